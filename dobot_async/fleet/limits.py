"""Where in the cell the tool of a guarded arm may be: ways are checked before they are sent, jogs are watched.

An arm that is outside, by a jog, a homing or a hand, may come back: its way must lead inside, and no further out than
where it begins.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Iterable, Sequence
from dataclasses import dataclass

from dobot_async._core.util.shapes import Box
from dobot_async.errors import DobotError
from dobot_async.fleet.frames import BaseFrame
from dobot_async.fleet.planner import XYZ

__all__ = ["FleetLimits"]

ROUNDING = 0.01  # mm; what numbers lose on the line
LOOK = 0.02  # seconds between two looks at an arm that jogs
AHEAD = 0.2  # seconds in which an arm that is told to stop comes to rest
SILENT = 0.3  # seconds for which a jog goes on that cannot be seen


@dataclass(frozen=True, slots=True)
class FleetLimits:
    """The limits of one arm.

    Attributes:
        name: The arm's.
        box: In the cell; None for an arm without limits.
        base: Where the arm stands in the cell.
    """

    name: str
    box: Box | None
    base: BaseFrame

    def check(self, outline: Sequence[XYZ] | None, start: XYZ | None) -> None:
        """Raise ValueError if a way leaves the limits.

        Args:
            outline: Its places; None if not even its end is known.
            start: Where it begins, if that is known.
        """
        if self.box is None:
            return

        if outline is None:
            raise ValueError(
                f"{self.name}: where this leads is not known, for where it begins is not; await what comes before it"
            )

        allowed = ROUNDING + (self._outside(start) if start else 0.0)
        for place in outline:
            if self._outside(place) > (ROUNDING if place is outline[-1] else allowed):
                x, y, z, _ = self.base.to_cell(*place)
                raise ValueError(
                    f"{self.name}: the way leaves the arm's limits, at ({x:.1f}, {y:.1f}, {z:.1f}) of the cell"
                )

    def check_way(self, places: Iterable[Sequence[float]]) -> None:
        """Raise ValueError for a straight way that ends outside, or leads further out; see `Bounds`."""
        line = [(float(x), float(y), float(z)) for x, y, z, *_ in places]
        self.check(line, line[0])

    def excess(self, place: Sequence[float]) -> tuple[float, ...]:
        """Return how many mm a place is outside; see `Bounds`."""
        return (self._outside((place[0], place[1], place[2])),)

    async def watch(self, look: Callable[[], Awaitable[XYZ]]) -> str:
        """Watch an arm that jogs; return why it has to be stopped: soon it would be outside, or further outside."""
        loop = asyncio.get_running_loop()
        before: XYZ | None = None
        seen_at = 0.0
        while True:
            asked_at = loop.time()
            try:
                async with asyncio.timeout(SILENT):
                    place = await look()
            except (TimeoutError, DobotError) as error:
                return f"it does not say where it is ({error})" if str(error) else "it does not say where it is"

            now = loop.time()
            if before:
                # What was seen is as old as the answer took, and the stop takes as long.
                share = (AHEAD + 2 * (now - asked_at)) / max(now - seen_at, LOOK / 2)
                soon = tuple(b + (b - a) * share for a, b in zip(before, place, strict=True))
                if self._outside((soon[0], soon[1], soon[2])) > self._outside(place) + ROUNDING:
                    return "it has come to its limits"

            before, seen_at = place, now
            await asyncio.sleep(LOOK)

    def _outside(self, place: XYZ) -> float:
        """How many mm a place is outside."""
        x, y, z, _ = self.base.to_cell(*place)
        box = self.box or Box()
        return max(max(low - value, value - high, 0.0) for value, (low, high) in ((x, box.x), (y, box.y), (z, box.z)))
