"""From a camera's pixels to an arm's coordinates on a table. Pure arithmetic.

    3 pairs           affine: right for a camera that looks straight down
    4 pairs and more  homography: right for a camera that looks from anywhere, without distortion of its lens;
                      pairs that do not fit the others are found (RANSAC), told, and left out

Numbers are scaled about their middle before they are solved for, for pixels in the thousands would leave few digits.
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
from typing import Any, Self, SupportsFloat, cast

from dobot_async._core.util.arguments import to_float
from dobot_async._core.util.projective import Pair, Rows, inverse, mapped, solved

__all__ = ["Calibration"]

TRIES = 500
ENOUGH = 5  # pairs that fit together by no accident
KIND = "dobot_async calibration"


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
            tolerance: mm by which the map may miss a pair; what misses by more is an outlier. Any four pairs fit
                together, so that it takes six to tell one.
            seed: Of the random choices, so that the same pairs give the same map.

        Raises:
            ValueError: There are too few pairs, three of three (or nearly all) lie on a line, or no five of five
                or more pairs fit together.
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
        random = Random(seed)  # noqa: S311 - repeatable, no secret
        chosen = everybody if len(places) <= 4 else inliers(places, targets, limit, random)
        if len(chosen) < ENOUGH <= len(places):
            raise ValueError(f"no {ENOUGH} of the {len(places)} pairs fit together within {limit:g} mm")

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

        Args:
            pixel: u to the right and v down, as the image has them; fractions count.

        Raises:
            ValueError: The pixel is on the camera's horizon, or beyond it.
        """
        return mapped(self.matrix, pair(pixel, "a pixel"))

    def to_pixel(self, x: SupportsFloat, y: SupportsFloat) -> Pair:
        """Return the pixel of a place of the arm, mm.

        Args:
            x: mm.
            y: mm.

        Raises:
            ValueError: It is no place that the camera can see.
            TypeError: It is not given by numbers.
        """
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
            numbers = tuple(tuple(float(number) for number in row) for row in found["matrix"])
            residuals, used = tuple(map(float, found["residuals"])), tuple(map(bool, found["used"]))
            check_saved(found["kind"], numbers, residuals, used)
        except (ValueError, TypeError, KeyError, RecursionError) as error:
            raise ValueError(f"this is no calibration: {error}") from None

        return cls(cast(Rows, numbers), residuals, used)

    def save(self, path: str | PathLike[str]) -> None:
        """Write it to a JSON file.

        Args:
            path: Of the file, which is replaced if it is there.

        Raises:
            OSError: It cannot be written.
        """
        Path(path).write_text(self.to_json() + "\n", encoding="utf-8")

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Self:
        """Return what `save` has written; raise ValueError, with the file's name, for anything else.

        Raises:
            ValueError: It is no calibration.
            OSError: It cannot be read.
        """
        try:
            return cls.from_json(Path(path).read_text(encoding="utf-8"))
        except ValueError as error:
            raise ValueError(f"{Path(path).name}: {error}") from None


def check_saved(
    kind: object, matrix: Sequence[Sequence[float]], residuals: Sequence[float], used: Sequence[bool]
) -> None:
    """Raise ValueError for what `to_json` has not written."""
    if kind != KIND:
        raise ValueError(f"its kind is {kind!r}")

    if [len(row) for row in matrix] != [3, 3, 3] or not all(map(math.isfinite, itertools.chain(*matrix))):
        raise ValueError("its matrix is not three rows of three finite numbers")

    if len(residuals) != len(used):
        raise ValueError("it has not as many residuals as pairs")


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


def miss(matrix: Rows, place: Pair, target: Pair) -> float:
    """How far a map misses, mm; infinite beyond the horizon."""
    try:
        return math.dist(mapped(matrix, place), target)
    except ValueError:
        return math.inf


def pair(value: object, name: str) -> Pair:
    """Two numbers, or a pose."""
    if hasattr(value, "x") and hasattr(value, "y"):
        numbers: list[SupportsFloat] = [cast(Any, value).x, cast(Any, value).y]
    else:
        numbers = list(cast("Iterable[SupportsFloat]", value))[:2]

    found = tuple(to_float(number, name) for number in numbers)
    if len(found) != 2 or not all(map(math.isfinite, found)):
        raise ValueError(f"{name} must be two finite numbers, not {value!r}")

    return found
