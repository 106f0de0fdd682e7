"""The queue on this side: what it gives to the arm, and what it says of it, with a hand that a test moves."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from typing import Any

import pytest
from virtual import virtual

from dobot_async.errors import ArmAlarm, CommandRejected, ConnectionLost, MotionStopped, MotionUnknown, ReplyTimeout
from dobot_async.executor import Entry
from dobot_async.hosted import HostedExecutor
from dobot_async.layouts import NOTHING
from dobot_async.motion import Motion, MotionQueue
from dobot_async.wire import Command, Queueing

MOVE: Command[Any, None] = Command(
    "Move", 1, NOTHING, NOTHING, "", write=True, queueing=Queueing.ALWAYS, repeatable=False, moves=True
)


class FakeHand:
    """Takes a second for each command; a command's value may be an error, which it ends with."""

    def __init__(self) -> None:
        self.begun: list[Any] = []
        self.done: list[Any] = []
        self.stops = 0
        self.calls: list[str] = []

    async def connected(self) -> None:
        """It always is."""

    def prepare(self, command: Command[Any, Any], value: Any) -> Entry:
        """Takes anything."""
        return Entry(command, value, None)

    async def execute(self, entry: Entry) -> None:
        """Takes a second."""
        self.begun.append(entry.value)
        await asyncio.sleep(1)
        if isinstance(entry.value, Exception):
            raise entry.value

        self.done.append(entry.value)

    async def halt(self) -> None:
        """Counts."""
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
    """A hand with its queue."""

    def __init__(self, capacity: int = 100) -> None:
        self.hand = FakeHand()
        self.executor = HostedExecutor(self.hand, capacity)
        self.queue = MotionQueue(self.executor)

    async def put(self, *values: Any) -> list[Motion]:
        """Queues commands."""
        return [await self.queue.put(MOVE, value) for value in values]

    async def aclose(self) -> None:
        """Ends all tasks."""
        await self.queue.aclose()
        await self.executor.aclose()


async def ends(motions: Sequence[Motion], kind: type[Exception]) -> None:
    for motion in motions:
        with pytest.raises(kind):
            await motion


@virtual
async def test_one_after_the_other() -> None:
    arm = Arm()
    motions = await arm.put(1, 2, 3)
    await asyncio.sleep(0.5)
    assert arm.hand.begun == [1]
    assert arm.executor.unsent == 2
    await motions[2]
    assert arm.hand.done == [1, 2, 3]
    assert arm.executor.unsent == 0
    await arm.put(4)
    await arm.queue.join()
    assert arm.hand.done == [1, 2, 3, 4]
    await arm.aclose()


@virtual
async def test_what_was_sent_and_has_failed_is_not_unsent() -> None:
    arm = Arm()
    await arm.put(ConnectionLost("gone"), 2)
    await asyncio.sleep(0.5)
    assert arm.executor.unsent == 1
    await asyncio.sleep(10)
    assert arm.hand.begun[1:] == []
    assert arm.executor.unsent == 1
    await arm.aclose()


@virtual
async def test_a_failure_ends_what_is_behind_it_and_nothing_before_it() -> None:
    for error in (ArmAlarm("alarm"), CommandRejected("no"), MotionStopped("elsewhere")):
        arm = Arm()
        motions = await arm.put(1, 2, error, 3, 4)
        await asyncio.sleep(10)  # nobody awaits anything yet
        assert arm.hand.begun == [1, 2, error]
        more = await arm.put(5)
        await ends([*motions[2:], *more], type(error))
        await motions[0]
        await motions[1]
        assert arm.hand.done == [1, 2]
        await (await arm.put(6))[0]
        assert arm.hand.done == [1, 2, 6]
        await arm.aclose()


@virtual
async def test_a_silent_arm_is_lost() -> None:
    arm = Arm()
    await ends(await arm.put(ReplyTimeout("silent"), 1), ConnectionLost)
    assert arm.hand.done == []
    await arm.aclose()


@virtual
async def test_stop_drops_everything_and_what_is_put_after_it_runs() -> None:
    arm = Arm()
    motions = await arm.put(1, 2)
    await asyncio.sleep(0.5)
    await arm.queue.stop()
    assert arm.hand.stops == 1
    await ends(motions, MotionStopped)
    await (await arm.put(3))[0]
    assert arm.hand.done == [3]
    await arm.aclose()


@virtual
async def test_clear_ends_what_runs_as_well() -> None:
    arm = Arm()
    motions = await arm.put(1, 2)
    await asyncio.sleep(0.5)
    await arm.queue.clear()
    assert arm.hand.stops == 1
    await ends(motions, MotionStopped)
    await arm.queue.clear()
    assert arm.hand.stops == 1
    await arm.aclose()


@virtual
async def test_a_pause_holds_back_the_next_command() -> None:
    arm = Arm()
    first, second = await arm.put(1, 2)
    await asyncio.sleep(0.5)
    await arm.queue.pause()
    await first
    with pytest.raises(ReplyTimeout):
        await second.wait(5)

    assert arm.hand.begun == [1]
    await arm.queue.resume()
    await second
    assert arm.hand.calls == ["pause", "resume"]
    await arm.queue.pause()
    await arm.queue.stop()
    await (await arm.put(3))[0]
    await arm.aclose()


@pytest.mark.parametrize("capacity", [1, 2, 7])
@virtual
async def test_a_full_queue_makes_put_wait(capacity: int) -> None:
    arm = Arm(capacity)
    for number in range(20):
        await arm.queue.put(MOVE, number)
        assert len(arm.hand.begun) >= number - capacity

    await arm.queue.join()
    assert arm.hand.done == list(range(20))
    await arm.put(*range(capacity))
    with pytest.raises(ReplyTimeout, match="no room"):
        await arm.queue.put(MOVE, 0, timeout=0.5)

    await arm.aclose()


@virtual
async def test_a_mistake_in_a_family_is_no_motion_that_never_ends() -> None:
    arm = Arm()
    loop = asyncio.get_running_loop()
    seen: list[Any] = []
    loop.set_exception_handler(lambda _, context: seen.append(context))
    await ends(await arm.put(KeyError("bug"), 1), MotionUnknown)
    assert arm.hand.done == []
    await arm.aclose()
    loop.set_exception_handler(None)


@virtual
async def test_closing_leaves_the_arm_as_it_is() -> None:
    arm = Arm()
    motions = await arm.put(1, 2)
    await asyncio.sleep(0.5)
    await arm.aclose()
    await ends(motions, MotionStopped)
    assert arm.hand.stops == 0
