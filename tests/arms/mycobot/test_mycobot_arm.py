"""A myCobot from the user's side, on the simulator in memory and on a virtual clock."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import astuple
from typing import Any

import pytest
from virtual import virtual

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.info import DeviceInfo
from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.arm import MyCobot
from dobot_async.arms.mycobot.models import MODELS
from dobot_async.errors import (
    ArmAlarm,
    CommandRejected,
    ConnectFailed,
    ConnectionLost,
    MotionStopped,
    MotionUnknown,
    ReplyTimeout,
)
from dobot_async.simulator import MyCobotQuirks, Simulation, simulate

OLD = MyCobotQuirks(acknowledges=False, later=False)
HERE = (30.0, -20.0, 40.0, -10.0, 20.0, 60.0)


def done(sim: Simulation, *rows: Any) -> list[Any]:
    """The parameters of what the arm has executed of some rows, in order."""
    return [each.value for each in sim.arm.executed if each.outcome == "done" and each.command in rows]


def near(found: Sequence[float], wanted: Sequence[float], gap: float = 0.02) -> bool:
    return all(abs(a - b) <= gap for a, b in zip(found, wanted, strict=True))


def pose_of(name: str) -> tuple[float, ...]:
    """A pose in the middle of a model's range."""
    return tuple(low + 0.6 * (high - low) for low, high in MODELS[name].joint_limits)


@pytest.mark.parametrize("quirks", [MyCobotQuirks(), OLD], ids=["new firmware", "old firmware"])
@pytest.mark.parametrize("model", list(MODELS))
@virtual
async def test_each_model_moves_and_tells(model: str, quirks: MyCobotQuirks) -> None:
    async with simulate(model, quirks=quirks) as sim, MyCobot.connect(sim.url, model=model) as arm:
        target = pose_of(model)
        await arm.move_joints(*target)
        assert near(sim.arm.joints, target)
        assert near(await arm.get_angles(), target)
        coords = await arm.get_coords()
        pose = await arm.get_pose()
        assert near(pose.joints, target)
        assert (pose.x, pose.y, pose.z, pose.rx) == (coords.x, coords.y, coords.z, coords.rx)
        await arm.move_joint(1, target[0] - 20)
        await arm.step_joint(1, 20)
        assert near(sim.arm.joints, target)
        await arm.move_to(*astuple(coords)[: len(arm.model.reach)], mode=c.MoveMode.LINEAR)
        assert near(sim.arm.joints, target, 1)
        assert not await arm.is_moving()
        assert await arm.is_in_position(target)
        assert not await arm.is_in_position([0.0] * arm.model.joints)
        await arm.home()
        assert near(sim.arm.joints, [0.0] * arm.model.joints)
        assert arm.link.stats.bad_frames == 0


@virtual
async def test_an_await_returns_when_the_arm_has_arrived() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        await arm.move_joints(*HERE)
        assert not sim.arm.moving
        assert 0 < sim.arm.device.now - sim.arm.executed[-1].finished < 0.5


@virtual
async def test_the_queue_feeds_the_arm_one_motion_at_a_time() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        motions = [await arm.queue.move_joint(1, angle) for angle in (10, 20, 30)]
        assert [motion.index for motion in motions] == [1, 2, 3]
        assert not motions[0].done
        await motions[1]
        await motions[1]
        assert [motion.done for motion in motions] == [True, True, False]
        await arm.queue.join()
        assert [value.angle for value in done(sim, c.SEND_ANGLE)] == [10, 20, 30]
        assert sim.arm.device.left_space == sim.arm.device.options.capacity


@virtual
async def test_the_queue_runs_although_nobody_awaits_it() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        await arm.queue.move_joint(1, 10)
        last = await arm.queue.move_joint(1, 20)
        await asyncio.sleep(10)
        assert near(sim.arm.joints, (20, 0, 0, 0, 0, 0))
        await last


