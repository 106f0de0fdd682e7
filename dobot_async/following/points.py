"""Places that an arm is sent to, and what lies between them; numbers alone, no arm and no clock."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, SupportsFloat, cast

from dobot_async._core.util.arguments import to_float
from dobot_async.errors import UnsupportedError

__all__ = [
    "TargetPoint",
    "apart",
    "nearer_than",
    "part_of_way",
    "read_point",
    "straight_way",
    "turns_back",
    "way_along",
]

GRAIN = 0.02
"""mm and degrees; what is nearer is the same place."""


@dataclass(frozen=True, slots=True)
class TargetPoint:
    """A place.

    Attributes:
        numbers: x, y, z in mm and then angles in degrees; or the joints, degrees.
        joints: Whether they are joints.
    """

    numbers: tuple[float, ...]
    joints: bool = False

    def __str__(self) -> str:
        return f"{'joints ' if self.joints else ''}({', '.join(f'{number:.6g}' for number in self.numbers)})"


def read_point(
    target: Any, axes: Sequence[str], joints: int, here: TargetPoint | None, *, as_joints: bool = False
) -> TargetPoint:
    """Return the place that a target says.

    Args:
        target: A pose, with an attribute for each axis, or numbers: x, y, z and as many angles as are given.
        axes: The names of the arm's coordinates.
        joints: How many joints it has.
        here: What angles that are not given are taken from; None if nothing tells.
        as_joints: The numbers are the joints, all of them; of a pose its joints are taken.

    Raises:
        ValueError: There are too few numbers, or too many, or one is not finite.
        TypeError: It is neither a pose nor numbers.
    """
    names = [f"j{number}" for number in range(1, joints + 1)] if as_joints else list(axes)
    if as_joints and hasattr(target, "joints"):
        target = target.joints
    elif not as_joints and all(hasattr(target, axis) for axis in axes):
        target = [getattr(target, axis) for axis in axes]

    if isinstance(target, (str, bytes)) or not isinstance(target, Iterable):
        raise TypeError(f"target must be a pose, or numbers ({', '.join(names)}), not {target!r}")

    given = list(cast("Iterable[SupportsFloat]", target))
    numbers = [to_float(value, name) for name, value in zip(names, given, strict=False)]
    least = len(names) if as_joints else 3
    if not least <= len(given) <= len(names):
        raise ValueError(f"target must have {', '.join(names)}{'' if as_joints else ', the first three at least'}")

    for name, number in zip(names, numbers, strict=False):
        if not math.isfinite(number):
            raise ValueError(f"{name} of the target must be finite, not {number!r}")

    if len(numbers) < len(names):
        if here is None or here.joints:
            raise ValueError(f"give all of {', '.join(names)}: nothing tells the others while joints are followed")

        numbers += here.numbers[len(numbers) :]

    return TargetPoint(tuple(numbers), as_joints)


def gaps(start: TargetPoint, end: TargetPoint, *, turns: bool) -> list[float]:
    """How far it is in each number; with `turns` angles of a pose go the short way round."""
    found = [b - a for a, b in zip(start.numbers, end.numbers, strict=True)]
    if turns and not end.joints:
        found[3:] = [math.remainder(angle, 360) for angle in found[3:]]

    return found


def way_along(start: TargetPoint, end: TargetPoint, *, turns: bool = False) -> tuple[float, float]:
    """Return how far it is: mm in a straight line, and degrees of the angle that turns most."""
    found = gaps(start, end, turns=turns)
    split = 0 if end.joints else 3
    return math.hypot(*found[:split]), max(map(abs, found[split:]), default=0.0)


def straight_way(start: TargetPoint, end: TargetPoint) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the places (x, y, z) at the ends of a straight way; raise UnsupportedError for one in joints."""
    if end.joints:
        raise UnsupportedError(
            "joints cannot be followed within a workspace or limits: the driver does not know where those of this arm "
            "lead; follow coordinates"
        )

    return start.numbers[:3], end.numbers[:3]


def apart(start: TargetPoint, end: TargetPoint, *, turns: bool = False) -> float:
    """Return how far it is as one number, for comparing: mm and degrees count the same."""
    return math.hypot(*way_along(start, end, turns=turns))


def nearer_than(here: TargetPoint, there: TargetPoint, tolerance: tuple[float, float], *, turns: bool = False) -> bool:
    """Return whether one place is within a tolerance, mm and degrees, of another."""
    mm, degrees = way_along(here, there, turns=turns)
    return mm <= tolerance[0] and degrees <= tolerance[1]


def part_of_way(start: TargetPoint, end: TargetPoint, mm: float, degrees: float, *, turns: bool = False) -> TargetPoint:
    """Return the place on the straight way that is no further than so many mm and degrees from its start."""
    length, turn = way_along(start, end, turns=turns)
    share = min(1.0, mm / length if length > mm else 1.0, degrees / turn if turn > degrees else 1.0)
    if share == 1.0:
        return end

    moved = [a + share * gap for a, gap in zip(start.numbers, gaps(start, end, turns=turns), strict=True)]
    if turns and not end.joints:
        moved[3:] = [angle if abs(angle) <= 180 else math.remainder(angle, 360) for angle in moved[3:]]

    return TargetPoint(tuple(moved), end.joints)


def turns_back(here: TargetPoint, sent: TargetPoint, wanted: TargetPoint, *, turns: bool = False) -> bool:
    """Return whether the way to a place leads back from where the arm goes."""
    ahead, now = gaps(here, sent, turns=turns), gaps(here, wanted, turns=turns)
    return sum(a * b for a, b in zip(ahead, now, strict=True)) < 0
