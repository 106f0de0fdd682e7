"""A toolpath on a work plane as the moves of an arm: no arm is known here, and nothing is sent.

pen     travel --lower--> draw draw draw --lift--> travel ...      the tool is lifted between strokes
laser   travel --lower--> draw draw draw, jump, draw draw ...      the laser is off between strokes, at one height
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import Literal

from dobot_async._core.util.bounds import ToolBounds
from dobot_async.toolpath.errors import UnreachableStroke
from dobot_async.toolpath.plane import Place, WorkPlane
from dobot_async.toolpath.stroke import Stroke
from dobot_async.toolpath.toolpath import Toolpath

__all__ = [
    "SAME",
    "MoveKind",
    "Reach",
    "Tool",
    "ToolpathMove",
    "approach",
    "check_moves",
    "fastest",
    "from_point",
    "moves_of",
]

Tool = Literal["pen", "laser"]
Reach = Callable[[Place], None]
"""Told x, y, z of the arm in mm, raises ValueError with the reason where it cannot go there."""

SAME = 0.01  # mm; nearer points are one for an arm
DOT = 0.1  # mm: how long a dot of a laser is, which must move to burn
LOOK = 5.0  # mm between two looks at the reach


class MoveKind(Enum):
    """What a move is for."""

    TRAVEL = "travel"
    LOWER = "lower"
    DRAW = "draw"
    JUMP = "jump"
    LIFT = "lift"


@dataclass(frozen=True, slots=True)
class ToolpathMove:
    """One straight way.

    Attributes:
        kind: What it is for.
        place: Where it ends, x, y, z of the arm in mm.
        power: Percent, on the way; 0 where nothing is drawn.
        speed: mm/s of the stroke that it belongs to.
        stroke: The number of that stroke.
        point: The number of the point in the stroke as it is drawn, to which it leads.
    """

    kind: MoveKind
    place: Place
    power: float
    speed: float
    stroke: int
    point: int = 0


def moves_of(toolpath: Toolpath, plane: WorkPlane, tool: Tool, speeds: Sequence[float]) -> list[list[ToolpathMove]]:
    """Return the moves of each stroke, from above its start (the laser: at it) to above its end."""
    make = pen_moves if tool == "pen" else laser_moves
    return [
        list(make(stroke.without_repeats(SAME), number, plane, speed))
        for number, (stroke, speed) in enumerate(zip(toolpath.strokes, speeds, strict=True))
    ]


def pen_moves(stroke: Stroke, number: int, plane: WorkPlane, speed: float) -> Iterator[ToolpathMove]:
    """Over the start, down, along, and up."""
    powers = stroke.powers
    yield ToolpathMove(MoveKind.TRAVEL, plane.to_arm(*stroke.start, plane.lift), 0.0, speed, number)
    yield ToolpathMove(MoveKind.LOWER, plane.pressed(stroke.start, powers[0]), 0.0, speed, number)
    for point, (place, power) in enumerate(zip(stroke.points[1:], powers[1:], strict=True), 1):
        yield ToolpathMove(MoveKind.DRAW, plane.pressed(place, power), power, speed, number, point)

    yield ToolpathMove(MoveKind.LIFT, plane.to_arm(*stroke.end, plane.lift), 0.0, speed, number, len(powers) - 1)


def laser_moves(stroke: Stroke, number: int, plane: WorkPlane, speed: float) -> Iterator[ToolpathMove]:
    """To the start without power, and along."""
    points, powers = stroke.points, stroke.powers
    if len(points) == 1:
        points, powers = (points[0], (points[0][0] + DOT, points[0][1])), powers * 2

    yield ToolpathMove(MoveKind.JUMP, plane.to_arm(*points[0]), 0.0, speed, number)
    for point, (place, power) in enumerate(zip(points[1:], powers[1:], strict=True), 1):
        yield ToolpathMove(MoveKind.DRAW, plane.to_arm(*place), power, speed, number, point)


def approach(here: Place, moves: Sequence[ToolpathMove], plane: WorkPlane) -> list[ToolpathMove]:
    """Return the moves from where the arm is to the first of a drawing: up, across, and for a laser down."""
    first = moves[0]
    at = plane.to_plane(*here)
    above = plane.to_plane(*first.place)
    found: list[ToolpathMove] = []
    if at.height < plane.lift - SAME:
        found.append(replace(first, kind=MoveKind.TRAVEL, place=plane.to_arm(at.x, at.y, plane.lift)))

    if first.kind is MoveKind.JUMP:
        found.append(replace(first, kind=MoveKind.TRAVEL, place=plane.to_arm(above.x, above.y, plane.lift)))
        found.append(replace(first, kind=MoveKind.LOWER))

    return found


def from_point(moves: Sequence[ToolpathMove], point: float) -> list[ToolpathMove]:
    """Return the moves of a laser's stroke from a place in it on, which is told in points."""
    behind = int(point)
    start, end = moves[behind].place, moves[behind + 1].place
    place = between(start, end, point - behind)
    return [replace(moves[0], place=place), *moves[behind + 1 :]] if point else list(moves)


