"""The ultraArm's lines: what goes out, letter by letter, and what comes back, however it is written and cut."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.ultraarm import commands as c
from dobot_async.arms.ultraarm.answers import Answer, Receipt, Refusal, Status
from dobot_async.arms.ultraarm.frame import BARRIERS, LONGEST, Frame, Parser, encode
from dobot_async.arms.ultraarm.layouts import Words, number
from dobot_async.arms.ultraarm.status import STATUS_AND_ANGLES
from dobot_async.arms.ultraarm.stopper import STOP_AND_STATUS
from dobot_async.errors import ProtocolError
from dobot_async.simulator import UltraArmQuirks
from dobot_async.simulator.ultraarm.arm import SimulatedUltraArm

Row = tuple[Command[Any, Any], Any]
Answered = tuple[bytes, Command[Any, Any], Any]
VECTORS: list[dict[str, Any]] = json.loads((Path(__file__).parent / "vectors.json").read_text(encoding="utf-8"))


def request(row: Command[Any, Any], value: Any) -> Frame:
    return encode(row, row.request.encode(value), queued=False)


STOP, POLL = request(STOP_AND_STATUS, None), request(STATUS_AND_ANGLES, None)


def text(row: Command[Any, Any], value: Any) -> str:
    """The command's own line, or lines, without those that close its answer."""
    return request(row, value).line.decode("ascii")


def bare(line: str) -> str:
    """A line as an arm reads it: blanks and case count for nothing."""
    return line.upper().replace(" ", "")


# What the manual prints.

MANUAL: list[tuple[str, Command[Any, Any], Any]] = [
    ("G0 X200 Y0 Z0 F100", c.MOVE_COORDS, c.CoordsMove(200, 0, 0, f=100)),
    ("G4 S1", c.WAIT, c.Dwell(1)),
    ("G28", c.HOME, None),
    ("G90", c.ABSOLUTE, None),
    ("G91", c.RELATIVE, None),
    ("G92 X0 Y0 Z0", c.SET_POSITION, c.Position(0, 0, 0)),
    ("G92 X100 Y50 Z10", c.SET_POSITION, c.Position(100, 50, 10)),
    ("M3", c.LASER_ON, None),
    ("M5", c.LASER_OFF, None),
    ("M21 P200", c.SET_PWM, c.PWM(200)),
    ("M22", c.PUMP_OFF, None),
    ("M23", c.PUMP_ON, None),
    ("M24", c.SET_GRIPPER_ZERO, c.GripperZero()),
    ("M25 A50 F200", c.SET_GRIPPER, c.GripperSet(50, 200)),
    ("M26", c.RELEASE_GRIPPER, None),
    ("M27", c.FAN_ON, None),
    ("M28", c.FAN_OFF, None),
    ("M10 J1 A90 F100", c.MOVE_JOINT, c.JointMove(1, 90, 100)),
    ("M11 X90 Y30 Z30 F100", c.MOVE_JOINTS, c.JointsMove(90, 30, 30, f=100)),
    ("M12", c.GET_ANGLES, None),
    ("M13 J1 D0 F10", c.JOG_JOINT, c.JogMove(1, c.JogDirection.POSITIVE, 10)),
    ("M14 J1 D0 F10", c.JOG_COORD, c.JogMove(1, c.JogDirection.POSITIVE, 10)),
    ("M15", c.JOG_STOP, None),
    ("M17", c.RELEASE, None),
    ("M18", c.POWER_ON, None),
    ("M114", c.GET_COORDS, None),
    ("M119", c.GET_ENDSTOPS, None),
]

RETURNS: list[tuple[str, Command[Any, Any], Any]] = [
    ("DATA: ANGLES[0.00 ,0.00 ,90.00 ,0.00]", c.GET_ANGLES, c.UltraArmAngles(0, 0, 90, 0)),
    ("DATA : COORDS[204.00,0.00,120.00,0.00]", c.GET_COORDS, c.UltraArmCoords(204, 0, 120, 0)),
    ("DATA : ENDSTOP[1 ,1 ,1]", c.GET_ENDSTOPS, c.Endstops(1, 1, 1)),
]


