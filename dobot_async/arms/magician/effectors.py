"""The tools that a Magician comes with, for `arm.set_end_effector`; a tool of one's own is an EndEffectorParams."""

from __future__ import annotations

from dataclasses import dataclass

from dobot_async._core.protocol.wire import f32
from dobot_async.arms.magician.params import EndEffectorParams

__all__ = ["Gripper", "Laser", "Pen", "SuctionCup"]


@dataclass(frozen=True, slots=True)
class SuctionCup(EndEffectorParams):
    """The suction cup: 59.7 mm from the wrist. The reported z is the flange's; the cup's tip is about 59.5 mm lower."""

    x_bias: f32 = 59.7


@dataclass(frozen=True, slots=True)
class Gripper(EndEffectorParams):
    """The pneumatic gripper: 59.7 mm from the wrist."""

    x_bias: f32 = 59.7


@dataclass(frozen=True, slots=True)
class Pen(EndEffectorParams):
    """The pen holder: 61 mm from the wrist."""

    x_bias: f32 = 61.0


@dataclass(frozen=True, slots=True)
class Laser(EndEffectorParams):
    """The laser: 70 mm from the wrist."""

    x_bias: f32 = 70.0
