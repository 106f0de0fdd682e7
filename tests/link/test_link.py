"""The link over a line in memory with a peer that answers in order, on a clock that jumps over every wait."""

from __future__ import annotations

import asyncio
import math
import struct
from collections.abc import Awaitable, Callable
from contextlib import aclosing, suppress
from itertools import chain, pairwise, repeat
from typing import Any

import anyio
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from link_line import (
    BARRIERS,
    LATENCY,
    LOST,
    QUESTIONS,
    TIME,
    Line,
    StrictParser,
    asked,
    line,
    link_over,
    now,
    number_in,
    question,
    start,
)
from quick_suite import examples
from virtual import run_virtual

from dobot_async._core.link.link import Link
from dobot_async._core.link.round_trip import RoundTrip
from dobot_async._core.protocol.contract import LinkState, Unexpected
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.frame import FILLER, Frame, Parser, request
from dobot_async.errors import ConnectFailed, ConnectionLost, ProtocolError, ReplyTimeout
from dobot_async.transports.memory import memory_pair

pytestmark = pytest.mark.virtual_time

STOP = c.SET_QUEUED_CMD_FORCE_STOP_EXEC
ONCE = c.SET_QUEUED_CMD_START_DOWNLOAD
DOWNLOAD = c.QueuedCmdStartDownload(1, 1)
BARRIER_KEYS = {frame.key for frame in BARRIERS}
SOON = 0.5
"""Seconds within which everything works again once the line does."""


# Requests and replies


async def test_a_request_returns_its_decoded_answer() -> None:
    async with line() as (link, wire):
        wire.answer = lambda frame: frame._replace(params=struct.pack("<8f", *range(8)))  # type: ignore[method-assign]
        assert await link.request(c.GET_POSE, None) == c.Pose(*map(float, range(8)))
        assert wire.raw == [bytes.fromhex("aa aa 02 0a 00 f6")]


@pytest.mark.parametrize("prompt", [False, True])
async def test_requests_of_one_key_wait_for_each_other(prompt: bool) -> None:
    async with line(prompt=prompt) as (link, wire):
        assert await asyncio.gather(*[asked(link) for _ in range(5)]) == [1, 2, 3, 4, 5]
        for before, after in zip(wire.times(TIME.id), wire.times(TIME.id)[1:], strict=False):
            assert after >= before + LATENCY


@pytest.mark.parametrize("in_flight", [1, 2, 8])
async def test_requests_of_different_keys_overlap_as_far_as_the_transport_allows(in_flight: int) -> None:
    async with line(in_flight=in_flight) as (link, wire):
        assert await asyncio.gather(*[asked(link, command) for command in QUESTIONS[:8]]) == list(range(1, 9))
        at_once = max(sum(at <= other < at + 0.9 * LATENCY for other, _ in wire.sent) for at, _ in wire.sent)
        assert at_once == in_flight


async def test_who_waits_for_a_busy_key_holds_up_nobody_else() -> None:
    async with line() as (link, _wire):
        calls = [start(asked(link)) for _ in range(2)]
        await asyncio.sleep(0)
        assert await asked(link, c.GET_POSE) == 2
        assert now() == pytest.approx(LATENCY, abs=1e-4)
        assert await asyncio.gather(*calls) == [1, 3]


async def test_the_answer_of_another_io_address_is_not_taken() -> None:
    async with line() as (link, wire):
        wire.fates = repeat(None)
        call = start(link.request(c.GET_IODI, 7))
        await asyncio.sleep(0.01)
        wire.say(Frame(c.GET_IODI.id, 0, bytes([8, 1])))
        await asyncio.sleep(0.01)
        assert not call.done()
        wire.say(Frame(c.GET_IODI.id, 0, bytes([7, 0])))
        assert await call == c.IODI(7, 0)


async def test_an_answer_that_never_fits_is_a_protocol_error_in_time() -> None:
    async with line() as (link, wire):
        wire.answer = lambda frame: frame._replace(params=b"too short")  # type: ignore[method-assign]
        with pytest.raises(ProtocolError, match="GetPose: the arm's answer does not fit: expected 32 bytes"):
            await link.request(c.GET_POSE, None, timeout=1.5)

        assert now() <= 1.5 + 1e-3


# Who goes first


async def test_urgent_passes_everybody() -> None:
    async with line(in_flight=1) as (link, wire):
        calls = [start(asked(link, command)) for command in QUESTIONS]
        await asyncio.sleep(LATENCY / 2)
        since = now()
        await link.request(STOP, None, urgent=True)
        assert wire.times(STOP.id) == [since]
        await asyncio.gather(*calls)


async def test_immediate_goes_before_queued_when_the_link_is_busy() -> None:
    async with line(in_flight=1) as (link, _wire):
        order: list[str] = []

        async def queued() -> None:
            async with link.slot("SetWAITCmd", 1.0):
                order.append("queued")

        async def immediate() -> None:
            order.append(str(await asked(link)))

        first = start(asked(link, c.GET_POSE))
        await asyncio.sleep(0)
        second = start(queued())
        await asyncio.sleep(0)
        await asyncio.gather(first, second, immediate())
        assert order == ["2", "queued"]


