"""The gripper of a simulated myCobot, in time."""

from __future__ import annotations

from collections.abc import Callable

__all__ = ["SimulatedGripper"]

SPEED = 100.0  # percent of its way per s
ABSENT = 255


class SimulatedGripper:
    """A gripper at an arm, or the lack of one.

    Attributes:
        plugged_in: Whether it answers the arm at all.
        piece: How far open a piece between its fingers keeps it, percent; None if there is none.
    """

    def __init__(self, now: Callable[[], float], *, plugged_in: bool = True) -> None:
        self.plugged_in = plugged_in
        self.piece: float | None = None
        self._now = now
        self._begun = now()
        self._from = self._to = 0.0
        self._speed = SPEED

    @property
    def value(self) -> float:
        """How far it is open, percent."""
        way = self._speed * (self._now() - self._begun)
        if abs(self._to - self._from) <= way:
            return self._to

        return self._from + (way if self._to > self._from else -way)

    @property
    def told(self) -> int:
        """That, as the arm tells it."""
        return round(self.value) if self.plugged_in else ABSENT

    @property
    def moving(self) -> bool:
        """Whether it has not got there yet."""
        return self.value != self._to

    def go(self, value: float, speed: float) -> None:
        """Sets out to another value; on its way to a smaller one a piece stops it."""
        here = self.value
        if self.piece is not None and value < self.piece <= here:
            value = self.piece

        if self.plugged_in:
            self._from, self._to, self._begun = here, value, self._now()
            self._speed = SPEED * speed / 100

    def halt(self) -> None:
        """Stays where it is."""
        self.go(self.value, 100)
