"""Watches the motions of an arm to their end, also those that no program awaits."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable, Coroutine
from contextlib import suppress
from typing import Any

from dobot_async.errors import DobotError
from dobot_async.fleet.guard import Guard
from dobot_async.fleet.planned_steps import PlannedStep

__all__ = ["Follower"]

BETWEEN_LOOKS = 1.0  # seconds until an arm that did not tell where it stands is asked again
Spawn = Callable[[Coroutine[Any, Any, None], str], asyncio.Task[None]]


class Follower:
    """What follows one arm.

    Args:
        steps: What the arm has to do; they are taken as their motions end.
        spawn: Starts a task that ends with the arm's place in its fleet, for something.

    Attributes:
        guard: The arm's, if it has one.
        quiet: Whether motions are not to be watched for now: those that were not sent yet cannot be.
    """

    def __init__(self, steps: deque[PlannedStep], spawn: Spawn) -> None:
        self.guard: Guard[Any] | None = None
        self.quiet = False
        self._steps = steps
        self._spawn = spawn
        self._follower: asyncio.Task[None] | None = None
        self._seeker: asyncio.Task[None] | None = None

    def follow(self) -> None:
        """Watches motions to their end, though nobody may await them: an arm that fails is to stop the others."""
        if self._steps and not self.quiet and (self._follower is None or self._follower.done()):
            self._follower = self._spawn(self._follow(), "follower")

        if self.guard and self.guard.is_sought and (self._seeker is None or self._seeker.done()):
            self._seeker = self._spawn(self._seek(self.guard), "seeker")

    def leave(self, guard: Guard[Any], leftovers: Callable[[], Awaitable[None]]) -> None:
        """Waits for the end of what an earlier program has left in the arm's queue, and then for what is queued."""

        async def left() -> None:
            await guard.until(leftovers)
            self.follow()

        self._spawn(left(), "leftovers")

    async def _follow(self) -> None:
        """Takes the steps as their motions end."""
        while self._steps and not self.quiet:
            step = self._steps[0]
            with suppress(DobotError):
                await step.motion

            if self.guard:
                await self.guard.catch_up()
            elif step in self._steps:
                self._steps.remove(step)

        self.follow()

    async def _seek(self, guard: Guard[Any]) -> None:
        """Asks where the arm stands until it tells: what it holds until then, others may wait for."""
        while guard.is_sought:
            await guard.catch_up()
            await asyncio.sleep(BETWEEN_LOOKS)
