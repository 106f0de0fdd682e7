"""How values lie in requests: letters with numbers. What is answered is in `answers`.

Numbers are written with at most two decimals, rounded, and never with an exponent: the arm would read the E of 1e-07
as its fourth axis. Encoding raises `ValueError` or `TypeError`, decoding `ProtocolError`.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any, Generic, TypeVar, Union, get_args, get_origin, get_type_hints

from dobot_async._core.protocol.layouts import NOTHING
from dobot_async.arms.ultraarm.frame import split_words
from dobot_async.errors import ProtocolError

__all__ = ["Also", "Letter", "Relative", "Whole", "Words", "number"]

T = TypeVar("T")


def number(value: float) -> str:
    """Return a number as it is written on a line: fixed-point, at most two decimals."""
    text = f"{value:.2f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


@dataclass(frozen=True, slots=True)
class Letter:
    """The letter of a field, and the range that may be sent; `whole` fields take whole numbers alone."""

    letter: str
    low: float = -9999.0
    high: float = 9999.0
    whole: bool = False

    def write(self, name: str, value: Any) -> str:
        """Return letter and number; raise ValueError or TypeError with the field's name."""
        if not hasattr(value, "__index__" if self.whole else "__float__"):
            raise TypeError(f"{name} must be a {'whole number' if self.whole else 'number'}, not {value!r}")

        try:
            found: float = operator.index(value) if self.whole else float(value)
        except OverflowError:
            found = math.inf

        if not self.low <= found <= self.high:
            raise ValueError(f"{name} must be in {self.low:g} to {self.high:g}, not {value!r}")

        return self.letter + number(found)

    def read(self, text: str) -> float:
        """Return what a number on a line says."""
        try:
            return int(text) if self.whole else float(text)
        except ValueError:
            raise ProtocolError(f"{self.letter}{text} is no {'whole ' * self.whole}number") from None


@dataclass(frozen=True, slots=True)
class TextField:
    """One annotated field of a request."""

    name: str
    letter: Letter
    kind: Callable[[Any], Any]
    optional: bool


class Words(Generic[T]):
    """A dataclass whose fields are letters: ` X200 Y0 F100`. A field that may be None is left out where it is.

    On a line `joint` of `JointMove` is J1: each annotation is `Annotated[float, Letter("X")]`, or that `| None`.
    """

    def __init__(self, kind: type[T]) -> None:
        assert is_dataclass(kind)
        self.kind = kind
        hints = get_type_hints(kind, include_extras=True)
        self.fields: list[TextField] = [field_of(each.name, hints[each.name]) for each in fields(kind)]

    def encode(self, value: T) -> bytes:
        """Return the words, each after a blank."""
        if not isinstance(value, self.kind):
            raise TypeError(f"expected {self.kind.__name__}, not {value!r}")

        found = [(field, getattr(value, field.name)) for field in self.fields]
        words = [
            f" {field.letter.write(field.name, given)}"
            for field, given in found
            if not (field.optional and given is None)
        ]
        return "".join(words).encode("ascii")

    def decode(self, data: bytes) -> T:
        """Read words in any order and whatever their blanks; a letter twice counts as the last one."""
        try:
            given = dict(split_words(data))
        except ValueError as error:
            raise ProtocolError(str(error)) from None

        values: dict[str, Any] = {}
        for each in self.fields:
            text = given.pop(each.letter.letter, None)
            if text is not None:
                values[each.name] = build(each, text)
            elif not each.optional:
                raise ProtocolError(f"{each.letter.letter} is missing in {data!r}")

        if given:
            raise ProtocolError(f"{data!r} has words that mean nothing: {', '.join(given)}")

        return self.kind(**values)


def build(field: TextField, text: str) -> Any:
    """The value of a field."""
    try:
        return field.kind(field.letter.read(text))
    except ValueError as error:
        raise ProtocolError(str(error)) from None


def field_of(name: str, annotation: Any) -> TextField:
    """Read an annotation, such as `Annotated[float, Letter("X")] | None`."""
    choices = get_args(annotation) if get_origin(annotation) is Union else (annotation,)
    kinds = [each for each in choices if each is not type(None)]
    kind, letter = get_args(kinds[0])
    return TextField(name, letter, kind, optional=len(kinds) < len(choices))


class Whole(Words[T]):
    """Words of which the arm knows whole numbers alone: what stands behind the point is not sent."""

    def encode(self, value: T) -> bytes:
        """Return the words, rounded down."""
        super().encode(value)
        whole: Any = {field.name: math.floor(getattr(value, field.name)) for field in self.fields}
        return super().encode(replace(value, **whole))  # type: ignore[type-var] # a record is a dataclass

    def decode(self, data: bytes) -> T:
        """Read whole numbers."""
        value = super().decode(data)
        if any(getattr(value, field.name) % 1 for field in self.fields):
            raise ProtocolError(f"{data!r} is no whole number")

        return value


class Relative(Generic[T]):
    """A motion between the words that make it relative and absolute again: one write, three lines."""

    def __init__(self, words: Words[T]) -> None:
        self.words = words

    def encode(self, value: T) -> bytes:
        """Return what stands behind G91."""
        return b"\rG0" + self.words.encode(value) + b"\rG90"

    def decode(self, data: bytes) -> T:
        """An arm reads three lines, never this."""
        if not (data.startswith(b"\rG0") and data.endswith(b"\rG90")):
            raise ProtocolError(f"{data!r} is no relative motion")

        return self.words.decode(data[3:-4])


class Also:
    """What stands behind M9 to say one word more with it: one write, one answer more."""

    def __init__(self, word: str) -> None:
        self._more = b"\r" + word.encode("ascii")

    def encode(self, value: None) -> bytes:
        """Return the word."""
        return NOTHING.encode(value) + self._more

    def decode(self, data: bytes) -> None:
        """An arm reads two lines, never this."""
        return NOTHING.decode(data.removeprefix(self._more))
