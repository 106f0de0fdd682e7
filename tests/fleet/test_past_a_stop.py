"""Nothing goes on past a stop: whatever an arm is in the middle of, once the stop has returned it does not move.

Each scenario is run once for each step of all its tasks, and stopped at that step. MOMENTS=all does so with more of
them: on slow links, and in longer programs.
"""

from __future__ import annotations

import asyncio
import gc
import os
from collections.abc import AsyncIterator, Callable, Coroutine, Mapping, Sequence
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from itertools import count, cycle
from typing import Any

import pytest
from steps import Steps
from virtual import virtual

from dobot_async import (
    DobotError,
    Fleet,
    Jog,
    Magician,
    MotionStopped,
    MyCobot,
    PTPMode,
    SuctionCup,
    UltraArm,
    UltraArmJog,
)
from dobot_async.arms.magician import commands as c
from dobot_async.fleet import BarrierBroken, BaseFrame, Box, Cylinder, Member
from dobot_async.simulator import Faults, Simulation, simulate

ALL = os.environ.get("MOMENTS") == "all"
ZONES: Mapping[str, Box | Cylinder | None] = {"bin": Box((240, 300), (-40, 40), (0, 80)), "belt": None}
HERE, THERE, IN = (200, -120, 40), (200, 120, 40), (270, 0, 40)
LONGER = 0.15  # virtual seconds in which an arm that goes on would be seen to: half a minute of its own

Cell = tuple[Fleet[Magician], Mapping[str, Simulation]]
Scenario = Callable[[Fleet[Any]], Coroutine[Any, Any, None]]


@asynccontextmanager
async def cell(latency: float = 0.002) -> AsyncIterator[Cell]:
    """Two guarded arms, far from each other but for one zone."""
    bases = {"left": BaseFrame(), "right": BaseFrame(540, 0, 0, 180)}
    async with AsyncExitStack() as stack:
        sims = {
            name: await stack.enter_async_context(simulate(speed=200, faults=Faults(latency=latency))) for name in bases
        }
        place(sims)
        members = {name: Member(sim.url, Magician, base=bases[name], guard="wait") for name, sim in sims.items()}
        yield await stack.enter_async_context(Fleet.connect(members, zones=ZONES)), sims


def place(sims: Mapping[str, Simulation]) -> None:
    """Leads all arms to where they begin."""
    for sim in sims.values():
        sim.arm.guide_to(*HERE)


async def alone(fleet: Fleet[Magician]) -> None:
    await fleet["left"].move_to(*THERE, mode=PTPMode.JUMP_XYZ)


async def each(fleet: Fleet[Magician]) -> None:
    async def there(arm: Magician) -> None:
        await arm.set_end_effector(SuctionCup())
        await arm.move_to(*THERE)

    await fleet.each(there)


async def together(fleet: Fleet[Magician]) -> None:
    async with fleet.together() as batches:
        for name in batches:
            batches[name].move_to(*THERE)

    await batches.wait()


async def batch(fleet: Fleet[Magician]) -> None:
    async with fleet["left"].queue.batch() as steps:
        steps.move_to(*THERE)
        await asyncio.sleep(0.001)
        steps.move_to(*HERE)

    await fleet["left"].queue.join()


async def programs(fleet: Fleet[Magician]) -> None:
    """They meet, and take turns in a zone, and do not take a stop for an answer."""

    async def program(name: str) -> None:
        for _ in range(2):
            with suppress(MotionStopped, BarrierBroken):
                await fleet.barrier("meet")
                async with fleet.zone("belt"):
                    await asyncio.sleep(0.001)

            with suppress(MotionStopped):
                await fleet[name].move_to(*IN)
                await fleet[name].move_to(*HERE)

    await fleet.run({name: program(name) for name in fleet})


async def download(fleet: Fleet[Magician]) -> None:
    async def program() -> None:
        moving = await fleet["left"].queue.move_to(*THERE)
        async with fleet["left"].queue.download() as steps:
            steps.move_to(*HERE)
            await asyncio.sleep(0.05)  # longer than a stop takes

        await moving

    await fleet.run({"left": program()})


async def jog(fleet: Fleet[Magician]) -> None:
    with suppress(MotionStopped):
        await fleet["left"].jog(Jog.Y_PLUS, 0.002)

    await asyncio.sleep(LONGER)


