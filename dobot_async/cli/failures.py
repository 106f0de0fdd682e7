"""How commands end that fail: what each failure says, and the exit codes.

0        done
1        the arm or the link failed; one line on standard error says how
2        wrong usage, and nothing was sent; of a program, one line on standard error says which of its lines is wrong
128 + n  signal n ended it: 130 Ctrl-C, 143 SIGTERM; 141 if nobody reads the output any more
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import IO, Any

import click

from dobot_async.errors import DobotError

__all__ = ["FAILED", "OUTPUT_CLOSED", "Interrupted", "StepRefused", "WrongFile"]

FAILED = 1
OUTPUT_CLOSED = 141  # what a shell reports of a program that SIGPIPE ended


class Interrupted(Exception):
    """A signal ended the work, and everything was closed.

    Attributes:
        number: The signal's.
        problems: What went wrong on the way out, such as an arm that did not acknowledge its stop.
    """

    def __init__(self, number: int, problems: Sequence[str]) -> None:
        super().__init__(number)
        self.number = number
        self.problems = problems


class StepRefused(DobotError):
    """A step cannot be done, as was found when others had been sent: that is no wrong usage any more."""


class WrongFile(click.UsageError):
    """A file is wrong, and nothing was sent: one line says where."""

    def show(self, file: IO[Any] | None = None) -> None:
        """Prints the line."""
        click.echo(f"error: {' '.join(self.message.split())}", file=file, err=file is None)
