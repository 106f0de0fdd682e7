"""When a motion is over, found by watching. Numbers in, verdicts out; waits for nothing and asks nothing.

    look(now, here, moving) --> GOING      it moves, or may still begin to
                                ARRIVED    it stands still where it was to go
                                SHORT      it moved, and stands still somewhere else
                                IDLE       it never moved, and it should have begun by now

The arm's moving flag and its position are both believed a little: the flag may be stuck, and a frame without a checksum
may be spoilt. So they have to agree: the flag is off, and the position is that of the look before. An arm that may be
creeping has to do so several times in a row.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.mycobot.models import SENTINEL

__all__ = ["STILL", "Goal", "StandstillDetector", "Verdict", "cannot_read_servos", "turned"]

LOOKS = 3  # in a row, all of them still, of an arm that was not seen to move
MOVED, FAST = 2, 1  # the same for one that has moved, and for one that was so fast that it cannot be creeping
RUSH = 100.0  # speed of such an arm, in what counts as still, a second
STILL = 0.2  # degrees or mm within which an arm stands still
START = 1.5  # seconds within which a motion begins
REST = 1.0  # seconds of standing still elsewhere, after which it counts as over
STUCK = 2.0  # seconds of standing still after which a flag that says "moving" is not believed


class Verdict(enum.Enum):
    """What a look tells."""

    GOING = "going"
    ARRIVED = "arrived"
    SHORT = "short"
    IDLE = "idle"


@dataclass(frozen=True, slots=True)
class Goal:
    """Where a motion leads.

    Attributes:
        read: The row that tells where the arm is.
        expected: What is to be reached, by the places of the numbers that it tells.
        tolerances: How near, for each place; the last one for all that follow.
        still: How far the numbers may go and the arm still counts as standing.
        rotation: Whether places 3 to 5 are a rotation, of which several triples of angles may be the same.
        round: Places of angles that are the same after a whole turn.
        of: The parameters of `read`.
    """

    read: Command[Any, Any]
    expected: Mapping[int, float]
    tolerances: Sequence[float]
    still: float = STILL
    rotation: bool = False
    round: frozenset[int] = frozenset()
    of: Any = None

    def missed(self, here: Sequence[float]) -> float:
        """Return by how much the goal is missed, in the unit of the worst place; 0 within the tolerances."""
        return max((gap for place, gap in self.gaps(here).items() if gap > self.tolerance(place)), default=0.0)

    def distance(self, here: Sequence[float]) -> float:
        """Return how far away the goal is, in the unit of the worst place, tolerances left aside."""
        return max(self.gaps(here).values(), default=0.0)

    def gaps(self, here: Sequence[float]) -> dict[int, float]:
        """Return how far away it is in each place."""
        gaps = {place: abs(here[place] - wanted) for place, wanted in self.expected.items()}
        if self.rotation:
            gaps = {place: gap for place, gap in gaps.items() if place < 3}
            gaps[3] = turned([here[place] for place in (3, 4, 5)], [self.expected[place] for place in (3, 4, 5)])

        for place in self.round & gaps.keys():
            gaps[place] = abs(math.remainder(gaps[place], 360))

        return gaps

    def tolerance(self, place: int) -> float:
        """How near the number at a place has to be."""
        return self.tolerances[min(place, len(self.tolerances) - 1)]


@dataclass(slots=True)
class StandstillDetector:
    """One motion, from the moment it was sent.

    Attributes:
        goal: Where it leads.
        since: When it was sent, or when the arm was last seen to be paused.
        moved: Whether the arm has been seen to move.
        ends_at: When it will be there, if it goes on as it does.
        fastest: The greatest speed at which it came nearer.
        settled: Whether a fast arm was twice in a row at one place, where it was to go: its flag alone is enough then.
    """

    goal: Goal
    since: float
    moved: bool = False
    anchor: Sequence[float] = field(default_factory=tuple)
    still_since: float = 0.0
    looks: int = 0
    ends_at: float = math.inf
    fastest: float = 0.0
    distance: tuple[float, float] | None = None
    settled: bool = False

    def look(self, now: float, here: Sequence[float], *, moving: bool) -> Verdict:
        """Take what the arm told at a time; return what is to be made of it."""
        if not self.anchor:
            self.stand(now, here)
        elif max(abs(a - b) for a, b in zip(here, self.anchor, strict=True)) > self.goal.still:
            self.moved = True
            self.stand(now, here)
        elif moving:
            self.moved = True
            self.looks = 0
        else:
            self.looks += 1

        self.expect(now, here)
        resting = now - self.still_since
        self.settled = resting > 0 and self.needed == FAST and not self.goal.missed(here)
        if moving and resting < STUCK:
            return Verdict.GOING

        if not self.goal.missed(here):
            return Verdict.ARRIVED if moving or self.looks >= self.needed else Verdict.GOING

        if self.moved:
            return Verdict.SHORT if resting >= REST else Verdict.GOING

        return Verdict.IDLE if now - self.since >= START else Verdict.GOING

    @property
    def needed(self) -> int:
        """How many still looks in a row are enough."""
        if self.fastest > RUSH * self.goal.still:
            return FAST

        return MOVED if self.moved else LOOKS

    def expect(self, now: float, here: Sequence[float]) -> None:
        """Note when the arm will be there: now, if it is and has moved, else as its speed tells."""
        distance = self.goal.distance(here)
        if self.moved and not self.goal.missed(here):
            self.ends_at = now
        elif self.distance and now > self.distance[0]:
            speed = (self.distance[1] - distance) / (now - self.distance[0])
            self.fastest = max(self.fastest, speed)
            self.ends_at = now + distance / speed if speed > 0 else math.inf

        self.distance = now, distance

    def stand(self, now: float, here: Sequence[float]) -> None:
        """Take where the arm is for where it may be standing."""
        self.anchor, self.still_since, self.looks = tuple(here), now, 0

    def hold(self, now: float) -> None:
        """The arm is paused: nothing that it does not do now says anything."""
        self.since = now
        self.anchor = ()
        self.settled = False
        self.distance, self.ends_at = None, math.inf


def cannot_read_servos(angles: Sequence[float]) -> bool:
    """Whether these are the angles of an Atom that cannot read its servos."""
    return all(math.isclose(abs(angle), SENTINEL) for angle in angles)


def turned(one: Sequence[float], other: Sequence[float]) -> float:
    """Return the angle, in degrees, between two rotations, each given as degrees about x, then y, then z."""
    a, b = matrix(one), matrix(other)
    trace = sum(a[row][column] * b[row][column] for row in range(3) for column in range(3))
    return math.degrees(math.acos(max(-1.0, min(1.0, (trace - 1) / 2))))


def matrix(angles: Sequence[float]) -> list[list[float]]:
    """The rotation about x, then y, then z of the fixed frame."""
    (sx, cx), (sy, cy), (sz, cz) = ((math.sin(a), math.cos(a)) for a in map(math.radians, angles))
    return [
        [cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
        [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx],
        [-sy, cy * sx, cy * cx],
    ]
