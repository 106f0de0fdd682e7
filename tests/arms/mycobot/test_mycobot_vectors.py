"""Calls of the vendor's library 4.0.7, the bytes that it sent, and what it made of answers: the same here, both ways.

The vendor's library truncates where this one rounds: int(-0.29 * 100) is -28. So where the numbers of a call are not
whole on the wire the bytes differ by one unit, and the test says so.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import astuple, is_dataclass, replace
from itertools import chain
from pathlib import Path
from typing import Any

import pytest

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.frame import Frame, Parser, encode
from dobot_async.arms.mycobot.models import MODELS, CobotModel
from dobot_async.simulator import SimulatedMyCobot

VECTORS = json.loads((Path(__file__).parent / "vectors.json").read_text(encoding="utf-8"))
OF_CLASS = {"MyArm": "myarm300", "MyCobot280": "mycobot280", "MyCobot": "mycobot280"}
Row = Command[Any, Any]


def nothing() -> None:
    """The value of a row without parameters."""


def same(value: Any) -> Any:
    """The value of a row with one parameter."""
    return value


def as_flag(value: int) -> bool:
    return bool(value)


def as_degrees(radians: list[float], speed: int) -> c.JointsMove:
    return c.JointsMove(tuple(math.degrees(each) for each in radians), speed)


CALLS: Mapping[str, tuple[Row, Callable[..., Any]]] = {
    "power_on": (c.POWER_ON, nothing),
    "is_power_on": (c.IS_POWER_ON, nothing),
    "release_all_servos": (c.RELEASE_ALL_SERVOS, lambda damping=None: damping),
    "is_controller_connected": (c.IS_CONTROLLER_CONNECTED, nothing),
    "read_next_error": (c.READ_NEXT_ERROR, nothing),
    "set_fresh_mode": (c.SET_FRESH_MODE, as_flag),
    "get_fresh_mode": (c.GET_FRESH_MODE, nothing),
    "set_free_mode": (c.SET_FREE_MODE, as_flag),
    "is_free_mode": (c.IS_FREE_MODE, nothing),
    "get_angles": (c.GET_ANGLES, nothing),
    "get_radians": (c.GET_ANGLES, nothing),
    "send_angle": (c.SEND_ANGLE, c.JointMove),
    "send_angles": (c.SEND_ANGLES, lambda angles, speed: c.JointsMove(tuple(angles), speed)),
    "send_radians": (c.SEND_ANGLES, as_degrees),
    "go_home": (c.SEND_ANGLES, lambda: c.JointsMove((0.0,) * 6, 10)),
    "get_coords": (c.GET_COORDS, nothing),
    "send_coord": (c.SEND_COORD, c.CoordMove),
    "send_coords": (
        c.SEND_COORDS,
        lambda coords, speed, mode=None: c.ToMove(tuple(coords), speed, None if mode is None else c.MoveMode(mode)),
    ),
    "pause": (c.PAUSE, nothing),
    "is_paused": (c.IS_PAUSED, nothing),
    "stop": (c.STOP, nothing),
    "is_in_position": (c.IS_IN_POSITION, lambda values, kind: c.InPosition(tuple(values), c.Position(kind))),
    "is_moving": (c.IS_MOVING, nothing),
    "get_solution_angles": (c.GET_SOLUTION_ANGLES, nothing),
    "set_solution_angles": (c.SET_SOLUTION_ANGLES, c.SetSolutionAngle),
    "jog_angle": (c.JOG_ANGLE, lambda joint, way, speed: c.JogJoint(joint, c.Direction(way), speed)),
    "jog_coord": (c.JOG_COORD, lambda axis, way, speed: c.JogAxis(axis, c.Direction(way), speed)),
    "jog_increment": (c.JOG_INCREMENT, c.JointMove),
    "jog_increment_angle": (c.JOG_INCREMENT, c.JointMove),
    "jog_increment_coord": (c.JOG_INCREMENT_COORD, c.CoordStep),
    "set_encoder": (c.SET_ENCODER, c.SetEncoder),
    "get_encoder": (c.GET_ENCODER, same),
    "set_encoders": (c.SET_ENCODERS, lambda encoders, speed: c.SetEncoders(tuple(encoders), speed)),
    "get_encoders": (c.GET_ENCODERS, nothing),
    "set_encoders_drag": (
        c.SET_ENCODERS_DRAG,
        lambda encoders, speeds: c.SetEncodersDrag(tuple(encoders), tuple(speeds)),
    ),
    "set_acceleration": (c.SET_ACCELERATION, same),
    "get_joint_min_angle": (c.GET_JOINT_MIN_ANGLE, same),
    "get_joint_max_angle": (c.GET_JOINT_MAX_ANGLE, same),
    "set_joint_min": (c.SET_JOINT_MIN, c.JointLimit),
    "is_servo_enable": (c.IS_SERVO_ENABLE, same),
    "is_all_servo_enable": (c.IS_ALL_SERVO_ENABLE, nothing),
    "set_servo_data": (
        c.SET_SERVO_DATA,
        lambda joint, address, value, mode=0: c.ServoData(joint, address, value, wide=bool(mode)),
    ),
    "get_servo_data": (c.GET_SERVO_DATA, c.ServoDataAddress),
    "set_servo_calibration": (c.SET_SERVO_CALIBRATION, same),
    "release_servo": (c.RELEASE_SERVO, c.Release),
    "focus_servo": (c.FOCUS_SERVO, same),
    "get_servo_speeds": (c.GET_SERVO_SPEEDS, nothing),
    "get_servo_voltages": (c.GET_SERVO_VOLTAGES, nothing),
    "get_servo_status": (c.GET_SERVO_STATUS, nothing),
    "get_servo_temps": (c.GET_SERVO_TEMPS, nothing),
    "set_digital_output": (c.SET_DIGITAL_OUTPUT, c.PinLevel),
    "get_digital_input": (c.GET_DIGITAL_INPUT, same),
    "set_pwm_output": (c.SET_PWM_OUTPUT, c.PWMOutput),
    "get_gripper_value": (c.GET_GRIPPER_VALUE, lambda kind=None: kind),
    "set_gripper_state": (c.SET_GRIPPER_STATE, lambda state, speed: c.SetGripperState(c.GripperState(state), speed)),
    "set_gripper_value": (
        c.SET_GRIPPER_VALUE,
        lambda value, speed, kind=None: c.SetGripperValue(value, speed, None if kind is None else c.GripperType(kind)),
    ),
    "is_gripper_moving": (c.IS_GRIPPER_MOVING, nothing),
    "set_color": (c.SET_COLOR, c.RGB),
    "set_basic_output": (c.SET_BASIC_OUTPUT, c.PinLevel),
    "get_basic_input": (c.GET_BASIC_INPUT, same),
    "set_tool_reference": (c.SET_TOOL_REFERENCE, tuple),
    "get_tool_reference": (c.GET_TOOL_REFERENCE, nothing),
    "set_world_reference": (c.SET_WORLD_REFERENCE, tuple),
    "get_world_reference": (c.GET_WORLD_REFERENCE, nothing),
    "set_reference_frame": (c.SET_REFERENCE_FRAME, c.ReferenceFrame),
    "get_reference_frame": (c.GET_REFERENCE_FRAME, nothing),
    "set_movement_type": (c.SET_MOVEMENT_TYPE, c.MoveMode),
    "get_movement_type": (c.GET_MOVEMENT_TYPE, nothing),
    "set_end_type": (c.SET_END_TYPE, c.EndType),
    "get_transponder_mode": (c.GET_TRANSPONDER_MODE, nothing),
    "set_transponder_mode": (c.SET_TRANSPONDER_MODE, c.TransponderMode),
    "get_angles_coords": (c.GET_ANGLES_COORDS, nothing),
    "get_system_version": (c.GET_SYSTEM_VERSION, nothing),
    "get_basic_version": (c.GET_BASIC_VERSION, nothing),
    "get_error_information": (c.GET_ERROR_INFORMATION, nothing),
    "get_HTS_gripper_torque": (c.GET_HTS_GRIPPER_TORQUE, nothing),
    "get_gripper_protect_current": (c.GET_GRIPPER_PROTECT_CURRENT, nothing),
    "init_gripper": (c.INIT_GRIPPER, nothing),
    "set_gripper_protect_current": (c.SET_GRIPPER_PROTECT_CURRENT, same),
    "set_four_pieces_zero": (c.SET_FOUR_PIECES_ZERO, nothing),
    "get_tof_distance": (c.GET_TOF_DISTANCE, nothing),
}
"""What each call of the vendor's library is here: the row, and its value made of the arguments."""

