"""The simulated myCobots: their motions in time, their queue, their errors, and the habits of the M5."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mycobot_values import values
from quick_suite import examples

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.frame import Frame, Parser, encode
from dobot_async.arms.mycobot.models import MODELS
from dobot_async.arms.mycobot.standstill import turned
from dobot_async.simulator import MyCobotQuirks, SimulatedMyCobot
from dobot_async.simulator.mycobot.elbow import elbow_angle, turn_elbow
from dobot_async.simulator.mycobot.kinematics import KINEMATICS, Chain
from dobot_async.simulator.mycobot.segments import NO_INVERSE, NO_LINE, SegmentPlanner


class Bench:
    """An arm, its clock, and a client's side of its line."""

    def __init__(self, model: str = "mycobot280", **details: Any) -> None:
        self.now = 0.0
        self.arm = SimulatedMyCobot(lambda: self.now, model=model, **details)
        self.model = MODELS[model]
        self.session = self.arm.session()

    def send(self, command: Command[Any, Any], value: Any = None) -> bytes:
        """Sends a request, returns the bytes of the answer."""
        row = self.model.row(command)
        return self.session.receive(encode(Frame(row.id, row.request.encode(value))))

    def ask(self, command: Command[Any, Any], value: Any = None) -> Any:
        """Sends a request, returns what the answer says."""
        [frame] = Parser(self.model.known).feed(self.send(command, value))
        row = self.model.row(command)
        assert frame.id == row.id
        return row.reply.decode(frame.params)


@pytest.mark.parametrize("name", list(MODELS))
@settings(max_examples=examples(20))
@given(data=st.data())
def test_joints_that_are_near_are_found_for_each_point(name: str, data: st.DataObject) -> None:
    model, solver = MODELS[name], KINEMATICS[name]
    joints = [data.draw(st.floats(low * 0.9, high * 0.9)) for low, high in model.joint_limits]
    near = [
        min(max(joint + data.draw(st.floats(-5, 5)), low), high)
        for joint, (low, high) in zip(joints, model.joint_limits, strict=True)
    ]
    point = solver.forward(joints)
    assert len(point) == len(model.reach)
    found = solver.inverse(point, near, model.joint_limits)
    if found is None:
        return  # near a singular place; the arm says so too

    there = solver.forward(found)
    assert there[:3] == pytest.approx(point[:3], abs=0.05)
    if len(point) == 6:
        assert turned(there[3:], point[3:]) < 0.1


def test_the_highest_point_is_that_of_the_vendors_tables() -> None:
    for name in ("mycobot280", "mycobot320", "myarm300"):
        assert KINEMATICS[name].forward([0.0] * MODELS[name].joints)[2] == pytest.approx(MODELS[name].reach[2][1])


def test_a_motion_takes_its_time() -> None:
    bench = Bench()
    bench.send(c.SEND_ANGLE, c.JointMove(1, 75, 50))
    assert bench.ask(c.IS_MOVING)
    bench.now = 0.6
    assert 0 < bench.ask(c.GET_ANGLES)[0] < 75
    bench.now = 1.3
    assert bench.ask(c.IS_MOVING)  # 75 degrees at 75 degrees/s, and 0.375 s for the ramps
    bench.now = 1.4
    assert not bench.ask(c.IS_MOVING)
    assert bench.ask(c.GET_ANGLES) == (75.0, 0, 0, 0, 0, 0)


def test_commands_queue_up_or_the_newest_wins() -> None:
    for fresh, path in ((False, [50, 0]), (True, [0])):
        bench = Bench()
        bench.send(c.SET_FRESH_MODE, fresh)
        bench.send(c.SEND_ANGLE, c.JointMove(1, 50, 100))
        bench.now = 0.3
        bench.send(c.SEND_ANGLE, c.JointMove(1, 0, 100))
        bench.now = 20
        assert [each.value.angle for each in bench.arm.executed if each.outcome == "done"] == path


def test_pause_resume_and_stop() -> None:
    bench = Bench()
    bench.send(c.SEND_ANGLE, c.JointMove(1, 150, 100))
    bench.now = 0.5
    bench.send(c.PAUSE)
    bench.now = 9
    assert bench.ask(c.IS_PAUSED)
    assert not bench.ask(c.IS_MOVING)
    held = bench.ask(c.GET_ANGLES)
    bench.send(c.RESUME)
    assert bench.ask(c.GET_ANGLES) == held
    bench.now = 9.2
    bench.send(c.STOP)
    stopped = bench.ask(c.GET_ANGLES)
    assert held[0] < stopped[0] < 150
    bench.now = 20
    assert bench.ask(c.GET_ANGLES) == stopped
    assert not bench.ask(c.IS_PAUSED)


