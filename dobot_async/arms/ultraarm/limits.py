"""What an ultraArm may be told: the ranges of the arm at hand, in mm and degrees."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from types import MappingProxyType

from dobot_async.arms.ultraarm.params import CoordsMove, JointMove, JointsMove, Position

__all__ = ["LIBRARY_LIMITS", "MANUAL_LIMITS", "UltraArmLimits"]

Range = tuple[float, float]


@dataclass(frozen=True, slots=True)
class UltraArmLimits:
    """What an arm may be told, in mm and degrees; each a lowest and a highest value."""

    x: Range
    y: Range
    z: Range
    e: Range
    j1: Range
    j2: Range
    j3: Range
    j4: Range

    def check(self, value: object) -> None:
        """Raise ValueError for a target that is beyond the limits."""
        if isinstance(value, JointMove):
            self._check_axis(f"j{value.joint}", value.angle)
            return

        for name in CHECKED.get(type(value), ()):
            self._check_axis(name, getattr(value, name))

    def _check_axis(self, name: str, given: float | None) -> None:
        low, high = getattr(self, name)
        if given is not None and not low <= given <= high:
            raise ValueError(f"{name} must be in {low:g} to {high:g}, not {given!r}")


CHECKED: Mapping[type, tuple[str, ...]] = MappingProxyType(
    {
        CoordsMove: ("x", "y", "z", "e"),
        Position: ("x", "y", "z", "e"),
        JointsMove: tuple(each.name for each in fields(JointsMove) if each.name != "f"),
    }
)

MANUAL_LIMITS = UltraArmLimits(
    x=(-260, 300),
    y=(-300, 300),
    z=(-130, 135),
    e=(-180, 180),
    j1=(-150, 170),
    j2=(-20, 90),
    j3=(-5, 60),
    j4=(-179, 179),
)
"""The manual's: older and tighter."""

LIBRARY_LIMITS = UltraArmLimits(
    x=(-360, 365.55),
    y=(-365.55, 365.55),
    z=(-140, 130),
    e=(-180, 180),
    j1=(-150, 170),
    j2=(-20, 90),
    j3=(-5, 110),
    j4=(-179, 179),
)
"""Those of the vendor's library, pymycobot 4."""
