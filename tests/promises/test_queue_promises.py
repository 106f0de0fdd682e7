"""What a queue and its motions promise, case by case; C5 to C17 of the faults that were found on 2026-11-30.

What ends a download is in `test_standstill`.
"""

from __future__ import annotations

import asyncio
import gc
import traceback
from contextlib import suppress
from typing import Any

import pytest
from promise_arms import BY_NAME, Bench, Family, bench, each_family, motions_done, stands
from promise_clock import end_of, now, on_virtual_clock
from promise_line import Manner

from dobot_async import ArmAlarm, DobotError, Motion, MotionStopped, ReplyTimeout
from dobot_async.arms.magician import commands as c

pytestmark = pytest.mark.timeout(100)
MAGICIAN = BY_NAME["magician"]
SLACK = 0.1
OUT_OF_REACH = (600, 0, 0)


async def alarmed(b: Bench) -> list[Any]:
    """Three motions, the first out of reach, so that the arm raises alarms."""
    await b.arm.queue.pause()
    places = (OUT_OF_REACH, (220, 0, 40), (200, 0, 40))
    motions = [await b.arm.queue.move_to(*place) for place in places]
    await b.arm.queue.resume()
    return motions


# Hooks are isolated.


@pytest.mark.parametrize("outgoing", [True, False])
@each_family
@on_virtual_clock
async def test_a_hook_that_raises_breaks_nothing(family: Family, outgoing: bool) -> None:
    async with bench(family, speed=10) as b:
        called = 0

        def raising(out: bool, frame: object) -> None:
            nonlocal called
            if out is outgoing:
                called += 1
                raise RuntimeError("a hook of the user's")

        b.arm.link.on_frame.add(raising)
        async with asyncio.timeout(60):
            await family.read(b.arm)
            await (await b.arm.queue.move_joints(*family.near))
            await b.arm.queue.join()
            await b.arm.move_joints(*family.far)

        assert called > 3
        assert motions_done(b.sim) == 2


@on_virtual_clock
async def test_a_hook_that_raises_once_does_not_end_who_watches_the_arm() -> None:
    async with bench(MAGICIAN, manner=Manner()) as b:
        calls = 0

        def raising(outgoing: bool, frame: Any) -> None:
            nonlocal calls
            calls += outgoing and frame.id == c.GET_QUEUED_CMD_CURRENT_INDEX.id
            if calls == 3:
                raise RuntimeError("a hook of the user's")

        b.arm.link.on_frame.add(raising)
        async with asyncio.timeout(60):
            await (await b.arm.queue.move_to(220, 0, 40))

        assert motions_done(b.sim) == 1


@each_family
@on_virtual_clock
async def test_several_hooks_hear_all_frames_until_they_are_removed(family: Family) -> None:
    async with bench(family, speed=10) as b:
        heard: list[tuple[int, bool]] = []

        def first(out: bool, frame: object) -> None:
            heard.append((1, out))
            raise RuntimeError("a hook of the user's")

        def second(out: bool, frame: object) -> None:
            assert bytes(frame)  # type: ignore[call-overload]
            heard.append((2, out))

        b.arm.link.on_frame.add(first)
        b.arm.link.on_frame.add(second)
        await family.read(b.arm)
        assert {(1, True), (1, False), (2, True), (2, False)} <= set(heard)
        b.arm.link.on_frame.remove(first)
        heard.clear()
        await family.read(b.arm)
        assert {number for number, _ in heard} == {2}
        b.arm.link.on_frame.remove(second)
        heard.clear()
        await family.read(b.arm)
        assert not heard


# Join has one deadline, and tells of failures.


@each_family
@on_virtual_clock
async def test_join_has_one_deadline(family: Family) -> None:
    async with bench(family) as b:
        for _ in range(5):
            await b.arm.queue.wait(2)

        before = now()
        with pytest.raises(ReplyTimeout):
            await b.arm.queue.join(timeout=3)

        assert now() - before == pytest.approx(3, abs=SLACK)
        await b.arm.queue.join(timeout=30)


