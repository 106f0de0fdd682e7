"""What a family brings to the queue of motions: how its arm takes commands, says how far it is, and stops."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

from dobot_async.errors import MotionUnknown
from dobot_async.wire import Command

__all__ = ["Accepted", "Entry", "Executor"]

Q = TypeVar("Q")


@dataclass(frozen=True, slots=True, eq=False)
class Entry:
    """One command on its way into the queue, checked and encoded before a byte is sent."""

    command: Command[Any, Any]
    value: Any
    frame: Any


Accepted = Callable[[Entry, int | None], None]
"""Called with the ticket that the arm gave to a command, None for one that it never took. Tickets grow."""


class Executor(Protocol):
    """What a family brings: how its arm takes commands, says how far it is, and stops."""

    async def connected(self) -> None:
        """Returns when the arm can be reached; raises ConnectionLost if that is over.

        Raises:
            MotionUnknown: It can be reached again, but it was switched off and on meanwhile.
        """

    def prepare(self, command: Command[Q, Any], value: Q) -> Entry:
        """Returns an entry for the queue.

        Raises:
            ValueError: The parameters do not fit, the target cannot be reached, or the command cannot be queued.
            TypeError: They are of the wrong type.
        """

    @property
    def room(self) -> int:
        """How many commands the arm's queue can take for certain; 0 where only `left_space` tells."""

    async def left_space(self) -> int:
        """Returns how many commands the arm's queue can still take, which is then its `room`."""

    distress: Callable[[MotionUnknown], None]
    """Set by the queue: called when a motion turns out to be unknown while nobody asks."""

    @property
    def under_way(self) -> Collection[Entry]:
        """The commands that were sent and of which nobody knows yet whether the arm took them."""

    async def push(self, entries: Iterator[Entry], accepted: Accepted) -> None:
        """Gives commands to the arm, each exactly once and in order, and calls `accepted` for each one.

        It takes an entry when it can send it, and returns when there are no more, when there is no room, or when the
        arm did not take one; what was not accepted may be pushed again. Interrupted, it leaves commands `under_way`,
        which `settle` or the next `push` settles first.

        Raises:
            MotionUnknown: Nothing can tell whether the arm took a command.
        """

    async def settle(self) -> None:
        """Finds out what became of the commands under way, and calls their `accepted`; raises as `push` does."""

    async def completed(self) -> int | None:
        """Returns the ticket of the last command that the arm has finished, None if it cannot say."""

    async def remaining(self, entry: Entry) -> float | None:
        """Returns seconds within which a command, the next one to be finished, cannot be; None where nothing tells."""

    async def faults(self) -> Sequence[object]:
        """Returns the alarms that keep the arm from moving."""

    async def stands_at(self, entry: Entry) -> bool:
        """Returns whether the arm stands where a motion leads; False where the motion alone cannot tell."""

    async def halt(self) -> None:
        """Stops the arm where it is, ahead of everything else."""

    async def reset(self) -> None:
        """Empties the arm's queue and lets it run again."""

    async def pause(self) -> None:
        """Lets the arm finish the command that it executes, and then wait."""

    async def resume(self) -> None:
        """Lets the arm go on."""
