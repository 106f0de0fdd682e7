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

from collections.abc import Sequence
from typing import Any

import click

from dobot_async.arms.registry import REGISTERED
from dobot_async.cli.params import PROGRAM, TextSource
from dobot_async.cli.program_files import checked, execute
from dobot_async.cli.session import CommandSession
from dobot_async.program import VOCABULARIES, Step
from dobot_async.program.text import lines_in

__all__ = ["run_program"]


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
def run_program(session: CommandSession, file: TextSource, dry_run: bool, download: bool, loops: int | None) -> None:
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


async def store(arm: Any, steps: Sequence[Step], loops: int) -> None:
    """Stores all steps in an arm."""
    async with arm.queue.download(loops=loops) as program:
        for step in steps:
            program.put(step.command, step.value)
