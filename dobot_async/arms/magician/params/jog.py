"""Parameters of the Magician's commands, 2.10: JOG; see the package."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Annotated

from dobot_async._core.protocol.wire import Scalar, f32, f32x4, flag

__all__ = ["JOGCmd", "JOGCommonParams", "JOGCoordinateParams", "JOGJointParams", "JOGKey", "JOGLParams"]


class JOGKey(IntEnum):
    """Which key of the teach pendant is down: an axis (or joint) and its direction; idle stops. 2.10.4.

    A is x or joint 1, B is y or joint 2, C is z or joint 3, D is r or joint 4, E is the rail (V1.1).
    """

    IDLE = 0
    AP_DOWN = 1
    AN_DOWN = 2
    BP_DOWN = 3
    BN_DOWN = 4
    CP_DOWN = 5
    CN_DOWN = 6
    DP_DOWN = 7
    DN_DOWN = 8
    EP_DOWN = 9
    EN_DOWN = 10


@dataclass(frozen=True, slots=True)
class JOGJointParams:
    """Jog velocities and accelerations of the four joints, degrees/s and degrees/s². 2.10.1."""

    velocity: f32x4
    acceleration: f32x4


@dataclass(frozen=True, slots=True)
class JOGCoordinateParams:
    """Jog velocities and accelerations along x, y, z (mm/s, mm/s²) and r (degrees/s, degrees/s²). 2.10.2."""

    velocity: f32x4
    acceleration: f32x4


@dataclass(frozen=True, slots=True)
class JOGCommonParams:
    """Percent of the jog velocities and accelerations that are used; the arm takes more than 100 as 100. 2.10.3."""

    velocity_ratio: f32
    acceleration_ratio: f32


@dataclass(frozen=True, slots=True)
class JOGCmd:
    """Starts to jog joints or coordinates, or stops (`JOGKey.IDLE`). 2.10.4."""

    is_joint: flag
    cmd: Annotated[JOGKey, Scalar("B")]


@dataclass(frozen=True, slots=True)
class JOGLParams:
    """Jog velocity and acceleration of the rail, mm/s and mm/s². V1.1."""

    velocity: f32
    acceleration: f32
