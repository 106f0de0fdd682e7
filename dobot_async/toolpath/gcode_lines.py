"""Lines of G-code as words, and what a whole program tells of its tool before it runs."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

__all__ = ["INCH", "GCodeWords", "WrongLine", "lines_of", "low_of", "switched"]

LONGEST = 1000  # characters of a line
WORD = re.compile(r"\s*([A-Za-z])\s*([-+]?(?:\d+\.?\d*|\.\d+))")
COMMENT = re.compile(r"\([^()]*\)|;.*")
NOTHING = re.compile(r"\s*(?:%.*|\$.*|/.*)?\s*")
INCH = 25.4


@dataclass(frozen=True, slots=True)
class GCodeWords:
    """One line: its number, and its words in order."""

    number: int
    words: tuple[tuple[str, float], ...]

    def get(self, letter: str) -> float | None:
        """The number behind a letter, None if it is not there."""
        return next((number for word, number in self.words if word == letter), None)


class WrongLine(Exception):
    """A line that is wrong, by its number."""

    def __init__(self, number: int, reason: str) -> None:
        super().__init__(reason)
        self.number = number
        self.reason = reason


def lines_of(text: str) -> Iterator[GCodeWords]:
    """The lines that say something, up to the end of the program (M2, M30)."""
    for number, given in enumerate(text.split("\n"), 1):
        if len(given) > LONGEST:
            raise WrongLine(number, f"more than {LONGEST} characters")

        line = COMMENT.sub("", given.removesuffix("\r")).partition("*")[0]
        words: list[tuple[str, float]] = []
        place = 0
        while place < len(line) and not NOTHING.fullmatch(line, place):
            match = WORD.match(line, place)
            if match is None:
                raise WrongLine(number, f"column {place + 1}: {line[place:].strip()[:20]!r} is no word of G-code")

            words.append((match[1].upper(), float(match[2])))
            place = match.end()

        if any(word in {("M", 2.0), ("M", 30.0)} for word in words):
            return

        if words:
            yield GCodeWords(number, tuple(word for word in words if word[0] != "N"))


def switched(program: list[GCodeWords]) -> bool:
    """Whether a program switches a laser, a spindle or a servo on."""
    return any(letter == "M" and number in {3, 4, 106} for line in program for letter, number in line.words)


def low_of(program: list[GCodeWords]) -> float | None:
    """The middle of the heights of a program, mm, None if there is but one."""
    unit, absolute, z = 1.0, True, 0.0
    heights: set[float] = set()
    for line in program:
        for letter, number in line.words:
            if letter == "G" and number in {20, 21}:
                unit = INCH if number == 20 else 1.0
            elif letter == "G" and number in {90, 91}:
                absolute = number == 90

        given = line.get("Z")
        if given is not None:
            z = given * unit if absolute else z + given * unit
            heights.add(z)

    return (min(heights) + max(heights)) / 2 if len(heights) > 1 else None
