"""What an old program has queued, and how it ends: each index followed, each failure told. Runs in the arms' thread.

    put --> [index 7] [index 8] [index 9]     followed, whoever waits
               |          `------------------> the arm raises an alarm: the failure of 8, and of all behind it
               `-----------------------------> done: current_index() is 7

1. An index counts as reached when the driver knows that its command was executed, and no earlier.
2. A failure is raised once in each thread that calls, and by whoever asks for an index, until a command is accepted
   again, or the alarms are cleared: a loop that waits for an index ends.
3. A queue that was told not to run is not waited for: what would need it is refused.
"""

from __future__ import annotations

from collections import deque
from typing import Any, TypeVar

from dobot_async import Magician, Motion
from dobot_async._core.protocol.wire import Command
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.alarms import decode, faults
from dobot_async.errors import CommandRejected, DobotError, MotionStopped, ReplyTimeout, another

__all__ = ["Commands"]

Q = TypeVar("Q")
R = TypeVar("R")
PATIENCE = 5.0
"""Seconds that a queue which does not run has to take a command; a full one never does."""

HALTED = (
    "the arm's queue was told not to run, so that this would never be over: let it run first (SetQueuedCmdStartExec)"
)
FULL = "the arm's queue is full, and was told not to run: let it run first (SetQueuedCmdStartExec)"
CLEARED = MotionStopped("what was queued was not executed: the program stopped the arm, or cleared its queue")
STILL = c.JOGCmd(is_joint=False, cmd=c.JOGKey.IDLE)


class Failure:
    """Why what was queued was not executed.

    Args:
        error: What is raised.
        everybody: Whether it need not be told, since the program itself has brought it about.
    """

    def __init__(self, error: DobotError, *, everybody: bool = False) -> None:
        self.error = error
        self.everybody = everybody
        self.told: set[int] = set()


