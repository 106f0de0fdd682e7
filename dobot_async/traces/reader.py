"""A trace read back: all parts of it that are left, checked, as lines in their order."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import cast

from dobot_async.traces.file import VERSION, part_path

__all__ = ["Trace", "TraceLine", "TraceProblem", "read_trace"]

LONGEST = 200  # characters of a line that are shown


class TraceProblem(ValueError):
    """A file is no trace, or one that this version cannot read; the message has the file and the line."""


@dataclass(frozen=True, slots=True)
class TraceLine:
    """One thing that happened.

    Attributes:
        kind: "connection", "frame", "junk", "state", "event", "motion" or "end".
        t: Seconds since the trace began, by a clock that nobody sets.
        time: Seconds since 1970.
        arm: Of several arms, whose it is; "" where there is one.
        fields: All else, as docs/trace.md says.
    """

    kind: str
    t: float
    time: float
    arm: str
    fields: Mapping[str, object]

    def text(self, name: str) -> str:
        """Return a field that is a text, "" where it is none or not there."""
        value = self.fields.get(name)
        return value if isinstance(value, str) else ""

    def number(self, name: str, otherwise: float = 0.0) -> float:
        """Return a field that is a number.

        Args:
            name: Of the field.
            otherwise: What is returned where it is no number, or not there.
        """
        value = self.fields.get(name)
        return float(value) if isinstance(value, (int, float)) else otherwise

    def numbers(self, name: str) -> tuple[float, ...]:
        """Return a field that is a row of numbers, () where it is none or not there."""
        value = self.fields.get(name)
        found = cast("list[object]", value) if isinstance(value, list) else []
        return tuple(float(each) for each in found if isinstance(each, (int, float)))

    @property
    def outgoing(self) -> bool:
        """Whether it went to the arm."""
        return self.fields.get("direction") == "out"


@dataclass(frozen=True, slots=True)
class Trace:
    """What was recorded.

    Attributes:
        path: Of its newest part.
        software: What has written it.
        whole: Whether its beginning is there, and was not rotated away.
        lines: What happened.
        arms: The names of the arms in it; ("",) where they have none.
    """

    path: Path
    software: str
    whole: bool
    lines: tuple[TraceLine, ...]

    @property
    def arms(self) -> tuple[str, ...]:
        """The names of the arms."""
        return tuple(dict.fromkeys(line.arm for line in self.lines if line.kind == "connection"))

    def of(self, arm: str | None, connection: int = 1) -> Trace:
        """Return what belongs to one connection of an arm.

        Args:
            arm: Its name; None where there is only one.
            connection: Which of its connections, from 1.

        Raises:
            ValueError: There is none such.
        """
        names = self.arms
        if arm is None and len(names) > 1:
            raise ValueError(f"{self.path} has several arms, {', '.join(names)}: say which, with arm=")

        name = arm if arm is not None else next(iter(names), "")
        lines = [line for line in self.lines if line.arm == name]
        begins = [place for place, line in enumerate(lines) if line.kind == "connection"]
        if not 1 <= connection <= len(begins):
            raise ValueError(f"{self.path} has {len(begins)} connections of arm {name!r}, and no number {connection}")

        end = begins[connection] if connection < len(begins) else len(lines)
        return Trace(self.path, self.software, self.whole, tuple(lines[begins[connection - 1] : end]))


def read_trace(path: str | os.PathLike[str]) -> Trace:
    """Read a trace with all of its parts.

    Args:
        path: Of its newest part, as it was given to `connect(record=)` or `--trace`.

    Raises:
        TraceProblem: It is no trace, or of a later version.
        OSError: It cannot be read.
    """
    newest = Path(path)
    head, lines = read_part(newest)
    parts = [(head, lines)]
    number = 1
    while (older := part_path(newest, number)).is_file():
        found = read_part(older)
        if (found[0].text("run"), found[0].number("part")) != (head.text("run"), parts[0][0].number("part") - 1):
            break  # of an earlier trace in a file of the same name

        parts.insert(0, found)
        number += 1

    every = [line for place, (_, lines) in enumerate(parts) for line in lines if not (place and continued(line))]
    return Trace(newest, head.text("software"), parts[0][0].number("part") == 1, tuple(every))


def continued(line: TraceLine) -> bool:
    """Whether a line only repeats that there is a connection, for who has a later part alone."""
    return line.kind == "connection" and bool(line.fields.get("continued"))


def read_part(path: Path) -> tuple[TraceLine, list[TraceLine]]:
    """Return the first line of a part, and all others."""
    lines = list(parsed(path))
    if not lines or lines[0].kind != "trace":
        raise TraceProblem(f"{path} is no trace: its first line does not say so")

    version = lines[0].number("version")
    if version != VERSION:
        raise TraceProblem(f"{path} is a trace of version {version:g}; this reads version {VERSION}")

    return lines[0], lines[1:]


def parsed(path: Path) -> Iterator[TraceLine]:
    """Yield the lines of a file; half a line at its end, of a program that was killed, is left out."""
    with path.open("rb") as file:
        for number, raw in enumerate(file, 1):
            try:
                yield line_of(json.loads(raw))
            except (ValueError, TypeError, RecursionError):
                if raw.endswith(b"\n"):
                    shown = raw[:LONGEST].decode("utf-8", "replace").strip()
                    raise TraceProblem(f"{path}: line {number} is no line of a trace: {shown!r}") from None


def line_of(found: object) -> TraceLine:
    """Return a line; raise ValueError or TypeError for what is none."""
    if not isinstance(found, dict):
        raise TypeError

    fields = cast("dict[str, object]", found)
    kind, t, time = fields.pop("kind", None), fields.pop("t", None), fields.pop("time", None)
    arm = fields.pop("arm", "")
    if not (isinstance(kind, str) and isinstance(t, (int, float)) and isinstance(time, (int, float))):
        raise TypeError

    if not isinstance(arm, str):
        raise TypeError

    return TraceLine(kind, float(t), float(time), arm, fields)
