"""An arm of the myCobot family: connect, ask, move, stop."""

from __future__ import annotations

import asyncio
import math
import re
from collections.abc import AsyncIterator, Awaitable
from contextlib import asynccontextmanager, suppress
from functools import partial
from typing import Any, Literal, Self, TypeVar, cast
from urllib.parse import urlsplit

import anyio

from dobot_async.errors import ConnectFailed, DobotError, MotionStopped, ReplyTimeout
from dobot_async.family import held, left, open_in_time, owned
from dobot_async.hosted import HostedExecutor
from dobot_async.link import Link
from dobot_async.motion import undisturbed
from dobot_async.mycobot import commands as c
from dobot_async.mycobot import frame
from dobot_async.mycobot.channel import Channel
from dobot_async.mycobot.executor import CobotHand, Tolerance
from dobot_async.mycobot.models import AXES, DEFAULT, CobotModel, model_of
from dobot_async.mycobot.queue import CobotQueue
from dobot_async.mycobot.readings import Readings
from dobot_async.mycobot.verbs import SPEED, Verbs
from dobot_async.roundtrip import RoundTrip
from dobot_async.transports import Transport
from dobot_async.transports.paced import Paced
from dobot_async.wire import Command, Queueing

__all__ = ["MyCobot"]

Q = TypeVar("Q")
R = TypeVar("R")
GAP = 0.02  # seconds; an M5 that is given frames more closely loses them
LEAVE_TIMEOUT = 2.0
JOG = re.compile(rf"(?:j(?P<joint>[1-9])|(?P<axis>{'|'.join(sorted(AXES, key=len, reverse=True))}))(?P<way>[+-])")


