"""The queue of motions over an executor without an arm: the order, the ends, the stops, and what it costs."""

from __future__ import annotations

import asyncio
import gc
from collections.abc import Coroutine, Sequence
from contextlib import suppress
from typing import Any

import pytest
from fake_executor import GO, LATENCY, SET, FakeExecutor, Step, now, queue_over
from hypothesis import given, settings
from hypothesis import strategies as st
from quick_suite import examples
from virtual import run_virtual

from dobot_async._core.queue.batch import BatchBuilder, batch
from dobot_async._core.queue.executor import MotionSource
from dobot_async._core.queue.motion import Motion
from dobot_async._core.queue.queue import MotionQueue
from dobot_async.errors import (
    ArmAlarm,
    CommandRejected,
    ConnectionLost,
    DobotError,
    MotionStopped,
    MotionUnknown,
    ReplyTimeout,
)

pytestmark = pytest.mark.virtual_time

SOON = 0.2
"""Seconds within which the end of a motion is noticed while somebody waits."""

FAR_TOO_LONG = 30.0


def start(work: Coroutine[Any, Any, Any]) -> asyncio.Task[Any]:
    """Begins a call."""
    return asyncio.create_task(work)


async def put(queue: MotionQueue, name: Any, seconds: float = 0.1, **options: Any) -> Motion:
    """Puts a motion."""
    return await queue.put(GO, Step(name, seconds, **options))


async def end_of(motion: Motion) -> DobotError | None:
    """How a motion ends."""
    try:
        await motion.wait(FAR_TOO_LONG)
    except DobotError as error:
        return error

    return None


async def ends_of(motions: Sequence[Motion]) -> list[str]:
    """How motions end, by name."""
    return [type(error).__name__ for error in await asyncio.gather(*map(end_of, motions))]


# Put and wait


async def test_what_is_put_is_executed_in_order_and_done() -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        motions = [await put(queue, number) for number in range(5)]
        assert [motion.index for motion in motions] == [1, 2, 3, 4, 5]
        assert not any(motion.ended for motion in motions)
        await motions[4]
        assert executor.done == [0, 1, 2, 3, 4]
        assert all(motion.done for motion in motions)
        assert now() == pytest.approx(0.5, abs=SOON)
        assert queue.pending == 0
        await motions[0]
        assert motions[0].exception() is None


async def test_puts_at_once_keep_their_order() -> None:
    executor = FakeExecutor(capacity=3)
    async with queue_over(executor) as queue:
        motions = await asyncio.gather(*[put(queue, number) for number in range(20)])
        assert executor.sent == list(range(20))
        assert await ends_of(motions) == ["NoneType"] * 20


async def test_what_does_not_fit_is_refused_at_once() -> None:
    executor = FakeExecutor()
    wrong: Any = 7
    async with queue_over(executor) as queue:
        with pytest.raises(TypeError, match="no step"):
            await queue.put(GO, wrong)

        for timeout in (-1, float("nan")):
            with pytest.raises(ValueError, match="timeout"):
                await queue.put(GO, Step(1), timeout=timeout)

        assert not executor.calls


async def test_a_motion_may_be_awaited_by_many_and_who_is_cancelled_ends_only_its_waiting() -> None:
    async with queue_over(FakeExecutor()) as queue:
        motion = await put(queue, 1, 1.0)
        waiting = [start(motion.wait()) for _ in range(4)]
        await asyncio.sleep(0.5)
        waiting[0].cancel()
        await asyncio.wait(waiting)
        assert waiting[0].cancelled()
        assert [task.exception() for task in waiting[1:]] == [None] * 3


async def test_each_who_waits_gets_an_error_of_its_own() -> None:
    async with queue_over(FakeExecutor()) as queue:
        motion = await put(queue, 1, 5.0)
        waiting = [start(motion.wait()) for _ in range(3)]
        await asyncio.sleep(0.1)
        await queue.stop()
        errors = await asyncio.gather(*waiting, return_exceptions=True)
        assert {type(error) for error in errors} == {MotionStopped}
        errors += [motion.exception()]
        assert len({id(error) for error in errors}) == 4


