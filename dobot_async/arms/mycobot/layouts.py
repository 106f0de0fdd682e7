"""How values lie on the wire of the myCobot family: big-endian whole numbers that stand for decimals.

    45.5 degrees  -> 4550 -> 11 C6        150.3 mm -> 1503 -> 05 DF        -45 degrees of a limit -> -450 -> FE 3E
    (hundredths)                          (tenths)                         (tenths)

A record is a dataclass whose fields carry a `Fixed`. What there is of once for each joint, or once for each coordinate,
has as many numbers as the arm has: `sized` makes the layout of one model of the layout of all. Values are rounded; the
vendor's library truncates. Encoding raises ValueError or TypeError, decoding ProtocolError.
"""

from __future__ import annotations

import enum
import math
import operator
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Annotated, Any, Generic, Self, TypeVar, get_args, get_origin, get_type_hints

from dobot_async.errors import ProtocolError

__all__ = ["ACK", "Acknowledgement", "Axis", "Fixed", "Many", "Octets", "Packed", "Value", "Whole"]

T = TypeVar("T")


class Many(enum.Enum):
    """What there are several of, one for each joint or coordinate of the model."""

    JOINTS = "joints"
    COORDS = "coords"


Sizes = Mapping[Many, int]
UNSIZED: Sizes = {}


@dataclass(frozen=True, slots=True)
class Fixed:
    """One field: a number, or a row of them, each multiplied on the wire by its scale.

    Attributes:
        code: Of `struct`.
        scales: By what the numbers are multiplied, the last one for all that follow.
        low: Least value that may be sent.
        high: Greatest value that may be sent.
        count: None for one number, else of what there is a row.
        optional: The last field, which is left out where it is None.
    """

    code: str
    scales: tuple[int, ...] = (1,)
    low: float = -math.inf
    high: float = math.inf
    count: Many | None = None
    optional: bool = False

    def scale(self, place: int) -> int:
        """By what the number at a place is multiplied."""
        return self.scales[min(place, len(self.scales) - 1)]

    def encode(self, name: str, value: Any, sizes: Sizes) -> bytes:
        """Return the bytes of a field's value."""
        if self.optional and value is None:
            return b""

        values: list[Any] = [value] if self.count is None else list(value)
        wanted = sizes.get(self.count) if self.count else 1
        if wanted is not None and len(values) != wanted:
            raise ValueError(f"{name} must have {wanted} values for this arm, not {len(values)}")

        return b"".join(self.pack(name, each, self.scale(place)) for place, each in enumerate(values))

    def pack(self, name: str, value: Any, scale: int) -> bytes:
        """Return the bytes of one number; raise ValueError or TypeError where it does not fit."""
        if not hasattr(value, "__index__" if scale == 1 else "__float__"):
            raise TypeError(f"{name} must be a {'whole number' if scale == 1 else 'number'}, not {value!r}")

        number = operator.index(value) if scale == 1 else float(value)
        if not (math.isfinite(number) and self.low <= number <= self.high):
            raise ValueError(f"{name} must be in {self.low:g} to {self.high:g}, not {value!r}")

        try:
            return struct.pack(f">{self.code}", round(number * scale))
        except struct.error:
            raise ValueError(f"{name} does not fit into its bytes on the wire: {value!r}") from None

    def decode(self, data: bytes, kind: Any) -> Any:
        """Return the value of a field's bytes."""
        numbers = struct.unpack(f">{len(data) // self.width}{self.code}", data)
        values = tuple(
            number if self.scale(place) == 1 else number / self.scale(place) for place, number in enumerate(numbers)
        )
        if self.count is not None:
            return values

        if kind is bool and values[0] not in {0, 1}:
            raise ValueError(f"{values[0]} is neither 0 nor 1")

        return kind(values[0]) if kind else values[0]

    @property
    def width(self) -> int:
        """Bytes of one number."""
        return struct.calcsize(f">{self.code}")