async def test_a_slot_waits_only_where_one_request_at_a_time_may_be_out() -> None:
    async with line(in_flight=2) as (link, _wire):
        calls = [start(asked(link, command)) for command in QUESTIONS]
        await asyncio.sleep(0)
        async with link.slot("SetWAITCmd", 1.0), link.slot("SetWAITCmd", 1.0):
            assert now() == 0

        await asyncio.gather(*calls)


async def test_while_a_slot_is_entered_no_question_goes_out_where_one_at_a_time_may() -> None:
    async with line(in_flight=1) as (link, wire):
        async with link.slot("SetWAITCmd", 1.0):
            call = start(asked(link))
            await asyncio.sleep(0.5)
            assert not wire.sent

        assert await call == 1


async def test_a_link_that_stays_busy_is_a_timeout() -> None:
    async with line(in_flight=1) as (link, _wire):
        async with link.slot("SetWAITCmd", 1.0):
            with pytest.raises(ReplyTimeout, match="too busy to send SetPTPCmd"):
                async with link.slot("SetPTPCmd", 0.5):
                    pytest.fail("it was entered")

            with pytest.raises(ReplyTimeout, match="too busy to send GetDeviceTime"):
                await link.request(TIME, None)

        assert now() == pytest.approx(0.5 + TIME.timeout)
        assert await asked(link) == 1


async def test_a_line_that_takes_no_frame_is_a_timeout() -> None:
    async with line() as (link, wire):
        wire.blocked = True
        with pytest.raises(ReplyTimeout, match="GetDeviceTime"):
            await link.request(TIME, None)

        assert now() == pytest.approx(TIME.timeout)
        wire.blocked = False
        assert await asked(link) >= 1
        assert now() < TIME.timeout + SOON


async def test_nothing_is_outstanding_that_never_had_its_turn_to_be_sent() -> None:
    async with line() as (link, wire):
        wire.blocked = True
        first = start(asked(link, timeout=2.0))
        await asyncio.sleep(0)
        with pytest.raises(ReplyTimeout):
            await asked(link, c.GET_POSE, timeout=0.2)

        assert link.stats.sent == 1
        wire.blocked = False
        assert await first == 1
        assert await asked(link, c.GET_POSE) == 2
        assert not set(wire.times(c.GET_DEVICE_NAME.id))


# Losses


async def test_a_question_is_sent_once_on_a_silent_line() -> None:
    async with line() as (link, wire):
        wire.dead = True
        with pytest.raises(ReplyTimeout, match=r"no answer to GetDeviceTime from memory: within 1\.5 s"):
            await link.request(TIME, None)

        assert now() == pytest.approx(TIME.timeout)
        assert len(wire.times(TIME.id)) == 1
        assert {frame.key for _, frame in wire.sent} <= {TIME.id, *BARRIER_KEYS}
        assert (link.stats.repeated, link.stats.timeouts) == (0, 1)


@pytest.mark.parametrize("fate", [None, LOST])
async def test_a_lost_question_is_sent_again_when_a_barrier_has_proven_it(fate: float | None) -> None:
    async with line() as (link, wire):
        wire.fates = chain([fate], repeat(LATENCY))
        assert await asked(link) >= 2
        [first, again] = wire.times(TIME.id)
        [barrier] = [at for key in BARRIER_KEYS for at in wire.times(key) if at < again]
        assert first < barrier <= again - LATENCY
        assert link.stats.repeated == 1


@pytest.mark.parametrize("losses", range(1, 12))
async def test_however_many_are_lost_in_a_row_it_is_mended_behind_them(losses: int) -> None:
    async with line() as (link, wire):
        wire.fates = chain(repeat(None, losses), repeat(LATENCY))
        await asked(link, timeout=60)
        assert link.stats.repeated == 1


async def test_the_next_barrier_has_another_key_for_the_answer_to_the_last_one_may_be_lost() -> None:
    """The answer to a second one of its key would pass for that to the first, and prove nothing of what is between."""
    async with line() as (link, wire):
        wire.fates = chain(repeat(None, 4), repeat(LATENCY))  # three questions, and the first barrier among them
        calls = [start(asked(link, c.GET_DEVICE_ID, timeout=30)), start(asked(link, timeout=30))]
        while not any(wire.times(key) for key in BARRIER_KEYS):  # noqa: ASYNC110 - the link decides when
            await asyncio.sleep(LATENCY / 10)

        calls.append(start(asked(link, c.GET_POSE, timeout=30)))
        await asyncio.sleep(0)
        wire.say(wire.answer(question(c.GET_DEVICE_ID)))
        await asyncio.gather(*calls)
        barriers = [frame.key for _, frame in wire.sent if frame.key in BARRIER_KEYS]
        assert len(set(barriers)) == len(barriers) == 2


@pytest.mark.parametrize("fate", [None, LOST])
async def test_what_must_not_be_repeated_is_sent_once(fate: float | None) -> None:
    async with line() as (link, wire):
        wire.fates = chain([fate], repeat(LATENCY))
        with pytest.raises(ReplyTimeout):
            await link.request(ONCE, DOWNLOAD, timeout=2)

        assert now() <= 2.001
        assert len(wire.times(ONCE.id)) == 1


@given(late=st.floats(0.0, 1.49), others=st.lists(st.floats(0.0, 1.4), max_size=4))
@settings(max_examples=examples(60))
def test_a_question_whose_answer_comes_in_time_does_not_fail(late: float, others: list[float]) -> None:
    async def scenario() -> None:
        async with line() as (link, wire):
            wire.fates = chain([late], repeat(LATENCY))
            calls = [start(asked(link, c.GET_POSE, timeout=30)) for _ in others]
            assert await asked(link) >= 1
            assert len(wire.times(TIME.id)) == 1
            assert now() == pytest.approx(late, abs=1e-3)
            await asyncio.gather(*calls)

    run_virtual(scenario())


