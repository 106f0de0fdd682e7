"""A line to a simulated ultraArm on which a test decides what becomes of each message.

It is a stream: what is late delays all that is behind it.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

import pytest

from dobot_async import UltraArm
from dobot_async.simulator import Simulation, simulate
from dobot_async.transports import Transport

__all__ = ["BadLine", "Spoil", "once", "rig"]

TICK = 1e-6  # two timers for one moment fire in any order
Spoil = Callable[[bytes], list[tuple[float, bytes]]]
"""What becomes of a message: what arrives of it, each after so many seconds."""


def unspoilt(data: bytes) -> list[tuple[float, bytes]]:
    return [(0, data)]


class BadLine:
    """The line: `request` and `reply` say what happens."""

    in_flight = window = 1
    disorder = 0.0

    def __init__(self, inner: Transport) -> None:
        self.request: Spoil = unspoilt
        self.reply: Spoil = unspoilt
        self._inner = inner
        self._arrived: asyncio.Queue[bytes] = asyncio.Queue()
        self._pump = asyncio.create_task(self._read())

    async def _read(self) -> None:
        loop = asyncio.get_running_loop()
        due = 0.0
        while True:
            message = await self._inner.receive()
            for delay, data in self.reply(message):
                due = max(loop.time() + delay, due + TICK)
                loop.call_at(due, self._arrived.put_nowait, data)

    async def send(self, data: bytes) -> None:
        """Sends what is left of a message."""
        for _, each in self.request(data):
            await self._inner.send(each)

    async def receive(self) -> bytes:
        """Returns the next message that has arrived."""
        return await self._arrived.get()

    async def aclose(self) -> None:
        """Closes the line."""
        self._pump.cancel()
        await asyncio.wait([self._pump])
        await self._inner.aclose()


def once(word: bytes, into: Spoil) -> Spoil:
    """Does something to the first message with a word in it, and nothing to the others."""
    left = [into]

    def spoil(data: bytes) -> list[tuple[float, bytes]]:
        return left.pop()(data) if left and word in data else [(0, data)]

    return spoil


@asynccontextmanager
async def rig(
    monkeypatch: pytest.MonkeyPatch, *, sim: dict[str, Any] | None = None, **options: Any
) -> AsyncIterator[tuple[Simulation, UltraArm, BadLine]]:
    """A simulated arm, a driver, and the line between them."""
    from dobot_async import family
    from dobot_async.transports import open_transport

    made: list[BadLine] = []

    async def opened(url: str, *, arm: str) -> Transport:
        made.append(BadLine(await open_transport(url, arm=arm)))
        return made[-1]

    monkeypatch.setattr(family, "open_transport", opened)
    async with simulate("ultraarm", **(sim or {})) as simulation, UltraArm.connect(simulation.url, **options) as arm:
        yield simulation, arm, made[0]
