"""The options behind the "?" of a URL: what each takes, and what is wrong with one."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any
from urllib.parse import SplitResult, parse_qsl

__all__ = ["Option", "number", "options", "words"]

PLAIN_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


@dataclass(frozen=True, slots=True)
class Option:
    """What an option of a URL takes.

    Attributes:
        convert: Makes its value of the text; raises ValueError if it is none.
        expected: What the text is to be, with its unit and range.
        secret: Whether the text is kept out of messages.
    """

    convert: Callable[[str], Any]
    expected: str
    secret: bool = False


def number(kind: type[int | float], unit: str, *, least: float, most: float) -> Option:
    """Return an option that takes a number of a unit, within a range."""

    def convert(text: str) -> float:
        value = kind(text) if PLAIN_NUMBER.fullmatch(text) else math.nan
        if not least <= value <= most:
            raise ValueError

        return value

    return Option(convert, f"{unit}, {'a whole number' if kind is int else 'a number'} from {least:g} to {most:.10g}")


def options(url: SplitResult, known: Mapping[str, Option | Callable[[str], Any]]) -> dict[str, Any]:
    """Return the options behind the "?" of a URL, converted.

    Args:
        url: Where they are.
        known: What each option takes, by its name.

    Raises:
        ValueError: One is unknown, given twice, or not as expected. The message names it.
    """
    if url.fragment:
        raise ValueError("what is behind a # would be left out; a # in a URL is written %23")

    found: dict[str, Any] = {}
    for name, text in parse_qsl(url.query, keep_blank_values=True, strict_parsing=bool(url.query)):
        if name not in known:
            raise ValueError(f"unknown option {name!r}; known: {', '.join(known) or 'none'}")

        if name in found:
            raise ValueError(f"option {name} is given twice")

        option = known[name]
        if not isinstance(option, Option):
            option = Option(option, f"a value of type {option.__name__}")

        try:
            found[name] = option.convert(text)
        except ValueError:
            shown = name if option.secret else f"{name}={text!r}"
            raise ValueError(f"{shown}: expected {option.expected}") from None

    return found


def words(text: str) -> str:
    """Return a text of an option that may be anything but empty; raise ValueError if it is."""
    if not text:
        raise ValueError

    return text
