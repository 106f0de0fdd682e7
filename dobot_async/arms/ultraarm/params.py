"""The parameters of the ultraArm's commands, and what its readings tell.

Lengths are mm, angles degrees, times seconds. The ranges here are the widest that any source names; those of the arm at
hand are `UltraArmLimits`. `f` is what the manual calls mm/s; for joints nobody says what it is in degrees.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Annotated

from dobot_async.arms.ultraarm.layouts import Letter

__all__ = [
    "PWM",
    "CoordsMove",
    "Dwell",
    "Endstops",
    "GripperClosePosition",
    "GripperMode",
    "GripperPosition",
    "GripperSet",
    "GripperType",
    "GripperZero",
    "JogDirection",
    "JogMove",
    "JointMove",
    "JointsMove",
    "ModeOfGripper",
    "ModeOfSpeed",
    "Position",
    "RegisterMode",
    "ServoRegister",
    "ServoValue",
    "Speed",
    "SpeedMode",
    "UltraArmAngles",
    "UltraArmCoords",
    "UltraArmPose",
]

Speed = Annotated[float, Letter("F", 1, 200)]
X = Annotated[float, Letter("X")] | None
Y = Annotated[float, Letter("Y")] | None
Z = Annotated[float, Letter("Z")] | None
E = Annotated[float, Letter("E")] | None


class JogDirection(IntEnum):
    """Which way a jog goes."""

    POSITIVE = 0
    NEGATIVE = 1


class SpeedMode(IntEnum):
    """How the arm runs through a series of motions."""

    CONSTANT = 0
    RAMPED = 2


class GripperType(IntEnum):
    """Which gripper is on the arm."""

    ELECTRIC = 1
    FORCE = 2


class GripperMode(IntEnum):
    """How the force gripper grips."""

    ADAPTIVE = 1
    FLEXIBLE = 2
    PARALLEL = 3


class RegisterMode(IntEnum):
    """How wide a servo's register is."""

    BYTE = 1
    WORD = 2


@dataclass(frozen=True, slots=True)
class CoordsMove:
    """A point to move to; an axis that is None stays. Manual 5, coordinate control."""

    x: X = None
    y: Y = None
    z: Z = None
    e: E = None
    f: Speed | None = None


@dataclass(frozen=True, slots=True)
class Position:
    """What the arm is to take its position for; an axis that is None stays. Manual 5, set point."""

    x: X = None
    y: Y = None
    z: Z = None
    e: E = None


@dataclass(frozen=True, slots=True)
class JointMove:
    """One joint to move. Manual 5, single joint angle control."""

    joint: Annotated[int, Letter("J", 1, 4, whole=True)]
    angle: Annotated[float, Letter("A")]
    f: Speed | None = None


@dataclass(frozen=True, slots=True)
class JointsMove:
    """UltraArmAngles to move to; the fourth is there if something is mounted on it. Manual 5, all angle control."""

    j1: Annotated[float, Letter("X")]
    j2: Annotated[float, Letter("Y")]
    j3: Annotated[float, Letter("Z")]
    j4: E = None
    f: Speed | None = None


@dataclass(frozen=True, slots=True)
class JogMove:
    """A joint, or x, y, z as 1, 2, 3, that is to move on until it is stopped. Manual 5, jog."""

    axis: Annotated[int, Letter("J", 1, 3, whole=True)]
    direction: Annotated[JogDirection, Letter("D", 0, 1, whole=True)]
    f: Speed | None = None


@dataclass(frozen=True, slots=True)
class Dwell:
    """Seconds to wait. The arm knows whole ones; the driver waits the rest itself. Manual 5, wait."""

    seconds: Annotated[float, Letter("S", 0, 65535)]


@dataclass(frozen=True, slots=True)
class ModeOfSpeed:
    """How the arm runs through a series of motions."""

    mode: Annotated[SpeedMode, Letter("S", 0, 2, whole=True)]


@dataclass(frozen=True, slots=True)
class ModeOfGripper:
    """Which mode of the force gripper is asked about; None for another gripper, of which M50 alone tells."""

    mode: Annotated[GripperMode, Letter("T", 1, 3, whole=True)] | None = None


@dataclass(frozen=True, slots=True)
class PWM:
    """The duty cycle of the laser's output, 0 to 255. Manual 5, set PWM duty cycle."""

    duty: Annotated[int, Letter("P", 0, 255, whole=True)]


@dataclass(frozen=True, slots=True)
class GripperZero:
    """Which gripper is to take its position for zero; None is the manual's form. Manual 5, gripper calibration."""

    gripper: Annotated[GripperType, Letter("M", 1, 2, whole=True)] | None = None


@dataclass(frozen=True, slots=True)
class GripperSet:
    """How far the gripper is to open, 0 to 100, and how fast. Manual 5, set gripper open state.

    `gripper` and `mode` are of later firmware; None is the manual's form.
    """

    opening: Annotated[int, Letter("A", 0, 100, whole=True)]
    speed: Annotated[int, Letter("F", 0, 1500, whole=True)]
    gripper: Annotated[GripperType, Letter("M", 1, 2, whole=True)] | None = None
    mode: Annotated[GripperMode, Letter("T", 1, 3, whole=True)] | None = None


@dataclass(frozen=True, slots=True)
class GripperClosePosition:
    """Where the force gripper is closed, in steps of its servo."""

    mode: Annotated[GripperMode, Letter("T", 1, 3, whole=True)]
    position: Annotated[int, Letter("L", 1, 2047, whole=True)]


@dataclass(frozen=True, slots=True)
class ServoRegister:
    """A register of servo 4 or 7."""

    servo: Annotated[int, Letter("J", 1, 7, whole=True)]
    address: Annotated[int, Letter("S", 0, 69, whole=True)]
    mode: Annotated[RegisterMode, Letter("P", 1, 2, whole=True)] | None = None


@dataclass(frozen=True, slots=True)
class ServoValue:
    """What to write into a register of servo 4 or 7."""

    servo: Annotated[int, Letter("X", 1, 7, whole=True)]
    address: Annotated[int, Letter("Y", 7, 69, whole=True)]
    value: Annotated[int, Letter("Z", 0, 65535, whole=True)]
    mode: Annotated[RegisterMode, Letter("P", 1, 2, whole=True)] | None = None


@dataclass(frozen=True, slots=True)
class UltraArmAngles:
    """The joints, degrees; `j4` is 0 where nothing is mounted on it."""

    j1: float
    j2: float
    j3: float
    j4: float = 0.0


@dataclass(frozen=True, slots=True)
class UltraArmCoords:
    """Where the tool is, mm, and the fourth joint, degrees."""

    x: float
    y: float
    z: float
    e: float = 0.0


@dataclass(frozen=True, slots=True)
class UltraArmPose:
    """Where the arm is, all of it read at one time; a target of `move_to`.

    Attributes:
        x: mm, forward.
        y: mm, to the left.
        z: mm, up.
        e: Degrees, of what is mounted on the fourth joint; 0 where nothing is.
        joints: The four joints, degrees.
    """

    x: float
    y: float
    z: float
    e: float
    joints: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Endstops:
    """The home switches of the joints, as the arm tells them, 0 or 1: the manual's example has 1 for all of them."""

    j1: int
    j2: int
    j3: int


@dataclass(frozen=True, slots=True)
class GripperPosition:
    """Where the force gripper is, and where it is closed, in steps of its servo."""

    position: int
    closed: int
