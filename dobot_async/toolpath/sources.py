"""What all readers of files share: where the bytes come from, and how fine curves are read."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import IO

from dobot_async._core.util.arguments import to_float

__all__ = ["FINE", "Source", "check_tolerance", "content", "name_of"]

Source = str | PathLike[str] | IO[str] | IO[bytes]
"""The path of a file, or a stream that is read to its end."""

FINE = 0.02
"""mm by which straight ways may miss a curve: a tenth of what a pen draws."""


def content(source: Source) -> bytes:
    """Return the bytes of a file or a stream."""
    if isinstance(source, (str, PathLike)):
        return Path(source).read_bytes()

    data = source.read()
    return data.encode() if isinstance(data, str) else data


def name_of(source: Source) -> str:
    """Return what a source is called in messages: the file's name, or the name of a stream that has one."""
    if isinstance(source, (str, PathLike)):
        return Path(source).name

    name = getattr(source, "name", "")
    return Path(name).name if isinstance(name, str) else ""


def check_tolerance(tolerance: float) -> None:
    """Raise ValueError for a tolerance that no curve can keep."""
    if not 1e-4 <= to_float(tolerance, "tolerance") < float("inf"):
        raise ValueError(f"tolerance must be 0.0001 mm or more and finite, not {tolerance!r}")
