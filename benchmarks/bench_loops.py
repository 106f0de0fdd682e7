"""The driver on asyncio's own event loop and on uvloop: poses a second, PTP motions a second, and CPU per 1,000 poses.

    python -m benchmarks.bench_loops [--requests 2000] [--json] [--quick]

Over pseudo-terminals, the arm being in another process, on a loop of its own that is the same for both. The loops take
turns in several rounds; figures are medians, and ratios those of the loops in the same round, with their spread.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from importlib.util import find_spec

from benchmarks.arm import AT_ONCE, arms
from benchmarks.bench_queue import by_driver as commands
from benchmarks.bench_roundtrip import LINKS, Measure
from benchmarks.bench_roundtrip import by_driver as poses
from benchmarks.report import Row, median, paired, parsed, show

ROUNDS = 7
OWN, UVLOOP = "asyncio", "uvloop"


def loops() -> dict[str, Callable[[], asyncio.AbstractEventLoop] | None]:
    """What makes each loop that there is here."""
    if not find_spec(UVLOOP):
        return {OWN: None}

    import uvloop  # noqa: PLC0415 - where it is installed

    return {OWN: None, UVLOOP: uvloop.new_event_loop}


def measured(url: str, requests: int, factory: Callable[[], asyncio.AbstractEventLoop] | None) -> tuple[Measure, float]:
    """Poses, and PTP motions a second, on one loop."""
    with asyncio.Runner(loop_factory=factory) as runner:
        read = runner.run(poses(url, requests))
        rate, _ = runner.run(commands(url, 1, requests))
        return read, rate


def rows_of(link: str, found: dict[str, list[tuple[Measure, float]]]) -> list[Row]:
    """A row for each loop."""
    rates = {name: [len(times) / seconds for (seconds, _, times), _ in rounds] for name, rounds in found.items()}
    cpus = {name: [1000 * cpu / len(times) for (_, cpu, times), _ in rounds] for name, rounds in found.items()}
    ptps = {name: [rate for _, rate in rounds] for name, rounds in found.items()}
    rows: list[Row] = []
    for name in found:
        ratio, spread = paired(rates[name], rates[OWN])
        cpu_ratio, cpu_spread = paired(cpus[name], cpus[OWN], 2)
        rows.append(
            {
                "link": link,
                "loop": name,
                "poses_per_s": median(rates[name], 1),
                "ratio": ratio,
                "spread": spread,
                "ptp_per_s": median(ptps[name], 1),
                "cpu_s_per_1000": median(cpus[name], 4),
                "cpu_ratio": cpu_ratio,
                "cpu_spread": cpu_spread,
            }
        )

    return rows


def main() -> None:
    """Prints a table, or one JSON object."""
    options = parsed(__doc__, requests=2000)
    each = max(1, options.requests // ROUNDS)
    rows: list[Row] = []
    for link, (listen, _) in LINKS.items():
        with arms(listen, speed=AT_ONCE) as there:
            found: dict[str, list[tuple[Measure, float]]] = {name: [] for name in loops()}
            for _ in range(ROUNDS):
                for name, factory in loops().items():
                    found[name].append(measured(there.url, each, factory))

            rows += rows_of(link, found)

    show("loops", rows, as_json=options.json, requests=options.requests)


if __name__ == "__main__":
    main()
