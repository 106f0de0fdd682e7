"""TCP and UDP over the real loopback: the test holds the arm's end."""

from __future__ import annotations

import asyncio
import socket
import ssl
import struct
from collections.abc import AsyncIterator, Callable
from contextlib import AsyncExitStack, aclosing, asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import anyio
import pytest
import trustme

from dobot_async._core.link.link import Link
from dobot_async._core.protocol.contract import LinkState
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.frame import Frame, Parser, request
from dobot_async.errors import ConnectFailed, ConnectionLost, ReplyTimeout
from dobot_async.transports import open_transport

POSE = c.Pose(*map(float, range(8)))
POSE_REPLY = Frame(10, 0, struct.pack("<8f", *range(8)))
BARRIERS = [request(row, b"", queued=False) for row in (c.GET_POSE, c.GET_ALARMS_STATE)]
POSE_REQUEST = bytes.fromhex("aa aa 02 0a 00 f6")
HOSTS = ["127.0.0.1", "[::1]"]


def has_ipv6() -> bool:
    """Whether the loopback speaks IPv6 here."""
    try:
        with socket.socket(socket.AF_INET6) as probe:
            probe.bind(("::1", 0))
    except OSError:
        return False

    return True


@pytest.fixture(params=HOSTS)
def host(request: pytest.FixtureRequest) -> str:
    """An address of this machine, as it stands in a URL."""
    if request.param == "[::1]" and not has_ipv6():
        pytest.skip("no IPv6 here")

    return str(request.param)


@asynccontextmanager
async def linked(url: str) -> AsyncIterator[Link[Frame]]:
    """A link to a URL."""
    transport = await open_transport(url, arm="magician")
    async with aclosing(Link(transport, Parser(), request, url=url, barriers=BARRIERS)) as link:
        yield link


class TcpPeer:
    """A serial server for one client."""

    def __init__(self) -> None:
        self.connected: asyncio.Future[tuple[asyncio.StreamReader, asyncio.StreamWriter]] = (
            asyncio.get_running_loop().create_future()
        )
        self.url = ""

    async def read(self, size: int) -> bytes:
        """Returns exactly so many bytes of the client."""
        reader, _ = await self.connected
        return await reader.readexactly(size)

    async def write(self, data: bytes) -> None:
        """Sends something to the client."""
        _, writer = await self.connected
        writer.write(data)
        await writer.drain()

    async def disconnect(self, *, reset: bool = False) -> None:
        """Ends the connection."""
        _, writer = await self.connected
        if reset:
            peer = writer.get_extra_info("socket")
            peer.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            writer.transport.abort()
        else:
            writer.close()


@asynccontextmanager
async def tcp_peer(host: str = "127.0.0.1") -> AsyncIterator[TcpPeer]:
    """Listens at a free port."""
    peer = TcpPeer()
    server = await asyncio.start_server(lambda *streams: peer.connected.set_result(streams), host.strip("[]"), 0)
    peer.url = f"tcp://{host}:{server.sockets[0].getsockname()[1]}"
    try:
        yield peer
    finally:
        server.close()
        for _ in range(5):
            await asyncio.sleep(0)  # somebody may have come just now

        if peer.connected.done():
            peer.connected.result()[1].transport.abort()

        await server.wait_closed()


class UdpPeer(asyncio.DatagramProtocol):
    """An arm at a UDP port."""

    def __init__(self) -> None:
        self.received: asyncio.Queue[tuple[bytes, Any]] = asyncio.Queue()
        self.url = ""

    def connection_made(self, transport: Any) -> None:
        """The port is open."""
        self.transport: asyncio.DatagramTransport = transport

    def datagram_received(self, data: bytes, addr: Any) -> None:
        """The client has sent something."""
        self.received.put_nowait((data, addr))

    async def answer(self, *datagrams: bytes) -> bytes:
        """Waits for a datagram, sends others back, and returns the one that came."""
        data, client = await self.received.get()
        for datagram in datagrams:
            self.transport.sendto(datagram, client)

        return data


@asynccontextmanager
async def udp_peer(host: str = "127.0.0.1", port: int = 0) -> AsyncIterator[UdpPeer]:
    """Listens at a UDP port."""
    loop = asyncio.get_running_loop()
    transport, peer = await loop.create_datagram_endpoint(UdpPeer, local_addr=(host.strip("[]"), port))
    peer.url = f"udp://{host}:{transport.get_extra_info('sockname')[1]}"
    try:
        yield peer
    finally:
        transport.close()


