"""Many arms in one process: each one's pose is read 20 times a second while it moves back and forth.

    python -m benchmarks.bench_many [--seconds 4] [--json] [--quick]

The arms are simulated in other processes, on pseudo-terminals of unlimited speed. `moves` says how each one moves:
"queued" gives it the next motions without waiting for their ends, "awaited" awaits each. A reading is due every 50 ms;
`late` is how long after that its answer was there. Memory per arm is what the process has grown by between the first
arm's connection and the last one's (rss), and what Python's own objects take of it (heap).
"""

from __future__ import annotations

import asyncio
import gc
import time
import tracemalloc
from collections.abc import Awaitable, Callable
from contextlib import AsyncExitStack, suppress
from pathlib import Path

from benchmarks.arm import crowd
from benchmarks.report import Row, parsed, percentile, show
from dobot_async import Magician

COUNTS = (1, 10, 100, 300)
FEW = (1, 10)
CROWD = 10  # arms from which on a share of the memory says something
PERIOD = 0.05
PATIENT = 60.0  # seconds; the arms of the run before may still be busy with what was asked
TRIP = 25.0  # mm
STATM = Path("/proc/self/statm")
PAGE = 4096


async def queued(arm: Magician) -> None:
    """Keeps a few motions in the arm's queue; a second's worth is put every second."""
    side = 1
    while True:
        for _ in range(2):
            side = -side
            await arm.queue.move_to(220, side * TRIP, 40)

        await asyncio.sleep(1)


async def awaited(arm: Magician) -> None:
    """Moves, and waits for each motion."""
    side = 1
    while True:
        side = -side
        await arm.move_to(220, side * TRIP, 40)


MOVES: dict[str, Callable[[Magician], Awaitable[None]]] = {"queued": queued, "awaited": awaited}


async def poll(arm: Magician, begin: float, end: float, late: list[float]) -> None:
    """Reads the pose whenever it is due; what is long overdue is left out, and counts as late all the same."""
    loop = asyncio.get_running_loop()
    due = begin
    while due < end:
        await asyncio.sleep(due - loop.time())
        await arm.get_pose()
        now = loop.time()
        late.append(now - due)
        due += PERIOD


async def run(urls: list[str], moves: str, seconds: float) -> Row:
    """All arms at work for some time."""
    loop = asyncio.get_running_loop()
    late: list[float] = []
    async with AsyncExitStack() as stack:
        first, before = await connected(urls[:1], stack), resident()
        everybody = first + await connected(urls[1:], stack)
        gc.collect()
        grown = (resident() - before) / max(len(urls) - 1, 1)
        begin = loop.time() + PERIOD
        movers = [asyncio.ensure_future(MOVES[moves](arm)) for arm in everybody]
        cpu, started = time.process_time(), time.perf_counter()
        offsets = [begin + PERIOD * number / len(everybody) for number in range(len(everybody))]
        await asyncio.gather(*(poll(arm, at, at + seconds, late) for arm, at in zip(everybody, offsets, strict=True)))
        cpu, elapsed = time.process_time() - cpu, time.perf_counter() - started
        sent = sum(arm.link.stats.sent for arm in everybody)
        timeouts = sum(arm.link.stats.timeouts for arm in everybody)
        for mover in movers:
            mover.cancel()

        for mover in movers:
            with suppress(asyncio.CancelledError):
                await mover

    return {
        "arms": len(urls),
        "moves": moves,
        "cpu_percent": round(100 * cpu / elapsed, 1),
        "poses_per_s": round(len(late) / elapsed),
        "wanted_per_s": round(len(urls) / PERIOD),
        "requests_per_s": round(sent / elapsed),
        "late_p50_ms": round(percentile(late, 50) * 1000, 2),
        "late_p99_ms": round(percentile(late, 99) * 1000, 2),
        "late_worst_ms": round(max(late) * 1000, 2),
        "rss_kb_per_arm": round(grown / 1000, 1) if len(urls) >= CROWD else None,
        "timeouts": timeouts,
    }


async def connected(urls: list[str], stack: AsyncExitStack) -> list[Magician]:
    """Arms, each of which has answered."""
    entered = [
        await stack.enter_async_context(Magician.connect(url, on_error="leave", timeout=PATIENT)) for url in urls
    ]
    await asyncio.gather(*(arm.get_pose() for arm in entered))
    return entered


async def heap(urls: list[str]) -> float:
    """Bytes of Python's own objects per arm."""
    async with AsyncExitStack() as stack:
        await connected(urls[:1], stack)
        gc.collect()
        tracemalloc.start()
        await connected(urls[1:], stack)
        gc.collect()
        taken, _ = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        return taken / (len(urls) - 1)


def resident() -> int:
    """The process's resident memory in bytes, where the system tells it."""
    return int(STATM.read_text().split()[1]) * PAGE if STATM.exists() else 0


def main() -> None:
    """Prints a table, or one JSON object."""
    options = parsed(__doc__, seconds=4)
    rows = []
    for count in FEW if options.quick else COUNTS:
        for moves in MOVES:
            with crowd("pty", count) as there:
                urls = [url for process in there for url in process.urls]
                row = asyncio.run(run(urls, moves, options.seconds))
                taken = asyncio.run(heap(urls)) if count >= CROWD else None
                rows.append(row | {"heap_kb_per_arm": round(taken / 1000, 1) if taken else None})

    show("many", rows, as_json=options.json, seconds=options.seconds)


if __name__ == "__main__":
    main()
