"""Where each family's arm can go, as far as the driver knows."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, SupportsFloat

from dobot_async.arms.magician.arm import Magician
from dobot_async.arms.magician.kinematics import BEYOND_LIMIT, Kinematics, Unreachable
from dobot_async.arms.mycobot.arm import MyCobot
from dobot_async.arms.mycobot.models import CobotModel
from dobot_async.arms.ultraarm.arm import UltraArm
from dobot_async.arms.ultraarm.limits import UltraArmLimits
from dobot_async.arms.ultraarm.params import CoordsMove
from dobot_async.toolpath.moves import Reach, Tool, check_moves
from dobot_async.toolpath.plane import Place, WorkPlane
from dobot_async.toolpath.schedule import TOLERANCE, planned, position_in, simplified
from dobot_async.toolpath.toolpath import Toolpath

__all__ = ["check_toolpath", "reach_of", "reachable"]


def of_kinematics(kinematics: Kinematics) -> Reach:
    """The Magician's joints and their limits; the tool's rotation is left as it is, and not looked at."""

    def check(place: Place) -> None:
        j1, j2, j3, _ = kinematics.inverse(*place, 0.0)
        problems = kinematics.limits.problems((j1, j2, j3, 0.0))
        if problems:
            raise Unreachable("; ".join(problems), BEYOND_LIMIT)

    return check


def of_limits(limits: UltraArmLimits) -> Reach:
    """The ultraArm's ranges of x, y and z."""
    return lambda place: limits.check(CoordsMove(*place))


def of_model(model: CobotModel) -> Reach:
    """The myCobot's ranges of x, y and z."""

    def check(place: Place) -> None:
        for axis, value in enumerate(place, 1):
            model.check_coord(axis, value)

    return check


REACHES: Mapping[type, Callable[[Any], Reach]] = {
    Magician: lambda arm: of_kinematics(arm.kinematics),
    Kinematics: of_kinematics,
    UltraArm: lambda arm: of_limits(arm.limits),
    UltraArmLimits: of_limits,
    MyCobot: lambda arm: of_model(arm.model),
    CobotModel: of_model,
}


def reach_of(arm: object) -> Reach:
    """Return what raises ValueError, with the reason, for a place of the arm that it cannot go to.

    Args:
        arm: A connected arm; or `Kinematics`, `UltraArmLimits`, a `CobotModel`, for one that is not there.

    Raises:
        TypeError: It is something else.
    """
    for kind, make in REACHES.items():
        if isinstance(arm, kind):
            return make(arm)

    raise TypeError(f"expected an arm, Kinematics, UltraArmLimits or a CobotModel, not {arm!r}")


def reachable(arm: object, plane: WorkPlane) -> Callable[[float, float], bool]:
    """Return what tells whether the arm can draw at a place of the plane, and lift the pen there.

    For `Toolpath.split` and `preview`.

    Args:
        arm: As for `reach_of`.
        plane: Where the paper lies.
    """
    check = reach_of(arm)

    def inside(x: float, y: float) -> bool:
        try:
            check(plane.to_arm(x, y, -plane.press))
            check(plane.to_arm(x, y, plane.lift))
        except ValueError:
            return False

        return True

    return inside


def check_toolpath(
    arm: object,
    toolpath: Toolpath,
    plane: WorkPlane,
    *,
    tool: Tool = "pen",
    tolerance: SupportsFloat = TOLERANCE,
    first: int = 0,
    point: SupportsFloat = 0.0,
) -> None:
    """Check all strokes, the ways between them and the lifts as `draw` does, without an arm.

    Args:
        arm: As for `reach_of`.
        toolpath: What is to be drawn.
        plane: Where the paper lies.
        tool: "pen" or "laser".
        tolerance: As for `Drawing`, mm.
        first: As for `Drawing.run`.
        point: As for `Drawing.run`.

    Raises:
        UnreachableStroke: The arm cannot go there; it names stroke, point and reason.
        ValueError: There is nothing to draw, or no such stroke or point.
    """
    strokes = planned(simplified(toolpath, tolerance), plane, tool, None, None)
    check_moves((move for moves in strokes for move in moves), reach_of(arm))
    position_in(strokes, first, point, tool)
