"""An Elephant Robotics ultraArm P340: connect, ask, move, stop."""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress
from enum import Enum
from functools import partial
from typing import Any, Literal, Self, TypeVar

import anyio

from dobot_async.errors import CommandRejected, ConnectFailed, DobotError
from dobot_async.family import held, left, open_in_time, owned
from dobot_async.link import Link
from dobot_async.motion import undisturbed
from dobot_async.roundtrip import RoundTrip
from dobot_async.transports import Transport, hidden
from dobot_async.ultraarm import commands as c
from dobot_async.ultraarm.executor import UltraArmExecutor
from dobot_async.ultraarm.frame import Frame, Parser, encode
from dobot_async.ultraarm.gcode import GCodeRun, Source, parse_gcode
from dobot_async.ultraarm.queue import UltraArmQueue
from dobot_async.ultraarm.verbs import SPEED, Pump, Verbs
from dobot_async.wire import Command, Queueing

__all__ = ["UltraArm", "UltraArmJog"]

Q = TypeVar("Q")
R = TypeVar("R")
LEAVE_TIMEOUT = 2.0


class UltraArmJog(Enum):
    """A direction to jog in: of the tool, or of a joint. Manual 5, M13 and M14."""

    X_PLUS = (False, 1, c.JogDirection.POSITIVE)
    X_MINUS = (False, 1, c.JogDirection.NEGATIVE)
    Y_PLUS = (False, 2, c.JogDirection.POSITIVE)
    Y_MINUS = (False, 2, c.JogDirection.NEGATIVE)
    Z_PLUS = (False, 3, c.JogDirection.POSITIVE)
    Z_MINUS = (False, 3, c.JogDirection.NEGATIVE)
    J1_PLUS = (True, 1, c.JogDirection.POSITIVE)
    J1_MINUS = (True, 1, c.JogDirection.NEGATIVE)
    J2_PLUS = (True, 2, c.JogDirection.POSITIVE)
    J2_MINUS = (True, 2, c.JogDirection.NEGATIVE)
    J3_PLUS = (True, 3, c.JogDirection.POSITIVE)
    J3_MINUS = (True, 3, c.JogDirection.NEGATIVE)


LEAVING: tuple[tuple[Command[Any, Any], Any], ...] = ((c.LASER_OFF, None), (c.SET_PWM, c.PWM(0)))
"""What is said to the arm, beside the stop, when its block is left by an error: nothing burns after it."""


