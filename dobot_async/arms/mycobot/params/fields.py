"""What the parameters of the myCobot family consist of: numbers as they lie on the wire, and words for some of them."""

from __future__ import annotations

from enum import IntEnum
from typing import Annotated

from dobot_async.arms.mycobot.layouts import Fixed, Many

__all__ = [
    "Direction",
    "EndType",
    "GripperState",
    "GripperType",
    "MoveMode",
    "PinMode",
    "Position",
    "ReferenceFrame",
    "TransponderMode",
    "angle",
    "angles",
    "byte",
    "coords",
    "flag",
    "i16s",
    "limit",
    "octets",
    "percent",
    "servo",
    "servo_or_all",
    "share",
    "tenths",
    "u16",
    "u16s",
    "volts",
]


byte = Annotated[int, Fixed("B")]
flag = Annotated[bool, Fixed("B", low=0, high=1)]
u16 = Annotated[int, Fixed("H")]
octets = Annotated[tuple[int, ...], Fixed("B", count=Many.JOINTS)]
u16s = Annotated[tuple[int, ...], Fixed("H", count=Many.JOINTS)]
i16s = Annotated[tuple[int, ...], Fixed("h", count=Many.JOINTS)]
angle = Annotated[float, Fixed("h", (100,))]
angles = Annotated[tuple[float, ...], Fixed("h", (100,), count=Many.JOINTS)]
coords = Annotated[tuple[float, ...], Fixed("h", (10, 10, 10, 100), count=Many.COORDS)]
tenths = Annotated[float, Fixed("B", (10,))]
volts = Annotated[tuple[float, ...], Fixed("B", (10,), count=Many.JOINTS)]
limit = Annotated[float, Fixed("h", (10,))]
percent = Annotated[int, Fixed("B", low=1, high=100)]
share = Annotated[int, Fixed("B", low=0, high=100)]
servo = Annotated[int, Fixed("B", low=1, high=8)]
servo_or_all = Annotated[int, Fixed("B", low=0, high=8)]


class Direction(IntEnum):
    """Which way to jog."""

    DOWN = 0
    UP = 1


class MoveMode(IntEnum):
    """How the tool gets to a point."""

    ANGULAR = 0
    LINEAR = 1


class Position(IntEnum):
    """What the numbers of a position are."""

    ANGLES = 0
    COORDS = 1


class ReferenceFrame(IntEnum):
    """In which frame coordinates are."""

    BASE = 0
    WORLD = 1


class EndType(IntEnum):
    """Of what coordinates are."""

    FLANGE = 0
    TOOL = 1


class TransponderMode(IntEnum):
    """What the M5 does with what passes through it: everything, checking all, or checking its settings alone."""

    OFF = 0
    CHECK_ALL = 1
    CHECK_SETTINGS = 2


class PinMode(IntEnum):
    """What a pin of the Atom is used for."""

    INPUT = 0
    OUTPUT = 1
    INPUT_PULLUP = 2


class GripperState(IntEnum):
    """What the gripper does."""

    OPEN = 0
    CLOSED = 1
    RELEASED = 0xFE


class GripperType(IntEnum):
    """Which gripper it is."""

    ADAPTIVE = 1
    FIVE_FINGERED = 2
    PARALLEL = 3
    FLEXIBLE = 4
