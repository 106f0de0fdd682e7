"""`cell`: all arms of a cell file at once.

    dobot-async cell cell.toml status | home | stop | run PROGRAM | watch

`home` and `run` need all arms, and stop them all when one fails. `status`, `stop` and `watch` do what they can with
each arm, whatever the others do.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Awaitable, Callable, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any, TypeVar

import click

from dobot_async.cli.cell_program import CellProgram, parse_cell_program, run_cell_program
from dobot_async.cli.cell_watch import CellReading, joined_alone, observe, read, told_by
from dobot_async.cli.failures import FAILED, WrongFile
from dobot_async.cli.output import Output
from dobot_async.cli.params import ABOVE_ZERO, PROGRAM, TextSource
from dobot_async.cli.program_files import wrong
from dobot_async.cli.session import CommandSession, run
from dobot_async.cli.trace import tracing
from dobot_async.errors import DobotError
from dobot_async.fleet.cell import Cell, parse_cell
from dobot_async.fleet.fleet import Fleet
from dobot_async.fleet.fleet_arm import Member
from dobot_async.program import ProgramError
from dobot_async.program.text import lines_in
from dobot_async.traces import TraceFile

__all__ = ["cell"]

T = TypeVar("T")
COLUMNS = ("arm", "family", "tool in the cell", "alarms", "link")


@dataclass(frozen=True, slots=True)
class Chosen:
    """The cell, and how to speak."""

    session: CommandSession
    cell: Cell

    @property
    def output(self) -> Output:
        """Where to speak."""
        return self.session.output

    @asynccontextmanager
    async def fleet(self, trace: TraceFile | None) -> AsyncGenerator[Fleet[Any]]:
        """Connects to all arms."""
        cell, record = self.cell, {"record": trace} if trace else {}
        async with Fleet.connect(cell.members, zones=cell.zones, groups=cell.groups, **record) as fleet:
            self.session.commanding = True
            yield fleet


@click.group()
@click.argument("file", type=PROGRAM)
@click.pass_context
def cell(ctx: click.Context, file: TextSource) -> None:
    """Drive all arms of a cell, or watch them.

    FILE is a cell file (TOML): arms with their URLs, where they stand, their groups, and zones.
    """
    try:
        ctx.meta[__name__] = Chosen(ctx.obj, parse_cell(file.text))
    except ValueError as error:
        raise WrongFile(f"{file.name}: {error}; nothing was sent") from None


def chosen() -> Chosen:
    """What stands before the subcommand."""
    found: Chosen = click.get_current_context().meta[__name__]
    found.session.refuse("a cell file has the URLs of the arms, and their families", "url", "arm")
    return found


@cell.command()
def status() -> None:
    """Tell of each arm where its tool is, and its alarms.

    Ends with 1 if an arm does not answer.
    """
    here = chosen()
    cell = here.cell
    readings = run(alone(here, lambda name, arm: read(cell.members[name], arm), control=False))
    told = {name: told_by(cell.members[name], each) for name, each in readings.items()}
    here.output.answer({"arms": told}, table_text(told))
    end_with({name: each.error for name, each in told.items()})


@cell.command()
def home() -> None:
    """Drive all arms home, which calibrates them.

    What earlier programs left in their queues is thrown away. Guarded arms go one after the other.
    """
    here = chosen()

    async def work() -> None:
        with tracing(here.session.trace) as trace:
            async with here.fleet(trace) as fleet:
                await fleet.each("home")

    with here.output.working("homing"):
        run(work())

    here.output.answer({"home": True}, "all arms are home")


@cell.command()
def stop() -> None:
    """Stop all arms now, and empty their queues; those that answer, if others do not."""
    here = chosen()
    results = run(alone(here, lambda _, arm: arm.stop(), control=True))
    errors = {name: str(error) if isinstance(error, Exception) else None for name, error in results.items()}
    text = "\n".join(f"{name}: {error or 'stopped'}" for name, error in errors.items())
    here.output.answer({"stopped": {name: error is None for name, error in errors.items()}, "errors": errors}, text)
    end_with(errors)


@cell.command("run")
@click.argument("program", type=PROGRAM)
@click.option("--dry-run", is_flag=True, help="Only check it: no arm is needed, and nothing is sent.")
def run_program(program: TextSource, dry_run: bool) -> None:
    """Run a program of all arms.

    PROGRAM (- is standard input) has lines such as: left: move 200 0 50. Before the colon stand names of arms, or * for
    all, behind it a verb as for the command run, or: barrier NAME, zone NAME, leave NAME. The arms run side by side,
    each its own lines. All lines are checked, for each arm, before anything is sent to any.
    """
    here = chosen()
    steps = parse(program, here.cell)

    async def work() -> None:
        with tracing(here.session.trace) as trace:
            async with here.fleet(trace) as fleet:
                await run_cell_program(fleet, steps)

    if not dry_run:
        with here.output.working(program.name):
            run(work())

    counts = {name: len(each) for name, each in steps.items()}
    answer = {"file": program.name, "commands": counts, **({"sent": False} if dry_run else {})}
    done = "would run" if dry_run else "done"
    here.output.answer(answer, f"{program.name}: {sum(counts.values())} commands {done}")


def parse(program: TextSource, cell: Cell) -> CellProgram:
    """Returns the lines of each arm; raises WrongFile with the line if one is wrong."""
    try:
        steps = parse_cell_program(lines_in(program.text), cell)
    except ProgramError as error:
        raise wrong(program, error.summary) from None

    if not steps:
        raise wrong(program, "it has no commands")

    return steps


@cell.command()
@click.option("--rate", type=ABOVE_ZERO, default=5.0, show_default=True, help="Readings/s.")
@click.option("--count", type=click.IntRange(1), help="End after so many readings.")
def watch(rate: float, count: int | None) -> None:
    """Watch all arms, in place on a terminal, elsewhere some lines for each reading.

    Ends with Ctrl-C, and does not disturb programs that run on the arms, as far as their links can be shared.
    """
    here = chosen()
    with tracing(here.session.trace) as trace:
        if here.output.terminal:
            with here.output.table(COLUMNS) as draw:

                def show(told: Mapping[str, CellReading]) -> None:
                    draw([each.cells(name) for name, each in told.items()])

                run(observe(here.cell, rate, count, show, trace))
        else:

            def say(told: Mapping[str, CellReading]) -> None:
                here.output.answer({"arms": told}, table_text(told))

            run(observe(here.cell, rate, count, say, trace))


async def alone(
    here: Chosen, question: Callable[[str, Any], Awaitable[T]], *, control: bool
) -> dict[str, T | BaseException]:
    """Asks each arm for itself, at the same time; returns its answer, or why there is none."""
    members = here.cell.members
    with tracing(here.session.trace) as trace:

        async def asked(name: str, member: Member[Any]) -> T:
            async with joined_alone(name, member, trace, control=control) as arm:
                return await question(name, arm)

        work = [asked(name, member) for name, member in members.items()]
        results = await asyncio.gather(*work, return_exceptions=True)

    for result in results:
        if isinstance(result, BaseException) and not isinstance(result, (DobotError, OSError)):
            raise result

    return dict(zip(members, results, strict=True))


def table_text(told: Mapping[str, CellReading]) -> str:
    """A line for each arm."""
    return "\n".join("  |  ".join(each.cells(name)) for name, each in told.items())


def end_with(errors: Mapping[str, str | None]) -> None:
    """Ends the command with 1 if there are errors, each on a line of standard error."""
    failed = {name: error for name, error in errors.items() if error}
    for name, error in failed.items():
        click.echo(f"error: {name}: {' '.join(error.split())}", err=True)

    if failed:
        click.get_current_context().exit(FAILED)
