"""The verbs of a myCobot, written once and used in three places.

    arm.move_joints(...)          returns when the arm has done it
    arm.queue.move_joints(...)    returns a Motion at once; the queue is on this side, for the arm has none
    batch.move_joints(...)        returns a Motion that is queued with its batch

Lengths are mm, angles degrees, times seconds, speeds 1 to 100 percent. Wrong arguments raise ValueError or TypeError
before a byte is sent. `timeout` is the whole motion's on the arm, the wait for room in the queue; a batch has its own.

A motion that did not happen raises: ArmAlarm with what the arm tells, CommandRejected if the arm did not move,
MotionStopped if it came to rest elsewhere, MotionUnknown or ReplyTimeout if the arm is silent.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, Generic, SupportsFloat, TypeVar

from dobot_async._core.protocol.wire import Command
from dobot_async._core.util.arguments import to_float
from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.models import AXES, CobotModel
from dobot_async.arms.mycobot.pose import CobotPose
from dobot_async.arms.mycobot.targets import MOVE_PARTLY, SUCTION, WAIT, PartOfMove, coordinates, of_pose

__all__ = ["Axis", "Verbs", "axis_number"]

T = TypeVar("T")
Q = TypeVar("Q")
SPEED = 50
Axis = str
"""One of x, y, z, rx, ry, rz."""


class Verbs(Generic[T]):
    """What one can tell the arm to do; T is what each verb returns in its place. A speed is 1 to 100 percent.

    Raises:
        ValueError: Of each verb: a number is out of range, or the model has no such command; nothing was sent.
        TypeError: Something is of the wrong type.
    """

    @property
    @abstractmethod
    def model(self) -> CobotModel:
        """What the arm is."""

    @abstractmethod
    def perform(self, command: Command[Q, Any], value: Q, timeout: float | None) -> T:
        """Do, or queues, or collects a command."""

    def home(self, *, speed: int = 10, timeout: float | None = None) -> T:
        """Move all joints to 0 degrees; these arms need no calibration after power-up.

        Args:
            speed: Percent, 1 to 100.
            timeout: Seconds.
        """
        return self.move_joints(*(0.0,) * self.model.joints, speed=speed, timeout=timeout)

    def move_joints(self, *angles: float, speed: int = SPEED, timeout: float | None = None) -> T:
        """Move all joints, one angle for each, within the model's limits.

        Args:
            *angles: Degrees, from the base on.
            speed: Percent, 1 to 100.
            timeout: Seconds.
        """
        return self.perform(c.SEND_ANGLES, c.JointsMove(angles, speed), timeout)

    def move_joint(self, joint: int, angle: float, *, speed: int = SPEED, timeout: float | None = None) -> T:
        """Move one joint (from 1) to an angle.

        Args:
            joint: From 1.
            angle: Degrees.
            speed: Percent, 1 to 100.
            timeout: Seconds.
        """
        return self.perform(c.SEND_ANGLE, c.JointMove(joint, angle, speed), timeout)

    def step_joint(self, joint: int, degrees: float, *, speed: int = SPEED, timeout: float | None = None) -> T:
        """Move one joint (from 1) by degrees.

        Args:
            joint: From 1.
            degrees: Either way.
            speed: Percent, 1 to 100.
            timeout: Seconds.
        """
        return self.perform(c.JOG_INCREMENT, c.JointMove(joint, degrees, speed), timeout)

    def move_to(
        self,
        x: SupportsFloat | CobotPose | c.Coords | None = None,
        y: SupportsFloat | None = None,
        z: SupportsFloat | None = None,
        rx: SupportsFloat | None = None,
        ry: SupportsFloat | None = None,
        rz: SupportsFloat | None = None,
        *,
        speed: int = SPEED,
        mode: c.MoveMode | None = c.MoveMode.ANGULAR,
        timeout: float | None = None,
    ) -> T:
        """Move the tool to a point, in the frames that are set.

        Coordinates that are not given stay as they are: as the target of the motion right before it in the queue has
        them, if that gave all of them, else as the arm has them when it is the motion's turn.

        Args:
            x: mm, within the model's reach; or a pose, and then no other coordinate.
            y: mm.
            z: mm.
            rx: Degrees, -180 to 180; of a myPalletizer its one angle.
            ry: Degrees; a myPalletizer has none.
            rz: Degrees; a myPalletizer has none.
            speed: Percent.
            mode: ANGULAR moves the joints, LINEAR the tool along a straight line; None as `set_movement_type` says. An
                arm goes along a line only in fresh mode 0, so LINEAR sets that mode first. With None it is the
                caller's affair: `request(c.SET_FRESH_MODE, False)`.
            timeout: Seconds.

        Raises:
            ValueError: A coordinate is out of range, or nothing is given, or a pose and coordinates.
        """
        if isinstance(x, (CobotPose, c.Coords)):
            if any(each is not None for each in (y, z, rx, ry, rz)):
                raise ValueError("give a pose, or coordinates, not both")

            given: dict[str, Any] = {axis: value for axis, value in of_pose(x).items() if axis in self.model.words}
        else:
            given = {"x": x, "y": y, "z": z, "rx": rx, "ry": ry, "rz": rz}

        coords = self._coordinates(given)
        whole = tuple(each for each in coords if each is not None)
        if len(whole) == len(coords):
            return self.perform(c.SEND_COORDS, c.ToMove(whole, speed, mode), timeout)

        if not whole:
            raise ValueError("move_to needs a coordinate at least, or a pose")

        return self.perform(MOVE_PARTLY, PartOfMove(coords, speed, mode), timeout)

    def move_by(
        self,
        x: SupportsFloat = 0.0,
        y: SupportsFloat = 0.0,
        z: SupportsFloat = 0.0,
        rx: SupportsFloat | None = None,
        ry: SupportsFloat | None = None,
        rz: SupportsFloat | None = None,
        *,
        speed: int = SPEED,
        mode: c.MoveMode | None = c.MoveMode.ANGULAR,
        timeout: float | None = None,
    ) -> T:
        """Move the tool by so much, from where the motion before it ends; the target is checked, not the step.

        Args:
            x: mm.
            y: mm.
            z: mm.
            rx: Degrees; of a myPalletizer its one angle.
            ry: Degrees; a myPalletizer has none.
            rz: Degrees; a myPalletizer has none.
            speed: Percent.
            mode: As for `move_to`.
            timeout: Seconds.

        Raises:
            CommandRejected: The target is out of the model's range, or of the limits that were given; nothing was sent.
        """
        coords = self._coordinates({"x": x, "y": y, "z": z, "rx": rx, "ry": ry, "rz": rz})
        return self.perform(MOVE_PARTLY, PartOfMove(coords, speed, mode, relative=True), timeout)

    def move_coord(self, axis: Axis, value: float, *, speed: int = SPEED, timeout: float | None = None) -> T:
        """Move the tool along one axis (x, y, z, rx, ry, rz) to a coordinate; the others stay as they are.

        Args:
            axis: One of x, y, z, rx, ry, rz.
            value: mm or degrees.
            speed: Percent, 1 to 100.
            timeout: Seconds.
        """
        return self.perform(c.SEND_COORD, c.CoordMove(axis_number(axis), value, speed), timeout)

    def step_coord(self, axis: Axis, value: float, *, speed: int = SPEED, timeout: float | None = None) -> T:
        """Move the tool along one axis by mm or degrees; not on a myArm 300 or a myPalletizer.

        Args:
            axis: One of x, y, z, rx, ry, rz.
            value: mm or degrees, either way.
            speed: Percent, 1 to 100.
            timeout: Seconds.
        """
        return self.perform(c.JOG_INCREMENT_COORD, c.CoordStep(axis_number(axis), value, speed), timeout)

    def move_elbow(self, angle: float, *, speed: int = SPEED, timeout: float | None = None) -> T:
        """Turn the elbow of a myArm 300 about the line from shoulder to wrist, and leave the tool where it is.

        Args:
            angle: Degrees.
            speed: Percent, 1 to 100.
            timeout: Seconds.
        """
        return self.perform(c.SET_SOLUTION_ANGLES, c.SetSolutionAngle(angle, speed), timeout)

    def move_encoders(self, *encoders: int, speed: int = SPEED, timeout: float | None = None) -> T:
        """Move all servos to positions of 0 to 4096; 2048 is 0 degrees. Joint limits are not looked at.

        Args:
            *encoders: 0 to 4096, one for each joint.
            speed: Percent, 1 to 100.
            timeout: Seconds.
        """
        return self.perform(c.SET_ENCODERS, c.SetEncoders(encoders, speed), timeout)

    def wait(self, seconds: float, *, timeout: float | None = None) -> T:
        """Hold the queue for a time.

        Args:
            seconds: 0 or more; fractions count.
            timeout: Seconds.
        """
        return self.perform(WAIT, seconds, timeout)

    def gripper(
        self, closed: bool, *, speed: int = SPEED, kind: c.GripperType | None = None, timeout: float | None = None
    ) -> T:
        """Close or open the gripper; done when it was seen to rest.

        Args:
            closed: Whether to close it. It may come to rest on a piece.
            speed: Percent.
            kind: Which gripper it is, where the firmware has to be told.
            timeout: Seconds.

        Raises:
            CommandRejected: It did not move, or there is none.
            MotionStopped: It was to open, and came to rest before that.
            MotionUnknown: It does not come to rest.
        """
        state = c.GripperState.CLOSED if closed else c.GripperState.OPEN
        return self.perform(c.SET_GRIPPER_STATE, c.SetGripperState(state, speed, kind), timeout)

    def gripper_to(
        self,
        percent: SupportsFloat,
        *,
        speed: int = SPEED,
        kind: c.GripperType | None = None,
        timeout: float | None = None,
    ) -> T:
        """Open the gripper to 0 (closed) to 100 (open) percent, in whole ones; see `gripper`.

        Args:
            percent: 0 to 100.
            speed: Percent, 1 to 100.
            kind: Which gripper it is, where the firmware has to be told.
            timeout: Seconds.
        """
        value = to_float(percent, "percent")
        if not 0 <= value <= 100:
            raise ValueError(f"percent must be in 0 (closed) to 100 (open), not {percent!r}")

        return self.perform(c.SET_GRIPPER_VALUE, c.SetGripperValue(round(value), speed, kind), timeout)

    def suction(self, on: bool, *, timeout: float | None = None) -> T:  # noqa: ARG002 - as other arms have it
        """Raise UnsupportedError: these arms have no pump of their own."""
        return self.perform(SUCTION, self.model.title, timeout)

    def color(self, red: int, green: int, blue: int, *, timeout: float | None = None) -> T:
        """Set the light of the Atom, 0 to 255 each."""
        return self.perform(c.SET_COLOR, c.RGB(red, green, blue), timeout)

    def configure_pin(self, pin: int, mode: c.PinMode, *, timeout: float | None = None) -> T:
        """Say what a pin of the Atom, at the tool, is used for.

        Args:
            pin: Its number, on the Atom.
            mode: Input, output, or input with a pull-up resistor.
            timeout: Seconds.
        """
        return self.perform(c.SET_PIN_MODE, c.PinModeSetting(pin, mode), timeout)

    def set_pin(self, pin: int, level: bool, *, base: bool = False, timeout: float | None = None) -> T:
        """Set a pin of the Atom, at the tool, or of the M5 in the base; high for whatever is true.

        Args:
            pin: Its number, on the Atom or the M5.
            level: True for high.
            base: Whether it is one of the M5.
            timeout: Seconds.
        """
        row = c.SET_BASIC_OUTPUT if base else c.SET_DIGITAL_OUTPUT
        return self.perform(row, c.PinLevel(pin, int(bool(level))), timeout)

    def set_pwm(self, pin: int, frequency: int, duty_cycle: int, *, timeout: float | None = None) -> T:
        """Set a PWM output of the Atom: Hz, and 0 to 255 parts of 256.

        Args:
            pin: Its number, on the Atom.
            frequency: Hz, 0 to 65535.
            duty_cycle: 0 to 255 parts of 256.
            timeout: Seconds.
        """
        return self.perform(c.SET_PWM_OUTPUT, c.PWMOutput(pin, frequency, duty_cycle), timeout)

    def _coordinates(self, given: dict[str, Any]) -> tuple[float | None, ...]:
        """What was given, in the order of this arm's axes."""
        return coordinates(len(self.model.reach), self.model.title, **{**dict.fromkeys(AXES), **given})


def axis_number(axis: Axis) -> int:
    """Return the number of an axis, from 1; raise ValueError for another word."""
    if axis not in AXES:
        raise ValueError(f"an axis is one of {', '.join(AXES)}, not {axis!r}")

    return AXES.index(axis) + 1
