"""A myCobot that is jogged: the verbs; `jog` has by which words, and whether the arm was seen to jog."""

from __future__ import annotations

from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager

import anyio

from dobot_async._core.link.link import Link
from dobot_async._core.util.arguments import check_duration
from dobot_async._core.util.workspace import Workspace
from dobot_async.arms.keeping import kept_inside
from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.channel import Channel
from dobot_async.arms.mycobot.executor import CobotRunner
from dobot_async.arms.mycobot.frame import Frame
from dobot_async.arms.mycobot.jog import jog_command, jogging
from dobot_async.arms.mycobot.models import CobotModel
from dobot_async.arms.mycobot.queue import CobotQueue
from dobot_async.arms.mycobot.verbs import SPEED

__all__ = ["Jogging"]


class Jogging:
    """The part of a myCobot that jogs."""

    link: Link[Frame]
    queue: CobotQueue
    _model: CobotModel
    _channel: Channel
    _runner: CobotRunner
    _workspace: Workspace | None

    async def jog(self, direction: str, seconds: float, *, speed: int = SPEED) -> None:
        """Jog for a time, then stop.

        Args:
            direction: j1+ j1- ... for a joint, x+ x- y+ y- z+ z- rx+ rx- ry+ ry- rz+ rz- for the tool, as far as the
                model has them.
            seconds: How long, finite and not negative.
            speed: Percent.

        Raises:
            DobotError: As `jogging`.
        """
        seconds = check_duration(seconds)
        async with self.jogging(direction, speed=speed):
            await anyio.sleep(seconds)

    @asynccontextmanager
    async def jogging(self, direction: str, *, speed: int = SPEED) -> AsyncGenerator[None]:
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
        jog = jog_command(self._model, direction, speed)
        self.link.frame(self._model.row(jog[0]), jog[1])
        async with (
            jogging(self._channel, self._runner, direction, jog, self.queue),
            kept_inside(self._workspace, self._place, self._runner.stop, direction),
        ):
            yield

    async def _place(self) -> tuple[float, ...]:
        """Where the tool is."""
        coords = await self._channel.ask(c.GET_COORDS, None)
        return tuple(coords)[:3]
