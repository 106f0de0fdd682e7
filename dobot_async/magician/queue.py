"""The Magician's queue with the verbs on it, its batches, and programs stored in the arm."""

from __future__ import annotations

from collections.abc import AsyncIterator, Awaitable
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from typing import Any, TypeVar

from dobot_async.executor import Entry
from dobot_async.family import Collector, collected
from dobot_async.magician.executor import MagicianExecutor
from dobot_async.magician.verbs import Verbs
from dobot_async.motion import Motion, MotionQueue
from dobot_async.wire import Command

__all__ = ["Batch", "MagicianQueue", "Program"]

Q = TypeVar("Q")


class MagicianQueue(MotionQueue, Verbs[Awaitable[Motion]]):
    """The arm's queue: each verb returns a Motion once the arm has accepted it, and waits while the queue is full."""

    def __init__(self, executor: MagicianExecutor) -> None:
        super().__init__(executor)
        self._arm = executor

    def perform(self, command: Command[Q, Any], value: Q, timeout: float | None) -> Awaitable[Motion]:
        """Queues a command; see `put`."""
        return self.put(command, value, timeout=timeout)

    def batch(self, *, timeout: float | None = None) -> AbstractAsyncContextManager[Batch]:
        """Collects commands, and queues them with nothing between them when the block ends; an error sends none.

        Args:
            timeout: Seconds to wait for room in the arm's queue.

        Raises:
            DobotError: As `put`; what was accepted before that is pending.
        """
        return collected(self, Batch(self), timeout)

    @asynccontextmanager
    async def download(self, *, loops: int = 1) -> AsyncIterator[Program]:
        """Stores the commands of the block in the arm, which runs them when its key is pressed. Manual 2.19.4.

        Args:
            loops: How often the arm is to run them.
        """
        program = Program(self)
        yield program
        async with self.exclusively():
            await self._arm.download(program.entries, loops)


class Batch(Collector, Verbs[Motion]):
    """Commands that are sent together; each verb returns its Motion, which may be awaited after the batch's block."""


class Program(Verbs[None]):
    """Commands to be stored in the arm."""

    def __init__(self, queue: MotionQueue) -> None:
        self.entries: list[Entry] = []
        self._queue = queue

    def put(self, command: Command[Q, Any], value: Q) -> None:
        """Adds any row of the table that may be queued."""
        self.entries.append(self._queue.prepare(command, value))

    def perform(self, command: Command[Q, Any], value: Q, timeout: float | None) -> None:
        """Adds a command."""
        if timeout is not None:
            raise ValueError("the commands of a program have no timeout")

        self.put(command, value)
