"""An arm of the myCobot family, for programs without asyncio.

Written by tests/sync/write_sync.py: change what that reads, and run it again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from typing import Any, Literal, Self, SupportsFloat, TypeVar

from dobot_async._core.protocol.wire import Command
from dobot_async._core.util.bounds import ToolBounds
from dobot_async._core.util.shapes import Box, Cylinder
from dobot_async._core.util.workspace import Workspace
from dobot_async.arms.info import DeviceInfo
from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.alarms import CobotAlarm
from dobot_async.arms.mycobot.arm import MyCobot as AsyncMyCobot
from dobot_async.arms.mycobot.executor import Tolerance
from dobot_async.arms.mycobot.models import CobotModel, Range
from dobot_async.arms.mycobot.pose import CobotPose
from dobot_async.arms.mycobot.queue import CobotBatch as AsyncCobotBatch
from dobot_async.arms.mycobot.queue import CobotQueue as AsyncCobotQueue
from dobot_async.arms.mycobot.readings import CobotInfo
from dobot_async.arms.mycobot.verbs import Verbs
from dobot_async.sync.bases import ArmTwin, BatchTwin, QueueTwin
from dobot_async.sync.follow import Follow
from dobot_async.sync.link import Link
from dobot_async.sync.motion import Motion
from dobot_async.sync.portal import PORTAL
from dobot_async.sync.twin import BlockingContext, same
from dobot_async.traces.recorder import Record

__all__ = ["CobotBatch", "CobotQueue", "MyCobot"]

Q = TypeVar("Q")
R = TypeVar("R")


class CobotBatch(BatchTwin[AsyncCobotBatch], Verbs[Motion]):
    """Commands that are queued together; each verb returns its Motion, to be waited for after the batch's block."""

    @property
    def model(self) -> CobotModel:
        """What the arm is."""
        return self.asynchronous.model

    def put(self, command: Command[Q, Any], value: Q) -> Motion:
        """Add any row of the table that may be queued.

        Args:
            command: A row of the table that may be queued.
            value: Its parameters.

        Raises:
            ValueError: The parameters do not fit, or the command cannot be queued.
            TypeError: They are of the wrong type.
        """
        return Motion(PORTAL.look(lambda: self.asynchronous.put(command, value)))


