from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dobot_async.arms.magician.alarms import ALARMS, IGNORED, Alarm, decode, encode, faults, lookup

HARDWARE = bytes.fromhex("00000000040000002000000000000000")


def codes(alarms: tuple[Alarm, ...]) -> list[int]:
    return [alarm.code for alarm in alarms]


def test_bits_of_a_real_arm() -> None:
    alarms = decode(HARDWARE)
    assert [(alarm.code, alarm.name) for alarm in alarms] == [(0x22, "MOVE_INV_LIMIT"), (0x45, "LIMIT_AXIS3_NEG")]
    assert encode([0x45, 0x22]) == HARDWARE


@given(st.sets(st.integers(0, 0x7F)))
def test_every_set_of_bits_survives(wanted: set[int]) -> None:
    assert codes(decode(encode(wanted))) == sorted(wanted)


@given(st.binary(max_size=40))
def test_any_bytes_decode(bits: bytes) -> None:
    alarms = decode(bits)
    assert len(alarms) == int.from_bytes(bits, "little").bit_count()
    assert all(bits[alarm.code // 8] >> alarm.code % 8 & 1 for alarm in alarms)


def test_unknown_bit_is_a_placeholder() -> None:
    (alarm,) = decode(encode([0x5A]))
    assert 0x5A not in ALARMS
    assert alarm.code == 0x5A
    assert str(alarm).startswith("0x5A UNKNOWN_0x5A: not in the vendor's list")


@pytest.mark.parametrize("code", [-1, 0x80, 0xB0])
def test_a_code_without_a_bit_is_refused(code: int) -> None:
    with pytest.raises(ValueError, match="0 to 0x7F"):
        encode([code])


def test_reset_is_no_fault() -> None:
    alarms = decode(encode([0x00, 0x01, 0x11]))
    assert codes(faults(alarms)) == [0x11]
    assert codes(faults(alarms, ignored=IGNORED - {0x01})) == [0x01, 0x11]
    assert faults(decode(encode([0x00]))) == ()


def test_an_alarm_says_what_to_do() -> None:
    assert str(lookup(0x11)) == (
        "0x11 PLAN_INV_CALC: target out of the workspace (give another target, then clear the alarms)"
    )


def test_table_is_whole() -> None:
    documented = {
        *range(5),
        *range(0x10, 0x1C),
        *range(0x20, 0x23),
        *range(0x30, 0x34),
        *range(0x40, 0x4A),
        *range(0x50, 0x54),
        *range(0x60, 0x6D),
        *(first + number for first in (0x70, 0x80, 0x90, 0xA0) for number in range(15)),
        *range(0xB0, 0xB3),
    }
    assert set(ALARMS) == documented
    assert all(alarm.code == code for code, alarm in ALARMS.items())
    assert len({alarm.name for alarm in ALARMS.values()}) == len(ALARMS)
    assert all(alarm.cause and alarm.remedy for alarm in ALARMS.values())


@pytest.mark.parametrize(
    ("code", "name"),
    [
        (0x30, "OVERSPEED_AXIS1"),
        (0x40, "LIMIT_AXIS1_POS"),
        (0x47, "LIMIT_AXIS4_NEG"),
        (0x49, "LIMIT_AXIS23_NEG"),
        (0x53, "LOSE_STEP_AXIS4"),
        (0x60, "OTHER_AXIS1_DRV_ALARM"),
        (0x6B, "OTHER_AXIS4_FOLLOW"),
        (0x6C, "OTHER_INVALIDPARAM"),
        (0x7E, "MOTOR_REAR_CAN_BROKE"),
    ],
)
def test_rows_that_are_computed(code: int, name: str) -> None:
    assert lookup(code).name == name
