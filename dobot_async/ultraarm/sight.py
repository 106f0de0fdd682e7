"""What an ultraArm shows of itself: looks at it, one after the other, and what they say together.

look --> M9, M120, M119 (M12), M114: does it move, how much waits, where is it?
rests    so many looks in a row at which it rests, with nothing waiting
ends_at  when it will be where it is to go, if it goes on as it does
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Awaitable, Callable
from dataclasses import replace
from typing import Any

from dobot_async.errors import ProtocolError, ReplyTimeout
from dobot_async.ultraarm import commands as c
from dobot_async.ultraarm.books import Books
from dobot_async.ultraarm.layouts import AND_ANGLES, Status

__all__ = ["PACE", "RESTS", "SILENCE", "Sight"]

SILENCE = 5.0  # seconds without an answer after which the arm counts as lost, and what is under way as unknown
PACE = 0.02  # seconds between two looks at an arm that moves
RESTS = 2  # looks in a row at which it rests: between two motions it may look so once; not behind the only one
SOON = 0.15  # seconds before the end of a motion from when on it is looked at without a pause
TELLING = 0.1  # seconds that an arm waits and looks busy, after which it is known that it does so
STATUS_AND_ANGLES = replace(c.GET_STATUS, request=AND_ANGLES)


class Sight:
    """See the module.

    Attributes:
        size: How many commands wait in the arm's queue, as far as is known.
        rests: At how many looks in a row it has rested.
        rest_since: When it was first seen to rest.
    """

    def __init__(self, ask: Callable[..., Awaitable[Any]], books: Books) -> None:
        self.size: int | None = None
        self.rests = 0
        self.rest_since = -math.inf
        self._ask = ask
        self._books = books
        self._looked_at = self._rested_at = self._given_at = -math.inf
        self._moved = False
        self._tells_dwell = False
        self._distance: tuple[float, float] | None = None
        self._ends_at = math.inf

    @property
    def done(self) -> bool:
        """Whether the arm rests for good: often enough, and longer than it may have been told to wait."""
        enough = 1 if self._moved and self._books.alone else RESTS
        dwell = 0.0 if self._tells_dwell else self._books.dwell
        return self.rests >= enough and self.now() >= self.rest_since + dwell

    def given(self) -> None:
        """The arm has something new to do."""
        self.rests = 0
        self._moved = False
        self._given_at = self.now()

    async def next(self) -> Status:
        """Looks, not too soon after the last time: without a pause where the end of the motion is near."""
        soon = self.rests or self.now() > self._ends_at - SOON
        if not soon and (pause := self._looked_at + PACE - self.now()) > 0:
            await asyncio.sleep(pause)

        return await self.look()

    async def look(self, *, urgent: bool = False) -> Status:
        """Asks how far the arm is; raises ReplyTimeout if it does not say."""
        target = self._books.target
        row = STATUS_AND_ANGLES if target and target.joints else c.GET_STATUS
        try:
            status: Status = await self._ask(row, None, timeout=SILENCE, urgent=urgent)
        except ProtocolError as error:
            raise ReplyTimeout(f"the arm does not say how far it is: {error}") from error

        now = self._looked_at = self.now()
        self.size = status.queue_size
        self._expect(status)
        if not status.at_rest or status.queue_size:
            self.rests = 0
            self._moved = not status.at_rest and self._books.alone
            waits = len(self._books.open) == 1 and self._books.open[0].entry.command is c.WAIT
            self._tells_dwell = self._tells_dwell or (waits and now > self._given_at + TELLING)
        elif now >= self._rested_at + PACE / 2:
            self._rested_at = now
            self.rest_since = self.rest_since if self.rests else now
            self.rests += 1

        return status

    async def comes_to_rest(self, looks: int) -> bool:
        """Whether the arm rests and has nothing more to do, within so many looks."""
        self.rests = 0
        for _ in range(looks):
            await self.look(urgent=True)
            if self.rests >= RESTS:
                return True

            await asyncio.sleep(PACE)

        return False

    def now(self) -> float:
        """The time, seconds."""
        return asyncio.get_running_loop().time()

    def _expect(self, status: Status) -> None:
        """Notes when the arm will be where it is to go, if it goes on as it does."""
        target = self._books.target
        here = target.told(status) if target else None
        if target is None or here is None:
            self._distance, self._ends_at = None, math.inf
            return

        now, distance = self.now(), target.miss(here)
        if self._distance and now > self._distance[0]:
            speed = (self._distance[1] - distance) / (now - self._distance[0])
            self._ends_at = now + distance / speed if speed > 0 else math.inf

        self._distance = now, distance
