"""An arm follows a target that moves: the part that is the same for all families.

    async with arm.following(rate=30, max_speed=100) as follow:
        follow.target = pose          # the newest wins

Each family brings a small `Strategy`: how its arm is sent to a place in place of where it goes now.
"""

from dobot_async.following.block import MAX_SPEED, MAX_TURN, RATE, STALE, follow_target, positive
from dobot_async.following.follow import Follow
from dobot_async.following.points import TargetPoint
from dobot_async.following.strategy import FollowStatus, Strategy

__all__ = [
    "MAX_SPEED",
    "MAX_TURN",
    "RATE",
    "STALE",
    "Follow",
    "FollowStatus",
    "Strategy",
    "TargetPoint",
    "follow_target",
    "positive",
]
