"""Arms that start together: loaded while paused, released with each link's latency compensated."""

from __future__ import annotations

import asyncio
import gc
from contextlib import AsyncExitStack
from functools import partial
from itertools import count, pairwise
from typing import Any

import pytest
from steps import Steps
from virtual import virtual

from dobot_async import ConnectionLost, DobotError, Fleet, Magician, MotionStopped, MyCobot, UltraArm
from dobot_async.arms.magician import commands as c
from dobot_async.arms.ultraarm import commands as u
from dobot_async.fleet import Member
from dobot_async.simulator import Faults, Simulation, simulate

LATENCIES = (0.0, 0.002, 0.01, 0.04)
NEAR = (220.0, 0.0, 40.0)


async def cell(stack: AsyncExitStack, *latencies: float, speed: float = 1) -> tuple[Fleet[Magician], list[Simulation]]:
    """Arms behind links of several latencies."""
    sims = [
        await stack.enter_async_context(simulate(speed=speed, faults=Faults(latency=latency))) for latency in latencies
    ]
    urls = {f"arm{number}": sim.url for number, sim in enumerate(sims)}
    return await stack.enter_async_context(Fleet.connect(urls)), sims


def first_motion(sim: Simulation) -> float:
    return next(float(each.started) for each in sim.arm.executed if each.command is c.SET_PTP_CMD)


@virtual
async def test_the_start_is_one_instant_whatever_the_links_take() -> None:
    async with AsyncExitStack() as stack:
        fleet, sims = await cell(stack, *LATENCIES)
        async with fleet.together() as together:
            motions = [together[name].move_to(*NEAR) for name in together]
            with pytest.raises(RuntimeError, match="when the block ends"):
                _ = together.skew

        assert together.start
        assert len(together) == 4
        await together.wait()
        assert all(motion.done for motion in motions)
        starts = [first_motion(sim) for sim in sims]
        assert max(starts) - min(starts) < 0.001
        assert together.skew == pytest.approx(max(starts) - min(starts), abs=1e-6)
        assert [together.start.latency[name] for name in together] == pytest.approx(LATENCIES, abs=1e-6)
        assert together.start.uncertainty == pytest.approx(max(LATENCIES), abs=1e-6)


@virtual
async def test_it_begins_when_all_are_done_with_what_they_do() -> None:
    async with AsyncExitStack() as stack:
        fleet, sims = await cell(stack, 0.0, 0.0)
        await fleet["arm0"].queue.wait(5)
        async with fleet.together("arm0", "arm1") as together:
            for name in together:
                together[name].move_to(*NEAR)

        await together.wait()
        starts = [first_motion(sim) for sim in sims]
        assert min(starts) > 5
        assert max(starts) - min(starts) < 0.001


@virtual
async def test_more_than_a_queue_holds() -> None:
    async with AsyncExitStack() as stack:
        fleet, sims = await cell(stack, 0.0, 0.01, speed=20)
        async with fleet.together() as together:
            for name in together:
                for number in range(100):
                    together[name].move_to(200 + number / 2, 0, 40)

        await together.wait()
        for sim in sims:
            places = [each.value.x for each in sim.arm.executed if each.command is c.SET_PTP_CMD]
            assert len(places) == 100
            assert all(a < b for a, b in pairwise(places))


@virtual
async def test_an_error_in_the_block_sends_nothing() -> None:
    async with AsyncExitStack() as stack:
        fleet, sims = await cell(stack, 0.0, 0.0)
        with pytest.raises(ZeroDivisionError):
            async with fleet.together() as together:
                motion = together["arm0"].move_to(*NEAR)
                raise ZeroDivisionError

        with pytest.raises(MotionStopped, match="not sent"):
            await motion

        assert not any(each.command is c.SET_PTP_CMD for each in sims[0].arm.executed)
        async with fleet.together():
            pass


