"""The books of a Magician's queue: which index means what, and what became of commands without acknowledgement.

    last        index of the last command that the arm is known to have taken
    under way   what was sent after it, in order, and is not acknowledged
    probe       a WAIT of 0 ms, queued to learn the index that it gets

Each command that the arm takes gets the next index, so a probe that gets `last + n` proves that n commands were taken
since, itself included. That settles it if it is none or all of those under way. Where probes go unacknowledged too,
what settles it is the count that was read before the first of them. Bookkeeping, no I/O.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from dobot_async.executor import Entry

__all__ = ["Attempt", "Books", "Verdict"]


@dataclass(frozen=True, slots=True, eq=False)
class Attempt:
    """A command that was sent and not acknowledged.

    Attributes:
        entry: The command.
        sent_at: When, in seconds.
        probe: Whether it was sent for its index alone.
        counted: How many of those sent before it the arm had taken, as read before it was sent; None if it did not say.
    """

    entry: Entry
    sent_at: float
    probe: bool = False
    counted: int | None = None


@dataclass(frozen=True, slots=True)
class Verdict:
    """What became of the commands under way, probes left out.

    Attributes:
        taken: Those that the arm took, with their indices.
        lost: Those that it did not take.
        last: The index of the last command that the arm took, probes included.
        surplus: How many more the arm took than were sent: the network doubled them, or somebody else queued them.
    """

    taken: list[tuple[Entry, int]]
    lost: list[Entry]
    last: int
    surplus: int = 0


@dataclass(slots=True)
class Books:
    """See the module."""

    last: int | None = None
    under_way: list[Attempt] = field(default_factory=list)

    @property
    def entries(self) -> list[Entry]:
        """The commands under way, probes left out."""
        return [attempt.entry for attempt in self.under_way if not attempt.probe]

    @property
    def probes(self) -> list[Entry]:
        """The probes under way."""
        return [attempt.entry for attempt in self.under_way if attempt.probe]

    def acknowledge(self, index: int) -> tuple[Entry, int]:
        """The first command under way got an index; returns it with the surplus that the index shows."""
        attempt = self.under_way.pop(0)
        surplus = 0 if self.last is None else index - self.last - 1
        self.last = index
        return attempt.entry, surplus

    def prove(self, index: int, *, exact: bool = False) -> Verdict | None:
        """The probe that was sent last got an index; returns what that means, or None if nothing can tell.

        Args:
            index: What it got.
            exact: Nothing is ever doubled: a single probe's index says more than a count that late replies may spoil.
        """
        assert self.last is not None
        total = index - self.last
        counted = next(attempt.counted for attempt in self.under_way if attempt.probe)
        commands = len(self.entries)
        probes = len(self.under_way) - commands
        if counted is None and not exact:
            # Of two that were taken the second may be the first one's copy.
            counted = 0 if total == 1 else None
        elif counted is None or commands > 1 or (exact and probes == 1):
            # All were taken, or none but the probe that got the index.
            counted = commands if total >= commands + probes else 0 if total == 1 else None

        return self._conclude(counted, total, probes)

    def conclude(self, counted: int) -> Verdict | None:
        """The arm took so many commands since the last one, as read; returns what that means, as `prove`."""
        first = next((attempt.counted for attempt in self.under_way if attempt.probe), counted)
        return self._conclude(first, counted, len(self.under_way) - len(self.entries))

    def _conclude(self, counted: int | None, total: int, probes: int) -> Verdict | None:
        """The arm took `counted` of the commands under way, and `total` in all, `probes` of which are ours."""
        entries, last = self.entries, self.last
        if counted is None or last is None or 0 < counted < len(entries):
            return None

        taken = [(entry, last + place) for place, entry in enumerate(entries, start=1)] if counted else []
        # Not every probe need have been taken, but what was counted before the first of them was none of theirs.
        surplus = max(0, counted - len(entries), total - (len(entries) if counted else 0) - probes)
        self.last, self.under_way = last + total, []
        return Verdict(taken, [] if counted else entries, self.last, surplus)
