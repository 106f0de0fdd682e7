"""The least that an asyncio program can do to talk to a Magician: what the driver is measured against.

It trusts the line. Answers belong to requests in the order in which they were sent; nothing is lost, late or doubled,
nobody gives up, nothing is reopened, and no queue ever runs out of room. Only the checksum is looked at.
"""

from __future__ import annotations

import asyncio
import os
import struct
import tty
from collections import deque
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager

from dobot_async.transports import open_transport

__all__ = ["CURRENT_INDEX", "GET_POSE", "LEFT_SPACE", "START", "Minimal", "connect", "cp", "framed", "ptp"]

BUFFER = 4096
READ, WRITE, WRITE_QUEUED = 0b00, 0b01, 0b11
POSE = struct.Struct("<8f")
POINT = struct.Struct("<B4f")
INDEX = struct.Struct("<Q")


def framed(number: int, ctrl: int, params: bytes = b"") -> bytes:
    """A request's bytes."""
    payload = bytes((number, ctrl)) + params
    return b"\xaa\xaa" + bytes((len(payload),)) + payload + bytes((-sum(payload) & 0xFF,))


GET_POSE = framed(10, READ)
CURRENT_INDEX = framed(246, READ)
LEFT_SPACE = framed(247, READ)
START = framed(240, WRITE)


def ptp(x: float, y: float, z: float, r: float = 0.0) -> bytes:
    """A queued motion on a line."""
    return framed(84, WRITE_QUEUED, POINT.pack(2, x, y, z, r))


def cp(x: float, y: float, z: float) -> bytes:
    """A queued point of a continuous path."""
    return framed(91, WRITE_QUEUED, POINT.pack(1, x, y, z, 100.0))


class Minimal:
    """A client.

    Args:
        write: Sends bytes.
    """

    def __init__(self, write: Callable[[bytes], Awaitable[None]]) -> None:
        self._write = write
        self._loop = asyncio.get_running_loop()
        self._buffer = b""
        self._waiting: deque[asyncio.Future[bytes]] = deque()

    async def post(self, request: bytes) -> asyncio.Future[bytes]:
        """Sends a request; returns where the parameters of its answer will be."""
        answer: asyncio.Future[bytes] = self._loop.create_future()
        self._waiting.append(answer)
        await self._write(request)
        return answer

    async def request(self, request: bytes) -> bytes:
        """Sends a request and returns the parameters of its answer."""
        return await (await self.post(request))

    async def get_pose(self) -> tuple[float, ...]:
        """Reads the pose."""
        return POSE.unpack(await self.request(GET_POSE))

    async def queue(self, request: bytes) -> int:
        """Queues a command; returns its index."""
        index: int = INDEX.unpack(await self.request(request))[0]
        return index

    async def done(self, index: int) -> int:
        """Returns when a command has been executed: asks for nothing else, as fast as it is answered."""
        asked = 1
        while INDEX.unpack(await self.request(CURRENT_INDEX))[0] != index:
            asked += 1

        return asked

    def received(self, data: bytes) -> None:
        """Takes the next bytes of the line."""
        buffer = self._buffer + data
        at = 0
        while len(buffer) - at > 3:
            end = at + 4 + buffer[at + 2]
            if end > len(buffer):
                break

            if sum(buffer[at + 3 : end]) & 0xFF == 0:
                self._waiting.popleft().set_result(buffer[at + 5 : end - 1])

            at = end

        self._buffer = buffer[at:]


@asynccontextmanager
async def connect(url: str) -> AsyncIterator[Minimal]:
    """Opens `serial:///dev/...` as a bare descriptor, and anything else with the driver's own transports."""
    if url.startswith("serial://"):
        async with on_port(url.removeprefix("serial://")) as client:
            yield client

        return

    transport = await open_transport(url, arm="magician")
    client = Minimal(transport.send)

    async def read() -> None:
        while True:
            client.received(await transport.receive())

    reading = asyncio.create_task(read())
    try:
        yield client
    finally:
        reading.cancel()
        await asyncio.wait([reading])
        await transport.aclose()


@asynccontextmanager
async def on_port(path: str) -> AsyncIterator[Minimal]:
    """A serial port."""
    loop = asyncio.get_running_loop()
    port = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    tty.setraw(port)

    async def write(data: bytes) -> None:
        os.write(port, data)

    client = Minimal(write)
    loop.add_reader(port, lambda: client.received(os.read(port, BUFFER)))
    try:
        yield client
    finally:
        loop.remove_reader(port)
        os.close(port)
