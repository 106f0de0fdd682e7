"""The ledger of an ultraArm's queue: what it was given, and what of that QUEUE SIZE proves done. No I/O.

    taken   G0  G0  M23  G0  G0  |          QUEUE SIZE[1]: one waits, one more may be executing,
            done    done  `-- open          so that the last two motions, and what is behind them, are open

The arm has no indices, so a ticket is our own count. Whether a setting takes room in the arm's queue is not known; only
motions are counted, which proves less than it could and never too much.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from dobot_async._core.queue.executor import Entry
from dobot_async.ultraarm import commands as c
from dobot_async.ultraarm.answers import Status
from dobot_async.wire import Command

__all__ = ["MODES", "QueueLedger", "TakenCommand", "Target", "UnackedCommand", "target_of"]

AXES: Mapping[type, tuple[bool, Mapping[str, str]]] = MappingProxyType(
    {
        c.CoordsMove: (False, {name: name for name in ("x", "y", "z", "e")}),
        c.JointsMove: (True, {name: name for name in ("j1", "j2", "j3", "j4")}),
    }
)


@dataclass(frozen=True, slots=True)
class Target:
    """Where an absolute motion leads: some of the coordinates, or of the joints."""

    joints: bool
    numbers: Mapping[str, float]

    def position(self, status: Status) -> c.UltraArmCoords | c.UltraArmAngles | None:
        """Return where the arm said it is, in what the target is in; None if it did not."""
        numbers = (status.angles if self.joints else status.coords)[:4]
        kind = c.UltraArmAngles if self.joints else c.UltraArmCoords
        return kind(*numbers) if len(numbers) >= 3 else None

    def distance(self, here: c.UltraArmCoords | c.UltraArmAngles) -> float:
        """Return the greatest distance of an axis from the target, mm or degrees."""
        return max((abs(getattr(here, name) - value) for name, value in self.numbers.items()), default=0.0)

    def __str__(self) -> str:
        return ", ".join(f"{name} {value:g}" for name, value in self.numbers.items())


def target_of(entry: Entry, *, relative: bool = False) -> Target | None:
    """Return where a command leads, None if that depends on where the arm will be, or if it leads nowhere."""
    value: Any = entry.value
    if entry.command is c.MOVE_BY or (relative and entry.command is c.MOVE_COORDS):
        return None

    if isinstance(value, c.JointMove):
        return Target(joints=True, numbers={f"j{value.joint}": value.angle})

    if type(value) not in AXES or not entry.command.moves:
        return None

    joints, names = AXES[type(value)]
    found = {name: getattr(value, field) for name, field in names.items()}
    return Target(joints, {name: number for name, number in found.items() if number is not None})


@dataclass(frozen=True, slots=True)
class TakenCommand:
    """A command that the arm has taken."""

    ticket: int
    entry: Entry


@dataclass(slots=True)
class UnackedCommand:
    """The command that was sent and of which nobody knows yet whether the arm took it.

    Attributes:
        entry: The command.
        size: How many commands waited in the arm's queue before it was sent; None if that is not known.
    """

    entry: Entry
    size: int | None


class QueueLedger:
    """See the module.

    Attributes:
        open: What was taken and is not known to be done, in order.
        unacked: What may have been taken.
        last: The ticket of the last command that was taken; 0 before it.
        completed: The ticket of the last command that is known to be done; 0 before it.
        target: Where the arm stands once all is done, if the last motion tells.
        verified: Whether it was seen to stand there.
        relative: Whether coordinates are increments once all is done.
    """

    def __init__(self) -> None:
        self.open: deque[TakenCommand] = deque()
        self.unacked: UnackedCommand | None = None
        self.last = 0
        self.completed = 0
        self.target: Target | None = None
        self.verified = False
        self.relative = False

    def enter(self, entry: Entry) -> int:
        """Enter a command that the arm has taken; return its ticket."""
        self.unacked = None
        self.last += 1
        self.open.append(TakenCommand(self.last, entry))
        if entry.command.moves:
            self.target, self.verified = target_of(entry, relative=self.relative), False

        return self.last

    def done_by_size(self, size: int) -> int:
        """So many commands wait in the arm's queue; return the ticket of the last one that is done."""
        motions = 0
        undone = len(self.open)
        for taken in reversed(self.open):
            undone -= 1
            motions += taken.entry.command.moves
            if motions > size:
                break
        else:
            undone = 0

        for _ in range(undone):
            self.completed = self.open.popleft().ticket

        return self.completed

    def all_done(self) -> int:
        """The arm rests, and nothing waits; return the ticket of the last command."""
        self.open.clear()
        self.completed = self.last
        self.verified = True
        return self.completed

    @property
    def alone(self) -> bool:
        """Whether one motion is all that is open, and it is known where it leads."""
        return len(self.open) == 1 and self.target is not None and self.open[0].entry.command.moves

    @property
    def dwell(self) -> float:
        """Seconds that the arm is told to wait behind the last open motion: it may look idle meanwhile."""
        seconds = 0.0
        for taken in reversed(self.open):
            if taken.entry.command.moves:
                break

            if taken.entry.command is c.WAIT:
                seconds += taken.entry.value.seconds

        return seconds

    def note(self, command: Command[Any, Any]) -> None:
        """Note what a command that the arm has taken means for the others."""
        self.relative = MODES.get(command, self.relative)
        if command in FORGETTING:
            self.target = None

    def forget(self) -> bool:
        """Nothing is open any more; return whether that leaves it unknown what coordinates mean."""
        entries = [taken.entry for taken in self.open] + ([self.unacked.entry] if self.unacked else [])
        self.open.clear()
        self.unacked = self.target = None
        self.completed = self.last
        return any(entry.command in MODES or entry.command is c.MOVE_BY for entry in entries)


MODES: Mapping[Command[Any, Any], bool] = MappingProxyType({c.ABSOLUTE: False, c.RELATIVE: True})
FORGETTING = {c.JOG_JOINT, c.JOG_COORD, c.RELEASE, c.CALIBRATE_J1, c.SET_POSITION}
"""After these the arm stands elsewhere than the last motion led, or calls it otherwise."""
