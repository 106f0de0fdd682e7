"""The lines along which a picture is as dark as a threshold: marching squares, on NumPy arrays.

a --- b        Each square between four pixels is crossed where two of its corners lie on either side of the
|  /  |        threshold; where exactly, their values tell, linearly, so that soft edges are found to a fraction
d --- c        of a pixel. Dark lies to the left of the line; where two lines cross a square, its middle decides.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = ["area", "outlines"]

Crossing = tuple[int, int, int]
"""Between the pixel (row, column) and the one to its right (0), or below it (1)."""
Position = tuple[float, float]

TOP, RIGHT, BOTTOM, LEFT = (0, 0, 0), (0, 1, 1), (1, 0, 0), (0, 0, 1)  # sides of a square, as crossings from its corner
WAYS: dict[int, tuple[tuple[Crossing, Crossing], ...]] = {
    0b0001: ((BOTTOM, LEFT),),
    0b0010: ((RIGHT, BOTTOM),),
    0b0011: ((RIGHT, LEFT),),
    0b0100: ((TOP, RIGHT),),
    0b0110: ((TOP, BOTTOM),),
    0b0111: ((TOP, LEFT),),
    0b1000: ((LEFT, TOP),),
    0b1001: ((BOTTOM, TOP),),
    0b1011: ((RIGHT, TOP),),
    0b1100: ((LEFT, RIGHT),),
    0b1101: ((BOTTOM, RIGHT),),
    0b1110: ((LEFT, BOTTOM),),
}
"""From which side to which one the line goes, by which of the corners a, b, c, d (the highest bit first) are dark."""

SADDLES: dict[tuple[int, bool], tuple[tuple[Crossing, Crossing], ...]] = {
    (0b0101, False): ((TOP, RIGHT), (BOTTOM, LEFT)),
    (0b0101, True): ((TOP, LEFT), (BOTTOM, RIGHT)),
    (0b1010, False): ((LEFT, TOP), (RIGHT, BOTTOM)),
    (0b1010, True): ((RIGHT, TOP), (LEFT, BOTTOM)),
}
"""The same of two dark corners across, by whether the middle is dark, too."""


def outlines(dark: NDArray[np.float64], threshold: float) -> Iterator[list[Position]]:
    """Yield closed lines around what is darker than a threshold, and around the light within it.

    Args:
        dark: Rows of darkness, from top to bottom.
        threshold: From which darkness on a pixel is dark.

    Yields:
        The points of a line, (x, y) in pixels from the upper left corner of the picture, y down; the first one is the
        last one. A pixel's value is that of its middle, and beyond the picture all is light.
    """
    import numpy as np

    field = np.pad(dark, 1)  # so that every line is closed
    ways = crossings(field, threshold)
    while ways:
        first, after = ways.popitem()
        line = [first]
        while after != first:
            line.append(after)
            after = ways.pop(after)

        points = [place(crossing, field, threshold) for crossing in line]
        yield [*points, points[0]]


def crossings(field: NDArray[np.float64], threshold: float) -> dict[Crossing, Crossing]:
    """From each crossing to the next one."""
    import numpy as np

    black = (field >= threshold).astype(int)
    corners = black[:-1, :-1] * 8 + black[:-1, 1:] * 4 + black[1:, 1:] * 2 + black[1:, :-1]
    found: dict[Crossing, Crossing] = {}
    for row, column in np.argwhere((corners > 0) & (corners < 0b1111)).tolist():
        kind = int(corners[row, column])
        ways = WAYS.get(kind) or SADDLES[kind, bool(field[row : row + 2, column : column + 2].mean() >= threshold)]
        for start, end in ways:
            found[start[0] + row, start[1] + column, start[2]] = (end[0] + row, end[1] + column, end[2])

    return found


def place(crossing: Crossing, field: NDArray[np.float64], threshold: float) -> Position:
    """Where a line crosses the way from one pixel to the next."""
    row, column, below = crossing
    here, there = field[row, column], field[row + below, column + 1 - below]
    share = float((threshold - here) / (there - here))
    along = (0.0, share) if below else (share, 0.0)
    return column - 0.5 + along[0], row - 0.5 + along[1]  # the first row and column are not the picture's


def area(line: Sequence[Position]) -> float:
    """Return how many pixels a closed line encloses."""
    return abs(sum(ax * by - bx * ay for (ax, ay), (bx, by) in pairwise(line))) / 2
