"""Declarative binary layouts, and `Command`, the row type of every command table.

A layout turns a value into bytes and bytes into a value, and refuses what does not fit before a byte is sent.
A parameter type is a frozen dataclass whose annotations lie on the wire in their order, with nothing between them:

    @dataclass(frozen=True, slots=True)
    class IOPWM:                          Record(IOPWM)
        address: IOAddress                u8, 1 to 20
        frequency: f32                    f32
        duty_cycle: f32                   f32          = 9 bytes

A last field may carry a layout of its own, `Annotated[bytes, Bytes()]`, which takes whatever follows the others.

Encoding raises `ValueError` (out of range, not finite, too long) or `TypeError` (not a number, not the dataclass).
Decoding raises `ProtocolError`, whatever the bytes.
"""

from __future__ import annotations

import enum
import math
import operator
import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, is_dataclass
from typing import Annotated, Any, Generic, Protocol, TypeVar, cast, get_args, get_origin, get_type_hints

from dobot_async.errors import ProtocolError

__all__ = [
    "Command",
    "Layout",
    "Number",
    "Queueing",
    "Record",
    "Scalar",
    "f32",
    "f32x2",
    "f32x4",
    "f32x8",
    "flag",
    "i32",
    "u8",
    "u8x4",
    "u16",
    "u32",
    "u32x3",
    "u64",
]

T = TypeVar("T")
V = TypeVar("V")
Q = TypeVar("Q")
R = TypeVar("R")

FLOAT32_MAX = struct.unpack("<f", b"\xff\xff\x7f\x7f")[0]


class Layout(Protocol[T]):
    """How one value lies on the wire."""

    def encode(self, value: T) -> bytes:
        """Returns the bytes of a value; raises ValueError or TypeError where it does not fit."""
        ...

    def decode(self, data: bytes) -> T:
        """Returns the value of exactly these bytes; raises ProtocolError where they are none."""
        ...


@dataclass(frozen=True, slots=True)
class Scalar:
    """One number, or a row of `count` equal ones, in the alphabet of `struct`, with the range that may be sent.

    The range is never wider than what the code can carry. What an arm reports is not held against it: a reading
    outside of it is still a reading.
    """

    code: str
    low: float = -math.inf
    high: float = math.inf
    count: int = 1

    def __post_init__(self) -> None:
        low, high = capacity(self.code)
        object.__setattr__(self, "low", max(self.low, low))
        object.__setattr__(self, "high", min(self.high, high))

    def check(self, name: str, value: Any) -> Any:
        """Returns what `struct` is to pack; `name` is for the message."""
        number_of = float if self.code == "f" else operator.index
        if not hasattr(value, "__float__" if self.code == "f" else "__index__"):
            raise TypeError(f"{name} must be a {'number' if self.code == 'f' else 'whole number'}, not {value!r}")

        try:
            number = number_of(value)
        except OverflowError:
            number = math.inf

        if not self.low <= number <= self.high:
            raise ValueError(f"{name} must be in {self.low} to {self.high}, not {value!r}")

        return number


def capacity(code: str) -> tuple[float, float]:
    """The least and the greatest number that a code of `struct` can carry."""
    if code == "f":
        return -FLOAT32_MAX, FLOAT32_MAX

    bits = 8 * struct.calcsize(f"<{code}")
    return (-(1 << bits - 1), (1 << bits - 1) - 1) if code.islower() else (0, (1 << bits) - 1)


u8 = Annotated[int, Scalar("B")]
u16 = Annotated[int, Scalar("H")]
u32 = Annotated[int, Scalar("I")]
u64 = Annotated[int, Scalar("Q")]
i32 = Annotated[int, Scalar("i")]
f32 = Annotated[float, Scalar("f")]
flag = Annotated[bool, Scalar("B", 0, 1)]
u8x4 = Annotated[tuple[int, int, int, int], Scalar("B", count=4)]
u32x3 = Annotated[tuple[int, int, int], Scalar("I", count=3)]
f32x2 = Annotated[tuple[float, float], Scalar("f", count=2)]
f32x4 = Annotated[tuple[float, float, float, float], Scalar("f", count=4)]
f32x8 = Annotated[tuple[float, ...], Scalar("f", count=8)]


@dataclass(frozen=True, slots=True)
class Field:
    """One annotated field: what it is on the wire, and the Python type that its numbers become."""

    name: str
    scalar: Scalar
    kind: type[bool | enum.IntEnum] | None

    @classmethod
    def of(cls, name: str, annotation: Any) -> Field:
        """Reads an annotation such as `f32`, `f32x4` or `Annotated[PTPMode, Scalar("B")]`."""
        if get_origin(annotation) is not Annotated:
            raise TypeError(f"{name}: {annotation!r} does not say how it lies on the wire")

        python_type, scalar, *_ = get_args(annotation)
        convert = isinstance(python_type, type) and issubclass(python_type, (bool, enum.IntEnum))
        return cls(name, scalar, cast("type[bool | enum.IntEnum]", python_type) if convert else None)

    @property
    def codes(self) -> str:
        """One letter of `struct` for each number."""
        return self.scalar.code * self.scalar.count

    @property
    def plain(self) -> bool:
        """Whether the one number is the value already."""
        return self.scalar.count == 1 and not self.kind

    def flatten(self, value: Any) -> list[Any]:
        """The checked numbers of a value, in the order of the wire."""
        scalar = self.scalar
        if scalar.count == 1:
            if self.kind is bool and not hasattr(value, "__index__") and not isinstance(value, float):
                value = bool(value) if hasattr(value, "__float__") else value  # a truth of NumPy's

            number = scalar.check(self.name, value)
            if self.kind:
                self.kind(number)  # an enum refuses a number that is none of its members

            return [number]

        values = list(value)
        if len(values) != scalar.count:
            raise ValueError(f"{self.name} must have {scalar.count} values, not {len(values)}")

        return [scalar.check(f"{self.name}[{i}]", each) for i, each in enumerate(values)]

    def build(self, numbers: tuple[Any, ...]) -> Any:
        """The value of `scalar.count` numbers."""
        if self.scalar.count > 1:
            return numbers

        return self.kind(numbers[0]) if self.kind else numbers[0]


