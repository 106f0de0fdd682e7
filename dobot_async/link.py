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
from collections.abc import Callable, Hashable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, Generic, Protocol, TypeVar

import anyio

from dobot_async.errors import ConnectionLost, ProtocolError, ReplyTimeout
from dobot_async.events import Events
from dobot_async.pending import Keyed, Pending, Waiter
from dobot_async.transports import Transport
from dobot_async.turns import Turns
from dobot_async.wire import Command

__all__ = ["Link", "LinkState", "LinkStats", "Posted", "Unexpected"]

R = TypeVar("R")
Q = TypeVar("Q")
ATTEMPTS = 3
IMMEDIATE_RANK, QUEUED_RANK = 0, 1
CLOSE_TIMEOUT = 2.0
HURRY = 0.05  # seconds that an answer is waited for after the one before it was swallowed in its place, or so it seems


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


class Encoder(Protocol[F_co]):
    """Makes a family's request frame of a command's row and its parameters."""

    def __call__(self, command: Command[Any, Any], params: bytes, *, queued: bool) -> F_co: ...


class LinkState(enum.Enum):
    """What a link is good for."""

    OPEN = "open"
    LOST = "lost"
    CLOSED = "closed"


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
        state: Whether it is open, was lost, or was closed.
        events: Frames that nobody waited for, as `Unexpected`.
        trace: Called with (outgoing, frame) for each frame, if set.
    """

    def __init__(
        self,
        transport: Transport,
        parser: Parser[F],
        encode: Encoder[F],
        *,
        url: str,
        read_only: bool = False,
    ) -> None:
        self.url = url
        self.state = LinkState.OPEN
        self.events: Events[Unexpected[F]] = Events()
        self.trace: Callable[[bool, F], None] | None = None
        self._transport = transport
        self._parser = parser
        self._encode = encode
        self._read_only = read_only
        self._stats = LinkStats()
        self._loop = asyncio.get_running_loop()
        self._pending: Pending[F] = Pending(self._loop.time)
        self._turns = Turns(transport.in_flight)
        self._sending = anyio.Lock(fast_acquire=True)
        self._cause: BaseException | None = None
        self._reader = self._loop.create_task(self._read(), name=f"dobot_async reader {url}")

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
        attempts = ATTEMPTS if command.repeatable else 1
        reply, echo = command.reply, command.echo

        def accept(answer: F) -> R:
            decoded = reply.decode(answer.params)
            if echo and getattr(decoded, echo) != value:
                raise ProtocolError(f"{command.name} of {echo} {value} was answered with {decoded}")

            return decoded

        self._check()
        waiter = self._pending.expect(frame.key, accept)
        if not urgent:
            await self._turn(frame.key, IMMEDIATE_RANK, timeout, command.name)

        try:
            answer: R = await self._exchange(frame, waiter, command.name, timeout, attempts)
        finally:
            if not urgent:
                self._turns.give(frame.key, quiet=waiter.quiet)

        return answer

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
        posted: Posted[R] = Posted(self, name, waiter, partial(self._turns.give, None))
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

    def answer(self, reply: asyncio.Future[R]) -> R:
        """Returns what was delivered, or raises ConnectionLost if it was the end of the link."""
        value = reply.result()
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
        """Raises ConnectionLost if the link is no longer open."""
        if self.state is not LinkState.OPEN:
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
        if self.state is not LinkState.OPEN:
            return

        self.state, self._cause = state, cause
        self._pending.fail(self._lost())
        self.events.close()

    async def _exchange(self, frame: F, waiter: Waiter[F], name: str, timeout: float, attempts: int) -> Any:
        """Sends a frame, again if it has to be, and returns what its waiter makes of the answer."""
        started = self._loop.time()
        with waiter:
            for attempt in range(attempts):
                until = started + timeout * (attempt + 1) / attempts
                hurried = True
                while hurried:
                    reply, hurried = await self._ask(frame, waiter, until, repeatable=attempts > 1)
                    if reply.done() and not reply.cancelled():
                        return self.answer(reply)

        if waiter.misfit:
            raise ProtocolError(f"{name}: the arm's answer does not fit: {waiter.misfit}")

        self._stats.timeouts += 1
        raise self._overdue(name, timeout)

    async def _ask(
        self, frame: F, waiter: Waiter[F], until: float, *, repeatable: bool
    ) -> tuple[asyncio.Future[Any], bool]:
        """Sends a frame once; returns its answer, if one came in time, and whether to ask again before that time."""
        self._check()
        reply = self._listen(waiter)
        self._stats.sent += 1
        self._stats.repeated += waiter.repeats
        waiter.sent()
        with suppress(TimeoutError):
            async with asyncio.timeout_at(until) as limit:
                if repeatable:
                    waiter.hurry = partial(bring_forward, limit, self._loop)

                await self._send(frame)
                await reply

        hurried = limit.when() != until
        if not hurried and (not reply.done() or reply.cancelled()):
            # The answer may have come inside of a frame that never ended.
            reply = self._listen(waiter)
            self._receive(self._parser.resync())

        return reply, hurried

    def _listen(self, waiter: Waiter[F]) -> asyncio.Future[Any]:
        """What the waiter's next answer is delivered to."""
        reply: asyncio.Future[Any] = self._loop.create_future()
        waiter.listen(partial(deliver, reply))
        return reply

    async def _turn(self, key: Hashable, rank: int, timeout: float, what: str) -> None:
        """Waits for the turn of a request, no longer than its own timeout."""
        try:
            async with asyncio.timeout(timeout):
                await self._turns.take(key, rank)
        except TimeoutError:
            raise ReplyTimeout(f"the link to {self.url} was too busy to send {what} within {timeout:.3g} s") from None

        if self.state is not LinkState.OPEN:
            self._turns.give(key)
            self._check()

    async def _send(self, frame: F) -> None:
        """Hands one whole frame to the transport."""
        if self.trace:
            self.trace(True, frame)

        try:
            async with self._sending:
                await self._transport.send(bytes(frame))
        except (anyio.BrokenResourceError, anyio.ClosedResourceError, OSError) as error:
            self._end(LinkState.LOST, error.__cause__ or error)
            raise self._lost() from error

    async def _read(self) -> None:
        """Reads until the transport ends."""
        try:
            while True:
                self._receive(self._parser.feed(await self._transport.receive()))
        except (anyio.EndOfStream, anyio.BrokenResourceError, anyio.ClosedResourceError, OSError) as error:
            self._end(LinkState.LOST, error.__cause__ or error)
        except Exception as error:
            # A bug in a parser must not leave callers waiting for a reader that is gone.
            self._end(LinkState.LOST, error)
            raise

    def _receive(self, frames: list[F]) -> None:
        """Hands frames to those who wait for them."""
        for frame in frames:
            self._stats.received += 1
            if self.trace:
                self.trace(False, frame)

            if not self._pending.resolve(frame):
                self._stats.unexpected += 1
                self.events.publish(Unexpected(frame))


