"""Parameters of the Magician's commands, 2.9: the end effector; see the package."""

from __future__ import annotations

from dataclasses import dataclass

from dobot_async._core.protocol.wire import f32, flag

__all__ = ["EndEffectorGripper", "EndEffectorLaser", "EndEffectorParams", "EndEffectorSuctionCup"]


@dataclass(frozen=True, slots=True)
class EndEffectorParams:
    """The tool's offset from the flange, mm; 59.7 forward is a suction cup or gripper, 61 a pen, 70 a laser. 2.9.1."""

    x_bias: f32
    y_bias: f32 = 0.0
    z_bias: f32 = 0.0


@dataclass(frozen=True, slots=True)
class EndEffectorLaser:
    """The laser; it burns only when both are set. 2.9.2."""

    is_ctrl_enabled: flag
    is_on: flag


@dataclass(frozen=True, slots=True)
class EndEffectorSuctionCup:
    """The air pump and its valve: control runs the pump, not sucked vents the cup. 2.9.3."""

    is_ctrl_enabled: flag
    is_sucked: flag


@dataclass(frozen=True, slots=True)
class EndEffectorGripper:
    """The air pump and the gripper: control runs the pump, gripped is closed. 2.9.4."""

    is_ctrl_enabled: flag
    is_gripped: flag
