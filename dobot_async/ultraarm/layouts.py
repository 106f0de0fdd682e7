"""How values lie in lines: letters with numbers in a request, keywords with brackets in an answer.

Numbers are written with at most two decimals, rounded, and never with an exponent: the arm would read the E of 1e-07
as its fourth axis. Encoding raises `ValueError` or `TypeError`, decoding `ProtocolError`.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable
from dataclasses import dataclass, field, fields, is_dataclass
from typing import Any, Generic, TypeVar, Union, get_args, get_origin, get_type_hints

from dobot_async.errors import ProtocolError
from dobot_async.layouts import NOTHING
from dobot_async.ultraarm.frame import bracket, errors, split_words

__all__ = [
    "AND_ANGLES",
    "RECEIPT",
    "STATUS",
    "Answer",
    "Bracket",
    "Letter",
    "Numbers",
    "Receipt",
    "Refusal",
    "Relative",
    "Status",
    "Words",
    "number",
]

T = TypeVar("T")
QUEUE_SIZE = bracket("QUEUE SIZE")
ANGLES, COORDS, ENDSTOP = (
    re.compile(rb"(?:DATA\s*:\s*)?" + bracket(keyword).pattern, re.IGNORECASE)
    for keyword in ("ANGLES", "COORDS", "ENDSTOP")
)
MOVING_END = re.compile(rb"Moving\s*end", re.IGNORECASE)
READ = re.compile(rb"[A-Z0-9]\s*\[|Moving\s*end", re.IGNORECASE)
"""What an answer to a reading holds, and a receipt does not, its QUEUE SIZE left aside."""


def number(value: float) -> str:
    """Returns a number as it is written on a line: fixed-point, at most two decimals."""
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
        """Returns letter and number; raises ValueError or TypeError with the field's name."""
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
        """Returns what a number on a line says."""
        try:
            return int(text) if self.whole else float(text)
        except ValueError:
            raise ProtocolError(f"{self.letter}{text} is no {'whole ' * self.whole}number") from None


@dataclass(frozen=True, slots=True)
class Field:
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
        self.fields = [field_of(each.name, hints[each.name]) for each in fields(kind)]

    def encode(self, value: T) -> bytes:
        """Returns the words, each after a blank."""
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
        """Reads words in any order and whatever their blanks; a letter twice counts as the last one."""
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


def build(field: Field, text: str) -> Any:
    """The value of a field."""
    try:
        return field.kind(field.letter.read(text))
    except ValueError as error:
        raise ProtocolError(str(error)) from None


def field_of(name: str, annotation: Any) -> Field:
    """Reads an annotation, such as `Annotated[float, Letter("X")] | None`."""
    choices = get_args(annotation) if get_origin(annotation) is Union else (annotation,)
    kinds = [each for each in choices if each is not type(None)]
    kind, letter = get_args(kinds[0])
    return Field(name, letter, kind, optional=len(kinds) < len(choices))


class Relative(Generic[T]):
    """A motion between the words that make it relative and absolute again: one write, three lines."""

    def __init__(self, words: Words[T]) -> None:
        self.words = words

    def encode(self, value: T) -> bytes:
        """Returns what stands behind G91."""
        return b"\rG0" + self.words.encode(value) + b"\rG90"

    def decode(self, data: bytes) -> T:
        """An arm reads three lines, never this."""
        if not (data.startswith(b"\rG0") and data.endswith(b"\rG90")):
            raise ProtocolError(f"{data!r} is no relative motion")

        return self.words.decode(data[3:-4])


@dataclass(frozen=True, slots=True)
class Receipt:
    """What the arm says to a command.

    Attributes:
        queue_size: How many commands wait in the arm's queue.
        text: What else it said, on one line; firmware differs in that.
    """

    queue_size: int
    text: str = ""


@dataclass(frozen=True, slots=True)
class Status:
    """How far the arm is.

    Attributes:
        queue_size: How many commands wait in its queue.
        at_rest: Whether nothing moves.
        text: What else it said.
        coords: Where it is, as it said with that: x, y, z and e; empty where it did not.
        angles: Its joints, if they were asked as well.
    """

    queue_size: int
    at_rest: bool
    text: str = ""
    coords: tuple[float, ...] = field(default=(), compare=False)
    angles: tuple[float, ...] = field(default=(), compare=False)


@dataclass(frozen=True, slots=True)
class Refusal:
    """The arm answered with an error."""

    text: str


class ReceiptLayout:
    """The answer to a command: any text that is no reading, another QUEUE SIZE perhaps, and QUEUE SIZE."""

    def encode(self, value: Receipt) -> bytes:
        """Returns the text of an answer."""
        head = f"{value.text}\r\n" if value.text else ""
        return f"{head}QUEUE SIZE[{value.queue_size}]".encode("ascii")

    def decode(self, data: bytes) -> Receipt:
        """Reads an answer."""
        size, text = closing(data)
        if READ.search(QUEUE_SIZE.sub(b"", text)):
            raise ProtocolError(f"{text!r} answers something else")

        return Receipt(size, text.decode("ascii", "replace"))