class Posted(Generic[R]):
    """A queued command that was sent and is not answered yet."""

    def __init__(self, link: Link[Any], name: str, waiter: Waiter[Any], give_turn: Callable[[], None]) -> None:
        self._link = link
        self._name = name
        self._waiter = waiter.__enter__()
        self._give_turn: Callable[[], None] | None = give_turn
        self._reply: asyncio.Future[R] = asyncio.get_running_loop().create_future()
        waiter.listen(partial(deliver, self._reply))

    async def answer(self, timeout: float) -> R:
        """Returns what `accept` made of the answer.

        Raises:
            ReplyTimeout: No answer came within so many seconds.
            ConnectionLost: The link is gone.
        """
        try:
            async with asyncio.timeout(timeout):
                await self._reply
        except TimeoutError:
            if not self._reply.done() or self._reply.cancelled():
                raise ReplyTimeout(f"{self._name} was not acknowledged within {timeout:.3g} s") from None
        finally:
            self.forget()

        return self._link.answer(self._reply)

    def forget(self) -> None:
        """Stops waiting; may be called again."""
        give_turn, self._give_turn = self._give_turn, None
        if give_turn:
            self._waiter.__exit__()
            give_turn()


def bring_forward(limit: asyncio.Timeout, loop: asyncio.AbstractEventLoop) -> None:
    """Shortens a wait to `HURRY`, if it goes on longer."""
    when = limit.when()
    if when is not None and not limit.expired():
        limit.reschedule(min(when, loop.time() + HURRY))


def deliver(reply: asyncio.Future[Any], value: Any) -> None:
    """Sets a future that its waiter may have given up already."""
    if not reply.done():
        reply.set_result(value)