class CobotQueue(QueueTwin[AsyncCobotQueue], Verbs[Motion]):
    """What is put here the arm is given one after the other; each verb returns a Motion."""

    @property
    def model(self) -> CobotModel:
        """What the arm is."""
        return self.asynchronous.model

    def batch(self, *, timeout: float | None = None) -> AbstractContextManager[CobotBatch]:
        """Collect commands, and queue them with nothing between them when the block ends; an error sends none.

        Args:
            timeout: Seconds to wait for room in the queue.

        Raises:
            DobotError: As `put`; what was accepted before that is pending.
        """
        return BlockingContext(lambda: self.asynchronous.batch(timeout=timeout), CobotBatch, "batch")

    @property
    def unsent(self) -> int:
        """How many commands are here that the arm has never heard of."""
        return self.asynchronous.unsent

    def put(self, command: Command[Q, Any], value: Q, *, timeout: float | None = None) -> Motion:
        """Give one command to the arm's queue and return once the arm has accepted it.

        Args:
            command: A row of the table that may be queued.
            value: Its parameters.
            timeout: Seconds to wait for room in the arm's queue; None waits as long as the arm answers.

        Raises:
            ValueError: The parameters do not fit, or the command cannot be queued.
            CommandRejected: The arm follows a target, and takes no commands meanwhile.
            ReplyTimeout: There was no room in time, or the arm is silent; it was not sent.
            ArmAlarm: The arm has raised alarms and makes no more room.
            MotionStopped: The queue was stopped while this waited.
            MotionUnknown: Nothing can tell whether the arm took it.
            ConnectionLost: The link is gone.
        """
        return Motion(PORTAL.run(lambda: self.asynchronous.put(command, value, timeout=timeout)))

    @property
    def bounds(self) -> ToolBounds | None:
        """Where the tool may be, for who sends the arm about without the queue; None where nothing limits it."""
        return self.asynchronous.bounds

    def join(self, timeout: float | None = None) -> None:
        """Return when all that was put has been executed.

        Args:
            timeout: Seconds for all of it.

        Raises:
            ReplyTimeout: Something is still to be done; it goes on.
            DobotError: The first failure since the last `join`, stops by this program aside.
        """
        PORTAL.run(lambda: self.asynchronous.join(timeout))

    def pause(self) -> None:
        """Let the arm finish the command that it executes, and then wait; Motions stay pending.

        Raises:
            ReplyTimeout: The arm does not acknowledge it.
            ConnectionLost: The link is gone.
        """
        PORTAL.run(self.asynchronous.pause)

    def resume(self) -> None:
        """Let a paused arm go on; a stop ends this call, which raises why: MotionStopped, or the ArmAlarm behind it.

        Raises:
            MotionStopped: A stop ended this call.
            ArmAlarm: An alarm was behind that stop.
            ReplyTimeout: The arm does not acknowledge it.
            ConnectionLost: The link is gone.
        """
        PORTAL.run(self.asynchronous.resume)

    def stop(self, *, timeout: float = 5.0) -> None:
        """Stop the arm now, ahead of everything; all pending Motions raise MotionStopped, and the queue is empty.

        Args:
            timeout: Seconds to wait until the arm has acknowledged it. It is repeated after that, too, and when this
                call is cancelled, until the arm acknowledges it or the connection ends.

        Raises:
            ReplyTimeout: The arm has not acknowledged it yet.
            ConnectionLost: The link is gone.
        """
        PORTAL.run(lambda: self.asynchronous.stop(timeout=timeout))

    def clear(self, *, timeout: float = 5.0) -> None:
        """Throw away all that is queued, the running command included; its Motions raise MotionStopped. See `stop`.

        Args:
            timeout: Seconds to wait until the arm has acknowledged it.

        Raises:
            ReplyTimeout: The arm has not acknowledged it yet.
            ConnectionLost: The link is gone.
        """
        PORTAL.run(lambda: self.asynchronous.clear(timeout=timeout))

    @property
    def pending(self) -> int:
        """How many accepted commands are not known to have ended."""
        return self.asynchronous.pending


