"""What is said to an arm of the myCobot family, and what it answers, as its model has it.

    ask    a read             --> the answer
    tell   a setting          --> acknowledged, or read back, or at least the arm is there
    send   a frame, once      --> whether it was acknowledged

Reads are answered. Commands are acknowledged by newer firmware only; whether one is, is learned once for each.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Awaitable, Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Any, Generic, TypeVar

from dobot_async._core.link.link import Link
from dobot_async._core.protocol.wire import Command, Layout
from dobot_async._core.util.arguments import check_timeout
from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.frame import Frame
from dobot_async.arms.mycobot.models import CobotModel, lengths
from dobot_async.errors import CommandRejected, ProtocolError, ReplyTimeout

__all__ = ["SILENCE", "Channel"]

Q = TypeVar("Q")
R = TypeVar("R")
UNSURE = 0.5  # seconds to wait for an acknowledgement of which nobody knows yet whether it comes
NEW = 0.3  # the same for the answer to a read that older firmware does not know
SILENCE = 5.0  # seconds without any answer after which what the arm does cannot be seen any more
LEAST = 0.1  # seconds for the last question of a call whose time is over
PATIENCE = 4  # reply timeouts that a call lasts at least
UNSUPPORTED = 2  # calls in a row without an answer, from an arm that answers other reads
OF_FRAMES = frozenset({c.SET_TOOL_REFERENCE, c.SET_WORLD_REFERENCE, c.SET_REFERENCE_FRAME, c.SET_END_TYPE})


class Unechoed(Generic[R]):
    """The layout of an answer, but for the bytes of its request."""

    def __init__(self, layout: Layout[R], request: bytes) -> None:
        self.encode: Callable[[R], bytes] = layout.encode
        self._layout = layout
        self._request = request

    def decode(self, data: bytes) -> R:
        """Decode an answer; refuse the request."""
        if data == self._request:
            raise ProtocolError("that is the request, sent back")

        return self._layout.decode(data)


class Channel:
    """One arm's link, in the words of its model.

    Args:
        link: The connection.
        model: What the arm is.
        acknowledges: Whether its firmware is thought to answer commands.
        patience: See below.

    Attributes:
        link: The connection.
        model: What the arm is.
        patience: Seconds for which an answer that was not lost may well be late.
        frames: How often this side has changed what coordinates are of, or count from.
    """

    def __init__(self, link: Link[Frame], model: CobotModel, *, acknowledges: bool, patience: float = 0.0) -> None:
        self.link = link
        self.model = model
        self._acknowledges = acknowledges
        self.patience = patience
        self._acknowledged: dict[Command[Any, Any], bool] = {}
        self._answered: set[Command[Any, Any]] = set()
        self._unanswered: Counter[Command[Any, Any]] = Counter()
        self._now = asyncio.get_running_loop().time
        self.frames: int = 0

    async def ask(self, command: Command[Q, R], value: Q, *, timeout: float | None = None) -> R:
        """Read something; raise as `Link.request` does.

        An M5 may send the request back before the answer. Where both may look alike, the answer is taken that does not,
        and the other one only if there is none.
        """
        row = self.model.row(command)
        data = row.request.encode(value)
        self.model.check(command, value)
        timeout = self._chosen(timeout, row.timeout)
        if data and len(data) in lengths(row.reply):
            timeout /= 2
            with suppress(ReplyTimeout, ProtocolError):
                return await self.link.request(replace(row, reply=Unechoed(row.reply, data)), value, timeout=timeout)

        return await self.link.request(row, value, timeout=timeout)

    async def poll(self, command: Command[Q, R], value: Q) -> R:
        """Read something of an arm at work; see `through_outages`."""
        return await self.through_outages(partial(self.ask, command, value, timeout=SILENCE))

    async def poll_if_known(self, command: Command[Q, R], value: Q) -> R | None:
        """Read something of an arm at work that older firmware does not know; see `ask_if_known`."""
        return await self.through_outages(partial(self.ask_if_known, command, value))

    async def through_outages(self, ask: Callable[[], Awaitable[R]]) -> R:
        """Do what may be done again, and again after each outage of a link that is reopened.

        Raises:
            ReplyTimeout: The arm was silent on a link that was open all the time.
        """
        while True:
            await self.link.opened()
            outages = self.link.outages
            try:
                return await ask()
            except ReplyTimeout:
                if self._unbroken(outages):
                    raise

    async def ask_if_known(self, command: Command[Q, R], value: Q, timeout: float | None = None) -> R | None:
        """Read something that older firmware does not know.

        Args:
            command: The row.
            value: Its parameters.
            timeout: Seconds in which the arm has to answer anything; 5 by default.

        Returns:
            The answer; None if the arm does not know the row, which is found out.

        Raises:
            ReplyTimeout: The arm is silent.
        """
        if not self.may_know(command):
            return None

        timeout = self._chosen(timeout, SILENCE)
        deadline = self._now() + timeout
        first = min(self.patient(NEW), timeout)
        try:
            answer = await self.ask(command, value, timeout=timeout if command in self._answered else first)
        except (ReplyTimeout, ProtocolError):
            try:
                await self.ask(c.IS_MOVING, None, timeout=self._left(deadline))
            except ReplyTimeout:
                silent = f"no answer to {command.name} from {self.link.url} within {timeout:.3g} s"
                raise ReplyTimeout(silent) from None

            self._unanswered[command] += 1
            return None

        self._answered.add(command)
        return answer

    def may_know(self, command: Command[Any, Any]) -> bool:
        """Return whether the arm answers a read, as far as is known yet."""
        return command in self._answered or self._unanswered[command] < UNSUPPORTED

    def likely_knows(self, command: Command[Any, Any]) -> bool:
        """Return whether the arm answers a read of later firmware, as far as is known.

        One that acknowledges nothing, though newer firmware of its model does, is older.
        """
        newer = self._acknowledges or not self.model.acknowledges
        return command in self._answered or (newer and self.may_know(command))

    async def tell(self, command: Command[Q, None], value: Q, *, timeout: float | None = None) -> bool:
        """Set something that may be said more than once.

        Returns:
            Whether it was acknowledged, or read back; else it may have been lost.

        Args:
            command: The row.
            value: Its parameters.
            timeout: Seconds; the row's own by default.

        Raises:
            ValueError: The parameters do not fit, or the connection only reads.
            ReplyTimeout: The arm does not answer.
            CommandRejected: It answers, and what was set reads otherwise.
        """
        row = self.model.row(command)
        frame = self.link.frame(row, value)
        self.model.check(command, value)
        self.frames += command in OF_FRAMES
        timeout = self._chosen(timeout, row.timeout)
        deadline = self._now() + timeout
        if self._acknowledged.get(command, self._acknowledges):
            sure = self._acknowledged.get(command, False)
            try:
                await self.link.request(row, value, timeout=timeout if sure else min(timeout, self.patient(UNSURE)))
            except ReplyTimeout:
                if sure:
                    raise

                await self.ask(c.IS_MOVING, None, timeout=self._left(deadline))
                self._silent(command)
            else:
                self._acknowledged[command] = True
                return True
        else:
            await self.send(frame, command, timeout)

        return await self._confirm(command, value, deadline, frame)

    async def send(self, frame: Frame, command: Command[Any, Any], timeout: float = SILENCE) -> bool:
        """Send a frame once.

        Args:
            frame: What is sent.
            command: Its row.
            timeout: Seconds for which the line may be busy, and the arm silent.

        Returns:
            Whether it was acknowledged. An acknowledgement that comes later than what was asked behind it is none.

        Raises:
            ReplyTimeout: The arm is silent on an open link, or the line takes no more bytes.
        """
        link = self.link
        await link.opened()
        outages = link.outages
        async with link.slot(command.name, timeout):
            try:
                expected = self._acknowledged.get(command, self._acknowledges)
                request = await link.send(frame, lambda _: None, timeout=timeout, expected=expected)
                if not expected:
                    return False

                if await link.settle(request, timeout):
                    self._acknowledged[command] = True
                    return True
            except TimeoutError as error:
                if self._unbroken(outages):
                    raise ReplyTimeout(f"no answer to {command.name} from {link.url} within {timeout:.3g} s") from error

        if self._unbroken(outages):
            self._silent(command)

        return False

    def patient(self, seconds: float) -> float:
        """Return seconds that are at least enough for an answer that is late."""
        return max(seconds, 2 * self.patience)

    def _unbroken(self, outages: int) -> bool:
        """Whether the link has been open all the time since it had so many outages."""
        return self.link.open and self.link.outages == outages

    def _left(self, deadline: float) -> float:
        """The seconds until a deadline, a few if it is over."""
        return max(deadline - self._now(), LEAST)

    def _silent(self, command: Command[Any, Any]) -> None:
        """A command was not acknowledged; if none ever was, this firmware acknowledges nothing."""
        self._acknowledged.setdefault(command, False)
        if not any(self._acknowledged.values()):
            self._acknowledges = False

    def _chosen(self, timeout: float | None, otherwise: float) -> float:
        """The seconds that were chosen, if any; else at least what several answers may take."""
        found = check_timeout(timeout)
        return max(otherwise, PATIENCE * self.patience) if found is None else found

    async def _confirm(self, command: Command[Q, None], value: Q, deadline: float, frame: Frame) -> bool:
        """Make sure that an arm which does not acknowledge was told: it is read back, or at least the arm is there."""
        read = c.CONFIRMED_BY.get(command)
        if read is None or not self.may_know(read):
            await self.ask(c.IS_MOVING, None, timeout=self._left(deadline))
            return False

        wanted = self.model.row(read).reply
        while (found := await self.ask_if_known(read, None, self._left(deadline))) is not None:
            if wanted.encode(found) == wanted.encode(value):
                return True

            if self._now() >= deadline:
                raise CommandRejected(f"{command.name} was sent with {value}, and the arm says {found}")

            await self.send(frame, command, self._left(deadline))

        return False
