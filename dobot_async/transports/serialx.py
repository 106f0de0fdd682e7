"""A serial port through serialx, the only module that knows of it.

DTR and RTS are low from the moment on at which the port is open, for they reset the board; closing waits for the output
no longer than `DRAIN`, then throws the rest away. What serialx logs of each byte is switched off unless somebody has
switched it on: one of them is of a password.
"""

from __future__ import annotations

import asyncio
import logging

from serialx import BaseSerialTransport, PinState, SerialException, create_serial_connection

from dobot_async._core.util.tasks import run_shielded
from dobot_async.transports.port import PortTransport

__all__ = ["SerialxTransport", "open_port"]

PATIENCE = 1.0
"""Seconds that a cancelled opening waits until the system has let go of the port."""
logger: logging.Logger = logging.getLogger("serialx")
if logger.level == logging.NOTSET:
    logger.setLevel(logging.INFO)


async def open_port(path: str, baud: int) -> SerialxTransport:
    """Open a port; raise OSError or ValueError if it cannot be opened."""
    opening = asyncio.create_task(opened(path, baud), name="dobot_async open")
    try:
        return await asyncio.shield(opening)
    except asyncio.CancelledError:
        opening.cancel()
        opening.add_done_callback(discarded)
        await run_shielded(let_go(opening))
        raise


async def opened(path: str, baud: int) -> SerialxTransport:
    """Open a port."""
    try:
        _, connection = await create_serial_connection(
            asyncio.get_running_loop(),
            SerialxTransport,
            path,
            baud,
            dtr_on_open=PinState.LOW,
            rts_on_open=PinState.LOW,
            dtr_on_close=PinState.LOW,
            rts_on_close=PinState.LOW,
        )
    except SerialException as error:
        raise OSError(str(error)) from error

    assert isinstance(connection, SerialxTransport)
    return connection


async def let_go(opening: asyncio.Task[SerialxTransport]) -> None:
    """Wait a moment for an opening that was cancelled."""
    await asyncio.wait([opening], timeout=PATIENCE)
    if opening.done() and not opening.cancelled() and not opening.exception():
        await opening.result().aclose()


def discarded(opening: asyncio.Task[SerialxTransport]) -> None:
    """Let go of a port that was opened too late."""
    if not opening.cancelled() and not opening.exception():
        opening.result().discard()


class SerialxTransport(PortTransport):
    """An open serial port."""

    _transport: BaseSerialTransport
    errors: tuple[type[Exception], ...] = (OSError, SerialException)

    def discard(self) -> None:
        """Close it at once."""
        self._closed = True
        self._abort()

    def _put(self, data: bytes) -> None:
        """Hand bytes to the port; one that is gone is found by its reader as well."""
        try:
            self._transport.write(data)
        except (OSError, SerialException) as error:
            self._cause = error
            self._abort()

    def _unwritten(self) -> int:
        """Bytes that the system still holds."""
        return self._transport.serial.num_unwritten_bytes()

    def _discard_output(self) -> None:
        """Throw away what the system still holds."""
        self._transport.serial.reset_write_buffer()

    def _abort(self) -> None:
        """End the port, unless it has ended."""
        if not self._lost.done():
            self._transport.abort()