async def test_the_wait_for_a_motion_has_its_time() -> None:
    async with queue_over(FakeExecutor()) as queue:
        motion = await put(queue, 1, 5.0)
        since = now()
        with pytest.raises(ReplyTimeout, match="it goes on"):
            await motion.wait(1.0)

        assert now() == pytest.approx(since + 1.0)
        assert not motion.ended
        with pytest.raises(asyncio.InvalidStateError):
            motion.exception()

        assert await end_of(motion) is None


async def test_done_comes_true_for_who_looks_again_and_again() -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        motion = await put(queue, 1, 2.0)
        looks = 0
        while not motion.done:
            await asyncio.sleep(0.25)
            looks += 1
            assert looks < 20

        assert now() == pytest.approx(2.0, abs=0.25 + SOON)
        assert motion.exception() is None


async def test_an_arm_of_which_nobody_wants_to_know_is_left_alone() -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        await put(queue, 1, 100.0)
        await asyncio.sleep(1)
        calls = sum(executor.calls.values())
        await asyncio.sleep(50)
        assert sum(executor.calls.values()) == calls


async def test_update_tells_without_anybody_who_waits() -> None:
    async with queue_over(FakeExecutor()) as queue:
        motion = await put(queue, 1, 0.5)
        await asyncio.sleep(1)
        assert not motion.ended
        await queue.update()
        assert motion.ended


@pytest.mark.full
async def test_what_nobody_awaits_fills_no_memory() -> None:
    executor = FakeExecutor(capacity=10)
    async with queue_over(executor) as queue:
        most = 0
        for number in range(20_000):
            await queue.put(SET, Step(number, 0.001))
            most = max(most, queue.pending)

        assert most < 1000
        await queue.join()
        assert queue.pending == 0
        assert executor.done == list(range(20_000))
        gc.collect()
        assert sum(isinstance(each, Motion) for each in gc.get_objects()) < 1000


async def test_a_failure_is_kept_for_join_although_nobody_awaits_the_motion() -> None:
    async with queue_over(FakeExecutor()) as queue:
        await put(queue, 1, fails=True)
        for number in range(150):
            try:
                await put(queue, number)
            except ArmAlarm:
                break

        with pytest.raises(ArmAlarm):
            await queue.join()


# Room


async def test_a_full_queue_makes_put_wait() -> None:
    executor = FakeExecutor(capacity=2)
    async with queue_over(executor) as queue:
        for number in range(2):
            await put(queue, number, 1.0)

        since = now()
        await put(queue, 2, 1.0)
        assert now() == pytest.approx(since + 1.0, abs=SOON)


async def test_who_finds_no_room_in_time_has_put_nothing() -> None:
    executor = FakeExecutor(capacity=1)
    async with queue_over(executor) as queue:
        first = await put(queue, 1, 3.0)
        since = now()
        with pytest.raises(ReplyTimeout, match="no room within 1 s"):
            await queue.put(GO, Step(2), timeout=1.0)

        assert now() == pytest.approx(since + 1.0)
        third = await put(queue, 3)
        assert await ends_of([first, third]) == ["NoneType"] * 2
        assert executor.sent == [1, 3]


@pytest.mark.parametrize("steps", range(12))
async def test_a_put_that_is_cancelled_is_sent_once_or_never(steps: int) -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        call = start(put(queue, 1))
        for _ in range(steps):
            await asyncio.sleep(0 if steps < 6 else LATENCY / 2)

        call.cancel()
        await asyncio.wait([call])
        last = await put(queue, 2)
        await last
        assert executor.sent in ([1, 2], [2])


