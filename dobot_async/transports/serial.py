"""A serial port through pyserial-asyncio, the only module that knows of it.

What its traps demand: opening blocks, so a thread of its own does it; DTR and RTS are low before the port opens, for
they reset the board; closing waits for the output no longer than `DRAIN`, then throws the rest away, so that neither
the loop nor the kernel waits for a line that does not drain; and the transport is aborted exactly once.
"""

from __future__ import annotations

import asyncio
import os
import threading
from collections.abc import Callable
from typing import Any

import serial
import serial_asyncio

from dobot_async.transports.port import PortTransport

__all__ = ["SerialTransport", "open_port"]

SERIAL_ASYNCIO: Any = serial_asyncio  # it has no types
if not hasattr(SERIAL_ASYNCIO, "connection_for_serial"):
    raise ImportError("the serial_asyncio that is installed is not pyserial-asyncio")

POSIX = os.name == "posix"


async def open_port(path: str, baud: int) -> SerialTransport:
    """Open a port; raise OSError or ValueError if it cannot be opened."""
    port = (Port if POSIX else serial.Serial)(None, baudrate=baud, exclusive=True if POSIX else None)
    port.port = path
    port.dtr = port.rts = False
    try:
        await in_thread(port.open, port.close)
        opened: tuple[asyncio.Transport, SerialTransport] = await SERIAL_ASYNCIO.connection_for_serial(
            asyncio.get_running_loop(), SerialTransport, port
        )
    except (OSError, ValueError):
        port.close()
        raise

    # Said here already, for waiting until it is said could be cancelled, and would leave an open port to nobody.
    output, transport = opened
    transport.connection_made(output)
    return transport


class Port(serial.Serial):
    """A port that is read when there is something to read: pyserial would ask the system for that once more."""

    def read(self, size: int | None = 1) -> bytes:
        """Return what is there; raise SerialException if that is nothing, for then the port is gone."""
        try:
            data = os.read(self.fileno(), size or 1)
        except (BlockingIOError, InterruptedError):
            return b""
        except OSError as error:
            raise serial.SerialException(f"read failed: {error}") from error

        if not data:
            raise serial.SerialException("the port is ready to be read, and has nothing: the device is gone")

        return data


class SerialTransport(PortTransport):
    """An open serial port."""

    def __init__(self) -> None:
        super().__init__()
        self._port: int | None = None  # what the system knows it by, if it takes bytes at once

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Keep the open port; pyserial-asyncio calls this once more, a little after it has returned the transport."""
        super().connection_made(transport)
        self._port = self._transport.serial.fd if POSIX else None

    def _put(self, data: bytes) -> None:
        """Hand bytes to the port, and what it does not take at once to its output."""
        rest = self._written(data)
        if rest:
            self._transport.write(rest)

    def _written(self, data: bytes) -> bytes:
        """Write what the port takes at once, and return the rest.

        pyserial-asyncio would have the loop ask the system first whether the port takes it: that costs more than the
        rest of a request together.
        """
        if self._port is None or self._transport.get_write_buffer_size():
            return data

        try:
            return data[os.write(self._port, data) :]
        except BlockingIOError:
            return data
        except OSError as error:
            self._cause = error  # pyserial-asyncio would find the same, and print it
            self._abort()
            return b""

    def _unwritten(self) -> int:
        """Bytes that the system still holds."""
        return int(self._transport.serial.out_waiting)

    def _discard_output(self) -> None:
        """Throw away what the system still holds."""
        self._transport.serial.reset_output_buffer()

    def _abort(self) -> None:
        """End the port, exactly once: one that ends by itself is left alone, unless output keeps it from it."""
        if not self._lost.done() and (not self._transport.is_closing() or self._transport.get_write_buffer_size()):
            self._transport.abort()


async def in_thread(call: Callable[[], None], undo: Callable[[], None]) -> None:
    """Run a blocking call in a thread that ends with it; undo it if the caller is cancelled meanwhile."""
    loop = asyncio.get_running_loop()
    done: asyncio.Future[None] = loop.create_future()
    order: list[str] = []  # whoever comes second sees it here, and undoes the call if it was abandoned

    def finish(error: Exception | None) -> None:
        if done.done():
            return

        if error:
            done.set_exception(error)
        else:
            done.set_result(None)

    def run() -> None:
        error: Exception | None = None
        try:
            call()
        except Exception as caught:  # noqa: BLE001 - it is raised where the call is awaited
            error = caught

        order.append("done")
        if order[0] == "done":
            loop.call_soon_threadsafe(finish, error)
        else:
            undo()

    thread = threading.Thread(target=run, name="dobot_async open", daemon=True)
    thread.start()
    try:
        await done
    except asyncio.CancelledError:
        order.append("abandoned")
        if order[0] == "done":
            undo()

        raise
    finally:
        if order[0] == "done":
            thread.join()
