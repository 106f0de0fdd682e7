"""The planned steps of an arm, with the zones that they lead through."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from dobot_async._core.queue.motion import Motion
from dobot_async.fleet.planner import Region, Stance

__all__ = ["PlannedStep", "PlannedSteps", "shifted"]

S = TypeVar("S", bound=Stance)


@dataclass(eq=False, slots=True)
class PlannedStep:
    """One command on its way.

    Attributes:
        motion: The command.
        zones: What it leads through.
        after: The zones in which it ends; None if that is not known, or if it leaves the arm where it is.
        region: Where the tool comes along if it moves the arm.
        shift: mm by which it puts the tool elsewhere.
        homing: What the planner has to be told of again when it is done: the arm knows its place then.
    """

    motion: Motion
    zones: frozenset[str] = frozenset()
    after: frozenset[str] | None = None
    region: Region | None = None
    shift: float = 0.0
    homing: object = None


@dataclass(frozen=True, slots=True)
class PlannedSteps(Generic[S]):
    """Several commands that are sent together, looked at before they are.

    Attributes:
        steps: Each of them.
        end: Where the arm stands after them, if that is known.
        moves: Whether one of them moves the arm, or changes its ways.
    """

    steps: Sequence[PlannedStep]
    end: S | None
    moves: bool

    @property
    def zones(self) -> frozenset[str]:
        """What they lead through."""
        return frozenset[str]().union(*(step.zones for step in self.steps))


def shifted(steps: Sequence[PlannedStep]) -> list[tuple[Region, float]]:
    """Returns where the arm may be stopped by an alarm on its way, and by how many mm its tool is elsewhere then.

    What is queued behind a motion that an alarm has ended is done where that has ended, unless it is a motion.
    """
    ways: list[tuple[Region, float]] = []
    for step in steps:
        ways = [(region, shift + step.shift) for region, shift in ways]
        if step.region:
            ways.append((step.region, 0.0))

    return ways