@virtual
async def test_a_batch_keeps_its_order_and_an_error_sends_none_of_it() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        async with arm.queue.batch() as batch:
            batch.move_joint(1, 20)
            batch.gripper(True)
            batch.wait(0.5)
            batch.color(0, 0, 255)
            last = batch.move_joint(1, 0)
            with pytest.raises(ValueError, match="no timeout of their own"):
                batch.move_joint(1, 10, timeout=1)

        await last
        assert [value.angle for value in done(sim, c.SEND_ANGLE)] == [20, 0]
        assert sim.arm.color == c.RGB(0, 0, 255)
        with pytest.raises(RuntimeError):
            async with arm.queue.batch() as batch:
                motion = batch.move_joint(1, 90)
                raise RuntimeError

        with pytest.raises(MotionStopped, match="not sent"):
            await motion

        assert len(done(sim, c.SEND_ANGLE)) == 2


@virtual
async def test_stop_is_now_and_the_arm_is_ready_again() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        motions = [await arm.queue.move_joint(1, angle) for angle in (150, -150)]
        await asyncio.sleep(0.5)
        await arm.stop()
        joints = sim.arm.joints
        for motion in motions:
            with pytest.raises(MotionStopped, match="told to stop"):
                await motion

        await asyncio.sleep(5)
        assert sim.arm.joints == joints
        assert 0 < joints[0] < 150
        await arm.move_joint(1, 0)
        assert near(sim.arm.joints, (0,) * 6)


@virtual
async def test_what_somebody_else_stops_is_not_done() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        motion = await arm.queue.move_joint(1, 150)
        behind = await arm.queue.move_joint(1, 0)
        await asyncio.sleep(0.5)
        sim.arm.halt()
        for each in (motion, behind):
            with pytest.raises(MotionStopped, match="came to rest"):
                await each

        assert done(sim, c.SEND_ANGLE) == []
        await arm.move_joint(1, 10)


@virtual
async def test_pause_waits_in_the_middle_of_a_motion_and_resume_goes_on() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        motion = await arm.queue.move_joint(1, 150)
        await arm.queue.move_joint(1, 0)
        await asyncio.sleep(0.5)
        await arm.pause()
        joints = sim.arm.joints
        assert await arm.is_paused()
        with pytest.raises(ReplyTimeout):
            await motion.wait(60)

        assert sim.arm.joints == joints
        await arm.resume()
        await motion
        await arm.queue.join()
        assert near(sim.arm.joints, (0,) * 6)


@virtual
async def test_stopping_a_paused_arm_makes_it_ready_again() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        simulated: Any = sim.arm
        simulated._end_all = lambda: (simulated.device.force_stop(), simulated.device.clear(), simulated.device.start())
        motion = await arm.queue.move_joint(1, 150)
        await asyncio.sleep(0.5)
        await arm.pause()
        await arm.stop()
        assert not await arm.is_paused()
        with pytest.raises(MotionStopped):
            await motion

        await arm.move_joint(1, 0)


@virtual
async def test_clear_stops_what_runs() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        motion = await arm.queue.move_joint(1, 150)
        await asyncio.sleep(0.5)
        await arm.queue.clear()
        assert not sim.arm.moving
        with pytest.raises(MotionStopped, match="cleared"):
            await motion


@virtual
async def test_leaving_by_an_error_stops_the_arm() -> None:
    async with simulate("myarm300") as sim:
        with pytest.raises(RuntimeError, match="mine"):
            async with MyCobot.connect(sim.url, model="myarm300") as arm:
                motion = await arm.queue.move_joint(1, 150)
                await asyncio.sleep(0.5)
                raise RuntimeError("mine")

        assert not sim.arm.moving
        assert sim.arm.executed[-1].outcome == "aborted"
        with pytest.raises(MotionStopped):
            await motion


@virtual
async def test_leaving_by_an_error_can_let_the_arm_finish() -> None:
    async with simulate("mycobot280") as sim:
        with pytest.raises(RuntimeError):
            async with MyCobot.connect(sim.url, on_error="leave") as arm:
                await arm.queue.move_joint(1, 50)
                await asyncio.sleep(0.5)
                raise RuntimeError

        await asyncio.sleep(5)
        assert near(sim.arm.joints, (50, 0, 0, 0, 0, 0))


