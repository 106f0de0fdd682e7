"""Every row of the table in both directions, against the sizes and the frames that real arms send and take."""

from __future__ import annotations

import re
from dataclasses import replace
from enum import IntEnum
from typing import Any, cast

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from quick_suite import examples

from dobot_async._core.protocol.layouts import NOTHING, Bytes, Count, Counted, Lenient, Text
from dobot_async._core.protocol.wire import Command, Field, Layout, Number, Queueing, Record
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician import params
from dobot_async.arms.magician.frame import MAX_PARAMS, Frame, Parser, encode, request
from dobot_async.errors import ProtocolError

Row = Command[Any, Any]
every_row = pytest.mark.parametrize("row", c.ALL, ids=lambda row: row.name)

# Bytes of parameters: of what a write sends, and of what a read gets back.
WRITES = {
    3: 2, 11: 9, 20: 0, 21: 0, 30: 16, 31: 4, 32: 5, 40: 1, 41: 1, 50: 1, 60: 12, 61: 2, 62: 2, 63: 2, 70: 32, 71: 32,
    72: 8, 73: 2, 74: 8, 80: 32, 81: 16, 82: 8, 83: 8, 84: 17, 85: 8, 86: 21, 87: 12, 90: 13, 91: 17, 92: 17, 93: 1,
    94: 8, 100: 16, 101: 32, 102: 36, 103: 8, 110: 4, 120: 5, 130: 2, 131: 2, 132: 9, 135: 6, 136: 10, 137: 3, 138: 3,
    140: 8, 141: 8, 142: 4, 150: 1, 153: 5, 154: 4, 155: 4, 156: 4, 170: 4, 171: 0, 182: 1, 240: 0, 241: 0, 242: 0,
    243: 8, 244: 0, 245: 0,
}  # fmt: skip
READS = {
    3: 1, 4: 4, 5: 12, 6: 16, 10: 32, 12: 8, 13: 4, 20: 16, 30: 16, 32: 4, 40: 1, 41: 1, 42: 1, 50: 1, 60: 12, 61: 2,
    62: 2, 63: 2, 70: 32, 71: 32, 72: 8, 74: 8, 80: 32, 81: 16, 82: 8, 83: 8, 85: 8, 87: 12, 90: 13, 93: 1, 94: 8,
    100: 16, 103: 8, 130: 2, 131: 2, 132: 9, 133: 2, 134: 3, 137: 3, 138: 1, 140: 8, 141: 8, 142: 4, 150: 1, 153: 5,
    154: 4, 155: 4, 156: 4, 157: 1, 181: 1, 182: 1, 220: 32, 221: 4, 246: 8, 247: 4, 248: 1,
}  # fmt: skip
ASKS = {130: 1, 131: 1, 132: 1, 133: 1, 134: 1, 138: 1, 221: 17}
VARIABLE = {(0, True), (0, False), (1, True), (1, False), (2, False), (88, True), (89, True)} | {
    (number, write) for number in (151, 152) for write in (True, False)
}

# What the manual has, by chapter 2.3 to 2.19.
SET_AND_GET = {
    0,
    1,
    30,
    40,
    41,
    50,
    *range(60, 64),
    70,
    71,
    72,
    *range(80, 84),
    90,
    100,
    130,
    131,
    132,
    140,
    *range(150, 157),
}
SET_ONLY = {11, 20, 21, 31, 73, 84, 91, 92, 101, 110, 120, 135, *range(240, 246)}
GET_ONLY = {2, 10, 20, 42, 133, 134, 157, 246, 247}

MOVES = {31, 32, 73, 84, 86, 88, 89, 91, 92, 101, 102, 171}
ALWAYS_QUEUED = (MOVES - {73}) | {110, 120, 136}
ALLOWED = {3, 30, 50, *range(60, 64), *range(70, 75), *range(80, 84), 85, 87, 90, 94, 100, 103, *range(130, 133), 135}
ALLOWED |= {137, 138}  # since V1.1.5


def constant(name: str) -> str:
    """The constant of a name of the manual: SetPTPJointParams -> SET_PTP_JOINT_PARAMS."""
    words = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])|(?<=[a-z])(?=\d+$)", "_", name)
    return re.sub(r"WIFI(?=[A-Z])", "WIFI_", words.upper())