class Packed(Generic[T]):
    """A record: the fields of a dataclass, one after the other."""

    def __init__(self, kind: type[T], sizes: Sizes = UNSIZED) -> None:
        hints = get_type_hints(kind, include_extras=True)
        names = [each.name for each in fields(kind)]  # type: ignore[arg-type] # the type of a record is that of a dataclass
        self.kind = kind
        self.sizes = sizes
        self.parts: list[tuple[str, Fixed, Any]] = [(name, *fixed_of(name, hints[name])) for name in names]

    def sized(self, sizes: Sizes) -> Self:
        """Return the layout of a model that has so many joints and coordinates."""
        return type(self)(self.kind, sizes)

    def encode(self, value: T) -> bytes:
        """Pack a record."""
        if not isinstance(value, self.kind):
            raise TypeError(f"expected {self.kind.__name__}, not {value!r}")

        return encode(self.parts, [getattr(value, name) for name, _, _ in self.parts], self.sizes)

    def decode(self, data: bytes) -> T:
        """Unpack a record; the bytes must be exactly its own."""
        return self.kind(*decode(self.parts, data, self.sizes))

    @property
    def lengths(self) -> frozenset[int] | None:
        """How many bytes it may have; None while it is not sized."""
        return lengths(self.parts, self.sizes)


class Value(Generic[T]):
    """A bare value: a number, a flag, an enum, or a row of numbers."""

    def __init__(self, annotation: Any, sizes: Sizes = UNSIZED) -> None:
        self.annotation = annotation
        self.sizes = sizes
        self.parts: list[tuple[str, Fixed, Any]] = [("value", *fixed_of("value", annotation))]

    def sized(self, sizes: Sizes) -> Self:
        """Return the layout of a model that has so many joints and coordinates."""
        return type(self)(self.annotation, sizes)

    def encode(self, value: T) -> bytes:
        """Pack a value."""
        return encode(self.parts, [value], self.sizes)

    def decode(self, data: bytes) -> T:
        """Unpack a value; the bytes must be exactly its own."""
        value: T
        [value] = decode(self.parts, data, self.sizes)
        return value

    @property
    def lengths(self) -> frozenset[int] | None:
        """How many bytes it may have; None while it is not sized."""
        return lengths(self.parts, self.sizes)


class Axis(Generic[T]):
    """A record of an axis (1 to 6), a value that is mm on the first three and degrees on the others, and a speed."""

    lengths: frozenset[int] = frozenset({4})

    def __init__(self, kind: type[T]) -> None:
        self.kind = kind
        self.mm: Packed[T] = Packed(kind)
        self.degrees: Packed[T] = Packed(kind)
        self.degrees.parts = [
            (name, Fixed("h", (100,)) if name == "value" else fixed, each) for name, fixed, each in self.mm.parts
        ]

    def encode(self, value: T) -> bytes:
        """Pack a record."""
        return self.layout(getattr(value, "axis", 1)).encode(value)

    def decode(self, data: bytes) -> T:
        """Unpack a record."""
        return self.layout(data[0] if data else 1).decode(data)

    def layout(self, axis: Any) -> Packed[T]:
        """The layout of one axis."""
        return self.mm if isinstance(axis, int) and axis <= 3 else self.degrees


class Whole:
    """A whole number of one byte or of two."""

    lengths: frozenset[int] = frozenset({1, 2})

    def encode(self, value: int) -> bytes:
        """Pack a number, into one byte if it fits."""
        return value.to_bytes(1 if value < 256 else 2, "big")

    def decode(self, data: bytes) -> int:
        """Unpack a number."""
        if len(data) not in self.lengths:
            raise ProtocolError(f"expected 1 or 2 bytes of parameters, got {len(data)}")

        return int.from_bytes(data, "big")


class Octets:
    """Some bytes, as numbers: how many is the firmware's affair."""

    def __init__(self, low: int, high: int) -> None:
        self.lengths: frozenset[int] = frozenset(range(low, high + 1))

    def encode(self, value: Sequence[int]) -> bytes:
        """Pack the numbers."""
        return bytes(value)

    def decode(self, data: bytes) -> tuple[int, ...]:
        """Unpack as many numbers as there are bytes."""
        if len(data) not in self.lengths:
            raise ProtocolError(f"expected {min(self.lengths)} to {max(self.lengths)} bytes, got {len(data)}")

        return tuple(data)


