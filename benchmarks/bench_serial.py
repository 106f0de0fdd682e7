"""Poses read one at a time through each serial backend, and with a trace: how many a second, what is added, and CPU.

    python -m benchmarks.bench_serial [--requests 4000] [--json] [--quick]

Over a pseudo-terminal as fast as the computer, and over one at 115200 baud, the arm being in another process. Backends
take turns in several rounds, and the best round of each counts, but for the latencies: they are of all rounds. `ratio`
and `cpu_ratio` are beside pyserial on the same link. `pyserial, traced` writes each frame into a file, with
`connect(record=)`.
"""

from __future__ import annotations

import asyncio
import tempfile
from collections.abc import Awaitable, Callable
from pathlib import Path

from benchmarks.arm import arms
from benchmarks.bench_roundtrip import LINKS, ROUNDS, Measure, timed
from benchmarks.report import Row, parsed, percentile, show
from dobot_async import Magician

USUAL = "pyserial"


async def poses(url: str, requests: int, record: Path | None = None) -> Measure:
    """Reads so many poses."""
    async with Magician.connect(url, record=record) as arm:
        return await timed(arm.get_pose, requests)


def traced(url: str, requests: int) -> Awaitable[Measure]:
    """The same into a trace."""
    return poses(f"{url}?backend={USUAL}", requests, Path(tempfile.gettempdir()) / "dobot_async-bench.jsonl")


CLIENTS: dict[str, Callable[[str, int], Awaitable[Measure]]] = {
    USUAL: lambda url, requests: poses(f"{url}?backend=pyserial", requests),
    "serialx": lambda url, requests: poses(f"{url}?backend=serialx", requests),
    f"{USUAL}, traced": traced,
}


async def measured(url: str, requests: int) -> dict[str, list[Measure]]:
    """All clients, one after the other, in each round."""
    found: dict[str, list[Measure]] = {name: [] for name in CLIENTS}
    for _ in range(ROUNDS):
        for name, measure in CLIENTS.items():
            found[name].append(await measure(url, requests))

    return found


def rows_of(link: str, line: float, found: dict[str, list[Measure]]) -> list[Row]:
    """A row for each client."""
    rates = {name: max(len(times) / seconds for seconds, _, times in rounds) for name, rounds in found.items()}
    cpus = {name: min(cpu / len(times) for _, cpu, times in rounds) for name, rounds in found.items()}
    rows = []
    for name, rounds in found.items():
        added = [seconds - line for _, _, times in rounds for seconds in times]
        rows.append(
            {
                "link": link,
                "client": name,
                "poses_per_s": round(rates[name], 1),
                "ratio": round(rates[name] / rates[USUAL], 3),
                "added_p50_ms": round(percentile(added, 50) * 1000, 3),
                "added_p99_ms": round(percentile(added, 99) * 1000, 3),
                "cpu_s_per_1000": round(cpus[name] * 1000, 4),
                "cpu_ratio": round(cpus[name] / cpus[USUAL], 2),
            }
        )

    return rows


def main() -> None:
    """Prints a table, or one JSON object."""
    options = parsed(__doc__, requests=4000)
    rows: list[Row] = []
    for link, (listen, line) in LINKS.items():
        with arms(listen) as there:
            rows += rows_of(link, line, asyncio.run(measured(there.url, max(1, options.requests // ROUNDS))))

    (Path(tempfile.gettempdir()) / "dobot_async-bench.jsonl").unlink(missing_ok=True)
    show("serial", rows, as_json=options.json, requests=options.requests)


if __name__ == "__main__":
    main()
