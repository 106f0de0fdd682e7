"""`cell`: all arms of a cell file at once.

    dobot-async cell cell.toml status | home | stop | run PROGRAM | watch

`home` and `run` need all arms, and stop them all when one fails. `status`, `stop` and `watch` do what they can with
each arm, whatever the others do.
"""

from __future__ import annotations

import asyncio
import itertools
import re
from collections.abc import AsyncIterator, Awaitable, Callable, Collection, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeVar

import anyio
import click

from dobot_async._core.util.tasks import run_shielded
from dobot_async.cli.arms import FAMILIES
from dobot_async.cli.cell_program import CellProgram, parse_cell_program, run_cell_program, word_of
from dobot_async.cli.failures import FAILED, WrongFile
from dobot_async.cli.output import Output
from dobot_async.cli.params import ABOVE_ZERO, PROGRAM, Text
from dobot_async.cli.program import wrong
from dobot_async.cli.session import Session, run
from dobot_async.cli.trace import Trace, TraceFile, traced, tracing
from dobot_async.errors import DobotError
from dobot_async.fleet.cell import Cell, parse_cell
from dobot_async.fleet.families import family_of
from dobot_async.fleet.fleet import Fleet
from dobot_async.fleet.seat import Member
from dobot_async.program import ProgramError
from dobot_async.program.text import lines_in

__all__ = ["cell"]

T = TypeVar("T")
RETRY = 1.0  # seconds until an arm that did not answer is tried again
SHORT = re.compile(r"(joint \d+: )?[^:]*")  # of an alarm: cause and remedy would fill the screen
COLUMNS = ("arm", "family", "tool in the cell", "alarms", "link")


@dataclass(slots=True)
class Reading:
    """What an arm of the cell told.

    Attributes:
        family: Its family.
        x: Of the tool, in the cell, mm; None if the arm did not answer.
        y: The same.
        z: The same.
        alarms: What is set.
        error: Why it did not answer.
    """

    family: str
    x: float | None = None
    y: float | None = None
    z: float | None = None
    alarms: tuple[str, ...] = ()
    error: str | None = None

    def cells(self, name: str) -> tuple[str, ...]:
        """The row of a table."""
        places = (self.x, self.y, self.z)
        tool = "  ".join(f"{axis} {place:7.2f}" for axis, place in zip("xyz", places, strict=True) if place is not None)
        alarms = ", ".join(found[0] for alarm in self.alarms if (found := SHORT.match(alarm)))
        return name, self.family, tool or "-", alarms or "none", self.error or "good"


@dataclass(frozen=True, slots=True)
class Chosen:
    """The cell, and how to speak."""

    session: Session
    cell: Cell

    @property
    def output(self) -> Output:
        """Where to speak."""
        return self.session.output

    @asynccontextmanager
    async def fleet(self, trace: TraceFile | None) -> AsyncIterator[Fleet[Any]]:
        """Connects to all arms; the trace begins when they are connected."""
        cell = self.cell
        async with Fleet.connect(cell.members, zones=cell.zones, groups=cell.groups) as fleet:
            self.session.commanding = True
            for name, member in cell.members.items():
                if trace:
                    fleet[name].link.on_frame.add(trace_of(trace, name, member))

            yield fleet


@click.group()
@click.argument("file", type=PROGRAM)
@click.pass_context
def cell(ctx: click.Context, file: Text) -> None:
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


def trace_of(trace: TraceFile, name: str, member: Member[Any]) -> Trace:
    """What tells a trace of the frames of one arm."""
    return Trace(trace, FAMILIES[word_of(member)].describe, arm=name)


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
def run_program(program: Text, dry_run: bool) -> None:
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


def parse(program: Text, cell: Cell) -> CellProgram:
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
                show = lambda told: draw([each.cells(name) for name, each in told.items()])  # noqa: E731
                run(observe(here.cell, rate, count, show, trace))
        else:
            show = lambda told: here.output.answer({"arms": told}, table_text(told))  # noqa: E731
            run(observe(here.cell, rate, count, show, trace))


