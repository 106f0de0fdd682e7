"""A simulated Magician, as a scene sees it."""

from __future__ import annotations

from typing import Any

from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.kinematics import Kinematics
from dobot_async.simulator.device.device import Device
from dobot_async.simulator.magician.arm import SimulatedMagician
from dobot_async.simulator.scene.geometry import Placement
from dobot_async.simulator.scene.things import ColorSpot, LightBeam, Tool

__all__ = ["MagicianInScene"]

LOSE_STEP_AXIS2 = 0x51


class MagicianInScene:
    """A Magician; the tip hangs below its wrist, which two parallelograms keep upright."""

    def __init__(self, arm: SimulatedMagician) -> None:
        self.arm = arm
        self._colors: dict[c.ColorPort, tuple[c.AccessoryVersion, c.Color]] = {}

    @property
    def device(self) -> Device:
        """Its device."""
        return self.arm.device

    @property
    def due(self) -> float:
        """When a command ends, or the air has followed one."""
        return min(self.arm.device.due, self.arm.state.due)

    @property
    def moving(self) -> bool:
        """Whether it moves."""
        return self.arm.device.moving

    @property
    def rail(self) -> float:
        """Where it stands on its rail."""
        return self.arm.true_rail

    @property
    def sucks(self) -> bool:
        """Whether the cup sucks."""
        return self.arm.suction

    @property
    def opening(self) -> float:
        """It is closed, or open."""
        return 0.0 if self.arm.gripper else 1.0

    @property
    def switches(self) -> Any:
        """The registers of its sensors."""
        get = self.arm.state.get
        return get(c.SET_COLOR_SENSOR), *(get(c.SET_INFRARED_SENSOR, port) for port in c.InfraredPort)

    def tip(self, tool: Tool) -> Placement:
        """Where it really is, and not where it believes to be."""
        base, rear, fore, turn, _ = self.arm.state.true(self.arm.device.joints)
        x, y, z, r = Kinematics(tool.offset).forward(base, rear, fore, turn)
        return Placement(x, y, z - tool.length, r)

    def crash(self) -> None:
        """The motors lose steps."""
        self.arm.raise_alarm(LOSE_STEP_AXIS2)

    def pulses(self, motor: int) -> int:
        """Of one of its two steppers."""
        return self.arm.motors[motor].pulses

    def turns(self, motor: int) -> bool:
        """Of one of its two steppers."""
        return self.arm.motors[motor].speed != 0

    def sees(self, sensor: LightBeam, seen: bool) -> None:
        """At a socket or at a pin."""
        if sensor.port is not None:
            self.arm.infrared_version = sensor.version
            self.arm.infrared[sensor.port] = seen
        elif sensor.pin is not None:
            self.arm.set_input(sensor.pin, int(seen))

    def sees_color(self, sensor: ColorSpot, flags: tuple[int, int, int]) -> None:
        """At its socket; the arm tells of the one that is switched on, which may have no sensor."""
        self._colors[sensor.port] = sensor.version, c.Color(*flags)
        switched = self.arm.state.get(c.SET_COLOR_SENSOR)
        nothing = switched.version, c.Color(0, 0, 0)
        self.arm.color_version, self.arm.color = self._colors.get(switched.port, nothing)
