"""Several arms as one: connecting, closing, doing the same, stopping, failing and recovering together."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Mapping
from contextlib import AsyncExitStack, asynccontextmanager
from typing import Any

import pytest
from virtual import virtual

from dobot_async import ArmAlarm, ConnectFailed, ConnectionLost, Fleet, Magician, MotionStopped, MyCobot, UltraArm
from dobot_async.arms.base import Arm
from dobot_async.arms.magician import commands as c
from dobot_async.fleet import BarrierBroken, Member
from dobot_async.fleet.fleet import OnFailure
from dobot_async.fleet.fleet_arm import FleetArm
from dobot_async.fleet.guard import Mode
from dobot_async.simulator import Faults, Simulation, simulate

NEAR, FAR, TOO_FAR = (220.0, 0.0, 40.0), (240.0, 60.0, 60.0), (400.0, 0.0, 40.0)


class Oops(Exception):
    """The user's own."""


@asynccontextmanager
async def cell(*names: str, speed: float = 20, **details: Any) -> AsyncIterator[dict[str, Simulation]]:
    """Simulated Magicians by name."""
    async with AsyncExitStack() as stack:
        yield {name: await stack.enter_async_context(simulate(speed=speed, **details)) for name in names}


def urls(sims: dict[str, Simulation]) -> dict[str, str]:
    return {name: sim.url for name, sim in sims.items()}


@virtual
async def test_all_are_connected_and_closed() -> None:
    async with cell("left", "right") as sims:
        async with Fleet.connect(urls(sims)) as fleet:
            assert list(fleet) == ["left", "right"]
            assert "left" in fleet
            assert len(fleet) == 2
            arm: Magician = fleet["left"]
            await arm.move_to(*NEAR)
            assert (await fleet["left"].get_pose()).x == pytest.approx(220, abs=0.01)

        with pytest.raises(ConnectionLost):
            await fleet["left"].get_pose()

        with pytest.raises(KeyError, match="there are: left, right"):
            fleet["middle"]


@virtual
async def test_connecting_takes_as_long_as_the_slowest() -> None:
    async with cell(*"abcdefgh", faults=Faults(latency=0.05)) as sims:
        loop = asyncio.get_running_loop()
        start = loop.time()
        async with Fleet.connect({"one": sims["a"].url}):
            one = loop.time() - start

        start = loop.time()
        async with Fleet.connect(urls(sims)):
            assert loop.time() - start < 2 * one


@virtual
async def test_one_that_does_not_answer_closes_all() -> None:
    async with cell("left", "right") as sims:
        sims["right"].faults.loss = 1.0
        with pytest.raises(ConnectFailed, match=r"^right: no Magician answers"):
            async with Fleet.connect(urls(sims)):
                pytest.fail("it is all or nothing")


@virtual
async def test_a_connecting_that_is_cancelled_leaves_nothing() -> None:
    async with cell("left", "right") as sims:
        sims["right"].faults.loss = 1.0
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(1), Fleet.connect(urls(sims)):
                pytest.fail("it cannot connect")


@virtual
async def test_wrong_arguments() -> None:
    with pytest.raises(ValueError, match="at least one"):
        Fleet.connect({})

    with pytest.raises(ValueError, match=r"left: .*no scheme"):
        async with Fleet.connect({"left": "nonsense"}):
            pass

    with pytest.raises(ValueError, match="each group is in groups"):
        Fleet.connect({"left": Member("sim:", Magician, group="a")})

    with pytest.raises(ValueError, match="families Magician, MyCobot, UltraArm"):
        Member("sim:", int)


@virtual
async def test_the_users_own_exception_comes_out_as_it_is_and_stops_all() -> None:
    async with cell("left", "right") as sims:
        with pytest.raises(Oops):
            async with Fleet.connect(urls(sims)) as fleet:
                for arm in fleet:
                    await fleet[arm].queue.move_to(*NEAR)
                    await fleet[arm].queue.wait(60)

                raise Oops

        assert all(sim.arm.device.idle for sim in sims.values())


@virtual
async def test_a_normal_end_stops_nothing() -> None:
    async with cell("left", "right") as sims:
        async with Fleet.connect(urls(sims)) as fleet:
            await fleet["left"].queue.wait(60)

        assert not sims["left"].arm.device.idle


@virtual
async def test_cancelling_the_block_stops_all() -> None:
    async with cell("left", "right") as sims:

        async def program() -> None:
            async with Fleet.connect(urls(sims)) as fleet:
                for arm in fleet:
                    await fleet[arm].queue.wait(60)

                await asyncio.sleep(100)

        task = asyncio.create_task(program())
        await asyncio.sleep(1)
        assert not any(sim.arm.device.idle for sim in sims.values())
        task.cancel()
        await asyncio.wait([task])
        assert task.cancelled()
        assert all(sim.arm.device.idle for sim in sims.values())


