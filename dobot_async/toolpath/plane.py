"""A work plane: where the paper lies, in the arm's coordinates.

          y ^        lift  mm above the paper in which the tool travels
origin      |        press mm below the paper at full pressure (for a pen on a spring)
  o---------+--> x   height, positive above the paper: along x cross y

The plane may lie aslant, but not upright.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple, Self, SupportsFloat, cast

from dobot_async._core.util.arguments import check_duration, to_float
from dobot_async.toolpath.stroke import Point

__all__ = ["OnPlane", "Place", "WorkPlane"]

Place = tuple[float, float, float]
SQUARE = 5.0  # degrees by which taught corners may be off a right angle
LEAST = 1.0  # mm between two taught corners
STEEP = 0.1  # of a millimetre of height that a millimetre along the plane's upright is; a wall cannot be drawn on


class OnPlane(NamedTuple):
    """A place seen from a work plane, mm."""

    x: float
    y: float
    height: float


@dataclass(frozen=True, slots=True)
class WorkPlane:
    """Where the paper lies.

    Attributes:
        origin: The arm's x, y, z of the plane's origin, on the paper, mm.
        x_axis: The direction of the plane's x, of any length.
        y_axis: The direction of the plane's y; what of it is along x is left out.
        lift: mm above the paper in which the tool travels.
        press: mm below the paper to which full pressure brings it; less pressure less, 0 to the paper.

    Raises:
        ValueError: The directions are no plane, or seen from above they are a mirror image: x and y exchanged.
    """

    origin: Place
    x_axis: Place = (1.0, 0.0, 0.0)
    y_axis: Place = (0.0, 1.0, 0.0)
    lift: float = 5.0
    press: float = 0.0

    def __post_init__(self) -> None:
        origin, x, y = (
            place_of(value, name)
            for value, name in ((self.origin, "origin"), (self.x_axis, "x_axis"), (self.y_axis, "y_axis"))
        )
        along = scaled(x, length(x), "x_axis")
        share = dot(y, along)
        aside = (y[0] - share * along[0], y[1] - share * along[1], y[2] - share * along[2])
        if length(aside) < 1e-6 * length(y):
            raise ValueError("x_axis and y_axis point the same way")

        across = scaled(aside, length(aside), "y_axis")
        if cross(along, across)[2] < STEEP:
            raise ValueError(
                "seen from above, y must point to the left of x: with these directions the drawing would be a mirror "
                "image, or stand upright; exchange the two corners"
            )

        for name, value in (("origin", origin), ("x_axis", along), ("y_axis", across)):
            object.__setattr__(self, name, value)

        object.__setattr__(self, "lift", check_duration(self.lift, "lift"))
        object.__setattr__(self, "press", check_duration(self.press, "press"))

    @classmethod
    def flat(
        cls,
        x: SupportsFloat,
        y: SupportsFloat,
        z: SupportsFloat,
        *,
        rotation: SupportsFloat = 0.0,
        lift: float = 5.0,
        press: float = 0.0,
    ) -> Self:
        """Return a level plane.

        Args:
            x: Of the origin, mm of the arm.
            y: Of the origin.
            z: The height of the paper.
            rotation: Degrees by which the plane's x is turned to the left of the arm's. With -90 the drawing stands
                upright for who sits opposite of the arm's front, 90 for who stands behind the arm.
            lift: mm above the paper in which the tool travels.
            press: mm below the paper at full pressure.
        """
        angle = math.radians(to_float(rotation, "rotation"))
        axes = (math.cos(angle), math.sin(angle), 0.0), (-math.sin(angle), math.cos(angle), 0.0)
        return cls((float(x), float(y), float(z)), *axes, lift=lift, press=press)

    @classmethod
    def from_corners(
        cls, origin: object, along_x: object, along_y: object, *, lift: float = 5.0, press: float = 0.0
    ) -> Self:
        """Return the plane through three corners of the paper that the arm was taught, touching it.

        Args:
            origin: Where the plane's origin is to be: a pose of the arm, or x, y, z in mm.
            along_x: Another corner, in the direction of x.
            along_y: Another corner, in the direction of y. Where the angle is no right one, x counts.
            lift: mm above the paper in which the tool travels.
            press: mm below the paper at full pressure.

        Raises:
            ValueError: Two corners are nearer than 1 mm, or the angle is more than 5 degrees off a right one.
        """
        corner, x, y = place_of(origin, "origin"), place_of(along_x, "along_x"), place_of(along_y, "along_y")
        sides = minus(x, corner), minus(y, corner)
        if min(map(length, sides)) < LEAST:
            raise ValueError(f"the corners must be {LEAST:g} mm apart or more")

        angle = math.degrees(math.acos(max(-1.0, min(1.0, dot(*sides) / (length(sides[0]) * length(sides[1]))))))
        if abs(angle - 90) > SQUARE:
            raise ValueError(f"the corners make an angle of {angle:.1f} degrees at the origin, not of 90")

        return cls(corner, *sides, lift=lift, press=press)

    @property
    def normal(self) -> Place:
        """The direction away from the paper."""
        return cross(self.x_axis, self.y_axis)

    def to_arm(self, x: float, y: float, height: float = 0.0) -> Place:
        """Return the arm's x, y, z of a place on the plane, or `height` mm above it.

        Args:
            x: mm, from the plane's origin.
            y: mm, from the plane's origin.
            height: mm away from the paper; below 0 into it.
        """
        along, across, up = self.x_axis, self.y_axis, self.normal
        return (
            self.origin[0] + x * along[0] + y * across[0] + height * up[0],
            self.origin[1] + x * along[1] + y * across[1] + height * up[1],
            self.origin[2] + x * along[2] + y * across[2] + height * up[2],
        )

    def to_plane(self, x: float, y: float, z: float) -> OnPlane:
        """Return where a place of the arm is on the plane, and how high above it.

        Args:
            x: mm, as the arm counts.
            y: mm.
            z: mm.
        """
        off = minus((x, y, z), self.origin)
        return OnPlane(dot(off, self.x_axis), dot(off, self.y_axis), dot(off, self.normal))

    def pressed(self, point: Point, power: float) -> Place:
        """Return where the tool is at a point, with a pressure in percent."""
        return self.to_arm(*point, -self.press * power / 100)


def place_of(value: object, name: str) -> Place:
    """A pose, or three numbers."""
    numbers = (
        (getattr(value, axis) for axis in "xyz") if hasattr(value, "x") else cast("Iterable[SupportsFloat]", value)
    )
    found = tuple(to_float(number, name) for number in numbers)
    if len(found) != 3 or not all(map(math.isfinite, found)):
        raise ValueError(f"{name} must be x, y and z in finite mm, not {value!r}")

    return found


def minus(a: Place, b: Place) -> Place:
    """The difference."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def dot(a: Place, b: Place) -> float:
    """The scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Place, b: Place) -> Place:
    """The vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def length(a: Place) -> float:
    """How long it is."""
    return math.sqrt(dot(a, a))


def scaled(a: Place, by: float, name: str) -> Place:
    """A direction of length 1."""
    if not by > 0:
        raise ValueError(f"{name} must not be 0")

    return a[0] / by, a[1] / by, a[2] / by
