"""Zones of programs, and guarded arms: nobody gets into a zone that somebody else holds."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Mapping
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from typing import Any, Literal

import pytest
from virtual import virtual

from dobot_async import ArmAlarm, DobotError, Fleet, Jog, Magician, MotionStopped, PTPMode, ReplyTimeout
from dobot_async.arms.magician import commands as c
from dobot_async.fleet import BaseFrame, Box, Cylinder, Member, ZoneDeadlock, ZoneOccupied
from dobot_async.fleet.zone_locks import ZoneHolder, ZoneRequest
from dobot_async.fleet.zones import Zones
from dobot_async.simulator import Simulation, simulate

# Two arms that face each other; the bin lies in the middle between them, and each has a tray at its side.
BASES = {"left": BaseFrame(), "right": BaseFrame(500, 0, 0, 180)}
BIN = Box(x=(220, 280), y=(-40, 40), z=(0, 80))
IN, OVER, ASIDE, BEHIND = (250, 0, 20), (250, 0, 120), (200, 120, 20), (200, -120, 20)
INSIDE = c.PTPCmd(PTPMode.MOVJ_XYZ, *IN)
ZONES: dict[str, Box | Cylinder | None] = {"bin": BIN, "left tray": Cylinder(200, 120, 30), "belt": None}


@asynccontextmanager
async def facing(
    guard: Literal["wait", "raise"] = "wait", *, alone: bool = False, **details: Any
) -> AsyncIterator[tuple[Fleet[Magician], Mapping[str, Simulation]]]:
    """Two guarded arms and their simulations, out of all zones."""
    async with AsyncExitStack() as stack:
        sims = {name: await stack.enter_async_context(simulate(speed=5)) for name in BASES}
        for sim in sims.values():
            sim.arm.guide_to(*BEHIND)

        members = {
            name: Member(sim.url, Magician, base=BASES[name], guard=guard, group="g", **details)
            for name, sim in sims.items()
        }
        groups: dict[str, Any] = {"g": "alone" if alone else "fleet"}
        yield await stack.enter_async_context(Fleet.connect(members, zones=ZONES, groups=groups)), sims


def moved(sim: Simulation) -> int:
    return sum(each.command is c.SET_PTP_CMD for each in sim.arm.executed)


@virtual
async def test_a_zone_is_for_one_program_at_a_time_in_order() -> None:
    async with facing() as (fleet, _):
        log: list[str] = []

        async def program(name: str) -> None:
            async with fleet.zone("belt"):
                log.append(f"{name} in")
                await asyncio.sleep(1)
                log.append(f"{name} out")

        await fleet.run({name: program(name) for name in "abc"})
        assert log == ["a in", "a out", "b in", "b out", "c in", "c out"]
        with pytest.raises(ValueError, match="there are: bin, left tray, belt"):
            async with fleet.zone("nowhere"):
                pass

        with pytest.raises(KeyError, match="no arm"):
            fleet.zone("bin", "nobody")


@virtual
async def test_a_program_may_hold_a_zone_twice_and_its_children_do_not_share_it() -> None:
    async with facing() as (fleet, _):
        inside = 0

        async def child() -> None:
            nonlocal inside
            async with fleet.zone("belt"):
                inside += 1
                assert inside == 1
                await asyncio.sleep(1)
                inside -= 1

        async with fleet.zone("belt"), fleet.zone("belt"):
            await asyncio.gather(child(), child())
            assert fleet.holders("belt") == [asyncio.current_task().get_name()]  # type: ignore[union-attr]

        assert fleet.holders("belt") == []


@virtual
async def test_a_deadlock_of_programs_raises() -> None:
    async with facing() as (fleet, _):

        async def program(first: str, second: str) -> str:
            try:
                async with fleet.zone(first):
                    await asyncio.sleep(1)
                    async with fleet.zone(second):
                        return "both"
            except ZoneDeadlock as error:
                return str(error)

        told = await fleet.run({"left": program("bin", "belt"), "right": program("belt", "bin")})
        assert min(told.values()).startswith("a deadlock: program ")  # of whoever asks last
        assert "both" in told.values()


@pytest.mark.parametrize("first", ["barrier", "zone"])
def test_who_closes_a_deadlock_of_a_barrier_and_a_zone_is_told(first: str) -> None:
    @virtual
    async def scene() -> None:
        async with facing() as (fleet, _):
            told: list[str] = []

            async def holder() -> None:
                try:
                    async with fleet.zone("belt"):
                        await asyncio.sleep(1 if first == "barrier" else 3)
                        await fleet.barrier("meet")
                except ZoneDeadlock as error:
                    told.append(str(error))
                    await fleet.barrier("meet")

            async def comer() -> None:
                await asyncio.sleep(2)
                try:
                    async with fleet.zone("belt"):
                        pass
                except ZoneDeadlock as error:
                    told.append(str(error))

                await fleet.barrier("meet")

            async with asyncio.timeout(60):
                await fleet.run({"left": holder(), "right": comer()})

            assert len(told) == 1
            assert "program left waits at barrier 'meet' for program right" in told[0]
            assert "program right waits for zone belt, which program left holds" in told[0]

    scene()


@virtual
async def test_an_arm_that_stands_in_a_zone_at_a_barrier_where_its_partner_needs_it() -> None:
    async with facing() as (fleet, sims):

        async def left() -> None:
            await fleet["left"].move_to(*IN)
            await fleet.barrier("meet")

        async def right() -> None:
            await asyncio.sleep(20)
            with pytest.raises(ZoneDeadlock, match=r"right waits for zone bin, which left holds; .*barrier 'meet'"):
                await fleet["right"].move_to(*IN)

            await fleet.barrier("meet")

        await fleet.run({"left": left(), "right": right()})
        assert moved(sims["right"]) == 0


@virtual
async def test_an_arm_that_still_moves_out_of_a_zone_at_a_barrier_is_no_deadlock() -> None:
    async with facing() as (fleet, sims):
        leaving = asyncio.Event()

        async def left() -> None:
            await fleet["left"].move_to(*IN)
            await fleet["left"].set_speed(1)
            await fleet["left"].queue.move_to(*BEHIND)
            leaving.set()
            await fleet.barrier("meet")

        async def right() -> None:
            await leaving.wait()
            assert fleet.holders("bin") == ["left"]
            await fleet["right"].move_to(*IN)
            await fleet.barrier("meet")

        await fleet.run({"left": left(), "right": right()})
        assert moved(sims["right"]) == 1


@virtual
async def test_an_arm_that_comes_to_rest_in_a_zone_closes_the_deadlock() -> None:
    async with facing() as (fleet, _):

        async def left() -> None:
            await fleet["left"].queue.move_to(*IN)
            await fleet.barrier("meet")

        async def right() -> None:
            await asyncio.sleep(0.1)
            with pytest.raises(ZoneDeadlock, match="barrier 'meet'"):
                await fleet["right"].move_to(*IN)

            await fleet.barrier("meet")

        async with asyncio.timeout(60):
            await fleet.run({"left": left(), "right": right()})


@virtual
async def test_two_programs_that_command_one_arm_and_a_zone_that_one_of_them_holds() -> None:
    async with facing() as (fleet, sims):
        told: list[str] = []

        async def stranger() -> None:
            await asyncio.sleep(1)
            await fleet["left"].move_to(*IN)

        async def left() -> None:
            try:
                async with fleet.zone("bin"):
                    await asyncio.sleep(2)
                    await fleet["left"].move_to(*OVER)
            except ZoneDeadlock as error:
                told.append(str(error))

        stranger_running = asyncio.create_task(stranger(), name="stranger")
        async with asyncio.timeout(60):
            await fleet.run({"left": left()})
            await stranger_running

        assert len(told) == 1
        assert "program left waits to command left behind stranger; left waits for zone bin, which program" in told[0]
        assert moved(sims["left"]) == 1


@virtual
async def test_two_barriers_crossed_are_a_deadlock() -> None:
    async with facing() as (fleet, _):
        told: list[str] = []

        async def program(first: str, second: str) -> None:
            try:
                await fleet.barrier(first)
            except ZoneDeadlock as error:
                told.append(str(error))
                await fleet.barrier(second)
                await fleet.barrier(first)
            else:
                await fleet.barrier(second)

        await fleet.run({"left": program("one", "two"), "right": program("two", "one")})
        assert len(told) == 1
        assert "program right waits at barrier 'two' for program left" in told[0]
        assert "program left waits at barrier 'one' for program right" in told[0]


@virtual
async def test_a_helper_that_waits_for_a_zone_keeps_nobody_from_a_barrier() -> None:
    async with facing() as (fleet, _):
        log: list[str] = []

        async def helper() -> None:
            async with fleet.zone("belt"):
                log.append("helper")

        async def left() -> None:
            async with fleet.zone("belt"):
                await asyncio.sleep(1)
                await fleet.barrier("meet")
                log.append("left")

        async def right() -> None:
            await asyncio.sleep(0.5)
            helping = asyncio.create_task(helper())
            await asyncio.sleep(1)
            await fleet.barrier("meet")
            await helping

        await fleet.run({"left": left(), "right": right()})
        assert log == ["left", "helper"]


@virtual
async def test_a_stop_ends_a_claim_that_is_not_judged_yet() -> None:
    arms = {name: ZoneHolder(name) for name in ("left", "right")}
    zones = Zones({"belt": None}, arms)
    caught_up = asyncio.Event()

    async def catch_up() -> None:
        await caught_up.wait()

    zones.guards.append(catch_up)
    zones.locks.take(ZoneRequest(arms["left"], frozenset([arms["left"]]), frozenset(["belt"])))
    request = ZoneRequest(arms["right"], frozenset([arms["right"]]), frozenset(["belt"]))
    asking = asyncio.create_task(zones.request(request, None))
    await asyncio.sleep(1)
    zones.locks.interrupt(arms["right"], MotionStopped("enough"))
    caught_up.set()
    with pytest.raises(MotionStopped, match="enough"):
        await asking

    assert not zones.locks.waiting


@virtual
async def test_an_error_releases_a_zone_and_a_wait_can_time_out() -> None:
    async with facing() as (fleet, _):

        async def holder() -> None:
            async with fleet.zone("belt"):
                await asyncio.sleep(5)
                raise ZeroDivisionError

        task = asyncio.create_task(holder())
        await asyncio.sleep(0)
        with pytest.raises(ReplyTimeout, match="did not get zone belt"):
            async with fleet.zone("belt", timeout=1):
                pass

        async with fleet.zone("belt"):
            assert task.done()

        with pytest.raises(ZeroDivisionError):
            await task


@virtual
async def test_a_guarded_arm_waits_until_the_zone_on_its_way_is_free() -> None:
    async with facing() as (fleet, sims):
        await fleet["left"].move_to(*IN)
        assert fleet.holders("bin") == ["left"]
        right = asyncio.ensure_future(fleet["right"].move_to(*IN))
        await asyncio.sleep(5)
        assert moved(sims["right"]) == 0
        await fleet["left"].move_to(*BEHIND)
        await right
        assert fleet.holders("bin") == ["right"]
        await fleet["right"].move_to(*OVER)
        await asyncio.sleep(1)
        assert fleet.holders("bin") == []


@pytest.mark.parametrize("mode", [PTPMode.MOVL_XYZ, PTPMode.MOVJ_XYZ])
def test_a_way_through_a_zone_counts_though_its_ends_are_outside(mode: PTPMode) -> None:
    @virtual
    async def scene() -> None:
        async with facing("raise") as (fleet, sims):
            await fleet["left"].move_to(220, -60, 20)
            await fleet["right"].move_to(*IN)
            with pytest.raises(ZoneOccupied, match=r"left may not pass: right holds zone bin"):
                await fleet["left"].move_to(220, 60, 20, mode=mode)

            assert moved(sims["left"]) == 1
            await fleet["left"].move_to(220, -60, 120)
            await fleet["left"].move_to(220, 60, 120, mode=mode)

    scene()


@virtual
async def test_a_jump_over_a_zone_is_allowed_and_a_low_one_is_not() -> None:
    async with facing("raise") as (fleet, _):
        await fleet["right"].move_to(*IN)
        await fleet["left"].move_to(220, -60, 80)
        await fleet["left"].request(c.SET_PTP_JUMP_PARAMS, c.PTPJumpParams(2, 200))
        with pytest.raises(ZoneOccupied):
            await fleet["left"].move_to(220, 60, 60, mode=PTPMode.JUMP_XYZ)

        await fleet["left"].request(c.SET_PTP_JUMP_PARAMS, c.PTPJumpParams(30, 200))
        await fleet["left"].request(c.SET_PTP_JUMP2_PARAMS, c.PTPJump2Params(30, 30, 200))
        await fleet["left"].move_to(220, 60, 80, mode=PTPMode.JUMP_XYZ)


@virtual
async def test_a_program_that_holds_a_zone_moves_its_arm_in_and_nobody_else_does() -> None:
    async with facing("raise") as (fleet, _):
        async with fleet.zone("bin"):
            await fleet["left"].move_to(*IN)
            assert fleet.holders("bin")[1:] == ["left"]

            async def other() -> None:
                with pytest.raises(ZoneOccupied, match="left"):
                    await fleet["right"].move_to(*IN)

            await asyncio.create_task(other())  # on behalf of this one, but the left arm is in there
            await fleet["left"].move_to(*BEHIND)

        await asyncio.sleep(0.1)
        await fleet["right"].move_to(*IN)


@virtual
async def test_a_zone_that_is_left_too_early_stays_with_the_arm_that_is_in_it() -> None:
    async with facing() as (fleet, _):
        async with fleet.zone("bin"):
            motion = await fleet["left"].queue.move_to(*IN)

        assert fleet.holders("bin") == ["left"]
        waiting = asyncio.ensure_future(fleet["right"].move_to(*IN))
        await motion
        await asyncio.sleep(1)
        assert not waiting.done()
        await fleet["left"].move_to(*BEHIND)
        await waiting


@virtual
async def test_a_program_gets_a_zone_in_which_its_own_arm_stands() -> None:
    async with facing() as (fleet, _):

        async def left() -> None:
            async with fleet.zone("bin"):
                await fleet["left"].move_to(*BEHIND)

        await fleet["left"].move_to(*IN)
        async with fleet.zone("bin", timeout=1):
            pass  # this task has moved it there

        await fleet.run({"left": left()})


@virtual
async def test_arms_that_want_each_others_place_are_told_of_the_deadlock() -> None:
    async with facing() as (fleet, _):
        await fleet["left"].move_to(*ASIDE)
        await fleet["right"].move_to(*IN)

        async def go(name: str, *place: float) -> str:
            try:
                await fleet[name].move_to(*place)
            except ZoneDeadlock as error:
                await fleet[name].move_to(*BEHIND)
                return str(error)

            return "moved"

        # The left arm's tray, seen from the right arm, is at (300, -120).
        told = await asyncio.gather(go("left", *IN), go("right", 290, -115, 20))
        assert told[0] == "moved"
        assert told[1].startswith("a deadlock: right waits for zone left tray, which left holds; left waits for zone")


@virtual
async def test_homing_and_jogging_need_all_zones() -> None:
    async with facing("raise") as (fleet, _):
        await fleet["right"].move_to(*IN)
        with pytest.raises(ZoneOccupied):
            await fleet["left"].home()

        with pytest.raises(ZoneOccupied):
            await fleet["left"].jog(Jog.Z_PLUS, 1)

        await fleet["right"].move_to(*BEHIND)
        await asyncio.sleep(0.1)
        await fleet["left"].home()
        await fleet["left"].jog(Jog.Z_PLUS, 0.1)
        assert fleet.holders("left tray") == []


@virtual
async def test_all_home_one_after_the_other() -> None:
    async with facing() as (fleet, sims):
        await fleet.each("home")
        first, second = sorted((sim.arm.executed[-1].started, sim.arm.executed[-1].finished) for sim in sims.values())
        assert first[1] <= second[0]


@virtual
async def test_a_stop_ends_the_waiting_for_a_zone() -> None:
    async with facing() as (fleet, sims):
        await fleet["left"].move_to(*IN)
        right = asyncio.create_task(fleet["right"].queue.put(c.SET_PTP_CMD, INSIDE))
        await asyncio.sleep(1)
        await fleet.stop()
        with pytest.raises(MotionStopped):
            await right

        await asyncio.sleep(1)
        assert moved(sims["right"]) == 0
        assert fleet.holders("bin") == ["left"], "it still stands there"
        with pytest.raises(ReplyTimeout, match="zone bin"):
            await asyncio.create_task(fleet["right"].queue.put(c.SET_PTP_CMD, INSIDE, timeout=1))


@virtual
async def test_an_arm_that_was_stopped_on_its_way_is_looked_for() -> None:
    async with facing() as (fleet, sims):
        async with asyncio.timeout(1):
            motion = await fleet["left"].queue.move_to(*IN)

        await asyncio.sleep(0.01)
        await fleet["left"].stop()
        with pytest.raises(MotionStopped):
            await motion

        await asyncio.sleep(1)
        pose = sims["left"].arm.pose
        x, y, z, _ = BASES["left"].to_cell(pose.x, pose.y, pose.z)
        assert fleet.holders("bin") == (["left"] if BIN.contains(x, y, z, 2.5) else [])
        await fleet["left"].move_to(*IN)


@virtual
async def test_a_failed_arm_in_a_zone_is_not_waited_for() -> None:
    async with facing(alone=True) as (fleet, sims):
        await fleet["left"].move_to(*IN)
        right = asyncio.ensure_future(fleet["right"].move_to(*IN))
        await asyncio.sleep(1)
        sims["left"].unplug()
        with pytest.raises(ZoneOccupied, match="left has failed, and may still be in zone bin"):
            await right

        await fleet["right"].move_to(*OVER)


@virtual
async def test_a_program_whose_arm_fails_keeps_its_zones_to_the_end_of_its_block() -> None:
    async with facing(alone=True) as (fleet, sims):

        async def left() -> None:
            async with fleet.zone("belt"):
                await asyncio.sleep(1)
                sims["left"].unplug()
                await asyncio.sleep(100)

        async def right() -> float:
            async with fleet.zone("belt"):
                return asyncio.get_running_loop().time()

        started = asyncio.get_running_loop().time()
        done = await fleet.run({"left": left(), "right": right()})
        assert done["right"] is not None
        assert done["right"] - started > 100


@virtual
async def test_a_failure_of_the_fleet_ends_the_waiting_for_zones() -> None:
    async with facing() as (fleet, _):

        async def left() -> None:
            await asyncio.sleep(1)
            await fleet["left"].move_to(500, 0, 0, mode=PTPMode.MOVJ_ANGLE)

        async def right() -> None:
            async with fleet.zone("belt"):
                pass

        async with fleet.zone("belt"):
            with pytest.raises(ArmAlarm, match="left"):
                await fleet.run({"left": left(), "right": right()})


@virtual
async def test_limits_are_kept_in_the_cell() -> None:
    async with facing(limits=Box(x=(150, 350), y=(-130, 130))) as (fleet, sims):
        with pytest.raises(ValueError, match=r"left: the way leaves the arm's limits"):
            await fleet["left"].move_to(200, 140, 20)

        with pytest.raises(ValueError, match=r"right: the way leaves"):
            await fleet["right"].move_to(140, 0, 20)

        assert moved(sims["left"]) == moved(sims["right"]) == 0
        await fleet["right"].move_to(200, 100, 20)


@virtual
async def test_one_program_cannot_let_two_arms_into_a_zone() -> None:
    async with facing() as (fleet, _):
        await fleet["left"].move_to(*IN)
        with pytest.raises(ZoneDeadlock, match="right waits for zone bin, which left holds"):
            await fleet["right"].move_to(*IN)


@virtual
async def test_a_batch_is_looked_at_as_a_whole() -> None:
    async with facing("raise") as (fleet, sims):
        await fleet["right"].move_to(*IN)
        with pytest.raises(ZoneOccupied):
            async with fleet["left"].queue.batch() as batch:
                first = batch.move_to(*OVER)
                batch.move_by(0, 0, -80)

        with pytest.raises(ZoneOccupied):
            await first

        assert moved(sims["left"]) == 0


def test_members_are_checked() -> None:
    with pytest.raises(ValueError, match="expected guard"):
        Member("sim:", Magician, guard="maybe")  # type: ignore[arg-type]

    with pytest.raises(ValueError, match="limits are kept by the guard"):
        Member("sim:", Magician, limits=Box(x=(0, 1)))


@virtual
async def test_an_arm_that_does_not_tell_where_it_stands_is_waited_for_no_more() -> None:
    async with facing() as (fleet, sims):
        told: list[DobotError] = []
        ended = asyncio.Event()

        async def left() -> None:
            with suppress(TimeoutError):
                async with asyncio.timeout(0.2):
                    await fleet["left"].move_to(*IN)

            try:
                async with fleet.zone("belt"):
                    pass
            except DobotError as error:
                told.append(error)
                ended.set()

        async def right() -> None:
            async with fleet.zone("belt"):
                await asyncio.sleep(0.1)
                sims["left"].faults.loss = 1.0
                try:
                    async with fleet.zone("bin"):
                        pass
                except DobotError as error:
                    told.append(error)
                    ended.set()

        async def other() -> None:
            """Has the arm looked at when the last claim is judged, and for longer than that takes."""
            await asyncio.sleep(4)
            with suppress(DobotError):
                await fleet["left"].move_to(*BEHIND)

            await ended.wait()  # for the end of a program has all claims judged

        async with asyncio.timeout(60):
            await fleet.run({"left": left(), "right": right(), "other": other()})

        assert isinstance(told[0], ZoneDeadlock)
        sims["left"].faults.loss = 0.0


@virtual
async def test_who_has_had_its_turn_is_not_waited_for_any_more() -> None:
    async with facing() as (fleet, sims):

        async def program() -> None:
            await fleet["left"].queue.move_to(*ASIDE)
            await fleet.barrier("meet")

        await fleet.run({"left": program(), "other": program()})
        await fleet["left"].queue.join()
        assert moved(sims["left"]) == 2


@virtual
async def test_an_arm_that_did_not_tell_where_it_stands_is_asked_until_it_does() -> None:
    async with facing() as (fleet, sims):
        loop = asyncio.get_running_loop()

        async def left() -> None:
            with suppress(TimeoutError):
                async with asyncio.timeout(0.2):
                    await fleet["left"].move_to(*ASIDE)  # through the bin, which its arm leaves while nobody hears it

            await asyncio.sleep(60)

        async def right() -> float:
            await asyncio.sleep(0.1)
            sims["left"].faults.loss = 1.0
            async with fleet.zone("bin"):
                return loop.time()

        loop.call_later(20, setattr, sims["left"].faults, "loss", 0.0)
        told = await fleet.run({"left": left(), "right": right()})
        assert 20 < (told["right"] or 0) < 30
