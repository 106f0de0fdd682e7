"""Arms in the Wi-Fi: their radio module (USR-C322) answers a broadcast.

    everybody, port 48899  <--  Who is Dobot?
    who asked              -->  192.168.137.128,D8B04CB33868,USR-C322,2.17.14      address, MAC, module, its firmware

The arm itself is at that address, port 8899.
"""

from __future__ import annotations

import asyncio
import re
from collections.abc import AsyncGenerator, Sequence
from contextlib import AsyncExitStack, suppress
from ipaddress import IPv4Address
from typing import Any

from dobot_async.discovery.found import Found, printable
from dobot_async.discovery.interfaces import ANY, broadcast_targets

__all__ = ["PORT", "QUESTION", "WiFiModules"]

PORT = 48899
QUESTION = b"Who is Dobot?"
ANSWER = re.compile(r"(?P<address>[\d.]{7,15}),(?P<mac>[0-9A-Fa-f]{12})(?:,(?P<module>[^,]*))?(?:,(?P<version>[^,]*))?")
BACKLOG = 256


class WiFiModules:
    """Finds arms in the networks that this computer is in.

    Args:
        broadcast: Where to ask, in place of the broadcast address of each network: addresses, each with its port.
        interval: Seconds until it is asked again, for datagrams get lost.
    """

    name = "wifi"
    probes_at_once = 8

    def __init__(self, broadcast: Sequence[tuple[str, int]] = (), *, interval: float = 1.0) -> None:
        self._broadcast = broadcast
        self._interval = interval

    async def search(self, timeout: float) -> AsyncGenerator[Found, None]:
        """Yields each module that answers.

        Raises:
            OSError: Nobody could be asked.
        """
        ways = [(ANY, target) for target in self._broadcast] or [
            (own, (target, PORT)) for own, target in broadcast_targets()
        ]
        if not ways:
            raise OSError("this computer is in no IPv4 network")

        end = asyncio.get_running_loop().time() + timeout
        async with AsyncExitStack() as stack:
            replies = ReplySocket()
            sockets: list[tuple[Any, tuple[str, int]]] = []
            refused: list[OSError] = []
            for own, target in ways:
                try:
                    sockets.append((await replies.open(own, stack), target))
                except OSError as error:  # a computer's name may lead to addresses that it does not have
                    refused.append(error)

            if not sockets:
                raise refused[-1]

            until = 0.0
            while until < end:
                for socket, target in sockets:
                    socket.sendto(QUESTION, target)

                until = min(asyncio.get_running_loop().time() + self._interval, end)
                while found := await replies.next(until):
                    yield found

            if replies.errors and not replies.heard:
                raise replies.errors[-1]


class ReplySocket(asyncio.DatagramProtocol):
    """Where answers arrive.

    Attributes:
        errors: Why questions could not be sent.
        heard: How many answers there were.
    """

    def __init__(self) -> None:
        self.errors: list[Exception] = []
        self.heard: int = 0
        self._answers: asyncio.Queue[Found] = asyncio.Queue(BACKLOG)

    async def open(self, address: str, stack: AsyncExitStack) -> asyncio.DatagramTransport:
        """Opens a socket at an own address."""
        loop = asyncio.get_running_loop()
        transport, _ = await loop.create_datagram_endpoint(lambda: self, local_addr=(address, 0), allow_broadcast=True)
        stack.callback(transport.close)
        return transport

    async def next(self, until: float) -> Found | None:
        """Returns the next answer, or None if there is none until a time of the loop."""
        with suppress(TimeoutError):
            async with asyncio.timeout_at(until):
                return await self._answers.get()

        return None

    def datagram_received(self, data: bytes, addr: tuple[str | Any, int]) -> None:
        """Keeps an answer; what is none, and a flood, is left aside."""
        found = understood(data, addr[0])
        if found:
            self.heard += 1
            with suppress(asyncio.QueueFull):
                self._answers.put_nowait(found)

    def error_received(self, exc: Exception) -> None:
        """A question could not be sent."""
        self.errors.append(exc)


def understood(data: bytes, sender: str) -> Found | None:
    """What an answer says; None if it is no answer."""
    match = ANSWER.fullmatch(data.rstrip(b"\0\r\n").decode("latin-1"))
    if not match:
        return None

    try:
        address = IPv4Address(match["address"])
    except ValueError:
        return None

    host = sender if address.is_unspecified else str(address)
    module = " ".join(filter(None, (match["module"], match["version"])))
    return Found(f"udp://{host}", WiFiModules.name, match["mac"].upper(), printable(module), families=("magician",))
