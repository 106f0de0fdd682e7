"""`run`: program files, one verb a line, read and checked as a whole before anything is sent.

    # pick a piece up
    home
    move 200 0 50           # mm and degrees
    move 200 0 5 mode=movl
    suction on
    wait 0.5

Which verbs there are depends on the arm; `dobot_async.program` reads them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import click

from dobot_async.cli.failures import StepRefused, WrongFile
from dobot_async.cli.params import PROGRAM, Text
from dobot_async.cli.session import Session
from dobot_async.families import REGISTERED
from dobot_async.program import VOCABULARIES, ProgramError, Step
from dobot_async.program.text import lines_in

__all__ = ["checked", "execute", "run_program", "wrong"]


class RunCommand(click.Command):
    """The command whose help has the verbs of all arms."""

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002 - the same for all
        """Writes the verbs of each family; a model has those of its family."""
        with formatter.section("Verbs"):
            formatter.write_dl([(name, VOCABULARIES[name].usage()) for name in VOCABULARIES if name in REGISTERED])


@click.command("run", cls=RunCommand)
@click.argument("file", type=PROGRAM)
@click.option("--dry-run", is_flag=True, help="Only check it: no arm is needed, and nothing is sent.")
@click.option("--download", is_flag=True, help="Store it in a magician, which runs it when its key is pressed.")
@click.option("--loops", type=click.IntRange(1), help="How often the arm runs what is stored.  [default: 1]")
@click.pass_obj
def run_program(session: Session, file: Text, dry_run: bool, download: bool, loops: int | None) -> None:
    """Run a program file.

    FILE (- is standard input) has one verb a line, as in: move 200 0 50 mode=movl. All lines are checked for the arm,
    with its limits and its reach, before anything is sent. What an earlier program left in the arm's queue is thrown
    away. Ctrl-C stops the arm.
    """
    if loops and not download:
        raise click.UsageError("--loops is for --download")

    if download:
        session.only("magician")

    steps = checked(file, lambda: session.vocabulary.parse(lines_in(file.text)))
    if not dry_run:
        session.target()
        with session.output.counting(file.name, len(steps)) as report:
            session.ask(lambda arm: store(arm, steps, loops or 1) if download else execute(arm.queue, steps, report))

    answer = {"file": file.name, "commands": len(steps)}
    done = "stored" if download else "done"
    if dry_run:
        answer["sent"], done = False, "would run"

    session.output.answer(answer, f"{file.name}: {len(steps)} commands {done}")


def checked(file: Text, parse: Callable[[], Sequence[Step]]) -> Sequence[Step]:
    """Returns the steps of a program; raises WrongFile with the line if one is wrong."""
    try:
        steps = parse()
    except ProgramError as error:
        raise wrong(file, error.summary) from None

    if not steps:
        raise wrong(file, "it has no commands")

    return steps


def wrong(file: Text, why: str) -> WrongFile:
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


async def store(arm: Any, steps: Sequence[Step], loops: int) -> None:
    """Stores all steps in an arm."""
    async with arm.queue.download(loops=loops) as program:
        for step in steps:
            program.put(step.command, step.value)
