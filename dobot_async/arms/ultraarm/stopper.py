r"""How an ultraArm is stopped. Its protocol has no command that ends a queued motion.

    M9 \r M15 \r M120 ...    says it, and asks whether the arm stands, in one write: repeated until it is seen to stand
    M9 \r M17 \r M120 ...    takes the power off the motors, where M15 does not end it within a moment

M15 ends a jog, and with some firmware perhaps more. Nothing here gives up on a silent line: each copy of the question
says the stop again.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from dataclasses import replace
from typing import Literal

from dobot_async.arms.ultraarm import commands as c
from dobot_async.arms.ultraarm.answers import Status
from dobot_async.arms.ultraarm.layouts import Also
from dobot_async.arms.ultraarm.state import ArmState
from dobot_async.arms.ultraarm.status import PACE, RESTS, UltraArmPoller
from dobot_async.errors import CommandRejected

__all__ = ["UltraArmStopper"]

BRAKING = 5  # polls of an arm that was told to stop
GIVING_UP = 50  # polls of an arm without power, after which it counts as one that cannot be stopped
AGAIN = 10  # polls after which the power is taken off again: some firmware queues that
STOP_AND_STATUS = replace(c.GET_STATUS, request=Also("M15"), write=True)
RELEASE_AND_STATUS = replace(c.GET_STATUS, request=Also("M17"), write=True)


class UltraArmStopper:
    """Stops the arm until it is seen to stand.

    Args:
        status: Polls the arm.
        state: What is noted of its power.
        on_stop: What to do where M15 does not end a motion.
    """

    def __init__(self, status: UltraArmPoller, state: ArmState, on_stop: Literal["release", "finish"]) -> None:
        self._status = status
        self._state = state
        self._on_stop = on_stop

    async def stop(self) -> None:
        """Return when the arm is seen to stand, with nothing in its queue.

        Raises:
            CommandRejected: It goes on, although its motors were told to let go.
            ConnectionLost: The link is gone.
        """
        if await self._comes_to_rest(BRAKING):
            return

        if self._on_stop == "finish":
            while not await self._comes_to_rest(GIVING_UP):
                pass
        else:
            self._state.note(c.RELEASE, None)
            if not await self._comes_to_rest(GIVING_UP, release=True):
                raise CommandRejected(
                    f"the arm goes on, with {self._status.size} more commands in its queue: its protocol has nothing "
                    "that ends them; switch it off"
                )

    async def end_jog(self, queued: Callable[[], bool]) -> None:
        """Return when a jog has ended; stop the arm as `stop` does if M15 does not end it.

        Args:
            queued: Returns whether there is something in the arm's queue that goes on, so that standing tells nothing.
        """
        self._status.begin()
        for _ in range(GIVING_UP):
            status = await self._poll(release=False)
            if self._status.rests >= RESTS or status.queue_size or queued():
                return

            await asyncio.sleep(PACE)

        await self.stop()

    async def _comes_to_rest(self, polls: int, *, release: bool = False) -> bool:
        """Return whether the arm rests and has nothing more to do, within so many polls."""
        self._status.begin()
        for poll in range(polls):
            status = await self._poll(release=release and poll % AGAIN == 0)
            if self._status.rests >= RESTS:
                return True

            if poll and status.queue_size and polls == BRAKING:
                return False  # what has been said twice does not empty the queue

            await asyncio.sleep(PACE)

        return False

    async def _poll(self, *, release: bool) -> Status:
        """Say that the arm is to stop until it says how far it is."""
        row = RELEASE_AND_STATUS if release else STOP_AND_STATUS
        return await self._status.poll(row, timeout=math.inf, urgent=True)
