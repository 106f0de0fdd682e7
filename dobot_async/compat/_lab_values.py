"""What DobotLab's calls return, and how they name pins and sockets.

Programs take the same readings in several ways: `x, y, z, r, joints = pose`, `pose.x`, `pose["x"]`, `pose.get("x")`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from dobot_async.arms.magician import commands as c

__all__ = ["Color", "Pose", "Ratios", "SensorFlag", "pin", "socket"]

PIN = re.compile(r"(?:D[IO]|A[DIO])_?(\d{1,2})", re.IGNORECASE)
PINS = range(1, 21)
SOCKETS = {1: c.InfraredPort.GP1, 2: c.InfraredPort.GP2, 4: c.InfraredPort.GP4, 5: c.InfraredPort.GP5}


class PoseNumbers(NamedTuple):
    """The numbers of a pose, in DobotLab's order."""

    x: float
    y: float
    z: float
    r: float
    jointAngle: list[float]  # noqa: N815 - DobotLab's name


class Pose(PoseNumbers):
    """Where the tool is, mm and degrees, and the list of the four joints, degrees."""

    __slots__ = ()

    def __getitem__(self, key: Any) -> Any:
        return found(self._asdict(), tuple(self), key)

    def get(self, name: str, default: float | None = None) -> Any:
        """Return what has a name, or something else if nothing has it."""
        return self[name] if name in self._fields else default

    @property
    def joints(self) -> list[float]:
        """The four joints, degrees."""
        return self.jointAngle


class ColorNumbers(NamedTuple):
    """The numbers of a colour, in DobotLab's order."""

    red: int
    green: int
    blue: int


class Color(ColorNumbers):
    """What the colour sensor sees: 1 for the colour that it is, on the arms seen so far, and 0 for the others."""

    __slots__ = ()

    def __getitem__(self, key: Any) -> Any:
        return found(self._asdict(), tuple(self), key)

    def get(self, name: str, default: int | None = None) -> Any:
        """Return what has a name, or something else if nothing has it."""
        return self[name] if name in self._fields else default


class SensorFlag(int):
    """1 if something is seen, else 0; `["status"]` is the same, for programs that ask so."""

    def __getitem__(self, name: str) -> int:
        if name != "status":
            raise KeyError(f"there is no {name!r} here, but 'status'")

        return int(self)


class Ratios(tuple[float, float]):  # noqa: SLOT001 - a tuple with an attribute has no slots
    """Two numbers of a property. Some programs assign them, others call it: `magician.motion_params(50, 50)`."""

    _set: Callable[[float, float], bool]

    @classmethod
    def of(cls, first: float, second: float, setter: Callable[[float, float], bool]) -> Ratios:
        """Make one of its numbers, and of what sets them."""
        found = cls((first, second))
        found._set = setter
        return found

    def __call__(self, first: float, second: float) -> bool:
        """Set the two numbers, as the assignment does."""
        return self._set(first, second)


def found(named: Mapping[str, object], numbers: Sequence[object], key: Any) -> Any:
    """Return what has a name, or a place; raise KeyError, with the names that there are, if nothing has the name."""
    if not isinstance(key, str):
        return numbers[key]

    if key not in named:
        raise KeyError(f"there is no {key!r} here, but {', '.join(named)}")

    return named[key]


def pin(io: str | int) -> int:
    """Return the number of a pin of its name, such as "DO_01", or of itself.

    Raises:
        ValueError: There is none, or it is not among 1 to 20.
    """
    found = PIN.fullmatch(io.strip()) if isinstance(io, str) else None
    number = int(found[1]) if found else io
    if isinstance(number, str) or number not in PINS:
        raise ValueError(f'io must be "DO_01" to "DO_20", "DI_01" to "DI_20" or a number, 1 to 20, not {io!r}')

    return number


def socket(port: int) -> c.InfraredPort:
    """Return the socket of its number in DobotLab; raise ValueError if there is none."""
    if port not in SOCKETS:
        raise ValueError(f"port must be 1, 2, 4 or 5 for the sockets GP1, GP2, GP4 and GP5, not {port!r}")

    return SOCKETS[port]
