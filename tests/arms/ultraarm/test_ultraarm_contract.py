"""What an ultraArm shares with the other families: reads, poses as targets, pauses, grippers, jogs by their words."""

from __future__ import annotations

import asyncio
from typing import Any

import numpy as np
import pytest
from virtual import run_virtual, virtual

from dobot_async import ArmAlarm, DeviceInfo, MotionStopped, UltraArm, UltraArmCoords, UltraArmJog, UltraArmPose
from dobot_async.arms.ultraarm import commands as c
from dobot_async.arms.ultraarm.jog import WORDS
from dobot_async.simulator import Simulation, UltraArmQuirks, simulate

pytestmark = pytest.mark.cases(3)


def done(sim: Simulation, *names: str) -> list[Any]:
    return [each for each in sim.arm.executed if each.outcome == "done" and each.name in names]


@virtual
async def test_a_pose_is_one_reading_and_a_target() -> None:
    async with simulate("ultraarm", homed=True, speed=5) as sim, UltraArm.connect(sim.url) as arm:
        await arm.move_joints(20, 10, 30)
        sent = arm.link.stats.sent
        pose = await arm.get_pose()
        assert arm.link.stats.sent == sent + 1
        assert list(pose.joints) == list(await arm.get_joints()) == [20, 10, 30, 0]
        assert (pose.x, pose.y, pose.z) == pytest.approx((sim.arm.pose.x, sim.arm.pose.y, sim.arm.pose.z), abs=0.01)
        await arm.move_to(200, 0, 40)
        await arm.move_to(pose)
        assert await arm.get_joints() == pytest.approx(pose.joints, abs=0.05)
        await arm.move_to(200, 0, 40)
        await (await arm.queue.move_to(UltraArmCoords(200, 10, 40)))
        assert sim.arm.pose.y == pytest.approx(10)
        for wrong in ({"y": 5}, {"z": 5}, {"e": 0}):
            with pytest.raises(ValueError, match="a pose, or coordinates"):
                await arm.move_to(pose, **wrong)

        await arm.move_joints(*pose.joints)


@virtual
async def test_who_it_is() -> None:
    async with simulate("ultraarm") as sim, UltraArm.connect(sim.url) as arm:
        assert await arm.get_info() == DeviceInfo(serial_number="", name="", version="1.2")
        sim.arm.quirks = UltraArmQuirks(later=False)
        assert await arm.get_info() == DeviceInfo(serial_number="", name="", version="")


@virtual
async def test_a_pause_holds_back_what_was_not_begun() -> None:
    async with simulate("ultraarm", homed=True) as sim, UltraArm.connect(sim.url) as arm:
        motions = [await arm.queue.move_to(200 + 10 * step, 0, 40) for step in range(3)]
        await asyncio.sleep(0.2)
        await arm.pause()
        await motions[0]
        await asyncio.sleep(30)
        assert [each.value.x for each in done(sim, "G0")] == [200]
        assert not motions[1].done
        await arm.resume()
        await motions[2]
        assert [each.value.x for each in done(sim, "G0")] == [200, 210, 220]


@virtual
async def test_recover_empties_the_queue_and_lets_the_motors_hold() -> None:
    async with simulate("ultraarm", homed=True) as sim, UltraArm.connect(sim.url) as arm:
        motion = await arm.queue.move_to(150, 100, 40, speed=10)
        await asyncio.sleep(0.5)
        await arm.recover()
        with pytest.raises(MotionStopped):
            await motion

        assert not sim.arm.device.moving
        assert sim.arm.registers.powered
        assert len(await arm.get_alarms()) == 1
        await arm.home()
        assert await arm.get_alarms() == ()


@pytest.mark.parametrize(
    ("closed", "opening"), [(True, 0), (False, 100), (1, 0), (0, 100), (np.bool_(False), 100), (np.True_, 0)]
)
@pytest.mark.parametrize("place", ["arm", "queue", "batch"])
def test_a_gripper_is_closed_or_open_and_rests(place: str, closed: Any, opening: int) -> None:
    async def run() -> None:
        async with simulate("ultraarm") as sim, UltraArm.connect(sim.url) as arm:
            await arm.gripper_to(50)
            assert sim.arm.gripper == 50
            before = sim.arm.device.now
            if place == "arm":
                await arm.gripper(closed)
            elif place == "queue":
                await (await arm.queue.gripper(closed))
            else:
                async with arm.queue.batch() as batch:
                    motion = batch.gripper(closed)

                await motion

            assert sim.arm.registers.gripper == opening
            assert abs(sim.arm.gripper - opening) <= 1, "it has come there"
            assert sim.arm.device.now > before + 0.4

    run_virtual(run())


