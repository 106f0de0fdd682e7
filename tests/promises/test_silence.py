"""An arm that does not answer on an open link: nothing is lost by that, and nothing is claimed.

The link is not lost (`ConnectionLost` means that it is gone). Questions raise ReplyTimeout. Motions stay pending, or
end as MotionUnknown together with a stop that reaches the arm within 1 s after the line is back; nobody is told that
they are done. After it everything works again.
"""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from promise_arms import Bench, Family, bench, each_family, motions_done, stands
from promise_clock import Ended, end_of, now, on_virtual_clock

from dobot_async import ConnectionLost, LinkState, MotionStopped, MotionUnknown, ReplyTimeout

pytestmark = pytest.mark.timeout(100)
SIX = 6
HEARD_WITHIN = 1.0
SLOWLY = 0.1  # six motions take longer than a minute

each_silence = pytest.mark.parametrize("seconds", [6.0, 30.0, 60.0])
each_fault = pytest.mark.parametrize("fault", ["dead", "still"])


def fall_silent(b: Bench, fault: str) -> None:
    """From now on the arm is not heard, and does not hear."""
    if fault == "dead":
        b.line.die()
    else:
        b.line.stand_still()


async def six(b: Bench) -> list[Any]:
    """Queues six motions, to and fro."""
    motions = []
    for step in range(SIX):
        share = 1 if step % 2 == 0 else 0.5
        motions.append(await b.arm.queue.move_joints(*(share * joint for joint in b.family.far)))

    return motions


async def asked(b: Bench) -> Any:
    """What comes out of a question; None is an answer."""
    ended = await end_of(b.family.read(b.arm), 20)
    return ended if ended.seconds > 20 else ended.error


@each_silence
@each_fault
@each_family
@on_virtual_clock
async def test_motions_stay_pending_or_are_unknown(family: Family, fault: str, seconds: float) -> None:
    async with bench(family, speed=SLOWLY, on_error="leave") as b:
        motions = await six(b)
        waiting = [asyncio.ensure_future(each.wait()) for each in motions]
        joining = asyncio.ensure_future(b.arm.queue.join())
        await asyncio.sleep(0.3)
        fall_silent(b, fault)
        silent_until = now() + seconds
        while now() < silent_until - 0.1:
            await asyncio.sleep(0.1)
            assert b.arm.link.state.value is LinkState.OPEN
            for each in (*waiting, joining):
                if each.done():
                    assert isinstance(each.exception(), MotionUnknown), each

        await asyncio.sleep(0.1)
        unknown = any(each.done() for each in waiting)
        b.line.recover()
        await asyncio.sleep(HEARD_WITHIN)
        if unknown:
            assert not await stands(b.sim)
            ended = await asyncio.gather(*waiting, joining, return_exceptions=True)
            assert all(isinstance(each, MotionUnknown | MotionStopped) for each in ended), ended
        else:
            # What was pending comes to its end: none of it is done before the arm has done it.
            for done, each in enumerate(waiting, 1):
                await asyncio.wait_for(each, 300)
                assert motions_done(b.sim) >= done

            await asyncio.wait_for(joining, 10)

        await b.works_again()
        await b.arm.queue.stop()


@each_silence
@each_fault
@each_family
@on_virtual_clock
async def test_join_never_returns_as_if_all_was_done(family: Family, fault: str, seconds: float) -> None:
    """Nobody awaits the motions; a join that is called during the silence, or after it, knows of them."""
    async with bench(family, speed=SLOWLY, on_error="leave") as b:
        await six(b)
        await asyncio.sleep(0.3)
        fall_silent(b, fault)
        joining = asyncio.ensure_future(b.arm.queue.join())
        await asyncio.sleep(seconds)
        b.line.recover()
        await asyncio.sleep(0.5)
        ends: list[Ended] = [await end_of(joining, 300)]
        if ends[0].error is None:
            ends.append(await end_of(b.arm.queue.join(), 300))

        for each in ends:
            assert not isinstance(each.error, ConnectionLost), each
            assert each.error is not None or motions_done(b.sim) == SIX, f"{each}, and {motions_done(b.sim)} are done"

        await b.works_again()


@each_silence
@each_fault
@each_family
@on_virtual_clock
async def test_questions_raise_reply_timeout_and_are_answered_again(family: Family, fault: str, seconds: float) -> None:
    async with bench(family) as b:
        fall_silent(b, fault)
        silent_until = now() + seconds
        while now() < silent_until - 3:
            error = await asked(b)
            assert isinstance(error, ReplyTimeout), error
            await asyncio.sleep(0.5)

        await asyncio.sleep(silent_until - now())
        b.line.recover()
        await b.works_again(within=5.0)
        assert b.arm.link.state.value is LinkState.OPEN
        await b.arm.move_joints(*family.near, timeout=60)
        assert motions_done(b.sim) == 1


@each_family
@on_virtual_clock
async def test_a_motion_that_ends_in_the_silence_is_told_after_it(family: Family) -> None:
    async with bench(family, speed=1, on_error="leave") as b:
        waiting = asyncio.ensure_future(b.arm.move_joints(*family.near))
        await asyncio.sleep(0.1)
        b.line.die()
        await asyncio.sleep(10)
        b.line.recover()
        ended = await end_of(waiting, 60)
        # The arm has done it; who could not see that may say that it is unknown, and nothing else.
        assert ended.error is None or isinstance(ended.error, MotionUnknown), ended