NAMES = [f"{number}-{each['cls']}-{each['call']}" for number, each in enumerate(VECTORS)]
ANSWERED = [each for each in VECTORS if each["rx_hex_used"]]
TRUNCATED = {("send_angle", "fe fe 06 21 01 ff e4 32 fa"), ("send_radians", None)}


def truncated(value: Any) -> Any:
    """A motion as the vendor's library rounds it."""
    if isinstance(value, c.JointMove):
        return replace(value, angle=int(value.angle * 100) / 100)

    assert isinstance(value, c.JointsMove)
    return replace(value, angles=tuple(int(round(each, 9) * 100) / 100 for each in value.angles))


def model(vector: dict[str, Any]) -> CobotModel:
    return MODELS[OF_CLASS[vector["cls"]]]


def sent(vector: dict[str, Any], change: Callable[[Any], Any] = same) -> bytes:
    """What this package sends for a call of the vendor's library."""
    command, value_of = CALLS[vector["call"]]
    row = model(vector).row(command)
    return encode(Frame(row.id, row.request.encode(change(value_of(*vector["args"])))))


@pytest.mark.parametrize("vector", VECTORS, ids=NAMES)
def test_the_bytes_of_a_call(vector: dict[str, Any]) -> None:
    expected = bytes.fromhex(vector["tx_hex"])
    if {(vector["call"], vector["tx_hex"]), (vector["call"], None)} & TRUNCATED:
        assert sent(vector) != expected
        assert sent(vector, truncated) == expected
    else:
        assert sent(vector) == expected


