"""How long to wait for an answer: adapts to the link's measured round trip, as RFC 6298 does for TCP.

    first sample r:    srtt = r                        rttvar = r / 2
    later ones:        rttvar += (|srtt - r| - rttvar) / 4         srtt += (r - srtt) / 8
    timeout:           srtt + 4 * rttvar, within floor and ceiling; longer by half after each that passed unanswered

Only requests that were sent once give a sample: the answer to one that was sent again could belong to either.
"""

from __future__ import annotations

__all__ = ["RoundTrip"]

INITIAL = 0.5
GROWTH = 1.5


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

    def sample(self, seconds: float) -> None:
        """Takes the round trip of a request that was sent once."""
        if self.smoothed is None:
            self.smoothed, self._variation = seconds, seconds / 2
            return

        self._variation += (abs(self.smoothed - seconds) - self._variation) / 4
        self.smoothed += (seconds - self.smoothed) / 8

    def timeout(self, unanswered: int = 0) -> float:
        """Returns the seconds to wait, after so many requests in a row that nobody answered."""
        if self.smoothed is None:
            base = min(INITIAL, self._ceiling)
        else:
            base = min(max(self.smoothed + 4 * self._variation, self._floor), self._ceiling)

        return min(base * GROWTH**unanswered, self._ceiling)
