"""A program of any length through a queue: its steps are queued as there is room, and told as they are done.

    steps --feeder--> queue.put --> open: (step, Motion), ... --> yielded, in order, as each Motion ends
                        |
                        `waits while the queue is full, or while AHEAD steps are done and nobody has taken them

1. The feeder is a task that lives as long as somebody iterates: a slow loop body does not starve the arm.
2. What is queued belongs to the queue; whoever leaves the loop only ends the feeder.
3. An error names the step that failed, or the first and the last that may have.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import AsyncIterable, AsyncIterator, Coroutine, Generator, Iterable
from contextlib import AbstractContextManager, suppress
from typing import Any, Generic, NamedTuple, Protocol, TypeGuard, TypeVar

from dobot_async._core.protocol.wire import Command
from dobot_async._core.queue.epoch import Epoch
from dobot_async._core.queue.motion import Motion
from dobot_async._core.util.tasks import cancel_and_join
from dobot_async.errors import ArmAlarm, DobotError

__all__ = ["Steps", "Stream", "StreamStep"]

S = TypeVar("S")
Y = TypeVar("Y")
Steps = Iterable[S] | AsyncIterable[S]

AHEAD = 1000
"""Steps that may be queued and not yet be yielded."""

STANDS_WITHIN = 1.5
"""Seconds for which one waits, after an alarm, to hear which motions were done before it."""


class StreamStep(Protocol):
    """A step that names a row of the command table."""

    @property
    def command(self) -> Command[Any, Any]:
        """The row."""
        ...

    @property
    def value(self) -> Any:
        """Its parameters."""
        ...


class Queue(Protocol):
    """The queue, as far as a stream is concerned."""

    @property
    def epoch(self) -> Epoch:
        """The time since the last stop."""
        ...

    async def put(self, command: Command[Any, Any], value: Any, *, epoch: Epoch | None = None) -> Motion:
        """Give one command to the arm's queue and return once the arm has accepted it."""
        ...

    def watching(self) -> AbstractContextManager[None]:
        """While this is entered, the arm is asked how far it is."""
        ...


class Queued(NamedTuple):
    """A step in the queue, and what is yielded for it."""

    name: str
    step: Any
    motion: Motion


class Stream(Generic[Y]):
    """Steps on their way through a queue; made by `queue.stream`."""

    def __init__(self, queue: Queue, steps: Steps[Any]) -> None:
        self._queue = queue
        self._steps = steps

    def __await__(self) -> Generator[Any, None, None]:
        return self._run().__await__()

    async def _run(self) -> None:
        async for _ in self:
            pass

    async def __aiter__(self) -> AsyncIterator[Y]:
        feeder = Feeder(self._queue, self._steps)
        task = asyncio.create_task(feeder.feed(), name="dobot_async stream")
        task.add_done_callback(lambda _: feeder.news.set())
        try:
            with self._queue.watching():
                while True:
                    queued = await self._next_done(feeder, task)
                    if queued is None:
                        break

                    feeder.room.release()
                    yield queued.step
        finally:
            await cancel_and_join(task)

    async def _next_done(self, feeder: Feeder, task: asyncio.Task[None]) -> Queued | None:
        """Return the next step once it is done, None when there are no more; raise what came between."""
        while not feeder.open and not task.done():
            feeder.news.clear()
            await feeder.news.wait()

        try:
            if feeder.open:
                await ended_or_failed(feeder.open[0].motion, task)
                return feeder.open.popleft()

            task.result()
        except (DobotError, ValueError, TypeError) as error:
            await feeder.locate(error)
            raise

        return None


def is_coroutine(step: object) -> TypeGuard[Coroutine[Any, Any, object]]:
    """Return whether a step is a verb of the queue, to be awaited."""
    return isinstance(step, Coroutine)


class Feeder:
    """What puts the steps of a stream.

    Attributes:
        open: The steps that are queued and not yielded, in order.
        room: How many more may be.
        news: Set when there is one more, or when there will be none.
    """

    def __init__(self, queue: Queue, steps: Steps[Any]) -> None:
        self.open: deque[Queued] = deque()
        self.room = asyncio.Semaphore(AHEAD)
        self.news = asyncio.Event()
        self._queue = queue
        self._steps = steps
        self._epoch = queue.epoch
        self._putting: tuple[str, Any] | None = None

    async def feed(self) -> None:
        """Put all steps."""
        number = 0
        try:
            async for step in drawn(self._steps):
                number += 1
                is_verb = is_coroutine(step)
                self._putting = (name_of(step, number), step)
                await self._acquire(step)
                motion: object
                if is_verb:
                    motion = await step
                else:
                    motion = await self._queue.put(step.command, step.value, epoch=self._epoch)

                if not isinstance(motion, Motion):
                    raise TypeError("a step is a verb of the queue, such as arm.queue.home(), or has command and value")

                self._putting = None
                name = f"step {number} ({motion})" if is_verb else name_of(step, number)
                self.open.append(Queued(name, motion if is_verb else step, motion))
                self.news.set()
        finally:
            if isinstance(self._steps, list | tuple):
                close(self._steps[number:])

    async def locate(self, error: Exception) -> None:
        """Note on an error which step has failed, or the first and the last one that may have."""
        if isinstance(error, ArmAlarm):
            await self._settle()

        failed = [each for each in self.open if each.motion.ended and each.motion.exception()]
        if isinstance(error, ArmAlarm):
            failed = [each for each in failed if each.motion in error.motions] or failed[:1]
        else:
            failed = failed[:1]

        found = [(each.name, each.step) for each in failed]
        if self._putting and not (isinstance(error, ArmAlarm) and failed):
            found.append(self._putting)

        if not found:
            return

        (first, step), (last, last_step) = found[0], found[-1]
        error.add_note(first if first == last else f"{first} {'or' if len(found) == 2 else 'to'} {last}")
        if isinstance(error, DobotError):
            error.steps = (step, last_step)

    async def _acquire(self, step: Any) -> None:
        """Wait for room."""
        try:
            await self.room.acquire()
            self._epoch.check()
        except BaseException:
            close([step])
            raise

    async def _settle(self) -> None:
        """Wait until it is known which motions were done before the arm raised an alarm."""
        with suppress(TimeoutError):
            async with asyncio.timeout(STANDS_WITHIN):
                for each in self.open:
                    with suppress(DobotError):
                        await each.motion.wait()


async def ended_or_failed(motion: Motion, task: asyncio.Task[None]) -> None:
    """Return when a motion is done; raise how it has failed, or how the task has, if that comes first."""
    if not motion.ended and not task.done():
        waiter = asyncio.create_task(motion.wait())
        try:
            await asyncio.wait([waiter, task], return_when=asyncio.FIRST_COMPLETED)
        finally:
            await cancel_and_join(waiter)

    if not motion.ended and task.done():
        task.result()

    await motion.wait()


async def drawn(steps: Steps[Any]) -> AsyncIterator[Any]:
    """Yield the steps of any iterable."""
    if isinstance(steps, AsyncIterable):
        async for step in steps:
            yield step
    else:
        for step in steps:
            yield step


def close(steps: Iterable[Any]) -> None:
    """End verbs that will not be awaited."""
    for step in steps:
        if isinstance(step, Coroutine):
            step.close()


def name_of(step: Any, number: int) -> str:
    """What a step is called: what it says of itself, or its place and its command."""
    if isinstance(step, Coroutine):
        return f"step {number}"

    says_so = any("__str__" in vars(kind) for kind in type(step).__mro__[:-1])
    return str(step) if says_so else f"step {number} ({step.command.name})"
