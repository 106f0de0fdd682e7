"""`trace`: what was recorded, as lines, in figures and as curves; and the dissector for Wireshark."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import click

from dobot_async.cli.output import words
from dobot_async.cli.session import CommandSession
from dobot_async.traces.figures import CommandFigures, TraceFigures, figures, percentile
from dobot_async.traces.reader import Trace, TraceLine, TraceProblem, read_trace

__all__ = ["trace"]

FILE = click.argument("file", type=click.Path(exists=True, dir_okay=False, path_type=Path))
OF = click.option("--of", metavar="NAME", help="Which arm, where there are several.")
CONNECTION = click.option(
    "--connection", type=click.IntRange(1), default=1, show_default=True, help="Which connection of the arm."
)


@click.group()
def trace() -> None:
    """Look at a trace: lines, figures, curves.

    It is what --trace or record= has written.

    The URL replay:FILE is a device that answers as in the trace. FILE is the newest part; older ones are found.
    """


@trace.command()
@FILE
@OF
@click.option("--kind", "kinds", multiple=True, metavar="KIND", help="Only frame, junk, motion, state, event, ...")
@click.option("--last", type=click.IntRange(1), help="Only so many lines, the last ones.")
@click.pass_obj
def show(session: CommandSession, file: Path, of: str | None, kinds: tuple[str, ...], last: int | None) -> None:
    """Show what went over the connection, a line each."""
    found = read(session, file)
    lines = [line for line in found.lines if (of is None or line.arm == of) and (not kinds or line.kind in kinds)]
    for line in lines[-last:] if last else lines:
        value = {"kind": line.kind, "t": line.t, "time": line.time, "arm": line.arm, **line.fields}
        session.output.answer(value, text_of(line))


@trace.command()
@FILE
@OF
@CONNECTION
@click.pass_obj
def stats(session: CommandSession, file: Path, of: str | None, connection: int) -> None:
    """Tell latencies, losses, repetitions, and what became of each motion."""
    found = figures(part(read(session, file), of, connection))
    session.output.answer(summary(found), "\n".join(stats_text(found)))


@trace.command()
@FILE
@OF
@CONNECTION
@click.option("--png", type=click.Path(dir_okay=False, path_type=Path), help="Draw into a picture. Needs matplotlib.")
@click.pass_obj
def plot(session: CommandSession, file: Path, of: str | None, connection: int, png: Path | None) -> None:
    """Draw how full the queue was, and how long the answers took."""
    from dobot_async.traces.plot import MissingPlotter, in_terminal, to_png

    mine = part(read(session, file), of, connection)
    if png is None:
        session.output.answer(summary(figures(mine)), in_terminal(mine, shutil.get_terminal_size().columns))
        return

    try:
        to_png(mine, png)
    except MissingPlotter as error:
        raise click.UsageError(str(error)) from None

    session.output.answer({"png": str(png)}, str(png))


@trace.command()
@click.pass_obj
def dissector(session: CommandSession) -> None:
    """Print the dissector for Wireshark, in Lua, with the command tables of all families.

    It belongs into the folder of Wireshark's personal Lua plugins.
    """
    from dobot_async.cli.commands.wireshark import dissector as source

    session.output.answer({"lua": source()}, source())


def read(session: CommandSession, file: Path) -> Trace:
    """Reads a trace; a file that is none is wrong usage."""
    session.refuse("a trace is only read", "url", "arm", "trace")
    try:
        return read_trace(file)
    except TraceProblem as error:
        raise click.UsageError(str(error)) from None


def part(found: Trace, of: str | None, connection: int) -> Trace:
    """What belongs to one connection; wrong usage if there is none such."""
    try:
        return found.of(of, connection)
    except ValueError as error:
        raise click.UsageError(str(error).replace("with arm=", "with --of")) from None


def text_of(line: TraceLine) -> str:
    """A line as people read it."""
    arm = f"{line.arm}: " if line.arm else ""
    return f"{line.t:12.6f}  {arm}{TEXTS.get(line.kind, other)(line)}"


def frame(line: TraceLine) -> str:
    """A frame."""
    command = line.text("command") or line.text("key")
    value = line.fields.get("value")
    shown = "" if value is None else f"  {words(value)}"
    problem = f"  ({line.text('problem')})" if line.text("problem") else ""
    return f"{'->' if line.outgoing else '<-'} {command}{shown}{problem}"


def motion(line: TraceLine) -> str:
    """A motion."""
    more = line.text("error") or (f"index {line.number('index'):g}" if "index" in line.fields else "")
    value = f"  {words(line.fields['value'])}" if line.fields.get("value") is not None else ""
    shown = f" ({more})" if more else ""
    return f"motion {line.number('motion'):g} {line.text('name')} {line.text('state')}{shown}{value}"


def junk(line: TraceLine) -> str:
    """What was no frame."""
    return f"<- {line.number('count'):g} bytes that are no frame  {line.text('raw')}".rstrip()


def other(line: TraceLine) -> str:
    """Anything else."""
    return f"{line.kind}: {words(dict(line.fields))}"


TEXTS: dict[str, Callable[[TraceLine], str]] = {"frame": frame, "motion": motion, "junk": junk}


def summary(found: TraceFigures) -> dict[str, Any]:
    """The figures as JSON."""
    return {
        "seconds": round(found.seconds, 6),
        "sent": found.frames[0],
        "received": found.frames[1],
        "commands": {name: command_summary(each) for name, each in found.commands.items()},
        "motions": found.motions,
        "deepest": found.deepest,
        "silence": round(found.silence, 6),
        "outages": found.outages,
        "junk": found.junk,
        "error": found.error or None,
    }


def command_summary(command: CommandFigures) -> dict[str, Any]:
    """One command's figures as JSON; milliseconds."""
    waits = [1000 * wait for wait in command.latencies]
    latencies = {name: round(percentile(waits, percent), 3) for name, percent in PERCENTS.items()}
    return {"asked": command.asked, "repeated": command.repeated, "lost": command.lost, "ms": latencies}


PERCENTS = {"p50": 50.0, "p95": 95.0, "max": 100.0}


def stats_text(found: TraceFigures) -> Iterator[str]:
    """Yields the figures as lines."""
    sent, received = found.frames
    yield f"{found.seconds:.3f} s, {sent} frames sent, {received} received, {found.junk} bytes of junk"
    yield f"longest silence {1000 * found.silence:.1f} ms, {found.outages} outages, at most {found.deepest} queued"
    yield f"{'command':32} {'asked':>6} {'again':>6} {'lost':>6} {'p50 ms':>9} {'p95 ms':>9} {'max ms':>9}"
    for name, command in found.commands.items():
        each = command_summary(command)
        waits = " ".join(f"{wait:9.2f}" for wait in each["ms"].values())
        yield f"{name:32} {each['asked']:6} {each['repeated']:6} {each['lost']:6} {waits}"

    for motion in found.motions:
        took = "" if motion.seconds is None else f" after {motion.seconds:.3f} s"
        yield f"motion {motion.number} {motion.name}: {motion.end}{took}{f': {motion.error}' if motion.error else ''}"

    if found.error:
        yield f"it ended with {found.error}"