@on_virtual_clock
async def test_join_tells_of_a_failure_that_others_have_seen() -> None:
    async with bench(MAGICIAN, speed=10) as b:
        motions = await alarmed(b)
        with pytest.raises(ArmAlarm):
            await motions[0]

        with pytest.raises(ArmAlarm):
            await b.arm.queue.join()

        await b.arm.recover()
        await b.arm.queue.join()  # it was told
        await b.arm.queue.move_to(220, 0, 40)
        await b.arm.queue.join()
        assert motions_done(b.sim) == 1


@each_family
@on_virtual_clock
async def test_join_tells_of_a_failure_that_nobody_has_seen(family: Family) -> None:
    """A motion whose Motion was thrown away was stopped from elsewhere, as by a timeout of another call."""
    async with bench(family, speed=0.5) as b:
        await b.arm.queue.move_joints(*family.far)
        with pytest.raises(ReplyTimeout):
            await b.arm.move_joints(*family.near, timeout=0.5)

        with pytest.raises(MotionStopped):
            await b.arm.queue.join()


# An instance per raise.


async def raised_by(motion: Any) -> BaseException:
    """What awaiting a motion raises."""
    try:
        await motion
    except DobotError as error:
        return error

    raise AssertionError("it raises nothing")


async def raised_in_context(motion: Any) -> BaseException:
    """The same, while something else is being handled."""
    nothing: dict[str, int] = {}
    try:
        nothing["another program's affair"] += 1
    except KeyError:
        return await raised_by(motion)

    raise AssertionError


@on_virtual_clock
async def test_each_awaiter_gets_an_alarm_of_its_own() -> None:
    async with bench(MAGICIAN, speed=10) as b:
        motion, *_ = await alarmed(b)
        one, two = await asyncio.gather(raised_in_context(motion), raised_by(motion))
        three = await raised_by(motion)
        assert len({id(one), id(two), id(three)}) == 3
        assert {type(each) for each in (one, two, three)} == {ArmAlarm}
        assert len({str(each) for each in (one, two, three)}) == 1
        alarms = [each.alarms for each in (one, two, three) if isinstance(each, ArmAlarm)]
        assert alarms[0]
        assert alarms.count(alarms[0]) == 3
        assert isinstance(one.__context__, KeyError)
        assert two.__context__ is None
        assert three.__context__ is None
        assert "raised_in_context" not in "".join(traceback.format_exception(two))


@each_family
@on_virtual_clock
async def test_each_awaiter_of_a_stopped_motion_gets_an_error_of_its_own(family: Family) -> None:
    async with bench(family, speed=0.5) as b:
        motions = [await b.arm.queue.move_joints(*family.far), await b.arm.queue.move_joints(*family.near)]
        waiting = [asyncio.ensure_future(raised_by(each)) for each in (*motions, *motions)]
        await asyncio.sleep(0.3)
        await b.arm.stop()
        errors = await asyncio.gather(*waiting)
        errors += [await raised_by(motions[0]), await raised_by(motions[0])]
        assert {type(each) for each in errors} == {MotionStopped}
        assert len({id(each) for each in errors}) == len(errors)
        assert all(each.__context__ is None for each in errors)


@each_family
@on_virtual_clock
async def test_each_call_on_a_lost_link_gets_an_error_of_its_own(family: Family) -> None:
    async with bench(family, speed=0.5) as b:
        motion = await b.arm.queue.move_joints(*family.far)
        await asyncio.sleep(0.2)
        b.line.break_off()
        await asyncio.sleep(0.2)
        errors = [await raised_by(motion), await raised_by(motion)]
        errors += [await raised_by(family.read(b.arm)), await raised_by(family.read(b.arm))]
        assert all(isinstance(each, ConnectionError) for each in errors), errors
        assert len({id(each) for each in errors}) == 4


# Memory is bounded.


