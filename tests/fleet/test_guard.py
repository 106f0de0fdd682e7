"""What the guard promises, case by case; docs/fleet.md has the list. Where the tool really is, the monitor tells."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Mapping
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from typing import Any

import pytest
from monitor import Monitor, Stand, true_joints
from virtual import virtual

from dobot_async import ArmAlarm, Fleet, Jog, Magician, MotionStopped, PTPMode, ReplyTimeout
from dobot_async.arms.magician import commands as c
from dobot_async.fleet import BaseFrame, Box, Member, ZoneDeadlock, ZoneOccupied
from dobot_async.simulator import Faults, Simulation, simulate

BIN = Box((240, 300), (-40, 40), (0, 80))
LIMITS = Box((150, 300), (-60, 60), (0, 150))
OUT, ASIDE, IN = (200, -120, 40), (200, 120, 40), (270, 0, 40)
LONGER = c.EndEffectorParams(110, 0, 0)

Cell = tuple[Fleet[Magician], Mapping[str, Simulation]]


@asynccontextmanager
async def cell(
    *, options: Mapping[str, Any] | None = None, at: Mapping[str, Any] | None = None, speed: float = 5, **details: Any
) -> AsyncIterator[Cell]:
    """Two guarded arms at one place, which only a simulation allows: what one can reach, the other one can."""
    async with AsyncExitStack() as stack:
        sims = {name: await stack.enter_async_context(simulate(speed=speed, homed=True)) for name in ("a", "b")}
        for name, sim in sims.items():
            sim.arm.guide_to(*(at or {"a": OUT, "b": ASIDE})[name])

        yield await stack.enter_async_context(connected(sims, options, **details)), sims


def connected(sims: Mapping[str, Simulation], options: Mapping[str, Any] | None = None, **details: Any) -> Any:
    """The fleet of these arms, the first of which has these options."""
    details = {"guard": "wait", "group": "g", **details}
    members = {
        name: Member(sim.url, Magician, options=options if options and name == "a" else {}, **details)
        for name, sim in sims.items()
    }
    return Fleet.connect(members, zones={"bin": BIN, "belt": None}, groups={"g": "alone"})


def inside(sim: Simulation, box: Box = BIN) -> bool:
    """Whether the tool of an arm is in a box."""
    place = Monitor({"it": sim}, {"it": Stand()}, {}).place("it")
    return box.contains(*place)


def was_told(sim: Simulation) -> bool:
    """Whether an arm was told of a motion."""
    return sim.arm.device.moving or any(each.command is c.SET_PTP_CMD for each in sim.arm.executed)


async def left_behind(sim: Simulation) -> None:
    """What an earlier program leaves in an arm's queue: it waits, goes into the bin, and stays there for a while."""
    async with Magician.connect(sim.url) as arm:
        await arm.queue.wait(10)
        await arm.queue.move_to(*IN)
        await arm.queue.wait(10)
        await arm.queue.move_to(*OUT)


@virtual
async def test_an_arm_with_leftovers_may_go_anywhere_until_they_are_done() -> None:
    async with simulate(speed=5, homed=True) as sa, simulate(speed=5, homed=True) as sb:
        sa.arm.guide_to(*OUT)
        sb.arm.guide_to(*ASIDE)
        await left_behind(sa)
        async with connected({"a": sa, "b": sb}, {"queue": "keep"}) as fleet:
            assert fleet.holders("bin") == ["a"]
            moving = asyncio.create_task(fleet["b"].move_to(*IN))
            while not moving.done():
                assert not (inside(sa) and inside(sb))
                await asyncio.sleep(0.01)

            await moving
            assert inside(sb)
            assert [each.command for each in sa.arm.executed].count(c.SET_PTP_CMD) == 2, "all of it was done"


