"""A trajectory: places with times, as planners and recorders have them. Knows no arm and no clock."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterable
from itertools import pairwise
from typing import Any

from dobot_async._core.util.arguments import check_duration
from dobot_async.following.points import GRAIN, TargetPoint, part_of_way, way_along

__all__ = ["Trajectory"]

SLACK = 1.001  # of a speed, for what numbers lose


class Trajectory:
    """Places with times.

    Args:
        points: Pairs of seconds and a target, the times growing.
        read: Returns the checked place of a target.
        check: Raises ValueError for a straight way from one place to another that is not allowed.
        mm: Speed of the tool, mm/s, that may not be passed.
        degrees: The same of angles and joints, degrees/s.
        turns: Whether angles of a pose go the short way round.

    Attributes:
        first: Where it begins.
        last: Where it ends.
        seconds: How long it takes.

    Raises:
        ValueError: There is none, the times do not grow, a place is not allowed, or a way is too fast. The message
            has the number of the point, from 0.
    """

    def __init__(
        self,
        points: Iterable[tuple[float, Any]],
        read: Callable[[Any], TargetPoint],
        check: Callable[[TargetPoint, TargetPoint], None],
        *,
        mm: float,
        degrees: float,
        turns: bool,
    ) -> None:
        self._turns = turns
        self._times: list[float] = []
        self._places: list[TargetPoint] = []
        for number, (seconds, target) in enumerate(points):
            try:
                self._times.append(check_duration(seconds, "the time"))
                self._places.append(read(target))
                check(self._places[max(0, number - 1)], self._places[number])
            except ValueError as error:
                raise ValueError(f"point {number} (from 0) of the trajectory: {error}") from error

        if not self._times:
            raise ValueError("a trajectory needs a point at least")

        for number, (before, after) in enumerate(pairwise(self._times), 1):
            if not before < after:
                raise ValueError(f"point {number} (from 0) of the trajectory: its time, {after:g} s, is not later")

            length, turn = way_along(self._places[number - 1], self._places[number], turns=turns)
            for needed, most, unit in ((length, mm, "mm"), (turn, degrees, "degrees")):
                if needed > most * (after - before) * SLACK + GRAIN:
                    raise ValueError(
                        f"point {number} (from 0) of the trajectory: {needed / (after - before):.4g} {unit}/s are "
                        f"needed to get there in time, and {most:g} are allowed"
                    )

        self.first: TargetPoint = self._places[0]
        self.last: TargetPoint = self._places[-1]
        self.seconds: float = self._times[-1] - self._times[0]

    def at(self, elapsed: float) -> TargetPoint:
        """Return the place after some seconds."""
        time = self._times[0] + elapsed
        number = bisect_right(self._times, time)
        if number == len(self._times):
            return self.last

        if not number:
            return self.first

        start, end = self._places[number - 1], self._places[number]
        share = (time - self._times[number - 1]) / (self._times[number] - self._times[number - 1])
        length, turn = way_along(start, end, turns=self._turns)
        return part_of_way(start, end, share * length, share * turn, turns=self._turns)
