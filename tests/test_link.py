"""The link over a line in memory, with the far end driven by hand, on a clock that jumps over every wait."""

from __future__ import annotations

import asyncio
import struct
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine, Iterator
from contextlib import aclosing, asynccontextmanager, suppress
from dataclasses import dataclass, field
from itertools import count, repeat
from typing import Any

import anyio
import async_solipsism
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from dobot_async.contract import LinkState, Unexpected
from dobot_async.errors import ConnectionLost, ProtocolError, ReplyTimeout
from dobot_async.link import MUTE, Link
from dobot_async.magician import commands as c
from dobot_async.magician.frame import QUEUED, WRITE, Frame, Parser, request
from dobot_async.posted import Posted
from dobot_async.roundtrip import RoundTrip
from dobot_async.transports import Transport
from dobot_async.transports.memory import memory_pair
from dobot_async.wire import Number, u64

pytestmark = pytest.mark.virtual_time

INDEX: Number[int] = Number(u64)
TIME = c.GET_DEVICE_TIME
LINGER = 3.0


class Far:
    """The arm's end of a line: what it says is up to the test."""

    def __init__(self, transport: Transport) -> None:
        self.transport = transport
        self.parser = Parser()

    async def arrived(self) -> list[Frame]:
        """All requests that have come since the last look."""
        frames = []
        with suppress(TimeoutError):
            while True:
                async with asyncio.timeout(0.001):
                    data = await self.transport.receive()

                frames += self.parser.feed(data)

        return frames

    async def one(self) -> Frame:
        """The only request that has come since the last look."""
        [only] = await self.arrived()
        return only

    async def say(self, *answers: Frame) -> None:
        """Sends frames in one piece."""
        await self.transport.send(b"".join(map(bytes, answers)))


@dataclass
class Arm:
    """An arm that answers each request with its number, each so many seconds after it came; None loses it."""

    far: Far
    fates: Iterator[float | None]
    numbers: Iterator[int] = field(default_factory=count)
    heard: int = 0

    async def run(self) -> None:
        """Answers until it is cancelled, in order: who is late makes those behind it wait."""
        sending, waiting = anyio.create_memory_object_stream[tuple[float, Frame]](1000)
        speaker = asyncio.create_task(self.speak(waiting))
        try:
            while True:
                for frame in self.far.parser.feed(await self.far.transport.receive()):
                    self.heard += 1
                    number, fate = next(self.numbers), next(self.fates, 0.0)
                    if fate is not None:
                        due = asyncio.get_running_loop().time() + fate
                        sending.send_nowait((due, numbered(frame, number)))
        finally:
            speaker.cancel()
            await asyncio.wait([speaker])
            sending.close()
            waiting.close()

    async def speak(self, waiting: Any) -> None:
        """Sends each answer when it is due."""
        async for due, answer in waiting:
            await asyncio.sleep(max(0.0, due - asyncio.get_running_loop().time()))
            await self.far.say(answer)


def numbered(asked: Frame, number: int) -> Frame:
    """An answer to GetDeviceTime that can be told from all others."""
    return asked._replace(params=struct.pack("<I", number))


def queued(milliseconds: int) -> Frame:
    """A queued command; each has the same key."""
    return request(c.SET_WAIT_CMD, c.SET_WAIT_CMD.request.encode(c.WAITCmd(milliseconds)), queued=True)


def acknowledged(index: int) -> Frame:
    """The answer to a queued command."""
    return Frame(c.SET_WAIT_CMD.id, WRITE | QUEUED, INDEX.encode(index))


def index_is(wanted: int) -> Callable[[Frame], int]:
    """Accepts the acknowledgement with one index."""

    def accept(frame: Frame) -> int:
        if INDEX.decode(frame.params) != wanted:
            raise ProtocolError("another index")

        return wanted

    return accept


async def post(link: Link[Frame], index: int, timeout: float = 0.5) -> Posted[int]:
    """Sends a queued command whose acknowledgement is to have an index."""
    return await link.post(queued(index), index_is(index), name="SetWAITCmd", timeout=timeout)


def link_over(
    transport: Transport, *, read_only: bool = False, filler: bytes = b"", round_trip: RoundTrip | None = None
) -> Link[Frame]:
    """A link with the parser of a Magician."""
    return Link(transport, Parser(), request, url="memory:", filler=filler, read_only=read_only, round_trip=round_trip)


@asynccontextmanager
async def line(
    *, in_flight: int = 8, buffer: float = 1000, read_only: bool = False
) -> AsyncIterator[tuple[Link[Frame], Far]]:
    """A link and its far end, both closed at the end."""
    near, far = memory_pair(in_flight=in_flight, buffer=buffer)
    async with aclosing(far), aclosing(link_over(near, read_only=read_only)) as link:
        yield link, Far(far)


@asynccontextmanager
async def running(work: Coroutine[Any, Any, None]) -> AsyncIterator[None]:
    """Runs something beside the block."""
    task = asyncio.create_task(work)
    try:
        yield
    finally:
        task.cancel()
        await asyncio.wait([task])


