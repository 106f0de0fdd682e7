"""A simulated Magician without its socket: what can be seen of it, what the world does to it, what commands do to it.

Knows the rows of the command table and their parameters, but no frames.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

from dobot_async._core.protocol.wire import Command, Queueing
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.alarms import IGNORED, SIZE, Alarm, lookup
from dobot_async.arms.magician.kinematics import JointLimits
from dobot_async.simulator.device.device import Device
from dobot_async.simulator.device.work import DeviceFault, DeviceOptions, Executed, Work
from dobot_async.simulator.magician.effects import CommandEffects, read_pin
from dobot_async.simulator.magician.state import HOME_JOINTS, Motor, State

__all__ = ["MAGICIAN", "MagicianBody", "StoredProgram"]

MAGICIAN = DeviceOptions(harmless=IGNORED, keep=20_000)
"""The options of a Magician; the record is bounded, for a simulation may run for months."""

PROGRAM_LINES = 10_000
LARGEST = 3.4e38
"""Within float32, whatever end effector somebody has set."""


@dataclass(slots=True)
class StoredProgram:
    """The program in the arm's flash: how often it runs, and its commands with their parameters. Manual 2.19.4."""

    loops: int = 1
    commands: list[tuple[Command[Any, Any], Any]] = field(default_factory=list[tuple[Command[Any, Any], Any]])


