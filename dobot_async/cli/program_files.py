"""Program files: checked as a whole, then executed through an arm's queue."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from dobot_async.cli.failures import StepRefused, WrongFile
from dobot_async.cli.params import TextSource
from dobot_async.program import ProgramError, Step

__all__ = ["checked", "execute", "wrong"]


def checked(file: TextSource, parse: Callable[[], Sequence[Step]]) -> Sequence[Step]:
    """Returns the steps of a program; raises WrongFile with the line if one is wrong."""
    try:
        steps = parse()
    except ProgramError as error:
        raise wrong(file, error.summary) from None

    if not steps:
        raise wrong(file, "it has no commands")

    return steps


def wrong(file: TextSource, why: str) -> WrongFile:
    """What is raised for a wrong program."""
    return WrongFile(f"{file.name}: {why}; nothing was sent")


async def execute(queue: Any, steps: Sequence[Step], report: Callable[[int], None] = lambda _: None) -> None:
    """Queues all steps, as room allows, and returns when the arm has executed the last; reports how many it has.

    Raises:
        DobotError: As `arm.queue.stream`, with a note of the lines that it is about.
    """
    done = 0
    try:
        async for _ in queue.stream(steps):
            done += 1
            report(done)
    except ValueError as error:
        refused = StepRefused(str(error))
        for note in getattr(error, "__notes__", ()):
            refused.add_note(note)

        raise refused from error