@pytest.mark.parametrize(("line", "row", "value"), MANUAL, ids=lambda each: each if isinstance(each, str) else "")
def test_the_manuals_requests(line: str, row: Command[Any, Any], value: Any) -> None:
    assert text(row, value) == line + "\r"
    assert row.request.decode(line[len(row.name) :].encode()) == value


def test_every_command_of_the_manual_has_its_example() -> None:
    of_the_manual = {row for row in c.ALL if row.section not in {"pymycobot", "G-code programs"}} - {c.MOVE_BY}
    assert {row for _, row, _ in MANUAL} == of_the_manual


@pytest.mark.parametrize(("line", "row", "value"), RETURNS, ids=lambda each: each if isinstance(each, str) else "")
def test_the_manuals_returns(line: str, row: Command[Any, Any], value: Any) -> None:
    assert row.reply.decode(line.encode()) == value


def test_the_manuals_return_of_homing_is_a_receipt() -> None:
    assert c.HOME.reply.decode(b"DATA: [ok]\r\nQUEUE SIZE[0]\r\nCOORDS[0,0,0,0]") == Receipt(0, "DATA: [ok]")


# What the vendor's library sends, and makes of answers.


def move(kind: Any, numbers: list[float], speed: float) -> Any:
    """A motion from a list, as the vendor's library has it."""
    return kind(*numbers, f=speed)


def servo_value(servo: int, address: int, value: int, width: int) -> c.ServoValue:
    return c.ServoValue(servo, address, value, c.RegisterMode(width))


def mode(args: list[Any]) -> Row:
    return (c.RELATIVE if args[0] else c.ABSOLUTE), None


MEANING: dict[str, Callable[[list[Any]], Row]] = {
    "release_all_servos": lambda _: (c.RELEASE, None),
    "power_on": lambda _: (c.POWER_ON, None),
    "go_zero": lambda _: (c.HOME, None),
    "sleep": lambda args: (c.WAIT, c.Dwell(*args)),
    "set_init_pose": lambda args: (c.SET_POSITION, c.Position(*args[0])),
    "set_coords": lambda args: (c.MOVE_COORDS, move(c.CoordsMove, *args)),
    "set_coord": lambda args: (c.MOVE_COORDS, c.CoordsMove(**{args[0].lower(): args[1]}, f=args[2])),
    "set_mode": mode,
    "set_speed_mode": lambda args: (c.SET_SPEED_MODE, c.ModeOfSpeed(c.SpeedMode(args[0]))),
    "set_gpio_state": lambda args: ((c.PUMP_ON if args[0] else c.PUMP_OFF), None),  # M23 and M22, whatever they do
    "set_gripper_zero": lambda args: (c.SET_GRIPPER_ZERO, c.GripperZero(c.GripperType(args[0]))),
    "set_gripper_release": lambda _: (c.RELEASE_GRIPPER, None),
    "get_gripper_position": lambda args: (c.GET_GRIPPER_POSITION, c.ModeOfGripper(c.GripperMode(args[0]))),
    "calibrate_joint": lambda _: (c.CALIBRATE_J1, None),
    "get_calibrate_step": lambda _: (c.GET_CALIBRATION_STEP, None),
    "set_fan_state": lambda args: ((c.FAN_ON if args[0] else c.FAN_OFF), None),
    "set_angle": lambda args: (c.MOVE_JOINT, c.JointMove(*args)),
    "set_angles": lambda args: (c.MOVE_JOINTS, move(c.JointsMove, *args)),
    "set_jog_angle": lambda args: (c.JOG_JOINT, c.JogMove(args[0], c.JogDirection(args[1]), args[2])),
    "set_jog_coord": lambda args: (c.JOG_COORD, c.JogMove(args[0], c.JogDirection(args[1]), args[2])),
    "is_moving_end": lambda _: (c.GET_STATUS, None),
    "sync": lambda _: (c.GET_STATUS, None),
    "get_gripper_angle": lambda args: (c.GET_GRIPPER_ANGLE, c.ModeOfGripper(c.GripperMode(args[0]))),
    "set_system_value": lambda args: (
        c.SET_SERVO_REGISTER,
        servo_value(*args),
    ),
    "get_system_value": lambda args: (c.GET_SERVO_REGISTER, c.ServoRegister(*args[:2], *map(c.RegisterMode, args[2:]))),
    "get_system_version": lambda _: (c.GET_SYSTEM_VERSION, None),
    "set_pwm": lambda args: (c.SET_PWM, c.PWM(*args)),
    "get_coords_info": lambda _: (c.GET_COORDS, None),
}

