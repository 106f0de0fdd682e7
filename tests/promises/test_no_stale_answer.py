"""An answer is the answer to its question, or there is none; and it costs no more frames than that takes.

The quick form of `stale.py`, which goes on for longer, and over a real TCP connection.
"""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from promise_arms import BY_NAME, bench
from promise_clock import now, on_virtual_clock
from promise_stale import KINDS, QUESTIONS, Kind, tally_of

from dobot_async import ReplyTimeout

pytestmark = pytest.mark.timeout(100)
ANSWERS = 500


@pytest.mark.cases(3)
@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_no_answer_is_another_questions(kind: Kind) -> None:
    tally = tally_of(kind, ANSWERS)
    assert tally.answers >= ANSWERS, tally
    assert tally.stale == 0, tally


@pytest.mark.cases(2)
@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind.most], ids=lambda kind: kind.name)
def test_an_answer_costs_no_more_frames_than_it_takes(kind: Kind) -> None:
    assert kind.most
    tally = tally_of(kind, 2 * ANSWERS, calm=True)
    assert tally.answers >= 0.99 * tally.asked, tally
    assert tally.stale == 0, tally
    assert tally.frames_per_answer <= kind.most, tally


@pytest.mark.parametrize("gone", [1.0, 3.2, 10.0, 60.0])
@pytest.mark.parametrize("question", QUESTIONS[:4], ids=lambda question: question[0].name)
@on_virtual_clock
async def test_what_a_stalled_line_holds_back_answers_nobody_later(question: Any, gone: float) -> None:
    """One question gives up while the line stands still; the next one is asked just before it goes on."""
    from promise_frames import dated

    row, value, age = question
    async with bench(BY_NAME["magician"]) as b:
        b.line.stamp = lambda data: dated(data, now())
        await asyncio.sleep(0.1)
        await b.arm.link.request(row, value)
        # The question reaches the arm, and its answer does not come back.
        b.line.down.stand_still()
        with pytest.raises(ReplyTimeout):
            await b.arm.link.request(row, value, timeout=0.3)

        await asyncio.sleep(gone)
        asyncio.get_running_loop().call_later(0.02, b.line.recover)
        for _ in range(20):
            asked = now()
            answer = await b.arm.link.request(row, value)
            assert age(answer, asked) <= 0.001


@on_virtual_clock
async def test_an_output_that_was_set_meanwhile_is_read_as_it_is() -> None:
    """Stale answers as a user meets them: a level of before the line stood still."""
    async with bench(BY_NAME["magician"]) as b:
        from dobot_async.arms.magician import commands as c

        await b.arm.configure_io(5, c.IOFunction.DO)
        await b.arm.set_output(5, False)
        assert await b.arm.get_output(5) is False
        b.line.down.stand_still()
        with pytest.raises(ReplyTimeout):
            await b.arm.get_output(5, timeout=0.3)

        b.sim.arm.perform(c.SET_IODO, c.IODO(5, 1))
        await asyncio.sleep(6)
        asyncio.get_running_loop().call_later(0.05, b.line.recover)
        assert await b.arm.get_output(5) is True
