"""A plan: steps that are tried out without the arm, and a picture of their ways from above."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Annotated, Any

from pydantic import Field

from dobot_async.remote import Draw, Grip, Home, Move, Pick, Place, Recover, RemoteArm
from dobot_async.toolpath import Stroke, Toolpath, preview

__all__ = ["Planned", "Step", "plan_steps"]

Step = Annotated[Home | Move | Pick | Place | Grip | Draw | Recover, Field(discriminator="do")]
Spot = tuple[float, float, float]
Way = tuple[Spot, ...]
WIDTH = 640  # px
MARGIN = 20.0  # mm around what is shown
LEAST = 0.05  # mm, of a way that is to be seen


@dataclass(slots=True)
class Planned:
    """What came of it.

    Attributes:
        problems: The steps that could not be done, and why.
        ways: Where the tool would go.
        seconds: That the drawings take; None if there are none.
        picture: PNG; b"" if nothing is to be seen.
    """

    problems: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])
    ways: list[Way] = field(default_factory=list[Way])
    seconds: float | None = None
    picture: bytes = b""

    @property
    def told(self) -> dict[str, Any]:
        """What is said of it."""
        lengths = sum(length_of(way) for way in self.ways)
        drawn = {} if self.seconds is None else {"seconds_of_drawing": round(self.seconds, 1)}
        return {"possible": not self.problems, "problems": self.problems, "mm": round(lengths, 1), **drawn}


def plan_steps(on: RemoteArm, start: Spot, steps: Sequence[Any]) -> Planned:
    """Try steps out.

    Args:
        on: The arm.
        start: Where its tool is, mm.
        steps: Actions.
    """
    planned, here, known = Planned(), start, True
    for number, step in enumerate(steps, 1):
        try:
            check_start(step, known)
            step.check(on)
            ways = step.ways(on, here)
            if isinstance(step, Draw) and (seconds := step.seconds(on)) is not None:
                planned.seconds = (planned.seconds or 0.0) + seconds
        except ValueError as error:
            planned.problems.append({"step": number, "do": step.do, "why": str(error)})
            continue

        planned.ways += ways if known else ways[1:]
        if ways:
            here, known = ways[-1][-1], True

        known = known and not isinstance(step, Home)

    planned.picture = picture_of(on, planned)
    return planned


def check_start(step: Any, known: bool) -> None:
    """Raise ValueError for a step that begins where nobody knows, and needs it."""
    if isinstance(step, Move) and not known and None in (step.x, step.y, step.z):
        raise ValueError("where home leads is not known: say x, y and z")


def picture_of(on: RemoteArm, planned: Planned) -> bytes:
    """The ways from above, and where the tool could go at their lowest height."""
    strokes = tuple(Stroke(tuple((x, y) for x, y, _ in way)) for way in planned.ways if seen(way))
    if not strokes:
        return b""

    lowest = min(z for way in planned.ways for _, _, z in way)
    path = Toolpath(strokes)
    bounds = path.bounds
    x, y = (bounds.left + bounds.right) / 2, (bounds.bottom + bounds.top) / 2
    half = max(bounds.width, bounds.height) / 2 + MARGIN
    return preview(
        path,
        reachable=lambda x, y: on.allows((x, y, lowest)),
        bounds=(x - half, y - half, x + half, y + half),
        seconds=planned.seconds,
        width=WIDTH,
    ).png()


def seen(way: Way) -> bool:
    """Whether something of a way is to be seen from above."""
    return any(abs(a[0] - b[0]) + abs(a[1] - b[1]) > LEAST for a, b in pairwise(way))


def length_of(way: Way) -> float:
    """Its length, mm."""
    return sum(math.dist(a, b) for a, b in pairwise(way))
