"""One timer for all who wait on a link: one for each would cost as much as the rest of a request."""

from __future__ import annotations

import asyncio
import math

__all__ = ["Deadlines", "release"]


class Deadlines:
    """Releases futures at their times, unless they are removed before."""

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._until: dict[asyncio.Future[None], float] = {}
        self._timer: asyncio.TimerHandle | None = None
        self._fires_at = math.inf

    def add(self, waiting: asyncio.Future[None], until: float) -> None:
        """Release a future at a time."""
        self._until[waiting] = until
        if until < self._fires_at:
            self.close()
            self._fires_at = until
            self._timer = self._loop.call_at(until, self._fire)

    def remove(self, waiting: asyncio.Future[None]) -> None:
        """A future no longer waits. The timer stays: it finds that it is early, and is set anew."""
        self._until.pop(waiting, None)

    def close(self) -> None:
        """End the timer."""
        if self._timer:
            self._timer.cancel()

    def _fire(self) -> None:
        now = max(self._loop.time(), self._fires_at)  # a loop calls a little early, by its clock's resolution
        self._fires_at = math.inf
        for waiting, until in list(self._until.items()):
            if until <= now:
                del self._until[waiting]
                release(waiting)

        if self._until:
            self._fires_at = min(self._until.values())
            self._timer = self._loop.call_at(self._fires_at, self._fire)


def release(waiting: asyncio.Future[None]) -> None:
    """Release a future that may have been released already."""
    if not waiting.done():
        waiting.set_result(None)