@pytest.mark.full
@each_family
@on_virtual_clock
async def test_commands_whose_motions_nobody_keeps_need_no_memory(family: Family) -> None:
    """What such a program tells often moves nothing; nobody ever asks how far the arm is."""
    many, most = 2000, 1100

    def motions() -> int:
        gc.collect()
        return sum(isinstance(each, Motion) for each in gc.get_objects())

    async with bench(family, speed=100, manner=Manner(latency=0.001), details={}) as b:
        before = motions()

        async def tell(step: int) -> None:
            if family.name == "magician":
                await b.arm.queue.suction(step % 2 == 1)
            elif family.name == "mycobot":
                await b.arm.queue.color(step % 256, 0, 0)
            else:
                await b.arm.queue.fan(step % 2 == 1)

        for step in range(many):
            await tell(step)

        assert motions() - before < most
        assert b.arm.queue.pending < most
        async with asyncio.timeout(400):
            await b.arm.queue.join()

        assert b.arm.queue.pending == 0


# A motion of a batch cannot be awaited before the batch is sent.


@each_family
@on_virtual_clock
async def test_awaiting_a_motion_in_its_own_batch_is_an_error(family: Family) -> None:
    async with bench(family, speed=10) as b:
        with pytest.raises(RuntimeError, match="batch"):
            async with asyncio.timeout(30), b.arm.queue.batch() as batch:
                await batch.move_joints(*family.near)

        assert not await stands(b.sim)
        await b.arm.move_joints(*family.near)


# Who is stopped while putting hears that.


@pytest.mark.parametrize("later", [0.001, 0.005, 0.01, 0.015, 0.02, 0.03, 0.06, 0.1, 0.2, 0.5])
@pytest.mark.parametrize("lost", ["nothing", "reply", "request"])
@each_family
@on_virtual_clock
async def test_a_put_that_a_stop_interrupts_is_stopped(family: Family, lost: str, later: float) -> None:
    async with bench(family, speed=0.5) as b:
        await asyncio.sleep(0.3)
        left = [0]

        def lose_one(data: bytes) -> bytes | None:
            return None if left and left.pop() == 0 else data

        if lost != "nothing":
            (b.line.down if lost == "reply" else b.line.up).spoil = lose_one

        putting = asyncio.ensure_future(b.arm.queue.move_joints(*family.far))
        await asyncio.sleep(later)
        await b.arm.stop()
        ended = await end_of(putting, 10)
        if ended.result is not None:
            assert ended.result.index is not None
            assert isinstance(await raised_by(ended.result), MotionStopped)
        else:
            assert isinstance(ended.error, MotionStopped), ended

        assert b.arm.queue.pending == 0
        await asyncio.sleep(1)
        assert not await stands(b.sim)


# What can be known of a motion without awaiting it.


@each_family
@on_virtual_clock
async def test_polling_done_comes_true(family: Family) -> None:
    async with bench(family, speed=10) as b:
        motion = await b.arm.queue.move_joints(*family.near)
        ends = now() + 30
        while not motion.done:
            assert now() < ends, "it never comes true"
            await asyncio.sleep(0.2)

        assert motions_done(b.sim) == 1
        assert motion.exception() is None


@each_family
@on_virtual_clock
async def test_exception_says_how_a_motion_has_ended(family: Family) -> None:
    async with bench(family, speed=0.5) as b:
        motion = await b.arm.queue.move_joints(*family.far)
        with pytest.raises(asyncio.InvalidStateError):
            motion.exception()

        await b.arm.stop()
        assert motion.done
        assert isinstance(motion.exception(), MotionStopped)
        assert motion.exception() is not await raised_by(motion)


@on_virtual_clock
async def test_exception_of_a_motion_that_an_alarm_has_ended() -> None:
    async with bench(MAGICIAN, speed=10) as b:
        motion, *_ = await alarmed(b)
        ends = now() + 30
        while not motion.done:
            assert now() < ends, "it never ends"
            await asyncio.sleep(0.2)

        assert isinstance(motion.exception(), ArmAlarm)
        with suppress(ArmAlarm):
            await b.arm.queue.join()
