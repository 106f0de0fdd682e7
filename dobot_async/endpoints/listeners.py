"""Where something can be reached by programs that know no more than bytes: TCP, UDP; `pty` has the third.

    client --bytes--> Host.client(...).send        deliver --bytes--> client

Each client gets an object of its own from the host, so that one's half frame never touches another's. There are no
tasks but one while TLS is agreed upon: the event loop calls, and the host answers when it likes.
"""

from __future__ import annotations

import asyncio
import ssl
from collections.abc import Callable
from contextlib import AsyncExitStack
from dataclasses import dataclass, field
from typing import Any, Generic, Protocol, TypeVar, cast

from dobot_async._core.protocol.transport import MANY
from dobot_async._core.util.tasks import cancel_and_join
from dobot_async.transports.keep_alive import PeerWatch, keep_alive

TLS_WITHIN = 5.0  # seconds

__all__ = ["ClientConnection", "DatagramEndpoint", "Host", "Peer", "on_tcp", "on_udp", "url_of"]


class Peer(Protocol):
    """What a host keeps of one client."""

    def send(self, data: bytes) -> None:
        """Takes what the client has sent."""


P = TypeVar("P", bound=Peer)
Handshake = asyncio.Task[asyncio.Transport | None]


class Host(Protocol[P]):
    """Whoever is reached."""

    def client(
        self,
        deliver: Callable[[bytes], None],
        disconnect: Callable[[], None],
        *,
        ordered: bool,
        pause_reading: Callable[[bool], None] = ...,
        name: str = ...,
    ) -> P:
        """Called when somebody has connected.

        Args:
            deliver: Sends bytes to the client; what it does not read may get lost.
            disconnect: Ends the connection, as far as there is one; `leave` follows.
            ordered: Whether its bytes arrive in their order, as they do on all but datagrams.
            pause_reading: Called with True it lets the client wait, with False go on; datagrams get lost instead.
            name: Who it is, for people.
        """
        ...

    def leave(self, client: P) -> None:
        """Called once, when the client has gone."""


async def on_tcp(
    host: Host[Any],
    stack: AsyncExitStack,
    *,
    address: str,
    port: int,
    tls: ssl.SSLContext | None = None,
    scheme: str = "tcp",
) -> str:
    """A TCP port, as a serial server has it; returns its URL, with the scheme that the host makes of it."""
    loop = asyncio.get_running_loop()
    place = ListeningPort(host, tls, scheme)
    server = await loop.create_server(lambda: ClientConnection(place), address, port)
    stack.push_async_callback(server.wait_closed)
    stack.push_async_callback(place.aclose)
    stack.callback(server.close)
    return url_of(f"{scheme}s" if tls and scheme == "ws" else scheme, server.sockets[0].getsockname())


@dataclass(eq=False, slots=True)
class ListeningPort(Generic[P]):
    """What the connections of one TCP port share.

    Attributes:
        host: Who is reached.
        tls: What TLS needs, None for none.
        scheme: What the URL of a client begins with.
        handshakes: Those whose TLS is not agreed upon yet.
        closed: Whether nobody is taken any more, not even who has been accepted already.
    """

    host: Host[P]
    tls: ssl.SSLContext | None
    scheme: str
    handshakes: set[Handshake] = field(default_factory=set[Handshake])
    closed: bool = False

    async def aclose(self) -> None:
        """Ends those whose TLS is not agreed upon yet."""
        self.closed = True
        for handshake in list(self.handshakes):
            await cancel_and_join(handshake)


async def on_udp(
    host: Host[Any],
    stack: AsyncExitStack,
    *,
    address: str,
    port: int,
    admit: Callable[[bytes, bool], bytes | None] = lambda data, _known: data,
    on_full: Callable[[str], None] | None = None,
) -> str:
    """A UDP port, as the arm's Wi-Fi has it; returns its URL. See `DatagramEndpoint`."""
    loop = asyncio.get_running_loop()
    transport, _ = await loop.create_datagram_endpoint(
        lambda: DatagramEndpoint(host, admit=admit, on_full=on_full), local_addr=(address, port)
    )
    stack.callback(transport.close)
    return url_of("udp", transport.get_extra_info("sockname"))