@virtual
async def test_each_does_the_same_at_the_same_time() -> None:
    async with cell("left", "right") as sims, Fleet.connect(urls(sims)) as fleet:
        start = asyncio.get_running_loop().time()
        await fleet.each(Magician.home)
        took = asyncio.get_running_loop().time() - start
        assert took < 6 / 20
        poses = await fleet.each("get_pose")
        assert list(poses) == ["left", "right"]
        await fleet.each("move_to", *NEAR)
        assert [pose.x for pose in (await fleet.each("get_pose")).values()] == pytest.approx([220, 220], abs=0.01)


@virtual
async def test_stop_goes_to_all_at_once() -> None:
    names = [f"arm{number}" for number in range(40)]
    async with cell(*names, speed=1, faults=Faults(latency=0.01)) as sims, Fleet.connect(urls(sims)) as fleet:
        motions = [await fleet[name].queue.wait(600) for name in names]
        await fleet.stop()
        assert all(sim.arm.device.idle for sim in sims.values())
        ends = [sim.arm.executed[-1].finished + 0.0 for sim in sims.values()]
        assert max(ends) - min(ends) < 0.001
        for motion in motions:
            with pytest.raises(MotionStopped):
                await motion


@virtual
async def test_a_stop_is_on_every_line_before_anything_is_awaited() -> None:
    async with cell("left", "right", speed=1) as sims, Fleet.connect(urls(sims)) as fleet:
        motions = [await fleet[name].queue.wait(600) for name in fleet]
        stop = asyncio.create_task(fleet.stop())
        await asyncio.sleep(0)
        assert [sim.arm.executed[-1].outcome for sim in sims.values()] == ["aborted", "aborted"]
        assert all(motion.done for motion in motions)
        await stop
        for motion in motions:
            with pytest.raises(MotionStopped):
                await motion

        figures = [fleet[name].link.stats for name in fleet]
        assert not any(each.unexpected or each.repeated or each.timeouts for each in figures)
        await fleet.each("move_to", *NEAR)


@virtual
async def test_a_shout_that_is_lost_costs_nothing_but_time() -> None:
    async with cell("left", speed=1) as sims, Fleet.connect(urls(sims)) as fleet:
        motion = await fleet["left"].queue.wait(600)
        sims["left"].faults.loss = 1.0
        stop = asyncio.create_task(fleet.stop())
        await asyncio.sleep(0)
        sims["left"].faults.loss = 0.0
        await stop
        with pytest.raises(MotionStopped):
            await motion

        assert sims["left"].arm.device.idle


@virtual
async def test_what_a_stop_makes_the_arm_tick_off_is_not_done() -> None:
    async with cell("left", speed=1) as sims, Fleet.connect(urls(sims)) as fleet:
        arm = fleet["left"]
        motion = await arm.queue.wait(600)
        with arm.queue.stopping():
            await arm.request(c.SET_QUEUED_CMD_FORCE_STOP_EXEC, None)
            await arm.queue.update()
            assert not motion.done

        await fleet.stop()
        with pytest.raises(MotionStopped):
            await motion


@virtual
async def test_an_arm_is_lost_while_another_one_is_still_being_connected() -> None:
    async with cell("left", "right", "third") as sims:
        sims["right"].faults.latency = sims["third"].faults.latency = 0.1
        asyncio.get_running_loop().call_later(0.1, sims["left"].unplug)
        async with Fleet.connect(urls(sims)) as fleet:
            assert isinstance(fleet.failures["left"], ConnectionLost)
            for name in ("right", "third"):
                with pytest.raises(MotionStopped, match="left"):
                    await fleet[name].move_to(*NEAR)


@virtual
async def test_an_alarm_stops_the_others_and_names_the_arm() -> None:
    async with cell("left", "right") as sims, Fleet.connect(urls(sims)) as fleet:
        right = await fleet["right"].queue.wait(600)
        with pytest.raises(ArmAlarm, match=r"^left: the arm raised alarms"):
            await fleet["left"].move_to(*TOO_FAR)

        with pytest.raises(MotionStopped, match=r"^right was stopped because another arm failed: left: .*0x11"):
            await right

        await asyncio.sleep(0.1)
        assert sims["right"].arm.device.idle
        assert list(fleet.failures) == ["left"]
        for name in fleet:
            with pytest.raises(MotionStopped, match=r"fleet\.recover"):
                await fleet[name].move_to(*NEAR)

        await fleet.recover()
        assert not fleet.failures
        await fleet.each("move_to", *NEAR)


@virtual
async def test_an_alarm_of_a_motion_that_nobody_awaits_stops_the_others() -> None:
    async with cell("left", "right") as sims, Fleet.connect(urls(sims)) as fleet:
        right = await fleet["right"].queue.wait(600)
        await fleet["left"].queue.move_to(*TOO_FAR)
        with pytest.raises(MotionStopped, match="left"):
            await right


