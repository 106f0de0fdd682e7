"""What a simulated Magician reaches: its kinematics as paths want them."""

from __future__ import annotations

from dataclasses import dataclass

from dobot_async.arms.magician.kinematics import Kinematics, Unreachable
from dobot_async.simulator.device.work import DeviceFault, Vector

__all__ = ["Reach"]


@dataclass(frozen=True, slots=True)
class Reach:
    """The kinematics as paths want them: points and joints of four numbers, and faults."""

    kinematics: Kinematics

    def forward(self, joints: Vector) -> Vector:
        """Returns the point of four joints."""
        return self.kinematics.forward(*joints)

    def inverse(self, point: Vector) -> Vector:
        """Returns the joints of a point, within their limits; raises Fault."""
        try:
            return self.kinematics.check(*point)
        except Unreachable as error:
            raise DeviceFault(error.alarm) from None

    def base_angle(self, x: float, y: float, z: float) -> float:
        """Returns joint 1 of a place, whatever the limits; raises Fault."""
        try:
            return self.kinematics.inverse(x, y, z, 0.0).j1
        except Unreachable as error:
            raise DeviceFault(error.alarm) from None

    def check(self, joints: Vector) -> Vector:
        """Returns these joints; raises Fault if they are beyond the limits."""
        try:
            self.kinematics.check_joints(*joints)
        except Unreachable as error:
            raise DeviceFault(error.alarm) from None

        return joints
