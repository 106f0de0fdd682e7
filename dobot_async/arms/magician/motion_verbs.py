"""The verbs that move a Magician; see `verbs`."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import Any, Generic, TypeVar

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.arguments import to_flag, to_number, to_point, to_whole
from dobot_async.arms.magician.goals import Goal, Need, Plan, known
from dobot_async.arms.magician.kinematics import Kinematics
from dobot_async.arms.magician.reach import ANGLES, INCREMENTS
from dobot_async.arms.magician.targets import one_of, read_target, to_ptp

__all__ = ["MotionVerbs"]

T = TypeVar("T")
Q = TypeVar("Q")

ABSOLUTE = {
    c.PTPMode.MOVL_INC: c.PTPMode.MOVL_XYZ,
    c.PTPMode.MOVJ_XYZ_INC: c.PTPMode.MOVJ_XYZ,
    c.PTPMode.MOVJ_INC: c.PTPMode.MOVJ_ANGLE,
}
"""The same way to a place that is given as a place."""

NOTHING: Need = frozenset()
POSE: Need = frozenset({"pose"})
EVERYTHING: Need = frozenset({"pose", "rail"})


class MotionVerbs(Generic[T]):
    """What moves the arm; T is what each verb returns in its place.

    Raises:
        ValueError: Of each verb: an argument is out of range, or the arm cannot get there; no motion was sent.
        TypeError: An argument is of the wrong type.
    """

    @abstractmethod
    def perform(self, command: Command[Q, Any], value: Q, timeout: float | None) -> T:
        """Does, or queues, or collects a command."""

    def perform_from_goal(self, plan: Plan, needs: Need, timeout: float | None) -> T:  # noqa: ARG002 - where nothing tells
        """Does, or queues, or collects what a plan makes of the goal that is before it.

        Raises:
            ValueError: The plan needs what is not known.
        """
        raise ValueError(
            "not all of the target is given, and nothing here tells where the arm will be: say x, y, z and r"
        )

    def home(self, *, timeout: float | None = None) -> T:
        """Drives to the switches, and from there to the home position; takes tens of seconds. Manual 2.6.2.

        Needed after power-up: before it the arm believes that its base, its tool and its rail stand at 0.
        """
        return self.perform(c.SET_HOME_CMD, c.HOMECmd(), timeout)

    def move_to(
        self,
        x: float | c.Pose | None = None,
        y: float | None = None,
        z: float | None = None,
        r: float | None = None,
        *,
        j4: float | None = None,
        mode: c.PTPMode = c.PTPMode.MOVJ_XYZ,
        l: float | None = None,
        timeout: float | None = None,
    ) -> T:
        """Moves the tool to a point. Manual 2.11.5.

        Of x, y and z those that are not given stay as they are, and r with them: as the motion before leaves them, or
        as the arm stands if it has nothing to do. With all three given, r is 0 unless it is given as well.

        Args:
            x: mm, forward; or a pose, in place of x, y, z and r.
            y: mm, to the left.
            z: mm, up.
            r: Degrees, the tool's rotation.
            j4: Degrees, joint 4 in place of r: r = j1 + j4, so that the tool turns with the arm.
            mode: How it gets there. An ANGLE mode reads the four numbers as joints, an INC mode as increments; both
                need the first three.
            l: mm along the rail, for an arm that stands on one; see `set_rail`.
            timeout: Seconds.

        Raises:
            ValueError: A number is not finite; what is not given is not known; `l` without a rail.
            TypeError: Something is of the wrong type.
        """
        target = read_target(x, y, z, r, j4=j4, mode=mode, l=l)
        if target.whole and target.j4 is None:
            return self.perform(*target.command(Goal(Kinematics())), timeout)

        return self.perform_from_goal(target.command, NOTHING if target.whole else POSE, timeout)

    def move_joints(
        self,
        j1: float,
        j2: float,
        j3: float,
        j4: float,
        *,
        mode: c.PTPMode = c.PTPMode.MOVJ_ANGLE,
        l: float | None = None,
        timeout: float | None = None,
    ) -> T:
        """Moves the joints to angles in degrees. Manual 2.11.5.

        Args:
            j1: Degrees, the base.
            j2: Degrees, the rear arm.
            j3: Degrees, the forearm.
            j4: Degrees, the tool.
            mode: How it gets there, one of the ANGLE modes.
            l: mm along the rail, for an arm that stands on one; see `set_rail`.
            timeout: Seconds.

        Raises:
            ValueError: An angle is not finite or beyond its limits, or `mode` is no ANGLE mode; `l` without a rail.
            TypeError: Something is of the wrong type.
        """
        mode = one_of("move_joints", mode, ANGLES)
        numbers = [to_number(name, value) for name, value in (("j1", j1), ("j2", j2), ("j3", j3), ("j4", j4))]
        return self._tell(mode, numbers, None if l is None else to_number("l", l), timeout)

    def move_by(
        self,
        x: float = 0.0,
        y: float = 0.0,
        z: float = 0.0,
        r: float = 0.0,
        *,
        mode: c.PTPMode = c.PTPMode.MOVL_INC,
        l: float | None = None,
        timeout: float | None = None,
    ) -> T:
        """Moves the tool by mm and degrees from where it will be then. Manual 2.11.5.

        Args:
            x: mm, forward.
            y: mm, to the left.
            z: mm, up.
            r: Degrees.
            mode: How it gets there, one of the INC modes; MOVJ_INC reads the four numbers as joints.
            l: mm along the rail, by which the arm moves as well. No document says what an increment along the rail is,
                so the arm is told the place itself: where the motion before leads must be known.
            timeout: Seconds.

        Raises:
            ValueError: A number is not finite, the target is out of reach, or `mode` is no INC mode; `l` without a
                rail.
            TypeError: Something is of the wrong type.
        """
        mode = one_of("move_by", mode, INCREMENTS)
        numbers = [to_number(name, value) for name, value in (("x", x), ("y", y), ("z", z), ("r", r))]
        if l is None:
            return self._tell(mode, numbers, None, timeout)

        rail = to_number("l", l)

        def plan(goal: Goal) -> tuple[Command[Any, None], Any]:
            names = "xyzr"
            start: Sequence[float] = [known(name, getattr(goal, name)) for name in names]
            if mode is c.PTPMode.MOVJ_INC:
                start = goal.kinematics.inverse(*start)

            end = [here + more for here, more in zip(start, numbers, strict=True)]
            return to_ptp(ABSOLUTE[mode], end, known("l", goal.rail) + rail)

        return self.perform_from_goal(plan, EVERYTHING, timeout)

    def arc(self, via: Sequence[float], to: Sequence[float], *, timeout: float | None = None) -> T:
        """Moves along the circular arc from here through `via` to `to`, each (x, y, z) or (x, y, z, r).

        Manual 2.13.2.

        Args:
            via: A point on the way.
            to: Where it ends.
            timeout: Seconds.

        Raises:
            ValueError: A point has not 3 or 4 finite numbers, or is out of reach.
        """
        return self.perform(c.SET_ARC_CMD, c.ARCCmd(to_point("via", via), to_point("to", to)), timeout)

    def circle(self, via: Sequence[float], to: Sequence[float], *, count: int = 1, timeout: float | None = None) -> T:
        """Moves `count` times around the circle through here, `via` and `to`, each (x, y, z) or (x, y, z, r).

        Args:
            via: A point on the circle.
            to: Another one.
            count: How often, 1 or more.
            timeout: Seconds.

        Raises:
            ValueError: A point has not 3 or 4 finite numbers, or is out of reach; `count` is below 1.
        """
        points = to_point("via", via), to_point("to", to)
        return self.perform(c.SET_CIRCLE_CMD, c.CircleCmd(*points, to_whole("count", count, 1, 2**32 - 1)), timeout)

    def path_to(self, x: float, y: float, z: float, *, relative: bool = False, timeout: float | None = None) -> T:
        """Moves on along a continuous path (CP), without a halt if the next point is queued in time. Manual 2.12.2.

        Anything else between two points, a wait of 0 s too, lets the arm halt there.

        Args:
            x: mm, forward.
            y: mm, to the left.
            z: mm, up.
            relative: Whether they count from the point before.
            timeout: Seconds.

        Raises:
            ValueError: A number is not finite, or the point is out of reach.
        """
        return self.perform(c.SET_CP_CMD, c.CPCmd(cp_mode(relative), *xyz(x, y, z)), timeout)

    def engrave_to(
        self, x: float, y: float, z: float, power: float, *, relative: bool = False, timeout: float | None = None
    ) -> T:
        """Moves on along a continuous path with the laser at 0 to 100 percent (CPLE). Manual 2.12.3.

        Args:
            x: mm, forward.
            y: mm, to the left.
            z: mm, up.
            power: Percent, 0 to 100.
            relative: Whether x, y and z count from the point before.
            timeout: Seconds.

        Raises:
            ValueError: A number is out of range, or the point out of reach.
        """
        percent = to_number("power", power, 0, 100, "percent")
        return self.perform(c.SET_CPLE_CMD, c.CPLECmd(cp_mode(relative), *xyz(x, y, z), percent), timeout)

    def _tell(self, mode: c.PTPMode, numbers: Sequence[Any], rail: float | None, timeout: float | None) -> T:
        """Performs a point-to-point motion."""
        command, value = to_ptp(mode, numbers, rail)
        return self.perform(command, value, timeout)


def cp_mode(relative: bool) -> c.CPMode:
    """Whether a point counts from the last one."""
    return c.CPMode.RELATIVE if to_flag("relative", relative) else c.CPMode.ABSOLUTE


def xyz(x: float, y: float, z: float) -> tuple[float, float, float]:
    """Three numbers."""
    return to_number("x", x), to_number("y", y), to_number("z", z)
