"""The myArm and the ultraArm beside the vendor's library: angles read a second, how late a motion's end is noticed.

    python -m benchmarks.bench_families [--requests 200] [--motions 6] [--json] [--quick]

Over a pseudo-terminal at 115200 baud, the arm being in another process. A myArm loses frames that come closer than
20 ms to one another, so the driver keeps that gap, and `limit_per_s` is what it allows; the library keeps none. The
ultraArm is asked one thing at a time, and its simulation answers at once. `late` is the time from the arm's finishing
to the return of the call.
"""

from __future__ import annotations

import asyncio
import importlib.util
import time
from collections.abc import Awaitable, Callable
from typing import Any

from benchmarks import others
from benchmarks.arm import Arms, arms
from benchmarks.report import BAUD, Row, parsed, percentile, show
from dobot_async import MyCobot, UltraArm
from dobot_async.arms.mycobot.arm import GAP
from dobot_async.mycobot import commands as cobot
from dobot_async.ultraarm import commands as ultra

LISTEN = f"pty:?baud={BAUD}"
Clock = tuple[float, float, list[float]]  # seconds, CPU seconds, when each returned


async def timed(call: Callable[[int], Awaitable[Any]], count: int) -> Clock:
    """One call after the other."""
    ended = []
    cpu, started = time.process_time(), time.perf_counter()
    for number in range(count):
        await call(number)
        ended.append(time.monotonic())

    return time.perf_counter() - started, time.process_time() - cpu, ended


async def by_driver_myarm(url: str, requests: int, motions: int) -> tuple[Clock, Clock]:
    """The driver with a myArm."""
    async with MyCobot.connect(url, model="myarm300") as arm:
        await arm.power_on()
        reads = await timed(lambda _: arm.get_angles(), requests)
        return reads, await timed(lambda number: arm.move_joints(*others.joints(number, 7), speed=80), motions)


async def by_driver_ultraarm(url: str, requests: int, motions: int) -> tuple[Clock, Clock]:
    """The driver with an ultraArm."""

    async def move(number: int) -> None:
        j1, j2, j3 = others.joints(number, 3)
        await arm.move_joints(j1, j2, j3, speed=50)

    async with UltraArm.connect(url) as arm:
        reads = await timed(lambda _: arm.get_angles(), requests)
        return reads, await timed(move, motions)


def by_library(library: str, there: Arms, requests: int, motions: int) -> tuple[Clock, Clock]:
    """The vendor's library."""
    reads = others.measured(library, "read", there.url, requests)
    waits = others.measured(library, "wait", there.url, motions)
    return (reads["seconds"], reads["cpu"], reads["ended"]), (waits["seconds"], waits["cpu"], waits["ended"])


FAMILIES: dict[str, tuple[str, Callable[[str, int, int], Any], str, str, float | None]] = {
    "myArm": ("myarm300", by_driver_myarm, "pymycobot (myArm)", cobot.SEND_ANGLES.name, 1 / GAP),
    "ultraArm": ("ultraarm", by_driver_ultraarm, "pymycobot (ultraArm)", ultra.MOVE_JOINTS.name, None),
}


def row_of(family: str, client: str, clocks: tuple[Clock, Clock], there: Arms, name: str, limit: float | None) -> Row:
    """One client's row."""
    (seconds, cpu, reads), (_, _, returned) = clocks
    finished = there.ended(name)[-len(returned) :]
    late = [at - done for at, done in zip(returned, finished, strict=True)]
    return {
        "family": family,
        "client": client,
        "reads_per_s": round(len(reads) / seconds, 1),
        "limit_per_s": limit,
        "cpu_s_per_1000": round(cpu / len(reads) * 1000, 4),
        "late_p50_ms": round(percentile(late, 50) * 1000, 2),
        "late_worst_ms": round(max(late) * 1000, 2),
    }


def main() -> None:
    """Prints a table, or one JSON object."""
    options = parsed(__doc__, requests=200, motions=6)
    rows = []
    for family, (model, by_driver, library, name, limit) in FAMILIES.items():
        with arms(LISTEN, model=model) as there:
            clocks = asyncio.run(by_driver(there.url, options.requests, options.motions))
            rows.append(row_of(family, "dobot_async", clocks, there, name, limit))

        if importlib.util.find_spec("pymycobot"):
            with arms(LISTEN, model=model) as there:
                clocks = by_library(library, there, options.requests, options.motions)
                rows.append(row_of(family, library, clocks, there, name, None))

    show("families", rows, as_json=options.json, requests=options.requests, motions=options.motions)


if __name__ == "__main__":
    main()
