"""A long continuous path (CP) through the arm's bounded queue, at the arm's pace: does it ever wait for its host?

    python -m benchmarks.bench_stream [--points 3000] [--json] [--quick]

Points 0.5 mm apart on a circle, at 100 mm/s: 5 ms each, where a line of 115200 baud could carry one in 3.2 ms. A WAIT
ahead of them lets the queue fill. From then on a point that is not there when the one before it ends is `starved`, and
one whose successor was not there when it began, so that the arm slowed down towards its end, is `slowed`; both must be
0. `overflow` counts what a full queue dropped, which must be 0 too.
"""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Awaitable, Callable
from itertools import pairwise

from benchmarks import minimal
from benchmarks.arm import Arms, arms
from benchmarks.report import BAUD, Row, parsed, show
from dobot_async import Magician
from dobot_async.magician import commands as c

RUNS = [
    ("pty", "dobot_async", 1),
    ("115200 baud", "minimal", 1),
    ("115200 baud", "dobot_async", 1),
    ("115200 baud", "dobot_async", 8),
]
LISTEN = {"pty": "pty", "115200 baud": f"pty:?baud={BAUD}"}
CP = c.SET_CP_CMD.name
STEP, RADIUS, SPEED = 0.5, 30.0, 100.0  # mm, mm, mm/s
CENTRE = 230.0, 0.0, 40.0
PACE = STEP / SPEED
FILLING = 0.5
LATE = 1e-6  # seconds, of the arm's arithmetic
Measure = tuple[float, float]  # seconds until all were accepted, CPU seconds


def points(count: int) -> list[tuple[float, float, float]]:
    """Round and round."""
    angles = (number * STEP / RADIUS for number in range(1, count + 1))
    x, y, z = CENTRE
    return [(x + RADIUS * math.cos(angle), y + RADIUS * math.sin(angle), z) for angle in angles]


async def prepare(url: str) -> None:
    """Drives to the beginning, and says how fast the path is."""
    async with Magician.connect(url) as arm:
        await arm.request(c.SET_CP_PARAMS, c.CPParams(plan_acc=20_000.0, junction_vel=SPEED, acc=20_000.0))
        await arm.request(c.SET_CP_COMMON_PARAMS, c.CPCommonParams(100.0, 100.0))
        x, y, z = CENTRE
        await arm.move_to(x + RADIUS, y, z)


async def by_driver(url: str, window: int, count: int) -> Measure:
    """The driver: batches, which wait for room by themselves."""
    async with Magician.connect(url, window=window) as arm:
        cpu, started = time.process_time(), time.perf_counter()
        await arm.queue.wait(FILLING)
        async with arm.queue.batch() as batch:
            for point in points(count):
                last = batch.put(c.SET_CP_CMD, c.CPCmd(c.CPMode.ABSOLUTE, *point))

        measure = time.perf_counter() - started, time.process_time() - cpu
        await last
        return measure


async def by_minimal(url: str, _: int, count: int) -> Measure:
    """The minimal client: asks how much room there is whenever what it knows of is used up."""
    async with minimal.connect(url) as client:
        cpu, started = time.process_time(), time.perf_counter()
        await client.queue(minimal.framed(110, 0b11, int(FILLING * 1000).to_bytes(4, "little")))
        left = 0
        for point in points(count):
            while not left:
                left = int.from_bytes(await client.request(minimal.LEFT_SPACE), "little")

            left -= 1
            index = await client.queue(minimal.cp(*point))

        measure = time.perf_counter() - started, time.process_time() - cpu
        await client.done(index)
        return measure


CLIENTS: dict[str, Callable[[str, int, int], Awaitable[Measure]]] = {"minimal": by_minimal, "dobot_async": by_driver}


def starvation(there: Arms) -> tuple[int, int, float]:
    """How many points were starved, and how many slowed, and how many seconds that cost altogether."""
    path = [(started, ended) for name, started, ended in there.executed if name == CP]
    waits = [begun - ended for (_, ended), (begun, _) in pairwise(path)]
    inner = [ended - begun for begun, ended in path[1:-1]]
    slowed = sum(seconds > PACE * 1.02 for seconds in inner)
    cost = path[-1][1] - path[0][0] - len(path) * PACE
    return sum(wait > LATE for wait in waits), slowed, cost


async def measured(client: str, url: str, window: int, count: int) -> Measure:
    """One client's way."""
    await prepare(url)
    return await CLIENTS[client](url, window, count)


def main() -> None:
    """Prints a table, or one JSON object."""
    options = parsed(__doc__, points=3000)
    rows: list[Row] = []
    for link, client, window in RUNS:
        with arms(LISTEN[link]) as there:
            seconds, cpu = asyncio.run(measured(client, there.url, window, options.points))
            starved, slowed, cost = starvation(there)
            counters = there.counters
            rows.append(
                {
                    "link": link,
                    "client": client,
                    "window": window,
                    "points_per_s": round(options.points / seconds, 1),
                    "starved": starved,
                    "slowed": slowed,
                    "lost_ms": round(cost * 1000, 1),
                    "cpu_s_per_1000": round(cpu / options.points * 1000, 4),
                    "overflow": counters["overflowed"],
                    "junk": counters["junk_bytes"] + counters["bad_frames"],
                }
            )

    show("stream", rows, as_json=options.json, points=options.points)


if __name__ == "__main__":
    main()
