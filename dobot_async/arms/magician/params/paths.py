"""Parameters of the Magician's commands, 2.12 and 2.13: continuous paths and arcs; see the package."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Annotated

from dobot_async._core.protocol.wire import Scalar, f32, flag, u32

__all__ = [
    "ARCCmd",
    "ARCCommonParams",
    "ARCParams",
    "ARCPoint",
    "CPCmd",
    "CPCommonParams",
    "CPLECmd",
    "CPMode",
    "CPParams",
    "CircleCmd",
]


class CPMode(IntEnum):
    """Whether a point of a continuous path counts from the last one or from the base. 2.12.2."""

    RELATIVE = 0
    ABSOLUTE = 1


@dataclass(frozen=True, slots=True)
class CPParams:
    """Limits of a continuous path, mm/s and mm/s². 2.12.1.

    Attributes:
        plan_acc: The greatest planned acceleration.
        junction_vel: The greatest velocity at a junction.
        acc: The greatest real acceleration; in real time mode it is the period of interpolation instead.
        real_time_track: Real time mode.
    """

    plan_acc: f32
    junction_vel: f32
    acc: f32
    real_time_track: flag = False


@dataclass(frozen=True, slots=True)
class CPCmd:
    """The next point of a continuous path, mm; the velocity is reserved. 2.12.2."""

    cp_mode: Annotated[CPMode, Scalar("B")]
    x: f32
    y: f32
    z: f32
    velocity: f32 = 100.0


@dataclass(frozen=True, slots=True)
class CPLECmd:
    """The next point of a laser engraving, mm, and the laser's power on the way there, 0 to 100 percent. 2.12.3."""

    cp_mode: Annotated[CPMode, Scalar("B")]
    x: f32
    y: f32
    z: f32
    power: Annotated[float, Scalar("f", 0, 100)]


@dataclass(frozen=True, slots=True)
class CPCommonParams:
    """Percent of the CP velocity and acceleration that are used. V1.1."""

    velocity_ratio: f32
    acceleration_ratio: f32


@dataclass(frozen=True, slots=True)
class ARCParams:
    """Velocities and accelerations of an arc: xyz in mm/s and mm/s², r in degrees/s and degrees/s². 2.13.1."""

    xyz_velocity: f32
    r_velocity: f32
    xyz_acceleration: f32
    r_acceleration: f32


@dataclass(frozen=True, slots=True)
class ARCPoint:
    """A point of an arc, mm and degrees. 2.13.2."""

    x: f32
    y: f32
    z: f32
    r: f32 = 0.0


@dataclass(frozen=True, slots=True)
class ARCCmd:
    """An arc from where the arm is, through `cir_point`, to `to_point`. 2.13.2."""

    cir_point: ARCPoint
    to_point: ARCPoint


@dataclass(frozen=True, slots=True)
class CircleCmd:
    """`count` full circles from where the arm is, through both points. V1.1."""

    cir_point: ARCPoint
    to_point: ARCPoint
    count: u32 = 1


@dataclass(frozen=True, slots=True)
class ARCCommonParams:
    """Percent of the ARC velocities and accelerations that are used. V1.1."""

    velocity_ratio: f32
    acceleration_ratio: f32