def start(work: Coroutine[Any, Any, Any]) -> asyncio.Task[Any]:
    """Begins a call."""
    return asyncio.create_task(work)


def now() -> float:
    """The virtual time."""
    return asyncio.get_running_loop().time()


# Requests and replies


async def test_a_request_returns_its_decoded_answer() -> None:
    async with line() as (link, far):
        call = start(link.request(c.GET_POSE, None))
        asked = await far.one()
        assert bytes(asked) == bytes.fromhex("aa aa 02 0a 00 f6")

        await far.say(asked._replace(params=struct.pack("<8f", *range(8))))
        assert await call == c.Pose(*map(float, range(8)))


async def test_requests_of_one_key_wait_for_each_other() -> None:
    async with line() as (link, far):
        calls = [start(link.request(TIME, None)) for _ in range(3)]
        for number, call in enumerate(calls):
            await far.say(numbered(await far.one(), number))
            assert await call == number


async def test_requests_of_different_keys_overlap_as_far_as_the_transport_allows() -> None:
    async with line(in_flight=2) as (link, far):
        calls = [start(link.request(command, None)) for command in (TIME, c.GET_POSE, c.GET_DEVICE_NAME)]
        first, second = await far.arrived()
        assert (first.id, second.id) == (TIME.id, c.GET_POSE.id)

        await far.say(second._replace(params=bytes(32)))
        third = await far.one()
        await far.say(third._replace(params=b"arm\0"), numbered(first, 7))
        assert await asyncio.gather(*calls) == [7, c.Pose(*[0.0] * 8), "arm"]


async def test_answers_out_of_order_reach_who_asked() -> None:
    async with line() as (link, far):
        calls = [start(link.request(TIME, None)), start(link.request(c.GET_DEVICE_NAME, None))]
        first, second = await far.arrived()
        await far.say(second._replace(params=b"arm\0"), numbered(first, 7))
        assert await asyncio.gather(*calls) == [7, "arm"]


async def test_who_waits_for_a_busy_key_holds_up_nobody_else() -> None:
    async with line() as (link, far):
        calls = [start(link.request(TIME, None)) for _ in range(2)]
        await asyncio.sleep(0)
        calls.append(start(link.request(c.GET_DEVICE_NAME, None)))
        posting = start(post(link, 0))
        assert {frame.id for frame in await far.arrived()} == {TIME.id, c.GET_DEVICE_NAME.id, c.SET_WAIT_CMD.id}
        await link.aclose()
        posted = await posting
        posted.forget()
        await asyncio.gather(*calls, return_exceptions=True)


async def test_immediate_goes_before_queued_when_the_link_is_busy() -> None:
    async with line(in_flight=1) as (link, far):
        first = start(link.request(TIME, None))
        busy = await far.one()
        posting = start(post(link, 5))
        await asyncio.sleep(0)
        second = start(link.request(c.GET_DEVICE_NAME, None))
        assert await far.arrived() == []

        await far.say(numbered(busy, 1))
        asked = await far.one()
        assert asked.id == c.GET_DEVICE_NAME.id

        await far.say(asked._replace(params=b"arm\0"))
        assert await far.one() == queued(5)
        await far.say(acknowledged(5))
        posted = await posting
        assert [await first, await second, await posted.answer()] == [1, "arm", 5]


async def test_urgent_passes_everybody() -> None:
    async with line(in_flight=1) as (link, far):
        calls = [start(link.request(TIME, None)) for _ in range(3)]
        posted = start(post(link, 5))
        await far.one()
        stops = [start(link.request(c.SET_QUEUED_CMD_FORCE_STOP_EXEC, None, urgent=True)) for _ in range(2)]
        asked = await far.arrived()
        assert [frame.id for frame in asked] == [c.SET_QUEUED_CMD_FORCE_STOP_EXEC.id] * 2

        await far.say(*asked)
        assert await asyncio.gather(*stops) == [None, None]
        await link.aclose()
        await asyncio.gather(*calls, posted, return_exceptions=True)


async def test_acknowledgements_that_come_together_reach_each_its_own() -> None:
    async with line() as (link, far):
        posted = [await post(link, index) for index in range(3)]
        assert await far.arrived() == [queued(index) for index in range(3)]
        await far.say(*map(acknowledged, range(3)))
        assert [await each.answer() for each in posted] == [0, 1, 2]
        assert link.stats.unexpected == 0


async def test_acknowledgements_that_anything_fits_reach_each_its_own() -> None:
    async with line() as (link, far):
        posted = [
            await link.post(queued(n), lambda frame: INDEX.decode(frame.params), name="", timeout=1) for n in range(3)
        ]
        await far.say(*map(acknowledged, range(3)))
        assert [await each.answer() for each in posted] == [0, 1, 2]


async def test_an_acknowledgement_that_does_not_come_is_a_timeout_and_frees_the_link() -> None:
    async with line(in_flight=1) as (link, far):
        posted = await post(link, 3)
        with pytest.raises(ReplyTimeout, match="SetWAITCmd was not acknowledged"):
            await posted.answer()

        call = start(link.request(TIME, None))
        _, asked = await far.arrived()
        await far.say(acknowledged(3), numbered(asked, 1))
        assert await call == 1
        assert link.stats.unexpected == 1


