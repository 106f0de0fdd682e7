"""An engraving that a stop, an error or Ctrl-C ends at a random moment, and that another program goes on with.

What the simulated arm recorded decides: its laser is off and nothing moves, and what it has burnt in both goes is all
of the engraving, no way of it twice. ENGRAVINGS=200 tries that many moments of each way out.
"""

from __future__ import annotations

import asyncio
import os
import random
import re
import signal
from collections.abc import Awaitable, Callable, Iterator
from typing import Any

import async_solipsism
import pytest
from burner import Burner, ends_of

from dobot_async import Magician, MotionStopped
from dobot_async.cli.drawing_job import CommandDrawing
from dobot_async.simulator import Faults, Simulation, simulate
from dobot_async.toolpath import Stroke, Toolpath, WorkPlane, estimate

ENGRAVINGS = int(os.environ.get("ENGRAVINGS", "4"))
PLANE = WorkPlane.flat(200, -20, -40)
REST = re.compile(r"--from-stroke (\d+)(?::([\d.e-]+))? draws the rest")


def engraving() -> Toolpath:
    """Short dashes to and fro, a zigzag of several powers, a long line and a ring."""
    dashes = [Stroke(((x * 1.1, y * 0.5), (x * 1.1 + 0.7, y * 0.5)), 40) for y in range(3) for x in range(12)]
    zigzag = Stroke(tuple((3 + x * 0.8, 5 + 2 * (x % 2)) for x in range(12)), tuple(10.0 + 5 * x for x in range(12)))
    ring = Stroke(((0, 14), (8, 14), (8, 20), (0, 20), (0, 14)), 55)
    return Toolpath((*dashes, zigzag, Stroke(((0.0, 10.0), (40.0, 10.0)), 70), ring))


async def by_stop(run: Awaitable[None], arm: Magician, seconds: float) -> None:
    """Somebody stops the arm."""
    task = asyncio.ensure_future(run)
    await asyncio.sleep(seconds)
    await arm.stop()
    await task


async def by_error(run: Awaitable[None], _: Magician, seconds: float) -> None:
    """Another part of the program fails."""

    async def fail() -> None:
        await asyncio.sleep(seconds)
        raise ZeroDivisionError

    async def engrave() -> None:
        await run

    async with asyncio.TaskGroup() as group:
        group.create_task(engrave())
        group.create_task(fail())


async def by_ctrl_c(run: Awaitable[None], _: Magician, seconds: float) -> None:
    """The user presses Ctrl-C."""
    asyncio.get_running_loop().call_later(seconds, signal.raise_signal, signal.SIGINT)
    await run


async def by_cancellations(run: Awaitable[None], _: Magician, seconds: float) -> None:
    """The task is cancelled, and twice more while it ends."""
    task = asyncio.ensure_future(run)
    for pause in (seconds, 0.001, 0.02):
        await asyncio.sleep(pause)
        task.cancel()

    await task


Way = Callable[[Awaitable[None], Magician, float], Awaitable[None]]
WAYS: dict[str, tuple[Way, type[BaseException]]] = {
    "stop": (by_stop, MotionStopped),
    "error": (by_error, BaseExceptionGroup),
    "ctrl-c": (by_ctrl_c, KeyboardInterrupt),
    "cancellations": (by_cancellations, asyncio.CancelledError),
}


async def interrupted(sim: Simulation[Any], path: Toolpath, way: Way, seconds: float, begin: dict[str, Any]) -> str:
    """Engraves until it is interrupted; returns what is said of the rest; what has ended it is raised behind that."""
    told: list[str] = []
    async with Magician.connect(sim.url) as arm:
        drawing = CommandDrawing(arm, path, PLANE, tool="laser")
        done = False

        async def run() -> None:
            nonlocal done
            try:
                await drawing.run(**begin)
                done = True
            except BaseException as error:
                told.extend(error.__notes__)
                raise

        try:
            await way(run(), arm, seconds)
        except BaseException as error:
            if not done:
                error.add_note("\n".join(told))

            raise

    return ""


@pytest.fixture(autouse=True)
def heard() -> Iterator[None]:
    """Hears Ctrl-C, which what runs in the background of a shell does not."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.cases(2)
@pytest.mark.parametrize("name", WAYS)
@pytest.mark.parametrize("number", range(ENGRAVINGS))
def test_whenever_it_is_ended_the_laser_is_off_nothing_moves_and_the_rest_is_burnt_once(name: str, number: int) -> None:
    path, (way, expected) = engraving(), WAYS[name]
    whole = estimate(path, PLANE, tool="laser").seconds
    moment = random.Random(f"{name} {number}").uniform(0.02, 0.99) * whole
    looked = False

    async def run() -> None:
        nonlocal looked
        async with simulate(seed=number, faults=Faults(latency=0.002)) as sim:
            burner = Burner(sim)
            try:
                await interrupted(sim, path, way, moment, {})
            except BaseException as error:
                burner.look()
                assert sim.arm.laser == 0
                assert not sim.arm.device.moving
                stands, executed = sim.arm.pose, len(sim.arm.executed)
                await asyncio.sleep(5)
                assert (sim.arm.pose, sim.arm.laser, len(sim.arm.executed)) == (stands, 0, executed)
                (rest,) = set(REST.findall("\n".join(error.__notes__)))
                begin: dict[str, Any] = {"first": int(rest[0]), "point": float(rest[1] or 0)}
                async with Magician.connect(sim.url) as arm:
                    await CommandDrawing(arm, path, PLANE, tool="laser").run(**begin)

                burner.look()
                assert sim.arm.laser == 0
                assert burner.ends == ends_of(path, PLANE)
                assert burner.length == pytest.approx(path.length, abs=0.02)
                looked = True
                raise

    with pytest.raises(expected), asyncio.Runner(loop_factory=async_solipsism.EventLoop) as runner:
        runner.run(run())

    assert looked
