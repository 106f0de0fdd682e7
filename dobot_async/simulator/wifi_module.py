"""The radio module of a simulated arm, as a search for arms sees it: it answers the broadcast on a port of its own.

    who asks, any port  -->  Who is Dobot?
                        <--  127.0.0.1,02D07F000001,USR-C322,2.17.14

The answer has no port: whoever reads it takes the arm to be at 8899, so that is where the arm has to listen.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from ipaddress import IPv4Address
from typing import Any, cast
from urllib.parse import urlsplit

from dobot_async.discovery.wifi import PORT, QUESTION

__all__ = ["announced"]

ANY = "0.0.0.0"  # noqa: S104 - a broadcast is not heard at a single address
MODULE = "USR-C322,2.17.14"


@asynccontextmanager
async def announced(url: str, host: str = ANY, port: int = PORT) -> AsyncGenerator[int]:
    """Answers searches for a simulated arm for the length of a block; yields the port at which it is asked.

    Args:
        url: The arm's, `udp://` and an IPv4 address.
        host: The address at which questions arrive: 0.0.0.0 for all broadcasts, or the broadcast address of one
            network, where the system allows to listen there (Linux does).
        port: 48899 is where everybody asks; 0 takes any free one.

    Raises:
        ValueError: The arm has no IPv4 address.
        OSError: Nobody can listen there.
    """
    parts = urlsplit(url)
    if parts.scheme != "udp":
        raise ValueError(f"only an arm in the Wi-Fi, udp://, answers a search, not {url}")

    address = IPv4Address(parts.hostname or "")
    # The second digit marks a MAC that nobody was given, as simulated ones should be.
    answer = f"{address},02D0{address.packed.hex().upper()},{MODULE}".encode()
    loop = asyncio.get_running_loop()
    transport, _ = await loop.create_datagram_endpoint(
        lambda: WiFiModule(answer), local_addr=(host, port), allow_broadcast=True
    )
    try:
        yield transport.get_extra_info("sockname")[1]
    finally:
        transport.close()


class WiFiModule(asyncio.DatagramProtocol):
    """Answers who asks the one question that it knows."""

    def __init__(self, answer: bytes) -> None:
        self._answer = answer

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """The port is open."""
        self._transport = cast(asyncio.DatagramTransport, transport)

    def datagram_received(self, data: bytes, addr: Any) -> None:
        """Answers, if it is the question."""
        if data.rstrip(b"\0\r\n") == QUESTION:
            self._transport.sendto(self._answer, addr)
