"""Placements about the vertical and upright boxes: where things stand, and what a way runs into. Pure arithmetic.

    Placement.then(other)      other, seen from this placement --> the same, seen from where this one is seen from
    Placement.locate(other)    the other way round

Lengths are mm, angles degrees.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

__all__ = ["Place3", "Placement", "Solid"]

Place3 = tuple[float, float, float]
SKIN = 0.1  # mm; what touches a side is not inside
NOISE = 1e-6


class Placement(NamedTuple):
    """A place in the scene: x, y, z, and how far it is turned to the left about the vertical."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    yaw: float = 0.0

    @property
    def place(self) -> Place3:
        """Without the angle."""
        return self.x, self.y, self.z

    def then(self, other: Placement) -> Placement:
        """Returns what is `other` seen from here, seen from where this one is seen from."""
        cos, sin = turn(self.yaw)
        x, y = other.x * cos - other.y * sin, other.x * sin + other.y * cos
        return Placement(self.x + x, self.y + y, self.z + other.z, self.yaw + other.yaw)

    def locate(self, other: Placement) -> Placement:
        """Returns `other` as it is seen from here."""
        cos, sin = turn(self.yaw)
        ahead, aside = other.x - self.x, other.y - self.y
        return Placement(ahead * cos + aside * sin, aside * cos - ahead * sin, other.z - self.z, other.yaw - self.yaw)


def turn(degrees: float) -> tuple[float, float]:
    """Cosine and sine."""
    radians = math.radians(degrees)
    return math.cos(radians), math.sin(radians)


@dataclass(frozen=True, slots=True)
class Solid:
    """An upright box.

    Attributes:
        base: The middle of its lower face.
        size: Its length, width and height.
    """

    base: Placement
    size: Place3

    @property
    def top(self) -> float:
        """How high its upper face is."""
        return self.base.z + self.size[2]

    def covers(self, x: float, y: float) -> bool:
        """Whether a place is above or below it, or in it."""
        local = self.base.locate(Placement(x, y))
        return abs(local.x) <= self.size[0] / 2 and abs(local.y) <= self.size[1] / 2

    def is_entered(self, start: Place3, end: Place3, give: float) -> bool:
        """Returns whether a straight way leads into it, or deeper into it if it begins inside.

        Args:
            start: Where the way begins.
            end: Where it ends.
            give: mm by which the upper face may be pressed in.
        """
        if self._is_passed(start, end):
            return False

        a, b = self._inside_lengths(start, give), self._inside_lengths(end, give)
        if min(a) > 0:
            return min(b) > min(a) + NOISE

        return crosses(a, b)

    def is_crossed(self, start: Place3, end: Place3) -> float | None:
        """Returns the share of a straight way at which it meets the box, or None."""
        if self._is_passed(start, end):
            return None

        a, b = self._inside_lengths(start, 0.0), self._inside_lengths(end, 0.0)
        first, last = span(a, b)
        return first if first < last else None

    def _is_passed(self, start: Place3, end: Place3) -> bool:
        """Whether a way is clearly on one side of it; most are, and this is quick."""
        length, width, height = self.size
        reach = (length + width) / 2
        middle = self.base.x, self.base.y, self.base.z + height / 2
        return any(
            (a < at - far and b < at - far) or (a > at + far and b > at + far)
            for a, b, at, far in zip(start, end, middle, (reach, reach, height / 2), strict=True)
        )

    def _inside_lengths(self, place: Place3, give: float) -> tuple[float, ...]:
        """How far a place is behind each of the six faces; in the box all are above 0."""
        local = self.base.locate(Placement(*place))
        length, width, height = self.size
        return (
            length / 2 - SKIN + local.x,
            length / 2 - SKIN - local.x,
            width / 2 - SKIN + local.y,
            width / 2 - SKIN - local.y,
            local.z - SKIN,
            height - max(give, SKIN) - local.z,
        )


def span(a: tuple[float, ...], b: tuple[float, ...]) -> tuple[float, float]:
    """The shares of a way between which all of its lengths, which change evenly, are above 0."""
    first, last = 0.0, 1.0
    for begin, end in zip(a, b, strict=True):
        if begin <= 0 and end <= 0:
            return 1.0, 0.0

        if begin < 0 or end < 0:
            zero = begin / (begin - end)
            first, last = (max(first, zero), last) if begin < end else (first, min(last, zero))

    return first, last


def crosses(a: tuple[float, ...], b: tuple[float, ...]) -> bool:
    """Whether a way is inside anywhere."""
    first, last = span(a, b)
    return first < last