class MagicianBody:
    """One arm, switched on where it believes to stand in the home pose.

    Attributes:
        device: Its queue and its joints in time, as it believes; the fifth joint is the place on the rail in mm.
        state: Its registers.
        program: The offline program that was downloaded, if any.
        color: What is in front of the colour sensor; the arm tells it while the sensor is on, and has settled.
        color_version: Which colour sensor is plugged in; one that was switched on as another version sees nothing.
        infrared: Whether something is in front of the infrared sensor at each port.
        infrared_version: Which infrared sensors are plugged in.
    """

    def __init__(
        self, clock: Callable[[], float], options: DeviceOptions | None, limits: JointLimits, *, homed: bool
    ) -> None:
        self.device: Device = Device(clock, (*HOME_JOINTS, 0.0), options or MAGICIAN, self._finished)
        self.state: State = State(lambda: self.device.now, limits, homed=homed)
        self.program: StoredProgram | None = None
        self.color: c.Color = c.Color(0, 0, 0)
        self.color_version = self.infrared_version = c.AccessoryVersion.V1
        self.infrared: dict[c.InfraredPort, bool] = dict.fromkeys(c.InfraredPort, False)
        self._effects = CommandEffects(self.state)
        self._downloading = False
        self._taught = False
        self._lines: Iterator[Work] = iter(())

    # What can be seen of the arm.

    @property
    def pose(self) -> c.Pose:
        """Where it believes to be now, mm and degrees; that is what it tells."""
        return self._pose_at(self.device.joints[:4])

    @property
    def true_pose(self) -> c.Pose:
        """Where it really is: elsewhere before it was homed, and after it has lost steps."""
        return self._pose_at(self.state.true(self.device.joints)[:4])

    @property
    def homed(self) -> bool:
        """Whether it was homed since it was switched on, so that it knows where it is."""
        self.device.advance()
        return self.state.homed

    def _pose_at(self, joints: tuple[float, ...]) -> c.Pose:
        numbers = (*self.state.kinematics.forward(*joints), *joints)
        return c.Pose(*(max(-LARGEST, min(LARGEST, number)) for number in numbers))

    @property
    def rail(self) -> float:
        """Where it believes to stand on the rail, mm."""
        return self.device.joints[4]

    @property
    def true_rail(self) -> float:
        """Where it really stands on the rail, mm."""
        return self.state.true(self.device.joints)[4]

    @property
    def executed(self) -> list[Executed]:
        """What has been executed so far, in the order of finishing: each with its row, parameters, times and outcome.

        Commands that may be queued and were sent immediately are in it without an index.
        """
        return self.device.executed

    @property
    def alarms(self) -> tuple[Alarm, ...]:
        """The alarms that are set, lowest code first."""
        return tuple(lookup(code) for code in sorted(self.device.alarms))

    @property
    def suction(self) -> bool:
        """Whether the cup sucks; that takes a moment from the command on."""
        self.device.advance()
        cup = self.state.settled(c.SET_END_EFFECTOR_SUCTION_CUP)
        return cup.is_ctrl_enabled and cup.is_sucked

    @property
    def gripper(self) -> bool:
        """Whether the gripper is closed; that takes a moment from the command on."""
        self.device.advance()
        gripper = self.state.settled(c.SET_END_EFFECTOR_GRIPPER)
        return gripper.is_ctrl_enabled and gripper.is_gripped

    @property
    def laser(self) -> float:
        """The laser's power in percent; 0 is off."""
        executing = self.device.executing
        if executing and isinstance(executing.value, c.CPLECmd):
            return executing.value.power

        laser = self.state.get(c.SET_END_EFFECTOR_LASER)
        return 100.0 if laser.is_ctrl_enabled and laser.is_on else 0.0

    @property
    def motors(self) -> tuple[Motor, Motor]:
        """The two steppers: their speed, and the pulses that they made."""
        self.device.advance()
        return self.state.motors

    def output(self, address: int) -> int:
        """Returns the level at a pin (1 to 20); 0 unless it is configured as a digital output."""
        self.device.advance()
        level = self.state.get(c.SET_IODO, pin(address)).level
        return level if self.state.function(address) is c.IOFunction.DO else 0

    def pwm(self, address: int) -> c.IOPWM:
        """Returns frequency and duty cycle at a pin (1 to 20); 0 percent unless it is configured for PWM."""
        self.device.advance()
        pwm = self.state.get(c.SET_IOPWM, pin(address))
        return pwm if self.state.function(address) is c.IOFunction.PWM else replace(pwm, duty_cycle=0)

    def read_pin(self, mode: c.TriggerMode, address: int) -> int:
        """Returns what the arm reads at a pin (1 to 20)."""
        return int(read_pin(self.state, self.device, mode, address))

    # What the world does to the arm.

    def set_input(self, address: int, level: int) -> None:
        """Sets the level, 0 or 1, at a digital input (1 to 20)."""
        self.device.set_input((c.TriggerMode.IO, pin(address)), int(bool(level)))

    def set_adc(self, address: int, value: int) -> None:
        """Sets an analog input (1 to 20) to 0 to 4095."""
        if not 0 <= value <= 4095:
            raise ValueError(f"an analog value is 0 to 4095, not {value}")

        self.device.set_input((c.TriggerMode.ADC, pin(address)), value)

    def raise_alarm(self, code: int) -> None:
        """Sets an alarm (0 to 0x7F), as when the arm hits something; a fault ends the motion that goes on."""
        if not 0 <= code < 8 * SIZE:
            raise ValueError(f"an alarm code is 0 to 0x7F, not 0x{code:X}")

        self.device.raise_alarm(code)

    def lose_steps(self, joint: int, degrees: float) -> None:
        """Lets a joint (1 to 4) lose steps; LostStepCmd finds them, and homing makes them good.

        The arm believes to be where it was; `true_pose` tells where it is.
        """
        if not 1 <= joint <= 4:
            raise ValueError(f"the arm's joints are 1 to 4, not {joint}")

        self.device.advance()
        self.state.lost_steps[joint - 1] += degrees

    def guide_to(self, x: float, y: float, z: float, r: float = 0.0) -> None:
        """Leads the arm by hand until it believes to be at a point, with the key on the forearm held; then lets go.

        Raises:
            Unreachable: The arm does not go there.
            RuntimeError: It moves by itself.
        """
        if self.device.moving:
            raise RuntimeError("the arm moves; it can be guided when it stands")

        self.device.place((*self.state.kinematics.check(x, y, z, r), self.rail))
        self.press_teach_key()

    def press_teach_key(self) -> None:
        """Presses and releases the key on the forearm: a taught point is there to be fetched, if that is enabled."""
        self.device.advance()
        self._taught = self.state.get(c.SET_HHT_TRIG_OUTPUT_ENABLED)

    def run_program(self) -> None:
        """Presses the key on the arm's back: the downloaded program runs through the queue, all its loops."""
        program = self.program
        if program is None or not program.commands:
            return

        works = [self._effects.make(row, value) for row, value in program.commands]
        self._lines = (work for _ in range(program.loops) for work in works)
        self.device.start()
        self._go_on_with_program()

    def power_cycle(self) -> None:
        """Switches it off and on: it forgets all but its flash, and how far its base, tool and rail have come.

        It stands where it stood, and believes that base, tool and rail are at 0, until it is homed.
        """
        self._lines = iter(())
        self.device.power_cycle()
        self.device.place(self.state.power_up(self.device.joints))
        self._downloading = self._taught = False

    # What commands do, and ask.

    def put(self, row: Command[Any, Any], value: Any) -> int | None:
        """Queues a command, or stores it during a download; returns its index, or None where there is no room."""
        if not self._downloading or self.program is None:
            return self.device.put(self._effects.make(row, value))

        if len(self.program.commands) >= PROGRAM_LINES:
            return None

        self.program.commands.append((row, value))
        return self.device.skip()

    def perform(self, row: Command[Any, Any], value: Any) -> None:
        """Does a command immediately.

        A motion takes the place of the one that goes on; beside anything else that executes it is not done. Neither is
        a wait.
        """
        if row is c.SET_JOG_CMD:
            self._effects.jog(value, self.device)
        elif row.queueing is Queueing.NEVER:
            self.state.set(row, value)
        elif row.queueing is Queueing.ALLOWED:
            self.device.perform(self._effects.make(row, value))
        elif not row.moves:
            self.device.begin_aside(self._effects.make(row, value))
        elif not self.device.halted:
            self.device.replace(self._effects.make(row, value))

    def clear(self) -> None:
        """Empties the queue, and ends a program that runs."""
        self._lines = iter(())
        self.device.clear()

    def start_download(self, value: c.QueuedCmdStartDownload) -> None:
        """Stores what is queued from now on."""
        self._downloading, self.program = True, StoredProgram(value.total_loop)

    def stop_download(self) -> None:
        """Executes what is queued from now on."""
        self._downloading = False

    def reset_pose(self, value: c.ResetPose) -> None:
        """Takes two joints to be at other angles; the simulated angle sensors are never wrong."""
        if value.manual:
            j1, _, _, j4, rail = self.device.joints
            self.device.place((j1, value.rear_arm_angle, value.front_arm_angle, j4, rail))

    def fetch_taught_point(self) -> bool:
        """Returns whether a point was taught since the last time."""
        taught, self._taught = self._taught, False
        return taught

    def ptp_time(self, value: c.PTPCmd) -> int:
        """Returns how many ms a motion from here would take; 0 if the arm cannot go there."""
        try:
            seconds = sum(segment.duration for segment in self._effects.motions.ptp_legs(value, self.device.joints))
        except DeviceFault:
            return 0

        return round(min(seconds * 1000, 2**32 - 1))

    def speed(self) -> c.Kinematics:
        """Returns the velocity and acceleration that are set for the tool while it moves, else 0."""
        if not self.device.moving:
            return c.Kinematics(0, 0)

        limits = self.state.get(c.SET_PTP_COORDINATE_PARAMS)
        return c.Kinematics(limits.xyz_velocity, limits.xyz_acceleration)

    def _finished(self, executed: Executed) -> None:
        self._effects.finished(executed, self.device)
        self._go_on_with_program()

    def _go_on_with_program(self) -> None:
        """Puts as many lines of a running program into the queue as it can take."""
        while self.device.left_space:
            work = next(self._lines, None)
            if work is None:
                return

            self.device.put(work)


def pin(address: int) -> int:
    """The address of a pin; raises ValueError if the arm has none there."""
    if not 1 <= address <= 20:
        raise ValueError(f"the arm's pins are 1 to 20, not {address}")

    return address
