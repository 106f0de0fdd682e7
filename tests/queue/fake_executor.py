"""An executor and its arm in a few lines, on the loop's clock: what the arm was sent, and what it has done."""

from __future__ import annotations

import asyncio
import math
from collections import deque
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any

from dobot_async._core.protocol.wire import Command, Queueing
from dobot_async._core.queue.executor import Entry, MotionSource, alarmed
from dobot_async._core.queue.keeper import Keeper
from dobot_async._core.queue.motion import Motion
from dobot_async._core.queue.queue import MotionQueue
from dobot_async._core.util.hooks import Hooks
from dobot_async._core.util.tasks import Cleanup
from dobot_async.errors import CommandRejected, MotionUnknown, ReplyTimeout

__all__ = ["ALARM", "GO", "LATENCY", "SET", "FakeExecutor", "Step", "now", "queue_over"]

LATENCY = 0.002
SILENCE = 1.5
ALARM = "alarm 16: the target cannot be reached"


class NoLayout:
    """Nothing is put on a wire."""

    def encode(self, value: Any) -> bytes:
        return b""

    def decode(self, data: bytes) -> Any:
        return None


@dataclass(frozen=True)
class Step:
    """What a command tells the arm.

    Attributes:
        name: What it is known by.
        seconds: How long it takes.
        fails: Whether it ends by an alarm.
        refused: Whether the arm will not take it.
    """

    name: Any
    seconds: float = 0.1
    fails: bool = False
    refused: bool = False


GO: Command[Step, None] = Command("Go", 1, NoLayout(), NoLayout(), "", queueing=Queueing.ALLOWED, moves=True)
SET: Command[Step, None] = Command("Set", 2, NoLayout(), NoLayout(), "", queueing=Queueing.ALLOWED)


def now() -> float:
    """The virtual time."""
    return asyncio.get_running_loop().time()


class FakeExecutor:
    """See `Executor`.

    Attributes:
        capacity: Commands that the arm's queue holds.
        dead: Whether the arm is not reached.
        losses: How many of the next commands do not reach it, as turns out a while later.
        sent: The names of the commands that the arm has got, in order.
        done: Those that it has done.
        stops: When it was stopped.
        at_target: Whether the arm stands wherever a motion leads.
        errors: What the next calls of a name raise.
        calls: How often each was called.
    """

    def __init__(self, capacity: int = 1000) -> None:
        self.cleanup = Cleanup("fake:")
        self.on_unknown: Hooks[[MotionUnknown]] = Hooks()
        self.on_motion: Hooks[[Motion]] = Hooks()
        self.keeper: Keeper[Any] | None = None
        self.capacity = capacity
        self.dead = False
        self.losses = 0
        self.sent: list[Any] = []
        self.done: list[Any] = []
        self.stops: list[float] = []
        self.clears: list[float] = []
        self.alarm = False
        self.at_target = False
        self.paused = False
        self.errors: dict[str, BaseException] = {}
        self.calls: dict[str, int] = {}
        self._tickets = self._finished = 0
        self._queue: deque[tuple[int, Entry]] = deque()
        self._runs_until = math.inf
        self._under_way: tuple[Entry, int] | None = None

    async def _way(self, name: str) -> None:
        """Half a round trip; raises ReplyTimeout if the arm is not reached."""
        self.calls[name] = self.calls.get(name, 0) + 1
        if name in self.errors:
            raise self.errors.pop(name)

        await asyncio.sleep(LATENCY)
        if self.dead:
            await asyncio.sleep(SILENCE)
            raise ReplyTimeout("the arm is silent")

        self._progress()

    def _progress(self) -> None:
        """Let the arm do what it has done since the last look."""
        while self._queue and not self.alarm and now() >= self._runs_until:
            ticket, entry = self._queue.popleft()
            self._finished = ticket
            if entry.value.fails:
                self.alarm = True
            else:
                self.done.append(entry.value.name)

            self._runs_until += self._queue[0][1].value.seconds if self._queue else math.inf

    def prepare(self, command: Command[Any, Any], value: Any) -> Entry:
        if not isinstance(value, Step):
            raise TypeError(f"no step: {value!r}")

        return Entry(command, value, None)

    async def submit(self, source: MotionSource) -> None:
        if self._under_way:
            entry, ticket = self._under_way
            self._under_way = None
            if ticket:
                source.accepted(entry, ticket)
            else:
                source.put_back([entry])

        while len(source):
            while len(self._queue) >= self.capacity:
                if self.alarm:
                    raise alarmed([ALARM])

                await asyncio.sleep(0.005)
                await self._way("room")

            if not len(source):
                break

            entry = source.take()
            self._under_way = entry, 0
            await self._way("submit")
            if self.losses:
                self.losses -= 1
                await asyncio.sleep(10 * LATENCY)
                self._under_way = None
                source.put_back([entry])
                continue

            if entry.value.refused:
                self._under_way = None
                raise CommandRejected(f"{entry.value.name} is refused")

            self._tickets += 1
            if not self._queue:
                self._runs_until = now() + entry.value.seconds

            self._queue.append((self._tickets, entry))
            self.sent.append(entry.value.name)
            self._under_way = entry, self._tickets
            await self._way("acknowledgement")
            self._under_way = None
            source.accepted(entry, self._tickets)

    async def completed(self) -> int | None:
        await self._way("completed")
        finished = self._finished
        await self._way("completed")
        return finished

    async def earliest_end(self, entry: Entry) -> float | None:
        await self._way("earliest_end")
        return None

    async def alarms(self) -> Sequence[object]:
        await self._way("alarms")
        return [ALARM] if self.alarm else []

    async def is_at_target(self, entry: Entry) -> bool:
        await self._way("is_at_target")
        return self.at_target

    async def stop(self) -> None:
        await self._until_heard("stop")
        self.stops.append(now())
        self._forget()
        await asyncio.sleep(LATENCY)

    async def clear(self) -> None:
        await self._until_heard("clear")
        self.clears.append(now())
        self.alarm = False
        self._forget()
        await asyncio.sleep(10 * LATENCY)

    async def _until_heard(self, name: str) -> None:
        while True:
            try:
                await self._way(name)
            except ReplyTimeout:
                continue

            return

    def _forget(self) -> None:
        self._progress()
        self._finished = self._tickets  # as an arm does that ticks off what it throws away
        self._queue.clear()
        self._under_way = None

    async def pause(self) -> None:
        await self._way("pause")

    async def resume(self) -> None:
        await self._way("resume")


@asynccontextmanager
async def queue_over(executor: FakeExecutor) -> AsyncIterator[MotionQueue]:
    """A queue, ended as an arm does it."""
    queue = MotionQueue(executor)
    try:
        yield queue
    finally:
        await queue.aclose()
        await executor.cleanup.aclose()
