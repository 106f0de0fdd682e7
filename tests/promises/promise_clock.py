"""A virtual clock with a hard end: no test hangs, whatever the driver on trial does.

A test that waits for nothing fails at once (`async_solipsism`). One that goes on past its limit in virtual time is
struck: the loop stops whatever the tasks do, for a driver that is wrong may refuse to be cancelled.
"""

from __future__ import annotations

import asyncio
import functools
from collections.abc import Awaitable, Callable, Coroutine
from typing import Any, ParamSpec, TypeVar

import async_solipsism

P = ParamSpec("P")
T = TypeVar("T")

LIMIT = 600.0
"""Virtual seconds that a test may take."""
SPINS = 5000
"""Turns of the loop in a row in which no time passes, after which time passes all the same: as on a real computer, who
asks for turns without end does not halt the clock. (An anyio scope does so whose task does not heed a cancellation.)"""
SPIN = 0.001  # seconds that each further turn then takes

__all__ = ["LIMIT", "Ended", "end_of", "now", "on_virtual_clock", "run_on_virtual_clock"]


class VirtualLoop(async_solipsism.EventLoop):  # type: ignore[misc]  # it has no types
    """A loop whose clock jumps to the next thing that happens, and that nobody can halt."""

    def __init__(self) -> None:
        super().__init__()
        selector = self._selector
        plain, clock = selector.select, selector.clock
        spins = 0

        def select(timeout: float | None = None) -> Any:
            nonlocal spins
            if timeout is None or timeout > 0:
                spins = 0
                # What is due before the clock's next tick is due at it.
                return plain(timeout and max(timeout, clock.resolution))

            spins += 1
            if spins > SPINS:
                clock.advance(SPIN)

            return plain(timeout)

        selector.select = select


def on_virtual_clock(test: Callable[P, Coroutine[Any, Any, None]]) -> Callable[P, None]:
    """Makes a plain test of an async one, on a virtual clock with the limit."""

    @functools.wraps(test)
    def run(*args: P.args, **kwargs: P.kwargs) -> None:
        run_on_virtual_clock(test(*args, **kwargs))

    return run


def run_on_virtual_clock(work: Coroutine[Any, Any, T], limit: float = LIMIT) -> T:
    """Runs work to its end and returns its result.

    Raises:
        AssertionError: It was not over within the limit, or left tasks behind.
        async_solipsism.SleepForeverError: Everybody waited, and for nothing.
    """

    async def checked() -> T:
        result = await work
        left = asyncio.all_tasks() - {asyncio.current_task()}
        assert not left, f"left behind: {left}"
        return result

    struck = False

    def strike(loop: asyncio.AbstractEventLoop) -> None:
        nonlocal struck
        struck = True
        loop.stop()
        loop.call_later(1, strike, loop)  # the runner's own cleaning up may hang as well

    try:
        with asyncio.Runner(loop_factory=VirtualLoop) as runner:
            loop = runner.get_loop()
            loop.set_exception_handler(lambda *_: None)  # of tasks that are struck
            loop.call_later(limit, strike, loop)
            return runner.run(checked())
    except RuntimeError as error:
        if struck:
            raise AssertionError(f"not over within {limit:g} s of virtual time") from error

        raise


def now() -> float:
    """The time of the running loop."""
    return asyncio.get_running_loop().time()


class Ended:
    """How a call ended.

    Attributes:
        seconds: How long it took; infinite if it did not end in time.
        error: What it raised.
        cancelled: Whether its task ended as cancelled.
        result: What it returned.
    """

    def __init__(self, task: asyncio.Task[Any], seconds: float) -> None:
        self.seconds = seconds if task.done() else float("inf")
        self.cancelled = task.done() and task.cancelled()
        self.error = task.exception() if task.done() and not self.cancelled else None
        self.result = task.result() if task.done() and not self.cancelled and not self.error else None

    def __repr__(self) -> str:
        if self.seconds == float("inf"):
            return "still going on"

        how = "cancelled" if self.cancelled else repr(self.error) if self.error else f"returned {self.result!r}"
        return f"{how} after {self.seconds:.2f} s"


async def end_of(work: Awaitable[Any] | asyncio.Task[Any], within: float) -> Ended:
    """Waits for a call to end, so long and no longer; the call itself is not touched."""
    task = work if isinstance(work, asyncio.Task) else asyncio.ensure_future(work)
    assert isinstance(task, asyncio.Task)
    before = now()
    await asyncio.wait([task], timeout=within)
    return Ended(task, now() - before)