@virtual
async def test_leaving_normally_stops_nothing_and_tells_what_was_never_sent() -> None:
    async with simulate("mycobot280") as sim:
        async with MyCobot.connect(sim.url) as arm:
            await arm.queue.move_joint(1, 50)
            await asyncio.sleep(0.5)

        await asyncio.sleep(5)
        assert near(sim.arm.joints, (50, 0, 0, 0, 0, 0))
        with pytest.raises(MotionStopped, match=r"2 commands waited in the queue.*never sent"):
            async with MyCobot.connect(sim.url) as arm:
                for angle in (0, 10, 20):
                    await arm.queue.move_joint(1, angle)

                await asyncio.sleep(0.2)

        await asyncio.sleep(5)
        assert near(sim.arm.joints, (0,) * 6)


@virtual
async def test_cancelling_who_awaits_a_motion_of_the_arm_stops_it() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(0.5):
                await arm.move_joint(1, 150)

        assert not sim.arm.moving
        with pytest.raises(ReplyTimeout, match=r"not done within 0.5 s; the arm was stopped"):
            await arm.move_joint(1, 0, timeout=0.5)

        assert not sim.arm.moving


@virtual
async def test_cancelling_who_awaits_a_motion_of_the_queue_stops_nothing() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        motion = await arm.queue.move_joint(1, 90)
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(0.5):
                await motion

        await motion
        assert near(sim.arm.joints, (90, 0, 0, 0, 0, 0))


@pytest.mark.parametrize(
    ("code", "name"),
    [
        (1, "EMERGENCY_STOP"),
        (16, "COMMUNICATION_LOST"),
        (25, "COMMUNICATION_UNSTABLE"),
        (40, "VOLTAGE"),
        (50, "MAGNETIC_ENCODER"),
        (64, "OVER_TEMPERATURE"),
        (81, "OVER_CURRENT"),
        (97, "OVERLOAD"),
        (200, "UNKNOWN_0xC8"),
    ],
)
@virtual
async def test_an_error_of_a_joint_ends_the_motion(code: int, name: str) -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        motion = await arm.queue.move_joint(2, 100)
        behind = await arm.queue.move_joint(2, 0)
        await asyncio.sleep(0.3)
        sim.arm.raise_error(3, code)
        for each in (motion, behind):
            with pytest.raises(ArmAlarm, match=f"joint 3: 0x{code:02X} {name}") as caught:
                await each

            assert [(alarm.joint, alarm.code, alarm.name) for alarm in caught.value.alarms] == [(3, code, name)]

        assert [alarm.name for alarm in await arm.get_alarms()] == [name]
        with pytest.raises(ArmAlarm):
            await arm.move_joint(1, 90)

        sim.arm.raise_error(3, 0)
        await arm.recover()
        await arm.move_joint(1, 90)
        assert await arm.get_alarms() == ()


@virtual
async def test_an_error_of_the_atom_is_told_and_keeps_nothing_from_moving() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        sim.arm.raise_error(7, 16)
        await arm.move_joint(1, 90)
        [alarm] = await arm.get_alarms()
        assert (alarm.joint, alarm.blocks) == (None, False)


@virtual
async def test_a_target_out_of_reach_raises_what_the_arm_says() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        with pytest.raises(ArmAlarm, match="NO_INVERSE_SOLUTION") as caught:
            await arm.move_to(270, 270, 400, 0, 0, 0)

        assert [alarm.code for alarm in caught.value.alarms] == [32]
        await arm.move_joints(*HERE)
        await arm.clear_alarms()
        assert sim.arm.error == 0
        await arm.set_joint_limits(1, -10, 10)
        with pytest.raises(ArmAlarm, match="joint 1: 0x01 JOINT_LIMIT"):
            await arm.move_joint(1, 90)


@virtual
async def test_an_arm_that_says_nothing_of_it_is_not_believed_to_have_moved() -> None:
    async with simulate("mycobot280", quirks=OLD) as sim, MyCobot.connect(sim.url) as arm:
        with pytest.raises(CommandRejected, match="answers but does not move"):
            await arm.move_to(270, 270, 400, 0, 0, 0)

        await arm.release()
        with pytest.raises(CommandRejected, match="are the servos on"):
            await arm.move_joint(1, 90)

        await arm.focus()
        await arm.move_joint(1, 90)
        await arm.power_off()
        with pytest.raises(CommandRejected, match="not powered"):
            await arm.move_joint(1, 0)

        await arm.power_on()
        await arm.move_joint(1, 0)
        assert near(sim.arm.joints, (0,) * 6)


