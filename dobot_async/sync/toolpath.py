"""Drawing and engraving, for programs without asyncio.

Written by tests/sync/write_sync.py: change what that reads, and run it again.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, SupportsFloat

from dobot_async.sync.given import arm_of, like_an_arm
from dobot_async.sync.portal import PORTAL
from dobot_async.sync.twin import Twin
from dobot_async.sync.twins import AnyArm
from dobot_async.toolpath import check_toolpath as async_check_toolpath
from dobot_async.toolpath import draw as async_draw
from dobot_async.toolpath import engrave as async_engrave
from dobot_async.toolpath import estimate as async_estimate
from dobot_async.toolpath import reach_of as async_reach_of
from dobot_async.toolpath import reachable as async_reachable
from dobot_async.toolpath.drawing import Drawing as AsyncDrawing
from dobot_async.toolpath.estimate import Estimate
from dobot_async.toolpath.moves import Reach, Tool
from dobot_async.toolpath.plane import WorkPlane
from dobot_async.toolpath.progress import Progress
from dobot_async.toolpath.toolpath import Toolpath

__all__ = ["Drawing", "check_toolpath", "draw", "engrave", "estimate", "reach_of", "reachable"]


class Drawing(Twin[AsyncDrawing]):
    """A toolpath, an arm and a plane: checked when it is made, drawn by `run`, stopped by `stop`.

    Args:
        arm: A connected Magician, UltraArm or MyCobot; a Magician should know its tool (`set_end_effector`).
        toolpath: What to draw.
        plane: Where the paper lies.
        tool: "pen" is lifted between strokes, "laser" switched off.
        speed: mm/s; None takes each stroke's own, or 50 (pen) and 20 (laser). A myCobot knows none: see `percent`.
        tolerance: mm by which points that are left out may be missed; 0 leaves none out.
        acceleration: Of a Magician's continuous path, mm/s².
        percent: Of a myCobot's speed.
        constant_speed: Of an ultraArm: run without ramps (M16 S0), as the vendor's player runs programs, and go back to
            ramps behind it. What that does to its motions nobody has measured.
        rate: Commands per second that the line carries; where many short ways follow one another the speed of a
            Magician is made so low that the arm does not use up its queue. None does not look.
        progress: Called with a `Progress` when something was done.

    Raises:
        UnreachableStroke: The arm cannot go there, or not in its workspace; it names stroke, point and reason.
        UnsupportedError: The arm has no such tool.
        ValueError: A number is out of range, or there is nothing to draw.
    """

    def __init__(
        self,
        arm: AnyArm,
        toolpath: Toolpath,
        plane: WorkPlane,
        *,
        tool: Tool = "pen",
        speed: SupportsFloat | None = None,
        tolerance: SupportsFloat = 0.05,
        acceleration: SupportsFloat = 100.0,
        percent: int = 20,
        constant_speed: bool = False,
        rate: SupportsFloat | None = 120.0,
        progress: Callable[[Progress], None] | None = None,
    ) -> None:
        super().__init__(
            AsyncDrawing(
                arm_of(arm),
                toolpath,
                plane,
                tool=tool,
                speed=speed,
                tolerance=tolerance,
                acceleration=acceleration,
                percent=percent,
                constant_speed=constant_speed,
                rate=rate,
                progress=progress,
            )
        )

    @property
    def next_stroke(self) -> int:
        """The first stroke that is not known to be done: with it `run` goes on."""
        return self.asynchronous.next_stroke

    @property
    def next_point(self) -> float:
        """How far a laser was in it, in points: 7.25 is a quarter of the way from point 7 to point 8. 0 for a pen."""
        return self.asynchronous.next_point

    @property
    def progress(self) -> Progress:
        """How far it is."""
        return self.asynchronous.progress

    def run(self, *, first: int | None = None, point: SupportsFloat = 0.0) -> None:
        """Draw, from `next_stroke` and `next_point` on; return when the arm has done all of it.

        A stroke in which it was interrupted is drawn again from its start by a pen; a laser goes on where it was
        stopped. Before the first stroke the tool is lifted.

        Args:
            first: The stroke, from 0, to begin with.
            point: Of a laser: how far in this stroke, as `next_point` of the same toolpath with the same tolerance.

        Raises:
            UnreachableStroke: The way from where the arm is to the first stroke is out of reach, or from there a limit
                of a myCobot's joints is in the way of a stroke; nothing has moved.
            DobotError: As `arm.queue.put` and `Motion.wait`, with a note that tells the stroke. The arm was stopped.
            RuntimeError: It is being drawn already.
        """
        PORTAL.run(lambda: self.asynchronous.run(first=first, point=point))

    def stop(self) -> None:
        """Stop the arm now; `run` raises MotionStopped, and can go on from `next_stroke`."""
        PORTAL.run(self.asynchronous.stop)

    def how_to_go_on(self) -> str:
        """Return the arguments with which the rest is drawn, for the note on an error."""
        return PORTAL.look(self.asynchronous.how_to_go_on)


def draw(arm: AnyArm, toolpath: Toolpath, plane: WorkPlane, *, first: int = 0, **options: Any) -> None:
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
    PORTAL.run(lambda: async_draw(arm_of(arm), toolpath, plane, first=first, **options))


def engrave(
    arm: AnyArm, toolpath: Toolpath, plane: WorkPlane, *, first: int = 0, point: SupportsFloat = 0.0, **options: Any
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
    PORTAL.run(lambda: async_engrave(arm_of(arm), toolpath, plane, first=first, point=point, **options))


def estimate(
    toolpath: Toolpath,
    plane: WorkPlane,
    *,
    arm: Any = "magician",
    tool: Tool = "pen",
    speed: SupportsFloat | None = None,
    tolerance: SupportsFloat = 0.05,
    acceleration: float = 100.0,
    percent: int = 20,
    constant_speed: bool = False,
    rate: SupportsFloat | None = 120.0,
) -> Estimate:
    """Return how long a drawing takes, by drawing it with a simulated arm. It takes two seconds for 10,000 points.

    The arm is taken to have its usual speeds for moves above the paper (`PTPCommonParams` 50 % of a Magician).

    Args:
        toolpath: What to draw.
        plane: Where the paper lies.
        arm: A connected arm; or "magician", "ultraarm", or a myCobot's model.
        tool: "pen" or "laser".
        speed: As for `Drawing`; so are the others.
        tolerance: mm.
        acceleration: mm/s².
        percent: Of a myCobot's speed.
        constant_speed: Of an ultraArm whose firmware takes the ramps away when it is told to.
        rate: Commands per second.

    Raises:
        ValueError: The simulated arm cannot draw it: it tells the stroke.
        TypeError: There is no simulator for this.
    """
    return async_estimate(
        toolpath,
        plane,
        arm=like_an_arm(arm),
        tool=tool,
        speed=speed,
        tolerance=tolerance,
        acceleration=acceleration,
        percent=percent,
        constant_speed=constant_speed,
        rate=rate,
    )


def check_toolpath(
    arm: object,
    toolpath: Toolpath,
    plane: WorkPlane,
    *,
    tool: Tool = "pen",
    tolerance: SupportsFloat = 0.05,
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
    async_check_toolpath(like_an_arm(arm), toolpath, plane, tool=tool, tolerance=tolerance, first=first, point=point)


def reach_of(arm: object) -> Reach:
    """Return what raises ValueError, with the reason, for a place of the arm that it cannot go to.

    Args:
        arm: A connected arm; or `Kinematics`, `UltraArmLimits`, a `CobotModel`, for one that is not there.

    Raises:
        TypeError: It is something else.
    """
    return async_reach_of(like_an_arm(arm))


def reachable(arm: object, plane: WorkPlane) -> Callable[[float, float], bool]:
    """Return what tells whether the arm can draw at a place of the plane, and lift the pen there.

    For `Toolpath.split` and `preview`.

    Args:
        arm: As for `reach_of`.
        plane: Where the paper lies.
    """
    return async_reachable(like_an_arm(arm), plane)
