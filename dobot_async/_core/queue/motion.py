"""A queued command as its user holds it, and the outbox in which it waits to be sent."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Generator, Sequence
from contextlib import AbstractContextManager
from typing import Any, Protocol

from dobot_async._core.queue.executor import Entry
from dobot_async._core.util.arguments import check_timeout
from dobot_async.errors import DobotError, MotionStopped, ReplyTimeout, another

__all__ = ["WITHDRAWN", "Motion", "MotionOutbox"]


class Watcher(Protocol):
    """The queue of a Motion, which finds out how the Motion ends."""

    def watch(self, seconds: float) -> None:
        """Ask the arm how far it is, for so many seconds at least."""

    def watching(self) -> AbstractContextManager[None]:
        """While this is entered, the arm is asked how far it is."""
        ...

    def note(self, motion: Motion) -> None:
        """Tell those who look on what has become of a Motion."""

    def count(self, error: DobotError | None) -> None:
        """Take note of how something ended that moves the arm."""


class Motion:
    """One queued command; awaitable any number of times, by any number of tasks.

    Awaiting it returns when the arm has executed it, and raises ArmAlarm, MotionStopped, MotionUnknown or
    ConnectionLost when it has not. It belongs to its queue: cancelling who waits for it only ends the waiting.

    Attributes:
        entry: The command.
        name: Its name.
        moves: Whether it moves the arm.
        index: The arm's number for it, None until the arm has accepted it.
        call: What it was put with, None while it is in a batch whose block has not ended.
        withdrawn: Whether nobody wants it any more.
        accepted_or_ended: Set when the arm has taken it, or it has ended.
    """

    def __init__(self, queue: Watcher, entry: Entry) -> None:
        self.entry = entry
        self.name: str = entry.command.name
        self.moves: bool = entry.command.moves
        self.index: int | None = None
        self.call: object = None
        self.withdrawn = False
        self.accepted_or_ended: asyncio.Event = asyncio.Event()
        self._queue = queue
        self._ended = asyncio.Event()
        self._error: DobotError | None = None

    @property
    def done(self) -> bool:
        """Whether it has ended, well or not. Whoever looks again and again has the arm asked for a while each time."""
        if not self._ended.is_set() and self.call:
            self._queue.watch(LOOKED_AT)

        return self._ended.is_set()

    @property
    def ended(self) -> bool:
        """Whether it is known to have ended; asks nobody."""
        return self._ended.is_set()

    def exception(self) -> DobotError | None:
        """Return how it failed, None if it was executed.

        Raises:
            asyncio.InvalidStateError: It has not ended yet.
        """
        if not self.done:
            raise asyncio.InvalidStateError(f"{self} has not ended yet")

        return self._error

    async def wait(self, timeout: float | None = None) -> None:
        """Wait as `await motion` does, for so many seconds at most.

        Raises:
            ReplyTimeout: It has not ended yet; it goes on.
            RuntimeError: It is in a batch whose block has not ended, so that it was not sent.
        """
        if not self._ended.is_set():
            if not self.call:
                raise RuntimeError(f"{self} is sent when the block of its batch ends: await it after that")

            try:
                with self._queue.watching():
                    async with asyncio.timeout(check_timeout(timeout)):
                        await self._ended.wait()
            except TimeoutError:
                raise ReplyTimeout(f"{self} has not ended within {timeout:.3g} s; it goes on") from None

        if self._error:
            raise another(self._error)

    def __await__(self) -> Generator[Any, None, None]:
        return self.wait().__await__()

    def __str__(self) -> str:
        return self.name if self.index is None else f"{self.name} (index {self.index})"

    def __repr__(self) -> str:
        state = "failed" if self._error else "done" if self._ended.is_set() else "pending"
        return f"<Motion {self}: {state}>"

    def accept(self, ticket: int) -> None:
        """Called by the queue: the arm has taken it."""
        self.index = ticket
        self.accepted_or_ended.set()

    def end(self, error: DobotError | None = None) -> None:
        """Called by the queue: how it ended. Only the first call counts."""
        if not self._ended.is_set():
            self._error = error
            self._ended.set()
            self.accepted_or_ended.set()
            self._queue.note(self)
            if self.moves:
                self._queue.count(error)


LOOKED_AT = 1.0
"""Seconds for which the arm is asked after somebody has looked whether a Motion is done."""


class MotionOutbox:
    """What was put and has not been accepted: it waits, or was taken by the executor and is on its way.

    Args:
        accepted: Called with each Motion that the arm has taken.
    """

    def __init__(self, accepted: Callable[[Motion], None]) -> None:
        self._accepted = accepted
        self._waiting: deque[Motion] = deque()
        self._taken: dict[Entry, Motion] = {}

    def __len__(self) -> int:
        """How many wait to be sent."""
        return len(self._waiting)

    @property
    def unaccepted(self) -> list[Motion]:
        """All that was not accepted."""
        return [*self._taken.values(), *self._waiting]

    def add(self, motions: Sequence[Motion]) -> None:
        """Put Motions behind all others."""
        self._waiting.extend(motions)

    def take(self) -> Entry:
        """Return the next command, which is sent now; it can no longer be withdrawn."""
        motion = self._waiting.popleft()
        self._taken[motion.entry] = motion
        return motion.entry

    def put_back(self, entries: Sequence[Entry]) -> None:
        """The arm has not taken these: send them again, but for those that nobody wants any more."""
        for entry in reversed(entries):
            motion = self._taken.pop(entry, None)
            if motion and motion.withdrawn:
                motion.end(WITHDRAWN)
            elif motion:
                self._waiting.appendleft(motion)

    def accepted(self, entry: Entry, ticket: int) -> None:
        """The arm has taken a command."""
        motion = self._taken.pop(entry, None)
        if motion:
            motion.accept(ticket)
            self._accepted(motion)

    def withdraw(self, motions: Sequence[Motion], reason: DobotError) -> None:
        """Nobody wants these any more: they end, but for those on their way, which are not sent a second time."""
        for motion in motions:
            motion.withdrawn = True
            if motion.index is None and motion.entry not in self._taken:
                motion.end(reason)

        self._waiting = deque(motion for motion in self._waiting if not motion.ended)

    def refuse(self, error: DobotError) -> None:
        """The arm has refused what was taken: it ends, and so does what was put in the same call."""
        calls = [motion.call for motion in self._taken.values()]
        for motion in self.unaccepted:
            if motion.call in calls:
                motion.end(error)

        self._taken.clear()
        self._waiting = deque(motion for motion in self._waiting if not motion.ended)

    def drop(self, error: DobotError) -> bool:
        """End all with an error; return whether there were any."""
        motions = self.unaccepted
        self._waiting.clear()
        self._taken.clear()
        for motion in motions:
            motion.end(error)

        return bool(motions)


WITHDRAWN = MotionStopped("it was not sent: the call that put it was cancelled")
