"""Runs every benchmark, writes what they found to RESULTS.md beside this file, and draws it into docs/.

    python benchmarks/run_all.py [--quick] [--only NAME ...] [--results FILE] [--plots FOLDER]

`NAME` is that of a benchmark without `bench_`. The text of RESULTS.md between the marks is written anew; what stands
outside of them stays, so that words about the figures have their place there. A benchmark that did not run keeps its
old table. Plots need matplotlib, of the development dependencies.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import re
import subprocess
import sys
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from benchmarks.report import Row, clients, text

HERE = Path(__file__).parent
RESULTS = HERE / "RESULTS.md"
DOCS = HERE.parent / "docs"
FLOW = (7.0, 3.6)
COLORS = ("#8a8a8a", "#1f6fb4", "#d1852c", "#6b9b37")
NAMES = (
    "parser",
    "roundtrip",
    "serial",
    "queue",
    "completion",
    "lateness",
    "fleet",
    "many",
    "families",
    "stream",
    "sync",
    "ble",
    "panel",
)


def ran(name: str, *, quick: bool) -> dict[str, Any] | None:
    """What a benchmark says, None if it cannot run here."""
    command = [sys.executable, str(HERE / f"bench_{name}.py"), "--json", *(["--quick"] if quick else [])]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.stderr.write(f"{name} did not run: {done.stderr.strip().splitlines()[-1]}\n")
        return None

    found: dict[str, Any] = json.loads(done.stdout)
    return found


def table(rows: Sequence[Row]) -> str:
    """Rows as a table of Markdown."""
    columns = list(rows[0])
    lines = [" | ".join(columns), "|".join("---:" for _ in columns)]
    lines += [" | ".join(text(row[column]) for column in columns) for row in rows]
    return "\n".join(f"| {line} |" for line in lines)


def written(old: str, name: str, body: str) -> str:
    """The text with what stands between the marks of a name replaced, or with the marks at its end."""
    begin, end = f"<!-- {name} -->", f"<!-- end of {name} -->"
    block = f"{begin}\n{body}\n{end}"
    if begin not in old:
        return f"{old.rstrip()}\n\n{block}\n"

    return re.sub(f"{re.escape(begin)}.*?{re.escape(end)}", lambda _: block, old, flags=re.DOTALL)


def machine() -> str:
    """Where and when this ran."""
    load = f", load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    return (
        f"{datetime.now(UTC):%Y-%m-%d}, Python {platform.python_version()}, {platform.system()} {platform.machine()}, "
        f"{os.cpu_count()} cores{load}."
    )


def bars(
    rows: Sequence[Row], group: Callable[[Row], str], key: str, label: str, to: Path, *, log: bool = False
) -> None:
    """Draws a group of bars for each link, with a bar for each client."""
    from matplotlib.figure import Figure

    groups = list(dict.fromkeys(map(group, rows)))
    names = clients(rows)
    figure = Figure(figsize=FLOW, layout="constrained")
    axes = figure.subplots()
    width = 0.8 / len(names)
    for number, name in enumerate(names):
        values = {group(row): row[key] for row in rows if row["client"] == name and row[key] is not None}
        places = [groups.index(each) + width * (number - (len(names) - 1) / 2) for each in values]
        drawn = axes.bar(places, list(values.values()), width, label=name, color=COLORS[number % len(COLORS)])
        axes.bar_label(drawn, fmt="%.4g", fontsize=6, padding=1)

    axes.set_xticks(range(len(groups)), groups)
    axes.set_ylabel(label)
    axes.set_yscale("log" if log else "linear")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(fontsize=7, frameon=False)
    figure.savefig(to, dpi=130, metadata={"Software": None})


def draw(name: str, rows: Sequence[Row], folder: Path) -> None:
    """Draws what a benchmark found, if there is a picture for it."""
    slow = [row for row in rows if "baud" in str(row.get("link"))]
    if name == "roundtrip":
        bars(rows, lambda row: row["link"], "poses_per_s", "poses/s", folder / "bench-roundtrip.png", log=True)
    elif name == "queue":
        bars(slow, lambda row: f"window {row['window']}", "ptp_per_s", "PTP/s", folder / "bench-queue.png")
    elif name == "completion":
        label = "noticed so many ms late (median)"
        bars(rows, lambda row: row["link"], "late_p50_ms", label, folder / "bench-completion.png", log=True)


def main() -> None:
    """Runs what is asked for."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--quick", action="store_true", help="briefly, to see that they run")
    options.add_argument("--only", nargs="+", choices=NAMES, default=NAMES, metavar="NAME")
    options.add_argument("--results", type=Path, default=RESULTS)
    options.add_argument("--plots", type=Path, default=DOCS)
    arguments = options.parse_args()

    for name in arguments.only:
        found = ran(name, quick=arguments.quick)
        if not found:
            continue

        rows = found["rows"]
        old = arguments.results.read_text(encoding="utf-8") if arguments.results.exists() else "# Results\n"
        new = written(old, name, f"{machine()}\n\n{table(rows)}")
        arguments.results.write_text(new, encoding="utf-8")
        draw(name, rows, arguments.plots)
        print(f"{name}: {len(rows)} rows")


if __name__ == "__main__":
    main()