async def test_a_link_that_stays_busy_is_a_timeout() -> None:
    async with line(in_flight=1) as (link, _):
        posted = await post(link, 3)
        with pytest.raises(ReplyTimeout, match="too busy"):
            await post(link, 4)

        with pytest.raises(ReplyTimeout, match="too busy to send GetDeviceTime"):
            await link.request(TIME, None)

        assert now() == pytest.approx(0.5 + TIME.timeout)
        posted.forget()


async def test_a_line_that_does_not_take_the_frame_is_a_timeout_and_frees_the_link() -> None:
    async with line(in_flight=1, buffer=0) as (link, far):
        with pytest.raises(ReplyTimeout, match="SetWAITCmd"):
            await post(link, 3)

        with pytest.raises(ReplyTimeout, match="GetDeviceTime"):
            await link.request(TIME, None)

        assert now() == pytest.approx(0.5 + TIME.timeout)
        async with running(Arm(far, iter(())).run()):
            assert await link.request(TIME, None) >= 0


async def test_nothing_is_owed_for_what_never_had_its_turn_to_be_sent() -> None:
    async with line(buffer=0) as (link, far):
        first = start(post(link, 1, timeout=1.0))
        await asyncio.sleep(0)
        with pytest.raises(ReplyTimeout):
            await link.request(TIME, None, timeout=0.2)

        left: list[bool] = []
        with pytest.raises(ReplyTimeout):
            await link.post(queued(2), index_is(2), name="SetWAITCmd", timeout=0.2, leaving=lambda: left.append(True))

        assert not left
        assert link.stats.sent == 1
        assert await far.one() == queued(1)
        await far.say(acknowledged(1))
        assert await (await first).answer() == 1
        second = start(link.request(TIME, None))
        asked = await far.one()
        await far.say(numbered(asked, 7))
        assert await second == 7
        assert link.stats.sent == 2


# Timeouts, repetition, late replies


async def test_a_repeatable_request_is_sent_again_and_then_times_out() -> None:
    async with line() as (link, far):
        with pytest.raises(ReplyTimeout, match=r"no answer to GetDeviceTime from memory: within 1\.5 s"):
            await link.request(TIME, None)

        assert now() == pytest.approx(1.5)
        assert [frame.id for frame in await far.arrived()] == [
            TIME.id
        ] * 7  # at 0, 0.1, 0.225, 0.381, ...: each wait is a quarter longer
        assert (link.stats.sent, link.stats.repeated, link.stats.timeouts) == (7, 6, 1)


async def test_a_lost_reply_is_mended_by_the_repetition() -> None:
    async with line() as (link, far), running(Arm(far, iter([None, None])).run()):
        assert await link.request(TIME, None) == 2
        assert now() == pytest.approx(0.1 + 0.125)


async def test_what_must_not_be_repeated_is_sent_once() -> None:
    async with line() as (link, far):
        with pytest.raises(ReplyTimeout):
            await link.request(c.SET_QUEUED_CMD_START_DOWNLOAD, c.QueuedCmdStartDownload(1, 1), timeout=2)

        assert now() == pytest.approx(2.0)
        assert len(await far.arrived()) == 1


@pytest.mark.parametrize("late", range(4))
async def test_a_late_reply_does_not_answer_the_next_request(late: int) -> None:
    async with line() as (link, far):
        with pytest.raises(ReplyTimeout):
            await link.request(TIME, None)

        asked = await far.arrived()
        call = start(link.request(TIME, None))
        await far.say(*(numbered(frame, 100) for frame in asked[:late]))
        async with running(Arm(far, iter(())).run()):
            assert await call < 100


async def test_late_replies_that_nobody_waits_for_any_more_do_no_harm() -> None:
    async with line() as (link, far):
        with pytest.raises(ReplyTimeout):
            await link.request(TIME, None)

        await far.say(*(numbered(frame, 100) for frame in await far.arrived()))
        await asyncio.sleep(0.001)
        async with running(Arm(far, iter(())).run()):
            assert [await link.request(TIME, None) for _ in range(3)] == [0, 1, 2]

        assert link.stats.unexpected == 0


async def test_a_reply_is_recognised_as_late_for_three_seconds() -> None:
    async with line() as (link, far):
        with pytest.raises(ReplyTimeout):
            await link.request(TIME, None)

        *_, last = await far.arrived()
        await asyncio.sleep(LINGER - (now() - 1.0) - 0.01)
        call = start(link.request(TIME, None))
        await far.say(numbered(last, 100))
        async with running(Arm(far, iter(())).run()):
            assert await call < 100


async def test_a_swallowed_reply_at_the_very_end_of_the_wait_harms_nobody() -> None:
    torn = Torn()
    async with aclosing(link_over(torn)) as link:
        with pytest.raises(ReplyTimeout):
            await link.request(TIME, None, timeout=0.3)

        # In one turn of the loop: the reply arrives, then the time is over; the reader runs before who asked.
        answer = bytes(Frame(TIME.id, 0, bytes(4)))
        asyncio.get_running_loop().call_at(now() + 0.05 - 1e-5, lambda: torn.broken.set_result(answer))
        with pytest.raises(ReplyTimeout):
            await link.request(TIME, None, timeout=0.05)

        assert link.state.value is LinkState.OPEN


