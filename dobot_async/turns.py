"""Who may be on the wire: a few at a time, one of each key, the rest in order."""

from __future__ import annotations

import asyncio
from bisect import insort
from collections.abc import Hashable
from dataclasses import dataclass, field

__all__ = ["Turns"]


@dataclass(order=True, slots=True)
class Turn:
    """One request's wish to be on the wire: lower ranks first, then earlier requests."""

    rank: int
    number: int
    key: Hashable = field(compare=False)
    granted: asyncio.Future[None] = field(compare=False)


class Turns:
    """Lets at most `limit` requests be unanswered at a time, and one of each key; the others wait in order."""

    def __init__(self, limit: int) -> None:
        self._free = limit
        self._busy: set[Hashable] = set()
        self._waiting: list[Turn] = []
        self._number = 0

    def take_now(self, key: Hashable) -> bool:
        """Takes a turn if it is this request's at once: nobody who waits could go instead."""
        if not self._may(key):
            return False

        self._grant(key)
        return True

    async def take(self, key: Hashable, rank: int) -> None:
        """Returns when it is this request's turn; a key of None excludes nobody."""
        if self.take_now(key):
            return

        self._number += 1
        turn = Turn(rank, self._number, key, asyncio.get_running_loop().create_future())
        insort(self._waiting, turn)
        try:
            await turn.granted
        except asyncio.CancelledError:
            if turn in self._waiting:
                self._waiting.remove(turn)
            else:
                self.give(key)

            raise

    def give(self, key: Hashable) -> None:
        """Gives the turn back, and lets those go on who can."""
        self._free += 1
        self._busy.discard(key)
        for turn in list(self._waiting):
            if self._may(turn.key) and not turn.granted.done():  # who was cancelled takes itself out
                self._waiting.remove(turn)
                self._grant(turn.key)
                turn.granted.set_result(None)

    def _may(self, key: Hashable) -> bool:
        return self._free > 0 and key not in self._busy

    def _grant(self, key: Hashable) -> None:
        self._free -= 1
        if key is not None:
            self._busy.add(key)