class UltraArm(Verbs[Awaitable[None]]):
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
    ) -> None:
        self.link = link
        self.limits = limits
        self.pump = pump
        self._executor = UltraArmExecutor(link, limits.check, depth=depth, tolerance=tolerance, on_stop=on_stop)
        self.queue = UltraArmQueue(self._executor, pump)
        link.lost = lambda error: self.queue.fail(error)  # noqa: PLW0108 - a fleet gives the arm another queue

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
        """Connects to an arm for the length of a block.

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
        choices = queue in {"fresh", "keep"} and on_error in {"stop", "leave"} and on_stop in {"release", "finish"}
        if not (choices and pump in {"manual", "vendor"} and depth >= 1):
            raise ValueError(
                'expected queue "fresh" or "keep", on_error "stop" or "leave", on_stop "release" or "finish", pump '
                '"manual" or "vendor", depth >= 1'
            )

        floor, ceiling = reply_timeout if isinstance(reply_timeout, tuple) else (reply_timeout, reply_timeout)
        deadline = asyncio.get_running_loop().time() + timeout
        round_trip = RoundTrip(floor, ceiling)
        link = Link(
            await opened(url, timeout),
            Parser(),
            encode,
            url=url,
            read_only=not control,
            round_trip=round_trip,
            reopen=partial(opened, url, timeout) if reconnect else None,
        )
        arm = cls(link, limits=limits, pump=pump, depth=depth, tolerance=tolerance, on_stop=on_stop)
        greet = arm._greet(left(deadline, timeout), fresh=queue == "fresh")
        leave = arm._leave if control and on_error == "stop" else None
        async with held(greet, leave=leave, close=arm._close):
            yield arm

    async def request(self, command: Command[Q, R], value: Q, *, timeout: float | None = None) -> R:
        """Sends any row of the command table at once, and returns the arm's answer.

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
        """Returns the joints, degrees. Manual 5, M12."""
        return await self._executor.ask(c.GET_ANGLES, None, timeout=timeout)

    async def get_coords(self, *, timeout: float | None = None) -> c.UltraArmCoords:
        """Returns where the tool is, mm, and the fourth joint, degrees. Manual 5, M114."""
        return await self._executor.ask(c.GET_COORDS, None, timeout=timeout)

    async def get_endstops(self, *, timeout: float | None = None) -> c.Endstops:
        """Returns the home switches. Manual 5, M119."""
        return await self._executor.ask(c.GET_ENDSTOPS, None, timeout=timeout)

    async def get_queue_size(self, *, timeout: float | None = None) -> int:
        """Returns how many commands wait in the arm's queue."""
        return (await self._executor.ask(c.GET_QUEUE_SIZE, None, timeout=timeout)).queue_size

    async def is_moving(self, *, timeout: float | None = None) -> bool:
        """Returns whether the arm moves."""
        return not (await self._executor.ask(c.GET_STATUS, None, timeout=timeout)).at_rest

    async def get_version(self, *, timeout: float | None = None) -> str:
        """Returns the firmware's version, "1.2"; CommandRejected from firmware that does not tell it."""
        version = await self._executor.ask(c.GET_SYSTEM_VERSION, None, timeout=timeout)
        return f"{version:g}"

    async def stop(self) -> None:
        """Stops the arm, ahead of everything; pending Motions raise MotionStopped. See `on_stop` of `connect`.

        Raises:
            CommandRejected: The arm goes on, although its motors were told to let go.
        """
        await self.queue.stop()

    async def release(self, *, timeout: float | None = None) -> None:
        """Takes the power off the motors, now: the arm may sink, and forgets where it is. Manual 5, M17."""
        await self._executor.ask(c.RELEASE, None, timeout=timeout)

    async def jog(self, direction: UltraArmJog, seconds: float, *, speed: float = SPEED) -> None:
        """Jogs for a time, then stops. Manual 5, M13 to M15."""
        if not (math.isfinite(seconds) and seconds >= 0):
            raise ValueError(f"seconds must be finite and not negative, not {seconds!r}")

        async with self.jogging(direction, speed=speed):
            await anyio.sleep(seconds)

    @asynccontextmanager
    async def jogging(self, direction: UltraArmJog, *, speed: float = SPEED) -> AsyncIterator[None]:
        """Jogs until the block ends, however it ends. Manual 5, M13 to M15.

        Raises:
            CommandRejected: The motors have no power.
        """
        is_joint, axis, way = direction.value
        if self._executor.released:
            raise CommandRejected("the motors have no power: power_on(), then home()")

        command, value = c.JOG_JOINT if is_joint else c.JOG_COORD, c.JogMove(axis, way, speed)
        self.link.frame(command, value)  # what is wrong is said before anything is sent, a stop included
        try:
            await self._executor.ask(command, value)
            yield
        finally:
            await undisturbed(self.jog_stop())

    async def jog_stop(self) -> None:
        """Ends a jog; what is in the arm's queue goes on. Manual 5, M15."""
        await self._executor.ask(c.JOG_STOP, None, urgent=True)

    def run_gcode(
        self,
        source: Source,
        *,
        dry_run: bool = False,
        constant_speed: bool = False,
        progress: Callable[[int, int], None] | None = None,
    ) -> GCodeRun:
        """Checks a G-code program as a whole, and returns what runs it when it is awaited or iterated over.

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
        return GCodeRun(self.queue, steps, send=not dry_run, constant_speed=constant_speed, progress=progress)

    def perform(self, command: Command[Q, Any], value: Q, timeout: float | None) -> Awaitable[None]:
        """Does a command through the queue, and returns when it is done."""
        return owned(self.queue, command, value, timeout)

    async def _greet(self, timeout: float, *, fresh: bool) -> None:
        """Proves that an arm answers."""
        try:
            async with asyncio.timeout(timeout):
                await self._executor.greet(timeout, fresh=fresh)
        except (DobotError, TimeoutError) as error:
            raise silent(self.link) from error

    async def _leave(self) -> None:
        """Stops the arm and its laser, as far as the link still allows."""
        with suppress(TimeoutError):
            async with asyncio.timeout(LEAVE_TIMEOUT):
                await self._darken()
                with suppress(DobotError):
                    await self._executor.halt()

                await self._darken()  # what the stop has thrown away may have been this

    async def _darken(self) -> None:
        """Switches the laser off."""
        requests = (self._executor.ask(command, value, urgent=True) for command, value in LEAVING)
        await asyncio.gather(*requests, return_exceptions=True)

    async def _close(self) -> None:
        await self.queue.aclose()
        await self.link.aclose()


async def opened(url: str, timeout: float) -> Transport:
    """Opens the transport in time, for one request at a time: nothing in an answer tells whose it is."""
    transport = await open_in_time(url, "ultraarm", timeout)
    if transport.disorder:
        await transport.aclose()
        raise ValueError(
            f"{hidden(url)!r}: an ultraArm needs a link that neither doubles nor reorders, such as serial: or tcp:"
        )

    transport.in_flight = transport.window = 1
    return transport


def silent(link: Link[Frame]) -> ConnectFailed:
    """Why no arm answered."""
    return ConnectFailed(
        f"no ultraArm answers at {link.url}; is the arm switched on, is this its port, does it run at 115200 baud, and "
        "does its firmware know M120 (QUEUE SIZE), which the oldest does not?"
    )
