"""The text of programs: where its lines end, what its numbers are, and how much of it goes into a message."""

from __future__ import annotations

import math
import re
from pathlib import Path

__all__ = ["LARGEST", "lines_in", "parse_number", "read_text", "shortened"]

LARGEST = 64 << 20
"""Bytes of a file that are read: what has more is no program."""

SHOWN = 60
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?", re.ASCII)


def read_text(source: Path | bytes) -> str:
    """Return UTF-8 text, without its byte order mark.

    Raises:
        ValueError: It is no such text, or too large.
        OSError: The file cannot be read.
    """
    if isinstance(source, Path):
        with source.open("rb") as file:
            source = file.read(LARGEST + 1)

    if len(source) > LARGEST:
        raise ValueError(f"more than {LARGEST >> 20} MB of text")

    try:
        return source.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"not UTF-8 text: {error.reason} at byte {error.start}") from None


def lines_in(text: str) -> list[str]:
    r"""Return the lines of a text. They end at \n and \r\n alone: nothing else ends a comment."""
    lines = text.split("\n")
    return [line.removesuffix("\r") for line in (lines if lines[-1] else lines[:-1])]


def parse_number(text: str) -> float:
    """Return the number that ASCII digits stand for; raise ValueError for anything else, and for what is not finite."""
    value = float(text) if NUMBER.fullmatch(text) else math.nan
    if not math.isfinite(value):
        raise ValueError(text)

    return value


def shortened(text: str, length: int = SHOWN) -> str:
    """Return text for a message: on one line, printable, and not endless."""
    found = "".join(each if each.isprintable() else " " for each in text[: length + 1])
    return found if len(text) <= length else f"{found[: length - 3]}..."
