"""What is said to an arm of the myCobot family, and what it answers, as its model has it.

Reads are answered. Commands are acknowledged by newer firmware only, so `tell` takes an acknowledgement where there is
one; where there is none it reads back what was set, if that can be read, and else makes sure that the arm is there.
Whether a command is acknowledged is learned once for each.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from contextlib import suppress
from dataclasses import replace
from typing import Any, Generic, TypeVar

from dobot_async.errors import CommandRejected, ProtocolError, ReplyTimeout
from dobot_async.link import Link
from dobot_async.mycobot import commands as c
from dobot_async.mycobot.frame import Frame
from dobot_async.mycobot.models import CobotModel, lengths
from dobot_async.wire import Command, Layout

__all__ = ["Channel"]

Q = TypeVar("Q")
R = TypeVar("R")
BUSY = 2.0  # seconds that a motion waits for its turn on the link
UNSURE = 0.5  # seconds to wait for an acknowledgement of which nobody knows yet whether it comes
SILENCE = 5.0  # seconds without any answer after which the arm counts as lost
UNSUPPORTED = 2  # calls in a row without an answer, from an arm that answers other reads


class Unechoed(Generic[R]):
    """The layout of an answer, but for the bytes of its request."""

    def __init__(self, layout: Layout[R], request: bytes) -> None:
        self.encode = layout.encode
        self._layout = layout
        self._request = request

    def decode(self, data: bytes) -> R:
        """Decodes an answer; refuses the request."""
        if data == self._request:
            raise ProtocolError("that is the request, sent back")

        return self._layout.decode(data)


class Channel:
    """One arm's link, in the words of its model.

    Attributes:
        link: The connection.
        model: What the arm is.
    """

    def __init__(self, link: Link[Frame], model: CobotModel, *, acknowledges: bool) -> None:
        self.link = link
        self.model = model
        self._acknowledges = acknowledges
        self._acknowledged: dict[Command[Any, Any], bool] = {}
        self._answered: set[Command[Any, Any]] = set()
        self._unanswered: Counter[Command[Any, Any]] = Counter()

    async def ask(self, command: Command[Q, R], value: Q, *, timeout: float | None = None, urgent: bool = False) -> R:
        """Reads something; raises as `Link.request` does.

        An M5 may send the request back before the answer. Where both may look alike, the answer is taken that does not,
        and the other one only if there is none.
        """
        row = self.model.row(command)
        data = row.request.encode(value)
        if data and len(data) in lengths(row.reply):
            with suppress(ReplyTimeout, ProtocolError):
                other = replace(row, reply=Unechoed(row.reply, data))
                return await self.link.request(other, value, timeout=timeout, urgent=urgent)

        return await self.link.request(row, value, timeout=timeout, urgent=urgent)

    async def ask_if_known(self, command: Command[None, R], timeout: float) -> R | None:
        """Reads something that older firmware does not know; None if the arm does not, which is found out."""
        if not self.may_know(command):
            return None

        try:
            answer = await self.ask(command, None, timeout=timeout)
        except (ReplyTimeout, ProtocolError):
            await self.ask(c.IS_MOVING, None, timeout=SILENCE)
            self._unanswered[command] += 1
            return None

        self._answered.add(command)
        return answer

    def may_know(self, command: Command[None, Any]) -> bool:
        """Whether the arm answers a read, as far as is known yet."""
        return command in self._answered or self._unanswered[command] < UNSUPPORTED

    async def tell(self, command: Command[Q, None], value: Q, *, timeout: float | None = None) -> None:
        """Sets something that may be said more than once.

        Raises:
            ValueError: The parameters do not fit, or the connection only reads.
            ReplyTimeout: The arm does not answer.
            CommandRejected: It answers, and what was set reads otherwise.
        """
        row = self.model.row(command)
        frame = self.link.frame(row, value)
        timeout = row.timeout if timeout is None else timeout
        if self._acknowledged.get(command, self._acknowledges):
            sure = self._acknowledged.get(command, False)
            try:
                await self.link.request(row, value, timeout=timeout if sure else min(timeout, UNSURE))
            except ReplyTimeout:
                if sure:
                    raise

                await self.ask(c.IS_MOVING, None, timeout=timeout)
                self._silent(command)
            else:
                self._acknowledged[command] = True
                return
        else:
            await self.send(frame, command)

        await self._confirm(command, value, timeout, frame)

    async def send(self, frame: Frame, command: Command[Any, Any]) -> bool:
        """Sends a frame once, and returns whether it was acknowledged; a late acknowledgement is swallowed."""
        posted = await self.link.post(frame, lambda _: None, name=command.name, timeout=BUSY, tombstone=True)
        if not self._acknowledged.get(command, self._acknowledges):
            posted.forget()
            return False

        try:
            await posted.answer()
        except ReplyTimeout:
            self._silent(command)
            return False

        self._acknowledged[command] = True
        return True

    def _silent(self, command: Command[Any, Any]) -> None:
        """A command was not acknowledged; if none ever was, this firmware acknowledges nothing."""
        self._acknowledged.setdefault(command, False)
        if not any(self._acknowledged.values()):
            self._acknowledges = False

    async def _confirm(self, command: Command[Q, None], value: Q, timeout: float, frame: Frame) -> None:
        """Makes sure that an arm which does not acknowledge was told: it is read back, or at least the arm is there."""
        read = c.CONFIRMED_BY.get(command)
        if read is None or not self.may_know(read):
            await self.ask(c.IS_MOVING, None, timeout=timeout)
            return

        wanted = self.model.row(read).reply
        loop = asyncio.get_running_loop()
        deadline = loop.time() + timeout
        while (found := await self.ask_if_known(read, timeout)) is not None:
            if wanted.encode(found) == wanted.encode(value):
                return

            if loop.time() >= deadline:
                raise CommandRejected(f"{command.name} was sent with {value}, and the arm says {found}")

            await self.send(frame, command)
