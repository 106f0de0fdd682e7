"""What every transport is, and the pieces that they share."""

from __future__ import annotations

import math
import re
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from typing import Any, NoReturn, Protocol, runtime_checkable
from urllib.parse import SplitResult, parse_qsl

__all__ = ["MANY", "Option", "StreamTransport", "Transport", "nowait_writer", "number", "options", "read_loop", "words"]

PLAIN_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
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

    async def send(self, data: bytes) -> None:
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


class Stream(Protocol):
    """What anyio's sockets and memory streams have in common."""

    @property
    def send(self) -> Callable[[bytes], Awaitable[None]]: ...

    @property
    def receive(self) -> Callable[[], Awaitable[bytes]]: ...

    @property
    def aclose(self) -> Callable[[], Awaitable[None]]: ...


class StreamTransport:
    """An anyio stream as a transport: its own three verbs, and the limits."""

    def __init__(self, stream: Any, *, in_flight: int, window: int, reorder_window: float = 0.0) -> None:
        self.in_flight = in_flight
        self.window = window
        self.reorder_window = reorder_window
        self.send: Callable[[bytes], Any] = stream.send
        self.receive: Callable[[], Any] = stream.receive
        self.aclose: Callable[[], Any] = stream.aclose


@dataclass(frozen=True, slots=True)
class Option:
    """What an option of a URL takes.

    Attributes:
        convert: Makes its value of the text; raises ValueError if it is none.
        expected: What the text is to be, with its unit and range.
        secret: Whether the text is kept out of messages.
    """

    convert: Callable[[str], Any]
    expected: str
    secret: bool = False


def number(kind: type[int | float], unit: str, *, least: float, most: float) -> Option:
    """Return an option that takes a number of a unit, within a range."""

    def convert(text: str) -> float:
        value = kind(text) if PLAIN_NUMBER.fullmatch(text) else math.nan
        if not least <= value <= most:
            raise ValueError

        return value

    return Option(convert, f"{unit}, {'a whole number' if kind is int else 'a number'} from {least:g} to {most:.10g}")


def options(url: SplitResult, known: Mapping[str, Option | Callable[[str], Any]]) -> dict[str, Any]:
    """Return the options behind the "?" of a URL, converted.

    Args:
        url: Where they are.
        known: What each option takes, by its name.

    Raises:
        ValueError: One is unknown, given twice, or not as expected. The message names it.
    """
    if url.fragment:
        raise ValueError("what is behind a # would be left out; a # in a URL is written %23")

    found = {}
    for name, text in parse_qsl(url.query, keep_blank_values=True, strict_parsing=bool(url.query)):
        if name not in known:
            raise ValueError(f"unknown option {name!r}; known: {', '.join(known) or 'none'}")

        if name in found:
            raise ValueError(f"option {name} is given twice")

        option = known[name]
        if not isinstance(option, Option):
            option = Option(option, f"a value of type {option.__name__}")

        try:
            found[name] = option.convert(text)
        except ValueError:
            shown = name if option.secret else f"{name}={text!r}"
            raise ValueError(f"{shown}: expected {option.expected}") from None

    return found


def words(text: str) -> str:
    """Return a text of an option that may be anything but empty; raise ValueError if it is."""
    if not text:
        raise ValueError

    return text


def nowait_writer(transport: Transport) -> Callable[[bytes], bool]:
    """Return what sends a frame before it returns; its answer is False where that cannot be done."""
    return transport.write if isinstance(transport, NowaitTransport) else lambda _: False


async def read_loop(transport: Transport, take: Callable[[bytes], None]) -> NoReturn:
    """Hand over what arrives, until the transport ends; then raise as its `receive`."""
    if isinstance(transport, PushTransport):
        await transport.deliver(take)

    while True:
        take(await transport.receive())
