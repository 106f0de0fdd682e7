"""Files that were dropped on a page: read beside the event loop, shown, checked against the reach, and drawn.

bytes --reader, in a thread--> Toolpath, kept under a short name --preview--> picture, time, what is out of reach
`--draw-----> Drawing, in the driver's own way
"""

from __future__ import annotations

import asyncio
import io
import itertools
from collections.abc import Callable, Mapping
from pathlib import PurePath
from typing import Any

from dobot_async.errors import DobotError
from dobot_async.panel.arm_tasks import ArmTask, ArmTasks
from dobot_async.panel.arms import ArmView
from dobot_async.panel.problems import PanelRefusal
from dobot_async.toolpath import (
    Drawing,
    Progress,
    Toolpath,
    UnreachableStroke,
    WorkPlane,
    check_toolpath,
    estimate,
    preview,
    reachable,
    read_dxf,
    read_gcode,
    read_picture,
    read_svg,
    trace_picture,
)

__all__ = ["MODES", "Drawings", "Size"]

Size = tuple[float, float] | None
KEPT = 8  # files
LONGEST = 30.0  # seconds that a file may take to be read
MOST_POINTS = 200_000
SHOWN = 5000  # points that a page draws itself
FINEST, COARSER = 0.05, 2.0  # mm by which what is shown may miss the drawing, and by how much more each time
READERS: Mapping[str, Callable[[Any], Toolpath]] = {
    ".svg": lambda data: read_svg(data).order(),
    ".dxf": lambda data: read_dxf(data).order(),
    **dict.fromkeys((".gcode", ".nc", ".ngc", ".g", ".gc", ".tap"), read_gcode),
}
MODES: Mapping[str, Callable[[Any], Toolpath]] = {
    "outline": lambda data: trace_picture(data).order(),
    "threshold": lambda data: read_picture(data, shading="threshold"),
    "dither": lambda data: read_picture(data, shading="floyd-steinberg"),
    "grey": lambda data: read_picture(data, shading="grey"),
}
"""How a picture becomes strokes."""

PICTURES = (".png", ".jpg", ".jpeg", ".bmp", ".gif", ".tif", ".tiff", ".webp")


class Drawings:
    """The files of a panel; the oldest goes when there are too many."""

    def __init__(self) -> None:
        self._files: dict[str, tuple[str, Toolpath]] = {}
        self._numbers = itertools.count(1)
        self._reading = asyncio.Lock()

    async def add(self, data: bytes, name: str, mode: str) -> dict[str, Any]:
        """Read a file, and keep what it draws.

        Raises:
            ValueError: It is broken, empty, or of no kind that is known.
            Refusal: Another one is being read, or it takes too long.
        """
        read = reader_of(name, mode)
        if self._reading.locked():
            raise PanelRefusal("busy", "another file is being read: try again in a moment")

        await self._reading.acquire()
        work = asyncio.ensure_future(asyncio.to_thread(toolpath_of, read, data, name))
        work.add_done_callback(lambda _: self._reading.release())  # a thread that takes too long goes on alone
        try:
            async with asyncio.timeout(LONGEST):
                path, lines = await asyncio.shield(work)
        except TimeoutError:
            raise PanelRefusal("file", f"{name}: it takes more than {LONGEST:.0f} s to read; make it simpler") from None

        file = f"f{next(self._numbers)}"
        self._files[file] = name, path
        while len(self._files) > KEPT:
            del self._files[next(iter(self._files))]

        return {"file": file, "name": name, **facts(path), "lines": lines, "svg": preview(path).svg()}

    async def preview(self, view: ArmView, file: str, plane: WorkPlane, size: Size, tool: Any) -> dict[str, Any]:
        """Return what a drawing is at a place: its lines, a picture, its time, and what the arm cannot do."""
        name, path = self._fitted(file, size)
        return await asyncio.to_thread(looked_at, view, name, path, plane, tool)

    async def draw(
        self,
        view: ArmView,
        file: str,
        plane: WorkPlane,
        size: Size,
        *,
        tool: Any,
        speed: float | None,
        first: int,
        works: ArmTasks,
        work: ArmTask,
    ) -> dict[str, Any]:
        """Draw a file; return when the arm has done it."""
        _, path = self._fitted(file, size)

        def report(progress: Progress) -> None:
            works.get_on(work, progress.mm / progress.of_mm if progress.of_mm else None, progress.seconds_left)

        drawing = await asyncio.to_thread(
            lambda: Drawing(view.arm, path, plane, tool=tool, progress=report, **view.drawing_options(speed))
        )
        try:
            await drawing.run(first=first)
        except DobotError as error:
            error.add_note(f"{drawing.next_stroke} of {len(path)} strokes are done")
            raise

        return {"strokes": len(path)}

    def _fitted(self, file: str, size: Size) -> tuple[str, Toolpath]:
        if file not in self._files:
            raise PanelRefusal("file", "this file is not here any more: drop it again")

        name, path = self._files[file]
        return name, path.fit(*size) if size else path


def reader_of(name: str, mode: str) -> Callable[[Any], Toolpath]:
    """Return what reads a file, by the ending of its name; raise ValueError for others."""
    suffix = PurePath(name).suffix.lower()
    if suffix in PICTURES:
        return MODES[mode]

    if suffix in READERS:
        return READERS[suffix]

    raise ValueError(f"a name ends in one of {', '.join((*READERS, *PICTURES))}, not in {suffix!r}")


def toolpath_of(read: Callable[[Any], Toolpath], data: bytes, name: str) -> tuple[Toolpath, list[Any]]:
    """Return a file's strokes with their lower left corner at the origin, and as a page shows them."""
    stream = io.BytesIO(data)
    stream.name = name
    path = read(stream)
    if not path.strokes:
        raise ValueError(f"{name}: there is nothing to draw in it")

    if path.points > MOST_POINTS:
        raise ValueError(f"{name}: it has {path.points} points, and {MOST_POINTS} are as many as may be")

    path = path.translate(-path.bounds.left, -path.bounds.bottom)
    return path, shown(path)


def shown(path: Toolpath) -> list[Any]:
    """Return lines of few points."""
    tolerance = FINEST
    while path.points > SHOWN and tolerance < max(path.bounds.width, path.bounds.height):
        path = path.simplify(tolerance)
        tolerance *= COARSER

    strokes = path.strokes[:: max(1, path.points // SHOWN)]
    return [[[round(x, 2), round(y, 2)] for x, y in stroke.points] for stroke in strokes]


def looked_at(view: ArmView, name: str, path: Toolpath, plane: WorkPlane, tool: Any) -> dict[str, Any]:
    """See `Drawings.preview`."""
    problems: list[str] = []
    seconds = None
    try:
        check_toolpath(view.arm, path, plane, tool=tool)
    except UnreachableStroke as error:
        problems.append(str(error))

    if not problems:
        try:
            seconds = estimate(path, plane, arm=view.arm, tool=tool).seconds
        except ValueError as error:
            problems.append(f"the time is not known: {error}")

    picture = preview(path, reachable=reachable(view.arm, plane), seconds=seconds)
    lines = [[plane.to_arm(x, y) for x, y in line] for line in shown(path)]
    return {**facts(path), "name": name, "svg": picture.svg(), "lines": lines, "seconds": seconds, "problems": problems}


def facts(path: Toolpath) -> dict[str, Any]:
    """Return its size in numbers."""
    bounds = path.bounds
    return {
        "bounds": [bounds.left, bounds.bottom, bounds.right, bounds.top],
        "length": path.length,
        "travel": path.travel,
        "strokes": len(path),
    }
