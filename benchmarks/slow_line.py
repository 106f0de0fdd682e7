"""A line in memory with 115,200 baud each way, in virtual time: `slow://HOST` is `sim://HOST` over it.

slow://arm1?delay=0.05     and every message takes so many seconds more, each way
"""

from __future__ import annotations

import asyncio
from urllib.parse import SplitResult

from benchmarks.report import BAUD, BITS
from dobot_async._core.protocol.transport import Transport
from dobot_async.transports import SCHEMES, open_transport
from dobot_async.transports.options import number, options

__all__ = ["SlowLine", "open_url"]

DELAY = number(float, "seconds", least=0.0, most=10.0)


class SlowLine:
    """A line in memory that takes its time for each byte; each direction has its own."""

    window = 16
    in_flight = 8
    reorder_window = 0.0

    def __init__(self, inner: Transport, delay: float = 0.0) -> None:
        self._inner = inner
        self._delay = delay
        self._loop = asyncio.get_running_loop()
        self._out = self._in = 0.0
        self._arrived: asyncio.Queue[bytes | Exception] = asyncio.Queue()
        self._tasks = {asyncio.create_task(self._read())}

    def write(self, data: bytes) -> bool:
        """Take a frame; it reaches the arm once its last byte has gone out."""
        self._out = max(self._out, self._loop.time()) + len(data) * BITS / BAUD
        self._loop.call_at(self._out + self._delay, self._reach, data)
        return True

    async def send(self, data: bytes) -> None:
        """As `write`."""
        self.write(data)

    async def receive(self) -> bytes:
        """Return what has come in whole."""
        found = await self._arrived.get()
        if isinstance(found, Exception):
            raise found

        return found

    async def aclose(self) -> None:
        """Close it."""
        await self._inner.aclose()
        await asyncio.wait(self._tasks)

    def _reach(self, data: bytes) -> None:
        task = asyncio.create_task(self._inner.send(data))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _read(self) -> None:
        try:
            while True:
                data = await self._inner.receive()
                self._in = max(self._in, self._loop.time()) + len(data) * BITS / BAUD
                self._loop.call_at(self._in + self._delay, self._arrived.put_nowait, data)
        except Exception as error:  # noqa: BLE001 - whoever receives is told
            self._arrived.put_nowait(error)


async def open_url(url: SplitResult, *, arm: str) -> Transport:
    """Open `slow://HOST`."""
    given = options(url, {"delay": DELAY})
    return SlowLine(await open_transport(f"sim://{url.netloc}", arm=arm), **given)


SCHEMES["slow"] = (__name__, "slow://HOST (?delay=)")
