"""The room in a Magician's queue, and how many commands it has taken, as its left space and its index tell together.

taken = finished + lying in the queue        finished: the index of the last finished command, or of the last one
      = finished + capacity - left space               that a clear threw away
"""

from __future__ import annotations

from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.ledger import QueueLedger
from dobot_async.arms.magician.status import ArmStatus

__all__ = ["QueueSpace"]


class QueueSpace:
    """What is known of the arm's queue.

    Attributes:
        room: How many commands it can take for certain, counted down from what was read.
        left: The left space that was read last.
        empty: Whether nothing lies in it.
    """

    def __init__(self, status: ArmStatus) -> None:
        self.room: int = 0
        self.left: int = 0
        self.empty: bool = False
        self._status = status
        self._capacity: int | None = None
        self._cleared = -1
        self._since = 0  # the first index from which on the sum is right
        self._changes = 0

    async def read(self) -> int:
        """Read how many commands it can still take; that of an empty queue is its capacity. Manual 2.19.8."""
        empty, changes = self.empty, self._changes
        self.left = await self._status.ask(c.GET_QUEUED_CMD_LEFT_SPACE)
        if changes == self._changes:
            self.room = self.left
            if empty:
                self._capacity = self.left

        return self.left

    def posted(self) -> None:
        """A command goes out."""
        self._changes += 1
        self.room = max(0, self.room - 1)
        self.empty = False

    def was_cleared(self, last: int | None) -> None:
        """The queue was emptied; `last` is the index of the last command that it had taken."""
        self._changes += 1
        self.room = 0
        self.empty = True
        self._cleared = -1 if last is None else last

    def restarted(self) -> None:
        """The arm counts anew."""
        self._changes += 1
        self.room = 0
        self._cleared, self._since = -1, 0

    async def opened(self, ledger: QueueLedger, *, first: bool) -> None:
        """The ledger was opened, with a WAIT that was the `first` command of an empty queue, or after some others.

        An arm that is paused has finished nothing yet: what lies in its queue is what it took since it was cleared.
        """
        assert ledger.last is not None
        index = self._since = ledger.last
        if first:
            self._cleared = self._since = index - 1
            return

        more = await self.count(ledger)
        if more:
            ledger.last = index + more
        elif more is None and self._capacity is not None:
            self._cleared = self._since = index + await self.read() - self._capacity

    async def count(self, ledger: QueueLedger) -> int | None:
        """Return how many commands the arm has taken since the ledger's last one, None if it does not tell.

        The two readings race with the arm: a command that it finishes between them is counted twice. So the left space
        has to be the same before and after the index, with nothing sent meanwhile.
        """
        if self._capacity is None or ledger.last is None:
            return None

        last, state, left = ledger.last, self._state(ledger), await self.read()
        while (finished := await self._status.index(ledger.highest)) is not None:
            finished = max(finished, self._cleared)
            if finished < self._since or state != self._state(ledger):
                return None

            taken = finished + self._capacity - left - last
            if taken <= 0:
                return 0 if taken == 0 else None

            before, left = left, await self.read()
            if before == left and state == self._state(ledger):
                return taken

        return None

    def least(self, ledger: QueueLedger) -> int:
        """Return the least number of commands that the arm has taken since the ledger's last one: what lies there."""
        if self._capacity is None or ledger.last is None:
            return 0

        return self._cleared + self._capacity - self.left - ledger.last

    def _state(self, ledger: QueueLedger) -> tuple[int | None, int, int]:
        """What a count is made against."""
        return ledger.last, len(ledger.unacked), self._changes