@pytest.mark.parametrize("hours", [0.001, 1.0, 20.0])
async def test_an_answer_that_is_late_by_hours_answers_nobody_else(hours: float) -> None:
    async with line() as (link, wire):
        await asked(link)
        wire.stand_still()
        with pytest.raises(ReplyTimeout):
            await asked(link)

        await asyncio.sleep(hours * 3600)
        call = start(asked(link))
        await asyncio.sleep(0.01)
        before = wire.heard
        wire.go_on()
        assert await call > before + 1, "not that of the first question"
        assert link.stats.unexpected == 0


@pytest.mark.parametrize("commands", [QUESTIONS, QUESTIONS[:1], (c.GET_DEVICE_NAME, c.GET_DEVICE_SN, TIME)])
@pytest.mark.parametrize("prompt", [True, False])
async def test_a_minute_of_silence_costs_little_and_ends_at_once(commands: Any, prompt: bool) -> None:
    """Ten callers who ask again and again; the barriers' own keys among them."""
    async with line(in_flight=16, prompt=prompt) as (link, wire):
        begin = {command: await asked(link, command) for command in commands}
        wire.dead = True
        sent = link.stats.sent
        over = False
        answers: list[int] = []

        async def insist(command: Any) -> None:
            while not over and link.open:
                with suppress(ReplyTimeout):
                    await asked(link, command)

            answers.append(await asked(link, command))

        calls = [start(insist(command)) for command in (*commands, *QUESTIONS)[: max(10, len(commands))]]
        await asyncio.sleep(60)
        sent = link.stats.sent - sent
        wire.dead, over, heard = False, True, wire.heard
        since = now()
        await asyncio.gather(*calls)
        assert sent <= 60 / link.reply_timeout + 2 * len(calls), "one barrier a timeout"
        assert now() < since + SOON
        assert min(answers) > heard >= max(begin.values())


async def test_who_asked_at_the_end_of_a_long_silence_is_answered_as_soon() -> None:
    """Its question was sent behind hundreds of barriers, and all of these are outstanding."""
    async with line(prompt=True) as (link, wire):
        wire.dead = True
        with pytest.raises(ReplyTimeout):
            await asked(link, timeout=60)

        others = [start(asked(link, command, timeout=0.5)) for command in QUESTIONS[1:6]]
        await asyncio.wait(others)
        assert all(isinstance(other.exception(), ReplyTimeout) for other in others)
        wire.dead, since = False, now()
        await asyncio.gather(*[asked(link, command, timeout=10) for command in QUESTIONS[1:6]])
        assert now() < since + 1


async def test_after_an_outage_the_next_question_succeeds() -> None:
    async with line() as (link, wire):
        wire.fates = repeat(LOST)
        for _ in range(3):
            with pytest.raises(ReplyTimeout):
                await asked(link)

        wire.fates = repeat(LATENCY)
        since = now()
        assert await asked(link) >= 1
        assert now() < since + SOON


async def test_an_arm_that_answers_nothing_ends_the_link() -> None:
    async with line(prompt=True) as (link, wire):
        lost: list[ConnectionLost] = []
        link.on_lost.add(lost.append)
        wire.dead = True
        waiting = start(asked(link, timeout=math.inf))
        sent = 0
        with pytest.raises(ConnectionLost, match="has not answered"):
            while sent < 100_000:
                link.send_nowait(question(c.GET_POSE))
                sent += 1

        assert 1000 < sent < 40_000
        assert link.state.value is LinkState.LOST
        assert len(lost) == 1
        with pytest.raises(ConnectionLost):
            await waiting


async def test_a_stop_is_repeated_until_it_is_acknowledged() -> None:
    async with line() as (link, wire):
        wire.dead = True
        stop = start(link.request(STOP, None, urgent=True, timeout=math.inf))
        await asyncio.sleep(30)
        times = wire.times(STOP.id)
        assert all(after - before <= 0.5 + 1e-3 for before, after in pairwise(times))
        assert times[0] == 0
        assert len(times) >= 59
        assert {frame.key for _, frame in wire.sent} == {STOP.id}
        wire.dead = False
        await stop
        assert now() < 30 + SOON + LATENCY


async def test_a_stop_that_is_not_acknowledged_in_time_is_a_timeout() -> None:
    async with line() as (link, wire):
        wire.dead = True
        with pytest.raises(ReplyTimeout):
            await link.request(STOP, None, urgent=True, timeout=3)

        assert now() == pytest.approx(3)


async def test_a_stop_goes_out_at_once_although_another_one_was_given_up() -> None:
    async with line() as (link, wire):
        wire.dead = True
        with pytest.raises(ReplyTimeout):
            await link.request(STOP, None, urgent=True, timeout=3)

        since = now()
        stop = start(link.request(STOP, None, urgent=True, timeout=30))
        await asyncio.sleep(0.001)
        assert wire.times(STOP.id)[-1] == since
        wire.dead = False
        await stop


