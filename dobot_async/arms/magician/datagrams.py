"""What only a link for datagrams needs: there a command may be taken twice, and that is noticed by counting.

D is the link's reorder window: within D two messages may overtake each other, and a second copy may arrive.

- A command goes out no sooner than 2 D after the last acknowledgement, when a second copy of the command before it, and
  of its acknowledgement, have arrived, and after the count was found right: a copy must not pass for what comes next.
- Commands that steer the queue are kept D apart from each other and from what is queued: no copy of one undoes another.
- An index counts as finished only if the count is right: behind a doubled command all indices are shifted.
"""

from __future__ import annotations

import asyncio
import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dobot_async._core.link.link import Link
    from dobot_async.arms.magician.frame import Frame
    from dobot_async.arms.magician.submission import Submission

__all__ = ["DatagramGuard", "Surplus"]


class Surplus:
    """An event: the arm took more commands than were sent, but only such as may be done twice.

    Attributes:
        count: How many more.
    """

    def __init__(self, count: int) -> None:
        self.count = count

    def __repr__(self) -> str:
        return f"<Surplus of {self.count} queued commands: doubled by the network, or queued by somebody else>"


class DatagramGuard:
    """Keeps the times, and counts.

    Args:
        submission: Whose commands are guarded.
        link: Tells D.
    """

    def __init__(self, submission: Submission, link: Link[Frame]) -> None:
        self._submission = submission
        self._link = link
        self._now = asyncio.get_running_loop().time
        self._controlled_at = self._posted_at = self._acknowledged_at = -math.inf
        self._counted = False

    async def before_control(self) -> None:
        """Return when a command may go out that steers the queue."""
        await self._until(max(self._controlled_at, self._posted_at) + self._link.reorder_window)

    def controlled(self) -> None:
        """It was acknowledged."""
        self._controlled_at = self._now()

    async def before_post(self) -> None:
        """Return when anything may be queued."""
        await self._until(self._controlled_at + self._link.reorder_window)
        self._posted_at, self._counted = self._now(), False

    async def before_command(self) -> None:
        """Return when the next command may be queued: nothing was taken twice that would pass for it."""
        if not self._counted:
            await self._until(self._acknowledged_at + 2 * self._link.reorder_window)
            await self.confirm()

    async def before_count(self) -> None:
        """Return when nothing is on its way any more that would spoil a count."""
        await self._until(self._posted_at + self._link.reorder_window)

    def entered(self) -> None:
        """What became of the last command is known."""
        self._acknowledged_at = self._now()

    async def confirm(self) -> bool:
        """Count, and enter a surplus; return False if the arm does not tell."""
        submission, ledger = self._submission, self._submission.ledger
        began = self._now()
        surplus = await submission.space.count(ledger)
        if surplus is None or ledger.last is None:
            return False

        if not ledger.unacked:
            self._counted = began >= self._acknowledged_at + 2 * self._link.reorder_window
            ledger.last += surplus
            submission.surplus(surplus)

        return True

    async def _until(self, when: float) -> None:
        await asyncio.sleep(max(0.0, when - self._now()))
