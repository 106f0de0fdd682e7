"""Attributes of SVG elements that svgelements would read half of, and say nothing: what is wrong, and in which line."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

__all__ = ["NUMBER", "SHAPES", "Node", "SVGProblem", "check", "length", "numbers_of"]

SHAPES = frozenset({"path", "rect", "circle", "ellipse", "line", "polyline", "polygon"})
PX = {"": 1.0, "px": 1.0, "in": 96.0, "mm": 96 / 25.4, "cm": 960 / 25.4, "pt": 96 / 72, "pc": 16.0, "q": 96 / 101.6}
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
LENGTH = re.compile(rf"\s*({NUMBER})\s*(%|[a-zA-Z]*)\s*")
NUMBERS = re.compile(rf"[\s,]*(?:{NUMBER}[\s,]*)*")
TRANSFORM = re.compile(
    rf"\s*(?:(?:matrix|translate|scale|rotate|skewX|skewY)\s*\(\s*(?:{NUMBER}(?:[a-z%]*)[\s,]*)+\)[\s,]*)*"
)
DATA = re.compile(rf"\s*([MmZzLlHhVvCcSsQqTtAa])|[\s,]*({NUMBER})|(\s+)$")
FLAG = re.compile(r"[\s,]*([01])")
NO_START = "data that does not begin with M"
ARGUMENTS = {"m": 2, "z": 0, "l": 2, "h": 1, "v": 1, "c": 6, "s": 4, "q": 4, "t": 2, "a": 7}


class SVGProblem(Exception):
    """What is wrong, and in which line."""

    def __init__(self, line: int, reason: str) -> None:
        super().__init__(reason)
        self.line = line
        self.reason = reason


@dataclass(slots=True)
class Node:
    """One element: its name without the namespace, its attributes, what is in it, and its line."""

    tag: str
    attributes: dict[str, str]
    line: int
    children: list[Node] = field(default_factory=list["Node"])
    text: str = ""

    def walk(self) -> Iterator[Node]:
        """Yield this and all that is in it."""
        yield self
        for child in self.children:
            yield from child.walk()


def length(node: Node, name: str, value: str, whole: float) -> float:
    """A length in user units; raise Misfit for what is none."""
    match = LENGTH.fullmatch(value)
    unit = match[2].lower() if match else ""
    if match and unit == "%":
        return float(match[1]) / 100 * whole

    if match is None or unit not in PX or not math.isfinite(float(match[1])):
        raise SVGProblem(
            node.line, f"<{node.tag}>: {name}={value!r} is no length (of {', '.join(filter(None, PX))} or %)"
        )

    return float(match[1]) * PX[unit]


def numbers_of(node: Node, name: str, count: int) -> list[float]:
    """So many numbers in an attribute; raise Misfit for others."""
    value = node.attributes[name]
    found = [float(number) for number in re.findall(NUMBER, value)]
    if not NUMBERS.fullmatch(value) or len(found) != count or not all(map(math.isfinite, found)):
        raise SVGProblem(node.line, f"<{node.tag}>: {name}={value!r} must be {count} numbers")

    return found


def check(node: Node) -> None:
    """Raise Misfit for attributes that svgelements would read half of, and say nothing."""
    for name, checks in CHECKS.items():
        if name in node.attributes and (name == "transform" or node.tag in SHAPES):
            checks(node, node.attributes[name])


def check_transform(node: Node, value: str) -> None:
    """Known functions with numbers."""
    if not TRANSFORM.fullmatch(value):
        raise SVGProblem(node.line, f"<{node.tag}>: transform={value!r} is not understood")


def check_points(node: Node, value: str) -> None:
    """Pairs of numbers."""
    count = len(re.findall(NUMBER, value))
    if not NUMBERS.fullmatch(value) or count % 2:
        raise SVGProblem(node.line, f"<{node.tag}>: points must be pairs of numbers, not {shortened(value)}")


def check_data(node: Node, value: str) -> None:
    """Path data: letters, each with a whole number of its arguments."""
    place, letter, count = 0, "", 0
    while place < len(value):
        flag = letter in {"A", "a"} and count % 7 in {3, 4}
        match = (FLAG if flag else DATA).match(value, place)
        if match is None:
            raise data_misfit(node, value, place, "something that is no path data")

        if not flag and match[1]:
            wrong = lacking(letter, count) if letter else "" if match[1] in "Mm" else NO_START
            letter, count = match[1], 0
        elif flag or match[2]:
            wrong = superfluous(letter)
            count += 1
        else:
            wrong = ""

        if wrong:
            raise data_misfit(node, value, place, wrong)

        place = match.end()

    if letter and (wrong := lacking(letter, count)):
        raise data_misfit(node, value, place, wrong)


def data_misfit(node: Node, value: str, place: int, wrong: str) -> SVGProblem:
    """What to raise for path data."""
    rest = shortened(value[place:]) if value[place:].strip() else "the end"
    return SVGProblem(node.line, f"<path>: {wrong} at character {place + 1} of its data: {rest}")


def lacking(letter: str, count: int) -> str:
    """What is wrong with so many numbers behind a letter."""
    needs = ARGUMENTS[letter.lower()]
    return f"{letter} has too few numbers" if needs and (count % needs or not count) else ""


def superfluous(letter: str) -> str:
    """What is wrong with a number behind a letter."""
    if not letter:
        return NO_START

    return "" if ARGUMENTS[letter.lower()] else f"a number where {letter} takes none"


def shortened(text: str) -> str:
    """What is told of a long text."""
    return repr(text if len(text) <= 30 else f"{text[:27]}...")


CHECKS: Mapping[str, Callable[[Node, str], None]] = {
    "transform": check_transform,
    "points": check_points,
    "d": check_data,
}
