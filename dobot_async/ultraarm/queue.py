"""The ultraArm's queue with the verbs on it, and its batches."""

from __future__ import annotations

from collections.abc import Coroutine
from contextlib import AbstractAsyncContextManager
from typing import Any, TypeVar

from dobot_async._core.queue.batch import BatchBuilder, batch
from dobot_async._core.queue.executor import Executor
from dobot_async._core.queue.motion import Motion
from dobot_async._core.queue.queue import MotionQueue
from dobot_async.ultraarm.verbs import Pump, Verbs
from dobot_async.wire import Command

__all__ = ["UltraArmBatch", "UltraArmQueue"]

Q = TypeVar("Q")


class UltraArmQueue(MotionQueue, Verbs[Coroutine[Any, Any, Motion]]):
    """The arm's queue: each verb returns a Motion once the arm has accepted it, and waits while the queue is full."""

    def __init__(self, executor: Executor, pump: Pump) -> None:
        super().__init__(executor)
        self.pump = pump

    def perform(self, command: Command[Q, Any], value: Q, timeout: float | None) -> Coroutine[Any, Any, Motion]:
        """Queue a command; see `put`."""
        return self.put(command, value, timeout=timeout)

    def batch(self, *, timeout: float | None = None) -> AbstractAsyncContextManager[UltraArmBatch]:
        """Collect commands, and queue them with nothing between them when the block ends; an error sends none.

        Args:
            timeout: Seconds to wait for room in the arm's queue.

        Raises:
            DobotError: As `put`; what was accepted before that is pending.
        """
        return batch(self, UltraArmBatch(self, self.pump), timeout)


class UltraArmBatch(BatchBuilder, Verbs[Motion]):
    """Commands that are sent together; each verb returns its Motion, which may be awaited after the batch's block."""

    def __init__(self, queue: MotionQueue, pump: Pump) -> None:
        super().__init__(queue)
        self.pump = pump
