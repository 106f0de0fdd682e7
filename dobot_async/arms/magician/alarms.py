"""What the Magician's alarm bits mean, and what to do about each. Bytes in, alarms out; asks nothing of an arm.

    16 bytes of GetAlarmsState:   byte 0           byte 1           ...   byte 15           alarm n =
                                  0x07 ... 0x00    0x0F ... 0x08          0x7F ... 0x78     byte n // 8, bit n % 8

The manual (2.5.1) leaves the codes to another document; names are the vendor's. A bit that this table does not know
becomes a placeholder, for newer firmware has more of them and a reading must not fail over one.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

__all__ = ["ALARMS", "IGNORED", "SIZE", "Alarm", "decode", "encode", "faults", "lookup"]

SIZE = 16
"""How many bytes the arm's alarm state has."""

IGNORED = frozenset({0x00, 0x01})
"""Codes that do not keep the arm from moving: every power-up sets 0x00, a command that it does not know 0x01."""


@dataclass(frozen=True, slots=True)
class Alarm:
    """One alarm.

    Attributes:
        code: Its number, which is the number of its bit.
        name: The vendor's name, such as "PLAN_INV_CALC".
        cause: What has happened.
        remedy: What to do about it.
    """

    code: int
    name: str
    cause: str
    remedy: str

    def __str__(self) -> str:
        return f"0x{self.code:02X} {self.name}: {self.cause} ({self.remedy})"


def lookup(code: int) -> Alarm:
    """Returns the alarm of a code; a placeholder if the code is not in the table."""
    return ALARMS.get(code) or Alarm(
        code, f"UNKNOWN_0x{code:02X}", "not in the vendor's list", "clear the alarms; if it comes back, restart the arm"
    )


def decode(bits: bytes) -> tuple[Alarm, ...]:
    """Returns the alarms that are set, lowest code first. Takes any number of bytes; the arm sends 16."""
    return tuple(
        lookup(8 * place + bit) for place, byte in enumerate(bits) if byte for bit in range(8) if byte >> bit & 1
    )


def encode(codes: Iterable[int]) -> bytes:
    """Returns the 16 bytes of a set of codes; raises ValueError for a code outside 0 to 0x7F."""
    bits = 0
    for code in codes:
        if not 0 <= code < 8 * SIZE:
            raise ValueError(f"an alarm code must be in 0 to 0x{8 * SIZE - 1:X} to have a bit, not {code}")

        bits |= 1 << code

    return bits.to_bytes(SIZE, "little")


def faults(alarms: Iterable[Alarm], ignored: Iterable[int] = IGNORED) -> tuple[Alarm, ...]:
    """Returns the alarms that stop motion: all but the ignored codes."""
    harmless = frozenset(ignored)
    return tuple(alarm for alarm in alarms if alarm.code not in harmless)


CLEAR = "clear the alarms"
RESTART = "switch the arm off and on again"
NEW_TARGET = "give another target, then clear the alarms"
NEW_POINTS = "give other points, then clear the alarms"
JOG_OUT = "jog it back; the alarm then clears itself"
SLOWER = "lower the velocity ratio, then clear the alarms"
HOME = "clear the alarms, then home the arm"

COMMON = (
    Alarm(0x00, "COMMON_RESET", "the arm was switched on or reset, which is normal", "nothing to do"),
    Alarm(0x01, "COMMON_UNDEFINED_INSTRUCTION", "the arm got a command that it does not know", CLEAR),
    Alarm(0x02, "COMMON_FILE_SYSTEM", "the arm's flash file system failed at start-up", RESTART),
    Alarm(0x03, "COMMON_MCU_FPGA_COMM", "the arm's processor could not reach its motion chip at start-up", RESTART),
    Alarm(0x04, "COMMON_ANGLE_SENSOR", "an angle sensor of the rear arm or the forearm reads nonsense", RESTART),
)

PLAN = (
    Alarm(0x10, "PLAN_INV_SINGULARITY", "target in a singular position", NEW_TARGET),
    Alarm(0x11, "PLAN_INV_CALC", "target out of the workspace", NEW_TARGET),
    Alarm(0x12, "PLAN_INV_LIMIT", "target beyond the joints' limits", NEW_TARGET),
    Alarm(0x13, "PLAN_PUSH_DATA_REPEAT", "an arc or a straight jump has the same point twice", NEW_POINTS),
    Alarm(0x14, "PLAN_ARC_INPUT_PARAM", "no circle goes through the three points of the arc", NEW_POINTS),
    Alarm(
        0x15,
        "PLAN_JUMP_PARAM",
        "a jump begins or ends above its zLimit, or is to lift by less than 0",
        "raise zLimit or the height, then clear the alarms",
    ),
    Alarm(0x16, "PLAN_LINE_HAND", "a straight line would need the arm's other orientation", NEW_TARGET),
    Alarm(0x17, "PLAN_LINE_OUT_SPACE", "a straight line would leave the workspace", NEW_TARGET),
    Alarm(0x18, "PLAN_ARC_OUT_SPACE", "an arc would leave the workspace", NEW_POINTS),
    Alarm(0x19, "PLAN_MOTIONTYPE", "the arm does not know this type of motion", CLEAR),
    Alarm(
        0x1A, "PLAN_SPEED_INPUT_PARAM", "a velocity or an acceleration is not valid", "set them, then clear the alarms"
    ),
    Alarm(0x1B, "PLAN_CP_CALC", "the continuous path could not be planned", NEW_POINTS),
)

