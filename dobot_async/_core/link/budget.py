"""How many requests a second a link may send: a bucket of turns, which fills evenly.

Whatever goes out takes a turn. What stops an arm, or finds out what was lost, does not wait for one, and all else waits
the longer. So a second has never more than the budget and a tenth of it, beside what could not wait.
"""

from __future__ import annotations

import asyncio
import math
from typing import SupportsFloat

__all__ = ["LEAST", "Budget", "check_budget"]

LEAST = 5.0  # requests per second; with fewer an arm could not be watched, and hardly connected to
BURST = 0.1  # seconds: the turns of so long may be taken at once
TICK = 1e-6  # seconds that count as none
DEBT = 1.0  # seconds for which others wait, at the most, because of what could not wait


class Budget:
    """The turns of one link.

    Args:
        per_second: How many there are.
    """

    def __init__(self, per_second: float) -> None:
        self._each = 1 / per_second
        self._loop = asyncio.get_running_loop()
        self._spent_until = -math.inf  # by when all that was granted may have been sent
        self._granted = 0  # turns of which nothing was sent yet
        self._turn = asyncio.Lock()

    def sent(self) -> None:
        """Take note that something goes out: somebody's turn, or what could not wait for one."""
        if self._granted:
            self._granted -= 1
        else:
            self._spend()

    async def turn(self) -> None:
        """Return when something may go out: at once, or behind those who wait already."""
        async with self._turn:
            while True:
                wait = self._spent_until - self._loop.time() - BURST
                if wait < TICK:
                    break

                await asyncio.sleep(wait)

            self._granted += 1
            self._spend()

    def _spend(self) -> None:
        now = self._loop.time()
        self._spent_until = min(max(self._spent_until, now) + self._each, now + DEBT)


def check_budget(max_requests: SupportsFloat | None) -> float | None:
    """Return how many requests a second a link may send; None does not limit them.

    Raises:
        ValueError: They are too few, or not a number.
        TypeError: It is no number at all.
    """
    if max_requests is None:
        return None

    if not hasattr(max_requests, "__float__"):
        raise TypeError(f"max_requests must be a number of requests per second, or None, not {max_requests!r}")

    budget = float(max_requests)
    if not LEAST <= budget < math.inf:
        raise ValueError(f"max_requests must be {LEAST:g} per second or more, and finite, not {max_requests!r}")

    return budget
