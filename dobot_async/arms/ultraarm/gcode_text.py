"""A line of G-code without its comments and its checksum."""

from __future__ import annotations

import re
from itertools import pairwise

from dobot_async.program.text import shortened

__all__ = ["bare"]

CHECKSUM = re.compile(r"\*\d+$")
BEGINNING = re.compile(r"[(;]")
IN_NUMBERS = "0123456789."


def bare(line: str) -> str:
    """Return a line without comments and checksum; raise ValueError where a comment cannot be told from the rest."""
    line = line.strip()
    if line == "%":
        return ""

    if "\n" in line or "\r" in line:
        raise ValueError(f"{shortened(line)!r} has a line break in it")

    pieces: list[str] = []
    at = 0
    while (begins := BEGINNING.search(line, at)) and begins[0] == "(":
        ends = line.find(")", begins.end())
        if ends < 0:
            raise ValueError("a comment that begins with ( ends with ) in the same line")

        pieces.append(line[at : begins.start()].strip())
        at = ends + 1

    pieces.append(line[at : begins.start() if begins else None].strip())
    pieces = [piece for piece in pieces if piece]
    for before, after in pairwise(pieces):
        if before[-1] in IN_NUMBERS and after[0] in IN_NUMBERS:
            raise ValueError("there is a comment in the middle of a number")

    return CHECKSUM.sub("", " ".join(pieces)).strip()
