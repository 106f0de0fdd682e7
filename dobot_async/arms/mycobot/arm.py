"""An arm of the myCobot family: connect, ask, move, stop."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Coroutine, Mapping
from contextlib import asynccontextmanager
from functools import partial
from typing import Any, Literal, Self, TypeVar, cast

from dobot_async._core.link.link import Link
from dobot_async._core.link.round_trip import RoundTrip
from dobot_async._core.protocol.transport import Transport
from dobot_async._core.protocol.wire import Command, Queueing
from dobot_async._core.queue.host import HostExecutor
from dobot_async._core.util.arguments import check_duration, check_timeout
from dobot_async._core.util.shapes import Box, Cylinder
from dobot_async._core.util.workspace import Workspace
from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot import frame
from dobot_async.arms.mycobot.channel import Channel
from dobot_async.arms.mycobot.executor import CobotRunner, Tolerance
from dobot_async.arms.mycobot.following import CobotFollowing
from dobot_async.arms.mycobot.gripper import GRIPPER
from dobot_async.arms.mycobot.jogging import Jogging
from dobot_async.arms.mycobot.keeping import CobotKeeper
from dobot_async.arms.mycobot.models import DEFAULT, CobotModel, Range, model_of
from dobot_async.arms.mycobot.opening import BARRIERS, GAP, greet, opened, reply_times, with_baud
from dobot_async.arms.mycobot.queue import CobotQueue
from dobot_async.arms.mycobot.readings import Readings
from dobot_async.arms.mycobot.trace_words import frames_of
from dobot_async.arms.mycobot.verbs import Verbs
from dobot_async.arms.session import arm_session, check_options, run_owned
from dobot_async.errors import DobotError, MotionStopped, ReplyTimeout
from dobot_async.traces.recorder import Record, RecordSettings

__all__ = ["BARRIERS", "GAP", "MyCobot", "opened", "with_baud"]

Q = TypeVar("Q")
R = TypeVar("R")

TOLERANCE: Tolerance = (4.0, 8.0)
"""Half as much again as the worst that users report of a 280: 2.6 degrees, and 4.3 mm along an axis."""


class MyCobot(Readings, Jogging, Verbs[Coroutine[Any, Any, None]]):
    """An arm behind a link; made by `MyCobot.connect`. Each verb returns when it is done, and raises what `Arm` names.

    A motion belongs to the call that awaits it: if that is cancelled, or its timeout passes, the arm stops.

    Attributes:
        link: The connection, with its state, events and figures.
        queue: The queue of motions, with the same verbs. It is on this side, so it ends with the block.
        following: Called for a block in which the arm follows a target: `async with arm.following() as follow`.
    """

    def __init__(
        self,
        link: Link[frame.Frame],
        *,
        model: CobotModel,
        acknowledges: bool,
        tolerance: Tolerance,
        fresh: bool = False,
        patience: float = 0.0,
        workspace: Workspace | None = None,
    ) -> None:
        self.link = link
        self._model = model
        self._fresh = fresh
        self._channel = Channel(link, model, acknowledges=acknowledges, patience=patience)
        keeper = CobotKeeper(workspace, self._channel) if workspace else None
        self._workspace = workspace
        self._runner = CobotRunner(self._channel, tolerance, keeper)
        self._executor = HostExecutor(self._runner, link.cleanup)
        self._executor.keeper = keeper
        self.queue: CobotQueue = CobotQueue(self._executor, model)
        self.following: CobotFollowing = CobotFollowing(self._channel, self._runner, tolerance, lambda: self.queue)
        link.on_lost.add(lambda error: self.queue.fail(error))  # noqa: PLW0108 - a fleet gives the arm another queue
        super().__init__(self._channel, self._runner)

    @property
    def model(self) -> CobotModel:
        """What the arm is: its joints, its limits, its rows of the command table."""
        return self._model

    @classmethod
    @asynccontextmanager
    async def connect(
        cls,
        url: str,
        *,
        model: str = DEFAULT,
        control: bool = True,
        queue: Literal["fresh", "keep"] = "fresh",
        timeout: float = 5.0,
        on_error: Literal["stop", "leave"] = "stop",
        reconnect: bool = False,
        reply_timeout: float | tuple[float, float] | None = None,
        acknowledges: bool | None = None,
        tolerance: Tolerance = TOLERANCE,
        limits: Mapping[str, Range] | None = None,
        gap: float = GAP,
        max_requests: float | None = None,
        workspace: Workspace | Box | Cylinder | None = None,
        record: Record | None = None,
    ) -> AsyncGenerator[Self]:
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
        arm_model = model_of(model).limited(limits or {})
        reply_timeout = reply_times(url) if reply_timeout is None else reply_timeout
        common = check_options(queue, on_error, timeout, reply_timeout, max_requests, workspace)
        gap = check_duration(gap, "gap")
        check_tolerance(tolerance)
        reopen = partial(opened, model=model, timeout=common.timeout, gap=gap)

        def connected(transport: Transport, found: str) -> Link[frame.Frame]:
            return Link(
                transport,
                frame.Parser(arm_model.known),
                frame.request,
                url=url,
                barriers=[frame.request(arm_model.row(row), b"", queued=False) for row in BARRIERS],
                read_only=not control,
                round_trip=RoundTrip(*common.reply_timeout),
                reopen=partial(reopen, found) if reconnect else None,
                max_requests=common.max_requests,
            )

        build = partial(
            cls,
            model=arm_model,
            acknowledges=arm_model.acknowledges if acknowledges is None else acknowledges,
            tolerance=tolerance,
            fresh=control and queue == "fresh",
            patience=common.reply_timeout[0],
            workspace=common.workspace,
        )
        async with arm_session(
            with_baud(url, arm_model.baud),
            common.timeout,
            reopen,
            lambda transport, found: build(connected(transport, found)),
            stop_on_error=control and on_error == "stop",
            recording=RecordSettings(record, frames_of(arm_model), model, common.reply_timeout),
        ) as arm:
            yield arm
            unsent = arm.queue.unsent

        check_all_sent(unsent)

    async def request(self, command: Command[Q, R], value: Q, *, timeout: float | None = None) -> R:
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
        if command.queueing is Queueing.ALWAYS:
            raise ValueError(f"{command.name} goes through the queue: await arm.queue.put(...)")

        if self._workspace and command.moves:
            raise ValueError(f"{command.name} has no end, and can leave the workspace: use jog() or jogging()")

        if not command.write:
            return await self._channel.ask(command, value, timeout=timeout)

        await self._channel.tell(cast("Command[Q, None]", command), value, timeout=timeout)
        return cast(R, None)

    async def clear_alarms(self, *, timeout: float | None = None) -> None:
        """Clear what was wrong with the last motion; the motions that it ended do not go on."""
        await self.queue.update()
        await self._channel.tell(c.CLEAR_ERROR_INFORMATION, None, timeout=timeout)

    async def recover(self) -> None:
        """Empty the queue, clear the alarms and power the arm on: it is ready for new commands.

        Raises:
            ArmAlarm: Something still keeps it from moving.
        """
        await self.queue.clear()
        await self.clear_alarms()
        await self.power_on()
        await self._runner.raise_joint_alarms()

    async def pause(self) -> None:
        """Let the arm wait where it is, in the middle of a motion; returns when it says that it does.

        Raises:
            CommandRejected: It answers, and goes on.
        """
        await self.queue.pause()

    async def resume(self) -> None:
        """Let a paused arm go on; returns when it says that it does.

        Raises:
            CommandRejected: It answers, and stays paused.
        """
        await self.queue.resume()

    async def stop(self, *, timeout: float = 5.0) -> None:
        """Stop the arm now, ahead of everything; pending Motions raise MotionStopped.

        Args:
            timeout: Seconds to wait until the arm says that it stands; it is told again after that, too, until it does.

        Raises:
            ReplyTimeout: The arm has not said so yet.
            MotionUnknown: It says that it still moves, 2 s after it was told.
            ConnectionLost: The link is gone.
        """
        await self.queue.stop(timeout=timeout)

    async def jog_stop(self) -> None:
        """Stop a jog; it stops any other motion as well."""
        await self.stop()

    def perform(self, command: Command[Q, Any], value: Q, timeout: float | None) -> Coroutine[Any, Any, None]:
        """Do a command and return when it is done: a motion through the queue, anything else immediately."""
        if command in GRIPPER:
            return self._grip(command, value, timeout)

        if command.queueing is Queueing.ALWAYS:
            return run_owned(self.queue, self.link.cleanup, command, value, timeout)

        return self._tell(command, value, timeout)

    async def _tell(self, command: Command[Q, None], value: Q, timeout: float | None) -> None:
        """Do what is no motion."""
        await self._channel.tell(command, value, timeout=timeout)

    async def _grip(self, command: Command[Any, None], value: Any, timeout: float | None) -> None:
        """Close or open the gripper, and return when it rests."""
        entry, timeout = self._runner.prepare(command, value), check_timeout(timeout)
        try:
            async with asyncio.timeout(timeout):
                await self._runner.run(entry)
        except TimeoutError as error:
            if isinstance(error, DobotError):
                raise

            raise ReplyTimeout(f"the gripper was not seen to be done within {timeout:.3g} s; it may go on") from None

    async def greet(self, timeout: float) -> None:
        """Prove that an arm answers, and as its model does, and stop it if that was asked for; for `connect`."""
        await greet(self._channel, timeout, stop=self._fresh)

    async def leave(self) -> None:
        """Stop the arm, until it says that it stands; for `connect`."""
        await self.queue.begin_stop(MotionStopped("the connection's block was left by an error"))


def check_tolerance(tolerance: Tolerance) -> None:
    """Raise ValueError for what is no tolerance."""
    if len(tolerance) != 2 or not min(check_duration(each, "tolerance") for each in tolerance) > 0:
        raise ValueError(f"tolerance must be degrees and mm, both above 0, not {tolerance!r}")


def check_all_sent(unsent: int) -> None:
    """Raise MotionStopped if a block has ended while commands waited to be sent."""
    if unsent:
        raise MotionStopped(
            f"the block ended while {unsent} commands waited in the queue, which is on this side: they were never "
            "sent; await arm.queue.join() before the end"
        )
