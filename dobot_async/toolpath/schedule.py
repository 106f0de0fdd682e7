"""A drawing before it is sent: the moves of its strokes, how fast, in which pieces, and about how long they take."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import islice, pairwise
from typing import Any, SupportsFloat, SupportsIndex

from dobot_async._core.util.arguments import check_duration, to_float
from dobot_async.toolpath.moves import MoveKind, Tool, ToolpathMove, fastest, moves_of
from dobot_async.toolpath.plane import WorkPlane
from dobot_async.toolpath.position import StrokePosition
from dobot_async.toolpath.programs import Instruction
from dobot_async.toolpath.toolpath import Toolpath

__all__ = [
    "RATE",
    "TOLERANCE",
    "above_zero",
    "batches",
    "guess",
    "planned",
    "position_in",
    "simplified",
    "whole_percent",
]

SPEEDS: dict[Tool, float] = {"pen": 50.0, "laser": 20.0}
TOLERANCE = 0.05  # mm; a third of what an arm repeats
BATCH = 24  # commands that are put together: fewer than an arm's queue holds
RATE = 120.0  # commands per second that a line of 115200 baud carries with room to spare
DEPTH = 24  # commands that lie ready in the arm while more come
PER_MOVE = 0.15  # seconds that a move of the pen takes beside its way, for the first guess of the time that is left


def simplified(toolpath: Toolpath, tolerance: SupportsFloat) -> Toolpath:
    """The toolpath as it is drawn; raises ValueError for one without strokes."""
    if not toolpath.strokes:
        raise ValueError("there is nothing to draw: the toolpath has no strokes")

    return toolpath.simplify(check_duration(tolerance, "tolerance"))


def planned(
    path: Toolpath, plane: WorkPlane, tool: Tool, speed: SupportsFloat | None, rate: SupportsFloat | None
) -> list[list[ToolpathMove]]:
    """The moves of each stroke, at speeds at which the line keeps up."""
    given = None if speed is None else above_zero(speed, "speed")
    speeds = [given or stroke.speed or SPEEDS[tool] for stroke in path]
    strokes = moves_of(path, plane, tool, speeds)
    if rate is None:
        return strokes

    most = fastest([move for moves in strokes for move in moves], above_zero(rate, "rate"), DEPTH)
    return strokes if most >= max(speeds) else moves_of(path, plane, tool, [min(each, most) for each in speeds])


def batches(instructions: Sequence[Instruction]) -> Iterator[list[tuple[Instruction, bool]]]:
    """Commands in pieces, each with whether it is the last one of its stroke."""
    ends = [False] * len(instructions)
    last: dict[int, int] = {}
    for number, each in enumerate(instructions):
        if each.move and each.move.kind in {MoveKind.DRAW, MoveKind.LIFT}:
            last[each.move.stroke] = number

    for number in (*last.values(), len(instructions) - 1):
        ends[number] = True

    marked = iter(list(zip(instructions, ends, strict=True)))
    while some := list(islice(marked, BATCH)):
        yield some


def guess(moves: Sequence[ToolpathMove]) -> float:
    """About how many seconds a stroke takes."""
    ways = pairwise(moves)
    along = sum(math.dist(a.place, b.place) / b.speed for a, b in ways)
    return along + PER_MOVE * sum(move.kind is not MoveKind.DRAW for move in moves)


def above_zero(value: SupportsFloat, name: str) -> float:
    """A finite number above 0."""
    found = to_float(value, name)
    if not 0 < found < math.inf:
        raise ValueError(f"{name} must be above 0 and finite, not {value!r}")

    return found


def whole_percent(value: Any) -> int:
    """1 to 100."""
    if not hasattr(value, "__index__") or not 1 <= value <= 100:
        raise ValueError(f"percent must be a whole number, 1 to 100, not {value!r}")

    return int(value)


def position_in(
    strokes: Sequence[Sequence[ToolpathMove]], stroke: SupportsIndex, point: SupportsFloat, tool: Tool
) -> StrokePosition:
    """The place where to begin, checked."""
    if not hasattr(stroke, "__index__"):
        raise TypeError(f"first must be the number of a stroke, not {stroke!r}")

    number = stroke.__index__()
    if not 0 <= number < len(strokes):
        raise ValueError(
            f"first must be in 0 to {len(strokes) - 1}, for there are {len(strokes)} strokes, not {stroke!r}"
        )

    found = to_float(point, "point")
    if found and tool != "laser":
        raise ValueError("point is for lasers alone: a pen draws a stroke from its start")

    last = len(strokes[number]) - 1
    if not 0 <= found <= last or (found == last and found):
        raise ValueError(f"point must be 0 or above and below {last}, the last point of stroke {stroke}, not {point!r}")

    return StrokePosition(number, found)