ROUNDED = {
    "G0 X0.30000000000000004 Y0 Z1e-07 F50": "G0 X0.3 Y0 Z0 F50",
}
"""The vendor's library writes what Python prints. In our lines numbers are rounded to two decimals (its binary protocol
truncates, so that 0.29 degrees become 0.28 there), and 1e-07, which the arm would read as Z1 E-07, never happens."""


@pytest.mark.parametrize("vector", VECTORS, ids=lambda each: f"{each['cls']}.{each['call']}{each['args']}")
def test_the_vendors_library_sends_the_same(vector: dict[str, Any]) -> None:
    row, value = MEANING[vector["call"]](vector["args"])
    own, *rest = vector["tx_text"].split("\r")
    assert bare(text(row, value)) == bare(ROUNDED.get(own, own)) + "\r"
    if rest == ["M120", ""]:
        assert bytes(request(row, value)).endswith(b"\rM120\rM114\r")


@pytest.mark.parametrize(
    "vector",
    [each for each in VECTORS if each["rx_text"] and each["returned"] is not None],
    ids=lambda each: each["call"],
)
def test_the_vendors_library_reads_the_same(vector: dict[str, Any]) -> None:
    row, _ = MEANING[vector["call"]](vector["args"])
    closed = vector["rx_text"]
    if row is c.GET_STATUS:
        closed += "QUEUE SIZE[3]\r\nDATA : ENDSTOP[1 ,1 ,1]\r\n"

    if row is not c.GET_COORDS:
        closed += "DATA : COORDS[204.00,0.00,120.00,0.00]\r\n"

    (frame,) = Parser().feed(closed.encode())
    value, returned = row.reply.decode(frame.params), vector["returned"]
    if isinstance(value, Status):
        assert value.at_rest == bool(returned)
    elif isinstance(value, Receipt):
        assert value.queue_size == 0
        assert returned == 1
    elif isinstance(value, (int, float)):
        assert value == float(returned)
    else:
        assert [getattr(value, name) for name in value.__slots__] == returned


# Numbers.


@given(st.floats(-9999, 9999))
def test_a_number_is_fixed_point_and_as_near_as_two_decimals_go(value: float) -> None:
    written = number(value)
    assert set(written) <= set("-0123456789.")
    assert abs(float(written) - value) <= 0.005 + 1e-9
    assert not written.startswith("-0") or float(written) < 0
    assert not written.endswith(".")


@pytest.mark.parametrize(
    ("value", "written"),
    [(200, "200"), (200.5, "200.5"), (-10.25, "-10.25"), (1e-7, "0"), (-1e-7, "0"), (0.1 + 0.2, "0.3"), (0.29, "0.29")],
)
def test_numbers(value: float, written: str) -> None:
    assert number(value) == written


@pytest.mark.parametrize("value", [1e20, -1e20, math.inf, math.nan, 10**400, 1e5])
def test_what_no_arm_can_reach_is_refused(value: float) -> None:
    with pytest.raises(ValueError, match="x must be in"):
        c.MOVE_COORDS.request.encode(c.CoordsMove(x=value))


