"""Where an arm stands in its cell, and where the same place is for both. Pure arithmetic; mm and degrees."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

__all__ = ["BaseFrame", "Place"]


class Place(NamedTuple):
    """A place of the tool: x, y, z in mm, and its rotation r about the vertical in degrees."""

    x: float
    y: float
    z: float
    r: float = 0.0


@dataclass(frozen=True, slots=True)
class BaseFrame:
    """The origin of an arm's coordinates, seen from the cell. All arms stand upright.

    Attributes:
        x: mm.
        y: mm.
        z: mm.
        yaw: Degrees by which the arm is turned to the left about the vertical.
    """

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    yaw: float = 0.0

    def __post_init__(self) -> None:
        if not all(map(math.isfinite, (self.x, self.y, self.z, self.yaw))):
            raise ValueError(f"a base frame has finite numbers, not {self}")

    def to_cell(self, x: float, y: float, z: float, r: float = 0.0) -> Place:
        """Returns where a place of the arm is in the cell.

        Args:
            x: mm, as the arm counts.
            y: mm.
            z: mm.
            r: Degrees.
        """
        cos, sin = self._turn()
        return Place(self.x + x * cos - y * sin, self.y + x * sin + y * cos, self.z + z, r + self.yaw)

    def to_arm(self, x: float, y: float, z: float, r: float = 0.0) -> Place:
        """Returns where a place of the cell is for the arm.

        Args:
            x: mm, as the cell counts.
            y: mm.
            z: mm.
            r: Degrees.
        """
        cos, sin = self._turn()
        ahead, aside = x - self.x, y - self.y
        return Place(ahead * cos + aside * sin, aside * cos - ahead * sin, z - self.z, r - self.yaw)

    def _turn(self) -> tuple[float, float]:
        yaw = math.radians(self.yaw)
        return math.cos(yaw), math.sin(yaw)
