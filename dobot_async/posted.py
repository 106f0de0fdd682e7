"""A queued command on its way: sent, and not answered yet."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from functools import partial
from typing import Any, Generic, Protocol, TypeVar

from dobot_async.errors import ReplyTimeout
from dobot_async.pending import Waiter
from dobot_async.roundtrip import RoundTrip

__all__ = ["Posted", "deliver"]

R = TypeVar("R")


class Sender(Protocol):
    """The link that it went over."""

    def overdue(self) -> None:
        """Takes note that no answer came in time."""

    def answer(self, reply: asyncio.Future[R]) -> R:
        """Returns what was delivered, or raises what ended the link."""


class Posted(Generic[R]):
    """A queued command that was sent and is not answered yet."""

    def __init__(
        self,
        link: Sender,
        name: str,
        waiter: Waiter[Any],
        round_trip: RoundTrip,
        give_turn: Callable[[], None] | None,
    ) -> None:
        self._link = link
        self._round_trip = round_trip
        self._name = name
        self._waiter = waiter.__enter__()
        self._give_turn = give_turn
        self._reply: asyncio.Future[R] = asyncio.get_running_loop().create_future()
        waiter.listen(partial(deliver, self._reply))

    async def answer(self) -> R:
        """Returns what `accept` made of the answer.

        Raises:
            ReplyTimeout: No answer came within the link's own timeout.
            ConnectionLost: The link is gone.
        """
        try:
            if not self._reply.done():
                async with asyncio.timeout(self._round_trip.timeout):
                    await self._reply
        except TimeoutError:
            if not self._reply.done() or self._reply.cancelled():
                self._link.overdue()
                raise ReplyTimeout(f"{self._name} was not acknowledged") from None
        finally:
            self.forget()

        self._round_trip.sample(asyncio.get_running_loop().time() - self.sent_at)
        return self._link.answer(self._reply)

    @property
    def done(self) -> bool:
        """Whether its answer has come."""
        return self._reply.done()

    @property
    def sent_at(self) -> float:
        """When it was sent, in the loop's seconds."""
        return self._waiter.sends[0]

    def answer_with(self, value: R) -> None:
        """Ends the waiting with a value, if no answer has come: none will."""
        deliver(self._reply, value)
        self.forget()

    def forget(self) -> None:
        """Stops waiting; may be called again."""
        self._waiter.__exit__()
        give_turn, self._give_turn = self._give_turn, None
        if give_turn:
            give_turn()


def deliver(reply: asyncio.Future[Any], value: Any) -> None:
    """Sets a future that its waiter may have given up already."""
    if not reply.done():
        reply.set_result(value)
