"""The queue above an arm with a queue of its own: what it asks in which order, with an arm that a test moves."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from typing import Any

import pytest
from virtual import virtual

from dobot_async._core.protocol.layouts import NOTHING
from dobot_async._core.protocol.wire import Command, Queueing
from dobot_async._core.queue.executor import Entry, MotionSource
from dobot_async._core.queue.keeper import Keeper
from dobot_async._core.queue.motion import Motion
from dobot_async._core.queue.queue import MotionQueue
from dobot_async._core.util.hooks import Hooks
from dobot_async._core.util.tasks import Cleanup
from dobot_async.errors import ArmAlarm, MotionStopped, MotionUnknown

MOVE: Command[None, None] = Command(
    "Move", 1, NOTHING, NOTHING, "", write=True, queueing=Queueing.ALWAYS, repeatable=False, moves=True
)


class FakeExecutor:
    """Takes everything at once; a test says what is done. An answer may be slow: it is what was true when it was asked.

    Attributes:
        finished: The ticket of the last command that is done.
        raised: The alarms.
        fails: Whether the next command to be finished raises an alarm when it is.
        slow: Seconds that the answer to a question for alarms takes.
        stands: Unset while the arm does not hear that it is to stop.
    """

    def __init__(self) -> None:
        self.cleanup = Cleanup("fake:")
        self.on_unknown: Hooks[[MotionUnknown]] = Hooks()
        self.on_motion: Hooks[[Motion]] = Hooks()
        self.keeper: Keeper[Any] | None = None
        self.taken = self.finished = 0
        self.raised: list[object] = []
        self.fails = False
        self.slow = 0.0
        self.stands = asyncio.Event()
        self.stands.set()

    def prepare(self, command: Command[Any, Any], value: Any) -> Entry:
        """Takes anything."""
        return Entry(command, value, None)

    async def submit(self, source: MotionSource) -> None:
        """Takes all."""
        while source:
            self.taken += 1
            source.accepted(source.take(), self.taken)

    async def completed(self) -> int:
        """Tells; a command that fails is ticked off in the very moment."""
        await asyncio.sleep(0)
        if self.fails:
            self.fails = False
            self.finished += 1
            self.raised.append("alarm")

        return self.finished

    async def earliest_end(self, entry: Entry) -> None:
        """Cannot tell."""

    async def alarms(self) -> Sequence[object]:
        """Tells what was set when it was asked."""
        raised = list(self.raised)
        await asyncio.sleep(self.slow)
        return raised

    async def is_at_target(self, entry: Entry) -> bool:
        """Is never there."""
        return False

    async def stop(self) -> None:
        """Stands as soon as it hears that."""
        await self.stands.wait()

    async def clear(self) -> None:
        """Forgets all, and ticks off what it was at."""
        self.finished = self.taken
        self.raised.clear()

    async def pause(self) -> None:
        """Does nothing."""

    async def resume(self) -> None:
        """Does nothing."""


@asynccontextmanager
async def connected() -> AsyncIterator[tuple[FakeExecutor, MotionQueue]]:
    """An arm with its queue."""
    arm = FakeExecutor()
    queue = MotionQueue(arm)
    yield arm, queue
    await queue.aclose()
    await arm.cleanup.aclose()


@virtual
async def test_a_motion_that_fails_when_it_is_ticked_off_is_not_done() -> None:
    async with connected() as (arm, queue):
        motion = await queue.put(MOVE, None)
        arm.fails = True
        with pytest.raises(ArmAlarm):
            await motion.wait(5)


@virtual
async def test_an_alarm_that_was_read_before_a_stop_ends_nothing_that_was_put_after_it() -> None:
    async with connected() as (arm, queue):
        first = await queue.put(MOVE, None)
        arm.raised.append("alarm")
        arm.slow = 3.0
        waiting = asyncio.ensure_future(first.wait())
        await asyncio.sleep(1)
        await queue.stop()
        with pytest.raises(MotionStopped):
            await waiting

        second = await queue.put(MOVE, None)
        watched = asyncio.ensure_future(second.wait())
        await asyncio.sleep(5)
        assert not second.ended
        arm.finished += 1
        await watched


@virtual
async def test_what_is_put_while_a_stop_is_not_heard_waits_for_it() -> None:
    async with connected() as (arm, queue):
        await queue.put(MOVE, None)
        arm.stands.clear()
        stopping = asyncio.ensure_future(queue.stop())
        await asyncio.sleep(0)
        putting = asyncio.ensure_future(queue.put(MOVE, None))
        await asyncio.sleep(2)
        assert arm.taken == 1
        assert not putting.done()
        arm.stands.set()
        await stopping
        motion = await putting
        arm.finished += 1
        await motion.wait(5)


@virtual
async def test_a_put_that_a_stop_keeps_waiting_for_longer_than_an_arm_may_be_silent_is_told() -> None:
    async with connected() as (arm, queue):
        arm.stands.clear()
        with pytest.raises(TimeoutError):
            await queue.stop(timeout=0.1)

        before = asyncio.get_running_loop().time()
        with pytest.raises(TimeoutError, match="nothing was sent"):
            await queue.put(MOVE, None)

        assert 1 < asyncio.get_running_loop().time() - before < 20
        assert arm.taken == 0
        arm.stands.set()
