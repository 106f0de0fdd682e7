"""Where a tool may be, for who sends an arm about without its queue: what all sources of such limits have in common."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol

__all__ = ["AllBounds", "ToolBounds", "both"]


class ToolBounds(Protocol):
    """Where the tool of one arm may be; places are x, y, z in mm, as the arm itself tells them."""

    def check_way(self, places: Iterable[Sequence[float]]) -> None:
        """Raise ValueError for a way that does not end inside, or goes further out on its course.

        Args:
            places: Along the way, where it begins and ends among them; straight in between.
        """

    def excess(self, place: Sequence[float]) -> tuple[float, ...]:
        """Return by how many mm a place breaks each rule; 0 for not."""
        ...


@dataclass(frozen=True, slots=True)
class AllBounds:
    """Several of them, all of which count."""

    each: tuple[ToolBounds, ...]

    def check_way(self, places: Iterable[Sequence[float]]) -> None:
        """See `ToolBounds`."""
        line = list(places)
        for bounds in self.each:
            bounds.check_way(line)

    def excess(self, place: Sequence[float]) -> tuple[float, ...]:
        """See `ToolBounds`."""
        return tuple(excess for bounds in self.each for excess in bounds.excess(place))


def both(one: ToolBounds | None, other: ToolBounds | None) -> ToolBounds | None:
    """Return what keeps to both; None if there is neither."""
    found = tuple(bounds for bounds in (one, other) if bounds is not None)
    return AllBounds(found) if len(found) > 1 else next(iter(found), None)