def test_a_straight_line_is_straight() -> None:
    bench = Bench()
    bench.arm.place(30, -20, 40, -10, 20, 60)
    start = bench.ask(c.GET_COORDS)
    bench.send(c.SEND_COORDS, c.ToMove((*start[:2], start[2] - 60, *start[3:]), 50, c.MoveMode.LINEAR))
    seen = []
    while bench.ask(c.IS_MOVING):
        bench.now += 0.05
        seen.append(bench.ask(c.GET_COORDS))

    assert len(seen) > 5
    for coords in seen:
        assert coords[:2] == pytest.approx(start[:2], abs=0.5)
        assert turned(coords[3:], start[3:]) < 0.5

    assert seen[-1][2] == pytest.approx(start[2] - 60, abs=0.1)


def test_what_cannot_be_reached_is_an_error_and_no_motion() -> None:
    bench = Bench()
    bench.send(c.SEND_COORDS, c.ToMove((280, 280, 400, 0, 0, 0), 50, c.MoveMode.ANGULAR))
    assert bench.ask(c.GET_ERROR_INFORMATION) == NO_INVERSE
    assert not bench.ask(c.IS_MOVING)
    bench.send(c.SET_JOINT_MAX, c.JointLimit(2, 30))
    bench.send(c.SEND_ANGLE, c.JointMove(2, 31, 50))
    assert bench.ask(c.GET_ERROR_INFORMATION) == 2
    bench.send(c.CLEAR_ERROR_INFORMATION)
    assert bench.ask(c.GET_ERROR_INFORMATION) == 0
    bench.send(c.SEND_ANGLE, c.JointMove(2, 30, 50))
    assert bench.ask(c.IS_MOVING)


def test_a_line_through_where_there_are_no_joints_is_none() -> None:
    ways = SegmentPlanner(MODELS["mypalletizer260"])
    start = (0.0, 30.0, 0.0, 0.0)
    there = (170.0, 30.0, 0.0, 0.0)
    assert NO_LINE != NO_INVERSE
    assert ways.line(start, ways.solver.forward(there[:1] + start[1:]), 50).stop < 1.0


@pytest.mark.parametrize("command", [c.SEND_ANGLE, c.JOG_INCREMENT])
def test_an_arm_without_power_or_with_an_error_stays(command: Command[Any, Any]) -> None:
    bench = Bench()
    value = c.JointMove(1, 20, 50)
    for off, on in (
        (lambda: bench.send(c.POWER_OFF), lambda: bench.send(c.POWER_ON)),
        (lambda: bench.send(c.RELEASE_SERVO, c.Release(3)), lambda: bench.send(c.FOCUS_SERVO, 3)),
        (lambda: bench.send(c.RELEASE_ALL_SERVOS), lambda: bench.send(c.FOCUS_SERVO, 0)),
        (lambda: bench.arm.raise_error(2, 1), lambda: bench.arm.raise_error(2, 0)),
    ):
        off()
        bench.send(command, value)
        assert not bench.ask(c.IS_MOVING)
        on()
        bench.send(command, value)
        assert bench.ask(c.IS_MOVING)
        bench.send(c.STOP)
        bench.arm.place(0, 0, 0, 0, 0, 0)


def test_errors_are_told_joint_by_joint() -> None:
    assert len(Bench("myarm300").ask(c.READ_NEXT_ERROR)) == 7
    bench = Bench()
    bench.arm.raise_error(3, 80)
    bench.arm.raise_error(7, 16)
    assert bench.ask(c.READ_NEXT_ERROR) == (0, 0, 80, 0, 0, 0, 16)


def test_jogs_end_at_a_limit_or_when_they_are_told_to() -> None:
    bench = Bench()
    bench.send(c.JOG_ANGLE, c.JogJoint(1, c.Direction.UP, 100))
    bench.now = 60
    assert bench.ask(c.GET_ANGLES)[0] == 168
    bench.send(c.JOG_ANGLE, c.JogJoint(1, c.Direction.DOWN, 10))
    bench.now = 61
    bench.send(c.STOP)
    stopped = bench.ask(c.GET_ANGLES)
    bench.now = 70
    assert bench.ask(c.GET_ANGLES) == stopped
    assert 0 < stopped[0] < 168
    bench.arm.place(30, -20, 40, -10, 20, 60)
    for command, value in (
        (c.JOG_COORD, c.JogAxis(3, c.Direction.DOWN, 50)),
        (c.JOG_ROTATION, c.JogRotation(3, c.Direction.UP, 50)),
    ):
        before = bench.ask(c.GET_COORDS)
        bench.send(command, value)
        bench.now += 0.5
        bench.send(c.STOP)
        assert bench.ask(c.GET_COORDS) != before


