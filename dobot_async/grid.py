"""A pallet: places in rows, columns and layers, between corners that the arm was taught. Pure arithmetic, mm.

    third o---.---.---o fourth       rows go from the first corner to the third
          |           |              columns go from the first corner to the second
    first o---.---.---o second       layers lie on one another

A row's places are evenly far apart, and so are a column's.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple, SupportsFloat, SupportsIndex, cast, overload

from dobot_async._core.util.arguments import check_choice, to_float

__all__ = ["Grid", "GridPlace"]

Order = Literal["rows", "columns", "rows-snake", "columns-snake"]
ORDERS = ("rows", "columns", "rows-snake", "columns-snake")


class GridPlace(NamedTuple):
    """One place: x, y, z in mm."""

    x: float
    y: float
    z: float


@dataclass(frozen=True, slots=True)
class Grid(Sequence[GridPlace]):
    """The places of a pallet, in an order; a sequence.

    Attributes:
        corners: Three or four corners as x, y, z in mm, or poses of an arm: the first, the second at the end of its
            row, the third at the end of its column, the fourth opposite of the first. Without the fourth the pallet is
            a parallelogram.
        rows: How many, 1 or more.
        columns: How many, 1 or more.
        layers: How many lie on one another.
        layer_height: mm from one layer to the next; negative to count from the top.
        order: "rows" goes along one row after the other, "columns" along columns; "-snake" there and back. One layer
            comes after the other.

    Raises:
        ValueError: A number is out of range, or the corners are neither three nor four.
    """

    corners: Sequence[object]
    rows: int
    columns: int
    layers: int = 1
    layer_height: float = 0.0
    order: Order = "rows"

    def __post_init__(self) -> None:
        corners = tuple(map(place, self.corners))
        if len(corners) not in {3, 4}:
            raise ValueError(f"a grid has three or four corners, not {len(corners)}")

        for name in ("rows", "columns", "layers"):
            object.__setattr__(self, name, count(getattr(self, name), name))

        check_choice("order", self.order, *ORDERS)
        height = to_float(self.layer_height, "layer_height")
        if not math.isfinite(height):
            raise ValueError(f"layer_height must be finite, not {height!r}")

        if self.layers > 1 and not height:
            raise ValueError("several layers need a layer_height other than 0 mm")

        object.__setattr__(self, "layer_height", height)
        object.__setattr__(self, "corners", corners)

    def __len__(self) -> int:
        return self.rows * self.columns * self.layers

    @overload
    def __getitem__(self, index: SupportsIndex) -> GridPlace: ...

    @overload
    def __getitem__(self, index: slice) -> list[GridPlace]: ...

    def __getitem__(self, index: SupportsIndex | slice) -> GridPlace | list[GridPlace]:
        if isinstance(index, slice):
            return [self[number] for number in range(*index.indices(len(self)))]

        number = index.__index__()
        if not -len(self) <= number < len(self):
            raise IndexError(f"the grid has {len(self)} places, and none with the number {number}")

        return self.at(*self.cell(number % len(self)))

    def __iter__(self) -> Iterator[GridPlace]:
        return (self[number] for number in range(len(self)))

    def cell(self, number: int) -> tuple[int, int, int]:
        """Return row, column and layer, from 0, of a place by its number in the order."""
        layer, rest = divmod(number, self.rows * self.columns)
        by_rows = self.order.startswith("rows")
        line, step = divmod(rest, self.columns if by_rows else self.rows)
        if self.order.endswith("snake") and line % 2:
            step = (self.columns if by_rows else self.rows) - 1 - step

        return (line, step, layer) if by_rows else (step, line, layer)

    def at(self, row: int, column: int, layer: int = 0) -> GridPlace:
        """Return the place in a row, a column and a layer, each from 0.

        Raises:
            IndexError: There is no such place.
        """
        for name, value, most in (
            ("row", row, self.rows),
            ("column", column, self.columns),
            ("layer", layer, self.layers),
        ):
            if not 0 <= value < most:
                raise IndexError(f"{name} must be in 0 to {most - 1}, not {value}")

        across, up = share(column, self.columns), share(row, self.rows)
        first, second, third, *others = cast("Sequence[GridPlace]", self.corners)
        fourth = others[0] if others else GridPlace(*(b + c - a for a, b, c in zip(first, second, third, strict=True)))
        x, y, z = (
            (1 - up) * ((1 - across) * a + across * b) + up * ((1 - across) * c + across * d)
            for a, b, c, d in zip(first, second, third, fourth, strict=True)
        )
        return GridPlace(x, y, z + layer * self.layer_height)


def place(value: object) -> GridPlace:
    """A pose, or three numbers."""
    numbers = (getattr(value, axis) for axis in "xyz") if hasattr(value, "x") else value
    found = [to_float(number, "a corner") for number in cast("Iterable[SupportsFloat]", numbers)]
    if len(found) != 3 or not all(map(math.isfinite, found)):
        raise ValueError(f"a corner must be x, y and z in finite mm, not {value!r}")

    return GridPlace(*found)


def count(value: object, name: str) -> int:
    """A whole number, 1 or more."""
    if not hasattr(value, "__index__"):
        raise TypeError(f"{name} must be a whole number, not {value!r}")

    found = operator.index(cast("SupportsIndex", value))
    if found < 1:
        raise ValueError(f"{name} must be 1 or more, not {value!r}")

    return found


def share(number: int, of: int) -> float:
    """How much of the way lies before a place."""
    return number / (of - 1) if of > 1 else 0.0
