"""Tasks that are always joined: shielded, bounded, cancelled; and cleanup that outlives its caller.

    run_shielded   to its end, whatever becomes of the caller
    run_within     for so long at most; ended if the caller is cancelled
    cancel_and_join
    Cleanup        begun at once, waited for 2 s at most, and finished in the background if that was not enough

A cancellation always comes out as the cancellation that it was: what goes wrong while a caller cleans up is a note on
it, and a line in the log.
"""

from __future__ import annotations

import asyncio
import logging
import math
from collections.abc import AsyncGenerator, Callable, Coroutine
from contextlib import asynccontextmanager
from typing import Any, TypeVar

import anyio

from dobot_async.errors import ConnectionLost, DobotError, ReplyTimeout

__all__ = ["Cleanup", "Ended", "cancel_and_join", "join", "run_concurrently", "run_shielded", "run_within"]

T = TypeVar("T")
logger = logging.getLogger("dobot_async.link")
CLEAN_UP = 3.0
"""Seconds that a cancelled call may take to clean up, twice: the second cancellation ends the cleaning up."""

TICK = 1e-6  # seconds that count as none: the loop's timers may fire a moment early
LEAVING = 1.9
"""Seconds for which who is on his way out, cancelled or by an error, waits for a stop to be acknowledged: in all, of
however many calls and blocks inside of each other that is the way. The later ones get `AT_LEAST`."""

AT_LEAST = 0.05
SAME_WAY = 0.5  # seconds after a wait in vain within which the next one belongs to the same way out

STAYING = 5.0
"""Seconds for which everybody else does."""


class Ended(Exception):
    """What a call was needed for has come to its end before the call has."""


async def run_shielded(work: Coroutine[Any, Any, T]) -> T:
    """Run work to its end even if the caller is cancelled meanwhile; the cancellation goes on after it.

    Raises:
        CancelledError: The caller was cancelled; whatever the work returned or raised.
    """
    task = asyncio.create_task(work)
    cancelled = await join(task)
    if cancelled:
        if not task.cancelled():
            task.exception()  # the cancellation is what counts

        raise cancelled

    return task.result()


async def run_within(seconds: float, work: Coroutine[Any, Any, T], *, until: asyncio.Future[None] | None = None) -> T:
    """Run work for so long at most, or until a future is done; end it if the caller is cancelled.

    Raises:
        TimeoutError: It took longer.
        Ended: The future was done first.
    """
    task = asyncio.create_task(work)
    try:
        waited: set[asyncio.Future[Any]] = {task, until} if until else {task}
        await asyncio.wait(waited, timeout=seconds, return_when=asyncio.FIRST_COMPLETED)
        in_time = task.done()
    finally:
        if not task.done():
            await cancel_and_join(task)
        elif not task.cancelled():
            task.exception()  # if the caller is cancelled now, nobody asks for it

    if in_time:
        return task.result()

    if until and until.done():
        raise Ended

    raise TimeoutError(f"not done within {seconds:.3g} s")


async def run_concurrently(*work: Coroutine[Any, Any, Any]) -> None:
    """Run several things at the same time; the first error, or a cancellation, ends the others before it goes on."""
    tasks = [asyncio.create_task(each) for each in work]
    try:
        await asyncio.gather(*tasks)
    finally:
        for task in tasks:
            if not task.done():
                await cancel_and_join(task)


async def cancel_and_join(task: asyncio.Task[Any]) -> None:
    """Cancel a task and wait until it has cleaned up, as far as it does so in time."""
    cancelled = None
    for _ in range(2):
        task.cancel()
        cancelled = await join(task, CLEAN_UP) or cancelled
        if task.done():
            break

    if task.done() and not task.cancelled():
        task.exception()

    if cancelled:
        raise cancelled


async def join(task: asyncio.Task[Any], timeout: float | None = None) -> asyncio.CancelledError | None:
    """Wait for a task whatever comes; return the cancellation that came meanwhile."""
    loop = asyncio.get_running_loop()
    deadline = None if timeout is None else loop.time() + timeout
    cancelled = None
    with anyio.CancelScope(shield=True):
        while not task.done():
            left = None if deadline is None else deadline - loop.time()
            if left is not None and left <= TICK:
                break

            try:
                await asyncio.wait([task], timeout=left)
            except asyncio.CancelledError as error:
                cancelled = error

    return cancelled