async def pause(fleet: Fleet[Magician]) -> None:
    async def program() -> None:
        await fleet["left"].queue.move_to(*THERE)
        back = await fleet["left"].queue.move_to(*HERE)
        await fleet["left"].pause()
        await fleet["left"].resume()
        await back

    await fleet.run({"left": program()})


SCENARIOS: list[Scenario] = [alone, each, together, batch, programs, download, jog, pause]


def stored(sim: Simulation) -> object:
    """The program in the arm's flash, as far as it has come."""
    program = getattr(sim.arm, "program", None)
    return program and (id(program), len(program.commands))


@asynccontextmanager
async def families(latency: float = 0.002) -> AsyncIterator[tuple[Fleet[Any], Mapping[str, Simulation]]]:
    """An arm of each family."""
    kinds = {"magician": ("magician", Magician, {}), "cobot": ("mycobot280", MyCobot, {"model": "mycobot280"})}
    async with AsyncExitStack() as stack:
        sims, members = {}, {}
        for name, (simulated, kind, options) in {**kinds, "ultra": ("ultraarm", UltraArm, {})}.items():
            faults = Faults(latency=latency)
            homed: dict[str, Any] = {} if simulated == "mycobot280" else {"homed": True}
            sims[name] = await stack.enter_async_context(simulate(simulated, speed=50, faults=faults, **homed))
            members[name] = Member[Any](sims[name].url, kind, options=options)

        fleet: Fleet[Any] = await stack.enter_async_context(Fleet.connect(members))
        await fleet.arm("cobot", MyCobot).power_on()
        yield fleet, sims


ways = cycle([-1, 1])
jogs = cycle([0, 1])


async def of_families(fleet: Fleet[Any]) -> None:
    way = next(ways)
    async with fleet.together() as batches:
        batches["magician"].move_to(220, 60 * way, 40)
        batches["cobot"].move_joints(*([20 * way] * 6))
        batches["ultra"].move_to(200, 40 * way, 100)

    await batches.wait()


async def jogs_of_families(fleet: Fleet[Any]) -> None:
    """Jogs, each time back again: at this speed a few of them in one direction come to a limit."""
    way = next(jogs)

    async def jog(name: str, directions: Sequence[object]) -> None:
        with suppress(MotionStopped):
            await fleet[name].jog(directions[way], 0.01)

    await fleet.run({name: jog(name, directions) for name, directions in DIRECTIONS.items()})


@pytest.mark.full
@pytest.mark.parametrize("scenario", [of_families, jogs_of_families], ids=lambda scenario: scenario.__name__)
def test_families_at_each_step(scenario: Scenario) -> None:
    @virtual
    async def scene() -> None:
        async with families() as (fleet, sims):
            for step in count(1, 1 if ALL else 7):
                if not await stopped_at(step, scenario, fleet, sims):
                    assert step > 10
                    break

                await fleet.recover()

    scene()


async def stopped_at(step: int, scenario: Scenario, fleet: Fleet[Any], sims: Mapping[str, Simulation]) -> bool:
    """Stops a scenario at one of its steps; returns whether it has that many."""
    stops: list[asyncio.Task[Mapping[str, tuple[float, Any, Any]]]] = []

    async def stop() -> Mapping[str, tuple[float, Any, Any]]:
        await fleet.stop()
        return {name: (sim.arm.device.now, sim.arm.device.joints, stored(sim)) for name, sim in sims.items()}

    steps = Steps(step, lambda: stops.append(asyncio.create_task(stop())))
    work = steps.begin(scenario(fleet))
    await asyncio.wait([work], timeout=30)
    if not stops:
        assert work.done(), "it hangs"
        work.result()
        return False

    stood = await stops[0]
    await asyncio.sleep(LONGER)
    for name, sim in sims.items():
        stopped, joints, program = stood[name]
        moves = [each for each in sim.arm.executed if each.command and each.command.moves and each.finished > stopped]
        assert not moves, f"{name} moves after the stop at step {step} of {scenario.__name__}: {moves}"
        assert sim.arm.device.joints == joints, f"{name} moved after the stop at step {step} of {scenario.__name__}"
        assert sim.arm.device.idle
        assert stored(sim) == program, f"a download went on after the stop at step {step}"

    if not work.done():
        work.cancel()
        await asyncio.wait([work])

    error = None if work.cancelled() else work.exception()
    assert error is None or isinstance(error, DobotError), error
    return True


