"""Replies that come alone, long after their turn, from a peer that answers out of order.

No arm is known to do that, but what stands between it and the driver may. A request that was lost, as far as its order
tells, may then be answered yet, and that would pass for the reply to the next request of its key. So for `SUSPICION`
seconds after a loss a barrier is asked behind each request of that key: with one reply by the time of the barrier's
answer it is the right one (`Correlator`, held requests).

That costs a second request each time, so it is done only where losses are rare: on a line that loses many messages a
reply that does not come is lost. A loss whose reply comes after all was none, and for `PROVEN` seconds it shows that
losses tell nothing here.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Hashable

__all__ = ["Stragglers"]

SUSPICION = 3.0
PROVEN = 60.0
RARE = 3  # losses ...
AMONG = 80  # ... among so many messages are no longer rare


class Stragglers:
    """Tells for which keys a reply may yet come alone."""

    def __init__(self) -> None:
        self._sent = 0
        self._losses: deque[int] = deque(maxlen=RARE)
        self._until: dict[Hashable, float] = {}
        self._proven_until = -math.inf

    def sent(self) -> None:
        """Note that something was sent."""
        self._sent += 1

    def lost(self, key: Hashable, now: float, *, counts: bool = True) -> None:
        """Note that a request of a key was lost, as far as its order tells.

        Args:
            key: Of the request.
            now: The time.
            counts: False if there were several replies: one of them was that of a request that was lost before.
        """
        if counts:
            self._losses.append(self._sent)
        else:
            self.came(key, now)

        self._until[key] = now + SUSPICION

    def came(self, key: Hashable, now: float) -> None:
        """Note that a reply of a key came that nobody waits for: what was lost was not its request."""
        if now < self._until.get(key, -math.inf):
            self._proven_until = now + PROVEN
            if self._losses:
                self._losses.pop()

    def suspected(self, key: Hashable, now: float) -> bool:
        """Return whether the reply to a request of a key has to be told from one that is late alone."""
        if now >= self._until.get(key, -math.inf):
            return False

        rare = len(self._losses) < RARE or self._sent - self._losses[0] > AMONG
        return rare or now < self._proven_until