@virtual
async def test_what_a_model_cannot_do_is_refused_before_it_is_queued() -> None:
    async with simulate("mypalletizer260") as sim, MyCobot.connect(sim.url, model="mypalletizer260") as arm:
        refused: list[tuple[Command[Any, Any], Any]] = [
            (c.SEND_ANGLE, c.JointMove(1, 170)),
            (c.JOG_ABSOLUTE, c.JointMove(2, -5)),
            (c.JOG_INCREMENT, c.JointMove(5, 1)),
            (c.SEND_COORD, c.CoordMove(5, 0)),
        ]
        for command, value in refused:
            with pytest.raises(ValueError, match=r"myPalletizer 260|must be in"):
                await arm.queue.put(command, value)

        for direction in ("ry+", "j5+"):
            with pytest.raises(ValueError, match=r"is j1\+ j1- .* j4\+ j4- x\+ x- .* rx\+ rx-, not"):
                await arm.jog(direction, 1)

        await arm.queue.put(c.SEND_ANGLE, c.JointMove(1, 10))
        await arm.queue.join()
        assert sim.arm.joints[0] == pytest.approx(10, abs=0.1)


@virtual
async def test_servos_are_let_go_damped_unless_told_otherwise() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        sent: list[bytes] = []
        arm.link.on_frame.add(lambda outgoing, frame: sent.append(bytes(frame)) if outgoing else None)
        await arm.release()
        await arm.release(damping=False)
        await arm.release(2)
        await arm.release(2, damping=False)
        told = [frame.hex(" ") for frame in sent if frame[3] in (0x13, 0x56)]
        assert told == ["fe fe 02 13 fa", "fe fe 03 13 01 fa", "fe fe 03 56 02 fa", "fe fe 04 56 02 01 fa"]


@virtual
async def test_servos_that_cannot_be_read_are_an_alarm_and_no_angle() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        sim.arm.servos_lost = True
        with pytest.raises(ArmAlarm, match="SERVO_LOSS"):
            await arm.get_angles()

        with pytest.raises(ArmAlarm, match="SERVO_LOSS"):
            await arm.get_pose()

        with pytest.raises(ArmAlarm, match="SERVO_LOSS"):
            await arm.move_joint(1, 90)


@virtual
async def test_jogs_last_as_long_as_they_are_told_to() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        await arm.jog("j1+", 1.0, speed=20)
        assert not sim.arm.moving
        assert 20 < sim.arm.joints[0] < 40
        await arm.move_joints(*HERE)
        before = await arm.get_coords()
        await arm.jog("z-", 0.5)
        after = await arm.get_coords()
        assert after.z < before.z - 10
        assert near((after.x, after.y), (before.x, before.y), 1)
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(0.5), arm.jogging("j6-"):
                await asyncio.sleep(60)

        assert not sim.arm.moving
        for wrong in ("j7+", "j1", "q+", ""):
            with pytest.raises(ValueError, match="direction"):
                await arm.jog(wrong, 1)

        with pytest.raises(ValueError, match="seconds"):
            await arm.jog("j1+", -1)


@virtual
async def test_the_other_motions() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        await arm.move_joints(*HERE)
        coords = await arm.get_coords()
        await arm.step_coord("z", -30)
        await arm.move_coord("x", coords.x + 10)
        moved = await arm.get_coords()
        assert near((moved.x, moved.y, moved.z), (coords.x + 10, coords.y, coords.z - 30), 0.3)
        await arm.move_encoders(*(2048,) * 6)
        assert await arm.get_encoders() == (2048,) * 6
        with pytest.raises(ValueError, match="an axis is one of"):
            await arm.move_coord("w", 1)

    async with simulate("myarm300") as sim, MyCobot.connect(sim.url, model="myarm300") as arm:
        await arm.move_joints(10, 40, 0, -60, 0, 40, 0)
        before = await arm.get_coords()
        await arm.move_elbow(5)
        after = await arm.get_coords()
        assert near((after.x, after.y, after.z), (before.x, before.y, before.z), 1)
        assert abs(await arm.request(c.GET_SOLUTION_ANGLES, None) - 5) < 0.1