@virtual
async def test_who_may_be_in_a_zone_does_not_move_there_beside_another_who_may() -> None:
    async with simulate(speed=5, homed=True, faults=Faults(latency=0.1)) as sa, simulate(speed=5, homed=True) as sb:
        sa.arm.guide_to(*OUT)
        sb.arm.guide_to(*ASIDE)
        await left_behind(sa)
        members = {
            "a": Member(sa.url, Magician, {"queue": "keep"}, guard="wait"),
            "b": Member(sb.url, Magician, guard="wait", rail=90),  # it was not told of its rail, and so may be anywhere
        }
        async with Fleet.connect(members, zones={"bin": BIN}) as fleet:
            assert fleet.holders("bin") == ["b", "a"]
            moving = asyncio.create_task(fleet["b"].move_to(*IN))
            seen = 0
            while not moving.done():
                seen += inside(sa)
                assert not (inside(sa) and inside(sb))
                await asyncio.sleep(0.01)

            await moving
            assert seen
            assert inside(sb)


@virtual
async def test_leftovers_that_are_cleared_hold_nothing_back() -> None:
    async with simulate(speed=5, homed=True) as sa, simulate(speed=5, homed=True) as sb:
        sa.arm.guide_to(*OUT)
        sb.arm.guide_to(*ASIDE)
        await left_behind(sa)
        async with connected({"a": sa, "b": sb}, {"queue": "keep"}) as fleet:
            await fleet["a"].stop()
            await fleet["b"].move_to(*IN)
            assert not inside(sa)


@pytest.mark.parametrize("how", ["verb", "request", "queue"])
def test_another_tool_that_sticks_out_into_a_zone(how: str) -> None:
    @virtual
    async def scene() -> None:
        async with cell(at={"a": (225, 0, 40), "b": ASIDE}) as (fleet, sims):
            if how == "verb":
                await fleet["a"].set_end_effector(LONGER)
            elif how == "request":
                await fleet["a"].request(c.SET_END_EFFECTOR_PARAMS, LONGER)
            else:
                await fleet["a"].queue.put(c.SET_END_EFFECTOR_PARAMS, LONGER)
                await fleet["a"].queue.join()

            assert inside(sims["a"])
            assert fleet.holders("bin") == ["a"]
            with pytest.raises(ReplyTimeout, match="did not get zone bin"):
                await asyncio.create_task(fleet["b"].queue.move_to(*IN, timeout=1))

            await fleet["a"].move_joints(0, 0, 60, 0)
            assert not inside(sims["a"])
            await fleet["b"].move_to(*IN)

    scene()


@pytest.mark.parametrize("how", ["request", "queue"])
def test_another_tool_waits_for_the_zone_that_it_would_stick_out_into(how: str) -> None:
    @virtual
    async def scene() -> None:
        async with cell(at={"a": (225, 0, 40), "b": IN}) as (fleet, sims):
            put: Any = fleet["a"].queue.put if how == "queue" else fleet["a"].request
            changing = asyncio.create_task(put(c.SET_END_EFFECTOR_PARAMS, LONGER))
            await asyncio.sleep(1)
            assert not inside(sims["a"])
            await fleet["b"].move_to(*ASIDE)
            await changing
            await fleet["a"].queue.join()
            assert inside(sims["a"])

    scene()


@virtual
async def test_a_tool_that_was_refused_leaves_nothing_behind() -> None:
    async with cell(guard="raise", at={"a": (225, 0, 40), "b": IN}) as (fleet, sims):
        with pytest.raises(ZoneOccupied):
            await fleet["a"].set_end_effector(LONGER)

        with pytest.raises(ZoneOccupied):
            await fleet["a"].queue.put(c.SET_END_EFFECTOR_PARAMS, LONGER)

        await fleet["a"].move_by(0, 0, 1)
        await fleet["a"].stop()
        await fleet["a"].move_by(0, 0, 1)
        assert fleet.holders("bin") == ["b"]
        with pytest.raises(ZoneOccupied):
            await fleet["a"].move_to(*IN)

        assert not inside(sims["a"])


