"""What is written by hand of a Motion."""

from __future__ import annotations

from dobot_async import Motion as AsyncMotion
from dobot_async.sync.portal import PORTAL
from dobot_async.sync.twin import Twin

__all__ = ["MotionTwin"]


class MotionTwin(Twin[AsyncMotion]):
    """A Motion."""

    __slots__ = ()

    @property
    def done(self) -> bool:
        """Whether it has ended, well or not. Whoever looks again and again has the arm asked for a while each time."""
        return self.asynchronous.ended or PORTAL.look(lambda: self.asynchronous.done)

    def __str__(self) -> str:
        return str(self.asynchronous)

    def __repr__(self) -> str:
        return repr(self.asynchronous)
