"""The link: a transport, a parser and those who wait, held together by one reading task.

    request, post --> Turns --> transport.send       at most `in_flight` requests unanswered, one of each key;
        ^                                            immediate before queued, urgent ones pass everybody
        |
    Pending  <-- Parser.feed <-- transport.receive   the reading task

There is one door of death: whatever breaks first is kept as the cause, everybody who waits hears of it once, and every
later call fails with it at once. Nothing is held open across the caller's code: the reader is a plain task that
`aclose` cancels and joins.
"""

from __future__ import annotations

import asyncio
import enum
import random
from collections.abc import Awaitable, Callable, Hashable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, Generic, Protocol, TypeVar, cast

import anyio

from dobot_async.errors import ConnectFailed, ConnectionLost, ProtocolError, ReplyTimeout
from dobot_async.events import Events, Watched
from dobot_async.pending import SWALLOWED, Keyed, Pending, Waiter
from dobot_async.roundtrip import RoundTrip
from dobot_async.transports import Transport
from dobot_async.turns import Turns
from dobot_async.wire import Command

__all__ = ["Link", "LinkState", "LinkStats", "Posted", "Unexpected"]

R = TypeVar("R")
Q = TypeVar("Q")
IMMEDIATE_RANK, QUEUED_RANK = 0, 1
CLOSE_TIMEOUT = 2.0
LEAST_PATIENCE = 0.001  # seconds; nobody answers a request for which less is left
FIRST_PAUSE, LAST_PAUSE = 0.1, 5.0
BROKEN = (anyio.EndOfStream, anyio.BrokenResourceError, anyio.ClosedResourceError, OSError)
MUTE = 3
"""Unanswered requests in a row after which the arm may be waiting for the rest of a frame with a spoilt length: it gets
so many bytes that mean nothing that any frame ends."""


class Frame(Keyed, Protocol):
    """What a family's parser makes and its transport carries."""

    @property
    def params(self) -> bytes:
        """The parameters, for the command's layout."""

    def __bytes__(self) -> bytes: ...


F = TypeVar("F", bound=Frame)
F_co = TypeVar("F_co", bound=Frame, covariant=True)


class Parser(Protocol[F]):
    """Finds a family's frames in a stream that may be cut anywhere and may hold anything."""

    junk_bytes: int
    bad_frames: int

    def feed(self, data: bytes) -> list[F]:
        """Takes the next bytes of the stream, returns the frames that they complete."""

    def resync(self) -> list[F]:
        """Gives up an incomplete frame, returns the frames found inside of it."""

    def reset(self) -> None:
        """Forgets an incomplete frame: another stream begins."""


class Encoder(Protocol[F_co]):
    """Makes a family's request frame of a command's row and its parameters."""

    def __call__(self, command: Command[Any, Any], params: bytes, *, queued: bool) -> F_co: ...


class LinkState(enum.Enum):
    """What a link is good for."""

    OPEN = "open"
    REOPENING = "reopening"
    LOST = "lost"
    CLOSED = "closed"


DEAD = {LinkState.LOST, LinkState.CLOSED}


@dataclass(frozen=True, slots=True)
class Unexpected(Generic[F]):
    """A frame that nobody waited for: late beyond its tombstone, of another client, or of no request at all."""

    frame: F


@dataclass(slots=True)
class LinkStats:
    """What went over a link so far.

    Attributes:
        sent: Requests, repeated ones included.
        received: Whole frames with a good checksum.
        repeated: Requests that were sent again because no answer came.
        timeouts: Calls that failed because no answer came.
        unexpected: Frames that nobody waited for.
        junk_bytes: Bytes that belong to no frame.
        bad_frames: Frames with a wrong checksum.
    """

    sent: int = 0
    received: int = 0
    repeated: int = 0
    timeouts: int = 0
    unexpected: int = 0
    junk_bytes: int = 0
    bad_frames: int = 0


