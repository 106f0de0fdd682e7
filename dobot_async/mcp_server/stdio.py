"""One client by standard input and output: a JSON-RPC message a line.

    stdin --thread--> lines --> messages --> server --> messages --> lines --thread--> stdout

Reading and writing block, so each has a thread of its own that nothing waits for: the server ends at once when it is
told to, whether its client says something, reads, or does neither. When the input ends the client is gone.
"""

from __future__ import annotations

import asyncio
import logging
import os
import threading
from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager, suppress
from functools import partial
from queue import SimpleQueue

import anyio
from anyio.abc import ObjectReceiveStream, ObjectSendStream
from mcp.shared.message import SessionMessage
from mcp_types import jsonrpc_message_adapter

from dobot_async._core.util.tasks import cancel_and_join
from dobot_async.mcp_server.server import ArmServer, Messages

__all__ = ["serve_stdio"]

logger: logging.Logger = logging.getLogger("dobot_async.mcp")
LONGEST = 4 << 20
"""Bytes of a line; who sends a longer one is cut off."""

AHEAD = 64
"""Lines that are read before they are wanted."""


class LineReader:
    """The lines of a file descriptor, read by a thread; `None` is the end.

    Args:
        number: The descriptor.
    """

    def __init__(self, number: int) -> None:
        self.lines: asyncio.Queue[bytes | None] = asyncio.Queue()
        self._number = number
        self._loop = asyncio.get_running_loop()
        self._room = threading.Semaphore(AHEAD)
        threading.Thread(target=self._read, name="dobot_async mcp stdin", daemon=True).start()

    async def next(self) -> bytes | None:
        """Return the next line, None at the end."""
        line = await self.lines.get()
        self._room.release()
        return line

    def _read(self) -> None:
        rest = b""
        with suppress(OSError):
            while data := os.read(self._number, 1 << 16):
                *whole, rest = (rest + data).split(b"\n")
                for line in whole:
                    self._put(line)

                if len(rest) > LONGEST:
                    break

        self._put(None)

    def _put(self, line: bytes | None) -> None:
        self._room.acquire()
        with suppress(RuntimeError):  # the loop has ended, and nobody wants it any more
            self._loop.call_soon_threadsafe(self.lines.put_nowait, line)


class LineWriter:
    """Lines to a file descriptor, written by a thread.

    Args:
        number: The descriptor.
        broken: Called when nobody reads it any more.
    """

    def __init__(self, number: int, broken: Callable[[], None]) -> None:
        self._number = number
        self._broken = broken
        self._loop = asyncio.get_running_loop()
        self._waiting: SimpleQueue[tuple[bytes, asyncio.Future[None]] | None] = SimpleQueue()
        threading.Thread(target=self._write, name="dobot_async mcp stdout", daemon=True).start()

    async def write(self, line: bytes) -> None:
        """Return when a line is written."""
        written: asyncio.Future[None] = self._loop.create_future()
        self._waiting.put((line, written))
        await written

    def close(self) -> None:
        """Let the thread end when it has written what there is."""
        self._waiting.put(None)

    def _write(self) -> None:
        while found := self._waiting.get():
            line, written = found
            try:
                data = memoryview(line)
                while data:
                    data = data[os.write(self._number, data) :]
            except OSError:
                self._tell(self._broken)
                return

            self._tell(partial(settle, written))

    def _tell(self, what: Callable[[], object]) -> None:
        with suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(what)


def settle(done: asyncio.Future[None]) -> None:
    """Let who waits go on, if anybody still does."""
    if not done.done():
        done.set_result(None)


@asynccontextmanager
async def standard_streams(stdin: int, stdout: int) -> AsyncGenerator[Messages]:
    """The messages of the client at two file descriptors."""
    to_server, incoming = anyio.create_memory_object_stream[SessionMessage | Exception](0)
    outgoing, from_server = anyio.create_memory_object_stream[SessionMessage](0)
    gone = asyncio.Event()
    writer = LineWriter(stdout, gone.set)
    tasks = [
        asyncio.create_task(take_in(LineReader(stdin), to_server, gone), name="dobot_async mcp in"),
        asyncio.create_task(hand_out(writer, from_server), name="dobot_async mcp out"),
    ]
    try:
        yield Messages(incoming, outgoing)
    finally:
        for task in tasks:
            await cancel_and_join(task)

        writer.close()
        for stream in (to_server, incoming, outgoing, from_server):
            stream.close()


async def take_in(
    lines: LineReader, to_server: ObjectSendStream[SessionMessage | Exception], gone: asyncio.Event
) -> None:
    """Pass on what the client says, until it is gone."""
    leaving = asyncio.create_task(gone.wait(), name="dobot_async mcp reader gone")
    try:
        while True:
            reading = asyncio.create_task(lines.next(), name="dobot_async mcp line")
            try:
                await asyncio.wait([reading, leaving], return_when=asyncio.FIRST_COMPLETED)
                line = reading.result() if reading.done() else None
            finally:
                await cancel_and_join(reading)

            if line is None:
                return

            try:
                message = SessionMessage(jsonrpc_message_adapter.validate_json(line, by_name=False))
            except ValueError as error:
                await to_server.send(error)
            else:
                await to_server.send(message)
    except (anyio.BrokenResourceError, anyio.ClosedResourceError):
        pass  # the server has ended
    finally:
        await cancel_and_join(leaving)
        await to_server.aclose()


async def hand_out(writer: LineWriter, from_server: ObjectReceiveStream[SessionMessage]) -> None:
    """Tell the client what the server says."""
    async with from_server:
        async for told in from_server:
            text = told.message.model_dump_json(by_alias=True, exclude_unset=True)
            await writer.write(text.encode() + b"\n")


async def serve_stdio(server: ArmServer, *, stdin: int = 0, stdout: int = 1) -> None:
    """Serve the client at standard input and output, until it is gone.

    Args:
        server: Of `make_server`.
        stdin: The file descriptor that the client writes to.
        stdout: The one that it reads.
    """
    async with standard_streams(stdin, stdout) as messages:
        await server.serve(messages)
