"""The action that draws: a text, or an SVG picture, with a pen. There is none for the laser."""

from __future__ import annotations

import io
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

from dobot_async.remote.actions import Note, Strict, Way, action
from dobot_async.remote.moves import reached
from dobot_async.remote.site import RemoteArm
from dobot_async.toolpath import Drawing, Progress, Toolpath, WorkPlane, estimate, read_svg, write_text

__all__ = ["Draw"]

MOST_LETTERS = 500
MOST_POINTS = 20_000
LARGEST = 10_000.0  # mm, a side that does not count
Spot = tuple[float, float, float]


@action
@dataclass(frozen=True, kw_only=True)
class Draw(Strict):
    """Draw a text, or an SVG picture, with a pen."""

    x: float
    y: float
    z: float
    text: str | None = None
    svg: str | None = None
    height: float = 10.0
    fit_width: float | None = None
    fit_height: float | None = None
    rotate: float = 0.0
    lift: float = 5.0
    speed: float | None = None
    do: Literal["draw"] = "draw"

    def check(self, on: RemoteArm) -> None:
        """All strokes, where the pen is down and where it is up."""
        on.check_speed(self.speed)
        path, plane = self.toolpath(), self.plane()
        for spot in spots(path, plane):
            on.check_spot(spot, "a point of the drawing")

        for start, end in pen_ways(path, plane):
            on.check_straight(start, end)

    def ways(self, on: RemoteArm, start: Spot) -> list[Way]:
        """Each stroke."""
        self.check(on)
        plane = self.plane()
        strokes = [tuple(plane.to_arm(*point) for point in stroke.points) for stroke in self.toolpath()]
        return [(start, strokes[0][0]), *strokes]

    async def run(self, on: RemoteArm, note: Note) -> dict[str, Any]:
        """Do it."""
        percent = on.check_speed(self.speed)
        path = self.toolpath()

        def progress(told: Progress) -> None:
            note(f"drawing: {told.strokes} of {told.of} strokes")

        note("drawing")
        await on.traits.pace(on.arm, percent)
        arm: Any = on.arm
        drawing = Drawing(arm, path, self.plane(), tool="pen", progress=progress, **on.traits.pen(percent))
        await drawing.run()
        return {"strokes": len(path), "mm": round(path.length, 1), **await reached(on, self.do)}

    def seconds(self, on: RemoteArm) -> float | None:
        """Return about how long it takes; None where nothing tells."""
        percent = on.check_speed(self.speed)
        try:
            return estimate(self.toolpath(), self.plane(), arm=on.arm, tool="pen", **on.traits.pen(percent)).seconds
        except ValueError:
            return None

    def toolpath(self) -> Toolpath:
        """Return the strokes; raise ValueError for what is none, or too much."""
        if (self.text is None) == (self.svg is None):
            raise ValueError("draw needs text, or svg, and not both")

        if self.text is not None:
            if len(self.text) > MOST_LETTERS:
                raise ValueError(f"text has {MOST_LETTERS} characters at the most, not {len(self.text)}")

            path = write_text(self.text, self.height)
        else:
            path = read_svg(io.StringIO(self.svg)).order()

        if not path.strokes:
            raise ValueError("there is nothing to draw")

        if sum(len(stroke.points) for stroke in path) > MOST_POINTS:
            raise ValueError(f"a drawing has {MOST_POINTS} points at the most")

        path = path.translate(-path.bounds.left, -path.bounds.bottom)
        if self.fit_width is None and self.fit_height is None:
            return path

        fitted = path.fit(*(LARGEST if side is None else side for side in (self.fit_width, self.fit_height)))
        return fitted.translate(-fitted.bounds.left, -fitted.bounds.bottom)

    def plane(self) -> WorkPlane:
        """Return where the paper lies."""
        return WorkPlane.flat(self.x, self.y, self.z, rotation=self.rotate, lift=self.lift)


def spots(path: Toolpath, plane: WorkPlane) -> Iterator[Spot]:
    """Where the pen is down, and where it is lifted."""
    for stroke in path:
        for point in stroke.points:
            yield plane.to_arm(*point)

        yield plane.to_arm(*stroke.start, plane.lift)
        yield plane.to_arm(*stroke.end, plane.lift)


def pen_ways(path: Toolpath, plane: WorkPlane) -> Iterator[tuple[Spot, Spot]]:
    """The straight ways of the pen on the paper."""
    for stroke in path:
        for start, end in zip(stroke.points, stroke.points[1:], strict=False):
            yield plane.to_arm(*start), plane.to_arm(*end)
