"""Where a Magician stands, with its end effector and on its rail, and where its tool is then."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.kinematics import Joints, Kinematics
from dobot_async.arms.magician.paths import STEP, Lift
from dobot_async.fleet.planner import XYZ, Discs, Points, Region

__all__ = ["MagicianStance", "Span", "centres", "kinematics_of", "numbers", "shifted"]

SAME = 0.3  # mm and degrees that an arm may stand off from where it was to stand
Span = tuple[float, float]
"""Least and greatest place on a rail, mm."""


@dataclass(frozen=True, slots=True)
class MagicianStance:
    """Where a Magician stands.

    Attributes:
        joints: Its joints.
        bias: Its end effector, as the arm believes.
        slack: mm by which its tool may be elsewhere.
        heading: The direction in which l grows, degrees to the left of x; None for an arm on no rail.
        rail: Least and greatest place on the rail, mm.
        rides: Whether the arm was told of its rail.
        lifts: Those of jumps that are on their way to the arm.
    """

    joints: Joints
    bias: c.EndEffectorParams
    slack: float = 0.0
    heading: float | None = None
    rail: Span = (0.0, 0.0)
    rides: bool = False
    lifts: frozenset[Lift] = frozenset()

    @property
    def kinematics(self) -> Kinematics:
        """The geometry with its end effector."""
        return kinematics_of(self.bias)

    @property
    def tool(self) -> XYZ:
        """The place of the tool, in the middle of where the rail may be."""
        (place,) = shifted([self.kinematics.forward(*self.joints)[:3]], self.heading, [sum(self.rail) / 2])
        return place

    @property
    def region(self) -> Region:
        """Where the tool is."""
        return self.along([self.kinematics.forward(*self.joints)[:3]], self.rail)

    def along(self, places: Sequence[XYZ], rail: Span) -> Region:
        """Where the tool comes along while the rail goes from one of its places to another."""
        if rail[0] == rail[1]:
            return Points(shifted(places, self.heading, [rail[0]]), self.slack)

        radius = max(math.hypot(x, y) for x, y, _ in places)
        return Discs(centres(self.heading, rail), radius + self.slack + STEP)

    def near(self, other: MagicianStance) -> bool:
        """Return whether another one is the same, but for what numbers lose on the line."""
        return (
            math.dist(self.joints, other.joints) < SAME
            and math.dist(numbers(self.bias), numbers(other.bias)) < SAME
            and math.dist(self.rail, other.rail) < SAME
        )


def numbers(bias: c.EndEffectorParams) -> XYZ:
    """The offset of an end effector."""
    return bias.x_bias, bias.y_bias, bias.z_bias


def kinematics_of(bias: c.EndEffectorParams) -> Kinematics:
    """The geometry with an end effector."""
    return Kinematics(*numbers(bias))


def shifted(places: Sequence[XYZ], heading: float | None, rail: Sequence[float]) -> tuple[XYZ, ...]:
    """Places of the arm, from each of these places on its rail."""
    if heading is None:
        return tuple(places)

    cos, sin = math.cos(math.radians(heading)), math.sin(math.radians(heading))
    return tuple((x + at * cos, y + at * sin, z) for at in dict.fromkeys(rail) for x, y, z in places)


def centres(heading: float | None, rail: Span) -> tuple[tuple[float, float], ...]:
    """Where the arm itself stands on a part of its rail, at most a STEP apart."""
    steps = max(1, math.ceil((rail[1] - rail[0]) / STEP))
    along = [rail[0] + (rail[1] - rail[0]) * step / steps for step in range(steps + 1)]
    return tuple((x, y) for x, y, _ in shifted([(0.0, 0.0, 0.0)], heading, along))
