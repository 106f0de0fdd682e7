"""What the arms of a cell tell, once or for ever; each for itself, whatever the others do."""

from __future__ import annotations

import asyncio
import itertools
import re
from collections.abc import Callable, Collection, Mapping
from contextlib import AbstractAsyncContextManager
from dataclasses import dataclass
from functools import partial
from typing import Any

import anyio

from dobot_async._core.util.tasks import run_shielded
from dobot_async.arms.base import Arm
from dobot_async.errors import DobotError
from dobot_async.fleet.cell import Cell
from dobot_async.fleet.families import family_of
from dobot_async.fleet.fleet_arm import Member
from dobot_async.traces import TraceFile

__all__ = ["CellReading", "joined_alone", "observe", "read", "told_by"]

RETRY = 1.0  # seconds until an arm that did not answer is tried again
SHORT = re.compile(r"(joint \d+: )?[^:]*")  # of an alarm: cause and remedy would fill the screen


@dataclass(slots=True)
class CellReading:
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


def joined_alone(
    name: str, member: Member[Any], trace: TraceFile | None, *, control: bool
) -> AbstractAsyncContextManager[Any]:
    """Connects to an arm that is asked for itself."""
    record = {"record": trace.named(name)} if trace else {}
    options = {**member.options, "control": control, "queue": "keep", **record}
    found: AbstractAsyncContextManager[Any] = family_of(member.kind).kind.connect(member.url, **options)
    return found


async def read(member: Member[Any], arm: Arm) -> CellReading:
    """Asks an arm for what is shown."""
    pose = await arm.get_pose()
    x, y, z, _ = member.base.to_cell(pose.x, pose.y, pose.z)
    alarms = tuple(map(str, await arm.get_alarms()))
    return CellReading(family_of(member.kind).name, round(x, 3), round(y, 3), round(z, 3), alarms)


async def observe(
    cell: Cell,
    rate: float,
    count: int | None,
    show: Callable[[Mapping[str, CellReading]], None],
    trace: TraceFile | None = None,
) -> None:
    """Shows what all arms tell at each tick; arms that do not answer are tried again."""
    told = {name: CellReading(family_of(member.kind).name, error="connecting") for name, member in cell.members.items()}
    first = {name: asyncio.Event() for name in told}

    def note(name: str, reading: CellReading) -> None:
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
    for name, member in cell.members.items():
        connected = partial(joined_alone, name, member, trace, control=False)
        tasks.append(asyncio.create_task(follow(connected, member, 1 / rate, partial(note, name))))

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


async def follow(
    connected: Callable[[], AbstractAsyncContextManager[Any]],
    member: Member[Any],
    interval: float,
    note: Callable[[CellReading], None],
) -> None:
    """Notes what one arm tells, for ever."""
    while True:
        try:
            async with connected() as arm:
                while True:
                    note(await read(member, arm))
                    await anyio.sleep(interval)
        except (DobotError, OSError) as error:
            note(told_by(member, error))
            await anyio.sleep(RETRY)


def told_by(member: Member[Any], answer: CellReading | BaseException) -> CellReading:
    """What an arm told, or why it did not."""
    if isinstance(answer, BaseException):
        return CellReading(family_of(member.kind).name, error=str(answer))

    return answer
