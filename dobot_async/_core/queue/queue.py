"""The queue of motions, for all families: put, completion, pause, stop. It never learns which arm it drives.

    put --> Outbox --writer--> executor.submit --> pending --+--> done            the arm has executed it
                                                             +--> ArmAlarm        the arm raised alarms
             one poller, only while somebody waits  -------->+--> MotionStopped   stop, clear, end of the block
                                                             +--> MotionUnknown   nothing can tell; the arm is stopped
                                                             +--> ConnectionLost  the link is gone

Every Motion ends exactly once. One writer task sends, in the order of the calls, and lives while there is something to
send; a full queue makes `put` wait. A ticket that the arm has reached is no proof that the motion succeeded, so the
alarms are read after it; only then a Motion is done. A stop ends all Motions at once, and is repeated until the arm has
heard it, by a task that outlives who asked for it; nothing is sent before it is done.
"""

from __future__ import annotations

import asyncio
import logging
from collections import deque
from collections.abc import Coroutine, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from typing import Any, TypeVar, overload

from dobot_async._core.queue.epoch import Epoch
from dobot_async._core.queue.executor import Entry, Executor, alarmed, in_motions, unseen
from dobot_async._core.queue.motion import WITHDRAWN, Motion, Outbox
from dobot_async._core.queue.poller import StatusPoller
from dobot_async._core.queue.stopper import Stopper
from dobot_async._core.queue.stream import Steps, Stream, StreamStep
from dobot_async._core.queue.writer import Writer
from dobot_async._core.util.arguments import check_timeout
from dobot_async._core.util.tasks import STAYING
from dobot_async.errors import (
    ArmAlarm,
    ConnectionLost,
    DobotError,
    MotionStopped,
    MotionUnknown,
    ReplyTimeout,
    another,
)
from dobot_async.wire import Command

__all__ = ["MotionQueue"]

Q = TypeVar("Q")
S = TypeVar("S", bound=StreamStep)
T = TypeVar("T")
logger = logging.getLogger("dobot_async.queue")


