"""`Workspace`: where the tool of one arm may be. Everything is mm, in the coordinates that the arm itself tells.

A way is a row of places, and straight between two of them. One rule holds for all of it: nowhere may it go further out
of what is allowed, or deeper into what is forbidden, than it was just before. So a way that begins inside stays inside,
and an arm that stands outside may come back.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from dobot_async._core.util.shapes import XYZ, Box, Cylinder, Shape

__all__ = ["OutsideWorkspace", "Workspace", "workspace_of"]

EDGE = 0.01
"""mm beyond an edge that still count as on it: what numbers lose on the wire and in sums."""

STEP = 5.0
"""mm of a way that are looked at together."""

Given = Shape | Iterable[Shape]


class OutsideWorkspace(ValueError):
    """A motion leads out of the workspace that `connect` was given; nothing of it was sent."""


@dataclass(frozen=True, slots=True, init=False)
class Workspace:
    """Where a tool may be: in one of the shapes that are allowed, and in none that is forbidden.

    Attributes:
        allowed: Shapes; () is everywhere.
        forbidden: Shapes; their surfaces are not forbidden.
    """

    allowed: tuple[Shape, ...]
    forbidden: tuple[Shape, ...]

    def __init__(self, allowed: Given = (), forbidden: Given = ()) -> None:
        """Say where a tool may be.

        Args:
            allowed: A Box or a Cylinder, or several, in mm and the arm's own coordinates.
            forbidden: The same.

        Raises:
            TypeError: It is something else.
            ValueError: There is neither.
        """
        object.__setattr__(self, "allowed", shapes("allowed", allowed))
        object.__setattr__(self, "forbidden", shapes("forbidden", forbidden))
        if not (self.allowed or self.forbidden):
            raise ValueError("a workspace has shapes that are allowed, or forbidden, or both")

    def check_place(self, place: Sequence[float], what: str = "the target") -> None:
        """Raise OutsideWorkspace, with the place and the shape, for a place that is not in it.

        Args:
            place: x, y, z, mm.
            what: What it is.
        """
        x, y, z = place[:3]
        where: XYZ = float(x), float(y), float(z)
        if self.allowed and not self._out(where) <= EDGE:
            raise OutsideWorkspace(f"{what} {said(where)} is outside of {self._said}")

        for shape in self.forbidden:
            if not shape.outside(where) >= -EDGE:
                raise OutsideWorkspace(f"{what} {said(where)} is in {shape}, which is forbidden")

    def check_way(self, places: Iterable[Sequence[float]]) -> None:
        """Raise OutsideWorkspace for a way that does not end in it, or goes further out on its course.

        Args:
            places: Along the way, where it begins and ends among them; straight in between.
        """
        line = [(float(x), float(y), float(z)) for x, y, z, *_ in places]
        self.check_place(line[-1])
        for start, end in itertools.pairwise(line):
            for a, b in cut(start, end):
                self._check_step(a, b, line[-1])

    def excess(self, place: Sequence[float]) -> tuple[float, ...]:
        """Return how far out of what is allowed a place is, and how deep in each forbidden shape, mm; 0 for not."""
        x, y, z = place[:3]
        where: XYZ = float(x), float(y), float(z)
        return (max(0.0, self._out(where)), *(max(0.0, -shape.outside(where)) for shape in self.forbidden))

    def left(self, least: Sequence[float], excess: Sequence[float]) -> str:
        """Return what is wrong with a place whose excess is more than the least one so far; "" for nothing."""
        for number, (was, now) in enumerate(zip(least, excess, strict=True)):
            if now > was + EDGE:
                return f"in {self.forbidden[number - 1]}, which is forbidden" if number else f"outside of {self._said}"

        return ""

    def _check_step(self, a: XYZ, b: XYZ, target: XYZ) -> None:
        """Raise OutsideWorkspace for a short straight part of the way to a target that leads further out."""
        by = f"the way to {said(target)} leads by {said(b)}"
        if self.allowed and not self._covers(a, b) and (self._out(a) <= EDGE or self._out(b) > self._out(a) + EDGE):
            raise OutsideWorkspace(f"{by}, outside of {self._said}")

        for shape in self.forbidden:
            if shape.outside(a) < -EDGE:
                bad = shape.outside(b) < shape.outside(a) - EDGE
            else:
                bad = shape.stretch(a, b, -EDGE) is not None

            if bad:
                raise OutsideWorkspace(f"{by}, through {shape}, which is forbidden")

    def _covers(self, a: XYZ, b: XYZ) -> bool:
        """Whether the allowed shapes together cover a line."""
        reached, small = 0.0, EDGE / max(EDGE, math.dist(a, b))
        for first, last in sorted(filter(None, (shape.stretch(a, b, EDGE) for shape in self.allowed))):
            if first > reached + small:
                return False

            reached = max(reached, last)

        return reached >= 1 - small

    def _out(self, place: XYZ) -> float:
        """How far a place is from all that is allowed."""
        return min((shape.outside(place) for shape in self.allowed), default=-math.inf)

    @property
    def _said(self) -> str:
        return " and ".join(map(str, self.allowed))


def shapes(name: str, given: Given) -> tuple[Shape, ...]:
    """One shape, or several."""
    found = (given,) if isinstance(given, (Box, Cylinder)) else tuple(given) if isinstance(given, Iterable) else given
    if not isinstance(found, tuple) or not all(isinstance(each, (Box, Cylinder)) for each in found):
        raise TypeError(f"{name} must be a Box or a Cylinder, or several, not {given!r}")

    return found


def workspace_of(given: Workspace | Shape | None) -> Workspace | None:
    """Return what `connect(workspace=...)` was given, a shape alone as allowed; raise TypeError for something else."""
    if given is None or isinstance(given, Workspace):
        return given

    if not isinstance(given, (Box, Cylinder)):
        raise TypeError(f"workspace must be a Workspace, a Box or a Cylinder, not {given!r}")

    return Workspace(given)


def cut(start: XYZ, end: XYZ) -> Iterator[tuple[XYZ, XYZ]]:
    """A straight way in short ones."""
    steps = max(1, math.ceil(math.dist(start, end) / STEP))
    at = [(*(a + (b - a) * step / steps for a, b in zip(start, end, strict=True)),) for step in range(steps + 1)]
    for a, b in itertools.pairwise(at):
        yield (a[0], a[1], a[2]), (b[0], b[1], b[2])


def said(place: XYZ) -> str:
    """A place in words."""
    return f"({', '.join(f'{round(each, 2):g}' for each in place)}) mm"
