"""From a camera's pixels to an arm's coordinates on a table. Pure arithmetic.

    3 pairs           affine: right for a camera that looks straight down
    4 pairs and more  homography: right for a camera that looks from anywhere, without distortion of its lens;
                      pairs that do not fit the others are found (RANSAC), told, and left out

Numbers are scaled about their middle before they are solved for, without which pixels in the thousands leave few digits.
"""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from random import Random
from typing import Self, SupportsFloat, cast

from dobot_async._core.util.arguments import to_float

__all__ = ["Calibration"]

Pair = tuple[float, float]
Rows = tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]
TRIES = 500
KIND = "dobot_async calibration"
FLAT = 1e-4  # of a triangle's longest side squared, its area: less is three points on a line
LEAST = 1e-9


@dataclass(frozen=True, slots=True)
class Calibration:
    """A map from pixels to the arm's x and y; made by `from_points`.

    Attributes:
        matrix: Three rows of three numbers: (x w, y w, w) = matrix (u, v, 1).
        residuals: For each pair, how far the map misses the arm's coordinates, mm.
        used: For each pair, whether the map was made with it; False is an outlier.
    """

    matrix: Rows
    residuals: tuple[float, ...] = ()
    used: tuple[bool, ...] = ()

    @classmethod
    def from_points(
        cls,
        pixels: Iterable[Sequence[SupportsFloat]],
        coordinates: Iterable[object],
        *,
        tolerance: SupportsFloat = 2.0,
        seed: int = 0,
    ) -> Self:
        """Return the map that brings pixels to coordinates.

        Args:
            pixels: At least three, as (u, v).
            coordinates: Where the arm was for each of them: (x, y) in mm, or poses. More numbers are left out.
            tolerance: mm by which the map may miss a pair; what misses by more is an outlier. With 4 pairs and fewer
                nothing can tell one.
            seed: Of the random choices, so that the same pairs give the same map.

        Raises:
            ValueError: There are too few pairs, three of three (or nearly all) lie on a line, or fewer than four of
                more pairs fit together.
        """
        places = [pair(each, "a pixel") for each in pixels]
        targets = [pair(each, "a coordinate") for each in coordinates]
        limit = to_float(tolerance, "tolerance")
        if len(places) != len(targets):
            raise ValueError(f"there are {len(places)} pixels and {len(targets)} coordinates")

        if len(places) < 3:
            raise ValueError(f"a calibration needs three pairs, four for a camera that looks aslant, not {len(places)}")

        if not 0 < limit < math.inf:
            raise ValueError(f"tolerance must be above 0 mm and finite, not {tolerance!r}")

        everybody = list(range(len(places)))
        chosen = everybody if len(places) <= 4 else inliers(places, targets, limit, Random(seed))  # noqa: S311
        if len(chosen) < 4 < len(places):
            raise ValueError(f"no four of the {len(places)} pairs fit together within {limit:g} mm")

        matrix = solved([places[i] for i in chosen], [targets[i] for i in chosen])
        if matrix is None:
            raise ValueError("the points lie on a line, or in one place: take some that are further apart")

        residuals = tuple(miss(matrix, place, target) for place, target in zip(places, targets, strict=True))
        return cls(matrix, residuals, tuple(number in set(chosen) for number in everybody))

    @property
    def error(self) -> float:
        """The root mean square of the residuals of the pairs that were used, mm."""
        squares = [residual**2 for residual, used in zip(self.residuals, self.used, strict=True) if used]
        return math.sqrt(sum(squares) / len(squares)) if squares else 0.0

    @property
    def outliers(self) -> tuple[int, ...]:
        """The numbers of the pairs, from 0, that do not fit the others."""
        return tuple(number for number, used in enumerate(self.used) if not used)

    def to_arm(self, pixel: Sequence[SupportsFloat]) -> Pair:
        """Return the arm's x and y in mm of a pixel (u, v).

        Raises:
            ValueError: The pixel is on the camera's horizon, or beyond it.
        """
        return mapped(self.matrix, pair(pixel, "a pixel"))

    def to_pixel(self, x: SupportsFloat, y: SupportsFloat) -> Pair:
        """Return the pixel of a place of the arm, mm."""
        return mapped(inverse(self.matrix), pair((x, y), "a place"))

    def to_json(self) -> str:
        """Return it as JSON."""
        return json.dumps(
            {"kind": KIND, "matrix": self.matrix, "residuals": self.residuals, "used": self.used}, indent=2
        )

    @classmethod
    def from_json(cls, text: str) -> Self:
        """Return what `to_json` has written; raise ValueError for anything else."""
        try:
            found = json.loads(text)
            if found["kind"] != KIND:
                raise ValueError(f"its kind is {found['kind']!r}")

            numbers = [[float(number) for number in row] for row in found["matrix"]]
            if [len(row) for row in numbers] != [3, 3, 3] or not all(map(math.isfinite, itertools.chain(*numbers))):
                raise ValueError("its matrix is not three rows of three finite numbers")

            matrix = cast(Rows, tuple(map(tuple, numbers)))
            residuals, used = tuple(map(float, found["residuals"])), tuple(map(bool, found["used"]))
            if len(residuals) != len(used):
                raise ValueError("it has not as many residuals as pairs")
        except (ValueError, TypeError, KeyError, RecursionError) as error:
            raise ValueError(f"this is no calibration: {error}") from None

        return cls(matrix, residuals, used)

    def save(self, path: str | PathLike[str]) -> None:
        """Write it to a JSON file."""
        Path(path).write_text(self.to_json() + "\n", encoding="utf-8")

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Self:
        """Return what `save` has written; raise ValueError, with the file's name, for anything else."""
        try:
            return cls.from_json(Path(path).read_text(encoding="utf-8"))
        except ValueError as error:
            raise ValueError(f"{Path(path).name}: {error}") from None


