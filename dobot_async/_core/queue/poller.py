"""The poller: one task that asks the arm how far it is, while somebody wants to know.

- While the next motion cannot end yet: for the alarms now and then, and seldom for the index.
- When it may end in a moment: for the index alone, as fast as it is answered. An answer to anything else would come
  between the end and the answer that tells of it.
- Where nothing tells when it ends: for the index, at intervals of 2 % of what the motion has taken so far.
- One question at a time, and where an answer takes long, all of this less often: what is asked for anything but the end
  is a small part of what the link can answer.
"""

from __future__ import annotations

import asyncio
import logging
import math
from collections.abc import Generator
from contextlib import contextmanager, suppress
from typing import Protocol

from dobot_async._core.queue.executor import unseen
from dobot_async._core.util.tasks import cancel_and_join
from dobot_async.errors import DobotError, MotionUnknown

__all__ = ["StatusPoller"]

logger = logging.getLogger("dobot_async.queue")
POLL = 0.003  # seconds between two looks, at the least, at an arm of which nothing tells how long it still needs
SHARE, WIDEST = 0.02, 0.025  # of what its motion has taken so far, and seconds: the most
LEAD = 0.002  # seconds before the earliest end, from when on the arm is asked as fast as it answers
DENSE, SELDOM = 0.001, 0.6  # seconds from one question for the index to the next, at the least and at the most
ALARMS = 0.25  # seconds after which the alarms are read as well, for a motion that an alarm keeps from ending
ROUND_TRIPS = 5  # that such an interval has at least
UNWATCHED = 100  # Motions that may be pending although nobody awaits one; beyond, the arm is asked all the same


class WatchedMotion(Protocol):
    """The queue, as far as the poller is concerned."""

    @property
    def pending(self) -> int:
        """How many accepted commands are not known to have ended."""
        ...

    @property
    def next(self) -> object:
        """The Motion that ends next, None if there is none."""
        ...

    async def look(self, *, alarms: bool, index: bool = True) -> None:
        """Ask the arm how far it is, and end the Motions that this decides."""

    async def rest(self) -> float | None:
        """Return seconds within which no Motion can end; None where nothing tells."""
        ...

    def give_up(self, error: DobotError) -> None:
        """End everything because of an error that nobody can mend."""


class StatusPoller:
    """Lives while somebody waits, or has just looked, or so much is pending that it would fill the memory."""

    def __init__(self, queue: WatchedMotion) -> None:
        self._queue = queue
        self._watchers = 0
        self._until = -math.inf
        self._stirred = asyncio.Event()
        self._task: asyncio.Task[None] | None = None
        self._clock = asyncio.get_running_loop().time

    def watch(self, seconds: float = 0.0) -> None:
        """Ask for so many seconds at least, or while there is another reason."""
        self._until = max(self._until, self._clock() + seconds)
        if self._wanted and (self._task is None or self._task.done()):
            self._task = asyncio.create_task(self._poll(), name="dobot_async poller")

    @contextmanager
    def watching(self, after: float = 0.0) -> Generator[None]:
        """Ask while this is entered, once so many seconds have passed."""
        self._watchers += 1
        timer = asyncio.get_running_loop().call_later(after, self.watch)
        if not after:
            self.watch()

        try:
            yield
        finally:
            self._watchers -= 1
            timer.cancel()

    def stir(self) -> None:
        """What the arm was to do is thrown away: it may have something shorter to do than was thought."""
        self._stirred.set()

    async def aclose(self) -> None:
        """End it."""
        if self._task:
            await cancel_and_join(self._task)

    @property
    def _wanted(self) -> bool:
        pending = self._queue.pending
        return self._watchers > 0 or pending > UNWATCHED or (pending > 0 and self._clock() < self._until)

    async def _poll(self) -> None:
        asked_at = alarms_at = near_since = -math.inf
        took = 0.0
        head, since = None, self._clock()
        try:
            while self._wanted:
                self._stirred.clear()
                now = self._clock()
                if head is not self._queue.next:
                    head, since = self._queue.next, now

                pause = max(POLL, min(SHARE * (now - since), WIDEST))
                try:
                    least = await self._queue.rest()
                    now, lead = self._clock(), max(LEAD, took / 2)
                    every = max(ALARMS, ROUND_TRIPS * took)
                    near = least is not None and least <= lead
                    near_since = near_since if near else now
                    alarms = now >= alarms_at + every and not (near and now < near_since + every)
                    seldom = min(max(POLL, now - since), max(SELDOM, ROUND_TRIPS * took))
                    index = least is None or near or now >= asked_at + seldom
                    alarms_at, asked_at = now if alarms else alarms_at, now if index else asked_at
                    if index or alarms:
                        await self._queue.look(alarms=alarms, index=index)
                        took = (self._clock() - now) / (alarms + index)

                    if least is not None:
                        pause = min(now + least - lead, alarms_at + every) - self._clock()
                except DobotError as error:
                    self._queue.give_up(unseen(error))

                await self._rest(max(pause, now + DENSE - self._clock()))
        except Exception as error:
            logger.exception("the poller failed")
            self._queue.give_up(MotionUnknown(f"the driver failed while it watched the arm: {error!r}"))

    async def _rest(self, seconds: float) -> None:
        """Leave the arm alone, until it is stirred."""
        await asyncio.sleep(min(seconds, POLL))
        if seconds > POLL:
            with suppress(TimeoutError):
                async with asyncio.timeout(seconds - POLL):
                    await self._stirred.wait()
