"""The verbs of a Magician, written once and used in three places.

    arm.move_to(...)          returns when the arm has done it
    arm.queue.move_to(...)    returns a Motion once the arm has accepted it
    batch.move_to(...)        returns a Motion that is sent with its batch

Lengths are mm, angles degrees, times seconds, ratios percent. Wrong arguments raise ValueError or TypeError at once.
`timeout` is the whole motion's on the arm, the wait for room in the queue; a batch has its own.
"""

from __future__ import annotations

from typing import TypeVar

from dobot_async.arms.magician.motion_verbs import MotionVerbs
from dobot_async.arms.magician.tool_verbs import ToolVerbs

__all__ = ["Verbs"]

T = TypeVar("T")


class Verbs(MotionVerbs[T], ToolVerbs[T]):
    """What one can tell the arm to do; T is what each verb returns in its place."""
