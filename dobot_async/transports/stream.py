"""An anyio stream as a transport."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

__all__ = ["StreamTransport"]


class StreamTransport:
    """An anyio stream as a transport: its own three verbs, and the limits."""

    def __init__(self, stream: Any, *, in_flight: int, window: int, reorder_window: float = 0.0) -> None:
        self.in_flight = in_flight
        self.window = window
        self.reorder_window = reorder_window
        self.send: Callable[[bytes], Any] = stream.send
        self.receive: Callable[[], Any] = stream.receive
        self.aclose: Callable[[], Any] = stream.aclose
