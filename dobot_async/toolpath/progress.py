"""How far a drawing is, and how long it will still take."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass

__all__ = ["Progress", "ProgressMeter"]

logger: logging.Logger = logging.getLogger("dobot_async.toolpath")
LEAST_KNOWN = 0.05  # of the time that was guessed, before how long it really takes is believed


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a drawing is.

    Attributes:
        strokes: How many are done, those before the one with which it began among them.
        of: How many there are.
        mm: How much was drawn, mm.
        of_mm: How much there is to draw.
        seconds_left: How long it will still take, by how long it has taken so far.
    """

    strokes: int
    of: int
    mm: float
    of_mm: float
    seconds_left: float


class ProgressMeter:
    """Compares the time that strokes take with the time that was guessed for them.

    Args:
        lengths: Of the strokes, mm.
        guesses: About how many seconds each takes.
        report: Called with a `Progress` when strokes were done; what it raises is logged.
    """

    def __init__(
        self, lengths: Sequence[float], guesses: Sequence[float], report: Callable[[Progress], None] | None
    ) -> None:
        self._lengths = lengths
        self._guesses = guesses
        self._report = report
        self._began = 0.0
        self._taken = self._guessed = 0.0  # seconds that what is done has taken, and was guessed to take

    def begin(self, now: float) -> None:
        """The arm begins."""
        self._began, self._taken, self._guessed = now, 0.0, 0.0

    def progress(self, done: int) -> Progress:
        """Return how far it is when so many strokes are done."""
        believed = self._guessed > LEAST_KNOWN * sum(self._guesses)
        slower = self._taken / self._guessed if believed else 1.0
        left = sum(self._guesses[done:]) * slower
        return Progress(done, len(self._lengths), sum(self._lengths[:done]), sum(self._lengths), left)

    def reached(self, before: int, done: int, now: float) -> None:
        """Note, and report, that more strokes are done."""
        if done == before:
            return

        self._taken = now - self._began
        self._guessed += sum(self._guesses[before:done])
        if self._report:
            try:
                self._report(self.progress(done))
            except Exception:
                logger.exception("progress= of a drawing failed")
