"""The link: commands and their answers over one connection to one arm.

    request --> encode --> Admission --> [barrier] --> transport.send      a few requests out, one of each key
       ^                                                    |
       `--- decode <-- Correlator <-- Parser.feed <-- transport.receive    the reading task

Below it are `exchange` (sent once, noticed if lost), `connection` (opened, reopened, dead) and the sans-I/O
`correlator` (which reply belongs to which request).
"""

from __future__ import annotations

import asyncio
import logging
import math
from collections.abc import AsyncGenerator, Callable, Hashable, Sequence
from contextlib import AbstractAsyncContextManager, asynccontextmanager, nullcontext
from typing import Any, TypeVar

from dobot_async._core.link.admission import Admission, Priority
from dobot_async._core.link.budget import Budget
from dobot_async._core.link.connection import Reopen
from dobot_async._core.link.correlator import Outcome
from dobot_async._core.link.exchange import Exchange
from dobot_async._core.link.round_trip import RoundTrip
from dobot_async._core.protocol.contract import Encoder, Frame, LineLimits, LinkState, LinkStats, Parser, Unexpected
from dobot_async._core.protocol.transport import Transport
from dobot_async._core.protocol.wire import Command
from dobot_async._core.util.events import Events
from dobot_async._core.util.hooks import Hooks
from dobot_async._core.util.tasks import Cleanup
from dobot_async.errors import ConnectionLost, ProtocolError, ReplyTimeout

__all__ = ["Link"]

F = TypeVar("F", bound=Frame)
R = TypeVar("R")
Q = TypeVar("Q")
logger = logging.getLogger("dobot_async.link")
BREAK = 0.005  # seconds without a byte in the middle of a frame, after which the rest of it does not come


