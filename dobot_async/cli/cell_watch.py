"""What the arms of a cell tell, once or for ever; each for itself, whatever the others do."""

from __future__ import annotations

import asyncio
import itertools
import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import anyio

from dobot_async._core.util.tasks import run_shielded
from dobot_async.arms.base import Arm
from dobot_async.cli.arms import FAMILIES
from dobot_async.cli.cell_program import word_of
from dobot_async.cli.trace import Trace, TraceFile, traced
from dobot_async.errors import DobotError
from dobot_async.fleet.cell import Cell
from dobot_async.fleet.families import family_of
from dobot_async.fleet.seat import Member

__all__ = ["Reading", "kind_of", "observe", "read", "told_by", "trace_of"]

RETRY = 1.0  # seconds until an arm that did not answer is tried again
SHORT = re.compile(r"(joint \d+: )?[^:]*")  # of an alarm: cause and remedy would fill the screen


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


def trace_of(trace: TraceFile, name: str, member: Member[Any]) -> Trace:
    """What tells a trace of the frames of one arm."""
    return Trace(trace, FAMILIES[word_of(member)].describe, arm=name)


def kind_of(name: str, member: Member[Any], trace: TraceFile | None) -> Any:
    """What connects to an arm that is asked for itself."""
    kind = family_of(member.kind).kind
    return traced(kind, trace_of(trace, name, member)) if trace else kind


async def read(member: Member[Any], arm: Arm) -> Reading:
    """Asks an arm for what is shown."""
    pose = await arm.get_pose()
    x, y, z, _ = member.base.to_cell(pose.x, pose.y, pose.z)
    alarms = tuple(map(str, await arm.get_alarms()))
    return Reading(family_of(member.kind).name, round(x, 3), round(y, 3), round(z, 3), alarms)


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
