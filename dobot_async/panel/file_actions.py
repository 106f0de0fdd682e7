"""The actions of a page on files: the taught list, and drawings."""

from __future__ import annotations

from collections.abc import Coroutine, Mapping
from typing import Any

from dobot_async.panel.arguments import Arguments
from dobot_async.panel.arm_tasks import ArmTask
from dobot_async.panel.arms import ArmView
from dobot_async.panel.requests import PageRequest
from dobot_async.toolpath import WorkPlane

__all__ = [
    "draw",
    "preview",
    "teach_clear",
    "teach_edit",
    "teach_load",
    "teach_move",
    "teach_play",
    "teach_remove",
    "teach_take",
]

FAR = 2000.0  # mm
TOOLS = ("pen", "laser")


def teach_take(call: PageRequest) -> Coroutine[Any, Any, Any]:
    """Take a point."""
    taught, name = call.station.taught, call.given.text("name", "")
    mode = call.given.word("mode", call.station.view.modes) if call.given.has("mode") else None
    return call.work("take a point", lambda view, _: taught.take(view, mode=mode, name=name), beside=True)


def teach_remove(call: PageRequest) -> None:
    """Take a point out."""
    call.station.taught.remove(call.given.whole("index", 0, 10_000))


def teach_move(call: PageRequest) -> None:
    """Put it elsewhere in the list."""
    call.station.taught.move(call.given.whole("index", 0, 10_000), call.given.whole("to", 0, 10_000))


def teach_edit(call: PageRequest) -> None:
    """Change it."""
    call.station.taught.edit(call.given.whole("index", 0, 10_000), call.given.mapping("changes"))


def teach_clear(call: PageRequest) -> None:
    """Begin a new list."""
    call.station.taught.set(())


def teach_load(call: PageRequest) -> None:
    """Take what is in a file."""
    file = call.given.text("file")
    call.given.end()
    call.station.taught.load(file)


def teach_play(call: PageRequest) -> Coroutine[Any, Any, Any]:
    """Let the arm do it."""
    loops = call.given.number_or_none("loops", 1, 10_000, 1)
    options = {
        "speed": call.given.number_or_none("speed", 1, 100),
        "loops": None if loops is None else int(loops),
        "reverse": call.given.flag("reverse", default=False),
    }
    return call.work("play", lambda view, work: call.station.taught.play(view, work, **options), alone=True)


def plane_of(call: PageRequest) -> WorkPlane:
    """Return where the paper lies."""
    given = Arguments(call.given.mapping("plane"))
    x, y, z = (given.number(axis, -FAR, FAR) for axis in "xyz")
    rotation = given.number("rotation", -360, 360, 0)
    lift, press = given.number("lift", 0, 100, 5), given.number("press", 0, 20, 0)
    given.end()
    return WorkPlane.flat(x, y, z, rotation=rotation, lift=lift, press=press)


def size_of(call: PageRequest) -> tuple[float, float] | None:
    """Return how large the drawing is to be; None leaves it."""
    found = call.given.numbers("size", {2}, optional=True)
    if found is None:
        return None

    if not all(0.1 <= each <= FAR for each in found):
        raise ValueError("size must be a width and a height of 0.1 mm or more")

    return found[0], found[1]


def preview(call: PageRequest) -> Coroutine[Any, Any, Any]:
    """Show a drawing at a place."""
    file, plane, size = call.given.text("file"), plane_of(call), size_of(call)
    tool = call.given.word("tool", TOOLS, "pen")
    call.given.end()
    return call.session.state.drawings.preview(call.station.view, file, plane, size, tool)


def draw(call: PageRequest) -> Coroutine[Any, Any, Any]:
    """Draw it."""
    station, drawings = call.station, call.session.state.drawings
    file, plane, size = call.given.text("file"), plane_of(call), size_of(call)
    tool = call.given.word("tool", TOOLS, "pen")
    options: dict[str, Any] = {
        "tool": tool,
        "speed": call.given.number_or_none("speed", 1, 500),
        "first": call.given.whole("first", 0, 1_000_000, 0),
        "works": station.works,
    }
    if tool == "laser":
        station.check_armed()

    async def drawn(view: ArmView, work: ArmTask) -> Mapping[str, Any]:
        return await drawings.draw(view, file, plane, size, **options, work=work)

    return call.work("engrave" if tool == "laser" else "draw", drawn, alone=True)