async def test_a_reply_later_than_any_tombstone_is_unexpected() -> None:
    async with line() as (link, far):
        with pytest.raises(ReplyTimeout):
            await link.request(TIME, None)

        asked = await far.arrived()
        await asyncio.sleep(LINGER)
        await far.say(numbered(asked[0], 100))
        await asyncio.sleep(0.001)
        assert link.stats.unexpected == 1


async def test_after_an_outage_the_next_request_succeeds() -> None:
    async with line() as (link, far):
        arm = Arm(far, repeat(None))
        async with running(arm.run()):
            for _ in range(2):
                with pytest.raises(ReplyTimeout):
                    await link.request(TIME, None)

            lost = arm.heard
            arm.fates = iter(())
            assert await link.request(TIME, None) >= lost


async def test_one_lost_reply_costs_who_follows_a_request_each_at_the_most_and_no_time() -> None:
    arm_fates: list[float | None] = [None]
    async with line() as (link, far):
        arm = Arm(far, iter(arm_fates))
        async with running(arm.run()):
            for _ in range(3):
                await link.request(TIME, None)

            heard, since = arm.heard, now()
            for _ in range(10):
                await link.request(TIME, None)

            assert heard + 10 <= arm.heard <= heard + 20
            assert now() == since

            await asyncio.sleep(LINGER + 0.01)
            heard = arm.heard
            for _ in range(10):
                await link.request(TIME, None)

            assert arm.heard == heard + 10


async def test_what_must_not_be_repeated_is_not_hurried_either() -> None:
    async with line() as (link, far):
        command, value = c.SET_QUEUED_CMD_START_DOWNLOAD, c.QueuedCmdStartDownload(1, 1)
        with pytest.raises(ReplyTimeout):
            await link.request(command, value, timeout=1)

        call = start(link.request(command, value, timeout=1))
        first, _ = await far.arrived()
        await far.say(first._replace(params=b""))
        assert len(await far.arrived()) == 0
        await far.say(first._replace(params=b""))
        assert await call is None


delays = st.sampled_from([0.0, 0.0, 0.0, 0.001, 0.03, 0.1, 0.3, 0.6, 1.1, 1.6, 2.5])


@given(delays, st.lists(st.booleans() | st.none(), max_size=25), st.lists(st.booleans(), max_size=8))
@example(0.6, [None, True, None, True, True], [False] * 5)
@example(2.5, [True] * 6, [True, False, True])
def test_no_request_gets_the_answer_to_an_earlier_one(
    delay: float, fates: list[bool | None], impatience: list[bool]
) -> None:
    """Whatever is lost (None) or late (True): what comes back belongs to this call, and the link recovers."""

    async def scenario() -> None:
        async with line() as (link, far):
            arm = Arm(far, iter([None if fate is None else fate * delay for fate in fates]))
            async with running(arm.run()):
                for impatient in impatience:
                    before = arm.heard
                    with suppress(ReplyTimeout, TimeoutError):
                        async with asyncio.timeout(0.02 if impatient else None):
                            assert await link.request(TIME, None) >= before

                while next(arm.fates, False) is not False:
                    pass

                await asyncio.sleep(delay)
                for _ in range(3):
                    before = arm.heard
                    assert await link.request(TIME, None) >= before

    with asyncio.Runner(loop_factory=async_solipsism.EventLoop) as runner:
        runner.run(scenario())


# Round trips, mute arms, disorder


async def test_only_a_request_that_was_sent_once_is_measured() -> None:
    near, other = memory_pair()
    trip = RoundTrip()
    async with aclosing(other), aclosing(link_over(near, round_trip=trip)) as link:
        async with running(Arm(Far(other), iter([None, 0.03])).run()):
            await link.request(TIME, None)
            assert trip.smoothed is None

        await asyncio.sleep(LINGER)
        async with running(Arm(Far(other), iter([0.03])).run()):
            await link.request(TIME, None)
            assert trip.smoothed == pytest.approx(0.03)
            assert link.reply_timeout == pytest.approx(0.09)


async def test_who_is_answered_after_a_swallowed_reply_is_not_measured() -> None:
    near, other = memory_pair()
    trip = RoundTrip()
    far = Far(other)
    async with aclosing(other), aclosing(link_over(near, round_trip=trip)) as link:
        with pytest.raises(ReplyTimeout):
            await link.request(TIME, None, timeout=0.0625)

        late = await far.one()
        call = start(link.request(TIME, None))
        asked = await far.one()
        since = now()
        await far.say(numbered(late, 100))
        again = await far.one()
        assert now() - since < link.reply_timeout  # it was sent again at once
        assert link.stats.repeated == 1
        await far.say(numbered(asked, 1), numbered(again, 2))
        assert await call == 1
        assert trip.smoothed is None


