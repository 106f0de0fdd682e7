"""What ends everything that a Magician does: its motion, a jog, the laser, the steppers."""

from __future__ import annotations

from typing import Any

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.magician import commands as c

__all__ = ["LEAVING", "STILL", "TOOLS"]

STILL = c.JOGCmd(is_joint=False, cmd=c.JOGKey.IDLE)
"""No key of the teach pendant is down."""

TOOLS: tuple[tuple[Command[Any, None], Any], ...] = (
    (c.SET_END_EFFECTOR_LASER, c.EndEffectorLaser(is_ctrl_enabled=False, is_on=False)),
    (c.SET_E_MOTOR, c.EMotor(0, is_enabled=False, speed=0)),
    (c.SET_E_MOTOR, c.EMotor(1, is_enabled=False, speed=0)),
)
"""What a stop switches off beside the arm: nothing burns or turns after it. The pump stays, so that nothing drops."""

LEAVING: tuple[tuple[Command[Any, None], Any], ...] = (
    (c.SET_QUEUED_CMD_FORCE_STOP_EXEC, None),
    (c.SET_QUEUED_CMD_CLEAR, None),
    (c.SET_JOG_CMD, STILL),
    *TOOLS,
)
"""All that ends what the arm does, the stop first."""