@pytest.mark.parametrize("reorder_window", [0.0, 0.02])
async def test_the_acknowledgement_of_a_stop_is_seen_although_another_one_was_given_up(reorder_window: float) -> None:
    async with line(reorder_window=reorder_window) as (link, wire):
        wire.dead = True
        with pytest.raises(ReplyTimeout):
            await link.request(STOP, None, urgent=True, timeout=3)

        wire.dead, since = False, now()
        await link.request(STOP, None, urgent=True, timeout=30)
        assert now() < since + SOON


delays = st.sampled_from([LATENCY, LATENCY, 0.0, 0.03, 0.1, 0.3, 0.6, 1.6, 2.5, 600.0])


@given(
    fates=st.lists(st.one_of(delays, st.none(), st.just(LOST)), max_size=25),
    impatience=st.lists(st.sampled_from([0.001, 0.02, 0.15, 1.0, None]), max_size=8),
    keys=st.lists(st.sampled_from(QUESTIONS[:2]), min_size=8, max_size=8),
    in_flight=st.sampled_from([1, 2, 8]),
)
@example([0.6, None, 0.6, None, 0.6, 0.6], [0.02] * 5, [TIME] * 8, 8)
@settings(max_examples=examples(150))
def test_no_question_gets_an_answer_to_an_earlier_one(
    fates: list[float | None], impatience: list[float | None], keys: list[Any], in_flight: int
) -> None:
    """Whatever is lost or late: what comes back belongs to this call, and the link recovers."""

    async def scenario() -> None:
        async with line(in_flight=in_flight) as (link, wire):
            wire.fates = chain(fates, repeat(LATENCY))

            async def ask(command: Any, patience: float | None) -> None:
                before = wire.heard
                with suppress(ReplyTimeout, TimeoutError):
                    async with asyncio.timeout(patience):
                        assert await asked(link, command) > before

            for patience, command, beside in zip(impatience, keys, keys[1:], strict=False):
                await asyncio.gather(ask(command, patience), ask(beside, 0.2))

            await asyncio.sleep(3600)
            wire.fates = repeat(LATENCY)
            for command in QUESTIONS[:2]:
                before = wire.heard
                assert await asked(link, command) > before

    run_virtual(scenario())


# Bytes that are wrong


async def test_an_arm_that_waits_for_the_rest_of_a_frame_gets_it() -> None:
    async with line() as (link, wire):
        wire.parser = StrictParser()
        wire.parser.feed(b"\xaa\xaa\xfa")  # what a spoilt length made of a request of before
        assert await asked(link, timeout=10) >= 1
        assert now() < 5
        assert sum(FILLER in data for data in wire.raw) <= 2


async def test_no_filler_goes_to_an_arm_that_answers() -> None:
    async with line() as (link, wire):
        wire.fates = chain([None, LATENCY] * 10, repeat(LATENCY))
        for _ in range(20):
            await asked(link, timeout=20)

        assert max(map(len, wire.raw)) < len(FILLER)


async def test_a_half_frame_does_not_swallow_what_follows_it() -> None:
    async with line() as (link, wire):
        wire.noise(b"\xaa\xaa\xc8" + bytes(20))
        assert await asked(link) >= 1
        assert now() < SOON
        before = wire.heard
        assert await asked(link) == before + 1


async def test_an_answer_inside_of_a_half_frame_is_found() -> None:
    async with line() as (link, wire):
        wire.noise(b"\xaa\xaa\xc8")
        wire.fates = chain([LATENCY], repeat(None))
        await link.request(ONCE, DOWNLOAD, timeout=1)


async def test_a_request_is_answered_in_the_middle_of_garbage() -> None:
    async with line() as (link, wire):
        call = start(asked(link))
        await asyncio.sleep(0)
        wire.noise(b"\x00\xaa\xaa\x02\x01\x02\x03")
        assert await call == 1
        assert link.stats.junk_bytes > 0


@pytest.mark.parametrize("junk", [b"\xaa", b"\xaa\xaa\xfa", b"\x00\xff", b"\xaa\xaa\x02\x0a\x00\xf6" * 5])
async def test_garbage_for_ever_neither_starves_others_nor_fills_memory(junk: bytes) -> None:
    near, far = memory_pair(buffer=1)
    parser = Parser()
    link: Link[Frame] = Link(near, parser, request, url="memory:", barriers=BARRIERS)

    async def flood() -> None:
        while True:
            await far.send(junk)

    async with aclosing(far), aclosing(link):
        flooding = start(flood())
        for _ in range(1000):
            await asyncio.sleep(0)

        assert link.stats.junk_bytes + 6 * link.stats.received > 100
        assert len(parser._buffer) < 256
        assert len(asyncio.all_tasks()) == 3
        flooding.cancel()
        await asyncio.wait([flooding])


async def test_a_bug_in_the_parser_ends_the_link() -> None:
    class Broken(Parser):
        def feed(self, data: bytes) -> list[Frame]:
            raise ZeroDivisionError("a bug")

    failures: list[Any] = []
    asyncio.get_running_loop().set_exception_handler(lambda _, context: failures.append(context))
    wire = Line()
    link: Link[Frame] = Link(wire, Broken(), request, url="memory:", barriers=BARRIERS)
    async with aclosing(link):
        with pytest.raises(ConnectionLost, match="a bug") as lost:
            await asked(link)

        assert isinstance(lost.value.__cause__, ZeroDivisionError)
        assert link.state.value is LinkState.LOST


# Round trips, datagrams