async def test_a_late_answer_costs_the_next_question_a_few_frames_and_no_later_one() -> None:
    near, other = memory_pair(in_flight=8, buffer=1000)
    far = Far(other)
    link = Link(near, Parser(), request, url="memory:", fences=(c.GET_DEVICE_NAME, c.GET_DEVICE_ID))
    async with aclosing(other), aclosing(link):
        late = start(link.request(TIME, None))
        first = await far.one()
        await asyncio.sleep(0.11)
        again = await far.one()
        await far.say(numbered(first, 1))
        assert await late == 1

        number = 1

        async def answer() -> None:
            nonlocal number
            await far.say(numbered(again, 0))  # the one that is still owed
            while True:
                for frame in await far.arrived():
                    number += frame.id == TIME.id
                    await far.say(numbered(frame, number) if frame.id == TIME.id else frame._replace(params=bytes(12)))

        async with running(answer()):
            before = link.stats.sent
            assert await link.request(TIME, None) > 1
            assert link.stats.sent - before <= 4
            before = link.stats.sent
            for _ in range(10):
                assert await link.request(TIME, None) > 1

            assert link.stats.sent - before == 10


async def test_an_answer_that_is_late_alone_answers_nobody_whenever_it_comes() -> None:
    """Asked without a pause, so that it comes between a question and its answer."""
    for moment in (1.5, 1.5004, 1.5008, 1.5012):
        near, other = memory_pair(in_flight=8, buffer=1000)
        far = Far(other)
        link = Link(near, Parser(), request, url="memory:", fences=(c.GET_DEVICE_NAME, c.GET_DEVICE_ID))
        async with aclosing(other), aclosing(link):
            with pytest.raises(ReplyTimeout):
                await link.request(TIME, None, timeout=0.05)

            late = await far.one()
            began, number, asked = now(), 1, start(link.request(TIME, None, timeout=1.0))
            came = False
            while now() < began + 2.0:
                for frame in await far.arrived():
                    await asyncio.sleep(0.0005)
                    if not came and now() >= began + moment:
                        came = True
                        await far.say(numbered(late, 0))

                    number += frame.id == TIME.id
                    await far.say(numbered(frame, number) if frame.id == TIME.id else frame._replace(params=bytes(12)))

                await asyncio.sleep(0)
                if asked.done():
                    assert asked.result() > 1
                    asked = start(link.request(TIME, None, timeout=1.0))

            assert came
            asked.cancel()
            await asyncio.wait([asked])


async def test_filler_goes_before_the_request_that_follows_three_unanswered_ones() -> None:
    torn = Torn()
    filler = bytes(9)
    async with aclosing(link_over(torn, filler=filler)) as link:
        with pytest.raises(ReplyTimeout):
            await link.request(TIME, None)

        assert [data.startswith(filler) for data in torn.sent] == [n > 0 and n % MUTE == 0 for n in range(7)]
        assert {data.removeprefix(filler) for data in torn.sent} == {bytes(Frame(TIME.id, 0, b""))}


async def test_any_frame_that_arrives_puts_off_the_filler() -> None:
    torn = Torn()
    async with aclosing(link_over(torn, filler=bytes(9))) as link:
        call = start(link.request(TIME, None))
        while len(torn.sent) < 6:
            await asyncio.sleep(0.07)
            torn.broken.set_result(bytes(Frame(200, 0, b"")))

        assert {len(data) for data in torn.sent} == {6}
        with pytest.raises(ReplyTimeout):
            await call


async def test_where_messages_may_be_doubled_who_asks_again_lets_the_double_pass() -> None:
    torn = Torn()
    torn.disorder = 0.02
    async with aclosing(link_over(torn)) as link:
        strays: list[Frame] = []
        link.stray = strays.append
        for number in range(2):
            call = start(link.request(TIME, None))
            await asyncio.sleep(0.001)
            assert len(torn.sent) == 1  # the first goes at once, the second waits
            await asyncio.sleep(0.04)
            assert len(torn.sent) == number + 1
            torn.broken.set_result(bytes(numbered(Frame(TIME.id, 0, b""), number)) * 2)
            assert await call == number
            assert strays == [numbered(Frame(TIME.id, 0, b""), n) for n in range(number + 1)]


# Cancellation


async def cancelled_task(link: Link[Frame], steps: int) -> None:
    """A request whose task is cancelled after so many turns of the loop."""
    call = start(link.request(TIME, None))
    for _ in range(steps):
        await asyncio.sleep(0)

    call.cancel()
    await asyncio.wait([call])


async def cancelled_scope(link: Link[Frame], steps: int) -> None:
    """A request in an anyio scope that is cancelled after so many turns of the loop."""

    async def call() -> None:
        with scope:
            await link.request(TIME, None)

    scope = anyio.CancelScope()
    task = start(call())
    for _ in range(steps):
        await asyncio.sleep(0)

    scope.cancel()
    await task


