"""Jogs of an ultraArm: their directions, and how one is begun, watched and ended.

M9 --> at rest? --> M13/M14 --> does it set out? --> (the block, M9, M9, ...) --> M15, until it stands
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager, suppress
from enum import Enum

from dobot_async._core.protocol.wire import Command
from dobot_async._core.queue.executor import alarmed
from dobot_async._core.queue.queue import MotionQueue
from dobot_async._core.util.tasks import Cleanup, cancel_and_join
from dobot_async.arms.ultraarm import commands as c
from dobot_async.arms.ultraarm.answers import Receipt
from dobot_async.arms.ultraarm.goals import MotionFault
from dobot_async.arms.ultraarm.runner import UltraArmRunner
from dobot_async.arms.ultraarm.status import PACE, RESTS, STATUS_AND_ANGLES
from dobot_async.errors import CommandRejected, DobotError

__all__ = ["Jogger", "UltraArmJog", "direction_of"]

SETS_OUT = 0.5  # seconds within which an arm sets out
SELDOM = 0.05  # seconds between two looks at a jog
BLOCKED = MotionFault("the jog did not set out: at the end of its way, not homed, or without power")
RAN_OUT = MotionFault("the jog came to the end of its way before it was to end")


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

    @property
    def word(self) -> str:
        """The word for it: "x+", "j2-"."""
        return self.name.lower().replace("_plus", "+").replace("_minus", "-")


WORDS = {each.word: each for each in UltraArmJog}


def direction_of(direction: UltraArmJog | str) -> UltraArmJog:
    """Return a direction, given as itself or by its word, "x+" or "j1-"; raise ValueError for another word."""
    if isinstance(direction, UltraArmJog):
        return direction

    if direction not in WORDS:
        raise ValueError(f"direction must be one of {' '.join(WORDS)}, not {direction!r}")

    return WORDS[direction]


class Jogger:
    """Jogs the arm.

    Args:
        runner: What is known of the arm, and what asks it.
        cleanup: What has to be done to it whatever becomes of who asked.
    """

    def __init__(self, runner: UltraArmRunner, cleanup: Cleanup) -> None:
        self._runner = runner
        self._cleanup = cleanup
        self._watch: asyncio.Task[None] | None = None
        self._ran_out = False

    @asynccontextmanager
    async def jogging(
        self, command: Command[c.JogMove, Receipt], value: c.JogMove, queue: MotionQueue
    ) -> AsyncGenerator[None]:
        """Jog until the block ends, or a stop of the queue comes; see `UltraArm.jogging`."""
        runner, epoch = self._runner, queue.epoch
        runner.state.check(command)
        if runner.jogging:
            raise CommandRejected("another jog goes on: end it first")

        runner.jogging, self._ran_out = True, False
        try:
            status = await runner.status.poll(STATUS_AND_ANGLES)
            if status.queue_size or not status.at_rest:
                raise CommandRejected("the arm moves: a jog can begin when it stands")

            async with self._cleanup.at_end(self._end, "the end of the jog"):
                runner.status.begin()
                await queue.beside(runner.ask(command, value), epoch)
                await self._sets_out()
                self._watch = asyncio.create_task(self._look_on(), name="dobot_async jog")
                yield
        finally:
            runner.jogging = False
            runner.disturbed()
            if self._watch:
                await cancel_and_join(self._watch)

        if self._ran_out:
            raise alarmed([RAN_OUT])

    async def end(self) -> None:
        """End a jog, until that is seen; what is in the arm's queue goes on."""
        await self._runner.stopper.end_jog(lambda: self._runner.busy)

    async def _end(self) -> None:
        """End the jog of a block."""
        if self._watch:
            self._watch.cancel()

        await self._runner.stopper.end_jog(lambda: False)

    async def _look_on(self) -> None:
        """Note if the arm comes to rest before it is told to; of a silent line the end of the jog tells."""
        status = self._runner.status
        status.begin()
        with suppress(DobotError):
            while not self._ran_out:
                await asyncio.sleep(SELDOM)
                await status.poll(c.GET_STATUS)
                self._ran_out = status.rests >= RESTS

    async def _sets_out(self) -> None:
        """Return when the arm is seen to move; raise ArmAlarm if it does not."""
        status = self._runner.status
        until = status.now() + SETS_OUT
        while not status.set_out:
            if status.now() >= until:
                raise alarmed([BLOCKED])

            await status.poll(STATUS_AND_ANGLES)
            if not status.set_out:
                await asyncio.sleep(PACE)
