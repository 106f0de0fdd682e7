"""What a family brings so that its arm follows a target."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from dobot_async.following.points import TargetPoint

__all__ = ["FollowLimits", "FollowStatus", "Strategy"]


@dataclass(frozen=True, slots=True)
class FollowLimits:
    """How a target is followed.

    Attributes:
        rate: Setpoints per second at the most.
        mm: Speed of the setpoint, mm/s.
        degrees: The same of angles and joints, degrees/s.
        stale: Seconds after which a target that was not renewed is not followed any more.
    """

    rate: float
    mm: float
    degrees: float
    stale: float


@dataclass(frozen=True, slots=True)
class FollowStatus:
    """What an arm told at one time.

    Attributes:
        here: Where it is.
        rests: Whether it says that it stands with nothing more to do; None where it does not say.
    """

    here: TargetPoint
    rests: bool | None = None


class Strategy(Protocol):
    """How one arm is led. Each call may be cancelled at any moment."""

    @property
    def axes(self) -> Sequence[str]:
        """The names of its coordinates, x, y and z first."""
        ...

    @property
    def joints(self) -> int:
        """How many joints it has."""
        ...

    @property
    def turns(self) -> bool:
        """Whether its angles are the same after a whole turn."""
        ...

    @property
    def replaces(self) -> bool:
        """Whether `go` takes the place of the motion that goes on; else it is called at an arm that rests."""
        ...

    @property
    def settle(self) -> float:
        """Seconds for which a motion that nothing ends may go on behind the block; 0 where a stop ends it."""
        ...

    @property
    def tolerance(self) -> tuple[float, float]:
        """How near counts as there, mm and degrees."""
        ...

    @property
    def check_every(self) -> float:
        """Seconds between two calls of `check`."""
        ...

    def allow(self, point: TargetPoint) -> None:
        """Raise ValueError for a place that is beyond the limits, or out of reach."""

    def way(self, start: TargetPoint, end: TargetPoint) -> Sequence[tuple[float, ...]]:
        """Return places (x, y, z, mm) on the way that the arm goes from one point to another, its ends among them.

        Raises:
            UnsupportedError: They are in joints, and the driver does not know where those lead.
        """
        ...

    async def begin(self) -> None:
        """Make the arm ready to be led; raise CommandRejected if it cannot be now."""

    async def look(self, *, joints: bool) -> FollowStatus:
        """Return where the arm is, as coordinates or as joints; raise ReplyTimeout if it is silent."""
        ...

    def within(self, look: FollowStatus, point: TargetPoint) -> TargetPoint:
        """Return how far towards a place the arm may be sent from where it is."""
        ...

    async def go(self, point: TargetPoint) -> bool:
        """Send the arm to a place, once; return False if that is known to have been lost.

        Raises:
            ReplyTimeout: The arm is silent.
        """
        ...

    async def check(self) -> None:
        """Raise ArmAlarm if something keeps the arm from moving."""

    async def end(self) -> None:
        """Put back what `begin` has changed, behind the stop."""
