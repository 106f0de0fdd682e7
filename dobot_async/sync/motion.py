"""A queued command, for programs without asyncio.

Written by tests/sync/write_sync.py: change what that reads, and run it again.
"""

from __future__ import annotations

from dobot_async.errors import DobotError
from dobot_async.sync.motion_base import MotionTwin
from dobot_async.sync.portal import PORTAL

__all__ = ["Motion"]


class Motion(MotionTwin):
    """One queued command; any number of threads may wait for it.

    `wait` returns when the arm has executed it, and raises ArmAlarm, MotionStopped, MotionUnknown or ConnectionLost
    when it has not. It belongs to its queue: interrupting who waits for it only ends the waiting.
    """

    @property
    def name(self) -> str:
        """Its name."""
        return self.asynchronous.name

    @property
    def moves(self) -> bool:
        """Whether it moves the arm."""
        return self.asynchronous.moves

    @property
    def index(self) -> int | None:
        """The arm's number for it, None until the arm has accepted it."""
        return self.asynchronous.index

    @property
    def ended(self) -> bool:
        """Whether it is known to have ended; asks nobody."""
        return self.asynchronous.ended

    def exception(self) -> DobotError | None:
        """Return how it failed, None if it was executed.

        Raises:
            asyncio.InvalidStateError: It has not ended yet.
        """
        return PORTAL.look(self.asynchronous.exception)

    def wait(self, timeout: float | None = None) -> None:
        """Wait until it has ended, for so many seconds at most.

        Raises:
            ReplyTimeout: It has not ended yet; it goes on.
            RuntimeError: It is in a batch whose block has not ended, so that it was not sent.
        """
        PORTAL.run(lambda: self.asynchronous.wait(timeout))
