"""An arm on BLE behind the bridge: bleak's own BlueZ backend, against a BlueZ on a bus of its own."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack

import pytest
from bridge_rig import ask, client, far, until

from dobot_async import Magician
from dobot_async.arms.magician import commands as c
from dobot_async.bridge import bridge
from dobot_async.simulator import Simulation, simulate

if sys.platform != "linux":
    pytest.skip("BlueZ is Linux's", allow_module_level=True)

from dobot_async.simulator.ble.link_layer import RadioSettings
from dobot_async.simulator.ble.testbed import rig

if not shutil.which("dbus-daemon") and not os.environ.get("DOBOT_REQUIRE_DBUS"):
    pytest.skip("dbus-daemon is not installed (Debian: apt install dbus-daemon)", allow_module_level=True)

WS = "ws://127.0.0.1:0"


@pytest.fixture
async def sim() -> AsyncIterator[Simulation]:
    """An arm with a BLE module, on a good connection."""
    async with rig() as world, simulate(speed=5) as simulation:
        world.add(simulation, RadioSettings(interval=0.0075, advertising=0.02))
        yield simulation


@pytest.mark.usefixtures("sim")
async def test_several_programs_share_it() -> None:
    async with AsyncExitStack() as stack:
        running = await stack.enter_async_context(bridge("ble:", listen=WS, timeout=10))
        arm = await stack.enter_async_context(Magician.connect(running.url, timeout=10))
        watcher = await stack.enter_async_context(Magician.connect(running.url, control=False, timeout=10))
        await arm.move_to(220, 30, 40)
        assert (await watcher.get_pose()).y == pytest.approx(30, abs=0.01)


async def test_who_vanishes_stops_it(sim: Simulation) -> None:
    async with bridge("ble:", listen=WS, timeout=10) as running:
        async with client(running.url) as plain:
            await plain.send(ask(c.SET_QUEUED_CMD_START_EXEC), far(), far(-100), far(), far(-100))
            for _ in range(5):
                await plain.receive()

        await until(lambda: running.holder is None)
        assert not sim.arm.device.moving
        assert sim.arm.device.left_space == 32


async def test_it_is_found_again_after_a_drop(sim: Simulation) -> None:
    async with bridge("ble:", listen=WS, timeout=10) as running, client(running.url) as plain:
        await plain.ask(c.GET_DEVICE_NAME)
        sim.unplug()
        await until(lambda: running.link.outages)
        assert (await plain.ask(c.GET_DEVICE_NAME)).params == b"Dobot Magician\0"
