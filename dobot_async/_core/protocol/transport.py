"""What a transport is to a link: bytes of frames, in and out, and the limits that the way to the arm has."""

from __future__ import annotations

from collections.abc import Callable
from typing import NoReturn, Protocol, runtime_checkable

__all__ = ["MANY", "Transport", "nowait_writer", "read_loop"]

MANY = 8
"""Unanswered requests that a byte stream carries at a time: a handful fits the arm's own input buffer."""


class Transport(Protocol):
    """A way to an arm for bytes, with anyio's verbs and errors. Framing never enters it.

    Attributes:
        in_flight: How many requests may be unanswered at a time.
        window: How many queued commands may be unacknowledged at a time, whatever the user asks for.
        reorder_window: Seconds within which messages may overtake one another, and a doubled one arrive again; 0 on a
            stream.
    """

    in_flight: int
    window: int

    @property
    def reorder_window(self) -> float:
        """See above; it may change with the link."""
        ...

    async def send(self, data: bytes, /) -> None:
        """Send all bytes of one frame; wait while the line cannot take them.

        A send that is cancelled returns at once, and has sent the whole frame or nothing of it.

        Raises:
            anyio.ClosedResourceError: It was closed on this side.
            anyio.BrokenResourceError: The other side is gone.
        """

    async def receive(self) -> bytes:
        """Return the next bytes, at least one, cut anywhere.

        Raises:
            anyio.ClosedResourceError: It was closed on this side.
            anyio.EndOfStream: The other side ended it.
            anyio.BrokenResourceError: It broke.
        """
        ...

    async def aclose(self) -> None:
        """Close it; it may be called again."""


@runtime_checkable
class PushTransport(Protocol):
    """A transport that hands over bytes as they arrive: it takes a turn of the event loop less than `receive`."""

    async def deliver(self, take: Callable[[bytes], None]) -> None:
        """Call `take` with what arrives, until the transport ends; then raise as `receive`."""


@runtime_checkable
class NowaitTransport(Protocol):
    """A transport that need not be awaited to send, as long as its output is not full."""

    def write(self, data: bytes) -> bool:
        """Send all bytes of one frame before it returns; return False if it cannot, and nothing was sent."""
        ...


def nowait_writer(transport: Transport) -> Callable[[bytes], bool]:
    """Return what sends a frame before it returns; its answer is False where that cannot be done."""
    return transport.write if isinstance(transport, NowaitTransport) else lambda _: False


async def read_loop(transport: Transport, take: Callable[[bytes], None]) -> NoReturn:
    """Hand over what arrives, until the transport ends; then raise as its `receive`."""
    if isinstance(transport, PushTransport):
        await transport.deliver(take)

    while True:
        take(await transport.receive())
