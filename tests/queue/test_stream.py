"""`queue.stream`: steps of any source, as fast as the arm takes them, told as they are done; and what errors name."""

from __future__ import annotations

import asyncio
import inspect
from collections.abc import AsyncIterator, Iterator
from contextlib import aclosing, suppress
from dataclasses import dataclass
from typing import Any, cast

import pytest
from fake_executor import ALARM, GO, SET, FakeExecutor, Step, now, queue_over

from dobot_async import Magician, MyCobot, UltraArm
from dobot_async._core.protocol.wire import Command
from dobot_async._core.queue import stream
from dobot_async._core.queue.motion import Motion
from dobot_async.arms.magician import commands as c
from dobot_async.errors import (
    ArmAlarm,
    CommandRejected,
    ConnectionLost,
    DobotError,
    MotionStopped,
)
from dobot_async.simulator import simulate

pytestmark = pytest.mark.virtual_time


@dataclass(frozen=True)
class Line:
    """A step as a program has it."""

    name: Any
    value: Step
    command: Command[Step, None] = GO

    def __str__(self) -> str:
        return f"line {self.name}"


def line(name: Any, seconds: float = 0.1, command: Command[Step, None] = GO, **options: Any) -> Line:
    return Line(name, Step(name, seconds, **options), command)


def notes(error: BaseException) -> list[str]:
    return getattr(error, "__notes__", [])


def names(error: DobotError) -> list[object]:
    return [step.name for step in error.steps if isinstance(step, Line)]


# What is done


async def test_all_steps_are_done_in_order_and_told_as_they_are_done() -> None:
    executor = FakeExecutor(capacity=3)
    lines = [line(number, 1) for number in range(10)]
    told = []
    async with queue_over(executor) as queue:
        async for done in queue.stream(lines):
            told.append((done.name, now()))
            assert executor.done == [name for name, _ in told]

    assert [name for name, _ in told] == list(range(10))
    for number, at in told:
        assert number + 1 <= at < number + 1.5


async def test_verbs_are_steps_and_their_motions_are_told() -> None:
    executor = FakeExecutor(capacity=2)
    async with queue_over(executor) as queue:
        steps = (queue.put(GO, Step(number)) for number in range(6))
        motions = [motion async for motion in queue.stream(steps)]

    assert all(type(motion) is Motion for motion in motions)
    assert [motion.index for motion in motions] == [1, 2, 3, 4, 5, 6]
    assert executor.done == list(range(6))


async def test_an_await_returns_when_all_is_done() -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        await queue.stream(line(number) for number in range(4))
        assert executor.done == [0, 1, 2, 3]
        await queue.stream([])


async def test_steps_may_come_one_by_one_and_their_end_is_told_meanwhile() -> None:
    executor = FakeExecutor()

    async def sensor() -> AsyncIterator[Line]:
        for number in range(3):
            yield line(number, 1)
            await asyncio.sleep(10)

    async with queue_over(executor) as queue:
        ends = [now() async for _ in queue.stream(sensor())]

    assert [round(end) for end in ends] == [1, 11, 21]


# Back-pressure


async def test_steps_are_drawn_as_the_arm_has_room() -> None:
    executor = FakeExecutor(capacity=3)
    drawn: list[int] = []

    def endless() -> Iterator[Line]:
        while True:
            drawn.append(len(drawn))
            yield line(drawn[-1], 1)

    async with queue_over(executor) as queue:
        async with aclosing(aiter(queue.stream(endless()))) as steps:  # type: ignore[type-var]
            async for done in steps:
                assert len(drawn) <= done.name + 6
                if done.name == 9:
                    break

        count = len(drawn)
        await queue.join()
        assert len(drawn) == count
        assert executor.done == list(range(len(executor.sent)))  # what was queued goes on


async def test_a_slow_loop_body_does_not_starve_the_arm() -> None:
    executor = FakeExecutor(capacity=3)
    async with queue_over(executor) as queue:
        async for done in queue.stream(line(number, 1) for number in range(20)):
            if done.name == 0:
                await asyncio.sleep(30)
                assert executor.done == list(range(20))


