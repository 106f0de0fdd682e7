"""Where the arm will be: what a motion's missing coordinates are taken from.

    Goal --follow(command)--> Goal --follow(command)--> Goal      None for a coordinate that nothing tells

A plan makes a command of the goal that is before it: `move_to(z=20)` keeps the other coordinates of the goal.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, cast

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.kinematics import Joints, Kinematics, Unreachable
from dobot_async.arms.magician.reach import ANGLES, INCREMENTS

__all__ = ["Goal", "Need", "Plan", "follow", "goal_of", "known"]

Need = frozenset[str]
"""What a plan takes from the goal: "pose", "rail", or neither (the kinematics are always there)."""


@dataclass(frozen=True, slots=True)
class Goal:
    """Where the arm will be, mm and degrees; None where that is not known."""

    kinematics: Kinematics
    x: float | None = None
    y: float | None = None
    z: float | None = None
    r: float | None = None
    rail: float | None = None

    @property
    def point(self) -> tuple[float, float, float, float] | None:
        """All four coordinates, if all are known."""
        if self.x is None or self.y is None or self.z is None or self.r is None:
            return None

        return self.x, self.y, self.z, self.r

    @property
    def joints(self) -> Joints | None:
        """The joints there, if all coordinates are known, and lead to any."""
        try:
            return self.kinematics.inverse(*self.point) if self.point else None
        except Unreachable:
            return None


Plan = Callable[[Goal], tuple[Command[Any, None], Any]]


def known(name: str, value: float | None) -> float:
    """Return a coordinate of a goal; raise ValueError if it is not known."""
    if value is None:
        raise ValueError(
            f"{name} is to stay, but what it will be then is not known: say {name}, or await the motions before"
        )

    return value


def goal_of(kinematics: Kinematics, pose: c.Pose, rail: float | None) -> Goal:
    """Return the goal of an arm that stands."""
    return Goal(kinematics, pose.x, pose.y, pose.z, pose.r, rail)


def follow(goal: Goal, value: Any) -> Goal:
    """Return the goal behind a command."""
    step = STEPS.get(cast("type[object]", type(value)))
    return step(goal, value) if step else goal


def ptp(goal: Goal, value: c.PTPCmd | c.PTPWithLCmd | c.PTPPOCmd | c.PTPPOWithLCmd) -> Goal:
    """A point-to-point motion, and the rail's if it has one."""
    numbers = value.x, value.y, value.z, value.r
    if isinstance(value, (c.PTPWithLCmd, c.PTPPOWithLCmd)):
        goal = replace(goal, rail=value.rail)

    if value.ptp_mode is c.PTPMode.MOVJ_INC:
        joints = goal.joints
        return at(goal, goal.kinematics.forward(*map(sum, zip(joints, numbers, strict=True))) if joints else None)

    if value.ptp_mode in ANGLES:
        return at(goal, goal.kinematics.forward(*numbers))

    return at(goal, added(goal, numbers) if value.ptp_mode in INCREMENTS else numbers)


def path(goal: Goal, value: c.CPCmd | c.CPLECmd) -> Goal:
    """A point of a continuous path; what the tool's rotation is then depends on the arm's settings."""
    place = value.x, value.y, value.z, None
    return at(goal, added(goal, place) if value.cp_mode is c.CPMode.RELATIVE else place)


def added(goal: Goal, numbers: tuple[float | None, ...]) -> tuple[float | None, ...]:
    """A goal's coordinates with increments."""
    here = goal.x, goal.y, goal.z, goal.r
    return tuple(None if a is None or b is None else a + b for a, b in zip(here, numbers, strict=True))


def at(goal: Goal, place: tuple[float | None, ...] | None) -> Goal:
    """The same goal at another place."""
    x, y, z, r = place or (None,) * 4
    return replace(goal, x=x, y=y, z=z, r=r)


def arc(goal: Goal, value: c.ARCCmd) -> Goal:
    """An arc ends at its second point."""
    to = value.to_point
    return at(goal, (to.x, to.y, to.z, to.r))


def lost(goal: Goal, _: Any) -> Goal:
    """A command that leads nobody knows where."""
    return Goal(goal.kinematics)


STEPS: Mapping[type, Callable[[Goal, Any], Goal]] = {
    c.PTPCmd: ptp,
    c.PTPWithLCmd: ptp,
    c.PTPPOCmd: ptp,
    c.PTPPOWithLCmd: ptp,
    c.CPCmd: path,
    c.CPLECmd: path,
    c.ARCCmd: arc,
    c.HOMECmd: lost,
    c.JOGCmd: lost,
    c.AutoLevelingCmd: lost,
    c.EndEffectorParams: lost,  # the same joints are another place then
}
"""What moves the goal; a circle ends where it began, and nothing else moves."""
