"""A transport on asyncio's own transports, for bytes in their order: what serial ports and TCP have in common.

1. A frame is handed to the output whole. A `send` that is cancelled has sent all of it or nothing of it, and returns at
   once: it only ever waits for room.
2. What arrives is handed over as it does (`deliver`), or kept until somebody asks (`receive`), up to `BUFFER` bytes.
3. `aclose` waits `DRAIN` seconds for the output, then throws the rest away.
"""

from __future__ import annotations

import asyncio
from abc import abstractmethod
from collections.abc import Callable
from typing import Any

import anyio

from dobot_async._core.protocol.transport import MANY
from dobot_async.transports.input_buffer import BUFFER, InputBuffer

__all__ = ["DRAIN", "WINDOW", "ByteStreamTransport"]

WINDOW = 16
DRAIN = 0.5


class ByteStreamTransport(InputBuffer, asyncio.Protocol):
    """An open connection or port; made by asyncio, which calls what is no verb of a transport."""

    in_flight = MANY
    window = WINDOW
    reorder_window: float = 0.0

    def __init__(self) -> None:
        super().__init__()
        self._transport: Any = None
        self._take: Callable[[bytes], None] | None = None
        self._writable = asyncio.Event()
        self._writable.set()

    async def send(self, data: bytes) -> None:
        """Write one frame; wait while the output is full, before it and after it."""
        await self._room()
        self._put(data)
        await self._room()

    def write(self, data: bytes) -> bool:
        """Write one frame now; return False if the output is full or the connection is gone."""
        if self._closed or self._lost.done() or not self._writable.is_set():
            return False

        self._put(data)
        return True

    async def receive(self) -> bytes:
        """Return what has arrived, at least one byte."""
        data = await super().receive()
        if not self._lost.done():
            self._transport.resume_reading()

        return data

    async def deliver(self, take: Callable[[bytes], None]) -> None:
        """Hand over what arrives as soon as it does; raise as `receive` when nothing more does."""
        if self._buffer:
            take(await self.receive())

        self._take = take
        try:
            while True:
                await self._arrival()
        finally:
            self._take = None

    async def aclose(self) -> None:
        """Close it; what cannot be written within half a second is thrown away."""
        if not self._closed:
            self._closed = True
            self._wake()
            try:
                await self._drain()
            finally:
                self._abort()

        await asyncio.shield(self._lost)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Keep what asyncio made; it is open."""
        self._transport = transport

    def data_received(self, data: bytes) -> None:
        """Hand over what arrives, or keep it; stop reading while nobody takes it."""
        if self._take:
            try:
                self._take(data)
            except Exception as error:  # noqa: BLE001 - it is raised where `deliver` is awaited
                self._take = None
                if self._arrived and not self._arrived.done():
                    self._arrived.set_exception(error)

            return

        self._buffer += data
        if len(self._buffer) > BUFFER:
            self._transport.pause_reading()

        self._wake()

    def connection_lost(self, exc: Exception | None) -> None:
        """Note that it is gone or closed; called once."""
        self._cause = exc or self._cause
        self._lost.set_result(None)
        self._writable.set()
        self._wake()

    def pause_writing(self) -> None:
        """Note that the output is full."""
        self._writable.clear()

    def resume_writing(self) -> None:
        """Note that the output has room again."""
        self._writable.set()

    def _put(self, data: bytes) -> None:
        """Hand bytes to the output."""
        self._transport.write(data)

    async def _room(self) -> None:
        """Wait until the output has room; raise if it never will."""
        self._check()
        while not self._writable.is_set():
            await self._writable.wait()
            self._check()

    def _check_input(self) -> None:
        if self._lost.done() and not self._closed and not self._cause:
            raise anyio.EndOfStream

        self._check()

    @abstractmethod
    async def _drain(self) -> None:
        """Wait for the output, no longer than `DRAIN`."""

    @abstractmethod
    def _abort(self) -> None:
        """End what asyncio made, unless it has ended; `connection_lost` follows."""
