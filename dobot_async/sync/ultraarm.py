"""An ultraArm P340, for programs without asyncio.

Written by tests/sync/write_sync.py: change what that reads, and run it again.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any, Literal, Self, SupportsFloat, TypeVar

from dobot_async._core.protocol.wire import Command
from dobot_async._core.util.bounds import ToolBounds
from dobot_async._core.util.shapes import Box, Cylinder
from dobot_async._core.util.workspace import Workspace
from dobot_async.arms.info import DeviceInfo
from dobot_async.arms.ultraarm import commands as c
from dobot_async.arms.ultraarm.arm import UltraArm as AsyncUltraArm
from dobot_async.arms.ultraarm.gcode import Source
from dobot_async.arms.ultraarm.goals import MotionFault
from dobot_async.arms.ultraarm.jog import UltraArmJog
from dobot_async.arms.ultraarm.queue import UltraArmBatch as AsyncUltraArmBatch
from dobot_async.arms.ultraarm.queue import UltraArmQueue as AsyncUltraArmQueue
from dobot_async.arms.ultraarm.verbs import Pump, Verbs
from dobot_async.sync.bases import ArmTwin, BatchTwin, QueueTwin
from dobot_async.sync.follow import Follow
from dobot_async.sync.link import Link
from dobot_async.sync.motion import Motion
from dobot_async.sync.portal import PORTAL
from dobot_async.sync.streams import GCodeRun
from dobot_async.sync.twin import BlockingContext, same
from dobot_async.traces.recorder import Record

__all__ = ["UltraArm", "UltraArmBatch", "UltraArmQueue"]

Q = TypeVar("Q")
R = TypeVar("R")


class UltraArmBatch(BatchTwin[AsyncUltraArmBatch], Verbs[Motion]):
    """Commands that are queued together; each verb returns its Motion, to be waited for after the batch's block."""

    def __init__(self, asynchronous: AsyncUltraArmBatch) -> None:
        super().__init__(asynchronous)
        self.pump: Pump = asynchronous.pump

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


class UltraArmQueue(QueueTwin[AsyncUltraArmQueue], Verbs[Motion]):
    """What is put here the arm is given in order, each once the one before it was seen to be done."""

    def __init__(self, asynchronous: AsyncUltraArmQueue) -> None:
        super().__init__(asynchronous)
        self.pump: Pump = asynchronous.pump

    def batch(self, *, timeout: float | None = None) -> AbstractContextManager[UltraArmBatch]:
        """Collect commands, and queue them with nothing between them when the block ends; an error sends none.

        Args:
            timeout: Seconds to wait for room in the queue.

        Raises:
            DobotError: As `put`; what was accepted before that is pending.
        """
        return BlockingContext(lambda: self.asynchronous.batch(timeout=timeout), UltraArmBatch, "batch")

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