@pytest.mark.parametrize("value", ["200", None, 1j])
def test_what_is_no_number_is_refused(value: Any) -> None:
    with pytest.raises(TypeError):
        c.MOVE_JOINT.request.encode(c.JointMove(1, value))


@pytest.mark.parametrize(
    ("row", "value"),
    [
        (c.MOVE_COORDS, c.CoordsMove(x=200, f=0)),
        (c.MOVE_COORDS, c.CoordsMove(x=200, f=201)),
        (c.MOVE_JOINT, c.JointMove(5, 0)),
        (c.JOG_JOINT, c.JogMove(4, c.JogDirection.POSITIVE)),
        (c.SET_PWM, c.PWM(256)),
        (c.SET_GRIPPER, c.GripperSet(101, 200)),
        (c.WAIT, c.Dwell(-1)),
    ],
)
def test_ranges(row: Command[Any, Any], value: Any) -> None:
    with pytest.raises(ValueError, match="must be in"):
        row.request.encode(value)


@pytest.mark.parametrize(("seconds", "sent"), [(0.5, "S0"), (1.0, "S1"), (2.99, "S2"), (65535, "S65535")])
def test_of_a_wait_whole_seconds_alone_are_sent(seconds: float, sent: str) -> None:
    assert text(c.WAIT, c.Dwell(seconds)) == f"G4 {sent}\r"
    with pytest.raises(ProtocolError, match="whole"):
        c.WAIT.request.decode(b"S0.5")


def test_a_value_of_another_command_is_refused() -> None:
    value: Any = c.Dwell(1)
    with pytest.raises(TypeError, match="CoordsMove"):
        c.MOVE_COORDS.request.encode(value)


# Requests, as the simulator and the manual's habits need them.


@pytest.mark.parametrize("line", ["M25A50F200", "m25 a50 f200", " M 25 A 50 F 200 ", "M25 F200 A50"])
def test_blanks_case_and_order_count_for_nothing(line: str) -> None:
    inside = bare(line).removeprefix("M25")
    assert c.SET_GRIPPER.request.decode(inside.encode()) == c.GripperSet(50, 200)


@pytest.mark.parametrize("inside", [b"A50", b"A50F200Q1", b"A50F200,", b"A5.5F200", b"A-F200", b"A50F200M9"])
def test_words_that_mean_nothing(inside: bytes) -> None:
    with pytest.raises(ProtocolError):
        c.SET_GRIPPER.request.decode(inside)


AXIS = st.none() | st.floats(-300, 300).map(lambda each: round(each, 2))


@given(AXIS, AXIS, AXIS, AXIS, st.none() | st.integers(1, 200))
def test_words_come_back(x: float | None, y: float | None, z: float | None, e: float | None, f: float | None) -> None:
    value = c.CoordsMove(x, y, z, e, f)
    assert c.MOVE_COORDS.request.decode(c.MOVE_COORDS.request.encode(value)) == value
    assert c.MOVE_BY.request.decode(c.MOVE_BY.request.encode(value)) == value


def test_a_relative_motion_is_one_write_of_three_lines() -> None:
    assert bytes(request(c.MOVE_BY, c.CoordsMove(z=5, f=50))) == b"G91\rG0 Z5 F50\rG90\rM120\rM114\r"


def test_rows_have_the_words_that_they_send() -> None:
    assert len(c.BY_WORD) == len(c.ALL) - 1
    for row in c.ALL:
        assert row.name[0] in "GM"
        assert row.id == c.code(row.name)
        assert isinstance(row.request, Words) or not hasattr(row.request, "fields")


# Answers.

