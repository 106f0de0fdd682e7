"""The verbs of a Magician, written once and used in three places.

    arm.move_to(...)          returns when the arm has done it
    arm.queue.move_to(...)    returns a Motion once the arm has accepted it
    batch.move_to(...)        returns a Motion that is sent with its batch

Lengths are mm, angles degrees, times seconds, ratios percent. Wrong arguments raise ValueError or TypeError at once.
`timeout` is the whole motion's on the arm, the wait for room in the queue; a batch has its own.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, Generic, TypeVar

from dobot_async._core.util.arguments import check_duration
from dobot_async.magician import commands as c
from dobot_async.wire import Command

__all__ = ["Verbs"]

LONGEST_WAIT = 4294967.295  # seconds; a u32 of milliseconds
T = TypeVar("T")
Q = TypeVar("Q")


class Verbs(Generic[T]):
    """What one can tell the arm to do; T is what each verb returns in its place."""

    @abstractmethod
    def perform(self, command: Command[Q, Any], value: Q, timeout: float | None) -> T:
        """Does, or queues, or collects a command."""

    def home(self, *, timeout: float | None = None) -> T:
        """Drives to the home position and sets the encoders there; takes tens of seconds. Manual 2.6.2."""
        return self.perform(c.SET_HOME_CMD, c.HOMECmd(), timeout)

    def move_to(
        self,
        x: float,
        y: float,
        z: float,
        r: float = 0.0,
        *,
        mode: c.PTPMode = c.PTPMode.MOVJ_XYZ,
        l: float | None = None,
        timeout: float | None = None,
    ) -> T:
        """Moves the tool to a point. Manual 2.11.5.

        Args:
            x: mm, forward.
            y: mm, to the left.
            z: mm, up.
            r: Degrees, the tool's rotation.
            mode: How it gets there. An ANGLE mode reads the four numbers as joints, an INC mode as increments.
            l: mm along the rail, for an arm that stands on one.
            timeout: Seconds.
        """
        if l is None:
            return self.perform(c.SET_PTP_CMD, c.PTPCmd(mode, x, y, z, r), timeout)

        return self.perform(c.SET_PTP_WITH_L_CMD, c.PTPWithLCmd(mode, x, y, z, r, l), timeout)

    def move_joints(
        self,
        j1: float,
        j2: float,
        j3: float,
        j4: float,
        *,
        mode: c.PTPMode = c.PTPMode.MOVJ_ANGLE,
        timeout: float | None = None,
    ) -> T:
        """Moves the joints to angles in degrees. Manual 2.11.5."""
        return self.perform(c.SET_PTP_CMD, c.PTPCmd(mode, j1, j2, j3, j4), timeout)

    def move_by(
        self,
        x: float = 0.0,
        y: float = 0.0,
        z: float = 0.0,
        r: float = 0.0,
        *,
        mode: c.PTPMode = c.PTPMode.MOVL_INC,
        timeout: float | None = None,
    ) -> T:
        """Moves the tool by mm and degrees from where it will be then. Manual 2.11.5."""
        return self.perform(c.SET_PTP_CMD, c.PTPCmd(mode, x, y, z, r), timeout)

    def arc(
        self,
        via: tuple[float, float, float, float],
        to: tuple[float, float, float, float],
        *,
        timeout: float | None = None,
    ) -> T:
        """Moves along the circular arc from here through `via` to `to`, each (x, y, z, r). Manual 2.13.2."""
        return self.perform(c.SET_ARC_CMD, c.ARCCmd(c.ARCPoint(*via), c.ARCPoint(*to)), timeout)

    def circle(
        self,
        via: tuple[float, float, float, float],
        to: tuple[float, float, float, float],
        *,
        count: int = 1,
        timeout: float | None = None,
    ) -> T:
        """Moves `count` times around the circle through here, `via` and `to`, each (x, y, z, r)."""
        return self.perform(c.SET_CIRCLE_CMD, c.CircleCmd(c.ARCPoint(*via), c.ARCPoint(*to), count), timeout)

    def path_to(self, x: float, y: float, z: float, *, relative: bool = False, timeout: float | None = None) -> T:
        """Moves on along a continuous path (CP), without a halt if the next point is queued in time. Manual 2.12.2."""
        mode = c.CPMode.RELATIVE if relative else c.CPMode.ABSOLUTE
        return self.perform(c.SET_CP_CMD, c.CPCmd(mode, x, y, z), timeout)

    def engrave_to(
        self, x: float, y: float, z: float, power: float, *, relative: bool = False, timeout: float | None = None
    ) -> T:
        """Moves on along a continuous path with the laser at 0 to 100 percent (CPLE). Manual 2.12.3."""
        mode = c.CPMode.RELATIVE if relative else c.CPMode.ABSOLUTE
        return self.perform(c.SET_CPLE_CMD, c.CPLECmd(mode, x, y, z, power), timeout)

    def wait(self, seconds: float, *, timeout: float | None = None) -> T:
        """Holds the arm's queue for a time, to the millisecond. Manual 2.14.1."""
        return self.perform(c.SET_WAIT_CMD, c.WAITCmd(milliseconds(seconds)), timeout)

    def wait_for_input(self, address: int, *, level: bool = True, timeout: float | None = None) -> T:
        """Holds the arm's queue until a digital input (1 to 20) has a level. Manual 2.15.1."""
        condition = c.TriggerIOCondition.EQUAL
        return self.perform(c.SET_TRIG_CMD, c.TRIGCmd(address, c.TriggerMode.IO, condition, int(level)), timeout)

    def wait_for_adc(
        self,
        address: int,
        condition: c.TriggerADCCondition,
        threshold: int,
        *,
        timeout: float | None = None,
    ) -> T:
        """Holds the arm's queue until an analog input (1 to 20) meets a condition (0 to 4095). Manual 2.15.1."""
        return self.perform(c.SET_TRIG_CMD, c.TRIGCmd(address, c.TriggerMode.ADC, condition, threshold), timeout)

    def suction(self, on: bool, *, pump: bool = True, timeout: float | None = None) -> T:
        """Sucks, or lets go; `pump=False` also switches the pump off. Manual 2.9.3."""
        return self.perform(c.SET_END_EFFECTOR_SUCTION_CUP, c.EndEffectorSuctionCup(pump, on), timeout)

    def gripper(self, closed: bool, *, pump: bool = True, timeout: float | None = None) -> T:
        """Closes or opens the gripper; `pump=False` switches its pump off. Manual 2.9.4."""
        return self.perform(c.SET_END_EFFECTOR_GRIPPER, c.EndEffectorGripper(pump, closed), timeout)

    def laser(self, on: bool, *, timeout: float | None = None) -> T:
        """Switches the laser. Manual 2.9.2."""
        return self.perform(c.SET_END_EFFECTOR_LASER, c.EndEffectorLaser(on, on), timeout)

    def configure_io(self, address: int, function: c.IOFunction, *, timeout: float | None = None) -> T:
        """Says what a pin (1 to 20) is used for; needed once before it is used. Manual 2.16.1."""
        return self.perform(c.SET_IO_MULTIPLEXING, c.IOMultiplexing(address, function), timeout)

    def set_output(self, address: int, level: bool, *, timeout: float | None = None) -> T:
        """Sets a digital output (1 to 20). Manual 2.16.2."""
        return self.perform(c.SET_IODO, c.IODO(address, level), timeout)

    def set_pwm(self, address: int, frequency: float, duty_cycle: float, *, timeout: float | None = None) -> T:
        """Sets a PWM output (1 to 20): 10 Hz to 1 MHz, 0 to 100 percent. Manual 2.16.3."""
        return self.perform(c.SET_IOPWM, c.IOPWM(address, frequency, duty_cycle), timeout)

    def conveyor(self, speed: int, *, distance: int | None = None, motor: int = 0, timeout: float | None = None) -> T:
        """Runs a stepper motor, such as a conveyor belt's. Manual 2.16.6.

        Args:
            speed: Pulses/s, negative backwards, 0 to stop. On the vendor's belt about 160 pulses are a mm.
            distance: Pulses after which it stops; None runs on.
            motor: 0 or 1.
            timeout: Seconds.
        """
        if distance is None:
            return self.perform(c.SET_E_MOTOR, c.EMotor(motor, speed != 0, speed), timeout)

        return self.perform(c.SET_E_MOTOR_S, c.EMotorS(motor, is_enabled=True, speed=speed, distance=distance), timeout)

    def set_speed(self, velocity: float, acceleration: float | None = None, *, timeout: float | None = None) -> T:
        """Sets the ratios (0 to 100 percent) of all PTP motions from here on. Manual 2.11.4."""
        for name, ratio in {"velocity": velocity, "acceleration": acceleration}.items():
            if ratio is not None and not ratio > 0:
                raise ValueError(f"{name} must be above 0 percent, not {ratio!r}: an arm that has none never arrives")

        ratios = c.PTPCommonParams(velocity, velocity if acceleration is None else acceleration)
        return self.perform(c.SET_PTP_COMMON_PARAMS, ratios, timeout)


def milliseconds(seconds: float) -> int:
    """Return whole milliseconds; raise ValueError or TypeError for seconds that a WAIT cannot have."""
    return round(1000 * check_duration(seconds, "seconds", LONGEST_WAIT))
