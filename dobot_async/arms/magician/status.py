"""What a Magician says of itself, and whether it is still in the same run: switched off and on, it begins anew.

Its clock counts the ms since power-up. If that has not gone on with ours, the arm was switched off in between. It is
compared whenever the arm does not get on for a second, before what became of a command is concluded, and after an
outage of the link. The index that goes back, and the alarm of a restart, tell the same.
"""

from __future__ import annotations

import asyncio
import logging
import math
from collections.abc import Callable
from typing import NamedTuple, TypeVar, cast

from dobot_async._core.link.link import Link
from dobot_async._core.protocol.wire import Command
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.alarms import Alarm, decode
from dobot_async.arms.magician.frame import Frame
from dobot_async.errors import MotionUnknown, ReplyTimeout

__all__ = ["GARBAGE", "SILENCE", "ArmStatus"]

Q = TypeVar("Q")
R = TypeVar("R")
logger: logging.Logger = logging.getLogger("dobot_async.queue")
SILENCE = 5.0  # seconds without an answer after which what the arm does cannot be seen any more
GARBAGE = 1 << 32  # an index so far beyond the last one is what some firmware shows while it moves
CHECK = 1.0  # seconds without progress after which the arm's clock is compared
RESTARTED = 0x00  # the alarm that an arm shows from power-up until it is cleared
WRAP = 1 << 32  # ms, after which the arm's clock begins again: 49.7 days
DRIFT = 0.05  # of the time that has passed, by which the arm's clock may differ from ours


class StatusReading(NamedTuple):
    """What the arm's clock said, in ms, and when it was asked and answered, in seconds of ours."""

    clock: int
    asked_at: float
    answered_at: float


class ArmStatus:
    """Reads what may be read again and again.

    Args:
        link: The link.
        restarted: Called when the arm turns out to have been switched off and on, before MotionUnknown is raised.

    Attributes:
        completed: The highest index that is known to be finished, -1 before there is one.
        restarts: How often the arm was seen to have been switched off and on.
    """

    def __init__(self, link: Link[Frame], restarted: Callable[[], None]) -> None:
        self.completed: int = -1
        self.restarts: int = 0
        self._link = link
        self._on_restart = restarted
        self._now = asyncio.get_running_loop().time
        self._restart_known = True
        self._reading: StatusReading | None = None
        self._clockless = False
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

    async def index(self, highest: int | None) -> int | None:
        """Read the index of the last finished command; None where firmware shows nonsense instead. Manual 2.19.7.

        Args:
            highest: The highest index that a command can have got, None if that is not known.
        """
        index = await self.ask(c.GET_QUEUED_CMD_CURRENT_INDEX)
        # On a link that doubles commands, some have an index above the highest.
        margin = GARBAGE if self._link.reorder_window else 0
        nonsense = highest is not None and index > highest + margin
        if self._reading and (nonsense or index <= self.completed) and self._now() > self._reading.answered_at + CHECK:
            await self.check_run()

        if index < self.completed:
            # Twice: a single answer may have come late, out of its turn.
            index = await self.ask(c.GET_QUEUED_CMD_CURRENT_INDEX)
            if index < self.completed:
                raise self.restarted()

        return None if nonsense else index

    async def remember(self) -> None:
        """Note the arm's clock, to compare it later; old firmware has none. V1.1."""
        asked_at = self._now()
        try:
            await self._read_clock(None)
        except ReplyTimeout:
            if self._link.heard_at < asked_at:
                raise

            self._clockless = True
            logger.warning("%s does not tell its clock; that it was switched off and on may go unseen", self._link.url)

    async def check_run(self) -> None:
        """Raise MotionUnknown if the arm was switched off and on since its clock was read last. V1.1."""
        before = self._reading
        if before is None:
            return

        for _ in range(2):  # a single answer may have come late, out of its turn
            await self._link.opened()
            if is_same_run(before, await self._read_clock(SILENCE)):
                return

        raise self.restarted()

    async def check_idle(self) -> None:
        """Raise MotionUnknown if an idle arm was switched off and on; note its clock the first time. V1.1."""
        if self._reading is None and not self._clockless:
            await self.remember()
        else:
            await self.check_run()

    async def check_outage(self, highest: int | None) -> None:
        """After an outage of the link, raise MotionUnknown if the arm was switched off meanwhile."""
        await self._link.opened()
        if self._outages == self._link.outages:
            return

        outages = self._link.outages
        await self.index(highest)
        await self.check_run()
        self._outages = outages

    def restarted(self) -> MotionUnknown:
        """Note that the arm was switched off and on; return what to raise."""
        self.completed = -1
        self.restarts += 1
        self._reading = None
        self._outages = self._link.outages
        self._on_restart()
        return MotionUnknown("the arm was switched off and on: it counts its commands anew, and its queue is empty")

    async def _read_clock(self, timeout: float | None) -> StatusReading:
        asked_at = self._now()
        clock = await self._link.request(c.GET_DEVICE_TIME, None, timeout=timeout)
        self._reading = StatusReading(clock, asked_at, self._now())
        return self._reading


def is_same_run(before: StatusReading, after: StatusReading) -> bool:
    """Return whether the arm's clock has counted, modulo its size, what has passed between two readings."""
    least = int(1000 * (1 - DRIFT) * (after.asked_at - before.answered_at))  # it counts whole ms
    most = math.ceil(1000 * (1 + DRIFT) * (after.answered_at - before.asked_at))
    return (after.clock - before.clock - least) % WRAP <= most - least + 1