def of_field(field: Field) -> st.SearchStrategy[Any]:
    """Values that fit a field, and are the same after the trip."""
    scalar = field.scalar
    single: st.SearchStrategy[Any]
    if scalar.code == "f":
        single = st.floats(scalar.low, scalar.high, width=32)
    elif field.kind:
        single = st.sampled_from(members(field.kind))
    else:
        single = st.integers(int(scalar.low), int(scalar.high))

    return single if scalar.count == 1 else st.tuples(*[single] * scalar.count)


def members(kind: type[bool | IntEnum]) -> list[int]:
    """All values of a flag or an enum."""
    return [*kind] if issubclass(kind, IntEnum) else [False, True]


def values(layout: Layout[Any] | Field) -> st.SearchStrategy[Any]:
    """Values of a layout."""
    match layout:
        case Field():
            return of_field(layout)
        case Lenient():
            return values(layout.layout)
        case Number():
            return of_field(layout.field)
        case Record():
            parts = {name: values(field) for name, field in layout.fields.items()}
            if layout.tail:
                parts[layout.tail_name] = values(layout.tail)

            return st.builds(layout.kind, **parts)
        case Counted():
            return st.lists(values(layout.record), max_size=layout.limit).map(tuple)
        case Count():
            return st.integers(0, 2**32 - 1)
        case Text():
            letters = st.characters(min_codepoint=1, max_codepoint=255, codec=layout.encoding)
            return st.text(letters, max_size=layout.limit // 2)
        case Bytes():
            return st.binary(min_size=layout.size or 0, max_size=layout.size or 20)

    assert layout is NOTHING
    return st.none()


@every_row
@given(data=st.data())
@settings(max_examples=examples(15))
def test_row_round_trip(row: Row, data: st.DataObject) -> None:
    for layout in (row.request, row.reply):
        value = data.draw(values(layout))
        params = layout.encode(value)

        assert layout.decode(params) == value
        assert len(params) <= MAX_PARAMS
        assert Parser().feed(encode(Frame(row.id, row.write, params))) == [Frame(row.id, row.write, params)]


@every_row
@given(data=st.data())
@settings(max_examples=examples(5))
def test_row_has_the_size_of_the_wire(row: Row, data: st.DataObject) -> None:
    key = row.id, row.write
    if key in VARIABLE:
        return

    out, back = (WRITES[row.id], 0) if row.write else (ASKS.get(row.id, 0), READS[row.id])
    assert len(row.request.encode(data.draw(values(row.request)))) == out
    assert len(row.reply.encode(data.draw(values(row.reply)))) == back


@every_row
@given(data=st.data())
@settings(max_examples=examples(30))
def test_arbitrary_bytes_are_a_value_or_a_protocol_error(row: Row, data: st.DataObject) -> None:
    size = (WRITES if row.write else READS).get(row.id, 20)
    params = data.draw(st.binary(max_size=MAX_PARAMS) | st.binary(min_size=size, max_size=size))
    for layout in (row.request, row.reply):
        try:
            value = layout.decode(params)
        except ProtocolError:
            continue

        assert type(value) is type(layout.decode(params))


@every_row
@given(data=st.data())
@settings(max_examples=examples(10))
def test_bad_fields_are_refused_before_bytes_exist(row: Row, data: st.DataObject) -> None:
    layout = row.request.layout if isinstance(row.request, Lenient) else row.request
    if not isinstance(layout, Record):
        return

    good = data.draw(values(layout))
    for name, field in layout.fields.items():
        for bad in bad_values(field):
            with pytest.raises((ValueError, TypeError)):
                row.request.encode(replace(good, **{name: bad}))


def bad_values(field: Field | Record[Any]) -> list[Any]:
    """What must not be sent in a field."""
    if isinstance(field, Record):
        return [None, 0, (1, 2, 3, 4)]

    scalar = field.scalar
    if scalar.code == "f":
        single = [float("nan"), float("inf"), -float("inf"), 1e39, -1e39, 10**400, "1", None, 1j]
        single += [bound * 1.01 + sign for bound, sign in ((scalar.low, -1), (scalar.high, 1)) if abs(bound) < 1e38]
    else:
        single = [scalar.low - 1, scalar.high + 1, 10**400, 0.5, "1", None]
        single += [number for number in range(256) if field.kind and number not in members(field.kind)]

    return single if scalar.count == 1 else [(each,) * scalar.count for each in single] + [(1,) * (scalar.count + 1), 1]


@every_row
def test_values_of_another_kind_are_refused(row: Row) -> None:
    for other in (object(), params.Kinematics(1, 1), [1]):
        with pytest.raises((TypeError, ValueError)):
            row.request.encode(other)

    if row.request is not NOTHING:
        with pytest.raises(TypeError):
            row.request.encode(None)


@every_row
def test_constant_is_the_name_of_the_manual(row: Row) -> None:
    assert getattr(c, constant(row.name)) is row
    assert re.fullmatch(r"2\.\d+\.\d|V1\.1(\.[45])?", row.section)
    assert row.name.startswith(("Set", "Reset", "Clear") if row.write else "Get")


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("SetPTPJointParams", "SET_PTP_JOINT_PARAMS"),
        ("GetHHTTrigMode", "GET_HHT_TRIG_MODE"),
        ("SetQueuedCmdForceStopExec", "SET_QUEUED_CMD_FORCE_STOP_EXEC"),
        ("SetIODO", "SET_IODO"),
        ("SetWAITCmd", "SET_WAIT_CMD"),
        ("SetEMotor", "SET_E_MOTOR"),
        ("GetWIFISSID", "GET_WIFI_SSID"),
        ("SetHOMECmd", "SET_HOME_CMD"),
        ("SetPTPWithLCmd", "SET_PTP_WITH_L_CMD"),
    ],
)
def test_names_become_constants(name: str, expected: str) -> None:
    assert constant(name) == expected
    assert expected in vars(c)


