"""What is written by hand of arms, queues and batches."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, TypeVar

from dobot_async import Motion as AsyncMotion
from dobot_async._core.protocol.wire import Command
from dobot_async._core.queue.stream import StreamStep
from dobot_async.sync.motion import Motion
from dobot_async.sync.portal import PORTAL
from dobot_async.sync.streams import Stream, drawn
from dobot_async.sync.twin import Twin

__all__ = ["ArmTwin", "BatchTwin", "QueueTwin", "motions"]

Q = TypeVar("Q")
S = TypeVar("S", bound=StreamStep)


A = TypeVar("A")


def motions(found: Iterable[AsyncMotion]) -> list[Motion]:
    """Return the twins of Motions."""
    return [Motion(each) for each in found]


class ArmTwin(Twin[A]):
    """An arm: each verb returns when the arm has done it."""

    __slots__ = ()

    def perform(self, command: Command[Q, Any], value: Q, timeout: float | None) -> None:
        """Do a command, and return when it is done."""
        arm: Any = self.asynchronous
        PORTAL.run(lambda: arm.perform(command, value, timeout))

    def perform_from_goal(self, plan: Any, needs: Any, timeout: float | None) -> None:
        """Do what a plan makes of where the arm will be then."""
        arm: Any = self.asynchronous
        PORTAL.run(lambda: arm.perform_from_goal(plan, needs, timeout))


class QueueTwin(Twin[A]):
    """A queue: each verb returns a Motion once the arm has accepted it."""

    __slots__ = ()

    @property
    def outcomes(self) -> Mapping[str, int]:
        """How many motions ended, by how: "done", or the name of the error that they raise."""
        queue: Any = self.asynchronous
        return dict(queue.outcomes)

    def perform(self, command: Command[Q, Any], value: Q, timeout: float | None) -> Motion:
        """Queue a command."""
        queue: Any = self.asynchronous
        return Motion(PORTAL.run(lambda: queue.perform(command, value, timeout)))

    def perform_from_goal(self, plan: Any, needs: Any, timeout: float | None) -> Motion:
        """Queue what a plan makes of where the arm will be then."""
        queue: Any = self.asynchronous
        return Motion(PORTAL.run(lambda: queue.perform_from_goal(plan, needs, timeout)))

    def stream(self, steps: Iterable[S]) -> Stream[S]:
        """Queue steps as they come, as fast as the arm takes them; iterated over, it yields each one that is done.

            arm.queue.stream(program).wait()
            for step in arm.queue.stream(program): ...

        The steps queued belong to the queue: who is interrupted, or leaves the loop, ends the queueing of further ones.
        Verbs need no stream: each returns when the arm has accepted it.

        Args:
            steps: Objects with a `command` and its `value`. What is no list or tuple is drawn from in another thread,
                as there is room.

        Returns:
            What does it: its `wait`, or iterating over it.

        Raises:
            ValueError: A step does not fit; those before it go on.
            DobotError: As `put` and the Motions do. A note, and `steps`, name the step that failed, or the first and
                the last one that may have.
        """
        queue: Any = self.asynchronous
        return Stream(PORTAL.look(lambda: queue.stream(drawn(steps))))


class BatchTwin(Twin[A]):
    """A batch: each verb returns its Motion, which can be waited for behind the batch's block.

    Attributes:
        motions: What was added.
    """

    __slots__ = ()

    @property
    def motions(self) -> list[Motion]:
        """What was added."""
        batch: Any = self.asynchronous
        return motions(batch.motions)

    def perform(self, command: Command[Q, Any], value: Q, timeout: float | None) -> Motion:
        """Add a command."""
        batch: Any = self.asynchronous
        return Motion(PORTAL.look(lambda: batch.perform(command, value, timeout)))

    def perform_from_goal(self, plan: Any, needs: Any, timeout: float | None) -> Motion:
        """Add what a plan makes of where the arm will be then."""
        batch: Any = self.asynchronous
        return Motion(PORTAL.look(lambda: batch.perform_from_goal(plan, needs, timeout)))
