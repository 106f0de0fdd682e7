"""Nothing goes on past a stop: whatever leads to a motion in several steps is bound to the epoch in which it began.

    epoch = queue.epoch                      taken before the first step
    await ...
    await queue.put_all(motions, epoch=epoch)   MotionStopped, and nothing is sent, if a stop came in between

A stop ends the epoch at once, and the next one begins. An epoch is checked last of all: nothing is awaited between the
check and the motion. It says why it ended, and does not change any more.
"""

from __future__ import annotations

from dobot_async.errors import DobotError, another

__all__ = ["Epoch"]


class Epoch:
    """The time between two stops."""

    __slots__ = ("_reason",)

    def __init__(self) -> None:
        self._reason: DobotError | None = None

    def check(self) -> None:
        """Raise why it has ended, if it has."""
        if self._reason:
            raise another(self._reason)

    def end(self, reason: DobotError) -> Epoch:
        """End it; return the next one."""
        self._reason = self._reason or reason
        return Epoch()