class Cleanup:
    """What has to be done to an arm whatever becomes of who asked for it: stops, above all.

    Args:
        url: Of the arm, for the log.
    """

    def __init__(self, url: str) -> None:
        self._url = url
        self._tasks: set[asyncio.Task[Any]] = set()
        self._loop = asyncio.get_running_loop()
        self._out_by = self._in_vain_at = -math.inf

    def start(self, work: Coroutine[Any, Any, T], what: str) -> asyncio.Task[T]:
        """Start work that goes on until it is done, or until `aclose`.

        Args:
            work: What is to be done.
            what: Its name, for the log.
        """
        task = asyncio.create_task(work, name=f"dobot_async {what}")
        self._tasks.add(task)
        late = asyncio.get_running_loop().call_later(LEAVING, self._late, task)

        def ended(task: asyncio.Task[T]) -> None:
            late.cancel()
            self._ended(task)

        task.add_done_callback(ended)
        return task

    async def finish(self, task: asyncio.Task[Any], seconds: float | None = None) -> DobotError | None:
        """Wait for work of `start`; it goes on after that.

        Args:
            task: The work.
            seconds: How long at most; by default what is left of the time for the way out, `LEAVING`.

        Returns:
            What went wrong, None if it is done.

        Raises:
            CancelledError: The caller was cancelled meanwhile; the waiting went on for `LEAVING` seconds at most.
        """
        cancelled = None
        if seconds is not None:
            try:
                await asyncio.wait([task], timeout=seconds)
            except asyncio.CancelledError as error:
                cancelled = error

        if seconds is None or cancelled:
            seconds = self._left()
            cancelled = await join(task, seconds) or cancelled

        failure = self._failure(task)
        if task.done():
            self._out_by = -math.inf  # the way out is over
        else:
            self._in_vain_at = self._loop.time()

        if cancelled:
            if failure:
                cancelled.add_note(str(failure))

            raise cancelled

        return failure

    @asynccontextmanager
    async def at_end(self, work: Callable[[], Coroutine[Any, Any, Any]], what: str) -> AsyncGenerator[None]:
        """Do something when the block ends, however it ends.

        Raises:
            DobotError: It could not be done, and the block ended without an error of its own.
        """
        try:
            yield
        except BaseException as error:
            failure = await self.finish(self.start(work(), what))
            if failure:
                error.add_note(str(failure))

            raise

        failure = await self.finish(self.start(work(), what), STAYING)
        if failure:
            raise failure

    async def aclose(self) -> None:
        """End what is still being tried."""
        for task in list(self._tasks):
            logger.warning("%s: given up, for the connection to %s ends", task.get_name(), self._url)
            await cancel_and_join(task)

    def _failure(self, task: asyncio.Task[Any]) -> DobotError | None:
        """What is wrong with work that was waited for; raises what is no error of an arm or its link."""
        what = task.get_name().removeprefix("dobot_async ")
        if not task.done():
            return ReplyTimeout(
                f"{what}: {self._url} has not acknowledged it yet; it is repeated until it does, or until the "
                "connection ends"
            )

        if task.cancelled():
            return ConnectionLost(f"{what}: the connection to {self._url} ended before it was acknowledged")

        error = task.exception()
        if error is None or isinstance(error, DobotError):
            return error

        raise error

    def _late(self, task: asyncio.Task[Any]) -> None:
        logger.warning("%s: %s has not acknowledged it yet; it is repeated until it does", task.get_name(), self._url)

    def _left(self) -> float:
        """The seconds that are left on the way out; a new one begins when the last one has been over for a while."""
        now = self._loop.time()
        if now > max(self._out_by, self._in_vain_at + SAME_WAY):
            self._out_by = now + LEAVING

        return max(self._out_by - now, AT_LEAST)

    def _ended(self, task: asyncio.Task[Any]) -> None:
        self._tasks.discard(task)
        if not task.cancelled() and (error := task.exception()):
            logger.warning("%s: %s", task.get_name(), error)
