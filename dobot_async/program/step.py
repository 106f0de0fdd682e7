"""A step of a program, and what is wrong with one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from dobot_async._core.protocol.wire import Command
from dobot_async.program.text import shortened

__all__ = ["ProgramError", "Step"]


@dataclass(frozen=True, slots=True)
class Step:
    """One command of a program, converted and checked.

    Attributes:
        number: Of its line, from 1; 0 for what the program did not ask for itself.
        text: Of its line.
        command: The row of the table.
        value: Its parameters.
        verb: The word that it begins with.
    """

    number: int
    text: str
    command: Command[Any, Any]
    value: Any
    verb: str = ""

    def __str__(self) -> str:
        return f"line {self.number} ({shortened(self.text)})" if self.number else f"the program's own {self.text}"


class ProgramError(ValueError):
    """Lines of a program are wrong; the message has each with its number.

    Attributes:
        problems: The number of each wrong line, and what is wrong with it.
    """

    def __init__(self, problems: Sequence[tuple[int, str]]) -> None:
        super().__init__("\n".join(f"line {number}: {problem}" for number, problem in problems))
        self.problems: tuple[tuple[int, str], ...] = tuple(problems)

    @property
    def summary(self) -> str:
        """The first wrong line, and the numbers of the others, on one line."""
        (number, problem), *others = self.problems
        found = f"line {number}: {' '.join(problem.split())}"
        if not others:
            return found

        numbers = ", ".join(str(other) for other, _ in others[:MOST]) + (", ..." if len(others) > MOST else "")
        return f"{found} (wrong as well: line{'s' * (len(others) > 1)} {numbers})"


MOST = 10
"""Wrong lines whose numbers are told."""
