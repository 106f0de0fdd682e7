"""An ultraArm P340 in the panel."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar

from dobot_async import UltraArm, UltraArmJog
from dobot_async.arms.ultraarm import commands as u
from dobot_async.panel.arms.base import ArmView, Part, Point
from dobot_async.simulator.ultraarm.kinematics import FORE, OFFSET, UPPER

__all__ = ["UltraArmView"]

FOOT = -62.0  # mm, about
USUAL, FASTEST = 50.0, 200.0  # mm/s


class UltraArmView(ArmView):
    """An ultraArm; where its joints are is inferred from the ranges that the vendor names."""

    family = "ultraarm"
    features: ClassVar[tuple[str, ...]] = ("suction", "gripper", "gripper_to", "laser", "engrave", "power")
    parts: Sequence[Part] = (
        Part("base", "cylinder", 55.0),
        Part("rear arm", "box", 20.0),
        Part("forearm", "box", 16.0),
        Part("hand", "cylinder", 14.0),
    )
    arm: UltraArm

    @property
    def title(self) -> str:
        """What people call it."""
        return "ultraArm P340"

    @property
    def joint_limits(self) -> Sequence[tuple[float, float]]:
        """What the arm may be told."""
        limits = self.arm.limits
        return limits.j1, limits.j2, limits.j3, limits.j4

    @property
    def words(self) -> Sequence[str]:
        """Of the tool, and of three joints."""
        return [each.word for each in UltraArmJog]

    def points(self, joints: Sequence[float]) -> list[Point]:
        """Foot, shoulder, elbow, wrist and tool."""
        j1, j2, j3 = map(math.radians, joints[:3])
        elbow = UPPER * math.sin(j2), UPPER * math.cos(j2)
        wrist = elbow[0] + FORE * math.cos(j3), elbow[1] - FORE * math.sin(j3)
        ways = ((0.0, FOOT), (0.0, 0.0), elbow, wrist, (wrist[0] + OFFSET, wrist[1]))
        return [(out * math.cos(j1), out * math.sin(j1), up) for out, up in ways]

    async def move_to(self, place: Mapping[str, float], *, line: bool) -> None:
        """G0, or G1."""
        if line:
            await self.arm.perform(u.MOVE_LINE, u.CoordsMove(**place, f=self._speed), None)
        else:
            await self.arm.move_to(**place, speed=self._speed)

    async def move_joints(self, joints: Sequence[float]) -> None:
        """M11."""
        j1, j2, j3, j4 = joints
        await self.arm.move_joints(j1, j2, j3, j4, speed=self._speed)

    async def power(self) -> None:
        """M18."""
        await self.arm.power_on()

    @property
    def _speed(self) -> float:
        return USUAL if self.percent is None else max(1.0, FASTEST * self.percent / 100)
