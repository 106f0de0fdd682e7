"""Several things at once, each for one arm.

All end before this returns. Of several failures one is told: the first of which the others are a consequence.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Mapping
from typing import Any, TypeVar

from dobot_async.errors import DobotError, MotionStopped
from dobot_async.fleet.errors import BarrierBroken
from dobot_async.motion import undisturbed

__all__ = ["all_of", "named", "side_by_side"]

T = TypeVar("T")
CONSEQUENCES = (MotionStopped, BarrierBroken, asyncio.CancelledError)


async def side_by_side(
    work: Mapping[str, Coroutine[Any, Any, T]],
    *,
    ends: Callable[[str, BaseException], bool] = lambda _name, _error: True,
) -> dict[str, T]:
    """Does everything at the same time, and returns what each has returned.

    Args:
        work: By the arm's name.
        ends: Whether a failure cancels the others.

    Raises:
        BaseException: The first failure, when all have ended.
    """
    tasks = {asyncio.create_task(each, name=f"dobot_async {name}"): name for name, each in work.items()}
    waiting, failures = set(tasks), list[BaseException]()
    try:
        while waiting:
            done, waiting = await asyncio.wait(waiting, return_when=asyncio.FIRST_COMPLETED)
            for task, name in tasks.items():
                error = failure(task) if task in done else None
                if error:
                    failures.append(error)
                    if ends(name, error):
                        cancel(waiting)
    except BaseException:
        await undisturbed(end(waiting))
        raise

    if failures:
        raise min(failures, key=lambda error: isinstance(error, CONSEQUENCES))

    return {name: task.result() for task, name in tasks.items()}


async def all_of(work: Mapping[str, Coroutine[Any, Any, Any]]) -> None:
    """Does everything at the same time, to its end, whatever fails; then raises the first failure, with the others."""
    results = await asyncio.gather(*work.values(), return_exceptions=True)
    errors = [named(name, error) for name, error in zip(work, results, strict=True) if isinstance(error, BaseException)]
    if errors:
        for other in errors[1:]:
            errors[0].add_note(f"and {other}")

        raise errors[0]


def named(name: str, error: BaseException) -> BaseException:
    """Returns an error of an arm; its message gets the arm's name if it is one of ours."""
    if isinstance(error, (DobotError, ValueError)) and not str(error).startswith(f"{name}: "):
        error.args = (f"{name}: {error}", *error.args[1:])

    return error


def failure(task: asyncio.Task[Any]) -> BaseException | None:
    """How a task that has ended failed, if it did."""
    return asyncio.CancelledError() if task.cancelled() else task.exception()


def cancel(tasks: set[asyncio.Task[Any]]) -> None:
    """Cancels all."""
    for task in tasks:
        task.cancel()


async def end(tasks: set[asyncio.Task[Any]]) -> None:
    """Cancels all, and waits for their end, however it is."""
    cancel(tasks)
    if tasks:
        await asyncio.wait(tasks)

    for task in tasks:
        failure(task)  # asyncio complains of one that nobody looks at
