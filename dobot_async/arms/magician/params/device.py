"""Parameters of the Magician's commands, 2.3 to 2.8: who and where the arm is, home, teaching; see the package."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Annotated

from dobot_async._core.protocol.layouts import Bytes
from dobot_async._core.protocol.wire import Scalar, f32, flag, u8, u32, u64

__all__ = [
    "AccessoryVersion",
    "ArmOrientation",
    "AutoLevelingCmd",
    "DeviceInfo",
    "DeviceVersion",
    "DeviceWithL",
    "HHTTrigMode",
    "HOMECmd",
    "HOMEParams",
    "Kinematics",
    "Pose",
    "ResetPose",
]


class AccessoryVersion(IntEnum):
    """Which of its two hardware versions an accessory is: rail, colour sensor or infrared sensor."""

    V1 = 0
    V2 = 1


@dataclass(frozen=True, slots=True)
class DeviceVersion:
    """The firmware's version; `rest` is what newer firmware adds, where byte 10 is the hardware version. 2.3.3."""

    major_version: u8
    minor_version: u8
    revision: u8
    rest: Annotated[bytes, Bytes()] = b""

    def __str__(self) -> str:
        return f"{self.major_version}.{self.minor_version}.{self.revision}"


@dataclass(frozen=True, slots=True)
class DeviceWithL:
    """Whether the arm stands on a sliding rail, and which one. V1.1."""

    is_with_l: flag
    version: Annotated[AccessoryVersion, Scalar("B")] = AccessoryVersion.V1


@dataclass(frozen=True, slots=True)
class DeviceInfo:
    """How long the arm has been running in all, and how often it was switched on and off. V1.1.5."""

    run_time: u64
    power_on: u32
    power_off: u32


@dataclass(frozen=True, slots=True)
class Pose:
    """Where the tool is, mm and degrees in the base frame, and the four joint angles. 2.4.1.

    J2 counts from the vertical; J3 counts from the horizontal, downwards, whatever J2 is; r = j1 + j4.
    """

    x: f32
    y: f32
    z: f32
    r: f32
    j1: f32
    j2: f32
    j3: f32
    j4: f32

    @property
    def joints(self) -> tuple[float, float, float, float]:
        """The four joint angles, degrees."""
        return self.j1, self.j2, self.j3, self.j4


@dataclass(frozen=True, slots=True)
class ResetPose:
    """Takes the pose anew: from the angle sensors (`manual` false), or from the two angles given (true). 2.4.2."""

    manual: flag
    rear_arm_angle: f32 = 0.0
    front_arm_angle: f32 = 0.0


@dataclass(frozen=True, slots=True)
class Kinematics:
    """Velocity and acceleration that the arm has now. V1.1."""

    velocity: f32
    acceleration: f32


@dataclass(frozen=True, slots=True)
class HOMEParams:
    """Where the arm stands after homing, mm and degrees. 2.6.1."""

    x: f32
    y: f32
    z: f32
    r: f32 = 0.0


@dataclass(frozen=True, slots=True)
class HOMECmd:
    """Home; the number is reserved. 2.6.2."""

    reserved: u32 = 0


@dataclass(frozen=True, slots=True)
class AutoLevelingCmd:
    """Levels the arm with the levelling tool, to a precision. V1.1."""

    control_flag: flag
    precision: f32


class HHTTrigMode(IntEnum):
    """When a point is recorded while the arm is led by hand. 2.7.1."""

    TRIGGERED_ON_KEY_RELEASED = 0
    TRIGGERED_ON_PERIODIC_INTERVAL = 1


class ArmOrientation(IntEnum):
    """The elbow's side; for SCARA arms only, a Magician may leave the request unanswered. 2.8.1."""

    LEFTY = 0
    RIGHTY = 1
