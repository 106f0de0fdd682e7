"""What is queued and how it ends, whoever asks: the part of a queue that its writer, poller and stops work with.

    accepted --> pending --look--> done, or ArmAlarm
                        `--stop, clear, silence, restart--> MotionStopped, MotionUnknown, ConnectionLost

Every Motion ends exactly once. A ticket that the arm has reached is no proof that the motion succeeded, so the alarms
are read after it; only then a Motion is done.
"""

from __future__ import annotations

import asyncio
import logging
from collections import Counter, deque
from collections.abc import Coroutine, Generator, Sequence
from contextlib import AbstractAsyncContextManager, AbstractContextManager, contextmanager, nullcontext
from typing import Any, TypeVar

from dobot_async._core.queue.epoch import Epoch
from dobot_async._core.queue.executor import Executor, alarmed, in_motions, unseen
from dobot_async._core.queue.motion import Motion, MotionOutbox
from dobot_async._core.queue.poller import StatusPoller
from dobot_async._core.queue.stopper import Stopper
from dobot_async._core.queue.writer import Writer
from dobot_async._core.util.hooks import Hooks
from dobot_async.errors import (
    ArmAlarm,
    CommandRejected,
    ConnectionLost,
    DobotError,
    MotionUnknown,
    ReplyTimeout,
)

__all__ = ["QueueCore"]

T = TypeVar("T")
logger = logging.getLogger("dobot_async.queue")


class QueueCore:
    """See the module.

    Attributes:
        epoch: What a motion in several steps is bound to; a stop ends it, and the next one is here.
        outcomes: How many motions ended, by how: "done", or the name of the error that they raise.
    """

    def __init__(self, executor: Executor) -> None:
        self.epoch: Epoch = Epoch()
        self.outcomes: Counter[str] = Counter()
        self._executor = executor
        executor.on_unknown.add(self.give_up)
        self._outbox = MotionOutbox(self._accepted)
        self._pending: deque[Motion] = deque()
        self._poller = StatusPoller(self)
        self._writer = Writer(executor, self._outbox, self._poller, self)
        self._stopper = Stopper(executor, self)
        self._failure: DobotError | None = None
        self._keeping = asyncio.Lock()
        self._leading: Motion | None = None

    @property
    def pending(self) -> int:
        """How many accepted commands are not known to have ended."""
        return len(self._pending) + (self._leading is not None)

    async def update(self) -> None:
        """Ask the arm once how far it is, and end the Motions that this decides; wait for a stop that is under way."""
        try:
            await self._stopper.over()
            await self.look(alarms=True)
        except MotionUnknown as error:
            self.give_up(error)

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

        if self._leading:
            ending.append(self._leading)

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

    def watch(self, seconds: float) -> None:
        """Ask the arm how far it is, for so many seconds at least."""
        self._poller.watch(seconds)

    def watching(self) -> AbstractContextManager[None]:
        """While this is entered, the arm is asked how far it is."""
        return self._poller.watching()

    @property
    def on_motion(self) -> Hooks[[Motion]]:
        """Hooks, called with each Motion when it was put, when the arm has accepted it, and when it has ended."""
        return self._executor.on_motion

    def note(self, motion: Motion) -> None:
        """Tell those who look on what has become of a Motion."""
        if self.on_motion:
            self.on_motion(motion)

    def count(self, error: DobotError | None) -> None:
        """Take note of how something ended that moves the arm."""
        self.outcomes["done" if error is None else type(error).__name__] += 1

    def unplanned_motion(self) -> AbstractAsyncContextManager[None]:
        """While this is entered, the arm may go anywhere; in a fleet it waits until it may."""
        return nullcontext()

    @contextmanager
    def led_by(self, motion: Motion) -> Generator[None]:
        """While this is entered a motion that is not queued has the arm: what is put is refused, and a stop ends it.

        Raises:
            CommandRejected: Commands are pending, or another such motion has the arm.
        """
        if self._leading or self._pending or self._outbox.unaccepted:
            busy = str(self._leading) if self._leading else f"{self.pending or 'some'} commands are pending: that"
            raise CommandRejected(f"{busy} has the arm; {motion} can begin when it has ended, or was stopped")

        self._leading = motion
        try:
            yield
        finally:
            self._leading = None

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

    def _first_moving(self) -> Sequence[Motion]:
        """The first motion that is not known to be done, if there is one."""
        return [motion for motion in self._pending if motion.moves and not motion.ended][:1]

    @contextmanager
    def _unless_stopped(self) -> Generator[None]:
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
        self.note(motion)
        self._pending.append(motion)
        self._poller.watch()
