"""Concurrent work, one coroutine for each arm.

All end before this returns. Of several failures the one that caused the others is raised.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Collection, Coroutine, Iterable, Mapping
from typing import Any, TypeVar

from dobot_async._core.util.tasks import LEAVING, join
from dobot_async.errors import DobotError, MotionStopped
from dobot_async.fleet.errors import BarrierBroken

__all__ = ["ended", "on_the_way_out", "run_all", "run_concurrently", "with_arm_name"]

T = TypeVar("T")
CONSEQUENCES = (MotionStopped, BarrierBroken, asyncio.CancelledError)


async def run_concurrently(
    work: Mapping[str, Coroutine[Any, Any, T]],
    *,
    ends: Callable[[str, BaseException], bool] = lambda _name, _error: True,
    causes: Callable[[BaseException], Collection[str]] = lambda _error: (),
) -> dict[str, T]:
    """Does everything at the same time, and returns what each has returned.

    Args:
        work: By the arm's name.
        ends: Whether a failure cancels the others.
        causes: Whose own failures a failure is a consequence of: they get a moment to hear of them.

    Raises:
        BaseException: The first failure, when all have ended; what went wrong while the others ended is a note on it.
    """
    tasks = {asyncio.create_task(each, name=f"dobot_async {name}"): name for name, each in work.items()}
    waiting, failures = set(tasks), dict[str, BaseException]()
    patience = None
    try:
        while waiting:
            done, waiting = await asyncio.wait(waiting, timeout=patience, return_when=asyncio.FIRST_COMPLETED)
            if not done:
                patience = None
                cancel(waiting)

            for task, name in tasks.items():
                error = failure(task) if task in done else None
                if error:
                    failures[name] = error
                    if ends(name, error):
                        spared = {each for each in waiting if tasks[each] in causes(error)}
                        cancel(waiting - spared)
                        patience = LEAVING if spared else None
    except BaseException as error:
        await on_the_way_out(error, ended({task: tasks[task] for task in waiting}))
        raise

    if failures:
        first = min(failures.values(), key=lambda error: isinstance(error, CONSEQUENCES))
        for note in notes(failures, but=first):
            first.add_note(note)

        raise first

    return {name: task.result() for task, name in tasks.items()}


async def run_all(work: Mapping[str, Coroutine[Any, Any, Any]]) -> None:
    """Does everything at the same time, to its end, whatever fails; then raises the first failure, with the others."""
    results = await asyncio.gather(*work.values(), return_exceptions=True)
    errors = [
        with_arm_name(name, error)
        for name, error in zip(work, results, strict=True)
        if isinstance(error, BaseException)
    ]
    if errors:
        for other in errors[1:]:
            errors[0].add_note(f"and {other}")

        raise errors[0]


def with_arm_name(name: str, error: BaseException) -> BaseException:
    """Returns an error of an arm; its message gets the arm's name if it is one of ours."""
    if isinstance(error, (DobotError, ValueError)) and not str(error).startswith(f"{name}: "):
        error.args = (f"{name}: {error}", *error.args[1:])

    return error


def failure(task: asyncio.Task[Any]) -> BaseException | None:
    """How a task that has ended failed, if it did; a cancellation has its notes when it is asked for first."""
    try:
        return task.exception()
    except asyncio.CancelledError as error:
        return error


def cancel(tasks: Collection[asyncio.Task[Any]]) -> None:
    """Cancels all."""
    for task in tasks:
        task.cancel()


async def ended(tasks: Mapping[asyncio.Task[Any], str]) -> list[str]:
    """Cancels all, waits for their end, and returns what went wrong meanwhile, by the names of their arms."""
    cancel(tasks)
    if tasks:
        await asyncio.wait(tasks)

    return notes({name: error for task, name in tasks.items() if (error := failure(task))})


def notes(failures: Mapping[str, BaseException], *, but: BaseException | None = None) -> list[str]:
    """What went wrong while work was cancelled, by the names of the arms."""
    cancelled = {
        name: error
        for name, error in failures.items()
        if isinstance(error, asyncio.CancelledError) and error is not but
    }
    return [
        note if note.startswith(f"{name}: ") else f"{name}: {note}"
        for name, error in cancelled.items()
        for note in getattr(error, "__notes__", ())
    ]


async def on_the_way_out(error: BaseException, work: Coroutine[Any, Any, Iterable[str]]) -> None:
    """Runs work to its end before an error goes on; what it returns is noted on that.

    Raises:
        CancelledError: The caller was cancelled meanwhile, and the error was none.
    """
    task = asyncio.create_task(work)
    cancelled = await join(task)
    for note in task.result():
        error.add_note(note)

    if cancelled and not isinstance(error, asyncio.CancelledError):
        raise cancelled