class MyCobot(ArmTwin[AsyncMyCobot], Verbs[None]):
    """An arm behind a link; made by `connect`. Each verb returns when it is done, and raises what `Arm` names.

    A motion belongs to the call that waits for it: if that is cancelled, or its timeout passes, the arm stops.
    """

    @property
    def link(self) -> Link:
        """The connection, with its state, events and figures."""
        return Link(self.asynchronous.link)

    @property
    def queue(self) -> CobotQueue:
        """The queue of motions, with the same verbs. It is on this side, so it ends with the block."""
        return CobotQueue(self.asynchronous.queue)

    @property
    def model(self) -> CobotModel:
        """What the arm is: its joints, its limits, its rows of the command table."""
        return self.asynchronous.model

    @classmethod
    def connect(
        cls,
        url: str,
        *,
        model: str = "mycobot280",
        control: bool = True,
        queue: Literal["fresh", "keep"] = "fresh",
        timeout: float = 5.0,
        on_error: Literal["stop", "leave"] = "stop",
        reconnect: bool = False,
        reply_timeout: float | tuple[float, float] | None = None,
        acknowledges: bool | None = None,
        tolerance: Tolerance = (4.0, 8.0),
        limits: Mapping[str, Range] | None = None,
        gap: float = 0.02,
        max_requests: float | None = None,
        workspace: Workspace | Box | Cylinder | None = None,
        record: Record | None = None,
    ) -> AbstractContextManager[Self]:
        """Connect to an arm for the length of a block.

        It never clears errors, sets parameters, powers the arm on or moves it on its own.

        Args:
            url: `serial:///dev/ttyUSB0`, `tcp://host:port`, `sim:`.
            model: "myarm300", "mycobot280" (or "mycobot"), "mycobot280pi", "mycobot320", "mecharm270" or
                "mypalletizer260".
            control: False for observers: only reads are sent, everything else raises ValueError.
            queue: "fresh" stops what an earlier program left moving; "keep" leaves it as found.
            timeout: Seconds until an arm must have answered.
            on_error: "stop" stops the arm when the block is left by an exception or a cancellation; "leave" lets it
                finish the motion that it does.
            reconnect: Reopen a link that breaks. The arm goes on with its motion meanwhile, and is watched again after.
            reply_timeout: Seconds without an answer after which a request is sent again: the least and the most that it
                may adapt itself to, or one fixed value. By default (0.05, 0.5); on `tcp:` (0.7, 1.5), for the vendor's
                server may take half a second for one answer, and a second request meanwhile spoils its order.
            acknowledges: Whether the firmware answers commands; None as the model does, and it is found out anyway.
            tolerance: How near a motion has to come to count as done: degrees, and mm. An arm that is told to go
                elsewhere within it counts as there already.
            limits: Ranges of your own beside the model's, by joint and axis: `{"j2": (-90, 90), "z": (20, 400)}`.
                Degrees and mm; what a motion names is checked before it is sent.
            gap: Seconds between two frames.
            max_requests: How many requests per second go to the arm, 5 or more, over a line that others need as well;
                None sends as many as it answers. A call waits for its turn before its timeout begins; what stops the
                arm does not wait. With few of them the end of a motion is noticed later.
            workspace: Where the tool may be, in mm and the coordinates that the arm tells: a `Workspace`, or a Box or
                Cylinder that is allowed. What leads outside raises OutsideWorkspace, a ValueError, before anything is
                sent, or CommandRejected where it shows when its turn comes. Motions given in joints are not looked at;
                see docs/workspace.md.
            record: Where to write down what goes over the connection, for the length of the block: a path, or a
                `dobot_async.traces.TraceFile`. Passwords are left out; see docs/trace.md.

        Raises:
            ValueError: The URL or an argument is wrong.
            ConnectFailed: No arm answered; the message says what to check.
            MotionStopped: The block has ended without an error, and motions were still waiting in the queue on this
                side: they were never sent.
        """
        return BlockingContext(
            lambda: AsyncMyCobot.connect(
                url,
                model=model,
                control=control,
                queue=queue,
                timeout=timeout,
                on_error=on_error,
                reconnect=reconnect,
                reply_timeout=reply_timeout,
                acknowledges=acknowledges,
                tolerance=tolerance,
                limits=limits,
                gap=gap,
                max_requests=max_requests,
                workspace=workspace,
                record=record,
            ),
            cls,
            str(url),
        )

    def request(self, command: Command[Q, R], value: Q, *, timeout: float | None = None) -> R:
        """Send any row of the command table immediately, and return the arm's answer, None for a command.

        Args:
            command: A row of `dobot_async.arms.mycobot.commands`.
            value: Its parameters; None where it has none.
            timeout: Seconds, repetitions included; the row's own by default.

        Raises:
            ValueError: The parameters do not fit, the model has no such row, it is a motion, or the connection only
                reads.
            ReplyTimeout: No answer came.
            ConnectionLost: The link is gone.
        """
        return PORTAL.run(lambda: self.asynchronous.request(command, value, timeout=timeout))

    def clear_alarms(self, *, timeout: float | None = None) -> None:
        """Clear what was wrong with the last motion; the motions that it ended do not go on."""
        PORTAL.run(lambda: self.asynchronous.clear_alarms(timeout=timeout))

    def recover(self) -> None:
        """Empty the queue, clear the alarms and power the arm on: it is ready for new commands.

        Raises:
            ArmAlarm: Something still keeps it from moving.
        """
        PORTAL.run(self.asynchronous.recover)

    def pause(self) -> None:
        """Let the arm wait where it is, in the middle of a motion; returns when it says that it does.

        Raises:
            CommandRejected: It answers, and goes on.
        """
        PORTAL.run(self.asynchronous.pause)

    def resume(self) -> None:
        """Let a paused arm go on; returns when it says that it does.

        Raises:
            CommandRejected: It answers, and stays paused.
        """
        PORTAL.run(self.asynchronous.resume)

    def stop(self, *, timeout: float = 5.0) -> None:
        """Stop the arm now, ahead of everything; pending Motions raise MotionStopped.

        Args:
            timeout: Seconds to wait until the arm says that it stands; it is told again after that, too, until it does.

        Raises:
            ReplyTimeout: The arm has not said so yet.
            MotionUnknown: It says that it still moves, 2 s after it was told.
            ConnectionLost: The link is gone.
        """
        PORTAL.run(lambda: self.asynchronous.stop(timeout=timeout))

    def jog_stop(self) -> None:
        """Stop a jog; it stops any other motion as well."""
        PORTAL.run(self.asynchronous.jog_stop)

    def get_joints(self, *, timeout: float | None = None) -> tuple[float, ...]:
        """Return the joints, degrees; raise ArmAlarm if the arm cannot read its servos."""
        return PORTAL.run(lambda: self.asynchronous.get_joints(timeout=timeout))

    def get_angles(self, *, timeout: float | None = None) -> tuple[float, ...]:
        """Return the joints: `get_joints` under the vendor's name."""
        return PORTAL.run(lambda: self.asynchronous.get_angles(timeout=timeout))

    def get_coords(self, *, timeout: float | None = None) -> c.Coords:
        """Return where the tool is, mm, and how it is turned, degrees, in the frames that are set."""
        return PORTAL.run(lambda: self.asynchronous.get_coords(timeout=timeout))

    def get_pose(self, *, timeout: float | None = None) -> CobotPose:
        """Return tool and joints; of one moment if the firmware knows GetAnglesCoords, else one after the other."""
        return PORTAL.run(lambda: self.asynchronous.get_pose(timeout=timeout))

    def get_info(self, *, timeout: float | None = None) -> DeviceInfo:
        """Return who the arm is: the version of its firmware, where that tells it, for it has no number or name."""
        return PORTAL.run(lambda: self.asynchronous.get_info(timeout=timeout))

    def get_versions(self, *, timeout: float | None = None) -> CobotInfo:
        """Return the model and the versions of its firmware."""
        return PORTAL.run(lambda: self.asynchronous.get_versions(timeout=timeout))

    def get_alarms(self, *, timeout: float | None = None) -> tuple[CobotAlarm, ...]:
        """Return what keeps the arm from moving, and what was wrong with its last motion, with cause and remedy."""
        return PORTAL.run(lambda: self.asynchronous.get_alarms(timeout=timeout))

    def is_moving(self, *, timeout: float | None = None) -> bool:
        """Return whether the arm says that it moves."""
        return PORTAL.run(lambda: self.asynchronous.is_moving(timeout=timeout))

    def is_paused(self, *, timeout: float | None = None) -> bool:
        """Return whether the arm is paused."""
        return PORTAL.run(lambda: self.asynchronous.is_paused(timeout=timeout))

    def is_in_position(self, values: Sequence[float], *, coords: bool = False, timeout: float | None = None) -> bool:
        """Return whether the arm says that it is at these angles, or coordinates. The vendor calls it unstable.

        Args:
            values: Degrees of all joints, or mm and degrees of all axes.
            coords: Whether they are coordinates.
            timeout: Seconds.
        """
        return PORTAL.run(lambda: self.asynchronous.is_in_position(values, coords=coords, timeout=timeout))

    def is_powered(self, *, timeout: float | None = None) -> bool:
        """Return whether the Atom is powered."""
        return PORTAL.run(lambda: self.asynchronous.is_powered(timeout=timeout))

    def power_on(self, *, timeout: float | None = 3.0) -> None:
        """Power the servos on, and return when the arm says that they are."""
        PORTAL.run(lambda: self.asynchronous.power_on(timeout=timeout))

    def power_off(self, *, timeout: float | None = 3.0) -> None:
        """Power the servos off: the arm falls. Returns when the arm says that they are."""
        PORTAL.run(lambda: self.asynchronous.power_off(timeout=timeout))

    def release(self, joint: int | None = None, *, damping: bool = True, timeout: float | None = None) -> None:
        """Let one servo (from 1) go, or all: the arm falls, unless somebody holds it; damped, where the firmware can.

        Args:
            joint: Which one; None for all.
            damping: False lets it go without; older firmware knows no difference.
            timeout: Seconds.
        """
        PORTAL.run(lambda: self.asynchronous.release(joint, damping=damping, timeout=timeout))

    def focus(self, joint: int | None = None, *, timeout: float | None = None) -> None:
        """Let one servo (from 1) hold its place again, or all.

        Args:
            joint: Which one; None for all.
            timeout: Seconds.
        """
        PORTAL.run(lambda: self.asynchronous.focus(joint, timeout=timeout))

    def get_pin(self, pin: int, *, base: bool = False, timeout: float | None = None) -> bool:
        """Return the level of a pin of the Atom, at the tool, or of the M5 in the base.

        Args:
            pin: Its number, on the Atom or the M5.
            base: Whether it is one of the M5.
            timeout: Seconds.
        """
        return PORTAL.run(lambda: self.asynchronous.get_pin(pin, base=base, timeout=timeout))

    def get_gripper(self, *, kind: c.GripperType | None = None, timeout: float | None = None) -> int:
        """Return how far the gripper is open, 0 to 100 percent; raise CommandRejected if no gripper answers the arm.

        Args:
            kind: Which gripper it is, where the firmware has to be told.
            timeout: Seconds.
        """
        return PORTAL.run(lambda: self.asynchronous.get_gripper(kind=kind, timeout=timeout))

    def get_encoders(self, *, timeout: float | None = None) -> tuple[int, ...]:
        """Return the positions of the servos, 0 to 4096."""
        return PORTAL.run(lambda: self.asynchronous.get_encoders(timeout=timeout))

    def get_speeds(self, *, timeout: float | None = None) -> tuple[int, ...]:
        """Return the speeds of the servos, steps/s."""
        return PORTAL.run(lambda: self.asynchronous.get_speeds(timeout=timeout))

    def get_voltages(self, *, timeout: float | None = None) -> tuple[float, ...]:
        """Return the voltages of the servos."""
        return PORTAL.run(lambda: self.asynchronous.get_voltages(timeout=timeout))

    def get_temperatures(self, *, timeout: float | None = None) -> tuple[int, ...]:
        """Return the temperatures of the servos, degrees Celsius."""
        return PORTAL.run(lambda: self.asynchronous.get_temperatures(timeout=timeout))

    def get_status(self, *, timeout: float | None = None) -> tuple[int, ...]:
        """Return a byte for each servo, 0 if all is well: bit 0 voltage, 1 sensor, 2 heat, 3 current, 5 overload."""
        return PORTAL.run(lambda: self.asynchronous.get_status(timeout=timeout))

    def get_joint_limits(self, joint: int, *, timeout: float | None = None) -> tuple[float, float]:
        """Return the least and the greatest angle that the arm allows a joint (from 1).

        Args:
            joint: From 1.
            timeout: Seconds.
        """
        return PORTAL.run(lambda: self.asynchronous.get_joint_limits(joint, timeout=timeout))

    def set_joint_limits(self, joint: int, low: float, high: float, *, timeout: float | None = None) -> None:
        """Set the least and the greatest angle that the arm allows a joint (from 1); in tenths of a degree.

        Args:
            joint: From 1.
            low: Degrees.
            high: Degrees.
            timeout: Seconds.

        Raises:
            ValueError: An argument is out of range; nothing was sent.
        """
        PORTAL.run(lambda: self.asynchronous.set_joint_limits(joint, low, high, timeout=timeout))

    def get_tool(self, *, timeout: float | None = None) -> c.Coords:
        """Return where the tool's end is, seen from the flange."""
        return PORTAL.run(lambda: self.asynchronous.get_tool(timeout=timeout))

    def set_tool(self, *coords: float, timeout: float | None = None) -> None:
        """Say where the tool's end is, seen from the flange; it counts once `set_end_type(EndType.TOOL)` was said.

        Args:
            *coords: x, y, z in mm, rx, ry, rz in degrees.
            timeout: Seconds.

        Raises:
            ValueError: An argument is out of range; nothing was sent.
        """
        PORTAL.run(lambda: self.asynchronous.set_tool(*coords, timeout=timeout))

    def get_world(self, *, timeout: float | None = None) -> c.Coords:
        """Return where the arm's base is in the world."""
        return PORTAL.run(lambda: self.asynchronous.get_world(timeout=timeout))

    def set_world(self, *coords: float, timeout: float | None = None) -> None:
        """Say where the arm's base is in the world; it counts once the reference frame is WORLD.

        Args:
            *coords: x, y, z in mm, rx, ry, rz in degrees.
            timeout: Seconds.

        Raises:
            ValueError: An argument is out of range; nothing was sent.
        """
        PORTAL.run(lambda: self.asynchronous.set_world(*coords, timeout=timeout))

    def set_reference_frame(self, frame: c.ReferenceFrame, *, timeout: float | None = None) -> None:
        """Say in which frame coordinates are.

        Args:
            frame: That of the arm's base, or the world's; see `set_world`.
            timeout: Seconds.
        """
        PORTAL.run(lambda: self.asynchronous.set_reference_frame(frame, timeout=timeout))

    def set_end_type(self, end: c.EndType, *, timeout: float | None = None) -> None:
        """Say whether coordinates are the flange's or the tool's.

        Args:
            end: The flange, or the tool; see `set_tool`.
            timeout: Seconds.
        """
        PORTAL.run(lambda: self.asynchronous.set_end_type(end, timeout=timeout))

    def set_movement_type(self, mode: c.MoveMode, *, timeout: float | None = None) -> None:
        """Say how the arm moves to a point where the motion does not say it.

        Args:
            mode: ANGULAR moves the joints, LINEAR the tool along a straight line.
            timeout: Seconds.
        """
        PORTAL.run(lambda: self.asynchronous.set_movement_type(mode, timeout=timeout))

    def jog(self, direction: str, seconds: float, *, speed: int = 50) -> None:
        """Jog for a time, then stop.

        Args:
            direction: j1+ j1- ... for a joint, x+ x- y+ y- z+ z- rx+ rx- ry+ ry- rz+ rz- for the tool, as far as the
                model has them.
            seconds: How long, finite and not negative.
            speed: Percent.

        Raises:
            DobotError: As `jogging`.
        """
        PORTAL.run(lambda: self.asynchronous.jog(direction, seconds, speed=speed))

    def jogging(self, direction: str, *, speed: int = 50) -> AbstractContextManager[None]:
        """Jog until the block ends, however it ends; the stop is repeated until the arm says that it stands.

        A block that ends well is followed by an error if the arm did not jog until its end.

        Args:
            direction: As for `jog`.
            speed: Percent.

        Raises:
            ValueError: There is no such direction; the message lists those of this model.
            CommandRejected: The arm did not move, or motions of the queue are under way.
            MotionStopped: It came to rest before the end, at a limit or at the end of its reach; or it was stopped
                before the tool left the workspace of `connect`.
            ArmAlarm: A joint keeps it from moving.
            ReplyTimeout: The arm does not answer when it is to begin, or when it is to stop.
        """
        return BlockingContext(lambda: self.asynchronous.jogging(direction, speed=speed), same, "jogging")

    def following(
        self,
        *,
        rate: SupportsFloat = 30.0,
        max_speed: SupportsFloat = 100.0,
        max_turn: SupportsFloat = 90.0,
        stale: SupportsFloat = 0.3,
        speed: int = 100,
    ) -> AbstractContextManager[Follow]:
        """Let the arm follow a target for the length of a block, and stop it at the end, as `stop` does.

        While it lasts the arm is in fresh mode 1. Commands that are queued are refused, and jogs; what is done at once,
        as the gripper, is not.

        Args:
            rate: Setpoints per second at the most, above 0 to 200; fewer where the line is slow.
            max_speed: mm/s at which the setpoint goes to the target, above 0.
            max_turn: The same of rx, ry, rz, and of joints: degrees/s.
            stale: Seconds after which the arm comes to rest if the target was not renewed.
            speed: Percent, 1 to 100, with which the arm goes to each setpoint.

        Raises:
            ValueError: A number is out of range.
            CommandRejected: Commands are pending; the arm is not powered; it stands although it is to go.
            ArmAlarm: A joint keeps the arm from moving; the message has the target.
            MotionStopped: A stop ended it.
            MotionUnknown: The arm is silent, or the link was lost.
            ConnectionLost: The link is gone.
        """
        return BlockingContext(
            lambda: self.asynchronous.following(
                rate=rate, max_speed=max_speed, max_turn=max_turn, stale=stale, speed=speed
            ),
            Follow,
            "__call__",
        )
