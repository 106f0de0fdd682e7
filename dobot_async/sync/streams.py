"""Programs that run while one waits for them, or iterates over them."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Iterable
from typing import Any, Generic, TypeVar

from dobot_async._core.queue.stream import Stream as AsyncStream
from dobot_async.arms.ultraarm.gcode import GCodeLine
from dobot_async.arms.ultraarm.gcode import GCodeRun as AsyncGCodeRun
from dobot_async.sync.portal import PORTAL
from dobot_async.sync.twin import Items, Twin, same

__all__ = ["GCodeRun", "Stream", "drawn"]

S = TypeVar("S")
END = object()


class Stream(Twin[AsyncStream[S]], Generic[S]):
    """Steps on their way through a queue; made by `queue.stream`. Nothing is sent before `wait`, or the first step."""

    __slots__ = ()

    def wait(self) -> None:
        """Return when all of it is done; raises as `queue.stream` says."""
        PORTAL.run(lambda: self.asynchronous)

    def __iter__(self) -> Items[S]:
        return Items(lambda: self.asynchronous, same)


class GCodeRun(Twin[AsyncGCodeRun]):
    """A program that is checked; `wait` runs it, and so does iterating over it, which yields each line that is done.

    Interrupted, or left, it stops the arm. A line that fails is named in a note of the error.
    """

    __slots__ = ()

    @property
    def lines(self) -> tuple[GCodeLine, ...]:
        """Its commands."""
        return self.asynchronous.lines

    def wait(self) -> None:
        """Run it, and return when all of it is done."""
        PORTAL.run(lambda: self.asynchronous)

    def __iter__(self) -> Items[GCodeLine]:
        return Items(lambda: self.asynchronous, same)


def drawn(steps: Iterable[S]) -> Iterable[S] | AsyncIterator[S]:
    """Return steps as they are; those of a generator, which may take its time, from another thread."""
    return steps if isinstance(steps, list | tuple) else drawn_elsewhere(steps)


async def drawn_elsewhere(steps: Iterable[S]) -> AsyncIterator[S]:
    """Yield what an iterable yields, which is asked in another thread."""
    iterator = iter(steps)
    while True:
        step: Any = await asyncio.to_thread(next, iterator, END)
        if step is END:
            return

        yield step
