"""A simulated arm of the myCobot family: bytes of requests in, bytes of replies out. No I/O, no tasks; time is given.

    client's bytes --> Session --Frame--> SimulatedMyCobot --Work--> Device
                       parser             the model's rows           queue, time, joints
    client's bytes <-- Session <--Frame---------'

Requests are read with the rows that the driver writes them with. Parameters that do not fit are left unanswered, and so
is what the model does not know. The M5 in the base passes on only what reaches it whole, as `Quirks` says.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.frame import MAX_LENGTH, Frame, Parser, encode
from dobot_async.arms.mycobot.layouts import ACK
from dobot_async.arms.mycobot.models import FAMILY, MODELS, model_of
from dobot_async.errors import ProtocolError
from dobot_async.simulator.device.work import DeviceOptions
from dobot_async.simulator.mycobot.body import HEAT, VOLTAGE, MyCobotBody
from dobot_async.simulator.mycobot.numbers import has

__all__ = ["SIMULATED", "MyCobotCounters", "MyCobotQuirks", "MyCobotSession", "SimulatedMyCobot"]

READ_BACK = {read: row for row, read in c.CONFIRMED_BY.items()}
BY_M5 = frozenset({c.SET_BASIC_OUTPUT, c.SET_TRANSPONDER_MODE})
MODE_TEXT = b"ok--------------\r\n"
LATER = "later"
GRIPPER_STEPS = 20.48  # of its servo, in a percent


@dataclass(frozen=True, slots=True)
class MyCobotQuirks:
    """In what arms of this family answer differently.

    Attributes:
        acknowledges: Whether commands are answered, or which are; None as the model's newer firmware does it.
        later: Whether what the manual does not have is known.
        transponder: The M5 loses a frame that does not arrive whole, and one with the greatest length.
        echo: The M5 answers what it does itself with the request, and a new mode with a line of text before it.
        play: Degrees by which each joint comes to rest beside where it was told to, and stays there if it is told so
            again. With 1.0 the tool of a 280 is 2 to 5 mm and 1 to 3 degrees off, as users report of theirs.
        gripper: Whether there is one: of one that does not answer, the arm tells 255.
    """

    acknowledges: bool | frozenset[Command[Any, Any]] | None = None
    later: bool = True
    transponder: bool = True
    echo: bool = True
    play: float = 0.0
    gripper: bool = True


@dataclass(slots=True)
class MyCobotCounters:
    """What has happened on all sessions so far.

    Attributes:
        requests: Whole frames that came in.
        replies: Frames that went out.
        dropped: Frames that the M5 lost.
        unknown: Requests that this arm does not know.
        unfit: Requests whose parameters did not fit their row.
    """

    requests: int = 0
    replies: int = 0
    dropped: int = 0
    unknown: int = 0
    unfit: int = 0


class SimulatedMyCobot(MyCobotBody):
    """One arm, switched on, all joints at 0, and its protocol.

    Attributes:
        quirks: What is known to differ between firmwares.
        counters: Figures of the protocol.
    """

    def __init__(
        self,
        clock: Callable[[], float],
        options: DeviceOptions | None = None,
        quirks: MyCobotQuirks = MyCobotQuirks(),
        *,
        model: str = "mycobot280",
    ) -> None:
        """Switches an arm on.

        Args:
            clock: Returns simulated seconds.
            options: The capacity of its queue, how many records it keeps.
            quirks: What this arm's firmware does differently.
            model: One of `dobot_async.arms.mycobot.models.MODELS`.
        """
        super().__init__(clock, model_of(model), options, play=quirks.play, gripper=quirks.gripper)
        self.quirks = quirks
        self.counters: MyCobotCounters = MyCobotCounters()
        wanted = quirks.acknowledges
        wanted = self.model.acknowledges if wanted is None else wanted
        self._acknowledged = frozenset(self.model.rows if wanted is True else wanted or ())

    def session(self) -> MyCobotSession:
        """Returns the arm's side of a connection to a new client."""
        return MyCobotSession(self)

    def answer(self, frame: Frame) -> bytes:
        """Does what a request says; returns the bytes of the reply, or none."""
        self.device.advance()
        self.counters.requests += 1
        reply = self._reply(frame)
        self.counters.replies += bool(reply)
        return reply

    def _reply(self, frame: Frame) -> bytes:
        row = self.model.by_id.get(frame.id)
        if row is None or (row.section == LATER and not self.quirks.later):
            self.counters.unknown += 1
            return b""

        own = self.model.row(row)
        try:
            value = own.request.decode(frame.params)
            own.request.encode(value)  # refuses what no peer may send, such as a speed of 0
        except (ProtocolError, ValueError):
            self.counters.unfit += 1
            return b""

        if not has(self.model, row, value):
            self.counters.unfit += 1
            return b""

        if not row.write:
            read = READS.get(row)
            found = read(self, value) if read else self.settings[READ_BACK[row]]
            return encode(Frame(frame.id, own.reply.encode(found)))

        self._do(row, value)
        if row in BY_M5 and self.quirks.echo:
            return (MODE_TEXT if row is c.SET_TRANSPONDER_MODE else b"") + encode(frame)

        return encode(Frame(frame.id, ACK.encode(None))) if row in self._acknowledged else b""

    def _do(self, row: Command[Any, Any], value: Any) -> None:
        """Does a command."""
        if row in VERBS:
            VERBS[row](self, value)
        elif row is c.SET_ENCODER and value.joint > self.model.joints:
            self.grip(value.encoder / GRIPPER_STEPS, value.speed)
        elif row.moves and not row.repeatable:
            self.move(row, value)
        elif row.moves:
            self.jog(row, value)
        else:
            self.settings[row] = value