@pytest.mark.cases(1)
@pytest.mark.parametrize("latency", [0.002, *([0.0, 0.03] if ALL else [])])
@pytest.mark.parametrize("scenario", SCENARIOS, ids=lambda scenario: scenario.__name__)
def test_at_each_step(scenario: Scenario, latency: float) -> None:
    @virtual
    async def scene() -> None:
        broken: list[object] = []
        asyncio.get_running_loop().set_exception_handler(lambda _, context: broken.append(context))
        async with cell(latency) as (fleet, sims):
            for step in count(1):
                place(sims)
                if not await stopped_at(step, scenario, fleet, sims):
                    assert step > 10
                    break

        gc.collect()
        assert not broken, "a task of the driver died"

    scene()


DIRECTIONS: Mapping[str, Sequence[object]] = {
    "magician": (Jog.Y_MINUS, Jog.Y_PLUS),
    "cobot": ("j1-", "j1+"),
    "ultra": (UltraArmJog.X_MINUS, UltraArmJog.X_PLUS),
}


@pytest.mark.parametrize("name", DIRECTIONS)
def test_a_jog_whose_begin_was_lost_is_not_repeated_behind_a_stop(name: str) -> None:
    @virtual
    async def scene() -> None:
        async with families() as (fleet, sims):
            arm, sim = fleet[name], sims[name]
            jogging = asyncio.create_task(arm.jog(DIRECTIONS[name][1], 1))
            await asyncio.sleep(0)
            sim.faults.loss = 1.0
            await asyncio.sleep(0.001)
            sim.faults.loss = 0.0
            await arm.stop()
            joints = sim.arm.device.joints
            with pytest.raises(MotionStopped):
                await jogging

            await asyncio.sleep(LONGER)
            assert sim.arm.device.joints == joints

    scene()


@virtual
async def test_a_program_that_stops_the_fleet_itself_goes_on_and_the_others_do_not() -> None:
    async with cell() as (fleet, sims):

        async def left() -> None:
            await asyncio.sleep(0.001)
            await fleet.stop()
            await fleet["left"].move_to(*THERE)

        async def right() -> str:
            with suppress(MotionStopped):
                await fleet["right"].queue.wait(60)
                await fleet["right"].queue.join()

            await asyncio.sleep(1)
            with pytest.raises(MotionStopped, match="the fleet was stopped"):
                await fleet["right"].move_to(*THERE)

            return "stopped"

        done = await fleet.run({"left": left(), "right": right()})
        assert done["right"] == "stopped"
        assert sims["left"].arm.pose.y == pytest.approx(THERE[1], abs=0.1)
        assert sims["right"].arm.pose.y == pytest.approx(HERE[1], abs=0.1)
        await fleet["right"].move_to(*THERE)


@virtual
async def test_a_stop_of_one_arm_ends_the_start_of_all() -> None:
    async with cell(0.03) as (fleet, sims):

        async def start() -> None:
            async with fleet.together() as batches:
                for name in batches:
                    batches[name].move_to(*THERE)

        starting = asyncio.create_task(start())
        await asyncio.sleep(0.2)
        await fleet["left"].stop()
        with pytest.raises(MotionStopped):
            await starting

        await asyncio.sleep(1)
        assert [sim.arm.pose.y for sim in sims.values()] == pytest.approx([HERE[1]] * 2, abs=0.1)


@virtual
async def test_what_was_told_of_a_stop_is_not_told_again_when_the_fleet_starts_together() -> None:
    async with cell() as (fleet, _):
        await fleet["left"].queue.wait(60)
        await fleet.stop()
        await together(fleet)


@virtual
async def test_a_stop_of_an_arm_ends_what_was_collected_for_it_before() -> None:
    async with cell() as (fleet, sims):
        arm, sim = fleet["left"], sims["left"]
        with pytest.raises(MotionStopped):
            async with arm.queue.download() as program:
                program.move_to(*THERE)
                await arm.stop()

        with pytest.raises(MotionStopped):
            async with arm.queue.batch() as batch:
                motion = batch.move_to(*THERE)
                await arm.stop()

        with pytest.raises(MotionStopped):
            await motion

        assert sim.arm.program is None
        assert not any(each.command is c.SET_PTP_CMD for each in sim.arm.executed)
