"""How a Magician takes queued commands, each exactly once, whatever the link does. docs/exactly-once.md has the proof.

    push --> sent --acknowledged with the next index--> taken
               |
               `--silence--> settle: count by reading, then probe --> taken | not taken | MotionUnknown

Manual 2.2.1 (3), 2.19.
"""

from __future__ import annotations

import asyncio
import math
from collections import deque
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, TypeVar

from dobot_async.errors import MotionUnknown, ProtocolError, ReplyTimeout
from dobot_async.executor import Accepted, Entry
from dobot_async.link import Link
from dobot_async.magician import commands as c
from dobot_async.magician.alarms import Alarm, faults
from dobot_async.magician.approach import Approach
from dobot_async.magician.books import Attempt, Books, Verdict
from dobot_async.magician.frame import Frame
from dobot_async.magician.reach import destination, is_relative
from dobot_async.magician.readings import GARBAGE, SILENCE, Readings
from dobot_async.posted import Posted
from dobot_async.wire import Command, Number, u64

__all__ = ["MagicianExecutor", "Surplus"]

Q = TypeVar("Q")
R = TypeVar("R")
INDEX: Number[int] = Number(u64)
LEFT_SPACE = c.GET_QUEUED_CMD_LEFT_SPACE
PROBES = 60  # in a row, none acknowledged although the arm answers what it is asked
ARRIVED = 0.5  # mm and degrees
WARY = 64  # commands that are sent one at a time after one was not acknowledged


class Surplus:
    """An event: the arm took more commands than were sent, but only such as may be done twice.

    Attributes:
        count: How many more.
    """

    def __init__(self, count: int) -> None:
        self.count = count

    def __repr__(self) -> str:
        return f"<Surplus of {self.count} queued commands: doubled by the network, or queued by somebody else>"


@dataclass(slots=True)
class Burst:
    """Commands that were sent one behind the other, and what was asked behind the last of them.

    Attributes:
        posted: The commands that are not known to be answered.
        size: How many commands.
        behind: Tells the highest index that was acknowledged by then, and the left space.
    """

    posted: deque[Posted[int]] = field(default_factory=deque)
    size: int = 0
    behind: Posted[tuple[int, int]] | None = None

    def forget(self) -> None:
        """Stops waiting; may be called again."""
        for each in (*self.posted, self.behind):
            if each:
                each.forget()


