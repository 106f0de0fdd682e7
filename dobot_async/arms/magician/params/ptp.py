"""Parameters of the Magician's commands, 2.11: PTP; see the package."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Annotated

from dobot_async._core.protocol.layouts import Counted
from dobot_async._core.protocol.wire import Record, Scalar, f32, f32x4, u8
from dobot_async.arms.magician.frame import MAX_PARAMS
from dobot_async.arms.magician.params.io import Level

__all__ = [
    "PTPCmd",
    "PTPCommonParams",
    "PTPCoordinateParams",
    "PTPJointParams",
    "PTPJump2Params",
    "PTPJumpParams",
    "PTPLParams",
    "PTPMode",
    "PTPPOCmd",
    "PTPPOWithLCmd",
    "PTPWithLCmd",
    "ParallelOutputCmd",
]


class PTPMode(IntEnum):
    """How the four numbers of a PTP command are meant, and which way the tool takes there. 2.11.5.

    XYZ: coordinates. ANGLE: joint angles. INC: increments, of joint angles with MOVJ_INC, else of coordinates.
    MOVJ moves the joints, MOVL moves the tool along a straight line, JUMP lifts the tool, travels as MOVJ does (as MOVL
    does with JUMP_MOVL_XYZ) and lowers it.
    """

    JUMP_XYZ = 0
    MOVJ_XYZ = 1
    MOVL_XYZ = 2
    JUMP_ANGLE = 3
    MOVJ_ANGLE = 4
    MOVL_ANGLE = 5
    MOVJ_INC = 6
    MOVL_INC = 7
    MOVJ_XYZ_INC = 8
    JUMP_MOVL_XYZ = 9


@dataclass(frozen=True, slots=True)
class PTPJointParams:
    """PTP velocities and accelerations of the four joints, degrees/s and degrees/s². 2.11.1."""

    velocity: f32x4
    acceleration: f32x4


@dataclass(frozen=True, slots=True)
class PTPCoordinateParams:
    """PTP velocities and accelerations of the tool: xyz in mm/s and mm/s², r in degrees/s and degrees/s². 2.11.2."""

    xyz_velocity: f32
    r_velocity: f32
    xyz_acceleration: f32
    r_acceleration: f32


@dataclass(frozen=True, slots=True)
class PTPJumpParams:
    """How far a jump lifts, and the z (mm) that it never exceeds; to start or end above that z is an alarm. 2.11.3."""

    jump_height: f32
    z_limit: f32


@dataclass(frozen=True, slots=True)
class PTPCommonParams:
    """Percent of the PTP velocities and accelerations that are used; the arm takes more than 100 as 100. 2.11.4."""

    velocity_ratio: f32
    acceleration_ratio: f32


@dataclass(frozen=True, slots=True)
class PTPCmd:
    """Moves to a point: mm and degrees, or four joint angles, as the mode says. 2.11.5."""

    ptp_mode: Annotated[PTPMode, Scalar("B")]
    x: f32
    y: f32
    z: f32
    r: f32 = 0.0


@dataclass(frozen=True, slots=True)
class PTPLParams:
    """PTP velocity and acceleration of the rail, mm/s and mm/s². V1.1."""

    velocity: f32
    acceleration: f32


@dataclass(frozen=True, slots=True)
class PTPWithLCmd:
    """Moves to a point (as `PTPCmd`) while the rail moves to `rail`, mm. V1.1."""

    ptp_mode: Annotated[PTPMode, Scalar("B")]
    x: f32
    y: f32
    z: f32
    r: f32
    rail: f32


@dataclass(frozen=True, slots=True)
class PTPJump2Params:
    """As `PTPJumpParams`, with a lift of its own at either end, mm. V1.1."""

    start_jump_height: f32
    end_jump_height: f32
    z_limit: f32


@dataclass(frozen=True, slots=True)
class ParallelOutputCmd:
    """An output that switches on the way: after `ratio` percent of it, address 1 to 20, level 0 or 1. V1.1."""

    ratio: u8
    address: Annotated[int, Scalar("H", 1, 20)]
    level: Level


@dataclass(frozen=True, slots=True)
class PTPPOCmd:
    """As `PTPCmd`, with outputs that switch on the way. V1.1."""

    ptp_mode: Annotated[PTPMode, Scalar("B")]
    x: f32
    y: f32
    z: f32
    r: f32
    outputs: Annotated[tuple[ParallelOutputCmd, ...], Counted(Record(ParallelOutputCmd), (MAX_PARAMS - 18) // 4)]


@dataclass(frozen=True, slots=True)
class PTPPOWithLCmd:
    """As `PTPWithLCmd`, with outputs that switch on the way. V1.1."""

    ptp_mode: Annotated[PTPMode, Scalar("B")]
    x: f32
    y: f32
    z: f32
    r: f32
    rail: f32
    outputs: Annotated[tuple[ParallelOutputCmd, ...], Counted(Record(ParallelOutputCmd), (MAX_PARAMS - 22) // 4)]