END = b"DATA : COORDS[204.00,0.00,120.00,0.00]\r\n"
SWITCHES = b"DATA : ENDSTOP[1 ,1 ,1]\r\n"
OF_ANSWERS: list[Answered] = [
    (b"ok\r\nQUEUE SIZE[3]\r\n", c.MOVE_COORDS, Receipt(3, "ok")),
    (b"QUEUE SIZE[0]\r\n", c.MOVE_COORDS, Receipt(0, "")),
    (b"QUEUE SIZE[1]\r\nQUEUE SIZE[0]\r\n", c.MOVE_COORDS, Receipt(0, "QUEUE SIZE[1]")),
    (b"ok\r\nbusy\r\nQUEUE SIZE[12]\r\n", c.MOVE_COORDS, Receipt(12, "ok busy")),
    (b"Moving end\r\nQUEUE SIZE[0]\r\n" + SWITCHES, c.GET_STATUS, Status(0, at_rest=True)),
    (b"Moving\r\nQUEUE SIZE[7]\r\n" + SWITCHES, c.GET_STATUS, Status(7, at_rest=False, text="Moving")),
    (b"QUEUE SIZE[7]\r\n" + SWITCHES, c.GET_STATUS, Status(7, at_rest=False)),
    (b"DATA: ANGLES[1.00 ,-2.50 ,90.00 ,0.00]\r\n", c.GET_ANGLES, c.UltraArmAngles(1, -2.5, 90, 0)),
    (b"", c.GET_COORDS, c.UltraArmCoords(204, 0, 120, 0)),
    (b"DATA : ENDSTOP[1 ,0 ,1]\r\n", c.GET_ENDSTOPS, c.Endstops(1, 0, 1)),
    (b"GetGripperPosition[100, 20]\r\n", c.GET_GRIPPER_POSITION, c.GripperPosition(100, 20)),
    (b"ReadSYS[32]\r\n", c.GET_SERVO_REGISTER, 32),
    (b"GetSystemVersion[1.2]\r\n", c.GET_SYSTEM_VERSION, 1.2),
    (b"ERROR: COMMAND NOT RECOGNIZED\r\n", c.GET_MODIFY_VERSION, Refusal("COMMAND NOT RECOGNIZED")),
    (b"ERROR: COMMAND NOT RECOGNIZED\r\nQUEUE SIZE[0]\r\n", c.MOVE_COORDS, Refusal("COMMAND NOT RECOGNIZED")),
    (b"ERROR: J1 cal failed\r\n", c.CALIBRATE_J1, Refusal("J1 cal failed")),
]
ANSWERS: list[Answered] = [(text + END, row, value) for text, row, value in OF_ANSWERS]
NOISE = st.binary(max_size=6).map(lambda each: bytes(byte | 0x80 for byte in each))


def only(frames: list[Frame], row: Command[Any, Any]) -> Any:
    (frame,) = frames
    return Answer[Any](row.reply).decode(frame.params)


@pytest.mark.parametrize(("data", "row", "value"), ANSWERS, ids=lambda each: str(each)[:40])
def test_an_answer_cut_at_any_byte_is_the_same(data: bytes, row: Command[Any, Any], value: Any) -> None:
    for cut in range(len(data) + 1):
        parser = Parser()
        assert only(parser.feed(data[:cut]) + parser.feed(data[cut:]), row) == value

    parser = Parser()
    assert only([frame for byte in data for frame in parser.feed(bytes((byte,)))], row) == value


@given(st.sampled_from(ANSWERS), st.data())
def test_blanks_ends_and_noise_change_nothing(answer: Answered, data: st.DataObject) -> None:
    stream, row, value = answer
    if isinstance(value, Receipt) or row is c.GET_STATUS:
        written = stream
    else:
        blank = data.draw(st.sampled_from([b"", b" ", b"  ", b"\t"]))
        written = stream.replace(b"[", blank + b"[" + blank).replace(b",", blank + b"," + blank)

    written = written.replace(b"\r\n", data.draw(st.sampled_from([b"\r\n", b"\n", b"\r"])))
    parser = Parser()
    found: list[Frame] = []
    for byte in written:
        found += parser.feed(data.draw(NOISE) + bytes((byte,)))

    got = only(found, row)
    if isinstance(value, Receipt):
        assert got.text.split() == value.text.split()
        assert got.queue_size == value.queue_size
    else:
        assert got == value


