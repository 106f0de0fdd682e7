"""Boxes and upright cylinders, mm: in the frame of a cell, or in the coordinates of one arm."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

__all__ = ["XYZ", "Box", "Cylinder", "Shape"]

Span = tuple[float, float]
XYZ = tuple[float, float, float]
EVERYWHERE: Span = (-math.inf, math.inf)


def check_span(name: str, span: Span) -> None:
    """Raises ValueError unless it goes from a lower number to a higher one."""
    low, high = span
    if not low < high:
        raise ValueError(f"{name} goes from a lower number to a higher one, not from {low:g} to {high:g}")


@dataclass(frozen=True, slots=True)
class Box:
    """A box along the axes.

    Attributes:
        x: Lowest and highest, mm.
        y: Lowest and highest, mm.
        z: Lowest and highest, mm.
    """

    x: Span = EVERYWHERE
    y: Span = EVERYWHERE
    z: Span = EVERYWHERE

    def __post_init__(self) -> None:
        for name in ("x", "y", "z"):
            check_span(name, getattr(self, name))

    def contains(self, x: float, y: float, z: float, margin: float = 0.0) -> bool:
        """Returns whether a place is inside, or outside by at most `margin` mm along an axis.

        Args:
            x: mm.
            y: mm.
            z: mm.
            margin: mm, 0 or more.
        """
        return all(
            low - margin <= value <= high + margin for value, (low, high) in ((x, self.x), (y, self.y), (z, self.z))
        )

    def distance(self, x: float, y: float) -> float:
        """Returns how far it is from a vertical line, mm; 0 for a line that goes through it.

        Args:
            x: Of the line, mm.
            y: Of the line, mm.
        """
        ways = (max(low - value, value - high, 0.0) for value, (low, high) in ((x, self.x), (y, self.y)))
        return math.hypot(*ways)

    def outside(self, place: XYZ) -> float:
        """Returns how far a place is from it, mm; below 0 inside: how far it is to the surface."""
        ways = [beyond(value, span) for value, span in zip(place, (self.x, self.y, self.z), strict=True)]
        return math.hypot(*(max(0.0, way) for way in ways)) or max(ways)

    def stretch(self, start: XYZ, end: XYZ, margin: float = 0.0) -> Span | None:
        """Returns the part of a line that lies in it, as shares of the line; None if it misses.

        Args:
            start: Where the line begins.
            end: Where it ends.
            margin: mm by which the shape is grown; below 0 it is shrunk.
        """
        return common(
            slab(a, b, (low - margin, high + margin))
            for a, b, (low, high) in zip(start, end, (self.x, self.y, self.z), strict=True)
        )

    def __str__(self) -> str:
        return (
            f"Box({', '.join(said(name, getattr(self, name)) for name in 'xyz' if getattr(self, name) != EVERYWHERE)})"
        )


@dataclass(frozen=True, slots=True)
class Cylinder:
    """An upright cylinder.

    Attributes:
        x: Of its axis, mm.
        y: Of its axis, mm.
        radius: mm.
        z: Lowest and highest, mm.
    """

    x: float
    y: float
    radius: float
    z: Span = EVERYWHERE

    def __post_init__(self) -> None:
        if not (self.radius > 0 and math.isfinite(self.x) and math.isfinite(self.y)):
            raise ValueError(f"a cylinder has an axis and a radius above 0, not {self}")

        check_span("z", self.z)

    def contains(self, x: float, y: float, z: float, margin: float = 0.0) -> bool:
        """Returns whether a place is inside, or outside by at most `margin` mm.

        Args:
            x: mm.
            y: mm.
            z: mm.
            margin: mm, 0 or more.
        """
        low, high = self.z
        return math.hypot(x - self.x, y - self.y) <= self.radius + margin and low - margin <= z <= high + margin

    def distance(self, x: float, y: float) -> float:
        """Returns how far it is from a vertical line, mm; 0 for a line that goes through it.

        Args:
            x: Of the line, mm.
            y: Of the line, mm.
        """
        return max(0.0, math.hypot(x - self.x, y - self.y) - self.radius)

    def outside(self, place: XYZ) -> float:
        """Returns how far a place is from it, mm; below 0 inside: how far it is to the surface."""
        x, y, z = place
        ways = math.hypot(x - self.x, y - self.y) - self.radius, beyond(z, self.z)
        return math.hypot(*(max(0.0, way) for way in ways)) or max(ways)

    def stretch(self, start: XYZ, end: XYZ, margin: float = 0.0) -> Span | None:
        """Returns the part of a line that lies in it, as shares of the line; see `Box.stretch`.

        Args:
            start: Where the line begins.
            end: Where it ends.
            margin: mm by which the shape is grown; below 0 it is shrunk.
        """
        low, high = self.z
        upright = slab(start[2], end[2], (low - margin, high + margin))
        return common((upright, self._disc(start, end, self.radius + margin)))

    def _disc(self, start: XYZ, end: XYZ, radius: float) -> Span | None:
        """The part of a line that lies in the cylinder, were it endless: where a square equation is at most 0."""
        x, y = start[0] - self.x, start[1] - self.y
        dx, dy = end[0] - start[0], end[1] - start[1]
        square, half, rest = dx * dx + dy * dy, x * dx + y * dy, x * x + y * y - radius * radius
        if radius < 0:
            return None

        if not square:
            return (0.0, 1.0) if rest <= 0 else None

        root = half * half - square * rest
        if root < 0:
            return None

        return (-half - math.sqrt(root)) / square, (-half + math.sqrt(root)) / square

    def __str__(self) -> str:
        z = "" if self.z == EVERYWHERE else f", {said('z', self.z)}"
        return f"Cylinder({self.x:g}, {self.y:g}, {self.radius:g}{z})"


Shape = Box | Cylinder


def beyond(value: float, span: Span) -> float:
    """How far a number is out of a span; below 0 inside."""
    return max(span[0] - value, value - span[1])


def slab(start: float, end: float, span: Span) -> Span | None:
    """The shares of the way between two numbers that lie in a span."""
    low, high = span
    if start == end:
        return (0.0, 1.0) if low <= start <= high else None

    first, last = sorted(((low - start) / (end - start), (high - start) / (end - start)))
    return (first, last) if low <= high else None


def common(parts: Iterable[Span | None]) -> Span | None:
    """What several parts of a line have in common, within its ends."""
    first, last = 0.0, 1.0
    for part in parts:
        if part is None:
            return None

        first, last = max(first, part[0]), min(last, part[1])

    return (first, last) if first <= last else None


def said(name: str, span: Span) -> str:
    """A span as it is written."""
    return f"{name}=({span[0]:g}, {span[1]:g})"
