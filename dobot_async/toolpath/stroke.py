"""A stroke: the points that the tool goes through without being lifted. Immutable; mm on a work plane."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple, SupportsFloat

from dobot_async._core.util.arguments import to_float

__all__ = ["Bounds", "Matrix", "Point", "Stroke", "distance"]

Point = tuple[float, float]
FULL = 100.0  # percent


class Bounds(NamedTuple):
    """A rectangle on the work plane, mm."""

    left: float
    bottom: float
    right: float
    top: float

    @property
    def width(self) -> float:
        """From left to right, mm."""
        return self.right - self.left

    @property
    def height(self) -> float:
        """From bottom to top, mm."""
        return self.top - self.bottom

    @property
    def centre(self) -> Point:
        """The middle."""
        return (self.left + self.right) / 2, (self.bottom + self.top) / 2


class Matrix(NamedTuple):
    """An affine map: x' = a x + c y + e, y' = b x + d y + f."""

    a: float
    b: float
    c: float
    d: float
    e: float
    f: float

    def __call__(self, point: Point, /) -> Point:
        """Return a point, mapped."""
        x, y = point
        return self.a * x + self.c * y + self.e, self.b * x + self.d * y + self.f

    def about(self, centre: Point) -> Matrix:
        """Return the map with another point in the place of the origin."""
        x, y = self((-centre[0], -centre[1]))
        return self._replace(e=x + centre[0], f=y + centre[1])


@dataclass(frozen=True, slots=True)
class Stroke:
    """One stroke. A stroke of one point is a dot.

    Attributes:
        points: Where the tool goes, with the tool down from the first point on.
        power: Percent of the laser's power, or of the pen's pressure: one number for the stroke, or one for each point,
            which holds on the way to it. The first point's is that of the second, for no way leads to it.
        speed: mm/s; None leaves it to who draws.
        layer: What the file calls the part that it is of.

    Raises:
        ValueError: There is no point, a number is not finite, or a power is not in 0 to 100.
    """

    points: tuple[Point, ...]
    power: float | tuple[float, ...] = FULL
    speed: float | None = None
    layer: str = ""

    def __post_init__(self) -> None:
        points = tuple((float(x), float(y)) for x, y in self.points)
        if not points:
            raise ValueError("a stroke has at least one point")

        for number, point in enumerate(points):
            if not (math.isfinite(point[0]) and math.isfinite(point[1])):
                raise ValueError(f"point {number} of a stroke must be finite, not {point}")

        if self.speed is not None and not 0 < to_float(self.speed, "speed") < math.inf:
            raise ValueError(f"speed must be above 0 mm/s and finite, not {self.speed!r}")

        object.__setattr__(self, "points", points)
        object.__setattr__(self, "power", checked_power(self.power, len(points)))

    @property
    def powers(self) -> tuple[float, ...]:
        """The power on the way to each point."""
        return self.power if isinstance(self.power, tuple) else (self.power,) * len(self.points)

    @property
    def start(self) -> Point:
        """The first point."""
        return self.points[0]

    @property
    def end(self) -> Point:
        """The last point."""
        return self.points[-1]

    @property
    def closed(self) -> bool:
        """Whether it ends where it begins."""
        return len(self.points) > 2 and self.start == self.end

    @property
    def length(self) -> float:
        """How long it is, mm."""
        return sum(map(distance, self.points, self.points[1:]))

    @property
    def bounds(self) -> Bounds:
        """What it lies within."""
        xs, ys = zip(*self.points, strict=True)
        return Bounds(min(xs), min(ys), max(xs), max(ys))

    def reversed(self) -> Stroke:
        """Return it the other way round; each way keeps its power."""
        power: float | tuple[float, ...] = self.power
        if isinstance(power, tuple):
            power = (power[-1], *power[:0:-1])

        return replace(self, points=self.points[::-1], power=power)

    def transformed(self, matrix: Matrix) -> Stroke:
        """Return it with each point mapped."""
        return replace(self, points=tuple(matrix(point) for point in self.points))

    def part(self, points: Sequence[Point], power: Sequence[float]) -> Stroke:
        """Return a stroke like it, through other points."""
        return replace(self, points=tuple(points), power=tuple(power))

    def without_repeats(self, least: float = 0.0) -> Stroke:
        """Return it without points that are no further than `least` mm from the one before."""
        points, powers = [self.start], [self.powers[0]]
        for point, power in zip(self.points[1:], self.powers[1:], strict=True):
            if distance(points[-1], point) > least:
                points.append(point)
                powers.append(power)
        return self if len(points) == len(self.points) else self.part(points, powers)

    def ways(self) -> Iterator[tuple[Point, Point, float]]:
        """The straight ways that it consists of, each with its power."""
        for (a, b), power in zip(pairwise(self.points), self.powers[1:], strict=True):
            yield a, b, power


def distance(a: Point, b: Point) -> float:
    """How far two points are apart."""
    return math.hypot(b[0] - a[0], b[1] - a[1])


def checked_power(power: SupportsFloat | Iterable[SupportsFloat], count: int) -> float | tuple[float, ...]:
    """The power of so many points; one number where all are the same."""
    if not isinstance(power, Iterable):
        return percent(power)

    powers = tuple(map(percent, power))
    if len(powers) != count:
        raise ValueError(f"power has one number for each of the {count} points, or one for all, not {len(powers)}")

    if count > 1:
        powers = (powers[1], *powers[1:])

    return powers[0] if len(set(powers)) == 1 else powers


def percent(power: SupportsFloat) -> float:
    """A power."""
    found = to_float(power, "power")
    if not 0 <= found <= FULL:
        raise ValueError(f"power must be 0 to 100 percent, not {power!r}")

    return found