def test_all_is_the_table_in_its_order_without_duplicates() -> None:
    keys = [(row.id, row.write) for row in c.ALL]

    assert len(set(keys)) == len(keys) == len(c.BY_KEY) == len({row.name for row in c.ALL})
    assert {constant(row.name) for row in c.ALL} == {name for name, row in vars(c).items() if isinstance(row, Command)}
    assert all(c.BY_KEY[row.id, row.write] is row for row in c.ALL)
    assert [number for number, _ in keys if number < 160] == sorted(number for number, _ in keys if number < 160)
    with pytest.raises(TypeError):
        cast("Any", c.BY_KEY)[0, True] = c.GET_POSE


def test_the_whole_manual_is_there() -> None:
    manual = {(row.id, row.write) for row in c.ALL if row.section.startswith("2.")}

    assert {number for number, write in manual if write} == SET_AND_GET | SET_ONLY
    assert {number for number, write in manual if not write} == SET_AND_GET | GET_ONLY
    for number in SET_AND_GET:
        setter, getter = c.BY_KEY[number, True], c.BY_KEY[number, False]
        assert setter.name.removeprefix("Set") == getter.name.removeprefix("Get")
        assert setter.section == getter.section


def test_the_sizes_cover_the_table() -> None:
    sized = {(number, True) for number in WRITES} | {(number, False) for number in READS}

    assert sized | VARIABLE == set(c.BY_KEY)


def test_firmware_switches_are_not_there() -> None:
    assert not {160, 161} & {row.id for row in c.ALL}


@every_row
def test_row_says_when_it_may_be_queued_and_repeated(row: Row) -> None:
    expected = Queueing.NEVER
    if row.write and row.id in ALLOWED:
        expected = Queueing.ALLOWED
    elif row.write and row.id in ALWAYS_QUEUED:
        expected = Queueing.ALWAYS

    assert row.queueing is expected
    assert row.moves is (row.write and row.id in MOVES)
    assert row.repeatable is not (row.queueing is Queueing.ALWAYS or row is c.SET_QUEUED_CMD_START_DOWNLOAD)
    assert (row.reply is NOTHING) is row.write
    assert 0 < row.timeout <= 3


