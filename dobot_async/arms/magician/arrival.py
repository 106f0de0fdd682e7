"""The earliest time at which a motion can end, estimated from poses, so that its end is not polled before.

On the first half of its way it needs at least as long as it has needed so far, for it slows down as it has sped up; on
the second half, as long as at its present speed, for it only becomes slower. A jump goes two ways, one behind the
other: across, until it is above its target, and down. How long a look takes is measured: the longer, the earlier is the
last one.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Awaitable, Callable
from typing import Any

from dobot_async._core.queue.executor import Entry
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.reach import Destination, destination

__all__ = ["Approach"]

LOOK = 0.006  # seconds that a look may take: one that is not over before the end would come between it and its news
LONGER = 1.5  # times what the last look took, where that is more
NEAR = 0.018  # seconds before the end, or those of two looks: from then on no other look is worth it
EARLY = 0.003  # seconds before a look is due, from when on it is not worth waiting for
AGAIN = 0.1  # seconds after which an arm that should have arrived is looked at once more
STANDING = 0.02  # seconds between two looks at an arm that has not set off
ACROSS = 0.04  # seconds that a jump needs at least while it is not above its target: it has to go down as well
STEP = 0.01  # mm and degrees; one that has come less far stands
LEEWAY = 0.02  # seconds by which a WAIT may have begun earlier than it was seen to
PTP = (c.PTPCmd, c.PTPWithLCmd, c.PTPPOCmd, c.PTPPOWithLCmd)
JUMPS = {c.PTPMode.JUMP_XYZ, c.PTPMode.JUMP_MOVL_XYZ}


class Approach:
    """Watches the arm on its way to one destination after the other.

    Args:
        look: Reads the pose.
        clock: Returns seconds.
    """

    def __init__(self, look: Callable[[], Awaitable[c.Pose]], clock: Callable[[], float]) -> None:
        self._look = look
        self._clock = clock
        self._entry: Entry | None = None
        self._across: bool = False
        self._margin = LOOK
        self._target = Destination((0.0, 0.0, 0.0, 0.0))
        self._began_at: float | None = None
        self._looked_at = 0.0
        self._way = self._left = 0.0
        self._until: float | None = None
        self._again_at = 0.0

    async def remaining(self, entry: Entry) -> float | None:
        """Returns seconds within which a motion, the next one to end, cannot end; None where nothing tells."""
        now = self._clock()
        if isinstance(entry.value, c.WAITCmd):
            if entry is not self._entry:
                self._entry, self._until = entry, now + entry.value.timeout / 1000 - LEEWAY

            self._again_at = math.inf
        elif not isinstance(entry.value, PTP) or entry.value.ptp_mode is c.PTPMode.JUMP_ANGLE:
            return None
        elif entry is not self._entry or now >= self._again_at - EARLY:
            pose = await self._look()
            if entry is not self._entry:
                self._target = destination(entry.value) or increased(pose, entry.value)

            self._margin = max(LOOK, LONGER * (self._clock() - now))
            across: float = distance_across(entry.value, pose)
            self._estimate(entry, across or self._target.distance(pose), now, across=across > 0)

        return None if self._until is None else max(0.0, min(self._until, self._again_at) - self._clock())

    def _estimate(self, entry: Entry, left: float, now: float, *, across: bool) -> None:
        """Takes how far the arm had to go on this way, at `now` or a little later, and whether another way follows."""
        if entry is not self._entry or across is not self._across or left > self._way - STEP:
            self._entry, self._across, self._began_at, self._way = entry, across, None, left
            self._again_at = now + (ACROSS if across else STANDING)
            self._until = self._again_at if across else None
        else:
            self._began_at = now if self._began_at is None else self._began_at  # it cannot have begun later
            if left > self._way / 2:
                least = now - self._began_at
                again_at = max(now + self._margin, now + least - self._margin)
            else:
                gone = self._left - left
                least = left * (now - self._looked_at) / gone if gone > STEP else 0.0
                near = least < max(NEAR, 2 * self._margin)
                again_at = now + (2 * least + max(AGAIN, 2 * self._margin) if near else least - self._margin)

            self._until, self._again_at = now + least, again_at
            if across:
                self._until = self._again_at = now + max(least, ACROSS)

        self._looked_at, self._left = now, left


def distance_across(value: Any, pose: c.Pose) -> float:
    """How far a jump still has to go before it is above its target, mm; 0 for what goes straight to it."""
    if value.ptp_mode not in JUMPS:
        return 0.0

    across = math.hypot(value.x - pose.x, value.y - pose.y)
    return across if across >= STEP else 0.0


def increased(pose: c.Pose, value: Any) -> Destination:
    """Where increments lead from a pose."""
    joints = value.ptp_mode is c.PTPMode.MOVJ_INC
    here = (pose.j1, pose.j2, pose.j3, pose.j4) if joints else (pose.x, pose.y, pose.z, pose.r)
    x, y, z, r = map(operator.add, here, (value.x, value.y, value.z, value.r))
    return Destination((x, y, z, r), joints=joints)
