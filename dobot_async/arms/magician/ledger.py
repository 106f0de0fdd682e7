"""The ledger of a Magician's queue: which index means what, and what became of unacknowledged commands. No I/O.

    last      index of the last command that the arm is known to have taken; None until one is known
    unacked   what was sent after it, in order, and is not acknowledged
    probe     a WAIT of 0 ms, queued to learn the index that it gets

Each command that the arm takes gets the next index, so a probe that gets `last + n` proves that n commands were taken
since, itself included. That settles it if it is none or all of the unacknowledged ones. Where probes are lost, too, the
count that was read before the first of them settles it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from dobot_async._core.queue.executor import Entry

__all__ = ["QueueLedger", "Resolution", "UnackedCommand"]


@dataclass(frozen=True, slots=True, eq=False)
class UnackedCommand:
    """A command that was sent and not acknowledged.

    Attributes:
        entry: The command.
        sent_at: When, in seconds.
        probe: Whether it was sent for its index alone.
        counted: How many of those before it the arm had taken, as read before it was sent; None if it did not say.
    """

    entry: Entry
    sent_at: float
    probe: bool = False
    counted: int | None = None


@dataclass(frozen=True, slots=True)
class Resolution:
    """What became of the unacknowledged commands, probes left out.

    Attributes:
        taken: Those that the arm took, with their indices.
        lost: Those that it did not take.
        surplus: How many more the arm took than were sent: the network doubled them, or somebody else queued them.
    """

    taken: Sequence[tuple[Entry, int]]
    lost: Sequence[Entry]
    surplus: int


@dataclass(slots=True)
class QueueLedger:
    """See the module."""

    last: int | None = None
    unacked: list[UnackedCommand] = field(default_factory=list[UnackedCommand])

    @property
    def highest(self) -> int | None:
        """The highest index that a command can have got."""
        return None if self.last is None else self.last + len(self.unacked)

    @property
    def commands(self) -> list[Entry]:
        """The unacknowledged commands, probes left out."""
        return [each.entry for each in self.unacked if not each.probe]

    def acknowledge(self, index: int, count: int = 1) -> Resolution:
        """The first `count` unacknowledged commands were taken, the last of them with an index."""
        surplus = 0 if self.last is None else index - self.last - count
        taken = [(each.entry, index - count + place) for place, each in enumerate(self.unacked[:count], start=1)]
        self.last, self.unacked = index, self.unacked[count:]
        return Resolution(taken, [], max(0, surplus))

    def prove(self, index: int, *, doubling: bool) -> Resolution | None:
        """The probe that was sent last got an index; return what that means, None if nothing can tell.

        Args:
            index: What it got.
            doubling: The network may double commands: of two that were taken the second may be the first one's copy.
        """
        assert self.last is not None
        total = index - self.last
        counted = next(each.counted for each in self.unacked if each.probe)
        commands, probes = len(self.commands), len(self.unacked) - len(self.commands)
        if doubling:
            if counted is None:
                counted = 0 if total == 1 else None
        elif counted is None or commands > 1 or probes == 1:
            counted = commands if total >= commands + probes else 0 if total == 1 else None

        return self._conclude(counted, total, probes)

    def conclude(self, counted: int) -> Resolution | None:
        """The arm took so many commands since the last one, as read; return what that means, as `prove`."""
        first = next((each.counted for each in self.unacked if each.probe), counted) if counted else 0
        return self._conclude(first, counted, len(self.unacked) - len(self.commands))

    def _conclude(self, counted: int | None, total: int, probes: int) -> Resolution | None:
        """The arm took `counted` of the commands, and `total` in all, `probes` of which may be ours."""
        commands, last = self.commands, self.last
        if counted is None or last is None or 0 < counted < len(commands):
            return None

        taken = [(entry, last + place) for place, entry in enumerate(commands, start=1)] if counted else []
        # Not every probe need have been taken, but what was counted before the first of them was none of theirs.
        surplus = max(0, counted - len(commands), total - len(taken) - probes)
        self.last, self.unacked = last + total, []
        return Resolution(taken, [] if counted else commands, surplus)
