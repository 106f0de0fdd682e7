"""What keeps an arm that follows a target inside of its workspace, and of its limits in a fleet.

target   --check-->     the straight way to it is inside, or ValueError to who sets it
setpoint --obstacle-->  the way from where the arm is to it is inside, or the setpoint stays where it is
place    --watch-->     the arm is inside, or the following ends, and with it the motion
"""

from __future__ import annotations

from dobot_async._core.util.bounds import ToolBounds
from dobot_async.errors import CommandRejected
from dobot_async.following.points import TargetPoint
from dobot_async.following.strategy import Strategy

__all__ = ["Boundary"]


class Boundary:
    """The boundary of one following.

    Args:
        bounds: Where the tool may be; None lets it be anywhere.
        strategy: How the arm is led.
    """

    def __init__(self, bounds: ToolBounds | None, strategy: Strategy) -> None:
        self._bounds = bounds
        self._strategy = strategy
        self._least: tuple[float, ...] = ()

    def check(self, start: TargetPoint | None, target: TargetPoint) -> None:
        """Raise ValueError, which names the target, if that is outside, or the way to it is.

        Args:
            start: Where the way begins; None looks at the target alone.
            target: Where it leads.

        Raises:
            ValueError: It is outside; nothing was sent.
            UnsupportedError: It is in joints, and the driver does not know where those lead.
        """
        if self._bounds is None:
            return

        begin = start if start and start.joints == target.joints else target
        self._bounds.check_way(self._strategy.way(begin, target))

    def obstacle(self, start: TargetPoint, setpoint: TargetPoint) -> str:
        """Return why the arm may not go from where it is to a setpoint; "" if it may."""
        try:
            self.check(start, setpoint)
        except ValueError as error:
            return str(error)

        return ""

    def begin(self, here: TargetPoint) -> None:
        """Note where the arm is; raise CommandRejected if it stands outside."""
        if self._bounds is None:
            return

        try:
            self.check(None, here)
        except ValueError as error:
            raise CommandRejected(
                f"the arm stands outside: {error}; bring it back with move_to or a jog before it follows anything"
            ) from None

        self._least = self._bounds.excess(self._place(here))

    def watch(self, here: TargetPoint) -> None:
        """Raise CommandRejected if the arm has come further outside than it tells its place exactly."""
        if self._bounds is None:
            return

        excess, slack = self._bounds.excess(self._place(here)), self._strategy.tolerance[0]
        if any(now > least + slack for least, now in zip(self._least, excess, strict=True)):
            raise CommandRejected(f"the arm has come outside, {max(excess):.1f} mm, at {here}")

    def _place(self, point: TargetPoint) -> tuple[float, ...]:
        """Where the tool is."""
        return self._strategy.way(point, point)[-1]