async def test_a_put_that_is_cancelled_while_it_waits_is_never_sent() -> None:
    executor = FakeExecutor(capacity=1)
    async with queue_over(executor) as queue:
        await put(queue, 1, 1.0)
        calls = [start(put(queue, number)) for number in (2, 3, 4)]
        await asyncio.sleep(0.5)
        calls[1].cancel()
        await asyncio.wait(calls)
        await queue.join()
        assert executor.sent == [1, 2, 4]
        assert executor.done == [1, 2, 4]


async def test_a_put_that_is_on_its_way_when_it_is_cancelled_is_not_sent_twice() -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        call = start(put(queue, 1))
        await asyncio.sleep(1.5 * LATENCY)
        assert executor.sent == [1]
        call.cancel()
        await asyncio.wait([call])
        await (await put(queue, 2))
        assert executor.sent == [1, 2]


async def test_what_is_lost_on_its_way_is_sent_again_in_its_place() -> None:
    executor = FakeExecutor()
    executor.losses = 2
    async with queue_over(executor) as queue:
        motions = await asyncio.gather(*[put(queue, number) for number in range(4)])
        assert executor.sent == [0, 1, 2, 3]
        assert await ends_of(motions) == ["NoneType"] * 4


async def test_what_is_lost_on_its_way_is_not_sent_again_if_nobody_wants_it_any_more() -> None:
    executor = FakeExecutor()
    executor.losses = 1
    async with queue_over(executor) as queue:
        call = start(put(queue, 1))
        await asyncio.sleep(5 * LATENCY)
        call.cancel()
        await asyncio.wait([call])
        await (await put(queue, 2))
        assert executor.sent == [2]


# Stops


async def test_a_stop_ends_all_at_once_and_stops_the_arm() -> None:
    executor = FakeExecutor(capacity=2)
    async with queue_over(executor) as queue:
        motions = [await put(queue, number, 1.0) for number in range(2)]
        calls = [start(put(queue, number)) for number in (2, 3)]
        await asyncio.sleep(0.5)
        since = now()
        stop = start(queue.stop())
        await asyncio.sleep(0)
        assert all(motion.ended for motion in motions)
        await stop
        errors = await asyncio.gather(*calls, return_exceptions=True)
        assert [type(error) for error in errors] == [MotionStopped] * 2
        assert errors[0] is not errors[1]
        assert executor.stops == [pytest.approx(since, abs=SOON)]
        assert queue.pending == 0
        assert await ends_of(motions) == ["MotionStopped"] * 2
        assert executor.done == []


class SlowToEnd(FakeExecutor):
    """Brings to its end what it has begun to send when it is cancelled.

    Attributes:
        ended_at: When that was.
    """

    ended_at = 0.0

    async def submit(self, source: MotionSource) -> None:
        try:
            await super().submit(source)
        except asyncio.CancelledError:
            for _ in range(10):
                with suppress(asyncio.CancelledError):
                    await asyncio.sleep(LATENCY)

            self.ended_at = now()
            raise


async def test_the_queue_is_emptied_behind_what_was_still_being_sent() -> None:
    executor = SlowToEnd()
    async with queue_over(executor) as queue:
        call = start(put(queue, "under way", 1.0))
        await asyncio.sleep(LATENCY / 2)
        await queue.stop()
        assert 0 < executor.ended_at <= executor.clears[-1]
        await asyncio.gather(call, return_exceptions=True)


async def test_a_stop_ends_what_sets_the_arm_in_motion_beside_the_queue() -> None:
    executor = FakeExecutor()
    sent: list[float] = []

    async def jog() -> None:
        await asyncio.sleep(1)
        sent.append(now())

    async with queue_over(executor) as queue:
        call = start(queue.beside(jog()))
        await asyncio.sleep(0.1)
        await queue.stop()
        await asyncio.sleep(FAR_TOO_LONG)
        assert not sent
        with pytest.raises(MotionStopped):
            await call


async def test_clear_empties_the_queue_and_does_not_halt() -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        motion = await put(queue, 1, 1.0)
        await queue.clear()
        assert await ends_of([motion]) == ["MotionStopped"]
        assert (executor.stops, len(executor.clears)) == ([], 1)