class MyCobotSession:
    """One client's connection: its half frames are its own."""

    def __init__(self, arm: SimulatedMyCobot) -> None:
        self._arm = arm
        self._parser = Parser(arm.model.known)

    def receive(self, data: bytes) -> bytes:
        """Takes any bytes of requests, returns the bytes of all replies to those that are whole now, in their order."""
        frames = self._parser.feed(data)
        if self._arm.quirks.transponder:
            if self._parser.waiting:
                self._arm.counters.dropped += 1
                self._parser.reset()

            frames = [frame for frame in frames if self._fits(frame)]

        return b"".join(map(self._arm.answer, frames))

    def _fits(self, frame: Frame) -> bool:
        """Whether the M5 passes a frame on."""
        fits = len(frame.params) + 2 < MAX_LENGTH
        self._arm.counters.dropped += not fits
        return fits


def gripper_state(arm: SimulatedMyCobot, value: c.SetGripperState) -> None:
    """Opens or closes the gripper; released it stays where it is."""
    if value.state is not c.GripperState.RELEASED:
        arm.grip(0 if value.state is c.GripperState.CLOSED else 100, value.speed)


def set_color(arm: SimulatedMyCobot, value: c.RGB) -> None:
    """Sets the light."""
    arm.color = value


def clear_error(arm: SimulatedMyCobot, _: None) -> None:
    """Forgets what was wrong with the last motion."""
    arm.error = 0


def joint_limit(arm: SimulatedMyCobot, joint: int, *, upper: bool) -> c.JointAngle:
    """A joint's limit."""
    return c.JointAngle(joint, arm.ways.limits[joint - 1][upper])


def set_limit(arm: SimulatedMyCobot, value: c.JointLimit, *, upper: bool) -> None:
    """Sets a joint's limit."""
    arm.set_limit(value, upper=upper)


def encoder(arm: SimulatedMyCobot, joint: int) -> int:
    """The position of a servo; those beyond the joints are the gripper's."""
    return arm.encoders[joint - 1] if joint <= arm.model.joints else round(GRIPPER_STEPS * arm.gripper.value)


def pin_level(row: Command[Any, Any]) -> Callable[[SimulatedMyCobot, int], c.PinLevel]:
    """How an input is read."""
    return lambda arm, pin: c.PinLevel(pin, int(arm.device.get_input((row, pin))))


def errors(arm: SimulatedMyCobot, _: None) -> tuple[int, ...]:
    """A code for each joint; an arm with six has the Atom's behind them."""
    return tuple(
        arm.errors.get(joint, 0) for joint in range(1, max(arm.model.joints, 7 if arm.model.joints > 4 else 5) + 1)
    )


def each(value: Any) -> Callable[[SimulatedMyCobot, None], Any]:
    """The same for each joint."""
    return lambda arm, _: (value,) * arm.model.joints


