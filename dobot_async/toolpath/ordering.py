"""In which order, and which way round, strokes are drawn, so that the tool travels little between them.

    merge     strokes that meet become one
    order     from where the tool is to the nearest end, again and again (greedy); then pairs of travels that get
              shorter when all between them is drawn the other way round are exchanged (2-opt)

Each stroke is drawn exactly once. The result is never longer than the order given.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

from dobot_async.toolpath.stroke import Point, Stroke, distance

__all__ = ["merged", "ordered", "travel_of"]

PAIRS = 1_500_000  # pairs of travels that are looked at in all: two or three seconds
LEAST_WINDOW = 30  # strokes
NEGLIGIBLE = 1e-9  # mm


class Ends:
    """The free ends of strokes, found by place: squares of a grid, each with what lies in it."""

    def __init__(self, strokes: Sequence[Stroke], side: float, *, backward: bool) -> None:
        self._side = side
        self._cells: defaultdict[tuple[int, int], dict[tuple[int, bool], Point]] = defaultdict(dict)
        self._places: dict[tuple[int, bool], Point] = {}
        self._backward = backward
        for number, stroke in enumerate(strokes):
            self.add(number, stroke)

        cells = self._cells.keys()
        self._most = 1 + max((max(abs(x), abs(y)) for x, y in cells), default=0)

    def __len__(self) -> int:
        return len(self._places)

    def add(self, number: int, stroke: Stroke) -> None:
        """Add the ends of a stroke: its start (False), and its end (True) if it may be reversed."""
        for end, place in ((False, stroke.start), (True, stroke.end)):
            if self._backward or not end:
                self._places[number, end] = place
                self._cells[self._cell(place)][number, end] = place

    def remove(self, number: int) -> None:
        """Take a stroke out."""
        for end in (False, True):
            place = self._places.pop((number, end), None)
            if place is not None:
                cell = self._cell(place)
                del self._cells[cell][number, end]
                if not self._cells[cell]:
                    del self._cells[cell]

    def __contains__(self, number: object) -> bool:
        return (number, False) in self._places

    def nearest(self, place: Point, within: float = math.inf, *, only: bool | None = None) -> tuple[int, bool] | None:
        """Return the nearest end, None if there is none within so many mm: squares are looked at ring by ring.

        Args:
            place: From where.
            within: How far at most.
            only: False looks at starts alone, True at ends.
        """
        if not self._places:
            return None

        best: tuple[float, int, bool] | None = None
        for ring, cells in enumerate(self._rings(self._cell(place), within)):
            for cell in cells:
                for (number, end), other in self._cells.get(cell, {}).items():
                    found = (distance(place, other), number, end)
                    if only in {None, end} and found[0] <= within and (best is None or found < best):
                        best = found
            if best and best[0] <= ring * self._side:
                break

        return (best[1], best[2]) if best else None

    def _rings(self, centre: tuple[int, int], within: float) -> Iterator[Sequence[tuple[int, int]]]:
        """Squares by their distance; where few are left, all of those that are not empty at once."""
        x, y = centre
        furthest = self._most + max(abs(x), abs(y)) if math.isinf(within) else math.ceil(within / self._side)
        looked = 0
        for ring in range(furthest + 1):
            if looked > 4 * len(self._cells) + 16:
                yield list(self._cells)
                return

            cells = [(x, y)] if not ring else square(x, y, ring)
            looked += len(cells)
            yield cells

    def _cell(self, place: Point) -> tuple[int, int]:
        return math.floor(place[0] / self._side), math.floor(place[1] / self._side)


def square(x: int, y: int, ring: int) -> list[tuple[int, int]]:
    """The squares of a ring."""
    sides = range(-ring, ring + 1)
    rows = [(x + i, y + j) for i in sides for j in (-ring, ring)]
    return rows + [(x + i, y + j) for j in range(1 - ring, ring) for i in (-ring, ring)]


def side_for(strokes: Sequence[Stroke]) -> float:
    """Such a side that a square holds an end or two."""
    xs = [x for stroke in strokes for x, _ in (stroke.start, stroke.end)]
    ys = [y for stroke in strokes for _, y in (stroke.start, stroke.end)]
    width, height = max(xs) - min(xs), max(ys) - min(ys)
    return max(math.sqrt(max(width, 1e-6) * max(height, 1e-6) / len(strokes)), (width + height) / 2000, 1e-6)


def merged(strokes: Sequence[Stroke], tolerance: float, *, reverse: bool = True) -> list[Stroke]:
    """Return strokes of which those that meet within a tolerance, and are of one speed and layer, are one."""
    kinds: defaultdict[tuple[float | None, str], list[int]] = defaultdict(list)
    for number, stroke in enumerate(strokes):
        kinds[stroke.speed, stroke.layer].append(number)

    found: dict[int, Stroke] = {}
    for numbers in kinds.values():
        some = [strokes[number] for number in numbers]
        for place, stroke in merged_alike(some, tolerance, reverse=reverse).items():
            found[numbers[place]] = stroke

    return [found[number] for number in sorted(found)]


def merged_alike(strokes: Sequence[Stroke], tolerance: float, *, reverse: bool) -> dict[int, Stroke]:
    """The merged strokes, by the number of the first of each."""
    ends = Ends(strokes, max(tolerance, side_for(strokes)), backward=True)
    found: dict[int, Stroke] = {}
    for first, stroke in enumerate(strokes):
        if first not in ends:
            continue

        ends.remove(first)
        chain = [stroke]
        for forward in (True, False):
            while (found_end := next_of(ends, chain, tolerance, forward=forward, reverse=reverse)) is not None:
                number, end = found_end
                ends.remove(number)
                turned = strokes[number].reversed() if end == forward else strokes[number]
                chain.insert(len(chain) if forward else 0, turned)

        found[first] = chained(chain)

    return found


def next_of(
    ends: Ends, chain: Sequence[Stroke], tolerance: float, *, forward: bool, reverse: bool
) -> tuple[int, bool] | None:
    """The end that meets the end (or the start) of a chain."""
    if chain[0].start == chain[-1].end and (len(chain) > 1 or len(chain[0].points) > 1):
        return None  # it is closed

    place = chain[-1].end if forward else chain[0].start
    return ends.nearest(place, tolerance, only=None if reverse else not forward)


def chained(chain: Sequence[Stroke]) -> Stroke:
    """One stroke through all of a chain; a gap within the tolerance is a way with the power of what follows."""
    if len(chain) == 1:
        return chain[0]

    points, powers = list(chain[0].points), list(chain[0].powers)
    for stroke in chain[1:]:
        skip = int(stroke.start == points[-1])
        points += stroke.points[skip:]
        powers += stroke.powers[skip:]

    return replace(chain[0], points=tuple(points), power=tuple(powers))


def travel_of(strokes: Sequence[Stroke], start: Point | None) -> float:
    """How far the tool travels between strokes, and from `start` to the first."""
    way = sum(distance(a.end, b.start) for a, b in pairwise(strokes))
    return way + (distance(start, strokes[0].start) if start and strokes else 0.0)


def ordered(strokes: Sequence[Stroke], start: Point | None, *, reverse: bool = True) -> list[Stroke]:
    """Return the strokes in an order with little travel."""
    if len(strokes) < 2:
        if strokes and start and reverse and distance(start, strokes[0].end) < distance(start, strokes[0].start):
            return [strokes[0].reversed()]

        return list(strokes)

    found = greedy(strokes, start, reverse=reverse)
    if reverse:
        improve(found, start)

    return found if travel_of(found, start) < travel_of(strokes, start) else list(strokes)


def greedy(strokes: Sequence[Stroke], start: Point | None, *, reverse: bool) -> list[Stroke]:
    """Always to the nearest end."""
    ends = Ends(strokes, side_for(strokes), backward=reverse)
    found: list[Stroke] = []
    here = start or strokes[0].start
    while (nearest := ends.nearest(here)) is not None:
        number, end = nearest
        ends.remove(number)
        found.append(strokes[number].reversed() if end else strokes[number])
        here = found[-1].end

    return found


def improve(strokes: list[Stroke], start: Point | None) -> None:
    """2-opt: what lies between two travels is drawn the other way round where that makes them shorter together."""
    count, looked = len(strokes), 0
    window = max(LEAST_WINDOW, PAIRS // (4 * count))
    starts, ends = [each.start for each in strokes], [each.end for each in strokes]
    improved = True
    while improved and looked < PAIRS:
        improved = False
        for i in range(count):
            before = start if i == 0 else ends[i - 1]
            looked += min(count - i, window)
            for j in range(i, min(count, i + window)):
                after = starts[j + 1] if j + 1 < count else None
                if gain(before, starts[i], ends[j], after) > NEGLIGIBLE:
                    strokes[i : j + 1] = [each.reversed() for each in reversed(strokes[i : j + 1])]
                    starts[i : j + 1], ends[i : j + 1] = ends[i : j + 1][::-1], starts[i : j + 1][::-1]
                    improved = True


def gain(before: Point | None, first: Point, last: Point, after: Point | None) -> float:
    """By how much less the tool travels if it is `last` that comes behind `before`, and `first` before `after`."""
    way = 0.0
    if before:
        way += math.dist(before, first) - math.dist(before, last)

    if after:
        way += math.dist(last, after) - math.dist(first, after)

    return way
