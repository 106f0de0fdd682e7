"""A link that breaks and is reopened: the arm goes on, and what is pending comes to its true end."""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from typing import Any, cast

import pytest
from virtual import virtual

from dobot_async import ConnectionLost, LinkState, Magician, MotionUnknown, ReplyTimeout
from dobot_async.arms.magician import commands as c
from dobot_async.simulator import DeviceOptions, Faults, Simulation, simulate


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


CLOCK = 2**32 / 1000
"""Seconds after which the arm's own clock, in ms, begins again at 0."""


@asynccontextmanager
async def on_for(uptime: float) -> AsyncIterator[Simulation]:
    """An arm that has been on for so many seconds; nothing but its clock tells when it was switched off."""
    loop = asyncio.get_running_loop()
    options = DeviceOptions(initial_index=0, power_up_alarms=frozenset())
    passed = 0.0
    async with simulate(options=options, clock=lambda: loop.time() + passed) as sim:
        passed = uptime
        yield sim


@pytest.mark.parametrize("before", [1.0, 5.0, 20.0])
@virtual
async def test_an_arm_whose_clock_begins_again_was_not_switched_off(before: float) -> None:
    """It has been on for 49.7 days, all but a few seconds, when the link is opened."""
    async with on_for(CLOCK - before) as sim, Magician.connect(sim.url, reconnect=True) as arm:
        for step in range(4):
            await asyncio.sleep(0.5)
            motion = await arm.queue.move_to(200, 100 * (-1) ** step, 40)
            sim.unplug()
            await motion
            await asyncio.sleep(before)

        assert arm.link.outages == 4
        assert sim.arm.device.uptime > CLOCK
        assert targets(sim) == [(200, 100 * (-1) ** step) for step in range(4)]


@virtual
async def test_an_outage_of_a_few_ms_is_no_restart() -> None:
    """The arm counts whole ms, and what is left over of them is no time that is missing."""
    for step in range(15):
        async with simulate() as sim, Magician.connect(sim.url, reconnect=True) as arm:
            await asyncio.sleep(step / 1100)
            motion = await arm.queue.move_to(200 + step, 0, 40)
            sim.unplug()
            await motion
            assert targets(sim) == [(200 + step, 0)]


@pytest.mark.parametrize("uptime", [0.0, 5.0, CLOCK / 4, CLOCK * 3 / 4, CLOCK + 5.0])
@virtual
async def test_an_arm_that_was_switched_off_is_recognised_by_its_clock_alone(uptime: float) -> None:
    async with on_for(uptime) as sim, Magician.connect(sim.url, reconnect=True) as arm:
        await asyncio.sleep(2)
        motion = await arm.queue.move_to(200, 100, 40)
        sim.unplug()
        sim.arm.power_cycle()
        with pytest.raises(MotionUnknown, match="switched off and on"):
            await motion.wait(10)

        await arm.move_to(210, 0, 40)
        assert targets(sim) == [(210, 0)]


@pytest.mark.parametrize("initial", [0, 1, 2**64 - 1])
@pytest.mark.parametrize("capacity", [1, 8])
@pytest.mark.parametrize("behind", [False, True])
@virtual
async def test_an_arm_switched_off_while_the_line_stays_open_is_recognised(
    initial: int, capacity: int, behind: bool
) -> None:
    """Its alarms are set all the time, so that the one of a restart tells nothing."""
    options = DeviceOptions(initial_index=initial, capacity=capacity)
    async with simulate(options=options) as sim, Magician.connect(sim.url) as arm:
        await arm.move_to(220, 0, 40)
        motion = await arm.queue.move_to(200, 100, 40)
        sim.arm.power_cycle()
        with pytest.raises(MotionUnknown, match="switched off and on"):
            if behind:
                motion = await arm.queue.move_to(200, -100, 40)

            await motion.wait(10)

        await arm.move_to(210, 0, 40)
        assert targets(sim)[-1] == (210, 0)


@virtual
async def test_nothing_is_done_that_an_arm_was_told_before_it_was_switched_off() -> None:
    """Its first command after that has the index of an earlier one, and its acknowledgement is lost."""
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        await asyncio.sleep(5)
        motions = [await arm.queue.move_to(200 + step, 100, 40) for step in range(5)]
        sim.arm.power_cycle()
        sim.faults = Faults(loss=0.5)
        with pytest.raises(MotionUnknown, match="switched off and on"):
            await arm.queue.move_to(200, -100, 40)

        for motion in motions:
            with pytest.raises(MotionUnknown):
                await motion


@pytest.mark.cases(1)
@pytest.mark.parametrize("days", [0.01, 10, 49.7, 120])
@virtual
async def test_an_arm_that_has_nothing_to_do_for_days_was_not_switched_off(days: float) -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        await arm.move_to(220, 0, 40)
        for _ in range(200):
            await asyncio.sleep(432 * days)  # the virtual clock takes no step of a day or more

        sim.faults = Faults(loss=0.2)
        for step in range(20):
            await arm.move_to(200 + step, 0, 40)

        assert targets(sim)[1:] == [(200 + step, 0) for step in range(20)]


@pytest.mark.full
@virtual
async def test_an_arm_that_is_paused_was_not_switched_off() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        await arm.pause()
        motion = await arm.queue.move_to(220, 0, 40)
        waiting = asyncio.create_task(motion.wait())
        await asyncio.sleep(60)
        await arm.resume()
        await waiting
        assert targets(sim) == [(220, 0)]


@virtual
async def test_old_firmware_without_a_clock_is_driven_all_the_same(caplog: pytest.LogCaptureFixture) -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        answer = sim.arm.answer
        cast(Any, sim.arm).answer = lambda frame: b"" if frame.id == c.GET_DEVICE_TIME.id else answer(frame)
        await arm.move_to(220, 0, 40)
        await asyncio.sleep(5)
        await arm.move_to(200, 0, 40)
        assert targets(sim) == [(220, 0), (200, 0)]

    assert "does not tell its clock" in caplog.text


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


@pytest.mark.parametrize("window", [1, 4])
@virtual
async def test_what_is_put_after_a_power_failure_that_nothing_else_tells_of_is_not_sent_twice(window: int) -> None:
    """Its index went back: probes must not raise it to where it was, and take what was done for lost."""
    async with simulate(speed=20) as sim, Magician.connect(sim.url, window=window) as arm:
        for step in range(20):
            await arm.queue.move_to(200 + step, 0, 40)

        await arm.queue.join()
        before = len(sim.arm.executed)
        sim.arm.power_cycle()
        with pytest.raises(MotionUnknown, match="switched off and on"):
            await arm.queue.move_to(250, 0, 40)

        await asyncio.sleep(2)
        assert len(targets_of(sim, before)) <= 1
        await arm.move_to(230, 0, 40)
        assert targets_of(sim, before)[-1] == 230
        assert len(set(targets_of(sim, before))) == len(targets_of(sim, before))


def targets_of(sim: Simulation, first: int) -> list[float]:
    """The x of the motions that the arm has executed, from one on."""
    return [each.value.x for each in sim.arm.executed[first:] if each.name == "SetPTPCmd" and each.outcome == "done"]