@virtual
async def test_percent_of_a_gripper() -> None:
    async with simulate("ultraarm") as sim, UltraArm.connect(sim.url) as arm:
        await arm.gripper_to(np.float32(33.4), speed=1000)
        assert sim.arm.registers.gripper == 33
        requests = sim.arm.counters.requests
        for wrong in (-1, 101, float("nan"), float("inf")):
            with pytest.raises(ValueError, match=r"^percent must be"):
                await arm.gripper_to(wrong)

        with pytest.raises(TypeError, match=r"^percent must be"):
            await arm.gripper_to("5")  # type: ignore[arg-type]

        assert sim.arm.counters.requests == requests


@virtual
async def test_jogs_by_their_words() -> None:
    async with simulate("ultraarm", homed=True) as sim, UltraArm.connect(sim.url) as arm:
        assert set(WORDS.values()) == set(UltraArmJog)
        assert WORDS["x+"] is UltraArmJog.X_PLUS
        assert WORDS["j3-"] is UltraArmJog.J3_MINUS
        await arm.jog("j1-", 0.2, speed=20)
        assert sim.arm.angles.j1 < 0
        requests = sim.arm.counters.requests
        for wrong in ("r+", "l+", "j4+", "X_PLUS", "", None, 1):
            with pytest.raises(ValueError, match=r"one of x\+ x- y\+ y- z\+ z- j1\+ .*j3-, not"):
                await arm.jog(wrong, 0.1)  # type: ignore[arg-type]

        assert sim.arm.counters.requests == requests


@pytest.mark.parametrize("seconds", [0.25, 0.5, 1.0, 1.75, np.float32(0.5), 2])
@pytest.mark.parametrize("dwell_rests", [False, True])
def test_a_wait_takes_its_time_and_not_much_more(seconds: float, dwell_rests: bool) -> None:
    async def run() -> None:
        quirks = UltraArmQuirks(dwell_rests=dwell_rests)
        async with simulate("ultraarm", homed=True, quirks=quirks) as sim, UltraArm.connect(sim.url) as arm:
            await arm.queue.move_to(200, 0, 40)
            await arm.queue.wait(seconds)
            await (await arm.queue.suction(True))
            (moved,), (pump,) = done(sim, "G0"), done(sim, "M23")
            assert seconds <= pump.started - moved.finished < seconds + 0.2
            assert [each.value for each in done(sim, "G4")] == [c.Dwell(int(seconds))] * int(seconds >= 1)
            for wrong in (-0.5, float("nan"), 65536):
                with pytest.raises(ValueError, match=r"^seconds must be"):
                    await arm.wait(wrong)

    run_virtual(run())


@pytest.mark.parametrize("ends", ["stop", "a motion that fails"])
def test_a_laser_does_not_burn_on_behind_what_ends_the_motions(ends: str) -> None:
    async def run() -> None:
        async with simulate("ultraarm", homed=True) as sim, UltraArm.connect(sim.url) as arm:
            await arm.pwm(100)
            await arm.laser(True)
            motion = await (
                arm.queue.move_to(150, 100, 40, speed=10) if ends == "stop" else arm.queue.move_to(60, 0, 49)
            )
            await asyncio.sleep(0.5)
            if ends == "stop":
                await arm.stop()

            await asyncio.sleep(2)
            assert (sim.arm.registers.laser, sim.arm.registers.pwm) == (False, 0)
            with pytest.raises((MotionStopped, ArmAlarm)):
                await motion

    run_virtual(run())


@pytest.mark.parametrize(("url", "moves"), [("sim:", True), ("sim:?homed=true", True), ("sim:?homed=false", False)])
async def test_first_steps_need_no_way_home(url: str, moves: bool) -> None:
    mark = "&" if "?" in url else "?"
    async with UltraArm.connect(f"{url}{mark}speed=50") as arm:
        if moves:
            await arm.move_to(200, 0, 40)
        else:
            await arm.home()

        assert isinstance(await arm.get_pose(), UltraArmPose)


async def test_a_wrong_option_of_the_url() -> None:
    with pytest.raises(ValueError, match="homed='maybe': expected true or false"):
        async with UltraArm.connect("sim:?homed=maybe"):
            pass
