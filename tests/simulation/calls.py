"""Calls of a user that are left in peace, cancelled, or given a time; and what a user may expect of how they end.

A cancelled call ends with CancelledError and one whose `asyncio.timeout` has passed with TimeoutError, each within
`PROMPT` seconds, however dead the line is.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from random import Random
from typing import Any, Literal

from dobot_async import DobotError

__all__ = ["PROMPT", "Call", "How", "Mine", "Violation", "draw_how", "made"]

How = Literal["plain", "cancel", "limit"]
PROMPT = 2.0
TINY = 1e-3
MOMENTS = (0.0, 0.0, 0.0005, 0.001, 0.003, 0.01, 0.03, 0.1, 0.5, 2.0)


class Violation(AssertionError):
    """Something was not as it must be."""


class Mine(Exception):
    """An error of the user's own."""


@dataclass
class Call:
    """One call.

    Attributes:
        name: What was called.
        timeout: What the call itself was given; None if nothing.
        begun: When it began; None if it was cancelled before it did.
        hurried: When it was cancelled, or its `asyncio.timeout` passed.
        ended: When it ended.
        error: With what, if it failed.
        value: What it returned.
    """

    name: str
    timeout: float | None = None
    begun: float | None = None
    hurried: float | None = None
    ended: float | None = None
    error: BaseException | None = None
    value: Any = None

    @property
    def good(self) -> bool:
        """Whether it returned."""
        return self.ended is not None and self.error is None

    def __str__(self) -> str:
        def at(time: float | None) -> str:
            return "never" if time is None else f"{time:.4f}"

        hurried = "" if self.hurried is None else f", cancelled {at(self.hurried)}"
        return f"{self.name} (begun {at(self.begun)}{hurried}, ended {at(self.ended)}: {self.error or self.value!r})"


def draw_how(random: Random) -> tuple[How, float]:
    """How a call is to end, and after how many seconds it is cancelled."""
    how: How = random.choices(["plain", "cancel", "limit"], [6, 2, 2])[0]  # type: ignore[assignment]
    return how, random.choice(MOMENTS)


async def made(
    call: Call, work: Callable[[], Awaitable[Any]], how: How, seconds: float, hurry: Callable[[], None] = lambda: None
) -> None:
    """Makes a call to its end; raises Violation unless it ends as it must.

    Args:
        call: Where it is noted.
        work: What is called.
        how: "plain" lets it be, "cancel" cancels it, "limit" surrounds it with `asyncio.timeout`.
        seconds: When.
        hurry: Called when it is cancelled.
    """
    loop = asyncio.get_running_loop()

    async def run() -> None:
        call.begun = loop.time()
        limit = asyncio.timeout(seconds if how == "limit" else None)
        try:
            async with limit:
                call.value = await work()
        except (DobotError, Mine, TimeoutError, asyncio.CancelledError) as error:
            call.error = error
        finally:
            call.ended = loop.time()
            if limit.expired():
                call.hurried = limit.when()
                hurry()

    def cancel() -> None:
        if not task.done() and call.ended is None:
            call.hurried = loop.time()
            hurry()
            task.cancel()

    task = loop.create_task(run())
    if how == "cancel":
        timer = loop.call_later(seconds, cancel)

    try:
        await asyncio.wait([task])
    finally:
        if how == "cancel":
            timer.cancel()

        if not task.done():
            task.cancel()
            await asyncio.wait([task])

    if task.cancelled() and call.begun is None:
        return  # before it had begun

    task.result()
    judge_end(call, how)


def judge_end(call: Call, how: How) -> None:
    """Raises Violation unless a call that was hurried ended in time, and as Python's calls do."""
    if call.hurried is None or call.ended is None:
        if isinstance(call.error, asyncio.CancelledError) or type(call.error) is TimeoutError:
            raise Violation(f"cancelled by nobody: {call}")

        return

    if call.ended - call.hurried > PROMPT + TINY:
        raise Violation(f"went on for {call.ended - call.hurried:.2f} s after it was cancelled: {call}")

    right = isinstance(call.error, asyncio.CancelledError) if how == "cancel" else type(call.error) is TimeoutError
    if not right:
        told = type(call.error).__name__ if call.error else "a result"
        raise Violation(f"ended with {told} although it was cancelled ({how}): {call}")
