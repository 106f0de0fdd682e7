"""The link: a transport, a parser and those who wait, held together by one reading task.

    request, post --> Turns --> transport.send       at most `in_flight` requests unanswered, one of each key;
        ^                                            urgent ones pass everybody. Queued commands have a window of
        |                                            their own, and wait for a turn where only one may be under way
    Pending  <-- Parser.feed <-- transport.receive   the reading task

There is one door of death: whatever breaks first is kept as the cause, everybody who waits hears of it once, and every
later call fails with it at once. Nothing is held open across the caller's code: the reader is a plain task that
`aclose` cancels and joins.
"""

from __future__ import annotations

import asyncio
import math
import random
from collections.abc import Awaitable, Callable, Hashable, Sequence
from contextlib import suppress
from functools import partial
from typing import Any, Generic, TypeVar

import anyio

from dobot_async.contract import Encoder, Frame, LinkState, LinkStats, Parser, Unexpected
from dobot_async.errors import ConnectFailed, ConnectionLost, ProtocolError, ReplyTimeout
from dobot_async.events import Events, Watched
from dobot_async.pending import SWALLOWED, Pending, Waiter
from dobot_async.posted import Posted, deliver
from dobot_async.roundtrip import RoundTrip
from dobot_async.transports import Transport, hidden
from dobot_async.transports.base import pump
from dobot_async.turns import Turns
from dobot_async.wire import Command

__all__ = ["Link"]

F = TypeVar("F", bound=Frame)
R = TypeVar("R")
Q = TypeVar("Q")
IMMEDIATE_RANK, QUEUED_RANK = 0, 1
CLOSE_TIMEOUT = 2.0
LEAST_PATIENCE = 0.001  # seconds; nobody answers a request for which less is left
BREAK = 0.005  # seconds without a byte in the middle of a frame, after which the rest of it does not come
FIRST_PAUSE, LAST_PAUSE = 0.1, 5.0
BROKEN = (anyio.EndOfStream, anyio.BrokenResourceError, anyio.ClosedResourceError, OSError)
MUTE = 3
"""Unanswered requests in a row after which the arm may be waiting for the rest of a frame with a spoilt length: it gets
so many bytes that mean nothing that any frame ends."""
DEAD = {LinkState.LOST, LinkState.CLOSED}


