"""What the methods of pydobot and pydobotplus take and return."""

from __future__ import annotations

import math
from enum import IntEnum
from typing import NamedTuple, Self

from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.alarms import Alarm as KnownAlarm
from dobot_async.errors import DobotError

__all__ = ["Alarm", "CustomPosition", "GPIOPort", "Joints", "Pose", "Position", "WrongParameter", "ptp_mode"]


class WrongParameter(DobotError, ValueError):
    """An argument is out of its range; nothing was sent. Old programs catch it as a `DobotException`."""


class Position(NamedTuple):
    """Where the tool is, mm and degrees."""

    x: float
    y: float
    z: float
    r: float


class Joints(NamedTuple):
    """The joints, degrees."""

    j1: float
    j2: float
    j3: float
    j4: float

    def in_radians(self) -> Joints:
        """Return the same in radians."""
        return Joints(*map(math.radians, self))


class Pose(NamedTuple):
    """Where the tool is, and the joints."""

    position: Position
    joints: Joints


class CustomPosition:
    """A place for `move_to(position=...)`; what is None stays as it is.

    Args:
        x: mm.
        y: mm.
        z: mm.
        r: Degrees.
    """

    def __init__(
        self, x: float | None = None, y: float | None = None, z: float | None = None, r: float | None = None
    ) -> None:
        self.x: float | None = x
        self.y: float | None = y
        self.z: float | None = z
        self.r: float | None = r


class GPIOPort(IntEnum):
    """Sockets of sensors."""

    GP1 = 0
    GP2 = 1
    GP4 = 2
    GP5 = 3


class Alarm(int):
    """An alarm's number; it compares with numbers, and prints what to do about it.

    Attributes:
        known: Its name, cause and remedy.
    """

    known: KnownAlarm

    def __new__(cls, known: KnownAlarm) -> Self:
        """Make one of an alarm of the driver."""
        found = super().__new__(cls, known.code)
        found.known = known
        return found

    @property
    def name(self) -> str:
        """The vendor's name, such as PLAN_INV_CALC."""
        return self.known.name

    @property
    def value(self) -> int:
        """The number."""
        return int(self)

    def __str__(self) -> str:
        return str(self.known)

    def __repr__(self) -> str:
        return f"<Alarm.{self.name}: {int(self)}>"


def ptp_mode(mode: int) -> c.PTPMode:
    """Return a PTP mode of its number, or of another library's enum; raise WrongParameter if there is none."""
    try:
        return c.PTPMode(int(mode))
    except ValueError:
        raise WrongParameter(f"mode must be a PTPMode, 0 to {max(c.PTPMode)}, not {mode!r}") from None
