"""An Elephant Robotics ultraArm P340: connect, ask, move, stop."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Callable, Coroutine
from contextlib import asynccontextmanager
from functools import partial
from typing import Any, Literal, Self, TypeVar

from dobot_async._core.link.link import Link
from dobot_async._core.link.round_trip import RoundTrip
from dobot_async._core.protocol.transport import Transport
from dobot_async._core.protocol.wire import Command, Queueing
from dobot_async._core.queue.host import HostExecutor
from dobot_async._core.util.arguments import check_choice, check_duration
from dobot_async._core.util.shapes import Box, Cylinder
from dobot_async._core.util.tasks import STAYING
from dobot_async._core.util.workspace import Workspace
from dobot_async.arms.session import arm_session, check_options, run_owned
from dobot_async.arms.ultraarm import commands as c
from dobot_async.arms.ultraarm.following import UltraArmFollowing
from dobot_async.arms.ultraarm.frame import BARRIERS, Frame, Parser, encode
from dobot_async.arms.ultraarm.gcode import GCodeRun, Source, parse_gcode
from dobot_async.arms.ultraarm.jog import Jogger, UltraArmJog
from dobot_async.arms.ultraarm.jogging import Jogging
from dobot_async.arms.ultraarm.keeping import Stand
from dobot_async.arms.ultraarm.opening import opened, silent
from dobot_async.arms.ultraarm.queue import UltraArmQueue
from dobot_async.arms.ultraarm.readings import Readings
from dobot_async.arms.ultraarm.runner import UltraArmRunner
from dobot_async.arms.ultraarm.state import JOGS
from dobot_async.arms.ultraarm.tools import darken
from dobot_async.arms.ultraarm.trace_words import FRAMES
from dobot_async.arms.ultraarm.verbs import Pump, Verbs
from dobot_async.errors import DobotError, MotionStopped
from dobot_async.traces.recorder import Record, RecordSettings

__all__ = ["UltraArm", "UltraArmJog"]

Q = TypeVar("Q")
R = TypeVar("R")


class UltraArm(Readings, Jogging, Verbs[Coroutine[Any, Any, None]]):
    """An ultraArm P340; made by `connect`. Each verb returns when the arm has done it, and raises what `Arm` names.

    A command belongs to the call that awaits it: if that is cancelled, or its timeout passes, the arm stops.

    Attributes:
        link: The connection, with its state, events and figures.
        queue: The queue of what it is to do, with the same verbs.
        following: Called for a block in which the arm follows a target: `async with arm.following() as follow`.
        limits: What the arm may be told.
    """

    def __init__(
        self,
        link: Link[Frame],
        *,
        limits: c.UltraArmLimits,
        pump: Pump,
        tolerance: float,
        home_switches: tuple[int, int, int] | None,
        on_stop: Literal["release", "finish"],
        workspace: Workspace | None = None,
    ) -> None:
        self.link = link
        self.limits = limits
        self.pump: Pump = pump
        self._workspace = workspace
        self._runner = UltraArmRunner(
            link, limits, tolerance=tolerance, home_switches=home_switches, on_stop=on_stop, workspace=workspace
        )
        super().__init__(self._runner)
        self._executor = HostExecutor(self._runner, link.cleanup)
        self._executor.keeper = self._runner.keeper
        self._jogger = Jogger(self._runner, link.cleanup)
        self.queue: UltraArmQueue = UltraArmQueue(self._executor, pump)
        self.following: UltraArmFollowing = UltraArmFollowing(self._runner, tolerance, lambda: self.queue)
        link.on_lost.add(lambda error: self.queue.fail(error))  # noqa: PLW0108 - a fleet gives the arm another queue

    @classmethod
    @asynccontextmanager
    async def connect(
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
    ) -> AsyncGenerator[Self]:
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
        common = check_options(queue, on_error, timeout, reply_timeout, max_requests, workspace)
        check_choice("on_stop", on_stop, "release", "finish")
        check_choice("pump", pump, "manual", "vendor")
        tolerance = check_duration(tolerance, "tolerance")
        if not tolerance:
            raise ValueError("tolerance must be above 0 (mm or degrees): no arm is exact")

        if home_switches is not None and (len(home_switches) != 3 or not {*home_switches} <= {0, 1}):
            raise ValueError(f"home_switches must be three of 0 and 1, or None, not {home_switches!r}")

        reopen = partial(opened, timeout=common.timeout)

        def build(transport: Transport, found: str) -> UltraArm:
            link = Link(
                transport,
                Parser(),
                encode,
                url=url,
                barriers=BARRIERS,
                read_only=not control,
                round_trip=RoundTrip(*common.reply_timeout),
                reopen=partial(reopen, found) if reconnect else None,
                max_requests=common.max_requests,
            )
            return cls(
                link,
                limits=limits,
                pump=pump,
                tolerance=tolerance,
                home_switches=home_switches,
                on_stop=on_stop,
                workspace=common.workspace,
            )

        recording = RecordSettings(record, FRAMES, "ultraarm", common.reply_timeout)
        stop = control and on_error == "stop"
        async with arm_session(url, common.timeout, reopen, build, stop_on_error=stop, recording=recording) as arm:
            assert isinstance(arm, cls)
            yield arm

    async def request(self, command: Command[Q, R], value: Q, *, timeout: float | None = None) -> R:
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
        if command.queueing is Queueing.ALWAYS:
            raise ValueError(f"{command.name} goes through the queue: await arm.queue.put(...)")

        self.limits.check(value)
        if self._runner.keeper:
            if command in JOGS:
                raise ValueError(f"{command.name} has no end, and can leave the workspace: use jog() or jogging()")

            self._runner.keeper.lead(command, value, Stand())

        self._runner.state.check(command)
        return await self._runner.ask(command, value, timeout=timeout)

    async def recover(self) -> None:
        """Empty the queue, and let the motors hold if they were told to let go; `home` is then still to be called."""
        await self.queue.clear()
        if not self._runner.state.powered:
            await self.power_on()

    async def pause(self) -> None:
        """Let the arm finish the command that it does, and give it no more until `resume`; Motions stay pending.

        The protocol has no pause in the middle of a motion.
        """
        await self.queue.pause()

    async def resume(self) -> None:
        """Go on with what waits."""
        await self.queue.resume()

    async def stop(self, *, timeout: float = STAYING) -> None:
        """Stop the arm, ahead of everything; pending Motions raise MotionStopped. See `on_stop` of `connect`.

        Args:
            timeout: Seconds to wait until the arm is seen to stand; it is told again after that, too, until it does.

        Raises:
            ReplyTimeout: It is not known to stand yet.
            CommandRejected: The arm goes on, although its motors were told to let go.
            ConnectionLost: The link is gone.
        """
        await self.queue.stop(timeout=timeout)

    async def release(self, *, timeout: float | None = None) -> None:
        """Take the power off the motors, now: the arm may sink, and forgets where it is. Manual 5, M17.

        Motions and jogs are refused after it until `power_on` and `home`.
        """
        await self._runner.ask(c.RELEASE, None, timeout=timeout)

    def run_gcode(
        self,
        source: Source,
        *,
        dry_run: bool = False,
        constant_speed: bool = False,
        progress: Callable[[int, int], None] | None = None,
    ) -> GCodeRun:
        """Check a G-code program as a whole, and return what runs it when it is awaited or iterated over.

            await arm.run_gcode("part.gcode")
            async for line in arm.run_gcode(lines): ...

        Args:
            source: A file's path, or lines.
            dry_run: Only check: nothing is sent, and awaiting it returns at once.
            constant_speed: Run through it at constant speed, as the vendor's library does, and go back to ramps.
            progress: Called with (done, all) whenever a line is done.

        Raises:
            ValueError: Lines are wrong, or lead beyond the limits; the message has each with its number.
            OSError: The file cannot be read.
        """
        steps = parse_gcode(source, self.limits, self._runner.keeper)
        return GCodeRun(
            self.queue,
            self.link.cleanup,
            steps,
            send=not dry_run,
            constant_speed=constant_speed,
            progress=progress,
        )

    def perform(self, command: Command[Q, Any], value: Q, timeout: float | None) -> Coroutine[Any, Any, None]:
        """Do a command through the queue, and return when it is done."""
        return self._perform(command, value, timeout)

    async def greet(self, timeout: float) -> None:
        """Prove that an arm answers; for `connect`."""
        try:
            await self._runner.ask(c.GET_QUEUE_SIZE, None, timeout=timeout)
        except DobotError as error:
            raise silent(self.link) from error

    async def leave(self) -> None:
        """Stop the arm and its laser, until it has heard that; for `connect`."""
        stop = self.queue.begin_stop(MotionStopped("the connection's block was left by an error"))
        results = await asyncio.gather(stop, darken(self._runner.channel), return_exceptions=True)
        await darken(self._runner.channel)  # what the stop has thrown away may have been this
        for failure in filter(None, results):
            raise failure

    async def _perform(self, command: Command[Q, Any], value: Q, timeout: float | None) -> None:
        if not self.queue.pending:
            self._runner.check_increments(command, value)

        await run_owned(self.queue, self.link.cleanup, command, value, timeout)
