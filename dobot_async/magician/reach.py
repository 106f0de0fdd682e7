"""Which targets of which commands can be checked before they are sent, and how."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from dobot_async.magician import commands as c
from dobot_async.magician.kinematics import Kinematics

__all__ = ["check_reach"]


def check_reach(kinematics: Kinematics, value: Any) -> None:
    """Raises Unreachable, with the reason, if a command's target is beyond the arm.

    Targets alone are checked, not the way there; increments depend on where the arm will be, and are left to it.
    """
    check = CHECKS.get(type(value))
    if check:
        check(kinematics, value)


def check_ptp(kinematics: Kinematics, target: c.PTPCmd | c.PTPWithLCmd | c.PTPPOCmd | c.PTPPOWithLCmd) -> None:
    """A PTP command's four numbers are what its mode says."""
    if target.ptp_mode in ANGLES:
        kinematics.check_joints(target.x, target.y, target.z, target.r)
    elif target.ptp_mode not in INCREMENTS:
        kinematics.check(target.x, target.y, target.z, target.r)


def check_path(kinematics: Kinematics, target: c.CPCmd | c.CPLECmd) -> None:
    """A continuous path keeps the tool's rotation, which is not known here."""
    if target.cp_mode is c.CPMode.ABSOLUTE:
        kinematics.inverse(target.x, target.y, target.z, 0.0)


def check_arc(kinematics: Kinematics, target: c.ARCCmd | c.CircleCmd) -> None:
    """Both points of an arc are on it."""
    for point in (target.cir_point, target.to_point):
        kinematics.check(point.x, point.y, point.z, point.r)


ANGLES = {c.PTPMode.JUMP_ANGLE, c.PTPMode.MOVJ_ANGLE, c.PTPMode.MOVL_ANGLE}
INCREMENTS = {c.PTPMode.MOVJ_INC, c.PTPMode.MOVL_INC, c.PTPMode.MOVJ_XYZ_INC}
CHECKS: Mapping[type, Callable[[Kinematics, Any], None]] = {
    c.PTPCmd: check_ptp,
    c.PTPWithLCmd: check_ptp,
    c.PTPPOCmd: check_ptp,
    c.PTPPOWithLCmd: check_ptp,
    c.CPCmd: check_path,
    c.CPLECmd: check_path,
    c.ARCCmd: check_arc,
    c.CircleCmd: check_arc,
}
