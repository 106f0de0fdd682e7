"""`gcode`: runs a G-code file on an ultraArm, or only checks it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import click

from dobot_async.cli.failures import StepRefused
from dobot_async.cli.params import PROGRAM, TextSource
from dobot_async.cli.program_files import checked
from dobot_async.cli.session import CommandSession
from dobot_async.program.text import lines_in

__all__ = ["gcode"]


@click.command()
@click.argument("file", type=PROGRAM)
@click.option("--dry-run", is_flag=True, help="Only check it: no arm is needed, and nothing is sent.")
@click.option("--constant-speed", is_flag=True, help="Run through it at constant speed.")
@click.pass_obj
def gcode(session: CommandSession, file: TextSource, dry_run: bool, constant_speed: bool) -> None:
    """Run a G-code file on an ultraarm.

    FILE may be - for standard input. All lines are checked, against the manual's limits too, before anything is sent. F
    is mm/s. Ctrl-C stops the arm.
    """
    from dobot_async.arms.ultraarm.gcode import parse_gcode

    session.only("ultraarm")
    lines = lines_in(file.text)
    steps = checked(file, lambda: parse_gcode(lines))
    if not dry_run:
        with session.output.counting(file.name, len(steps)) as report:
            session.ask(lambda arm: execute(arm, lines, report, constant_speed=constant_speed))

    done = "would run" if dry_run else "done"
    session.output.answer(
        {"file": file.name, "commands": len(steps), "sent": not dry_run}, f"{file.name}: {len(steps)} commands {done}"
    )


async def execute(arm: object, lines: Sequence[str], report: Callable[[int], None], *, constant_speed: bool) -> None:
    """Runs it to its end."""
    from dobot_async.arms.ultraarm.arm import UltraArm

    assert isinstance(arm, UltraArm)
    try:
        await arm.run_gcode(lines, constant_speed=constant_speed, progress=lambda done, _: report(done))
    except ValueError as error:
        raise StepRefused(str(error)) from error