@pytest.mark.parametrize("pauses", [(0.0,) * 4, (0.0005,) * 4, (0.002, 0.0, 0.003, 0.001)])
async def test_what_is_put_during_a_stop_goes_out_after_it_and_in_order(pauses: Sequence[float]) -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        await put(queue, "before", 1.0)
        stop = start(queue.stop())
        calls = []
        for number, pause in enumerate(pauses):
            await asyncio.sleep(pause)
            calls.append(start(put(queue, number)))

        await stop
        await asyncio.sleep(0)
        calls.append(start(put(queue, "after")))
        motions = await asyncio.gather(*calls)
        assert executor.sent == ["before", 0, 1, 2, 3, "after"]
        assert await ends_of(motions) == ["NoneType"] * 5
        assert executor.clears[0] <= now()


async def test_nothing_is_sent_while_a_stop_is_under_way() -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        await put(queue, "before", 10.0)
        await asyncio.sleep(1)
        executor.dead = True
        stop = start(queue.stop(timeout=100))
        call = start(put(queue, 1))
        await asyncio.sleep(3)
        assert executor.sent == ["before"]
        executor.dead = False
        await stop
        await call
        assert executor.sent == ["before", 1]


@pytest.mark.parametrize("later", [False, True])
async def test_a_look_that_began_before_a_stop_does_not_end_what_is_put_after_it(later: bool) -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        waiting = start(end_of(await put(queue, "before", 10.0)))
        await asyncio.sleep(0.1)
        executor.dead = True
        await asyncio.sleep(0.1)
        executor.dead = not later
        stop = start(queue.stop(timeout=100))
        await asyncio.sleep(0.1)
        call = start(put(queue, 1))
        await asyncio.sleep(3)
        executor.dead = False
        await stop
        assert isinstance(await waiting, MotionStopped)
        assert await end_of(await call) is None


async def test_who_puts_while_the_arm_does_not_hear_the_stop_is_told_in_time() -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        await put(queue, "before", 1.0)
        executor.dead = True
        with pytest.raises(ReplyTimeout, match="has not acknowledged"):
            await queue.stop(timeout=1.0)

        since = now()
        with pytest.raises(ReplyTimeout, match="nothing was sent"):
            await put(queue, 1)

        assert now() < since + 10
        with pytest.raises(ReplyTimeout):
            await queue.put(GO, Step(2), timeout=0.5)

        executor.dead = False
        await asyncio.sleep(5)
        assert executor.sent == ["before"]
        await put(queue, 3)
        assert executor.sent == ["before", 3]


async def test_a_stop_that_is_not_heard_in_time_goes_on() -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        executor.dead = True
        since = now()
        with pytest.raises(ReplyTimeout, match="within 2 s"):
            await queue.stop(timeout=2)

        assert now() == pytest.approx(since + 2)
        await asyncio.sleep(60)
        executor.dead, since = False, now()
        await asyncio.sleep(5)
        assert len(executor.stops) == 1


async def test_a_stop_of_which_the_caller_is_cancelled_goes_on() -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        executor.dead = True
        stop = start(queue.stop())
        await asyncio.sleep(0.5)
        stop.cancel()
        await asyncio.wait([stop])
        assert stop.cancelled()
        executor.dead = False
        await asyncio.sleep(5)
        assert len(executor.stops) == 1


async def test_stops_may_be_many_at_once() -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        motion = await put(queue, 1, 5.0)
        await asyncio.gather(queue.stop(), queue.clear(), queue.stop())
        assert await ends_of([motion]) == ["MotionStopped"]
        motion = await put(queue, 2)
        assert await end_of(motion) is None


async def test_what_the_arm_ticks_off_by_a_stop_is_not_done() -> None:
    for wait in range(40):
        executor = FakeExecutor()
        async with queue_over(executor) as queue:
            motion = await put(queue, 1, 5.0)
            waiting = start(end_of(motion))
            await asyncio.sleep(wait * LATENCY / 4)
            await queue.stop()
            assert isinstance(await waiting, MotionStopped)


