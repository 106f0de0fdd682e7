"""Ways in space: straight lines and circles, by the share of the way that is done. Knows no speed and no arm.

A point is x, y, z (mm) and then any number of angles (degrees), which go along evenly.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

from dobot_async.simulator.device.work import DeviceFault, Vector

__all__ = ["SAME_PLACE", "Arc", "Curve", "LineSegment", "arc", "between", "circle"]

REPEATED_POINTS, BAD_ARC = 0x13, 0x14
COLLINEAR = 1e-6  # sine of the angle below which three points are one line
SAME_PLACE = 1e-3
"""Points nearer than this (mm) are the same; float32 points that mean the same differ by less."""


class Curve(Protocol):
    """A way in space."""

    @property
    def length(self) -> float:
        """The way of the tool in mm."""
        ...

    @property
    def turn(self) -> float:
        """The way of that angle, in degrees, that turns most."""
        ...

    def point(self, share: float) -> Vector:
        """Returns the point at a share, 0 to 1, of the way."""
        ...


@dataclass(frozen=True, slots=True)
class LineSegment:
    """Straight from one point to another."""

    start: Vector
    end: Vector

    @property
    def length(self) -> float:
        """Distance in mm."""
        return math.dist(self.start[:3], self.end[:3])

    @property
    def turn(self) -> float:
        """Degrees."""
        return largest_turn(self.start, self.end)

    def point(self, share: float) -> Vector:
        """Returns the point at a share of the way."""
        return between(self.start, self.end, share)


@dataclass(frozen=True, slots=True)
class Arc:
    """Part of a circle, or several turns of it; made by `arc` and `circle`.

    Attributes:
        start: Where it begins.
        end: Where its angles lead to.
        centre: Of the circle.
        ahead: From the centre to the start; as long as the radius.
        aside: As long, a quarter of a turn on.
        sweep: Radians in all.
    """

    start: Vector
    end: Vector
    centre: Vector
    ahead: Vector
    aside: Vector
    sweep: float

    @property
    def length(self) -> float:
        """Radius times sweep, in mm."""
        return math.hypot(*self.ahead) * self.sweep

    @property
    def turn(self) -> float:
        """Degrees."""
        return largest_turn(self.start, self.end)

    def point(self, share: float) -> Vector:
        """Returns the point at a share of the way."""
        cos, sin = math.cos(share * self.sweep), math.sin(share * self.sweep)
        place = (c + cos * a + sin * b for c, a, b in zip(self.centre, self.ahead, self.aside, strict=True))
        return (*place, *between(self.start[3:], self.end[3:], share))


def arc(start: Vector, through: Vector, end: Vector) -> Arc:
    """Returns the arc from `start` through a second point to `end`.

    Raises:
        Fault: 0x13 if two of the points are the same, 0x14 if all three are on one line.
    """
    first, last = minus(through, start), minus(end, start)
    if min(math.hypot(*first), math.hypot(*last), math.dist(through[:3], end[:3])) < SAME_PLACE:
        raise DeviceFault(REPEATED_POINTS)

    normal = cross(first, last)
    square = dot(normal, normal)
    if math.sqrt(square) < COLLINEAR * math.hypot(*first) * math.hypot(*last):
        raise DeviceFault(BAD_ARC)

    weighted = tuple(dot(first, first) * b - dot(last, last) * a for a, b in zip(first, last, strict=True))
    to_centre = tuple(value / (2 * square) for value in cross(weighted, normal))
    ahead = tuple(-value for value in to_centre)
    aside = tuple(value / math.sqrt(square) for value in cross(normal, ahead))
    to_end = minus(last, to_centre)
    sweep = math.atan2(dot(to_end, aside), dot(to_end, ahead)) % math.tau
    return Arc(start, end, tuple(a + b for a, b in zip(start[:3], to_centre, strict=True)), ahead, aside, sweep)


def circle(start: Vector, through: Vector, end: Vector, count: int) -> Arc:
    """Returns `count` turns of the circle through three points, passing them in this order; the angles stay.

    Raises:
        Fault: As `arc`.
    """
    part = arc(start, through, end)
    return Arc(start, start, part.centre, part.ahead, part.aside, math.tau * count)


def between(a: Vector, b: Vector, share: float) -> Vector:
    """The vector at a share of the way from one to another; exact at both ends."""
    if share >= 1:
        return b

    return tuple(p + (q - p) * share for p, q in zip(a, b, strict=True))


def largest_turn(a: Vector, b: Vector) -> float:
    """By how many degrees that angle of two points differs that differs most."""
    return max((abs(q - p) for p, q in zip(a[3:], b[3:], strict=True)), default=0.0)


def minus(a: Vector, b: Vector) -> Vector:
    """The way from b to a, in space."""
    return tuple(p - q for p, q in zip(a[:3], b[:3], strict=True))


def dot(a: Vector, b: Vector) -> float:
    """Scalar product."""
    return sum(p * q for p, q in zip(a, b, strict=True))


def cross(a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
