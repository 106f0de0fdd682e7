"""Fewer points, none of which is missed by more than a tolerance (Ramer, Douglas and Peucker)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

from dobot_async.toolpath.stroke import Point, Stroke

__all__ = ["simplified"]


def simplified(stroke: Stroke, tolerance: float) -> Stroke:
    """Return a stroke with fewer points; what has another power than what lies before it keeps its beginning."""
    points, powers = stroke.points, stroke.powers
    corners = [0, *(i for i in range(1, len(points) - 1) if powers[i] != powers[i + 1]), len(points) - 1]
    kept: list[int] = [0]
    for first, last in pairwise(corners):
        kept += [number for number in between(points, first, last, tolerance) if number > first]

    return stroke.part([points[i] for i in kept], [powers[i] for i in kept]) if len(kept) < len(points) else stroke


def between(points: Sequence[Point], first: int, last: int, tolerance: float) -> list[int]:
    """The numbers of the points that are kept, in order, the two ends among them."""
    kept = {first, last}
    pairs = [(first, last)]
    while pairs:
        a, b = pairs.pop()
        furthest, far = a, tolerance
        for number in range(a + 1, b):
            off = off_way(points[number], points[a], points[b])
            if off > far:
                furthest, far = number, off
        if furthest != a:
            kept.add(furthest)
            pairs += [(a, furthest), (furthest, b)]

    return sorted(kept)


def off_way(point: Point, a: Point, b: Point) -> float:
    """How far a point is from the straight way from a to b."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    px, py = point[0] - a[0], point[1] - a[1]
    square = dx * dx + dy * dy
    share = 0.0 if square == 0 else max(0.0, min(1.0, (px * dx + py * dy) / square))
    return math.hypot(px - share * dx, py - share * dy)
