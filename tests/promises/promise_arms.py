"""A simulated arm, the driver, and the line between them; and whether the arm stands.

What a test may know of an arm is what the simulated arm says of itself (`sim.arm`), and what the driver's public API
offers. Where a name of either differs from family to family, it stands here or in `promise_families`.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any

import pytest
from promise_clock import now
from promise_families import BY_NAME, FAMILIES, Family
from promise_line import Lines, Manner, PromiseLine, promise_lines

from dobot_async import DobotError
from dobot_async.simulator import Simulation, simulate

__all__ = [
    "BY_NAME",
    "FAMILIES",
    "Bench",
    "Family",
    "bench",
    "each_family",
    "latencies",
    "motions_done",
    "place",
    "simulated",
    "stands",
]


each_family = pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.name)
latencies = Manner(latency=0.01)


@dataclass
class Bench:
    """A simulated arm, the driver, and the lines between them."""

    family: Family
    sim: Simulation
    arm: Any
    lines: Lines
    options: dict[str, Any]

    @property
    def line(self) -> PromiseLine:
        """The first line, which is the driver's unless it has opened another one."""
        return self.lines[0]

    async def works_again(self, within: float = 10.0) -> None:
        """Asks the arm until it answers; fails if it has not within so many seconds."""
        ends = now() + within
        while True:
            try:
                async with asyncio.timeout_at(ends):
                    await self.family.read(self.arm)
                    return
            except (DobotError, TimeoutError) as error:
                if now() >= ends:
                    raise AssertionError(f"it does not work again within {within:g} s") from error

                await asyncio.sleep(0.05)

    async def second_connection_works(self) -> None:
        """Another program connects, asks the arm something and leaves."""
        async with (
            asyncio.timeout(10),
            self.family.connect(self.sim.url, **(self.options | {"control": False})) as other,
        ):
            await self.family.read(other)


@asynccontextmanager
async def simulated(
    family: Family,
    *,
    speed: float = 1.0,
    manner: Manner | None = None,
    seed: int = 0,
    details: dict[str, Any] | None = None,
) -> AsyncIterator[tuple[Simulation, Lines]]:
    """A simulated arm, and the lines over which it will be reached; takes what `bench` takes."""
    with promise_lines(manner or latencies, seed=seed) as lines:
        async with simulate(family.model, speed=speed, **{**family.details, **(details or {})}) as sim:
            try:
                yield sim, lines
            finally:
                for line in lines:
                    if not line.closed:  # the test says so itself where it matters
                        await line.aclose()


@asynccontextmanager
async def bench(
    family: Family,
    *,
    speed: float = 1.0,
    manner: Manner | None = None,
    seed: int = 0,
    details: dict[str, Any] | None = None,
    **options: Any,
) -> AsyncIterator[Bench]:
    """A simulated arm, and the driver connected to it.

    Args:
        family: Whose.
        speed: Simulated seconds per second.
        manner: What the line does; by default each message takes 10 ms.
        seed: Of the line.
        details: What `simulate` takes beside this.
        options: What `connect` takes.
    """
    async with (
        simulated(family, speed=speed, manner=manner, seed=seed, details=details) as (sim, lines),
        family.connect(sim.url, **options) as arm,
    ):
        yield Bench(family, sim, arm, lines, options)


def place(sim: Simulation) -> tuple[float, ...]:
    """The joints of the simulated arm."""
    joints: tuple[float, ...] = tuple(sim.arm.device.joints)
    return joints


def motions_done(sim: Simulation) -> int:
    """How many commands that move it the arm has executed to the end."""
    return sum(each.outcome == "done" and bool(each.command.moves) for each in sim.arm.executed)


async def stands(sim: Simulation, *, seconds: float = 5.0) -> str:
    """Watches a simulated arm; returns what it does although it should stand, "" if it stands."""
    before, done = place(sim), motions_done(sim)
    ends = now() + seconds
    while True:
        if place(sim) != before:
            return f"it moves, from {before} to {place(sim)}"

        if motions_done(sim) != done:
            return f"it has executed {sim.arm.executed[-1].name}"

        if sim.arm.device.moving:
            return "a motion or a jog goes on"

        if now() >= ends:
            return ""

        await asyncio.sleep(0.25)