async def test_a_stop_that_fails_is_told_and_the_queue_works_on() -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        executor.errors["stop"] = ConnectionLost("gone")
        with pytest.raises(ConnectionLost):
            await queue.stop()

        await asyncio.wait_for(put(queue, 1), 1)


async def test_the_end_of_the_connection_ends_a_stop() -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        executor.dead = True
        stop = start(queue.stop(timeout=1000))
        await asyncio.sleep(1)
        await executor.cleanup.aclose()
        with pytest.raises(ConnectionLost):
            await stop


# What fails


async def test_a_refusal_ends_only_what_was_put_in_the_same_call() -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        good = await put(queue, "good", 1.0)
        refused = [start(put(queue, "bad", refused=True))]
        later = start(put(queue, "later"))
        with pytest.raises(CommandRejected, match="bad is refused"):
            await refused[0]

        assert await ends_of([good, await later]) == ["NoneType"] * 2
        assert executor.sent == ["good", "later"]


async def test_a_refusal_ends_the_rest_of_its_batch() -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        later: asyncio.Task[Motion] | None = None
        with pytest.raises(CommandRejected):
            async with batch(queue, BatchBuilder(queue), None) as builder:
                first = builder.put(GO, Step(1))
                second = builder.put(GO, Step(2, refused=True))
                third = builder.put(GO, Step(3))
                asyncio.get_running_loop().call_soon(lambda: None)

        later = start(put(queue, "later"))
        motions = [first, second, third, await later]
        assert await ends_of(motions) == ["NoneType", "CommandRejected", "CommandRejected", "NoneType"]
        assert executor.sent == [1, "later"]


BUGS = [ZeroDivisionError("a bug"), RuntimeError("a bug"), KeyError("a bug"), TimeoutError("a bug"), OSError("a bug")]


@pytest.mark.parametrize("error", BUGS, ids=repr)
@pytest.mark.parametrize("where", ["submit", "acknowledgement"])
async def test_a_writer_that_dies_ends_everybody(where: str, error: Exception, caplog: Any) -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        pending = await put(queue, 1, 5.0)
        executor.errors[where] = error
        calls = [start(put(queue, number)) for number in (2, 3)]
        results = await asyncio.gather(*calls, return_exceptions=True)
        assert [type(result) for result in results] == [MotionUnknown] * 2
        assert await ends_of([pending]) == ["MotionUnknown"]
        await asyncio.sleep(1)
        assert len(executor.stops) == 1
        assert await end_of(await put(queue, 4)) is None


@pytest.mark.parametrize("error", BUGS, ids=repr)
@pytest.mark.parametrize("where", ["completed", "alarms", "earliest_end"])
async def test_a_poller_that_dies_ends_everybody(where: str, error: Exception, caplog: Any) -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        motions = [await put(queue, number, 5.0) for number in range(3)]
        waiting = start(ends_of(motions))
        await asyncio.sleep(0.5)
        executor.errors[where] = error
        assert await waiting == ["MotionUnknown"] * 3
        await asyncio.sleep(1)
        assert len(executor.stops) == 1
        assert await end_of(await put(queue, 4)) is None


@pytest.mark.parametrize("where", ["submit", "completed"])
@pytest.mark.parametrize("error", [MotionUnknown("switched off"), ConnectionLost("gone")])
async def test_what_the_executor_cannot_know_ends_everybody(where: str, error: DobotError) -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        motions = [await put(queue, number, 5.0) for number in range(2)]
        waiting = start(ends_of(motions))
        await asyncio.sleep(0.1)
        executor.errors[where] = error
        if where == "submit":
            with pytest.raises(type(error)):
                await put(queue, 3)

        assert await waiting == [type(error).__name__] * 2
        await asyncio.sleep(1)
        assert len(executor.stops) == isinstance(error, MotionUnknown)


