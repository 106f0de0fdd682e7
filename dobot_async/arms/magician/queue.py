"""The Magician's queue with the verbs on it, its batches, and programs stored in the arm."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Coroutine, Iterable, Sequence
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from typing import Any, Literal, TypeVar

from dobot_async._core.protocol.wire import Command
from dobot_async._core.queue.batch import BatchBuilder, batch
from dobot_async._core.queue.epoch import Epoch
from dobot_async._core.queue.motion import WITHDRAWN, Motion, MotionOutbox
from dobot_async._core.queue.queue import MotionQueue
from dobot_async._core.util.arguments import check_choice
from dobot_async._core.util.tasks import STAYING
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.declared import Declarations, told_rail
from dobot_async.arms.magician.executor import MagicianExecutor
from dobot_async.arms.magician.goals import Goal, Need, Plan, follow, goal_of
from dobot_async.arms.magician.kinematics import Kinematics
from dobot_async.arms.magician.verbs import Verbs
from dobot_async.errors import DobotError, MotionUnknown

__all__ = ["Batch", "Download", "MagicianQueue"]

Q = TypeVar("Q")


class MagicianQueue(MotionQueue, Verbs[Coroutine[Any, Any, Motion]]):
    """The arm's queue: each verb returns a Motion once the arm has accepted it, and waits while the queue is full.

    Attributes:
        kinematics: The arm's geometry with its end effector.
        declared: What the arm was told of its rail and its pins.
        inherited: Whether an earlier program's commands may lie in the arm's queue.
    """

    def __init__(self, executor: MagicianExecutor) -> None:
        super().__init__(executor)
        self.kinematics: Kinematics = Kinematics()
        self.declared: Declarations = Declarations(executor.status.ask)
        self.inherited: bool = False
        self._arm = executor
        self._own: Motion | None = None
        self._spare_tools = False
        self._order = asyncio.Lock()

    def perform(self, command: Command[Q, Any], value: Q, timeout: float | None) -> Coroutine[Any, Any, Motion]:
        """Queue a command; see `put`."""
        return self.put(command, value, timeout=timeout)

    async def perform_from_goal(self, plan: Plan, needs: Need, timeout: float | None) -> Motion:
        """Queue what a plan makes of the goal of what is queued before it, or of where the arm stands."""
        epoch = self.epoch
        return await self.put(*await self.planned(plan, needs), timeout=timeout, epoch=epoch)

    async def planned(self, plan: Plan, needs: Need) -> tuple[Command[Any, None], Any]:
        """Return what a plan makes of the goal; raise MotionStopped if the arm was stopped while that was found out."""
        epoch = self.epoch
        goal = await self.find_goal(needs)
        epoch.check()
        return plan(goal)

    async def put_all(
        self, motions: Sequence[Motion], *, timeout: float | None = None, epoch: Epoch | None = None
    ) -> None:
        """Give several commands to the arm's queue with nothing between them; see `MotionQueue.put_all`.

        Raises:
            ValueError: One needs a rail, or a pin, that was not declared; none was sent.
        """
        values, call, epoch = [motion.entry.value for motion in motions], object(), epoch or self.epoch
        for motion in motions:
            motion.call = call

        try:
            async with self._order:  # nothing overtakes what has to ask first
                await self.declared.check(values, queued=True)

            epoch.check()
        except BaseException:
            for motion in motions:
                motion.end(WITHDRAWN)

            raise

        await super().put_all(motions, timeout=timeout, epoch=epoch)
        for value in values:
            self.declared.told(value, queued=True)

        if self.inherited and motions:
            self._own = self._own or motions[-1]

    @property
    def leads_anywhere(self) -> bool:
        """Whether what an earlier program has left in the arm's queue may move it still."""
        return self.inherited and not (self._own and self._own.ended and self._own.exception() is None)

    def goal(self, *more: Motion) -> Goal:
        """Return where the arm will be behind all that is queued, and behind some more; asks nobody."""
        goal = Goal(self.kinematics)
        for motion in self._before(more):
            goal = follow(goal, motion.entry.value)

        return goal

    async def find_goal(self, needs: Need) -> Goal:
        """Return where the arm will be behind all that is queued; where it stands if it has nothing to do.

        Raises:
            ValueError: What an earlier program left in the queue may move it anywhere.
        """
        while needs:
            if list(self._before()):
                await self.update()  # it may have been done for long, and the arm been moved by hand since

            if list(self._before()):
                return self.goal()

            if self.leads_anywhere:
                raise ValueError(
                    'connected with queue="keep", it is not known what lies in the arm\'s queue, nor where that leads: '
                    "say x, y, z and r, or await a motion of your own first"
                )

            self.inherited = False
            rail = told_rail(await self._arm.status.ask(c.GET_POSE_L)) if "rail" in needs else None
            pose = await self._arm.status.ask(c.GET_POSE)
            if not list(self._before()):
                return goal_of(self.kinematics, pose, rail)

        return Goal(self.kinematics)

    def begin_stop(
        self, error: DobotError, *, halt: bool = True, doubtful: Sequence[Motion] = ()
    ) -> asyncio.Task[None]:
        """End all Motions, and begin to stop the arm, and its laser and steppers; see `MotionQueue.begin_stop`."""
        spare, self._spare_tools = self._spare_tools, False
        if halt and not spare:
            self._arm.tool_stops += 1

        self.declared.forget(all_of_them=isinstance(error, MotionUnknown))
        self.inherited = False
        return super().begin_stop(error, halt=halt, doubtful=doubtful)

    async def stop(self, *, timeout: float = STAYING, tools: Literal["off", "leave"] = "off") -> None:
        """Stop the arm now, ahead of everything; all pending Motions raise MotionStopped, and the queue is empty.

        Args:
            timeout: Seconds to wait until the arm has acknowledged it; it is repeated after that, too.
            tools: "off" ends the laser and the stepper motors as well; "leave" leaves them as they are.

        Raises:
            ReplyTimeout: The arm has not acknowledged it yet.
            ConnectionLost: The link is gone.
        """
        check_choice("tools", tools, "off", "leave")
        self._spare_tools = tools == "leave"
        await super().stop(timeout=timeout)

    def batch(self, *, timeout: float | None = None) -> AbstractAsyncContextManager[Batch]:
        """Collect commands, and queue them with nothing between them when the block ends; an error sends none.

        Args:
            timeout: Seconds to wait for room in the arm's queue.

        Raises:
            ValueError: A rail or a pin that a command needs was not declared; none was sent.
            DobotError: As `put`; what was accepted before that is pending.
        """
        return batch(self, Batch(self), timeout)

    @asynccontextmanager
    async def download(self, *, loops: int = 1) -> AsyncGenerator[Download]:
        """Store the commands of the block in the arm, which runs them when its key is pressed. Manual 2.19.4.

        A cancellation or a stop ends it, and the arm executes again what it is told. After power-up the arm knows of no
        rail and of no pin: a program that uses them has to declare them itself.

        Args:
            loops: How often the arm is to run them.

        Raises:
            ValueError: A rail or a pin that a command needs was declared neither to the arm nor in the program.
            MotionStopped: The arm was stopped meanwhile; a part of the program may be stored.
        """
        program, epoch = Download(self), self.epoch
        yield program
        await self.declared.check([motion.entry.value for motion in program.motions], queued=True)
        if self._arm.keeper:
            await self._arm.keeper.admit_stored(program.motions, self.kinematics)

        outbox = MotionOutbox(lambda _: None)
        outbox.add(program.motions)
        async with self._arm.cleanup.at_end(self._arm.end_download, "the end of the download"):
            await self.exclusively(self._arm.download(outbox, loops), "the download", epoch)

    def _before(self, more: Iterable[Motion] = ()) -> Iterable[Motion]:
        """What has not ended, in its order, and some more."""
        queued = (motion for motion in (*self._pending, *self._outbox.unaccepted) if not motion.ended)
        return (*queued, *more)


class Batch(BatchBuilder, Verbs[Motion]):
    """Commands that are sent together; each verb returns its Motion, which may be awaited after the batch's block."""

    def __init__(self, queue: MagicianQueue) -> None:
        super().__init__(queue)
        self._before = queue.goal

    def perform_from_goal(self, plan: Plan, needs: Need, timeout: float | None) -> Motion:  # noqa: ARG002
        """Add what a plan makes of the goal of what is before it."""
        return self.perform(*plan(self._before(*self.motions)), timeout)


class Download(BatchBuilder, Verbs[Motion]):
    """Commands to be stored in the arm; nobody awaits their Motions."""

    def __init__(self, queue: MagicianQueue) -> None:
        super().__init__(queue)
        self._kinematics = queue.kinematics

    def perform_from_goal(self, plan: Plan, needs: Need, timeout: float | None) -> Motion:  # noqa: ARG002
        """Add what a plan makes of the goal of what the program does before."""
        goal = Goal(self._kinematics)
        for motion in self.motions:
            goal = follow(goal, motion.entry.value)

        return self.perform(*plan(goal), timeout)