class MyCobot(Readings, Verbs[Awaitable[None]]):
    """An arm behind a link; made by `MyCobot.connect`. Each verb returns when the arm has done it.

    A motion belongs to the call that awaits it: if that is cancelled, or its timeout passes, the arm stops.

    Attributes:
        link: The connection, with its state, events and figures.
        queue: The queue of motions, with the same verbs. It is on this side, so it ends with the block.
    """

    def __init__(self, link: Link[frame.Frame], *, model: CobotModel, acknowledges: bool, tolerance: Tolerance) -> None:
        self.link = link
        self._model = model
        self._channel = Channel(link, model, acknowledges=acknowledges)
        self._hand = CobotHand(self._channel, tolerance)
        self._executor = HostedExecutor(self._hand)
        self.queue = CobotQueue(self._executor, model)
        link.lost = lambda error: self.queue.fail(error)  # noqa: PLW0108 - a fleet gives the arm another queue
        super().__init__(self._channel, self._hand)

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
        reply_timeout: float | tuple[float, float] = (0.05, 0.5),
        acknowledges: bool | None = None,
        tolerance: Tolerance = (2.0, 5.0),
        gap: float = GAP,
    ) -> AsyncIterator[Self]:
        """Connects to an arm for the length of a block.

        It never clears errors, sets parameters, powers the arm on or moves it on its own.

        Args:
            url: `serial:///dev/ttyUSB0`, `tcp://host:port`, `sim:`.
            model: "myarm300", "mycobot280", "mycobot280pi", "mycobot320", "mecharm270" or "mypalletizer260".
            control: False for observers: only reads are sent, everything else raises ValueError.
            queue: "fresh" stops what an earlier program left moving; "keep" leaves it as found.
            timeout: Seconds until an arm must have answered.
            on_error: "stop" stops the arm when the block is left by an exception or a cancellation; "leave" lets it
                finish the motion that it does.
            reconnect: Reopen a link that breaks. The arm goes on with its motion meanwhile, and is watched again after.
            reply_timeout: Seconds without an answer after which a request is sent again: the least and the most that it
                may adapt itself to, or one fixed value.
            acknowledges: Whether the firmware answers commands; None as the model does, and it is found out anyway.
            tolerance: How near a motion has to come to count as done: degrees, and mm.
            gap: Seconds between two frames.

        Raises:
            ValueError: The URL or an argument is wrong.
            ConnectFailed: No arm answered; the message says what to check.
            MotionStopped: The block has ended without an error, and motions were still waiting in the queue on this
                side: they were never sent.
        """
        arm_model = model_of(model)
        if queue not in {"fresh", "keep"} or on_error not in {"stop", "leave"} or gap < 0 or min(tolerance) <= 0:
            raise ValueError('expected queue "fresh" or "keep", on_error "stop" or "leave", gap >= 0, tolerances > 0')

        floor, ceiling = reply_timeout if isinstance(reply_timeout, tuple) else (reply_timeout, reply_timeout)
        reopen = partial(opened, with_baud(url, arm_model.baud), model, timeout, gap)
        deadline = asyncio.get_running_loop().time() + timeout
        link = Link(
            await reopen(),
            frame.Parser(arm_model.known),
            frame.request,
            url=url,
            fences=(c.IS_POWER_ON, c.IS_CONTROLLER_CONNECTED),
            read_only=not control,
            round_trip=RoundTrip(floor, ceiling),
            reopen=reopen if reconnect else None,
        )
        acknowledges = arm_model.acknowledges if acknowledges is None else acknowledges
        arm = cls(link, model=arm_model, acknowledges=acknowledges, tolerance=tolerance)
        greet = arm._greet(left(deadline, timeout), fresh=control and queue == "fresh")
        leave = arm._leave if control and on_error == "stop" else None
        async with held(greet, leave=leave, close=arm._close):
            yield arm
            unsent = arm._executor.unsent

        if unsent:
            raise MotionStopped(
                f"the block ended while {unsent} commands waited in the queue, which is on this side: they were never "
                "sent; await arm.queue.join() before the end"
            )

    async def request(self, command: Command[Q, R], value: Q, *, timeout: float | None = None) -> R:
        """Sends any row of the command table immediately, and returns the arm's answer, None for a command.

        Args:
            command: A row of `dobot_async.mycobot.commands`.
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

        if not command.write:
            return await self._channel.ask(command, value, timeout=timeout)

        await self._channel.tell(cast("Command[Q, None]", command), value, timeout=timeout)
        return cast(R, None)

    async def clear_alarms(self, *, timeout: float | None = None) -> None:
        """Clears what was wrong with the last motion; the motions that it ended do not go on."""
        try:
            await self.queue.update()
        except DobotError as error:
            self.queue.fail(error)

        await self._channel.tell(c.CLEAR_ERROR_INFORMATION, None, timeout=timeout)

    async def recover(self) -> None:
        """Clears the alarms and powers the arm on: it is ready for new commands."""
        await self.queue.clear()
        await self.clear_alarms()
        await self.power_on()

    async def pause(self) -> None:
        """Lets the arm wait where it is, in the middle of a motion."""
        await self.queue.pause()

    async def resume(self) -> None:
        """Lets a paused arm go on."""
        await self.queue.resume()

    async def stop(self) -> None:
        """Stops the arm now, ahead of everything; pending Motions raise MotionStopped."""
        await self.queue.stop()

    async def jog(self, direction: str, seconds: float, *, speed: int = SPEED) -> None:
        """Jogs for a time, then stops.

        Args:
            direction: j1+ j1- ... for a joint, x+ x- y+ y- z+ z- rx+ rx- ry+ ry- rz+ rz- for the tool.
            seconds: How long.
            speed: Percent.
        """
        if not (math.isfinite(seconds) and seconds >= 0):
            raise ValueError(f"seconds must be finite and not negative, not {seconds!r}")

        async with self.jogging(direction, speed=speed):
            await anyio.sleep(seconds)

    @asynccontextmanager
    async def jogging(self, direction: str, *, speed: int = SPEED) -> AsyncIterator[None]:
        """Jogs until the block ends, however it ends."""
        command, value = self._jog(direction, speed)
        self.link.frame(self._model.row(command), value)
        self._model.check(command, value)
        try:
            await self._channel.tell(command, value)
            yield
        finally:
            await undisturbed(self._hand.halt())

    async def jog_stop(self) -> None:
        """Stops a jog; it stops any other motion as well."""
        await self.stop()

    def perform(self, command: Command[Q, Any], value: Q, timeout: float | None) -> Awaitable[None]:
        """Does a command and returns when it is done: a motion through the queue, anything else immediately."""
        if command.queueing is Queueing.ALWAYS:
            return owned(self.queue, command, value, timeout)

        return self._channel.tell(command, value, timeout=timeout)

    def _jog(self, direction: str, speed: int) -> tuple[Command[Any, None], c.JogJoint | c.JogAxis]:
        """The command of a jog."""
        found = JOG.fullmatch(direction)
        if not found:
            raise ValueError(
                f"a direction is j1+ j1- ... or {' '.join(f'{axis}+' for axis in AXES)} ..., not {direction!r}"
            )

        way = c.Direction.UP if found["way"] == "+" else c.Direction.DOWN
        if found["joint"]:
            return c.JOG_ANGLE, c.JogJoint(int(found["joint"]), way, speed)

        return c.JOG_COORD, c.JogAxis(AXES.index(found["axis"]) + 1, way, speed)

    async def _greet(self, timeout: float, *, fresh: bool) -> None:
        """Proves that an arm answers, and as its model does, and stops it if that was asked for."""
        try:
            async with asyncio.timeout(timeout):
                powered = await self._channel.ask(c.IS_POWER_ON, None, timeout=timeout)
        except (DobotError, TimeoutError) as error:
            raise silent(self.link, self._model) from error

        try:
            if powered:
                await self._channel.ask(c.GET_ANGLES, None)

            if fresh:
                await self._hand.halt()
        except ReplyTimeout as error:
            raise ConnectFailed(
                f"an arm answers at {self.link.url}, but not as a {self._model.title} with {self._model.joints} joints "
                f"does ({self.link.stats.junk_bytes} bytes fit none of its answers); is the model right?"
            ) from error

    async def _leave(self) -> None:
        """Stops the arm, as far as the link still allows."""
        with suppress(TimeoutError, DobotError):
            async with asyncio.timeout(LEAVE_TIMEOUT):
                await self._executor.halt()

    async def _close(self) -> None:
        await self.queue.aclose()
        await self._executor.aclose()
        await self.link.aclose()


async def opened(url: str, model: str, timeout: float, gap: float) -> Transport:
    """Opens the way to an arm; what goes out on it is paced."""
    return Paced(await open_in_time(url, model, timeout), gap)


def with_baud(url: str, baud: int) -> str:
    """A serial URL with the model's baud rate, unless it has one of its own or the rate is the usual one."""
    parts = urlsplit(url)
    if parts.scheme != "serial" or "baud=" in parts.query or baud == 115200:
        return url

    return f"{url}{'&' if parts.query else '?'}baud={baud}"


def silent(link: Link[frame.Frame], model: CobotModel) -> ConnectFailed:
    """Why no arm answered, as far as what came instead tells."""
    advice = (
        "is the M5 in its base set by hand to the menu Transponder, and there to USB UART; is the arm switched on; and "
        "is this its port?"
    )
    if link.stats.junk_bytes:
        return ConnectFailed(
            f"{link.url} sends {link.stats.junk_bytes} bytes that are no answer of a {model.title}; is the baud rate "
            f"right ({model.baud} for this model), {advice}"
        )

    return ConnectFailed(f"no {model.title} answers at {link.url}; {advice}")