@virtual
async def test_the_ways_behind_a_queued_tool_are_those_of_the_tool() -> None:
    async with cell(guard="raise") as (fleet, sims):
        joints = (0, 15, 30, 0)  # with the short tool in front of the bin, with the long one in it
        await fleet["a"].move_joints(*joints)
        assert not inside(sims["a"])
        await fleet["a"].move_to(*OUT)
        await fleet["b"].move_to(*IN)
        await fleet["a"].move_joints(*joints)
        await fleet["a"].move_to(*OUT)
        with pytest.raises(ZoneOccupied, match="a may not pass: b holds zone bin"):
            async with fleet["a"].queue.batch() as batch:
                batch.put(c.SET_END_EFFECTOR_PARAMS, LONGER)
                motion = batch.move_joints(*joints)

        with pytest.raises(ZoneOccupied):
            await motion

        assert sims["a"].arm.state.get(c.SET_END_EFFECTOR_PARAMS) != LONGER, "nothing of it was sent"


@virtual
async def test_a_tool_that_is_queued_behind_a_motion_is_put_on_wherever_an_alarm_ends_that() -> None:
    async with cell(at={"a": (225, 0, 40), "b": IN}, speed=1) as (fleet, sims):

        async def change() -> None:
            async with fleet["a"].queue.batch() as batch:
                batch.move_to(*OUT)
                batch.put(c.SET_END_EFFECTOR_PARAMS, LONGER)

        changing = asyncio.create_task(change())
        await asyncio.sleep(1)
        assert not was_told(sims["a"])
        await fleet["b"].move_to(*ASIDE)
        await changing
        sims["a"].arm.raise_alarm(0x40)
        with pytest.raises(ArmAlarm):
            await fleet["a"].queue.join()

        await asyncio.sleep(1)
        assert inside(sims["a"])
        assert fleet.holders("bin") == ["a"]


@virtual
async def test_a_tool_that_changes_on_the_way_makes_the_way_unknown() -> None:
    async with cell(speed=1) as (fleet, _):
        first = await fleet["a"].queue.move_to(200, -150, 60)
        second = await fleet["a"].queue.move_to(*OUT)
        await asyncio.sleep(0.1)
        assert fleet.holders("bin") == []
        await fleet["a"].request(c.SET_END_EFFECTOR_PARAMS, LONGER)
        await first
        await asyncio.sleep(0.1)
        assert not second.done
        assert fleet.holders("bin") == ["a"]
        await second
        await asyncio.sleep(1)
        assert fleet.holders("bin") == []


@virtual
async def test_an_arm_that_was_switched_off_has_forgotten_its_tool_and_the_guard_has_not() -> None:
    async with cell(at={"a": (225, 0, 40), "b": ASIDE}) as (fleet, sims):
        await fleet["a"].set_end_effector(LONGER)
        monitor = Monitor(sims, {"a": Stand(), "b": Stand()}, {})
        monitor.switch_off_and_on("a")
        with suppress(Exception):
            await fleet["a"].queue.wait(0)
            await fleet["a"].queue.join()

        await fleet["a"].recover()
        await fleet["a"].move_by(0, 0, 1)
        assert BIN.contains(*monitor.place("a"))
        assert fleet.holders("bin") == ["a"]


@virtual
async def test_a_rail_is_part_of_where_the_arm_stands() -> None:
    far = Box((240, 300), (560, 640), (0, 80))
    async with simulate(speed=5, homed=True) as sa, simulate(speed=5, homed=True) as sb:
        sa.arm.guide_to(*OUT)
        sb.arm.guide_to(*OUT)
        members = {
            "a": Member(sa.url, Magician, guard="wait", rail=90),
            "b": Member(sb.url, Magician, guard="wait", base=BaseFrame(0, 600)),
        }
        async with Fleet.connect(members, zones={"far": far}) as fleet:
            with pytest.raises(ValueError, match=r"l: this guarded arm is on no rail; .*rail=90"):
                await fleet["b"].move_to(*OUT, l=10)

            with pytest.raises(ValueError, match="0 to 1000 mm"):
                await fleet["a"].move_to(*OUT, l=1001)

            assert fleet.holders("far") == ["a"], "an arm that was not told of its rail may be anywhere along it"
            with pytest.raises(ReplyTimeout, match="did not get zone far"):
                await asyncio.create_task(fleet["b"].queue.move_to(*IN, timeout=1))

            await fleet["a"].set_rail()
            assert fleet.holders("far") == []
            await fleet["b"].move_to(*IN)
            riding = asyncio.create_task(fleet["a"].move_to(*IN, l=600))
            await asyncio.sleep(2)
            assert sa.arm.rail == 0
            await fleet["b"].move_to(*OUT)
            await riding
            assert far.contains(*Stand(rail=90).tool(true_joints(sa), (59.7, 0, 0)))
            assert fleet.holders("far") == ["a"]
            await fleet["a"].move_to(*OUT)
            await asyncio.sleep(0.1)
            assert fleet.holders("far") == []
            await fleet["b"].move_to(*IN)


