"""The methods that pydobot and pydobotplus share; `pydobot` and `pydobotplus` add what they do differently."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable
from types import TracebackType
from typing import Self

from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.alarms import decode
from dobot_async.compat._dobot_raw import RawDobot
from dobot_async.compat._dobot_types import Alarm, GPIOPort, Joints, Pose, Position, WrongParameter
from dobot_async.compat._session import CompatSession

__all__ = ["BaseDobot"]

STEPS = 360.0 / 1.8 * 10.0 * 16.0
"""Pulses of a turn of the belt's motor, as `conveyor_belt` counts them; `conveyor_belt_distance` counts half."""

FULL_SPEED = 50.0  # mm/s; a speed of 1.0
ROLLER, DISTANCE_ROLLER = 36.0 * math.pi, 34.0 * math.pi  # mm of a turn, as either of them counts them
FASTEST_BELT = 100.0  # mm/s
JOG_ACCELERATION = 100.0  # mm/s² and degrees/s²
PINS = range(1, 21)


class BaseDobot(RawDobot):
    """A Magician, by the names of pydobot and pydobotplus.

    Args:
        port: A port's name ("COM3", "/dev/ttyUSB0"), an address or a URL; nothing for the first arm that there is.

    Raises:
        ConnectFailed: No arm answered.
    """

    def __init__(self, port: str | None = None) -> None:
        self.session: CompatSession = CompatSession(port)
        with self.session.opening():
            self._set_ptp_joint_params(200, 200, 200, 200, 200, 200, 200, 200)
            self._set_ptp_coordinate_params(velocity=200, acceleration=200)
            self._set_ptp_jump_params(10, 200)
            self._set_ptp_common_params(velocity=100, acceleration=100)

    def close(self) -> None:
        """Wait for what was queued, and disconnect; while an error is being handled, stop the arm instead.

        Raises:
            DobotError: What was queued has failed.
        """
        self.session.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.session.leave(error)

    def get_pose(self) -> Pose:
        """Return where the tool is (mm, degrees), and the joints (degrees)."""
        pose = self.session.read(c.GET_POSE)
        return Pose(Position(pose.x, pose.y, pose.z, pose.r), Joints(*pose.joints))

    def get_alarms(self) -> set[Alarm]:
        """Return the alarms that are set."""
        return set(map(Alarm, decode(self.session.alarms())))

    def clear_alarms(self) -> None:
        """Clear the alarms; what the arm was doing when they came up does not go on."""
        self.session.clear_alarms()

    def wait_for_cmd(self, cmd_id: int) -> None:
        """Return when the command of an index is executed.

        Raises:
            DobotError: It was not executed.
        """
        self.session.wait_for(cmd_id)

    def suck(self, enable: bool) -> int:
        """Suck, or let go, in its turn; give the air some 0.3 s. Returns its index."""
        return self._set_end_effector_suction_cup(enable)

    def grip(self, enable: bool) -> int:
        """Close or open the gripper, in its turn; give it some 0.5 s. Returns its index."""
        return self._set_end_effector_gripper(enable)

    def laze(self, power: float = 0, enable: bool = False) -> int:
        """Switch the laser, in its turn; it is on or off, whatever the power. Returns its index."""
        return self._set_end_effector_laser(power, enable)

    def speed(self, velocity: float = 100.0, acceleration: float = 100.0) -> None:
        """Set percentages and mm/s (mm/s²) from the same numbers, for what is queued from here on."""
        self._set_speed(velocity, acceleration)

    def wait(self, ms: float) -> int:
        """Let the arm wait, in ms, in its turn. Returns its index."""
        return self._set_wait_cmd(ms)

    def set_home(self, x: float, y: float, z: float, r: float = 0.0) -> None:
        """Set where the arm stands after homing."""
        self._set_home_coordinate(x, y, z, r)

    def home(self) -> int:
        """Home the arm, in its turn; `wait_for_cmd` waits for it. Returns its index."""
        return self._set_home_cmd()

    def go(self, x: float, y: float, z: float, r: float = 0.0) -> None:
        """Move in a straight line, in its turn; deprecated by pydobot."""
        warnings.warn("go() is deprecated, use move_to() instead", DeprecationWarning, stacklevel=2)
        self._set_ptp_cmd(x, y, z, r, mode=c.PTPMode.MOVL_XYZ)

    def move_rel(
        self,
        x: float = 0,
        y: float = 0,
        z: float = 0,
        r: float = 0,
        wait: bool = True,
    ) -> None:
        """Move by mm and degrees from where the arm stands now.

        Args:
            x: mm.
            y: mm.
            z: mm.
            r: Degrees.
            wait: Return when it is done, and not once the arm has accepted it.
        """
        here = self.get_pose().position
        self._set_ptp_cmd(here.x + x, here.y + y, here.z + z, here.r + r, c.PTPMode.MOVJ_XYZ, wait)

    def go_arc(
        self, x: float, y: float, z: float, r: float, cir_x: float, cir_y: float, cir_z: float, cir_r: float
    ) -> int:
        """Move along the arc through the second point to the first, in its turn. Returns its index."""
        return self._set_arc_cmd(x, y, z, r, cir_x, cir_y, cir_z, cir_r)

    def jog_x(self, v: float) -> None:
        """Jog along x at mm/s, negative backwards, once what is queued is done; 0 ends it at once."""
        self._jog(0, v)

    def jog_y(self, v: float) -> None:
        """Jog along y, as `jog_x`."""
        self._jog(1, v)

    def jog_z(self, v: float) -> None:
        """Jog along z, as `jog_x`."""
        self._jog(2, v)

    def jog_r(self, v: float) -> None:
        """Jog around r, degrees/s, as `jog_x`."""
        self._jog(3, v)

    def set_io(self, address: int, state: bool) -> None:
        """Set a digital output (1 to 20), in its turn, and return when it is set.

        A pin without a function becomes an output first.

        Raises:
            WrongParameter: There is no such pin, or it has another function.
        """
        if address not in PINS:
            raise WrongParameter(f"address must be a pin, {PINS[0]} to {PINS[-1]}, not {address!r}")

        function = self.session.read(c.GET_IO_MULTIPLEXING, address).multiplex
        if function is c.IOFunction.DUMMY:
            self.session.put(c.SET_IO_MULTIPLEXING, c.IOMultiplexing(address, c.IOFunction.DO))
        elif function is not c.IOFunction.DO:
            raise WrongParameter(f"pin {address} is configured as {function.name}, not as an output: nothing was set")

        self.session.run(c.SET_IODO, c.IODO(address, int(bool(state))))

    def set_eio(self, addr: int, val: int) -> None:
        """Set a digital output, as `set_io`."""
        self.set_io(addr, bool(val))

    def get_eio(self, addr: int) -> int:
        """Return the level that a digital output was set to."""
        return self.session.read(c.GET_IODO, addr).level

    def set_hht_trig_output(self, state: bool) -> None:
        """Say whether points are recorded while the arm is led by hand."""
        self.session.write(c.SET_HHT_TRIG_OUTPUT_ENABLED, bool(state))

    def get_hht_trig_output(self) -> bool:
        """Return whether points are recorded while the arm is led by hand."""
        return self.session.read(c.GET_HHT_TRIG_OUTPUT_ENABLED)

    def conveyor_belt(self, speed: float, direction: int = 1, interface: int = 0) -> None:
        """Run the belt, in its turn, at a share (0 to 1) of 50 mm/s, in a direction (1 or -1), until told otherwise."""
        if not 0.0 <= speed <= 1.0 or direction not in {1, -1}:
            raise WrongParameter(f"speed is 0 to 1, and direction 1 or -1, not {speed!r} and {direction!r}")

        self._set_stepper_motor(int(FULL_SPEED * speed * STEPS / ROLLER * direction), interface)

    def conveyor_belt_distance(
        self, speed_mm_per_sec: float, distance_mm: float, direction: int = 1, interface: int = 0
    ) -> int:
        """Run the belt for a distance, in its turn, at 100 mm/s at most. Returns its index."""
        if not 0 < speed_mm_per_sec <= FASTEST_BELT or direction not in {1, -1} or not distance_mm >= 0:
            raise WrongParameter(
                f"speed_mm_per_sec is above 0 and at most {FASTEST_BELT:g}, distance_mm 0 or more, and direction 1 or "
                f"-1, not {speed_mm_per_sec!r}, {distance_mm!r} and {direction!r}"
            )

        pulses = STEPS / 2 / DISTANCE_ROLLER
        speed, distance = int(speed_mm_per_sec * pulses * direction), int(distance_mm * pulses)
        return self._set_stepper_motor_distance(speed, distance, interface)

    def set_color(self, enable: bool = True, port: int = GPIOPort.GP2, version: int = 1) -> int:
        """Switch the colour sensor at a socket, in its turn; version 0 is V1, 1 is V2. Returns its index."""
        value = c.ColorSensor(bool(enable), c.ColorPort(port), c.AccessoryVersion(version))
        return self.session.put(c.SET_COLOR_SENSOR, value)

    def get_color(self, port: int = GPIOPort.GP2, version: int = 1) -> list[bool]:  # noqa: ARG002 - the arm needs neither
        """Return whether the colour sensor, which has to be on, sees red, green and blue."""
        found = self.session.read(c.GET_COLOR_SENSOR)
        return [found.r > 0, found.g > 0, found.b > 0]

    def set_ir(self, enable: bool = True, port: int = GPIOPort.GP4, version: int = 0) -> int:
        """Switch the infrared sensor at a socket, in its turn; version 0 is V1, 1 is V2. Returns its index."""
        value = c.InfraredSensor(bool(enable), c.InfraredPort(port), c.AccessoryVersion(version))
        return self.session.put(c.SET_INFRARED_SENSOR, value)

    def get_ir(self, port: int = GPIOPort.GP4) -> bool:
        """Return whether the infrared sensor at a socket sees something."""
        return self.session.read(c.GET_INFRARED_SENSOR, c.InfraredPort(port)) != 0

    def engrave(
        self,
        image: Iterable[Iterable[float]],
        pixel_size: float,
        low: float = 0.0,
        high: float = 40.0,
        velocity: float = 5,
        acceleration: float = 5,
        actual_acceleration: float = 5,
    ) -> None:
        """Burn a picture from where the arm stands, row by row, there and back; return when it is done.

        Args:
            image: Rows of grey values, 0 black, 255 white; a NumPy array, too.
            pixel_size: mm.
            low: Percent of the laser's power for the brightest grey.
            high: The same for the darkest.
            velocity: mm/s at the junctions.
            acceleration: mm/s², planned.
            actual_acceleration: mm/s².
        """
        rows = [[255.0 - float(grey) for grey in row] for row in image]
        darkest, brightest = max(map(max, rows)), min(map(min, rows))
        span = darkest - brightest or 1.0
        position = self.get_pose().position
        self.laze(0, enable=False)
        self._set_cp_params(velocity, acceleration, actual_acceleration)
        for number, row in enumerate(rows):
            places = list(enumerate(row))
            for column, grey in reversed(places) if number % 2 else places:
                power = (grey - brightest) / span * (high - low) + low
                x, y = position.x + number * pixel_size, position.y + column * pixel_size
                self._set_cple_cmd(x, y, position.z, power, absolute=True)

        self.wait_for_cmd(self.laze(0, enable=False))

    def _set_speed(self, velocity: float, acceleration: float) -> int:
        self._set_ptp_common_params(velocity, acceleration)
        return self._set_ptp_coordinate_params(velocity, acceleration)

    def _jog(self, axis: int, speed: float) -> None:
        """Jog along an axis, or end a jog."""
        if speed:
            v, a = abs(speed), JOG_ACCELERATION  # of all axes: an arm that is told 0 for the others does not take it
            self.session.write(c.SET_JOG_COORDINATE_PARAMS, c.JOGCoordinateParams((v, v, v, v), (a, a, a, a)))

        key = c.JOGKey(1 + 2 * axis + (speed < 0)) if speed else c.JOGKey.IDLE
        self.session.jog(joint=False, key=key)
