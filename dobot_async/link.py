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
from functools import partial
from typing import Any, Generic, TypeVar

import anyio

from dobot_async.asking import Asking
from dobot_async.contract import Encoder, Frame, LinkState, LinkStats, Parser, Unexpected
from dobot_async.errors import ConnectFailed, ConnectionLost, ProtocolError, ReplyTimeout
from dobot_async.events import Events, Watched
from dobot_async.pending import LINGER, Pending
from dobot_async.posted import Posted
from dobot_async.roundtrip import RoundTrip
from dobot_async.transports import Transport, hidden
from dobot_async.transports.base import prompt, pump
from dobot_async.turns import Turns
from dobot_async.wire import Command

__all__ = ["Link"]

F = TypeVar("F", bound=Frame)
R = TypeVar("R")
Q = TypeVar("Q")
IMMEDIATE_RANK, QUEUED_RANK = 0, 1
CLOSE_TIMEOUT = 2.0
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
        lost: Called once with what every later call raises, when it is lost and not reopened, if set.
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
        self.lost: Callable[[ConnectionLost], None] | None = None
        self._reopen = reopen
        self._transport = transport
        self._write = prompt(transport)
        self._parser = parser
        self._encode = encode
        self._filler = filler
        self._unanswered = 0
        self._arrived_at = -math.inf
        self._read_only = read_only
        self._stats = LinkStats()
        self._loop = asyncio.get_running_loop()
        self._pending: Pending[F] = Pending(self._loop.time, disorder=lambda: self.disorder)
        self._turns = Turns(transport.in_flight)
        self._round_trip = round_trip or RoundTrip()
        self._asking: Asking[F] = Asking(
            self,
            self._pending,
            self._round_trip,
            self._stats,
            send=self._send,
            resync=self._resync,
            fences=[encode(command, command.request.encode(None), queued=False) for command in fences],
        )
        self._sending = asyncio.Lock()
        self._cause: BaseException | None = None
        self._reader = self._loop.create_task(self._read(), name=f"dobot_async reader {url}")

    @property
    def open(self) -> bool:
        """Whether it is open just now."""
        return self.state.value is LinkState.OPEN

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
            answer: R = await self._asking.exchange(frame, waiter, name, timeout, urgent=urgent, ready=ready)
            return answer
        finally:
            if not urgent:
                self._turns.give(frame.key)

    def shout(self, frame: F, data: bytes) -> Callable[[], None]:
        """Sends what `frame` made of a command before this returns, if the transport can; nobody hears of its answer.

        For a stop, which many links are to carry at once: all of them are told before any is waited for. Whether it has
        arrived is for a `request` of the same to find out, so it must be harmless twice.

        Args:
            frame: The frame.
            data: Its bytes, made when there was time for it.

        Returns:
            What is to be called once all are told, before anything else is sent: it notes that an answer is owed.
        """
        if self.disorder or not self._write(data):
            return lambda: None

        return partial(self._owe, frame)

    def _owe(self, frame: F) -> None:
        """Notes that a frame was sent the answer to which is for nobody."""
        waiter = self._pending.expect(frame.key, lambda _: None)
        waiter.listen(lambda _: None)
        self._loop.call_later(LINGER, self._pending.leave, waiter)
        self._left(frame, waiter.sent)

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

        waiter = self._pending.expect(frame.key, accept, tombstone=tombstone)
        give_turn = partial(self._turns.give, None) if alone else None
        posted: Posted[R] = Posted(self, name, waiter, self._round_trip, give_turn)

        def noted() -> None:
            leaving()
            waiter.sent()

        try:
            await self._send(frame, timeout, noted)
        except BaseException as error:
            posted.forget()
            if isinstance(error, TimeoutError):
                raise self.too_late(name, timeout) from None

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

    def too_late(self, name: str, timeout: float) -> ReplyTimeout:
        """What to raise if no answer has come."""
        return ReplyTimeout(f"no answer to {name} from {self.url} within {timeout:.3g} s")

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

    def _end(self, state: LinkState, cause: BaseException | None) -> None:
        """The one door of death; only the first cause counts."""
        if self.state.value in DEAD:
            return

        self._cause = cause
        self.state.change(state)
        self.state.close()
        self._pending.fail(self._lost())
        if state is LinkState.LOST and self.lost:
            self.lost(self._lost())

        self.events.close()

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

    async def _send(self, frame: F, patience: float | None, leaving: Callable[[], None]) -> None:
        """Hands one whole frame to the transport; raises TimeoutError if it does not take it in so many seconds.

        `leaving` is called when it goes out, which is in the order in which the arm gets the frames: of one that never
        had its turn nobody may expect an answer.
        """
        data = bytes(frame)
        if self._unanswered == MUTE:
            self._unanswered = 0
            data = self._filler + data

        if not self._sending.locked() and self._write(data):
            self._left(frame, leaving)
            return

        async with asyncio.timeout(patience), self._sending:
            self._check()
            self._left(frame, leaving)
            try:
                await self._transport.send(data)
            except BROKEN as error:
                if self._reopen:
                    return  # as if it had been lost on the way: the reader finds the break, and mends it

                self._end(LinkState.LOST, error.__cause__ or error)
                raise self._lost() from error

    def _left(self, frame: F, leaving: Callable[[], None]) -> None:
        """Takes note of a frame that goes out."""
        leaving()
        self._stats.sent += 1
        if self.trace:
            self.trace(True, frame)

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
                self._write = prompt(self._transport)
                break
            except (ConnectFailed, OSError):
                await asyncio.sleep(pause * random.uniform(0.5, 1.0))  # noqa: S311 - no secret
                pause = min(2 * pause, LAST_PAUSE)

        self._parser.reset()
        self.outages += 1
        self.state.change(LinkState.OPEN)

    def _resync(self) -> None:
        """Gives up a frame the rest of which is overdue; what is found inside of it goes to those who wait."""
        if self._loop.time() > self._arrived_at + BREAK:
            self._receive(self._parser.resync())

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
