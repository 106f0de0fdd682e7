"""An Elephant Robotics ultraArm P340: connect, ask, move, stop."""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager, suppress
from functools import partial
from typing import Any, Literal, Self, TypeVar

import anyio

from dobot_async._core.link.link import Link
from dobot_async._core.link.round_trip import RoundTrip
from dobot_async._core.util.arguments import check_choice, check_duration, check_timeout
from dobot_async._core.util.tasks import STAYING
from dobot_async.arms.session import arm_session, check_options, run_owned
from dobot_async.errors import CommandRejected, DobotError, MotionStopped, ReplyTimeout
from dobot_async.transports import Transport
from dobot_async.ultraarm import commands as c
from dobot_async.ultraarm.executor import UltraArmExecutor
from dobot_async.ultraarm.frame import BARRIERS, Frame, Parser, encode
from dobot_async.ultraarm.gcode import GCodeRun, Source, parse_gcode
from dobot_async.ultraarm.jog import UltraArmJog
from dobot_async.ultraarm.opening import opened, silent
from dobot_async.ultraarm.queue import UltraArmQueue
from dobot_async.ultraarm.verbs import SPEED, Pump, Verbs, check_speed
from dobot_async.wire import Command, Queueing

__all__ = ["UltraArm", "UltraArmJog"]

Q = TypeVar("Q")
R = TypeVar("R")


TOOLS: tuple[tuple[Command[Any, Any], Any], ...] = ((c.LASER_OFF, None), (c.SET_PWM, c.PWM(0)))
"""What is switched off, beside the stop, when the arm's block is left by an error: nothing burns after it."""


