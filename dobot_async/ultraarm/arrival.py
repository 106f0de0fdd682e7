"""Whether an ultraArm stands where it was told to go: the arm itself says nothing of a target that it cannot reach."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any

from dobot_async.ultraarm import commands as c
from dobot_async.ultraarm.answers import Status
from dobot_async.ultraarm.frame import errors
from dobot_async.ultraarm.ledger import QueueLedger, Target
from dobot_async.ultraarm.status import StatusPoller

__all__ = ["ArrivalChecker", "Missed"]

SETTLED = 0.2  # seconds of rest elsewhere than it was told to, after which an arm has missed its target
GRAIN = 0.02  # mm and degrees; the arm tells hundredths


@dataclass(frozen=True, slots=True)
class Missed:
    """The arm came to rest elsewhere than it was told to, or said that something is wrong."""

    text: str

    def __str__(self) -> str:
        return self.text


class ArrivalChecker:
    """Compares where the arm is with where it was to go.

    Args:
        read: Reads a row, and raises ReplyTimeout if the arm is silent.
        ledger: What the arm was given.
        status: Polls the arm.
        tolerance: By how many mm or degrees it may miss a target; None does not look.

    Attributes:
        fault: What went wrong, None if nothing did.
    """

    def __init__(
        self, read: Callable[..., Awaitable[Any]], ledger: QueueLedger, status: StatusPoller, tolerance: float | None
    ) -> None:
        self.fault: Missed | None = None
        self._read = read
        self._ledger = ledger
        self._status = status
        self._tolerance = tolerance

    def can_tell(self, target: Target | None) -> bool:
        """Return whether it can be seen that the arm has gone to a target."""
        return target is not None and self._tolerance is not None

    async def is_at(self, target: Target | None) -> bool:
        """Return whether the arm stands at a target."""
        if target is None or self._tolerance is None:
            return False

        return target.distance(await self._position(target)) <= self._tolerance

    async def came_to(self, target: Target) -> bool:
        """Return whether the arm, at rest, has come to a target, and not only stands near it, where it stood before.

        If in doubt it has not: to be told once more where it stands moves an arm by no more than the tolerance.
        """
        here, before = await self._position(target), self._ledger.target
        miss = target.distance(here)
        nearer = before is not None and before.joints == target.joints and miss < before.distance(here)
        return miss <= GRAIN or (nearer and self._tolerance is not None and miss <= self._tolerance)

    def note(self, status: Status) -> None:
        """Note an error that the arm tells of beside its status: it is of something that it was given."""
        if status.text and errors(status.text.encode()) and self._ledger.open:
            self.fault = Missed(status.text)

    def misses(self, status: Status) -> bool:
        """Return whether an arm at rest misses the last target, and may yet settle; note a fault if it stays so."""
        target = self._ledger.target
        if target is None or self._tolerance is None or self.fault or self._ledger.verified:
            return False

        here = target.position(status)
        if here and target.distance(here) <= self._tolerance:
            return False

        if self._status.now() < self._status.rest_since + SETTLED:
            return True

        where = here or "somewhere that it does not tell"
        self.fault = Missed(f"it came to rest at {where} instead of {target}: out of reach, not homed, or obstructed")
        return False

    async def _position(self, target: Target) -> c.UltraArmAngles | c.UltraArmCoords:
        """Return where the arm is, in what a target is in."""
        here: c.UltraArmAngles | c.UltraArmCoords = await self._read(c.GET_ANGLES if target.joints else c.GET_COORDS)
        return here
