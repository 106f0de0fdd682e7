"""What the arms of all families do alike with their queue of motions, beside the queue itself."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine
from contextlib import asynccontextmanager
from typing import Any, TypeVar

from dobot_async.errors import ConnectFailed, DobotError, MotionStopped, ReplyTimeout
from dobot_async.executor import Entry
from dobot_async.motion import Motion, MotionQueue, undisturbed
from dobot_async.transports import Transport, hidden, open_transport
from dobot_async.wire import Command

__all__ = ["Collector", "collected", "held", "left", "open_in_time", "owned"]

Q = TypeVar("Q")
C = TypeVar("C", bound="Collector")
Closing = Callable[[], Coroutine[Any, Any, None]]
LEAST = 1.0  # seconds that an arm has for its first answer, whatever it took to open the way to it


async def owned(queue: MotionQueue, command: Command[Q, Any], value: Q, timeout: float | None) -> None:
    """Queues a motion and waits for its end; it does not outlive the call: cancelled, or too late, the arm stops.

    Raises:
        ReplyTimeout: It was not done in time; the arm was stopped.
        DobotError: As `MotionQueue.put` and `Motion.wait`.
    """
    queue.prepare(command, value)
    try:
        async with asyncio.timeout(timeout):
            motion = await queue.put(command, value)
            await motion
    except (TimeoutError, asyncio.CancelledError) as error:
        await undisturbed(queue.stop())
        if isinstance(error, TimeoutError) and not isinstance(error, DobotError):
            raise ReplyTimeout(f"{command.name} was not done within {timeout:.3g} s; the arm was stopped") from None

        raise


class Collector:
    """Commands that are to be queued together; each one's Motion may be awaited after the batch's block."""

    def __init__(self, queue: MotionQueue) -> None:
        self.motions: dict[Entry, Motion] = {}
        self._queue = queue

    def put(self, command: Command[Q, Any], value: Q) -> Motion:
        """Adds any row of the table that may be queued."""
        entry = self._queue.prepare(command, value)
        motion = self.motions[entry] = Motion(self._queue, entry)
        return motion

    def perform(self, command: Command[Q, Any], value: Q, timeout: float | None) -> Motion:
        """Adds a command."""
        if timeout is not None:
            raise ValueError("the commands of a batch have no timeout of their own; give it to batch()")

        return self.put(command, value)


@asynccontextmanager
async def collected(queue: MotionQueue, batch: C, timeout: float | None) -> AsyncIterator[C]:
    """Queues what the block collects, with nothing between it, when the block ends; an error sends none."""
    try:
        yield batch
    except BaseException:
        for motion in batch.motions.values():
            motion.end(MotionStopped("it was not sent: its batch was left by an error"))

        raise

    await queue.put_all(batch.motions, timeout=timeout)


async def open_in_time(url: str, arm: str, timeout: float) -> Transport:
    """Opens the way to an arm; raises ConnectFailed, with the transport's advice, if that takes too long."""
    try:
        async with asyncio.timeout(timeout):
            return await open_transport(url, arm=arm)
    except TimeoutError as error:
        # What the transport was about when the time was over may have left advice.
        why = getattr(error.__cause__, "__notes__", ["is the address right?"])[0]
        raise ConnectFailed(f"{hidden(url)} could not be opened within {timeout:.3g} s; {why}") from None


def left(deadline: float, timeout: float) -> float:
    """Returns the seconds in which an arm has to answer: until the deadline, but some even if the way took them all.

    To open it may take long where the arm is not to blame, as on a busy computer that imports the simulator first.
    """
    return max(deadline - asyncio.get_running_loop().time(), min(timeout, LEAST))


@asynccontextmanager
async def held(greet: Awaitable[None], *, leave: Closing | None, close: Closing) -> AsyncIterator[None]:
    """Holds an arm for the length of a block, and closes its link in any case.

    Args:
        greet: Proves that the arm answers.
        leave: Stops the arm where the block is left by an error or a cancellation; None lets it go on.
        close: Closes the link.
    """
    try:
        await greet
    except BaseException:
        await undisturbed(close())
        raise

    try:
        yield
    except BaseException:
        if leave:
            await undisturbed(leave())

        raise
    finally:
        await undisturbed(close())