@pytest.mark.parametrize("quirks", [MyCobotQuirks(), OLD], ids=["new firmware", "old firmware"])
@virtual
async def test_what_is_set_takes_effect_before_the_call_returns(quirks: MyCobotQuirks) -> None:
    async with simulate("mycobot280", quirks=quirks) as sim, MyCobot.connect(sim.url) as arm:
        await arm.color(1, 2, 3)
        assert sim.arm.color == c.RGB(1, 2, 3)
        await arm.set_pin(22, True)
        await arm.set_pin(2, True, base=True)
        assert sim.arm.outputs == {(c.SET_DIGITAL_OUTPUT, 22): 1, (c.SET_BASIC_OUTPUT, 2): 1}
        sim.arm.set_input(23, 1)
        sim.arm.set_input(5, 1, base=True)
        assert [await arm.get_pin(23), await arm.get_pin(24)] == [True, False]
        assert [await arm.get_pin(5, base=True), await arm.get_pin(6, base=True)] == [True, False]
        await arm.set_tool(0, 0, 50, 0, 0, 0)
        await arm.set_world(0, 0, 100, 0, 0, 0)
        assert (await arm.get_tool()).z == 50
        assert (await arm.get_world()).z == 100
        flange = await arm.get_coords()
        await arm.set_end_type(c.EndType.TOOL)
        await arm.set_reference_frame(c.ReferenceFrame.WORLD)
        tool = await arm.get_coords()
        assert abs(tool.z - flange.z - 100) < 0.2
        await arm.set_movement_type(c.MoveMode.LINEAR)
        assert sim.arm.settings[c.SET_MOVEMENT_TYPE] is c.MoveMode.LINEAR
        await arm.set_joint_limits(2, -45, 45)
        assert await arm.get_joint_limits(2) == (-45, 45)
        await arm.request(c.SET_FRESH_MODE, True)
        assert await arm.request(c.GET_TRANSPONDER_MODE, None) is c.TransponderMode.OFF
        await arm.request(c.SET_TRANSPONDER_MODE, c.TransponderMode.CHECK_ALL)
        assert await arm.request(c.GET_TRANSPONDER_MODE, None) is c.TransponderMode.CHECK_ALL
        await arm.gripper_to(40, speed=100)
        assert await arm.get_gripper() == 40
        assert await arm.get_voltages() == (7.2,) * 6
        assert await arm.get_temperatures() == (30,) * 6
        assert await arm.get_status() == await arm.get_speeds() == (0,) * 6


@virtual
async def test_a_gripper_in_the_queue_is_done_when_it_rests() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        await (await arm.queue.gripper(False, speed=50))
        assert sim.arm.gripper.value == 100
        await (await arm.queue.gripper(True, speed=50))
        assert sim.arm.gripper.value == 0


@virtual
async def test_old_firmware_tells_what_it_can() -> None:
    async with simulate("mycobot280", quirks=OLD) as sim, MyCobot.connect(sim.url) as arm:
        info = await arm.get_versions()
        assert (info.model, info.system_version, info.basic_version) == ("myCobot 280", None, None)
        assert await arm.get_info() == DeviceInfo("", "", "")
        assert await arm.get_alarms() == ()
        unknown = sim.arm.counters.unknown
        for _ in range(3):
            assert await arm.get_pose()

        learned = sim.arm.counters.unknown
        await arm.get_pose()
        assert unknown < learned == sim.arm.counters.unknown
        with pytest.raises(ReplyTimeout):
            await arm.request(c.GET_ERROR_INFORMATION, None, timeout=0.5)


@virtual
async def test_observers_only_read() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        await arm.queue.move_joint(1, 90)
        async with MyCobot.connect(sim.url, control=False) as observer:
            assert len(await observer.get_angles()) == 6
            requests = sim.arm.counters.requests
            for act in (
                observer.move_joint(1, 0),
                observer.color(0, 0, 0),
                observer.jog("j1+", 1),
                observer.power_off(),
                observer.request(c.SET_FRESH_MODE, True),
            ):
                with pytest.raises(ValueError, match="control=False"):
                    await act

            with pytest.raises(ValueError, match="control=False"):
                await observer.queue.wait(1)

            assert sim.arm.counters.requests - requests < 5

        await arm.queue.join()
        assert near(sim.arm.joints, (90, 0, 0, 0, 0, 0))