def free_port(kind: socket.SocketKind) -> int:
    """A port at which nobody listens."""
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


# TCP


async def test_tcp_round_trip(host: str) -> None:
    async with tcp_peer(host) as peer, linked(peer.url) as link:
        call = asyncio.create_task(link.request(c.GET_POSE, None))
        assert await peer.read(6) == POSE_REQUEST
        await peer.write(bytes(POSE_REPLY))
        assert await call == POSE


async def test_tcp_does_not_take_itself_for_an_arm(monkeypatch: pytest.MonkeyPatch) -> None:
    port = free_port(socket.SOCK_STREAM)
    loop = asyncio.get_running_loop()
    create_connection: Callable[..., Any] = loop.create_connection

    def from_where_it_leads(*arguments: Any, **options: Any) -> Any:
        return create_connection(*arguments, **{**options, "local_addr": ("127.0.0.1", port)})

    monkeypatch.setattr(loop, "create_connection", from_where_it_leads)
    with pytest.raises(ConnectFailed, match="nobody listens there"):
        await open_transport(f"tcp://127.0.0.1:{port}", arm="magician")


async def test_tcp_to_a_peer_that_hangs_up_at_once_is_opened_and_then_broken(monkeypatch: pytest.MonkeyPatch) -> None:
    loop = asyncio.get_running_loop()
    create_connection: Callable[..., Any] = loop.create_connection
    with socket.create_server(("127.0.0.1", 0)) as server:

        async def and_is_reset(*arguments: Any, **options: Any) -> Any:
            made = await create_connection(*arguments, **options)
            peer, _ = server.accept()
            peer.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            peer.close()
            return made

        monkeypatch.setattr(loop, "create_connection", and_is_reset)
        transport = await open_transport(f"tcp://127.0.0.1:{server.getsockname()[1]}", arm="magician")
        async with aclosing(transport):
            with pytest.raises(anyio.BrokenResourceError):
                await transport.receive()


async def test_tcp_frames_may_be_cut_anywhere() -> None:
    async with tcp_peer() as peer, linked(peer.url) as link:
        call = asyncio.create_task(link.request(c.GET_POSE, None))
        await peer.read(6)
        for byte in bytes(POSE_REPLY):
            await peer.write(bytes((byte,)))
            await asyncio.sleep(0)

        assert await call == POSE


async def test_tcp_frames_may_come_together() -> None:
    async with tcp_peer() as peer, linked(peer.url) as link:
        calls = [asyncio.create_task(link.request(command, None)) for command in (c.GET_POSE, c.GET_DEVICE_NAME)]
        await peer.read(12)
        await peer.write(b"junk" + bytes(POSE_REPLY) + bytes(Frame(1, 0, b"arm\0")))
        assert await asyncio.gather(*calls) == [POSE, "arm"]


@pytest.mark.parametrize("reset", [False, True])
async def test_a_tcp_peer_that_hangs_up_ends_the_link(reset: bool) -> None:
    async with tcp_peer() as peer, linked(peer.url) as link:
        call = asyncio.create_task(link.request(c.GET_POSE, None, timeout=60))
        await peer.read(6)
        await peer.disconnect(reset=reset)
        with pytest.raises(ConnectionLost) as lost:
            await call

        assert isinstance(lost.value.__cause__, ConnectionResetError if reset else anyio.EndOfStream)
        assert link.state.value is LinkState.LOST
        with pytest.raises(ConnectionLost):
            await link.request(c.GET_POSE, None)


async def test_a_tcp_peer_that_never_reads_does_not_hold_up_closing() -> None:
    async with tcp_peer() as peer:
        transport = await open_transport(peer.url, arm="magician")
        sending = asyncio.create_task(transport.send(bytes(1 << 24)))
        await peer.connected
        for _ in range(10):
            await asyncio.sleep(0)

        assert not sending.done()
        await transport.aclose()
        await asyncio.wait([sending])
        assert isinstance(sending.exception(), (anyio.ClosedResourceError, anyio.BrokenResourceError))


async def test_tcp_closes_once_and_for_all() -> None:
    async with tcp_peer() as peer:
        transport = await open_transport(peer.url, arm="magician")
        await transport.aclose()
        await transport.aclose()
        with pytest.raises(anyio.ClosedResourceError):
            await transport.send(b"x")

        with pytest.raises(anyio.ClosedResourceError):
            await transport.receive()


