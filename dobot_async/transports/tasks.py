"""Calls of libraries that must not be left half done: each runs in a task of its own, which nobody leaves behind.

A cancellation comes to the caller. What it does to the call is decided here and not by whatever the call was just
waiting for: `whole` lets it come to its end first, `within` ends it, and waits for its own cleaning up.
"""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from typing import Any, TypeVar

import anyio

__all__ = ["Ended", "whole", "within"]

T = TypeVar("T")
CLEAN_UP = 3.0
"""Seconds that a cancelled call may take to clean up, twice: the second cancellation ends the cleaning up."""


class Ended(Exception):
    """What a call was needed for has come to its end before the call has."""


async def whole(work: Coroutine[Any, Any, T]) -> T:
    """Runs a call to its end even if the caller is cancelled meanwhile; the cancellation goes on after it."""
    task = asyncio.create_task(work)
    cancelled = await joined(task, None)
    if cancelled:
        if not task.cancelled():
            task.exception()  # the cancellation is what counts

        raise cancelled

    return task.result()


async def within(seconds: float, work: Coroutine[Any, Any, T], *, until: asyncio.Future[None] | None = None) -> T:
    """Runs a call for so long at most, or until a future is done; ends it if the caller is cancelled.

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
            await ended(task)
        elif not task.cancelled():
            task.exception()  # if the caller is cancelled now, nobody asks for it

    if in_time:
        return task.result()

    if until and until.done():
        raise Ended

    raise TimeoutError(f"not done within {seconds:.3g} s")


async def ended(task: asyncio.Task[Any]) -> None:
    """Cancels a task and waits until it has cleaned up, as far as it does so in time."""
    cancelled = None
    for _ in range(2):
        task.cancel()
        cancelled = await joined(task, CLEAN_UP) or cancelled
        if task.done():
            break

    if task.done() and not task.cancelled():
        task.exception()

    if cancelled:
        raise cancelled


async def joined(task: asyncio.Task[Any], timeout: float | None) -> asyncio.CancelledError | None:
    """Waits for a task whatever comes; returns the cancellation that came meanwhile."""
    loop = asyncio.get_running_loop()
    deadline = None if timeout is None else loop.time() + timeout
    cancelled = None
    with anyio.CancelScope(shield=True):
        while not task.done():
            left = None if deadline is None else deadline - loop.time()
            if left is not None and left <= 0:
                break

            try:
                await asyncio.wait([task], timeout=left)
            except asyncio.CancelledError as error:
                cancelled = error

    return cancelled