async def test_the_timeout_follows_the_round_trips() -> None:
    trip = RoundTrip()
    async with line(round_trip=trip) as (link, wire):
        wire.fates = repeat(0.03)
        await asked(link)
        assert trip.smoothed == pytest.approx(0.03)
        assert link.reply_timeout == trip.timeout == pytest.approx(0.09)


async def test_a_lost_question_is_no_round_trip() -> None:
    trip = RoundTrip()
    async with line(round_trip=trip) as (link, wire):
        wire.fates = chain([None], repeat(0.03))
        await asked(link)
        assert trip.smoothed == pytest.approx(0.03, abs=1e-4)


async def test_where_messages_may_be_doubled_who_asks_again_lets_the_double_pass() -> None:
    async with line(reorder_window=0.02, in_flight=1) as (link, wire):
        strays: list[Frame] = []
        link.on_unsolicited.add(strays.append)
        wire.fates = repeat(None)
        for number in range(2):
            call = start(link.request(TIME, None))
            await asyncio.sleep(0.001)
            assert len(wire.sent) == 1  # the first goes at once, the second waits
            await asyncio.sleep(0.04)
            assert len(wire.sent) == number + 1
            answer = Frame(TIME.id, 0, struct.pack("<I", number))
            wire.say(answer, answer)
            assert await call == number
            assert strays == [Frame(TIME.id, 0, struct.pack("<I", n)) for n in range(number + 1)]


# Cancellation


async def cancelled_task(link: Link[Frame], steps: int) -> None:
    """A request whose task is cancelled after so many turns of the loop."""
    call = start(asked(link))
    for _ in range(steps):
        await asyncio.sleep(0)

    call.cancel()
    await asyncio.wait([call])


async def cancelled_scope(link: Link[Frame], steps: int) -> None:
    """A request in an anyio scope that is cancelled after so many turns of the loop."""

    async def call() -> None:
        with scope:
            await asked(link)

    scope = anyio.CancelScope()
    task = start(call())
    for _ in range(steps):
        await asyncio.sleep(0)

    scope.cancel()
    await task


@pytest.mark.parametrize("cancelled", [cancelled_task, cancelled_scope])
@pytest.mark.parametrize("busy", ["free", "its turn", "the line"])
@pytest.mark.parametrize("prompt", [False, True])
async def test_a_request_may_be_cancelled_anywhere(
    cancelled: Callable[[Link[Frame], int], Awaitable[None]], busy: str, prompt: bool
) -> None:
    for steps in range(25):
        async with line(in_flight=1 if busy == "its turn" else 8, prompt=prompt) as (link, wire):
            others = []
            if busy == "its turn":
                others = [start(asked(link, c.GET_DEVICE_SN)), start(asked(link))]
                await asyncio.sleep(0)

            wire.blocked = busy == "the line"
            await cancelled(link, steps)
            wire.blocked = False
            await cancelled(link, steps)
            before = wire.heard
            assert await asked(link) > before
            await asyncio.gather(*others)
            before = wire.heard
            assert await asked(link) > before
            assert link.stats.unexpected == 0


async def test_a_slot_may_be_cancelled_anywhere() -> None:
    for steps in range(6):
        async with line(in_flight=1) as (link, _wire):

            async def enter(link: Link[Frame] = link) -> None:
                async with link.slot("SetWAITCmd", 1.0):
                    await asyncio.sleep(1)

            calls = [start(asked(link)), start(enter())]
            for _ in range(steps):
                await asyncio.sleep(0)

            calls[1].cancel()
            await asyncio.wait(calls)
            assert await asked(link) == 2


# Sent, and settled later


async def test_what_is_sent_is_settled_with_its_reply() -> None:
    async with line() as (link, wire):
        requests = [await link.send(question(command), number_in) for command in QUESTIONS[:3]]
        assert len(wire.sent) == 3
        assert [await link.settle(each, 1.0) for each in requests] == [True] * 3
        assert [each.value for each in requests] == [1, 2, 3]


async def test_several_of_one_key_are_told_by_what_they_accept() -> None:
    def only(number: int) -> Callable[[Frame], int]:
        def accept(frame: Frame) -> int:
            if number_in(frame) != number:
                raise ProtocolError("another")

            return number

        return accept

    async with line() as (link, wire):
        wire.fates = chain([LATENCY, None], repeat(LATENCY))
        requests = [await link.send(question(TIME), only(number)) for number in (1, 2, 3)]
        assert [await link.settle(each, 1.0) for each in requests] == [True, False, True]


async def test_what_is_lost_is_settled_when_that_is_proven() -> None:
    async with line() as (link, wire):
        wire.fates = chain([None], repeat(LATENCY))
        sent = await link.send(question(TIME), number_in)
        assert await link.settle(sent, 5.0) is False
        assert now() < SOON
        assert len(wire.times(TIME.id)) == 1


async def test_what_a_silent_arm_was_sent_is_not_settled() -> None:
    async with line() as (link, wire):
        wire.dead = True
        sent = await link.send(question(TIME), number_in)
        with pytest.raises(ReplyTimeout, match="has not answered for 5 s"):
            await link.settle(sent, 5.0)

        assert now() == pytest.approx(5.0)


