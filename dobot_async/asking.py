"""A question and its own answer: asked again while none comes, and told apart from the answers that others are owed.

    owed answers of its key?   ask something else first: what is not there when that is answered was lost    (fence)
    a straggler may come?      ask something else behind it: one answer by then is the right one             (proof)
    neither                    ask

`dobot_async.pending` says why.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Hashable, Sequence
from contextlib import suppress
from functools import partial
from typing import Any, Generic, Protocol, TypeVar

from dobot_async.contract import Frame, LinkStats
from dobot_async.errors import ProtocolError, ReplyTimeout
from dobot_async.pending import SWALLOWED, Pending, Waiter
from dobot_async.posted import Sender, deliver
from dobot_async.roundtrip import RoundTrip

__all__ = ["Asking"]

F = TypeVar("F", bound=Frame)
LEAST_PATIENCE = 0.001  # seconds; nobody answers a request for which less is left
OVERDUE = object()
"""Delivered instead of a reply when its time is up."""


class Line(Sender, Protocol):
    """The link that is asked over."""

    @property
    def disorder(self) -> float:
        """Seconds within which messages may overtake one another, and a doubled one arrive again."""

    @property
    def open(self) -> bool:
        """Whether it is open just now."""

    async def opened(self) -> None:
        """Returns when it is."""

    def too_late(self, name: str, timeout: float) -> ReplyTimeout:
        """What to raise if no answer has come."""


class Asking(Generic[F]):
    """How one link asks.

    Args:
        link: The link.
        pending: Who waits on it.
        round_trip: How long its answers take.
        stats: Where to count.
        send: Sends a frame, and says when it goes out; raises TimeoutError if that cannot be within so many seconds.
        resync: Gives up a frame the rest of which is overdue, and delivers what was inside of it.
        fences: Questions that harm nobody.
    """

    def __init__(
        self,
        link: Line,
        pending: Pending[F],
        round_trip: RoundTrip,
        stats: LinkStats,
        *,
        send: Callable[[F, float | None, Callable[[], None]], Awaitable[None]],
        resync: Callable[[], None],
        fences: Sequence[F],
    ) -> None:
        self._link = link
        self._pending = pending
        self._round_trip = round_trip
        self._stats = stats
        self._send = send
        self._resync = resync
        self._fences = fences
        self._loop = asyncio.get_running_loop()

    async def exchange(
        self, frame: F, waiter: Waiter[F], name: str, timeout: float, *, urgent: bool, ready: Callable[[], None]
    ) -> Any:
        """Sends a frame, again and again if that is harmless, and returns what its waiter makes of the answer."""
        deadline = self._loop.time() + timeout
        overdue = False
        with waiter:
            while (left := deadline - self._loop.time()) > LEAST_PATIENCE:
                if not await self._ready(waiter, left, urgent=urgent):
                    break

                if not waiter.sends:
                    ready()

                reply = self._listen(waiter, resync=bool(waiter.sends))
                patience = min(left, self._round_trip.timeout) if waiter.repeatable else left
                if not await self._ask(frame, waiter, reply, patience):
                    overdue = True
                elif reply.result() is not SWALLOWED:
                    self._measure(waiter.sends, overdue=overdue)
                    return self._link.answer(reply)

            reply = self._listen(waiter, resync=True)
            if reply.done() and reply.result() is not SWALLOWED:
                return self._link.answer(reply)

        if waiter.misfit:
            raise ProtocolError(f"{name}: the arm's answer does not fit: {waiter.misfit}")

        self._stats.timeouts += 1
        raise self._link.too_late(name, timeout)

    def _measure(self, sends: list[float], *, overdue: bool) -> None:
        """Learns from a call that is answered now how long answers take."""
        now = self._loop.time()
        if len(sends) == 1:
            self._round_trip.sample(now - sends[0])
        else:
            self._round_trip.probably(now - sends[-2] if overdue else 0.0)

    async def _ready(self, waiter: Waiter[F], seconds: float, *, urgent: bool) -> bool:
        """Returns when a request may be sent, so that its answer is known from others; False if that is too late."""
        key, urgent = waiter.key, urgent and not waiter.sends
        owed = None if urgent else self._pending.owed(key, but=waiter)
        if self._link.open and (urgent or (owed is None and not self._link.disorder)):
            return True

        with suppress(TimeoutError):
            async with asyncio.timeout(seconds):
                await self._link.opened()
                if owed is not None:
                    waiter.fenced = await self._fence(key, owed)

                if not urgent:
                    await self._calm(key)

                return True

        return False

    async def _fence(self, key: Hashable, owed: float) -> bool:
        """Asks something else, if it can: what is owed and not there when that is answered was lost."""
        frame = self._other(key)
        if frame is None:
            return False

        await self._calm(frame.key)
        if self._link.disorder:
            await asyncio.sleep(owed + self._link.disorder - self._loop.time())

        answered: asyncio.Future[Any] = self._loop.create_future()
        with self._pending.expect(frame.key, lambda _: None) as waiter, suppress(TimeoutError):
            waiter.listen(partial(deliver, answered))
            await self._send(frame, None, waiter.sent)
            if self._link.disorder:  # on a stream nothing overtakes it
                async with asyncio.timeout(self._round_trip.timeout):
                    await answered

        await asyncio.sleep(self._link.disorder)
        return True

    async def _calm(self, key: Hashable) -> None:
        """Returns when no second answer to a request of this key can arrive: it would pass for the next one's."""
        if self._link.disorder:
            await asyncio.sleep(self._pending.calm_at(key) - self._loop.time())

    def _listen(self, waiter: Waiter[F], *, resync: bool) -> asyncio.Future[Any]:
        """Returns where the next answer arrives; it may do so at once, out of what an incomplete frame held back."""
        reply: asyncio.Future[Any] = self._loop.create_future()
        waiter.listen(partial(deliver, reply))
        if resync:
            self._resync()

        return reply

    async def _ask(self, frame: F, waiter: Waiter[F], reply: asyncio.Future[Any], patience: float) -> bool:
        """Sends a frame, unless its answer is there already; returns whether there is one in time."""

        def leaving() -> None:
            self._stats.repeated += bool(waiter.sends)
            waiter.sent()

        if not reply.done():
            expiry = self._loop.call_later(patience, deliver, reply, OVERDUE)
            try:
                await self._send(frame, patience, leaving)
                await self._prove(waiter, reply, patience)
                await reply
            except TimeoutError:
                deliver(reply, OVERDUE)
            finally:
                expiry.cancel()

        waiter.give_up()
        if reply.result() is not OVERDUE:
            return True

        self._link.overdue()
        return False

    async def _prove(self, waiter: Waiter[F], reply: asyncio.Future[Any], patience: float) -> None:
        """Where an answer may be late alone, asks something else behind the question, and waits for both answers.

        If there is one answer to the question by then, it is the right one: replies come in order.
        """
        if self._link.disorder or waiter.lenient or not self._pending.haunted(waiter):
            return

        frame = self._other(waiter.key)
        if frame is None:
            return

        waiter.hold()
        with self._pending.expect(frame.key, lambda _: None) as witness:
            witness.listen(waiter.prove)
            await self._send(frame, patience, witness.sent)
            await reply

    def _other(self, key: Hashable) -> F | None:
        """A question of another key to which no answer is awaited."""
        return next((frame for frame in self._fences if frame.key != key and not self._pending.line(frame.key)), None)
