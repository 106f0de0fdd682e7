"""Async tests on a virtual clock: waiting costs no time, and what happens when is the same in every run."""

from __future__ import annotations

import asyncio
import functools
from collections.abc import Callable, Coroutine
from typing import Any, ParamSpec

import async_solipsism

P = ParamSpec("P")

__all__ = ["run_virtual", "virtual"]


def virtual(test: Callable[P, Coroutine[Any, Any, None]]) -> Callable[P, None]:
    """Makes a plain test of an async one, on a loop whose time jumps to the next thing that happens."""

    @functools.wraps(test)
    def run(*args: P.args, **kwargs: P.kwargs) -> None:
        run_virtual(test(*args, **kwargs))

    return run


def run_virtual(work: Coroutine[Any, Any, None]) -> None:
    """Runs to the end; fails if tasks are left behind, or if everybody waits for something that never comes."""

    async def checked() -> None:
        await work
        left = asyncio.all_tasks() - {asyncio.current_task()}
        assert not left, f"left behind: {left}"

    with asyncio.Runner(loop_factory=async_solipsism.EventLoop) as runner:
        runner.run(checked())
