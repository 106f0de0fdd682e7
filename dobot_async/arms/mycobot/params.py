"""The parameters of the myCobot family's commands: what goes into a request, and what a reply gives back.

Lengths are mm, angles degrees, speeds 1 to 100 percent; what is otherwise says so. Joints and servos count from 1.
A row of one number for each joint has as many as the model has joints. docs/mycobot.md lists where the manual is wrong.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Annotated

from dobot_async.arms.mycobot.layouts import Fixed, Many

__all__ = [
    "RGB",
    "CoordMove",
    "CoordStep",
    "Coords",
    "Direction",
    "EndType",
    "GripperState",
    "GripperType",
    "InPosition",
    "JogAxis",
    "JogJoint",
    "JogRotation",
    "JointAngle",
    "JointLimit",
    "JointMove",
    "JointsAndCoords",
    "JointsMove",
    "MoveMode",
    "PWMOutput",
    "PinLevel",
    "PinMode",
    "PinModeSetting",
    "Position",
    "ReferenceFrame",
    "Release",
    "ServoConnected",
    "ServoData",
    "ServoDataAddress",
    "SetEncoder",
    "SetEncoders",
    "SetEncodersDrag",
    "SetGripperState",
    "SetGripperValue",
    "SetSolutionAngle",
    "ToMove",
    "TransponderMode",
    "angle",
    "angles",
    "byte",
    "coords",
    "flag",
    "i16s",
    "octets",
    "percent",
    "servo",
    "servo_or_all",
    "tenths",
    "u16",
    "u16s",
    "volts",
]

byte = Annotated[int, Fixed("B")]
flag = Annotated[bool, Fixed("B", low=0, high=1)]
u16 = Annotated[int, Fixed("H")]
octets = Annotated[tuple[int, ...], Fixed("B", count=Many.JOINTS)]
u16s = Annotated[tuple[int, ...], Fixed("H", count=Many.JOINTS)]
i16s = Annotated[tuple[int, ...], Fixed("h", count=Many.JOINTS)]
angle = Annotated[float, Fixed("h", (100,))]
angles = Annotated[tuple[float, ...], Fixed("h", (100,), count=Many.JOINTS)]
coords = Annotated[tuple[float, ...], Fixed("h", (10, 10, 10, 100), count=Many.COORDS)]
tenths = Annotated[float, Fixed("B", (10,))]
volts = Annotated[tuple[float, ...], Fixed("B", (10,), count=Many.JOINTS)]
limit = Annotated[float, Fixed("h", (10,))]
percent = Annotated[int, Fixed("B", low=1, high=100)]
share = Annotated[int, Fixed("B", low=0, high=100)]
servo = Annotated[int, Fixed("B", low=1, high=8)]
servo_or_all = Annotated[int, Fixed("B", low=0, high=8)]


class Direction(IntEnum):
    """Which way to jog."""

    DOWN = 0
    UP = 1


class MoveMode(IntEnum):
    """How the tool gets to a point."""

    ANGULAR = 0
    LINEAR = 1


class Position(IntEnum):
    """What the numbers of a position are."""

    ANGLES = 0
    COORDS = 1


class ReferenceFrame(IntEnum):
    """In which frame coordinates are."""

    BASE = 0
    WORLD = 1


class EndType(IntEnum):
    """Of what coordinates are."""

    FLANGE = 0
    TOOL = 1


class TransponderMode(IntEnum):
    """What the M5 does with what passes through it: everything, checking all, or checking its settings alone."""

    OFF = 0
    CHECK_ALL = 1
    CHECK_SETTINGS = 2


class PinMode(IntEnum):
    """What a pin of the Atom is used for."""

    INPUT = 0
    OUTPUT = 1
    INPUT_PULLUP = 2


class GripperState(IntEnum):
    """What the gripper does."""

    OPEN = 0
    CLOSED = 1
    RELEASED = 0xFE


class GripperType(IntEnum):
    """Which gripper it is."""

    ADAPTIVE = 1
    FIVE_FINGERED = 2
    PARALLEL = 3
    FLEXIBLE = 4


@dataclass(frozen=True, slots=True)
class Coords:
    """Where the tool is, mm, and how it is turned, degrees about x, y and z; a 4-axis arm turns about z, in `rx`."""

    x: float
    y: float
    z: float
    rx: float = 0.0
    ry: float = 0.0
    rz: float = 0.0


@dataclass(frozen=True, slots=True)
class JointsAndCoords:
    """Angles and coordinates at one moment."""

    angles: angles
    coords: coords


@dataclass(frozen=True, slots=True)
class JointMove:
    """Move one joint to an angle, or by it."""

    joint: servo
    angle: angle
    speed: percent = 50


@dataclass(frozen=True, slots=True)
class JointsMove:
    """Move all joints to angles."""

    angles: angles
    speed: percent = 50


@dataclass(frozen=True, slots=True)
class CoordMove:
    """Move the tool along one axis (1 to 6: x, y, z, rx, ry, rz) to a coordinate; the others stay as they are."""

    axis: Annotated[int, Fixed("B", low=1, high=6)]
    value: Annotated[float, Fixed("h", (10,))]
    speed: percent = 50


@dataclass(frozen=True, slots=True)
class CoordStep:
    """Move the tool along one axis (1 to 6) by mm or degrees."""

    axis: Annotated[int, Fixed("B", low=1, high=6)]
    value: Annotated[float, Fixed("h", (10,))]
    speed: percent = 50


@dataclass(frozen=True, slots=True)
class ToMove:
    """Move the tool to a point; without a mode the arm's movement type decides."""

    coords: coords
    speed: percent = 50
    mode: Annotated[MoveMode | None, Fixed("B", optional=True)] = None


