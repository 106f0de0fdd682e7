"""What a Magician says of itself, and whether it is still in the same run: switched off and on, it begins anew.

Its index goes back then, its clock too, and the alarm of a restart comes up.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Awaitable, Callable
from typing import Any, TypeVar, cast

from dobot_async._core.link.link import Link
from dobot_async.errors import MotionUnknown, ReplyTimeout
from dobot_async.magician import commands as c
from dobot_async.magician.alarms import Alarm, decode
from dobot_async.wire import Command

__all__ = ["GARBAGE", "SILENCE", "ArmStatus"]

Q = TypeVar("Q")
R = TypeVar("R")
SILENCE = 5.0  # seconds without an answer after which what the arm does cannot be seen any more
GARBAGE = 1 << 32  # an index so far beyond the last one is what some firmware shows while it moves
STANDSTILL = 1.0  # seconds between two poses of an arm that shows nonsense for an index
RESTARTED = 0x00  # the alarm that an arm shows from power-up until it is cleared
WRAP = 1 << 32  # ms, after which the arm's clock begins again: 49.7 days
SAME_RUN = 0.95  # of the seconds that have passed, the arm's own clock has counted at least so many


class ArmStatus:
    """Reads what may be read again and again.

    Args:
        link: The link.
        restarted: Called when the arm turns out to have been switched off and on, before MotionUnknown is raised.
        is_gone: Tells whether the arm's queue is empty although it should not be.

    Attributes:
        completed: The highest index that is known to be finished, -1 before there is one.
    """

    def __init__(
        self, link: Link[Any], restarted: Callable[[], None], is_gone: Callable[[int], Awaitable[bool]]
    ) -> None:
        self.completed = -1
        self._is_gone = is_gone
        self._link = link
        self._on_restart = restarted
        self._now = asyncio.get_running_loop().time
        self._stood: c.Pose | None = None
        self._checked_at = -math.inf
        self._restart_known = True
        self._clock: tuple[int, float, float] | None = None  # ms, asked at, answered at
        self._outages = 0

    async def ask(self, command: Command[Q, R], value: Q | None = None) -> R:
        """Read something, through outages of a link that is reopened; raise ReplyTimeout if the arm is silent."""
        for last in (False, False, True):
            await self._link.opened()
            asked_at = self._now()
            try:
                return await self._link.request(command, cast(Q, value), timeout=SILENCE)
            except ReplyTimeout:
                if last or (self._link.open and self._link.heard_at <= asked_at):
                    raise

        raise AssertionError

    async def alarms(self) -> tuple[Alarm, ...]:
        """Read the alarms; raise MotionUnknown if that of a restart has come up. Manual 2.5.1."""
        known, alarms = self._restart_known, decode(await self.ask(c.GET_ALARMS_STATE))
        self._restart_known = any(alarm.code == RESTARTED for alarm in alarms)
        if self._restart_known and not known:
            raise self.restarted()

        return alarms

    def alarms_cleared(self) -> None:
        """Take note that the alarms were cleared: that of a restart can only come from a new one."""
        self._restart_known = False

    def queue_cleared(self) -> None:
        """Take note that the queue is emptied: an arm that has nothing to do may well stand still."""
        self._stood = None

    async def index(self, highest: int | None) -> int | None:
        """Read the index of the last finished command; None where firmware shows nonsense instead. Manual 2.19.7.

        Args:
            highest: The highest index that a command can have got, None if that is not known.
        """
        index = await self.ask(c.GET_QUEUED_CMD_CURRENT_INDEX)
        if highest is not None and self._is_nonsense(index, highest):
            await self._check_standstill(highest)
            return None

        self._stood = None
        if index < self.completed:
            # Twice: a single answer may have come late, out of its turn.
            index = await self.ask(c.GET_QUEUED_CMD_CURRENT_INDEX)
            if index < self.completed:
                raise self.restarted()

        return index

    async def remember(self) -> None:
        """Note the arm's clock, so that it can be told after an outage whether it was switched off. V1.1."""
        asked_at = self._now()
        self._clock = await self.ask(c.GET_DEVICE_TIME), asked_at, self._now()

    async def check_outage(self, highest: int | None) -> None:
        """After an outage of the link, raise MotionUnknown if the arm was switched off meanwhile."""
        await self._link.opened()
        if self._outages == self._link.outages:
            return

        outages = self._link.outages
        await self.index(highest)
        if self._clock:
            before, _, answered_at = self._clock
            await self.remember()
            passed = (self._clock[0] - before + WRAP // 2) % WRAP - WRAP // 2
            if passed < int(SAME_RUN * 1000 * (self._clock[1] - answered_at)):  # it counts whole ms
                raise self.restarted()

        self._outages = outages

    async def _check_standstill(self, highest: int) -> None:
        """Raise MotionUnknown if an arm with nonsense for an index stands still, and its queue has lost its commands.

        What some firmware shows while it moves, all firmware shows from power-up until a command is finished.
        """
        if self._now() < self._checked_at + STANDSTILL:
            return

        self._checked_at = self._now()
        before, self._stood = self._stood, await self.ask(c.GET_POSE)
        if self._stood != before or not await self._is_gone(highest):
            return

        # It may have been paused, and have gone on meanwhile: then it has an index now.
        index = await self.ask(c.GET_QUEUED_CMD_CURRENT_INDEX)
        if self._is_nonsense(index, highest) and self._stood:
            raise self.restarted()

    def _is_nonsense(self, index: int, highest: int) -> bool:
        """Whether no command can have an index; on a link that doubles some have one above the highest."""
        return index > highest + (GARBAGE if self._link.reorder_window else 0)

    def restarted(self) -> MotionUnknown:
        """Note that the arm was switched off and on; return what to raise."""
        self.completed = -1
        self._stood = None
        self._outages = self._link.outages
        self._on_restart()
        return MotionUnknown("the arm was switched off and on: it counts its commands anew, and its queue is empty")
