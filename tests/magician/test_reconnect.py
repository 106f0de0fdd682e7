"""A link that breaks and is reopened: the arm goes on, and what is pending comes to its true end."""

from __future__ import annotations

import asyncio
import math
from contextlib import AsyncExitStack

import pytest
from virtual import virtual

from dobot_async import ConnectionLost, LinkState, Magician, MotionUnknown, ReplyTimeout
from dobot_async.simulator import Simulation, simulate


def targets(sim: Simulation) -> list[tuple[float, float]]:
    """Where the PTP commands led that the arm has executed."""
    return [
        (each.value.x, each.value.y) for each in sim.arm.executed if each.outcome == "done" and each.name == "SetPTPCmd"
    ]


@virtual
async def test_motions_resolve_after_an_outage() -> None:
    async with simulate() as sim, Magician.connect(sim.url, reconnect=True) as arm:
        motions = [await arm.queue.move_to(200 + step, 40 * (-1) ** step, 40) for step in range(6)]
        waiting = asyncio.gather(*(motion.wait() for motion in motions))
        await asyncio.sleep(0.3)
        sim.unplug()
        await waiting
        assert arm.link.outages == 1
        await arm.move_to(220, 0, 40)
        assert targets(sim) == [(200 + step, 40 * (-1) ** step) for step in range(6)] + [(220, 0)]


@virtual
async def test_the_state_can_be_watched() -> None:
    async with simulate() as sim, Magician.connect(sim.url, reconnect=True) as arm:
        seen: list[LinkState] = []

        async def watch() -> None:
            seen.extend([state async for state in arm.link.state])

        watching = asyncio.create_task(watch())
        await asyncio.sleep(0)
        for _ in range(2):
            sim.unplug()
            await asyncio.sleep(1)
            await arm.get_pose()

        assert arm.link.state.value is LinkState.OPEN

    await watching
    assert seen == [LinkState.REOPENING, LinkState.OPEN] * 2 + [LinkState.CLOSED]


@virtual
async def test_an_arm_that_was_switched_off_is_recognised() -> None:
    async with simulate() as sim, Magician.connect(sim.url, reconnect=True) as arm:
        await arm.move_to(220, 0, 40)
        await asyncio.sleep(5)
        motion = await arm.queue.move_to(200, 0, 40)
        sim.unplug()
        sim.arm.power_cycle()
        with pytest.raises(MotionUnknown, match="switched off and on"):
            await motion

        await arm.move_to(210, 0, 40)
        assert targets(sim)[-1] == (210, 0)


@virtual
async def test_a_read_waits_for_the_link_no_longer_than_its_timeout() -> None:
    async with AsyncExitStack() as stack:
        sim = await stack.enter_async_context(simulate())
        async with Magician.connect(sim.url, reconnect=True, on_error="leave") as arm:
            sim.unplug()
            assert math.isfinite((await arm.get_pose(timeout=1)).x)
            await stack.aclose()
            before = asyncio.get_running_loop().time()
            with pytest.raises(ReplyTimeout):
                await arm.get_pose(timeout=2)

            assert asyncio.get_running_loop().time() - before == pytest.approx(2, abs=0.01)


async def test_over_a_real_line_that_comes_back() -> None:
    async with simulate(listen="tcp://127.0.0.1:0", speed=20) as sim, Magician.connect(sim.url, reconnect=True) as arm:
        motion = await arm.queue.move_to(220, 60, 40)
        for _ in range(10):
            sim.unplug()
            assert math.isfinite((await arm.get_pose(timeout=5)).x)

        await motion
        assert targets(sim) == [(220, 60)]
        assert arm.link.outages == 10


@virtual
async def test_without_reconnect_a_broken_link_is_the_end() -> None:
    async with simulate() as sim:
        with pytest.raises(ConnectionLost):
            async with Magician.connect(sim.url) as arm:
                sim.unplug()
                await arm.get_pose()

        assert arm.link.state.value is LinkState.LOST