class Link(Exchange[F]):
    """One connection to one arm; used once, from its making to `aclose`.

    Args:
        transport: The way to the arm.
        parser: Finds the family's frames in what arrives.
        encode: Makes a frame of a row of the command table.
        url: Where the arm is, for messages.
        barriers: Cheap reads that harm nobody. Several, of different keys: an answer to one can be lost too.
        filler: Bytes that end a half frame that the arm waits for.
        read_only: Refuse what changes anything.
        round_trip: How long to wait for answers.
        reopen: Opens the transport anew when it breaks; None lets the link end with it.
        max_requests: How many a second it may send; None does not limit them.

    Attributes:
        heard_at: When the last frame came, in the loop's seconds.
        events: What happened unasked: frames that answered nothing, as `Unexpected`, and what the family adds.
        on_frame: Hooks, called with (outgoing, frame) for each frame.
        on_data: Hooks, called with the bytes that have arrived, behind `on_frame` for the frames in them.
        on_unsolicited: Hooks, called with each frame that answered nothing.
        on_lost: Hooks, called once with what every later call raises when the link is lost and not reopened.
        cleanup: What still has to be done to the arm, until the link ends.
    """

    def __init__(
        self,
        transport: Transport,
        parser: Parser[F],
        encode: Encoder[F],
        *,
        url: str,
        barriers: Sequence[F],
        filler: bytes = b"",
        read_only: bool = False,
        round_trip: RoundTrip | None = None,
        reopen: Reopen | None = None,
        max_requests: float | None = None,
    ) -> None:
        super().__init__(transport, url, reopen, barriers=barriers, filler=filler, round_trip=round_trip or RoundTrip())
        self.events: Events[object] = Events()
        self.on_frame: Hooks[[bool, F]] = Hooks()
        self.on_data: Hooks[[bytes]] = Hooks()
        self.on_unsolicited: Hooks[[F]] = Hooks()
        self.on_lost: Hooks[[ConnectionLost]] = Hooks()
        self.cleanup: Cleanup = Cleanup(self.url)
        self._parser = parser
        self._encode = encode
        self._read_only = read_only
        self._arrived_at = -math.inf
        self._admission = Admission(transport.in_flight)
        self._budget = Budget(max_requests) if max_requests else None

    @property
    def reorder_window(self) -> float:
        """Seconds within which messages of this link may overtake one another, and a doubled one arrive again."""
        return self._correlator.reorder_window

    @property
    def limits(self) -> LineLimits:
        """What the transport can carry at a time; it may change when the link is reopened."""
        transport = self._transport
        return LineLimits(transport.in_flight, transport.window, transport.reorder_window)

    @property
    def stats(self) -> LinkStats:
        """A snapshot of what went over the link so far."""
        self._stats.junk_bytes = self._parser.junk_bytes
        self._stats.bad_frames = self._parser.bad_frames
        return LinkStats(**{name: getattr(self._stats, name) for name in LinkStats.__slots__})

    @property
    def round_trip(self) -> float | None:
        """Seconds that an answer takes on the average; None before the first one."""
        return self._round_trip.smoothed

    def frame(self, command: Command[Q, Any], value: Q, *, queued: bool = False) -> F:
        """Return the frame of a request; raise ValueError or TypeError where the arm could not take it.

        Args:
            command: The row of the family's command table.
            value: Its parameters, None where it has none.
            queued: Whether it is for the arm's queue.
        """
        if self._read_only and command.write:
            raise ValueError(f"{command.name} is a command, and this connection only reads (control=False)")

        return self._encode(command, command.request.encode(value), queued=queued)

    async def request(
        self, command: Command[Q, R], value: Q, *, timeout: float | None = None, urgent: bool = False
    ) -> R:
        """Send one immediate command and return the arm's answer.

        Args:
            command: The row of the family's command table.
            value: Its parameters, None where it has none.
            timeout: Seconds until ReplyTimeout, repetitions included; the row's own by default. It counts from when
                `max_requests` lets it be sent.
            urgent: It stops something: it goes ahead of everything, and is repeated until it is acknowledged.

        Raises:
            ValueError: The parameters or the timeout do not fit, or the connection only reads.
            ReplyTimeout: No answer came.
            ProtocolError: An answer came that the layout does not allow.
            ConnectionLost: The link is broken or closed.
        """
        frame = self.frame(command, value)
        reply, echo = command.reply, command.echo

        def accept(answer: F) -> R:
            decoded = reply.decode(answer.params)
            if echo and getattr(decoded, echo) != value:
                raise ProtocolError(f"{command.name} of {echo} {value} was answered with {decoded}")

            return decoded

        timeout = command.timeout if timeout is None else timeout
        return await self.exchange(
            frame, accept, name=command.name, timeout=timeout, repeatable=command.repeatable, urgent=urgent
        )

    async def exchange(
        self,
        frame: F,
        accept: Callable[[F], R],
        *,
        name: str,
        timeout: float,
        repeatable: bool = False,
        urgent: bool = False,
        ready: Callable[[], None] = lambda: None,
    ) -> R:
        """Send a frame and return what `accept` makes of the answer; see `request`.

        Args:
            frame: Sent as it is; once, unless `repeatable`.
            accept: Raises ProtocolError if a frame of this key is not the answer.
            name: The command's name, for messages.
            timeout: Seconds until ReplyTimeout.
            repeatable: It may be sent again once it is known to have been lost.
            urgent: It goes ahead of everything, and is repeated until it is acknowledged.
            ready: Called whenever it is about to be sent; what this raises is raised, and nothing sent.

        Raises:
            ValueError: The timeout is not above 0.
            ReplyTimeout: No answer came, or the link was too busy for it to be sent.
            ProtocolError: An answer came that `accept` refuses.
            ConnectionLost: The link is broken or closed.
        """
        if not timeout > 0:
            raise ValueError(f"timeout must be above 0 seconds, not {timeout!r}")

        self._check()
        if not urgent:
            await self.turn()

        deadline = self._loop.time() + timeout
        priority = Priority.URGENT if urgent else Priority.IMMEDIATE
        if not self._admission.try_acquire(frame.key, priority):
            await self._acquire(frame.key, priority, deadline, name)

        try:
            if urgent:
                request = await self._urge(frame, accept, deadline, ready)
            else:
                request = await self._ask(frame, accept, deadline, ready, repeatable=repeatable)
        finally:
            self._admission.release(frame.key, priority)

        if request and request.outcome is Outcome.REPLY:
            value: R = request.value
            return value

        self._check()
        self._stats.timeouts += 1
        if request is None:
            raise ReplyTimeout(
                f"{name} could not be sent to {self.url} within {timeout:.3g} s: the link is busy, or silent"
            )

        if request.misfit:
            raise ProtocolError(f"{name}: the arm's answer does not fit: {request.misfit}")

        raise ReplyTimeout(f"no answer to {name} from {self.url} within {timeout:.3g} s")

    async def turn(self) -> None:
        """Return when `max_requests` lets another request be sent."""
        if self._budget:
            await self._budget.turn()

    def slot(self, name: str, timeout: float) -> AbstractAsyncContextManager[None]:
        """While this is entered, a queued command may be out; it waits only where one request at a time may be.

        Raises:
            ReplyTimeout: The link was too busy for so many seconds.
        """
        return nullcontext() if self._transport.in_flight > 1 else self._only(name, self._loop.time() + timeout)

    async def aclose(self) -> None:
        """Close the link; everybody who still waits gets ConnectionLost. Takes 2 s at most."""
        await self.cleanup.aclose()
        await super().aclose()

    @asynccontextmanager
    async def _only(self, what: str, deadline: float) -> AsyncGenerator[None]:
        """While this is entered, a queued command is out, and nothing else."""
        await self._acquire(None, Priority.QUEUED, deadline, what)
        try:
            yield
        finally:
            self._admission.release(None, Priority.QUEUED)

    async def _acquire(self, key: Hashable, priority: Priority, deadline: float, what: str) -> None:
        """Return when a request may be out; raise ReplyTimeout if it may not be by the deadline."""
        try:
            async with asyncio.timeout_at(None if deadline == math.inf else deadline):
                await self._admission.acquire(key, priority)
        except TimeoutError:
            raise ReplyTimeout(f"the link to {self.url} was too busy to send {what} in time") from None

    def _reopened(self) -> None:
        """Another stream begins."""
        self._parser.reset()

    def _ended(self, error: ConnectionLost) -> None:
        """Tell everybody who waits."""
        self._correlator.fail(error)
        self._deadlines.close()
        if self.state.value is LinkState.LOST:
            logger.warning("%s", error)
            self.on_lost(error)

        self.events.close()

    def _resync(self) -> None:
        """Give up a frame the rest of which is overdue; what is found inside of it goes to those who wait."""
        if self._loop.time() > self._arrived_at + BREAK:
            self._receive(self._parser.resync())

    def _feed(self, data: bytes) -> None:
        """Take the next bytes of the line."""
        self._arrived_at = self._loop.time()
        self._receive(self._parser.feed(data))
        if self.on_data:
            self.on_data(data)

    def _receive(self, frames: list[F]) -> None:
        """Hand frames to those who wait for them."""
        if frames:
            self._heard()

        for frame in frames:
            self._note(False, frame)
            if not self._correlator.resolve(frame):
                self._stats.unexpected += 1
                self._stragglers.came(frame.key, self._arrived_at)
                self.on_unsolicited(frame)
                self.events.publish(Unexpected(frame))

        self._log_losses()

    def _note(self, outgoing: bool, frame: F) -> None:
        """Count a frame, and tell those who look on."""
        if outgoing:
            self._stats.sent += 1
            if self._budget:
                self._budget.sent()
        else:
            self._stats.received += 1

        if self.on_frame:
            self.on_frame(outgoing, frame)

        if logger.isEnabledFor(logging.DEBUG):
            # Not the parameters: one of them is a password.
            logger.debug("%s %s %s, %d bytes", self.url, "->" if outgoing else "<-", frame.key, len(bytes(frame)))
