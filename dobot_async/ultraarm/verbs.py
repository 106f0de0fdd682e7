"""The verbs of an ultraArm, written once and used in three places.

    arm.move_to(...)          returns when the arm has done it
    arm.queue.move_to(...)    returns a Motion once the arm has accepted it
    batch.move_to(...)        returns a Motion that is sent with its batch

Lengths are mm, angles degrees, times seconds. `speed` is what the manual calls mm/s, 1 to 200; None leaves it to the
arm. Wrong arguments raise ValueError or TypeError at once. The arm runs everything in order, settings included.
`timeout` is the whole command's on the arm, the wait for room in the queue; a batch has its own.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, Generic, Literal, TypeVar

from dobot_async.ultraarm import commands as c
from dobot_async.wire import Command

__all__ = ["SPEED", "Pump", "Verbs"]

T = TypeVar("T")
Q = TypeVar("Q")
Axis = float | None
SPEED = 50.0
"""A careful speed."""

Pump = Literal["manual", "vendor"]
"""Whether M23 starts the pump, as the manual says, or M22, as the vendor's library has it."""


class Verbs(Generic[T]):
    """What one can tell the arm to do; T is what each verb returns in its place.

    Attributes:
        pump: Who is right about the pump.
    """

    pump: Pump = "manual"

    @abstractmethod
    def perform(self, command: Command[Q, Any], value: Q, timeout: float | None) -> T:
        """Does, or queues, or collects a command."""

    def home(self, *, timeout: float | None = None) -> T:
        """Drives to the home switches, before which neither angles nor coordinates are right. Manual 5, G28."""
        return self.perform(c.HOME, None, timeout)

    def move_to(
        self,
        x: float | None = None,
        y: float | None = None,
        z: float | None = None,
        e: float | None = None,
        *,
        speed: float | None = SPEED,
        timeout: float | None = None,
    ) -> T:
        """Moves the tool to a point; an axis that is not given stays. Manual 5, G0.

        Args:
            x: mm, forward.
            y: mm, to the left.
            z: mm, up.
            e: Degrees, of what is mounted on the fourth joint.
            speed: mm/s, 1 to 200.
            timeout: Seconds.
        """
        return self.perform(c.MOVE_COORDS, c.CoordsMove(*some(x, y, z, e), f=speed), timeout)

    def move_by(
        self,
        x: float | None = None,
        y: float | None = None,
        z: float | None = None,
        e: float | None = None,
        *,
        speed: float | None = SPEED,
        timeout: float | None = None,
    ) -> T:
        """Moves the tool by mm (and `e` by degrees) from where it will be then. Manual 5, G91, G0 and G90."""
        return self.perform(c.MOVE_BY, c.CoordsMove(*some(x, y, z, e), f=speed), timeout)

    def move_joints(
        self,
        j1: float,
        j2: float,
        j3: float,
        j4: float | None = None,
        *,
        speed: float | None = SPEED,
        timeout: float | None = None,
    ) -> T:
        """Moves the joints to angles in degrees. Manual 5, M11."""
        return self.perform(c.MOVE_JOINTS, c.JointsMove(j1, j2, j3, j4, speed), timeout)

    def move_joint(self, joint: int, angle: float, *, speed: float | None = SPEED, timeout: float | None = None) -> T:
        """Moves one joint (1 to 4) to an angle in degrees. Manual 5, M10."""
        return self.perform(c.MOVE_JOINT, c.JointMove(joint, angle, speed), timeout)

    def wait(self, seconds: int, *, timeout: float | None = None) -> T:
        """Holds the arm's queue for whole seconds, 0 to 65535. Manual 5, G4."""
        return self.perform(c.WAIT, c.Dwell(seconds), timeout)

    def set_position(
        self,
        x: float | None = None,
        y: float | None = None,
        z: float | None = None,
        e: float | None = None,
        *,
        timeout: float | None = None,
    ) -> T:
        """Lets the arm take its place for another one: coordinates count from there. Manual 5, G92."""
        return self.perform(c.SET_POSITION, c.Position(*some(x, y, z, e)), timeout)

    def absolute(self, *, timeout: float | None = None) -> T:
        """Lets `move_to` mean places, as it does unless told otherwise. Manual 5, G90."""
        return self.perform(c.ABSOLUTE, None, timeout)

    def relative(self, *, timeout: float | None = None) -> T:
        """Lets `move_to` mean increments, until `absolute` or `move_by`. Manual 5, G91."""
        return self.perform(c.RELATIVE, None, timeout)

    def set_speed_mode(self, mode: c.SpeedMode, *, timeout: float | None = None) -> T:
        """Says how the arm runs through a series of motions: at constant speed, or each with its ramps."""
        return self.perform(c.SET_SPEED_MODE, c.ModeOfSpeed(mode), timeout)

    def suction(self, on: bool, *, timeout: float | None = None) -> T:
        """Starts or stops the pump; see `pump` of `connect`. Manual 5, M22 and M23."""
        starts = on is (self.pump == "manual")
        return self.perform(c.PUMP_ON if starts else c.PUMP_OFF, None, timeout)

    def gripper(
        self,
        opening: int,
        *,
        speed: int = 200,
        kind: c.GripperType | None = None,
        mode: c.GripperMode | None = None,
        timeout: float | None = None,
    ) -> T:
        """Opens the gripper to 0 (closed) to 100. Manual 5, M25.

        Args:
            opening: Percent.
            speed: 0 to 1500; 1 to 65 for the force gripper.
            kind: Which gripper, for firmware that knows several.
            mode: How the force gripper grips.
            timeout: Seconds.
        """
        return self.perform(c.SET_GRIPPER, c.GripperSet(opening, speed, kind, mode), timeout)

    def release_gripper(self, *, timeout: float | None = None) -> T:
        """Takes the power off the gripper. Manual 5, M26."""
        return self.perform(c.RELEASE_GRIPPER, None, timeout)

    def laser(self, on: bool, *, timeout: float | None = None) -> T:
        """Switches the laser. Manual 5, M3 and M5."""
        return self.perform(c.LASER_ON if on else c.LASER_OFF, None, timeout)

    def pwm(self, duty: int, *, timeout: float | None = None) -> T:
        """Sets the laser's duty cycle, 0 to 255. Manual 5, M21."""
        return self.perform(c.SET_PWM, c.PWM(duty), timeout)

    def fan(self, on: bool, *, timeout: float | None = None) -> T:
        """Switches the fan, which is on unless told otherwise; the motors need it. Manual 5, M27 and M28."""
        return self.perform(c.FAN_ON if on else c.FAN_OFF, None, timeout)

    def power_on(self, *, timeout: float | None = None) -> T:
        """Lets the motors hold; after that the arm has to be homed. Manual 5, M18."""
        return self.perform(c.POWER_ON, None, timeout)


def some(x: Axis, y: Axis, z: Axis, e: Axis) -> tuple[Axis, Axis, Axis, Axis]:
    """The axes; raises ValueError where there is none."""
    if x is y is z is e is None:
        raise ValueError("give at least one axis")

    return x, y, z, e