class Link(Generic[F]):
    """One connection to one arm; used once, from `start` to `aclose`.

    Attributes:
        state: Its `value` says whether it is open, is being reopened, was lost or closed; `async for` yields changes.
        outages: How often it was lost and reopened.
        heard_at: When the last frame came, in the loop's seconds.
        events: What happened unasked: frames that nobody waited for, as `Unexpected`, and what the family adds.
        trace: Called with (outgoing, frame) for each frame, if set.
        stray: Called with each frame that nobody waited for, if set.
    """

    def __init__(
        self,
        transport: Transport,
        parser: Parser[F],
        encode: Encoder[F],
        *,
        url: str,
        filler: bytes = b"",
        fences: Sequence[Command[None, Any]] = (),
        read_only: bool = False,
        round_trip: RoundTrip | None = None,
        reopen: Callable[[], Awaitable[Transport]] | None = None,
    ) -> None:
        self.url = hidden(url)
        self.state = Watched(LinkState.OPEN)
        self.outages = 0
        self.heard_at = -math.inf
        self.events: Events[object] = Events()
        self.trace: Callable[[bool, F], None] | None = None
        self.stray: Callable[[F], None] | None = None
        self._reopen = reopen
        self._transport = transport
        self._parser = parser
        self._encode = encode
        self._filler = filler
        self._fences = fences
        self._unanswered = 0
        self._arrived_at = -math.inf
        self._read_only = read_only
        self._stats = LinkStats()
        self._loop = asyncio.get_running_loop()
        self._pending: Pending[F] = Pending(self._loop.time, disorder=lambda: self.disorder)
        self._turns = Turns(transport.in_flight)
        self._round_trip = round_trip or RoundTrip()
        self._sending = asyncio.Lock()
        self._cause: BaseException | None = None
        self._reader = self._loop.create_task(self._read(), name=f"dobot_async reader {url}")

    @property
    def disorder(self) -> float:
        """Seconds within which messages of this link may overtake one another, and a doubled one arrive again."""
        return self._transport.disorder

    @property
    def reply_timeout(self) -> float:
        """Seconds after which a request counts as unanswered, as the round trips so far suggest."""
        return self._round_trip.timeout

    @property
    def stats(self) -> LinkStats:
        """A snapshot of what went over the link so far."""
        self._stats.junk_bytes = self._parser.junk_bytes
        self._stats.bad_frames = self._parser.bad_frames
        return LinkStats(**{name: getattr(self._stats, name) for name in LinkStats.__slots__})

    def frame(self, command: Command[Q, Any], value: Q, *, queued: bool = False) -> F:
        """Returns the frame of a request; raises ValueError or TypeError where the arm could not take it."""
        if self._read_only and command.write:
            raise ValueError(f"{command.name} is a command, and this connection only reads (control=False)")

        return self._encode(command, command.request.encode(value), queued=queued)

    async def request(
        self,
        command: Command[Q, R],
        value: Q,
        *,
        timeout: float | None = None,
        urgent: bool = False,
        lenient: bool = False,
    ) -> R:
        """Sends one immediate command and returns the arm's answer.

        Args:
            command: The row of the family's command table.
            value: Its parameters, None where it has none.
            timeout: Seconds until ReplyTimeout, repeated requests included; the row's own by default.
            urgent: Goes ahead of everything else.
            lenient: On a datagram link, an answer that was later than its disorder may answer this: it costs less to
                ask where much is lost.

        Raises:
            ValueError: The parameters do not fit, or the connection only reads.
            ReplyTimeout: No answer came.
            ProtocolError: An answer came that the layout does not allow.
            ConnectionLost: The link is broken or closed.
        """
        frame = self.frame(command, value)
        timeout = command.timeout if timeout is None else timeout
        reply, echo = command.reply, command.echo

        def accept(answer: F) -> R:
            decoded = reply.decode(answer.params)
            if echo and getattr(decoded, echo) != value:
                raise ProtocolError(f"{command.name} of {echo} {value} was answered with {decoded}")

            return decoded

        return await self.forward(
            frame,
            accept,
            name=command.name,
            timeout=timeout,
            echo=value if echo else None,
            repeatable=command.repeatable,
            urgent=urgent,
            lenient=lenient,
        )

    async def forward(
        self,
        frame: F,
        accept: Callable[[F], R],
        *,
        name: str,
        timeout: float,
        echo: Hashable = None,
        repeatable: bool = False,
        urgent: bool = False,
        lenient: bool = False,
        ready: Callable[[], None] = lambda: None,
    ) -> R:
        """Sends a frame, one of a key at a time, and returns what `accept` makes of the answer.

        Args:
            frame: Sent as it is; once, unless `repeatable`.
            accept: Raises ProtocolError if a frame of this key is not the answer.
            name: The command's name, for messages.
            timeout: Seconds until ReplyTimeout.
            echo: What of the request `accept` finds in its answer.
            repeatable: It may be sent again while no answer comes.
            urgent: It goes ahead of everything else.
            lenient: See `request`.
            ready: Called when it is about to be sent for the first time; what this raises is raised, and nothing sent.
        """
        self._check()
        if not urgent:
            await self._turn(frame.key, IMMEDIATE_RANK, timeout, name)

        lenient = lenient and self.disorder > 0
        waiter = self._pending.expect(frame.key, accept, echo=echo, repeatable=repeatable, lenient=lenient)
        try:
            answer: R = await self._exchange(frame, waiter, name, timeout, urgent=urgent, ready=ready)
            return answer
        finally:
            if not urgent:
                self._turns.give(frame.key)

    async def post(
        self,
        frame: F,
        accept: Callable[[F], R],
        *,
        name: str,
        timeout: float,
        tombstone: bool = False,
        leaving: Callable[[], None] = lambda: None,
    ) -> Posted[R]:
        """Sends the frame of a queued command; its answer is awaited with the `Posted` that is returned.

        Several may be under way, as many as the family says. `accept` knows a late answer by its index, so none needs a
        tombstone.

        Args:
            frame: What `frame` made of the command.
            accept: Returns the answer's value, or raises ProtocolError if a frame of this key is not the answer.
            name: The command's name, for messages.
            timeout: Seconds that the link may be too busy.
            tombstone: Swallow an answer that comes after nobody waits for it any more, for a family without indices.
            leaving: Called when it goes out: from now on the arm may have it.
        """
        self._check()
        alone = self._transport.in_flight == 1
        if alone:
            await self._turn(None, QUEUED_RANK, timeout, name)

        leaving()
        waiter = self._pending.expect(frame.key, accept, tombstone=tombstone)
        give_turn = partial(self._turns.give, None) if alone else None
        posted: Posted[R] = Posted(self, name, waiter, self._round_trip, give_turn)
        try:
            waiter.sent()
            self._stats.sent += 1
            async with asyncio.timeout(timeout):
                await self._send(frame)
        except BaseException as error:
            posted.forget()
            if isinstance(error, TimeoutError):
                raise self._overdue(name, timeout) from None

            raise

        return posted

    def overdue(self) -> None:
        """Takes note that a request went unanswered for the reply timeout."""
        self._round_trip.unanswered()
        self._unanswered = min(self._unanswered + 1, MUTE)

    async def opened(self) -> None:
        """Returns when the link is open: at once, or when it has been reopened; raises ConnectionLost if it is dead."""
        while self.state.value is LinkState.REOPENING:
            await anext(self.state.__aiter__())

        self._check()

    def answer(self, reply: asyncio.Future[R]) -> R:
        """Returns what was delivered, or raises ConnectionLost if it was the end of the link."""
        value: R = reply.result()
        if isinstance(value, ConnectionLost):
            raise self._lost() from self._cause

        return value

    async def aclose(self) -> None:
        """Closes the link; everybody who still waits gets ConnectionLost. Takes at most 2 s."""
        with anyio.CancelScope(shield=True), anyio.move_on_after(CLOSE_TIMEOUT, shield=True):
            self._end(LinkState.CLOSED, None)
            self._reader.cancel()
            try:
                await asyncio.wait([self._reader])
            finally:
                await self._transport.aclose()

    def _check(self) -> None:
        """Raises ConnectionLost if the link is dead."""
        if self.state.value in DEAD:
            raise self._lost() from self._cause

    def _lost(self) -> ConnectionLost:
        """What to raise now that the link is dead."""
        if self._cause is None:
            return ConnectionLost(f"the connection to {self.url} was closed")

        reason = str(self._cause) or type(self._cause).__name__
        return ConnectionLost(f"the connection to {self.url} was lost: {reason}; is the arm powered and the cable in?")

    def _overdue(self, name: str, timeout: float) -> ReplyTimeout:
        return ReplyTimeout(f"no answer to {name} from {self.url} within {timeout:.3g} s")

    def _end(self, state: LinkState, cause: BaseException | None) -> None:
        """The one door of death; only the first cause counts."""
        if self.state.value in DEAD:
            return

        self._cause = cause
        self.state.change(state)
        self.state.close()
        self._pending.fail(self._lost())
        self.events.close()

    async def _exchange(
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
                    return self.answer(reply)

            reply = self._listen(waiter, resync=True)
            if reply.done() and reply.result() is not SWALLOWED:
                return self.answer(reply)

        if waiter.misfit:
            raise ProtocolError(f"{name}: the arm's answer does not fit: {waiter.misfit}")

        self._stats.timeouts += 1
        raise self._overdue(name, timeout)

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
        if self.state.value is LinkState.OPEN and (urgent or (owed is None and not self.disorder)):
            return True

        with suppress(TimeoutError):
            async with asyncio.timeout(seconds):
                await self.opened()
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
        if self.disorder:
            await asyncio.sleep(owed + self.disorder - self._loop.time())

        answered: asyncio.Future[Any] = self._loop.create_future()
        with self._pending.expect(frame.key, lambda _: None) as waiter, suppress(TimeoutError):
            waiter.listen(partial(deliver, answered))
            self._stats.sent += 1
            waiter.sent()
            await self._send(frame)
            if self.disorder:  # on a stream nothing overtakes it
                async with asyncio.timeout(self._round_trip.timeout):
                    await answered

        await asyncio.sleep(self.disorder)
        return True

    async def _calm(self, key: Hashable) -> None:
        """Returns when no second answer to a request of this key can arrive: it would pass for the next one's."""
        if self.disorder:
            await asyncio.sleep(self._pending.calm_at(key) - self._loop.time())

    def _listen(self, waiter: Waiter[F], *, resync: bool) -> asyncio.Future[Any]:
        """Returns where the next answer arrives; it may do so at once, out of what an incomplete frame held back."""
        reply: asyncio.Future[Any] = self._loop.create_future()
        waiter.listen(partial(deliver, reply))
        if resync and self._loop.time() > self._arrived_at + BREAK:
            self._receive(self._parser.resync())

        return reply

    async def _ask(self, frame: F, waiter: Waiter[F], reply: asyncio.Future[Any], patience: float) -> bool:
        """Sends a frame, unless its answer is there already; returns whether there is one in time."""
        with suppress(TimeoutError):
            async with asyncio.timeout(patience):
                if not reply.done():
                    self._stats.sent += 1
                    self._stats.repeated += bool(waiter.sends)
                    waiter.sent()
                    await self._send(frame)
                    await self._prove(waiter, reply)

                await reply

        waiter.give_up()
        if reply.done() and not reply.cancelled():
            return True

        self.overdue()
        return False

    async def _prove(self, waiter: Waiter[F], reply: asyncio.Future[Any]) -> None:
        """Where an answer may be late alone, asks something else behind the question, and waits for both answers.

        If there is one answer to the question by then, it is the right one: replies come in order.
        """
        if self.disorder or waiter.lenient or not self._pending.haunted(waiter):
            return

        frame = self._other(waiter.key)
        if frame is None:
            return

        waiter.hold()
        with self._pending.expect(frame.key, lambda _: None) as witness:
            witness.listen(waiter.prove)
            self._stats.sent += 1
            witness.sent()
            await self._send(frame)
            await reply

    def _other(self, key: Hashable) -> F | None:
        """A question of another key to which no answer is awaited."""
        frames = (self.frame(command, None) for command in self._fences)
        return next((frame for frame in frames if frame.key != key and not self._pending.line(frame.key)), None)

    async def _turn(self, key: Hashable, rank: int, timeout: float, what: str) -> None:
        """Waits for the turn of a request, no longer than its own timeout."""
        if self._turns.take_now(key):
            return

        try:
            async with asyncio.timeout(timeout):
                await self._turns.take(key, rank)
        except TimeoutError:
            raise ReplyTimeout(f"the link to {self.url} was too busy to send {what} within {timeout:.3g} s") from None

        if self.state.value in DEAD:
            self._turns.give(key)
            self._check()

    async def _send(self, frame: F) -> None:
        """Hands one whole frame to the transport."""
        if self.trace:
            self.trace(True, frame)

        data = bytes(frame)
        if self._unanswered == MUTE:
            self._unanswered = 0
            data = self._filler + data

        try:
            async with self._sending:
                await self._transport.send(data)
        except BROKEN as error:
            if self._reopen:
                return  # as if it had been lost on the way: the reader finds the break, and mends it

            self._end(LinkState.LOST, error.__cause__ or error)
            raise self._lost() from error

    async def _read(self) -> None:
        """Reads until the transport ends, and from the next one if it may be reopened."""
        try:
            while True:
                try:
                    await pump(self._transport, self._feed)
                except BROKEN as error:
                    if not self._reopen:
                        self._end(LinkState.LOST, error.__cause__ or error)
                        return

                    await self._mend(self._reopen)
        except Exception as error:
            # A bug in a parser must not leave callers waiting for a reader that is gone.
            self._end(LinkState.LOST, error)
            raise

    async def _mend(self, reopen: Callable[[], Awaitable[Transport]]) -> None:
        """Opens the transport anew, as often as it takes, at growing intervals that differ from arm to arm."""
        self.state.change(LinkState.REOPENING)
        await self._transport.aclose()
        pause = FIRST_PAUSE
        while True:
            try:
                self._transport = await reopen()
                break
            except (ConnectFailed, OSError):
                await asyncio.sleep(pause * random.uniform(0.5, 1.0))  # noqa: S311 - no secret
                pause = min(2 * pause, LAST_PAUSE)

        self._parser.reset()
        self.outages += 1
        self.state.change(LinkState.OPEN)

    def _feed(self, data: bytes) -> None:
        """Takes the next bytes of the line."""
        self._arrived_at = self._loop.time()
        self._receive(self._parser.feed(data))

    def _receive(self, frames: list[F]) -> None:
        """Hands frames to those who wait for them."""
        if frames:
            self._unanswered = 0
            self.heard_at = self._loop.time()

        for frame in frames:
            self._stats.received += 1
            if self.trace:
                self.trace(False, frame)

            if not self._pending.resolve(frame):
                self._stats.unexpected += 1
                if self.stray:
                    self.stray(frame)

                self.events.publish(Unexpected(frame))
