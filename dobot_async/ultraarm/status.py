"""What an ultraArm shows of itself: polls, one after the other, and what they say together.

poll         M9, M120, M119 (M12), M114: does it move, how much waits, where is it?
is_at_rest   so many polls in a row at which it rests, with nothing waiting
ends_at      when it will be where it is to go, if it goes on as it does
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Awaitable, Callable
from dataclasses import replace
from typing import Any

from dobot_async.errors import ProtocolError, ReplyTimeout
from dobot_async.ultraarm import commands as c
from dobot_async.ultraarm.answers import Status
from dobot_async.ultraarm.layouts import Also
from dobot_async.ultraarm.ledger import QueueLedger
from dobot_async.wire import Command

__all__ = ["PACE", "RESTS", "SILENCE", "StatusPoller"]

SILENCE = 5.0  # seconds without an answer after which what the arm does cannot be seen any more
PACE = 0.02  # seconds between two polls of an arm that moves
RESTS = 2  # polls in a row at which it rests: between two motions it may show so once; not behind the only one
SOON = 0.15  # seconds before the end of a motion from when on it is polled without a pause
TELLING = 0.1  # seconds that an arm waits and looks busy, after which it is known that it does so
STATUS_AND_ANGLES = replace(c.GET_STATUS, request=Also("M12"))


class StatusPoller:
    """See the module.

    Args:
        read: Reads a row, and raises ReplyTimeout if the arm is silent.
        ledger: What the arm was given.

    Attributes:
        size: How many commands wait in the arm's queue, as far as is known.
        rests: At how many polls in a row it has rested.
        rest_since: When it was first seen to rest.
    """

    def __init__(self, read: Callable[..., Awaitable[Any]], ledger: QueueLedger) -> None:
        self.size: int | None = None
        self.rests = 0
        self.rest_since = -math.inf
        self._read = read
        self._ledger = ledger
        self._polled_at = self._rested_at = self._given_at = -math.inf
        self._moved = False
        self._tells_dwell = False
        self._distance: tuple[float, float] | None = None
        self._ends_at = math.inf

    @property
    def is_at_rest(self) -> bool:
        """Whether the arm rests for good: often enough, and longer than it may have been told to wait."""
        enough = 1 if self._moved and self._ledger.alone else RESTS
        dwell = 0.0 if self._tells_dwell else self._ledger.dwell
        return self.rests >= enough and self.now() >= self.rest_since + dwell

    def begin(self) -> None:
        """The arm has, or may have, something new to do."""
        self.rests = 0
        self._moved = False
        self._given_at = self.now()

    async def poll_paced(self) -> Status:
        """Poll, not too soon after the last time: without a pause where the end of the motion is near."""
        soon = self.rests or self.now() > self._ends_at - SOON
        if not soon and (pause := self._polled_at + PACE - self.now()) > 0:
            await asyncio.sleep(pause)

        return await self.poll()

    async def poll(
        self, row: Command[None, Status] | None = None, *, timeout: float = SILENCE, urgent: bool = False
    ) -> Status:
        """Ask how far the arm is.

        Args:
            row: What asks for the status, and says something else with it.
            timeout: Seconds.
            urgent: It says what stops the arm.

        Raises:
            ReplyTimeout: The arm does not say.
        """
        target = self._ledger.target
        row = row or (STATUS_AND_ANGLES if target and target.joints else c.GET_STATUS)
        try:
            status: Status = await self._read(row, timeout=timeout, urgent=urgent)
        except ProtocolError as error:
            raise ReplyTimeout(f"the arm does not say how far it is: {error}") from error

        now = self._polled_at = self.now()
        self.size = status.queue_size
        self._expect(status)
        if not status.at_rest or status.queue_size:
            self.rests = 0
            self._moved = not status.at_rest and self._ledger.alone
            waits = len(self._ledger.open) == 1 and self._ledger.open[0].entry.command is c.WAIT
            self._tells_dwell = self._tells_dwell or (waits and now > self._given_at + TELLING)
        elif now >= self._rested_at + PACE / 2:
            self._rested_at = now
            self.rest_since = self.rest_since if self.rests else now
            self.rests += 1

        return status

    def now(self) -> float:
        """Return the loop's time, seconds."""
        return asyncio.get_running_loop().time()

    def _expect(self, status: Status) -> None:
        """Note when the arm will be where it is to go, if it goes on as it does."""
        target = self._ledger.target
        here = target.position(status) if target else None
        if target is None or here is None:
            self._distance, self._ends_at = None, math.inf
            return

        now, distance = self.now(), target.distance(here)
        if self._distance and now > self._distance[0]:
            speed = (self._distance[1] - distance) / (now - self._distance[0])
            self._ends_at = now + distance / speed if speed > 0 else math.inf

        self._distance = now, distance
