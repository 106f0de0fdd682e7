"""`monitor`: watches an arm without disturbing it; in place on a terminal, elsewhere a line for each reading."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import anyio
import click

from dobot_async.cli.family import MonitorReading
from dobot_async.cli.output import Output
from dobot_async.cli.params import ABOVE_ZERO
from dobot_async.cli.session import CommandSession, run

__all__ = ["monitor"]


@click.command()
@click.option("--rate", type=ABOVE_ZERO, default=5.0, show_default=True, help="Readings/s.")
@click.option("--count", type=click.IntRange(1), help="End after so many readings.")
@click.pass_obj
def monitor(session: CommandSession, rate: float, count: int | None) -> None:
    """Watch pose, queue and alarms.

    Ends with Ctrl-C, and does not disturb a program that runs on the arm. With --json each reading is one JSON
    object on a line.
    """
    if session.output.terminal:
        with session.output.panel() as draw:
            run(watch(session, rate, count, lambda reading: draw(reading.rows)))
    else:
        run(watch(session, rate, count, lambda reading: tell(session.output, reading)))


async def watch(
    session: CommandSession, rate: float, count: int | None, show: Callable[[MonitorReading], None]
) -> None:
    """Shows a reading at each tick; ticks that a slow link misses are left out."""
    async with session.connect(control=False) as arm:
        due = anyio.current_time()
        for number in itertools.count(1):
            show(await session.family.read(arm))
            if number == count:
                break

            due = max(due + 1 / rate, anyio.current_time())
            await anyio.sleep_until(due)


def tell(output: Output, reading: MonitorReading) -> None:
    """Prints a reading as a line."""
    output.answer(reading, "  |  ".join(f"{name} {text}" for name, text in reading.rows.items()))
