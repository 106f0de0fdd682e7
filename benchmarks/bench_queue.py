"""Queued PTP motions a second, for 1, 4, 8 and 16 unacknowledged at a time; the arm executes each at once.

    python -m benchmarks.bench_queue [--commands 2000] [--json] [--quick]

The limit at 115200 baud is that of 23 bytes out and 14 back: one after the other with a window of 1, side by side with
more. `ratio` is beside the minimal client with the same window, which never asks how much room the queue has. The
driver sends batches; clients take turns in several rounds, and all figures are medians, with the `spread` of the ratios
of one round. A full queue must not drop anything, so `overflow` is 0. The other libraries have a window of 1. A
rate of 0 is that of a client that did not get done in 8 s.
"""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Awaitable, Callable

from benchmarks import minimal, others
from benchmarks.arm import AT_ONCE, arms
from benchmarks.report import BAUD, BITS, Row, median, paired, parsed, show
from dobot_async import Magician
from dobot_async.simulator import simulate

ROUNDS = 5
LOSS = 0.01
LOSSY = "115200 baud, 1 % lost"
BATCH = 500
OUT, BACK = 23 * BITS / BAUD, 14 * BITS / BAUD
WINDOWS = (1, 4, 8, 16)
FEW = (1, 4)
PATIENCE = 8.0
LINKS = {"pty": "pty", "115200 baud": f"pty:?baud={BAUD}"}
POINTS = [(220.0, 10.0 * number, 40.0) for number in (0, 1)]
PTP = [minimal.ptp(*point) for point in POINTS]
Measure = tuple[float, float]  # commands/s, CPU seconds per command


async def by_driver(url: str, window: int, commands: int) -> Measure:
    """The driver; 0 if it does not get done in time."""
    try:
        async with asyncio.timeout(PATIENCE):
            return await in_batches(url, window, commands)
    except TimeoutError:
        return 0.0, 0.0


async def in_batches(url: str, window: int, commands: int) -> Measure:
    """The driver: single puts with a window of 1, batches with a wider one."""
    async with Magician.connect(url, window=window) as arm:
        cpu, started = time.process_time(), time.perf_counter()
        if window == 1:
            for number in range(commands):
                await arm.queue.move_to(*POINTS[number % 2])
        else:
            for first in range(0, commands, BATCH):
                async with arm.queue.batch() as batch:
                    for number in range(first, min(first + BATCH, commands)):
                        batch.move_to(*POINTS[number % 2])

        seconds, cpu = time.perf_counter() - started, time.process_time() - cpu
        await arm.queue.join()
        return commands / seconds, cpu / commands


async def by_minimal(url: str, window: int, commands: int) -> Measure:
    """The minimal client: as soon as one is acknowledged, the next one is sent."""
    async with minimal.connect(url) as client:
        under_way: deque[asyncio.Future[bytes]] = deque()
        await client.request(minimal.START)  # a client that was stopped has left the queue standing
        cpu, started = time.process_time(), time.perf_counter()
        for number in range(commands):
            if len(under_way) == window:
                await under_way.popleft()

            under_way.append(await client.post(PTP[number % 2]))

        while under_way:
            await under_way.popleft()

        seconds, cpu = time.perf_counter() - started, time.process_time() - cpu
        return commands / seconds, cpu / commands


CLIENTS: dict[str, Callable[[str, int, int], Awaitable[Measure]]] = {"minimal": by_minimal, "dobot_async": by_driver}


def limit(link: str, window: int) -> float | None:
    """Commands/s that the line allows."""
    if "baud" not in link:
        return None

    return 1 / (OUT + BACK) if window == 1 else 1 / max(OUT, BACK)


def rows_of(link: str, window: int, found: dict[str, list[Measure]], overflow: int) -> list[Row]:
    """A row for each client."""
    most = limit(link, window)
    rates = {name: [rate for rate, _ in rounds] for name, rounds in found.items()}
    cpus = {name: [cpu for _, cpu in rounds] for name, rounds in found.items()}
    base = "minimal" if "minimal" in found else "dobot_async"
    rows: list[Row] = []
    for name in found:
        rate, (ratio, spread) = median(rates[name], 1), paired(rates[name], rates[base])
        row = {
            "link": link,
            "window": window,
            "client": name,
            "ptp_per_s": rate,
            "of_limit": round(rate / most, 3) if most else None,
            "ratio": ratio,
            "spread": spread,
            "cpu_s_per_1000": median([cpu * 1000 for cpu in cpus[name]], 4),
            "cpu_ratio": paired(cpus[name], cpus[base], 2)[0],
            "overflow": overflow,
        }
        rows.append(row)

    return rows


async def in_memory(window: int, commands: int) -> tuple[dict[str, list[Measure]], int]:
    """The clients that can use memory, and the overflow."""
    async with simulate(speed=AT_ONCE) as sim:
        found = {
            name: [await measure(sim.url, window, commands) for _ in range(ROUNDS)] for name, measure in CLIENTS.items()
        }
        return found, sim.arm.counters.overflowed


def on_line(listen: str, window: int, commands: int) -> tuple[dict[str, list[Measure]], int]:
    """All clients, one after the other, in each round, and the overflow."""
    others_here = others.available() if window == 1 else {}
    found: dict[str, list[Measure]] = {name: [] for name in (*CLIENTS, *others_here)}
    with arms(listen, speed=AT_ONCE) as there:
        for _ in range(ROUNDS):
            for name, measure in CLIENTS.items():
                found[name].append(asyncio.run(measured(measure, there.url, window, commands)))

            for name in others_here:
                done = others.measured(name, "queue", there.url, max(commands // 8, 5))
                found[name].append((len(done["times"]) / done["seconds"], done["cpu"] / len(done["times"])))

        return found, there.counters["overflowed"]


async def measured(
    measure: Callable[[str, int, int], Awaitable[Measure]], url: str, window: int, commands: int
) -> Measure:
    """Makes a coroutine of what may be any awaitable."""
    return await measure(url, window, commands)


def main() -> None:
    """Prints a table, or one JSON object."""
    options = parsed(__doc__, commands=2000)
    each = max(1, options.commands // ROUNDS)
    rows = []
    windows = FEW if options.quick else WINDOWS
    for window in windows:
        rows += rows_of("memory", window, *asyncio.run(in_memory(window, each)))

    for link, listen in LINKS.items():
        for window in windows:
            rows += rows_of(link, window, *on_line(listen, window, each))

    with arms(LINKS["115200 baud"], speed=AT_ONCE, loss=LOSS) as there:
        # Of a window that was lost in part nothing tells which commands the arm took: that is MotionUnknown.
        lossy = [asyncio.run(by_driver(there.url, 1, each)) for _ in range(ROUNDS)]
        rows += rows_of(LOSSY, 1, {"dobot_async": lossy}, there.counters["overflowed"])

    show("queue", rows, as_json=options.json, commands=options.commands)


if __name__ == "__main__":
    main()