async def test_nobody_behind_a_tcp_port_says_what_to_check() -> None:
    url = f"tcp://127.0.0.1:{free_port(socket.SOCK_STREAM)}"
    with pytest.raises(ConnectFailed, match=rf"cannot reach {url}: .*is the address right") as failed:
        await open_transport(url, arm="magician")

    assert isinstance(failed.value.__cause__, OSError)


async def test_connecting_over_tcp_may_be_cancelled_anywhere() -> None:
    for steps in range(6):
        async with tcp_peer() as peer:
            opening = asyncio.create_task(open_transport(peer.url, arm="magician"))
            for _ in range(steps):
                await asyncio.sleep(0)

            opening.cancel()
            await asyncio.wait([opening])
            if not opening.cancelled():
                await opening.result().aclose()


# TLS


@dataclass
class Fence:
    """A port behind which somebody hangs up on the first callers in the middle of the handshake."""

    port: int
    hang_ups: int
    reset: bool
    calls: int = 0


@asynccontextmanager
async def hanging_up(hang_ups: int, certificate: trustme.LeafCert, *, reset: bool = False) -> AsyncIterator[Fence]:
    """Hangs up on some callers, then lets the others through to a TLS server that answers with poses."""
    tls = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
    certificate.configure_cert(tls)

    async def answer(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        fence.calls += 1
        if fence.calls <= fence.hang_ups:
            await reader.read(1)
            if fence.reset:
                linger = struct.pack("ii", 1, 0)
                writer.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, linger)

            writer.transport.abort()
            return

        await writer.start_tls(tls)
        while await reader.read(100):
            writer.write(bytes(POSE_REPLY))

        writer.close()

    server = await asyncio.start_server(answer, "127.0.0.1", 0)
    fence = Fence(server.sockets[0].getsockname()[1], hang_ups, reset)
    try:
        yield fence
    finally:
        server.close()
        await server.wait_closed()
        await asyncio.sleep(0.01)


@pytest.fixture(scope="module")
def authority() -> trustme.CA:
    """Who signs certificates."""
    return trustme.CA()


@pytest.fixture
def ca(authority: trustme.CA, tmp_path: Path) -> Path:
    """Its own certificate, as a file."""
    authority.cert_pem.write_to_path(tmp_path / "ca.pem")
    return tmp_path / "ca.pem"


@pytest.mark.parametrize("reset", [False, True])
@pytest.mark.parametrize("scheme", ["tcp", "wss"])
async def test_a_hang_up_in_the_tls_handshake_is_a_failed_connection(
    scheme: str, reset: bool, authority: trustme.CA, ca: Path
) -> None:
    async with hanging_up(1, authority.issue_cert("127.0.0.1"), reset=reset) as fence:
        with pytest.raises(ConnectFailed, match=r"cannot reach .*is the address right"):
            await open_transport(f"{scheme}://127.0.0.1:{fence.port}?ca={ca}", arm="magician")


async def test_a_hang_up_in_the_tls_handshake_is_tried_again_where_a_link_is_reopened(
    authority: trustme.CA, ca: Path
) -> None:
    async with hanging_up(0, authority.issue_cert("127.0.0.1")) as fence:
        url = f"tcp://127.0.0.1:{fence.port}?ca={ca}"

        async def reopen() -> Any:
            return await open_transport(url, arm="magician")

        link = Link(await reopen(), Parser(), request, url=url, barriers=BARRIERS, reopen=reopen)
        async with aclosing(link):
            assert await link.request(c.GET_POSE, None) == POSE
            fence.hang_ups = fence.calls + 2
            link._transport._transport.abort()  # type: ignore[attr-defined]
            async for state in link.state:
                if state is LinkState.OPEN and link.outages:
                    break

            assert await link.request(c.GET_POSE, None) == POSE
            assert fence.calls == fence.hang_ups + 1


async def test_tls_round_trip_and_a_certificate_that_is_not_trusted(authority: trustme.CA, ca: Path) -> None:
    async with hanging_up(0, authority.issue_cert("127.0.0.1")) as fence:
        async with linked(f"tcp://127.0.0.1:{fence.port}?ca={ca}") as link:
            assert await link.request(c.GET_POSE, None) == POSE

        with pytest.raises(ConnectFailed, match="CERTIFICATE_VERIFY_FAILED"):
            await open_transport(f"tcp://127.0.0.1:{fence.port}?ca=system", arm="magician")


# UDP


