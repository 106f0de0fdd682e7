"""The frames that the manual prints: those that are right, and those that are wrong with what is right instead.

The manual is a myArm 300's, with examples left over from an arm with six joints. docs/mycobot.md has the list in words.
"""

from __future__ import annotations

from typing import Any

import pytest

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.frame import Frame, Parser, encode
from dobot_async.arms.mycobot.models import MODELS

MYARM, SIX = MODELS["myarm300"], MODELS["mycobot280"]
Row = Command[Any, Any]
ZEROS = (0, 0, 0, 0, 0, 0, 0)

REQUESTS: list[tuple[str, Row, Any]] = [
    ("FE FE 02 10 FA", c.POWER_ON, None),
    ("FE FE 02 11 FA", c.POWER_OFF, None),
    ("FE FE 02 12 FA", c.IS_POWER_ON, None),
    ("FE FE 02 13 FA", c.RELEASE_ALL_SERVOS, None),
    ("FE FE 02 14 FA", c.IS_CONTROLLER_CONNECTED, None),
    ("FE FE 02 15 FA", c.READ_NEXT_ERROR, None),
    ("FE FE 03 16 01 FA", c.SET_FRESH_MODE, True),
    ("FE FE 03 16 00 FA", c.SET_FRESH_MODE, False),
    ("FE FE 03 1A 01 FA", c.SET_FREE_MODE, True),
    ("FE FE 02 1B FA", c.IS_FREE_MODE, None),
    ("FE FE 02 20 FA", c.GET_ANGLES, None),
    ("FE FE 06 21 01 00 00 14 FA", c.SEND_ANGLE, c.JointMove(1, 0, 20)),
    ("FE FE 02 23 FA", c.GET_COORDS, None),
    ("FE FE 06 24 01 07 D0 14 FA", c.SEND_COORD, c.CoordMove(1, 200, 20)),
    ("FE FE 02 26 FA", c.PAUSE, None),
    ("FE FE 02 27 FA", c.IS_PAUSED, None),
    ("FE FE 02 28 FA", c.RESUME, None),
    ("FE FE 02 29 FA", c.STOP, None),
    ("FE FE 02 2B FA", c.IS_MOVING, None),
    ("FE FE 02 2E FA", c.GET_SOLUTION_ANGLES, None),
    ("FE FE 05 30 01 01 14 FA", c.JOG_ANGLE, c.JogJoint(1, c.Direction.UP, 20)),
    ("FE FE 06 31 01 11 94 14 FA", c.JOG_ABSOLUTE, c.JointMove(1, 45, 20)),
    ("FE FE 02 34 FA", c.JOG_STOP, None),
    ("FE FE 03 3B 02 FA", c.GET_ENCODER, 2),
    ("FE FE 02 3D FA", c.GET_ENCODERS, None),
    ("FE FE 02 40 FA", c.GET_SPEED, None),
    ("FE FE 03 41 32 FA", c.SET_SPEED, 50),
    ("FE FE 02 44 FA", c.GET_ACCELERATION, None),
    ("FE FE 03 4A 02 FA", c.GET_JOINT_MIN_ANGLE, 2),
    ("FE FE 05 4C 02 00 00 FA", c.SET_JOINT_MIN, c.JointLimit(2, 0)),
    ("FE FE 03 50 01 FA", c.IS_SERVO_ENABLE, 1),
    ("FE FE 02 51 FA", c.IS_ALL_SERVO_ENABLE, None),
    ("FE FE 04 53 0115 FA", c.GET_SERVO_DATA, c.ServoDataAddress(1, 0x15)),
    ("FE FE 03 54 01 FA", c.SET_SERVO_CALIBRATION, 1),
    ("FE FE 03 55 01 FA", c.JOINT_BRAKE, 1),
    ("FE FE 03 57 01 FA", c.FOCUS_SERVO, 1),
    ("FE FE 02 E1 FA", c.GET_SERVO_SPEEDS, None),
    ("FE FE 02 E3 FA", c.GET_SERVO_VOLTAGES, None),
    ("FE FE 02 E4 FA", c.GET_SERVO_STATUS, None),
    ("FE FE 02 E5 FA", c.GET_SERVO_TEMPS, None),
    ("FE FE 04 60 16 00 FA", c.SET_PIN_MODE, c.PinModeSetting(22, c.PinMode.INPUT)),
    ("FE FE 04 61 17 01 FA", c.SET_DIGITAL_OUTPUT, c.PinLevel(23, 1)),
    ("FE FE 03 62 16 FA", c.GET_DIGITAL_INPUT, 22),
    ("FE FE 02 65 FA", c.GET_GRIPPER_VALUE, None),
    ("FE FE 04 66 00 32 FA", c.SET_GRIPPER_STATE, c.SetGripperState(c.GripperState.OPEN, 50)),
    ("FE FE 04 67 32 14 FA", c.SET_GRIPPER_VALUE, c.SetGripperValue(50, 20)),
    ("FE FE 02 68 FA", c.SET_GRIPPER_CALIBRATION, None),
    ("FE FE 02 69 FA", c.IS_GRIPPER_MOVING, None),
    ("FE FE 05 70 00 00 FF FA", c.SET_COLOR, c.RGB(0, 0, 255)),
    ("FE FE 04 a0 02 01 FA", c.SET_BASIC_OUTPUT, c.PinLevel(2, 1)),
    ("FE FE 02 82 FA", c.GET_TOOL_REFERENCE, None),
    ("FE FE 03 85 01 FA", c.SET_REFERENCE_FRAME, c.ReferenceFrame.WORLD),
    ("FE FE 02 86 FA", c.GET_REFERENCE_FRAME, None),
    ("FE FE 03 87 00 FA", c.SET_MOVEMENT_TYPE, c.MoveMode.ANGULAR),
    ("FE FE 03 89 01 FA", c.SET_END_TYPE, c.EndType.TOOL),
    ("FE FE 02 8a FA", c.GET_END_TYPE, None),
    ("FE FE 02 b0 FA", c.GET_TRANSPONDER_MODE, None),
    ("FE FE 03 b1 00 FA", c.SET_TRANSPONDER_MODE, c.TransponderMode.OFF),
]