class UltraArm(ArmTwin[AsyncUltraArm], Verbs[None]):
    """An ultraArm P340; made by `connect`. Each verb returns when the arm has done it, and raises what `Arm` names.

    A command belongs to the call that waits for it: if that is cancelled, or its timeout passes, the arm stops.
    """

    def __init__(self, asynchronous: AsyncUltraArm) -> None:
        super().__init__(asynchronous)
        self.pump: Pump = asynchronous.pump

    @property
    def link(self) -> Link:
        """The connection, with its state, events and figures."""
        return Link(self.asynchronous.link)

    @property
    def queue(self) -> UltraArmQueue:
        """The queue of what it is to do, with the same verbs."""
        return UltraArmQueue(self.asynchronous.queue)

    @property
    def limits(self) -> c.UltraArmLimits:
        """What the arm may be told."""
        return self.asynchronous.limits

    @classmethod
    def connect(
        cls,
        url: str,
        *,
        control: bool = True,
        queue: Literal["fresh", "keep"] = "fresh",
        timeout: float = 5.0,
        on_error: Literal["stop", "leave"] = "stop",
        reconnect: bool = False,
        reply_timeout: float | tuple[float, float] = (0.1, 0.5),
        limits: c.UltraArmLimits = c.MANUAL_LIMITS,
        pump: Pump = "manual",
        tolerance: float = 1.0,
        home_switches: tuple[int, int, int] | None = (1, 1, 1),
        on_stop: Literal["release", "finish"] = "release",
        max_requests: float | None = None,
        workspace: Workspace | Box | Cylinder | None = None,
        record: Record | None = None,
    ) -> AbstractContextManager[Self]:
        """Connect to an arm for the length of a block.

        It never sets parameters or moves on its own.

        Args:
            url: `serial:///dev/ttyUSB0`, `tcp://host:port`, `sim:`. A link for datagrams will not do: the arm's
                commands have no numbers, so that nothing shows that one was doubled.
            control: False for observers: only reads are sent, everything else raises ValueError.
            queue: Without effect, for nothing can empty the arm's queue: the first command waits until what earlier
                programs left in it is done.
            timeout: Seconds until an arm must have answered.
            on_error: "stop" stops the arm when the block is left by an exception or a cancellation; "leave" lets it
                finish.
            reconnect: Reopen a link that breaks. Motions go on to be looked at; `home` and `wait` raise MotionUnknown.
            reply_timeout: Seconds without an answer after which a question is asked again: the least and the most that
                it may adapt itself to, or one fixed value.
            limits: MANUAL_LIMITS, the tighter ones, LIBRARY_LIMITS, or others.
            pump: "manual": M23 starts the pump; "vendor": M22 does. Which of them is right depends on the arm.
            tolerance: By how many mm or degrees the arm may miss the goal of a motion; if it misses it by more when it
                has come to rest, the motion raises ArmAlarm.
            home_switches: What the home switches read at home (M119), as in the manual's example; None does not look,
                and then `home` is done when something has moved.
            on_stop: What to do where M15 does not end a motion: "release" takes the power off the motors, after which
                the arm has to be powered on and homed; "finish" lets it finish what is in its queue.
            max_requests: How many requests per second go to the arm, 5 or more, over a line that others need as well;
                None sends as many as it answers. A call waits for its turn before its timeout begins; what stops the
                arm does not wait. With few of them the end of a motion is noticed later.
            workspace: Where the tool may be, in mm and the arm's own coordinates: a `Workspace`, or a Box or Cylinder
                that is allowed. What leads outside raises OutsideWorkspace, a ValueError, before anything is sent, or
                CommandRejected where it shows when its turn comes. Motions given in joints are not looked at; see
                docs/workspace.md.
            record: Where to write down what goes over the connection, for the length of the block: a path, or a
                `dobot_async.traces.TraceFile`. Passwords are left out; see docs/trace.md.

        Raises:
            ValueError: The URL or an argument is wrong.
            ConnectFailed: No arm answered; the message says what to check.
        """
        return BlockingContext(
            lambda: AsyncUltraArm.connect(
                url,
                control=control,
                queue=queue,
                timeout=timeout,
                on_error=on_error,
                reconnect=reconnect,
                reply_timeout=reply_timeout,
                limits=limits,
                pump=pump,
                tolerance=tolerance,
                home_switches=home_switches,
                on_stop=on_stop,
                max_requests=max_requests,
                workspace=workspace,
                record=record,
            ),
            cls,
            str(url),
        )

    def request(self, command: Command[Q, R], value: Q, *, timeout: float | None = None) -> R:
        """Send any row of the command table at once, and return the arm's answer.

        What the arm makes wait in its queue has been taken, and not done, when this returns: a `Receipt` says how many
        commands wait.

        Args:
            command: A row of `dobot_async.arms.ultraarm.commands`.
            value: Its parameters; None where it has none.
            timeout: Seconds, repetitions included; the row's own by default.

        Raises:
            ValueError: The parameters do not fit, the command must be queued, or the connection only reads.
            CommandRejected: The arm answered with an error.
            ReplyTimeout: No answer came.
            ConnectionLost: The link is gone.
        """
        return PORTAL.run(lambda: self.asynchronous.request(command, value, timeout=timeout))

    def recover(self) -> None:
        """Empty the queue, and let the motors hold if they were told to let go; `home` is then still to be called."""
        PORTAL.run(self.asynchronous.recover)

    def pause(self) -> None:
        """Let the arm finish the command that it does, and give it no more until `resume`; Motions stay pending.

        The protocol has no pause in the middle of a motion.
        """
        PORTAL.run(self.asynchronous.pause)

    def resume(self) -> None:
        """Go on with what waits."""
        PORTAL.run(self.asynchronous.resume)

    def stop(self, *, timeout: float = 5.0) -> None:
        """Stop the arm, ahead of everything; pending Motions raise MotionStopped. See `on_stop` of `connect`.

        Args:
            timeout: Seconds to wait until the arm is seen to stand; it is told again after that, too, until it does.

        Raises:
            ReplyTimeout: It is not known to stand yet.
            CommandRejected: The arm goes on, although its motors were told to let go.
            ConnectionLost: The link is gone.
        """
        PORTAL.run(lambda: self.asynchronous.stop(timeout=timeout))

    def release(self, *, timeout: float | None = None) -> None:
        """Take the power off the motors, now: the arm may sink, and forgets where it is. Manual 5, M17.

        Motions and jogs are refused after it until `power_on` and `home`.
        """
        PORTAL.run(lambda: self.asynchronous.release(timeout=timeout))

    def run_gcode(
        self,
        source: Source,
        *,
        dry_run: bool = False,
        constant_speed: bool = False,
        progress: Callable[[int, int], None] | None = None,
    ) -> GCodeRun:
        """Check a G-code program as a whole, and return what runs it: call its `wait`, or iterate.

            arm.run_gcode("part.gcode").wait()
            for line in arm.run_gcode(lines): ...

        Args:
            source: A file's path, or lines.
            dry_run: Only check: nothing is sent, and `wait` returns at once.
            constant_speed: Run through it at constant speed, as the vendor's library does, and go back to ramps.
            progress: Called with (done, all) whenever a line is done.

        Raises:
            ValueError: Lines are wrong, or lead beyond the limits; the message has each with its number.
            OSError: The file cannot be read.
        """
        return GCodeRun(
            PORTAL.look(
                lambda: self.asynchronous.run_gcode(
                    source, dry_run=dry_run, constant_speed=constant_speed, progress=progress
                )
            )
        )

    def get_pose(self, *, timeout: float | None = None) -> c.UltraArmPose:
        """Return where the arm is: the tool, mm, and the joints, degrees, read at one time. Manual 5, M12 and M114."""
        return PORTAL.run(lambda: self.asynchronous.get_pose(timeout=timeout))

    def get_joints(self, *, timeout: float | None = None) -> tuple[float, ...]:
        """Return the four joints, degrees; the fourth is 0 where nothing is mounted on it. Manual 5, M12."""
        return PORTAL.run(lambda: self.asynchronous.get_joints(timeout=timeout))

    def get_angles(self, *, timeout: float | None = None) -> c.UltraArmAngles:
        """Return the joints, degrees. Manual 5, M12."""
        return PORTAL.run(lambda: self.asynchronous.get_angles(timeout=timeout))

    def get_coords(self, *, timeout: float | None = None) -> c.UltraArmCoords:
        """Return where the tool is, mm, and the fourth joint, degrees. Manual 5, M114."""
        return PORTAL.run(lambda: self.asynchronous.get_coords(timeout=timeout))

    def get_endstops(self, *, timeout: float | None = None) -> c.Endstops:
        """Return the home switches. Manual 5, M119."""
        return PORTAL.run(lambda: self.asynchronous.get_endstops(timeout=timeout))

    def get_queue_size(self, *, timeout: float | None = None) -> int:
        """Return how many commands wait in the arm's queue."""
        return PORTAL.run(lambda: self.asynchronous.get_queue_size(timeout=timeout))

    def is_moving(self, *, timeout: float | None = None) -> bool:
        """Return whether the arm moves."""
        return PORTAL.run(lambda: self.asynchronous.is_moving(timeout=timeout))

    def get_version(self, *, timeout: float | None = None) -> str:
        """Return the firmware's version, "1.2"; CommandRejected from firmware that does not tell it."""
        return PORTAL.run(lambda: self.asynchronous.get_version(timeout=timeout))

    def get_info(self, *, timeout: float | None = None) -> DeviceInfo:
        """Return who the arm is: it tells the version of its firmware alone, and older firmware not even that."""
        return PORTAL.run(lambda: self.asynchronous.get_info(timeout=timeout))

    def get_alarms(self, *, timeout: float | None = None) -> tuple[MotionFault, ...]:
        """Return what is known to keep the arm from moving: no power, or no place since it had none.

        The protocol has no alarms. This is what the program itself has done to the arm; what others did shows when a
        motion misses its goal.
        """
        return PORTAL.run(lambda: self.asynchronous.get_alarms(timeout=timeout))

    def clear_alarms(self, *, timeout: float | None = None) -> None:
        """Return if the arm is there: what `get_alarms` tells ends with `power_on` and `home` alone."""
        PORTAL.run(lambda: self.asynchronous.clear_alarms(timeout=timeout))

    def jog(self, direction: UltraArmJog | str, seconds: float, *, speed: float = 50.0) -> None:
        """Jog for a time, then stop. Manual 5, M13 to M15.

        Args:
            direction: Of the tool or of a joint, such as UltraArmJog.X_PLUS or "x+", "j2-".
            seconds: How long, finite and not negative.
            speed: 1 to 200.

        Raises:
            ValueError: There is no such direction; the message has all of them.
            DobotError: As `jogging`.
        """
        PORTAL.run(lambda: self.asynchronous.jog(direction, seconds, speed=speed))

    def jogging(self, direction: UltraArmJog | str, *, speed: float = 50.0) -> AbstractContextManager[None]:
        """Jog until the block ends, however it ends; the stop is repeated until that is seen. Manual 5, M13 to M15.

        What moves nothing, such as `suction`, can be done meanwhile.

        Args:
            direction: As for `jog`.
            speed: 1 to 200.

        Raises:
            CommandRejected: A motion or a jog goes on, or the motors have no power, or the arm has lost its place.
            ArmAlarm: The arm did not set out, or had come to the end of its way before the block ended.
            MotionStopped: It was stopped before the tool left the workspace of `connect`.
            ReplyTimeout: The arm does not acknowledge that it is to begin, or is not seen to stand.
        """
        return BlockingContext(lambda: self.asynchronous.jogging(direction, speed=speed), same, "jogging")

    def jog_stop(self, *, timeout: float = 5.0) -> None:
        """End a jog; what is in the arm's queue goes on. Manual 5, M15.

        Args:
            timeout: Seconds to wait until the arm is seen to stand; it is told again after that, too, until it does.

        Raises:
            ReplyTimeout: The arm is not seen to stand yet.
            ConnectionLost: The link is gone.
        """
        PORTAL.run(lambda: self.asynchronous.jog_stop(timeout=timeout))

    def following(
        self,
        *,
        rate: SupportsFloat = 30.0,
        max_speed: SupportsFloat = 100.0,
        max_turn: SupportsFloat = 90.0,
        stale: SupportsFloat = 0.3,
        motion_time: SupportsFloat = 0.1,
        constant_speed: bool = False,
    ) -> AbstractContextManager[Follow]:
        """Let the arm follow a target for the length of a block; at its end the arm comes to rest.

        It goes in short motions of about `motion_time`, for nothing ends one: with ramps that is slow, a few mm/s to
        some tens.
        While it lasts commands are refused, those of the tools too, and jogs.

        Args:
            rate: Setpoints per second at the most, above 0 to 200; fewer where the line, or the arm, is slow.
            max_speed: mm/s, above 0; the arm's F is 1 to 200.
            max_turn: The same of e, and of joints: degrees/s.
            stale: Seconds after which the arm comes to rest if the target was not renewed.
            motion_time: Seconds that each motion is to take, above 0 to 2. With ramps the arm gets on faster the longer
                they are, and cuts corners more; after the block it goes on for so long, up to twice.
            constant_speed: Run without ramps (M16 S0), as the vendor's library does in programs, and put that back
                after it (M16 S2). What it does to single motions nobody has measured.

        Raises:
            ValueError: A number is out of range.
            CommandRejected: Commands are pending; the arm is not homed; it stands although it is to go.
            ArmAlarm: The arm tells of an error; the message has the target.
            MotionStopped: A stop ended it.
            MotionUnknown: The arm is silent, or the link was lost.
            ConnectionLost: The link is gone.
        """
        return BlockingContext(
            lambda: self.asynchronous.following(
                rate=rate,
                max_speed=max_speed,
                max_turn=max_turn,
                stale=stale,
                motion_time=motion_time,
                constant_speed=constant_speed,
            ),
            Follow,
            "__call__",
        )
