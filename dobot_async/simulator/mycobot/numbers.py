"""Which joints, servos and axes a simulated myCobot has: a request that names another one is not answered."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.models import CobotModel

__all__ = ["has"]

OF_JOINTS = frozenset(
    {
        c.SEND_ANGLE,
        c.JOG_ANGLE,
        c.JOG_ABSOLUTE,
        c.JOG_INCREMENT,
        c.GET_JOINT_MIN_ANGLE,
        c.GET_JOINT_MAX_ANGLE,
        c.SET_JOINT_MIN,
        c.SET_JOINT_MAX,
    }
)
"""Rows that name a joint; others that name a servo may name the gripper's."""
SERVO_NUMBERS: Mapping[Command[Any, Any], int | None] = {
    **dict.fromkeys((c.GET_JOINT_MIN_ANGLE, c.GET_JOINT_MAX_ANGLE, c.GET_ENCODER, c.IS_SERVO_ENABLE)),
    **dict.fromkeys((c.SET_SERVO_CALIBRATION, c.JOINT_BRAKE)),
    c.FOCUS_SERVO: 0,
}
"""Rows whose parameter is the number of a servo, and what stands for all of them."""


def has(model: CobotModel, row: Command[Any, Any], value: Any) -> bool:
    """Returns whether the arm has the joint, the servo or the axis that a request names, if it names one."""
    number = value if row in SERVO_NUMBERS else getattr(value, "joint", 1)
    servos = {*range(1, model.joints + 1), *(() if row in OF_JOINTS else (model.gripper,))}
    return (number in servos or number == SERVO_NUMBERS.get(row)) and getattr(value, "axis", 1) <= len(model.reach)