@dataclass(frozen=True, slots=True)
class InPosition:
    """Asks whether the arm is at these angles or coordinates."""

    values: tuple[float, ...]
    position: Position = Position.ANGLES


@dataclass(frozen=True, slots=True)
class SetSolutionAngle:
    """Turn the elbow of a 7-joint arm about the line from shoulder to wrist, and leaves the tool where it is."""

    angle: angle
    speed: percent = 50


@dataclass(frozen=True, slots=True)
class JogJoint:
    """Turn a joint until it is told to stop."""

    joint: servo
    direction: Annotated[Direction, Fixed("B")]
    speed: percent = 50


@dataclass(frozen=True, slots=True)
class JogAxis:
    """Move the tool along an axis (1 to 6) until it is told to stop."""

    axis: Annotated[int, Fixed("B", low=1, high=6)]
    direction: Annotated[Direction, Fixed("B")]
    speed: percent = 50


@dataclass(frozen=True, slots=True)
class JogRotation:
    """Turn the tool about x, y or z (1 to 3) until it is told to stop."""

    axis: Annotated[int, Fixed("B", low=1, high=3)]
    direction: Annotated[Direction, Fixed("B")]
    speed: percent = 50


@dataclass(frozen=True, slots=True)
class SetEncoder:
    """Move one servo (7 and 8: the gripper) to a position of 0 to 4096."""

    joint: servo
    encoder: Annotated[int, Fixed("H", low=0, high=4096)]
    speed: percent = 50


@dataclass(frozen=True, slots=True)
class SetEncoders:
    """Move all servos to positions of 0 to 4096."""

    encoders: Annotated[tuple[int, ...], Fixed("H", low=0, high=4096, count=Many.JOINTS)]
    speed: percent = 50


@dataclass(frozen=True, slots=True)
class SetEncodersDrag:
    """Move all servos to positions of 0 to 4096, each at a speed in steps/s."""

    encoders: Annotated[tuple[int, ...], Fixed("H", low=0, high=4096, count=Many.JOINTS)]
    speeds: u16s


@dataclass(frozen=True, slots=True)
class JointAngle:
    """A joint, and the least or greatest angle that it may have."""

    joint: byte
    angle: limit


@dataclass(frozen=True, slots=True)
class JointLimit:
    """Set the least or greatest angle that a joint may have."""

    joint: servo
    angle: limit


@dataclass(frozen=True, slots=True)
class ServoConnected:
    """Whether a servo answers the Atom."""

    joint: byte
    connected: flag


@dataclass(frozen=True, slots=True)
class ServoDataAddress:
    """A register of a servo; mode 1 reads two bytes."""

    joint: servo
    address: byte
    mode: Annotated[int | None, Fixed("B", low=0, high=1, optional=True)] = None


@dataclass(frozen=True, slots=True)
class ServoData:
    """Writes a register of a servo: one byte, or two if it is `wide`."""

    joint: int
    address: int
    value: int
    wide: bool = False


@dataclass(frozen=True, slots=True)
class Release:
    """Let a servo go; damped, unless `undamped` is 1."""

    joint: servo
    undamped: Annotated[int | None, Fixed("B", low=0, high=1, optional=True)] = None


@dataclass(frozen=True, slots=True)
class PinModeSetting:
    """What a pin of the Atom is used for."""

    pin: byte
    mode: Annotated[PinMode, Fixed("B")]


@dataclass(frozen=True, slots=True)
class PinLevel:
    """A pin and its level."""

    pin: byte
    level: Annotated[int, Fixed("B", low=0, high=1)]


@dataclass(frozen=True, slots=True)
class PWMOutput:
    """A pin of the Atom, a frequency in Hz, and a duty cycle of 0 to 256 parts, as a byte."""

    pin: byte
    frequency: u16
    duty_cycle: byte


@dataclass(frozen=True, slots=True)
class SetGripperState:
    """Open, closes or releases the gripper."""

    state: Annotated[GripperState, Fixed("B")]
    speed: percent = 50
    kind: Annotated[GripperType | None, Fixed("B", optional=True)] = None


@dataclass(frozen=True, slots=True)
class SetGripperValue:
    """Open the gripper to 0 (closed) to 100 (open) percent."""

    value: share
    speed: percent = 50
    kind: Annotated[GripperType | None, Fixed("B", optional=True)] = None


@dataclass(frozen=True, slots=True)
class RGB:
    """A colour, 0 to 255 each."""

    red: byte
    green: byte
    blue: byte