@pytest.mark.parametrize("moment", [0.0, 0.01, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3])
@pytest.mark.parametrize("what", ["cancel", "unplug"])
def test_the_worst_moment(moment: float, what: str) -> None:
    """However it ends, no arm goes on with what was loaded while another one does not."""

    @virtual
    async def scene() -> None:
        async with AsyncExitStack() as stack:
            fleet, sims = await cell(stack, 0.01, 0.01)

            async def start() -> None:
                async with fleet.together() as together:
                    for name in together:
                        together[name].wait(600)

            task = asyncio.create_task(start())
            await asyncio.sleep(moment)
            if what == "cancel":
                task.cancel()
            else:
                sims[0].unplug()

            await asyncio.wait([task], timeout=30)
            assert task.done()
            await asyncio.sleep(1)
            if task.cancelled() or task.exception() or what == "unplug":
                assert sims[1].arm.device.idle

            if what == "unplug" and not task.cancelled():
                assert isinstance(task.exception(), (ConnectionLost, MotionStopped, DobotError, type(None)))

    scene()


def cancel(tasks: list[asyncio.Task[None]], cancelled: list[bool]) -> None:
    """Cancels what there is by now."""
    cancelled.append(all(task.cancel() for task in tasks))


@virtual
async def test_a_cancellation_at_each_step() -> None:
    broken: list[object] = []
    asyncio.get_running_loop().set_exception_handler(lambda _, context: broken.append(context))
    async with AsyncExitStack() as stack:
        fleet, sims = await cell(stack, 0.002, 0.002)

        started: list[int] = []

        async def start() -> None:
            async with fleet.together() as together:
                for name in together:
                    together[name].wait(600)

            started.append(step)

        for step in count(1):
            tasks: list[asyncio.Task[None]] = []
            cancelled: list[bool] = []
            steps = Steps(step, partial(cancel, tasks, cancelled))
            tasks.append(steps.begin(start()))
            await asyncio.wait(tasks, timeout=30)
            assert tasks[0].done()
            if not cancelled:
                break

            if step not in started:
                assert tasks[0].cancelled()
                assert all(sim.arm.device.idle for sim in sims), step

            await fleet.stop()

        assert step > 20
        await fleet.stop()

    gc.collect()
    assert not broken, "a task of the driver died"


@virtual
async def test_families_that_cannot_pause_start_with_the_others() -> None:
    async with (
        simulate(speed=5) as one,
        simulate("mycobot280", speed=5) as two,
        simulate("ultraarm", homed=True, speed=5) as three,
    ):
        members: dict[str, Member[Magician | MyCobot | UltraArm]] = {
            "magician": Member(one.url, Magician),
            "cobot": Member(two.url, MyCobot, options={"model": "mycobot280"}),
            "ultra": Member(three.url, UltraArm),
        }
        async with Fleet.connect(members) as fleet:
            await fleet.arm("cobot", MyCobot).power_on()
            async with fleet.together() as together:
                together["magician"].move_to(*NEAR)
                together["cobot"].move_joints(10, 10, 10, 10, 10, 10)
                together["ultra"].move_to(200, 0, 100)

            await together.wait()
            assert together.skew < 0.2


@virtual
async def test_leftovers_that_end_while_a_start_is_made_ready_have_nobody_watch_what_was_not_sent() -> None:
    broken: list[dict[str, Any]] = []
    asyncio.get_running_loop().set_exception_handler(lambda _, context: broken.append(context))
    async with simulate("ultraarm", faults=Faults(latency=0.05)) as slow, simulate() as quick:
        async with UltraArm.connect(slow.url) as arm:
            await arm.home()
            for _ in range(2):  # one is under way, and one lies in the own queue of the arm
                arm.link.send_nowait(arm.link.frame(u.WAIT, u.Dwell(1)))

            while not await arm.get_queue_size():
                pass

        members: dict[str, Member[Magician | UltraArm]] = {
            "slow": Member(slow.url, UltraArm, {"queue": "keep"}, guard="wait"),
            "quick": Member(quick.url, Magician),
        }
        async with Fleet.connect(members) as fleet:
            assert await fleet.arm("slow", UltraArm).get_queue_size()
            async with fleet.together() as together:
                together["slow"].move_to(200, 0, 40)
                together["quick"].move_to(*NEAR)

            await together.wait()

    gc.collect()
    assert not broken, "a task of the driver died"
