"""The stops of a queue: begun at once, and repeated until the arm has heard them, by tasks that outlive who asked."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine, Generator, Sequence
from contextlib import contextmanager
from typing import Any, Protocol, TypeVar

from dobot_async._core.queue.epoch import Epoch
from dobot_async._core.queue.executor import Executor
from dobot_async._core.queue.motion import Motion
from dobot_async._core.util.arguments import check_timeout
from dobot_async._core.util.tasks import STAYING, cancel_and_join
from dobot_async.errors import ConnectionLost, DobotError, MotionStopped, ReplyTimeout

__all__ = ["Stopper"]

T = TypeVar("T")


class Stopped(Protocol):
    """The queue, as far as its stops are concerned."""

    def fail(self, error: DobotError, *, spare: Sequence[Motion] = ()) -> None:
        """End all Motions, and the puts that wait, with an error; but for some."""

    def cancel_writer(self) -> None:
        """End what is being sent."""

    async def writer_ended(self) -> None:
        """Return when nothing is being sent any more."""

    def write_on(self) -> None:
        """Send what waits, if nothing stands in its way."""


class Stopper:
    """See the module.

    Attributes:
        count: How many stops there were so far: what was read before one says nothing after it.
    """

    def __init__(self, executor: Executor, queue: Stopped) -> None:
        self.count = 0
        self._executor = executor
        self._queue = queue
        self._tasks: set[asyncio.Task[None]] = set()
        self._beside: set[asyncio.Task[Any]] = set()
        self._under_way = 0

    @property
    def under_way(self) -> bool:
        """Whether a stop goes on: nothing may be sent, and nothing that the arm ticks off counts as done."""
        return self._under_way > 0

    @contextmanager
    def holding(self) -> Generator[None]:
        """While this is entered it is as if a stop went on."""
        self.count += 1
        self._under_way += 1
        try:
            yield
        finally:
            self._under_way -= 1
            self._queue.write_on()

    def begin(self, error: DobotError, *, halt: bool, doubtful: Sequence[Motion]) -> asyncio.Task[None]:
        """End all Motions, and begin to stop the arm; see `MotionQueue.begin_stop`."""
        self.count += 1
        self._under_way += 1
        self._queue.cancel_writer()
        self._queue.fail(error, spare=doubtful)
        what = "the arm's stop" if halt else "the emptying of the arm's queue"
        task = self._executor.cleanup.start(self._stop(error, halt=halt, doubtful=doubtful), what)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task

    async def wait(self, stop: asyncio.Task[None], timeout: float) -> None:
        """Wait for a stop; it goes on if this is cancelled, or if it takes too long."""
        done, _ = await asyncio.wait([stop], timeout=check_timeout(timeout))
        if not done:
            raise ReplyTimeout(
                f"the arm has not acknowledged its stop within {timeout:.3g} s; it is repeated until then"
            )

        if stop.cancelled():
            raise ConnectionLost("the connection ended before the arm had acknowledged that it is to stop")

        stop.result()

    async def beside(self, work: Coroutine[Any, Any, T], epoch: Epoch) -> T:
        """Run work that sets the arm in motion beside the queue; see `MotionQueue.beside`."""
        try:
            await self.over()
            epoch.check()
        except BaseException:
            work.close()
            raise

        task = asyncio.create_task(work, name="dobot_async beside the queue")
        self._beside.add(task)
        task.add_done_callback(self._beside.discard)
        try:
            await asyncio.wait([task])
        finally:
            if not task.done():
                await cancel_and_join(task)

        if task.cancelled():
            epoch.check()
            raise MotionStopped("the arm was stopped")

        return task.result()

    async def over(self) -> None:
        """Return when no stop goes on; raise ReplyTimeout if the arm does not hear it."""
        while self._tasks:
            _, unheard = await asyncio.wait(self._tasks, timeout=STAYING)
            if unheard:
                raise ReplyTimeout("the arm has not acknowledged yet that it is to stop; nothing was sent")

    async def _stop(self, error: DobotError, *, halt: bool, doubtful: Sequence[Motion]) -> None:
        """Stop the arm, and empty its queue behind the writer."""
        try:
            if doubtful:  # their fate is not awaited for longer than an arm may be silent
                asyncio.get_running_loop().call_later(STAYING, end_all, doubtful, error)

            for task in list(self._beside):  # nothing of it is sent behind the stop
                await cancel_and_join(task)

            if halt:
                await self._executor.stop()

            for motion in doubtful:
                if await self._executor.is_at_target(motion.entry):
                    motion.end()

            end_all(doubtful, error)
            await self._queue.writer_ended()
            await self._executor.clear()
        finally:
            end_all(doubtful, error)
            self._under_way -= 1
            self._queue.write_on()


def end_all(motions: Sequence[Motion], error: DobotError) -> None:
    """End those that have not ended."""
    for motion in motions:
        motion.end(error)
