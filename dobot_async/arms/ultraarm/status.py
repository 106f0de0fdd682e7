"""What an ultraArm shows of itself: polls, one after the other, and what they say together.

poll         M9 (M12), M120, M119, M114: does it move, its joints, how much waits, its switches, its place
rests        so many polls in a row at which it rests at the same place, with nothing waiting
ends_at      when it will be where it is to go, if it goes on as it does
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Awaitable, Callable
from dataclasses import replace
from typing import Any

from dobot_async._core.protocol.contract import LinkStats
from dobot_async._core.protocol.wire import Command
from dobot_async._core.queue.executor import alarmed
from dobot_async.arms.ultraarm import commands as c
from dobot_async.arms.ultraarm.answers import Status
from dobot_async.arms.ultraarm.frame import errors
from dobot_async.arms.ultraarm.goals import Goal, MotionFault, moved
from dobot_async.arms.ultraarm.layouts import Also
from dobot_async.errors import ProtocolError, ReplyTimeout

__all__ = ["PACE", "RESTS", "SILENCE", "STATUS_AND_ANGLES", "UltraArmPoller"]

SILENCE = 5.0  # seconds without an answer after which what the arm does cannot be seen any more
PACE = 0.02  # seconds between two polls of an arm that moves
DENSE = 0.003  # seconds between two polls at the least
RESTS = 2  # polls in a row at which it rests; one is enough behind one at which it moved, on a line that lost nothing
SETTLED = 0.2  # seconds of rest elsewhere than it was told to, after which an arm has missed its goal
SOON = 0.15  # seconds before the end of a motion from when on it is polled without a pause
STATUS_AND_ANGLES = replace(c.GET_STATUS, request=Also("M12"))


class UltraArmPoller:
    """See the module.

    Args:
        read: Reads a row, and raises ReplyTimeout if the arm is silent.
        stats: Returns what has happened on the line so far.

    Attributes:
        size: How many commands wait in the arm's queue, as far as is known.
        last: The last status; None if what came since may have changed it.
        rests: At how many polls in a row it has rested.
        rest_since: When it was first seen to rest.
        busy: Whether it was seen to move, or something to wait, since `begin`.
        set_out: Whether it was seen to move, or to stand otherwise than before, since `begin`.
    """

    def __init__(self, read: Callable[..., Awaitable[Any]], stats: Callable[[], LinkStats]) -> None:
        self.size: int = 0
        self.last: Status | None = None
        self.rests: int = 0
        self.rest_since: float = -math.inf
        self.busy: bool = False
        self.set_out: bool = False
        self._read = read
        self._stats = stats
        self._goal: Goal | None = None
        self._before: Status | None = None
        self._polled_at = self._rested_at = -math.inf
        self._moved = False
        self._distance: tuple[float, float] | None = None
        self._ends_at = math.inf

    @property
    def is_at_rest(self) -> bool:
        """Whether the arm rests, often enough."""
        return self.rests >= (1 if self._moved and self.is_in_order else RESTS)

    @property
    def is_in_order(self) -> bool:
        """Whether no answer was overdue so far: one that was may still come, and pass for one of now."""
        stats = self._stats()
        return not (stats.repeated or stats.timeouts or stats.unexpected)

    def begin(self, goal: Goal | None = None) -> None:
        """The arm has, or may have, something new to do."""
        self.rests = 0
        self.busy = self.set_out = self._moved = False
        self._before = self.last
        self._goal, self._distance, self._ends_at = goal, None, math.inf

    async def poll_paced(self) -> Status:
        """Poll, not too soon after the last time: with hardly a pause where the end of the motion is near.

        Raises:
            ReplyTimeout: The arm does not say.
            ArmAlarm: It tells of an error.
        """
        soon = self.rests or self.now() > self._ends_at - SOON
        pause = self._polled_at + (DENSE if soon else PACE) - self.now()
        if pause > 0:
            await asyncio.sleep(pause)

        status = await self.poll(STATUS_AND_ANGLES if self._goal and self._goal.needs_angles else c.GET_STATUS)
        if status.text and errors(status.text.encode()):
            raise alarmed([MotionFault(status.text)])

        return status

    async def poll(
        self, row: Command[None, Status] = STATUS_AND_ANGLES, *, timeout: float = SILENCE, urgent: bool = False
    ) -> Status:
        """Ask how far the arm is.

        Args:
            row: What asks for the status, and says something else with it.
            timeout: Seconds.
            urgent: It says what stops the arm.

        Raises:
            ReplyTimeout: The arm does not say.
        """
        try:
            status: Status = await self._read(row, timeout=timeout, urgent=urgent)
        except ProtocolError as error:
            raise ReplyTimeout(f"the arm does not say how far it is: {error}") from error

        now = self._polled_at = self.now()
        self.size = status.queue_size
        before, self.last = self.last, status
        self._expect(status)
        if not status.at_rest or status.queue_size:
            self.rests = 0
            self._moved = not status.at_rest
            self.busy = True
        elif not self.rests or now >= self._rested_at + PACE / 2:
            if not self.rests or (before and moved(before, status)):  # one of the two is not of now
                self.rests, self.rest_since = 0, now

            self._rested_at = now
            self.rests += 1

        self.set_out = self.set_out or not status.at_rest or (self._before is not None and moved(self._before, status))
        return status

    async def arrive(self, goal: Goal, tolerance: float) -> MotionFault | None:
        """Return when the arm rests at a goal, or elsewhere: then what is wrong."""
        while True:
            status = await self.poll_paced()
            if not self.is_at_rest:
                continue

            if goal.reached(status, tolerance, set_out=self.set_out):
                return None

            if self.now() >= self.rest_since + SETTLED and self.rests >= RESTS:
                return goal.missed(status, set_out=self.set_out)

    async def has_begun(self, goal: Goal, before: Status | None, tolerance: float) -> bool:
        """Return whether an arm that has not acknowledged a motion does it, or has done it."""
        while True:
            status = await self.poll_paced()
            if self.busy:
                return True

            if self.rests >= RESTS:
                return goal.come_to(before, status, tolerance)

    def now(self) -> float:
        """Return the loop's time, seconds."""
        return asyncio.get_running_loop().time()

    def _expect(self, status: Status) -> None:
        """Note when the arm will be where it is to go, if it goes on as it does."""
        distance = self._goal.distance(status) if self._goal else None
        if distance is None:
            return

        now = self.now()
        if self._distance and now > self._distance[0]:
            speed = (self._distance[1] - distance) / (now - self._distance[0])
            self._ends_at = now + distance / speed if speed > 0 else math.inf

        self._distance = now, distance
