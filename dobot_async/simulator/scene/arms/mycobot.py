"""A simulated arm of the myCobot family, as a scene sees it."""

from __future__ import annotations

import math

from dobot_async.simulator.device.device import Device
from dobot_async.simulator.mycobot.arm import SimulatedMyCobot
from dobot_async.simulator.mycobot.kinematics import Transform
from dobot_async.simulator.scene.geometry import Placement
from dobot_async.simulator.scene.things import ColorSpot, LightBeam, Tool

__all__ = ["MyCobotInScene"]

COLLISION = 16


class MyCobotInScene:
    """A myCobot; the tip is in front of its flange, wherever that looks."""

    rail: float = 0.0
    switches = None
    sucks = False

    def __init__(self, arm: SimulatedMyCobot) -> None:
        self.arm = arm

    @property
    def device(self) -> Device:
        """Its device."""
        return self.arm.device

    @property
    def due(self) -> float:
        """When a command ends; its gripper moves meanwhile."""
        return self.arm.device.due

    @property
    def moving(self) -> bool:
        """Whether it moves, or its gripper does."""
        return self.arm.moving or self.arm.gripper.moving

    @property
    def opening(self) -> float:
        """Of its own gripper."""
        return self.arm.gripper.value / 100

    def tip(self, tool: Tool) -> Placement:
        """Of a palletizer below its flange, which stays level; of the others in front of it."""
        point = self.arm.ways.solver.forward(self.arm.joints)
        if len(point) == 4:
            return Placement(point[0], point[1], point[2] - tool.length, point[3])

        frame = Transform.of(point)
        x, y, z = (p + row[2] * tool.length for p, row in frame.rows)
        return Placement(x, y, z, math.degrees(math.atan2(frame.rotation[1][0], frame.rotation[0][0])))

    def crash(self) -> None:
        """It notices a collision, and holds."""
        self.arm.error = COLLISION
        self.arm.halt()

    def pulses(self, motor: int) -> int:
        """It has no steppers."""
        raise ValueError(f"a {self.arm.model.name} has no stepper {motor} for a belt: plug it into a Magician")

    def turns(self, motor: int) -> bool:  # noqa: ARG002 - it has none
        """It has no steppers."""
        return False

    def sees(self, sensor: LightBeam, seen: bool) -> None:
        """At a pin of the Atom."""
        if sensor.pin is None:
            raise ValueError(f"a {self.arm.model.name} has no socket for an infrared sensor: give pin=")

        self.arm.set_input(sensor.pin, int(seen))

    def sees_color(self, sensor: ColorSpot, flags: tuple[int, int, int]) -> None:
        """It has no socket for one."""
        raise ValueError(f"a {self.arm.model.name} has no colour sensor at {sensor.port.name} that could see {flags}")
