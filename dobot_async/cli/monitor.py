"""`monitor`: watches an arm without disturbing it; in place on a terminal, elsewhere a line for each reading."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable
from dataclasses import dataclass

import anyio
import click

from dobot_async.cli.output import Output, joint_words, tool_words
from dobot_async.cli.session import Session, run
from dobot_async.magician import commands as c
from dobot_async.magician.alarms import Alarm
from dobot_async.magician.arm import Magician
from dobot_async.magician.params import Pose

__all__ = ["monitor"]

NO_INDEX = 1 << 63
"""From here on the arm's index means that it has none to tell: it has executed nothing yet, or it moves."""


@dataclass(frozen=True, slots=True)
class Reading:
    """What the arm told at one time.

    Attributes:
        time: Seconds since 1970.
        pose: Where it is.
        alarms: What is set.
        left_space: How many commands its queue can still take.
        index: The last command that it has executed; None if it tells none.
    """

    time: float
    pose: Pose
    alarms: tuple[Alarm, ...]
    left_space: int
    index: int | None

    @property
    def rows(self) -> dict[str, str]:
        """What a person wants to see of it."""
        return {
            "tool": tool_words(self.pose),
            "joints": joint_words(self.pose),
            "queue": f"room {self.left_space}, index {'-' if self.index is None else self.index}",
            "alarms": ", ".join(f"0x{alarm.code:02X} {alarm.name}" for alarm in self.alarms) or "none",
        }


@click.command()
@click.option("--rate", type=click.FloatRange(0, min_open=True), default=5.0, show_default=True, help="Readings/s.")
@click.option("--count", type=click.IntRange(1), help="End after so many readings.")
@click.pass_obj
def monitor(session: Session, rate: float, count: int | None) -> None:
    """Watch pose, queue and alarms.

    Ends with Ctrl-C, and does not disturb a program that runs on the arm. With --json each reading is one JSON
    object on a line.
    """
    if session.output.terminal:
        with session.output.panel() as draw:
            run(watch(session, rate, count, lambda reading: draw(reading.rows)))
    else:
        run(watch(session, rate, count, lambda reading: tell(session.output, reading)))


async def watch(session: Session, rate: float, count: int | None, show: Callable[[Reading], None]) -> None:
    """Shows a reading at each tick; ticks that a slow link misses are left out."""
    async with session.connect(control=False) as arm:
        due = anyio.current_time()
        for number in itertools.count(1):
            show(await read(arm))
            if number == count:
                break

            due = max(due + 1 / rate, anyio.current_time())
            await anyio.sleep_until(due)


async def read(arm: Magician) -> Reading:
    """Asks the arm for everything."""
    index = await arm.request(c.GET_QUEUED_CMD_CURRENT_INDEX, None)
    return Reading(
        time=time.time(),
        pose=await arm.get_pose(),
        alarms=await arm.get_alarms(),
        left_space=await arm.request(c.GET_QUEUED_CMD_LEFT_SPACE, None),
        index=index if index < NO_INDEX else None,
    )


def tell(output: Output, reading: Reading) -> None:
    """Prints a reading as a line."""
    output.answer(reading, "  |  ".join(f"{name} {text}" for name, text in reading.rows.items()))