class Commands:
    """The commands of one connection.

    Args:
        arm: The connected arm.
    """

    def __init__(self, arm: Magician) -> None:
        self._arm = arm
        self._pending: deque[Motion] = deque()
        self._last: int | None = None
        self._failure: Failure | None = None
        self._halted = False
        self._jogging = False

    def tell(self, thread: int) -> None:
        """Raise a failure that a thread has not been told yet."""
        self._absorb()
        failure = self._failure
        if failure and not failure.everybody and thread not in failure.told:
            failure.told.add(thread)
            raise another(failure.error)

    def mark_told(self, thread: int) -> None:
        """A thread has met an error: if it was that of what is queued, it is not told again."""
        self._absorb()
        if self._failure:
            self._failure.told.add(thread)

    async def read(self, row: Command[Q, R], value: Q) -> R:
        """Ask the arm."""
        return await self._arm.request(row, value)

    async def write(self, row: Command[Q, Any], value: Q) -> int:
        """Tell the arm something that it does at once; return 0, as a command without an index does.

        Raises:
            ValueError: A pin, or the rail, was not declared to the arm.
        """
        await self._arm.perform(row, value, None)
        return 0

    async def put(self, row: Command[Q, Any], value: Q) -> int:
        """Queue a command; return its index once the arm has accepted it."""
        try:
            motion = await self._arm.queue.put(row, value, timeout=PATIENCE if self._halted else None)
        except ReplyTimeout as error:
            if self._halted:
                raise CommandRejected(FULL) from error

            raise

        assert motion.index is not None
        self._pending.append(motion)
        self._last, self._failure = motion.index, None
        return motion.index

    async def run(self, row: Command[Q, Any], value: Q) -> int:
        """Queue a command, and return its index once it is executed; a queue that does not run, runs for it alone."""
        halted = self._halted
        if halted and self._pending:
            raise CommandRejected(HALTED)

        if halted:
            await self.start()

        index = await self.put(row, value)
        await self.wait_for(index)
        if halted:
            await self.halt()

        return index

    async def wait_for(self, index: int) -> None:
        """Return when the command of an index, and all before it, have been executed.

        Raises:
            ValueError: No command of this program has such an index.
            CommandRejected: The queue was told not to run.
            DobotError: It was not executed.
        """
        self._absorb()
        if index > (self._last or 0):
            raise ValueError(f"no command has the index {index}: the last one that was queued has {self._last}")

        waited = [motion for motion in self._pending if (motion.index or 0) <= index]
        if waited and self._halted:
            raise CommandRejected(HALTED)

        for motion in waited:
            await motion.wait()

        self._absorb()
        if self._failure:
            raise another(self._failure.error)

    async def current_index(self) -> int:
        """Return the index up to which everything is executed; ask the arm.

        Raises:
            DobotError: What was queued will not be executed.
        """
        await self._arm.queue.update()
        self._absorb()
        if self._failure:
            raise another(self._failure.error)

        if self._pending:
            return (self._pending[0].index or 0) - 1

        return self._last if self._last is not None else await self.read(c.GET_QUEUED_CMD_CURRENT_INDEX, None)

    async def start(self) -> None:
        """Let the queue run."""
        await self._arm.queue.resume()
        self._halted = False

    async def halt(self) -> None:
        """Let the queue not run any further than the command that is being executed."""
        await self._arm.queue.pause()
        self._halted = True

    async def clear(self) -> None:
        """Empty the queue; it runs, or does not, as before."""
        halted = self._halted
        await self._arm.queue.clear()
        self._forget()
        if halted:
            await self.halt()

    async def stop(self) -> None:
        """Stop the arm now, and empty its queue, which does not run until it is told to."""
        await self._arm.stop()
        self._forget()
        await self.halt()

    async def interrupt(self) -> None:
        """Stop the arm now, because the program is; its queue is empty then, and runs."""
        self._forget()
        self._halted = self._jogging = False
        await self._arm.stop()

    async def jog(self, value: c.JOGCmd) -> None:
        """Begin or end a jog; it begins when what was queued is done, and ends at once."""
        ends = value.cmd is c.JOGKey.IDLE
        if not ends:
            await self._finish()

        self._jogging = self._jogging or not ends
        await self._arm.request(c.SET_JOG_CMD, value)
        self._jogging = not ends

    async def alarms(self) -> bytes:
        """Return the arm's alarm bits; who reads them has been told of the failure that they are of."""
        await self._arm.queue.update()
        bits = await self.read(c.GET_ALARMS_STATE, None)
        self._absorb()
        if self._failure and faults(decode(bits)):
            self._failure.everybody = True

        return bits

    async def clear_alarms(self) -> None:
        """Clear the alarms. A failure that nobody was told of stays one, and is told by the next call."""
        await self._arm.clear_alarms()
        self._absorb()
        if self._failure and (self._failure.told or self._failure.everybody):
            self._failure = None

    async def home(self) -> None:
        """Home the arm, from an alarm as well."""
        if faults(decode(await self.alarms())):
            await self._arm.recover()
            self._forget()
            self._failure, self._halted = None, False

        await self.run(c.SET_HOME_CMD, c.HOMECmd())

    async def finish(self) -> None:
        """End a jog, and return when all that was queued is executed; what does not run is not waited for."""
        await self._arm.queue.update()  # which waits for a stop that goes on
        if self._jogging:
            await self.jog(STILL)

        if not self._halted:
            await self._finish()

    async def waiting(self) -> int:
        """Return how many commands are not known to be executed."""
        self._absorb()
        return len(self._pending)

    async def _finish(self) -> None:
        if self._pending:
            await self.wait_for(self._last or 0)

    def _absorb(self) -> None:
        """Take out what has ended, and keep why if something has failed; have the arm asked about the rest."""
        failed = False
        while self._pending and self._pending[0].done:
            error = self._pending.popleft().exception()
            if error and not failed:
                failed = True
                self._failure = Failure(error)
                self._halted = False  # the stop behind an alarm leaves an empty queue that runs

    def _forget(self) -> None:
        """The program itself has ended what was queued."""
        if self._pending:
            self._failure = Failure(CLEARED, everybody=True)

        self._pending.clear()