def test_firmware_acknowledges_everything_something_or_nothing() -> None:
    ack = bytes.fromhex("FE FE 03 21 01 FA")
    move = c.JointMove(1, 5, 50)
    assert Bench().send(c.SEND_ANGLE, move) == ack
    assert Bench("myarm300").send(c.SEND_ANGLE, move) == b""
    some = Bench("myarm300", quirks=MyCobotQuirks(acknowledges=frozenset({c.SEND_ANGLE})))
    assert some.send(c.SEND_ANGLE, move) == ack
    assert some.send(c.STOP) == b""


def test_old_firmware_does_not_know_what_the_manual_does_not_have() -> None:
    bench = Bench(quirks=MyCobotQuirks(later=False))
    for command in (c.GET_ERROR_INFORMATION, c.GET_ANGLES_COORDS, c.GET_FRESH_MODE):
        assert bench.send(command) == b""

    assert bench.arm.counters.unknown == 3


def test_the_m5_answers_what_it_does_itself_with_the_request() -> None:
    request = bytes.fromhex("FE FE 04 A0 02 01 FA")
    assert Bench().session.receive(request) == request
    mode = bytes.fromhex("FE FE 03 C2 01 FA")
    assert Bench().session.receive(mode) == b"ok--------------\r\n" + mode
    assert Bench(quirks=MyCobotQuirks(echo=False)).session.receive(request) == bytes.fromhex("FE FE 03 A0 01 FA")


def test_the_m5_loses_frames_that_do_not_arrive_whole() -> None:
    request = bytes.fromhex("FE FE 02 20 FA")
    bench = Bench()
    assert bench.session.receive(request[:3]) == b""
    assert bench.session.receive(request[3:]) == b""
    assert bench.arm.counters.dropped == 1
    assert len(bench.session.receive(request * 2)) == 2 * 17
    assert bench.session.receive(bytes.fromhex("FE FE 03 20 FA")) == b""
    drag = c.SetEncodersDrag((2048,) * 7, (100,) * 7)
    myarm = Bench("myarm300")
    myarm.send(c.SET_ENCODERS_DRAG, drag)
    assert myarm.arm.counters.dropped == 1
    direct = Bench("myarm300", quirks=MyCobotQuirks(transponder=False))
    direct.session.receive(request[:3])
    assert direct.session.receive(request[3:])
    direct.send(c.SET_ENCODERS_DRAG, drag)
    assert direct.arm.counters.dropped == 0
    assert direct.arm.counters.unfit == 0


def test_what_does_not_fit_is_left_unanswered() -> None:
    bench = Bench()
    for text in ("FE FE 06 21 09 00 00 14 FA", "FE FE 06 21 01 00 00 00 FA", "FE FE 03 85 07 FA"):
        assert bench.session.receive(bytes.fromhex(text)) == b""

    assert bench.arm.counters.unfit == 3


@pytest.mark.parametrize("name", list(MODELS))
@settings(max_examples=examples(12))
@given(data=st.data())
def test_any_request_is_answered_as_its_row_says(name: str, data: st.DataObject) -> None:
    bench = Bench(name, quirks=MyCobotQuirks(acknowledges=True, transponder=False))
    for _ in range(5):
        command = data.draw(st.sampled_from(list(bench.model.rows)))
        row = bench.model.row(command)
        reply = bench.send(command, data.draw(values(row.request)))
        bench.now += data.draw(st.floats(0, 2))
        if reply:
            [frame] = Parser(bench.model.known).feed(reply)
            assert frame.id == row.id
            row.reply.decode(frame.params)
        else:
            assert bench.arm.counters.unfit


@settings(max_examples=examples(100))
@given(st.lists(st.binary(max_size=40), max_size=8))
def test_no_bytes_break_an_arm(pieces: list[bytes]) -> None:
    bench = Bench()
    for piece in pieces:
        bench.session.receive(piece)
        bench.now += 0.1

    assert len(bench.ask(c.GET_ANGLES)) == 6


FLAT = (
    (-58.88, 34.27, -0.43, -67.5, -0.35, -76.2, 0.0),
    (-58.88, 34.27, -0.43, -67.5, -0.35, 20.2, 0.0),
    (40.25, 36.38, -0.52, -67.23, 0.26, -76.37, -0.35),
)
"""Postures of the vendor's examples: the whole arm lies nearly in one plane."""