@pytest.mark.parametrize("cancelled", [cancelled_task, cancelled_scope])
@pytest.mark.parametrize("busy", ["free", "its turn", "the line"])
async def test_a_request_may_be_cancelled_anywhere(
    cancelled: Callable[[Link[Frame], int], Awaitable[None]], busy: str
) -> None:
    for steps in range(25):
        async with line(in_flight=1 if busy == "its turn" else 8, buffer=0 if busy == "the line" else 1000) as (
            link,
            far,
        ):
            arm = Arm(far, iter(()))
            others = []
            if busy == "its turn":
                others = [start(link.request(c.GET_DEVICE_SN, None)), start(link.request(TIME, None))]
                await asyncio.sleep(0)

            if busy == "the line":
                await cancelled(link, steps)

            async with running(arm.run()):
                await cancelled(link, steps)
                before = arm.heard
                assert await link.request(TIME, None) >= before
                await asyncio.gather(*others)
                before = arm.heard
                assert await link.request(TIME, None) >= before

            assert link.stats.unexpected == 0


@pytest.mark.parametrize("steps", range(6))
async def test_a_post_may_be_cancelled_anywhere(steps: int) -> None:
    async with line(in_flight=1, buffer=0) as (link, far):
        posting = start(post(link, 1))
        for _ in range(steps):
            await asyncio.sleep(0)

        posting.cancel()
        await asyncio.wait([posting])
        async with running(Arm(far, iter(())).run()):
            assert await link.request(TIME, None) >= 0


async def test_waiting_for_an_acknowledgement_may_be_cancelled() -> None:
    async with line(in_flight=1) as (link, far):
        posted = await post(link, 1)
        waiting = start(posted.answer())
        await asyncio.sleep(0.1)
        waiting.cancel()
        await asyncio.wait([waiting])
        async with running(Arm(far, iter(())).run()):
            assert await link.request(TIME, None) >= 0


# What an arm may get wrong


async def test_an_answer_that_never_fits_is_a_protocol_error_in_time() -> None:
    async with line() as (link, far):
        call = start(link.request(c.GET_POSE, None, timeout=3))
        asked = 0
        while not call.done():
            for frame in await far.arrived():
                asked += 1
                await far.say(frame._replace(params=b"too short"))

        with pytest.raises(ProtocolError, match="GetPose: the arm's answer does not fit: expected 32 bytes"):
            await call

        assert now() < 3.1
        assert (link.stats.timeouts, link.stats.unexpected, link.stats.sent) == (0, asked, asked)


async def test_the_answer_of_another_io_address_is_not_taken() -> None:
    async with line() as (link, far):
        call = start(link.request(c.GET_IODI, 7))
        asked = await far.one()
        await far.say(asked._replace(params=bytes([8, 1])))
        assert await far.arrived() == []
        assert not call.done()

        await far.say(asked._replace(params=bytes([7, 0])))
        assert await call == c.IODI(7, 0)


async def test_only_answers_of_another_io_address_are_a_protocol_error() -> None:
    async with line() as (link, far):
        call = start(link.request(c.GET_IODI, 7, timeout=0.3))
        await far.say((await far.one())._replace(params=bytes([8, 1])))
        with pytest.raises(ProtocolError, match="GetIODI of address 7 was answered with"):
            await call


@pytest.mark.parametrize("junk", [b"\xaa", b"\xaa\xaa\xfa", b"\x00\xff", b"\xaa\xaa\x02\x0a\x00\xf6" * 5])
async def test_garbage_for_ever_neither_starves_others_nor_fills_memory(junk: bytes) -> None:
    near, far = memory_pair(buffer=1)
    parser = Parser()
    link: Link[Frame] = Link(near, parser, request, url="memory:")

    async def flood() -> None:
        while True:
            await far.send(junk)

    async with aclosing(far), aclosing(link), running(flood()):
        for _ in range(1000):
            await asyncio.sleep(0)

        assert link.stats.junk_bytes + 6 * link.stats.received > 100
        assert len(parser._buffer) < 256
        assert len(asyncio.all_tasks()) == 3


async def test_a_request_is_answered_in_the_middle_of_garbage() -> None:
    async with line() as (link, far):
        call = start(link.request(TIME, None))
        answer = bytes(numbered(await far.one(), 7))
        await far.transport.send(b"\x00\xaa\xaa\x02\x01\x02\x03" + answer[:5])
        await far.transport.send(answer[5:] + b"\xaa")
        assert await call == 7
        assert link.stats.junk_bytes > 0


async def test_a_half_frame_does_not_swallow_what_follows_it() -> None:
    async with line() as (link, far):
        call = start(link.request(TIME, None))
        asked = await far.one()
        await far.transport.send(b"\xaa\xaa\xc8" + bytes(20))
        await asyncio.sleep(0.05)
        await far.say(numbered(asked, 7))
        assert await call == 7
        assert now() == pytest.approx(0.1)  # when the request would have been sent again

        async with running(Arm(far, iter(()), numbers=count(100)).run()):
            assert await link.request(TIME, None) >= 100


