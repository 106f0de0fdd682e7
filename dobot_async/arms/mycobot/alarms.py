"""What the error codes of the myCobot family mean, and what to do about each. Numbers in, alarms out.

    ReadNextError (15)         a code for each joint, then the Atom's        manual, "Abnormal Error Detection"
    GetErrorInformation (07)   one code: what was wrong with a motion        later firmware

A code that the tables do not know becomes a placeholder, for newer firmware has more of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

__all__ = ["SERVO_LOSS", "CobotAlarm", "joint_alarms", "motion_alarm"]


@dataclass(frozen=True, slots=True)
class CobotAlarm:
    """Something that keeps an arm of the myCobot family from moving.

    Attributes:
        code: Its number.
        name: Such as "OVER_CURRENT".
        cause: What has happened.
        remedy: What to do about it.
        joint: The joint that it is about, from 1; None if it is about the arm.
        blocks: Whether it keeps the arm from moving.
    """

    code: int
    name: str
    cause: str
    remedy: str
    joint: int | None = None
    blocks: bool = True

    def __str__(self) -> str:
        where = "" if self.joint is None else f"joint {self.joint}: "
        return f"{where}0x{self.code:02X} {self.name}: {self.cause} ({self.remedy})"


RELEASE = "release the emergency stop, then power_on()"
WIRE = "check the cable between the joints and the power supply, then power_on()"
UNLOAD = "take the load or the obstacle away, then clear_alarms() and power_on()"
ELSEWHERE = "give another target, then clear_alarms()"

JOINT_CODES: Sequence[tuple[range, str, str, str]] = (
    (range(1, 2), "EMERGENCY_STOP", "the emergency stop is pressed", RELEASE),
    (range(16, 23), "COMMUNICATION_LOST", "its servo does not answer", WIRE),
    (range(23, 29), "COMMUNICATION_UNSTABLE", "its servo answers now and then only", WIRE),
    (range(32, 48), "VOLTAGE", "its servo has too low or too high a voltage", "check the power supply"),
    (range(48, 64), "MAGNETIC_ENCODER", "its encoder reads nonsense", "restart the arm; calibrate the servo"),
    (range(64, 80), "OVER_TEMPERATURE", "its servo is too hot", "release the servos and let it cool down"),
    (range(80, 96), "OVER_CURRENT", "its servo takes too much current", UNLOAD),
    (range(96, 112), "OVERLOAD", "its servo carries too much", UNLOAD),
)
"""The codes of a joint; several stand for one thing."""

MOTION_CODES: Sequence[tuple[range, str, str, str]] = (
    (range(1, 8), "JOINT_LIMIT", "a joint would go beyond its limit", ELSEWHERE),
    (range(16, 20), "COLLISION", "the arm would hit itself", ELSEWHERE),
    (range(32, 33), "NO_INVERSE_SOLUTION", "the target is out of reach", ELSEWHERE),
    (range(33, 35), "NO_ADJACENT_SOLUTION", "the straight line leaves the arm's reach", "move by MoveMode.ANGULAR"),
    (range(49, 50), "POWER_FAILURE", "the arm is not powered", "power_on()"),
)
"""The codes of a motion."""

SERVO_LOSS = CobotAlarm(
    0, "SERVO_LOSS", "the Atom cannot read its servos", "check the power supply, then power_on(); restart the arm"
)
"""Not a code: all joints are reported at 180.08 degrees."""


def joint_alarms(codes: Sequence[int], joints: int) -> tuple[CobotAlarm, ...]:
    """Return the alarms of all joints; a code beyond the joints is the Atom's, which keeps no arm from moving."""
    return tuple(
        lookup(JOINT_CODES, code, place if place <= joints else None, blocks=place <= joints)
        for place, code in enumerate(codes, 1)
        if code
    )


def motion_alarm(code: int) -> tuple[CobotAlarm, ...]:
    """Return what was wrong with the last motion, if anything was."""
    if not code:
        return ()

    joint = code if code in MOTION_CODES[0][0] else None
    return (lookup(MOTION_CODES, code, joint, blocks=True),)


def lookup(table: Sequence[tuple[range, str, str, str]], code: int, joint: int | None, *, blocks: bool) -> CobotAlarm:
    """The alarm of a code; a placeholder if the code is not in the table."""
    for codes, name, cause, remedy in table:
        if code in codes:
            return CobotAlarm(code, name, cause, remedy, joint, blocks)

    return CobotAlarm(
        code, f"UNKNOWN_0x{code:02X}", "not in the vendor's list", "clear_alarms(); restart the arm", joint, blocks
    )
