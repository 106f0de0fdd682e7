"""What the verbs of a myCobot share with those of other arms, and what is told when one of them is not done."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest
from bad_line import bad_lines
from virtual import virtual

from dobot_async.arms.info import DeviceInfo
from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.arm import MyCobot
from dobot_async.arms.mycobot.models import MODELS, model_of
from dobot_async.arms.mycobot.standstill import turned
from dobot_async.errors import ArmAlarm, CommandRejected, MotionStopped, MotionUnknown, ReplyTimeout
from dobot_async.simulator import MyCobotQuirks, Simulation, simulate

NEW, OLD = MyCobotQuirks(), MyCobotQuirks(acknowledges=False, later=False)
firmwares = pytest.mark.parametrize("quirks", [NEW, OLD], ids=["new", "old"])
BENT = (30.0, -20.0, -40.0, -10.0, 20.0, 60.0)
DOWN = (150.0, 60.0, 200.0, -180.0, 0.0, -90.0)
GOALS = ((160, 60, 200, -150, 0, -90), DOWN, (150, 80, 160, -180, 0, -90), (-120, 150, 200, -180, 0, 0))


def told(sim: Simulation) -> list[tuple[float, ...]]:
    """The targets of the tool that the arm has reached."""
    return [each.value.coords for each in sim.arm.executed if each.command is c.SEND_COORDS and each.outcome == "done"]


# Targets of which a part is given.


@virtual
async def test_what_is_not_given_stays_as_it_is() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        await arm.move_to(*DOWN)
        await arm.move_to(z=170)
        await arm.move_to(160)
        await arm.move_to(y=50, rz=-80)
        assert told(sim)[1:] == [
            pytest.approx((150, 60, 170, -180, 0, -90), abs=0.2),
            pytest.approx((160, 60, 170, -180, 0, -90), abs=0.2),
            pytest.approx((160, 50, 170, -180, 0, -80), abs=0.2),
        ]
        await arm.move_by(z=30, rz=-10)
        assert told(sim)[-1] == pytest.approx((160, 50, 200, -180, 0, -90), abs=0.3)


@virtual
async def test_a_queued_target_is_seen_from_the_one_before_it_and_not_from_where_an_inexact_arm_stands() -> None:
    async with simulate("mycobot280", quirks=replace(NEW, play=1.0)) as sim, MyCobot.connect(sim.url) as arm:
        sim.arm.guide_to(*BENT)
        async with arm.queue.batch() as batch:
            batch.move_to(*DOWN)
            batch.wait(0.1)
            batch.move_to(z=180)
            batch.gripper(False)
            batch.move_by(x=5)
            batch.move_by(x=5, z=-10)

        await arm.queue.join()
        x, y, _, *turns = DOWN
        assert told(sim) == [DOWN, (x, y, 180, *turns), (x + 5, y, 180, *turns), (x + 10, y, 170, *turns)]
        stands = sim.arm.coords
        assert max(abs(a - b) for a, b in zip(stands[:3], told(sim)[-1][:3], strict=True)) > 1
        await arm.move_by(z=10)
        assert told(sim)[-1][:3] == pytest.approx((stands[0], stands[1], stands[2] + 10), abs=0.1)


@virtual
async def test_a_target_behind_one_in_joints_or_in_other_frames_is_seen_from_where_the_arm_stands() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        await arm.set_tool(0, 0, 5, 0, 0, 0)
        await arm.queue.move_to(*DOWN)
        await arm.queue.move_joint(1, 40)
        await arm.queue.move_by(z=20)
        await arm.queue.join()
        assert told(sim)[-1][:2] != pytest.approx(DOWN[:2], abs=1)
        await arm.queue.move_to(*DOWN, speed=10)
        motion = await arm.queue.move_by(z=-10)
        await asyncio.sleep(0.5)
        await arm.set_end_type(c.EndType.TOOL)
        await motion
        assert told(sim)[-1][2] == pytest.approx(DOWN[2] - 5 - 10, abs=0.3)


@virtual
async def test_a_pose_is_a_target() -> None:
    for model, joints in (("mycobot280", BENT), ("mypalletizer260", (20.0, 20.0, 10.0, -5.0))):
        async with simulate(model) as sim, MyCobot.connect(sim.url, model=model) as arm:
            await arm.move_joints(*joints)
            pose, coords = await arm.get_pose(), await arm.get_coords()
            assert pose.joints == await arm.get_joints() == await arm.get_angles()
            await arm.move_joint(1, joints[0] - 15)
            await arm.move_to(pose)
            assert (await arm.get_pose()).x == pytest.approx(pose.x, abs=0.5)
            await arm.move_to(coords)
            requests = sim.arm.counters.requests
            with pytest.raises(ValueError, match="a pose, or coordinates, not both"):
                await arm.move_to(pose, 10)

            assert sim.arm.counters.requests == requests


WRONG: list[tuple[Any, type[Exception], str]] = [
    (lambda arm: arm.move_to(), ValueError, "needs a coordinate"),
    (lambda arm: arm.move_to("a"), TypeError, "x must be a number, not 'a'"),
    (lambda arm: arm.move_to(z=float("nan")), ValueError, "z must be finite"),
    (lambda arm: arm.move_to(z=1000), ValueError, "z must be in -70 to 412.67, not 1000"),
    (lambda arm: arm.move_to(z=100, speed=0), ValueError, "speed must be in 1 to 100"),
    (lambda arm: arm.move_by(z=float("inf")), ValueError, "z must be finite"),
    (lambda arm: arm.gripper_to(101), ValueError, "percent must be in 0"),
    (lambda arm: arm.gripper_to(float("nan")), ValueError, "percent must be in 0"),
    (lambda arm: arm.gripper_to("x"), TypeError, "percent must be a number"),
    (lambda arm: arm.wait(-1), ValueError, "seconds must be 0 or more"),
    (lambda arm: arm.jog("up", 1), ValueError, r"is j1\+ j1- j2\+ .* rz\+ rz-, not 'up'"),
    (lambda arm: arm.jog(None, 1), ValueError, "not None"),
    (lambda arm: arm.request(c.GET_ENCODER, 8), ValueError, "the servos 1 to 6, and 7 of its gripper, not 8"),
    (lambda arm: arm.request(c.GET_ENCODER, np.int64(8)), ValueError, "not 8"),
    (lambda arm: arm.request(c.IS_SERVO_ENABLE, 8), ValueError, "not 8"),
    (lambda arm: arm.request(c.GET_SERVO_DATA, c.ServoDataAddress(8, 21)), ValueError, "not 8"),
    (lambda arm: arm.request(c.SET_SERVO_DATA, c.ServoData(8, 21, 1)), ValueError, "not 8"),
    (lambda arm: arm.request(c.SET_SERVO_CALIBRATION, 8), ValueError, "not 8"),
    (lambda arm: arm.request(c.JOINT_BRAKE, 8), ValueError, "not 8"),
    (lambda arm: arm.release(8), ValueError, "not 8"),
    (lambda arm: arm.focus(8), ValueError, "not 8"),
    (lambda arm: arm.queue.put(c.SET_ENCODER, c.SetEncoder(8, 2048)), ValueError, "not 8"),
    (lambda arm: arm.get_joint_limits(7), ValueError, "joints 1 to 6, not 7"),
    (lambda arm: arm.set_joint_limits(7, -1, 1), ValueError, "joints 1 to 6, not 7"),
    (lambda arm: arm.move_joint(7, 0), ValueError, "joints 1 to 6, not 7"),
    (lambda arm: arm.step_joint(7, 0), ValueError, "joints 1 to 6, not 7"),
]


@pytest.mark.parametrize(("act", "error", "message"), WRONG)
@virtual
async def test_wrong_arguments_are_refused_before_a_byte_is_sent(act: Any, error: Any, message: str) -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        requests = sim.arm.counters.requests
        with pytest.raises(error, match=message):
            await act(arm)

        assert sim.arm.counters.requests == requests


@virtual
async def test_each_model_has_the_servos_that_it_has() -> None:
    for name, gripper in (("myarm300", 8), ("mycobot280", 7), ("mypalletizer260", 7)):
        async with simulate(name) as sim, MyCobot.connect(sim.url, model=name) as arm:
            assert await arm.request(c.GET_ENCODER, gripper) == 0
            await arm.queue.put(c.SET_ENCODER, c.SetEncoder(gripper, 1024))
            await arm.queue.join()
            assert sim.arm.gripper.value == pytest.approx(50)
            await arm.focus()
            for wrong in {5, 8, 9} - {*range(1, arm.model.joints + 1), gripper}:
                with pytest.raises(ValueError, match=r"servos 1 to|in 1 to 8"):
                    await arm.request(c.GET_ENCODER, wrong)

    with pytest.raises(ValueError, match="rx only"):
        async with MyCobot.connect("sim:", model="mypalletizer260") as arm:
            await arm.move_to(150, 0, 100, ry=10)


@virtual
async def test_numbers_and_flags_of_numpy_are_taken() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as connected:
        arm: Any = connected
        await arm.gripper(np.bool_(False))
        assert sim.arm.gripper.value == 100
        await arm.gripper_to(np.float32(40))
        assert sim.arm.gripper.value == 40
        await arm.set_pin(5, np.bool_(True))
        assert sim.arm.outputs == {(c.SET_DIGITAL_OUTPUT, 5): 1}
        await arm.move_joint(1, np.float32(10))
        await arm.wait(np.float32(0.1))
        await arm.move_to(*np.array(DOWN))
        await arm.move_by(z=np.int64(5))


# Limits, models, information.


@virtual
async def test_limits_of_ones_own() -> None:
    limits: Any = {"j2": (-30, 30), "z": (100, np.float32(300))}
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url, limits=limits) as arm:
        await arm.move_joint(2, 30)
        sim.arm.guide_to(*BENT)
        executed = len(sim.arm.executed)
        refused: list[tuple[Any, type[Exception]]] = [
            (lambda: arm.move_joint(2, 31), ValueError),
            (lambda: arm.move_joints(0, -31, 0, 0, 0, 0), ValueError),
            (lambda: arm.queue.move_to(z=99), ValueError),
            (lambda: arm.move_coord("z", 301), ValueError),
            (lambda: arm.move_by(z=40), CommandRejected),
            (lambda: arm.step_joint(2, 51), CommandRejected),
            (lambda: arm.step_coord("z", -250), CommandRejected),
        ]
        for act, error in refused:
            with pytest.raises(error, match="must be in"):
                await act()

        assert len(sim.arm.executed) == executed


@pytest.mark.parametrize(
    ("limits", "error", "message"),
    [
        ({"j7": (0, 1)}, ValueError, "has j1, j2, .* rz, not 'j7'"),
        ({"z": (1, 1)}, ValueError, "z must have a least and a greatest"),
        ({"z": (0, float("nan"))}, ValueError, "z must have"),
        ({"z": ("low", 1)}, TypeError, "limits of z must be a number"),
        ({"z": (1, 2, 3)}, ValueError, "z must have"),
        ({"z": 5}, TypeError, "z must have"),
    ],
)
@virtual
async def test_wrong_limits(limits: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        async with MyCobot.connect("sim:", limits=limits):
            pass


@virtual
async def test_the_familys_name_is_that_of_its_usual_model() -> None:
    assert model_of("mycobot") is MODELS["mycobot280"]
    async with simulate("mycobot") as sim, MyCobot.connect(sim.url, model="mycobot") as arm:
        assert arm.model == sim.arm.model == MODELS["mycobot280"]
        assert await arm.get_info() == DeviceInfo("", "", "1.3")
        assert (await arm.get_versions()).basic_version == 1.4


# How near counts as there.


@virtual
async def test_an_arm_as_inexact_as_users_report_it_is_believed() -> None:
    async with simulate("mycobot280", quirks=replace(NEW, play=1.0)) as sim:
        off = []
        async with MyCobot.connect(sim.url) as arm:
            await arm.move_joints(20, -20, -60, 40, 10, 0)
            for goal in (
                (160, 60, 200, -150, 0, -90),
                DOWN,
                (150, 80, 160, -180, 0, -90),
                (-120, 150, 200, -180, 0, 0),
            ):
                await arm.move_to(*goal)
                stands = sim.arm.coords
                await arm.move_to(*goal)
                assert sim.arm.coords == pytest.approx(stands, abs=0.1), "told again it stays where it is"
                off.append(
                    (max(abs(a - b) for a, b in zip(stands[:3], goal[:3], strict=True)), turned(stands[3:], goal[3:]))
                )

        assert all(2 <= mm <= 5 and 1 <= degrees <= 3 for mm, degrees in off), off
        async with MyCobot.connect(sim.url, tolerance=(1.0, 1.0)) as arm:
            for error in (MotionStopped, CommandRejected):  # it comes to rest beside it, and then stays there
                with pytest.raises(error, match=r"connect\(tolerance=\(degrees, mm\)\)"):
                    await arm.move_to(*DOWN)


# What an arm told before a motion.


@virtual
async def test_what_was_wrong_before_is_not_the_reason_of_a_later_end() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        for _ in range(2):
            sim.arm.guide_to(*BENT)
            sim.arm.error = 0
            with pytest.raises(ArmAlarm, match="NO_INVERSE_SOLUTION"):
                await arm.move_to(270, 270, 400, 0, 0, 0)

            assert sim.arm.error == 32
            motion = await arm.queue.move_joint(1, 150)
            await asyncio.sleep(0.5)
            sim.arm.halt()
            with pytest.raises(MotionStopped, match="came to rest"):
                await motion

            sim.arm.power(on=False)
            with pytest.raises(CommandRejected, match="not powered"):
                await arm.move_joint(1, 10)

            sim.arm.power(on=True)
            assert [alarm.name for alarm in await arm.get_alarms()] == ["NO_INVERSE_SOLUTION"]

        await arm.clear_alarms()
        with pytest.raises(ArmAlarm, match="NO_INVERSE_SOLUTION"):
            await arm.move_to(270, 270, 400, 0, 0, 0)

        with pytest.raises(CommandRejected, match="does not move"):  # the same again is not known to be of this motion
            await arm.move_to(270, 270, 400, 0, 0, 0)


@virtual
async def test_recover_does_not_say_that_an_arm_is_ready_that_is_not() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        sim.arm.raise_error(3, 1)
        with pytest.raises(ArmAlarm, match="EMERGENCY_STOP"):
            await arm.recover()

        sim.arm.raise_error(3, 0)
        await arm.recover()
        await arm.move_joint(1, 10)


# Straight lines.


@firmwares
@virtual
async def test_a_straight_line_is_straight_in_either_fresh_mode(quirks: MyCobotQuirks) -> None:
    async with simulate("mycobot280", quirks=quirks) as sim, MyCobot.connect(sim.url) as arm:
        sim.arm.guide_to(20, -20, -60, 40, 10, 0)
        for fresh in (False, True):
            await arm.move_to(150, 80, 200, -180, 0, -90)
            await arm.request(c.SET_FRESH_MODE, fresh)
            motion = await arm.queue.move_to(y=-80, mode=c.MoveMode.LINEAR)
            while not motion.done:
                assert (sim.arm.coords[0], sim.arm.coords[2]) == pytest.approx((150, 200), abs=0.6)
                await asyncio.sleep(0.05)

            await motion
            assert sim.arm.coords[1] == pytest.approx(-80, abs=0.2)
            assert sim.arm.settings[c.SET_FRESH_MODE] is False


@firmwares
@virtual
async def test_a_mode_of_the_caller_is_left_alone_by_other_motions(quirks: MyCobotQuirks) -> None:
    async with simulate("mycobot280", quirks=quirks) as sim, MyCobot.connect(sim.url) as arm:
        await arm.request(c.SET_FRESH_MODE, True)
        await arm.move_joints(*BENT)
        await arm.move_by(z=-20)
        assert sim.arm.settings[c.SET_FRESH_MODE] is True


# The gripper.


@firmwares
@virtual
async def test_a_gripper_is_done_when_it_rests(quirks: MyCobotQuirks) -> None:
    async with simulate("mycobot280", quirks=quirks) as sim, MyCobot.connect(sim.url) as arm:
        loop = asyncio.get_running_loop()
        acts: list[tuple[Any, float]] = [
            (lambda: arm.gripper(False, speed=20), 100),
            (lambda: arm.gripper_to(70, speed=20), 70),
            (lambda: arm.gripper(True, speed=20), 0),
        ]
        for act, value in acts:
            way, at = abs(sim.arm.gripper.value - value), loop.time()
            await act()
            assert (sim.arm.gripper.value, sim.arm.gripper.moving) == (value, False)
            assert 0 <= loop.time() - at - way / 20 < 1

        at = loop.time()
        await arm.gripper(True)
        assert loop.time() - at < 0.5, "it is closed already"


@firmwares
@virtual
async def test_a_gripper_closes_on_a_piece(quirks: MyCobotQuirks) -> None:
    async with simulate("mycobot280", quirks=quirks) as sim, MyCobot.connect(sim.url) as arm:
        await arm.gripper(False)
        sim.arm.gripper.piece = 40.0
        await arm.gripper(True)
        assert await arm.get_gripper() == 40
        if quirks is NEW:  # the arm has acknowledged it
            await arm.gripper(True)
        else:
            with pytest.raises(CommandRejected, match="does not move at 40 percent"):
                await arm.gripper(True)

        await arm.gripper(False)
        assert await arm.get_gripper() == 100


@firmwares
@virtual
async def test_a_gripper_that_does_not_open_is_not_open(quirks: MyCobotQuirks) -> None:
    async with simulate("mycobot280", quirks=quirks) as sim, MyCobot.connect(sim.url) as arm:
        go = sim.arm.gripper.go
        cast(Any, sim.arm.gripper).go = lambda value, speed: go(min(value, 60), speed)
        with pytest.raises(MotionStopped, match="came to rest at 60 percent, before it was open to 100"):
            await arm.gripper(False)

        with pytest.raises(CommandRejected, match="does not move at 60 percent"):
            await arm.gripper(False)


@firmwares
@virtual
async def test_no_gripper_is_told_as_that(quirks: MyCobotQuirks) -> None:
    async with simulate("mycobot280", quirks=replace(quirks, gripper=False)) as sim, MyCobot.connect(sim.url) as arm:
        for act in (lambda: arm.get_gripper(), lambda: arm.gripper(True), lambda: arm.gripper_to(50)):
            with pytest.raises(CommandRejected, match=r"tells 255 of its gripper.*plugged"):
                await act()

        with pytest.raises(CommandRejected, match="255"):
            await (await arm.queue.gripper(True))


@pytest.mark.parametrize("lost", [1, 2, 999])
@firmwares
@virtual
async def test_a_gripper_command_that_is_lost_is_said_again_or_not_done(
    monkeypatch: pytest.MonkeyPatch, quirks: MyCobotQuirks, lost: int
) -> None:
    lines = bad_lines(monkeypatch)
    async with simulate("mycobot280", quirks=quirks) as sim, MyCobot.connect(sim.url) as arm:
        swallowed: list[bytes] = []

        def request(data: bytes) -> list[tuple[float, bytes]]:
            if data[3] == c.SET_GRIPPER_STATE.id and len(swallowed) < lost:
                swallowed.append(data)
                return []

            return [(0, data)]

        lines[0].request = request
        if lost == 999:
            with pytest.raises(CommandRejected, match="does not move"):
                await arm.gripper(False)
        else:
            await arm.gripper(False)
            assert sim.arm.gripper.value == 100


@virtual
async def test_a_gripper_of_which_nothing_is_told_is_unknown() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        known = sim.arm.answer
        blind = {c.IS_GRIPPER_MOVING.id, c.GET_GRIPPER_VALUE.id}
        cast(Any, sim.arm).answer = lambda frame: b"" if frame.id in blind else known(frame)
        with pytest.raises(MotionUnknown, match="tells nothing of its gripper"):
            await arm.gripper(False)


@virtual
async def test_the_time_of_a_gripper_is_over() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        with pytest.raises(ReplyTimeout, match=r"not seen to be done within 0\.5 s"):
            await arm.gripper(False, speed=5, timeout=0.5)

        assert sim.arm.gripper.moving


@firmwares
@virtual
async def test_a_gripper_can_be_let_go(quirks: MyCobotQuirks) -> None:
    async with simulate("mycobot280", quirks=quirks) as sim, MyCobot.connect(sim.url) as arm:
        await (await arm.queue.put(c.SET_GRIPPER_STATE, c.SetGripperState(c.GripperState.RELEASED)))
        assert not sim.arm.gripper.moving


# Pauses.


@firmwares
@virtual
async def test_a_pause_that_was_lost_is_said_again(monkeypatch: pytest.MonkeyPatch, quirks: MyCobotQuirks) -> None:
    lines = bad_lines(monkeypatch)
    async with simulate("mycobot280", quirks=quirks) as sim, MyCobot.connect(sim.url) as arm:
        motion = await arm.queue.move_joint(1, 150, speed=20)
        await asyncio.sleep(0.5)
        for row, act in ((c.PAUSE, arm.pause), (c.RESUME, arm.resume)):
            swallowed: list[bytes] = []

            def request(data: bytes, row: Any = row, swallowed: list[bytes] = swallowed) -> list[tuple[float, bytes]]:
                if data[3] == row.id and not swallowed:
                    swallowed.append(data)
                    return []

                return [(0, data)]

            lines[0].request = request
            await act()
            assert swallowed
            assert sim.arm.paused is (row is c.PAUSE)

        await motion


@virtual
async def test_an_arm_that_does_not_pause_is_not_said_to() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        await arm.pause()  # it stands, and that is enough
        await arm.resume()
        cast(Any, sim.arm).pause = lambda: None
        await arm.queue.move_joint(1, 150, speed=5)
        await asyncio.sleep(0.5)
        with pytest.raises(CommandRejected, match="Pause: the arm answers, and does not do it"):
            await arm.pause()

        assert sim.arm.moving
        await arm.stop()