@virtual
async def test_a_pulled_cable_stops_the_others() -> None:
    async with cell("left", "right") as sims, Fleet.connect(urls(sims)) as fleet:
        right = asyncio.ensure_future(fleet["right"].wait(600))
        left = asyncio.ensure_future(fleet["left"].wait(600))
        await asyncio.sleep(0.5)
        sims["left"].unplug()
        with pytest.raises(ConnectionLost, match="left"):
            await left

        with pytest.raises(MotionStopped, match="left"):
            await right

        await asyncio.sleep(0.1)
        assert sims["right"].arm.device.idle


@virtual
async def test_a_lost_link_is_noticed_although_nobody_asks() -> None:
    async with cell("left", "right") as sims, Fleet.connect(urls(sims)) as fleet:
        sims["left"].unplug()
        await asyncio.sleep(0.1)
        assert isinstance(fleet.failures["left"], ConnectionLost)
        with pytest.raises(MotionStopped, match="left"):
            await fleet["right"].move_to(*NEAR)


@virtual
async def test_a_link_that_is_lost_before_its_arm_has_its_seat_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    begin = FleetArm.begin

    async def begin_too_late(fleet_arm: FleetArm, arm: Arm, options: Mapping[str, Any]) -> None:
        if fleet_arm.name == "left":
            sims["left"].unplug()
            await anext(aiter(arm.link.state))

        await begin(fleet_arm, arm, options)

    monkeypatch.setattr(FleetArm, "begin", begin_too_late)
    async with cell("left", "right") as sims, Fleet.connect(urls(sims)) as fleet:
        assert isinstance(fleet.failures["left"], ConnectionLost)
        with pytest.raises(MotionStopped, match="left"):
            await fleet["right"].move_to(*NEAR)


@pytest.mark.parametrize("guard", ["off", "wait"])
def test_recover_gives_an_ultraarm_its_power_back_and_lets_nothing_else_through(guard: Mode) -> None:
    @virtual
    async def scene() -> None:
        async with (
            simulate(speed=20) as one,
            simulate("ultraarm", homed=True, speed=20, faults=Faults(latency=0.05)) as two,
        ):
            members = {"one": Member[Any](one.url, Magician), "two": Member[Any](two.url, UltraArm, guard=guard)}
            async with Fleet.connect(members) as fleet:
                arm = fleet.arm("two", UltraArm)
                await arm.release()
                with pytest.raises(ArmAlarm):
                    await fleet.arm("one", Magician).move_to(*TOO_FAR)

                with pytest.raises(MotionStopped):
                    await arm.power_on()

                recovering = asyncio.create_task(fleet.recover())
                await asyncio.sleep(0.08)
                assert not recovering.done()
                with pytest.raises(MotionStopped, match=r"until fleet\.recover"):
                    await arm.home()

                await recovering
                assert two.arm.registers.powered
                await arm.home()
                assert two.arm.registers.homed

    scene()


@pytest.mark.parametrize(("reach", "stopped"), [("fleet", {"b", "c"}), ("group", {"b"}), ("alone", set())])
def test_a_group_says_who_stops(reach: OnFailure, stopped: set[str]) -> None:
    @virtual
    async def scene() -> None:
        async with cell("a", "b", "c") as sims:
            members = {
                name: Member(sim.url, Magician, group="pair" if name != "c" else None) for name, sim in sims.items()
            }
            async with Fleet.connect(members, groups={"pair": reach}) as fleet:
                motions = {name: await fleet[name].queue.wait(5) for name in "bc"}
                with pytest.raises(ArmAlarm):
                    await fleet["a"].move_to(*TOO_FAR)

                ended = set()
                for name, motion in motions.items():
                    try:
                        await motion
                    except MotionStopped:
                        ended.add(name)

                assert ended == stopped
                if reach == "alone":
                    await fleet["a"].recover()
                    await fleet["a"].move_to(*NEAR)
                    assert not fleet.failures

    scene()


@virtual
async def test_each_raises_the_cause_and_not_its_consequences() -> None:
    async with cell("a", "b", "c") as sims, Fleet.connect(urls(sims)) as fleet:

        async def go(arm: Magician) -> None:
            await arm.move_to(*(TOO_FAR if arm is fleet["b"] else FAR))
            await arm.wait(60)

        with pytest.raises(ArmAlarm, match=r"^b: "):
            await fleet.each(go)

        assert all(sim.arm.device.idle for sim in sims.values())


@virtual
async def test_each_cancels_the_others_for_a_wrong_argument() -> None:
    async with cell("a", "b") as sims, Fleet.connect(urls(sims), check_reach=True) as fleet:

        async def go(arm: Magician) -> None:
            await arm.move_to(*(TOO_FAR if arm is fleet["b"] else FAR))

        with pytest.raises(ValueError, match=r"^b: "):
            await fleet.each(go)

        assert all(sim.arm.device.idle for sim in sims.values())


