"""Poses read one at a time: how many a second, what is added to the line's own time, and CPU per 1,000 requests.

    python -m benchmarks.bench_roundtrip [--requests 2000] [--json] [--quick]

Over memory (where the simulated arm takes its time in the same process), over a pseudo-terminal as fast as the
computer, and over one at 115200 baud, the arm being in another process. The limit is what the baud rate allows: 6 bytes
out and 38 back. All clients take turns in several rounds; figures are medians of the rounds, and latencies are of all
requests. `ratio` and `cpu_ratio` are the medians of what each round gives beside the minimal client of the same round,
and `spread` and `cpu_spread` the least and the greatest of these. The minimal client trusts the line, so the row of a
line that loses 1 % of the messages each way has nothing beside it.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from contextlib import AsyncExitStack

from benchmarks import minimal, others
from benchmarks.arm import Arms, arms
from benchmarks.report import BAUD, BITS, Row, median, paired, parsed, percentile, show
from dobot_async import Magician
from dobot_async.simulator import simulate

ROUNDS = 9
LOSS = 0.01
LOSSY = "115200 baud, 1 % lost"
LINE = (6 + 38) * BITS / BAUD
LINKS = {"pty": ("pty", 0.0), "115200 baud": (f"pty:?baud={BAUD}", LINE)}
Measure = tuple[float, float, list[float]]


async def timed(call: Callable[[], Awaitable[object]], requests: int) -> Measure:
    """Seconds, CPU seconds, and the seconds of each call."""
    for _ in range(10):
        await call()

    times = []
    cpu, started = time.process_time(), time.perf_counter()
    before = started
    for _ in range(requests):
        await call()
        now = time.perf_counter()
        times.append(now - before)
        before = now

    return before - started, time.process_time() - cpu, times


async def by_driver(url: str, requests: int) -> Measure:
    """The driver."""
    async with Magician.connect(url) as arm:
        return await timed(arm.get_pose, requests)


async def by_minimal(url: str, requests: int) -> Measure:
    """The minimal client."""
    async with minimal.connect(url) as client:
        return await timed(client.get_pose, requests)


CLIENTS = {"minimal": by_minimal, "dobot_async": by_driver}


def rows_of(link: str, line: float, found: dict[str, list[Measure]]) -> list[Row]:
    """A row for each client."""
    rows = []
    rates = {name: [len(times) / seconds for seconds, _, times in rounds] for name, rounds in found.items()}
    cpus = {name: [cpu / len(times) for _, cpu, times in rounds] for name, rounds in found.items()}
    base = "minimal" if "minimal" in found else "dobot_async"
    for name, rounds in found.items():
        ratio, spread = paired(rates[name], rates[base])
        cpu_ratio, cpu_spread = paired(cpus[name], cpus[base], 2)
        added = [seconds - line for _, _, times in rounds for seconds in times]
        rows.append(
            {
                "link": link,
                "client": name,
                "poses_per_s": median(rates[name], 1),
                "of_limit": round(median(rates[name], 1) * line, 3) if line else None,
                "ratio": ratio,
                "spread": spread,
                "added_p50_ms": round(percentile(added, 50) * 1000, 3),
                "added_p99_ms": round(percentile(added, 99) * 1000, 3),
                "cpu_s_per_1000": median([cpu * 1000 for cpu in cpus[name]], 4),
                "cpu_ratio": cpu_ratio,
                "cpu_spread": cpu_spread,
            }
        )

    return rows


async def in_memory(requests: int) -> dict[str, list[Measure]]:
    """All clients that can use memory."""
    async with AsyncExitStack() as stack:
        sim = await stack.enter_async_context(simulate())
        found: dict[str, list[Measure]] = {name: [] for name in CLIENTS}
        for _ in range(ROUNDS):
            for name, measure in CLIENTS.items():
                found[name].append(await measure(sim.url, requests))

        return found


def on_line(there: Arms, requests: int) -> dict[str, list[Measure]]:
    """All clients, one after the other, in each round."""
    found: dict[str, list[Measure]] = {name: [] for name in (*CLIENTS, *others.available())}
    for _ in range(ROUNDS):
        for name, measure in CLIENTS.items():
            found[name].append(asyncio.run(measure(there.url, requests)))

        for name in others.available():
            done = others.measured(name, "pose", there.url, max(requests // 4, 5))
            found[name].append((done["seconds"], done["cpu"], done["times"]))

    return found


def main() -> None:
    """Prints a table, or one JSON object."""
    options = parsed(__doc__, requests=2000)
    each = max(1, options.requests // ROUNDS)
    rows = rows_of("memory", 0.0, asyncio.run(in_memory(each)))
    counters = []
    for link, (listen, line) in LINKS.items():
        with arms(listen) as there:
            rows += rows_of(link, line, on_line(there, each))
            counters.append(there.counters)

    with arms(f"pty:?baud={BAUD}", loss=LOSS) as there:
        lossy = [asyncio.run(by_driver(there.url, each)) for _ in range(ROUNDS)]
        rows += rows_of(LOSSY, LINE, {"dobot_async": lossy})

    junk = sum(each["junk_bytes"] + each["bad_frames"] for each in counters)
    show("roundtrip", rows, as_json=options.json, requests=options.requests, junk=junk)


if __name__ == "__main__":
    main()
