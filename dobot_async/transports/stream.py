"""An anyio stream as a transport."""

from __future__ import annotations

from collections.abc import Callable
from types import CoroutineType
from typing import Any

__all__ = ["StreamTransport"]


class StreamTransport:
    """An anyio stream as a transport: its own three verbs, and the limits."""

    def __init__(self, stream: Any, *, in_flight: int, window: int, reorder_window: float = 0.0) -> None:
        self.in_flight = in_flight
        self.window = window
        self._reorder_window = reorder_window
        self.send: Callable[[bytes], CoroutineType[Any, Any, None]] = stream.send
        self.receive: Callable[[], CoroutineType[Any, Any, bytes]] = stream.receive
        self.aclose: Callable[[], CoroutineType[Any, Any, None]] = stream.aclose

    @property
    def reorder_window(self) -> float:
        """Seconds within which messages may overtake one another; 0 on a stream."""
        return self._reorder_window
