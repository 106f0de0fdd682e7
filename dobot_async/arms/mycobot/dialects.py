"""Layouts that a request has one of two of."""

from __future__ import annotations

import struct
from typing import Any

from dobot_async.arms.mycobot.layouts import Value
from dobot_async.arms.mycobot.params import InPosition, Position, ServoData
from dobot_async.errors import ProtocolError

__all__ = ["PositionLayout", "ServoRegister"]

WIDE = 1
"""The mode behind a value of two bytes."""


class ServoRegister:
    """A register of a servo and its new value: one byte, or two with a mode of 1 behind them."""

    lengths: frozenset[int] = frozenset({3, 5})

    def encode(self, value: ServoData) -> bytes:
        """Pack a value."""
        if not isinstance(value, ServoData):
            raise TypeError(f"expected ServoData, not {value!r}")

        if not 1 <= value.joint <= 8:
            raise ValueError(f"joint must be in 1 to 8, not {value.joint!r}")

        numbers = value.joint, value.address, value.value
        try:
            return struct.pack(">BBHB", *numbers, WIDE) if value.wide else struct.pack(">BBB", *numbers)
        except struct.error as error:
            raise ValueError(f"{value}: {error}") from None

    def decode(self, data: bytes) -> ServoData:
        """Unpack a value."""
        if len(data) not in self.lengths:
            raise ProtocolError(f"expected 3 or 5 bytes of parameters, got {len(data)}")

        return ServoData(data[0], data[1], int.from_bytes(data[2:4], "big"), wide=len(data) > 3)


class PositionLayout:
    """The values of a position and what they are, which comes first on some models and last on others."""

    def __init__(
        self, angles: Value[tuple[float, ...]], coords: Value[tuple[float, ...]], *, first: bool = False
    ) -> None:
        self.first = first
        self.layouts: dict[Position, Value[tuple[float, ...]]] = {Position.ANGLES: angles, Position.COORDS: coords}

    @property
    def lengths(self) -> frozenset[int] | None:
        """How many bytes it may have; None while it is not sized."""
        found = [layout.lengths for layout in self.layouts.values()]
        return frozenset(1 + each for some in found for each in some or ()) if all(found) else None

    def sized(self, sizes: Any) -> PositionLayout:
        """Return the layout of a model that has so many joints and coordinates."""
        angles, coords = (layout.sized(sizes) for layout in self.layouts.values())
        return PositionLayout(angles, coords, first=self.first)

    def encode(self, value: InPosition) -> bytes:
        """Pack a position."""
        if not isinstance(value, InPosition):
            raise TypeError(f"expected InPosition, not {value!r}")

        data, kind = self.layouts[value.position].encode(value.values), bytes((value.position,))
        return kind + data if self.first else data + kind

    def decode(self, data: bytes) -> InPosition:
        """Unpack a position."""
        kind, values = (data[:1], data[1:]) if self.first else (data[-1:], data[:-1])
        try:
            position = Position(int.from_bytes(kind, "big"))
        except ValueError as error:
            raise ProtocolError(str(error)) from None

        return InPosition(self.layouts[position].decode(values), position)
