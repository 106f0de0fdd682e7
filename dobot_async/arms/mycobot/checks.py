"""Whether a model can do what a command says, whatever its pose: it has the joint, and the target is within limits."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, cast

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.targets import PartOfMove

if TYPE_CHECKING:
    from dobot_async.arms.mycobot.models import CobotModel

__all__ = ["check"]

Check = Callable[["CobotModel", Any], None]


def check(model: CobotModel, command: Command[Any, Any], value: Any) -> None:
    """Raise ValueError for parameters of a command that a model cannot do."""
    found = OF_ROW.get(command) or OF_VALUE.get(cast("type[object]", type(value)))
    if found:
        found(model, value)


def joint(model: CobotModel, value: Any) -> None:
    """It has the joint."""
    model.check_has_joint(value.joint)


def servo(model: CobotModel, value: Any) -> None:
    """It has the servo, of a joint or of the gripper."""
    model.check_servo(value.joint)


def axis(model: CobotModel, value: Any) -> None:
    """It has the axis."""
    model.check_axis(value.axis)


def joint_number(model: CobotModel, value: int) -> None:
    """It has the joint."""
    model.check_has_joint(value)


def servo_number(model: CobotModel, value: int) -> None:
    """It has the servo."""
    model.check_servo(value)


def servo_or_all(model: CobotModel, value: int) -> None:
    """It has the servo; 0 is all."""
    if value:
        model.check_servo(value)


def joint_move(model: CobotModel, value: c.JointMove) -> None:
    """The joint's angle is within its limits."""
    model.check_joint(value.joint, value.angle)


def joints_move(model: CobotModel, value: c.JointsMove) -> None:
    """All angles are."""
    for number, angle in enumerate(value.angles, 1):
        model.check_joint(number, angle)


def coord_move(model: CobotModel, value: c.CoordMove) -> None:
    """The coordinate is within reach."""
    model.check_coord(value.axis, value.value)


def to_move(model: CobotModel, value: c.ToMove) -> None:
    """All coordinates are."""
    for number, coord in enumerate(value.coords, 1):
        model.check_coord(number, coord)


def part_of_move(model: CobotModel, value: PartOfMove) -> None:
    """What is given is; what comes of steps is looked at when it is known where they begin."""
    for number, coord in enumerate(() if value.relative else value.coords, 1):
        if coord is not None:
            model.check_coord(number, coord)


OF_ROW: Mapping[Command[Any, Any], Check] = {
    c.JOG_INCREMENT: joint,
    c.GET_JOINT_MIN_ANGLE: joint_number,
    c.GET_JOINT_MAX_ANGLE: joint_number,
    c.GET_ENCODER: servo_number,
    c.IS_SERVO_ENABLE: servo_number,
    c.SET_SERVO_CALIBRATION: servo_number,
    c.JOINT_BRAKE: servo_number,
    c.FOCUS_SERVO: servo_or_all,
}
"""What the row alone tells."""

OF_VALUE: Mapping[type, Check] = {
    c.SetEncoder: servo,
    c.ServoData: servo,
    c.ServoDataAddress: servo,
    c.Release: servo,
    c.JogJoint: joint,
    c.JointLimit: joint,
    c.JogAxis: axis,
    c.CoordStep: axis,
    c.JointMove: joint_move,
    c.JointsMove: joints_move,
    c.CoordMove: coord_move,
    c.ToMove: to_move,
    PartOfMove: part_of_move,
}
"""What the parameters tell."""
