"""Where something can be reached by programs that know no more than bytes: TCP, UDP; `terminal` has the third.

    client --bytes--> Host.client(...).send        deliver --bytes--> client

Each client gets an object of its own from the host, so that one's half frame never touches another's. There are no
tasks: the event loop calls, and the host answers when it likes.
"""

from __future__ import annotations

import asyncio
import ssl
from collections.abc import Callable
from contextlib import AsyncExitStack
from typing import Any, Generic, Protocol, TypeVar, cast

from dobot_async.transports.base import MANY
from dobot_async.transports.keep_alive import PeerWatch, keep_alive

__all__ = ["Connection", "Datagrams", "Host", "Peer", "on_tcp", "on_udp", "url_of"]


class Peer(Protocol):
    """What a host keeps of one client."""

    def send(self, data: bytes) -> None:
        """Takes what the client has sent."""


P = TypeVar("P", bound=Peer)


class Host(Protocol[P]):
    """Whoever is reached."""

    def client(
        self,
        deliver: Callable[[bytes], None],
        hang_up: Callable[[], None],
        *,
        ordered: bool,
        hold: Callable[[bool], None] = ...,
        name: str = ...,
    ) -> P:
        """Called when somebody has connected.

        Args:
            deliver: Sends bytes to the client; what it does not read may get lost.
            hang_up: Ends the connection, as far as there is one; `leave` follows.
            ordered: Whether its bytes arrive in their order, as they do on all but datagrams.
            hold: Called with True it lets the client wait, with False go on; datagrams get lost instead.
            name: Who it is, for people.
        """

    def leave(self, client: P) -> None:
        """Called once, when the client has gone."""


async def on_tcp(
    host: Host[Any], stack: AsyncExitStack, *, address: str, port: int, tls: ssl.SSLContext | None = None
) -> str:
    """A TCP port, as a serial server has it; returns its URL."""
    loop = asyncio.get_running_loop()
    server = await loop.create_server(lambda: Connection(host), address, port, ssl=tls)
    stack.push_async_callback(server.wait_closed)
    stack.callback(server.close)
    return url_of("tcp", server.sockets[0].getsockname())


async def on_udp(
    host: Host[Any],
    stack: AsyncExitStack,
    *,
    address: str,
    port: int,
    admit: Callable[[bytes, bool], bytes | None] = lambda data, _known: data,
    evict: bool = True,
) -> str:
    """A UDP port, as the arm's Wi-Fi has it; returns its URL. See `Datagrams`."""
    loop = asyncio.get_running_loop()
    transport, _ = await loop.create_datagram_endpoint(
        lambda: Datagrams(host, admit=admit, evict=evict), local_addr=(address, port)
    )
    stack.callback(transport.close)
    return url_of("udp", transport.get_extra_info("sockname"))


def url_of(scheme: str, name: tuple[Any, ...]) -> str:
    """The URL of a socket."""
    host, port = name[:2]
    return f"{scheme}://{f'[{host}]' if ':' in host else host}:{port}"


class Connection(asyncio.Protocol, Generic[P]):
    """One TCP client."""

    def __init__(self, host: Host[P]) -> None:
        self._host = host

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """A client has connected."""
        self._transport = cast(asyncio.Transport, transport)
        self._held = self._full = False
        connection = transport.get_extra_info("socket")
        keep_alive(connection)
        self._watch = PeerWatch(connection, lambda _: self._transport.abort())
        name = url_of("tcp", transport.get_extra_info("peername"))
        self._client = self._host.client(
            self._transport.write, self._transport.abort, ordered=True, hold=self._hold, name=name
        )

    def data_received(self, data: bytes) -> None:
        """It has sent something."""
        self._client.send(data)

    def pause_writing(self) -> None:
        """It does not read; what it asks meanwhile waits in the line."""
        self._full = True
        self._flow()

    def resume_writing(self) -> None:
        """It reads again."""
        self._full = False
        self._flow()

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002 - it does not matter why
        """It has gone."""
        self._watch.stop()
        self._host.leave(self._client)

    def _hold(self, held: bool) -> None:
        self._held = held
        self._flow()

    def _flow(self) -> None:
        if self._held or self._full:
            self._transport.pause_reading()
        else:
            self._transport.resume_reading()


class Datagrams(asyncio.DatagramProtocol, Generic[P]):
    """All UDP clients, each known by its address.

    Args:
        host: Who is reached.
        admit: Called with each datagram, and whether its sender is known; returns what the host gets of it, None for
            nothing, which makes nobody a client.
        evict: Whether one more than a handful takes the place of the first, or is ignored.
    """

    def __init__(
        self, host: Host[P], *, admit: Callable[[bytes, bool], bytes | None] = lambda data, _: data, evict: bool = True
    ) -> None:
        self._host = host
        self._admit = admit
        self._evict = evict
        self._clients: dict[Any, P] = {}

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """The port is open."""
        self._transport = cast(asyncio.DatagramTransport, transport)

    def datagram_received(self, data: bytes, addr: Any) -> None:
        """Somebody has sent something."""
        admitted = self._admit(data, addr in self._clients)
        if admitted is None:
            return

        if addr not in self._clients:
            if len(self._clients) == MANY:
                if not self._evict:
                    return

                self._forget(next(iter(self._clients)))

            self._clients[addr] = self._host.client(
                lambda reply: self._transport.sendto(reply, addr),
                lambda: self._forget(addr),
                ordered=False,
                name=url_of("udp", addr),
            )

        self._clients[addr].send(admitted)

    def _forget(self, addr: Any) -> None:
        """The next datagram from there comes from a new client."""
        client = self._clients.pop(addr, None)
        if client:
            self._host.leave(client)
