"""The verbs of an ultraArm, written once and used in three places.

    arm.move_to(...)          returns when the arm has done it
    arm.queue.move_to(...)    returns a Motion once the arm has accepted it
    batch.move_to(...)        returns a Motion that is sent with its batch

Lengths are mm, angles degrees, times seconds. `speed` is what the manual calls mm/s, 1 to 200; None leaves it to the
arm. Wrong arguments raise ValueError or TypeError at once. Everything is done in order, settings included, and nothing
before what is in front of it was seen to be done. `timeout` is the whole command's on the arm, the wait for room in the
queue; a batch has its own.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, Generic, Literal, SupportsFloat, TypeVar

from dobot_async._core.protocol.wire import Command
from dobot_async._core.util.arguments import check_duration, to_float
from dobot_async.arms.ultraarm import commands as c

__all__ = ["SPEED", "Pump", "Verbs", "check_speed"]

T = TypeVar("T")
Q = TypeVar("Q")
Axis = float | None
SPEED = 50.0
"""A careful speed."""

SLOWEST, FASTEST = 1.0, 200.0
LONGEST_WAIT = 65535.0
FULLY = 100.0

Pump = Literal["manual", "vendor"]
"""Whether M23 starts the pump, as the manual says, or M22, as the vendor's library has it."""