class StatusLayout:
    """The answer to M9: "Moving end", or anything else; known by the ENDSTOP that is asked with it."""

    def encode(self, value: Status) -> bytes:
        """Returns the text of an answer."""
        said = ["Moving end" if value.at_rest else "", value.text]
        lines = [*said, f"QUEUE SIZE[{value.queue_size}]", "ENDSTOP[0,0,0]"]
        return "\r\n".join(filter(None, lines)).encode("ascii")

    def decode(self, data: bytes) -> Status:
        """Reads an answer."""
        if not ENDSTOP.search(data):
            raise ProtocolError(f"{data!r} answers something else")

        size, text = closing(ANGLES.sub(b"", ENDSTOP.sub(b"", data)))
        rest = MOVING_END.sub(b"", text)
        at_rest, text = rest != text, rest.strip()
        return Status(size, at_rest, text.decode("ascii", "replace"), floats(COORDS, data), floats(ANGLES, data))


class AndAngles:
    """What stands behind M9 to ask for the joints as well: one write, one answer more."""

    def encode(self, value: None) -> bytes:
        """Returns M12."""
        return NOTHING.encode(value) + b"\rM12"

    def decode(self, data: bytes) -> None:
        """An arm reads two lines, never this."""
        return NOTHING.decode(data.removeprefix(b"\rM12"))


RECEIPT = ReceiptLayout()
STATUS = StatusLayout()
AND_ANGLES = AndAngles()


class Bracket(Generic[T]):
    """The answer to a reading: a keyword and what stands in the brackets behind it, whatever the blanks.

    Answers that tell the QUEUE SIZE are those of commands, and are refused here.
    """

    def __init__(self, keyword: str, read: Callable[[list[str]], T], write: Callable[[T], str]) -> None:
        self.keyword = keyword
        self.read = read
        self.write = write
        self.pattern = bracket(keyword)

    def encode(self, value: T) -> bytes:
        """Returns keyword and brackets."""
        return f"{self.keyword}[{self.write(value)}]".encode("ascii")

    def decode(self, data: bytes) -> T:
        """Reads the last one, for an answer that was given up may stand before it."""
        found = self.pattern.findall(data)
        if not found or QUEUE_SIZE.search(data):
            raise ProtocolError(f"there is no {self.keyword}[...] in {data!r}")

        inside = found[-1].decode("ascii", "replace")
        try:
            return self.read([each.strip() for each in inside.split(",")])
        except (ValueError, TypeError):
            raise ProtocolError(f"{self.keyword}[{inside}] cannot be read") from None


class Numbers(Bracket[T]):
    """A dataclass of numbers in brackets, in its order; of what the arm adds behind them nothing is read."""

    def __init__(self, keyword: str, kind: type[T], convert: Callable[[str], Any] = float) -> None:
        assert is_dataclass(kind)
        names = [each.name for each in fields(kind)]

        def read(texts: list[str]) -> T:
            values = [convert(text) for text in texts[: len(names)]]
            if not all(map(math.isfinite, values)):
                raise ValueError(texts)

            return kind(*values)

        def write(value: T) -> str:
            numbers = [getattr(value, name) for name in names]
            return ",".join(str(each) if convert is int else f"{each:.2f}" for each in numbers)

        super().__init__(keyword, read, write)


class Answer(Generic[T]):
    """The layout of an answer that may also be an error; it only reads.

    Attributes:
        over: Set when it is known that the answer cannot come any more: then nothing is read as it.
    """

    def __init__(self, inner: Any) -> None:
        self.inner = inner
        self.over = False

    def encode(self, value: Any) -> bytes:
        """As the inner layout."""
        data: bytes = self.inner.encode(value)
        return data

    def decode(self, data: bytes) -> T | Refusal:
        """Reads an answer; an error where a value is missing, or behind a command, is a Refusal."""
        if self.over:
            raise ProtocolError("its request was answered, or lost, before this")

        found = errors(data)
        try:
            value: T = self.inner.decode(data)
        except ProtocolError:
            if not found:
                raise

            return Refusal("; ".join(found))

        return Refusal("; ".join(found)) if found and isinstance(value, Receipt) else value


def floats(pattern: re.Pattern[bytes], data: bytes) -> tuple[float, ...]:
    """The numbers in the last brackets of a kind; none where they cannot be read."""
    *_, last = (b"", *pattern.findall(data))
    try:
        values = tuple(float(each) for each in last.split(b","))
    except ValueError:
        return ()

    return values if all(map(math.isfinite, values)) else ()


def closing(data: bytes) -> tuple[int, bytes]:
    """The last size of the queue that an answer tells, and the text beside it and the COORDS that close the answer."""
    found = list(QUEUE_SIZE.finditer(data))
    if not found:
        raise ProtocolError("; ".join(errors(data)) or f"there is no QUEUE SIZE in {data!r}")

    last = found[-1]
    try:
        size = int(last[1])
    except ValueError:
        raise ProtocolError(f"QUEUE SIZE[{last[1]!r}] cannot be read") from None

    text = data[: last.start()] + COORDS.sub(b"", data[last.end() :])
    return size, b" ".join(text.split())