async def test_what_is_not_settled_on_a_line_that_takes_no_barrier_is_a_reply_timeout() -> None:
    async with line() as (link, wire):
        wire.fates = repeat(None)
        sent = await link.send(question(TIME), number_in)
        wire.blocked = True
        with pytest.raises(ReplyTimeout):
            await link.settle(sent, 1.0)


async def test_what_is_not_settled_when_the_link_ends_is_lost_with_it() -> None:
    async with line() as (link, wire):
        wire.fates = repeat(None)
        sent = await link.send(question(TIME), number_in)
        settling = start(link.settle(sent, 50.0))
        await asyncio.sleep(0.01)
        wire.breaks(anyio.EndOfStream())
        with pytest.raises(ConnectionLost):
            await settling

        with pytest.raises(ConnectionLost):
            await link.settle(sent, 50.0)


async def test_sent_within_a_time_or_not_at_all() -> None:
    async with line() as (link, wire):
        wire.blocked = True
        first = start(link.send(question(TIME), number_in))
        await asyncio.sleep(0)
        with pytest.raises(TimeoutError):
            await link.send(question(c.GET_POSE), number_in, timeout=0.5)

        assert now() == pytest.approx(0.5)
        wire.blocked = False
        await first
        assert [frame.id for _, frame in wire.sent] == [TIME.id]


async def test_send_nowait_sends_at_once_and_its_reply_is_for_nobody() -> None:
    async with line(prompt=True) as (link, wire):
        assert link.send_nowait(question(TIME))
        assert len(wire.sent) == 1
        assert await asked(link) > 1
        assert link.stats.unexpected == 0


async def test_send_nowait_sends_nothing_where_it_would_have_to_wait() -> None:
    async with line() as (link, wire):
        assert not link.send_nowait(question(TIME))
        assert link.stats.sent == 0

    async with line(prompt=True) as (link, wire):
        wire.blocked = True
        assert not link.send_nowait(question(TIME))
        assert link.stats.sent == 0


async def test_send_nowait_on_a_closed_link_sends_nothing() -> None:
    async with line(prompt=True) as (link, wire):
        await link.aclose()
        assert not link.send_nowait(question(TIME))
        assert not wire.sent


async def test_whoever_must_be_asked_before_each_sending_is_asked() -> None:
    async with line() as (link, wire):
        wire.fates = chain([None], repeat(LATENCY))
        asks: list[int] = []

        def ready() -> None:
            asks.append(len(wire.times(TIME.id)))

        await link.exchange(question(TIME), number_in, name="GetDeviceTime", timeout=5, repeatable=True, ready=ready)
        assert asks == [0, 1]


async def test_what_readiness_raises_is_raised_and_nothing_is_sent() -> None:
    def never() -> None:
        raise ValueError("not now")

    async with line() as (link, wire):
        for urgent in (False, True):
            with pytest.raises(ValueError, match="not now"):
                await link.exchange(question(TIME), number_in, name="", timeout=5, ready=never, urgent=urgent)

        assert not wire.sent
        assert await asked(link) == 1


# Life and death


async def test_the_end_of_the_stream_reaches_everybody_once() -> None:
    async with line(in_flight=1) as (link, wire):
        lost: list[ConnectionLost] = []
        link.on_lost.add(lost.append)
        wire.fates = repeat(None)
        calls = [start(asked(link)) for _ in range(3)]
        calls += [start(link.request(STOP, None, urgent=True)), start(asked(link, c.GET_POSE))]
        await asyncio.sleep(0.01)
        since = now()
        wire.breaks(anyio.EndOfStream())
        results = await asyncio.gather(*calls, return_exceptions=True)
        assert now() == since
        for result in results:
            assert isinstance(result, ConnectionLost)
            assert isinstance(result.__cause__, anyio.EndOfStream)
            assert "EndOfStream" in str(result)

        assert len({id(result) for result in results}) == len(results), "each has an instance of its own"
        assert link.state.value is LinkState.LOST
        assert [event async for event in link.events] == []
        again = []
        for _ in range(2):
            with pytest.raises(ConnectionLost) as caught:
                await asked(link)

            again.append(caught.value)

        assert again[0] is not again[1]
        assert len(lost) == 1

    assert len(lost) == 1


async def test_the_first_cause_is_kept() -> None:
    async with line() as (link, wire):
        wire.fates = repeat(None)
        call = start(asked(link))
        await asyncio.sleep(0.05)
        error = anyio.BrokenResourceError()
        error.__cause__ = OSError(5, "Input/output error")
        wire.breaks(error)
        with pytest.raises(ConnectionLost, match=r"the connection to memory: was lost: .*Input/output error") as lost:
            await call

        assert lost.value.__cause__ is error.__cause__
        wire.send_error = anyio.ClosedResourceError()
        with pytest.raises(ConnectionLost, match="Input/output error") as again:
            await asked(link)

        assert again.value.__cause__ is error.__cause__
        assert len(wire.sent) == 1

    assert link.state.value is LinkState.LOST


@pytest.mark.parametrize("error", [anyio.BrokenResourceError(), anyio.ClosedResourceError(), OSError("gone")])
async def test_a_failing_send_ends_the_link(error: Exception) -> None:
    async with line() as (link, wire):
        wire.fates = repeat(None)
        call = start(asked(link))
        await asyncio.sleep(0.05)
        wire.send_error = error
        with pytest.raises(ConnectionLost):
            await asked(link, c.GET_POSE)

        with pytest.raises(ConnectionLost):
            await call

        assert now() == pytest.approx(0.05)
        assert link.state.value is LinkState.LOST


