"""A drawing of 10,000 points over a line of 115200 baud: the arm's queue never runs dry within a stroke."""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace
from itertools import pairwise
from typing import Any

import pytest
from virtual import virtual

from dobot_async import Magician
from dobot_async.arms.magician import commands as m
from dobot_async.endpoints.line_rate import RateLimited
from dobot_async.simulator import Simulation, memory, simulate
from dobot_async.simulator.device.work import Executed
from dobot_async.simulator.magician.arm import MAGICIAN
from dobot_async.toolpath import Progress, Toolpath, WorkPlane, draw, engrave

PLANE = WorkPlane.flat(190, -60, -50)
BAUD = 115_200


def rings(points: int, strokes: int) -> Toolpath:
    """Closed zigzags around one another, with 0.45 mm from each point to the next: 110 of them a second at 50 mm/s."""
    found = []
    for number in range(strokes):
        some = points // strokes
        radius = 0.43 * some / math.tau + 0.2 * number
        turns = ((math.tau * i / (some - 1), radius + 0.06 * (i % 2)) for i in range(some))
        found.append([(50 + r * math.cos(a), 60 + r * math.sin(a)) for a, r in turns])

    return Toolpath.of(*found)


class SlowLine(RateLimited[Any]):
    """A simulation behind a serial line of that speed, without a pty, so that its time may be virtual."""

    def __init__(self, simulation: Simulation) -> None:
        super().__init__(simulation, BAUD)
        self.faults = simulation.faults


@asynccontextmanager
async def behind_a_slow_line() -> AsyncIterator[tuple[Simulation, Magician]]:
    async with simulate(options=replace(MAGICIAN, keep=None)) as sim:
        memory.running["slow"] = line = SlowLine(sim)  # type: ignore[assignment]
        try:
            async with Magician.connect("sim://slow") as arm:
                yield sim, arm
                assert line.faults is sim.faults
        finally:
            memory.running.pop("slow", None)


def halts(records: list[Executed], row: object) -> list[tuple[int, float]]:
    """Where the arm waited for a point: between two commands of one path."""
    return [
        (number, b.started - a.finished)
        for number, (a, b) in enumerate(pairwise(records))
        if a.command is row and b.command is row and b.started != a.finished
    ]


@pytest.mark.full
@virtual
async def test_ten_thousand_points_with_a_pen() -> None:
    path = rings(10_000, 20)
    assert path.points == 10_000
    async with behind_a_slow_line() as (sim, arm):
        begun = asyncio.get_running_loop().time()
        told: list[Progress] = []
        await draw(arm, path, PLANE, tolerance=0, speed=50, acceleration=500, progress=told.append)
        taken = asyncio.get_running_loop().time() - begun
        points = [record for record in sim.arm.executed if record.command is m.SET_CP_CMD]
        assert len(points) == 10_000 - 20
        assert not halts(sim.arm.executed, m.SET_CP_CMD)
        assert {record.outcome for record in sim.arm.executed} == {"done"}
        assert taken < 1.4 * path.length / 50
        assert len(told) >= 15


@pytest.mark.full
@virtual
async def test_a_laser_never_halts_at_all() -> None:
    path = rings(1_000, 4)
    async with behind_a_slow_line() as (sim, arm):
        await engrave(arm, path, PLANE, tolerance=0, speed=40, acceleration=500)
        records = [record for record in sim.arm.executed if record.command is m.SET_CPLE_CMD]
        assert len(records) == 1_000
        assert not halts(sim.arm.executed, m.SET_CPLE_CMD)


@pytest.mark.full
@virtual
async def test_a_path_that_is_too_fine_for_the_line_is_drawn_more_slowly() -> None:
    path = Toolpath.of([(i * 0.05, 0.05 * (i % 2)) for i in range(400)])
    async with behind_a_slow_line() as (sim, arm):
        await draw(arm, path, PLANE, tolerance=0, speed=100, acceleration=2_000)
        assert not halts(sim.arm.executed, m.SET_CP_CMD)

    async with behind_a_slow_line() as (sim, arm):
        await draw(arm, path, PLANE, tolerance=0, speed=100, acceleration=2_000, rate=None)
        assert len(halts(sim.arm.executed, m.SET_CP_CMD)) > 10  # the line is slow indeed


@pytest.mark.parametrize("count", [24, 25, 200])
def test_what_a_queue_holds_needs_no_line(count: int) -> None:
    from dobot_async.toolpath.moves import fastest, moves_of

    (moves,) = moves_of(Toolpath.of([(i * 0.5, 0) for i in range(count + 1)]), PLANE, "pen", [50.0])
    assert fastest(moves, 100, 24) == (math.inf if count <= 24 else pytest.approx(50))
