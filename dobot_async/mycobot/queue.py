"""The queue of a myCobot with the verbs on it, and its batches. It is on this side: see `hosted`."""

from __future__ import annotations

from collections.abc import Awaitable
from contextlib import AbstractAsyncContextManager
from typing import Any, TypeVar

from dobot_async.family import Collector, collected
from dobot_async.hosted import HostedExecutor
from dobot_async.motion import Motion, MotionQueue
from dobot_async.mycobot.models import CobotModel
from dobot_async.mycobot.verbs import Verbs
from dobot_async.wire import Command

__all__ = ["CobotBatch", "CobotQueue"]

Q = TypeVar("Q")


class CobotQueue(MotionQueue, Verbs[Awaitable[Motion]]):
    """What is put here the arm is given one after the other; each verb returns a Motion."""

    def __init__(self, executor: HostedExecutor, model: CobotModel) -> None:
        super().__init__(executor)
        self._model = model

    @property
    def model(self) -> CobotModel:
        """What the arm is."""
        return self._model

    def perform(self, command: Command[Q, Any], value: Q, timeout: float | None) -> Awaitable[Motion]:
        """Queues a command; see `put`."""
        return self.put(command, value, timeout=timeout)

    def batch(self, *, timeout: float | None = None) -> AbstractAsyncContextManager[CobotBatch]:
        """Collects commands, and queues them with nothing between them when the block ends; an error sends none."""
        return collected(self, CobotBatch(self, self._model), timeout)


class CobotBatch(Collector, Verbs[Motion]):
    """Commands that are queued together; each verb returns its Motion, to be awaited after the batch's block."""

    def __init__(self, queue: MotionQueue, model: CobotModel) -> None:
        super().__init__(queue)
        self._model = model

    @property
    def model(self) -> CobotModel:
        """What the arm is."""
        return self._model