REPLIES: list[tuple[str, Row, Any]] = [
    ("FE FE 03 12 01 FA", c.IS_POWER_ON, True),
    ("FE FE 03 14 01 FA", c.IS_CONTROLLER_CONNECTED, True),
    ("FE FE 09 15 00 00 00 00 00 00 00 FA", c.READ_NEXT_ERROR, ZEROS),
    ("FE FE 03 1B 01 FA", c.IS_FREE_MODE, True),
    ("FE FE 03 27 01 FA", c.IS_PAUSED, True),
    ("FE FE 03 2A 00 FA", c.IS_IN_POSITION, False),
    ("FE FE 03 2B 01 FA", c.IS_MOVING, True),
    ("FE FE 04 2E 00 00 FA", c.GET_SOLUTION_ANGLES, 0.0),
    ("FE FE 04 3B 08 07 FA", c.GET_ENCODER, 2055),
    ("FE FE 03 40 32 FA", c.GET_SPEED, 50),
    ("FE FE 03 44 32 FA", c.GET_ACCELERATION, 50),
    ("FE FE 05 4A 02 F9 F2 FA", c.GET_JOINT_MIN_ANGLE, c.JointAngle(2, -155.0)),
    ("FE FE 04 50 01 01 FA", c.IS_SERVO_ENABLE, c.ServoConnected(1, connected=True)),
    ("FE FE 03 51 01 FA", c.IS_ALL_SERVO_ENABLE, True),
    ("FE FE 09 E3 00 00 00 00 00 00 00 FA", c.GET_SERVO_VOLTAGES, ZEROS),
    ("FE FE 09 E4 00 00 00 00 00 00 00 FA", c.GET_SERVO_STATUS, ZEROS),
    ("FE FE 09 E5 00 00 00 00 00 00 00 FA", c.GET_SERVO_TEMPS, ZEROS),
    ("FE FE 03 65 64 FA", c.GET_GRIPPER_VALUE, 100),
    ("FE FE 03 69 00 FA", c.IS_GRIPPER_MOVING, False),
    ("FE FE 03 86 01 FA", c.GET_REFERENCE_FRAME, c.ReferenceFrame.WORLD),
    ("FE FE 03 88 00 FA", c.GET_MOVEMENT_TYPE, c.MoveMode.ANGULAR),
    ("FE FE 03 8a 01 FA", c.GET_END_TYPE, c.EndType.TOOL),
    ("FE FE 03 b0 00 FA", c.GET_TRANSPONDER_MODE, c.TransponderMode.OFF),
]