class Number(Generic[T]):
    """A bare number (or flag, or enum, or row of numbers): `Number(u32)`."""

    def __init__(self, annotation: Any, order: str = "<") -> None:
        self.field: Field = Field.of("value", annotation)
        self.struct: struct.Struct = struct.Struct(f"{order}{self.field.scalar.count}{self.field.scalar.code}")

    def encode(self, value: T) -> bytes:
        """Packs one number."""
        return self.struct.pack(*self.field.flatten(value))

    def decode(self, data: bytes) -> T:
        """Unpacks one number; the bytes must be exactly its own."""
        value: T = unpack(self.struct, data, self.field.build)
        return value


class Record(Generic[T]):
    """A dataclass: its annotated fields one after the other; fields that are dataclasses themselves lie inside."""

    def __init__(self, kind: type[T], order: str = "<") -> None:
        assert is_dataclass(kind)
        self.kind = kind
        hints = get_type_hints(kind, include_extras=True)
        names = [each.name for each in fields(kind)]
        self.tail: Layout[Any] | None = layout_of(hints[names[-1]])
        self.tail_name: str = names.pop() if self.tail else ""
        self.fields: dict[str, Field | Record[Any]] = {
            name: Record(hints[name], order) if is_dataclass(hints[name]) else Field.of(name, hints[name])
            for name in names
        }
        self.codes: str = "".join(field.codes for field in self.fields.values())
        self.struct: struct.Struct = struct.Struct(order + self.codes)
        self.plain: bool = all(isinstance(field, Field) and field.plain for field in self.fields.values())

    def encode(self, value: T) -> bytes:
        """Packs a record."""
        head = self.struct.pack(*self.flatten(value))
        return head + self.tail.encode(getattr(value, self.tail_name)) if self.tail else head

    def decode(self, data: bytes) -> T:
        """Unpacks a record; the bytes must be exactly its own."""
        if not self.tail:
            return unpack(self.struct, data, self.build)

        size = self.struct.size
        values = [*unpack(self.struct, data[:size], self.cut), self.tail.decode(data[size:])]
        return self.kind(*values)

    def flatten(self, value: Any) -> list[Any]:
        """The checked numbers of a record, in the order of the wire."""
        if not isinstance(value, self.kind):
            raise TypeError(f"expected {self.kind.__name__}, not {value!r}")

        return [number for name, field in self.fields.items() for number in field.flatten(getattr(value, name))]

    def build(self, numbers: tuple[Any, ...]) -> T:
        """The record of its numbers."""
        return self.kind(*(numbers if self.plain else self.cut(numbers)))

    def cut(self, numbers: tuple[Any, ...]) -> list[Any]:
        """The values of the fields, cut out of the numbers."""
        values: list[Any] = []
        at = 0
        for field in self.fields.values():
            count = len(field.codes)
            values.append(field.build(numbers[at : at + count]))
            at += count

        return values


class Queueing(enum.Enum):
    """Whether a command may go through the arm's queue."""

    NEVER = "immediate only"
    ALLOWED = "immediate or queued"
    ALWAYS = "queued only"


@dataclass(frozen=True, slots=True, eq=False)
class Command(Generic[Q, R]):
    """One row of a command table.

    Attributes:
        name: The manual's name, such as "SetPTPCmd".
        id: What names the command on the wire.
        request: Layout of the parameters that go out.
        reply: Layout of the parameters that come back when it was not queued.
        section: The manual's section, or the document that describes it.
        write: Whether it changes anything; observers send none of these.
        queueing: Whether it may or must go through the queue.
        repeatable: Whether sending it twice does what sending it once does.
        timeout: Seconds that an answer may take before the call fails.
        moves: Whether it moves the arm, so that alarms speak about it.
        echo: A field that the reply repeats from the request, such as an IO address.
    """

    name: str
    id: int
    request: Layout[Q]
    reply: Layout[R]
    section: str
    write: bool = False
    queueing: Queueing = Queueing.NEVER
    repeatable: bool = True
    timeout: float = 1.5
    moves: bool = False
    echo: str | None = None

    def __repr__(self) -> str:
        return f"<{self.name} {self.id}>"


def commands_in(names: Mapping[str, object]) -> tuple[Command[Any, Any], ...]:
    """Returns the rows among the names of a module, in their order."""
    return tuple(row for row in tuple(names.values()) if isinstance(row, Command))  # pyright: ignore[reportUnknownVariableType, reportUnknownArgumentType] - isinstance tells no type parameters


def unpack(layout: struct.Struct, data: bytes, build: Callable[[tuple[Any, ...]], V]) -> V:
    """Unpacks and builds, with every failure a ProtocolError."""
    if len(data) != layout.size:
        raise ProtocolError(f"expected {layout.size} bytes of parameters, got {len(data)}")

    try:
        return build(layout.unpack(data))
    except ValueError as error:
        raise ProtocolError(f"{data.hex(' ')}: {error}") from None


def layout_of(annotation: Any) -> Layout[Any] | None:
    """The layout that an annotation carries itself, if it carries one instead of a `Scalar`."""
    if get_origin(annotation) is not Annotated or isinstance(get_args(annotation)[1], Scalar):
        return None

    layout: Layout[Any] = get_args(annotation)[1]
    return layout