def test_a_rail_is_a_magicians_and_has_a_direction() -> None:
    for rail in (float("nan"), float("inf")):
        with pytest.raises(ValueError, match="rail is the direction"):
            Member("sim:", Magician, rail=rail)


@virtual
async def test_arms_that_start_together_cannot_share_a_zone() -> None:
    async with cell() as (fleet, sims):
        with pytest.raises(ZoneDeadlock, match="a and b start together, and each needs zone bin from the start on"):
            async with fleet.together() as batches:
                first = batches["a"].move_to(*IN)
                batches["b"].move_to(*IN)

        with pytest.raises(MotionStopped):
            await first

        assert fleet.holders("bin") == []
        assert not any(each.command is c.SET_PTP_CMD for sim in sims.values() for each in sim.arm.executed)
        await fleet["a"].move_to(*IN)
        with pytest.raises(ZoneDeadlock):
            async with fleet.together() as batches:
                batches["a"].move_to(*OUT)
                batches["b"].move_to(*IN)


@virtual
async def test_a_start_together_waits_for_all_its_zones_and_holds_none_before() -> None:
    async with AsyncExitStack() as stack:
        sims = {name: await stack.enter_async_context(simulate(speed=5, homed=True)) for name in "abc"}
        for sim in sims.values():
            sim.arm.guide_to(*OUT)

        zones = {"bin": BIN, "side": Box((170, 230), (90, 150), (0, 80))}
        members = {name: Member(sim.url, Magician, guard="wait") for name, sim in sims.items()}
        fleet: Fleet[Magician] = await stack.enter_async_context(Fleet.connect(members, zones=zones))
        await fleet["c"].move_to(*IN)

        async def start() -> None:
            async with fleet.together("a", "b") as batches:
                batches["a"].move_to(*IN)
                batches["b"].move_to(*ASIDE, mode=PTPMode.JUMP_XYZ)
                batches["b"].move_to(*ASIDE, mode=PTPMode.JUMP_XYZ)

            await batches.wait()

        await fleet["b"].request(c.SET_PTP_JUMP_PARAMS, c.PTPJumpParams(60, 150))
        await fleet["b"].request(c.SET_PTP_JUMP2_PARAMS, c.PTPJump2Params(60, 60, 150))
        starting = asyncio.create_task(start())
        await asyncio.sleep(1)
        assert fleet.holders("side") == []
        await fleet["c"].move_to(*OUT)
        await starting
        assert fleet.holders("side") == ["b"]
        assert fleet.holders("bin") == ["a"]


@virtual
async def test_an_arm_that_no_program_moves_any_more_is_not_waited_for() -> None:
    async with cell() as (fleet, _):

        async def a() -> None:
            await fleet["a"].move_to(*IN)

        async def b() -> None:
            await asyncio.sleep(1)
            with pytest.raises(ZoneOccupied, match="a is in zone bin, and no program is left that moves it"):
                await fleet["b"].move_to(*IN)

            with pytest.raises(ZoneOccupied, match="no program is left"):
                async with fleet.zone("bin"):
                    pass

        async with asyncio.timeout(60):
            await fleet.run({"a": a(), "b": b()})


