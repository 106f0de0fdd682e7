"""How many requests may be out at a time: a few, one of each key; the rest wait, the more urgent ones first."""

from __future__ import annotations

import asyncio
import enum
from bisect import insort
from collections.abc import Hashable
from dataclasses import dataclass, field

__all__ = ["Admission", "Priority"]


class Priority(enum.IntEnum):
    """Who goes first."""

    URGENT = 0
    """Stops: beside all others, one of each key."""
    IMMEDIATE = 1
    QUEUED = 2
    """Commands for the arm's queue, where only one request may be out."""


@dataclass(order=True, slots=True)
class Waiting:
    """A request that is not admitted yet: lower priorities first, then earlier requests."""

    priority: Priority
    number: int
    key: Hashable = field(compare=False)
    admitted: asyncio.Future[None] = field(compare=False)


class Admission:
    """Lets at most `limit` requests be out, and one of each key; a key of None excludes nobody."""

    def __init__(self, limit: int) -> None:
        self._free = limit
        self._busy: set[tuple[bool, Hashable]] = set()
        self._waiting: list[Waiting] = []
        self._number = 0

    def try_acquire(self, key: Hashable, priority: Priority) -> bool:
        """Admit a request if that can be done at once."""
        urgent = priority is Priority.URGENT
        if (urgent, key) in self._busy or not (urgent or self._free > 0):
            return False

        self._free -= not urgent
        if key is not None:
            self._busy.add((urgent, key))

        return True

    async def acquire(self, key: Hashable, priority: Priority) -> None:
        """Return when a request is admitted."""
        if self.try_acquire(key, priority):
            return

        self._number += 1
        waiting = Waiting(priority, self._number, key, asyncio.get_running_loop().create_future())
        insort(self._waiting, waiting)
        try:
            await waiting.admitted
        except asyncio.CancelledError:
            if waiting in self._waiting:
                self._waiting.remove(waiting)
            else:
                self.release(key, priority)

            raise

    def release(self, key: Hashable, priority: Priority) -> None:
        """A request is no longer out: admit those who can go now."""
        urgent = priority is Priority.URGENT
        self._free += not urgent
        self._busy.discard((urgent, key))
        for waiting in list(self._waiting):
            if not waiting.admitted.done() and self.try_acquire(waiting.key, waiting.priority):
                self._waiting.remove(waiting)
                waiting.admitted.set_result(None)
