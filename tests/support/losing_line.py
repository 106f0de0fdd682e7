"""A line to a simulated arm that loses the replies which a test chooses: those to motions."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from types import TracebackType
from typing import Self
from urllib.parse import urlsplit

__all__ = ["LosingLine"]

HEADER = b"\xaa\xaa"
MOTIONS = {84, 86}  # SetPTPCmd, SetPTPWithLCmd
QUEUED = 0b11
EVERY = 3


class LosingLine:
    """Passes bytes on in both directions, and loses the replies to some motions.

    Attributes:
        url: Where a program connects to.
        lost: How many replies were lost.

    Args:
        url: The simulated arm's.
        lose: How many replies are to be lost; every third one of a motion, from the second one on.
    """

    def __init__(self, url: str, lose: int) -> None:
        self.url = ""
        self.lost = 0
        self._target = urlsplit(url)
        self._lose = lose
        self._seen = 0
        self._tasks: set[asyncio.Task[None]] = set()

    async def __aenter__(self) -> Self:
        self._server = await asyncio.start_server(self._serve, "127.0.0.1", 0)
        self.url = f"tcp://127.0.0.1:{self._server.sockets[0].getsockname()[1]}"
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._server.close()
        for task in self._tasks:
            task.cancel()

        await asyncio.gather(*self._tasks, return_exceptions=True)

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task
        self._tasks.add(task)
        there, back = await asyncio.open_connection(self._target.hostname, self._target.port)
        ways = [asyncio.create_task(way) for way in (self._requests(reader, back), self._replies(there, writer))]
        try:
            await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for way in ways:
                way.cancel()

            await asyncio.gather(*ways, return_exceptions=True)
            for end in (writer, back):
                end.close()
                with suppress(OSError):
                    await end.wait_closed()

            self._tasks.discard(task)

    async def _requests(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        while data := await reader.read(4096):
            writer.write(data)

    async def _replies(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Frames are a header, a length, so many bytes (ID, Ctrl, parameters), and a checksum."""
        while True:
            head = await reader.readexactly(3)
            assert head.startswith(HEADER), "the simulated arm sends frames alone"
            body = await reader.readexactly(head[2] + 1)
            if not self._loses(body[0], body[1]):
                writer.write(head + body)

    def _loses(self, number: int, control: int) -> bool:
        if number not in MOTIONS or control & QUEUED != QUEUED:
            return False

        self._seen += 1
        if self.lost < self._lose and self._seen % EVERY == 2:
            self.lost += 1
            return True

        return False
