"""A serial line's pace, eight bits and no parity, for a host of `listeners` that answers at once.

    client --> SerialLine --> host          each way its own line, whose bytes arrive in pieces of a millisecond
    client <-- SerialLine <--

A frame that ends inside of a piece arrives with the piece, so at most `PIECE` late; what was sent ends with a piece.
Due times are counted from one another and not from when a timer woke up, so that an hour of traffic is as exact as its
first byte: to what the loop's timers are, a millisecond with epoll.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Generic, TypeVar

from dobot_async.endpoints.listeners import Host, Peer

__all__ = ["RateLimited", "RateLimitedLine"]

P = TypeVar("P", bound=Peer)
BITS = 10  # start, eight of data, stop
PIECE = 0.001  # seconds
AHEAD = 1 << 12  # bytes that a client may write ahead of its line, as a system's serial driver lets it


class RateLimitedLine:
    """One direction: carries bytes from `send` to `deliver`.

    Args:
        baud: Bits per second.
        deliver: Called with each piece when it has arrived.
    """

    def __init__(self, baud: float, deliver: Callable[[bytes], None]) -> None:
        self._per_byte = BITS / baud
        self._piece = max(1, int(PIECE / self._per_byte))
        self._deliver = deliver
        self._loop = asyncio.get_running_loop()
        self._waiting = bytearray()
        self._free_at = self._loop.time()
        self._timer: asyncio.TimerHandle | None = None

    @property
    def backlog(self) -> int:
        """How many bytes have not arrived yet."""
        return len(self._waiting)

    def send(self, data: bytes) -> None:
        """Put bytes on the line, behind those that are on it."""
        if not self._waiting:
            self._free_at = max(self._free_at, self._loop.time())

        self._waiting += data
        self._go()

    def clear(self) -> None:
        """Forget what has not arrived."""
        self._waiting.clear()
        if self._timer:
            self._timer.cancel()
            self._timer = None

    def _go(self) -> None:
        """Set the timer for the next piece."""
        if self._waiting and not self._timer:
            size = min(self._piece, len(self._waiting))
            self._free_at += size * self._per_byte
            self._timer = self._loop.call_at(self._free_at, self._arrive, size)

    def _arrive(self, size: int) -> None:
        self._timer = None
        piece = bytes(self._waiting[:size])
        del self._waiting[:size]
        self._go()
        self._deliver(piece)


class RateLimitedPeer(Generic[P]):
    """A client behind its two lines."""

    def __init__(
        self,
        baud: float,
        deliver: Callable[[bytes], None],
        disconnect: Callable[[], None],
        pause_reading: Callable[[bool], None],
        leave: Callable[[P], None],
    ) -> None:
        self.back: RateLimitedLine = RateLimitedLine(baud, deliver)
        self.peer: P | None = None
        self._there = RateLimitedLine(baud, self._arrived)
        self._disconnect = disconnect
        self._pause_reading = pause_reading
        self._leave = leave
        self._held = False
        self._open = True

    def answer(self, data: bytes) -> None:
        """Take what the host sends; nobody hears it once the client has gone."""
        if self._open:
            self.back.send(data)

    def send(self, data: bytes) -> None:
        """Take what the client has written; one that is far ahead of its line has to wait."""
        self._there.send(data)
        self._flow()

    def disconnect(self) -> None:
        """End the client; what it has sent and has not arrived is lost."""
        self._there.clear()
        if self._open:
            self._disconnect()
        else:
            self._left()

    def close(self) -> None:
        """Note that the client has gone; what it has sent before arrives first, as a UART sends it."""
        self._open = False
        self.back.clear()
        if not self._there.backlog:
            self._left()

    def _arrived(self, data: bytes) -> None:
        if self.peer:
            self.peer.send(data)

        if self._open:
            self._flow()
        elif not self._there.backlog:
            self._left()

    def _left(self) -> None:
        """Tell the host, once, that its client has gone."""
        peer, self.peer = self.peer, None
        if peer:
            self._leave(peer)

    def _flow(self) -> None:
        held = self._there.backlog >= AHEAD
        if held != self._held:
            self._held = held
            self._pause_reading(held)


class RateLimited(Generic[P]):
    """A host behind serial lines: its clients are reached, and reach it, at the lines' pace.

    Args:
        host: Who is reached.
        baud: Bits per second, each way.
    """

    def __init__(self, host: Host[P], baud: float) -> None:
        self._host = host
        self._baud = baud

    def client(
        self,
        deliver: Callable[[bytes], None],
        disconnect: Callable[[], None],
        *,
        ordered: bool,
        pause_reading: Callable[[bool], None] = lambda _: None,
        name: str = "",
    ) -> RateLimitedPeer[P]:
        """Connect somebody; see `Host`."""
        wired: RateLimitedPeer[P] = RateLimitedPeer(self._baud, deliver, disconnect, pause_reading, self._host.leave)
        wired.peer = self._host.client(wired.answer, wired.disconnect, ordered=ordered, name=name)
        return wired

    def leave(self, client: RateLimitedPeer[P]) -> None:
        """Let a client go; the host hears of it when what the client had sent has arrived."""
        client.close()
