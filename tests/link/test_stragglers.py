"""Replies that come alone, long after their turn: none answers a later question; and what the guard costs."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from random import Random

import pytest
from link_line import LATENCY, LOST, TIME, Line, asked, line, now

from dobot_async._core.link.link import Link
from dobot_async._core.link.stragglers import AMONG, PROVEN, RARE, SUSPICION, Stragglers
from dobot_async.arms.magician.frame import Frame
from dobot_async.errors import ReplyTimeout

pytestmark = pytest.mark.virtual_time

KEEP = 3.0
"""Seconds by which a reply may be late that comes alone."""


# The rule


@pytest.fixture
def stragglers() -> Stragglers:
    found = Stragglers()
    for _ in range(10 * AMONG):
        found.sent()

    return found


def test_nobody_is_suspected_while_nothing_is_lost(stragglers: Stragglers) -> None:
    assert not stragglers.suspected("pose", 0.0)


def test_after_a_loss_its_key_is_suspected_for_a_while(stragglers: Stragglers) -> None:
    stragglers.lost("pose", 10.0)
    assert stragglers.suspected("pose", 10.0)
    assert stragglers.suspected("pose", 10.0 + SUSPICION - 0.001)
    assert not stragglers.suspected("pose", 10.0 + SUSPICION)
    assert not stragglers.suspected("alarms", 10.0)


def test_where_losses_are_frequent_nobody_is_suspected(stragglers: Stragglers) -> None:
    for _ in range(RARE):
        stragglers.lost("pose", 10.0)

    assert not stragglers.suspected("pose", 10.0)
    for _ in range(AMONG + 1):
        stragglers.sent()

    assert stragglers.suspected("pose", 10.0)


def test_a_loss_whose_reply_comes_after_all_was_none(stragglers: Stragglers) -> None:
    for second in range(10):
        stragglers.lost("pose", 10.0 + second)
        stragglers.came("pose", 10.5 + second)

    assert stragglers.suspected("pose", 19.9)
    stragglers.came("alarms", 19.9)
    later = 19.5 + PROVEN
    for _ in range(RARE):
        stragglers.lost("pose", later)

    assert not stragglers.suspected("pose", later)


def test_where_a_reply_came_alone_losses_are_suspected_however_many(stragglers: Stragglers) -> None:
    stragglers.lost("alarms", 10.0)
    stragglers.came("alarms", 10.5)
    for _ in range(RARE):
        stragglers.lost("pose", 11.0)

    assert stragglers.suspected("pose", 11.0)


def test_what_had_several_replies_is_suspected_and_no_loss_of_the_line(stragglers: Stragglers) -> None:
    for second in range(10):
        stragglers.lost("pose", 10.0 + second, counts=False)

    assert stragglers.suspected("pose", 19.0 + SUSPICION - 0.001)


# The link


class StragglingLine(Line):
    """A peer of which one reply in so many comes alone, after others that were behind it; one at a time."""

    def __init__(self, random: Random, every: int) -> None:
        super().__init__()
        self.random = random
        self.every = every
        self.stragglers = self.questions = 0
        self._alone_at = 0.0

    def _reach(self, data: bytes) -> None:
        loop = asyncio.get_running_loop()
        for frame in self.parser.feed(data):
            self.heard += 1
            self.questions += frame.id == TIME.id
            answer = bytes(self.answer(frame))
            if frame.id == TIME.id and self.questions % self.every == 0 and now() > self._alone_at:
                self.stragglers += 1
                self._alone_at = now() + self.random.uniform(0.2, KEEP)
                loop.call_at(self._alone_at, self._come, answer)
            else:
                self._due = max(self._due + 1e-6, now() + LATENCY)
                loop.call_at(self._due, self._come, answer)


async def ask_densely(link: Link[Frame], wire: Line, seconds: float, patience: float = 1.5) -> tuple[int, int, int]:
    """Asks without a pause; returns how many were answered, how many not, and how many with something stale."""
    answered = failed = stale = 0
    end = now() + seconds
    while now() < end:
        before = wire.heard
        with suppress(ReplyTimeout):
            stale += await asked(link, timeout=patience) <= before
            answered += 1
            failed -= 1

        failed += 1

    return answered, failed, stale


@pytest.mark.cases(1)
@pytest.mark.parametrize("seed", range(6))
async def test_no_answer_to_dense_questions_is_stale(seed: int) -> None:
    wire = StragglingLine(Random(seed), 70)
    async with line(over=wire) as (link, _):
        answered, failed, stale = await ask_densely(link, wire, 60)
        assert wire.stragglers > 20
        assert (stale, failed) == (0, 0)
        assert answered > 1000


async def test_a_question_with_two_replies_is_asked_again_and_the_guard_stays() -> None:
    async with line() as (link, wire):
        await ask_densely(link, wire, 1)
        wire.fates = iter([None])
        await asked(link)
        [*_, late] = [frame for _, frame in wire.sent if frame.key == TIME.id]
        for _ in range(5):
            before, sent = wire.heard, len(wire.times(TIME.id))
            call = asyncio.ensure_future(asked(link))
            await asyncio.sleep(LATENCY / 2)
            wire.say(late._replace(params=bytes(4)))
            assert await call > before
            assert len(wire.times(TIME.id)) == sent + 2


@pytest.mark.full
@pytest.mark.parametrize("seed", range(3))
async def test_who_gives_up_early_leaves_nothing_for_who_comes_next(seed: int) -> None:
    wire = StragglingLine(Random(seed), 70)
    async with line(over=wire) as (link, _):
        answered, _, stale = await ask_densely(link, wire, 60, patience=0.05)
        assert stale == 0
        assert answered > 1000


async def test_the_guard_costs_nothing_while_nothing_is_lost() -> None:
    async with line() as (link, wire):
        answered, failed, stale = await ask_densely(link, wire, 20)
        assert (len(wire.sent), failed, stale) == (answered, 0, 0)


@pytest.mark.full
async def test_the_guard_costs_little_on_a_line_that_loses_much() -> None:
    random = Random(1)
    async with line() as (link, wire):
        lost = 0

        def fates() -> object:
            nonlocal lost
            while True:
                gone = random.random() < 0.05
                lost += gone
                yield random.choice([None, LOST]) if gone else LATENCY

        wire.fates = fates()  # type: ignore[assignment]
        answered, failed, stale = await ask_densely(link, wire, 60)
        assert (failed, stale) == (0, 0)
        assert lost > 50
        assert len(wire.times(TIME.id)) <= answered + lost
        assert len(wire.sent) <= 1.5 * answered, "not a barrier behind each question"


async def test_after_a_loss_the_guard_goes_away_again() -> None:
    async with line() as (link, wire):
        await ask_densely(link, wire, 1)
        wire.fates = iter([None])
        await asked(link)
        await asyncio.sleep(KEEP)
        sent = len(wire.sent)
        answered, _, _ = await ask_densely(link, wire, 1)
        assert len(wire.sent) == sent + answered
