"""A drawing as it was asked for on the command line: checked, shown and estimated without an arm, and drawn by one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import click

from dobot_async.arms.magician.arm import Magician
from dobot_async.arms.magician.kinematics import Kinematics
from dobot_async.arms.magician.params import EndEffectorParams
from dobot_async.arms.mycobot.models import model_of
from dobot_async.arms.ultraarm.arm import UltraArm
from dobot_async.arms.ultraarm.limits import MANUAL_LIMITS
from dobot_async.cli.drawing_options import Begin
from dobot_async.cli.failures import Interrupted, StepRefused, WrongFile
from dobot_async.cli.session import CommandSession
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
)
from dobot_async.toolpath.moves import Tool

__all__ = ["Job"]

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

    session: CommandSession
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
            begun: list[Drawing] = []
            try:
                self.session.ask(lambda arm: self._draw(arm, tell, begun))
            except Interrupted as interrupted:
                if not interrupted.problems and any(each.next_stroke == total for each in begun):
                    raise Interrupted(interrupted.number, ("all strokes are done",)) from None

                raise

    async def _draw(self, arm: Any, count: Callable[[int], None] | None, begun: list[Drawing]) -> None:
        if isinstance(arm, Magician):
            await arm.set_end_effector(self.effector)

        def tick(told: Progress) -> None:
            if count:
                count(told.strokes)

        report = tick if count else ProgressLines(self.session.output.say)
        try:
            drawing = CommandDrawing(arm, self.path, self.plane, tool=self.tool, progress=report, **self.options)
            begun.append(drawing)
            await drawing.run(first=self.begin.stroke, point=self.begin.point)
        except ValueError as error:  # the way from where it stands, for all else was looked at before
            raise StepRefused(str(error)) from error


class CommandDrawing(Drawing):
    """A drawing whose rest is drawn by another command."""

    def how_to_go_on(self) -> str:
        """Return the option with which the rest is drawn."""
        return f"--from-stroke {Begin(self.next_stroke, self.next_point)}"


class ProgressLines:
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


def minutes(seconds: float) -> str:
    """Seconds as minutes."""
    whole = round(seconds)
    return f"{whole // 60}:{whole % 60:02d} min"