@pytest.mark.parametrize("posture", FLAT)
def test_an_elbow_turns_out_of_a_flat_posture_and_leaves_the_tool_where_it_is(posture: tuple[float, ...]) -> None:
    bench = Bench("myarm300")
    for angle in (70, -70, 0, 45):
        bench.arm.guide_to(*posture)
        before = bench.ask(c.GET_COORDS)
        bench.send(c.SET_SOLUTION_ANGLES, c.SetSolutionAngle(angle, 60))
        bench.now += 20
        after = bench.ask(c.GET_COORDS)
        assert bench.arm.executed[-1].outcome == "done"
        assert bench.ask(c.GET_SOLUTION_ANGLES) == pytest.approx(angle, abs=0.01)
        assert after[:3] == pytest.approx(before[:3], abs=0.1)
        assert turned(after[3:], before[3:]) < 0.1
        assert bench.arm.joints[3] == posture[3]


def test_an_elbow_of_a_stretched_arm_is_nowhere_and_one_beyond_the_joints_limits_is_not_reached() -> None:
    bench = Bench("myarm300")
    assert bench.ask(c.GET_SOLUTION_ANGLES) == 0
    for joints, angle in ((0.0,) * 7, 10), (FLAT[0], 89):
        bench.arm.guide_to(*joints)
        bench.arm.ways.limits[0] = (-60, 20)
        bench.send(c.SET_SOLUTION_ANGLES, c.SetSolutionAngle(angle, 60))
        assert bench.ask(c.GET_ERROR_INFORMATION) == NO_INVERSE
        assert not bench.ask(c.IS_MOVING)
        bench.send(c.CLEAR_ERROR_INFORMATION)


@settings(max_examples=examples(50))
@given(st.data())
def test_an_elbow_is_where_it_was_told_to_be(data: st.DataObject) -> None:
    model, chain = MODELS["myarm300"], KINEMATICS["myarm300"]
    assert isinstance(chain, Chain)
    joints = [data.draw(st.floats(low * 0.6, high * 0.6)) for low, high in model.joint_limits]
    wanted = data.draw(st.floats(-89, 89))
    found = turn_elbow(chain, joints, wanted, model.joint_limits)
    if found is None:
        return  # stretched, or beyond a limit

    assert all(low - 0.01 <= each <= high + 0.01 for each, (low, high) in zip(found, model.joint_limits, strict=True))
    assert abs((elbow_angle(chain, found) or 0.0) - wanted) < 0.01
    here, there = chain.forward(joints), chain.forward(found)
    assert there[:3] == pytest.approx(here[:3], abs=0.01)
    assert turned(there[3:], here[3:]) < 0.01


def test_servos_have_speeds_while_they_move() -> None:
    bench = Bench()
    assert bench.ask(c.GET_SERVO_SPEEDS) == (0,) * 6
    bench.send(c.SEND_ANGLES, c.JointsMove((75, -37.5, 0, 0, 0, 0), 50))
    bench.now = 0.6
    first, second, *others = bench.ask(c.GET_SERVO_SPEEDS)
    assert first == pytest.approx(75 * 4096 / 360, abs=10)
    assert second == pytest.approx(-first / 2, abs=2)
    assert others == [0] * 4
    bench.send(c.PAUSE)
    assert bench.ask(c.GET_SERVO_SPEEDS) == (0,) * 6
    bench.send(c.RESUME)
    assert bench.ask(c.GET_SERVO_SPEEDS)[0] == first
    bench.send(c.STOP)
    assert bench.ask(c.GET_SERVO_SPEEDS) == (0,) * 6
    bench.send(c.JOG_ANGLE, c.JogJoint(1, c.Direction.DOWN, 20))
    bench.now += 0.5
    assert bench.ask(c.GET_SERVO_SPEEDS)[0] == pytest.approx(-30 * 4096 / 360, abs=10)


def test_servos_that_are_dragged_are_no_faster_than_told() -> None:
    bench = Bench("mycobot280", quirks=MyCobotQuirks(transponder=False))
    encoders = (2048 + 1024, 2048 - 512, *(2048,) * 4)
    bench.send(c.SET_ENCODERS_DRAG, c.SetEncodersDrag(encoders, (256, 1000, 0, 0, 0, 0)))
    bench.now = 2.0
    assert bench.ask(c.GET_SERVO_SPEEDS)[:2] == (256, -128)
    bench.now = 3.9
    assert bench.ask(c.IS_MOVING)  # 1024 steps at 256 a second
    bench.now = 4.5
    assert bench.ask(c.GET_ENCODERS) == encoders


