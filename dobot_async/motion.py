"""The queue of motions, for all families: put, completion, pause, stop. It never learns which arm it drives.

    put --> room? --> executor.push --> Motion (accepted) --+--> done            the arm has executed it
             ^                                              +--> ArmAlarm        the arm raised alarms
             `-- left space, counted down, asked at zero    +--> MotionStopped   stop, clear, end of the block
                                                            +--> MotionUnknown   nothing can tell
             one poller, only while somebody waits  ------->+--> ConnectionLost  the link is gone

Every Motion ends exactly once. Commands are put in the order of the calls; a full queue makes `put` wait. A ticket that
the arm has reached is no proof that the motion succeeded, so the alarms are read after it; only then a Motion is done.
"""

from __future__ import annotations

import asyncio
import math
from collections import deque
from collections.abc import AsyncIterator, Collection, Coroutine, Generator, Iterator, Mapping, Sequence
from contextlib import asynccontextmanager, contextmanager, suppress
from typing import Any, TypeVar

import anyio

from dobot_async.errors import ArmAlarm, ConnectionLost, DobotError, MotionStopped, MotionUnknown, ReplyTimeout
from dobot_async.executor import Entry, Executor
from dobot_async.wire import Command

__all__ = ["Motion", "MotionQueue", "undisturbed"]

T = TypeVar("T")
Q = TypeVar("Q")
POLL = 0.003  # seconds between two looks at an arm of which nothing tells how long it still needs
DENSE, SELDOM = 0.001, 0.05  # seconds from one look to the next, at the least and at the most
ALARMS = 0.05  # seconds after which the alarms are read as well, for a motion that an alarm keeps from ending
REFUSALS = 20  # in a row; each was settled, so that nothing is under way


class Motion:
    """One queued command; awaitable any number of times, by any number of tasks.

    Awaiting it returns when the arm has executed it, and raises ArmAlarm, MotionStopped, MotionUnknown or
    ConnectionLost when it has not. It belongs to its queue: cancelling who waits for it only ends the waiting.

    Attributes:
        entry: The command.
        name: Its name.
        moves: Whether it moves the arm.
        index: The arm's number for it, None until the arm has accepted it.
    """

    def __init__(self, queue: MotionQueue, entry: Entry) -> None:
        self.entry = entry
        self.name = entry.command.name
        self.moves = entry.command.moves
        self.index: int | None = None
        self._queue = queue
        self._ended: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._error: DobotError | None = None

    @property
    def done(self) -> bool:
        """Whether it is known to have ended, well or not. It is found out while somebody awaits a Motion of the arm."""
        return self._ended.done()

    async def wait(self, timeout: float | None = None) -> None:
        """Waits as `await motion` does, for at most so many seconds.

        Raises:
            ReplyTimeout: It has not ended yet; it goes on.
        """
        if not self.done:
            try:
                with self._queue.watching():
                    async with asyncio.timeout(timeout):
                        await asyncio.shield(self._ended)
            except TimeoutError:
                raise ReplyTimeout(f"{self} has not ended within {timeout:.3g} s; it goes on") from None

        if self._error:
            raise self._error.with_traceback(None)

    def __await__(self) -> Generator[Any, None, None]:
        return self.wait().__await__()

    def __str__(self) -> str:
        return self.name if self.index is None else f"{self.name} (index {self.index})"

    def __repr__(self) -> str:
        state = "failed" if self._error else "done" if self.done else "pending"
        return f"<Motion {self}: {state}>"

    def end(self, error: DobotError | None = None) -> None:
        """Called by the queue: how it ended. Only the first call counts."""
        if not self.done:
            self._error = error
            self._ended.set_result(None)


