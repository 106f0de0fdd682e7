"""Where the tool of an arm can be: a few numbers for a picture, and its outline at a height. Pure arithmetic.

Rays from the axis of joint 1 are looked at every few mm, and each change between in and out is found by halving.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import pairwise
from typing import Any

from dobot_async.panel.arms import ArmView

__all__ = ["outline", "reach_of_view"]

Inside = Callable[[float, float], bool]
Ring = list[tuple[float, float]]
FARTHEST = 600.0  # mm
STRIDE = 10.0  # mm between two looks
FINE = 0.5  # mm
TURN = 3  # degrees between two rays
HEIGHTS = range(-150, 501, 10)


def spans(inside: Callable[[float], bool]) -> list[tuple[float, float]]:
    """Return from where to where a ray is inside."""
    marks = [STRIDE * number for number in range(int(FARTHEST / STRIDE) + 1)]
    known = [inside(mark) for mark in marks]
    edges: list[float] = [0.0] if known[0] else []
    for (near, is_in), (far, is_still_in) in pairwise(zip(marks, known, strict=True)):
        if is_in != is_still_in:
            edges.append(edge(inside, near, far, is_in=is_in))

    if known[-1]:
        edges.append(FARTHEST)

    return list(zip(edges[::2], edges[1::2], strict=True))


def edge(inside: Callable[[float], bool], near: float, far: float, *, is_in: bool) -> float:
    """Return where, between two marks, a ray leaves or enters."""
    while far - near > FINE:
        middle = (near + far) / 2
        if inside(middle) == is_in:
            near = middle
        else:
            far = middle

    return near if is_in else far


def along(inside: Inside, degrees: float) -> Callable[[float], bool]:
    """Return what tells of a distance on a ray."""
    cos, sin = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return lambda distance: inside(distance * cos, distance * sin)


def outline(view: ArmView, z: float) -> list[Ring]:
    """Return rings around all that can be reached at a height, mm in the arm's coordinates."""
    rays = [(angle, spans(along(partial(view.reaches, z=z), angle))) for angle in range(-180, 180, TURN)]
    return [ring(run) for run in runs(rays)]


def runs(rays: Sequence[tuple[float, list[tuple[float, float]]]]) -> Iterator[list[tuple[float, float, float]]]:
    """Return neighbouring rays that reach somewhere, each with its nearest and farthest place."""
    reached = [(angle, each[0][0], each[-1][1]) if each else None for angle, each in rays]
    if all(reached):
        whole = [each for each in reached if each]
        yield [*whole, (whole[0][0] + 360, *whole[0][1:])]
        return

    first = reached.index(None)
    run: list[tuple[float, float, float]] = []
    for each in (*reached[first:], *reached[:first], None):
        if each:
            run.append(each)
        elif run:
            yield run
            run = []


def ring(run: Sequence[tuple[float, float, float]]) -> Ring:
    """Return the outer edge, and back along the inner one."""
    outer = [(angle, far) for angle, _, far in run]
    inner = [(angle, near) for angle, near, _ in reversed(run)]
    return [
        (round(far * math.cos(math.radians(angle)), 1), round(far * math.sin(math.radians(angle)), 1))
        for angle, far in (*outer, *inner)
    ]


async def reach_of_view(view: ArmView) -> dict[str, Any]:
    """Return the nearest and farthest distance from the axis, the heights, and how far joint 1 turns.

    Between two heights others have their turn.
    """
    found: list[tuple[float, float, float]] = []
    for z in HEIGHTS:
        found += [(z, *each) for each in spans(along(partial(view.reaches, z=z), 0.0))]
        await asyncio.sleep(0)

    low, high = view.joint_limits[0]
    if not found:
        return {"inner": 0.0, "outer": 0.0, "z": [0.0, 0.0], "sector": [low, high]}

    return {
        "inner": min(near for _, near, _ in found),
        "outer": max(far for _, _, far in found),
        "z": [min(z for z, _, _ in found), max(z for z, _, _ in found)],
        "sector": [low, high],
    }
