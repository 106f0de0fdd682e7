"""The queue of motions as its users hold it, for all families. It never learns which arm it drives.

    put --> Outbox --writer--> executor.submit --> pending --+--> done            the arm has executed it
                                                             +--> ArmAlarm        the arm raised alarms
             one poller, only while somebody waits  -------->+--> MotionStopped   stop, clear, end of the block
                                                             +--> MotionUnknown   nothing can tell; the arm is stopped
                                                             +--> ConnectionLost  the link is gone

One writer task sends, in the order of the calls, and lives while there is something to send; a full queue makes `put`
wait. A stop ends all Motions at once, and is repeated until the arm has heard it, by a task that outlives who asked for
it; nothing is sent before it is done. What is pending, and how it ends, is in `core`.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Coroutine, Sequence
from typing import Any, TypeVar, overload

from dobot_async._core.protocol.wire import Command
from dobot_async._core.queue.core import QueueCore
from dobot_async._core.queue.epoch import Epoch
from dobot_async._core.queue.executor import Entry
from dobot_async._core.queue.motion import WITHDRAWN, Motion
from dobot_async._core.queue.stream import Steps, Stream, StreamStep
from dobot_async._core.util.arguments import check_timeout
from dobot_async._core.util.bounds import ToolBounds
from dobot_async._core.util.tasks import STAYING
from dobot_async.errors import (
    CommandRejected,
    DobotError,
    MotionStopped,
    ReplyTimeout,
    another,
)

__all__ = ["MotionQueue"]

Q = TypeVar("Q")
S = TypeVar("S", bound=StreamStep)
T = TypeVar("T")
logger = logging.getLogger("dobot_async.queue")
ELSEWHERE = MotionStopped("it was not sent: the motion before it was withdrawn, and its way would begin elsewhere")


class MotionQueue(QueueCore):
    """What is put here the arm executes in order, each exactly once.

    Attributes:
        epoch: What a motion in several steps is bound to; a stop ends it, and the next one is here.
        outcomes: How many motions ended, by how: "done", or the name of the error that they raise.
    """

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
            CommandRejected: The arm follows a target, and takes no commands meanwhile.
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
        """Return a checked entry; raise ValueError or TypeError as `put` does.

        Args:
            command: A row of the table that may be queued.
            value: Its parameters.
        """
        return self._executor.prepare(command, value)

    async def put_all(
        self, motions: Sequence[Motion], *, timeout: float | None = None, epoch: Epoch | None = None
    ) -> None:
        """Give several commands to the arm's queue with nothing between them; see `put`.

        Args:
            motions: What is to be sent.
            timeout: Seconds to wait for room.
            epoch: The epoch in which the steps that led here began; a stop since then lets nothing be sent.

        Raises:
            DobotError: As `put`.
        """
        timeout, call, epoch = check_timeout(timeout), object(), epoch or self.epoch
        for motion in motions:
            motion.call = call
            self.note(motion)

        await self._keep(motions)
        self._check_free(motions, epoch)
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
            self._withdraw(motions, error)
            raise
        except TimeoutError:
            late = ReplyTimeout(f"the arm's queue had no room within {timeout:.3g} s")
            self._withdraw(motions, late)
            raise another(late) from None
        except asyncio.CancelledError:
            self._withdraw(motions, WITHDRAWN)
            raise

        failed = next((motion for motion in motions if motion.index is None), None)
        if failed and (failure := failed.exception()):
            raise another(failure)

    @property
    def bounds(self) -> ToolBounds | None:
        """Where the tool may be, for who sends the arm about without the queue; None where nothing limits it."""
        keeper = self._executor.keeper
        return keeper.workspace if keeper else None

    async def _keep(self, motions: Sequence[Motion]) -> None:
        """Raise OutsideWorkspace, and send nothing, if one of several motions leads out of the arm's workspace."""
        keeper = self._executor.keeper
        if not keeper:
            return

        try:
            async with self._keeping:  # nothing overtakes what has to ask first
                await keeper.admit(motions, self._unended, self.update)
        except BaseException as error:
            stopped = MotionStopped(f"it was not sent: {error}") if isinstance(error, ValueError) else WITHDRAWN
            for motion in motions:
                motion.end(stopped)

            raise

    def _withdraw(self, motions: Sequence[Motion], reason: DobotError) -> None:
        """Nobody wants these any more; nor what would go another way, behind them, than the one that was looked at."""
        keeper, unsent = self._executor.keeper, self._outbox.unaccepted
        self._outbox.withdraw(motions, reason)
        if keeper:
            gone = (each.ended and each in motions and keeper.concerns(each.entry) for each in unsent)
            first = next((number for number, each in enumerate(gone) if each), len(unsent))
            self._outbox.withdraw(unsent[first:], ELSEWHERE)

    def _unended(self) -> list[Motion]:
        """What has not ended, in its order."""
        return [motion for motion in (*self._pending, *self._outbox.unaccepted) if not motion.ended]

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

    async def pause(self) -> None:
        """Let the arm finish the command that it executes, and then wait; Motions stay pending.

        Raises:
            ReplyTimeout: The arm does not acknowledge it.
            ConnectionLost: The link is gone.
        """
        await self._executor.pause()

    async def resume(self) -> None:
        """Let a paused arm go on; a stop ends this call, which raises why: MotionStopped, or the ArmAlarm behind it.

        Raises:
            MotionStopped: A stop ended this call.
            ArmAlarm: An alarm was behind that stop.
            ReplyTimeout: The arm does not acknowledge it.
            ConnectionLost: The link is gone.
        """
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
        """Throw away all that is queued, the running command included; its Motions raise MotionStopped. See `stop`.

        Args:
            timeout: Seconds to wait until the arm has acknowledged it.

        Raises:
            ReplyTimeout: The arm has not acknowledged it yet.
            ConnectionLost: The link is gone.
        """
        await self._stop(MotionStopped("the arm's queue was cleared"), timeout, halt=False)

    async def aclose(self) -> None:
        """End the writer, the poller and all Motions; the arm is left as it is."""
        self.fail(MotionStopped("the connection's block ended before the motion was known to be done"))
        await self._writer.ended()
        await self._poller.aclose()

    async def _stop(self, error: DobotError, timeout: float, *, halt: bool) -> None:
        """Stop, and wait until the arm has heard it."""
        await self._stopper.wait(self.begin_own_stop(error, halt=halt), timeout)

    def _check_free(self, motions: Sequence[Motion], epoch: Epoch) -> None:
        """Raise, and end the Motions, if a stop came since they were made, or something else has the arm."""
        try:
            epoch.check()
            if self._leading:
                raise CommandRejected(f"{self._leading} has the arm: queue commands when it has ended; none was sent")
        except DobotError as error:
            for motion in motions:
                motion.end(error)

            raise
