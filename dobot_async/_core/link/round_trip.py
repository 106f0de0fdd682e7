"""How long to wait for an answer: adapts to the link's measured round trip, as RFC 6298 does for TCP.

    first sample r:    srtt = r                        rttvar = r / 2
    later ones:        rttvar += (|srtt - r| - rttvar) / 4         srtt += (r - srtt) / 8
    timeout:           srtt + max(4 * rttvar, 10 ms), within floor and ceiling; a quarter longer after each that passes

A sample is always that of one request and its own reply: none is sent again before it is known to have been lost.
"""

from __future__ import annotations

__all__ = ["RoundTrip"]

INITIAL = 0.1
GRAIN = 0.01  # however even the round trips are, the next one may be a little longer
GROWTH = 1.25
MOST_GROWTH = 4.0  # a timeout of half a second where a fiftieth would do makes a lossy link a dead one


class RoundTrip:
    """The estimate of one link.

    Attributes:
        smoothed: Seconds that an answer takes on the average, None before the first one.
    """

    def __init__(self, floor: float = 0.02, ceiling: float = 0.5) -> None:
        if not 0 < floor <= ceiling:
            raise ValueError(f"expected 0 < floor <= ceiling, not {floor} and {ceiling}")

        self.smoothed: float | None = None
        self._floor = floor
        self._ceiling = ceiling
        self._variation = 0.0
        self._growth = 1.0

    @property
    def timeout(self) -> float:
        """Seconds to wait for the next answer."""
        base = INITIAL if self.smoothed is None else self.smoothed + max(4 * self._variation, GRAIN)
        return min(max(base, self._floor) * self._growth, self._ceiling)

    def unanswered(self) -> None:
        """Take note that a timeout has passed."""
        self._growth = min(self._growth * GROWTH, MOST_GROWTH)

    def sample(self, seconds: float) -> None:
        """Take the round trip of a request; a standstill of the line says no more than that it was long."""
        seconds = min(seconds, self._ceiling)
        self._growth = 1.0
        if self.smoothed is None:
            self.smoothed, self._variation = seconds, seconds / 2
            return

        self._variation += (abs(self.smoothed - seconds) - self._variation) / 4
        self.smoothed += (seconds - self.smoothed) / 8
