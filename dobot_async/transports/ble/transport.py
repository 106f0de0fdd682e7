"""Bluetooth Low Energy through bleak: the arm's BLE module passes bytes on to a serial port of the arm.

    send    --> chunks of MTU - 3 bytes --> writes on 0003CDD2, one at a time --> module --> arm
    receive <-- notifications on 0003CDD1, cut anywhere                       <-- module <--

A chunk goes out `PACE` seconds after the one before it went out, and not before the system has taken that, as the
vendor's apps do it: neither the system nor the module says when it has room for the next one. The answer of the arm
does, so a new frame need not wait after one. For the same reason one request is unanswered at a time.

A frame that has begun is sent to its end, whatever becomes of the caller: half of one would spoil the next. Every call
of bleak's races against the end of the connection and a deadline, for some of them never return when the peer is gone.
Each connection has a bleak client of its own, which is told to disconnect in any case: it leaks a descriptor otherwise.
"""

from __future__ import annotations

import asyncio
import math
import sys
from contextlib import suppress
from typing import Any

import anyio
from bleak import BleakClient
from bleak.args.bluez import BlueZClientArgs
from bleak.backends.characteristic import BleakGATTCharacteristic
from bleak.exc import BleakCharacteristicNotFoundError

from dobot_async._core.util.tasks import Ended, run_shielded, run_within
from dobot_async.transports.ble.diagnostics import trouble
from dobot_async.transports.ble.lock import DeviceLock
from dobot_async.transports.ble.scan import INPUT, OUTPUT, SeenDevice
from dobot_async.transports.input_buffer import BUFFER, InputBuffer

__all__ = ["PACE", "BleTransport"]

PACE = 0.02
TICK = 0.001
CONNECT = 20.0
GATT = 5.0
"""Seconds after which a write that has not come back means that the connection is dead."""

DISCONNECT = 6.0
LAST_FRAME = 1.0
LARGEST = 244


class BleTransport(InputBuffer):
    """A connection to one arm's BLE module; used once.

    Attributes:
        url: Leads to this very module, whatever else is in range.
    """

    in_flight = 1
    window = 1
    reorder_window: float = 0.0

    def __init__(self, seen: SeenDevice, *, url: str, pace: float, adapter: str | None, lock: DeviceLock) -> None:
        super().__init__()
        self.url = url
        self._lock = lock
        self._pace = pace
        self._client = BleakClient(
            seen.device,
            lambda _: self._lose(None),
            timeout=CONNECT,
            bluez=BlueZClientArgs(adapter=adapter) if adapter else BlueZClientArgs(),
        )
        self._turn = anyio.Lock()
        self._frame: asyncio.Task[None] | None = None
        self._closing: asyncio.Task[None] | None = None
        self._handed_over = -math.inf
        self._answered = False

    async def connect(self) -> None:
        """Connects, and asks for the notifications; raises what bleak does."""
        await run_shielded(check_version())
        await self._call(self._client.connect(), CONNECT)
        self._output = self._characteristic(OUTPUT)
        self._response = "write-without-response" not in self._output.properties
        await self._call(self._client.start_notify(self._characteristic(INPUT), self._receive), GATT)

    async def send(self, data: bytes) -> None:
        """Writes one frame, chunk by chunk."""
        async with self._turn:
            if self._frame:
                await asyncio.wait([self._frame])

            self._check()
            self._frame = self._loop.create_task(self._write(data))
            await asyncio.shield(self._frame)
            self._check()

    async def aclose(self) -> None:
        """Disconnects. If the caller is cancelled it goes on, for it may take seconds, and leaks if it is cut short."""
        self._closed = True
        if not self._closing:
            self._closing = self._loop.create_task(self._close())

        self._wake()
        await asyncio.shield(self._closing)

    def _characteristic(self, uuid: str) -> BleakGATTCharacteristic:
        found = self._client.services.get_characteristic(uuid)
        if found is None:
            raise BleakCharacteristicNotFoundError(uuid)

        return found

    async def _write(self, data: bytes) -> None:
        """Writes a frame to its end, or until the connection ends; tells of errors by `_lose`."""
        due = -math.inf if self._answered else self._handed_over + self._pace
        while data and not self._lost.done():
            await self._until(due)
            try:
                size = max(1, min(self._output.max_write_without_response_size, LARGEST))  # it may change at any time
                chunk, data = data[:size], data[size:]
                await self._call(self._hand_over(chunk), GATT)
            except Exception as error:  # noqa: BLE001 - whatever it is, nobody knows what of the frame has arrived
                self._lose(error)

            due = self._handed_over + self._pace

    async def _hand_over(self, chunk: bytes) -> None:
        """Writes a chunk; returns when the system has taken it, or, with a response, the module."""
        self._handed_over = self._loop.time()
        self._answered = False
        await self._client.write_gatt_char(self._output, chunk, response=self._response)

    async def _until(self, due: float) -> None:
        """Waits for a time, or for the end of the connection.

        An ordinary timer is up to a millisecond late, which may cost the chunk a connection event, so the last one is
        waited for turn by turn.
        """
        if (left := due - TICK - self._loop.time()) > 0:
            await asyncio.wait([self._lost], timeout=left)

        while not self._lost.done() and self._loop.time() < due:  # noqa: ASYNC110 - no event is as exact
            await asyncio.sleep(0)

    async def _call(self, work: Any, seconds: float) -> None:
        """Awaits a call of bleak's, as long as there is a connection, or may be one."""
        try:
            await run_within(seconds, work, until=self._lost)
        except Ended:
            raise ConnectionError("the BLE connection was lost") from self._cause

    async def _close(self) -> None:
        if self._frame and not self._lost.done():
            await asyncio.wait([self._frame], timeout=LAST_FRAME)

        self._lose(None)
        if self._frame:
            await asyncio.wait([self._frame])

        try:
            with suppress(Exception):  # a service that died cannot be told; bleak has released what it had
                await run_within(DISCONNECT, self._client.disconnect())
        finally:
            self._lock.drop()

    def _receive(self, _: Any, data: bytearray) -> None:
        """Keeps what arrives; if nobody takes it, the rest is lost, as a UART's is."""
        self._answered = True
        if len(self._buffer) < BUFFER:
            self._buffer += data
            self._wake()

    def _lose(self, cause: Exception | None) -> None:
        """The connection has ended; the first cause counts."""
        if not self._lost.done():
            self._cause = cause
            self._lost.set_result(None)
            self._wake()

    def _reason(self) -> ConnectionError:
        text = "the arm's BLE module has disconnected"
        return ConnectionError(trouble(self._cause).text if isinstance(self._cause, Exception) else text)


async def check_version() -> None:
    """Lets bleak ask for BlueZ's version, as it does once: if it is cancelled there, no later connection gets by."""
    if sys.platform == "linux":
        from bleak.backends.bluezdbus.version import BlueZFeatures  # noqa: PLC0415 - there is none on other systems

        if not BlueZFeatures.checked_bluez_version:
            await BlueZFeatures.check_bluez_version()
