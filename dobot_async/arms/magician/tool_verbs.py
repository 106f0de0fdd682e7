"""The verbs for a Magician's tools, pins, motors, times and settings; see `verbs`."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, Generic, TypeVar

from dobot_async._core.protocol.wire import Command
from dobot_async._core.util.arguments import check_duration
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.arguments import above_zero, to_address, to_choice, to_flag, to_number, to_whole
from dobot_async.errors import UnsupportedError

__all__ = ["ToolVerbs"]

LONGEST_WAIT = 4294967.295  # seconds; a u32 of milliseconds
FASTEST = 2**31 - 1  # pulses/s
LONGEST = 2**32 - 1  # pulses
T = TypeVar("T")
Q = TypeVar("Q")


class ToolVerbs(Generic[T]):
    """What is beside the motions; T is what each verb returns in its place.

    Raises:
        ValueError: Of each verb: an argument is out of range; nothing was sent.
        TypeError: An argument is of the wrong type.
    """

    @abstractmethod
    def perform(self, command: Command[Q, Any], value: Q, timeout: float | None) -> T:
        """Does, or queues, or collects a command."""

    def wait(self, seconds: float, *, timeout: float | None = None) -> T:
        """Holds the arm's queue for a time, to the millisecond. Manual 2.14.1.

        Args:
            seconds: 0 or more.
            timeout: Seconds.

        Raises:
            ValueError: It is below 0, not finite, or more than a WAIT can have.
        """
        return self.perform(c.SET_WAIT_CMD, c.WAITCmd(milliseconds(seconds)), timeout)

    def wait_for_input(self, address: int, *, level: bool = True, timeout: float | None = None) -> T:
        """Holds the arm's queue until a digital input (1 to 20) has a level. Manual 2.15.1.

        Args:
            address: 1 to 20, as the manual numbers the pins.
            level: True for high.
            timeout: Seconds.

        Raises:
            ValueError: The pin is not configured as an input.
        """
        value = c.TRIGCmd(
            to_address(address), c.TriggerMode.IO, c.TriggerIOCondition.EQUAL, int(to_flag("level", level))
        )
        return self.perform(c.SET_TRIG_CMD, value, timeout)

    def wait_for_adc(
        self, address: int, condition: c.TriggerADCCondition, threshold: int, *, timeout: float | None = None
    ) -> T:
        """Holds the arm's queue until an analog input (1 to 20) meets a condition (0 to 4095). Manual 2.15.1.

        Args:
            address: 1 to 20, as the manual numbers the pins.
            condition: How the input compares with the threshold.
            threshold: 0 to 4095.
            timeout: Seconds.

        Raises:
            ValueError: The pin is not configured as an analog input.
        """
        condition = to_choice("condition", condition, c.TriggerADCCondition)
        threshold = to_whole("threshold", threshold, 0, 4095)
        value = c.TRIGCmd(to_address(address), c.TriggerMode.ADC, condition, threshold)
        return self.perform(c.SET_TRIG_CMD, value, timeout)

    def suction(self, on: bool, *, pump: bool = True, timeout: float | None = None) -> T:
        """Sucks, or lets go; `pump=False` also switches the pump off. Manual 2.9.3.

        The arm acknowledges it at once; give the air some 0.3 s.

        Args:
            on: Whether to suck.
            pump: Whether its pump is on.
            timeout: Seconds.
        """
        value = c.EndEffectorSuctionCup(to_flag("pump", pump), to_flag("on", on))
        return self.perform(c.SET_END_EFFECTOR_SUCTION_CUP, value, timeout)

    def gripper(self, closed: bool, *, pump: bool = True, timeout: float | None = None) -> T:
        """Closes or opens the gripper; `pump=False` switches its pump off. Manual 2.9.4.

        The arm acknowledges it at once, and tells nothing of the gripper; give it some 0.5 s.

        Args:
            closed: Whether to close it.
            pump: Whether its pump is on.
            timeout: Seconds.
        """
        value = c.EndEffectorGripper(to_flag("pump", pump), to_flag("closed", closed))
        return self.perform(c.SET_END_EFFECTOR_GRIPPER, value, timeout)

    def gripper_to(self, percent: float, *, timeout: float | None = None) -> T:  # noqa: ARG002 - as other arms have it
        """Raises UnsupportedError: the gripper is moved by air, and is open or closed; see `gripper`."""
        raise UnsupportedError("a Magician's gripper is open or closed, nothing between: use gripper(closed)")

    def laser(self, on: bool, *, timeout: float | None = None) -> T:
        """Switches the laser. Manual 2.9.2.

        Args:
            on: Whether it burns.
            timeout: Seconds.
        """
        on = to_flag("on", on)
        return self.perform(c.SET_END_EFFECTOR_LASER, c.EndEffectorLaser(on, on), timeout)

    def configure_io(self, address: int, function: c.IOFunction, *, timeout: float | None = None) -> T:
        """Says what a pin (1 to 20) is used for; needed once before it is used. Manual 2.16.1.

        Args:
            address: 1 to 20, as the manual numbers the pins.
            function: What it is used for.
            timeout: Seconds.

        Raises:
            ValueError: An argument is out of range; nothing was sent.
        """
        value = c.IOMultiplexing(to_address(address), to_choice("function", function, c.IOFunction))
        return self.perform(c.SET_IO_MULTIPLEXING, value, timeout)

    def set_output(self, address: int, level: bool, *, timeout: float | None = None) -> T:
        """Sets a digital output (1 to 20). Manual 2.16.2.

        Args:
            address: 1 to 20, as the manual numbers the pins.
            level: True for high.
            timeout: Seconds.

        Raises:
            ValueError: The pin is not configured as an output.
        """
        return self.perform(c.SET_IODO, c.IODO(to_address(address), int(to_flag("level", level))), timeout)

    def set_pwm(self, address: int, frequency: float, duty_cycle: float, *, timeout: float | None = None) -> T:
        """Sets a PWM output (1 to 20): 10 Hz to 1 MHz, 0 to 100 percent. Manual 2.16.3.

        Args:
            address: 1 to 20, as the manual numbers the pins.
            frequency: Hz, 10 to 1,000,000.
            duty_cycle: Percent, 0 to 100.
            timeout: Seconds.

        Raises:
            ValueError: The pin is not configured for PWM.
        """
        value = c.IOPWM(
            to_address(address),
            to_number("frequency", frequency, 10, 1e6, "Hz"),
            to_number("duty_cycle", duty_cycle, 0, 100, "percent"),
        )
        return self.perform(c.SET_IOPWM, value, timeout)

    def conveyor(self, speed: int, *, distance: int | None = None, motor: int = 0, timeout: float | None = None) -> T:
        """Runs a stepper motor, such as a conveyor belt's. Manual 2.16.6.

        Args:
            speed: Pulses/s, negative backwards, 0 to stop. On the vendor's belt about 160 pulses are a mm.
            distance: Pulses after which it stops; None runs on.
            motor: 0 or 1.
            timeout: Seconds.

        Raises:
            ValueError: A number is out of range, or the speed is 0 with a distance.
            TypeError: One is not whole.
        """
        speed = to_whole("speed", speed, -FASTEST, FASTEST, "pulses/s")
        motor = to_whole("motor", motor, 0, 1)
        if distance is None:
            return self.perform(c.SET_E_MOTOR, c.EMotor(motor, speed != 0, speed), timeout)

        if not speed:
            raise ValueError("speed must not be 0 with a distance: it would never be over")

        pulses = to_whole("distance", distance, 0, LONGEST, "pulses")
        return self.perform(c.SET_E_MOTOR_S, c.EMotorS(motor, is_enabled=True, speed=speed, distance=pulses), timeout)

    def conveyor_mm(
        self,
        speed: float,
        *,
        pulses_per_mm: float,
        distance: float | None = None,
        motor: int = 0,
        timeout: float | None = None,
    ) -> T:
        """Runs a conveyor belt at mm/s, with your belt's own factor. Manual 2.16.6.

        Args:
            speed: mm/s, negative backwards, 0 to stop.
            pulses_per_mm: Measured: run 100,000 pulses by `conveyor`, and see how far the belt has come. The vendor's
                has about 160.
            distance: mm after which it stops; None runs on.
            motor: 0 or 1.
            timeout: Seconds.

        Raises:
            ValueError: A number is out of range, or the speed is below one pulse/s.
        """
        factor = above_zero("pulses_per_mm", pulses_per_mm)
        most = FASTEST / factor
        pulses = round(to_number("speed", speed, -most, most, "mm/s") * factor)
        if not pulses and speed:
            raise ValueError(f"speed must be at least one pulse/s, {1 / factor:.3g} mm/s, not {speed!r}")

        if distance is None:
            return self.conveyor(pulses, motor=motor, timeout=timeout)

        length = round(to_number("distance", distance, 0, LONGEST / factor, "mm") * factor)
        return self.conveyor(pulses, distance=length, motor=motor, timeout=timeout)

    def set_speed(self, velocity: float, acceleration: float | None = None, *, timeout: float | None = None) -> T:
        """Sets the ratios of all PTP motions from here on. Manual 2.11.4.

        Args:
            velocity: Percent of the velocities that the parameters say, above 0 and at most 100.
            acceleration: The same of the accelerations; as the velocity unless given.
            timeout: Seconds.

        Raises:
            ValueError: A ratio is not above 0 and at most 100.
        """
        most = velocity if acceleration is None else acceleration
        ratios = (
            percent("velocity", velocity),
            percent("velocity" if acceleration is None else "acceleration", most),
        )
        return self.perform(c.SET_PTP_COMMON_PARAMS, c.PTPCommonParams(*ratios), timeout)

    def set_home(self, x: float, y: float, z: float, r: float = 0.0, *, timeout: float | None = None) -> T:
        """Sets the place to which `home` drives from the switches, mm and degrees. Manual 2.6.1.

        Args:
            x: mm, forward.
            y: mm, to the left.
            z: mm, up.
            r: Degrees, the tool's rotation.
            timeout: Seconds.

        Raises:
            ValueError: A number is not finite.
        """
        numbers = (to_number(name, value) for name, value in (("x", x), ("y", y), ("z", z), ("r", r)))
        return self.perform(c.SET_HOME_PARAMS, c.HOMEParams(*numbers), timeout)


def percent(name: str, value: float) -> float:
    """A ratio above 0 and at most 100 percent."""
    if to_number(name, value, most=100, unit="percent") <= 0:
        raise ValueError(f"{name} must be above 0 percent, not {value!r}: an arm that has none never arrives")

    return float(value)


def milliseconds(seconds: float) -> int:
    """Return whole milliseconds; raise ValueError or TypeError for seconds that a WAIT cannot have."""
    return round(1000 * check_duration(seconds, "seconds", LONGEST_WAIT))
