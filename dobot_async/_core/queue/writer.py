"""The writer: the one task of a queue that sends, while there is something to send."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Coroutine
from typing import Any, Protocol

from dobot_async._core.queue.epoch import Epoch
from dobot_async._core.queue.executor import Executor
from dobot_async._core.queue.motion import MotionOutbox
from dobot_async._core.queue.poller import StatusPoller
from dobot_async._core.util.tasks import cancel_and_join
from dobot_async.errors import (
    ArmAlarm,
    CommandRejected,
    ConnectionLost,
    DobotError,
    MotionStopped,
    MotionUnknown,
)

__all__ = ["Writer"]

logger = logging.getLogger("dobot_async.queue")
LONG = 0.05  # seconds of sending after which the arm is asked how far it is: it may have failed, and make no room


class Written(Protocol):
    """The queue, as far as the writer is concerned."""

    async def no_more_room(self, error: ArmAlarm) -> None:
        """The arm has no room, and makes none, because of alarms."""

    def write_on(self) -> None:
        """Send what waits, if nothing stands in its way."""

    def give_up(self, error: DobotError) -> None:
        """End everything because of an error that nobody can mend."""


class Writer:
    """Gives what is in the outbox to the executor."""

    def __init__(self, executor: Executor, outbox: MotionOutbox, poller: StatusPoller, queue: Written) -> None:
        self._executor = executor
        self._outbox = outbox
        self._poller = poller
        self._queue = queue
        self._task: asyncio.Task[None] | None = None

    def wake(self) -> None:
        """Send what is in the outbox."""
        if self._outbox and (self._task is None or self._task.done()):
            self._task = asyncio.create_task(self._write(), name="dobot_async writer")

    def cancel(self) -> None:
        """End what is being sent."""
        if self._task:
            self._task.cancel()

    async def ended(self) -> None:
        """Return when nothing is being sent any more."""
        if self._task:
            await cancel_and_join(self._task)

    async def exclusively(self, work: Coroutine[Any, Any, None], what: str, epoch: Epoch) -> None:
        """Run work in place of the writer: nothing is sent meanwhile, and a stop ends it.

        Raises:
            MotionStopped: The queue was stopped.
        """
        try:
            while self._task and not self._task.done():
                await asyncio.wait([self._task])

            epoch.check()
        except BaseException:
            work.close()
            raise

        self._task = task = asyncio.create_task(work, name=f"dobot_async {what}")
        try:
            await asyncio.wait([task])
        finally:
            await cancel_and_join(task)

        if task.cancelled():
            raise MotionStopped(f"{what} was stopped")

        task.result()
        self._queue.write_on()

    async def _write(self) -> None:
        try:
            with self._poller.watching(after=LONG):
                while self._outbox:
                    try:
                        await self._executor.submit(self._outbox)
                    except CommandRejected as error:
                        self._outbox.refuse(error)
        except ArmAlarm as error:
            await self._queue.no_more_room(error)
        except (MotionUnknown, ConnectionLost) as error:
            self._queue.give_up(error)
        except DobotError as error:
            self._outbox.drop(error)
        except Exception as error:
            logger.exception("the writer failed")
            self._queue.give_up(MotionUnknown(f"the driver failed while it sent a command: {error!r}"))
