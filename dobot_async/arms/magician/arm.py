"""A Dobot Magician: connect, ask, move, stop."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Coroutine
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from dataclasses import replace
from functools import partial
from typing import Any, Literal, Self, TypeVar

from dobot_async._core.link.link import Link
from dobot_async._core.link.round_trip import RoundTrip
from dobot_async._core.protocol.transport import Transport
from dobot_async._core.protocol.wire import Command, Queueing
from dobot_async._core.util.arguments import check_timeout
from dobot_async._core.util.shapes import Box, Cylinder
from dobot_async._core.util.workspace import Workspace
from dobot_async.arms.keeping import kept_inside
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician import frame
from dobot_async.arms.magician.alarms import Alarm, decode
from dobot_async.arms.magician.arguments import to_choice, to_flag
from dobot_async.arms.magician.executor import MagicianExecutor
from dobot_async.arms.magician.following import MagicianFollowing
from dobot_async.arms.magician.goals import Need, Plan
from dobot_async.arms.magician.hand_guided import HandGuided
from dobot_async.arms.magician.jogs import Jog
from dobot_async.arms.magician.keeping import MagicianKeeper, Stand, check_jog
from dobot_async.arms.magician.kinematics import Joints, Kinematics
from dobot_async.arms.magician.opening import BARRIERS, silent
from dobot_async.arms.magician.queue import MagicianQueue
from dobot_async.arms.magician.ranges import check_ranges
from dobot_async.arms.magician.reach import check_reach as check_target
from dobot_async.arms.magician.readings import Readings
from dobot_async.arms.magician.sensors import Sensors
from dobot_async.arms.magician.trace_words import FRAMES
from dobot_async.arms.magician.verbs import Verbs
from dobot_async.arms.magician.wifi import WiFi
from dobot_async.arms.session import arm_session, check_options, open_in_time, run_owned
from dobot_async.errors import DobotError, MotionStopped
from dobot_async.traces.recorder import Record, RecordSettings

__all__ = ["Jog", "Magician"]

Q = TypeVar("Q")
R = TypeVar("R")


class Magician(Readings, Sensors, HandGuided, Verbs[Coroutine[Any, Any, None]]):
    """A Dobot Magician; made by `connect`. Each verb returns when the arm has done it, and raises what `Arm` names.

    A motion belongs to the call that awaits it: if that is cancelled, or its timeout passes, the arm stops.

    Attributes:
        link: The connection, with its state, events and figures.
        queue: The arm's queue, with the same verbs.
        following: Called for a block in which the arm follows a target: `async with arm.following() as follow`.
        wifi: Which network the arm joins, and whether it is in it.
    """

    def __init__(
        self,
        link: Link[frame.Frame],
        *,
        window: int,
        check_reach: bool,
        fresh: bool = False,
        workspace: Workspace | None = None,
    ) -> None:
        self.link = link
        self.wifi: WiFi = WiFi(link)
        self._check_reach = check_reach
        self._fresh = fresh
        self._executor = MagicianExecutor(link, window, self._check)
        if workspace:
            self._executor.keeper = MagicianKeeper(workspace, self._stand, self._executor.status.ask)

        self.queue: MagicianQueue = MagicianQueue(self._executor)
        self.following: MagicianFollowing = MagicianFollowing(link, self._executor, lambda: self.queue)
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
        window: int = 1,
        check_reach: bool = False,
        reconnect: bool = False,
        reply_timeout: float | tuple[float, float] = (0.02, 0.5),
        max_requests: float | None = None,
        workspace: Workspace | Box | Cylinder | None = None,
        record: Record | None = None,
    ) -> AsyncGenerator[Self]:
        """Connects to an arm for the length of a block.

        It never clears alarms, sets parameters or moves on its own.

        Args:
            url: `serial:///dev/ttyUSB0`, `udp://192.168.1.20`, `tcp://host:port`, `ble://NAME`, `sim:`.
            control: False for observers: only reads are sent, everything else raises ValueError.
            queue: "fresh" empties the arm's queue and starts it, so that nothing that an earlier program left behind
                begins to move; "keep" leaves it as found.
            timeout: Seconds until an arm must have answered.
            on_error: "stop" stops the arm and empties its queue when the block is left by an exception or a
                cancellation; "leave" lets it finish.
            window: How many queued commands may be unacknowledged at a time, on links that allow more than one.
            check_reach: Refuse targets that the arm cannot reach before they are sent, with the reason.
            reconnect: Reopen a link that breaks. The arm goes on with its queue meanwhile; reads wait within their
                timeout; Motions resolve if it is still the same run of the arm, else they raise MotionUnknown.
            reply_timeout: Seconds without an answer after which a request is sent again: the least and the most that it
                may adapt itself to, or one fixed value.
            max_requests: How many requests per second go to the arm, 5 or more, over a line that others need as well;
                None sends as many as it answers. A call waits for its turn before its timeout begins; what stops the
                arm does not wait. With few of them the end of a motion is noticed later.
            workspace: Where the tool may be, in mm and the arm's own coordinates: a `Workspace`, or a Box or Cylinder
                that is allowed. Targets, and ways as far as they are known, raise OutsideWorkspace, a ValueError,
                before anything is sent; docs/workspace.md says what is looked at.
            record: Where to write down what goes over the connection, for the length of the block: a path, or a
                `dobot_async.traces.TraceFile`. Passwords are left out; see docs/trace.md.

        Raises:
            ValueError: The URL or an argument is wrong.
            ConnectFailed: No arm answered; the message says what to check.
        """
        common = check_options(queue, on_error, timeout, reply_timeout, max_requests, workspace)
        if not window >= 1:
            raise ValueError(f"window must be at least 1, not {window!r}")

        reopen = partial(open_in_time, arm="magician", timeout=common.timeout)

        def build(transport: Transport, found: str) -> Magician:
            link: Link[frame.Frame] = Link(
                transport,
                frame.Parser(),
                frame.request,
                url=url,
                barriers=[frame.request(row, b"", queued=False) for row in BARRIERS],
                filler=frame.FILLER,
                read_only=not control,
                round_trip=RoundTrip(*common.reply_timeout),
                reopen=partial(reopen, found) if reconnect else None,
                max_requests=common.max_requests,
            )
            return cls(
                link,
                window=min(window, transport.window),
                check_reach=check_reach,
                fresh=control and queue == "fresh",
                workspace=common.workspace,
            )

        recording = RecordSettings(record, FRAMES, "magician", common.reply_timeout)
        stop = control and on_error == "stop"
        async with arm_session(url, common.timeout, reopen, build, stop_on_error=stop, recording=recording) as arm:
            assert isinstance(arm, cls)
            yield arm

    @property
    def kinematics(self) -> Kinematics:
        """The arm's geometry with the end effector that it was told, or that it had when it was connected."""
        return self.queue.kinematics

    async def request(self, command: Command[Q, R], value: Q, *, timeout: float | None = None) -> R:
        """Sends any row of the command table immediately, and returns the arm's answer.

        Args:
            command: A row of `dobot_async.arms.magician.commands`.
            value: Its parameters; None where it has none.
            timeout: Seconds, repetitions included; the row's own by default.

        Raises:
            ValueError: The parameters do not fit, or are such that no motion would end; the command must be queued; or
                the connection only reads.
            ReplyTimeout: No answer came.
            ConnectionLost: The link is gone.
        """
        if command.queueing is Queueing.ALWAYS:
            raise ValueError(f"{command.name} goes through the queue: await arm.queue.put(...)")

        check_ranges(value)
        if self._executor.keeper:
            check_jog(value)

        request = self.link.request(command, value, timeout=timeout)
        return await (self.queue.beside(request) if command.moves else request)

    async def get_alarms(self, *, timeout: float | None = None) -> tuple[Alarm, ...]:
        """Returns all alarms that are set, with cause and remedy. Manual 2.5.1."""
        return decode(await self.link.request(c.GET_ALARMS_STATE, None, timeout=timeout))

    async def clear_alarms(self, *, timeout: float | None = None) -> None:
        """Clears the alarms; what the arm was doing when they came up does not go on. Manual 2.5.2."""
        await self.queue.update()  # without its alarm a motion that failed looks like one that is done
        await self.link.request(c.CLEAR_ALL_ALARMS_STATE, None, timeout=timeout)
        self._executor.status.alarms_cleared()

    async def recover(self) -> None:
        """Empty the queue, clear the alarms, and let the queue run: the arm is ready for new commands."""
        await self.queue.update()  # without its alarm a motion that failed looks like one that is done
        await self.queue.clear()
        await self.clear_alarms()
        await self.queue.resume()

    async def set_rail(
        self, *, on: bool = True, version: c.AccessoryVersion = c.AccessoryVersion.V1, timeout: float | None = None
    ) -> None:
        """Says whether the arm stands on a rail; needed after each power-up, before it moves along it.

        Args:
            on: Whether it does.
            version: Which hardware version the rail is.
            timeout: Seconds.
        """
        value = c.DeviceWithL(to_flag("on", on), to_choice("version", version, c.AccessoryVersion))
        await self.link.request(c.SET_DEVICE_WITH_L, value, timeout=timeout)
        self.queue.declared.told(value)

    async def set_end_effector(self, tool: c.EndEffectorParams, *, timeout: float | None = None) -> None:
        """Says which tool is on the arm: SuctionCup(), Gripper(), Pen(), Laser() or its own mm. Manual 2.9.1."""
        if not isinstance(tool, c.EndEffectorParams):
            raise TypeError(f"tool must be SuctionCup(), Gripper(), Pen(), Laser() or EndEffectorParams, not {tool!r}")

        await self.link.request(c.SET_END_EFFECTOR_PARAMS, tool, timeout=timeout)
        x, y, z = tool.x_bias, tool.y_bias, tool.z_bias
        self.queue.kinematics = replace(self.kinematics, x_bias=x, y_bias=y, z_bias=z)

    async def pause(self) -> None:
        """Lets the arm finish the command that it executes, and then wait. Manual 2.19.2."""
        await self.queue.pause()

    async def resume(self) -> None:
        """Lets a paused arm go on. Manual 2.19.1."""
        await self.queue.resume()

    async def stop(self, *, timeout: float = 5.0, tools: Literal["off", "leave"] = "off") -> None:
        """Stop the arm now, ahead of everything; pending Motions raise MotionStopped. Manual 2.19.3.

        The laser and the stepper motors stop as well. The pump keeps its state, so that nothing is dropped.

        Args:
            timeout: Seconds to wait for the arm to acknowledge it; it is repeated after that, too, until the arm does.
            tools: "leave" leaves laser and stepper motors as they are.

        Raises:
            ReplyTimeout: The arm has not acknowledged it yet.
            ConnectionLost: The link is gone.
        """
        await self.queue.stop(timeout=timeout, tools=tools)

    def perform(self, command: Command[Q, Any], value: Q, timeout: float | None) -> Coroutine[Any, Any, None]:
        """Do a command and return when it is done: a motion through the queue, anything else immediately."""
        if command.queueing is Queueing.ALWAYS:
            return run_owned(self.queue, self.link.cleanup, command, value, timeout)

        return self._do(command, value, timeout)

    async def perform_from_goal(self, plan: Plan, needs: Need, timeout: float | None) -> None:
        """Do what a plan makes of the goal of what is queued before it, or of where the arm stands."""
        timeout, loop = check_timeout(timeout), asyncio.get_running_loop()
        started = loop.time()
        command, value = await self.queue.planned(plan, needs)
        left = None if timeout is None else max(0.0, timeout - (loop.time() - started))
        await run_owned(self.queue, self.link.cleanup, command, value, left)

    async def greet(self, timeout: float) -> None:
        """Prove that an arm answers, with a read that tells its end effector, and ready its queue; for `connect`."""
        try:
            async with asyncio.timeout(timeout):
                bias = await self.link.request(c.GET_END_EFFECTOR_PARAMS, None, timeout=timeout)
                self.queue.kinematics = Kinematics(bias.x_bias, bias.y_bias, bias.z_bias)
                self.queue.inherited = not self._fresh
                if self._fresh:
                    await self._executor.clear()
                    await self._executor.space.read()
        except (DobotError, TimeoutError) as error:
            raise silent(self.link) from error

    async def leave(self) -> None:
        """Stop the arm and everything on it, until it has heard that; for `connect`."""
        await self.queue.begin_stop(MotionStopped("the connection's block was left by an error"))

    async def _do(self, command: Command[Q, Any], value: Q, timeout: float | None) -> None:
        """Do a command that takes no time."""
        check_ranges(value)
        await self.queue.declared.check([value])
        await self.link.request(command, value, timeout=timeout)
        self.queue.declared.told(value)

    def _check(self, value: Any) -> None:
        """Raise ValueError for parameters with which no motion ends, or a target out of reach if that was asked for."""
        check_ranges(value)
        if self._check_reach:
            check_target(self.kinematics, value)

        if self._executor.keeper:
            self._executor.keeper.check_target(value)

    async def _stand(self) -> Stand:
        """Where the arm stands, for what keeps it in its workspace."""
        ask = self._executor.status.ask
        pose, bias = await ask(c.GET_POSE), await ask(c.GET_END_EFFECTOR_PARAMS)
        kinematics = replace(self.kinematics, x_bias=bias.x_bias, y_bias=bias.y_bias, z_bias=bias.z_bias)
        known = not self.queue.leads_anywhere
        return Stand(kinematics, Joints(pose.j1, pose.j2, pose.j3, pose.j4) if known else None)

    def _kept(self, direction: Jog) -> AbstractAsyncContextManager[None]:
        """While this is entered, a jog is ended before it leaves the workspace."""
        keeper = self._executor.keeper
        return kept_inside(keeper.workspace if keeper else None, self._place, self._stop_jog, direction.word)

    async def _place(self) -> tuple[float, float, float]:
        pose = await self.get_pose()
        return pose.x, pose.y, pose.z
