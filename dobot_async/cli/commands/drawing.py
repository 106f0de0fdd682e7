"""`draw`, `engrave` and `write`: from a file or a text to an arm that draws it.

    file, text --> toolpath --> preview --> checked without an arm (exit code 2) --> arm --> Drawing.run

Whatever ends a drawing before its end tells with which `--from-stroke` the rest is drawn.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, cast

import click

from dobot_async.arms.magician.arm import Magician
from dobot_async.arms.magician.effectors import Laser, Pen
from dobot_async.arms.magician.params import EndEffectorParams
from dobot_async.arms.mycobot.arm import MyCobot
from dobot_async.cli.drawing_job import Job
from dobot_async.cli.drawing_options import about_pictures, in_file, with_laser, with_paper, with_pen
from dobot_async.cli.drawing_paths import of_file, of_text, with_share_of_power
from dobot_async.cli.failures import WrongFile
from dobot_async.cli.session import CommandSession
from dobot_async.toolpath import MissingLibrary, Toolpath, WorkPlane
from dobot_async.toolpath.moves import Tool

__all__ = ["draw_file", "engrave_file", "write_line"]

TOOLS: Mapping[Tool, EndEffectorParams] = {"pen": Pen(), "laser": Laser()}


@click.command("draw")
@in_file
@with_paper
@with_pen
@about_pictures
@click.pass_obj
def draw_file(session: CommandSession, /, file: Path, press: float, power: float | None, **given: Any) -> None:
    """Draw a file with a pen: SVG, DXF, G-code, a picture.

    All strokes, the ways between them and the lifts are checked for the arm before anything is sent. An interrupted
    stroke is drawn again from its start. Ctrl-C stops the arm, and tells with which --from-stroke the rest is drawn.
    """
    if power is not None and not press:
        raise click.UsageError("--power: a pen without --press has no pressure")

    make(session, file.name, "pen", lambda: path_of(file, given), given, {"file": str(file)}, press=press, power=power)


@click.command("engrave")
@in_file
@with_paper
@with_laser
@about_pictures
@click.pass_obj
def engrave_file(session: CommandSession, /, file: Path, power: float | None, **given: Any) -> None:
    """Engrave a picture or a drawing with the laser.

    The tool touches the paper where the laser is in focus. All of it is checked for the arm before anything is sent.
    Ctrl-C switches the laser off and stops the arm, and tells with which --from-stroke the rest is engraved: it goes on
    where it was stopped, so that nothing is burnt twice. Wear the glasses.
    """
    if issubclass(session.family.kind, MyCobot):
        session.only("magician", "ultraarm")

    make(session, file.name, "laser", lambda: path_of(file, given), given, {"file": str(file)}, power=power)


@click.command("write")
@click.argument("text")
@click.option("--height", type=float, help="Of a capital letter, mm.  [default: 10]")
@click.option("--font", default="futural", show_default=True, help="futural is plain, scripts handwriting.")
@click.option("--align", type=click.Choice(["left", "centre", "right"]), default="left", show_default=True)
@with_paper
@with_pen
@click.pass_obj
def write_line(
    session: CommandSession,
    /,
    text: str,
    height: float | None,
    font: str,
    align: str,
    press: float,
    power: float | None,
    **given: Any,
) -> None:
    r"""Write a text with a pen.

    TEXT is in single-stroke letters; \n in it begins a new line. All of it is checked for the arm before anything is
    sent. Ctrl-C stops the arm, and tells with which --from-stroke the rest is written.
    """
    if power is not None and not press:
        raise click.UsageError("--power: a pen without --press has no pressure")

    def read() -> Toolpath:
        return of_text(text, given["size"], height, font, align)

    make(session, text, "pen", read, given, {"text": text}, press=press, power=power)


def path_of(file: Path, given: Mapping[str, Any]) -> Toolpath:
    """What a file holds, as the options have it."""
    return of_file(file, given["size"], given["mode"], given["line"], keep_order=given["keep_order"])


def make(
    session: CommandSession,
    name: str,
    tool: Tool,
    read: Callable[[], Toolpath],
    given: Mapping[str, Any],
    answer: dict[str, Any],
    *,
    power: float | None,
    press: float = 0.0,
) -> None:
    """Read, show, check and draw something."""
    options = speeds(session, given)
    effector = effector_of(session, tool, given["tool"])
    with refused(name):
        path = read()
        if power is not None:
            path = with_share_of_power(path, power)

        plane = WorkPlane.flat(*given["at"], rotation=given["rotate"], lift=given["lift"], press=press)
        if not path.strokes:
            raise ValueError("there is nothing to draw")

    job = Job(session, name, tool, path, plane, effector, given["begin"], options)
    seconds, how_long = job.estimated() if given["dry_run"] or given["preview"] else (None, "")
    with refused(name):
        if given["preview"]:
            job.save_preview(given["preview"], seconds)
            answer["preview"] = given["preview"]

    job.check()
    answer |= {"strokes": len(path), "mm": round(path.length, 1), "travel": round(path.travel, 1)}
    what = f"{name}: {len(path)} strokes, {path.length:.0f} mm"
    if given["dry_run"]:
        session.output.answer({**answer, "seconds": seconds, "sent": False}, f"{what} would be drawn {how_long}")
        return

    session.target()
    job.draw()
    session.output.answer({**answer, "sent": True}, f"{what} done")


@contextmanager
def refused(name: str) -> Generator[None]:
    """What goes wrong in this block is told in one line: nothing was sent."""
    try:
        yield
    except click.UsageError:
        raise
    except (ValueError, MissingLibrary, OSError) as error:
        reason = str(error)
        raise WrongFile(f"{reason if name in reason else f'{name}: {reason}'}; nothing was sent") from None


def speeds(session: CommandSession, given: Mapping[str, Any]) -> dict[str, Any]:
    """How fast, in what the arm knows."""
    knows_percent = issubclass(session.family.kind, MyCobot)
    name, other = ("percent", "speed") if knows_percent else ("speed", "percent")
    if given[other] is not None:
        known = "percent alone: give --percent" if knows_percent else "mm/s: give --speed"
        raise click.UsageError(f"--{other}: --arm {session.arm} knows {known}")

    return {} if given[name] is None else {name: given[name]}


def effector_of(session: CommandSession, tool: Tool, offsets: tuple[float, float, float] | None) -> EndEffectorParams:
    """How the tool sits."""
    if offsets is None:
        return TOOLS[tool]

    if not issubclass(session.family.kind, Magician):
        raise click.UsageError(f"--tool is for --arm magician alone, not for {session.arm}")

    return EndEffectorParams(*cast("tuple[Any, Any, Any]", offsets))
