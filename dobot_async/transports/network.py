"""TCP and UDP: anyio's own sockets.

UDP carries the arm's serial stream in datagrams, which may be lost, doubled, merged and split: it is parsed as a stream
like any other, one request is under way at a time, and a lost one is silence.
"""

from __future__ import annotations

from urllib.parse import SplitResult

import anyio

from dobot_async.errors import ConnectFailed
from dobot_async.transports.base import MANY, Transport, Wrapped, options

__all__ = ["UDP_PORT", "open_url"]

UDP_PORT = 8899
WINDOW = 16
DISORDER = 0.015  # seconds; one access point keeps datagrams in order, and doubles them within a few milliseconds


async def open_url(url: SplitResult, *, arm: str) -> Transport:  # noqa: ARG001
    """Opens `udp://host[:8899]` (`?disorder=` if the network is worse than `DISORDER`) or `tcp://host:port`."""
    disorder = options(url, {"disorder": float} if url.scheme == "udp" else {}).get("disorder", DISORDER)
    host, port = url.hostname, url.port
    if not host or url.path.strip("/") or port == 0 or (url.scheme == "tcp" and port is None):
        raise ValueError(f"expected {'udp://host' if url.scheme == 'udp' else 'tcp://host:port'}")

    try:
        if url.scheme == "udp":
            datagrams = await anyio.create_connected_udp_socket(host, port or UDP_PORT)
            return Wrapped(datagrams, in_flight=1, window=1, disorder=disorder)

        stream = await anyio.connect_tcp(host, port or 0)
    except OSError as error:
        raise ConnectFailed(
            f"cannot reach {url.geturl()}: {error}; is the address right, "
            "and is the arm (or its serial server) in this network?"
        ) from error

    return Wrapped(stream, in_flight=MANY, window=WINDOW)
