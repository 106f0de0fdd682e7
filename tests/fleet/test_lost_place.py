"""Guarded arms that have lost their place: what they tell of it is wrong until they were homed."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Mapping
from contextlib import AsyncExitStack, asynccontextmanager
from typing import Any

import pytest
from monitor import Monitor, Stand, Zone, true_joints
from virtual import virtual

from dobot_async import Fleet, Magician, MotionStopped, MotionUnknown, ReplyTimeout, UltraArm
from dobot_async.arms.magician import commands as c
from dobot_async.fleet import BaseFrame, Box, Member, ZoneDeadlock
from dobot_async.simulator import Simulation, simulate

BIN, ZONE = Box((240, 300), (-40, 40), (0, 80)), Zone((270, 0, 40), (30, 40, 40))
LIMITS = Box((100, 300), (-160, 160), (-50, 150))
LEFT, RIGHT, IN = (250, 150, 40), (250, -150, 40), (270, 0, 40)
"""An arm that is switched off and on at LEFT takes itself to be straight ahead; told to go to RIGHT it goes there."""

Cell = tuple[Fleet[Magician], Mapping[str, Simulation], Monitor]


@asynccontextmanager
async def cell(b: tuple[float, float, float] = IN, **details: Any) -> AsyncIterator[Cell]:
    """Two guarded arms at one place, under the eyes of the monitor: a at LEFT, b in the bin."""
    async with AsyncExitStack() as stack:
        sims = {name: await stack.enter_async_context(simulate(speed=5, homed=True)) for name in ("a", "b")}
        sims["a"].arm.guide_to(*LEFT)
        sims["b"].arm.guide_to(*b)
        members = {
            name: Member(sim.url, Magician, guard="wait", group="g", **(details if name == "a" else {}))
            for name, sim in sims.items()
        }
        connecting = Fleet.connect(members, zones={"bin": BIN}, groups={"g": "alone"})
        fleet: Fleet[Magician] = await stack.enter_async_context(connecting)
        monitor = Monitor(sims, {name: Stand() for name in sims}, {"bin": ZONE})
        watching = asyncio.create_task(monitor.watch())
        try:
            yield fleet, sims, monitor
        finally:
            watching.cancel()
            await asyncio.wait([watching])
            if not watching.cancelled():
                watching.result()


def moves(sim: Simulation) -> int:
    """How many motions an arm has been at."""
    return sum(each.command is not None and each.command.moves for each in sim.arm.executed)


async def switched_off_and_on(fleet: Fleet[Magician], monitor: Monitor, name: str) -> None:
    """An arm with nothing to do was switched off and on, which is found out; then it is made ready again."""
    await asyncio.sleep(1)
    monitor.switch_off_and_on(name)
    with pytest.raises(MotionUnknown, match=f"{name}: the arm was switched off and on"):
        await fleet[name].move_to(*LEFT)

    await fleet[name].recover()


async def refused(fleet: Fleet[Magician], name: str, place: tuple[float, float, float]) -> None:
    """An arm does not get the bin for a way to a place."""
    with pytest.raises(ReplyTimeout, match="did not get zone bin"):
        await asyncio.create_task(fleet[name].queue.move_to(*place, timeout=1))


@virtual
async def test_an_arm_that_was_switched_off_with_nothing_to_do_is_found_out_before_it_moves() -> None:
    async with cell(b=RIGHT) as (fleet, sims, monitor):
        await fleet["a"].move_by(0, 0, 1)
        await asyncio.sleep(1)
        monitor.switch_off_and_on("a")
        before = true_joints(sims["a"])
        with pytest.raises(MotionUnknown, match="a: the arm was switched off and on"):
            await fleet["a"].move_to(250, 160, 40)

        await asyncio.sleep(1)
        assert isinstance(fleet.failures["a"], MotionUnknown)
        assert true_joints(sims["a"]) == before


@pytest.mark.parametrize("start", ["alone", "together"])
def test_an_arm_that_was_switched_off_while_it_waited_for_a_zone_does_not_move(start: str) -> None:
    async def move(fleet: Fleet[Magician]) -> None:
        if start == "alone":
            await fleet["a"].move_to(*IN)
        else:
            async with fleet.together("a") as batches:
                batches["a"].move_to(*IN)

    @virtual
    async def scene() -> None:
        async with cell() as (fleet, sims, monitor):
            waiting = asyncio.create_task(move(fleet))
            await asyncio.sleep(1)
            monitor.switch_off_and_on("a")
            before = true_joints(sims["a"])
            await asyncio.sleep(1)
            await fleet["b"].move_to(*RIGHT)
            with pytest.raises(MotionUnknown, match="a: the arm was switched off and on"):
                await waiting

            await asyncio.sleep(1)
            assert true_joints(sims["a"]) == before

    scene()


@virtual
async def test_each_way_of_an_arm_that_was_switched_off_may_lead_anywhere_until_it_was_homed() -> None:
    async with cell() as (fleet, sims, monitor):
        moving = await fleet["a"].queue.move_to(*LEFT)
        monitor.switch_off_and_on("a")
        with pytest.raises(MotionUnknown):
            await moving

        await fleet["a"].recover()
        await refused(fleet, "a", RIGHT)
        homing = asyncio.create_task(fleet["a"].home())
        await asyncio.sleep(1)
        assert not sims["a"].arm.homed
        await fleet["b"].move_to(*RIGHT)
        await homing
        assert sims["a"].arm.homed
        await asyncio.sleep(1)
        assert fleet.holders("bin") == []
        await fleet["a"].move_to(*LEFT)
        await fleet["b"].move_to(*IN)
        await fleet["a"].move_to(250, 160, 40)
        assert fleet.holders("bin") == ["b"]


@virtual
async def test_an_arm_that_was_switched_off_may_be_anywhere_until_it_was_homed() -> None:
    async with cell(b=RIGHT) as (fleet, _, monitor):
        moving = await fleet["a"].queue.move_to(*LEFT)
        monitor.switch_off_and_on("a")
        with pytest.raises(MotionUnknown):
            await moving

        await fleet["a"].recover()
        await fleet["a"].move_to(*RIGHT)
        assert BIN.contains(*monitor.place("a"))
        assert not BIN.contains(*RIGHT)
        assert fleet.holders("bin") == ["a"]
        await refused(fleet, "b", IN)
        await fleet["a"].home()
        await fleet["a"].move_to(*LEFT)
        await fleet["b"].move_to(*IN)
        assert monitor.seen


@virtual
async def test_an_arm_that_has_lost_its_place_takes_no_zone_that_another_one_holds() -> None:
    async with cell(b=RIGHT) as (fleet, _, monitor):
        await fleet["a"].move_to(*IN)
        await fleet["a"].stop()
        await asyncio.sleep(1)
        assert fleet.holders("bin") == ["a"], "it was looked at there"
        await fleet["a"].move_to(*LEFT)
        await fleet["b"].move_to(*IN)
        await switched_off_and_on(fleet, monitor, "a")
        await asyncio.sleep(1)
        assert fleet.holders("bin") == ["b"]
        await refused(fleet, "a", LEFT)


@virtual
async def test_an_arm_that_was_switched_off_a_second_time_has_to_be_homed_again() -> None:
    async with cell(b=RIGHT) as (fleet, _, monitor):
        for _ in range(2):
            await fleet["a"].move_to(*LEFT)
            await fleet["b"].move_to(*IN)
            await switched_off_and_on(fleet, monitor, "a")
            await refused(fleet, "a", LEFT)
            await fleet["b"].move_to(*RIGHT)
            await fleet["a"].home()


@virtual
async def test_a_home_that_was_stopped_has_found_nothing() -> None:
    async with cell(b=RIGHT) as (fleet, sims, monitor):
        await switched_off_and_on(fleet, monitor, "a")
        homing = await fleet["a"].queue.home()
        await asyncio.sleep(0.1)
        await fleet["a"].stop()
        with pytest.raises(MotionStopped):
            await homing

        assert not sims["a"].arm.homed
        await asyncio.sleep(1)
        assert fleet.holders("bin") == ["a"]


@virtual
async def test_two_arms_that_have_lost_their_places_home_one_by_one() -> None:
    async with cell(b=RIGHT) as (fleet, sims, monitor):
        for name in fleet:
            await switched_off_and_on(fleet, monitor, name)

        await fleet.recover()

        async def homed(name: str) -> None:
            await fleet[name].home()
            await fleet[name].move_to(*{"a": LEFT, "b": RIGHT}[name])

        await fleet.run({name: homed(name) for name in fleet})
        assert all(sim.arm.homed for sim in sims.values())


@virtual
async def test_limits_hold_no_arm_that_does_not_know_where_it_is() -> None:
    async with cell(b=RIGHT, limits=LIMITS) as (fleet, sims, monitor):
        await switched_off_and_on(fleet, monitor, "a")
        before = moves(sims["a"])
        with pytest.raises(ValueError, match=r"a: it has lost its place, .*await home\(\) first"):
            await fleet["a"].move_to(*LEFT)

        with pytest.raises(ValueError, match="it has lost its place"):
            await fleet["a"].jog("z+", 0.1)

        assert moves(sims["a"]) == before
        async with fleet["a"].queue.batch() as batch:
            batch.home()
            batch.move_to(*LEFT)

        await fleet["a"].queue.join()
        place = monitor.place("a")
        assert place == pytest.approx(LEFT, abs=0.1)
        await fleet["a"].jog("z+", 0.1)


@virtual
async def test_an_arm_on_a_rail_is_anywhere_along_it_until_it_was_homed_there() -> None:
    far = Box((240, 300), (560, 640), (-50, 80))
    async with simulate(speed=5, homed=True) as sim:
        async with Magician.connect(sim.url) as arm:
            await arm.set_rail()
            await arm.move_to(*IN, l=600)

        member = Member(sim.url, Magician, guard="wait", group="g", rail=90)
        async with Fleet.connect({"a": member}, zones={"far": far, "bin": BIN}, groups={"g": "alone"}) as fleet:
            monitor = Monitor({"a": sim}, {"a": Stand(rail=90)}, {})
            assert fleet.holders("far") == ["a"]
            assert fleet.holders("bin") == []
            await switched_off_and_on(fleet, monitor, "a")
            await fleet["a"].home()  # the arm, and not the rail, which it was not told of
            await fleet["a"].set_rail()
            assert sim.arm.rail == 0
            assert far.contains(*monitor.place("a"))
            await fleet["a"].move_to(*IN, l=0)
            assert far.contains(*monitor.place("a"))
            assert fleet.holders("far") == ["a"]
            await fleet["a"].home()
            await asyncio.sleep(1)
            assert fleet.holders("far") == []
            assert not far.contains(*monitor.place("a"))


@virtual
async def test_of_two_arms_that_may_be_in_a_zone_one_holds_it() -> None:
    far = Box((240, 300), (560, 640), (0, 80))
    async with simulate(speed=5, homed=True) as sa, simulate(speed=5, homed=True) as sb:
        members = {
            name: Member(sim.url, Magician, guard="wait", base=BaseFrame(20 * number), rail=90)
            for number, (name, sim) in enumerate({"a": sa, "b": sb}.items())
        }
        async with Fleet.connect(members, zones={"far": far}) as fleet:
            (one,) = fleet.holders("far")
            (other,) = {"a", "b"} - {one}
            with pytest.raises((ReplyTimeout, ZoneDeadlock), match="far"):
                await asyncio.create_task(fleet[other].queue.move_to(*IN, timeout=1))

            assert not any(each.command is c.SET_PTP_CMD for sim in (sa, sb) for each in sim.arm.executed)


@virtual
async def test_an_ultraarm_without_power_may_be_anywhere_until_it_was_homed() -> None:
    async with simulate("ultraarm", speed=5, homed=True) as sim:
        member = Member(sim.url, UltraArm, guard="wait")
        async with Fleet.connect({"it": member}, zones={"bin": Box((600, 700), (0, 10), (0, 10))}) as fleet:
            assert fleet.holders("bin") == []
            await fleet["it"].release()
            async with fleet.zone("bin", "it"):
                pass

            assert fleet.holders("bin") == ["it"]
            await fleet["it"].power_on()
            await fleet["it"].home()
            await asyncio.sleep(1)
            assert fleet.holders("bin") == []