async def test_an_executor_that_finds_out_by_itself_ends_everybody() -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        motion = await put(queue, 1, 5.0)
        executor.on_unknown(MotionUnknown("switched off"))
        assert await ends_of([motion]) == ["MotionUnknown"]
        await asyncio.sleep(1)
        assert len(executor.stops) == 1


async def test_an_arm_that_falls_silent_makes_motions_unknown_and_is_stopped_when_it_is_back() -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        motion = await put(queue, 1, 50.0)
        waiting = start(end_of(motion))
        await asyncio.sleep(0.1)
        executor.dead = True
        assert isinstance(await waiting, MotionUnknown)
        assert now() < 10
        await asyncio.sleep(20)
        executor.dead = False
        await asyncio.sleep(3)
        assert len(executor.stops) == 1


async def test_a_put_to_a_silent_arm_ends_in_time() -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        executor.dead = True
        with pytest.raises((ReplyTimeout, MotionUnknown)):
            await put(queue, 1)

        assert now() < 10
        executor.dead = False
        await asyncio.sleep(5)
        assert await end_of(await put(queue, 2)) is None
        assert executor.sent.count(1) <= 1


async def test_all_end_with_the_queue() -> None:
    executor = FakeExecutor(capacity=1)
    async with queue_over(executor) as queue:
        motion = await put(queue, 1, 5.0)
        calls = [start(motion.wait()), start(put(queue, 2)), start(queue.join())]
        await asyncio.sleep(0.5)

    results = await asyncio.gather(*calls, return_exceptions=True)
    assert [type(result) for result in results] == [MotionStopped] * 3
    assert executor.stops == []


# Alarms


async def test_an_alarm_ends_what_failed_and_all_behind_it() -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        motions = [await put(queue, 1), await put(queue, 2, fails=True), await put(queue, 3), await put(queue, 4)]
        found = await ends_of(motions)
        assert found == ["NoneType", "ArmAlarm", "ArmAlarm", "ArmAlarm"]
        assert executor.done == [1]
        await asyncio.sleep(1)
        assert len(executor.stops) == 1


@pytest.mark.parametrize("at_target", [False, True])
async def test_of_several_that_are_ticked_off_at_once_those_count_as_done_whose_target_was_reached(
    at_target: bool,
) -> None:
    executor = FakeExecutor()
    executor.at_target = at_target
    async with queue_over(executor) as queue:
        motions = [await put(queue, 1), await put(queue, 2), await put(queue, 3, fails=True), await put(queue, 4)]
        await asyncio.sleep(5)
        found = await ends_of(motions)
        assert found == [*["NoneType" if at_target else "ArmAlarm"] * 2, "ArmAlarm", "ArmAlarm"]


async def test_who_looks_while_the_alarm_is_cleared_does_not_take_for_done_what_was_thrown_away() -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        motions = [await put(queue, 1), await put(queue, 2), await put(queue, 3, fails=True), await put(queue, 4)]
        await asyncio.sleep(5)
        while not all(motion.ended for motion in motions):
            await queue.update()

        assert await ends_of(motions) == ["ArmAlarm"] * 4


async def test_what_does_not_move_the_arm_is_done_although_there_is_an_alarm() -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        quiet = await queue.put(SET, Step(1))
        moves = await put(queue, 2, fails=True)
        await asyncio.sleep(5)
        assert await ends_of([quiet, moves]) == ["NoneType", "ArmAlarm"]


async def test_an_alarm_while_the_queue_is_full_ends_who_waits_for_room() -> None:
    executor = FakeExecutor(capacity=2)
    async with queue_over(executor) as queue:
        motions = [await put(queue, 1, fails=True), await put(queue, 2)]
        calls = [start(put(queue, number)) for number in (3, 4, 5)]
        results = await asyncio.gather(*calls, return_exceptions=True)
        assert {type(result) for result in results if not isinstance(result, Motion)} == {ArmAlarm}
        assert now() < 2
        assert await ends_of(motions) == ["ArmAlarm"] * 2