def check_moves(
    moves: Iterable[ToolpathMove], reach: Reach, here: Place | None = None, bounds: ToolBounds | None = None
) -> None:
    """Look at the reach every few mm of all moves, and at all of their ways in a workspace.

    Args:
        moves: What is to be done.
        reach: Of the arm.
        here: Where the first one begins.
        bounds: Where the tool may be.

    Raises:
        UnreachableStroke: The first place that cannot be reached.
    """
    for move in moves:
        place = move.place
        try:
            for place in places(here, move.place):
                reach(place)

            if bounds:
                bounds.check_way([here or place, place])
        except ValueError as error:
            way = "" if move.kind is MoveKind.DRAW else f" ({ON_THE_WAY[move.kind]})"
            alarm = getattr(error, "alarm", None)
            named = {} if alarm is None else {"alarm": alarm}
            raise UnreachableStroke(move.stroke, move.point, place, f"{error}{way}", **named) from None

        here = move.place


ON_THE_WAY = {
    MoveKind.TRAVEL: "on the way to the stroke, above the paper",
    MoveKind.LOWER: "where the stroke begins",
    MoveKind.JUMP: "on the way to the stroke",
    MoveKind.LIFT: "above the paper, where the stroke ends",
}


def between(start: Place, end: Place, share: float) -> Place:
    """The place behind a share, 0 to 1, of a straight way."""
    x, y, z = (a + share * (b - a) for a, b in zip(start, end, strict=True))
    return x, y, z


def places(here: Place | None, there: Place) -> Iterator[Place]:
    """Places on a way, every few mm, its end the last."""
    count = max(1, math.ceil(math.dist(here, there) / LOOK)) if here else 1
    for number in range(1, count):
        yield between(here or there, there, number / count)

    yield there


def fastest(moves: Sequence[ToolpathMove], rate: float, depth: int) -> float:
    """Return the speed in mm/s at which an arm uses up no more than `rate` moves per second of an unbroken series.

    A queue of `depth` moves evens out what is shorter than that.
    """
    best = math.inf
    lengths: list[float] = []
    here: Place | None = None
    for move in moves:
        if move.kind in {MoveKind.DRAW, MoveKind.JUMP} and here is not None:
            lengths.append(math.dist(here, move.place))
        else:
            best = min(best, slowest_window(lengths, depth))
            lengths = []

        here = move.place

    return min(best, slowest_window(lengths, depth)) * rate


def slowest_window(lengths: Sequence[float], depth: int) -> float:
    """The least mean length of `depth` moves in a row, mm; infinite where there are not so many."""
    if len(lengths) <= depth:
        return math.inf

    total = sum(lengths[:depth])
    least = total
    for gone, come in zip(lengths, lengths[depth:], strict=False):
        total += come - gone
        least = min(least, total)

    return max(least, 0.0) / depth
