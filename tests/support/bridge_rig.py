"""What the tests of the bridge share: a simulated arm, a bridge to it, and clients that know frames and no driver."""

from __future__ import annotations

import asyncio
import struct
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from typing import Any, NamedTuple

import anyio

from dobot_async._core.protocol.transport import Transport
from dobot_async._core.protocol.wire import Command
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.frame import Frame, Parser, encode, request
from dobot_async.bridge import Bridge, BridgeEvent, bridge
from dobot_async.simulator import Simulation, simulate
from dobot_async.transports import open_transport

__all__ = ["IN_TIME", "TCP", "Plain", "Rig", "ask", "bridged", "client", "far", "numbers", "set_now", "until"]

IN_TIME = 10.0
TCP = "tcp://127.0.0.1:0"


class Rig(NamedTuple):
    """An arm, the bridge to it, and what has happened there."""

    sim: Simulation
    bridge: Bridge[Any]
    happened: list[BridgeEvent]

    @property
    def url(self) -> str:
        return self.bridge.url

    def told(self, what: str) -> list[str]:
        """The details of the events of a kind."""
        return [event.detail for event in self.happened if event.what == what]

    def executed(self, command: Command[Any, Any], outcome: str = "done") -> list[Any]:
        """The parameters of what the arm has executed of a row, in order."""
        return [each.value for each in self.sim.arm.executed if each.command is command and each.outcome == outcome]


@asynccontextmanager
async def bridged(
    listen: str | list[str] = TCP, *, speed: float = 50.0, arm: dict[str, Any] | None = None, **details: Any
) -> AsyncIterator[Rig]:
    """A simulated arm behind a TCP port, and a bridge to it."""
    async with simulate(listen=TCP, speed=speed, **arm or {}) as sim:
        async with bridge(sim.url, listen=listen, **details) as running:
            happened: list[BridgeEvent] = []
            reading = asyncio.create_task(read(running, happened))
            await asyncio.sleep(0)
            yield Rig(sim, running, happened)

        await reading


async def read(running: Bridge[Any], happened: list[BridgeEvent]) -> None:
    """Notes each event when it happens."""
    async for event in running.events:
        happened += [event]


class Plain:
    """A client that sends and receives frames, and nothing else.

    Attributes:
        transport: Its own.
        poured: How often it has sent what need not be frames.
    """

    def __init__(self, transport: Transport) -> None:
        self.transport = transport
        self.poured = 0
        self._parser = Parser()
        self._frames: list[Frame] = []

    async def send(self, *frames: Frame) -> None:
        await self.transport.send(b"".join(map(encode, frames)))

    async def pour(self, data: bytes) -> None:
        """Sends bytes of any kind."""
        await self.transport.send(data)
        self.poured += 1

    async def receive(self) -> Frame:
        """The next frame."""
        async with asyncio.timeout(IN_TIME):
            while not self._frames:
                self._frames += self._parser.feed(await self.transport.receive())

        return self._frames.pop(0)

    async def ask(self, command: Command[Any, Any], value: Any = None, *, queued: bool = False) -> Frame:
        """The arm's answer."""
        await self.send(ask(command, value, queued=queued))
        return await self.receive()

    async def hears_nothing(self) -> bool:
        """Whether the answer to a read is the next thing to come: what was asked before it has none."""
        return (await self.ask(c.GET_DEVICE_NAME)).id == c.GET_DEVICE_NAME.id

    async def hung_up(self) -> bool:
        """Returns when the connection has ended."""
        with suppress(anyio.EndOfStream, anyio.BrokenResourceError, OSError):
            async with asyncio.timeout(IN_TIME):
                while True:
                    await self.transport.receive()

        return True


@asynccontextmanager
async def client(url: str) -> AsyncIterator[Plain]:
    """A client at a URL."""
    transport = await open_transport(url, arm="magician")
    try:
        yield Plain(transport)
    finally:
        await transport.aclose()


def ask(command: Command[Any, Any], value: Any = None, *, queued: bool = False) -> Frame:
    """A request."""
    return request(command, command.request.encode(value), queued=queued)


def far(y: float = 100) -> Frame:
    """A queued motion that takes its time."""
    return ask(c.SET_PTP_CMD, c.PTPCmd(c.PTPMode.MOVL_XYZ, 200, y, 40, 0), queued=True)


def set_now(x: float) -> Frame:
    """A setting that takes effect at once."""
    return ask(c.SET_PTP_COMMON_PARAMS, c.PTPCommonParams(x, 50))


def numbers(frame: Frame) -> tuple[float, ...]:
    """The parameters of a frame that has floats alone."""
    return struct.unpack(f"<{len(frame.params) // 4}f", frame.params)


async def until(condition: Callable[[], object]) -> None:
    """Returns when something has come about."""
    async with asyncio.timeout(IN_TIME):
        while True:
            if condition():
                return

            await asyncio.sleep(0.002)
