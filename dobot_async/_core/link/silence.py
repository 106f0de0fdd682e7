"""What a link notes of timeouts in a row: how long the peer has been silent, and what that means for the next one."""

from __future__ import annotations

import logging
from collections.abc import Callable

__all__ = ["Silence"]

logger = logging.getLogger("dobot_async.link")
TOLD = 2.0  # seconds without an answer after which the log says so
LONGEST_PAUSE = 0.4  # seconds between two barriers, or two copies of a stop
MUTE = 3
"""Timeouts in a row after which the arm may be waiting for the rest of a frame with a spoilt length: it gets so many
bytes that mean nothing that any frame ends."""


class Silence:
    """See the module.

    Args:
        url: Of the peer, for the log.
        clock: Returns seconds.
    """

    def __init__(self, url: str, clock: Callable[[], float]) -> None:
        self._url = url
        self._clock = clock
        self._timeouts = 0
        self._since: float | None = None
        self._told = False

    @property
    def pause(self) -> float:
        """Seconds that a timeout is to last at least: a sixteenth of the silence so far, up to a limit."""
        return 0.0 if self._since is None else min((self._clock() - self._since) / 16, LONGEST_PAUSE)

    def timeout(self) -> None:
        """Note that no answer came in time."""
        self._timeouts += 1
        if self._since is None:
            self._since = self._clock()
        elif not self._told and self._clock() > self._since + TOLD:
            self._told = True
            logger.warning("%s does not answer", self._url)

    def heard(self) -> None:
        """Note that something came."""
        self._timeouts = 0
        self._since = None
        if self._told:
            self._told = False
            logger.warning("%s answers again", self._url)

    def is_mute(self) -> bool:
        """Return whether the peer may be waiting for the rest of a frame; True once every few timeouts."""
        if self._timeouts < MUTE:
            return False

        self._timeouts = 0
        return True