async def test_aclose_joins_the_reader_and_ends_all_calls() -> None:
    async with line(in_flight=2) as (link, wire):
        wire.fates = repeat(None)
        calls = [start(asked(link)) for _ in range(3)] + [start(link.request(STOP, None, urgent=True))]
        await asyncio.sleep(0.05)
        await link.aclose()
        assert not [task for task in asyncio.all_tasks() if "reader" in task.get_name()]
        assert link.state.value is LinkState.CLOSED
        for result in await asyncio.gather(*calls, return_exceptions=True):
            assert isinstance(result, ConnectionLost)
            assert str(result) == "the connection to memory: was closed"

        assert wire.closed
        await link.aclose()
        with pytest.raises(ConnectionLost, match="was closed"):
            await asked(link)

        assert now() == pytest.approx(0.05)


async def test_a_closed_link_was_not_lost() -> None:
    async with line() as (link, _wire):
        lost: list[ConnectionLost] = []
        link.on_lost.add(lost.append)
        await link.aclose()
        assert lost == []


async def test_aclose_may_be_called_by_many_at_once() -> None:
    async with line() as (link, _):
        await asyncio.gather(*(link.aclose() for _ in range(3)))


async def test_aclose_does_not_hang_on_a_transport_that_does() -> None:
    wire = Line()
    wire.closing_hangs = True
    await link_over(wire).aclose()
    assert now() <= 2


async def test_aclose_with_a_stop_under_way_takes_no_longer() -> None:
    async with line() as (link, wire):
        wire.dead = True
        link.cleanup.start(link.request(STOP, None, urgent=True, timeout=math.inf), "the arm's stop")
        await asyncio.sleep(1)
        await link.aclose()
        assert now() <= 3


@pytest.mark.parametrize("steps", range(5))
async def test_the_transport_is_told_to_close_even_if_aclose_is_cancelled(steps: int) -> None:
    wire = Line()
    link = link_over(wire)
    closing = start(link.aclose())
    for _ in range(steps):
        await asyncio.sleep(0)

    closing.cancel()
    await asyncio.wait([closing])
    if not steps:
        await link.aclose()

    assert wire.closing == 1


async def test_aclose_ignores_the_scope_that_was_cancelled_around_it() -> None:
    wire = Line()
    link = link_over(wire)
    with anyio.CancelScope() as scope:
        scope.cancel()
        await link.aclose()

    assert wire.closed == 1


# Reopening


class Shop:
    """Where the next lines come from.

    Attributes:
        failures: How often none can be had.
        tries: When one was asked for.
    """

    def __init__(self, failures: int = 0, *, prompt: bool = False) -> None:
        self.failures = failures
        self.tries: list[float] = []
        self.lines: list[Line] = []

    async def __call__(self) -> Line:
        self.tries.append(now())
        if len(self.tries) <= self.failures:
            raise ConnectFailed("not yet")

        self.lines.append(Line())
        return self.lines[-1]


async def test_a_question_outlives_the_line() -> None:
    shop = Shop()
    async with line(reopen=shop) as (link, wire):
        wire.fates = repeat(None)
        changes = aiter(link.state)
        call = start(asked(link))
        await asyncio.sleep(0.01)
        wire.noise(b"\xaa\xaa\xfa")  # of a frame the rest of which never comes
        wire.breaks(anyio.EndOfStream())
        assert await call >= 1
        assert link.outages == 1
        assert wire.closed == 1
        assert [await anext(changes), await anext(changes)] == [LinkState.REOPENING, LinkState.OPEN]
        [new] = shop.lines
        before = new.heard
        assert await asked(link) > before


async def test_what_was_asked_on_the_old_line_holds_up_nobody_on_the_new_one() -> None:
    shop = Shop()
    async with line(reopen=shop) as (link, wire):
        wire.fates = repeat(None)
        with pytest.raises(ReplyTimeout):
            await asked(link, timeout=0.05)

        wire.breaks(anyio.EndOfStream())
        await asyncio.sleep(1)
        since = now()
        assert await asked(link) >= 1
        assert now() < since + SOON


async def test_it_is_opened_again_and_again_at_growing_intervals() -> None:
    shop = Shop(failures=8)
    async with line(reopen=shop) as (link, wire):
        wire.breaks(OSError("gone"))
        assert await asked(link, timeout=100) >= 1
        pauses = [after - before for before, after in zip(shop.tries, shop.tries[1:], strict=False)]
        assert pauses[0] <= 0.2
        assert max(pauses) <= 5.0
        assert pauses[-1] > pauses[0]


async def test_a_question_of_which_the_time_is_over_before_the_line_is_back_is_a_timeout() -> None:
    async with line(reopen=Shop(failures=1000)) as (link, wire):
        wire.breaks(OSError("gone"))
        await asyncio.sleep(1)
        since = now()
        with pytest.raises(ReplyTimeout):
            await asked(link)

        assert now() == pytest.approx(since + TIME.timeout)
        assert not link.open


@pytest.mark.parametrize("urgent", [False, True])
async def test_a_send_that_breaks_is_a_loss_if_the_line_is_opened_anew(urgent: bool) -> None:
    shop = Shop()
    async with line(reopen=shop) as (link, wire):
        wire.send_error = anyio.BrokenResourceError()
        call = start(link.request(STOP, None, urgent=True) if urgent else asked(link))
        await asyncio.sleep(0.01)
        wire.breaks(anyio.BrokenResourceError())
        await call
        assert link.outages == 1