@pytest.mark.cases(8)
@pytest.mark.parametrize("vector", VECTORS, ids=NAMES)
def test_the_simulated_arm_takes_the_call(vector: dict[str, Any]) -> None:
    arm = SimulatedMyCobot(lambda: 0.0, model=model(vector).name)
    reply = arm.session().receive(bytes.fromhex(vector["tx_hex"]))
    assert (arm.counters.requests, arm.counters.unknown, arm.counters.unfit, arm.counters.dropped) == (1, 0, 0, 0)
    if reply:
        [frame] = Parser(model(vector).known).feed(reply)
        row = model(vector).row(CALLS[vector["call"]][0])
        assert frame.id == row.id
        row.reply.decode(frame.params)


def plain(value: Any) -> Any:
    """A value as the vendor's library gives it."""
    if is_dataclass(value) and not isinstance(value, type):
        values = [plain(each) for each in astuple(value)]
        return [*chain(*values)] if all(isinstance(each, list) for each in values) else values[-1]

    if isinstance(value, tuple):
        return list(value)

    return int(value) if isinstance(value, int) else value


@pytest.mark.parametrize("vector", ANSWERED, ids=[f"{n}-{each['call']}" for n, each in enumerate(ANSWERED)])
def test_what_is_made_of_the_answer(vector: dict[str, Any]) -> None:
    row = model(vector).row(CALLS[vector["call"]][0])
    [frame] = Parser(model(vector).known).feed(bytes.fromhex(vector["rx_hex_used"]))
    assert frame.id == row.id
    found = row.reply.decode(frame.params)
    if row.write:
        assert found is None
    elif vector["call"] == "read_next_error":
        assert found == (0x00, 0x10, 0x17, 0x20, 0x01, 0x00, 0x00)
    elif vector["call"] == "get_radians":
        assert [round(math.radians(each), 3) for each in found] == vector["returned"]
    else:
        assert plain(found) == vector["returned"]


def test_every_call_of_the_vectors_is_there() -> None:
    assert {each["call"] for each in VECTORS} == set(CALLS)
    assert len(VECTORS) > 120
