"""What the driver is to reach, as a table; each target is looked up in the rows that the benchmarks gave."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from benchmarks.report import Row

__all__ = ["TARGETS", "Target", "verdicts"]

Found = Mapping[str, Sequence[Row]]
SLOW, FAST = "115200 baud", "pty"


@dataclass(frozen=True)
class Target:
    """One of them.

    Attributes:
        name: What is to be reached.
        benchmark: Which one tells.
        column: Its figure.
        where: What the row has in other columns.
        least: What the figure is to be at least; None if there is no such limit.
        most: What it is to be at the most.
        beside: What the row has in other columns whose figure this one is divided by.
    """

    name: str
    benchmark: str
    column: str
    where: Mapping[str, Any]
    least: float | None = None
    most: float | None = None
    beside: Mapping[str, Any] = field(default_factory=dict[str, Any])

    def figure(self, found: Found) -> float | None:
        """Return what was reached; None if it was not measured."""
        value, base = (self._one(found, each) for each in (self.where, self.beside))
        if not self.beside or value is None:
            return value

        return value / base if base else None

    def reached(self, figure: float) -> bool:
        """Return whether that is enough."""
        return (self.least is None or figure >= self.least) and (self.most is None or figure <= self.most)

    @property
    def wanted(self) -> str:
        """What is wanted, in words."""
        return f"{self.least:g} or more" if self.least is not None else f"{self.most:g} or less"

    def _one(self, found: Found, where: Mapping[str, Any]) -> float | None:
        rows = [row for row in found.get(self.benchmark, ()) if where.items() <= row.items()] if where else []
        return rows[0][self.column] if rows else None


def at(link: str, **more: Any) -> dict[str, Any]:
    """The driver's row of a link."""
    return {"link": link, "client": "dobot_async", **more}


def half_of(family: str, library: str) -> Target:
    """The end of a motion in half of the time that the vendor's library takes."""
    return Target(
        f"{family}: how late its end is noticed, beside pymycobot",
        "families",
        "late_p50_ms",
        {"family": family, "client": "dobot_async"},
        most=0.5,
        beside={"family": family, "client": library},
    )


def startup(what: str, column: str, most: float) -> Target:
    """The processor's time of a start."""
    return Target(f"{what}, ms of a processor", "startup", column, {"what": what}, most=most)


TARGETS = (
    Target("poses beside the minimal client, 115200 baud", "roundtrip", "ratio", at(SLOW), least=0.99),
    Target("PTP beside the minimal client, 115200 baud", "queue", "ratio", at(SLOW, window=1), least=0.98),
    Target("PTP with a window of 16, of the line's limit", "queue", "of_limit", at(SLOW, window=16), least=0.975),
    Target("end of a motion, median, ms, 115200 baud", "completion", "late_p50_ms", at(SLOW), most=5.0),
    Target("end of a motion, worst of 100, ms, 115200 baud", "completion", "late_worst_ms", at(SLOW), most=7.0),
    Target("CPU per pose beside the minimal client, 115200 baud", "roundtrip", "cpu_ratio", at(SLOW), most=1.3),
    Target("CPU per pose beside the minimal client, pty", "roundtrip", "cpu_ratio", at(FAST), most=2.0),
    Target("poses beside the minimal client, pty", "roundtrip", "ratio", at(FAST), least=0.85),
    Target("PTP beside the minimal client, pty", "queue", "ratio", at(FAST, window=1), least=0.9),
    half_of("myArm", "pymycobot (myArm)"),
    half_of("ultraArm", "pymycobot (ultraArm)"),
    startup("connect to sim:, first motion", "cpu_ms", 60),
    startup("import dobot_async", "over_ms", 15),
    startup("dobot-async --version", "cpu_ms", 150),
)


def verdicts(found: Found) -> list[Row]:
    """Return a row for each target."""
    rows: list[Row] = []
    for target in TARGETS:
        figure = target.figure(found)
        passed = None if figure is None else target.reached(figure)
        rows.append(
            {
                "target": target.name,
                "wanted": target.wanted,
                "reached": None if figure is None else round(figure, 3),
                "verdict": {None: "not measured", True: "pass", False: "FAIL"}[passed],
            }
        )

    return rows