@virtual
async def test_a_fresh_connection_stops_what_an_earlier_one_left_moving_and_another_does_not() -> None:
    async with simulate("mycobot280") as sim:
        async with MyCobot.connect(sim.url) as arm:
            await arm.queue.move_joint(1, 150)
            await asyncio.sleep(0.5)

        async with MyCobot.connect(sim.url, queue="keep") as arm:
            assert await arm.is_moving()

        async with MyCobot.connect(sim.url) as arm:
            assert not await arm.is_moving()


@virtual
async def test_wrong_arguments_are_refused_before_a_byte_is_sent() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        requests = sim.arm.counters.requests
        for act, message in (
            (arm.move_joints(0, 0, 0), "6 values for this arm, not 3"),
            (arm.move_joints(170, 0, 0, 0, 0, 0), "joint 1 must be in -168 to 168"),
            (arm.move_to(0, 0, 1000, 0, 0, 0), "z must be in"),
            (arm.move_elbow(10), "has no SetSolutionAngles"),
            (arm.request(c.SEND_ANGLES, c.JointsMove((0,) * 6)), "goes through the queue"),
            (arm.queue.wait(float("nan")), "seconds"),
            (arm.move_joint(1, 200), "joint 1 must be in"),
            (arm.queue.step_joint(7, 1), "joints 1 to 6"),
        ):
            with pytest.raises(ValueError, match=message):
                await act

        assert sim.arm.counters.requests == requests


NAN = float("nan")


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"model": "magician"}, "no model"),
        ({"queue": "empty"}, "queue must be"),
        ({"on_error": "go"}, "on_error must be"),
        ({"timeout": NAN}, "timeout must be"),
        ({"reply_timeout": (0.2, NAN)}, "reply_timeout must be"),
        ({"gap": -1}, "gap must be"),
        ({"gap": NAN}, "gap must be"),
        ({"tolerance": (0, 1)}, "tolerance must be"),
        ({"tolerance": (1, NAN)}, "tolerance must be"),
        ({"tolerance": (1, float("inf"))}, "tolerance must be"),
        ({"tolerance": (1,)}, "tolerance must be"),
    ],
)
@virtual
async def test_wrong_options_are_refused(wrong: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        async with MyCobot.connect("sim:", **wrong):
            pass


@virtual
async def test_a_silent_arm_is_told_with_its_most_common_cause() -> None:
    async with simulate("mycobot280") as sim:
        sim.faults.loss = 1.0
        with pytest.raises(ConnectFailed, match=r"no myCobot 280 answers.*Transponder.*USB UART"):
            async with MyCobot.connect(sim.url, timeout=1):
                pass


@virtual
async def test_another_arm_is_told_with_what_to_check() -> None:
    async with simulate("myarm300") as sim:
        with pytest.raises(ConnectFailed, match=r"not as a myCobot 280 with 6 joints.*is the model right"):
            async with MyCobot.connect(sim.url, model="mycobot280"):
                pass


@virtual
async def test_a_line_that_breaks_ends_everything_once() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        motion = await arm.queue.move_joint(1, 90)
        await asyncio.sleep(0.1)
        sim.unplug()
        with pytest.raises(ConnectionLost):
            await motion

        with pytest.raises(ConnectionLost):
            await arm.get_angles()


@virtual
async def test_a_reopened_line_finds_its_motion_again() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url, reconnect=True) as arm:
        motion = await arm.queue.move_joint(1, 150)
        behind = await arm.queue.move_joint(1, 0)
        await asyncio.sleep(0.3)
        sim.unplug()
        await motion
        await behind
        assert [value.angle for value in done(sim, c.SEND_ANGLE)] == [150, 0]


@virtual
async def test_an_arm_that_does_not_stop_is_not_said_to_have_stopped() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        simulated: Any = sim.arm
        simulated.halt = lambda: None
        motion = await arm.queue.move_joint(1, 160, speed=1)
        await asyncio.sleep(1)
        with pytest.raises(MotionUnknown, match="still moves"):
            await arm.stop()

        with pytest.raises(MotionStopped):
            await motion


@virtual
async def test_the_url_sim_makes_an_arm_of_the_model() -> None:
    for model in MODELS:
        async with MyCobot.connect("sim:?speed=10", model=model) as arm:
            await arm.home(speed=50)
            assert len(await arm.get_angles()) == MODELS[model].joints