@virtual
async def test_who_waits_already_is_told_when_the_program_ends_and_not_before() -> None:
    async with cell() as (fleet, _):

        async def a() -> None:
            await fleet["a"].move_to(*IN)
            await asyncio.sleep(10)

        async def b() -> float:
            await asyncio.sleep(5)
            with pytest.raises(ZoneOccupied, match="no program is left"):
                await fleet["b"].move_to(*IN)

            return asyncio.get_running_loop().time()

        async def gentle() -> None:
            await asyncio.sleep(1)

        began = asyncio.get_running_loop().time()
        done = await fleet.run({"a": a(), "b": b(), "other": gentle()})
        assert done["b"] is not None
        assert done["b"] - began > 10


@virtual
async def test_an_arm_that_its_caller_has_parked_is_told_in_a_run_and_waited_for_outside() -> None:
    async with cell() as (fleet, _):
        await fleet["a"].move_to(*IN)

        async def b() -> None:
            with pytest.raises(ZoneOccupied, match="no program is left"):
                await fleet["b"].move_to(*IN)

        await fleet.run({"b": b()})
        waiting = asyncio.create_task(fleet["b"].move_to(*IN))
        await asyncio.sleep(1)
        assert not waiting.done()
        await fleet["a"].move_to(*OUT)
        await waiting


@virtual
async def test_a_zone_stays_with_the_program_whose_arm_fails_in_it() -> None:
    async with cell(guard="off") as (fleet, sims):
        both = 0

        async def a() -> None:
            async with fleet.zone("bin"):
                await fleet["a"].move_to(*IN)
                with pytest.raises(ArmAlarm):
                    await fleet["a"].move_to(900, 0, 40)

                await asyncio.sleep(1)
                assert fleet.holders("bin") == ["program a"]
                await fleet["a"].recover()
                await fleet["a"].move_to(*OUT)

        async def b() -> None:
            await asyncio.sleep(0.1)
            async with fleet.zone("bin"):
                await fleet["b"].move_to(*IN)

        async def watch() -> None:
            nonlocal both
            while True:
                both += inside(sims["a"]) and inside(sims["b"])
                await asyncio.sleep(0.01)

        watching = asyncio.create_task(watch())
        await fleet.run({"a": a(), "b": b()})
        watching.cancel()
        assert inside(sims["b"])
        assert both == 0


@pytest.mark.parametrize("direction", [Jog.Y_PLUS, Jog.Y_MINUS, Jog.J1_PLUS, Jog.X_PLUS])
@pytest.mark.parametrize("speed", [1, 5])
def test_a_jog_ends_at_the_limits(direction: Jog, speed: float) -> None:
    @virtual
    async def scene() -> None:
        async with cell(at={"a": (220, 0, 40), "b": (220, 0, 40)}, limits=LIMITS, speed=speed) as (fleet, sims):
            await fleet["b"].jog(direction, 0.01)
            with pytest.raises(MotionStopped, match="a was stopped in its jog: it has come to its limits"):
                await fleet["a"].jog(direction, 20)

            assert inside(sims["a"], LIMITS)
            assert sims["a"].arm.device.idle
            assert abs(sims["a"].arm.pose.y) > 10 or sims["a"].arm.pose.x > 225, "it went some way"
            await fleet["a"].move_to(220, 0, 40)

    scene()


@virtual
async def test_a_jog_that_cannot_be_seen_ends() -> None:
    async with cell(at={"a": (220, 0, 40), "b": OUT}, limits=LIMITS, speed=1) as (fleet, sims):
        with pytest.raises(MotionStopped, match="it does not say where it is"):
            async with fleet["a"].jogging(Jog.Z_PLUS):
                await asyncio.sleep(0.1)
                sims["a"].faults.loss = 1.0
                await asyncio.sleep(1)
                sims["a"].faults.loss = 0.0
                await asyncio.sleep(1)
                assert sims["a"].arm.device.idle


