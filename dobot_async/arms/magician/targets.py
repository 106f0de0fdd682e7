"""Targets of point-to-point motions: what was given of them, checked, and the command that they make."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.arguments import to_choice, to_number
from dobot_async.arms.magician.goals import Goal, known
from dobot_async.arms.magician.reach import ANGLES, INCREMENTS

__all__ = ["Target", "one_of", "read_target", "to_ptp"]


@dataclass(frozen=True, slots=True)
class Target:
    """Where a motion is to lead, mm and degrees; None for what was not given."""

    mode: c.PTPMode
    x: float | None
    y: float | None
    z: float | None
    r: float | None
    j4: float | None
    rail: float | None

    @property
    def whole(self) -> bool:
        """Whether all of the place is given; the rotation is 0 then unless given."""
        return None not in {self.x, self.y, self.z}

    def command(self, goal: Goal) -> tuple[Command[Any, None], Any]:
        """Return the command that leads there from a goal; raise ValueError if that does not tell enough."""
        x, y, z = (
            known(name, there) if given is None else given
            for name, given, there in (("x", self.x, goal.x), ("y", self.y, goal.y), ("z", self.z, goal.z))
        )
        if self.j4 is not None:
            r = goal.kinematics.inverse(x, y, z, 0.0).j1 + self.j4
        elif self.r is not None:
            r = self.r
        else:
            r = 0.0 if self.whole else known("r", goal.r)

        return to_ptp(self.mode, (x, y, z, r), self.rail)


def read_target(
    x: float | c.Pose | None,
    y: float | None,
    z: float | None,
    r: float | None,
    *,
    j4: float | None,
    mode: c.PTPMode,
    l: float | None,
) -> Target:
    """Return the target that the arguments of `move_to` say; raise ValueError or TypeError if they say none."""
    mode = to_choice("mode", mode, c.PTPMode)
    if isinstance(x, c.Pose):
        if any(each is not None for each in (y, z, r, j4)) or mode in INCREMENTS:
            raise ValueError("a pose is a whole target: it takes no y, z, r or j4 beside it, and no INC mode")

        x, y, z, r = x.joints if mode in ANGLES else (x.x, x.y, x.z, x.r)

    if r is not None and j4 is not None:
        raise ValueError("r and j4 are two ways to say the same: give one of them")

    given = {"x": x, "y": y, "z": z, "r": r, "j4": j4, "l": l}
    numbers = {name: None if value is None else to_number(name, value) for name, value in given.items()}
    target = Target(mode, rail=numbers.pop("l"), **numbers)
    if mode in ANGLES | INCREMENTS and (not target.whole or j4 is not None):
        raise ValueError(f"mode {mode.name} needs x, y and z, and takes no j4")

    if mode in INCREMENTS and l is not None:
        raise ValueError("an increment along the rail is move_by(l=...)")

    return target


def to_ptp(mode: c.PTPMode, numbers: Sequence[float], rail: float | None) -> tuple[Command[Any, None], Any]:
    """Return the command for a point-to-point motion, with the rail's if it has one."""
    x, y, z, r = numbers
    if rail is None:
        return c.SET_PTP_CMD, c.PTPCmd(mode, x, y, z, r)

    return c.SET_PTP_WITH_L_CMD, c.PTPWithLCmd(mode, x, y, z, r, rail)


def one_of(verb: str, mode: c.PTPMode, modes: set[c.PTPMode]) -> c.PTPMode:
    """Return a mode that a verb takes; raise ValueError or TypeError for others."""
    mode = to_choice("mode", mode, c.PTPMode)
    if mode not in modes:
        names = ", ".join(sorted(each.name for each in modes))
        raise ValueError(f"mode of {verb} must be one of {names}, not {mode.name}")

    return mode
