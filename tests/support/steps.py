"""Does something at a step of some work: at each await of it, and of all tasks that it starts, there is one.

The loop's task factory counts how often these tasks are resumed. A scenario is run once for each step, and no moment is
chosen by hand.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Generator
from contextvars import Context, ContextVar, copy_context
from typing import Any

__all__ = ["Steps"]

counting: ContextVar[Steps | None] = ContextVar("counting", default=None)


class Steps:
    """The steps of one piece of work.

    Attributes:
        count: How many there were so far.
    """

    def __init__(self, at: int, act: Callable[[], object]) -> None:
        self.count = 0
        self._at = at
        self._act = act
        self._outside = copy_context()

    def begin(self, work: Coroutine[Any, Any, None]) -> asyncio.Task[None]:
        """Starts the work in a task; `act` is called, outside of what is counted, when its step number `at` begins."""
        asyncio.get_running_loop().set_task_factory(factory)
        inside = copy_context()
        inside.run(counting.set, self)
        return asyncio.get_running_loop().create_task(work, context=inside)

    def take(self) -> None:
        """One of the tasks goes on."""
        self.count += 1
        if self.count == self._at:
            self._outside.run(self._act)


def factory(
    loop: asyncio.AbstractEventLoop, work: Any, context: Context | None = None, **details: Any
) -> asyncio.Task[Any]:
    """Makes tasks; those of work that is counted tell of each of their steps."""
    steps = (context or copy_context()).get(counting)
    return asyncio.Task(Counted(steps, work) if steps else work, loop=loop, context=context, **details)


class Counted(Coroutine[Any, Any, Any]):
    """Work that tells of each of its steps."""

    def __init__(self, steps: Steps, work: Coroutine[Any, Any, Any]) -> None:
        self._steps = steps
        self._work = work

    def send(self, value: Any) -> Any:
        """Goes on."""
        self._steps.take()
        return self._work.send(value)

    def throw(self, *error: Any) -> Any:
        """Goes on with an error."""
        self._steps.take()
        return self._work.throw(*error)

    def close(self) -> None:
        """Ends it."""
        self._work.close()

    def __await__(self) -> Generator[Any, Any, Any]:
        raise TypeError("it is a task's")
