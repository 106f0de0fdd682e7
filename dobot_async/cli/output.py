"""What the commands say: an answer as text or as one JSON object, progress on a terminal, errors on one line.

Only an answer goes to standard output. Progress is drawn there too, and wiped, but only if it is a terminal and no JSON
was asked for. rich is imported when something is drawn.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any

import click

from dobot_async._core.util.plain import is_row, is_table, plain
from dobot_async.errors import ArmAlarm

__all__ = ["Output", "words"]


@dataclass(frozen=True, slots=True)
class Output:
    """Where a command speaks.

    Attributes:
        as_json: Answers are JSON objects, one a line.
    """

    as_json: bool

    @property
    def terminal(self) -> bool:
        """Whether somebody looks at it: progress and live displays may be drawn."""
        return not self.as_json and sys.stdout is not None and sys.stdout.isatty()

    def answer(self, value: Any, text: str) -> None:
        """Prints a command's answer: as JSON if that was asked for, else as text."""
        click.echo(json.dumps(plain(value)) if self.as_json else text)

    def say(self, text: str) -> None:
        """Prints a line on the way to the answer; nothing of it with JSON."""
        if not self.as_json:
            click.echo(text)

    def fail(self, error: Exception) -> None:
        """Prints what went wrong: a line on standard error, and an object in place of the answer with JSON."""
        message = " ".join(": ".join([*getattr(error, "__notes__", ()), str(error) or type(error).__name__]).split())
        with suppress(OSError):  # what failed may be the output itself
            click.echo(f"error: {message}", err=True)
            if self.as_json:
                alarms = error.alarms if isinstance(error, ArmAlarm) else ()
                self.answer({"error": type(error).__name__, "message": message, "alarms": alarms}, "")

    @contextmanager
    def working(self, what: str) -> Generator[None]:
        """Shows on a terminal that something goes on, for the length of a block."""
        if not self.terminal:
            yield
            return

        from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

        with Progress(SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn(), transient=True) as bar:
            bar.add_task(what, total=None)
            yield

    @contextmanager
    def counting(self, what: str, total: int) -> Generator[Callable[[int], None]]:
        """Shows on a terminal how much of something is done, for the length of a block; yields what to tell it by."""
        if not self.terminal:
            yield lambda _: None
            return

        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

        columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()
        with Progress(*columns, transient=True) as bar:
            task = bar.add_task(what, total=total)
            yield lambda done: bar.update(task, completed=done)

    @contextmanager
    def panel(self) -> Generator[Callable[[Mapping[str, str]], None]]:
        """Draws named lines in place on a terminal, for the length of a block; yields what to draw them with."""
        from rich.live import Live
        from rich.table import Table

        def draw(rows: Mapping[str, str]) -> None:
            table = Table(show_header=False)
            for name, text in rows.items():
                table.add_row(name, text)

            live.update(table, refresh=True)

        with Live(auto_refresh=False) as live:
            yield draw

    @contextmanager
    def table(self, columns: Sequence[str]) -> Generator[Callable[[Sequence[Sequence[str]]], None]]:
        """Draws a table in place on a terminal, for the length of a block; yields what to draw its rows with."""
        from rich.live import Live
        from rich.table import Table

        def draw(rows: Sequence[Sequence[str]]) -> None:
            table = Table(*columns)
            for row in rows:
                table.add_row(*row)

            live.update(table, refresh=True)

        with Live(auto_refresh=False) as live:
            yield draw


def words(value: Any) -> str:
    """Returns a value on one line, as people read it."""
    value = plain(value)
    if is_table(value):
        return ", ".join(f"{name} {words(each)}" for name, each in value.items()) or "nothing"

    if is_row(value):
        return f"({', '.join(map(words, value))})" if value else "none"

    return "nothing" if value is None else f"{value:g}" if isinstance(value, float) else str(value)
