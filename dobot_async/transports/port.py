"""What the transports of serial ports share, whichever library opened the port: the end of their output."""

from __future__ import annotations

import asyncio
from abc import abstractmethod
from contextlib import suppress

from dobot_async.transports.byte_stream import DRAIN, ByteStreamTransport

__all__ = ["PortTransport"]

POLL = 0.005  # seconds


class PortTransport(ByteStreamTransport):
    """An open serial port."""

    errors: tuple[type[Exception], ...] = (OSError,)
    """What its library raises where the port is gone."""

    async def _drain(self) -> None:
        """Wait for the output for a moment, then throw away what the port did not take."""
        if self._lost.done():
            return

        transport = self._transport
        transport.set_write_buffer_limits(high=0)
        try:
            async with asyncio.timeout(DRAIN):
                while transport.get_write_buffer_size() and not self._lost.done():
                    self._writable.clear()
                    await self._writable.wait()

                while not self._lost.done() and self._unwritten():  # noqa: ASYNC110 - nobody tells when
                    await asyncio.sleep(POLL)
        except (TimeoutError, asyncio.CancelledError) as error:
            with suppress(Exception):  # whatever becomes of this, the port is closed next
                self._discard_output()

            if isinstance(error, asyncio.CancelledError):
                raise
        except self.errors:
            return

    @abstractmethod
    def _unwritten(self) -> int:
        """Bytes that the system still holds."""

    @abstractmethod
    def _discard_output(self) -> None:
        """Throw away what the system still holds."""