EIGHT = " 08 00"
BROKEN: list[tuple[str, str, str, Row, Any]] = [
    # What is printed, what is right on a myArm, which of the two it is, and what it says.
    (
        "FE FE 10 20 00 8C 00 3D FF E6 FF 3F 00 AF FF 51 FA",
        "FE FE 10 20 00 8C 00 3D FF E6 FF 3F 00 AF FF 51 00 00 FA",
        "reply",
        c.GET_ANGLES,
        (1.4, 0.61, -0.26, -1.93, 1.75, -1.75, 0.0),
    ),
    (
        "FE FE 11 22 00 00 00 00 00 00 00 00 00 00 00 00 1E FA",
        "FE FE 11 22 00 00 00 00 00 00 00 00 00 00 00 00 00 00 1E FA",
        "request",
        c.SEND_ANGLES,
        c.JointsMove(ZEROS, 30),
    ),
    (
        "FE FE 10 23 01 BC FD A0 10 15 DC 66 FF 54 DE 21 FA",
        "FE FE 0E 23 01 BC FD A0 10 15 DC 66 FF 54 DE 21 FA",
        "reply",
        c.GET_COORDS,
        (44.4, -60.8, 411.7, -91.14, -1.72, -86.71),
    ),
    (
        "FE FE 11 2A 00 00 00 00 00 00 00 00 00 00 00 00 00 FA",
        "FE FE 11 2A 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 FA",
        "request",
        c.IS_IN_POSITION,
        c.InPosition(ZEROS, c.Position.ANGLES),
    ),
    ("FE FE 04 2F 00 00 14 FA", "FE FE 05 2F 00 00 14 FA", "request", c.SET_SOLUTION_ANGLES, c.SetSolutionAngle(0, 20)),
    (
        "FE FE 06 32 01 01 14 FA",
        "FE FE 05 32 01 01 14 FA",
        "request",
        c.JOG_COORD,
        c.JogAxis(1, c.Direction.UP, 20),
    ),
    ("FE FE 05 33 01 11 94 14 FA", "FE FE 06 33 01 11 94 14 FA", "request", c.JOG_INCREMENT, c.JointMove(1, 45, 20)),
    ("FE FE 06 3A 05 08 00 FA", "FE FE 06 3A 05 08 00 14 FA", "request", c.SET_ENCODER, c.SetEncoder(5, 2048, 20)),
    (
        f"FE FE 11 3C{EIGHT * 6} 14 FA",
        f"FE FE 11 3C{EIGHT * 7} 14 FA",
        "request",
        c.SET_ENCODERS,
        c.SetEncoders((2048,) * 7, 20),
    ),
    (f"FE FE 0E 3D{EIGHT * 7} FA", f"FE FE 10 3D{EIGHT * 7} FA", "reply", c.GET_ENCODERS, (2048,) * 7),
    ("FE FE 04 53 10 FA", "FE FE 03 53 10 FA", "reply", c.GET_SERVO_DATA, 16),
    ("FE FE 06 52 01 15 01 FA", "FE FE 05 52 01 15 01 FA", "request", c.SET_SERVO_DATA, c.ServoData(1, 0x15, 1)),
    (f"FE FE 0E E1{' 00 00' * 7} FA", f"FE FE 10 E1{' 00 00' * 7} FA", "reply", c.GET_SERVO_SPEEDS, ZEROS),
    ("FE FE 03 62 16 01 FA", "FE FE 04 62 16 01 FA", "reply", c.GET_DIGITAL_INPUT, c.PinLevel(22, 1)),
    (
        "FE FE 06 64 00 01 00 FA",
        "FE FE 06 64 16 03 E8 80 FA",
        "request",
        c.SET_PWM_OUTPUT,
        c.PWMOutput(22, 1000, 128),
    ),
    ("FE FE 03 a1 02 01 FA", "FE FE 03 A1 02 FA", "request", c.GET_BASIC_INPUT, 2),
    ("FE FE 03 a1 02 01 FA", "FE FE 04 A1 02 01 FA", "reply", c.GET_BASIC_INPUT, c.PinLevel(2, 1)),
    ("FE FE 02 88 00 FA", "FE FE 02 88 FA", "request", c.GET_MOVEMENT_TYPE, None),
]
"""Frames whose length is wrong: no arm understands them, and neither does the parser."""

