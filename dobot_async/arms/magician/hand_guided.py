"""A Magician that an operator moves: jogged, or guided by hand."""

from __future__ import annotations

import math
from collections.abc import AsyncGenerator, AsyncIterator
from contextlib import AbstractAsyncContextManager, asynccontextmanager, nullcontext, suppress

import anyio

from dobot_async._core.link.link import Link
from dobot_async._core.util.arguments import check_duration
from dobot_async._core.util.tasks import run_shielded
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.alarms import Alarm, decode, faults
from dobot_async.arms.magician.frame import Frame
from dobot_async.arms.magician.jogs import Jog, check_limits
from dobot_async.arms.magician.queue import MagicianQueue
from dobot_async.arms.magician.stopping import STILL
from dobot_async.errors import CommandRejected, DobotError

__all__ = ["HandGuided"]

TEACH_INTERVAL = 0.05


class HandGuided:
    """The part of a Magician that jogs, and that is guided by hand."""

    link: Link[Frame]
    queue: MagicianQueue

    def _kept(self, direction: Jog) -> AbstractAsyncContextManager[None]:  # noqa: ARG002 - where it may go anywhere
        """While this is entered, a jog is ended before it leaves the workspace."""
        return nullcontext()

    async def jog(self, direction: Jog | str, seconds: float) -> None:
        """Jog for a time, at the speed of the JOG parameters, then stop. Manual 2.10.4.

        Args:
            direction: Of the tool ("x+", "x-", "y+", ... "r-"), of a joint ("j1+" ... "j4-"), or along the rail ("l+",
                "l-").
            seconds: How long, finite and not negative.

        Raises:
            ValueError: There is no such direction, or the rail was not declared; see `set_rail`.
            ArmAlarm: The jog ended at a limit.
            CommandRejected: The arm executes what is queued.
        """
        direction, seconds = Jog.of(direction), check_duration(seconds)
        async with self.jogging(direction):
            await anyio.sleep(seconds)

    @asynccontextmanager
    async def jogging(self, direction: Jog | str) -> AsyncGenerator[None]:
        """Jog until the block ends, however it ends; the stop is repeated until the arm has heard it. Manual 2.10.4.

        Args:
            direction: As in `jog`.

        Raises:
            ReplyTimeout: The arm does not acknowledge that it is to begin, or that it is to stop.
            ValueError: There is no such direction, or the rail was not declared; see `set_rail`.
            ArmAlarm: The jog has ended at a limit; raised when the block ends.
            CommandRejected: The arm executes what is queued, and would not hear the jog.
            MotionStopped: It was stopped before the tool left the workspace of `connect`; raised when the block ends.
        """
        direction, epoch = Jog.of(direction), self.queue.epoch
        command = c.JOGCmd(*direction.value)
        await self.queue.declared.check([command])
        if self.queue.pending:
            await self.queue.update()
            if self.queue.pending:
                raise CommandRejected(
                    "the arm executes what is queued, and hears no jog meanwhile: await the motions, or stop the arm"
                )

        before = await self._faults()
        async with self.link.cleanup.at_end(self._stop_jog, "the end of the jog"):
            await self.queue.beside(self.link.request(c.SET_JOG_CMD, command), epoch)
            async with self._kept(direction):
                yield

        check_limits(direction, before, await self._faults())

    async def _stop_jog(self) -> None:
        await self.link.request(c.SET_JOG_CMD, STILL, timeout=math.inf, urgent=True)

    async def _faults(self) -> tuple[Alarm, ...]:
        return faults(decode(await self.link.request(c.GET_ALARMS_STATE, None)))

    async def taught_points(
        self, mode: c.HHTTrigMode = c.HHTTrigMode.TRIGGERED_ON_KEY_RELEASED
    ) -> AsyncIterator[c.Pose]:
        """Yields the poses of hand-guided teaching (HHT): the user presses the key on the forearm, and guides the arm.

        Args:
            mode: A pose when the key is released, or at intervals while it is held. Manual 2.7.

        Raises:
            ReplyTimeout: The arm does not answer in time.
            ConnectionLost: The link is gone.
        """
        await self.link.request(c.SET_HHT_TRIG_MODE, mode)
        await self.link.request(c.SET_HHT_TRIG_OUTPUT_ENABLED, value=True)
        try:
            while True:
                if await self.link.request(c.GET_HHT_TRIG_OUTPUT, None):
                    yield await self.link.request(c.GET_POSE, None)

                await anyio.sleep(TEACH_INTERVAL)
        finally:
            with suppress(DobotError):
                await run_shielded(self.link.request(c.SET_HHT_TRIG_OUTPUT_ENABLED, value=False))
