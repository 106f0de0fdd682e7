"""What every transport is, and the pieces that they share."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from typing import Any, NoReturn, Protocol, runtime_checkable
from urllib.parse import SplitResult, parse_qsl

__all__ = ["MANY", "Transport", "Wrapped", "options", "prompt", "pump"]

MANY = 8
"""Unanswered requests that a byte stream carries at a time: a handful fits the arm's own input buffer."""


class Transport(Protocol):
    """A way to an arm for bytes, with anyio's verbs and errors. Framing never enters it.

    Attributes:
        in_flight: How many requests may be unanswered at a time.
        window: How many queued commands may be unacknowledged at a time, whatever the user asks for.
        disorder: Seconds within which messages may overtake one another, and a doubled one arrive again; 0 on a stream.
    """

    in_flight: int
    window: int

    @property
    def disorder(self) -> float:
        """See above; it may change with the link."""

    async def send(self, data: bytes) -> None:
        """Sends all bytes of one frame; waits while the line cannot take them.

        Raises:
            anyio.ClosedResourceError: It was closed on this side.
            anyio.BrokenResourceError: The other side is gone.
        """

    async def receive(self) -> bytes:
        """Returns the next bytes, at least one, cut anywhere.

        Raises:
            anyio.ClosedResourceError: It was closed on this side.
            anyio.EndOfStream: The other side ended it.
            anyio.BrokenResourceError: It broke.
        """

    async def aclose(self) -> None:
        """Closes it; may be called again."""


@runtime_checkable
class Delivering(Protocol):
    """A transport that hands over bytes as they arrive: it takes a turn of the event loop less than `receive`."""

    async def deliver(self, take: Callable[[bytes], None]) -> None:
        """Calls `take` with what arrives, until the transport ends; then raises as `receive`."""


@runtime_checkable
class Prompt(Protocol):
    """A transport that need not be awaited to send, as long as its output is not full."""

    def write(self, data: bytes) -> bool:
        """Sends all bytes of one frame before it returns; False if it cannot, and has sent nothing."""


class Stream(Protocol):
    """What anyio's sockets and memory streams have in common."""

    @property
    def send(self) -> Callable[[bytes], Awaitable[None]]: ...

    @property
    def receive(self) -> Callable[[], Awaitable[bytes]]: ...

    @property
    def aclose(self) -> Callable[[], Awaitable[None]]: ...


class Wrapped:
    """An anyio stream as a transport: its own three verbs, and the limits."""

    def __init__(self, stream: Any, *, in_flight: int, window: int, disorder: float = 0.0) -> None:
        self.in_flight = in_flight
        self.window = window
        self.disorder = disorder
        self.send: Callable[[bytes], Any] = stream.send
        self.receive: Callable[[], Any] = stream.receive
        self.aclose: Callable[[], Any] = stream.aclose


def options(url: SplitResult, known: Mapping[str, Callable[[str], Any]]) -> dict[str, Any]:
    """Returns the options behind the "?" of a URL, converted; raises ValueError that names the wrong one."""
    found = {}
    for name, text in parse_qsl(url.query, keep_blank_values=True, strict_parsing=bool(url.query)):
        if name not in known:
            raise ValueError(f"unknown option {name!r}; known: {', '.join(known) or 'none'}")

        if name in found:
            raise ValueError(f"option {name} is given twice")

        try:
            found[name] = known[name](text)
        except ValueError:
            raise ValueError(f"{name}={text!r} is no {known[name].__name__}") from None

    return found


def prompt(transport: Transport) -> Callable[[bytes], bool]:
    """Returns what sends a frame before it returns; its answer is False where that cannot be done."""
    return transport.write if isinstance(transport, Prompt) else lambda _: False


async def pump(transport: Transport, take: Callable[[bytes], None]) -> NoReturn:
    """Hands over what arrives, until the transport ends; then raises as its `receive`."""
    if isinstance(transport, Delivering):
        await transport.deliver(take)

    while True:
        take(await transport.receive())
