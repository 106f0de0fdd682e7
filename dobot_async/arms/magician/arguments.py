"""Arguments of the verbs, checked and converted before a byte is sent; what is wrong is told in the caller's words."""

from __future__ import annotations

import math
import operator
from collections.abc import Sequence
from enum import IntEnum
from typing import Any, SupportsFloat, SupportsIndex, TypeVar, cast

from dobot_async.arms.magician import commands as c

__all__ = ["above_zero", "to_address", "to_choice", "to_flag", "to_number", "to_point", "to_whole"]

E = TypeVar("E", bound=IntEnum)
LARGEST = 3.4e38  # within float32, which is what goes over the wire


def to_number(
    name: str, value: SupportsFloat | SupportsIndex, least: float = -LARGEST, most: float = LARGEST, unit: str = ""
) -> float:
    """Return a finite number within a range.

    Raises:
        ValueError: It is outside, or not finite.
        TypeError: It is no number.
    """
    wrong = TypeError(f"{name} must be a number, not {value!r}")
    if not (hasattr(value, "__float__") or hasattr(value, "__index__")):
        raise wrong

    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    except TypeError:  # an array of several
        raise wrong from None

    if not least <= number <= most:
        raise ValueError(f"{name} must be {described(least, most)}{unit and f' {unit}'}, not {value!r}")

    return number


def above_zero(name: str, value: SupportsFloat | SupportsIndex, most: float = LARGEST, unit: str = "") -> float:
    """Return a number above 0; raise ValueError or TypeError for others."""
    number = to_number(name, value, most=most, unit=unit)
    if number <= 0:
        raise ValueError(f"{name} must be above 0{unit and f' {unit}'}, not {value!r}")

    return number


def to_whole(name: str, value: SupportsIndex, least: int, most: int, unit: str = "") -> int:
    """Return a whole number within a range.

    Raises:
        ValueError: It is outside.
        TypeError: It is no whole number.
    """
    try:
        number = operator.index(value)
    except TypeError:
        raise TypeError(f"{name} must be a whole number, not {value!r}") from None

    if not least <= number <= most:
        raise ValueError(f"{name} must be {least} to {most}{unit and f' {unit}'}, not {value!r}")

    return number


def to_address(value: SupportsIndex) -> int:
    """Return the address of a pin, 1 to 20; raise ValueError or TypeError for others."""
    return to_whole("address", value, 1, 20)


def to_flag(name: str, value: Any) -> bool:
    """Return whether a value is truthy, for one that is a single truth: a bool, a number, NumPy's too.

    Raises:
        TypeError: It is none: a text, None, several.
    """
    wrong = TypeError(f"{name} must be True or False, not {value!r}")
    if value is None or not hasattr(cast("type[object]", type(value)), "__bool__"):
        raise wrong

    try:
        return bool(value)
    except ValueError:  # an array of several has no truth
        raise wrong from None


def to_choice(name: str, value: Any, kind: type[E]) -> E:
    """Return a member of an enum, of itself or of its number.

    Raises:
        ValueError: No member has the number.
        TypeError: It is a member of another enum, or no number.
    """
    members = ", ".join(f"{kind.__name__}.{each.name}" for each in kind)
    message = f"{name} must be one of {members}, not {value!r}"
    if isinstance(value, kind):
        return value

    if isinstance(value, IntEnum) or not hasattr(value, "__index__"):
        raise TypeError(message)

    try:
        return kind(operator.index(value))
    except ValueError:
        raise ValueError(message) from None


def to_point(name: str, value: Sequence[SupportsFloat]) -> c.ARCPoint:
    """Return a point of three or four numbers: x, y, z in mm, and r in degrees, 0 unless given.

    Raises:
        ValueError: It has another length, or a number that is none.
        TypeError: It is no sequence of numbers.
    """
    try:
        numbers = list(value)
    except TypeError:
        raise TypeError(f"{name} must be (x, y, z) or (x, y, z, r), not {value!r}") from None

    if not 3 <= len(numbers) <= 4:
        raise ValueError(f"{name} must be (x, y, z) or (x, y, z, r), not {value!r}")

    return c.ARCPoint(*(to_number(f"{axis} of {name}", each) for axis, each in zip("xyzr", numbers, strict=False)))


def described(least: float, most: float) -> str:
    """A range in words."""
    if least <= -LARGEST and most >= LARGEST:
        return "finite"

    if most >= LARGEST:
        return f"at least {least:g}"

    if least <= -LARGEST:
        return f"at most {most:g}"

    return f"{least:g} to {most:g}"
