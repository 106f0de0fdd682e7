"""A toolpath: strokes on a work plane, in the order in which they are drawn. Immutable; mm, x to the right, y up."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Literal, SupportsFloat

from dobot_async._core.util.arguments import check_choice, check_duration, to_float
from dobot_async.toolpath.ordering import merged, ordered, travel_of
from dobot_async.toolpath.simplify import simplified
from dobot_async.toolpath.splitting import split_stroke
from dobot_async.toolpath.stroke import Bounds, Matrix, Point, Stroke

__all__ = ["Toolpath"]

MEETING = 0.01  # mm; nearer ends than this are drawn as one by any pen


@dataclass(frozen=True, slots=True)
class Toolpath:
    """What is to be drawn. Each method returns another toolpath, and leaves this one as it is.

    Attributes:
        strokes: In their order; between two of them the tool is up, or the laser off.
    """

    strokes: tuple[Stroke, ...] = ()

    def __post_init__(self) -> None:
        strokes = tuple(self.strokes)
        for stroke in strokes:
            if not isinstance(stroke, Stroke):
                raise TypeError(f"a toolpath consists of Strokes, not of {stroke!r}")

        object.__setattr__(self, "strokes", strokes)

    @classmethod
    def of(cls, *lines: Iterable[Point], power: float = 100.0) -> Toolpath:
        """Return a toolpath of lines, each given by its points (x, y) in mm.

        Args:
            *lines: Each a series of points, one at least.
            power: Percent of the laser's power, or of the pen's pressure: 0 to 100.

        Raises:
            ValueError: A line has no point, or a number is out of range.
        """
        return cls(tuple(Stroke(tuple(line), power) for line in lines))

    def __len__(self) -> int:
        return len(self.strokes)

    def __iter__(self) -> Iterator[Stroke]:
        return iter(self.strokes)

    def __add__(self, other: Toolpath) -> Toolpath:
        return Toolpath(self.strokes + other.strokes) if isinstance(other, Toolpath) else NotImplemented

    @property
    def bounds(self) -> Bounds:
        """What it lies within.

        Raises:
            ValueError: There is no stroke.
        """
        if not self.strokes:
            raise ValueError("a toolpath without strokes has no bounds")

        each = [stroke.bounds for stroke in self.strokes]
        return Bounds(
            min(b.left for b in each), min(b.bottom for b in each), max(b.right for b in each), max(b.top for b in each)
        )

    @property
    def points(self) -> int:
        """How many points it has in all."""
        return sum(len(stroke.points) for stroke in self.strokes)

    @property
    def length(self) -> float:
        """How long all strokes are together, mm."""
        return sum(stroke.length for stroke in self.strokes)

    @property
    def travel(self) -> float:
        """How far the tool goes between the strokes, mm."""
        return travel_of(self.strokes, None)

    @property
    def layers(self) -> tuple[str, ...]:
        """The layers that occur, in the order of their first strokes."""
        return tuple(dict.fromkeys(stroke.layer for stroke in self.strokes))

    def only(self, *layers: str) -> Toolpath:
        """Return the strokes of some layers; raise ValueError for a layer that there is not.

        Args:
            *layers: Their names; see `layers`.
        """
        missing = set(layers) - set(self.layers)
        if missing:
            raise ValueError(f"no layer {min(missing)!r}; there are: {', '.join(map(repr, self.layers))}")

        return self._each(stroke for stroke in self.strokes if stroke.layer in layers)

    def with_power(self, power: float) -> Toolpath:
        """Return it with one power, in percent, for all strokes.

        Raises:
            ValueError: It is not in 0 to 100.
        """
        return self._each(replace(stroke, power=power) for stroke in self.strokes)

    def with_speed(self, speed: float | None) -> Toolpath:
        """Return it with one speed, in mm/s, for all strokes; None leaves it to who draws.

        Raises:
            ValueError: It is not above 0.
        """
        return self._each(replace(stroke, speed=speed) for stroke in self.strokes)

    # Maps.

    def translate(self, x: SupportsFloat = 0.0, y: SupportsFloat = 0.0) -> Toolpath:
        """Return it moved by so many mm.

        Args:
            x: mm, to the right.
            y: mm, up.

        Raises:
            ValueError: A number is not finite.
        """
        return self.transform(Matrix(1, 0, 0, 1, finite(x, "x"), finite(y, "y")))

    def scale(self, x: SupportsFloat, y: SupportsFloat | None = None, *, about: Point = (0.0, 0.0)) -> Toolpath:
        """Return it as many times as large; negative factors mirror.

        Args:
            x: Factor along x.
            y: Factor along y; that along x by default.
            about: The point that stays.

        Raises:
            ValueError: A factor is 0, or not finite.
        """
        across = finite(x, "x")
        up = across if y is None else finite(y, "y")
        if not across or not up:
            raise ValueError("a toolpath cannot be scaled by 0")

        return self.transform(Matrix(across, 0, 0, up, 0, 0).about(about))

    def rotate(self, degrees: SupportsFloat, *, about: Point = (0.0, 0.0)) -> Toolpath:
        """Return it turned to the left by so many degrees, about a point that stays.

        Args:
            degrees: To the left; negative ones to the right.
            about: The point that stays, mm.

        Raises:
            ValueError: It is not finite.
        """
        angle = math.radians(math.remainder(finite(degrees, "degrees"), 360))
        cos, sin = math.cos(angle), math.sin(angle)
        return self.transform(Matrix(cos, sin, -sin, cos, 0, 0).about(about))

    def mirror(self, axis: Literal["x", "y"], *, about: Point = (0.0, 0.0)) -> Toolpath:
        """Return it mirrored: "x" turns right and left, "y" top and bottom round.

        Args:
            axis: The axis whose coordinates change their sign.
            about: A point of the line that stays, mm.

        Raises:
            ValueError: The axis is another one.
        """
        check_choice("axis", axis, "x", "y")
        matrix = Matrix(-1, 0, 0, 1, 0, 0) if axis == "x" else Matrix(1, 0, 0, -1, 0, 0)
        return self.transform(matrix.about(about))

    def transform(self, matrix: Matrix) -> Toolpath:
        """Return it with each point mapped by an affine map."""
        return self._each(stroke.transformed(matrix) for stroke in self.strokes)

    def fit(
        self,
        width: SupportsFloat,
        height: SupportsFloat,
        *,
        at: Point = (0.0, 0.0),
        margin: SupportsFloat = 0.0,
        rotate: bool = False,
    ) -> Toolpath:
        """Return it as large as a rectangle allows, in its middle, with its own proportions.

        Args:
            width: Of the rectangle, mm.
            height: Of the rectangle, mm.
            at: Its lower left corner.
            margin: mm that stay free on all sides.
            rotate: Turn it by a quarter if it becomes larger by that.

        Raises:
            ValueError: The margin leaves nothing of the rectangle, or there is no stroke.
        """
        free = check_duration(margin, "margin")
        across, up = finite(width, "width") - 2 * free, finite(height, "height") - 2 * free
        if not (across > 0 and up > 0):
            raise ValueError(f"nothing is left of {width} x {height} mm with a margin of {free:g} mm")

        bounds = self.bounds
        if rotate and (bounds.width > bounds.height) != (across > up) and bounds.width != bounds.height:
            return self.rotate(90).fit(width, height, at=at, margin=margin)

        ratios = [have / need for have, need in ((across, bounds.width), (up, bounds.height)) if need > 0]
        factor = min(ratios, default=1.0)
        x, y = bounds.centre
        to_x, to_y = at[0] + free + across / 2, at[1] + free + up / 2
        return self.transform(Matrix(factor, 0, 0, factor, to_x - factor * x, to_y - factor * y))

    # Fewer points, less travel.

    def simplify(self, tolerance: SupportsFloat) -> Toolpath:
        """Return it with fewer points, none of which is missed by more than `tolerance` mm.

        Raises:
            ValueError: It is below 0, or not finite.
        """
        most = check_duration(tolerance, "tolerance")
        return self._each(simplified(stroke, most) for stroke in self.strokes)

    def merge(self, tolerance: SupportsFloat = MEETING, *, reverse: bool = True) -> Toolpath:
        """Return it with strokes that meet drawn as one: those of the same speed and layer.

        Args:
            tolerance: mm between two ends that count as one; the gap is drawn.
            reverse: Whether strokes may be drawn the other way round.
        """
        return self._each(merged(self.strokes, check_duration(tolerance, "tolerance"), reverse=bool(reverse)))

    def order(
        self, *, start: Point | None = None, merge: SupportsFloat | None = MEETING, reverse: bool = True
    ) -> Toolpath:
        """Return it in an order with little travel, never with more than now.

        Args:
            start: Where the tool comes from; None begins with the first stroke.
            merge: mm between two ends that count as one, so that the strokes become one; None merges none.
            reverse: Whether strokes may be drawn the other way round.
        """
        path = self if merge is None else self.merge(merge, reverse=reverse)
        return self._each(ordered(path.strokes, start, reverse=bool(reverse)))

    def split(self, inside: Callable[[float, float], object], *, step: float = 1.0) -> tuple[Toolpath, Toolpath]:
        """Return what lies inside of something, and what does not; strokes that cross its edge are cut there.

        Args:
            inside: Told x and y in mm, returns something true inside.
            step: mm between two looks on a straight way. The edge is found to 0.001 mm.
        """
        if not 0 < to_float(step, "step") < math.inf:
            raise ValueError(f"step must be above 0 mm and finite, not {step!r}")

        parts: dict[bool, list[Stroke]] = {True: [], False: []}
        for stroke in self.strokes:
            for part, is_inside in split_stroke(stroke, lambda point: bool(inside(*point)), float(step)):
                parts[is_inside].append(part)

        return self._each(parts[True]), self._each(parts[False])

    def _each(self, strokes: Iterable[Stroke]) -> Toolpath:
        return Toolpath(tuple(strokes))


def finite(value: SupportsFloat, name: str) -> float:
    """A finite number."""
    found = to_float(value, name)
    if not math.isfinite(found):
        raise ValueError(f"{name} must be finite, not {value!r}")

    return found
