"""Commands that are collected in a block, and queued together when it ends."""

from __future__ import annotations

from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from typing import Any, TypeVar

from dobot_async._core.protocol.wire import Command
from dobot_async._core.queue.motion import Motion
from dobot_async._core.queue.queue import MotionQueue
from dobot_async._core.util.arguments import check_timeout
from dobot_async.errors import MotionStopped

__all__ = ["BatchBuilder", "batch"]

Q = TypeVar("Q")
B = TypeVar("B", bound="BatchBuilder")


class BatchBuilder:
    """Commands that are to be queued together; each one's Motion may be awaited after the batch's block."""

    def __init__(self, queue: MotionQueue) -> None:
        self.motions: list[Motion] = []
        self._queue = queue

    def put(self, command: Command[Q, Any], value: Q) -> Motion:
        """Add any row of the table that may be queued.

        Args:
            command: A row of the table that may be queued.
            value: Its parameters.

        Raises:
            ValueError: The parameters do not fit, or the command cannot be queued.
            TypeError: They are of the wrong type.
        """
        motion = Motion(self._queue, self._queue.prepare(command, value))
        self.motions.append(motion)
        return motion

    def perform(self, command: Command[Q, Any], value: Q, timeout: float | None) -> Motion:
        """Add a command."""
        if timeout is not None:
            raise ValueError("the commands of a batch have no timeout of their own; give it to batch()")

        return self.put(command, value)


@asynccontextmanager
async def batch(queue: MotionQueue, builder: B, timeout: float | None) -> AsyncGenerator[B]:
    """Queue what the block collects, with nothing between it, when the block ends; an error or a stop sends none."""
    timeout, epoch = check_timeout(timeout), queue.epoch
    try:
        yield builder
    except BaseException:
        for motion in builder.motions:
            motion.end(MotionStopped("it was not sent: its batch was left by an error"))

        raise

    await queue.put_all(builder.motions, timeout=timeout, epoch=epoch)