@pytest.mark.parametrize("row", [row for row in c.ALL if row.echo], ids=lambda row: row.name)
def test_echo_is_a_field_of_the_reply(row: Row) -> None:
    reply = row.reply.decode(bytes((7,)) + bytes(READS[row.id] - 1))

    assert getattr(reply, row.echo or "") == 7 == row.request.decode(row.request.encode(7))


def test_every_read_of_a_pin_has_its_echo() -> None:
    assert {row.id for row in c.ALL if row.echo} == {130, 131, 132, 133, 134}


@pytest.mark.parametrize(
    ("row", "value", "queued", "frame"),
    [
        (c.GET_POSE, None, False, "AA AA 02 0A 00 F6"),
        (c.SET_PTP_CMD, c.PTPCmd(c.PTPMode.MOVJ_XYZ, 250, 0, 0), True, f"AA AA 13 54 03 01 00 00 7A 43 {'00' * 12} EB"),
        (c.SET_E_MOTOR, c.EMotor(0, is_enabled=True, speed=-10000), True, "AA AA 08 87 03 00 01 F0 D8 FF FF AF"),
        (c.SET_DEVICE_WITH_L, c.DeviceWithL(is_with_l=True), False, "AA AA 04 03 01 01 00 FB"),
        (c.GET_JOGL_PARAMS, None, False, "AA AA 02 4A 00 B6"),
        (c.GET_DEVICE_NAME, None, False, "AA AA 02 01 00 FF"),
        (c.SET_DEVICE_NAME, "Hello", False, "AA AA 08 01 01 48 65 6C 6C 6F 00 0A"),
    ],
    ids=lambda value: value.name if isinstance(value, Command) else "",
)
def test_requests_that_real_arms_took(row: Row, value: Any, queued: bool, frame: str) -> None:
    sent = request(row, row.request.encode(value), queued=queued)

    assert bytes(sent) == bytes.fromhex(frame)
    assert Parser().feed(bytes.fromhex(frame)) == [sent]
    assert c.BY_KEY[sent.id, sent.write].request.decode(sent.params) == value


def test_reply_to_a_write_is_empty() -> None:
    [reply] = Parser().feed(bytes.fromhex("AA AA 02 03 01 FC"))

    assert (reply.id, reply.queued) == (3, False)
    c.SET_DEVICE_WITH_L.reply.decode(reply.params)


def test_queued_without_write_is_answered_with_an_index() -> None:
    [sent] = Parser().feed(bytes.fromhex("AA AA 04 03 02 01 00 FA"))
    [reply] = Parser().feed(bytes.fromhex(f"AA AA 0A 03 02 02 {'00' * 7} F9"))

    assert (sent.queued, sent.write) == (True, False)
    assert c.GET_QUEUED_CMD_CURRENT_INDEX.reply.decode(reply.params) == 2


@pytest.mark.parametrize("frame", [f"AA AA 13 54 03 01 00 00 7A 43 {'00' * 12} EA", f"AA AA 0A 03 02 {'00' * 7} F9"])
def test_damaged_frames_are_none(frame: str) -> None:
    parser = Parser()

    assert parser.feed(bytes.fromhex(frame)) + parser.resync() == []


def test_big_endian_numbers_are_valid_frames_with_other_values() -> None:
    [sent] = Parser().feed(bytes.fromhex("AA AA 0A 4A 03 00 00 00 1E 00 00 00 32 63"))

    assert c.SET_JOGL_PARAMS.request.decode(sent.params) != c.JOGLParams(30, 50)
    assert c.SET_JOGL_PARAMS.request.decode(sent.params).velocity < 1e-15


