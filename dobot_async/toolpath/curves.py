"""Curves as straight ways that miss them by no more than a tolerance."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from itertools import pairwise

__all__ = ["MOST", "arc", "bezier"]

MOST = 20_000
"""Straight ways of one curve; a curve that needs more is no drawing."""


def bezier(tolerance: float, *controls: complex) -> list[complex]:
    """Return points on a Bezier curve of degree 2 or 3, but for its first one.

    A chord over 1/n of a curve misses it by at most the second derivative's maximum / 8 n², and the second derivative
    of a Bezier curve is nowhere greater than at its control points.
    """
    degree = len(controls) - 1
    bend = max(abs(a - 2 * b + c) for a, b, c in zip(controls, controls[1:], controls[2:], strict=False))
    count = ways(math.sqrt(degree * (degree - 1) * bend / (8 * tolerance)))

    def at(share: float) -> complex:
        points: list[complex] = list(controls)
        while len(points) > 1:
            points = [a + (b - a) * share for a, b in pairwise(points)]
        return points[0]

    return [*(at(number / count) for number in range(1, count)), controls[-1]]


def arc(tolerance: float, radius: float, sweep: float, at: Callable[[float], complex]) -> list[complex]:
    """Return points on an arc, but for its first one.

    Args:
        tolerance: By how much chords may miss it.
        radius: The greatest radius.
        sweep: By how many radians it turns.
        at: The point after a share of the turn.
    """
    step = 2 * math.acos(max(0.0, 1 - tolerance / radius)) if radius > tolerance else math.pi / 2
    count = ways(abs(sweep) / min(step, math.pi / 2))
    return [at(number / count) for number in range(1, count + 1)]


def circular(tolerance: float, centre: complex, start: complex, sweep: float) -> list[complex]:
    """Return points on a circular arc from `start`, by so many radians to the left, but for its first one."""
    spoke = start - centre
    return arc(tolerance, abs(spoke), sweep, lambda share: centre + spoke * cmath.exp(1j * sweep * share))


def ways(count: float) -> int:
    """How many straight ways."""
    return max(1, min(MOST, math.ceil(count)))
