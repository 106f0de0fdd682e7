"""An ultraArm that is jogged: the verbs; `jog` has how a jog is begun, watched and ended."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager

import anyio

from dobot_async._core.link.link import Link
from dobot_async._core.util.arguments import check_duration, check_timeout
from dobot_async._core.util.tasks import STAYING
from dobot_async._core.util.workspace import Workspace
from dobot_async.arms.keeping import kept_inside
from dobot_async.arms.ultraarm import commands as c
from dobot_async.arms.ultraarm.frame import Frame
from dobot_async.arms.ultraarm.jog import Jogger, UltraArmJog, direction_of
from dobot_async.arms.ultraarm.queue import UltraArmQueue
from dobot_async.arms.ultraarm.runner import UltraArmRunner
from dobot_async.arms.ultraarm.verbs import SPEED, check_speed
from dobot_async.errors import CommandRejected, ReplyTimeout

__all__ = ["Jogging"]


class Jogging:
    """The part of an ultraArm that jogs."""

    link: Link[Frame]
    queue: UltraArmQueue
    _jogger: Jogger
    _runner: UltraArmRunner
    _workspace: Workspace | None

    async def jog(self, direction: UltraArmJog | str, seconds: float, *, speed: float = SPEED) -> None:
        """Jog for a time, then stop. Manual 5, M13 to M15.

        Args:
            direction: Of the tool or of a joint, such as UltraArmJog.X_PLUS or "x+", "j2-".
            seconds: How long, finite and not negative.
            speed: 1 to 200.

        Raises:
            ValueError: There is no such direction; the message has all of them.
            DobotError: As `jogging`.
        """
        seconds = check_duration(seconds)
        async with self.jogging(direction, speed=speed):
            await anyio.sleep(seconds)

    @asynccontextmanager
    async def jogging(self, direction: UltraArmJog | str, *, speed: float = SPEED) -> AsyncGenerator[None]:
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
        is_joint, axis, way = direction_of(direction).value
        command, value = c.JOG_JOINT if is_joint else c.JOG_COORD, c.JogMove(axis, way, check_speed(speed))
        self.link.frame(command, value)  # what is wrong is said before anything is sent, a stop included
        if self.queue.pending:
            raise CommandRejected("motions are pending: a jog can begin when they are done, or stopped")

        async with (
            self._jogger.jogging(command, value, self.queue),
            kept_inside(self._workspace, self._place, self._jogger.end, direction_of(direction).word),
        ):
            yield

    async def jog_stop(self, *, timeout: float = STAYING) -> None:
        """End a jog; what is in the arm's queue goes on. Manual 5, M15.

        Args:
            timeout: Seconds to wait until the arm is seen to stand; it is told again after that, too, until it does.

        Raises:
            ReplyTimeout: The arm is not seen to stand yet.
            ConnectionLost: The link is gone.
        """
        self.link.frame(c.JOG_STOP, None)
        limit = check_timeout(timeout)
        ending = self.link.cleanup.start(self._jogger.end(), "the end of the jog")
        done, _ = await asyncio.wait([ending], timeout=limit)
        if not done:
            raise ReplyTimeout(f"the jog has not ended within {timeout:.3g} s; the arm is told again until it does")

        ending.result()

    async def _place(self) -> tuple[float, float, float]:
        """Where the tool is."""
        coords = await self._runner.ask(c.GET_COORDS, None)
        return coords.x, coords.y, coords.z
