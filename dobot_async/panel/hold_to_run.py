"""Hold to run: an arm moves as long as beats arrive from a page, by this computer's clock.

    Ticks.number --tick--> page --beat, with the newest tick--> HoldToRun.beat        each moves the end on
                                                                 HoldToRun.over        "released", "no beat", ...

1. A beat counts if the tick in it was sent at most `PATIENCE` ago: a beat that the network delayed for longer does not
   prove that the operator still holds.
2. A hold ends when no valid beat has arrived for `PATIENCE`, or when it is ended; no later beat revives it.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from contextlib import AbstractAsyncContextManager
from typing import TypeVar

from dobot_async._core.util.tasks import cancel_and_join

__all__ = ["BEAT", "PATIENCE", "HoldToRun", "Ticks", "held"]

T = TypeVar("T")
BEAT = 0.1  # seconds between two ticks
PATIENCE = 0.3
KEPT = 16  # ticks


class Ticks:
    """The numbers by which beats are known to be new.

    Attributes:
        number: The newest.
    """

    def __init__(self) -> None:
        self.number: int = 0
        self._now = asyncio.get_running_loop().time
        self._sent: deque[tuple[int, float]] = deque(maxlen=KEPT)

    def next(self) -> int:
        """Return the number of a tick that is sent now."""
        self.number += 1
        self._sent.append((self.number, self._now()))
        return self.number

    def is_new(self, number: int) -> bool:
        """Return whether a tick was sent at most `PATIENCE` ago."""
        since = self._now() - PATIENCE
        return any(each == number and sent >= since for each, sent in self._sent)


class HoldToRun:
    """One press of a hand.

    Attributes:
        press: The page's number for it.
    """

    def __init__(self, ticks: Ticks, press: int) -> None:
        self.press = press
        self._ticks = ticks
        self._now = asyncio.get_running_loop().time
        self._until = self._now() + PATIENCE
        self._why = ""
        self._ended = asyncio.Event()

    def beat(self, tick: int) -> bool:
        """Take a beat; return whether it counts."""
        alive = not self._why and self._now() < self._until and self._ticks.is_new(tick)
        if alive:
            self._until = self._now() + PATIENCE

        return alive

    @property
    def is_over(self) -> bool:
        """Whether it is over."""
        return bool(self._why) or self._now() >= self._until

    def end(self, why: str) -> None:
        """End it; only the first reason counts."""
        self._why = self._why or why
        self._ended.set()

    async def over(self) -> str:
        """Return when it is over, and why."""
        while not self._why:
            left = self._until - self._now()
            if left <= 0:
                self.end("no beat")
                break

            try:
                async with asyncio.timeout(left):
                    await self._ended.wait()
            except TimeoutError:
                continue

        return self._why


async def held(
    hold: HoldToRun,
    block: Callable[[], AbstractAsyncContextManager[T]],
    begun: Callable[[T], None],
) -> str:
    """Keep a block of the driver entered while it is held; return why that is over.

    The block is left in good order, which stops the arm. If it is over before the arm moves, entering is cancelled.

    Args:
        hold: The hand.
        block: Makes the block: a jog, or a following.
        begun: Called with what the block yields, when it is entered.

    Raises:
        DobotError: As the block.
    """
    if hold.is_over:
        return await hold.over()

    entered, end = asyncio.Event(), asyncio.Event()

    async def move() -> None:
        async with block() as found:
            if hold_is_over.done():
                return

            entered.set()
            begun(found)
            await end.wait()

    hold_is_over = asyncio.create_task(hold.over(), name="dobot_async panel hold")
    moving = asyncio.create_task(move(), name="dobot_async panel held motion")
    try:
        await asyncio.wait({moving, hold_is_over}, return_when=asyncio.FIRST_COMPLETED)
        if hold_is_over.done() and entered.is_set():
            end.set()
            await asyncio.wait({moving})
        elif hold_is_over.done():
            await cancel_and_join(moving)

        if moving.done() and not moving.cancelled():
            moving.result()

        hold.end("ended")
        return await hold_is_over
    finally:
        for task in (moving, hold_is_over):
            if not task.done():
                await cancel_and_join(task)
