"""What a blocking call takes beside the awaited one: a read of an arm in the same process, by three kinds of program.

    python -m benchmarks.bench_sync [--rounds 3000] [--json] [--quick]

The arm answers at once, so that what is left is the driver and the ways between threads. `over` is by how much the
median is above that of the awaited call; "nothing" is a call that does nothing in the arms' thread. anyio's blocking
portal is what one would use without `dobot_async.sync`. The three are measured in turns, for other programs may have
the processor.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable

from anyio.from_thread import start_blocking_portal

from benchmarks.report import Row, parsed, percentile, show
from dobot_async import Magician
from dobot_async.sync import Magician as BlockingMagician
from dobot_async.sync import run

URL = "sim:"
TURNS = 5
BUDGET = 150.0
"""Microseconds that a blocking call may take longer than an awaited one."""


def microseconds(call: Callable[[], object], rounds: int) -> list[float]:
    """How long each of so many calls takes."""
    found = []
    for _ in range(rounds):
        began = time.perf_counter()
        call()
        found.append((time.perf_counter() - began) * 1e6)

    return found


async def awaited(rounds: int) -> list[float]:
    """The same of an awaited call."""
    found = []
    async with Magician.connect(URL) as arm:
        for _ in range(rounds):
            began = time.perf_counter()
            await arm.get_pose()
            found.append((time.perf_counter() - began) * 1e6)

    return found


async def nothing() -> None:
    """Does nothing."""


def main() -> None:
    """Measures, and tells."""
    options = parsed(__doc__, rounds=3000)
    rounds = max(2, options.rounds // TURNS)
    found: dict[str, list[float]] = {
        name: [] for name in ("await", "sync", "portal", "sync, nothing", "portal, nothing")
    }
    for _ in range(TURNS):
        found["await"] += asyncio.run(awaited(rounds))
        with BlockingMagician.connect(URL) as arm:
            found["sync"] += microseconds(arm.get_pose, rounds)
            found["sync, nothing"] += microseconds(lambda: run(nothing), rounds)

        with (
            start_blocking_portal() as portal,
            portal.wrap_async_context_manager(Magician.connect(URL)) as other,
        ):
            found["portal"] += microseconds(lambda: portal.call(other.get_pose), rounds)
            found["portal, nothing"] += microseconds(lambda: portal.call(nothing), rounds)

    base = percentile(found["await"], 50)
    rows: list[Row] = [
        {
            "client": name,
            "calls": len(took),
            "median_us": round(percentile(took, 50)),
            "p95_us": round(percentile(took, 95)),
            "over_us": None if "nothing" in name else round(percentile(took, 50) - base),
        }
        for name, took in found.items()
    ]
    show("sync", rows, as_json=options.json, budget_us=BUDGET)


if __name__ == "__main__":
    main()
