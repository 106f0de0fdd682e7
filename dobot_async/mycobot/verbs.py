"""The verbs of a myCobot, written once and used in three places.

    arm.move_joints(...)          returns when the arm has done it
    arm.queue.move_joints(...)    returns a Motion at once; the queue is on this side, for the arm has none
    batch.move_joints(...)        returns a Motion that is queued with its batch

Lengths are mm, angles degrees, times seconds, speeds 1 to 100 percent. Wrong arguments raise ValueError or TypeError at
once. `timeout` is the whole motion's on the arm, the wait for room in the queue; a batch has its own.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, Generic, TypeVar

from dobot_async.mycobot import commands as c
from dobot_async.mycobot.executor import WAIT
from dobot_async.mycobot.models import AXES, CobotModel
from dobot_async.wire import Command

__all__ = ["Axis", "Verbs", "axis_number"]

T = TypeVar("T")
Q = TypeVar("Q")
SPEED = 50
Axis = str
"""One of x, y, z, rx, ry, rz."""


class Verbs(Generic[T]):
    """What one can tell the arm to do; T is what each verb returns in its place."""

    @property
    @abstractmethod
    def model(self) -> CobotModel:
        """What the arm is."""

    @abstractmethod
    def perform(self, command: Command[Q, Any], value: Q, timeout: float | None) -> T:
        """Do, or queues, or collects a command."""

    def home(self, *, speed: int = 10, timeout: float | None = None) -> T:
        """Move all joints to 0 degrees; these arms need no calibration after power-up."""
        return self.move_joints(*(0.0,) * self.model.joints, speed=speed, timeout=timeout)

    def move_joints(self, *angles: float, speed: int = SPEED, timeout: float | None = None) -> T:
        """Move all joints, one angle for each, within the model's limits."""
        return self.perform(c.SEND_ANGLES, c.JointsMove(angles, speed), timeout)

    def move_joint(self, joint: int, angle: float, *, speed: int = SPEED, timeout: float | None = None) -> T:
        """Move one joint (from 1) to an angle."""
        return self.perform(c.SEND_ANGLE, c.JointMove(joint, angle, speed), timeout)

    def step_joint(self, joint: int, degrees: float, *, speed: int = SPEED, timeout: float | None = None) -> T:
        """Move one joint (from 1) by degrees."""
        return self.perform(c.JOG_INCREMENT, c.JointMove(joint, degrees, speed), timeout)

    def move_to(
        self,
        x: float,
        y: float,
        z: float,
        *rotation: float,
        speed: int = SPEED,
        mode: c.MoveMode | None = c.MoveMode.ANGULAR,
        timeout: float | None = None,
    ) -> T:
        """Move the tool to a point.

        Args:
            x: mm.
            y: mm.
            z: mm.
            rotation: rx, ry, rz in degrees; of a myPalletizer its one angle.
            speed: Percent.
            mode: ANGULAR moves the joints, LINEAR the tool along a straight line; None as `set_movement_type` says.
            timeout: Seconds.
        """
        return self.perform(c.SEND_COORDS, c.ToMove((x, y, z, *rotation), speed, mode), timeout)

    def move_coord(self, axis: Axis, value: float, *, speed: int = SPEED, timeout: float | None = None) -> T:
        """Move the tool along one axis (x, y, z, rx, ry, rz) to a coordinate; the others stay as they are."""
        return self.perform(c.SEND_COORD, c.CoordMove(axis_number(axis), value, speed), timeout)

    def step_coord(self, axis: Axis, value: float, *, speed: int = SPEED, timeout: float | None = None) -> T:
        """Move the tool along one axis by mm or degrees; not on a myArm 300 or a myPalletizer."""
        return self.perform(c.JOG_INCREMENT_COORD, c.CoordStep(axis_number(axis), value, speed), timeout)

    def move_elbow(self, angle: float, *, speed: int = SPEED, timeout: float | None = None) -> T:
        """Turn the elbow of a myArm 300 about the line from shoulder to wrist, and leaves the tool where it is."""
        return self.perform(c.SET_SOLUTION_ANGLES, c.SetSolutionAngle(angle, speed), timeout)

    def move_encoders(self, *encoders: int, speed: int = SPEED, timeout: float | None = None) -> T:
        """Move all servos to positions of 0 to 4096; 2048 is 0 degrees. Joint limits are not looked at."""
        return self.perform(c.SET_ENCODERS, c.SetEncoders(encoders, speed), timeout)

    def wait(self, seconds: float, *, timeout: float | None = None) -> T:
        """Hold the queue for a time."""
        return self.perform(WAIT, seconds, timeout)

    def gripper(
        self, closed: bool, *, speed: int = SPEED, kind: c.GripperType | None = None, timeout: float | None = None
    ) -> T:
        """Close or opens the gripper."""
        state = c.GripperState.CLOSED if closed else c.GripperState.OPEN
        return self.perform(c.SET_GRIPPER_STATE, c.SetGripperState(state, speed, kind), timeout)

    def gripper_to(
        self, value: int, *, speed: int = SPEED, kind: c.GripperType | None = None, timeout: float | None = None
    ) -> T:
        """Open the gripper to 0 (closed) to 100 (open) percent."""
        return self.perform(c.SET_GRIPPER_VALUE, c.SetGripperValue(value, speed, kind), timeout)

    def color(self, red: int, green: int, blue: int, *, timeout: float | None = None) -> T:
        """Set the light of the Atom, 0 to 255 each."""
        return self.perform(c.SET_COLOR, c.RGB(red, green, blue), timeout)

    def configure_pin(self, pin: int, mode: c.PinMode, *, timeout: float | None = None) -> T:
        """Say what a pin of the Atom, at the tool, is used for."""
        return self.perform(c.SET_PIN_MODE, c.PinModeSetting(pin, mode), timeout)

    def set_pin(self, pin: int, level: bool, *, base: bool = False, timeout: float | None = None) -> T:
        """Set a pin of the Atom, at the tool, or of the M5 in the base."""
        row = c.SET_BASIC_OUTPUT if base else c.SET_DIGITAL_OUTPUT
        return self.perform(row, c.PinLevel(pin, int(level)), timeout)

    def set_pwm(self, pin: int, frequency: int, duty_cycle: int, *, timeout: float | None = None) -> T:
        """Set a PWM output of the Atom: Hz, and 0 to 255 parts of 256."""
        return self.perform(c.SET_PWM_OUTPUT, c.PWMOutput(pin, frequency, duty_cycle), timeout)


def axis_number(axis: Axis) -> int:
    """Return the number of an axis, from 1; raise ValueError for another word."""
    if axis not in AXES:
        raise ValueError(f"an axis is one of {', '.join(AXES)}, not {axis!r}")

    return AXES.index(axis) + 1
