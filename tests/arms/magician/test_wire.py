"""Layouts: what they pack, what they refuse, and that both directions agree."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from fractions import Fraction
from typing import Annotated, Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dobot_async._core.protocol.layouts import NOTHING, Bytes, Count, Counted, Lenient, Text
from dobot_async._core.protocol.wire import (
    Command,
    Layout,
    Number,
    Record,
    Scalar,
    f32,
    f32x2,
    flag,
    i32,
    u8,
    u8x4,
    u16,
    u32,
    u64,
)
from dobot_async.errors import ProtocolError

FLOAT32_MAX = 3.4028234663852886e38


class Gear(IntEnum):
    LOW = 1
    HIGH = 4


@dataclass(frozen=True, slots=True)
class Point:
    x: f32
    y: f32


@dataclass(frozen=True, slots=True)
class Line:
    gear: Annotated[Gear, Scalar("B")]
    start: Point
    ends: f32x2
    on: flag


@dataclass(frozen=True, slots=True)
class Path:
    speed: u16
    points: Annotated[tuple[Point, ...], Counted(Record(Point), 2)] = ()


class Index:
    def __index__(self) -> int:
        return 7


POINT, LINE, PATH = Record(Point), Record(Line), Record(Path)


def test_record_lies_packed_and_little_endian() -> None:
    line = Line(Gear.HIGH, Point(1, -2), (0.5, 0), on=True)

    data = LINE.encode(line)

    assert data == bytes.fromhex("04 0000803f 000000c0 0000003f 00000000 01")
    assert LINE.decode(data) == line
    assert type(LINE.decode(data).gear) is Gear
    assert LINE.decode(data).on is True


def test_order_of_bytes_can_be_big_endian() -> None:
    assert Record(Path, ">").encode(Path(0x1234)) == b"\x12\x34\x00"
    assert Number[int](u16, ">").decode(b"\x12\x34") == 0x1234


def test_tail_takes_what_follows() -> None:
    path = Path(1, (Point(0, 0), Point(1, 0)))

    data = PATH.encode(path)

    assert len(data) == 2 + 1 + 2 * 8
    assert PATH.decode(data) == path
    assert PATH.encode(Path(1)) == b"\1\0\0"
    with pytest.raises(ValueError, match="3 of Point; the arm takes at most 2"):
        PATH.encode(Path(1, (Point(0, 0),) * 3))


@pytest.mark.parametrize("data", [b"", b"\1", b"\1\0", b"\1\0\1", b"\1\0\0\0", b"\1\0\1" + bytes(9)])
def test_tail_that_does_not_fit_is_a_protocol_error(data: bytes) -> None:
    with pytest.raises(ProtocolError):
        PATH.decode(data)


@pytest.mark.parametrize("size", [0, 1, 17, 19])
def test_record_of_another_size_is_a_protocol_error(size: int) -> None:
    with pytest.raises(ProtocolError, match=f"expected 18 bytes of parameters, got {size}"):
        LINE.decode(bytes(size))


def test_unknown_member_of_an_enum_is_a_protocol_error() -> None:
    with pytest.raises(ProtocolError, match="2 is not a valid Gear"):
        LINE.decode(b"\2" + bytes(17))


@pytest.mark.parametrize(
    ("change", "error"),
    [
        ({"gear": 2}, "2 is not a valid Gear"),
        ({"gear": 256}, "gear must be in 0 to 255"),
        ({"ends": (1.0,)}, "ends must have 2 values, not 1"),
        ({"ends": (1.0, float("nan"))}, r"ends\[1\] must be in"),
        ({"start": Point(float("inf"), 0)}, "x must be in"),
        ({"on": 2}, "on must be in 0 to 1"),
    ],
)
def test_values_that_do_not_fit_are_named(change: dict[str, Any], error: str) -> None:
    values: dict[str, Any] = {"gear": Gear.LOW, "start": Point(0, 0), "ends": (0, 0), "on": False} | change
    with pytest.raises(ValueError, match=error):
        LINE.encode(Line(**values))


@pytest.mark.parametrize("change", [{"gear": 1.0}, {"ends": 1.0}, {"start": (0, 0)}, {"on": "1"}, {"ends": "12"}])
def test_values_of_another_type_are_type_errors(change: dict[str, Any]) -> None:
    values: dict[str, Any] = {"gear": Gear.LOW, "start": Point(0, 0), "ends": (0, 0), "on": False} | change
    with pytest.raises(TypeError):
        LINE.encode(Line(**values))


def test_record_refuses_another_dataclass() -> None:
    layout: Layout[Any] = POINT
    for value in (None, (0, 0), Path(1)):
        with pytest.raises(TypeError, match="expected Point"):
            layout.encode(value)


def test_annotation_without_a_layout_is_a_mistake_of_the_table() -> None:
    @dataclass
    class Loose:
        x: int

    with pytest.raises(TypeError, match=r"x: .* does not say how it lies on the wire"):
        Record(Loose)


@pytest.mark.parametrize(
    ("annotation", "low", "high"),
    [
        (u8, 0, 255),
        (u16, 0, 65535),
        (u32, 0, 2**32 - 1),
        (u64, 0, 2**64 - 1),
        (i32, -(2**31), 2**31 - 1),
        (flag, 0, 1),
        (Annotated[int, Scalar("B", -5, 999)], 0, 255),
        (Annotated[int, Scalar("b", -5, 5)], -5, 5),
    ],
)
def test_integers_have_the_range_of_their_code(annotation: Any, low: int, high: int) -> None:
    number = Number[int](annotation)
    for value in (low, high):
        assert number.decode(number.encode(value)) == value

    for value in (low - 1, high + 1, 2**70, -(2**70)):
        with pytest.raises(ValueError, match=f"value must be in {low} to {high}, not"):
            number.encode(value)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -float("inf"), 3.5e38, -3.5e38, 10**400])
def test_floats_must_be_finite_in_single_precision(value: float) -> None:
    for annotation in (f32, Annotated[float, Scalar("f", 0)], Annotated[float, Scalar("f")]):
        with pytest.raises(ValueError, match="value must be in"):
            Number[float](annotation).encode(value)


@pytest.mark.parametrize("value", ["1", b"1", None, 1j, [1.0]])
def test_only_numbers_are_numbers(value: Any) -> None:
    for annotation in (f32, u8):
        with pytest.raises(TypeError):
            Number[Any](annotation).encode(value)


def test_what_behaves_as_a_number_is_one() -> None:
    assert Number[Any](u8).encode(Index()) == b"\7"
    assert Number[Any](f32).encode(Fraction(1, 2)) == Number[float](f32).encode(0.5)
    with pytest.raises(TypeError, match=r"value must be a whole number, not 1\.0"):
        Number[Any](u8).encode(1.0)


@given(st.floats(-FLOAT32_MAX, FLOAT32_MAX))
def test_every_finite_float_is_sent(value: float) -> None:
    number = Number[float](f32)

    once = number.decode(number.encode(value))

    assert number.decode(number.encode(once)) == once
    assert once == pytest.approx(value, rel=1e-6, abs=1e-44)


def test_readings_are_not_held_against_the_range() -> None:
    number = Number[int](Annotated[int, Scalar("B", 1, 20)])

    assert number.decode(b"\xff") == 255


def test_row_of_numbers_is_a_tuple() -> None:
    number = Number[tuple[int, ...]](u8x4)

    assert number.encode((192, 168, 1, 20)) == bytes((192, 168, 1, 20))
    assert number.decode(bytes(4)) == (0, 0, 0, 0)
    with pytest.raises(ValueError, match="4 values, not 3"):
        number.encode((1, 2, 3))


@given(st.text(max_size=10))
def test_text_comes_back_or_is_refused(text: str) -> None:
    layout = Text(20)
    try:
        data = layout.encode(text)
    except ValueError:
        assert "\0" in text or len(text.encode()) > 20
    else:
        assert data.endswith(b"\0")
        assert layout.decode(data) == layout.decode(data[:-1]) == layout.decode(data + b"rest") == text


@given(st.binary())
def test_text_reads_any_bytes(data: bytes) -> None:
    for encoding in ("utf-8", "latin-1", "ascii"):
        assert "\0" not in Text(20, encoding).decode(data)


def test_text_limits_are_bytes() -> None:
    assert len(Text(4).encode("éé")) == 5
    for text, error in (("ééé", "6 bytes; the arm takes at most 4"), ("a\0b", "NUL"), ("\ud800", "surrogates")):
        with pytest.raises(ValueError, match=error):
            Text(4).encode(text)

    layout: Layout[Any] = Text(4)
    with pytest.raises(TypeError):
        layout.encode(b"abc")


def test_bytes_have_their_size() -> None:
    assert Bytes(2).encode(b"ab") == Bytes(2).decode(b"ab") == b"ab"
    assert Bytes().encode(b"abc") == Bytes().decode(b"abc") == b"abc"
    with pytest.raises(ValueError, match="expected 2 bytes, not 3"):
        Bytes(2).encode(b"abc")

    with pytest.raises(ProtocolError):
        Bytes(2).decode(b"abc")

    layout: Layout[Any] = Bytes()
    for value in (3, "ab", [1, 2], None):
        with pytest.raises(TypeError):
            layout.encode(value)


def test_nothing_is_none_and_no_bytes() -> None:
    assert NOTHING.encode(None) == b""
    NOTHING.decode(b"")
    with pytest.raises(ProtocolError):
        NOTHING.decode(b"\0")

    layout: Layout[Any] = NOTHING
    with pytest.raises(TypeError):
        layout.encode(0)


def test_count_is_read_in_both_widths() -> None:
    assert Count().encode(32) == Count().encode(32)[:4] == b"\x20\0\0\0"
    assert Count().decode(b"\x20\0\0\0") == Count().decode(b"\x20" + bytes(7)) == 32
    assert Count().decode(b"\xff" * 8) == 2**64 - 1
    for size in (0, 1, 2, 3, 5, 6, 7, 9):
        with pytest.raises(ProtocolError):
            Count().decode(bytes(size))

    with pytest.raises(ValueError, match="value must be in"):
        Count().encode(2**32)


def test_lenient_fills_up_and_cuts_off() -> None:
    layout = Lenient(POINT, least=4)

    assert layout.encode(Point(1, 0)) == POINT.encode(Point(1, 0))
    assert layout.decode(POINT.encode(Point(1, 2))[:4]) == Point(1, 0)
    assert layout.decode(POINT.encode(Point(1, 2)) + b"more") == Point(1, 2)
    with pytest.raises(ProtocolError, match="at least 4"):
        layout.decode(bytes(3))


@given(st.binary(max_size=40))
def test_decoding_raises_protocol_errors_only(data: bytes) -> None:
    layouts: list[Layout[Any]] = [POINT, LINE, PATH, Count(), Lenient(LINE, 0), Text(4), Bytes(4), Bytes(), NOTHING]
    for layout in layouts:
        try:
            layout.decode(data)
        except ProtocolError:
            assert not isinstance(layout, Text)


def test_command_shows_its_name_and_number() -> None:
    assert repr(Command("GetPose", 10, NOTHING, POINT, "2.4.1")) == "<GetPose 10>"
