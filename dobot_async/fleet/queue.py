"""The queue of an arm in a fleet: it asks the fleet before it sends, and tells it what ends all motions.

arm.queue.put_all --> MotionGate.admitted --> the arm
arm.queue.fail    --> MotionGate.ended
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Coroutine, Sequence
from contextlib import AbstractAsyncContextManager, nullcontext
from typing import Any, Protocol

from dobot_async._core.queue.epoch import Epoch
from dobot_async._core.queue.motion import Motion
from dobot_async._core.queue.queue import MotionQueue
from dobot_async._core.util.arguments import check_timeout
from dobot_async._core.util.bounds import ToolBounds, both
from dobot_async.errors import DobotError
from dobot_async.fleet.zones import here

__all__ = ["FleetQueue", "MotionGate"]


class MotionGate(Protocol):
    """What a queue of the fleet reports to."""

    @property
    def bounds(self) -> ToolBounds | None:
        """Where the tool may be; None where the fleet does not limit it."""
        ...

    def admitted(
        self, motions: Sequence[Motion], timeout: float | None, epoch: Epoch
    ) -> AbstractAsyncContextManager[float | None]:
        """While this is entered, motions may be sent; raises if they may not be. Yields the seconds that are left."""
        ...

    def unplanned_motion(self, halt: Callable[[], Awaitable[None]] | None) -> AbstractAsyncContextManager[None]:
        """While this is entered, the arm may go anywhere; raises if it may not.

        Args:
            halt: Ends what it does there, for an arm that has limits.
        """
        ...

    def changing(self, value: object) -> AbstractAsyncContextManager[None]:
        """While this is entered, something changes at once on which the arm's ways depend."""
        ...

    def ended(self, error: DobotError) -> None:
        """Takes note of what ends all motions of the arm."""


class FleetQueue(MotionQueue):
    """The part of a queue that reports to the fleet.

    Attributes:
        gate: To whom; None until the arm is in its fleet.
    """

    gate: MotionGate | None = None

    @property
    def bounds(self) -> ToolBounds | None:
        """Where the tool may be: in the arm's workspace, and within its limits in the fleet."""
        return both(super().bounds, self.gate.bounds if self.gate else None)

    async def put_all(
        self, motions: Sequence[Motion], *, timeout: float | None = None, epoch: Epoch | None = None
    ) -> None:
        """Gives several commands to the arm's queue once the fleet allows them; see `MotionQueue.put_all`."""
        epoch = epoch or self.epoch
        if self.gate is None:
            await self.put_admitted(motions, timeout, epoch)
            return

        async with self.gate.admitted(motions, check_timeout(timeout), epoch) as left:
            await self.put_admitted(motions, left, epoch)

    async def put_admitted(self, motions: Sequence[Motion], timeout: float | None, epoch: Epoch) -> None:
        """Gives several commands that the fleet allows to the arm's queue."""
        await super().put_all(motions, timeout=timeout, epoch=epoch)

    async def exclusively(self, work: Coroutine[Any, Any, None], what: str, epoch: Epoch | None = None) -> None:
        """Runs work while nothing is sent, for a program that may go on; see `MotionQueue.exclusively`."""
        try:
            here().check()
        except BaseException:
            work.close()
            raise

        await super().exclusively(work, what, epoch)

    def fail(self, error: DobotError, *, spare: Sequence[Motion] = ()) -> None:
        """Ends all Motions with an error, and tells the fleet; see `MotionQueue.fail`."""
        if self.gate:
            self.gate.ended(error)

        super().fail(error, spare=spare)

    def unplanned_motion(self, halt: Callable[[], Awaitable[None]] | None = None) -> AbstractAsyncContextManager[None]:
        """While this is entered, the arm may go anywhere."""
        return self.gate.unplanned_motion(halt) if self.gate else nullcontext()

    def changing(self, value: object) -> AbstractAsyncContextManager[None]:
        """While this is entered, something changes at once on which the arm's ways depend."""
        return self.gate.changing(value) if self.gate else nullcontext()