READS: Mapping[Command[Any, Any], Callable[[SimulatedMyCobot, Any], Any]] = {
    c.GET_SYSTEM_VERSION: lambda _arm, _: 1.3,
    c.GET_BASIC_VERSION: lambda _arm, _: 1.4,
    c.GET_ATOM_VERSION: lambda _arm, _: 6.5,
    c.GET_ERROR_INFORMATION: lambda arm, _: arm.error,
    c.GET_REBOOT_COUNT: lambda _arm, _: 1,
    c.IS_POWER_ON: lambda arm, _: arm.powered,
    c.IS_CONTROLLER_CONNECTED: lambda arm, _: not arm.servos_lost,
    c.READ_NEXT_ERROR: errors,
    c.GET_ANGLES: lambda arm, _: arm.angles,
    c.GET_COORDS: lambda arm, _: arm.coords,
    c.GET_ANGLES_COORDS: lambda arm, _: c.JointsAndCoords(arm.angles, arm.coords),
    c.IS_PAUSED: lambda arm, _: arm.paused,
    c.IS_IN_POSITION: lambda arm, value: arm.in_position(value),
    c.IS_MOVING: lambda arm, _: arm.moving,
    c.GET_SOLUTION_ANGLES: lambda arm, _: arm.elbow,
    c.GET_ENCODER: encoder,
    c.GET_ENCODERS: lambda arm, _: arm.encoders,
    c.GET_JOINT_MIN_ANGLE: lambda arm, joint: joint_limit(arm, joint, upper=False),
    c.GET_JOINT_MAX_ANGLE: lambda arm, joint: joint_limit(arm, joint, upper=True),
    c.IS_SERVO_ENABLE: lambda arm, joint: c.ServoConnected(joint, not arm.servos_lost),
    c.IS_ALL_SERVO_ENABLE: lambda arm, _: not arm.servos_lost,
    c.GET_SERVO_DATA: lambda arm, value: arm.servo_data.get((value.joint, value.address), 0),
    c.GET_SERVO_SPEEDS: lambda arm, _: arm.servo_speeds,
    c.GET_SERVO_VOLTAGES: each(VOLTAGE),
    c.GET_SERVO_STATUS: each(0),
    c.GET_SERVO_TEMPS: each(HEAT),
    c.GET_DIGITAL_INPUT: pin_level(c.GET_DIGITAL_INPUT),
    c.GET_BASIC_INPUT: pin_level(c.GET_BASIC_INPUT),
    c.GET_GRIPPER_VALUE: lambda arm, _: arm.gripper.told,
    c.IS_GRIPPER_MOVING: lambda arm, _: arm.gripper.moving,
    c.GET_TOF_DISTANCE: lambda _arm, _: 123,
}
"""What is read from elsewhere than from what a command has set."""

VERBS: Mapping[Command[Any, Any], Callable[[SimulatedMyCobot, Any], None]] = {
    c.CLEAR_QUEUE: lambda arm, _: arm.device.clear(),
    c.CLEAR_ERROR_INFORMATION: clear_error,
    c.POWER_ON: lambda arm, _: arm.power(on=True),
    c.POWER_OFF: lambda arm, _: arm.power(on=False),
    c.RELEASE_ALL_SERVOS: lambda arm, _: arm.release(None),
    c.PAUSE: lambda arm, _: arm.pause(),
    c.RESUME: lambda arm, _: arm.resume(),
    c.STOP: lambda arm, _: arm.halt(),
    c.JOG_STOP: lambda arm, _: arm.halt(),
    c.SET_JOINT_MIN: lambda arm, value: set_limit(arm, value, upper=False),
    c.SET_JOINT_MAX: lambda arm, value: set_limit(arm, value, upper=True),
    c.SET_SERVO_DATA: lambda arm, value: arm.servo_data.update({(value.joint, value.address): value.value}),
    c.RELEASE_SERVO: lambda arm, value: arm.release(value.joint),
    c.FOCUS_SERVO: lambda arm, joint: arm.focus(joint),
    c.SET_DIGITAL_OUTPUT: lambda arm, value: arm.outputs.update({(c.SET_DIGITAL_OUTPUT, value.pin): value.level}),
    c.SET_BASIC_OUTPUT: lambda arm, value: arm.outputs.update({(c.SET_BASIC_OUTPUT, value.pin): value.level}),
    c.SET_GRIPPER_STATE: gripper_state,
    c.SET_GRIPPER_VALUE: lambda arm, value: arm.grip(value.value, value.speed),
    c.SET_COLOR: set_color,
}
"""What commands do that is more than to be remembered."""

SIMULATED: Mapping[str, Callable[..., SimulatedMyCobot]] = {
    name: partial(SimulatedMyCobot, model=name) for name in (FAMILY, *MODELS)
}
"""What makes each model."""