def kind_of(name: str, member: Member[Any], trace: TraceFile | None) -> Any:
    """What connects to an arm that is asked for itself."""
    kind = family_of(member.kind).kind
    return traced(kind, trace_of(trace, name, member)) if trace else kind


async def alone(
    here: Chosen, question: Callable[[str, Any], Awaitable[T]], *, control: bool
) -> dict[str, T | BaseException]:
    """Asks each arm for itself, at the same time; returns its answer, or why there is none."""
    members = here.cell.members
    with tracing(here.session.trace) as trace:

        async def asked(name: str, member: Member[Any]) -> T:
            options = {**member.options, "control": control, "queue": "keep"}
            async with kind_of(name, member, trace).connect(member.url, **options) as arm:
                return await question(name, arm)

        work = [asked(name, member) for name, member in members.items()]
        results = await asyncio.gather(*work, return_exceptions=True)

    for result in results:
        if isinstance(result, BaseException) and not isinstance(result, (DobotError, OSError)):
            raise result

    return dict(zip(members, results, strict=True))


async def read(member: Member[Any], arm: Any) -> Reading:
    """Asks an arm for what is shown."""
    family = family_of(member.kind)
    place = await family.place(arm)
    x, y, z, _ = member.base.to_cell(*place)
    alarms = tuple(map(str, await arm.get_alarms())) if hasattr(arm, "get_alarms") else ()
    return Reading(family.name, round(x, 3), round(y, 3), round(z, 3), alarms)


async def observe(
    cell: Cell,
    rate: float,
    count: int | None,
    show: Callable[[Mapping[str, Reading]], None],
    trace: TraceFile | None = None,
) -> None:
    """Shows what all arms tell at each tick; arms that do not answer are tried again."""
    told = {name: Reading(family_of(member.kind).name, error="connecting") for name, member in cell.members.items()}
    first = {name: asyncio.Event() for name in told}

    def note(name: str, reading: Reading) -> None:
        told[name] = reading
        first[name].set()

    async def watched() -> None:
        for event in first.values():
            await event.wait()

        for number in itertools.count(1):
            show(told)
            if number == count:
                break

            await anyio.sleep(1 / rate)

    tasks = [asyncio.create_task(watched())]
    tasks += [
        asyncio.create_task(follow(member, kind_of(name, member, trace), 1 / rate, partial(note, name)))
        for name, member in cell.members.items()
    ]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()

        await run_shielded(joined(tasks))
        for task in tasks:
            if not task.cancelled():
                task.result()


async def joined(tasks: Collection[asyncio.Task[None]]) -> None:
    """Returns when tasks have ended, however that is."""
    await asyncio.wait(tasks)


async def follow(member: Member[Any], kind: Any, interval: float, note: Callable[[Reading], None]) -> None:
    """Notes what one arm tells, for ever."""
    options = {**member.options, "control": False, "queue": "keep"}
    while True:
        try:
            async with kind.connect(member.url, **options) as arm:
                while True:
                    note(await read(member, arm))
                    await anyio.sleep(interval)
        except (DobotError, OSError) as error:
            note(told_by(member, error))
            await anyio.sleep(RETRY)


def told_by(member: Member[Any], answer: Reading | BaseException) -> Reading:
    """What an arm told, or why it did not."""
    if isinstance(answer, BaseException):
        return Reading(family_of(member.kind).name, error=str(answer))

    return answer


def table_text(told: Mapping[str, Reading]) -> str:
    """A line for each arm."""
    return "\n".join("  |  ".join(each.cells(name)) for name, each in told.items())


def end_with(errors: Mapping[str, str | None]) -> None:
    """Ends the command with 1 if there are errors, each on a line of standard error."""
    failed = {name: error for name, error in errors.items() if error}
    for name, error in failed.items():
        click.echo(f"error: {name}: {' '.join(error.split())}", err=True)

    if failed:
        click.get_current_context().exit(FAILED)