async def test_an_answer_inside_of_a_half_frame_is_found_even_if_there_is_no_repetition() -> None:
    async with line() as (link, far):
        call = start(link.request(c.SET_QUEUED_CMD_START_DOWNLOAD, c.QueuedCmdStartDownload(1, 1), timeout=1))
        asked = await far.one()
        await far.transport.send(b"\xaa\xaa\xc8" + bytes(asked._replace(params=b"")))
        assert await call is None
        assert now() == pytest.approx(1.0)


async def test_a_header_of_noise_costs_one_repetition() -> None:
    async with line() as (link, far):
        await far.transport.send(b"\xaa\xaa\xfa")
        async with running(Arm(far, iter(())).run()):
            assert [await link.request(TIME, None) for _ in range(3)] == [0, 1, 2]


async def test_a_bug_in_the_parser_ends_the_link() -> None:
    class Broken(Parser):
        def feed(self, data: bytes) -> list[Frame]:
            raise ZeroDivisionError("a bug")

    near, far = memory_pair()
    failures: list[Any] = []
    asyncio.get_running_loop().set_exception_handler(lambda _, context: failures.append(context))
    async with aclosing(far), aclosing(Link[Frame](near, Broken(), request, url="memory:")) as link:
        call = start(link.request(TIME, None))
        await far.send(b"x")
        with pytest.raises(ConnectionLost, match="a bug") as lost:
            await call

        assert isinstance(lost.value.__cause__, ZeroDivisionError)


# Life and death


class Torn:
    """A transport that breaks when it is told to."""

    in_flight = window = 8
    disorder = 0.0

    def __init__(self) -> None:
        self.broken: asyncio.Future[bytes] = asyncio.get_running_loop().create_future()
        self.sent: list[bytes] = []
        self.closing = self.closed = 0
        self.send_error: Exception | None = None
        self.hang_on_close = False

    async def send(self, data: bytes) -> None:
        self.sent.append(data)
        if self.send_error:
            raise self.send_error

    async def receive(self) -> bytes:
        data = await self.broken
        self.broken = asyncio.get_running_loop().create_future()
        return data

    async def aclose(self) -> None:
        self.closing += 1
        if self.hang_on_close:
            await asyncio.Event().wait()

        await asyncio.sleep(0)
        self.closed += 1


async def test_the_end_of_the_stream_reaches_everybody_once() -> None:
    async with line(in_flight=1) as (link, far):
        posted = await post(link, 1)
        calls = [start(link.request(TIME, None)) for _ in range(3)]
        calls += [start(posted.answer()), start(post(link, 2)), start(link.request(c.GET_POSE, None, urgent=True))]
        await far.arrived()
        since = now()
        await far.transport.aclose()
        results = await asyncio.gather(*calls, return_exceptions=True)
        assert now() == since
        for result in results:
            assert isinstance(result, ConnectionLost)
            assert isinstance(result.__cause__, anyio.EndOfStream)
            assert "EndOfStream" in str(result)

        assert link.state.value is LinkState.LOST
        assert link._reader.exception() is None
        assert [event async for event in link.events] == []
        with pytest.raises(ConnectionLost):
            await link.request(TIME, None)

        with pytest.raises(ConnectionLost):
            await post(link, 3)


async def test_the_first_cause_is_kept() -> None:
    torn = Torn()
    async with aclosing(link_over(torn)) as link:
        call = start(link.request(TIME, None))
        await asyncio.sleep(0.05)
        error = anyio.BrokenResourceError()
        error.__cause__ = OSError(5, "Input/output error")
        torn.broken.set_exception(error)
        with pytest.raises(ConnectionLost, match=r"the connection to memory: was lost: .*Input/output error") as lost:
            await call

        assert lost.value.__cause__ is error.__cause__
        torn.send_error = anyio.ClosedResourceError()
        with pytest.raises(ConnectionLost, match="Input/output error") as again:
            await link.request(TIME, None)

        assert again.value.__cause__ is error.__cause__
        assert len(torn.sent) == 1

    assert link.state.value is LinkState.LOST


@pytest.mark.parametrize("error", [anyio.BrokenResourceError(), anyio.ClosedResourceError(), OSError("gone")])
async def test_a_failing_send_ends_the_link(error: Exception) -> None:
    torn = Torn()
    async with aclosing(link_over(torn)) as link:
        call = start(link.request(TIME, None))
        await asyncio.sleep(0.1)
        torn.send_error = error
        with pytest.raises(ConnectionLost):
            await link.request(c.GET_POSE, None)

        with pytest.raises(ConnectionLost):
            await call

        assert now() == pytest.approx(0.1)
        assert link.state.value is LinkState.LOST


async def test_a_link_that_ends_between_two_repetitions_is_lost_and_not_silent() -> None:
    torn = Torn()
    async with aclosing(link_over(torn)) as link:
        call = start(link.request(TIME, None))
        loop = asyncio.get_running_loop()
        loop.call_at(0.5, torn.broken.set_exception, anyio.EndOfStream())
        with pytest.raises(ConnectionLost):
            await call

        assert now() == pytest.approx(0.5)


