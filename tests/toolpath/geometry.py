"""How far sets of lines are apart, by points close to one another on the one and the segments of the other."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dobot_async.toolpath import Toolpath

__all__ = ["FILES", "Line", "apart", "lines_of", "missed"]

Line = Sequence[tuple[float, float]]
FILES = Path(__file__).parent / "files"


def lines_of(toolpath: Toolpath) -> list[Line]:
    return [stroke.points for stroke in toolpath]


def samples(lines: Iterable[Line], step: float) -> NDArray[np.float64]:
    """Points on lines, no further than `step` from one another."""
    found = []
    for line in lines:
        found.append(line[0])
        for (ax, ay), (bx, by) in pairwise(line):
            count = max(1, int(np.ceil(np.hypot(bx - ax, by - ay) / step)))
            found += [(ax + (bx - ax) * i / count, ay + (by - ay) * i / count) for i in range(1, count + 1)]

    return np.array(found)


def missed(points: NDArray[np.float64], lines: Iterable[Line]) -> float:
    """How far the furthest of some points is from the nearest line."""
    segments = np.array([(*a, *b) for line in lines for a, b in zip(line[:-1] or line, line[1:] or line, strict=True)])
    start, way = segments[:, :2], segments[:, 2:] - segments[:, :2]
    square = np.maximum((way**2).sum(1), 1e-30)
    worst = 0.0
    for chunk in np.array_split(points, max(1, len(points) * len(segments) // 2_000_000)):
        off = chunk[:, None] - start
        share = np.clip((off * way).sum(2) / square, 0, 1)
        worst = max(worst, float(np.hypot(*np.moveaxis(off - share[..., None] * way, 2, 0)).min(1).max()))

    return worst


def apart(a: Iterable[Line], b: Iterable[Line], step: float = 0.1) -> float:
    """The Hausdorff distance of two drawings."""
    a, b = list(a), list(b)
    return max(missed(samples(a, step), b), missed(samples(b, step), a))