@given(st.lists(st.sampled_from(ANSWERS), max_size=6), st.data())
def test_answers_in_a_row_are_told_apart(answers: list[Answered], data: st.DataObject) -> None:
    stream = b"".join(each[0] for each in answers)
    parser = Parser()
    found: list[Frame] = []
    while stream:
        size = data.draw(st.integers(1, len(stream)))
        found += parser.feed(stream[:size])
        stream = stream[size:]

    assert [Answer[Any](row.reply).decode(frame.params) for frame, (_, row, _) in zip(found, answers, strict=True)] == [
        value for _, _, value in answers
    ]


@given(st.binary(max_size=400), st.lists(st.integers(1, 50), min_size=1))
def test_any_bytes_in_any_pieces_give_the_same_and_keep_little(data: bytes, sizes: list[int]) -> None:
    whole, parser = Parser(), Parser()
    expected = whole.feed(data)
    found, at, turn = [], 0, 0
    while at < len(data):
        size = sizes[turn % len(sizes)]
        found += parser.feed(data[at : at + size])
        at, turn = at + size, turn + 1

    assert found == expected
    for frame in found:
        for row in c.ALL:
            try:
                row.reply.decode(frame.params)
            except ProtocolError:
                continue


def test_what_never_closes_is_given_up() -> None:
    parser = Parser()
    for _ in range(20):
        assert not parser.feed(b"x" * 1000)

    assert len(parser._buffer) == LONGEST
    assert parser.junk_bytes == 20_000 - LONGEST
    assert [frame.params[-9:] for frame in parser.feed(b"COORDS[1]")] == [b"COORDS[1]"]
    assert parser.resync() == []
    parser.feed(b"half")
    parser.reset()
    assert parser.feed(b"COORDS[2]")[0].params == b"COORDS[2]"


@pytest.mark.parametrize(
    "late",
    [
        b"Moving end\r\nQUEUE SIZE[0]",
        b"DATA: ANGLES[0.00 ,0.00 ,0.00 ,0.00]\r\nQUEUE SIZE[0]",
        b"J1CAL[3]\nQUEUE SIZE[0]",
    ],
)
def test_the_answer_to_a_reading_is_no_receipt(late: bytes) -> None:
    with pytest.raises(ProtocolError, match="something else"):
        c.MOVE_COORDS.reply.decode(late)


@pytest.mark.parametrize(
    "wrong", [b"ANGLES[]", b"ANGLES[a,b,c]", b"ANGLES[1,2]", b"ANGLES[1,2,nan,0]", b"ANGLES[1,2,3", b"COORDS[1,2,3,4]"]
)
def test_what_is_no_reading(wrong: bytes) -> None:
    with pytest.raises(ProtocolError):
        c.GET_ANGLES.reply.decode(wrong)


def test_three_angles_will_do_and_the_last_reading_counts() -> None:
    assert c.GET_ANGLES.reply.decode(b"ANGLES[1,2,3]") == c.UltraArmAngles(1, 2, 3, 0)
    assert c.GET_ANGLES.reply.decode(b"ANGLES[1,2,3,4]\r\nANGLES[5,6,7,8]").j1 == 5


def test_what_the_simulator_writes_comes_back() -> None:
    pairs: list[Row] = [
        (c.GET_ANGLES, c.UltraArmAngles(1, 2.5, -3, 0)),
        (c.GET_ENDSTOPS, c.Endstops(1, 0, 1)),
        (c.GET_CALIBRATION_STEP, 12),
        (c.GET_STATUS, Status(2, at_rest=True, text="hm")),
        (c.MOVE_COORDS, Receipt(2, "ok")),
    ]
    for row, value in pairs:
        reply: Any = row.reply
        assert reply.decode(reply.encode(value)) == value
        assert Answer[Any](reply).encode(value) == reply.encode(value)


