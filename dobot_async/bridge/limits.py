"""How much a client may send: so many units a second, and a burst on top."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

__all__ = ["Allowance", "Limits"]


@dataclass(frozen=True, slots=True)
class Limits:
    """What one client may do; what is above it waits, or is cut off.

    Attributes:
        frames: Requests a second.
        data: Bytes a second.
        junk: Bytes without a request among them, after which the client is no client.
        clients: How many there may be at a time.
        silence: Seconds without a datagram after which a UDP client counts as gone.
    """

    frames: float = 2000.0
    data: float = 64_000.0
    junk: int = 16_384
    clients: int = 16
    silence: float = 10.0

    def __post_init__(self) -> None:
        for name in self.__slots__:
            if not getattr(self, name) > 0:
                raise ValueError(f"{name} must be above 0, not {getattr(self, name)!r}")


class Allowance:
    """A bucket of tokens: it fills with time and may be overdrawn once.

    Args:
        rate: Units a second.
        clock: Returns seconds.
        most: Units that may be spent at once; by default a quarter of a second's worth.
    """

    def __init__(self, rate: float, clock: Callable[[], float], most: float | None = None) -> None:
        self._rate = rate
        self._clock = clock
        self._most = max(rate / 4, 1.0) if most is None else most
        self._left = self._most
        self._at = clock()

    @property
    def wait(self) -> float:
        """Seconds until something may be spent again; 0 at once."""
        now = self._clock()
        self._left = min(self._most, self._left + (now - self._at) * self._rate)
        self._at = now
        return max(0.0, -self._left / self._rate)

    def spend(self, units: float) -> None:
        """Spends, whatever is left."""
        self._left -= units
