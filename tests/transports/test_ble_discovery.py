"""The search for arms over BLE: bleak's own BlueZ backend against a BlueZ on a bus of its own.

Where the program dbus-daemon is missing all of it is skipped, unless `DOBOT_REQUIRE_DBUS` is set: then it fails.
"""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, aclosing

import pytest

from dobot_async import ConnectFailed, DiscoveryProblem, Found, Magician, discover
from dobot_async.discovery.ble import BLEModules
from dobot_async.simulator import Simulation, simulate

if sys.platform != "linux":
    pytest.skip("BlueZ is Linux's", allow_module_level=True)

from dobot_async.simulator.ble.link_layer import RadioSettings
from dobot_async.simulator.ble.module import BleModule
from dobot_async.simulator.ble.testbed import BlueZTestbed, rig

if not shutil.which("dbus-daemon") and not os.environ.get("DOBOT_REQUIRE_DBUS"):
    pytest.skip("dbus-daemon is not installed (Debian: apt install dbus-daemon)", allow_module_level=True)

ADDRESS = "D8:B0:4C:00:00:{:02d}".format
LONG = 60.0


@pytest.fixture
async def world() -> AsyncIterator[BlueZTestbed]:
    """A bus with BlueZ on it."""
    async with rig() as made:
        yield made


@pytest.fixture
async def sims() -> AsyncIterator[list[Simulation]]:
    """Two arms."""
    async with AsyncExitStack() as stack:
        yield [await stack.enter_async_context(simulate(speed=50)) for _ in range(2)]


def module(world: BlueZTestbed, sim: Simulation, number: int, name: str = "WH-BLE 102") -> BleModule:
    """Gives an arm a module on a good connection."""
    radio = RadioSettings(interval=0.0075, advertising=0.02)
    return world.add(sim, radio, name=name, address=ADDRESS(number))


async def first(count: int) -> list[Found]:
    """The first that the search yields, in the order in which it does; there is time enough for the slowest machine."""
    found = []
    async with aclosing(BLEModules().search(LONG)) as search:
        async for each in search:
            found.append(each)
            if len(found) == count:
                break

    return found


async def test_modules_are_known_by_name_or_service(world: BlueZTestbed, sims: list[Simulation]) -> None:
    module(world, sims[0], 1, name="Headphones")
    module(world, sims[0], 2, name="My USR-BLE100 here")
    module(world, sims[1], 3, name="lab").advertises_service = True
    found = {each.url: each.description for each in await first(2)}
    assert found == {f"ble://{ADDRESS(2)}": "My USR-BLE100 here", f"ble://{ADDRESS(3)}": "lab"}


async def test_a_name_that_comes_later_is_told(world: BlueZTestbed, sims: list[Simulation]) -> None:
    late = module(world, sims[0], 1)
    late.advertises_service = True
    late.late_name = 3
    nameless, named = await first(2)
    assert (nameless.identity, nameless.description) == (ADDRESS(1), "")
    assert (named.identity, named.description) == (ADDRESS(1), "WH-BLE 102")


async def test_an_arm_that_is_in_use_here_is_told_too(world: BlueZTestbed, sims: list[Simulation]) -> None:
    used = module(world, sims[0], 1)
    async with Magician.connect(used.url) as arm:
        (found,) = await first(1)
        assert (found.url, found.description) == (used.url, "WH-BLE 102, in use by another program")
        await arm.get_pose()


async def test_a_probe_connects_to_one_after_the_other(world: BlueZTestbed, sims: list[Simulation]) -> None:
    modules = [module(world, sim, number) for number, sim in enumerate(sims)]
    found = [each async for each in discover(sources=["ble"], timeout=2, probe=True, probe_timeout=LONG)]
    assert [each.url for each in found] == [each.url for each in modules]
    assert [each.info and each.info.name for each in found] == ["Dobot Magician"] * 2
    assert [each.connections for each in modules] == [1, 1]
    assert not any(each.connected for each in modules)


async def test_the_scan_ends_with_the_search(world: BlueZTestbed, sims: list[Simulation]) -> None:
    module(world, sims[0], 1)
    assert world.bluez
    async with aclosing(BLEModules().search(LONG)) as search:
        await anext(search)
        assert world.bluez.scanning

    assert not world.bluez.scanning


async def test_an_adapter_that_is_off_is_a_problem_with_advice(world: BlueZTestbed) -> None:
    assert world.bluez
    world.bluez.power(on=False)
    problems: list[DiscoveryProblem] = []
    assert not [found async for found in discover(sources=["ble"], timeout=1, on_problem=problems.append)]
    (problem,) = problems
    assert isinstance(problem.error, ConnectFailed)
    assert "switch it on" in problem.message