async def test_no_more_than_so_many_are_done_that_nobody_has_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stream, "AHEAD", 5)
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        async for done in queue.stream(line(number, 0.1) for number in range(20)):
            if done.name == 0:
                await asyncio.sleep(30)
                assert executor.done == list(range(6))

    assert executor.done == list(range(20))


async def test_a_cancelled_await_ends_the_queueing_and_leaves_what_is_queued() -> None:
    executor = FakeExecutor(capacity=3)
    async with queue_over(executor) as queue:
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(2.5):
                await queue.stream(line(number, 1) for number in range(20))

        await queue.join()
        assert executor.done == list(range(len(executor.sent)))
        assert 3 <= len(executor.sent) <= 6
        assert executor.stops == []


# Whose fault it is


async def test_an_alarm_names_the_step_that_failed() -> None:
    executor = FakeExecutor()
    lines = [line(1), line(2, 1), line(3, 1, fails=True), line(4), line(5)]
    async with queue_over(executor) as queue:
        with pytest.raises(ArmAlarm, match=f"{ALARM}; in Go .index 3.") as failed:
            await queue.stream(lines)

    assert notes(failed.value) == ["line 3"]
    assert failed.value.steps == (lines[2], lines[2])
    assert [getattr(motion, "index", None) for motion in failed.value.motions] == [3]


@pytest.mark.parametrize("at_target", [False, True])
async def test_an_alarm_names_the_two_steps_between_which_it_came_up(at_target: bool) -> None:
    executor = FakeExecutor()
    executor.at_target = at_target
    lines = [line(1), line(2, 1), line(3, 0, fails=True), line(4), line(5)]
    async with queue_over(executor) as queue:
        with pytest.raises(ArmAlarm, match=r"in Go .index 2. or Go .index 3.") as failed:
            await queue.stream(lines)

    first = 3 if at_target else 2
    assert notes(failed.value) == ["line 3"] if at_target else ["line 2 or line 3"]
    assert failed.value.steps == (lines[first - 1], lines[2])


async def test_an_alarm_of_a_queue_names_the_first_motion_that_is_not_known_to_be_done() -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        motions = [await queue.put(GO, Step(number, 1, fails=number == 4)) for number in range(6)]
        await motions[1]
        await asyncio.sleep(30)
        with pytest.raises(ArmAlarm, match=r"in Go .index 3. to Go .index 5.") as failed:
            await motions[5]

        assert failed.value.motions == tuple(motions[2:5])


async def test_an_alarm_while_the_queue_is_full_names_the_step() -> None:
    executor = FakeExecutor(capacity=2)
    async with queue_over(executor) as queue:
        with pytest.raises(ArmAlarm) as failed:
            await queue.stream(line(number, 1, fails=number == 3) for number in range(9))

    assert notes(failed.value) == ["line 3"]


async def test_an_alarm_is_raised_although_no_step_comes() -> None:
    executor = FakeExecutor()

    async def stuck() -> AsyncIterator[Line]:
        yield line(1, 1, fails=True)
        await asyncio.Event().wait()

    async with queue_over(executor) as queue:
        with pytest.raises(ArmAlarm):
            await queue.stream(stuck())

        assert now() < 3


async def test_a_stop_names_the_step_that_it_ended() -> None:
    executor = FakeExecutor(capacity=3)
    async with queue_over(executor) as queue:
        asyncio.get_running_loop().call_later(2.5, lambda: queue.begin_stop(MotionStopped("told to stop")))
        with pytest.raises(MotionStopped) as failed:
            await queue.stream(line(number, 1) for number in range(9))

        await asyncio.sleep(1)

    assert notes(failed.value)[0].startswith("line 2")
    assert names(failed.value)[0] == 2


async def test_a_step_that_is_refused_is_named() -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        with pytest.raises(CommandRejected) as failed:
            await queue.stream([line(1), line(2, refused=True), line(3)])

        assert notes(failed.value)[0].endswith("line 2")
        assert names(failed.value)[1] == 2
        with pytest.raises(TypeError) as wrong:
            await queue.stream([line(1), Line("wrong", cast(Any, "no step"))])

        assert notes(wrong.value) == ["line wrong"]