class MotionQueue:
    """What is put here the arm executes in order, each exactly once.

    Attributes:
        epoch: What a motion in several steps is bound to; a stop ends it, and the next one is here.
    """

    def __init__(self, executor: Executor) -> None:
        self.epoch = Epoch()
        self._executor = executor
        executor.on_unknown.add(self.give_up)
        self._outbox = Outbox(self._accepted)
        self._pending: deque[Motion] = deque()
        self._poller = StatusPoller(self)
        self._writer = Writer(executor, self._outbox, self._poller, self)
        self._stopper = Stopper(executor, self)
        self._failure: DobotError | None = None

    @property
    def pending(self) -> int:
        """How many accepted commands are not known to have ended."""
        return len(self._pending)

    async def put(
        self, command: Command[Q, Any], value: Q, *, timeout: float | None = None, epoch: Epoch | None = None
    ) -> Motion:
        """Give one command to the arm's queue and return once the arm has accepted it.

        Args:
            command: A row of the table that may be queued.
            value: Its parameters.
            timeout: Seconds to wait for room in the arm's queue; None waits as long as the arm answers.
            epoch: The epoch in which the steps that led here began, if others came before.

        Raises:
            ValueError: The parameters do not fit, or the command cannot be queued.
            ReplyTimeout: There was no room in time, or the arm is silent; it was not sent.
            ArmAlarm: The arm has raised alarms and makes no more room.
            MotionStopped: The queue was stopped while this waited.
            MotionUnknown: Nothing can tell whether the arm took it.
            ConnectionLost: The link is gone.
        """
        motion = Motion(self, self.prepare(command, value))
        await self.put_all([motion], timeout=timeout, epoch=epoch)
        return motion

    def prepare(self, command: Command[Q, Any], value: Q) -> Entry:
        """Return a checked entry; raise ValueError or TypeError as `put` does."""
        return self._executor.prepare(command, value)

    async def put_all(
        self, motions: Sequence[Motion], *, timeout: float | None = None, epoch: Epoch | None = None
    ) -> None:
        """Give several commands to the arm's queue with nothing between them; see `put`.

        Args:
            motions: What is to be sent.
            timeout: Seconds to wait for room.
            epoch: The epoch in which the steps that led here began; a stop since then lets nothing be sent.
        """
        timeout, call = check_timeout(timeout), object()
        for motion in motions:
            motion.call = call

        try:
            (epoch or self.epoch).check()
        except DobotError as error:
            for motion in motions:
                motion.end(error)

            raise

        self._outbox.add(motions)
        self.write_on()
        try:
            async with asyncio.timeout(timeout):
                await self._stopper.over()
                for motion in motions:
                    await motion.accepted_or_ended.wait()
                    if motion.index is None:
                        break
        except DobotError as error:
            self._outbox.withdraw(motions, error)
            raise
        except TimeoutError:
            late = ReplyTimeout(f"the arm's queue had no room within {timeout:.3g} s")
            self._outbox.withdraw(motions, late)
            raise another(late) from None
        except asyncio.CancelledError:
            self._outbox.withdraw(motions, WITHDRAWN)
            raise

        failed = next((motion for motion in motions if motion.index is None), None)
        if failed and (failure := failed.exception()):
            raise another(failure)

    @overload
    def stream(self, steps: Steps[Coroutine[Any, Any, Motion]]) -> Stream[Motion]: ...

    @overload
    def stream(self, steps: Steps[S]) -> Stream[S]: ...

    def stream(self, steps: Steps[Any]) -> Stream[Any]:
        """Queue steps as they come, as fast as the arm takes them; to be awaited, or iterated over as they are done.

            await arm.queue.stream(arm.queue.path_to(x, y, 0) for x, y in points)
            async for step in arm.queue.stream(program): ...

        The steps queued belong to the queue: who cancels, or leaves the loop, ends the queueing of further ones.

        Args:
            steps: An iterable or async iterable of verbs of this queue, each not awaited yet, or of objects with a
                `command` and its `value`. It is drawn from as there is room.

        Returns:
            What yields, in order, the Motion of each verb, or each object, once the arm has executed it.

        Raises:
            ValueError: A step does not fit; those before it go on.
            DobotError: As `put` and the Motions do. A note, and `steps`, name the step that failed, or the first and
                the last one that may have.
        """
        return Stream(self, steps)

    async def join(self, timeout: float | None = None) -> None:
        """Return when all that was put has been executed.

        Args:
            timeout: Seconds for all of it.

        Raises:
            ReplyTimeout: Something is still to be done; it goes on.
            DobotError: The first failure since the last `join`, stops by this program aside.
        """
        try:
            async with asyncio.timeout(check_timeout(timeout)):
                for motion in [*self._pending, *self._outbox.unaccepted]:
                    await motion.wait()
        except DobotError:
            self._failure = None
            raise
        except TimeoutError:
            raise ReplyTimeout(f"{self.pending} commands have not ended within {timeout:.3g} s; they go on") from None

        failure, self._failure = self._failure, None
        if failure:
            raise another(failure)

    async def update(self) -> None:
        """Ask the arm once how far it is, and end the Motions that this decides; wait for a stop that is under way."""
        try:
            await self._stopper.over()
            await self.look(alarms=True)
        except MotionUnknown as error:
            self.give_up(error)

    async def pause(self) -> None:
        """Let the arm finish the command that it executes, and then wait; Motions stay pending."""
        await self._executor.pause()

    async def resume(self) -> None:
        """Let a paused arm go on; a stop ends this call, which raises MotionStopped."""
        await self.beside(self._executor.resume())

    async def stop(self, *, timeout: float = STAYING) -> None:
        """Stop the arm now, ahead of everything; all pending Motions raise MotionStopped, and the queue is empty.

        Args:
            timeout: Seconds to wait until the arm has acknowledged it. It is repeated after that, too, and when this
                call is cancelled, until the arm acknowledges it or the connection ends.

        Raises:
            ReplyTimeout: The arm has not acknowledged it yet.
            ConnectionLost: The link is gone.
        """
        await self._stop(MotionStopped("the arm was told to stop"), timeout, halt=True)

    async def clear(self, *, timeout: float = STAYING) -> None:
        """Throw away all that is queued, the running command included; its Motions raise MotionStopped. See `stop`."""
        await self._stop(MotionStopped("the arm's queue was cleared"), timeout, halt=False)

    def begin_stop(
        self, error: DobotError, *, halt: bool = True, doubtful: Sequence[Motion] = ()
    ) -> asyncio.Task[None]:
        """End all Motions, and begin to stop the arm; return the task that repeats it until the arm has heard it.

        Args:
            error: What the Motions raise.
            halt: False only empties the queue.
            doubtful: Motions that count as done if the arm, once it stands, stands at their targets.
        """
        return self._stopper.begin(error, halt=halt, doubtful=doubtful)

    def begin_own_stop(self, error: DobotError, *, halt: bool = True) -> asyncio.Task[None]:
        """Begin to stop the arm for who knows of it: `join` does not tell of this stop again; see `begin_stop`."""
        stop = self.begin_stop(error, halt=halt)
        self._failure = None
        return stop

    def stopping(self) -> AbstractContextManager[None]:
        """While this is entered nothing is sent, and nothing that the arm ticks off counts as done."""
        return self._stopper.holding()

    def fail(self, error: DobotError, *, spare: Sequence[Motion] = ()) -> None:
        """End all Motions, and the puts that wait, with an error.

        Args:
            error: What they raise.
            spare: Those that are left pending.
        """
        self.epoch = self.epoch.end(error)
        self._poller.stir()
        ending = [motion for motion in self._pending if motion not in spare]
        self._pending = deque(spare)
        if self._outbox.drop(error) or ending:
            self._failure = self._failure or error

        for motion in ending:
            motion.end(error)

    def give_up(self, error: DobotError) -> None:
        """End everything because of an error that nobody can mend; the arm is stopped if it can be reached."""
        if isinstance(error, ConnectionLost):
            self.fail(error)
        else:
            if isinstance(error, ArmAlarm):
                error = in_motions(error, self._first_moving())

            logger.warning("%s; the arm is told to stop", error)
            self.begin_stop(error)

    async def aclose(self) -> None:
        """End the writer, the poller and all Motions; the arm is left as it is."""
        self.fail(MotionStopped("the connection's block ended before the motion was known to be done"))
        await self._writer.ended()
        await self._poller.aclose()

    def watch(self, seconds: float) -> None:
        """Ask the arm how far it is, for so many seconds at least."""
        self._poller.watch(seconds)

    def watching(self) -> AbstractContextManager[None]:
        """While this is entered, the arm is asked how far it is."""
        return self._poller.watching()

    async def exclusively(self, work: Coroutine[Any, Any, None], what: str, epoch: Epoch | None = None) -> None:
        """Run work while nothing is sent; a stop ends it, and raises MotionStopped.

        Args:
            work: What is to be done.
            what: Its name.
            epoch: The epoch in which the steps that led here began.
        """
        await self._writer.exclusively(work, what, epoch or self.epoch)

    async def beside(self, work: Coroutine[Any, Any, T], epoch: Epoch | None = None) -> T:
        """Run work that sets the arm in motion without a Motion of its own, such as the begin of a jog.

        A stop ends it before the arm is told to stop, so that nothing is repeated behind the stop.

        Args:
            work: What is to be done.
            epoch: The epoch in which the steps that led here began.

        Raises:
            MotionStopped: The arm was stopped meanwhile.
        """
        return await self._stopper.beside(work, epoch or self.epoch)

    async def stops_heard(self) -> None:
        """Return when no stop goes on any more; raise ReplyTimeout if the arm does not hear it."""
        await self._stopper.over()

    @property
    def next(self) -> Motion | None:
        """The Motion that ends next, None if none is pending."""
        return self._pending[0] if self._pending else None

    async def look(self, *, alarms: bool, index: bool = True) -> None:
        """Ask the arm how far it is, and end the Motions that this decides.

        Args:
            alarms: Read the alarms even if no Motion has ended.
            index: False reads them alone.
        """
        # What a stop ends the arm ticks off as it does what is done: nothing that is read while it goes on tells which.
        if not self._stopper.under_way:
            with self._unless_stopped():
                await self._look(self._stopper.count, alarms=alarms, index=index)

    async def _look(self, stops: int, *, alarms: bool, index: bool) -> None:
        ticket = await self._executor.completed() if index else None
        reached = [motion for motion in self._pending if ticket is not None and (motion.index or 0) <= ticket]
        if self._stopper.count != stops or not (reached or alarms):
            return

        blocking = await self._executor.alarms()
        if self._stopper.count != stops:
            return

        if blocking and not index:
            await self._look(stops, alarms=True, index=True)  # first, which of them was done
            return

        for motion in reached:
            if not (blocking and motion.moves):
                motion.end()

        if blocking and any(motion.moves and not motion.ended for motion in self._pending):
            # The arm ticks off a motion that fails as it does one that succeeds. Of several that it has ticked off
            # since the alarms were last clear the last one failed; another one is done if the arm stands at its target.
            failed = [motion for motion in reached if motion.moves and not motion.ended]
            suspects = failed or self._first_moving()
            self.begin_stop(in_motions(alarmed(blocking), suspects), doubtful=failed[:-1])

        self._prune()

    async def rest(self) -> float | None:
        """Return seconds within which no Motion can end; None where nothing tells."""
        if not self._stopper.under_way and self._pending:
            with self._unless_stopped():
                return await self._executor.earliest_end(self._pending[0].entry)

        return None

    async def no_more_room(self, error: ArmAlarm) -> None:
        """The arm has no room, and makes none, because of alarms."""
        try:
            await self.update()  # which tells the motions that were done from those that were not
        except DobotError as failure:
            self.give_up(unseen(failure))

        if not self._stopper.under_way:
            self.begin_stop(in_motions(error, self._first_moving()))

    def cancel_writer(self) -> None:
        """End what is being sent."""
        self._writer.cancel()

    async def writer_ended(self) -> None:
        """Return when nothing is being sent any more."""
        await self._writer.ended()

    def write_on(self) -> None:
        """Have a writer if there is something to send, and it may be sent."""
        self._prune()
        if not self._stopper.under_way:
            self._writer.wake()

    async def _stop(self, error: DobotError, timeout: float, *, halt: bool) -> None:
        """Stop, and wait until the arm has heard it."""
        await self._stopper.wait(self.begin_own_stop(error, halt=halt), timeout)

    def _first_moving(self) -> Sequence[Motion]:
        """The first motion that is not known to be done, if there is one."""
        return [motion for motion in self._pending if motion.moves and not motion.ended][:1]

    @contextmanager
    def _unless_stopped(self) -> Iterator[None]:
        """What goes wrong in this block is of no interest if a stop has begun meanwhile."""
        stops = self._stopper.count
        try:
            yield
        except (MotionUnknown, ReplyTimeout):
            if self._stopper.count == stops:
                raise

    def _prune(self) -> None:
        while self._pending and self._pending[0].ended:
            self._pending.popleft()

    def _accepted(self, motion: Motion) -> None:
        """The arm has taken a command."""
        self._pending.append(motion)
        self._poller.watch()
