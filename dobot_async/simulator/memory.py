"""A line in memory: simulations of this process, by the host of their `sim://` URLs, and a client's end."""

from __future__ import annotations

import itertools
from contextlib import AsyncExitStack, suppress
from typing import Any
from weakref import WeakValueDictionary

import anyio

from dobot_async._core.protocol.transport import MANY
from dobot_async.simulator.simulation import Simulation

__all__ = ["MemoryTransport", "in_memory", "running"]

BUFFER = 1 << 16
LEAST_REORDER_WINDOW = 0.005

names: itertools.count[int] = itertools.count(1)
running: WeakValueDictionary[str, Simulation[Any]] = WeakValueDictionary()
"""The simulations of this process, by the host of their `sim://` URLs."""


async def in_memory(simulation: Simulation, stack: AsyncExitStack) -> str:
    """Clients in the same process; they open `sim://` and the simulation's name."""
    name = f"arm{next(names)}"
    running[name] = simulation
    stack.callback(running.pop, name, None)
    return f"sim://{name}"


class MemoryTransport:
    """A client's end of a line in memory."""

    def __init__(self, simulation: Simulation, stack: AsyncExitStack | None = None) -> None:
        self._simulation = simulation
        self._stack = stack
        self.in_flight, self.window = (1, 1) if self.reorder_window else (MANY, 16)
        self._arriving, self._arrived = anyio.create_memory_object_stream[bytes](BUFFER)
        self._client = simulation.client(self._deliver, self._arriving.close, ordered=not self.reorder_window)

    @property
    def reorder_window(self) -> float:
        """With jitter, overtaking or doubled messages it is a line for datagrams."""
        faults = self._simulation.faults
        reorder_window = faults.jitter + faults.reorder
        return max(reorder_window, LEAST_REORDER_WINDOW) if reorder_window or faults.dup else 0.0

    async def send(self, data: bytes) -> None:
        """Puts a request on the line."""
        ends = self._arriving.statistics()
        if not ends.open_receive_streams:
            raise anyio.ClosedResourceError

        if not ends.open_send_streams:
            raise anyio.BrokenResourceError

        self._client.send(data)

    def write(self, data: bytes) -> bool:
        """Puts a request on the line; False if it is gone."""
        ends = self._arriving.statistics()
        if ends.open_receive_streams and ends.open_send_streams:
            self._client.send(data)
            return True

        return False

    async def receive(self) -> bytes:
        """Returns the next message."""
        return await self._arrived.receive()

    async def aclose(self) -> None:
        """Hangs up, and ends a simulation that was made for this client alone."""
        self._simulation.leave(self._client)
        self._arriving.close()
        self._arrived.close()
        if self._stack:
            await self._stack.aclose()

    def _deliver(self, data: bytes) -> None:
        """Hands over what fits; a client that never reads loses the rest."""
        with suppress(anyio.WouldBlock):
            self._arriving.send_nowait(data)
