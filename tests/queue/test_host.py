"""The queue on this side: what it gives to the arm, and what it says of it, with a runner that a test moves."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from typing import Any

import pytest
from virtual import virtual

from dobot_async._core.protocol.layouts import NOTHING
from dobot_async._core.protocol.wire import Command, Queueing
from dobot_async._core.queue.executor import Entry
from dobot_async._core.queue.host import HostExecutor, HostQueue
from dobot_async._core.queue.motion import Motion
from dobot_async._core.util.tasks import Cleanup
from dobot_async.errors import ArmAlarm, CommandRejected, ConnectionLost, MotionStopped, MotionUnknown, ReplyTimeout

MOVE: Command[Any, None] = Command(
    "Move", 1, NOTHING, NOTHING, "", write=True, queueing=Queueing.ALWAYS, repeatable=False, moves=True
)


class FakeRunner:
    """Takes a second for each command; a command's value may be an error, which it ends with."""

    def __init__(self) -> None:
        self.begun: list[Any] = []
        self.done: list[Any] = []
        self.stops = 0
        self.calls: list[str] = []
        self.hears = asyncio.Event()
        self.hears.set()

    def prepare(self, command: Command[Any, Any], value: Any) -> Entry:
        """Takes anything."""
        return Entry(command, value, None)

    async def run(self, entry: Entry) -> None:
        """Takes a second."""
        self.begun.append(entry.value)
        await asyncio.sleep(1)
        if isinstance(entry.value, BaseException):
            raise entry.value

        self.done.append(entry.value)

    async def stop(self) -> None:
        """Counts, as soon as it hears."""
        await self.hears.wait()
        self.stops += 1

    async def reset(self) -> None:
        """Does nothing."""

    async def pause(self) -> None:
        """Notes it."""
        self.calls.append("pause")

    async def resume(self) -> None:
        """Notes it."""
        self.calls.append("resume")


class Arm:
    """A runner with its queue."""

    def __init__(self, capacity: int) -> None:
        self.runner = FakeRunner()
        self.cleanup = Cleanup("sim:")
        self.queue = HostQueue(HostExecutor(self.runner, self.cleanup, capacity))

    async def put(self, *values: Any) -> list[Motion]:
        """Queues commands."""
        return [await self.queue.put(MOVE, value) for value in values]


@asynccontextmanager
async def connected(capacity: int = 100) -> AsyncIterator[Arm]:
    """An arm that is left as a connection leaves it."""
    arm = Arm(capacity)
    yield arm
    await arm.queue.aclose()
    await arm.cleanup.aclose()


async def ends(motions: Sequence[Motion], kind: type[Exception]) -> None:
    for motion in motions:
        with pytest.raises(kind):
            await motion


@virtual
async def test_one_after_the_other() -> None:
    async with connected() as arm:
        motions = await arm.put(1, 2, 3)
        await asyncio.sleep(0.5)
        assert arm.runner.begun == [1]
        assert arm.queue.unsent == 2
        await motions[2]
        assert arm.runner.done == [1, 2, 3]
        assert arm.queue.unsent == 0
        await arm.put(4)
        await arm.queue.join()
        assert arm.runner.done == [1, 2, 3, 4]


@virtual
async def test_it_runs_although_nobody_awaits_it() -> None:
    async with connected() as arm:
        await arm.put(1, 2)
        await asyncio.sleep(3)
        assert arm.runner.done == [1, 2]


@virtual
async def test_what_was_sent_and_has_failed_is_not_unsent() -> None:
    async with connected() as arm:
        await arm.put(ConnectionLost("gone"), 2)
        await asyncio.sleep(0.5)
        assert arm.queue.unsent == 1
        await asyncio.sleep(10)
        assert arm.runner.begun[1:] == []
        assert arm.queue.unsent == 1
        assert arm.runner.stops == 0


@pytest.mark.parametrize("error", [ArmAlarm("alarm"), CommandRejected("no"), MotionStopped("elsewhere")])
@virtual
async def test_a_failure_ends_what_is_behind_it_and_nothing_before_it(error: Exception) -> None:
    async with connected() as arm:
        motions = await arm.put(1, 2, error, 3, 4)
        await asyncio.sleep(10)  # nobody awaits anything yet
        assert arm.runner.begun == [1, 2, error]
        more = await arm.put(5)
        await ends([*motions[2:], *more], type(error))
        await motions[0]
        await motions[1]
        assert arm.runner.done == [1, 2]
        await (await arm.put(6))[0]
        assert arm.runner.done == [1, 2, 6]


