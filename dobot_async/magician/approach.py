"""How long the arm needs yet for a motion, judged by where it is: so that it need not be asked for its end before.

On the first half of its way it needs at least as long as it has needed so far, for it slows down as it has sped up; on
the second half, as long as at its present speed, for it only becomes slower.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable

from dobot_async._core.queue.executor import Entry
from dobot_async.magician import commands as c
from dobot_async.magician.reach import Destination, destination

__all__ = ["Approach"]

NEAR = 0.012  # seconds before the end; from then on another look at the pose would only be in the way
AGAIN = 0.1  # seconds after which an arm that should have arrived is looked at once more
STANDING = 0.02  # seconds between two looks at an arm that has not set off
STEP = 0.01  # mm and degrees; one that has come less far stands
DETOURS = {c.PTPMode.JUMP_XYZ, c.PTPMode.JUMP_ANGLE, c.PTPMode.JUMP_MOVL_XYZ}


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
        self._began_at: float | None = None
        self._looked_at = 0.0
        self._way = self._left = 0.0
        self._until: float | None = None
        self._again_at = 0.0

    async def remaining(self, entry: Entry) -> float | None:
        """Returns seconds within which a motion, the next one to end, cannot end; None where nothing tells."""
        target = straight(entry)
        if target is None:
            return None

        if entry is not self._entry or self._clock() >= self._again_at:
            self._estimate(entry, target.distance(await self._look()))

        return None if self._until is None else max(0.0, self._until - self._clock())

    def _estimate(self, entry: Entry, left: float) -> None:
        """Takes how far the arm still has to go."""
        now = self._clock()
        if entry is not self._entry or left > self._way - STEP:
            self._entry, self._began_at, self._way = entry, None, left
            self._until, self._again_at = None, now + STANDING
        elif left > self._way / 2:
            self._began_at = now if self._began_at is None else self._began_at  # it cannot have begun later
            least = now - self._began_at
            self._until, self._again_at = now + least, now + least / 2
        else:
            gone = self._left - left
            least = left * (now - self._looked_at) / gone if gone > STEP else 0.0
            self._until, self._again_at = now + least, now + (AGAIN if least < NEAR else least / 2)

        self._looked_at, self._left = now, left


def straight(entry: Entry) -> Destination | None:
    """Where a motion leads that takes no detour."""
    return None if getattr(entry.value, "ptp_mode", None) in DETOURS else destination(entry.value)
