"""What the benchmarks found, written down: RESULTS.md, the tables of the pages that quote them, and plots."""

from __future__ import annotations

import os
import platform
import re
from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path

from benchmarks import svg
from benchmarks.report import Row, clients, text
from benchmarks.targets import verdicts

__all__ = ["draw", "machine", "quote", "report", "table"]

HEAD = """# Results

Written by `python -m benchmarks`, in one run: no figure here is older than another one, and none is written by hand.
What a column means is in the docstring of its benchmark, `benchmarks/bench_NAME.py`.

A ratio of two clients in one run says something; an absolute figure hardly does on another machine. The arms are
processes of their own, on processors of their own where there are several. Where the load is much above 1, others used
the machine at the same time, and the worst latencies are those of waiting for the processor.

pydobotplus wants an older pyserial than the driver, so it is measured where `DOBOT_BENCH_PYDOBOTPLUS` names the Python
of an environment that has it. 115200 baud is a pseudo-terminal whose simulated line carries 11,520 bytes/s each way.
"""


def table(rows: Sequence[Row], columns: Sequence[str] = ()) -> str:
    """Return rows as a table of Markdown."""
    chosen = columns or list(rows[0])
    lines = [" | ".join(chosen), "|".join("---:" for _ in chosen)]
    lines += [" | ".join(text(row[column]) for column in chosen) for row in rows]
    return "\n".join(f"| {line} |" for line in lines)


def machine() -> str:
    """Return where and when this ran."""
    load = f", load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    return (
        f"{datetime.now(UTC):%Y-%m-%d}, Python {platform.python_version()}, {platform.system()} {platform.machine()}, "
        f"{os.cpu_count()} cores{load}"
    )


def report(found: Mapping[str, Sequence[Row]], *, began: str, quick: bool) -> str:
    """Return the text of RESULTS.md."""
    run = f"{began}; at the end: {machine()}." + (" Run briefly (`--quick`): no figure here counts." if quick else "")
    parts = [HEAD, run, f"## Targets\n\n{table(verdicts(found))}"]
    parts += [f"## {name}\n\n{table(rows)}" for name, rows in found.items()]
    return "\n\n".join(part.strip() for part in parts) + "\n"


def quote(page: str, name: str, rows: Sequence[Row]) -> str:
    """Return a page with its table of a benchmark written anew, between `<!-- figures: NAME -->` and the end mark."""
    begin, end = f"<!-- figures: {name} -->", "<!-- end of figures -->"
    return re.sub(f"{re.escape(begin)}.*?{re.escape(end)}", f"{begin}\n{table(rows)}\n{end}", page, flags=re.DOTALL)


def grouped(rows: Sequence[Row], group: Callable[[Row], str], key: str) -> dict[str, dict[str, float]]:
    """Return the figures of each group's clients."""
    groups: dict[str, dict[str, float]] = {}
    for row in rows:
        if row[key] is not None:
            groups.setdefault(group(row), {})[row["client"]] = row[key]

    return {name: {each: found[each] for each in clients(rows) if each in found} for name, found in groups.items()}


def of_kind(rows: Sequence[Row]) -> dict[str, dict[str, float]]:
    """Return how late the end of each kind of command is noticed."""
    return {row["kind"]: {"median": row["late_p50_ms"], "worst": row["late_worst_ms"]} for row in rows}


def draw(found: Mapping[str, Sequence[Row]], folder: Path) -> None:
    """Draw what there are plots for."""
    plots: dict[str, Callable[[Sequence[Row]], str]] = {
        "roundtrip": lambda rows: svg.bars("poses/s", grouped(rows, lambda row: row["link"], "poses_per_s"), log=True),
        "queue": lambda rows: svg.bars(
            "PTP/s, by the window",
            grouped([row for row in rows if row["link"] == "115200 baud"], lambda row: str(row["window"]), "ptp_per_s"),
        ),
        "completion": lambda rows: svg.bars(
            "ms until the end of a motion is noticed, median",
            grouped(rows, lambda row: row["link"], "late_p50_ms"),
            log=True,
        ),
        "lateness": lambda rows: svg.bars("ms until the end is noticed, virtual time", of_kind(rows)),
    }
    for name, plot in plots.items():
        if name in found:
            (folder / f"bench-{name}.svg").write_text(plot(found[name]), encoding="utf-8")