def url_of(scheme: str, name: tuple[Any, ...]) -> str:
    """The URL of a socket."""
    host, port = name[:2]
    return f"{scheme}://{f'[{host}]' if ':' in host else host}:{port}"


class ClientConnection(asyncio.Protocol, Generic[P]):
    """One TCP client.

    The host hears of it before TLS is agreed upon, so that who never does it counts as well.

    Args:
        port: Where it has connected.
    """

    def __init__(self, port: ListeningPort[P]) -> None:
        self._loop = asyncio.get_running_loop()
        self._port = port
        self._handshake: Handshake | None = None
        self._early = bytearray()
        self._lost = False

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """A client has connected."""
        self._transport = cast(asyncio.Transport, transport)
        if self._port.closed:
            self._lost = True
            self._transport.abort()
            return

        self._held = self._full = False
        connection = transport.get_extra_info("socket")
        keep_alive(connection)
        self._watch = PeerWatch(connection, lambda _: self._disconnect())
        name = url_of(self._port.scheme, transport.get_extra_info("peername") or ("?", 0))
        if self._port.tls:
            agree = self._loop.start_tls(
                self._transport, self, self._port.tls, server_side=True, ssl_handshake_timeout=TLS_WITHIN
            )
            self._handshake = self._loop.create_task(agree, name=f"dobot_async TLS with {name}")
            self._handshake.add_done_callback(self._agreed)
            self._port.handshakes.add(self._handshake)

        self._client = self._port.host.client(
            self._write, self._disconnect, ordered=True, pause_reading=self._pause_reading, name=name
        )

    def data_received(self, data: bytes) -> None:
        """It has sent something."""
        if self._handshake:
            self._early += data  # it was quicker than the task that exchanges the transports
        else:
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
        if not self._lost:
            self._lost = True
            self._watch.stop()
            self._port.host.leave(self._client)

    def _agreed(self, handshake: Handshake) -> None:
        """Go on with what stands in place of the plain connection when TLS is agreed upon; else end it."""
        self._port.handshakes.discard(handshake)
        self._handshake = None
        error = None if handshake.cancelled() else handshake.exception()
        secure = None if handshake.cancelled() or error else handshake.result()
        if secure is None or self._lost:
            (secure or self._transport).abort()
            self.connection_lost(None)
        else:
            self._transport = secure
            self._flow()
            if self._early:
                self._client.send(bytes(self._early))

        if error and not isinstance(error, OSError):
            raise error  # OSError: it speaks no TLS, or has gone; there is no client to tell

    def _write(self, data: bytes) -> None:
        if not self._handshake and not self._lost:
            self._transport.write(data)

    def _disconnect(self) -> None:
        if self._handshake:
            self._handshake.cancel()
        else:
            self._transport.abort()

    def _pause_reading(self, held: bool) -> None:
        self._held = held
        self._flow()

    def _flow(self) -> None:
        if self._handshake:
            return

        if self._held or self._full:
            self._transport.pause_reading()
        else:
            self._transport.resume_reading()


class DatagramEndpoint(asyncio.DatagramProtocol, Generic[P]):
    """All UDP clients, each known by its address; a handful at a time.

    Args:
        host: Who is reached.
        admit: Called with each datagram, and whether its sender is known; returns what the host gets of it, None for
            nothing, which makes nobody a client.
        on_full: Called with who is ignored because there are enough; None lets one more take the place of the first.
    """

    def __init__(
        self,
        host: Host[P],
        *,
        admit: Callable[[bytes, bool], bytes | None] = lambda data, _: data,
        on_full: Callable[[str], None] | None = None,
    ) -> None:
        self._host = host
        self._admit = admit
        self._on_full = on_full
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
                if self._on_full:
                    self._on_full(url_of("udp", addr))
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