@pytest.mark.parametrize("error", [ReplyTimeout("silent"), KeyError("bug")])
@virtual
async def test_an_arm_of_which_nothing_is_known_is_stopped_at_once_and_its_motions_are_unknown(
    error: Exception,
) -> None:
    async with connected() as arm:
        motions = await arm.put(error, 1)
        await asyncio.sleep(1.1)
        assert arm.runner.stops == 1
        await ends(motions, MotionUnknown)
        assert arm.runner.done == []
        await (await arm.put(2))[0]
        assert arm.runner.done == [2]


@virtual
async def test_a_worker_that_somebody_cancels_is_no_motion_that_never_ends() -> None:
    async with connected() as arm:
        motions = await arm.put(1, 2)
        await asyncio.sleep(0.5)
        [worker] = [task for task in asyncio.all_tasks() if task.get_name() == "dobot_async worker"]
        worker.cancel()
        await ends(motions, MotionUnknown)
        await (await arm.put(3))[0]
        assert arm.runner.stops == 1
        assert arm.runner.done == [3]


@virtual
async def test_update_tells_of_a_failure() -> None:
    async with connected() as arm:
        done, failed = await arm.put(1, ArmAlarm("alarm"))
        await asyncio.sleep(5)
        assert not done.ended
        await arm.queue.update()
        assert (done.exception(), type(failed.exception())) == (None, ArmAlarm)
        await (await arm.put(2))[0]


@virtual
async def test_stop_drops_everything_and_what_is_put_after_it_runs() -> None:
    async with connected() as arm:
        motions = await arm.put(1, 2)
        await asyncio.sleep(0.5)
        await arm.queue.stop()
        assert arm.runner.stops == 1
        await ends(motions, MotionStopped)
        await (await arm.put(3))[0]
        assert arm.runner.done == [3]


@virtual
async def test_nothing_is_sent_before_a_stop_is_heard() -> None:
    async with connected() as arm:
        motions = await arm.put(1, 2)
        arm.runner.hears.clear()
        with pytest.raises(ReplyTimeout):
            await arm.queue.stop(timeout=0.5)

        await ends(motions, MotionStopped)
        later = asyncio.create_task(arm.queue.put(MOVE, 3))
        await asyncio.sleep(2)
        assert arm.runner.begun in ([], [1])
        arm.runner.hears.set()
        await (await later)
        assert arm.runner.done == [3]


@virtual
async def test_clear_ends_what_runs_as_well() -> None:
    async with connected() as arm:
        motions = await arm.put(1, 2)
        await asyncio.sleep(0.5)
        await arm.queue.clear()
        assert arm.runner.stops == 1
        await ends(motions, MotionStopped)
        await arm.queue.clear()
        assert arm.runner.stops == 1


@virtual
async def test_a_pause_holds_back_the_next_command() -> None:
    async with connected() as arm:
        first, second = await arm.put(1, 2)
        await asyncio.sleep(0.5)
        await arm.queue.pause()
        await first
        with pytest.raises(ReplyTimeout):
            await second.wait(5)

        assert arm.runner.begun == [1]
        await arm.queue.resume()
        await second
        assert arm.runner.calls == ["pause", "resume"]
        await arm.queue.pause()
        await arm.queue.stop()
        await (await arm.put(3))[0]


@pytest.mark.parametrize("capacity", [1, 2, 7])
@virtual
async def test_a_full_queue_makes_put_wait(capacity: int) -> None:
    async with connected(capacity) as arm:
        for number in range(20):
            await arm.queue.put(MOVE, number)
            assert len(arm.runner.begun) >= number - capacity

        await arm.queue.join()
        assert arm.runner.done == list(range(20))
        await arm.put(*range(capacity + 1))  # one of them is under way
        with pytest.raises(ReplyTimeout, match="no room"):
            await arm.queue.put(MOVE, 0, timeout=0.5)


@virtual
async def test_a_put_that_waits_for_room_behind_a_failure_fails_with_it() -> None:
    async with connected(1) as arm:
        await arm.put(ArmAlarm("alarm"), 1)
        with pytest.raises(ArmAlarm):
            await arm.queue.put(MOVE, 2)

        assert arm.runner.done == []


@pytest.mark.parametrize("seconds", [0.0, 0.5, 1.0, 1.5])
@virtual
async def test_nothing_is_begun_once_it_is_closed(seconds: float) -> None:
    async with connected(1) as arm:
        puts = asyncio.gather(*(arm.queue.put(MOVE, number) for number in range(5)), return_exceptions=True)
        await asyncio.sleep(seconds)

    begun = list(arm.runner.begun)
    await asyncio.sleep(10)
    assert arm.runner.begun == begun
    await puts


@virtual
async def test_closing_leaves_the_arm_as_it_is() -> None:
    async with connected() as arm:
        motions = await arm.put(1, 2)
        await asyncio.sleep(0.5)

    await ends(motions, MotionStopped)
    assert arm.runner.stops == 0
