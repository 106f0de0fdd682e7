"""Layouts that are neither a number nor a record: strings, raw bytes, counts, lists, and what an arm reads leniently.

As in `wire`: encoding raises `ValueError` or `TypeError`, decoding `ProtocolError`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from dobot_async._core.protocol.wire import Number, Record, u32
from dobot_async.errors import ProtocolError

__all__ = ["NOTHING", "Bytes", "Count", "Counted", "Lenient", "Text"]

T = TypeVar("T")


class Lenient(Generic[T]):
    """A layout of fixed size, read as an arm reads it: what is missing at the end is zero, what is over is left aside.

    Peers of different age send requests of different length; an arm takes them all.
    """

    def __init__(self, layout: Number[T] | Record[T], least: int) -> None:
        self.layout = layout
        self.least = least

    def encode(self, value: T) -> bytes:
        """Returns the whole layout's bytes."""
        return self.layout.encode(value)

    def decode(self, data: bytes) -> T:
        """Decodes any number of bytes from `least` on."""
        if len(data) < self.least:
            raise ProtocolError(f"expected at least {self.least} bytes of parameters, got {len(data)}")

        size = self.layout.struct.size
        return self.layout.decode(data[:size].ljust(size, b"\0"))


class Count:
    """A whole number of four bytes, or of eight from newer firmware; sent as four."""

    def encode(self, value: int) -> bytes:
        """Packs a u32."""
        return COUNT.encode(value)

    def decode(self, data: bytes) -> int:
        """Unpacks a u32 or a u64, little endian."""
        if len(data) not in (4, 8):
            raise ProtocolError(f"expected 4 or 8 bytes of parameters, got {len(data)}")

        return int.from_bytes(data, "little")


COUNT = Number[int](u32)


class Counted(Generic[T]):
    """Up to `limit` records of one kind behind a u8 that counts them."""

    def __init__(self, record: Record[T], limit: int = 255) -> None:
        self.record = record
        self.limit = limit

    def encode(self, value: Sequence[T]) -> bytes:
        """Packs the count and the records."""
        if len(value) > self.limit:
            raise ValueError(f"{len(value)} of {self.record.kind.__name__}; the arm takes at most {self.limit}")

        return bytes((len(value),)) + b"".join(map(self.record.encode, value))

    def decode(self, data: bytes) -> tuple[T, ...]:
        """Unpacks exactly as many records as the count says."""
        size = self.record.struct.size
        if not data or len(data) != 1 + data[0] * size:
            raise ProtocolError(f"{len(data)} bytes are no count with as many records of {size} bytes")

        return tuple(self.record.decode(data[at : at + size]) for at in range(1, len(data), size))


class Nothing:
    """No parameters at all: the value is None."""

    def encode(self, value: None) -> bytes:
        """Returns no bytes; any value but None is a mistake."""
        if value is not None:
            raise TypeError(f"this command takes no value, not {value!r}")

        return b""

    def decode(self, data: bytes) -> None:
        """Accepts no bytes only."""
        if data:
            raise ProtocolError(f"expected no parameters, got {len(data)} bytes")


NOTHING = Nothing()


@dataclass(frozen=True, slots=True)
class Text:
    """A string that ends with NUL on the wire; reading tolerates its absence and whatever follows it."""

    limit: int
    encoding: str = "utf-8"

    def encode(self, value: str) -> bytes:
        """Encodes a string; raises ValueError if it holds NUL or is longer than `limit` bytes."""
        if not isinstance(value, str):
            raise TypeError(f"expected a string, not {value!r}")

        data = value.encode(self.encoding)
        if b"\0" in data:
            raise ValueError("a string for the arm must not contain NUL")

        if len(data) > self.limit:
            raise ValueError(f"string of {len(data)} bytes; the arm takes at most {self.limit}")

        return data + b"\0"

    def decode(self, data: bytes) -> str:
        """Decodes up to the first NUL; bytes of another encoding become U+FFFD."""
        return data.split(b"\0", 1)[0].decode(self.encoding, errors="replace")


@dataclass(frozen=True, slots=True)
class Bytes:
    """Raw bytes, of a fixed size or, without one, of any."""

    size: int | None = None

    def encode(self, value: bytes) -> bytes:
        """Returns the bytes themselves."""
        if not isinstance(value, (bytes, bytearray, memoryview)):
            raise TypeError(f"expected bytes, not {value!r}")

        if self.size is not None and len(value) != self.size:
            raise ValueError(f"expected {self.size} bytes, not {len(value)}")

        return bytes(value)

    def decode(self, data: bytes) -> bytes:
        """Returns the bytes themselves."""
        if self.size is not None and len(data) != self.size:
            raise ProtocolError(f"expected {self.size} bytes, got {len(data)}")

        return data