async def test_an_alarm_while_the_queue_is_full_of_what_does_not_move_ends_who_waits_for_room() -> None:
    executor = FakeExecutor(capacity=2)
    async with queue_over(executor) as queue:
        for number in range(2):
            await queue.put(SET, Step(number, 0.5))

        executor.alarm = True
        with pytest.raises(ArmAlarm):
            await put(queue, 3)

        assert now() < 2


# Join


async def test_join_returns_when_all_is_done() -> None:
    executor = FakeExecutor(capacity=2)
    async with queue_over(executor) as queue:
        calls = [start(put(queue, number, 0.5)) for number in range(5)]
        await asyncio.sleep(0)
        await queue.join()
        assert executor.done == [0, 1, 2, 3, 4]
        await asyncio.gather(*calls)


async def test_join_has_one_deadline() -> None:
    async with queue_over(FakeExecutor()) as queue:
        for number in range(10):
            await put(queue, number, 1.0)

        since = now()
        with pytest.raises(ReplyTimeout, match="they go on"):
            await queue.join(3.5)

        assert now() == pytest.approx(since + 3.5)
        await queue.join(20)


async def test_join_raises_the_first_failure_since_the_last_join_once() -> None:
    async with queue_over(FakeExecutor()) as queue:
        motion = await put(queue, 1, fails=True)
        assert isinstance(await end_of(motion), ArmAlarm)
        await asyncio.sleep(1)
        with pytest.raises(ArmAlarm):
            await queue.join()

        await queue.join()
        await put(queue, 2)
        await queue.join()


async def test_join_does_not_raise_for_a_stop_of_this_program() -> None:
    async with queue_over(FakeExecutor()) as queue:
        await put(queue, 1, 5.0)
        await queue.stop()
        await queue.join()


async def test_who_joins_while_it_is_stopped_is_told() -> None:
    async with queue_over(FakeExecutor()) as queue:
        await put(queue, 1, 5.0)
        joining = start(queue.join())
        await asyncio.sleep(0.1)
        await queue.stop()
        with pytest.raises(MotionStopped):
            await joining


# Batches


async def test_a_batch_goes_out_together_when_its_block_ends() -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        async with batch(queue, BatchBuilder(queue), None) as builder:
            motions = [builder.put(GO, Step(number)) for number in range(3)]
            await put(queue, "meanwhile")
            with pytest.raises(RuntimeError, match="when the block of its batch ends"):
                await motions[0]

            assert not motions[0].done

        other = start(put(queue, "after"))
        assert executor.sent == ["meanwhile", 0, 1, 2]
        assert await ends_of([*motions, await other]) == ["NoneType"] * 4


async def test_nothing_comes_between_the_commands_of_a_batch() -> None:
    executor = FakeExecutor(capacity=1)
    async with queue_over(executor) as queue:

        async def batch_of(name: str) -> None:
            async with batch(queue, BatchBuilder(queue), None) as builder:
                for number in range(4):
                    builder.put(GO, Step(f"{name}{number}"))
                    await asyncio.sleep(0)

        await asyncio.gather(batch_of("a"), put(queue, "x"), batch_of("b"), put(queue, "y"))
        order = "".join(name[0] for name in executor.sent)
        assert "aaaa" in order
        assert "bbbb" in order


async def test_a_batch_that_is_left_by_an_error_is_not_sent() -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        with pytest.raises(ZeroDivisionError):
            async with batch(queue, BatchBuilder(queue), None) as builder:
                motion = builder.put(GO, Step(1))
                raise ZeroDivisionError

        assert motion.ended
        assert isinstance(motion.exception(), MotionStopped)
        assert executor.sent == []


async def test_of_a_batch_without_room_in_time_the_rest_is_not_sent() -> None:
    executor = FakeExecutor(capacity=2)
    async with queue_over(executor) as queue:
        with pytest.raises(ReplyTimeout):
            async with batch(queue, BatchBuilder(queue), 1.0) as builder:
                motions = [builder.put(GO, Step(number, 3.0)) for number in range(4)]

        assert await ends_of(motions) == ["NoneType", "NoneType", "ReplyTimeout", "ReplyTimeout"]
        assert executor.sent == [0, 1]


