"""DobotLab's names: `from dobot_async.compat.dobotlab import *`, in place of `from DobotEDU import *`.

    magician.ptp(mode=1, x=220, y=0, z=50, r=0)
    magician.set_endeffector_suctioncup(enable=True, on=True)
    magician.wait(second=0.3)

`magician` connects when it is first used: to DOBOT_URL, or to the first arm that there is. `Magician("COM3")` is a
connection of one's own, and a context manager, as pydobotlab has it. Each call returns when the arm has done it, and
what a call cannot do is raised: True is all that is returned. docs/compat.md has the table.
"""

from __future__ import annotations

from collections.abc import Sequence
from types import TracebackType
from typing import Any, Self

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.alarms import decode
from dobot_async.arms.magician.commands import PTPMode
from dobot_async.compat._lab_values import Color, Pose, Ratios, SensorFlag, pin, socket
from dobot_async.compat._session import CompatSession

__all__ = ["Dobot", "Magician", "PTPMode", "magician"]


class Magician:
    """A Magician, by the names of DobotLab.

    Args:
        port: A port's name ("COM3", "/dev/ttyUSB0"), an address or a URL; nothing for the first arm that there is.
    """

    Stepper1: int = 0
    Stepper2: int = 1

    def __init__(self, port: str | None = None) -> None:
        self._port = port
        self._session: CompatSession | None = None

    @property
    def session(self) -> CompatSession:
        """The connection, made when it is first needed; its `arm` is that of `dobot_async.sync`.

        Raises:
            ConnectFailed: No arm answered.
        """
        if self._session is None:
            self._session = CompatSession(self._port)

        return self._session

    @property
    def is_open(self) -> bool:
        """Whether it is connected."""
        return self._session is not None and self._session.is_open

    def connect(self) -> None:
        """Connect, if that was not done yet."""
        if self._session is not None and not self._session.is_open:
            self._session = None

        self.session  # noqa: B018 - made by asking for it

    def disconnect(self) -> None:
        """Disconnect; while an error is being handled, stop the arm first."""
        if self._session is not None:
            self._session.close()

    def __enter__(self) -> Self:
        self.connect()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.session.leave(error)

    def ptp(self, mode: int, x: float, y: float, z: float, r: float) -> bool:
        """Move to a point: mm and degrees, or joints, as the mode (0 to 9) says."""
        return self._run(c.SET_PTP_CMD, c.PTPCmd(PTPMode(mode), x, y, z, r))

    def set_device_withl(self, enable: bool, version: int = 0) -> bool:
        """Say whether the arm stands on a rail, and of which version it is: 0 is V1, 1 is V2."""
        return self._write(c.SET_DEVICE_WITH_L, c.DeviceWithL(bool(enable), c.AccessoryVersion(version)))

    def set_ptpl_params(self, vel: float, accel: float) -> bool:
        """Set velocity and acceleration of the rail; the arm takes them as mm/s and mm/s²."""
        return self._run(c.SET_PTPL_PARAMS, c.PTPLParams(vel, accel))

    def set_ptpwithl_cmd(self, mode: int, x: float, y: float, z: float, r: float, l: float) -> bool:  # noqa: E741
        """Move to a point while the rail moves to `l` mm."""
        return self._run(c.SET_PTP_WITH_L_CMD, c.PTPWithLCmd(PTPMode(mode), x, y, z, r, l))

    def set_r(self, r: float) -> bool:
        """Turn the tool to r degrees, where it is."""
        pose = self.get_pose()
        return self.ptp(PTPMode.MOVJ_XYZ, pose.x, pose.y, pose.z, r)

    @property
    def motion_params(self) -> Ratios:
        """The percentages of velocity and acceleration that PTP motions use."""
        found = self.session.read(c.GET_PTP_COMMON_PARAMS)
        return Ratios.of(found.velocity_ratio, found.acceleration_ratio, self._set_motion_params)

    @motion_params.setter
    def motion_params(self, value: Sequence[float]) -> None:
        self._set_motion_params(*value)

    @property
    def jump_params(self) -> Ratios:
        """The z (mm) that a jump never exceeds, and how far it lifts (mm): in this order."""
        found = self.session.read(c.GET_PTP_JUMP_PARAMS)
        return Ratios.of(found.z_limit, found.jump_height, self._set_jump_params)

    @jump_params.setter
    def jump_params(self, value: Sequence[float]) -> None:
        self._set_jump_params(*value)

    def set_multiplexing(self, io: str | int, multiplex: int) -> bool:
        """Say what a pin ("DO_01" to "DO_20") is for: 1 output, 2 PWM, 3 input, 4 analog, 5 pull-up, 6 pull-down."""
        return self._run(c.SET_IO_MULTIPLEXING, c.IOMultiplexing(pin(io), c.IOFunction(multiplex)))

    def set_pwm(self, io: str | int, freq: float, cycle: float) -> bool:
        """Set a PWM output: 10 Hz to 1 MHz, 0 to 100 percent."""
        return self._run(c.SET_IOPWM, c.IOPWM(pin(io), freq, cycle))

    def set_do(self, io: str | int, level: int) -> bool:
        """Set a digital output."""
        return self._run(c.SET_IODO, c.IODO(pin(io), int(bool(level))))

    def get_di(self, io: str | int) -> int:
        """Return the level of a digital input."""
        return self.session.input(pin(io))

    def get_adc(self, io: str | int) -> int:
        """Return an analog input, 0 to 4095."""
        return self.session.analog(pin(io))

    def set_endeffector_suctioncup(self, enable: bool, on: bool) -> bool:
        """Switch the pump, and suck or let go; give the air some 0.3 s."""
        return self._run(c.SET_END_EFFECTOR_SUCTION_CUP, c.EndEffectorSuctionCup(bool(enable), bool(on)))

    def set_endeffector_gripper(self, enable: bool, on: bool) -> bool:
        """Switch the pump, and close or open the gripper; give it some 0.5 s."""
        return self._run(c.SET_END_EFFECTOR_GRIPPER, c.EndEffectorGripper(bool(enable), bool(on)))

    def set_endeffector_laser(self, enable: bool, on: bool) -> bool:
        """Switch the laser; it burns only when both are set."""
        return self._run(c.SET_END_EFFECTOR_LASER, c.EndEffectorLaser(bool(enable), bool(on)))

    def set_infrared_sensor(self, port: int, enable: bool, version: int = 1) -> bool:
        """Switch the infrared sensor at GP1, GP2, GP4 or GP5 (1, 2, 4, 5); version 0 is V1, 1 is V2."""
        value = c.InfraredSensor(bool(enable), socket(port), c.AccessoryVersion(version))
        return self._run(c.SET_INFRARED_SENSOR, value)

    def get_infrared_sensor(self, port: int) -> SensorFlag:
        """Return 1 if the infrared sensor at GP1, GP2, GP4 or GP5 (1, 2, 4, 5) sees something, else 0."""
        return SensorFlag(self.session.read(c.GET_INFRARED_SENSOR, socket(port)))

    def set_color_sensor(self, port: int, enable: bool, version: int = 0) -> bool:
        """Switch the colour sensor at GP1, GP2, GP4 or GP5 (1, 2, 4, 5); version 0 is V1, 1 is V2."""
        value = c.ColorSensor(bool(enable), c.ColorPort(socket(port)), c.AccessoryVersion(version))
        return self._run(c.SET_COLOR_SENSOR, value)

    def get_color_sensor(self) -> Color:
        """Return what the colour sensor, which has to be on, sees: red, green, blue."""
        found = self.session.read(c.GET_COLOR_SENSOR)
        return Color(found.r, found.g, found.b)

    def wait(self, second: float) -> bool:
        """Let the arm wait, in s."""
        if not second >= 0:
            raise ValueError(f"second must be 0 or more, not {second!r}")

        return self._run(c.SET_WAIT_CMD, c.WAITCmd(round(1000 * second)))

    def set_home(self) -> bool:
        """Home the arm, from an alarm as well."""
        self.session.home()
        return True

    def get_pose(self) -> Pose:
        """Return x, y, z (mm), r (degrees), and the list of the four joints (degrees)."""
        pose = self.session.read(c.GET_POSE)
        return Pose(pose.x, pose.y, pose.z, pose.r, list(pose.joints))

    def get_posel(self) -> float:
        """Return where the arm stands on its rail, mm."""
        return self.session.read(c.GET_POSE_L)

    def clear_alarm(self) -> bool:
        """Clear the alarms."""
        self.session.clear_alarms()
        return True

    def get_arm_speed_ratio(self, mode: int) -> float:
        """Return the percentage of velocity that jogs (0) or PTP motions (1) use."""
        if mode:
            return self.session.read(c.GET_PTP_COMMON_PARAMS).velocity_ratio

        return self.session.read(c.GET_JOG_COMMON_PARAMS).velocity_ratio

    def set_lost_step_params(self, value: float) -> bool:
        """Set from how many degrees on steps count as lost."""
        return self._write(c.SET_LOST_STEP_PARAMS, value)

    def set_lost_step_cmd(self) -> bool:
        """Check for lost steps; if there are any, ArmAlarm is raised."""
        return self._run(c.SET_LOST_STEP_CMD, None)

    def get_lost_step_result(self) -> list[str]:
        """Return the names of the alarms that are set."""
        return [alarm.name for alarm in decode(self.session.alarms())]

    def set_converyor(self, index: int, enable: bool, speed: float) -> bool:
        """Run stepper 0 or 1 at pulses/s, negative backwards, until told otherwise. The name is DobotLab's."""
        return self._run(c.SET_E_MOTOR, c.EMotor(index, bool(enable), round(speed)))

    set_conveyor = set_converyor
    home = set_home
    clear_alarms = clear_alarm

    def _run(self, row: Command[Any, Any], value: Any) -> bool:
        """Queue a command, and return when it is executed."""
        self.session.run(row, value)
        return True

    def _write(self, row: Command[Any, Any], value: Any) -> bool:
        self.session.write(row, value)
        return True

    def _set_motion_params(self, vel: float, acc: float) -> bool:
        return self._run(c.SET_PTP_COMMON_PARAMS, c.PTPCommonParams(vel, acc))

    def _set_jump_params(self, zlimit: float, height: float) -> bool:
        return self._run(c.SET_PTP_JUMP_PARAMS, c.PTPJumpParams(height, zlimit))


Dobot = Magician
magician: Magician = Magician()
