r"""A simulated ultraArm P340: bytes of lines in, bytes of answers out. No I/O, no tasks; time is a parameter.

    client's bytes --> Session --line--> SimulatedUltraArm --Work--> Device
    client's bytes <-- Session <--text---------'

A line ends with \r; \n, blanks and the case of letters count for nothing. What is not known is answered with
`ERROR: COMMAND NOT RECOGNIZED`. What the manual does not tell, or firmware does differently, is an option.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.ultraarm import commands as c
from dobot_async.arms.ultraarm.frame import split_words
from dobot_async.errors import ProtocolError
from dobot_async.simulator.device.device import Device
from dobot_async.simulator.device.work import DeviceOptions, Executed
from dobot_async.simulator.ultraarm.body import CommandEffects, Registers, plus, pose
from dobot_async.simulator.ultraarm.kinematics import forward

__all__ = ["ULTRAARM", "SimulatedUltraArm", "UltraArmCounters", "UltraArmQuirks", "UltraArmSession"]

ULTRAARM = DeviceOptions(
    capacity=100, count_executing=False, first_index=1, initial_index=0, power_up_alarms=frozenset(), keep=20_000
)
"""The queue is more than 90 deep, for the vendor's library fills it so far."""

UNKNOWN = "ERROR: COMMAND NOT RECOGNIZED"
MOST = 4096  # bytes of a line that does not end


@dataclass(frozen=True, slots=True)
class UltraArmQuirks:
    """In what ultraArms answer differently, or may.

    Attributes:
        acknowledge: What a command is answered with: QUEUE SIZE (the vendor's library reads it there when it plays a
            file), "ok", or nothing.
        later: Whether the commands are known that the vendor's library has and the manual does not; without them an arm
            tells neither its QUEUE SIZE nor whether it moves.
        blanks: Whether the readings have the manual's prefixes and blanks, `DATA: ANGLES[0.00 ,0.00 ,0.00 ,0.00]`.
        dwell_rests: Whether M9 says "Moving end" while the arm waits (G4).
        jog_stop: What M15 ends: "jog" alone, as the manual has it, or "all" that moves or waits.
        release: When M17 takes the power off the motors: "now", with the queue emptied, or "queued" behind the motions.
        constant_speed: Whether M16 S0 takes the ramps away from each motion, as its name says.
    """

    acknowledge: Literal["size", "ok", "nothing"] = "size"
    later: bool = True
    blanks: bool = True
    dwell_rests: bool = False
    jog_stop: Literal["jog", "all"] = "jog"
    release: Literal["now", "queued"] = "now"
    constant_speed: bool = False


@dataclass(slots=True)
class UltraArmCounters:
    """What has happened on all sessions so far.

    Attributes:
        requests: Lines that came in.
        unknown: Lines that no row of the table describes, or whose words do not fit.
        overflowed: Commands that a full queue dropped.
    """

    requests: int = 0
    unknown: int = 0
    overflowed: int = 0