# Keys: what is asked for, and what is shown.


def values() -> list[Row]:
    """Each row with a value."""
    given = {row: value for _, row, value in MANUAL}
    asked: dict[Command[Any, Any], Any] = {
        c.MOVE_BY: c.CoordsMove(z=5),
        c.MOVE_LINE: c.CoordsMove(z=5),
        c.SET_SPEED_MODE: c.ModeOfSpeed(c.SpeedMode.CONSTANT),
        c.SET_GRIPPER_CLOSE_POSITION: c.GripperClosePosition(c.GripperMode.ADAPTIVE, 20),
        c.GET_GRIPPER_POSITION: c.ModeOfGripper(c.GripperMode.ADAPTIVE),
        c.GET_GRIPPER_ANGLE: c.ModeOfGripper(c.GripperMode.ADAPTIVE),
        c.SET_SERVO_REGISTER: c.ServoValue(7, 56, 1),
        c.GET_SERVO_REGISTER: c.ServoRegister(7, 56),
    }
    return [(row, (given | asked).get(row)) for row in c.ALL]


@pytest.mark.parametrize(
    "quirks",
    [
        UltraArmQuirks(),
        UltraArmQuirks(acknowledge="ok", blanks=False),
        UltraArmQuirks(acknowledge="nothing"),
        UltraArmQuirks(later=False),
    ],
    ids=str,
)
def test_what_the_arm_answers_has_the_key_of_what_it_was_asked(quirks: UltraArmQuirks) -> None:
    arm = SimulatedUltraArm(lambda: 0.0, quirks=quirks)
    session, parser = arm.session(), Parser()
    for frame in [*(request(row, value) for row, value in values()), *BARRIERS, STOP, POLL]:
        (answer,) = parser.feed(session.receive(bytes(frame)))
        if quirks.later or b"M120" not in bytes(frame):
            assert answer.key == frame.key

    assert arm.counters.requests


def test_barriers_are_like_nothing_else() -> None:
    keys = [frame.key for frame in BARRIERS]
    assert keys[:3] == ["M119 M119 M114", "M119 M12 M114", "M12 M119 M114"]
    assert len(set(keys)) == len(keys) == 12
    assert not set(keys) & {request(row, value).key for row, value in values()}
    assert not any("M120" in key for key in keys)


def test_an_answer_that_lost_something_is_nobodys() -> None:
    status = request(c.GET_STATUS, None)
    spoilt = {
        "a reading": b"Moving end\r\nQUE SIZE[0]\r\n" + SWITCHES + END,
        "a bracket": b"Moving end\r\nQUEUE SIZE[0\r\n" + SWITCHES + END,
        "its end": b"Moving end\r\nQUEUE SIZE[0]\r\n" + SWITCHES + b"DATA : COO" + SWITCHES + END,
    }
    known = {frame.key for frame in BARRIERS} | {status.key}
    for data in spoilt.values():
        (frame,) = Parser().feed(data)
        assert frame.key not in known

    (twice,) = Parser().feed(b"QUEUE SIZE[1]\r\nok\r\nQUEUE SIZE[0]\r\n" + END)
    assert twice.key == request(c.MOVE_COORDS, c.CoordsMove(1)).key == "M120 M114"


@given(st.data())
def test_an_answer_without_some_of_its_lines_is_no_receipt(data: st.DataObject) -> None:
    """Whatever a barrier's answer loses, it acknowledges no command."""
    frame = data.draw(st.sampled_from(BARRIERS))
    lines = SimulatedUltraArm(lambda: 0.0).session().receive(bytes(frame)).splitlines(keepends=True)
    left = b"".join(line for line in lines[:-1] if data.draw(st.booleans())) + lines[-1]
    for found in Parser().feed(left):
        assert found.key != request(c.HOME, None).key
        with pytest.raises(ProtocolError):
            c.HOME.reply.decode(found.params)