@virtual
async def test_a_way_that_leads_back_inside_passes() -> None:
    async with cell(at={"a": (220, 100, 40), "b": ASIDE}, limits=LIMITS) as (fleet, sims):
        with pytest.raises(ValueError, match="the way leaves the arm's limits"):
            await fleet["a"].move_to(220, 110, 40)

        with pytest.raises(ValueError, match="the way leaves the arm's limits"):
            await fleet["a"].move_to(220, 70, 40)

        await fleet["a"].jog(Jog.Y_MINUS, 0.01)
        await fleet["a"].move_to(220, 0, 40)
        assert inside(sims["a"], LIMITS)


@virtual
async def test_targets_are_checked_behind_a_home_too() -> None:
    async with cell(at={"a": (220, 0, 40), "b": OUT}, limits=LIMITS) as (fleet, sims):
        arm = fleet["a"]
        await arm.queue.home()
        outside = "the way leaves the arm's limits"
        with pytest.raises(ValueError, match=outside):
            await arm.queue.move_to(220, 120, 40)

        with pytest.raises(ValueError, match=outside):
            await arm.queue.move_joints(60, 40, 40, 0)

        with pytest.raises(ValueError, match=outside):
            await arm.queue.path_to(220, 120, 40)

        with pytest.raises(ValueError, match="await what comes before it"):
            await arm.queue.move_by(0, 10, 0)

        await arm.queue.move_to(220, 20, 40)
        await arm.queue.join()
        await arm.move_by(0, 10, 0)
        assert inside(sims["a"], LIMITS)


@virtual
async def test_jogs_without_an_end_are_refused() -> None:
    async with cell() as (fleet, sims):
        jog = c.JOGCmd(False, c.JOGKey.AP_DOWN)
        with pytest.raises(ValueError, match=r"use arm\.jogging"):
            await fleet["a"].queue.put(c.SET_JOG_CMD, jog)

        with pytest.raises(ValueError, match=r"use arm\.jogging"):
            await fleet["a"].request(c.SET_JOG_CMD, jog)

        await fleet["a"].request(c.SET_JOG_CMD, c.JOGCmd(False, c.JOGKey.IDLE))
        assert sims["a"].arm.device.idle


@virtual
async def test_an_arm_that_was_led_by_hand_is_looked_at_before_it_moves() -> None:
    async with cell() as (fleet, sims):
        await fleet["a"].move_to(*OUT)
        await fleet["b"].move_to(*ASIDE)
        sims["a"].arm.guide_to(*IN)
        await fleet["a"].move_by(0, 0, 1)
        assert fleet.holders("bin") == ["a"]


@virtual
async def test_who_stands_beside_a_zone_that_another_arm_holds_may_not_move_into_it() -> None:
    async with cell(guard="raise", at={"a": OUT, "b": IN}) as (fleet, sims):
        sims["a"].arm.guide_to(BIN.x[0] - 1.5, 0, 40)
        with pytest.raises(ZoneOccupied, match="b holds zone bin"):
            await fleet["a"].move_to(*IN)

        assert fleet.holders("bin") == ["b"]
        await fleet["b"].move_to(*ASIDE)
        await asyncio.sleep(0.1)
        await fleet["a"].move_to(*IN)


@virtual
async def test_a_zone_ahead_of_an_arm_is_kept_until_it_has_heard_its_stop() -> None:
    async with cell(speed=1) as (fleet, sims):
        await fleet["a"].set_speed(1)
        motion = await fleet["a"].queue.move_to(*IN, mode=PTPMode.MOVL_XYZ)
        await asyncio.sleep(1)
        sims["a"].faults.loss = 1.0
        with pytest.raises(ReplyTimeout):
            await fleet["a"].stop(timeout=0.5)

        with pytest.raises(MotionStopped):
            await motion

        waiting = asyncio.create_task(fleet["b"].move_to(*IN))
        await asyncio.sleep(2)
        assert not waiting.done()
        assert fleet.holders("bin") == ["a"]
        sims["a"].faults.loss = 0.0
        await waiting
        assert not inside(sims["a"])
        assert sims["a"].arm.device.idle