UNKNOWN = "FE FE 03 63 17 01 FA"
"""SetPWMMode: the manual contradicts itself so much that nobody knows what is right."""

LIMITS = [0.0, 0.0, 50.0, 0.0, 0.0, 0.0]
WRONG: list[tuple[str, str, str, Row, Any]] = [
    # What is printed is whole, and says something else than it is to say.
    (
        "FE FE 10 25 05 DF FD 51 03 FA BC 30 00 00 DC D8 0A 01 FA",
        "FE FE 10 25 05 DF FD 51 03 FA 03 FA 00 00 DC D8 0A 01 FA",
        "request",
        c.SEND_COORDS,
        c.ToMove((150.3, -68.7, 101.8, 10.18, 0, -90), 10, c.MoveMode.LINEAR),
    ),
    ("FE FE 05 4C 02 00 00 FA", "FE FE 03 45 32 FA", "request", c.SET_ACCELERATION, 50),
    ("FE FE 03 4A 02 FA", "FE FE 03 4B 02 FA", "request", c.GET_JOINT_MAX_ANGLE, 2),
    ("FE FE 05 4A 02 06 72 FA", "FE FE 05 4B 02 06 72 FA", "reply", c.GET_JOINT_MAX_ANGLE, c.JointAngle(2, 165.0)),
    ("FE FE 05 4D 02 32 32 FA", "FE FE 05 4D 02 01 C2 FA", "request", c.SET_JOINT_MAX, c.JointLimit(2, 45)),
    ("FE FE 05 4D 02 11 94 FA", "FE FE 05 4D 02 01 C2 FA", "request", c.SET_JOINT_MAX, c.JointLimit(2, 45)),
    *(
        (
            f"FE FE 0E {number} 00 00 00 00 13 88 00 00 00 00 00 00 FA",
            f"FE FE 0E {number} 00 00 00 00 01 F4 00 00 00 00 00 00 FA",
            role,
            row,
            (0.0, 0.0, 50.0, 0.0, 0.0, 0.0),
        )
        for number, role, row in (
            ("81", "request", c.SET_TOOL_REFERENCE),
            ("82", "reply", c.GET_TOOL_REFERENCE),
            ("83", "request", c.SET_WORLD_REFERENCE),
            ("84", "reply", c.GET_WORLD_REFERENCE),
        )
    ),
    ("FE FE 02 82 FA", "FE FE 02 84 FA", "request", c.GET_WORLD_REFERENCE, None),
]