class SimulatedUltraArm:
    """One arm, switched on where it stands, and its protocol.

    It does not know where that is, and tells zeros, until it has been home (G28); so is it whenever its motors have had
    no power. What moves it is taken until then, and not done, and the arm says nothing of that.

    Attributes:
        device: Its queue and its joints in time.
        quirks: What is known, or feared, to differ between firmwares.
        counters: Figures of the protocol.
    """

    def __init__(
        self,
        clock: Callable[[], float],
        options: DeviceOptions | None = None,
        quirks: UltraArmQuirks = UltraArmQuirks(),
        *,
        homed: bool = False,
    ) -> None:
        """Switches an arm on.

        Args:
            clock: Returns simulated seconds.
            options: The capacity of the queue, whether the command that executes counts, ...
            quirks: What this arm's firmware does differently.
            homed: Whether it has been home already; a real arm has not, and a `sim:` URL begins with one that has.
        """
        self._registers = Registers(homed=homed, constant_speed=quirks.constant_speed)
        self.device: Device = Device(clock, (0.0, 0.0, 0.0, 0.0), options or ULTRAARM)
        self.quirks = quirks
        self.counters: UltraArmCounters = UltraArmCounters()
        self._effects = CommandEffects(self._registers)

    @property
    def registers(self) -> Registers:
        """What it remembers."""
        self.device.advance()
        return self._registers

    @property
    def pose(self) -> c.UltraArmCoords:
        """Where the tool is, mm, in the coordinates that G92 has left; whatever the arm takes itself to be at."""
        return c.UltraArmCoords(*plus(forward(self.device.joints), self.registers.origin))

    @property
    def angles(self) -> c.UltraArmAngles:
        """The joints, degrees; whatever the arm takes them to be."""
        return c.UltraArmAngles(*self.device.joints)

    @property
    def gripper(self) -> float:
        """How far the gripper is open, percent."""
        return self.registers.opening(self.device.now)

    @property
    def gripper_moving(self) -> bool:
        """Whether the gripper has not got there yet."""
        target = self.registers.gripper
        return target is not None and self.gripper != target

    @property
    def executed(self) -> list[Executed]:
        """What has been executed so far, in order; a motion that led nowhere is among it, for the arm says nothing."""
        return self.device.executed

    @property
    def missed(self) -> int:
        """How many motions led nowhere: out of reach, or without power."""
        self.device.advance()
        return self._effects.missed

    @property
    def queue_size(self) -> int:
        """How many commands wait."""
        return self.device.options.capacity - self.device.left_space

    def guide_to(self, *joints: float) -> None:
        """Leads the arm to joint angles by hand; an arm that does not know where it is does not notice."""
        if self.device.moving:
            raise RuntimeError("the arm moves; it can be guided when it stands")

        self.device.place(joints)

    def power_cycle(self) -> None:
        """Switches it off and on: it forgets all, and stands where it stood."""
        self.device.power_cycle()
        self._effects.registers = self._registers = Registers(constant_speed=self.quirks.constant_speed)

    def session(self) -> UltraArmSession:
        """Returns the arm's side of a connection to a new client."""
        return UltraArmSession(self)

    def answer(self, line: bytes) -> str:
        """Does what a line says; returns the text of the answer, or none."""
        self.device.advance()
        self.counters.requests += 1
        try:
            row, value = self._understand(line)
        except (ProtocolError, ValueError):
            self.counters.unknown += 1
            return UNKNOWN

        if row in READS:
            return READS[row](self, value)

        if not self._do(row, value):
            return ""

        if row is c.HOME:
            return "DATA: [ok]"

        return {"size": f"QUEUE SIZE[{self.queue_size}]", "ok": "ok", "nothing": ""}[self.quirks.acknowledge]

    def _understand(self, line: bytes) -> tuple[Command[Any, Any], Any]:
        """The row of a line, and its parameters; raises ProtocolError or ValueError where there is none."""
        words = split_words(line)
        letter, number = words[0] if words else ("", "")
        row = c.BY_WORD.get(f"{letter}{int(number)}" if number.isdigit() else "")
        if row is None or (row.section == "pymycobot" and not self.quirks.later):
            raise ProtocolError(UNKNOWN)

        rest = "".join(letter + number for letter, number in words[1:]).encode("ascii")
        value = row.request.decode(rest)
        row.request.encode(value)
        if row is c.GET_GRIPPER_POSITION and value.mode is None:
            raise ProtocolError(UNKNOWN)

        return row, value

    def _do(self, row: Command[Any, Any], value: Any) -> bool:
        """Does or queues a command; returns whether it was taken."""
        device = self.device
        if row is c.JOG_STOP:
            device.end_aside()
            if self.quirks.jog_stop == "all":
                self._abandon()
        elif row is c.RELEASE and self.quirks.release == "now":
            self._abandon()
            self.registers.release(self.device.joints)
        elif row in {c.JOG_JOINT, c.JOG_COORD}:
            device.end_aside()
            return device.begin_aside(self._effects.jog(row, value))
        elif device.put(self._effects.make(row, value)) is None:
            self.counters.overflowed += 1
            return False

        return True

    def _abandon(self) -> None:
        """Ends all that moves, and empties the queue."""
        self.device.force_stop()
        self.device.clear()
        self.device.start()

    def numbers(self, keyword: str, values: tuple[float, ...], prefix: str = "DATA: ") -> str:
        """A reading, as the manual writes it."""
        if self.quirks.blanks:
            return f"{prefix}{keyword}[{' ,'.join(f'{each:.2f}' for each in values)}]"

        return f"{keyword}[{','.join(f'{each:.2f}' for each in values)}]"


class UltraArmSession:
    """One client's connection: its half lines are its own."""

    def __init__(self, arm: SimulatedUltraArm) -> None:
        self._arm = arm
        self._buffer = b""

    def receive(self, data: bytes) -> bytes:
        """Takes any bytes of requests, returns the bytes of all answers to the lines that are whole now."""
        *lines, rest = (self._buffer + data.replace(b"\n", b"")).split(b"\r")
        self._buffer = rest[-MOST:]
        answers = (self._arm.answer(line) for line in lines if line.strip())
        return b"".join(f"{answer}\r\n".encode("ascii") for answer in answers if answer)


def endstops(arm: SimulatedUltraArm, _: None) -> str:
    """The switches are pressed at home."""
    pressed = [int(abs(joint) < 0.01) for joint in arm.device.joints[:3]]
    return f"DATA : ENDSTOP[{' ,'.join(map(str, pressed))}]" if arm.quirks.blanks else f"ENDSTOP{pressed}"


def moving_end(arm: SimulatedUltraArm, _: None) -> str:
    """Whether the arm has something to do."""
    executing = arm.device.executing
    dwells = executing is not None and executing.command is c.WAIT and not arm.quirks.dwell_rests
    return "Moving" if arm.device.moving or dwells else "Moving end"


def calibrate(arm: SimulatedUltraArm, _: None) -> str:
    """M31 is done at once."""
    return f"QUEUE SIZE[{arm.queue_size}]" if arm.registers.powered else "ERROR: J1 cal failed"


READS: Mapping[Command[Any, Any], Callable[[SimulatedUltraArm, Any], str]] = {
    c.GET_SYSTEM_VERSION: lambda _arm, _: "GetSystemVersion[1.2]",
    c.GET_MODIFY_VERSION: lambda _arm, _: "GetModifyVersion[3]",
    c.GET_STATUS: moving_end,
    c.GET_ANGLES: lambda arm, _: arm.numbers("ANGLES", arm.registers.believed(arm.device.joints)),
    c.GET_GRIPPER_POSITION: lambda arm, _: f"GetGripperPosition[{arm.gripper:.0f},{arm.registers.closed}]",
    c.CALIBRATE_J1: calibrate,
    c.GET_CALIBRATION_STEP: lambda _arm, _: "J1CAL[12]",
    c.GET_GRIPPER_ANGLE: lambda arm, _: f"GRIPPERANGLE[{arm.gripper:.0f}]",
    c.GET_SERVO_REGISTER: lambda arm, value: f"ReadSYS[{arm.registers.servo.get((value.servo, value.address), 0)}]",
    c.GET_COORDS: lambda arm, _: arm.numbers("COORDS", pose(arm.registers, arm.device.joints), "DATA : "),
    c.GET_ENDSTOPS: endstops,
    c.GET_QUEUE_SIZE: lambda arm, _: f"QUEUE SIZE[{arm.queue_size}]",
}
