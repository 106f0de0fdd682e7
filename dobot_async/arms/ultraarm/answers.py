"""What an ultraArm answers, read and written: keywords with brackets, receipts, the status, errors.

Decoding raises `ProtocolError`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import cache
from typing import Any, Generic, TypeVar

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.ultraarm.frame import bracket, errors
from dobot_async.errors import ProtocolError

__all__ = [
    "RECEIPT",
    "STATUS",
    "Answer",
    "Bracket",
    "Numbers",
    "Receipt",
    "Refusal",
    "Status",
    "with_errors",
]

T = TypeVar("T")
Q = TypeVar("Q")
QUEUE_SIZE = bracket("QUEUE SIZE")
ANGLES, COORDS, ENDSTOP = (
    re.compile(rb"(?:DATA\s*:\s*)?" + bracket(keyword).pattern, re.IGNORECASE)
    for keyword in ("ANGLES", "COORDS", "ENDSTOP")
)
MOVING_END = re.compile(rb"Moving\s*end", re.IGNORECASE)
READ = re.compile(rb"[A-Z0-9]\s*\[|Moving\s*end", re.IGNORECASE)
"""What an answer to a reading holds, and a receipt does not, its QUEUE SIZE left aside."""


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
        endstops: Its home switches.
    """

    queue_size: int
    at_rest: bool
    text: str = ""
    coords: tuple[float, ...] = field(default=(), compare=False)
    angles: tuple[float, ...] = field(default=(), compare=False)
    endstops: tuple[float, ...] = field(default=(), compare=False)


@dataclass(frozen=True, slots=True)
class Refusal:
    """The arm answered with an error."""

    text: str


class ReceiptLayout:
    """The answer to a command: any text that is no reading, another QUEUE SIZE perhaps, and QUEUE SIZE."""

    def encode(self, value: Receipt) -> bytes:
        """Return the text of an answer."""
        head = f"{value.text}\r\n" if value.text else ""
        return f"{head}QUEUE SIZE[{value.queue_size}]".encode("ascii")

    def decode(self, data: bytes) -> Receipt:
        """Read an answer."""
        size, text = closing(data)
        if READ.search(QUEUE_SIZE.sub(b"", text)):
            raise ProtocolError(f"{text!r} answers something else")

        return Receipt(size, text.decode("ascii", "replace"))


class StatusLayout:
    """The answer to M9: "Moving end", or anything else; known by the ENDSTOP that is asked with it."""

    def encode(self, value: Status) -> bytes:
        """Return the text of an answer."""
        said = ["Moving end" if value.at_rest else "", value.text]
        lines = [*said, f"QUEUE SIZE[{value.queue_size}]", "ENDSTOP[0,0,0]"]
        return "\r\n".join(filter(None, lines)).encode("ascii")

    def decode(self, data: bytes) -> Status:
        """Read an answer."""
        if not ENDSTOP.search(data):
            raise ProtocolError(f"{data!r} answers something else")

        size, text = closing(ANGLES.sub(b"", ENDSTOP.sub(b"", data)))
        rest = MOVING_END.sub(b"", text)
        at_rest, text = rest != text, rest.strip()
        readings = (floats(pattern, data) for pattern in (COORDS, ANGLES, ENDSTOP))
        return Status(size, at_rest, text.decode("ascii", "replace"), *readings)


RECEIPT = ReceiptLayout()
STATUS = StatusLayout()


class Bracket(Generic[T]):
    """The answer to a reading: a keyword and what stands in the brackets behind it, whatever the blanks.

    Answers that tell the QUEUE SIZE are those of commands, and are refused here.
    """

    def __init__(self, keyword: str, read: Callable[[list[str]], T], write: Callable[[T], str]) -> None:
        self.keyword = keyword
        self.read = read
        self.write = write
        self.pattern: re.Pattern[bytes] = bracket(keyword)

    def encode(self, value: T) -> bytes:
        """Return keyword and brackets."""
        return f"{self.keyword}[{self.write(value)}]".encode("ascii")

    def decode(self, data: bytes) -> T:
        """Read the last one, for an answer that was given up may stand before it."""
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
        self.kind = kind
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
    """The layout of an answer that may also be an error; it only reads."""

    def __init__(self, inner: Any) -> None:
        self.inner = inner

    def encode(self, value: Any) -> bytes:
        """As the inner layout."""
        data: bytes = self.inner.encode(value)
        return data

    def decode(self, data: bytes) -> T | Refusal:
        """Read an answer; an error where a value is missing, or behind a command, is a Refusal."""
        found = errors(data)
        try:
            value: T = self.inner.decode(data)
        except ProtocolError:
            if not found:
                raise

            return Refusal("; ".join(found))

        return Refusal("; ".join(found)) if found and isinstance(value, Receipt) else value


@cache
def with_errors(command: Command[Q, Any]) -> Command[Q, Any]:
    """Return a row with an answer that may also be an error."""
    return replace(command, reply=Answer(command.reply))


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
