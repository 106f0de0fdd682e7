"""A line to a simulation in memory on which a test decides what becomes of each message."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import pytest

from dobot_async._core.protocol.transport import Transport

__all__ = ["BadLine", "Spoil", "bad_lines"]

TICK = 1e-6  # two timers for one moment fire in any order
Spoil = Callable[[bytes], list[tuple[float, bytes]]]
"""What becomes of a message: what arrives of it, each after so many seconds."""


def unspoilt(data: bytes) -> list[tuple[float, bytes]]:
    """Nothing happens to it."""
    return [(0, data)]


class BadLine:
    """The line: `request` and `reply` say what happens.

    Args:
        inner: To the simulation.
        in_order: What is late delays all that is behind it, as on a stream; else it is overtaken.
    """

    in_flight = window = 1

    def __init__(self, inner: Transport, *, in_order: bool = False) -> None:
        self.reorder_window = 0.0
        self.request: Spoil = unspoilt
        self.reply: Spoil = unspoilt
        self._inner = inner
        self._in_order = in_order
        self._arrived: asyncio.Queue[bytes] = asyncio.Queue()
        self._pump = asyncio.create_task(self._read())

    async def _read(self) -> None:
        loop = asyncio.get_running_loop()
        due = 0.0
        while True:
            message = await self._inner.receive()
            for delay, data in self.reply(message):
                at = loop.time() + delay
                due = max(at, due + TICK) if self._in_order else at
                loop.call_at(due, self._arrived.put_nowait, data)

    async def send(self, data: bytes) -> None:
        """Sends what is left of a message."""
        for delay, each in self.request(data):
            assert delay == 0
            await self._inner.send(each)

    async def receive(self) -> bytes:
        """Returns the next message that has arrived."""
        return await self._arrived.get()

    async def aclose(self) -> None:
        """Closes the line."""
        self._pump.cancel()
        await asyncio.wait([self._pump])
        await self._inner.aclose()


def bad_lines(patch: pytest.MonkeyPatch, *, in_order: bool = False) -> list[BadLine]:
    """Returns where the lines will be over which `sim://` is reached from now on."""
    from dobot_async.arms import session
    from dobot_async.transports import open_transport

    made: list[BadLine] = []

    async def opened(url: str, *, arm: str) -> Transport:
        made.append(BadLine(await open_transport(url, arm=arm), in_order=in_order))
        return made[-1]

    patch.setattr(session, "open_transport", opened)
    return made