MOVE = (
    Alarm(
        0x20, "MOVE_INV_SINGULARITY", "met a singular position on the way", "move by MOVJ, not MOVL; clear the alarms"
    ),
    Alarm(0x21, "MOVE_INV_CALC", "left the workspace on the way", "give another way, then clear the alarms"),
    Alarm(0x22, "MOVE_INV_LIMIT", "met a joint's limit on the way", "clear the alarms, then move back"),
)

OVERSPEED = tuple(
    Alarm(0x2F + axis, f"OVERSPEED_AXIS{axis}", f"joint {axis} would have to turn too fast", SLOWER)
    for axis in range(1, 5)
)

LIMIT = (
    *(
        Alarm(0x3E + 2 * axis + bit, f"LIMIT_AXIS{axis}_{name}", f"joint {axis} stands at its {word} limit", JOG_OUT)
        for axis in range(1, 5)
        for bit, name, word in ((0, "POS", "upper"), (1, "NEG", "lower"))
    ),
    Alarm(0x48, "LIMIT_AXIS23_POS", "rear arm and forearm are stretched as far as they go", JOG_OUT),
    Alarm(0x49, "LIMIT_AXIS23_NEG", "rear arm and forearm are folded as far as they go", JOG_OUT),
)

LOSE_STEP = tuple(
    Alarm(
        0x4F + axis, f"LOSE_STEP_AXIS{axis}", f"joint {axis} has lost steps: it hit something or carries too much", HOME
    )
    for axis in range(1, 5)
)

OTHER = (
    *(
        Alarm(0x5D + 3 * axis + kind, f"OTHER_AXIS{axis}_{name}", f"motor driver of joint {axis}: {text}", RESTART)
        for axis in range(1, 5)
        for kind, name, text in (
            (0, "DRV_ALARM", "it reports an alarm"),
            (1, "OVERFLOW", "its position counter overflowed"),
            (2, "FOLLOW", "the motor does not follow"),
        )
    ),
    Alarm(0x6C, "OTHER_INVALIDPARAM", "a command carried an invalid parameter", CLEAR),
)

MOTOR_TROUBLES = (
    ("ENCODER", "encoder"),
    ("TEMPERATURE_HIGH", "temperature too high"),
    ("TEMPERATURE_LOW", "temperature too low"),
    ("LOCK_CURRENT", "blocked, current too high"),
    ("BUSV_HIGH", "supply voltage too high"),
    ("BUSV_LOW", "supply voltage too low"),
    ("OVERHEAT", "overheated"),
    ("RUNAWAY", "ran away"),
    ("BATTERY_LOW", "encoder battery low"),
    ("PHASE_SHORT", "phases shorted"),
    ("PHASE_WRONG", "phases in the wrong order"),
    ("LOST_SPEED", "speed lost"),
    ("NOT_STANDARDIZE", "not calibrated"),
    ("ENCODER_NOT_STANDARDIZE", "encoder not calibrated"),
    ("CAN_BROKE", "no answer on its bus"),
)

# The M1's; those above 0x7F have no bit in a Magician's 16 bytes.
M1 = (
    *(
        Alarm(first + kind, f"MOTOR_{motor}_{name}", f"M1's motor {motor}: {text}", RESTART)
        for first, motor in ((0x70, "REAR"), (0x80, "FRONT"), (0x90, "Z"), (0xA0, "R"))
        for kind, (name, text) in enumerate(MOTOR_TROUBLES)
    ),
    *(Alarm(0xB0 + number, f"ENDIO_{number}", "M1's IO board at the tool", RESTART) for number in range(3)),
)

ALARMS: Mapping[int, Alarm] = MappingProxyType(
    {alarm.code: alarm for group in (COMMON, PLAN, MOVE, OVERSPEED, LIMIT, LOSE_STEP, OTHER, M1) for alarm in group}
)
"""All alarms by their codes."""