async def test_a_step_without_words_is_named_by_its_place_and_its_command() -> None:
    executor = FakeExecutor()

    @dataclass(frozen=True)
    class Bare:
        command: Command[Step, None]
        value: Step

    async with queue_over(executor) as queue:
        with pytest.raises(ArmAlarm) as failed:
            await queue.stream([Bare(SET, Step(1)), Bare(GO, Step(2, 1, fails=True))])

        assert notes(failed.value) == ["step 2 (Go)"]
        with pytest.raises(ArmAlarm) as also:
            await queue.stream(queue.put(GO, Step(number, fails=number == 3)) for number in range(1, 9))

        assert notes(also.value) == ["step 3 (Go (index 5))"]


async def test_what_the_source_raises_comes_out_and_what_was_queued_goes_on() -> None:
    executor = FakeExecutor()

    def broken() -> Iterator[Line]:
        yield line(1, 1)
        raise ZeroDivisionError

    async with queue_over(executor) as queue:
        with pytest.raises(ZeroDivisionError):
            await queue.stream(broken())

        await queue.join()

    assert executor.done == [1]


async def test_verbs_of_a_list_that_are_not_begun_are_closed() -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        steps = [queue.put(GO, Step(number, fails=number == 1, refused=number == 2)) for number in range(9)]
        with suppress(DobotError):
            await queue.stream(steps)

        assert {inspect.getcoroutinestate(cast(Any, step)) for step in steps} == {inspect.CORO_CLOSED}


async def test_what_is_no_step_is_refused() -> None:
    executor = FakeExecutor()
    async with queue_over(executor) as queue:
        with pytest.raises(TypeError, match="a step is a verb of the queue"):
            await queue.stream([asyncio.sleep(0)])  # type: ignore[list-item]


# Arms


@pytest.mark.full
async def test_a_magician_draws_a_path_of_any_length() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        points = [(200 + 20 * (number % 2), float(number % 50), 40.0) for number in range(100)]
        await arm.queue.stream(arm.queue.move_to(*point) for point in points)
        moves = [each.value for each in sim.arm.executed if each.command is c.SET_PTP_CMD]
        assert [(move.x, move.y, move.z) for move in moves] == points


async def test_a_magician_tells_which_point_cannot_be_reached() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        with pytest.raises(ArmAlarm) as failed:
            await arm.queue.stream(arm.queue.move_to(x, 0, 40) for x in (200, 220, 900, 210))

        assert "step 3" in notes(failed.value)[0]
        assert [each.outcome for each in sim.arm.executed if each.command is c.SET_PTP_CMD][:2] == ["done", "done"]


async def test_the_other_families_have_it_too() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        await arm.queue.stream(arm.queue.move_joints(angle, 0, 0, 0, 0, 0) for angle in (10, 20))
        assert sim.arm.angles[0] == pytest.approx(20, abs=0.1)
        with pytest.raises(ArmAlarm, match=r"; in SendCoords .index \d.") as failed:
            await arm.queue.stream(
                [arm.queue.move_joints(0, 0, 0, 0, 0, 0), arm.queue.move_to(270, 270, 400, 0, 0, 0), arm.queue.home()]
            )

        assert notes(failed.value)[0].startswith("step 2")

    async with simulate("ultraarm", homed=True) as sim2, UltraArm.connect(sim2.url) as arm2:
        await arm2.queue.stream(arm2.queue.move_to(200, y, 40) for y in (0, 20))
        assert sim2.arm.pose.y == pytest.approx(20, abs=0.1)


async def test_a_line_that_is_cut_names_the_first_step_that_is_not_known_to_be_done() -> None:
    async with simulate() as sim:
        with pytest.raises(ConnectionLost) as failed:
            async with Magician.connect(sim.url) as arm:
                steps = (arm.queue.move_to(200 + 50 * (number % 2), 0, 40) for number in range(50))
                done = 0
                async for _ in arm.queue.stream(steps):
                    done += 1
                    if done == 2:
                        sim.unplug()

        assert notes(failed.value)[0].startswith("step 3")
