"""Drawing and engraving in one call each."""

from __future__ import annotations

from typing import Any, SupportsFloat

from dobot_async.toolpath.drawing import Drawing, DrawingArm
from dobot_async.toolpath.plane import WorkPlane
from dobot_async.toolpath.toolpath import Toolpath

__all__ = ["draw", "engrave"]


async def draw(arm: DrawingArm, toolpath: Toolpath, plane: WorkPlane, *, first: int = 0, **options: Any) -> None:
    """Draw a toolpath with a pen, and return when the arm has done it; see `Drawing`, which can be stopped.

    Args:
        arm: A connected Magician, UltraArm or MyCobot.
        toolpath: What to draw.
        plane: Where the paper lies.
        first: The stroke, from 0, to begin with.
        options: As for `Drawing`: speed, tolerance, acceleration, percent, rate, progress.

    Raises:
        ValueError: An option is out of range.
        UnreachableStroke: A stroke is out of the arm's reach; nothing has moved.
        DobotError: The arm failed, and was stopped; a note tells the stroke.
    """
    await Drawing(arm, toolpath, plane, tool="pen", **options).run(first=first)


async def engrave(
    arm: DrawingArm,
    toolpath: Toolpath,
    plane: WorkPlane,
    *,
    first: int = 0,
    point: SupportsFloat = 0.0,
    **options: Any,
) -> None:
    """Engrave a toolpath with a laser, which is off on every way out; see `draw`.

    The plane is that of the focus: the laser is moved in it, and lifted on the way to the first stroke alone. A dot is
    a line of 0.1 mm. With `first` and `point` it goes on where it was stopped.

    Args:
        arm: A connected Magician or UltraArm.
        toolpath: What to engrave.
        plane: Where the laser has its focus.
        first: The stroke, from 0, to begin with.
        point: How far in this stroke; see `Drawing.next_point`.
        options: As for `Drawing`: speed, tolerance, acceleration, percent, rate, progress.

    Raises:
        ValueError: An option is out of range.
        UnsupportedError: The arm has no laser.
        UnreachableStroke: A stroke is out of the arm's reach; nothing has moved.
        DobotError: The arm failed, and was stopped; a note tells the stroke.
    """
    await Drawing(arm, toolpath, plane, tool="laser", **options).run(first=first, point=point)
