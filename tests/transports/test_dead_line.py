"""Lines that take no more bytes: whoever sends can be cancelled, no frame is cut, and closing is bounded.

The peers are real: sockets and a pseudo-terminal that nobody reads.
"""

from __future__ import annotations

import asyncio
import os
import socket
import ssl
import sys
import time
import tty
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager, suppress
from pathlib import Path
from typing import Any

import anyio
import pytest
import trustme
from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed

from dobot_async.transports import open_transport

if sys.platform == "win32":
    pytest.skip("needs pseudo-terminals", allow_module_level=True)

FRAME = 1000
CANCELLED_WITHIN = 0.5
CLOSED_WITHIN = 1.0


class Unread:
    """A peer that reads nothing until it is asked to.

    Args:
        url: Where it is.
        read: Returns what comes next, b"" at the end.
    """

    def __init__(self, url: str, read: Callable[[], Awaitable[bytes]]) -> None:
        self.url = url
        self.read = read


@asynccontextmanager
async def unread_tcp(_: Path, context: ssl.SSLContext | None = None, ca: str = "") -> AsyncIterator[Unread]:
    """A TCP peer, whose buffers are small."""
    connected: asyncio.Future[tuple[asyncio.StreamReader, asyncio.StreamWriter]]
    connected = asyncio.get_running_loop().create_future()

    def come(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.transport.pause_reading()  # type: ignore[attr-defined]
        connected.set_result((reader, writer))

    async def read() -> bytes:
        reader, writer = await connected
        writer.transport.resume_reading()  # type: ignore[attr-defined]
        return await reader.read(1 << 16)

    listener = socket.create_server(("127.0.0.1", 0))
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    server = await asyncio.start_server(come, sock=listener, ssl=context)
    try:
        yield Unread(f"tcp://127.0.0.1:{listener.getsockname()[1]}{ca}", read)
    finally:
        server.close()
        if connected.done():
            connected.result()[1].transport.abort()

        await server.wait_closed()


@asynccontextmanager
async def unread_tls(folder: Path) -> AsyncIterator[Unread]:
    """The same behind TLS."""
    authority = trustme.CA()
    authority.cert_pem.write_to_path(folder / "ca.pem")
    context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
    authority.issue_cert("127.0.0.1").configure_cert(context)
    async with unread_tcp(folder, context, f"?ca={folder / 'ca.pem'}") as peer:
        yield peer


@asynccontextmanager
async def unread_websocket(_: Path) -> AsyncIterator[Unread]:
    """A WebSocket, whose server reads no more than a few messages ahead."""
    go = asyncio.Event()
    arrived: asyncio.Queue[bytes] = asyncio.Queue()

    async def hear(connection: ServerConnection) -> None:
        await go.wait()
        with suppress(ConnectionClosed):
            async for message in connection:
                arrived.put_nowait(bytes(message))  # type: ignore[arg-type]

    async def read() -> bytes:
        go.set()
        return await arrived.get()

    async with serve(hear, "127.0.0.1", 0, max_queue=1, ping_interval=None, close_timeout=0.1) as server:
        try:
            yield Unread(f"ws://127.0.0.1:{next(iter(server.sockets)).getsockname()[1]}", read)
        finally:
            go.set()


@asynccontextmanager
async def unread_serial(_: Path) -> AsyncIterator[Unread]:
    """A pseudo-terminal."""
    master, slave = os.openpty()
    tty.setraw(slave)
    os.set_blocking(master, False)

    async def read() -> bytes:
        await anyio.wait_readable(master)
        return os.read(master, 1 << 16)

    try:
        yield Unread(f"serial://{os.ttyname(slave)}", read)
    finally:
        os.close(master)
        os.close(slave)


Peer = Callable[[Path], AbstractAsyncContextManager[Unread]]
each_peer = pytest.mark.parametrize("peer", [unread_tcp, unread_tls, unread_websocket, unread_serial])


def frame(number: int) -> bytes:
    """A frame that tells which one it is, and whether it is whole."""
    return b"<" + number.to_bytes(4) + bytes(FRAME - 6) + b">"


def numbers(data: bytes) -> list[int]:
    """The frames that arrived; fails if one is not whole."""
    frames = [data[start : start + FRAME] for start in range(0, len(data), FRAME)]
    found = [int.from_bytes(each[1:5]) for each in frames]
    assert frames == [frame(number) for number in found]
    return found


async def fill(transport: Any) -> tuple[int, list[int]]:
    """Sends until a send waits, cancels it and three more; returns how many frames went, and which were cancelled."""
    number = 0
    cancelled: list[int] = []
    while len(cancelled) < 4:
        number += 1
        sending = asyncio.create_task(transport.send(frame(number)))
        await asyncio.wait([sending], timeout=0.1 if not cancelled else 0.02)
        if not sending.done():
            begun = time.monotonic()
            sending.cancel()
            await asyncio.wait([sending], timeout=5)
            assert sending.cancelled()
            assert time.monotonic() - begun < CANCELLED_WITHIN
            cancelled.append(number)

    return number, cancelled


@pytest.mark.cases(2)
@each_peer
async def test_a_cancelled_send_returns_at_once_and_cuts_no_frame(peer: Peer, tmp_path: Path) -> None:
    async with peer(tmp_path) as unread:
        transport: Any = await open_transport(unread.url, arm="magician")
        try:
            last, cancelled = await fill(transport)
            sending = asyncio.create_task(transport.send(frame(last + 1)))
            received = b""
            while not received.endswith(frame(last + 1)):
                received += await unread.read()

            await sending
        finally:
            await transport.aclose()

    arrived = numbers(received)
    assert arrived == sorted(set(arrived))
    assert set(range(1, last + 2)) - set(arrived) <= set(cancelled)


@each_peer
async def test_closing_is_bounded_on_a_line_that_takes_nothing(peer: Peer, tmp_path: Path) -> None:
    async with peer(tmp_path) as unread:
        transport: Any = await open_transport(unread.url, arm="magician")
        await fill(transport)
        sending = asyncio.create_task(transport.send(frame(0)))
        receiving = asyncio.create_task(transport.receive())
        await asyncio.sleep(0.01)
        begun = time.monotonic()
        await transport.aclose()
        took = time.monotonic() - begun
        print(f"{unread.url}: closed in {took:.2f} s")  # noqa: T201
        assert took < CLOSED_WITHIN
        await asyncio.wait([sending, receiving], timeout=0.5)
        for task in (sending, receiving):
            assert isinstance(task.exception(), (anyio.ClosedResourceError, anyio.BrokenResourceError))


@each_peer
async def test_a_cancelled_close_on_such_a_line_closes_nevertheless(peer: Peer, tmp_path: Path) -> None:
    async with peer(tmp_path) as unread:
        transport: Any = await open_transport(unread.url, arm="magician")
        await fill(transport)
        closing = asyncio.create_task(transport.aclose())
        await asyncio.sleep(0.01)
        begun = time.monotonic()
        closing.cancel()
        await asyncio.wait([closing], timeout=5)
        assert closing.cancelled()
        assert time.monotonic() - begun < CANCELLED_WITHIN
        await transport.aclose()
        assert time.monotonic() - begun < CLOSED_WITHIN
        with pytest.raises(anyio.ClosedResourceError):
            await transport.send(b"x")


async def test_closing_a_udp_socket_takes_no_time() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as peer:
        peer.bind(("127.0.0.1", 0))
        transport = await open_transport(f"udp://127.0.0.1:{peer.getsockname()[1]}", arm="magician")
        for number in range(2000):
            await transport.send(frame(number))

        begun = time.monotonic()
        await transport.aclose()
        assert time.monotonic() - begun < CLOSED_WITHIN