async def test_an_empty_batch_is_nothing() -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue, batch(queue, BatchBuilder(queue), None):
        pass

    assert not executor.calls


# In place of the writer


async def test_exclusive_work_keeps_the_writer_out_and_a_stop_ends_it() -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        working = start(queue.exclusively(asyncio.sleep(1), "homing"))
        await asyncio.sleep(0.1)
        call = start(put(queue, 1))
        await asyncio.sleep(0.5)
        assert executor.sent == []
        await working
        await call
        working = start(queue.exclusively(asyncio.sleep(100), "homing"))
        await asyncio.sleep(0.1)
        await queue.stop()
        with pytest.raises(MotionStopped, match="homing was stopped"):
            await working


# Any program


steps = st.one_of(
    st.tuples(st.just("put"), st.sampled_from([0.0, 0.01, 0.2]), st.booleans()),
    st.tuples(st.just("put"), st.sampled_from([0.0, 0.01, 0.2]), st.just(False)),
    st.tuples(st.just("cancelled put"), st.sampled_from([0.0, 0.001, 0.002, 0.003, 0.1])),
    st.tuples(st.just("stop"), st.booleans()),
    st.tuples(st.just("sleep"), st.sampled_from([0.0, 0.001, 0.002, 0.003, 0.05, 0.5])),
    st.tuples(st.just("refused")),
    st.tuples(st.just("deaf"), st.sampled_from([0.1, 1.0])),
)


class Program:
    """A program under way, and what it was told of each command."""

    def __init__(self, executor: FakeExecutor, queue: MotionQueue) -> None:
        self.executor = executor
        self.queue = queue
        self.calls: list[asyncio.Task[Any]] = []
        self.told: dict[int, DobotError | None] = {}

    async def put(self, number: int, seconds: float = 0.1, *, fails: bool = False, refused: bool = False) -> None:
        try:
            await (await put(self.queue, number, seconds, fails=fails, refused=refused))
        except DobotError as error:
            self.told[number] = error
        else:
            self.told[number] = None

    async def perform(self, number: int, step: Any) -> None:
        match step:
            case "put", seconds, fails:
                self.calls.append(start(self.put(number, seconds, fails=fails)))
            case ("refused",):
                self.calls.append(start(self.put(number, refused=True)))
            case "cancelled put", seconds:
                self.calls.append(start(self.put(number)))
                asyncio.get_running_loop().call_later(seconds, self.calls[-1].cancel)
            case "stop", halt:
                self.calls.append(start(self.queue.stop() if halt else self.queue.clear()))
            case "sleep", seconds:
                await asyncio.sleep(seconds)
            case "deaf", seconds:
                self.executor.dead = True
                await asyncio.sleep(seconds)
                self.executor.dead = False

    def check(self) -> None:
        sent, done = self.executor.sent, self.executor.done
        assert sent == sorted(set(sent)), "twice, or out of order"
        for number, error in self.told.items():
            assert error or number in done, "it was said to be done"
            assert number not in sent or not isinstance(error, CommandRejected)


@given(st.lists(steps, max_size=25), st.sampled_from([1, 2, 1000]))
@settings(max_examples=examples(200))
def test_any_program_is_sent_once_and_in_order_and_all_end(script: Any, capacity: int) -> None:
    async def scenario() -> None:
        executor = FakeExecutor(capacity)
        async with queue_over(executor) as queue:
            program = Program(executor, queue)
            for number, step in enumerate(script):
                await program.perform(number, step)

            async with asyncio.timeout(100):
                await asyncio.gather(*program.calls, return_exceptions=True)

            program.check()
            await asyncio.sleep(5)  # what was asked while the arm was silent has come to its end
            assert await end_of(await put(queue, len(script))) is None
            assert queue.pending == 0

    run_virtual(scenario())
