"""Parameters that an arm takes, and then does nothing with, or raises an alarm: refused before they are sent.

They are no limits of the wire, so that the rows do not have them: an arm may tell such values of itself.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, cast

from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.arguments import above_zero, to_number

__all__ = ["check_ranges"]

ABOVE_ZERO: Mapping[type, tuple[str, ...]] = {
    c.JOGJointParams: ("velocity", "acceleration"),
    c.JOGCoordinateParams: ("velocity", "acceleration"),
    c.JOGCommonParams: ("velocity_ratio", "acceleration_ratio"),
    c.JOGLParams: ("velocity", "acceleration"),
    c.PTPJointParams: ("velocity", "acceleration"),
    c.PTPCoordinateParams: ("xyz_velocity", "r_velocity", "xyz_acceleration", "r_acceleration"),
    c.PTPCommonParams: ("velocity_ratio", "acceleration_ratio"),
    c.PTPLParams: ("velocity", "acceleration"),
    c.CPParams: ("plan_acc", "junction_vel", "acc"),
    c.CPCommonParams: ("velocity_ratio", "acceleration_ratio"),
    c.ARCParams: ("xyz_velocity", "r_velocity", "xyz_acceleration", "r_acceleration"),
    c.ARCCommonParams: ("velocity_ratio", "acceleration_ratio"),
}
"""With a velocity or an acceleration of 0 a motion never ends; below 0 nobody knows what happens."""

NOT_BELOW_ZERO: Mapping[type, tuple[str, ...]] = {
    c.PTPJumpParams: ("jump_height",),
    c.PTPJump2Params: ("start_jump_height", "end_jump_height"),
}
"""A jump that is to lift by less than nothing raises alarm 0x15 when it begins."""


def check_ranges(value: Any) -> None:
    """Raise ValueError for parameters with which a motion never ends, or ends with an alarm for certain."""
    kind = cast("type[object]", type(value))
    for name in ABOVE_ZERO.get(kind, ()):
        found: Any = getattr(value, name)
        if isinstance(found, (tuple, list)):
            for place, each in enumerate(cast("Sequence[Any]", found)):
                above_zero(f"{name}[{place}]", each)
        else:
            above_zero(name, found)

    for name in NOT_BELOW_ZERO.get(kind, ()):
        to_number(name, getattr(value, name), least=0)
