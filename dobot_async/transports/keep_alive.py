"""Find out that the other end of a TCP connection is gone: its computer, its power or the cable, without a word.

1. The system probes a connection that has been quiet for `IDLE` seconds, each second. Nothing comes back: ETIMEDOUT
   after 6 s on Linux, 5 s elsewhere.
2. It ends a connection whose data nobody acknowledges for 6 s (Linux) or 4 s, and then rests its probes. On Linux this
   goes for a peer, too, that is alive, and has not read for so long that all buffers are full.
3. Both can follow one another when something is sent just before the probes give up, and Linux starts the second
   clock up to 3 s late, while it looks for the neighbour. There `PeerWatch` bounds the sum: `SILENCE` seconds without
   any acknowledgement are the end, whatever was sent.

So a dead peer is found within 9 s. An outage of less than 4 s (on Linux 6 s) ends nothing.
"""

from __future__ import annotations

import asyncio
import errno
import socket
import struct
import sys
from collections.abc import Callable
from contextlib import suppress
from typing import Any

__all__ = ["SILENCE", "PeerWatch", "keep_alive"]

IDLE, INTERVAL, PROBES = 2, 1, 3  # seconds, and how many
SILENCE = 8.0
LOOK = 0.5  # seconds between two looks at the silence

PROBING = (
    (("TCP_KEEPIDLE", "TCP_KEEPALIVE"), IDLE),  # macOS has the second name
    (("TCP_KEEPINTVL",), INTERVAL),
    (("TCP_KEEPCNT",), PROBES),
)
UNACKNOWLEDGED = {
    "linux": ("TCP_USER_TIMEOUT", 18, 6000),
    "darwin": ("TCP_RXT_CONNDROPTIME", 0x80, 4),
    "win32": ("TCP_MAXRT", 5, 4),
}
"""By system: the option for the time without an acknowledgement, its number if Python has no name for it, its value."""

LAST_ACK = struct.Struct("=56xI")
"""The field tcpi_last_ack_recv of Linux's struct tcp_info: milliseconds since the last acknowledgement."""


def keep_alive(connection: Any) -> None:
    """Have the system find out whether the other side is still there; less exactly where it has fewer options.

    Args:
        connection: A socket, or asyncio's stand-in for one. None is left alone: it was lost already.
    """
    if connection is None:
        return

    set_option(connection, socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for names, value in PROBING:
        for number in [getattr(socket, name) for name in names if hasattr(socket, name)]:
            set_option(connection, socket.IPPROTO_TCP, number, value)

    if sys.platform in UNACKNOWLEDGED:
        name, number, value = UNACKNOWLEDGED[sys.platform]
        set_option(connection, socket.IPPROTO_TCP, getattr(socket, name, number), value)


def set_option(connection: Any, level: int, number: int, value: int) -> None:
    """Set a socket option, as far as the system knows it and the connection still stands."""
    with suppress(OSError):
        connection.setsockopt(level, number, value)


class PeerWatch:
    """Looks whether the other side of a kept-alive connection acknowledges anything; does nothing but on Linux.

    Args:
        connection: A socket, or asyncio's stand-in for one; None if it was lost already.
        gone: Called once, with the reason, when it has been silent for too long. It is to call `stop` in any case.
    """

    def __init__(self, connection: Any, gone: Callable[[TimeoutError], None]) -> None:
        self._connection = connection
        self._gone = gone
        self._loop = asyncio.get_running_loop()
        self._timer: asyncio.TimerHandle | None = None
        if connection is not None and sys.platform == "linux":
            self._timer = self._loop.call_later(LOOK, self._look)

    def stop(self) -> None:
        """Look no more; may be called again."""
        if self._timer:
            self._timer.cancel()
            self._timer = None

    def _look(self) -> None:
        """Look at the silence."""
        self._timer = None
        try:
            info = self._connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, LAST_ACK.size)
        except OSError:
            return  # it has just ended, which is told elsewhere

        silence = LAST_ACK.unpack(info)[0] / 1000 if len(info) == LAST_ACK.size else 0.0
        if silence < SILENCE:
            self._timer = self._loop.call_later(LOOK, self._look)
        else:
            self._gone(TimeoutError(errno.ETIMEDOUT, f"nothing has come back for {silence:.1f} s"))
