"""What a program without asyncio holds while an arm follows a target.

Written by tests/sync/write_sync.py: change what that reads, and run it again.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from dobot_async.following.follow import Follow as AsyncFollow
from dobot_async.following.points import TargetPoint
from dobot_async.sync.motion import Motion
from dobot_async.sync.portal import PORTAL
from dobot_async.sync.twin import Twin

__all__ = ["Follow"]


class Follow(Twin[AsyncFollow]):
    """The arm follows `target` for the length of the block of `arm.following()`."""

    @property
    def motion(self) -> Motion:
        """All of it as one Motion: done when the block has ended well, and failed as soon as the following has."""
        return Motion(self.asynchronous.motion)

    @property
    def sent(self) -> int:
        """How many setpoints were sent."""
        return self.asynchronous.sent

    @property
    def target(self) -> TargetPoint | None:
        """The newest target. Set it, again and again, to a pose, or to numbers: x, y, z (mm) and angles (degrees).

        Angles that are not given stay as they are. What is set counts for `stale` seconds, also if it is the same.

        Raises:
            ValueError: It is beyond the limits, out of reach, or outside of the workspace, or the straight way to it
                is; the one before stays.
            TypeError: It is neither a pose nor numbers.
            DobotError: The following has failed, or was stopped.
        """
        return self.asynchronous.target

    @target.setter
    def target(self, target: Any) -> None:
        PORTAL.look(lambda: setattr(self.asynchronous, "target", target))

    @property
    def joints(self) -> tuple[float, ...] | None:
        """The newest target, if it is in joints. Set it to one angle for each joint, degrees; see `target`."""
        return self.asynchronous.joints

    @joints.setter
    def joints(self, angles: Any) -> None:
        PORTAL.look(lambda: setattr(self.asynchronous, "joints", angles))

    @property
    def here(self) -> TargetPoint | None:
        """Where the arm was when it was last looked at, in coordinates."""
        return self.asynchronous.here

    def play(self, points: Iterable[tuple[float, Any]], *, joints: bool = False) -> None:
        """Follow a trajectory; return when the arm is at its end.

        The arm goes to the first point before the time begins to run. Between two points the target goes straight.

        Args:
            points: Pairs of seconds, growing, and a target as for `target`: all points are checked first.
            joints: The targets are joints, degrees.

        Raises:
            ValueError: A point is not allowed, or a way needs more than `max_speed`; the message has its number.
            DobotError: The following has failed, or was stopped.
        """
        PORTAL.run(lambda: self.asynchronous.play(points, joints=joints))

    def reach(self, target: Any, *, joints: bool = False) -> None:
        """Set a target, and return when the arm is there.

        Args:
            target: As for `target`.
            joints: It is in joints, degrees.

        Raises:
            ValueError: It is beyond the limits, or out of reach.
            DobotError: The following has failed, or was stopped.
        """
        PORTAL.run(lambda: self.asynchronous.reach(target, joints=joints))
