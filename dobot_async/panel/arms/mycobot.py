"""An arm of the myCobot family in the panel."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

from dobot_async import MyCobot
from dobot_async.arms.mycobot.jog import jog_words
from dobot_async.arms.mycobot.params import MoveMode, PinMode
from dobot_async.panel.arms.base import ArmView, Part, Point
from dobot_async.simulator.mycobot.kinematics import KINEMATICS, Chain, Palletizer

__all__ = ["CobotView"]

USUAL = 50  # percent, as the verbs have it
USES = {"input": PinMode.INPUT_PULLUP, "output": PinMode.OUTPUT}
THICK, THIN = 32.0, 20.0  # mm


class CobotView(ArmView):
    """A myArm, a myCobot, a mechArm or a myPalletizer; where its joints are, as the drawings of the vendor have it."""

    family = "mycobot"
    features: ClassVar[tuple[str, ...]] = ("gripper", "gripper_to", "outputs", "inputs", "power")
    pins: ClassVar[Mapping[str, Sequence[int]]] = {"outputs": (19, 23, 26, 33), "inputs": (19, 22, 26, 32, 39)}
    arm: MyCobot

    def __init__(self, arm: Any) -> None:
        super().__init__(arm)
        count = len(self.points([0.0] * self.arm.model.joints)) - 1
        self.parts: Sequence[Part] = tuple(
            Part("base" if not number else f"link {number}", "cylinder", THICK - (THICK - THIN) * number / count)
            for number in range(count)
        )

    @property
    def title(self) -> str:
        """What people call it."""
        return self.arm.model.title

    @property
    def joint_limits(self) -> Sequence[tuple[float, float]]:
        """Of the model."""
        return tuple(self.arm.model.joint_limits)

    @property
    def words(self) -> Sequence[str]:
        """Of its joints and axes."""
        return jog_words(self.arm.model)

    def points(self, joints: Sequence[float]) -> list[Point]:
        """Foot, the axis of each joint, flange."""
        solver = KINEMATICS[self.arm.model.name]
        if isinstance(solver, Chain):
            return [(place[0], place[1], place[2]) for place in (frame.place for frame in solver.frames(joints))]

        assert isinstance(solver, Palletizer)
        j1, j2, j3 = map(math.radians, joints[:3])
        out, up = solver.upper * math.sin(j2), solver.height + solver.upper * math.cos(j2)
        wrist = out + solver.fore * math.cos(j3), up - solver.fore * math.sin(j3)
        ways = ((0.0, 0.0), (0.0, solver.height), (out, up), wrist)
        return [(each * math.cos(j1), each * math.sin(j1), height) for each, height in ways]

    async def move_to(self, place: Mapping[str, float], *, line: bool) -> None:
        """By its joints, or straight."""
        mode = MoveMode.LINEAR if line else MoveMode.ANGULAR
        await self.arm.move_to(**place, speed=self._speed, mode=mode)

    async def move_joints(self, joints: Sequence[float]) -> None:
        """All joints."""
        await self.arm.move_joints(*joints, speed=self._speed)

    async def configure_pin(self, pin: int, use: str) -> None:
        """A pin of the Atom."""
        await self.arm.configure_pin(pin, USES[use])

    async def output(self, pin: int, level: bool) -> None:
        """A pin of the Atom."""
        await self.arm.set_pin(pin, level)
        self.tools.outputs = {**(self.tools.outputs or {}), pin: level}

    async def input(self, pin: int) -> bool:
        """A pin of the Atom."""
        return await self.arm.get_pin(pin)

    async def power(self) -> None:
        """The servos."""
        await self.arm.power_on()

    def drawing_options(self, speed: float | None) -> dict[str, Any]:
        """It knows percent alone."""
        return {} if speed is None else {"percent": round(min(max(speed, 1.0), 100.0))}

    @property
    def _speed(self) -> int:
        return USUAL if self.percent is None else max(1, round(self.percent))