def test_alarms_that_a_real_arm_reported() -> None:
    state = c.GET_ALARMS_STATE.reply.decode(bytes.fromhex("00000000040000002000000000000000"))

    assert [code for code in range(128) if state[code // 8] >> code % 8 & 1] == [0x22, 0x45]


def test_pose_that_a_real_arm_reported() -> None:
    pose = c.Pose(
        x=10.184884071350098,
        y=177.5911865234375,
        z=4.0564422607421875,
        r=86.7176742553711,
        j1=86.7176742553711,
        j2=14.331169128417969,
        j3=59.5638313293457,
        j4=0,
    )

    assert c.GET_POSE.reply.decode(c.GET_POSE.reply.encode(pose)) == pose


def test_version_keeps_what_newer_firmware_adds() -> None:
    short = c.GET_DEVICE_VERSION.reply.decode(bytes((3, 7, 0)))
    long = c.GET_DEVICE_VERSION.reply.decode(bytes(range(14)))

    assert (str(short), short.rest) == ("3.7.0", b"")
    assert (str(long), long.rest[10]) == ("0.1.2", 13)


@pytest.mark.parametrize(
    ("row", "data", "value"),
    [
        (c.SET_HOME_CMD, b"", c.HOMECmd()),
        (c.SET_DEVICE_WITH_L, b"\1", c.DeviceWithL(is_with_l=True)),
        (c.SET_COLOR_SENSOR, b"\1\2", c.ColorSensor(enable=True, port=c.ColorPort.GP4)),
        (c.SET_INFRARED_SENSOR, b"\1\0", c.InfraredSensor(enable=True, port=c.InfraredPort.GP1)),
        (c.GET_IOADC, b"\5\0\0", 5),
    ],
    ids=lambda value: value.name if isinstance(value, Command) else "",
)
def test_requests_of_older_peers_are_understood(row: Row, data: bytes, value: Any) -> None:
    assert row.request.decode(data) == value


def test_outputs_on_the_way_have_their_count() -> None:
    outputs = (c.ParallelOutputCmd(25, 3, 1), c.ParallelOutputCmd(75, 3, 0))
    data = c.SET_PTPPO_CMD.request.encode(c.PTPPOCmd(c.PTPMode.MOVL_XYZ, 200, 0, 40, 0, outputs))

    assert data[17:] == bytes.fromhex("02 19 0300 01 4B 0300 00")
    with pytest.raises(ValueError, match="at most 37"):
        c.SET_PTPPO_CMD.request.encode(c.PTPPOCmd(c.PTPMode.MOVL_XYZ, 200, 0, 40, 0, outputs * 19))


def test_limits_of_wifi_are_in_bytes() -> None:
    for row, limit in ((c.SET_WIFI_SSID, 32), (c.SET_WIFI_PASSWORD, 64), (c.SET_DEVICE_NAME, 166)):
        assert len(row.request.encode("x" * limit)) == limit + 1
        with pytest.raises(ValueError, match=f"at most {limit}"):
            row.request.encode("x" * (limit + 1))


@pytest.mark.parametrize(
    ("row", "value"),
    [
        (c.SET_IODO, c.IODO(0, 1)),
        (c.SET_IODO, c.IODO(21, 1)),
        (c.SET_IODO, c.IODO(1, 2)),
        (c.GET_IODI, 0),
        (c.SET_IOPWM, c.IOPWM(4, 9.9, 50)),
        (c.SET_IOPWM, c.IOPWM(4, 1_000_001, 50)),
        (c.SET_IOPWM, c.IOPWM(4, 1000, 101)),
        (c.SET_CPLE_CMD, c.CPLECmd(c.CPMode.ABSOLUTE, 0, 0, 0, power=100.1)),
        (c.SET_E_MOTOR, c.EMotor(2, is_enabled=True, speed=0)),
        (c.SET_WAIT_CMD, c.WAITCmd(-1)),
        (c.SET_TRIG_CMD, c.TRIGCmd(1, c.TriggerMode.IO, 4, 0)),
        (c.SET_PTP_CMD, c.PTPCmd(c.PTPMode.MOVL_XYZ, 0, float("nan"), 0)),
    ],
    ids=lambda value: value.name if isinstance(value, Command) else repr(value),
)
def test_documented_ranges_are_kept(row: Row, value: Any) -> None:
    with pytest.raises(ValueError, match=r"must be in \S+ to \S+, not"):
        row.request.encode(value)


def test_ratios_above_100_are_the_arms_to_clip() -> None:
    assert c.SET_PTP_COMMON_PARAMS.request.encode(c.PTPCommonParams(150, 150))


def test_parameter_types_stand_beside_the_rows() -> None:
    for name in params.__all__:
        assert getattr(c, name) is getattr(params, name)
