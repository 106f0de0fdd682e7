"""What stands in the tables of a TOML file; errors say where it is wrong."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from typing import Any, cast

__all__ = ["at", "known", "number", "span", "sub", "tables", "text"]


def at(place: str, read: Callable[[Mapping[str, Any]], Any], table: Mapping[str, Any]) -> Any:
    """Reads a table; errors get its place."""
    try:
        return read(table)
    except ValueError as error:
        raise ValueError(f"{place}: {error}") from None


def known(table: Mapping[str, Any], names: Collection[str], what: str) -> None:
    """Raises ValueError for a key that there is not."""
    for name in table:
        if name not in names:
            raise ValueError(f"{what} has no {name!r}; there are: {', '.join(names)}")


def tables(value: Any, name: str) -> Mapping[str, Mapping[str, Any]]:
    """A table of tables."""
    found = cast("dict[str, Any]", value) if isinstance(value, dict) else {"": value}
    if not all(isinstance(each, dict) for each in found.values()):
        raise ValueError(f"{name}: expected tables, such as [{name}.NAME]")

    return found


def sub(table: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    """A table in a table; empty if it is not there."""
    value = table.get(name, {})
    if isinstance(value, dict):
        return cast("dict[str, Any]", value)

    raise ValueError(f"{name}: expected a table, such as {name} = {{ ... }}, not {value!r}")


def text(table: Mapping[str, Any], name: str, default: str | None = None) -> str:
    """A text; raises ValueError if it is missing and there is no default."""
    value = table.get(name, default)
    if not isinstance(value, str) or not value:
        raise ValueError(f"{name}: {'it is missing' if value is None else f'expected a text, not {value!r}'}")

    return value


def number(table: Mapping[str, Any], name: str, default: float | None = None) -> float:
    """A number; raises ValueError if it is missing and there is no default."""
    value = table.get(name, default)
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        try:
            return float(value)
        except OverflowError:
            raise ValueError(f"{name}: the number is too large") from None

    raise ValueError(f"{name}: {'it is missing' if value is None else f'expected a number, not {value!r}'}")


def span(table: Mapping[str, Any], name: str) -> tuple[float, float]:
    """Two numbers."""
    value: list[Any] = table[name]
    if not isinstance(value, list) or len(value) != 2:
        raise ValueError(f"{name}: expected [lowest, highest], not {value!r}")

    low, high = (number({name: each}, name) for each in value)
    return low, high
