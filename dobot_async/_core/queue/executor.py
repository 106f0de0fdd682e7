"""What a family brings to the queue of motions: how its arm takes commands, says how far it is, and stops."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from dobot_async._core.protocol.wire import Command
from dobot_async._core.util.hooks import Hooks
from dobot_async._core.util.tasks import Cleanup
from dobot_async.errors import ArmAlarm, DobotError, MotionUnknown, ReplyTimeout

if TYPE_CHECKING:
    from dobot_async._core.queue.keeper import Keeper
    from dobot_async._core.queue.motion import Motion

__all__ = ["Entry", "Executor", "MotionSource", "alarmed", "in_motions", "unseen"]

Q = TypeVar("Q")


@dataclass(frozen=True, slots=True, eq=False)
class Entry:
    """One command on its way into the queue, checked and encoded before a byte is sent."""

    command: Command[Any, Any]
    value: Any
    frame: Any


class MotionSource(Protocol):
    """Where an executor gets the commands from, in order."""

    def __len__(self) -> int:
        """How many wait to be sent."""
        ...

    def take(self) -> Entry:
        """Return the next one, which is sent now; it can no longer be withdrawn."""
        ...

    def put_back(self, entries: Sequence[Entry]) -> None:
        """The arm is known not to have taken these: they come next again."""

    def accepted(self, entry: Entry, ticket: int) -> None:
        """The arm has taken one, and this is its number. Tickets grow."""


class Executor(Protocol):
    """One arm, as its queue sees it. Each call may be cancelled at any moment, and the next one goes on from there.

    Attributes:
        cleanup: What still has to be done to the arm.
        on_unknown: Hooks, called when a motion turns out to be unknown while nobody asks.
        on_motion: Hooks of those who look on; here, for a fleet gives the arm another queue.
    """

    cleanup: Cleanup
    on_unknown: Hooks[[MotionUnknown]]
    on_motion: Hooks[[Motion]]

    @property
    def keeper(self) -> Keeper[Any] | None:
        """What looks at the ways of motions before they are sent; None for an arm that may go anywhere."""
        ...

    def prepare(self, command: Command[Q, Any], value: Q) -> Entry:
        """Return an entry for the queue.

        Raises:
            ValueError: The parameters do not fit, the target cannot be reached, or the command cannot be queued.
            TypeError: They are of the wrong type.
        """
        ...

    async def submit(self, source: MotionSource) -> None:
        """Give commands to the arm, each exactly once and in order, until the source is empty; wait for room.

        Raises:
            MotionUnknown: Nothing can tell whether the arm took a command.
            ArmAlarm: The arm has no room, and with the alarms that it has raised it will not make any.
            CommandRejected: The arm refused the one that was taken last.
            ReplyTimeout: The arm is silent; what was not sent is left in the source.
        """

    async def completed(self) -> int | None:
        """Return the ticket of the last command that the arm has finished, None if it cannot say.

        Raises:
            MotionUnknown: The arm was switched off and on.
            ReplyTimeout: The arm is silent.
        """
        ...

    async def earliest_end(self, entry: Entry) -> float | None:
        """Return seconds within which a command, the next one to be finished, cannot be; None where nothing tells."""
        ...

    async def alarms(self) -> Sequence[object]:
        """Return the alarms that keep the arm from moving."""
        ...

    async def is_at_target(self, entry: Entry) -> bool:
        """Return whether the arm stands where a motion leads; False where the motion alone cannot tell."""
        ...

    async def stop(self) -> None:
        """Stop the arm where it is, ahead of everything; repeated until the arm has heard it."""

    async def clear(self) -> None:
        """Empty the arm's queue and let it run again; repeated until the arm has heard it."""

    async def pause(self) -> None:
        """Let the arm finish the command that it executes, and then wait."""

    async def resume(self) -> None:
        """Let the arm go on."""


def alarmed(alarms: Sequence[object]) -> ArmAlarm:
    """What to raise because of alarms."""
    return ArmAlarm(f"the arm raised alarms: {'; '.join(map(str, alarms))}", alarms)


def in_motions(error: ArmAlarm, motions: Sequence[object]) -> ArmAlarm:
    """Say in which motion an alarm came up: the only one of several, or from the first to the last of them."""
    if error.motions or not motions:
        return error

    first, last = motions[0], motions[-1]
    where = f"{first}" if len(motions) == 1 else f"{first}{' or' if len(motions) == 2 else ' to'} {last}"
    return ArmAlarm(f"{error}; in {where}", error.alarms, motions)


def unseen(error: DobotError) -> DobotError:
    """What an error means to Motions: an arm that does not answer may do them, or not."""
    if isinstance(error, ReplyTimeout):
        return MotionUnknown(f"the arm no longer answers, and what it does cannot be seen: {error}")

    return error