class MagicianExecutor:
    """The arm's own queue, over a link.

    Attributes:
        room: How many commands it can take for certain, as far as was counted down.
        readings: What the arm says of itself.
    """

    def __init__(self, link: Link[Frame], window: int, check: Callable[[Any], None]) -> None:
        self.room = 0
        self.distress: Callable[[MotionUnknown], None] = lambda _: None
        self.readings = Readings(link, self._restarted)
        self._link = link
        self._window = window
        self._check = check
        self._books = Books()
        self._approach = Approach(partial(self.readings.ask, c.GET_POSE), self._now)
        self._heard = -1
        self._cleared = -1
        self._summed_from = 0
        self._outages = 0
        self._capacity: int | None = None
        self._empty = False
        self._verified = False
        self._left = 0
        self._wary = 0
        self._relative: str | None = None
        self._controlled_at = self._posted_at = self._queued_at = -math.inf
        self._accepted: Accepted = lambda _entry, _ticket: None
        link.stray = self._stray

    @property
    def under_way(self) -> Collection[Entry]:
        """The commands that were sent and not acknowledged."""
        return self._books.entries

    async def connected(self) -> None:
        """Returns when the link is open, and after an outage when the arm is known to be in the same run as before."""
        await self._link.opened()
        if self._outages != self._link.outages:
            await self.readings.recognise(self._books.last)
            self._outages = self._link.outages

    def prepare(self, command: Command[Q, Any], value: Q) -> Entry:
        """Returns a checked and encoded command."""
        frame = self._link.frame(command, value, queued=True)
        self._check(value)
        return Entry(command, value, frame)

    async def left_space(self) -> int:
        """Returns how many commands the arm's queue can still take; opens the books if it can. Manual 2.19.8."""
        left = await self._read_left()
        if left and self._books.last is None:
            left = await self._read_left() if await self._open() else 0

        self.room = left
        return left

    async def push(self, entries: Iterator[Entry], accepted: Accepted) -> None:
        """Queues commands in order, at most `window` unacknowledged; returns early if the arm did not take them all."""
        await self.settle()
        self._accepted = accepted
        if self._books.last is None and not await self._open():
            return

        try:
            await self._stream(entries)
        except ReplyTimeout:
            self._wary = WARY
            await self._settle()

    async def settle(self) -> None:
        """Finds out what became of the commands under way."""
        for entry in await self._settle():
            self._accepted(entry, None)

    async def completed(self) -> int | None:
        """Returns the index of the last finished command, None if the arm does not say. Manual 2.19.7."""
        index = await self.readings.index(self._books.last)
        if index is None or self._books.last is None:
            return None

        if self._link.disorder and index > self.readings.completed:
            # A doubled command shifts the indices of those behind it, so an index counts only if the sum is right.
            began = self._now()
            surplus = await self._count()
            if surplus is None or self._books.last is None:
                return None

            self._recount(surplus, began)

        self.readings.completed = max(self.readings.completed, index)
        if index == self._books.last and not self._books.under_way:
            self._relative, self._empty = None, True

        return index

    async def remaining(self, entry: Entry) -> float | None:
        """Returns seconds within which a motion cannot end, as the arm's pose tells. Manual 2.3.1."""
        return await self._approach.remaining(entry)

    async def faults(self) -> Sequence[Alarm]:
        """Returns the alarms that keep the arm from moving. Manual 2.5.1."""
        return faults(await self.readings.alarms())

    async def stands_at(self, entry: Entry) -> bool:
        """Returns whether the arm stands where an absolute motion leads."""
        target = destination(entry.value)
        return target is not None and target.distance(await self.readings.ask(c.GET_POSE)) < ARRIVED

    async def halt(self) -> None:
        """Stops the arm where it is, jogs included, ahead of everything else. Manual 2.19.3 and 2.10.4."""
        await asyncio.gather(
            self.readings.ask(c.SET_QUEUED_CMD_FORCE_STOP_EXEC, urgent=True),
            self.readings.ask(c.SET_JOG_CMD, c.JOGCmd(is_joint=False, cmd=c.JOGKey.IDLE), urgent=True),
        )
        self._controlled_at = self._now()

    async def reset(self) -> None:
        """Empties the arm's queue and lets it run again. Manual 2.19.6 and 2.19.1."""
        await self._control(c.SET_QUEUED_CMD_CLEAR)
        await self._control(c.SET_QUEUED_CMD_START_EXEC)
        if self._books.under_way:
            # Whether the arm took them before it was cleared no longer matters, but the books have to be opened anew.
            self._books = Books()

        self._cleared = -1 if self._books.last is None else self._books.last
        self._relative, self._empty = None, True
        self.room = 0

    async def pause(self) -> None:
        """Lets the arm finish the command that it executes, and then wait. Manual 2.19.2."""
        await self._control(c.SET_QUEUED_CMD_STOP_EXEC)

    async def resume(self) -> None:
        """Lets the arm go on. Manual 2.19.1."""
        await self._control(c.SET_QUEUED_CMD_START_EXEC)

    async def download(self, entries: Sequence[Entry], loops: int) -> None:
        """Stores commands in the arm's flash as a program. Manual 2.19.4 and 2.19.5."""
        await self.left_space()
        await self.settle()
        await self._link.request(c.SET_QUEUED_CMD_START_DOWNLOAD, c.QueuedCmdStartDownload(loops, len(entries)))
        try:
            self.room = len(entries)
            await self.push(iter(entries), lambda _entry, _ticket: None)
        finally:
            self.room = 0
            await self._link.request(c.SET_QUEUED_CMD_STOP_DOWNLOAD, None, urgent=True)

    async def _control(self, command: Command[None, None]) -> None:
        """Sends a command that steers the queue, so late that nothing that was sent before arrives behind it."""
        await self._sleep_until(max(self._controlled_at, self._posted_at) + self._link.disorder)
        await self.readings.ask(command, urgent=True)
        self._controlled_at = self._now()

    async def _stream(self, entries: Iterator[Entry]) -> None:
        """Sends commands as there is room, at most `window` of them unacknowledged."""
        bursts = deque([Burst()])
        try:
            while True:
                await self._send(entries, bursts)
                burst = bursts[0]
                if not burst.posted:
                    return

                index = await burst.posted[0].answer()
                burst.posted.popleft()
                if not burst.posted and burst is not bursts[-1]:
                    await self._take(burst, index, sent_since=sum(later.size for later in bursts) - burst.size)
                    bursts.popleft()
        finally:
            for burst in bursts:
                burst.forget()

    async def _send(self, entries: Iterator[Entry], bursts: deque[Burst]) -> None:
        """Sends what may be sent now, and behind every window's length something to read."""
        window = 1 if self._wary else self._window
        while sum(len(burst.posted) for burst in bursts) < window:
            burst = bursts[-1]
            entry = next(entries, None) if self.room else None
            if entry:
                await self._verify()
                burst.posted.append(await self._post(entry))
                burst.size += 1

            # Where the room is used up, an answer that is on its way tells of more.
            if burst.size == window or (burst.size and not entry and (self.room or len(bursts) == 1)):
                if burst.size > 1 or (window > 1 and not self.room):
                    burst.behind = await self._ask_behind(burst)

                bursts.append(Burst())

            if not entry:
                return

    async def _ask_behind(self, burst: Burst) -> Posted[tuple[int, int]]:
        """Asks for the left space behind a burst.

        An acknowledgement does not say whose it is: with one command lost, the next one's would pass for it. But this
        is answered behind all of the burst's own: the highest index by then says how many of it the arm took.
        """

        def accept(frame: Frame) -> tuple[int, int]:
            left = LEFT_SPACE.reply.decode(frame.params)
            for each in burst.posted:
                each.answer_with(self._heard)

            return self._heard, left

        question = self._link.frame(LEFT_SPACE, None)
        return await self._link.post(question, accept, name="a window of commands", timeout=SILENCE, tombstone=True)

    async def _take(self, burst: Burst, index: int, *, sent_since: int) -> None:
        """Enters a burst the last of which got an index; raises ReplyTimeout if that is not true of all of it."""
        if burst.behind:
            index, left = await burst.behind.answer()
            self.room = max(self.room, left - sent_since)
            if self._books.last is None or index != self._books.last + burst.size:
                raise ReplyTimeout("some of a window of commands were not acknowledged")

        self._queued_at = self._now()
        self._wary = max(0, self._wary - burst.size)
        for each in range(index - burst.size + 1, index + 1):
            entry, surplus = self._books.acknowledge(each)
            self._accepted(entry, each)
            self._surplus(surplus)

    async def _verify(self) -> None:
        """Makes sure, on a link that doubles messages, that nothing was taken twice: it would pass for what comes next.

        Either the command or its acknowledgement may be on its way a second time: it takes the disorder of both ways.
        """
        if not self._link.disorder or self._books.under_way or self._verified:
            return

        await self._sleep_until(self._queued_at + 2 * self._link.disorder)
        began = self._now()
        self._recount(await self._count(), began)

    def _recount(self, surplus: int | None, began: float) -> None:
        """Brings the books up to date with a count that was made while nothing was under way."""
        if surplus is None or self._books.last is None or self._books.under_way:
            return

        self._verified = began >= self._queued_at + 2 * self._link.disorder
        if surplus:
            self._books.last += surplus
            self._surplus(surplus)

    async def _post(self, entry: Entry, *, probe: bool = False, counted: int | None = None) -> Posted[int]:
        """Sends a command, and enters it as under way."""
        await self._sleep_until(self._controlled_at + self._link.disorder)

        def leaving() -> None:
            self._posted_at, self._verified = self._now(), False
            self.room = max(0, self.room - 1)
            self._books.under_way.append(Attempt(entry, self._posted_at, probe, counted))
            self._empty = False
            if is_relative(entry.value):
                self._relative = entry.command.name

        return await self._link.post(
            entry.frame, self._index_of, name=entry.command.name, timeout=SILENCE, leaving=leaving
        )

    def _index_of(self, frame: Frame) -> int:
        """The index in an acknowledgement; one that was heard already is late or doubled."""
        index = INDEX.decode(frame.params)
        if index <= self._heard:
            raise ProtocolError(f"index {index} was heard already")

        self._heard = index
        return index

    def _stray(self, frame: Frame) -> None:
        """An acknowledgement that nobody waits for: late, or of a command that the network delivered twice."""
        last = self._books.last
        if not frame.queued or len(frame.params) != INDEX.struct.size or last is None or self._books.under_way:
            return

        index = INDEX.decode(frame.params)
        if last < index < last + GARBAGE:
            self._heard = max(self._heard, index)
            self._books.last = index
            try:
                self._surplus(index - last)
            except MotionUnknown as error:
                self.distress(error)

    def _surplus(self, count: int) -> None:
        """The arm took more than was sent: absolute motions may be done twice, nothing else."""
        if count <= 0:
            return

        if self._relative:
            raise MotionUnknown(
                f"the arm took {count} commands more than were sent, and {self._relative} must not run twice: the "
                "network doubled one, or another program queues commands on this arm"
            )

        self._link.events.publish(Surplus(count))

    async def _open(self) -> bool:
        """Opens the books with the index of a WAIT of 0 ms; returns whether the arm's queue had room for it."""
        cleared = self._empty
        for attempt in range(PROBES):
            index = await self._probe()
            if index is not None:
                self._books, self._summed_from = Books(index), index
                if cleared and not attempt:
                    self._cleared = self._summed_from = index - 1
                else:
                    await self._confirm(index)

                return True

            # What is asked behind a probe is answered behind its acknowledgement, which can be none of the next one's.
            if not await self._read_left():
                return False

            await asyncio.sleep(2 * self._link.disorder)

        raise ReplyTimeout("the arm does not acknowledge a WAIT of 0 ms; nothing was queued")

    async def _confirm(self, index: int) -> None:
        """Counts after the books were opened with difficulty, or finds out what there is to count from.

        An arm that is paused has finished nothing yet: what lies in its queue is what it took since it was cleared.
        """
        more = await self._count()
        if more:
            self._books.last = index + more
        elif more is None and self._capacity is not None:
            self._cleared = self._summed_from = index + await self._read_left() - self._capacity

    async def _settle(self) -> list[Entry]:
        """Finds out what became of the commands under way, and enters it; returns those that the arm did not take."""
        books = self._books
        names = ", ".join(entry.command.name for entry in books.entries)
        for attempt in range(PROBES if books.under_way else 0):
            if books.last is None:
                break  # the arm was switched off and on

            await self._sleep_until(books.under_way[-1].sent_at + self._link.disorder)
            try:
                await self._link.opened()
                if not attempt:
                    await self.readings.alarms()

                counted = await self._count()
            except ReplyTimeout:
                raise MotionUnknown(f"the arm fell silent and does not say whether it took {names}") from None

            if counted is not None and (self._link.disorder or not self._left):
                # A probe would find no room, or prove nothing: its acknowledgement may be that of its second copy.
                verdict = books.conclude(counted)
            else:
                # What the count has found was acknowledged before the probe: if that comes now, it is late.
                self._heard = max(self._heard, books.last + (counted or 0))
                index = await self._probe(counted)
                if index is None:
                    continue

                if books is not self._books:
                    break  # somebody else found out meanwhile that the arm was switched off and on

                verdict = books.prove(index, exact=not self._link.disorder)

            if verdict is None:
                raise MotionUnknown(f"the arm took some and lost some, and nothing tells which, of {names}")

            return self._enter(verdict)

        if books.under_way:
            raise MotionUnknown(f"the arm answers, but does not say whether it took {names}")

        return []

    def _enter(self, verdict: Verdict) -> list[Entry]:
        """Tells who put them which commands the arm took; returns the others, for which there may have been no room."""
        if verdict.lost:
            self.room = 0

        for entry, index in verdict.taken:
            self._accepted(entry, index)

        self._surplus(verdict.surplus)
        return verdict.lost

    async def _probe(self, counted: int | None = None) -> int | None:
        """Queues a WAIT of 0 ms; returns its index, None if it is not acknowledged."""
        try:
            posted = await self._post(self.prepare(c.SET_WAIT_CMD, c.WAITCmd(0)), probe=True, counted=counted)
            return await posted.answer()
        except ReplyTimeout:
            return None
        finally:
            self._queued_at = self._now()

    async def _count(self) -> int | None:
        """Counts by reading how many commands the arm took since the last one in the books; None if it does not add up.

        What it took is what it has finished, or was told to forget, and what lies in its queue; but what it was told to
        forget before the books were opened is not known until it has finished something of ours. If a command is
        finished between the two readings, the sum is too high where the queue was read first, and too low where it was
        read last. What is queued, settled or cleared meanwhile makes them worthless.
        """
        if self._books.last is None or self._capacity is None:
            return None

        state, left = self._state(), await self._read_left()
        while (finished := await self.readings.index(self._books.last)) is not None:
            last, _, cleared = state
            if last is None:
                return None

            if max(finished, cleared) < self._summed_from:
                return None

            most = max(finished, cleared) + self._capacity - left - last
            still = state == self._state()
            if still and most <= 0:
                return 0 if most == 0 else None

            before, state, left = (state, left), self._state(), await self._read_left()
            if still and before == (state, left) and state == self._state():
                return most

        return None

    def _state(self) -> tuple[int | None, int, int]:
        """What a count is made against."""
        return self._books.last, len(self._books.under_way), self._cleared

    def _restarted(self) -> None:
        """The arm was switched off and on: it counts its commands anew, and its queue is empty."""
        self.room = 0
        self._heard = self._cleared = -1
        self._summed_from = 0
        self._books = Books(under_way=self._books.under_way)  # until `reset`: their Motions are still to be ended

    async def _read_left(self) -> int:
        """Reads the left space; that of an empty queue is its capacity."""
        empty = self._empty
        self._left = await self.readings.ask(LEFT_SPACE)
        if empty and self._empty:
            self._capacity = self._left

        return self._left

    async def _sleep_until(self, when: float) -> None:
        seconds = when - self._now()
        if seconds > 0:
            await asyncio.sleep(seconds)

    def _now(self) -> float:
        return asyncio.get_running_loop().time()
