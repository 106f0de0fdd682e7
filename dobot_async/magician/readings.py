"""What a Magician says of itself, and whether it is still in the same run: switched off and on, it begins anew.

Its index goes back then, its clock too, and the alarm of a restart comes up.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from typing import Any, TypeVar, cast

from dobot_async.errors import MotionUnknown, ReplyTimeout
from dobot_async.link import Link
from dobot_async.magician import commands as c
from dobot_async.magician.alarms import Alarm, decode
from dobot_async.wire import Command

__all__ = ["GARBAGE", "SILENCE", "Readings"]

Q = TypeVar("Q")
R = TypeVar("R")
SILENCE = 5.0  # seconds without an answer after which the arm counts as lost, and what is under way as unknown
GARBAGE = 1 << 32  # an index so far beyond the last one is what some firmware shows while it moves
SAME_RUN = 0.95  # of the seconds that have passed, the arm's own clock has counted at least so many
STANDSTILL = 1.0  # seconds between two poses of an arm that shows nonsense for an index
RESTARTED = 0x00  # the alarm that an arm shows from power-up until it is cleared


class Readings:
    """Reads what repeating does no harm to.

    Args:
        link: The link.
        restarted: Called when the arm turns out to have been switched off and on, before MotionUnknown is raised.

    Attributes:
        completed: The highest index that is known to be finished, -1 before there is one.
    """

    def __init__(self, link: Link[Any], restarted: Callable[[], None]) -> None:
        self.completed = -1
        self._link = link
        self._on_restart = restarted
        self._now = asyncio.get_running_loop().time
        self._stood: c.Pose | None = None
        self._questioned_at = -math.inf
        self._restart_known = True
        self._uptime: tuple[float, float] | None = None

    async def ask(self, command: Command[Q, R], value: Q | None = None, *, urgent: bool = False) -> R:
        """Sends what may be repeated, however bad the line is; raises ReplyTimeout if the arm is silent to it."""
        for last in (False, False, True):
            try:
                return await self._link.request(command, cast(Q, value), timeout=SILENCE, urgent=urgent, lenient=True)
            except ReplyTimeout:
                if last or self._link.heard_at < self._now() - SILENCE:
                    raise

        raise AssertionError

    async def alarms(self) -> tuple[Alarm, ...]:
        """Reads the alarms; raises MotionUnknown if that of a restart has come up. Manual 2.5.1."""
        known, alarms = self._restart_known, decode(await self.ask(c.GET_ALARMS_STATE))
        self._restart_known = any(alarm.code == RESTARTED for alarm in alarms)
        if self._restart_known and not known:
            raise self._restarted()

        return alarms

    def alarms_cleared(self) -> None:
        """Takes note that the alarms were cleared: that of a restart can only come from a new one."""
        self._restart_known = False

    async def index(self, last: int | None) -> int | None:
        """Reads the index of the last finished command; None where firmware shows nonsense instead. Manual 2.19.7.

        Args:
            last: Of the last command that the arm is known to have taken, None if that is not known.
        """
        index = await self.ask(c.GET_QUEUED_CMD_CURRENT_INDEX)
        if last is not None and index > last + GARBAGE:
            await self._question()
            return None

        self._stood = None
        if index < self.completed:
            raise self._restarted()

        return index

    async def remember(self) -> None:
        """Notes the arm's clock, so that it can be told after an outage whether it was switched off. V1.1."""
        self._uptime = await self.ask(c.GET_DEVICE_TIME) / 1000, self._now()

    async def recognise(self, last: int | None) -> None:
        """Raises MotionUnknown if the arm was switched off and on since its clock was noted; `last` as for `index`."""
        await self.index(last)
        if self._uptime is None:
            return

        uptime, read_at = self._uptime
        await self.remember()
        if self._uptime[0] < uptime + SAME_RUN * (self._uptime[1] - read_at):
            raise self._restarted()

    async def _question(self) -> None:
        """Raises MotionUnknown if an arm that shows nonsense for an index stands still.

        What some firmware shows while it moves, all firmware shows from power-up until a command is finished.
        """
        if self._now() < self._questioned_at + STANDSTILL:
            return

        self._questioned_at = self._now()
        before, self._stood = self._stood, await self.ask(c.GET_POSE)
        if self._stood == before:
            raise self._restarted()

    def _restarted(self) -> MotionUnknown:
        self.completed = -1
        self._stood = None
        self._on_restart()
        return MotionUnknown("the arm was switched off and on: it counts its commands anew, and its queue is empty")
