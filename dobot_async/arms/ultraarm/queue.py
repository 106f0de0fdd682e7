"""The ultraArm's queue with the verbs on it, and its batches. It is on this side: see `_core.queue.host`."""

from __future__ import annotations

from collections.abc import Coroutine
from contextlib import AbstractAsyncContextManager
from typing import Any, TypeVar

from dobot_async._core.protocol.wire import Command
from dobot_async._core.queue.batch import BatchBuilder, batch
from dobot_async._core.queue.host import HostExecutor, HostQueue
from dobot_async._core.queue.motion import Motion
from dobot_async._core.queue.queue import MotionQueue
from dobot_async.arms.ultraarm.verbs import Pump, Verbs

__all__ = ["UltraArmBatch", "UltraArmQueue"]

Q = TypeVar("Q")


class UltraArmQueue(HostQueue, Verbs[Coroutine[Any, Any, Motion]]):
    """What is put here the arm is given in order, each once the one before it was seen to be done."""

    def __init__(self, executor: HostExecutor, pump: Pump) -> None:
        super().__init__(executor)
        self.pump: Pump = pump

    def perform(self, command: Command[Q, Any], value: Q, timeout: float | None) -> Coroutine[Any, Any, Motion]:
        """Queue a command; see `put`."""
        return self.put(command, value, timeout=timeout)

    def batch(self, *, timeout: float | None = None) -> AbstractAsyncContextManager[UltraArmBatch]:
        """Collect commands, and queue them with nothing between them when the block ends; an error sends none.

        Args:
            timeout: Seconds to wait for room in the queue.

        Raises:
            DobotError: As `put`; what was accepted before that is pending.
        """
        return batch(self, UltraArmBatch(self, self.pump), timeout)


class UltraArmBatch(BatchBuilder, Verbs[Motion]):
    """Commands that are queued together; each verb returns its Motion, to be awaited after the batch's block."""

    def __init__(self, queue: MotionQueue, pump: Pump) -> None:
        super().__init__(queue)
        self.pump: Pump = pump
