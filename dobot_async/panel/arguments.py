"""The arguments of what a page asks for, each checked in its words before anything is sent."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import Any, TypeGuard, cast

__all__ = ["Arguments"]

LONGEST = 200  # characters


class Arguments:
    """What came with a message; what nobody has asked for is wrong.

    Args:
        given: By name.
    """

    def __init__(self, given: Mapping[str, Any]) -> None:
        self._given = dict(given)

    def number(self, name: str, least: float, most: float, default: float | None = None) -> float:
        """Return a finite number within a range."""
        found = self.number_or_none(name, least, most, default)
        if found is None:
            raise ValueError(f"{name} is missing")

        return found

    def number_or_none(self, name: str, least: float, most: float, default: float | None = None) -> float | None:
        """Return a finite number within a range, or None."""
        value = self._given.pop(name, default)
        return None if value is None else number(name, value, least, most)

    def whole(self, name: str, least: int, most: int, default: int | None = None) -> int:
        """Return a whole number within a range."""
        found = self.number(name, least, most, default)
        if found != int(found):
            raise ValueError(f"{name} must be a whole number, not {found!r}")

        return int(found)

    def numbers(self, name: str, count: Collection[int], *, optional: bool = False) -> list[float] | None:
        """Return a list of finite numbers, of one of the lengths; None if that is optional and it is not given."""
        value = self._given.pop(name, None)
        if value is None and optional:
            return None

        if not is_list(value) or len(value) not in count:
            raise ValueError(f"{name} must be a list of {' or '.join(map(str, count))} numbers")

        return [number(f"each of {name}", each, -math.inf, math.inf) for each in value]

    def flag(self, name: str, default: bool | None = None) -> bool:
        """Return true or false."""
        value = self._given.pop(name, default)
        if not isinstance(value, bool):
            raise ValueError(f"{name} must be true or false")  # noqa: TRY004 - not the caller's type, but a page's

        return value

    def text(self, name: str, default: str | None = None) -> str:
        """Return a short text on one line."""
        value = self._given.pop(name, default)
        if not isinstance(value, str) or len(value) > LONGEST or not value.isprintable():
            raise ValueError(f"{name} must be text on one line, of {LONGEST} characters at most")

        return value

    def word(self, name: str, words: Collection[str], default: str | None = None) -> str:
        """Return one of some words."""
        value = self._given.pop(name, default)
        if value not in words:
            raise ValueError(f"{name} must be one of {', '.join(words)}")

        return str(value)

    def mapping(self, name: str) -> dict[str, Any]:
        """Return an object."""
        value = self._given.pop(name, None)
        if not isinstance(value, dict):
            raise ValueError(f"{name} must be an object")  # noqa: TRY004 - it is not the caller's type, but a page's

        return cast("dict[str, Any]", value)

    def has(self, name: str) -> bool:
        """Return whether something was given."""
        return self._given.get(name) is not None

    def end(self) -> None:
        """Raise ValueError for what nobody has asked for."""
        if self._given:
            raise ValueError(f"there is no {', '.join(sorted(map(repr, self._given)))} here")


def is_list(value: object) -> TypeGuard[list[Any]]:
    """Whether it is a list."""
    return isinstance(value, list)


def number(name: str, value: Any, least: float, most: float) -> float:
    """Return a finite number within a range."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError(f"{name} must be a finite number")

    if not least <= value <= most:
        raise ValueError(f"{name} must be in {least:g} to {most:g}, not {value:g}")

    return float(value)
