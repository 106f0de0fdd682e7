"""How late the end of a motion is noticed, from the arm's finishing to the return of the await, and what waiting costs.

    python -m benchmarks.bench_completion [--motions 100] [--json] [--quick]

Each client moves the arm back and forth over ways of different lengths, and waits for the end of each. The minimal
client does nothing but ask for the current index, as fast as it is answered; the others do what they do.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable

from benchmarks import minimal, others
from benchmarks.arm import Clock, arms
from benchmarks.report import BAUD, Row, parsed, percentile, show
from dobot_async import Magician, PTPMode
from dobot_async.magician import commands as c
from dobot_async.simulator import simulate

LINKS = {"pty": "pty", "115200 baud": f"pty:?baud={BAUD}"}
PTP = c.SET_PTP_CMD.name
WAYS = (10.0, 25.0, 17.0, 40.0, 5.0)  # mm
SPEED = 2.0
LOSS = 0.01
Measure = tuple[list[float], float, float]  # when each await returned, requests per wait, CPU seconds per wait


def places(count: int) -> list[tuple[float, float, float]]:
    """Where the arm goes."""
    return [(220.0, WAYS[number % len(WAYS)] * (-1) ** number, 40.0) for number in range(count)]


async def by_driver(url: str, motions: int) -> Measure:
    """The driver."""
    async with Magician.connect(url) as arm:
        ended = []
        sent, cpu = arm.link.stats.sent, time.process_time()
        for place in places(motions):
            await arm.move_to(*place, mode=PTPMode.MOVL_XYZ)
            ended.append(time.monotonic())

        cpu = time.process_time() - cpu
        return ended, (arm.link.stats.sent - sent) / motions, cpu / motions


async def by_minimal(url: str, motions: int) -> Measure:
    """The minimal client."""
    async with minimal.connect(url) as client:
        ended = []
        asked, cpu = 0, time.process_time()
        for place in places(motions):
            index = await client.queue(minimal.ptp(*place))
            asked += 1 + await client.done(index)
            ended.append(time.monotonic())

        return ended, asked / motions, (time.process_time() - cpu) / motions


CLIENTS: dict[str, Callable[[str, int], Awaitable[Measure]]] = {"minimal": by_minimal, "dobot_async": by_driver}


def row_of(link: str, client: str, measure: Measure, finished: list[float]) -> Row:
    """One client's row; `finished` is of the motions alone, in the arm's order."""
    ended, requests, cpu = measure
    late = [returned - done for returned, done in zip(ended, finished[-len(ended) :], strict=True)]
    return {
        "link": link,
        "client": client,
        "late_p50_ms": round(percentile(late, 50) * 1000, 2),
        "late_p99_ms": round(percentile(late, 99) * 1000, 2),
        "late_worst_ms": round(max(late) * 1000, 2),
        "requests_per_wait": round(requests, 1),
        "cpu_ms_per_wait": round(cpu * 1000, 2),
    }


async def in_memory(motions: int) -> list[Row]:
    """The clients that can use memory."""
    rows = []
    for name, measure in CLIENTS.items():
        async with simulate(clock=Clock(SPEED)) as sim:
            found = await measure(sim.url, motions)
            done = [each.finished / SPEED for each in sim.arm.executed if each.name == PTP]
            rows.append(row_of("memory", name, found, done))

    return rows


def on_line(link: str, listen: str, motions: int) -> list[Row]:
    """All clients, each with an arm that was just switched on."""
    rows = []
    for name, measure in CLIENTS.items():
        with arms(listen, speed=SPEED) as there:
            rows.append(row_of(link, name, asyncio.run(measured(measure, there.url, motions)), there.ended(PTP)))

    if link == "115200 baud":
        with arms(listen, speed=SPEED, loss=LOSS) as there:
            found = asyncio.run(by_driver(there.url, max(motions // 2, 2)))
            rows.append(row_of(f"{link}, 1 % lost", "dobot_async", found, there.ended(PTP)))

    for name in others.available():
        with arms(listen, speed=SPEED) as there:
            few = max(motions // 4, 2)
            before = there.counters["requests"]
            done = others.measured(name, "wait", there.url, few)
            requests = (there.counters["requests"] - before) / few
            rows.append(row_of(link, name, (done["ended"], requests, done["cpu"] / few), there.ended(PTP)))

    return rows


async def measured(measure: Callable[[str, int], Awaitable[Measure]], url: str, motions: int) -> Measure:
    """Makes a coroutine of what may be any awaitable."""
    return await measure(url, motions)


def main() -> None:
    """Prints a table, or one JSON object."""
    options = parsed(__doc__, motions=100)
    rows = asyncio.run(in_memory(max(options.motions // 4, 2)))
    for link, listen in LINKS.items():
        motions = options.motions if "baud" in link else max(options.motions // 2, 2)
        rows += on_line(link, listen, motions)

    show("completion", rows, as_json=options.json, motions=options.motions)


if __name__ == "__main__":
    main()
