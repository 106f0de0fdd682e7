"""A simulated ultraArm, as a scene sees it."""

from __future__ import annotations

from dobot_async.simulator.device.device import Device
from dobot_async.simulator.scene.geometry import Placement
from dobot_async.simulator.scene.things import ColorSpot, LightBeam, Tool
from dobot_async.simulator.ultraarm.arm import SimulatedUltraArm
from dobot_async.simulator.ultraarm.kinematics import forward

__all__ = ["UltraArmInScene"]

LOST = 0x50  # any code: the arm tells nobody


class UltraArmInScene:
    """An ultraArm; the tip hangs below what its coordinates tell."""

    rail: float = 0.0
    switches = None

    def __init__(self, arm: SimulatedUltraArm) -> None:
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
        return self.arm.device.moving or self.arm.gripper_moving

    @property
    def sucks(self) -> bool:
        """Whether the pump runs, if M23 starts it (`pump="manual"`)."""
        return self.arm.registers.pump

    @property
    def opening(self) -> float:
        """Of its gripper; a released one is open."""
        return 1.0 if self.arm.registers.gripper is None else self.arm.gripper / 100

    def tip(self, tool: Tool) -> Placement:
        """Below the end of the arm; the fourth joint turns it."""
        joints = self.arm.device.joints
        x, y, z, e = forward(joints)
        return Placement(x, y, z - tool.length, joints[0] + e)

    def crash(self) -> None:
        """The motion ends where it is; this arm notices nothing, and goes on with the next one."""
        self.arm.device.raise_alarm(LOST)
        self.arm.device.clear_alarms((LOST,))

    def pulses(self, motor: int) -> int:
        """It has no steppers."""
        raise ValueError(f"an ultraArm has no stepper {motor} for a belt: plug it into a Magician")

    def turns(self, motor: int) -> bool:  # noqa: ARG002 - it has none
        """It has no steppers."""
        return False

    def sees(self, sensor: LightBeam, seen: bool) -> None:
        """Its protocol has no inputs."""
        raise ValueError(f"an ultraArm has no input for {sensor}, which sees {'a piece' if seen else 'nothing'}")

    def sees_color(self, sensor: ColorSpot, flags: tuple[int, int, int]) -> None:
        """Its protocol has no inputs."""
        raise ValueError(f"an ultraArm has no socket for {sensor}, which sees {flags}")
