"""A rig for BLE with no radio: a bus, BlueZ on it, and simulated arms with BLE modules in its world.

Everything can fail in it that fails with a real one: connections break, the adapter is switched off, BlueZ or the bus
die. While it runs, this process takes its bus for the system's.
"""

from __future__ import annotations

import asyncio
import itertools
import os
import sys
from collections.abc import AsyncGenerator
from contextlib import AsyncExitStack, asynccontextmanager
from typing import Any
from weakref import WeakKeyDictionary

from dobot_async.simulator.ble.bluez import BlueZ
from dobot_async.simulator.ble.link_layer import RadioSettings
from dobot_async.simulator.ble.module import BleModule
from dobot_async.simulator.ble.system_bus import ADDRESS, PatientBus, dbus_daemon
from dobot_async.simulator.simulation import Simulation

__all__ = ["BlueZTestbed", "forget_bus", "rig", "serve"]

FIRST_ADDRESS = 0xD8B04CB33868  # in the range of the module's maker


class BlueZTestbed:
    """A bus, BlueZ on it, and the modules in its world.

    Attributes:
        environment: What a program needs in its environment to take the bus for the system's.
        bluez: The service, while it runs.
    """

    def __init__(self, address: str, daemon: asyncio.subprocess.Process) -> None:
        self.environment: dict[str, str] = {ADDRESS: address}
        self.bluez: BlueZ | None = None
        self._address = address
        self._daemon = daemon
        self._modules: list[BleModule] = []
        self._numbers = itertools.count()

    async def start(self) -> None:
        """Starts BlueZ, for the first time or again."""
        self.bluez = BlueZ(PatientBus(self._address))
        await self.bluez.start()
        for module in self._modules:
            self.bluez.add(module)

    async def stop(self) -> None:
        """Lets BlueZ die, without a word to its clients."""
        bluez, self.bluez = self.bluez, None
        if bluez:
            await bluez.stop()

    async def kill_bus(self) -> None:
        """Lets the bus die, and everything on it."""
        await self.stop()
        self._daemon.kill()
        await self._daemon.wait()

    def add(
        self, simulation: Simulation, radio: RadioSettings | None = None, *, name: str = "WH-BLE 102", address: str = ""
    ) -> BleModule:
        """Gives an arm a BLE module; the address is made up unless given."""
        address = address or (FIRST_ADDRESS + next(self._numbers)).to_bytes(6, "big").hex(":").upper()
        module = BleModule(simulation, radio or RadioSettings(), name=name, address=address)
        self._modules.append(module)
        if self.bluez:
            self.bluez.add(module)

        return module

    def remove(self, module: BleModule) -> None:
        """Takes an arm's module away."""
        self._modules.remove(module)
        if self.bluez:
            self.bluez.remove(module)


@asynccontextmanager
async def rig() -> AsyncGenerator[BlueZTestbed]:
    """Runs a rig for the length of a block; this process, and what it starts, takes its bus for the system's.

    Raises:
        OSError: dbus-daemon is not installed, or does not start.
    """
    async with dbus_daemon() as (address, daemon):
        made = BlueZTestbed(address, daemon)
        before = os.environ.get(ADDRESS)
        os.environ[ADDRESS] = address
        try:
            await made.start()
            yield made
        finally:
            if before is None:
                os.environ.pop(ADDRESS, None)
            else:
                os.environ[ADDRESS] = before

            await made.stop()
            await forget_bus()


async def forget_bus() -> None:
    """Takes the bus away from bleak, which keeps one for ever: the system's does not end while a program runs."""
    manager = sys.modules.get("bleak.backends.bluezdbus.manager")
    kept = vars(manager).get("_global_instances", {}).pop(asyncio.get_running_loop(), None) if manager else None
    bus, watcher = (getattr(kept, name, None) for name in ("_bus", "_bus_watcher_task"))
    if bus:
        bus.disconnect()

    if watcher:
        await asyncio.wait([watcher])


class Shared:
    """The rig of a loop for all simulations on it, for bleak knows one bus."""

    def __init__(self) -> None:
        self._changing = asyncio.Lock()
        self._users = 0
        self._stack = AsyncExitStack()
        self._rig: BlueZTestbed | None = None

    @asynccontextmanager
    async def use(self) -> AsyncGenerator[BlueZTestbed]:
        """Yields the rig; the first one starts it, the last one ends it."""
        async with self._changing:
            if self._rig is None:
                self._rig = await self._stack.enter_async_context(rig())

            self._users += 1

        try:
            yield self._rig
        finally:
            async with self._changing:
                self._users -= 1
                if not self._users:
                    self._rig = None
                    await self._stack.aclose()


rigs: WeakKeyDictionary[asyncio.AbstractEventLoop, Shared] = WeakKeyDictionary()


async def serve(
    simulation: Simulation,
    stack: AsyncExitStack,
    *,
    name: str = "WH-BLE 102",
    address: str = "",
    **radio: Any,
) -> str:
    """Gives a simulation a BLE module until the stack is closed; returns its URL."""
    settings = RadioSettings(**radio)
    shared = rigs.setdefault(asyncio.get_running_loop(), Shared())
    world = await stack.enter_async_context(shared.use())
    module = world.add(simulation, settings, name=name, address=address)
    stack.callback(world.remove, module)
    simulation.environment.update(world.environment)
    return module.url