class MotionQueue:
    """What is put here the arm executes in order, each exactly once."""

    def __init__(self, executor: Executor) -> None:
        self._executor = executor
        executor.distress = self._distress
        self._giving_up: set[asyncio.Task[None]] = set()
        self._order = anyio.Lock(fast_acquire=True)
        self._pending: deque[Motion] = deque()
        self._entering: dict[Entry, Motion] = {}
        self._stops = 0
        self._stopping = 0
        self._stopped: DobotError = MotionStopped("the arm was stopped")
        self._watchers = 0
        self._crowded = False
        self._poller: asyncio.Task[None] | None = None
        self._stirred = asyncio.Event()
        self._observed: asyncio.Future[None] = asyncio.get_running_loop().create_future()

    @property
    def pending(self) -> int:
        """How many accepted commands are not known to have ended."""
        return len(self._pending)

    async def put(self, command: Command[Q, Any], value: Q, *, timeout: float | None = None) -> Motion:
        """Gives one command to the arm's queue and returns once the arm has accepted it.

        Args:
            command: A row of the table that may be queued.
            value: Its parameters.
            timeout: Seconds to wait for room in the arm's queue; None waits as long as the arm answers.

        Raises:
            ValueError: The parameters do not fit, or the command cannot be queued.
            ReplyTimeout: There was no room in time.
            ArmAlarm: The arm has raised alarms and makes no more room.
            MotionStopped: The queue was stopped while this waited for room.
            MotionUnknown: Nothing can tell whether the arm took it.
            ConnectionLost: The link is gone.
        """
        entry = self.prepare(command, value)
        motion = Motion(self, entry)
        await self.put_all({entry: motion}, timeout=timeout)
        return motion

    def prepare(self, command: Command[Q, Any], value: Q) -> Entry:
        """Returns a checked entry; raises ValueError or TypeError as `put` does."""
        return self._executor.prepare(command, value)

    async def put_all(self, batch: Mapping[Entry, Motion], *, timeout: float | None = None) -> None:
        """Gives several commands to the arm's queue with nothing between them; see `put`."""
        stops = self._stops
        refusals = 0
        self._entering.update(batch)
        entries = list(batch)
        failure: DobotError = MotionStopped("it was not sent: the call that put it was cancelled")
        try:
            async with asyncio.timeout(timeout) as limit:
                await self._order.acquire()

            try:
                if self._executor.under_way:
                    await self._executor.settle()

                while entries:
                    async with asyncio.timeout_at(limit.when()):
                        await self._executor.connected()
                        await self._room(stops)

                    left = len(entries)
                    await self._executor.push(self._unsent(entries, stops), self._accepted)
                    entries = [entry for entry in entries if entry in self._entering]
                    refusals = 0 if len(entries) < left else refusals + 1
                    if refusals == REFUSALS:
                        raise ReplyTimeout(f"the arm answers, but did not take {entries[0].command.name}")
            finally:
                self._order.release()
        except DobotError as error:
            failure = error
            if isinstance(error, MotionUnknown):
                await self._give_up(error)

            raise
        except TimeoutError:
            failure = ReplyTimeout(f"the arm's queue had no room within {timeout:.3g} s")
            raise failure from None
        finally:
            # What is under way is not forgotten: it ends when it is settled.
            for entry in entries:
                if entry not in self._executor.under_way and entry in self._entering:
                    self._entering.pop(entry).end(failure)

    async def join(self, timeout: float | None = None) -> None:
        """Returns when all that was put has been executed; raises the first failure among it, or ReplyTimeout."""
        for motion in list(self._pending):
            await motion.wait(timeout)

    async def update(self) -> None:
        """Asks the arm once how far it is, and ends the Motions that this decides."""
        try:
            await self._observe(alarms=True)
        except MotionUnknown as error:
            await self._give_up(error)

    async def pause(self) -> None:
        """Lets the arm finish the command that it executes, and then wait; Motions stay pending."""
        await self._executor.pause()

    async def resume(self) -> None:
        """Lets a paused arm go on."""
        await self._executor.resume()

    async def stop(self) -> None:
        """Stops the arm now, ahead of everything; all pending Motions raise MotionStopped, and the queue is empty."""
        await undisturbed(self._stop(MotionStopped("the arm was stopped")))

    async def clear(self) -> None:
        """Throws away all that is queued, the running command included; its Motions raise MotionStopped."""
        await undisturbed(self._stop(MotionStopped("the arm's queue was cleared"), halt=False))

    @contextmanager
    def stopping(self, error: DobotError) -> Iterator[None]:
        """To be entered before the arm is told to stop: of what it ticks off meanwhile nothing counts as done."""
        self._refuse(error)
        self._stopping += 1
        try:
            yield
        finally:
            self._stopping -= 1

    def fail(self, error: DobotError) -> None:
        """Ends all Motions, and the puts that wait for room, with an error."""
        self._refuse(error)
        self._end_all(error, self._executor.under_way)

    def _end_all(self, error: DobotError, under_way: Collection[Entry]) -> None:
        """Ends all Motions that are pending or under way."""
        self._stirred.set()
        pending, self._pending = self._pending, deque()
        for motion in pending:
            motion.end(error)

        for entry in under_way:
            if entry in self._entering:
                self._entering.pop(entry).end(error)

        self._tell()

    async def aclose(self) -> None:
        """Ends the poller and all Motions; the arm is left as it is."""
        self.fail(MotionStopped("the connection's block ended before the motion was known to be done"))
        tasks = self._giving_up | ({self._poller} if self._poller else set())
        for task in tasks:
            task.cancel()

        if tasks:
            await asyncio.wait(tasks)

    @asynccontextmanager
    async def exclusively(self) -> AsyncIterator[None]:
        """While this is entered, nobody else puts anything."""
        async with self._order:
            yield

    @contextmanager
    def watching(self) -> Iterator[None]:
        """While this is entered, the arm is asked how far it is."""
        self._watchers += 1
        if self._poller is None or self._poller.done():
            self._poller = asyncio.create_task(self._poll(), name="dobot_async poller")

        try:
            yield
        finally:
            self._watchers -= 1

    def _accepted(self, entry: Entry, ticket: int | None) -> None:
        """The arm has taken a command, or is known not to have taken it."""
        motion = self._entering.pop(entry, None)
        if ticket is None:
            if motion:
                motion.end(MotionStopped("the arm did not take it before the call that put it was cancelled"))

            return

        if motion:
            motion.index = ticket
            self._pending.append(motion)

    def _check(self, stops: int) -> None:
        """Raises if the queue was stopped since it had been stopped so often."""
        if self._stops != stops:
            raise self._stopped.with_traceback(None)

    async def _room(self, stops: int) -> None:
        """Returns when the arm's queue has room: asked only when what was counted down is used up."""
        self._check(stops)
        while not self._executor.room:
            room = await self._executor.left_space()
            self._check(stops)
            if not room:
                self._crowded = True
                with self.watching():
                    await asyncio.shield(self._observed)

                self._check(stops)

    def _unsent(self, entries: Sequence[Entry], stops: int) -> Iterator[Entry]:
        """Yields entries until the queue is stopped."""
        for entry in entries:
            if self._stops != stops:
                return

            yield entry

    def _refuse(self, error: DobotError) -> None:
        """From now on nothing is sent any more that was put before."""
        self._stops += 1
        self._stopped = error

    async def _stop(self, error: DobotError, *, halt: bool = True) -> None:
        """Stops, ends all Motions, waits for the put that is under way, and empties the queue behind it."""
        with self.stopping(error):
            try:
                if halt:
                    await self._executor.halt()

                self.fail(error)
                async with self._order:
                    under_way = list(self._executor.under_way)
                    await self._executor.reset()
                    self._end_all(error, under_way)  # who puts from now on waits for this lock, and goes on
            except DobotError as failure:
                self.fail(failure)
                raise

    def _distress(self, error: MotionUnknown) -> None:
        """Gives up although nobody asks just now."""
        task = asyncio.create_task(self._give_up(error), name="dobot_async stop")
        self._giving_up.add(task)
        task.add_done_callback(self._giving_up.discard)

    async def _give_up(self, error: DobotError) -> None:
        """Stops the arm because of an error that nobody can mend, as far as the link still allows."""
        try:
            await undisturbed(self._stop(error))
        except DobotError:
            self.fail(error)

    async def _poll(self) -> None:
        """Observes the arm while somebody waits."""
        clock = asyncio.get_running_loop().time
        alarms_at = -math.inf
        while self._watchers:
            self._stirred.clear()
            now, pause = clock(), POLL
            alarms = now >= alarms_at + ALARMS
            if alarms:
                alarms_at = now

            try:
                await self._executor.connected()
                await self._observe(alarms=alarms)
                self._crowded = False
                self._tell()
                pause = await self._pause()
            except ReplyTimeout as error:
                self.fail(ConnectionLost(f"the arm no longer answers: {error}"))
            except MotionUnknown as error:
                await self._give_up(error)
            except DobotError as error:
                self.fail(error)

            await self._rest(max(pause, now + DENSE - clock()))

    async def _rest(self, seconds: float) -> None:
        """Leaves the arm alone, until what it was to do is thrown away: it may have something shorter to do then."""
        await asyncio.sleep(min(seconds, POLL))
        if seconds <= POLL:
            return

        with suppress(TimeoutError):
            async with asyncio.timeout(seconds - POLL):
                await self._stirred.wait()

    async def _pause(self) -> float:
        """Returns how long the arm may be left alone: half of what the next motion needs at the least."""
        least = await self._executor.remaining(self._pending[0].entry) if self._pending else None
        return POLL if least is None else min(least / 2, SELDOM)

    async def _observe(self, *, alarms: bool) -> None:
        """Asks the arm how far it is, and ends the Motions that this decides."""
        if self._executor.under_way and not self._order.locked():
            async with self._order:
                await self._executor.settle()

        # What a stop ends the arm ticks off as it does what is done; nothing that is read while it goes on tells which.
        stops = self._stops
        ticket = await self._executor.completed()
        if self._stopping or self._stops != stops:
            return

        reached = [] if ticket is None else [motion for motion in self._pending if (motion.index or 0) <= ticket]
        if not (reached or alarms):
            return

        faults = await self._executor.faults()
        if self._stopping or self._stops != stops:
            return

        for motion in reached:
            if not (faults and motion.moves):
                motion.end()

        # What takes up the room of an alarmed arm may be a command whose put was cancelled, and nobody's Motion.
        if faults and (self._crowded or any(motion.moves and not motion.done for motion in self._pending)):
            await self._alarmed(reached, faults)

        while self._pending and self._pending[0].done:
            self._pending.popleft()

    async def _alarmed(self, reached: Sequence[Motion], faults: Sequence[object]) -> None:
        """Stops the arm because of alarms.

        The arm ticks off a motion that fails as it does one that succeeds. Of several that it has ticked off since the
        alarms were last seen clear, the last has failed; of another, only an arm that stands where it led shows that it
        has not.
        """
        text = "; ".join(map(str, faults))
        error = ArmAlarm(f"the arm raised alarms: {text}", faults)
        with self.stopping(error):
            await self._executor.halt()
            for motion in [motion for motion in reached if motion.moves][:-1]:
                if await self._executor.stands_at(motion.entry):
                    motion.end()

        await self._stop(error, halt=False)

    def _tell(self) -> None:
        """Wakes those who wait for the next observation."""
        if not self._observed.done():
            self._observed.set_result(None)

        self._observed = asyncio.get_running_loop().create_future()


async def undisturbed(work: Coroutine[Any, Any, T]) -> T:
    """Runs work to its end even if the caller is cancelled meanwhile; the cancellation goes on after it."""
    task = asyncio.create_task(work)
    cancelled: asyncio.CancelledError | None = None
    with anyio.CancelScope(shield=True):
        while not task.done():
            try:
                await asyncio.wait([task])
            except asyncio.CancelledError as error:
                cancelled = error

    if cancelled:
        raise cancelled from (None if task.cancelled() else task.exception())

    return task.result()
