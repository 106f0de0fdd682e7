"""Run the benchmarks, write what they found to benchmarks/RESULTS.md and into docs/, and judge it by the targets.

    python -m benchmarks [NAME ...] [--quick] [--results FILE] [--docs FOLDER]

Without names, all of them; RESULTS.md then holds this run and nothing else. `--quick` is to see that they run: it
writes no page of docs/ unless it is told a folder. The code is 1 if a target was missed.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.report import Row
from benchmarks.results import draw, machine, quote, report
from benchmarks.targets import verdicts

HERE = Path(__file__).parent
RESULTS, DOCS = HERE / "RESULTS.md", HERE.parent / "docs"
NAMES = (
    "startup",
    "parser",
    "roundtrip",
    "serial",
    "loops",
    "queue",
    "completion",
    "lateness",
    "following",
    "families",
    "stream",
    "many",
    "fleet",
    "sync",
    "ble",
    "panel",
)


def ran(name: str, *options: str) -> list[Row] | None:
    """What a benchmark says, None if it cannot run here."""
    command = [sys.executable, "-m", f"benchmarks.bench_{name}", "--json", *options]
    done = subprocess.run(command, cwd=HERE.parent, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.stderr.write(f"{name} did not run: {(done.stderr.strip() or 'no word').splitlines()[-1]}\n")
        return None

    found: dict[str, Any] = json.loads(done.stdout)
    rows: list[Row] = found["rows"]
    return rows


def measured(names: Sequence[str], docs: Path | None, *, quick: bool) -> dict[str, list[Row]]:
    """The rows of each benchmark that runs here."""
    found: dict[str, list[Row]] = {}
    for name in names:
        options = ["--quick"] if quick else []
        if name == "following" and docs:
            options += ["--plot", str(docs / "bench-following.svg")]

        if rows := ran(name, *options):
            found[name] = rows
            print(f"{name}: {len(rows)} rows", flush=True)

    return found


def main() -> int:
    """Runs what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(NAMES))
    parser.add_argument("--quick", action="store_true", help="briefly, to see that they run")
    parser.add_argument("--results", type=Path, default=RESULTS)
    parser.add_argument("--docs", type=Path, help="where the pages are that quote figures; docs/ unless quick")
    options = parser.parse_args()
    if unknown := set(options.names) - set(NAMES):
        parser.error(f"no such benchmark: {', '.join(sorted(unknown))}; there are: {', '.join(NAMES)}")

    docs: Path | None = options.docs or (None if options.quick else DOCS)
    began = machine()
    found = measured(options.names or NAMES, docs, quick=options.quick)
    options.results.write_text(report(found, began=began, quick=options.quick), encoding="utf-8")
    if docs:
        draw(found, docs)
        for page in docs.glob("*.md"):
            old = new = page.read_text(encoding="utf-8")
            for name, rows in found.items():
                new = quote(new, name, rows)

            if new != old:
                page.write_text(new, encoding="utf-8")

    missed = 0
    for row in verdicts(found):
        missed += row["verdict"] == "FAIL"
        print(f"{row['verdict']:>12}  {row['target']}: {row['reached']}, wanted {row['wanted']}")

    return 1 if missed and not options.quick else 0


if __name__ == "__main__":
    sys.exit(main())
