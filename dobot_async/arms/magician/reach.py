"""Where commands lead, and whether the arm can go there."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, cast

from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.kinematics import Kinematics

__all__ = ["Destination", "check_reach", "destination", "is_relative"]

ANGLES = {c.PTPMode.JUMP_ANGLE, c.PTPMode.MOVJ_ANGLE, c.PTPMode.MOVL_ANGLE}
INCREMENTS = {c.PTPMode.MOVJ_INC, c.PTPMode.MOVL_INC, c.PTPMode.MOVJ_XYZ_INC}


class Destination(NamedTuple):
    """The end of an absolute motion: x, y, z, r, or the four joints."""

    numbers: tuple[float, float, float, float]
    joints: bool = False

    def distance(self, pose: c.Pose) -> float:
        """How far a pose is from it: mm and degrees."""
        here = (pose.j1, pose.j2, pose.j3, pose.j4) if self.joints else (pose.x, pose.y, pose.z, pose.r)
        return math.dist(here, self.numbers)


def destination(value: Any) -> Destination | None:
    """Returns where a command leads, None if that depends on where the arm will be, or if it leads nowhere."""
    find = DESTINATIONS.get(cast("type[object]", type(value)))
    return find(value) if find else None


def is_relative(value: Any) -> bool:
    """Returns whether doing a command twice is more than doing it once: increments, jogs, distances, circles."""
    if isinstance(value, (c.PTPCmd, c.PTPWithLCmd, c.PTPPOCmd, c.PTPPOWithLCmd)):
        return value.ptp_mode in INCREMENTS

    if isinstance(value, (c.CPCmd, c.CPLECmd)):
        return value.cp_mode is c.CPMode.RELATIVE

    return isinstance(value, (c.JOGCmd, c.EMotorS, c.CircleCmd))


def check_reach(kinematics: Kinematics, value: Any) -> None:
    """Raises Unreachable, with the reason, if a command's target is beyond the arm.

    Targets alone are checked, not the way there; increments depend on where the arm will be, and are left to it.
    """
    target = destination(value)
    if target and target.joints:
        kinematics.check_joints(*target.numbers)
    elif target:
        kinematics.check(*target.numbers)

    if isinstance(value, (c.ARCCmd, c.CircleCmd)):
        via = value.cir_point
        kinematics.check(via.x, via.y, via.z, via.r)

    if isinstance(value, (c.CPCmd, c.CPLECmd)) and value.cp_mode is c.CPMode.ABSOLUTE:
        # A continuous path keeps the tool's rotation, which is not known here.
        kinematics.inverse(value.x, value.y, value.z, 0.0)


def of_ptp(value: c.PTPCmd | c.PTPWithLCmd | c.PTPPOCmd | c.PTPPOWithLCmd) -> Destination | None:
    """A PTP command's four numbers are what its mode says."""
    if value.ptp_mode in INCREMENTS:
        return None

    return Destination((value.x, value.y, value.z, value.r), joints=value.ptp_mode in ANGLES)


def of_arc(value: c.ARCCmd) -> Destination:
    """An arc ends at its second point; a circle, where it began."""
    end = value.to_point
    return Destination((end.x, end.y, end.z, end.r))


DESTINATIONS: Mapping[type, Callable[[Any], Destination | None]] = {
    c.PTPCmd: of_ptp,
    c.PTPWithLCmd: of_ptp,
    c.PTPPOCmd: of_ptp,
    c.PTPPOWithLCmd: of_ptp,
    c.ARCCmd: of_arc,
}