@pytest.mark.parametrize("joints", [(), (10, 20), (0,) * 7, (float("nan"), 0, 0, 0, 0, 0)])
def test_a_hand_moves_as_many_joints_as_there_are(joints: tuple[float, ...]) -> None:
    bench = Bench()
    for guide in (bench.arm.guide_to, bench.arm.place):
        with pytest.raises(ValueError, match="a myCobot 280 has 6 joints"):
            guide(*joints)

    assert bench.ask(c.GET_ANGLES) == (0,) * 6


def test_what_names_a_servo_that_there_is_not_is_not_answered() -> None:
    for model, there, not_there in (("mycobot280", 7, 8), ("myarm300", 8, 9), ("mypalletizer260", 7, 5)):
        bench = Bench(model)
        assert bench.ask(c.GET_ENCODER, there) == 0
        if not_there < 9:
            for command, value in (
                (c.GET_ENCODER, not_there),
                (c.IS_SERVO_ENABLE, not_there),
                (c.GET_JOINT_MIN_ANGLE, there),
                (c.GET_SERVO_DATA, c.ServoDataAddress(not_there, 21)),
                (c.RELEASE_SERVO, c.Release(not_there)),
                (c.FOCUS_SERVO, not_there),
                (c.SEND_ANGLE, c.JointMove(there, 1)),
                (c.SET_ENCODER, c.SetEncoder(not_there, 1000)),
            ):
                assert bench.send(command, value) == b"", command

            assert not bench.arm.released


def test_a_gripper_needs_power_and_stops_at_a_piece() -> None:
    bench = Bench()
    bench.send(c.SET_GRIPPER_STATE, c.SetGripperState(c.GripperState.OPEN, 50))
    bench.now = 1.0
    assert bench.ask(c.IS_GRIPPER_MOVING)
    bench.arm.power(on=False)
    assert bench.ask(c.GET_GRIPPER_VALUE) == 50
    assert not bench.ask(c.IS_GRIPPER_MOVING)
    bench.send(c.SET_GRIPPER_VALUE, c.SetGripperValue(100, 100))
    bench.now = 5.0
    assert bench.ask(c.GET_GRIPPER_VALUE) == 50
    bench.arm.power(on=True)
    bench.arm.gripper.piece = 30.0
    bench.send(c.SET_GRIPPER_VALUE, c.SetGripperValue(0, 100))
    bench.now = 10.0
    assert bench.ask(c.GET_GRIPPER_VALUE) == 30
    bench.send(c.SET_ENCODER, c.SetEncoder(7, 2048))
    bench.now = 15.0
    assert bench.ask(c.GET_GRIPPER_VALUE) == 100
    assert Bench(quirks=MyCobotQuirks(gripper=False)).ask(c.GET_GRIPPER_VALUE) == 255


def test_an_arm_with_play_comes_to_rest_beside_where_it_was_told_to() -> None:
    bench = Bench(quirks=MyCobotQuirks(play=1.0))
    for _ in range(2):
        bench.send(c.SEND_ANGLES, c.JointsMove((10, 20, 30, 40, 50, 60), 100))
        bench.now += 10
        assert bench.ask(c.GET_ANGLES) == (11, 21, 29, 39, 51, 59)

    start = bench.ask(c.GET_COORDS)
    bench.send(c.SEND_COORDS, c.ToMove((*start[:2], start[2] - 20, *start[3:]), 50, c.MoveMode.LINEAR))
    bench.now += 10
    after = bench.ask(c.GET_COORDS)
    assert 1 < max(abs(a - b) for a, b in zip(after[:3], (*start[:2], start[2] - 20), strict=True)) < 6


def test_a_line_is_followed_in_fresh_mode_0_alone() -> None:
    ways = []
    for fresh in (False, True):
        bench = Bench()
        bench.arm.guide_to(20, -20, -60, 40, 10, 0)
        bench.send(c.SEND_COORDS, c.ToMove((150, 80, 200, -180, 0, -90), 100, c.MoveMode.ANGULAR))
        bench.now = 10
        bench.send(c.SET_FRESH_MODE, fresh)
        bench.send(c.SEND_COORDS, c.ToMove((150, -80, 200, -180, 0, -90), 50, c.MoveMode.LINEAR))
        off = 0.0
        while bench.ask(c.IS_MOVING):
            bench.now += 0.05
            here = bench.ask(c.GET_COORDS)
            off = max(off, abs(here[0] - 150), abs(here[2] - 200))

        assert here[1] == pytest.approx(-80, abs=0.2)
        ways.append(off)

    assert ways[0] < 0.5
    assert ways[1] > 10
