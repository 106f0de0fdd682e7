"""Affine maps and homographies of the plane, fitted to pairs of points. Pure arithmetic.

A map is three rows of three numbers: (x w, y w, w) = rows (u, v, 1).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import cast

__all__ = ["Pair", "Rows", "inverse", "mapped", "solved"]

Pair = tuple[float, float]
Rows = tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]
FLAT = 1e-4  # of a triangle's longest side squared, its area: less is three points on a line
LEAST = 1e-9


def solved(places: Sequence[Pair], targets: Sequence[Pair]) -> Rows | None:
    """The map of three pairs, or the best one of more; None where they lie on a line."""
    if on_a_line(places) or on_a_line(targets):
        return None

    before, after = normal(places), normal(targets)
    ps, ts = ([mapped(matrix, each) for each in some] for matrix, some in ((before, places), (after, targets)))
    affine = len(places) == 3
    equations = [row for (u, v), (x, y) in zip(ps, ts, strict=True) for row in equations_of(u, v, x, y, affine=affine)]
    found = least_squares(equations, 6 if affine else 8)
    if found is None:
        return None

    a, b, c, d, e, f, *rest = found
    g, h = rest or (0.0, 0.0)
    matrix = times(times(inverse(after), ((a, b, c), (d, e, f), (g, h, 1.0))), before)
    scale = weight(matrix, places[0])
    if abs(scale) < LEAST or not all(map(math.isfinite, itertools.chain(*matrix))):
        return None

    if any(weight(matrix, place) / scale < LEAST for place in places):
        return None  # the horizon runs between the points: no camera sees that

    return cast(Rows, tuple(tuple(number / scale for number in row) for row in matrix))


def equations_of(u: float, v: float, x: float, y: float, *, affine: bool) -> list[list[float]]:
    """Two equations of a pair, each with its right side last."""
    if affine:
        return [[u, v, 1, 0, 0, 0, x], [0, 0, 0, u, v, 1, y]]

    return [[u, v, 1, 0, 0, 0, -u * x, -v * x, x], [0, 0, 0, u, v, 1, -u * y, -v * y, y]]


def least_squares(equations: Sequence[Sequence[float]], count: int) -> list[float] | None:
    """The unknowns that fit best (Householder), None where the equations leave some open."""
    rows = [list(row) for row in equations]
    for column in range(count):
        norm = math.sqrt(math.fsum(row[column] ** 2 for row in rows[column:]))
        if norm < LEAST:
            return None

        norm = math.copysign(norm, -rows[column][column])
        mirror = [row[column] for row in rows[column:]]
        mirror[0] -= norm
        square = math.fsum(value * value for value in mirror)
        for place in range(column, count + 1):
            share = 2 * math.fsum(m * row[place] for m, row in zip(mirror, rows[column:], strict=True)) / square
            for m, row in zip(mirror, rows[column:], strict=True):
                row[place] -= share * m

    found = [0.0] * count
    for place in range(count - 1, -1, -1):
        rest = math.fsum(rows[place][other] * found[other] for other in range(place + 1, count))
        found[place] = (rows[place][count] - rest) / rows[place][place]

    return found


def on_a_line(points: Sequence[Pair]) -> bool:
    """Whether points leave a map open: three of up to four, or any three of more, are on a line."""
    flat = [is_flat(*three) for three in itertools.combinations(points[:12], 3)]
    return any(flat) if len(points) <= 4 else all(flat)


def is_flat(a: Pair, b: Pair, c: Pair) -> bool:
    """Whether three points are as good as on a line."""
    area = abs((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
    return area <= FLAT * max(math.dist(a, b), math.dist(b, c), math.dist(a, c)) ** 2


def normal(points: Sequence[Pair]) -> Rows:
    """What brings points to the origin, about 1 from it."""
    x, y = (math.fsum(values) / len(points) for values in zip(*points, strict=True))
    size = math.fsum(math.dist(point, (x, y)) for point in points) / len(points) or 1.0
    return ((1 / size, 0.0, -x / size), (0.0, 1 / size, -y / size), (0.0, 0.0, 1.0))


def weight(matrix: Rows, point: Pair) -> float:
    """The third number of a mapped point; above 0 on the side of the horizon on which the points are."""
    return matrix[2][0] * point[0] + matrix[2][1] * point[1] + matrix[2][2]


def mapped(matrix: Rows, point: Pair) -> Pair:
    """A point, mapped."""
    u, v = point
    w = weight(matrix, point)
    if w < LEAST:
        raise ValueError(f"({u:g}, {v:g}) is on the camera's horizon, or beyond it")

    x, y = (row[0] * u + row[1] * v + row[2] for row in matrix[:2])
    return x / w, y / w


def times(a: Rows, b: Rows) -> Rows:
    """The product of two matrices."""
    columns = list(zip(*b, strict=True))
    return cast(
        Rows, tuple(tuple(sum(p * q for p, q in zip(row, column, strict=True)) for column in columns) for row in a)
    )


def inverse(matrix: Rows) -> Rows:
    """The inverse of a matrix."""
    (a, b, c), (d, e, f), (g, h, i) = matrix
    determinant = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    adjugate = (
        (e * i - f * h, c * h - b * i, b * f - c * e),
        (f * g - d * i, a * i - c * g, c * d - a * f),
        (d * h - e * g, b * g - a * h, a * e - b * d),
    )
    return cast(Rows, tuple(tuple(number / determinant for number in row) for row in adjugate))
