"""A Dobot Magician in the panel."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

from dobot_async import Gripper, Jog, Laser, Magician, Pen, PTPMode, SuctionCup
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.alarms import IGNORED
from dobot_async.arms.magician.kinematics import FOREARM, REAR_ARM
from dobot_async.panel.arms.base import ArmView, Part, Point

__all__ = ["MagicianView"]

FOOT = -138.0  # the table
ANSWERS = 1.5  # seconds
TOOLS: Mapping[str, c.EndEffectorParams] = {
    "suction": SuctionCup(),
    "gripper": Gripper(),
    "pen": Pen(),
    "laser": Laser(),
}
USES = {"input": c.IOFunction.DI, "output": c.IOFunction.DO}


class MagicianView(ArmView):
    """A Magician."""

    family = "magician"
    features: ClassVar[tuple[str, ...]] = (
        "suction",
        "gripper",
        "laser",
        "conveyor",
        "rail",
        "outputs",
        "inputs",
        "engrave",
        "end_effector",
    )
    parts: Sequence[Part] = (
        Part("base", "cylinder", 60.0),
        Part("rear arm", "box", 22.0),
        Part("forearm", "box", 18.0),
        Part("hand", "cylinder", 14.0),
    )
    pins: ClassVar[Mapping[str, Sequence[int]]] = {"outputs": range(1, 21), "inputs": range(1, 21)}
    arm: Magician

    @property
    def title(self) -> str:
        """What people call it."""
        return "Dobot Magician"

    @property
    def joint_limits(self) -> Sequence[tuple[float, float]]:
        """The widest that any source states."""
        limits = self.arm.kinematics.limits
        return limits.j1, limits.j2, limits.j3, limits.j4

    @property
    def words(self) -> Sequence[str]:
        """Of the tool, of joints, along the rail if it was told that it has one."""
        return [each.word for each in Jog if self._on_rail or each not in {Jog.RAIL_PLUS, Jog.RAIL_MINUS}]

    def __init__(self, arm: Any) -> None:
        super().__init__(arm)
        self._on_rail = False

    def points(self, joints: Sequence[float]) -> list[Point]:
        """Foot, shoulder, elbow, wrist and tool."""
        j1, j2, j3 = map(math.radians, joints[:3])
        kinematics = self.arm.kinematics
        elbow_out, elbow_up = REAR_ARM * math.sin(j2), REAR_ARM * math.cos(j2)
        wrist_out, wrist_up = elbow_out + FOREARM * math.cos(j3), elbow_up - FOREARM * math.sin(j3)
        cos, sin = math.cos(j1), math.sin(j1)
        ways = ((0.0, FOOT), (0.0, 0.0), (elbow_out, elbow_up), (wrist_out, wrist_up))
        tool = kinematics.forward(joints[0], joints[1], joints[2], joints[3])
        return [*((out * cos, out * sin, up) for out, up in ways), (tool.x, tool.y, tool.z)]

    def is_harmless(self, alarm: object) -> bool:
        """As that which every power-up sets."""
        return getattr(alarm, "code", None) in IGNORED

    async def begin(self) -> None:
        """Empty the arm's own queue, and let it run.

        The first request has a time: behind a bridge that gives the arm to another program it is not answered, and must
        not be repeated until the arm is free.
        """
        await self.arm.request(c.SET_QUEUED_CMD_CLEAR, None, timeout=ANSWERS)
        await self.arm.queue.clear()

    async def move_to(self, place: Mapping[str, float], *, line: bool) -> None:
        """PTP, with the joints or straight."""
        await self.arm.move_to(**place, mode=PTPMode.MOVL_XYZ if line else PTPMode.MOVJ_XYZ)

    async def set_speed(self, percent: float) -> None:
        """The ratios of PTP."""
        await self.arm.set_speed(percent)
        self.percent: float | None = percent

    async def conveyor(self, speed: int, motor: int) -> None:
        """A stepper."""
        running = dict(self.tools.conveyor or {})
        self.tools.conveyor = running | ({motor: speed} if speed else {})
        await self.arm.conveyor(speed, motor=motor)
        if not speed:
            running.pop(motor, None)
            self.tools.conveyor = running

    async def rail(self, on: bool) -> None:
        """Declare it."""
        await self.arm.set_rail(on=on)
        self._on_rail = on

    async def move_rail(self, mm: float) -> None:
        """To a place along it, with the tool where it is."""
        await self.arm.move_to(l=mm)

    async def rail_place(self) -> float | None:
        """Where it stands."""
        return await self.arm.get_rail() if self._on_rail else None

    async def configure_pin(self, pin: int, use: str) -> None:
        """The multiplexing of a pin."""
        await self.arm.configure_io(pin, USES[use])

    async def output(self, pin: int, level: bool) -> None:
        """A digital output."""
        await self.arm.set_output(pin, level)
        self.tools.outputs = {**(self.tools.outputs or {}), pin: level}

    async def input(self, pin: int) -> bool:
        """A digital input."""
        return await self.arm.get_input(pin)

    async def end_effector(self, tool: str) -> None:
        """Its distance from the wrist."""
        await self.arm.set_end_effector(TOOLS[tool])
