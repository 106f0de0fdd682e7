"""`draw`, `engrave` and `write`: from a file or a text to an arm that draws it.

    file, text --> toolpath --> preview --> checked without an arm (exit code 2) --> arm --> Drawing.run

Whatever ends a drawing before its end tells with which `--from-stroke` the rest is drawn.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import click

from dobot_async.cli.drawing_options import Begin, about_pictures, in_file, with_laser, with_paper, with_pen
from dobot_async.cli.drawing_paths import of_file, of_text, with_share_of_power
from dobot_async.cli.failures import StepRefused, WrongFile
from dobot_async.cli.session import Session
from dobot_async.magician.arm import Magician
from dobot_async.magician.effectors import Laser, Pen
from dobot_async.magician.kinematics import Kinematics
from dobot_async.magician.params import EndEffectorParams
from dobot_async.mycobot.arm import MyCobot
from dobot_async.mycobot.models import model_of
from dobot_async.toolpath import (
    Drawing,
    MissingLibrary,
    Progress,
    Toolpath,
    UnreachableStroke,
    WorkPlane,
    check_toolpath,
    estimate,
    preview,
    reachable,
)
from dobot_async.toolpath.moves import Tool
from dobot_async.ultraarm.arm import UltraArm
from dobot_async.ultraarm.params import MANUAL_LIMITS

__all__ = ["draw_file", "engrave_file", "write_line"]

TOOLS: Mapping[Tool, EndEffectorParams] = {"pen": Pen(), "laser": Laser()}
LINES = 10  # of progress in a pipe


@dataclass(frozen=True, slots=True)
class Job:
    """One drawing, as it was asked for.

    Attributes:
        session: Which arm, and where to speak.
        name: Of the file, or the text.
        tool: "pen" or "laser".
        path: What to draw.
        plane: Where the paper lies.
        effector: How a Magician's tool sits.
        begin: Where to begin.
        options: Of a `Drawing`.
    """

    session: Session
    name: str
    tool: Tool
    path: Toolpath
    plane: WorkPlane
    effector: EndEffectorParams
    begin: Begin
    options: Mapping[str, Any]

    @property
    def stand_in(self) -> Any:
        """What is known of the arm before it is connected."""
        kind = self.session.family.kind
        bias = self.effector
        if issubclass(kind, Magician):
            return Kinematics(bias.x_bias, bias.y_bias, bias.z_bias)

        return MANUAL_LIMITS if issubclass(kind, UltraArm) else model_of(self.session.arm)

    def check(self) -> None:
        """Raise UsageError for what cannot be drawn."""
        count = len(self.path)
        if count and not 0 <= self.begin.stroke < count:
            raise click.UsageError(
                f"--from-stroke must be in 0 to {count - 1}, for there are {count} strokes, not {self.begin.stroke}"
            )

        try:
            check_toolpath(
                self.stand_in, self.path, self.plane, tool=self.tool, first=self.begin.stroke, point=self.begin.point
            )
        except UnreachableStroke as error:
            raise WrongFile(f"{self.name}: {error}; nothing was sent") from None
        except ValueError as error:
            where = f"--from-stroke {self.begin}" if self.begin.point else self.name
            raise click.UsageError(f"{where}: {error}") from None

    def estimated(self) -> tuple[float | None, str]:
        """About how many seconds it takes, and in words, or why that is not known."""
        known = self.stand_in
        arm = self.session.arm if known is MANUAL_LIMITS else known
        rest = Toolpath(self.path.strokes[max(0, self.begin.stroke) :])
        try:
            seconds = estimate(rest, self.plane, arm=arm, tool=self.tool, **self.options).seconds
        except ValueError as error:
            return None, f"in a time that is not known ({error})"

        return seconds, f"in about {minutes(seconds)}"

    def save_preview(self, file: str, seconds: float | None) -> None:
        """Save the picture."""
        try:
            preview(self.path, reachable=reachable(self.stand_in, self.plane), seconds=seconds).save(file)
        except OSError as error:
            raise click.UsageError(f"--preview {file}: {error.strerror or error}") from None
        except ValueError as error:
            raise click.UsageError(f"{self.name}: {error}") from None

    def draw(self) -> None:
        """Draw it."""
        output, total = self.session.output, len(self.path)
        with output.counting(self.name, total) as count:
            tell = count if output.terminal else None
            self.session.ask(lambda arm: self._draw(arm, tell))

    async def _draw(self, arm: Any, count: Callable[[int], None] | None) -> None:
        if isinstance(arm, Magician):
            await arm.set_end_effector(self.effector)

        report = Lines(self.session.output.say) if count is None else lambda told: count(told.strokes)
        try:
            drawing = CommandDrawing(arm, self.path, self.plane, tool=self.tool, progress=report, **self.options)
            await drawing.run(first=self.begin.stroke, point=self.begin.point)
        except ValueError as error:  # the way from where it stands, for all else was looked at before
            raise StepRefused(str(error)) from error


class CommandDrawing(Drawing):
    """A drawing whose rest is drawn by another command."""

    def how_to_go_on(self) -> str:
        """Return the option with which the rest is drawn."""
        return f"--from-stroke {Begin(self.next_stroke, self.next_point)}"


class Lines:
    """Some lines of progress."""

    def __init__(self, say: Callable[[str], None]) -> None:
        self._say = say
        self._told = 0

    def __call__(self, progress: Progress) -> None:
        part = int(LINES * progress.strokes / progress.of)
        if part > self._told and progress.strokes < progress.of:
            self._told = part
            self._say(
                f"{progress.strokes} of {progress.of} strokes, {progress.mm:.0f} of {progress.of_mm:.0f} mm, "
                f"{minutes(progress.seconds_left)} left"
            )


@click.command("draw")
@in_file
@with_paper
@with_pen
@about_pictures
@click.pass_obj
def draw_file(session: Session, file: Path, press: float, power: float | None, **given: Any) -> None:
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
def engrave_file(session: Session, file: Path, power: float | None, **given: Any) -> None:
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
    session: Session,
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
    session: Session,
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
def refused(name: str) -> Iterator[None]:
    """What goes wrong in this block is told in one line: nothing was sent."""
    try:
        yield
    except click.UsageError:
        raise
    except (ValueError, MissingLibrary, OSError) as error:
        reason = str(error)
        raise WrongFile(f"{reason if name in reason else f'{name}: {reason}'}; nothing was sent") from None


def speeds(session: Session, given: Mapping[str, Any]) -> dict[str, Any]:
    """How fast, in what the arm knows."""
    knows_percent = issubclass(session.family.kind, MyCobot)
    name, other = ("percent", "speed") if knows_percent else ("speed", "percent")
    if given[other] is not None:
        known = "percent alone: give --percent" if knows_percent else "mm/s: give --speed"
        raise click.UsageError(f"--{other}: --arm {session.arm} knows {known}")

    return {} if given[name] is None else {name: given[name]}


def effector_of(session: Session, tool: Tool, offsets: tuple[float, float, float] | None) -> EndEffectorParams:
    """How the tool sits."""
    if offsets is None:
        return TOOLS[tool]

    if not issubclass(session.family.kind, Magician):
        raise click.UsageError(f"--tool is for --arm magician alone, not for {session.arm}")

    return EndEffectorParams(*cast("tuple[Any, Any, Any]", offsets))


def minutes(seconds: float) -> str:
    """Seconds as minutes."""
    whole = round(seconds)
    return f"{whole // 60}:{whole % 60:02d} min"
