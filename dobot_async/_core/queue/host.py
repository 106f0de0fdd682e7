"""A queue on this side, for arms that have none of their own: they are given one motion at a time.

    put --submit--> waiting --worker--> runner.run --> done: the next one
                                                 `--> failed: the arm is stopped, what waits is never sent

1. Such an arm has no index: a motion is over when the family's `MotionRunner` says so.
2. The worker is a task that lives while there is something to do, whether or not anybody awaits it.
3. A failure is kept until the queue asks how far the arm is; what was put behind it by then fails with it.
"""

from __future__ import annotations

import asyncio
import logging
from collections import deque
from collections.abc import Sequence
from typing import Any, Protocol, TypeVar

from dobot_async._core.protocol.wire import Command
from dobot_async._core.queue.executor import Entry, MotionSource, unseen
from dobot_async._core.queue.keeper import Keeper
from dobot_async._core.queue.motion import Motion
from dobot_async._core.queue.queue import MotionQueue
from dobot_async._core.util.hooks import Hooks
from dobot_async._core.util.tasks import Cleanup, cancel_and_join
from dobot_async.errors import ConnectionLost, DobotError, MotionUnknown, another

__all__ = ["HostExecutor", "HostQueue", "MotionRunner"]

Q = TypeVar("Q")
logger = logging.getLogger("dobot_async.queue")
CAPACITY = 1000


class MotionRunner(Protocol):
    """What a family brings whose arm takes one motion at a time. Each call may be cancelled at any moment."""

    def prepare(self, command: Command[Q, Any], value: Q) -> Entry:
        """Return a checked entry; see `Executor.prepare`."""
        ...

    async def run(self, entry: Entry) -> None:
        """Do one command, sent once, and return when it is done.

        Raises:
            DobotError: It is not done.
        """

    async def stop(self) -> None:
        """Stop the arm, ahead of everything; repeated until it has heard that, and stands."""

    async def reset(self) -> None:
        """Make an arm that stands ready for more; repeated until it has heard that."""

    async def pause(self) -> None:
        """Let the arm wait where it is."""

    async def resume(self) -> None:
        """Let the arm go on."""


class HostExecutor:
    """The executor of an arm without a queue; see `Executor`.

    Args:
        runner: Does one command.
        cleanup: What still has to be done to the arm.
        capacity: How many commands may wait.

    Attributes:
        on_progress: Hooks, called when a command is done or has failed.
        keeper: See `Executor`.
    """

    keeper: Keeper[Any] | None = None

    def __init__(self, runner: MotionRunner, cleanup: Cleanup, capacity: int = CAPACITY) -> None:
        self.cleanup = cleanup
        self.on_unknown: Hooks[[MotionUnknown]] = Hooks()
        self.on_motion: Hooks[[Motion]] = Hooks()
        self.on_progress: Hooks[[]] = Hooks()
        self._runner = runner
        self._capacity = capacity
        self._waiting: deque[tuple[int, Entry]] = deque()
        self._room = asyncio.Event()
        self._running = asyncio.Event()
        self._running.set()
        self._tickets = 0
        self._finished = self._reported = 0
        self._worker: asyncio.Task[None] | None = None  # kept when it has failed
        self._error: DobotError | None = None
        self._stands = True

    @property
    def unsent(self) -> int:
        """How many commands wait that the arm has never heard of."""
        return len(self._waiting)

    def prepare(self, command: Command[Q, Any], value: Q) -> Entry:
        """Return a checked entry."""
        return self._runner.prepare(command, value)

    async def submit(self, source: MotionSource) -> None:
        """Take commands while there is room for them."""
        while source:
            if len(self._waiting) >= self._capacity:
                self._room.clear()
                await self._room.wait()
                continue

            entry = source.take()
            self._tickets += 1
            self._waiting.append((self._tickets, entry))
            source.accepted(entry, self._tickets)
            if self._worker is None:
                self._worker = asyncio.create_task(self._work(), name="dobot_async worker")

    async def completed(self) -> int | None:
        """Return the ticket of the last command that is done; then raise what the one behind it has failed with."""
        if self._error and self._reported == self._finished:
            self.drop()
            raise another(self._error)

        self._reported = self._finished
        return self._finished

    async def earliest_end(self, entry: Entry) -> None:
        """Return None: that a command is done is noticed here."""

    async def alarms(self) -> Sequence[object]:
        """Return nothing: a command that alarms have ended has failed."""
        return ()

    async def is_at_target(self, entry: Entry) -> bool:  # noqa: ARG002 - it is never needed
        """Return False."""
        return False

    async def stop(self) -> None:
        """Send nothing more, and stop the arm."""
        await self.aclose()
        await self._runner.stop()
        self._stands = True

    async def clear(self) -> None:
        """Forget what waits, end what runs, and make the arm ready for more."""
        if self._stands:
            await self.aclose()
        else:
            await self.stop()

        await self._runner.reset()

    async def pause(self) -> None:
        """Let the arm wait where it is, and send it nothing more."""
        self._running.clear()
        try:
            await self._runner.pause()
        except BaseException:
            self._running.set()
            raise

    async def resume(self) -> None:
        """Let the arm go on."""
        await self._runner.resume()
        self._running.set()

    async def aclose(self) -> None:
        """Send nothing more; the arm is left as it is."""
        self.drop()
        worker, self._worker, self._error = self._worker, None, None
        self._running.set()
        if worker:
            await cancel_and_join(worker)

    def drop(self) -> None:
        """Forget what waits."""
        self._waiting.clear()
        self._room.set()

    async def _work(self) -> None:
        """Give the arm one command after the other; after one that has failed, stop it."""
        try:
            while self._waiting:
                if not self._running.is_set():
                    await self._running.wait()
                    continue

                ticket, entry = self._waiting.popleft()
                self._room.set()
                self._stands = False
                await self._runner.run(entry)
                self._stands = True
                self._finished = ticket
                self.on_progress()

            self._worker = None
        except BaseException as error:
            if asyncio.current_task() is self._worker:  # else it was ended from here
                self._error = told(error)
                self.on_progress()

            if not isinstance(error, Exception):
                raise

            if not isinstance(error, DobotError):
                logger.exception("the worker failed")

            if not isinstance(error, ConnectionLost):
                await self._stop_unasked()

    async def _stop_unasked(self) -> None:
        """Stop the arm at once: the queue does so too, but not before somebody asks how far the arm is."""
        try:
            await self._runner.stop()
        except DobotError as error:
            logger.warning("the stop behind a motion that failed: %s", error)


def told(error: BaseException) -> DobotError:
    """What those who wait hear of the end of the worker."""
    if isinstance(error, DobotError):
        return unseen(error)

    return MotionUnknown(f"the driver failed in a motion: {error!r}")


class HostQueue(MotionQueue):
    """The queue of an arm without one: it ends with the block."""

    def __init__(self, executor: HostExecutor) -> None:
        super().__init__(executor)
        self._host = executor
        executor.on_progress.add(self._poller.stir)

    @property
    def unsent(self) -> int:
        """How many commands are here that the arm has never heard of."""
        return self._host.unsent

    async def update(self) -> None:
        """End what is done, and what has failed."""
        try:
            for _ in range(2):  # `completed` tells of a failure once it has told what is done
                await self.look(alarms=False)
        except DobotError as error:
            self.give_up(error)

    async def aclose(self) -> None:
        """End the worker as well: nothing that waits is begun once its Motion has ended."""
        self._host.drop()
        await super().aclose()
        await self._host.aclose()