async def test_aclose_joins_the_reader_and_ends_all_calls() -> None:
    near, far = memory_pair(in_flight=2)
    async with aclosing(far):
        link = link_over(near)
        posted = await post(link, 1)
        calls = [start(link.request(TIME, None)) for _ in range(3)] + [start(posted.answer())]
        await asyncio.sleep(0.05)
        await link.aclose()
        assert not [task for task in asyncio.all_tasks() if "reader" in task.get_name()]
        assert link.state.value is LinkState.CLOSED
        for result in await asyncio.gather(*calls, return_exceptions=True):
            assert isinstance(result, ConnectionLost)
            assert str(result) == "the connection to memory: was closed"

        with pytest.raises(anyio.EndOfStream):
            while True:
                await far.receive()

        await link.aclose()
        with pytest.raises(ConnectionLost, match="was closed"):
            await link.request(TIME, None)

        assert now() == pytest.approx(0.05)


async def test_aclose_may_be_called_by_many_at_once() -> None:
    async with line() as (link, _):
        await asyncio.gather(*(link.aclose() for _ in range(3)))


async def test_aclose_does_not_hang_on_a_transport_that_does() -> None:
    torn = Torn()
    torn.hang_on_close = True
    await link_over(torn).aclose()
    assert now() <= 2


@pytest.mark.parametrize("steps", range(5))
async def test_the_transport_is_closed_even_if_aclose_is_cancelled(steps: int) -> None:
    torn = Torn()
    link = link_over(torn)
    closing = start(link.aclose())
    for _ in range(steps):
        await asyncio.sleep(0)

    closing.cancel()
    await asyncio.wait([closing])
    if not steps:
        await link.aclose()

    assert torn.closing == 1
    assert torn.broken.cancelled()


async def test_aclose_ignores_the_scope_that_was_cancelled_around_it() -> None:
    torn = Torn()
    link = link_over(torn)
    with anyio.CancelScope() as scope:
        scope.cancel()
        await link.aclose()

    assert torn.closed == 1


# Events, figures, traces


async def test_what_nobody_waits_for_is_counted_and_offered() -> None:
    async with line() as (link, far):
        listener = aiter(link.events)
        strays = [Frame(200, 0, b"stray"), Frame(TIME.id, 0, bytes(4))]
        await far.say(*strays)
        assert [await anext(listener), await anext(listener)] == [Unexpected(frame) for frame in strays]
        assert link.stats.unexpected == 2

        await link.aclose()
        assert [event async for event in listener] == []


async def test_stats_tell_what_went_over_the_link() -> None:
    async with line() as (link, far):
        async with running(Arm(far, iter([0.0, None])).run()):
            await link.request(TIME, None)
            before = link.stats
            await link.request(TIME, None)

        bad = bytearray(bytes(Frame(1, 0, b"")))
        bad[-1] ^= 1
        await far.transport.send(b"junk" + bad + bytes(Frame(200, 0, b"")))
        with pytest.raises(ReplyTimeout):
            await link.request(c.SET_QUEUED_CMD_START_DOWNLOAD, c.QueuedCmdStartDownload(1, 1))

        stats = link.stats
        assert (before.sent, before.received) == (1, 1)
        assert (stats.sent, stats.received, stats.repeated) == (4, 3, 1)
        assert (stats.timeouts, stats.unexpected) == (1, 1)
        assert (stats.junk_bytes, stats.bad_frames) == (4 + 6, 1)


async def test_the_trace_has_every_frame_in_order() -> None:
    async with line() as (link, far):
        seen: list[tuple[bool, Frame]] = []
        link.trace = lambda outgoing, frame: seen.append((outgoing, frame))
        call = start(link.request(TIME, None))
        asked = await far.one()
        stray, answer = Frame(200, 0, b""), numbered(asked, 3)
        await far.say(stray, answer)
        await call
        assert seen == [(True, asked), (False, stray), (False, answer)]


# Mistakes of the caller


async def test_an_observer_sends_no_command() -> None:
    async with line(read_only=True) as (link, far):
        with pytest.raises(ValueError, match=r"SetQueuedCmdClear is a command.*control=False"):
            await link.request(c.SET_QUEUED_CMD_CLEAR, None)

        with pytest.raises(ValueError, match="control=False"):
            await link.request(c.SET_QUEUED_CMD_FORCE_STOP_EXEC, None, urgent=True)

        with pytest.raises(ValueError, match="control=False"):
            link.frame(c.SET_WAIT_CMD, c.WAITCmd(1), queued=True)

        assert await far.arrived() == []
        async with running(Arm(far, iter(())).run()):
            assert await link.request(TIME, None) == 0


async def test_what_does_not_fit_is_refused_before_a_byte_is_sent() -> None:
    wrong: Any = "7"
    async with line() as (link, far):
        with pytest.raises(ValueError, match=r"in 1 to 20, not 21"):
            await link.request(c.GET_IODI, 21)

        with pytest.raises(TypeError):
            await link.request(c.GET_IODI, wrong)

        with pytest.raises(TypeError):
            await link.request(TIME, wrong)

        with pytest.raises(ValueError, match="cannot be queued"):
            link.frame(TIME, None, queued=True)

        assert await far.arrived() == []
        assert link.stats.sent == 0