def inliers(places: Sequence[Pair], targets: Sequence[Pair], limit: float, random: Random) -> list[int]:
    """The numbers of the most pairs that fit a map through four of them, or a few of those together."""
    everybody = range(len(places))
    if math.comb(len(places), 4) <= TRIES:
        samples: Iterable[Sequence[int]] = itertools.combinations(everybody, 4)
    else:
        samples = (random.sample(everybody, 4) for _ in range(TRIES))

    best: list[int] = []
    least = math.inf
    for sample in samples:
        found = solved([places[i] for i in sample], [targets[i] for i in sample])
        if found is None:
            continue

        misses = [miss(found, places[i], targets[i]) for i in everybody]
        fitting = [i for i in everybody if misses[i] <= limit]
        total = sum(misses[i] for i in fitting)
        if (len(fitting), -total) > (len(best), -least):
            best, least = fitting, total

    for _ in range(3):  # what was found with four is found better with all that fit
        found = solved([places[i] for i in best], [targets[i] for i in best]) if len(best) >= 4 else None
        again = [i for i in everybody if found and miss(found, places[i], targets[i]) <= limit]
        if len(again) <= len(best):
            break

        best = again

    return best


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
    """Whether no three of some points are a triangle, or four of four are none: three of four on a line leave it open."""
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


def miss(matrix: Rows, place: Pair, target: Pair) -> float:
    """How far a map misses, mm; infinite beyond the horizon."""
    try:
        return math.dist(mapped(matrix, place), target)
    except ValueError:
        return math.inf


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


def pair(value: object, name: str) -> Pair:
    """Two numbers, or a pose."""
    if hasattr(value, "x") and hasattr(value, "y"):
        numbers: list[SupportsFloat] = [value.x, value.y]
    else:
        numbers = list(cast("Iterable[SupportsFloat]", value))[:2]

    found = tuple(to_float(number, name) for number in numbers)
    if len(found) != 2 or not all(map(math.isfinite, found)):
        raise ValueError(f"{name} must be two finite numbers, not {value!r}")

    return found