class Acknowledgement:
    """What an arm may answer to a command: nothing at all, a byte, or the request itself. It says nothing."""

    lengths: frozenset[int] = frozenset({0, 1})

    def encode(self, value: None) -> bytes:
        """Return the byte that newer firmware answers with."""
        if value is not None:
            raise TypeError(f"an acknowledgement has no value, not {value!r}")

        return b"\x01"

    def decode(self, data: bytes) -> None:  # noqa: ARG002 - whatever it is, it says nothing
        """Accepts anything."""
        return


ACK = Acknowledgement()


def encode(parts: Sequence[tuple[str, Fixed, Any]], values: Sequence[Any], sizes: Sizes) -> bytes:
    """The bytes of all fields."""
    for (name, _, kind), value in zip(parts, values, strict=True):
        if kind and value is not None:
            try:
                kind(value)  # an enum refuses a number that is none of its members
            except ValueError as error:
                raise ValueError(f"{name}: {error}") from None

    return b"".join(fixed.encode(name, value, sizes) for (name, fixed, _), value in zip(parts, values, strict=True))


def decode(parts: Sequence[tuple[str, Fixed, Any]], data: bytes, sizes: Sizes) -> list[Any]:
    """The values of all fields; their bytes must be all there are."""
    widths = fitting(parts, len(data), sizes)
    if widths is None:
        raise ProtocolError(f"{len(data)} bytes of parameters do not fit")

    values: list[Any] = []
    at = 0
    for (name, fixed, kind), width in zip(parts, widths, strict=True):
        try:
            values.append(fixed.decode(data[at : at + width], kind) if width or not fixed.optional else None)
        except ValueError as error:
            raise ProtocolError(f"{name}: {error}") from None

        at += width

    return values


def fitting(parts: Sequence[tuple[str, Fixed, Any]], length: int, sizes: Sizes) -> list[int] | None:
    """How many bytes each field takes of so many; None if they do not fit."""
    optional = parts[-1][1].optional
    for left_out in (True, False) if optional else (False,):
        used = parts[:-1] if left_out else parts
        widths = [fixed.width * (1 if fixed.count is None else sizes.get(fixed.count, 0)) for _, fixed, _ in used]
        open_ones = [place for place, (_, fixed, _) in enumerate(used) if fixed.count and fixed.count not in sizes]
        rest = length - sum(widths)
        if open_ones:
            share, over = divmod(rest, sum(used[place][1].width for place in open_ones))
            if share < 1 or over:
                continue

            for place in open_ones:
                widths[place] = share * used[place][1].width
        elif rest:
            continue

        return [*widths, 0] if left_out else widths

    return None


def lengths(parts: Sequence[tuple[str, Fixed, Any]], sizes: Sizes) -> frozenset[int] | None:
    """All numbers of bytes that the fields may have together; None if that is open."""
    if any(fixed.count and fixed.count not in sizes for _, fixed, _ in parts):
        return None

    widths = [fixed.width * (sizes[fixed.count] if fixed.count else 1) for _, fixed, _ in parts]
    whole = sum(widths)
    return frozenset({whole, whole - widths[-1]} if parts[-1][1].optional else {whole})


def fixed_of(name: str, annotation: Any) -> tuple[Fixed, Any]:
    """How a field lies on the wire, and the enum or bool that its number becomes, if any."""
    if get_origin(annotation) is not Annotated:
        raise TypeError(f"{name}: {annotation!r} does not say how it lies on the wire")

    python_type, fixed, *_ = get_args(annotation)
    kinds = [each for each in (python_type, *get_args(python_type)) if isinstance(each, type)]
    return fixed, next((each for each in kinds if issubclass(each, (bool, enum.IntEnum))), None)
