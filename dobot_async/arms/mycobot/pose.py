"""Where an arm of the myCobot family is."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["AXES", "CobotPose"]

AXES = ("x", "y", "z", "rx", "ry", "rz")


@dataclass(frozen=True, slots=True)
class CobotPose:
    """Where the tool is (mm), how it is turned (degrees), and the joints (degrees). It is a target of `move_to`, too.

    A 4-axis arm has no ry and rz, and tells its one angle as rx.
    """

    x: float
    y: float
    z: float
    rx: float
    ry: float
    rz: float
    joints: tuple[float, ...]
