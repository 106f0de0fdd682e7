"""What the benchmarks share: their options, their figures, and how they tell them."""

from __future__ import annotations

import argparse
import json
import statistics
from collections.abc import Sequence
from typing import Any

__all__ = ["BAUD", "BITS", "Row", "clients", "median", "paired", "parsed", "percentile", "show", "text"]

Row = dict[str, Any]
BAUD = 115200
LEAST = 2
BITS = 10  # of a byte on a serial line, start and stop included


def parsed(doc: str | None, **defaults: int) -> argparse.Namespace:
    """Returns the options: `--json`, `--quick`, and a number for each default.

    With `--quick`, which is for a test that a benchmark still runs, each number is a hundredth of what it would be.
    """
    options = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, default in defaults.items():
        options.add_argument(f"--{name}", type=int, default=None, help=f"default: {default}")

    options.add_argument("--json", action="store_true", help="print one JSON object")
    options.add_argument("--quick", action="store_true", help="run briefly")
    arguments = options.parse_args()
    for name, default in defaults.items():
        if getattr(arguments, name) is None:
            setattr(arguments, name, max(LEAST, default // 100) if arguments.quick else default)

    return arguments


def percentile(values: Sequence[float], percent: float) -> float:
    """The value below which so many percent lie: the nearest one that was measured."""
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(len(ordered) * percent / 100))]


def median(values: Sequence[float], digits: int) -> float:
    """The median, rounded."""
    return round(statistics.median(values), digits)


def paired(values: Sequence[float], beside: Sequence[float], digits: int = 3) -> tuple[float, str]:
    """The median of the ratios of what was measured in the same rounds, and the least and the greatest of them."""
    ratios = [value / other if other else 0.0 for value, other in zip(values, beside, strict=True)]
    return median(ratios, digits), f"{min(ratios):.{digits}f} to {max(ratios):.{digits}f}"


def show(name: str, rows: Sequence[Row], *, as_json: bool, **details: Any) -> None:
    """Prints one JSON object, or a table with a column for each key of the first row."""
    if as_json:
        print(json.dumps({"benchmark": name, **details, "rows": rows}))
        return

    columns = list(rows[0])
    lines = [columns, *([text(row[column]) for column in columns] for row in rows)]
    widths = [max(len(line[place]) for line in lines) for place in range(len(columns))]
    for line in lines:
        print("  ".join(cell.rjust(width) for cell, width in zip(line, widths, strict=True)).rstrip())


def text(value: Any) -> str:
    """A cell of the table."""
    if value is None:
        return "-"

    return f"{value:,}" if isinstance(value, int) else str(value)


def clients(rows: Sequence[Row]) -> list[str]:
    """The clients that rows are about, in order."""
    return list(dict.fromkeys(row["client"] for row in rows))