SIX_JOINTS: list[tuple[str, str, Row, Any]] = [
    (
        "FE FE 0E 20 00 8C 00 3D FF E6 FF 3F 00 AF FF 51 FA",
        "reply",
        c.GET_ANGLES,
        (1.4, 0.61, -0.26, -1.93, 1.75, -1.75),
    ),
    ("FE FE 0F 22 00 00 00 00 00 00 00 00 00 00 00 00 1E FA", "request", c.SEND_ANGLES, c.JointsMove(ZEROS[:6], 30)),
    ("FE FE 0F 2A 00 00 00 00 00 00 00 00 00 00 00 00 00 FA", "request", c.IS_IN_POSITION, c.InPosition(ZEROS[:6])),
    (f"FE FE 0F 3C{EIGHT * 6} 14 FA", "request", c.SET_ENCODERS, c.SetEncoders((2048,) * 6, 20)),
]
"""What the manual's examples with six values are on an arm with six joints."""


def frame_of(text: str, model: Any = MYARM) -> Frame:
    """The one frame that is printed."""
    [frame] = Parser(model.known).feed(bytes.fromhex(text))
    assert encode(frame) == bytes.fromhex(text)
    return frame


def says(text: str, role: str, command: Row, value: Any, model: Any = MYARM) -> None:
    """A frame is a request, or a reply, and says this and nothing else."""
    row = model.row(command)
    layout = row.request if role == "request" else row.reply
    frame = frame_of(text, model)
    assert frame.id == row.id
    assert layout.decode(frame.params) == value
    assert layout.encode(value) == frame.params


@pytest.mark.parametrize(("text", "command", "value"), REQUESTS, ids=[each[0] for each in REQUESTS])
def test_a_request_that_is_right(text: str, command: Row, value: Any) -> None:
    says(text, "request", command, value)


@pytest.mark.parametrize(("text", "command", "value"), REPLIES, ids=[each[0] for each in REPLIES])
def test_a_reply_that_is_right(text: str, command: Row, value: Any) -> None:
    says(text, "reply", command, value)


@pytest.mark.parametrize(("printed", "right", "role", "command", "value"), BROKEN, ids=[each[0] for each in BROKEN])
def test_a_frame_with_a_wrong_length(printed: str, right: str, role: str, command: Row, value: Any) -> None:
    parser = Parser(MYARM.known)
    assert parser.feed(bytes.fromhex(printed)) == []
    assert parser.resync() == []
    says(right, role, command, value)


@pytest.mark.parametrize(("printed", "right", "role", "command", "value"), WRONG, ids=[each[0] for each in WRONG])
def test_a_frame_that_says_something_else(printed: str, right: str, role: str, command: Row, value: Any) -> None:
    row = MYARM.row(command)
    frame = frame_of(printed)
    layout = row.request if role == "request" else row.reply
    assert frame.id != row.id or layout.decode(frame.params) != value
    says(right, role, command, value)


@pytest.mark.parametrize(("text", "role", "command", "value"), SIX_JOINTS, ids=[each[0] for each in SIX_JOINTS])
def test_the_example_on_an_arm_with_six_joints(text: str, role: str, command: Row, value: Any) -> None:
    says(text, role, command, value, SIX)


def test_what_nobody_knows_is_not_there() -> None:
    assert Parser(MYARM.known).feed(bytes.fromhex(UNKNOWN)) == []
    assert 0x63 not in MYARM.known


def test_each_command_of_the_manual_is_there() -> None:
    ids = {row.id for row in MYARM.rows.values()}
    texts = [text for text, *_ in REQUESTS + REPLIES] + [text for text, *_ in BROKEN + WRONG]
    printed = {bytes.fromhex(text)[3] for text in texts}
    assert printed - ids == set()
    assert ids >= {0x1A, 0x1B, 0x25, 0x3E, 0x45, 0x4D, 0x56}