async def test_the_link_can_be_closed_while_it_is_reopened() -> None:
    async with line(reopen=Shop(failures=1000)) as (link, wire):
        wire.breaks(OSError("gone"))
        calls = [start(asked(link, timeout=100)), start(link.opened()), start(link.send(question(TIME), number_in))]
        await asyncio.sleep(3)
        await link.aclose()
        assert now() <= 5
        for result in await asyncio.gather(*calls, return_exceptions=True):
            assert isinstance(result, ConnectionLost)


# Events, figures, hooks


async def test_what_nobody_waits_for_is_counted_and_offered() -> None:
    async with line() as (link, wire):
        listener = aiter(link.events)
        seen: list[Frame] = []
        link.on_unsolicited.add(seen.append)
        strays = [Frame(200, 0, b"stray"), Frame(TIME.id, 0, bytes(4))]
        wire.say(*strays)
        assert [await anext(listener), await anext(listener)] == [Unexpected(frame) for frame in strays]
        assert seen == strays
        assert link.stats.unexpected == 2

        await link.aclose()
        assert [event async for event in listener] == []


async def test_stats_tell_what_went_over_the_link() -> None:
    async with line() as (link, wire):
        wire.fates = chain([LATENCY, None], repeat(LATENCY))
        await asked(link)
        before = link.stats
        await asked(link)
        assert (before.sent, before.received, before.repeated) == (1, 1, 0)
        assert (link.stats.sent, link.stats.received) == (len(wire.sent), wire.heard - 1)
        assert (link.stats.repeated, link.stats.timeouts) == (1, 0)
        bad = bytearray(bytes(Frame(1, 0, b"")))
        bad[-1] ^= 1
        wire.noise(b"junk" + bad + bytes(Frame(200, 0, b"")))
        await asyncio.sleep(0.01)
        assert (link.stats.unexpected, link.stats.junk_bytes, link.stats.bad_frames) == (1, 4 + 6, 1)
        wire.fates = repeat(None)
        with pytest.raises(ReplyTimeout):
            await asked(link)

        assert link.stats.timeouts == 1
        assert before.timeouts == 0, "a snapshot"


async def test_every_frame_is_shown_in_order() -> None:
    async with line() as (link, wire):
        seen: list[tuple[bool, Frame]] = []
        link.on_frame.add(lambda outgoing, frame: seen.append((outgoing, frame)))
        call = start(asked(link))
        await asyncio.sleep(0)
        stray = Frame(200, 0, b"")
        wire.say(stray)
        await call
        assert seen == [(True, question(TIME)), (False, stray), (False, Frame(TIME.id, 0, struct.pack("<I", 1)))]


async def test_hooks_that_raise_harm_nobody(caplog: pytest.LogCaptureFixture) -> None:
    def bad(*args: object) -> None:
        raise ZeroDivisionError("a bug of the user's")

    lost: list[ConnectionLost] = []
    async with line(prompt=True) as (link, wire):
        for hooks in (link.on_frame, link.on_unsolicited, link.on_lost):
            hooks.add(bad)

        link.on_lost.add(lost.append)
        assert await asked(link) == 1
        wire.say(Frame(200, 0, b""))
        assert await asked(link) == 2
        assert link.send_nowait(question(TIME))
        assert link.open
        wire.breaks(anyio.EndOfStream())
        with pytest.raises(ConnectionLost):
            await asked(link)

    assert len(lost) == 1
    assert "a bug of the user's" in caplog.text


# Mistakes of the caller


@pytest.mark.parametrize("barriers", [(), BARRIERS[:1], (BARRIERS[0], BARRIERS[0])])
async def test_barriers_of_two_keys_are_required(barriers: Any) -> None:
    with pytest.raises(ValueError, match="two keys"):
        link_over(Line(), barriers=barriers)

    assert len(asyncio.all_tasks()) == 1


async def test_an_observer_sends_no_command() -> None:
    async with line(read_only=True) as (link, wire):
        with pytest.raises(ValueError, match=r"SetQueuedCmdClear is a command.*control=False"):
            await link.request(c.SET_QUEUED_CMD_CLEAR, None)

        with pytest.raises(ValueError, match="control=False"):
            await link.request(STOP, None, urgent=True)

        with pytest.raises(ValueError, match="control=False"):
            link.frame(c.SET_WAIT_CMD, c.WAITCmd(1), queued=True)

        assert not wire.sent
        assert await link.request(TIME, None) == 1


async def test_what_does_not_fit_is_refused_before_a_byte_is_sent() -> None:
    wrong: Any = "7"
    async with line() as (link, wire):
        with pytest.raises(ValueError, match=r"in 1 to 20, not 21"):
            await link.request(c.GET_IODI, 21)

        with pytest.raises(TypeError):
            await link.request(c.GET_IODI, wrong)

        with pytest.raises(TypeError):
            await link.request(TIME, wrong)

        with pytest.raises(ValueError, match="cannot be queued"):
            link.frame(TIME, None, queued=True)

        for timeout in (0, -1, math.nan):
            with pytest.raises(ValueError, match="timeout must be above 0"):
                await link.request(TIME, None, timeout=timeout)

        assert not wire.sent
        assert link.stats.sent == 0
