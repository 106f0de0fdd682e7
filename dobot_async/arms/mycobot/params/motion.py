"""The parameters of motions, jogs and encoders, and what is told of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from dobot_async.arms.mycobot.layouts import Fixed, Many
from dobot_async.arms.mycobot.params.fields import (
    Direction,
    MoveMode,
    Position,
    angle,
    angles,
    coords,
    percent,
    servo,
    u16s,
)

__all__ = [
    "CoordMove",
    "CoordStep",
    "Coords",
    "InPosition",
    "JogAxis",
    "JogJoint",
    "JogRotation",
    "JointMove",
    "JointsAndCoords",
    "JointsMove",
    "SetEncoder",
    "SetEncoders",
    "SetEncodersDrag",
    "SetSolutionAngle",
    "ToMove",
]


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
