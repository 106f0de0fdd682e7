"""How an ultraArm is asked one thing: errors in answers are raised, and a link that is reopened is waited for."""

from __future__ import annotations

from typing import Any, TypeVar, cast

from dobot_async._core.link.link import Link
from dobot_async._core.protocol.wire import Command
from dobot_async.arms.ultraarm.answers import Receipt, Refusal, with_errors
from dobot_async.arms.ultraarm.frame import Frame
from dobot_async.arms.ultraarm.status import SILENCE
from dobot_async.errors import CommandRejected, ProtocolError, ReplyTimeout

__all__ = ["Channel"]

Q = TypeVar("Q")
R = TypeVar("R")


class Channel:
    """Asks the arm.

    Args:
        link: The way to it.

    Attributes:
        link: The way to it.
    """

    def __init__(self, link: Link[Frame]) -> None:
        self.link = link

    async def ask(self, command: Command[Q, R], value: Q, *, timeout: float | None = None, urgent: bool = False) -> R:
        """Send one command, and return the arm's answer.

        Raises:
            CommandRejected: The arm answered with an error.
            DobotError: As `Link.request`.
        """
        answer = await self.link.request(with_errors(command), value, timeout=timeout, urgent=urgent)
        return cast(R, told(command, answer))

    async def read(self, command: Command[None, R], *, timeout: float = SILENCE, urgent: bool = False) -> R:
        """Read something, through outages of a link that is reopened; raise ReplyTimeout if the arm is silent."""
        while True:
            await self.link.opened()
            outages = self.link.outages
            try:
                return await self.ask(command, None, timeout=timeout, urgent=urgent)
            except ReplyTimeout:
                if self.link.open and self.link.outages == outages:
                    raise

    async def send(self, command: Command[Q, Any], value: Q) -> Receipt | None:
        """Send a command, once if it may not be repeated; return what the arm says to it, None if that was lost.

        Raises:
            CommandRejected: The arm answered with an error.
            ConnectionLost: The link is gone.
        """
        await self.link.opened()
        reply = with_errors(command).reply

        def accept(frame: Frame) -> Any:
            return reply.decode(frame.params)

        try:
            answer = await self.link.exchange(
                self.link.frame(command, value, queued=True),
                accept,
                name=command.name,
                timeout=SILENCE,
                repeatable=command.repeatable,
            )
        except (ReplyTimeout, ProtocolError):  # what came instead was somebody else's
            return None

        return cast(Receipt, told(command, answer))


def told(command: Command[Any, Any], answer: object) -> object:
    """Return an answer; raise CommandRejected for an error."""
    if isinstance(answer, Refusal):
        raise CommandRejected(f"the arm refused {command.name}: {answer.text}")

    return answer