@virtual
async def test_programs_meet_at_barriers() -> None:
    async with cell("left", "right") as sims, Fleet.connect(urls(sims)) as fleet:
        log: list[str] = []

        async def program(name: str, seconds: float) -> str:
            for _ in range(3):
                await fleet[name].wait(seconds)
                log.append(f"{name} comes")
                await fleet.barrier("meet")
                log.append(f"{name} goes")
                await fleet.barrier("part")

            return name

        done = await fleet.run({"left": program("left", 1), "right": program("right", 3)})
        assert done == {"left": "left", "right": "right"}
        for turn in range(3):
            assert [each.split()[1] for each in log[4 * turn : 4 * turn + 4]] == ["comes", "comes", "goes", "goes"]


@pytest.mark.parametrize("end", ["returns", "raises", "alarm", "unplug"])
def test_a_barrier_fails_when_a_partner_does_not_come(end: str) -> None:
    @virtual
    async def scene() -> None:
        async with cell("left", "right") as sims:
            members = {name: Member(sim.url, Magician, group="g") for name, sim in sims.items()}
            async with Fleet.connect(members, groups={"g": "alone"}) as fleet:
                told: list[Exception] = []

                async def left() -> None:
                    try:
                        await fleet.barrier("never")
                    except BarrierBroken as error:
                        told.append(error)

                async def right() -> None:
                    await asyncio.sleep(1)
                    if end == "raises":
                        raise ConnectionLost("gone")

                    if end == "alarm":
                        await fleet["right"].move_to(*TOO_FAR)

                    if end == "unplug":
                        sims["right"].unplug()
                        await asyncio.sleep(1000)

                try:
                    async with asyncio.timeout(100):
                        await fleet.run({"left": left(), "right": right()})
                except (ArmAlarm, ConnectionLost, TimeoutError):
                    assert end != "returns"

                assert len(told) == 1
                assert "right" in str(told[0])

    scene()


@virtual
async def test_a_barrier_outside_of_a_run_is_for_all_arms() -> None:
    async with cell("left", "right") as sims, Fleet.connect(urls(sims)) as fleet:
        await asyncio.gather(fleet.barrier("b"), fleet.barrier("b"))
        waiting = asyncio.create_task(fleet.barrier("b"))
        await asyncio.sleep(1)
        sims["right"].unplug()
        with pytest.raises(BarrierBroken, match="right"):
            await waiting


@virtual
async def test_a_partner_who_gives_up_breaks_the_barrier() -> None:
    async with cell("left", "right") as sims, Fleet.connect(urls(sims)) as fleet:
        with pytest.raises(TimeoutError):
            await fleet.barrier("b", timeout=1)

        with pytest.raises(BarrierBroken, match="gave up"):
            await fleet.barrier("b")

        with pytest.raises(ValueError, match="is for left, right"):
            await fleet.barrier("b", "left")


@virtual
async def test_a_run_ends_all_when_one_fails() -> None:
    async with cell("left", "right") as sims, Fleet.connect(urls(sims)) as fleet:

        async def fails() -> None:
            await asyncio.sleep(1)
            raise Oops

        async def works() -> None:
            await fleet["left"].wait(600)

        with pytest.raises(Oops):
            await fleet.run({"left": works(), "right": fails()})

        assert sims["left"].arm.device.idle


@virtual
async def test_an_alarm_while_the_fleet_is_being_left() -> None:
    async with cell("left", "right") as sims:
        async with Fleet.connect(urls(sims)) as fleet:
            await fleet["right"].queue.wait(600)
            await fleet["left"].queue.move_to(*TOO_FAR)

        await asyncio.sleep(1)
        assert sims["left"].arm.executed[-1].command is c.SET_PTP_CMD


@virtual
async def test_families_side_by_side() -> None:
    async with (
        simulate(speed=20) as one,
        simulate("mycobot280", speed=20) as two,
        simulate("ultraarm", homed=True, speed=20) as three,
    ):
        members: dict[str, Member[Magician | MyCobot | UltraArm]] = {
            "magician": Member(one.url, Magician),
            "cobot": Member(two.url, MyCobot, options={"model": "mycobot280"}),
            "ultra": Member(three.url, UltraArm),
        }
        async with Fleet.connect(members) as fleet:
            assert isinstance(fleet.arm("cobot", MyCobot), MyCobot)
            with pytest.raises(TypeError, match="cobot is a MyCobot, not a Magician"):
                fleet.arm("cobot", Magician)

            await fleet.arm("cobot", MyCobot).power_on()
            await fleet.each("home")
            await fleet.stop()