class Link(Generic[F]):
    """One connection to one arm; used once, from `start` to `aclose`.

    Attributes:
        state: Its `value` says whether it is open, is being reopened, was lost or closed; `async for` yields changes.
        outages: How often it was lost and reopened.
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
        read_only: bool = False,
        round_trip: RoundTrip | None = None,
        reopen: Callable[[], Awaitable[Transport]] | None = None,
    ) -> None:
        self.url = url
        self.state = Watched(LinkState.OPEN)
        self.outages = 0
        self.events: Events[object] = Events()
        self.trace: Callable[[bool, F], None] | None = None
        self.stray: Callable[[F], None] | None = None
        self._reopen = reopen
        self._transport = transport
        self._parser = parser
        self._encode = encode
        self._filler = filler
        self._unanswered = 0
        self._read_only = read_only
        self._stats = LinkStats()
        self._loop = asyncio.get_running_loop()
        self._pending: Pending[F] = Pending(self._loop.time)
        self._turns = Turns(transport.in_flight)
        self._round_trip = round_trip or RoundTrip()
        self._heard: dict[Hashable, float] = {}
        self._sending = anyio.Lock(fast_acquire=True)
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
        self, command: Command[Q, R], value: Q, *, timeout: float | None = None, urgent: bool = False
    ) -> R:
        """Sends one immediate command and returns the arm's answer.

        Args:
            command: The row of the family's command table.
            value: Its parameters, None where it has none.
            timeout: Seconds until ReplyTimeout, repeated requests included; the row's own by default.
            urgent: Goes ahead of everything else.

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

        self._check()
        if not urgent:
            await self._turn(frame.key, IMMEDIATE_RANK, timeout, command.name)

        try:
            if not urgent:
                await self.calm(frame.key)

            return await self._exchange(frame, accept, command.name, timeout, repeatable=command.repeatable)
        finally:
            if not urgent:
                self._turns.give(frame.key)

    async def post(self, frame: F, accept: Callable[[F], R], *, name: str, timeout: float) -> Posted[R]:
        """Sends the frame of a queued command; its answer is awaited with the `Posted` that is returned.

        Several may be under way. `accept` knows a late answer by its index, so none needs a tombstone.

        Args:
            frame: What `frame` made of the command.
            accept: Returns the answer's value, or raises ProtocolError if a frame of this key is not the answer.
            name: The command's name, for messages.
            timeout: Seconds that the link may be too busy.
        """
        self._check()
        await self._turn(None, QUEUED_RANK, timeout, name)
        waiter = self._pending.expect(frame.key, accept, tombstone=False)
        posted: Posted[R] = Posted(self, name, waiter, self._round_trip, partial(self._turns.give, None))
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

    async def calm(self, key: Hashable) -> None:
        """Returns when no second answer to a request of this key can arrive: it would pass for the next one's.

        Either the request or its answer may have been doubled on the way, so it takes the disorder of both ways.
        """
        heard = self._heard.get(key)
        if heard is not None and self.disorder:
            await asyncio.sleep(heard + 2 * self.disorder - self._loop.time())

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

    async def _exchange(self, frame: F, accept: Callable[[F], R], name: str, timeout: float, *, repeatable: bool) -> R:
        """Sends a frame, again and again if that is harmless, and returns what `accept` makes of its answer."""
        deadline = self._loop.time() + timeout
        attempts = 0
        with self._pending.expect(frame.key, accept, repeatable=repeatable) as waiter:
            while (left := deadline - self._loop.time()) > LEAST_PATIENCE:
                if not await self._opened_within(left):
                    break

                reply = self._listen(waiter, resync=attempts > 0)
                attempts += 1
                patience = min(left, self._round_trip.timeout) if repeatable else left
                if not await self._ask(frame, waiter, reply, patience) or reply.result() is SWALLOWED:
                    continue

                if attempts == 1:
                    self._round_trip.sample(self._loop.time() - waiter.sends[0])

                return cast(R, self.answer(reply))

            reply = self._listen(waiter, resync=True)
            if reply.done() and reply.result() is not SWALLOWED:
                return cast(R, self.answer(reply))

        if waiter.misfit:
            raise ProtocolError(f"{name}: the arm's answer does not fit: {waiter.misfit}")

        self._stats.timeouts += 1
        raise self._overdue(name, timeout)

    def _listen(self, waiter: Waiter[F], *, resync: bool) -> asyncio.Future[Any]:
        """Returns where the next answer arrives; it may do so at once, out of what an incomplete frame held back."""
        reply: asyncio.Future[Any] = self._loop.create_future()
        waiter.listen(partial(deliver, reply))
        if resync:
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

                await reply

        if reply.done() and not reply.cancelled():
            return True

        self.overdue()
        return False

    async def _opened_within(self, seconds: float) -> bool:
        """Whether the link is open, or is so before the seconds have passed."""
        if self.state.value is LinkState.OPEN:
            return True

        with suppress(TimeoutError):
            async with asyncio.timeout(seconds):
                await self.opened()
                return True

        return False

    async def _turn(self, key: Hashable, rank: int, timeout: float, what: str) -> None:
        """Waits for the turn of a request, no longer than its own timeout."""
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
                    self._receive(self._parser.feed(await self._transport.receive()))
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

    def _receive(self, frames: list[F]) -> None:
        """Hands frames to those who wait for them."""
        if frames:
            self._unanswered = 0

        now = self._loop.time()
        for frame in frames:
            self._stats.received += 1
            self._heard[frame.key] = now
            if self.trace:
                self.trace(False, frame)

            if not self._pending.resolve(frame):
                self._stats.unexpected += 1
                if self.stray:
                    self.stray(frame)

                self.events.publish(Unexpected(frame))


class Posted(Generic[R]):
    """A queued command that was sent and is not answered yet."""

    def __init__(
        self,
        link: Link[Any],
        name: str,
        waiter: Waiter[Any],
        round_trip: RoundTrip,
        give_turn: Callable[[], None],
    ) -> None:
        self._link = link
        self._round_trip = round_trip
        self._name = name
        self._waiter = waiter.__enter__()
        self._give_turn: Callable[[], None] | None = give_turn
        self._reply: asyncio.Future[R] = asyncio.get_running_loop().create_future()
        waiter.listen(partial(deliver, self._reply))

    async def answer(self) -> R:
        """Returns what `accept` made of the answer.

        Raises:
            ReplyTimeout: No answer came within the link's own timeout.
            ConnectionLost: The link is gone.
        """
        try:
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
    def sent_at(self) -> float:
        """When it was sent, in the loop's seconds."""
        return self._waiter.sends[0]

    def forget(self) -> None:
        """Stops waiting; may be called again."""
        give_turn, self._give_turn = self._give_turn, None
        if give_turn:
            self._waiter.__exit__()
            give_turn()


def deliver(reply: asyncio.Future[Any], value: Any) -> None:
    """Sets a future that its waiter may have given up already."""
    if not reply.done():
        reply.set_result(value)
