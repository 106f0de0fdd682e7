"""The Magician's queue with the verbs on it, its batches, and programs stored in the arm."""

from __future__ import annotations

from collections.abc import AsyncIterator, Coroutine
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from typing import Any, TypeVar

from dobot_async._core.queue.batch import BatchBuilder, batch
from dobot_async._core.queue.motion import Motion, Outbox
from dobot_async._core.queue.queue import MotionQueue
from dobot_async.magician.executor import MagicianExecutor
from dobot_async.magician.verbs import Verbs
from dobot_async.wire import Command

__all__ = ["Batch", "MagicianQueue", "Program"]

Q = TypeVar("Q")


class MagicianQueue(MotionQueue, Verbs[Coroutine[Any, Any, Motion]]):
    """The arm's queue: each verb returns a Motion once the arm has accepted it, and waits while the queue is full."""

    def __init__(self, executor: MagicianExecutor) -> None:
        super().__init__(executor)
        self._arm = executor

    def perform(self, command: Command[Q, Any], value: Q, timeout: float | None) -> Coroutine[Any, Any, Motion]:
        """Queue a command; see `put`."""
        return self.put(command, value, timeout=timeout)

    def batch(self, *, timeout: float | None = None) -> AbstractAsyncContextManager[Batch]:
        """Collect commands, and queue them with nothing between them when the block ends; an error sends none.

        Args:
            timeout: Seconds to wait for room in the arm's queue.

        Raises:
            DobotError: As `put`; what was accepted before that is pending.
        """
        return batch(self, Batch(self), timeout)

    @asynccontextmanager
    async def download(self, *, loops: int = 1) -> AsyncIterator[Program]:
        """Store the commands of the block in the arm, which runs them when its key is pressed. Manual 2.19.4.

        A cancellation or a stop ends it, and the arm executes again what it is told.

        Args:
            loops: How often the arm is to run them.

        Raises:
            MotionStopped: The arm was stopped meanwhile; a part of the program may be stored.
        """
        program, epoch = Program(self), self.epoch
        yield program
        outbox = Outbox(lambda _: None)
        outbox.add(program.motions)
        async with self._arm.cleanup.at_end(self._arm.end_download, "the end of the download"):
            await self.exclusively(self._arm.download(outbox, loops), "the download", epoch)


class Batch(BatchBuilder, Verbs[Motion]):
    """Commands that are sent together; each verb returns its Motion, which may be awaited after the batch's block."""


class Program(BatchBuilder, Verbs[Motion]):
    """Commands to be stored in the arm; nobody awaits their Motions."""