async def test_udp_round_trip(host: str) -> None:
    async with udp_peer(host) as peer, linked(peer.url) as link:
        call = asyncio.create_task(link.request(c.GET_POSE, None))
        assert await peer.answer(bytes(POSE_REPLY)) == POSE_REQUEST
        assert await call == POSE


async def test_udp_has_a_port_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[str, int]] = []

    async def record(host: str, port: int) -> None:
        asked.append((host, port))
        raise ConnectionRefusedError

    monkeypatch.setattr(anyio, "create_connected_udp_socket", record)
    for url in ("udp://192.168.1.20", "udp://[::1]", "udp://arm.local/", "udp://ARM:1234"):
        with pytest.raises(ConnectFailed):
            await open_transport(url, arm="magician")

    assert asked == [("192.168.1.20", 8899), ("::1", 8899), ("arm.local", 8899), ("arm", 1234)]


@pytest.mark.parametrize(
    "cut",
    [
        lambda data: [data[:3], data[3:]],
        lambda data: [bytes((byte,)) for byte in data],
        lambda data: [b"", data],
        lambda data: [b"\x00garbage\xaa", data],
        lambda data: [b"\xaa\xaa\x02\x00\x00\x01", data + data],
        lambda data: [b"junk" + data + b"junk"],
    ],
)
async def test_udp_datagrams_are_a_stream(cut: Callable[[bytes], list[bytes]]) -> None:
    async with udp_peer() as peer, linked(peer.url) as link:
        call = asyncio.create_task(link.request(c.GET_POSE, None))
        await peer.answer(*cut(bytes(POSE_REPLY)))
        assert await call == POSE
        assert link.state.value is LinkState.OPEN


async def test_a_lost_datagram_is_mended_by_the_repetition() -> None:
    async with udp_peer() as peer, linked(peer.url) as link:
        call = asyncio.create_task(link.request(c.GET_POSE, None, timeout=0.3))
        await peer.answer()
        await peer.answer(bytes(POSE_REPLY))
        assert await call == POSE
        assert link.stats.sent == 2


async def test_over_udp_one_request_is_under_way_at_a_time() -> None:
    async with udp_peer() as peer, linked(peer.url) as link:
        calls = [asyncio.create_task(link.request(command, None)) for command in (c.GET_POSE, c.GET_DEVICE_NAME)]
        _, client = await peer.received.get()
        for _ in range(10):
            await asyncio.sleep(0)

        assert peer.received.empty()
        peer.transport.sendto(bytes(POSE_REPLY), client)
        await peer.answer(bytes(Frame(1, 0, b"arm\0")))
        assert await asyncio.gather(*calls) == [POSE, "arm"]


async def test_a_closed_udp_port_is_silence_and_may_open_later() -> None:
    port = free_port(socket.SOCK_DGRAM)
    async with AsyncExitStack() as stack:
        link = await stack.enter_async_context(linked(f"udp://127.0.0.1:{port}"))
        for _ in range(2):
            with pytest.raises(ReplyTimeout):
                await link.request(c.GET_POSE, None, timeout=0.03)

        assert link.state.value is LinkState.OPEN
        peer = await stack.enter_async_context(udp_peer(port=port))
        call = asyncio.create_task(link.request(c.GET_POSE, None))
        answering = asyncio.create_task(answer_all(peer))
        assert await call == POSE
        answering.cancel()
        await asyncio.wait([answering])


async def answer_all(peer: UdpPeer) -> None:
    """Answers whatever comes with a pose."""
    while True:
        await peer.answer(bytes(POSE_REPLY))


async def test_udp_closes_once_and_for_all() -> None:
    async with udp_peer() as peer:
        transport = await open_transport(peer.url, arm="magician")
        receiving = asyncio.create_task(transport.receive())
        await asyncio.sleep(0)
        await transport.aclose()
        await transport.aclose()
        with pytest.raises(anyio.ClosedResourceError):
            await receiving

        with pytest.raises(anyio.ClosedResourceError):
            await transport.send(b"x")


@pytest.mark.parametrize(("scheme", "in_flight", "window"), [("tcp", 8, 16), ("udp", 1, 1)])
async def test_a_transport_states_its_limits(scheme: str, in_flight: int, window: int) -> None:
    async with tcp_peer() if scheme == "tcp" else udp_peer() as peer:
        transport = await open_transport(peer.url, arm="magician")
        assert (transport.in_flight, transport.window) == (in_flight, window)
        await transport.aclose()
