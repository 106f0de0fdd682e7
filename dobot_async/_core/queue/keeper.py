"""What keeps an arm in its workspace: it looks at the ways of motions before any of them is sent.

    put_all --> Keeper.admit:  where the last motion leads --follow--> ... --follow--> where the last of these leads
                               or, if none is under way, where the arm stands (look)

Each family brings what knows its ways. A place that nothing tells is None.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Awaitable, Callable, Sequence
from typing import Any, Generic, TypeVar
from weakref import WeakKeyDictionary

from dobot_async._core.queue.executor import Entry
from dobot_async._core.queue.motion import Motion
from dobot_async._core.util.workspace import Workspace

__all__ = ["Keeper"]

P = TypeVar("P")


class Keeper(ABC, Generic[P]):
    """Keeps one arm in its workspace; P is what its ways begin at.

    Attributes:
        workspace: Where the tool may be.
    """

    def __init__(self, workspace: Workspace) -> None:
        self.workspace = workspace
        self._ends: WeakKeyDictionary[Motion, P] = WeakKeyDictionary()

    @abstractmethod
    def concerns(self, entry: Entry) -> bool:
        """Return whether a command moves the arm, or changes what ways are."""

    @abstractmethod
    async def look(self) -> P:
        """Read where the arm stands."""

    @abstractmethod
    async def follow(self, entry: Entry, start: P) -> P:
        """Return where a command leads that concerns this; raise OutsideWorkspace if that is outside, or the way is."""

    async def admit(
        self, motions: Sequence[Motion], before: Callable[[], Sequence[Motion]], update: Callable[[], Awaitable[None]]
    ) -> None:
        """Raise OutsideWorkspace if one of several motions that are sent together leads outside.

        Args:
            motions: They.
            before: Tells all that has not ended of what was put before.
            update: Asks the arm which of those have.
        """
        if not any(self.concerns(motion.entry) for motion in motions):
            return

        if self._last(before()):
            await update()  # it may have been done for long, and the arm been moved by hand since

        last = self._last(before())
        start = self._ends[last] if last else await self.look()
        ends: list[tuple[Motion, Any]] = []
        for motion in motions:
            if self.concerns(motion.entry):
                start = await self.follow(motion.entry, start)
                ends.append((motion, start))

        self._ends.update(ends)

    def _last(self, motions: Sequence[Motion]) -> Motion | None:
        """The last motion of which it was noted where it leads."""
        return next((motion for motion in reversed(motions) if motion in self._ends), None)
