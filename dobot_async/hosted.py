"""A queue on this side, for arms that have none of their own: they are given one motion at a time.

    MotionQueue --push--> waiting --feeder--> hand.execute(entry) --> done: the next one
                                                                 `--> failed: the others are never sent

An arm that takes one motion at a time has no indices; a motion is over when its family's `Hand` says so. The feeder is
a task that lives while there is something to do, whether or not anybody awaits it.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Collection, Iterator, Sequence
from itertools import islice
from typing import Any, Protocol, TypeVar

from dobot_async.errors import DobotError, MotionUnknown
from dobot_async.executor import Accepted, Entry
from dobot_async.wire import Command

__all__ = ["Hand", "HostedExecutor"]

Q = TypeVar("Q")
CAPACITY = 1000


class Hand(Protocol):
    """What a family brings whose arm takes one motion at a time."""

    async def connected(self) -> None:
        """Returns when the arm can be reached; raises ConnectionLost if that is over."""

    def prepare(self, command: Command[Q, Any], value: Q) -> Entry:
        """Returns a checked entry; raises ValueError or TypeError where the arm could not take it."""

    async def execute(self, entry: Entry) -> None:
        """Does one command, sent once, and returns when it is done; raises DobotError when it is not."""

    async def halt(self) -> None:
        """Stops the arm where it is, ahead of everything else."""

    async def reset(self) -> None:
        """Makes the arm forget what it was told, and ready for more."""

    async def pause(self) -> None:
        """Lets the arm wait where it is."""

    async def resume(self) -> None:
        """Lets the arm go on."""


class HostedExecutor:
    """The queue, as a `MotionQueue` wants it."""

    def __init__(self, hand: Hand, capacity: int = CAPACITY) -> None:
        self.distress: Callable[[MotionUnknown], None] = lambda _: None
        self._hand = hand
        self._capacity = capacity
        self._waiting: deque[tuple[int, Entry]] = deque()
        self._tickets = 0
        self._finished = self._told = 0
        self._error: DobotError | None = None
        self._told_error = False
        self._executing = False
        self._running = asyncio.Event()
        self._running.set()
        self._feeder: asyncio.Task[None] | None = None

    @property
    def under_way(self) -> Collection[Entry]:
        """Nothing: what was accepted is here."""
        return ()

    @property
    def unsent(self) -> int:
        """How many commands are here that the arm has never heard of."""
        return len(self._waiting) - self._executing

    async def connected(self) -> None:
        """Returns when the arm can be reached."""
        await self._hand.connected()

    def prepare(self, command: Command[Q, Any], value: Q) -> Entry:
        """Returns a checked entry."""
        return self._hand.prepare(command, value)

    @property
    def room(self) -> int:
        """How many commands can still be taken."""
        return self._capacity - len(self._waiting)

    async def left_space(self) -> int:
        """Returns the room."""
        return self.room

    async def push(self, entries: Iterator[Entry], accepted: Accepted) -> None:
        """Takes commands. Behind one that has failed, and of which nobody has heard yet, they fail with it."""
        for entry in islice(entries, self.room):
            self._tickets += 1
            self._waiting.append((self._tickets, entry))
            accepted(entry, self._tickets)

        if self._told_error:
            self._error, self._told_error = None, False

        if not self._error and (self._feeder is None or self._feeder.done()):
            self._feeder = asyncio.create_task(self._feed(), name="dobot_async feeder")

    async def settle(self) -> None:
        """Nothing is ever unsettled."""

    async def completed(self) -> int | None:
        """Returns the ticket of the last command that is done; raises what the one behind it has failed with."""
        if self._error and self._told == self._finished:
            self._waiting.clear()
            self._told_error = True
            raise self._error

        self._told = self._finished
        return self._finished

    async def remaining(self, entry: Entry) -> None:
        """Returns None: its end is noticed here."""

    async def faults(self) -> Sequence[object]:
        """Returns nothing: a command that alarms have ended is not done."""
        return ()

    async def stands_at(self, entry: Entry) -> bool:  # noqa: ARG002 - it is never needed
        """Returns False."""
        return False

    async def halt(self) -> None:
        """Stops the arm, and sends it nothing more."""
        feeder = self._drop()
        try:
            await self._hand.halt()
        finally:
            if feeder:
                await asyncio.wait([feeder])

    async def reset(self) -> None:
        """Forgets what is waiting and ends what runs, and readies the arm."""
        if self._executing:
            await self.halt()

        await self.aclose()
        self._error, self._told_error = None, False
        await self._hand.reset()
        self._running.set()

    async def pause(self) -> None:
        """Lets the arm wait where it is, and sends it nothing more."""
        self._running.clear()
        try:
            await self._hand.pause()
        except BaseException:
            self._running.set()
            raise

    async def resume(self) -> None:
        """Lets the arm go on."""
        await self._hand.resume()
        self._running.set()

    async def aclose(self) -> None:
        """Sends nothing more; the arm is left as it is."""
        feeder = self._drop()
        if feeder:
            await asyncio.wait([feeder])

    def _drop(self) -> asyncio.Task[None] | None:
        """Forgets what is waiting; returns the task that ends because of it."""
        self._waiting.clear()
        self._executing = False
        feeder, self._feeder = self._feeder, None
        if feeder:
            feeder.cancel()

        return feeder

    async def _feed(self) -> None:
        """Gives the arm one command after the other."""
        try:
            while self._waiting:
                await self._running.wait()
                ticket, entry = self._waiting[0]
                self._executing = True
                await self._hand.execute(entry)
                self._executing = False
                self._waiting.popleft()
                self._finished = ticket
        except DobotError as error:
            self._end(error)
        except Exception as error:
            # Whoever awaits a motion must not wait for a feeder that is gone.
            self._end(MotionUnknown(f"it cannot be told how the motion ended: {error!r}"))
            raise

    def _end(self, error: DobotError) -> None:
        """The command that executes has failed; it is not one that was never sent."""
        if self._executing:
            self._waiting.popleft()

        self._executing, self._error = False, error
