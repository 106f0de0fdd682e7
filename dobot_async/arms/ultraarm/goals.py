"""Where a motion leads, and whether the arm stands there: it says nothing itself of a motion that it does not do.

G0 X200    -> coords (x 200)          compared with M114, within the tolerance
M11 X20    -> joints (j1 20)          compared with M12
G28        -> home                    compared with M119: the home switches; and something has moved
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.ultraarm import commands as c
from dobot_async.arms.ultraarm.answers import Status
from dobot_async.errors import ProtocolError

__all__ = [
    "AXES",
    "GRAIN",
    "INCREMENTS",
    "Goal",
    "HomeGoal",
    "MotionFault",
    "PointGoal",
    "goal_of",
    "moved",
    "pose_of",
    "summed",
]

GRAIN = 0.02  # mm and degrees; the arm tells hundredths
AXES = ("x", "y", "z", "e")
JOINTS = ("j1", "j2", "j3", "j4")
INCREMENTS = frozenset({c.MOVE_COORDS, c.MOVE_LINE})
"""What means increments after G91."""


@dataclass(frozen=True, slots=True)
class MotionFault:
    """What keeps an ultraArm from a motion, or has ended it: what was seen, for it has no alarms of its own."""

    text: str

    def __str__(self) -> str:
        return self.text


class Goal(Protocol):
    """Where a motion leads."""

    @property
    def needs_angles(self) -> bool:
        """Whether the joints tell of it."""
        ...

    def distance(self, status: Status) -> float | None:
        """Return by how many mm or degrees the arm misses it on its worst axis; None where it does not tell."""
        ...

    def reached(self, status: Status, tolerance: float, *, set_out: bool) -> bool:
        """Return whether an arm at rest has reached it; `set_out` says that something was seen to move."""
        ...

    def come_to(self, before: Status | None, here: Status, tolerance: float) -> bool:
        """Return whether an arm at rest has come to it, and not only stands near it, where it stood before.

        If in doubt it has not: to be told once more where it stands moves an arm by no more than the tolerance.
        """
        ...

    def missed(self, status: Status, *, set_out: bool) -> MotionFault:
        """Return what to say of an arm that rests elsewhere."""
        ...


@dataclass(frozen=True, slots=True)
class PointGoal:
    """Some of the coordinates, or of the joints."""

    joints: bool
    numbers: Mapping[str, float]

    @property
    def needs_angles(self) -> bool:
        """Whether it is in joints."""
        return self.joints

    def distance(self, status: Status) -> float | None:
        """Return the greatest distance of an axis, mm or degrees."""
        here = self._here(status)
        if any(name not in here for name in self.numbers):
            return None

        return max((abs(here[name] - value) for name, value in self.numbers.items()), default=0.0)

    def reached(self, status: Status, tolerance: float, *, set_out: bool) -> bool:  # noqa: ARG002 - a place tells enough
        """Return whether it stands there."""
        distance = self.distance(status)
        return distance is not None and distance <= tolerance

    def come_to(self, before: Status | None, here: Status, tolerance: float) -> bool:
        """Return whether it stands there, or nearer than before."""
        was, miss = self.distance(before) if before else None, self.distance(here)
        return miss is not None and (miss <= GRAIN or (was is not None and miss < was and miss <= tolerance))

    def missed(self, status: Status, *, set_out: bool) -> MotionFault:  # noqa: ARG002 - a place tells enough
        """Return where it came to rest instead."""
        found = ", ".join(f"{name} {value:g}" for name, value in self._here(status).items())
        where = f"at {found}" if found else "somewhere that it does not tell"
        return MotionFault(
            f"it came to rest {where} instead of {self}: out of reach, not homed, without power, or obstructed; "
            "tolerance= says how near is near enough"
        )

    def _here(self, status: Status) -> dict[str, float]:
        return dict(zip(JOINTS if self.joints else AXES, status.angles if self.joints else status.coords, strict=False))

    def __str__(self) -> str:
        return ", ".join(f"{name} {value:g}" for name, value in self.numbers.items())


@dataclass(frozen=True, slots=True)
class HomeGoal:
    """The home switches.

    Attributes:
        switches: What they read at home; None if they are not looked at.
    """

    switches: tuple[int, ...] | None

    @property
    def needs_angles(self) -> bool:
        """Return True: that they change tells that something moves."""
        return True

    def distance(self, status: Status) -> float | None:  # noqa: ARG002 - switches have none
        """Return None."""
        return None

    def reached(self, status: Status, tolerance: float, *, set_out: bool) -> bool:  # noqa: ARG002 - nor a tolerance
        """Return whether something has moved, and the switches are those of home."""
        return set_out and (self.switches is None or status.endstops == self.switches)

    def come_to(self, before: Status | None, here: Status, tolerance: float) -> bool:  # noqa: ARG002 - none of them tells
        """Return False: nobody knows without having seen it move."""
        return False

    def missed(self, status: Status, *, set_out: bool) -> MotionFault:
        """Return whether it did not set out, or did not get there."""
        if not set_out:
            return MotionFault("nothing moved on the way home (G28): the motors have no power? power_on(), then home()")

        read = ", ".join(f"{each:g}" for each in status.endstops) or "nothing"
        wanted = ", ".join(map(str, self.switches or ()))
        return MotionFault(
            f"it came to rest on the way home: its home switches read {read}, not {wanted}; home_switches= of connect "
            "says what they read at home"
        )

    def __str__(self) -> str:
        return "home"


def goal_of(command: Command[Any, Any], value: Any, switches: tuple[int, ...] | None) -> Goal:
    """Return where a motion leads whose coordinates are absolute."""
    if command is c.HOME:
        return HomeGoal(switches)

    if isinstance(value, c.JointMove):
        return PointGoal(joints=True, numbers={f"j{value.joint}": float(value.angle)})

    joints = isinstance(value, c.JointsMove)
    given = {name: getattr(value, name) for name in (JOINTS if joints else AXES)}
    return PointGoal(joints, {name: float(number) for name, number in given.items() if number is not None})


def summed(value: c.CoordsMove, status: Status) -> c.CoordsMove:
    """Return the target of increments from where the arm stands."""
    here: dict[str, float] = dict(zip(AXES, status.coords, strict=False))
    given = {name: getattr(value, name) for name in AXES}
    target = {name: round(here[name] + by, 2) for name, by in given.items() if by is not None}
    return c.CoordsMove(**target, f=value.f)


def moved(before: Status, after: Status) -> bool:
    """Return whether an arm stands, or has its switches, otherwise than before."""
    pairs = ((before.coords, after.coords), (before.angles, after.angles), (before.endstops, after.endstops))
    return any(abs(a - b) > GRAIN for one, other in pairs for a, b in zip(one, other, strict=False))


def pose_of(status: Status) -> c.UltraArmPose:
    """Return the pose in a status; the fourth joint is 0 where the arm does not tell it.

    Raises:
        ProtocolError: It tells less than three numbers of either.
    """
    if min(len(status.coords), len(status.angles)) < 3:
        raise ProtocolError(f"the arm does not tell where it is: COORDS{status.coords}, ANGLES{status.angles}")

    (x, y, z, e), joints = ((*numbers[:4], 0.0)[:4] for numbers in (status.coords, status.angles))
    return c.UltraArmPose(x, y, z, e, joints)
