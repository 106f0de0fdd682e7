"""The parameters of servos, limits, pins, grippers and lights, and what is told of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from dobot_async.arms.mycobot.layouts import Fixed
from dobot_async.arms.mycobot.params.fields import (
    GripperState,
    GripperType,
    PinMode,
    byte,
    flag,
    limit,
    percent,
    servo,
    share,
    u16,
)

__all__ = [
    "RGB",
    "JointAngle",
    "JointLimit",
    "PWMOutput",
    "PinLevel",
    "PinModeSetting",
    "Release",
    "ServoConnected",
    "ServoData",
    "ServoDataAddress",
    "SetGripperState",
    "SetGripperValue",
]


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
