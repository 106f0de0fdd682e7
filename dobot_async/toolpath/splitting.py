"""Cuts strokes at the edge of a region that is only known by a predicate."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

from dobot_async.toolpath.stroke import Point, Stroke, distance

__all__ = ["split_stroke"]

EDGE = 0.001  # mm; the cut is on the side on which the point is looked at last


def split_stroke(stroke: Stroke, inside: Callable[[Point], bool], step: float) -> Iterator[tuple[Stroke, bool]]:
    """Yield the parts of a stroke in their order, each with whether it lies inside."""
    state = inside(stroke.start)
    points, powers = [stroke.start], [stroke.powers[0]]
    for a, b, power in stroke.ways():
        count = max(1, math.ceil(distance(a, b) / step))
        here = a
        for look in range(1, count + 1):
            there = b if look == count else along(a, b, look / count)
            after = inside(there)
            if after != state:
                mine, others = edge(here, there, inside, state)
                points.append(mine)
                powers.append(power)
                yield stroke.part(points, powers).without_repeats(), state
                points, powers, state = [others], [power], after

            here = there

        if points[-1] != b:
            points.append(b)
            powers.append(power)

    yield stroke.part(points, powers), state


def edge(a: Point, b: Point, inside: Callable[[Point], bool], state: bool) -> tuple[Point, Point]:
    """The last point as a is, and the first that is not, on the way from a to b."""
    while distance(a, b) > EDGE:
        middle = along(a, b, 0.5)
        if middle in {a, b}:
            break

        a, b = (middle, b) if inside(middle) == state else (a, middle)

    return a, b


def along(a: Point, b: Point, share: float) -> Point:
    """The point after so much of the way."""
    return a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])