class UltraArm(Verbs[Coroutine[Any, Any, None]]):
    """An ultraArm P340; made by `connect`. Each verb returns when the arm has done it.

    A command belongs to the call that awaits it: if that is cancelled, or its timeout passes, the arm stops.

    Attributes:
        link: The connection, with its state, events and figures.
        queue: The arm's queue, with the same verbs.
        limits: What the arm may be told.
    """

    def __init__(
        self,
        link: Link[Frame],
        *,
        limits: c.UltraArmLimits,
        pump: Pump,
        depth: int,
        tolerance: float | None,
        on_stop: Literal["release", "finish"],
        fresh: bool = False,
    ) -> None:
        self.link = link
        self.limits = limits
        self.pump = pump
        self._fresh = fresh
        self._executor = UltraArmExecutor(link, limits.check, depth=depth, tolerance=tolerance, on_stop=on_stop)
        self.queue = UltraArmQueue(self._executor, pump)
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
        depth: int = 12,
        tolerance: float | None = 1.0,
        on_stop: Literal["release", "finish"] = "release",
    ) -> AsyncIterator[Self]:
        """Connect to an arm for the length of a block.

        It never sets parameters or moves on its own.

        Args:
            url: `serial:///dev/ttyUSB0`, `tcp://host:port`, `sim:`. A link for datagrams will not do: the arm's
                commands have no numbers, so that nothing shows that one was doubled.
            control: False for observers: only reads are sent, everything else raises ValueError.
            queue: "fresh" waits with the first command until what earlier programs left in the arm's queue is done, for
                nothing can empty it; "keep" puts commands behind it.
            timeout: Seconds until an arm must have answered.
            on_error: "stop" stops the arm when the block is left by an exception or a cancellation; "leave" lets it
                finish.
            reconnect: Reopen a link that breaks. Motions resolve if it can be seen where the last one ended, else they
                raise MotionUnknown.
            reply_timeout: Seconds without an answer after which a question is asked again: the least and the most that
                it may adapt itself to, or one fixed value.
            limits: MANUAL_LIMITS, the tighter ones, LIBRARY_LIMITS, or others.
            pump: "manual": M23 starts the pump; "vendor": M22 does. Which of them is right depends on the arm.
            depth: How many commands may wait in the arm's queue. A stop cannot take them back.
            tolerance: By how many mm or degrees the arm may miss the target of an absolute motion; if it misses it by
                more when it has come to rest, the motion raises ArmAlarm. None does not look.
            on_stop: What to do where M15 does not end a motion: "release" takes the power off the motors, after which
                the arm has to be powered on and homed; "finish" lets it finish what is in its queue.

        Raises:
            ValueError: The URL or an argument is wrong.
            ConnectFailed: No arm answered; the message says what to check.
        """
        timeout = check_options(queue, on_error, timeout, reply_timeout)
        check_choice("on_stop", on_stop, "release", "finish")
        check_choice("pump", pump, "manual", "vendor")
        if not hasattr(depth, "__index__") or depth < 1:
            raise ValueError(f"depth must be a whole number, 1 or more, not {depth!r}")

        tolerance = None if tolerance is None else check_duration(tolerance, "tolerance")
        if tolerance == 0:
            raise ValueError("tolerance must be above 0 (mm or degrees); None does not look")

        floor, ceiling = reply_timeout if isinstance(reply_timeout, tuple) else (reply_timeout, reply_timeout)
        reopen = partial(opened, timeout=timeout)

        def build(transport: Transport, found: str) -> UltraArm:
            link = Link(
                transport,
                Parser(),
                encode,
                url=url,
                barriers=BARRIERS,
                read_only=not control,
                round_trip=RoundTrip(floor, ceiling),
                reopen=partial(reopen, found) if reconnect else None,
            )
            fresh = queue == "fresh"
            return cls(link, limits=limits, pump=pump, depth=depth, tolerance=tolerance, on_stop=on_stop, fresh=fresh)

        async with arm_session(url, timeout, reopen, build, stop_on_error=control and on_error == "stop") as arm:
            assert isinstance(arm, cls)
            yield arm

    async def request(self, command: Command[Q, R], value: Q, *, timeout: float | None = None) -> R:
        """Send any row of the command table at once, and return the arm's answer.

        What the arm makes wait in its queue has been taken, and not done, when this returns: a `Receipt` says how many
        commands wait.

        Args:
            command: A row of `dobot_async.ultraarm.commands`.
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
        return await self._executor.ask(command, value, timeout=timeout)

    async def get_angles(self, *, timeout: float | None = None) -> c.UltraArmAngles:
        """Return the joints, degrees. Manual 5, M12."""
        return await self._executor.ask(c.GET_ANGLES, None, timeout=timeout)

    async def get_coords(self, *, timeout: float | None = None) -> c.UltraArmCoords:
        """Return where the tool is, mm, and the fourth joint, degrees. Manual 5, M114."""
        return await self._executor.ask(c.GET_COORDS, None, timeout=timeout)

    async def get_endstops(self, *, timeout: float | None = None) -> c.Endstops:
        """Return the home switches. Manual 5, M119."""
        return await self._executor.ask(c.GET_ENDSTOPS, None, timeout=timeout)

    async def get_queue_size(self, *, timeout: float | None = None) -> int:
        """Return how many commands wait in the arm's queue."""
        return (await self._executor.ask(c.GET_QUEUE_SIZE, None, timeout=timeout)).queue_size

    async def is_moving(self, *, timeout: float | None = None) -> bool:
        """Return whether the arm moves."""
        return not (await self._executor.ask(c.GET_STATUS, None, timeout=timeout)).at_rest

    async def get_version(self, *, timeout: float | None = None) -> str:
        """Return the firmware's version, "1.2"; CommandRejected from firmware that does not tell it."""
        version = await self._executor.ask(c.GET_SYSTEM_VERSION, None, timeout=timeout)
        return f"{version:g}"

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
        """Take the power off the motors, now: the arm may sink, and forgets where it is. Manual 5, M17."""
        await self._executor.ask(c.RELEASE, None, timeout=timeout)

    async def jog(self, direction: UltraArmJog, seconds: float, *, speed: float = SPEED) -> None:
        """Jog for a time, then stop. Manual 5, M13 to M15.

        Args:
            direction: Of the tool, or of a joint.
            seconds: How long, finite and not negative.
            speed: 1 to 200.
        """
        seconds = check_duration(seconds)
        async with self.jogging(direction, speed=speed):
            await anyio.sleep(seconds)

    @asynccontextmanager
    async def jogging(self, direction: UltraArmJog, *, speed: float = SPEED) -> AsyncIterator[None]:
        """Jog until the block ends, however it ends; the stop is repeated until that is seen. Manual 5, M13 to M15.

        Raises:
            CommandRejected: The motors have no power.
            ReplyTimeout: The arm does not acknowledge that it is to begin, or is not seen to stand.
        """
        is_joint, axis, way = direction.value
        if self._executor.released:
            raise CommandRejected("the motors have no power: power_on(), then home()")

        command, value = c.JOG_JOINT if is_joint else c.JOG_COORD, c.JogMove(axis, way, check_speed(speed))
        self.link.frame(command, value)  # what is wrong is said before anything is sent, a stop included
        async with self.link.cleanup.at_end(self._executor.end_jog, "the end of the jog"):
            await self.queue.beside(self._executor.ask(command, value))
            yield

    async def jog_stop(self, *, timeout: float = STAYING) -> None:
        """End a jog; what is in the arm's queue goes on. Manual 5, M15.

        Args:
            timeout: Seconds to wait until the arm is seen to stand; it is told again after that, too, until it does.
        """
        self.link.frame(c.JOG_STOP, None)
        limit = check_timeout(timeout)
        ending = self.link.cleanup.start(self._executor.end_jog(), "the end of the jog")
        done, _ = await asyncio.wait([ending], timeout=limit)
        if not done:
            raise ReplyTimeout(f"the jog has not ended within {timeout:.3g} s; the arm is told again until it does")

        ending.result()

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
        steps = parse_gcode(source, self.limits)
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
        return run_owned(self.queue, self.link.cleanup, command, value, timeout)

    async def greet(self, timeout: float) -> None:
        """Prove that an arm answers; for `connect`."""
        try:
            await self._executor.greet(timeout, fresh=self._fresh)
        except DobotError as error:
            raise silent(self.link) from error

    async def leave(self) -> None:
        """Stop the arm and its laser, until it has heard that; for `connect`."""
        stop = self.queue.begin_stop(MotionStopped("the connection's block was left by an error"))
        results = await asyncio.gather(stop, self._darken(), return_exceptions=True)
        await self._darken()  # what the stop has thrown away may have been this
        for failure in filter(None, results):
            raise failure

    async def _darken(self) -> None:
        """Switch the laser off, until the arm has heard it."""
        for command, value in TOOLS:
            with suppress(CommandRejected):  # an arm that does not know it has none
                await self._executor.ask(command, value, timeout=math.inf, urgent=True)