class Verbs(Generic[T]):
    """What one can tell the arm to do; T is what each verb returns in its place.

    Attributes:
        pump: Who is right about the pump.

    Raises:
        ValueError: Of each verb: an argument is out of range, or beyond the limits; nothing was sent.
        TypeError: An argument is of the wrong type.
    """

    pump: Pump = "manual"

    @abstractmethod
    def perform(self, command: Command[Q, Any], value: Q, timeout: float | None) -> T:
        """Do, or queue, or collect a command."""

    def home(self, *, timeout: float | None = None) -> T:
        """Drive to the home switches, before which neither angles nor coordinates are right. Manual 5, G28."""
        return self.perform(c.HOME, None, timeout)

    def move_to(
        self,
        x: float | c.UltraArmPose | c.UltraArmCoords | None = None,
        y: float | None = None,
        z: float | None = None,
        e: float | None = None,
        *,
        speed: float | None = SPEED,
        timeout: float | None = None,
    ) -> T:
        """Move the tool to a point; an axis that is not given stays. Manual 5, G0.

        Args:
            x: mm, forward; or a whole pose, as `get_pose` and `get_coords` return it.
            y: mm, to the left.
            z: mm, up.
            e: Degrees, of what is mounted on the fourth joint.
            speed: mm/s, 1 to 200.
            timeout: Seconds.

        Raises:
            ValueError: A number is out of range or beyond the limits, or no axis is given; nothing was sent.
        """
        if isinstance(x, (c.UltraArmPose, c.UltraArmCoords)):
            if not (y is None and z is None and e is None):
                raise ValueError("give a pose, or coordinates, not both")

            pose = x
            x, y, z, e = pose.x, pose.y, pose.z, pose.e

        return self.perform(c.MOVE_COORDS, c.CoordsMove(*some(x, y, z, e), f=check_speed(speed)), timeout)

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
        """Move the tool by mm (and `e` by degrees) from where it is then.

        The sum has to be within the limits: ValueError where that shows at once, else CommandRejected when its turn
        comes, before it is sent. Sent as a place, as `move_to` is.

        Args:
            x: mm, forward.
            y: mm, to the left.
            z: mm, up.
            e: Degrees, of what is mounted on the fourth joint.
            speed: mm/s, 1 to 200.
            timeout: Seconds.
        """
        return self.perform(c.MOVE_BY, c.CoordsMove(*some(x, y, z, e), f=check_speed(speed)), timeout)

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
        """Move the joints to angles in degrees. Manual 5, M11.

        Args:
            j1: Degrees.
            j2: Degrees.
            j3: Degrees.
            j4: Degrees, of what is mounted on it; None leaves it.
            speed: mm/s, 1 to 200.
            timeout: Seconds.

        Raises:
            ValueError: A number is out of range or beyond the limits; nothing was sent.
        """
        return self.perform(c.MOVE_JOINTS, c.JointsMove(j1, j2, j3, j4, check_speed(speed)), timeout)

    def move_joint(self, joint: int, angle: float, *, speed: float | None = SPEED, timeout: float | None = None) -> T:
        """Move one joint (1 to 4) to an angle in degrees. Manual 5, M10.

        Args:
            joint: 1 to 4.
            angle: Degrees.
            speed: mm/s, 1 to 200.
            timeout: Seconds.

        Raises:
            ValueError: A number is out of range or beyond the limits; nothing was sent.
        """
        return self.perform(c.MOVE_JOINT, c.JointMove(joint, angle, check_speed(speed)), timeout)

    def wait(self, seconds: float, *, timeout: float | None = None) -> T:
        """Hold the queue for a time. Manual 5, G4.

        Args:
            seconds: 0 to 65535. The arm waits whole ones, and the rest passes on this side before the next command.
            timeout: Seconds.

        Raises:
            ValueError: It is out of range.
        """
        return self.perform(c.WAIT, c.Dwell(check_duration(seconds, "seconds", LONGEST_WAIT)), timeout)

    def set_position(
        self,
        x: float | None = None,
        y: float | None = None,
        z: float | None = None,
        e: float | None = None,
        *,
        timeout: float | None = None,
    ) -> T:
        """Let the arm take its place for another one: coordinates count from there. Manual 5, G92.

        Args:
            x: mm, forward.
            y: mm, to the left.
            z: mm, up.
            e: Degrees, of what is mounted on the fourth joint.
            timeout: Seconds.

        Raises:
            ValueError: No axis is given, or a number is not finite.
        """
        return self.perform(c.SET_POSITION, c.Position(*some(x, y, z, e)), timeout)

    def absolute(self, *, timeout: float | None = None) -> T:
        """Let `move_to` mean places, as it does unless told otherwise, and after a stop. Manual 5, G90."""
        return self.perform(c.ABSOLUTE, None, timeout)

    def relative(self, *, timeout: float | None = None) -> T:
        """Let `move_to` mean increments, until `absolute` or a stop.

        They are added up on this side; the arm itself is never left in G91.
        """
        return self.perform(c.RELATIVE, None, timeout)

    def set_speed_mode(self, mode: c.SpeedMode, *, timeout: float | None = None) -> T:
        """Say how the arm runs through a series of motions: at constant speed, or each with its ramps.

        Args:
            mode: CONSTANT or RAMPED.
            timeout: Seconds.
        """
        return self.perform(c.SET_SPEED_MODE, c.ModeOfSpeed(mode), timeout)

    def suction(self, on: bool, *, timeout: float | None = None) -> T:
        """Start or stop the pump; see `pump` of `connect`. Manual 5, M22 and M23.

        Args:
            on: Whether to suck.
            timeout: Seconds.
        """
        starts = bool(on) == (self.pump == "manual")
        return self.perform(c.PUMP_ON if starts else c.PUMP_OFF, None, timeout)

    def gripper(self, closed: bool, *, speed: int = 200, timeout: float | None = None) -> T:
        """Close the gripper, or open it wide; see `gripper_to`. Manual 5, M25.

        Args:
            closed: Whether to close it.
            speed: 0 to 1500.
            timeout: Seconds.

        Raises:
            ValueError: The speed is out of range.
        """
        return self.gripper_to(0 if closed else 100, speed=speed, timeout=timeout)

    def gripper_to(
        self,
        percent: SupportsFloat,
        *,
        speed: int = 200,
        kind: c.GripperType | None = None,
        mode: c.GripperMode | None = None,
        timeout: float | None = None,
    ) -> T:
        """Open the gripper to 0 (closed) to 100 percent. Manual 5, M25.

        Done when it rests, at its opening or on what it holds, by firmware that tells where it is (M50); by other
        firmware when the arm has begun it.

        Args:
            percent: 0 to 100, rounded to whole ones.
            speed: 0 to 1500; 1 to 65 for the force gripper.
            kind: Which gripper, for firmware that knows several.
            mode: How the force gripper grips.
            timeout: Seconds.

        Raises:
            ValueError: A number is out of range.
        """
        opening = round(check_duration(percent, "percent", FULLY))
        return self.perform(c.SET_GRIPPER, c.GripperSet(opening, speed, kind, mode), timeout)

    def release_gripper(self, *, timeout: float | None = None) -> T:
        """Take the power off the gripper. Manual 5, M26."""
        return self.perform(c.RELEASE_GRIPPER, None, timeout)

    def laser(self, on: bool, *, timeout: float | None = None) -> T:
        """Switch the laser. Manual 5, M3 and M5.

        Args:
            on: Whether it burns.
            timeout: Seconds.
        """
        return self.perform(c.LASER_ON if on else c.LASER_OFF, None, timeout)

    def pwm(self, duty: int, *, timeout: float | None = None) -> T:
        """Set the laser's duty cycle, 0 to 255. Manual 5, M21.

        Args:
            duty: 0 to 255.
            timeout: Seconds.

        Raises:
            ValueError: It is out of range.
        """
        return self.perform(c.SET_PWM, c.PWM(duty), timeout)

    def fan(self, on: bool, *, timeout: float | None = None) -> T:
        """Switch the fan, which is on unless told otherwise; the motors need it. Manual 5, M27 and M28.

        Args:
            on: Whether it turns.
            timeout: Seconds.
        """
        return self.perform(c.FAN_ON if on else c.FAN_OFF, None, timeout)

    def power_on(self, *, timeout: float | None = None) -> T:
        """Let the motors hold; after that the arm has to be homed. Manual 5, M18."""
        return self.perform(c.POWER_ON, None, timeout)


def check_speed(speed: SupportsFloat | None) -> float | None:
    """Return a speed; raise ValueError or TypeError for one that the arm does not know."""
    if speed is None:
        return None

    found = to_float(speed, "speed")
    if not SLOWEST <= found <= FASTEST:
        raise ValueError(f"speed must be in {SLOWEST:g} to {FASTEST:g} mm/s, not {speed!r}")

    return found


def some(x: Axis, y: Axis, z: Axis, e: Axis) -> tuple[Axis, Axis, Axis, Axis]:
    """Return the axes; raise ValueError where there is none."""
    if x is y is z is e is None:
        raise ValueError("give at least one axis")

    return x, y, z, e
