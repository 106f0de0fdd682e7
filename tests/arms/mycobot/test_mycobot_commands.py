"""The table of commands: each row of each model, there and back, and what it refuses."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mycobot_values import values
from quick_suite import examples

from dobot_async._core.protocol.wire import Command, Queueing
from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.frame import Frame, Parser, encode
from dobot_async.arms.mycobot.layouts import ACK
from dobot_async.arms.mycobot.models import MODELS, CobotModel, lengths, model_of
from dobot_async.errors import ProtocolError

Row = Command[Any, Any]
ROWS = {
    (own.name, own.id, lengths(own.request), lengths(own.reply)): (model, own)
    for model in MODELS.values()
    for own in model.rows.values()
}
"""Each row of each model, once if it is the same on several."""
IDS = [f"{model.name}-{own.name}" for model, own in ROWS.values()]
OF_MANUAL = {
    *range(0x10, 0x17),
    0x1A,
    0x1B,
    *range(0x20, 0x2C),
    0x2E,
    0x2F,
    *range(0x30, 0x35),
    *range(0x3A, 0x3F),
    *(0x40, 0x41, 0x44, 0x45),
    *range(0x4A, 0x4E),
    *range(0x50, 0x58),
    *(0x60, 0x61, 0x62, 0x64, 0x65, 0x66, 0x67, 0x68, 0x69, 0x70),
    *range(0x81, 0x8B),
    *(0xA0, 0xA1, 0xB0, 0xB1),
    *(0xE1, 0xE3, 0xE4, 0xE5),
}


@pytest.mark.parametrize(("model", "row"), ROWS.values(), ids=IDS)
@settings(max_examples=examples(10))
@given(data=st.data())
def test_there_and_back(model: CobotModel, row: Row, data: st.DataObject) -> None:
    for layout in (row.request, row.reply):
        value = data.draw(values(layout))
        params = layout.encode(value)
        assert layout.decode(params) == value
        assert len(params) in lengths(layout)
        frame = Frame(row.id, params)
        assert Parser(model.known).feed(encode(frame)) == [frame]


@pytest.mark.parametrize(("model", "row"), ROWS.values(), ids=IDS)
@settings(max_examples=examples(10))
@given(params=st.binary(max_size=30))
def test_any_bytes_are_a_value_or_a_protocol_error(model: CobotModel, row: Row, params: bytes) -> None:
    for layout in (row.request, row.reply):
        try:
            value = layout.decode(params)
        except ProtocolError:
            continue

        assert layout is ACK or len(params) in lengths(layout)
        assert value is None or layout is not ACK


def test_the_table_is_the_manuals() -> None:
    ids = {row.id for row in MODELS["myarm300"].rows.values()}
    assert ids >= OF_MANUAL
    later = {row.id for row in MODELS["myarm300"].rows if row.section == "later"}
    assert ids - OF_MANUAL == later


def test_an_id_means_one_thing_on_a_model() -> None:
    for model in MODELS.values():
        assert len(model.by_id) == len(model.rows)
        assert len({row.name for row in model.rows}) == len(model.rows)


def test_where_models_differ() -> None:
    myarm, cobot, palletizer = MODELS["myarm300"], MODELS["mycobot280"], MODELS["mypalletizer260"]
    assert (myarm.row(c.SET_COLOR).id, cobot.row(c.SET_COLOR).id) == (0x70, 0x6A)
    assert (myarm.row(c.GET_TRANSPONDER_MODE).id, myarm.row(c.SET_TRANSPONDER_MODE).id) == (0xB0, 0xB1)
    for model in MODELS.values():
        if model is not myarm:
            assert (model.row(c.GET_TRANSPONDER_MODE).id, model.row(c.SET_TRANSPONDER_MODE).id) == (0xC3, 0xC2)
            assert 0xB0 not in model.known  # it would set the Wi-Fi
            assert 0xB1 not in model.known

    assert [model.joints for model in MODELS.values()] == [7, 6, 6, 6, 6, 4]
    position = c.InPosition((1, 2, 3, 4, 5, 6), c.Position.COORDS)
    assert myarm.row(c.IS_IN_POSITION).request.encode(position)[0] == 1
    assert cobot.row(c.IS_IN_POSITION).request.encode(position)[-1] == 1
    assert len(palletizer.row(c.GET_COORDS).reply.encode((1, 2, 3, 4))) == 8
    assert palletizer.row(c.JOG_STOP).id == cobot.row(c.JOG_INCREMENT_COORD).id


def test_a_model_lacks_what_it_does_not_have() -> None:
    with pytest.raises(ValueError, match="a myCobot 280 has no SetSolutionAngles"):
        MODELS["mycobot280"].row(c.SET_SOLUTION_ANGLES)

    with pytest.raises(ValueError, match="there are: mycobot, myarm300, mycobot280"):
        model_of("mycobot380")


def test_motions_are_never_repeatable_and_reads_always_are() -> None:
    for row in c.ALL:
        assert row.write or row.repeatable
        if row.queueing is Queueing.ALWAYS:
            assert row.moves
            assert not row.repeatable


def test_what_is_set_can_be_read_back_in_the_same_words() -> None:
    for model in MODELS.values():
        for row, read in c.CONFIRMED_BY.items():
            assert lengths(model.row(row).request) == lengths(model.row(read).reply)


REFUSED: list[tuple[Row, Any, str]] = [
    (c.SEND_ANGLES, c.JointsMove((0,) * 5, 50), "angles must have 6 values for this arm, not 5"),
    (c.SEND_ANGLES, c.JointsMove((0,) * 6, 0), "speed must be in 1 to 100"),
    (c.SEND_ANGLES, c.JointsMove((0,) * 6, 101), "speed must be in 1 to 100"),
    (c.SEND_ANGLES, c.JointsMove((float("nan"), 0, 0, 0, 0, 0)), "angles must be in"),
    (c.SEND_ANGLE, c.JointMove(1, 400.0), "does not fit"),
    (c.SEND_ANGLE, c.JointMove(9, 0), "joint must be in 1 to 8"),
    (c.SEND_COORD, c.CoordMove(7, 0), "axis must be in 1 to 6"),
    (c.SET_ENCODER, c.SetEncoder(1, 4097), "encoder must be in 0 to 4096"),
    (c.SET_GRIPPER_VALUE, c.SetGripperValue(101), "value must be in 0 to 100"),
    (c.SET_PIN_MODE, c.PinModeSetting(1, 3), "not a valid PinMode"),  # type: ignore[arg-type]
    (c.SET_SERVO_DATA, c.ServoData(1, 21, 256), "256"),
    (c.SET_SERVO_DATA, c.ServoData(9, 21, 1), "joint must be in 1 to 8"),
    (c.SET_REFERENCE_FRAME, 2, "not a valid ReferenceFrame"),
]


@pytest.mark.parametrize(("command", "value", "message"), REFUSED, ids=[f"{a.name}-{m}" for a, _, m in REFUSED])
def test_what_does_not_fit_is_refused(command: Row, value: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        MODELS["mycobot280"].row(command).request.encode(value)


@pytest.mark.parametrize(
    ("command", "value"),
    [
        (c.SEND_ANGLES, (0, 0, 0, 0, 0, 0)),
        (c.POWER_ON, 1),
        (c.SET_SERVO_DATA, 1),
        (c.IS_IN_POSITION, 1),
        (c.GET_ENCODER, 1.5),
        (c.SET_JOINT_MIN, c.JointLimit(1, "x")),  # type: ignore[arg-type]
    ],
)
def test_what_is_of_the_wrong_kind_is_a_type_error(command: Row, value: Any) -> None:
    with pytest.raises(TypeError):
        MODELS["mycobot280"].row(command).request.encode(value)


def test_a_flag_is_0_or_1() -> None:
    for byte in (2, 0xFF):
        with pytest.raises(ProtocolError):
            MODELS["mycobot280"].row(c.IS_MOVING).reply.decode(bytes((byte,)))
