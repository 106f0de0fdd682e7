"""Each way to an arm on uvloop: a motion, a stop, a cancellation; the arm tells what it did.

Where uvloop is missing all of it is skipped, unless `DOBOT_REQUIRE_UVLOOP` is set: then it fails.
"""

from __future__ import annotations

import asyncio
import os
import shutil
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from importlib.util import find_spec
from typing import Any

import pytest
from bridge_rig import bridged

from dobot_async import Magician, MotionStopped
from dobot_async.simulator import Simulation, simulate

if not find_spec("uvloop") and not os.environ.get("DOBOT_REQUIRE_UVLOOP"):
    pytest.skip("uvloop is not installed (it is none for Windows)", allow_module_level=True)

import uvloop

IN_TIME = 30.0
SPEED = 5.0
LISTEN = {
    "memory": "memory",
    "serial, pyserial": "pty",
    "serial, serialx": "pty",
    "serial, 115200 baud": "pty:?baud=115200",
    "tcp": "tcp://127.0.0.1:0",
    "udp": "udp://127.0.0.1:0",
    "ble": "ble",
    "ws": "ws://127.0.0.1:0",
}
with asyncio.Runner(loop_factory=uvloop.new_event_loop) as first:
    first.run(asyncio.sleep(0))  # libuv keeps a pipe from its first loop on, which no test has left behind

Act = Callable[[Magician, Simulation], Awaitable[None]]


@asynccontextmanager
async def reached(way: str) -> AsyncIterator[tuple[Magician, Simulation]]:
    """An arm by a way."""
    if way == "ws":
        async with bridged(LISTEN[way], speed=SPEED, arm={"homed": True}) as rig, Magician.connect(rig.url) as arm:
            yield arm, rig.sim
    else:
        backend = "?backend=serialx" if way.endswith("serialx") else ""
        async with simulate(listen=LISTEN[way], speed=SPEED, homed=True) as sim:
            os.environ.update(sim.environment)
            async with Magician.connect(sim.url + backend) as arm:
                yield arm, sim


async def moves(arm: Magician, sim: Simulation) -> None:
    await arm.move_to(220, 60, 40)
    assert (await arm.get_pose()).y == pytest.approx(60, abs=0.1)
    assert [done.value.y for done in sim.arm.executed if done.name == "SetPTPCmd"] == [60]


async def stops(arm: Magician, sim: Simulation) -> None:
    await arm.set_speed(5)
    motion = await arm.queue.move_to(220, 200, 40)
    waiting = asyncio.create_task(motion.wait())
    await until_it_moves(sim)
    await arm.stop()
    with pytest.raises(MotionStopped):
        await waiting

    assert not sim.arm.device.moving
    assert sim.arm.pose.y < 199


async def is_cancelled(arm: Magician, sim: Simulation) -> None:
    await arm.set_speed(5)
    moving = asyncio.create_task(arm.move_to(220, 200, 40))
    await until_it_moves(sim)
    moving.cancel()
    with pytest.raises(asyncio.CancelledError):
        await moving

    while sim.arm.device.moving:  # noqa: ASYNC110 - it has no event
        await asyncio.sleep(0.001)

    assert sim.arm.pose.y < 199


async def until_it_moves(sim: Any) -> None:
    while not sim.arm.device.moving:  # noqa: ASYNC110 - it has no event
        await asyncio.sleep(0.001)


@pytest.mark.cases(6)
@pytest.mark.parametrize("act", [moves, stops, is_cancelled])
@pytest.mark.parametrize("way", LISTEN)
def test_on_uvloop_an_arm(way: str, act: Act, monkeypatch: pytest.MonkeyPatch) -> None:
    if way == "ble" and not shutil.which("dbus-daemon") and not os.environ.get("DOBOT_REQUIRE_DBUS"):
        pytest.skip("dbus-daemon is not installed")

    monkeypatch.setattr(os, "environ", {**os.environ})

    async def run() -> None:
        assert isinstance(asyncio.get_running_loop(), uvloop.Loop)
        async with asyncio.timeout(IN_TIME), reached(way) as (arm, sim):
            await act(arm, sim)

    with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
        runner.run(run())
