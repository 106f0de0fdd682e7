"""`gcode`: runs a G-code file on an ultraArm, or only checks it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import click

from dobot_async.cli.session import Session
from dobot_async.ultraarm.arm import UltraArm
from dobot_async.ultraarm.gcode import GCodeLine, parse_gcode

__all__ = ["gcode"]


@click.command()
@click.argument("file", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.option("--dry-run", is_flag=True, help="Only check it: no arm is needed, and nothing is sent.")
@click.option("--constant-speed", is_flag=True, help="Run through it at constant speed.")
@click.pass_obj
def gcode(session: Session, file: Path, dry_run: bool, constant_speed: bool) -> None:
    """Run a G-code file on an ultraarm.

    All lines are checked, against the manual's limits too, before anything is sent. F is mm/s. Ctrl-C stops the arm.
    """
    session.only("ultraarm")
    lines = read(file)
    if not dry_run:
        with session.output.counting(file.name, len(lines)) as report:
            session.ask(lambda arm: execute(arm, file, report, constant_speed=constant_speed))

    done = "would run" if dry_run else "done"
    session.output.answer(
        {"file": str(file), "commands": len(lines), "sent": not dry_run}, f"{file}: {len(lines)} commands {done}"
    )


def read(file: Path) -> Sequence[GCodeLine]:
    """Returns a file's commands; raises UsageError for one that is wrong."""
    try:
        lines = parse_gcode(file)
    except UnicodeDecodeError as error:
        raise click.UsageError(f"{file} is not UTF-8 text: {error}") from None
    except ValueError as error:
        raise click.UsageError(f"{file} is wrong, and nothing was sent:\n{error}") from None

    if not lines:
        raise click.UsageError(f"{file} has no commands")

    return lines


async def execute(arm: UltraArm, file: Path, report: Callable[[int], None], *, constant_speed: bool) -> None:
    """Runs it to its end."""
    await arm.run_gcode(file, constant_speed=constant_speed, progress=lambda done, _: report(done))
