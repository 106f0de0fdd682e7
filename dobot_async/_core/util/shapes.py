"""Boxes and upright cylinders, mm: in the frame of a cell, or in the coordinates of one arm."""

from __future__ import annotations

import math
from dataclasses import dataclass

__all__ = ["Box", "Cylinder", "Shape"]

Span = tuple[float, float]
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
        """Returns whether a place is inside, or outside by at most `margin` mm along an axis."""
        return all(
            low - margin <= value <= high + margin for value, (low, high) in ((x, self.x), (y, self.y), (z, self.z))
        )

    def distance(self, x: float, y: float) -> float:
        """Returns how far it is from a vertical line, mm; 0 for a line that goes through it."""
        ways = (max(low - value, value - high, 0.0) for value, (low, high) in ((x, self.x), (y, self.y)))
        return math.hypot(*ways)


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
        """Returns whether a place is inside, or outside by at most `margin` mm."""
        low, high = self.z
        return math.hypot(x - self.x, y - self.y) <= self.radius + margin and low - margin <= z <= high + margin

    def distance(self, x: float, y: float) -> float:
        """Returns how far it is from a vertical line, mm; 0 for a line that goes through it."""
        return max(0.0, math.hypot(x - self.x, y - self.y) - self.radius)


Shape = Box | Cylinder
