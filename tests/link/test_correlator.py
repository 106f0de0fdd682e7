"""The correlator against models of the line that know which reply is whose.

On the stream the peer answers in order, whatever the line loses and however long it stands still. With datagrams two
messages overtake one another, or one arrives twice, within the reorder window. No reply may reach a request that was
sent after the reply was made.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import count
from typing import TypeVar

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule
from quick_suite import examples

from dobot_async._core.link.correlator import Correlator, Outcome, Request
from dobot_async.errors import ConnectionLost, ProtocolError

T = TypeVar("T")
HOUR = 3600.0
ECHOES = {"pose": [0], "alarms": [0], "io": [1, 2, 3]}
"""The keys of the questions, and what a reply repeats of its request."""

BARRIER = "barrier"
WHICH = st.integers(0, 30)


@dataclass(frozen=True)
class Reply:
    """What comes back.

    Attributes:
        echo: What it repeats of its request.
        owner: The number of the request that it answers.
        made: When it was made, in steps of the test.
    """

    key: str
    echo: int = 0
    owner: int = -1
    made: int = -1
    params: bytes = b""

    def __bytes__(self) -> bytes:
        return b""


def fits(echo: int) -> Callable[[Reply], Reply]:
    """Accepts the replies that repeat something."""

    def accept(reply: Reply) -> Reply:
        if reply.echo != echo:
            raise ProtocolError(f"{reply.echo} and not {echo}")

        return reply

    return accept


def pick(things: Sequence[T], which: int) -> T:
    """One of several."""
    return things[which % len(things)]


class Clock:
    """Time that stands still until it is moved."""

    def __init__(self) -> None:
        self.now = 1000.0

    def __call__(self) -> float:
        return self.now


# The rules, one by one


@dataclass
class Bench:
    """A correlator by hand."""

    reorder_window: float = 0.0
    clock: Clock = field(default_factory=Clock)
    lost: list[Request[Reply]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.correlator: Correlator[Reply] = Correlator(self.clock, lambda: self.reorder_window, self.lost.append)

    def ask(self, key: str = "pose", echo: int = 0, *, held: bool = False, proves: bool = True) -> Request[Reply]:
        return self.correlator.sent(key, fits(echo), held=held, proves=proves)

    def hear(self, key: str = "pose", echo: int = 0) -> bool:
        return self.correlator.resolve(Reply(key, echo))

    def later(self, seconds: float) -> None:
        self.clock.now += seconds


@pytest.fixture
def stream() -> Bench:
    return Bench()


@pytest.fixture
def datagrams() -> Bench:
    return Bench(reorder_window=1.0)


def outcomes(*requests: Request[Reply]) -> list[Outcome | None]:
    return [request.outcome for request in requests]


def test_a_reply_belongs_to_the_earliest_request_of_its_key(stream: Bench) -> None:
    first, other, second = stream.ask(), stream.ask("alarms"), stream.ask()
    assert stream.hear()
    assert outcomes(first, other, second) == [Outcome.REPLY, None, None]
    assert first.value == Reply("pose")


def test_a_reply_belongs_to_the_earliest_request_that_it_fits(stream: Bench) -> None:
    first, second, third = stream.ask("io", 1), stream.ask("io", 2), stream.ask("io", 2)
    assert stream.hear("io", 2)
    assert outcomes(first, second, third) == [Outcome.LOST, Outcome.REPLY, None]
    assert str(first.misfit) == "2 and not 1"


def test_a_reply_that_fits_nobody_is_nobodys_and_ends_nothing(stream: Bench) -> None:
    first = stream.ask("io", 1)
    assert not stream.hear("io", 2)
    assert not stream.hear("alarms")
    assert outcomes(first) == [None]
    assert stream.hear("io", 1)


def test_a_reply_proves_that_what_was_sent_before_is_lost(stream: Bench) -> None:
    requests = [stream.ask(key) for key in ("alarms", "io", "pose", "alarms", "io")]
    assert stream.hear()
    assert outcomes(*requests) == [Outcome.LOST, Outcome.LOST, Outcome.REPLY, None, None]
    assert stream.lost == requests[:2]
    assert len(stream.correlator) == 2


def test_no_clock_ends_a_request(stream: Bench) -> None:
    first, second = stream.ask(), stream.ask("alarms")
    stream.later(1e6 * HOUR)
    stream.correlator.expire()
    assert (stream.correlator.newest("pose"), stream.correlator.earliest("alarms")) == (first, second.number)
    assert stream.hear("pose")
    stream.later(1e6 * HOUR)
    assert stream.hear("alarms")
    assert outcomes(first, second) == [Outcome.REPLY, Outcome.REPLY]


def test_newest_and_earliest_are_those_of_their_key(stream: Bench) -> None:
    first, _, second = stream.ask(), stream.ask("alarms"), stream.ask()
    assert (stream.correlator.newest("pose"), stream.correlator.earliest("pose")) == (second, first.number)
    assert (stream.correlator.newest("io"), stream.correlator.earliest("io")) == (None, math.inf)


def test_whoever_waits_is_woken_once_and_finds_the_outcome(stream: Bench) -> None:
    seen: list[tuple[str, Outcome | None]] = []
    first, second = stream.ask("alarms"), stream.ask()
    first.wakers += [lambda: seen.append(("lost", first.outcome)), lambda: seen.append(("lost too", first.outcome))]
    second.wakers.append(lambda: seen.append(("answered", second.outcome)))
    stream.hear()
    stream.hear()
    assert seen == [("lost", Outcome.LOST), ("lost too", Outcome.LOST), ("answered", Outcome.REPLY)]


def test_the_end_of_the_link_ends_all(stream: Bench) -> None:
    error = ConnectionLost("gone")
    answered, first, held = stream.ask(), stream.ask("alarms"), stream.ask("io", held=True)
    stream.hear()
    stream.hear("io")
    stream.correlator.fail(error)
    assert outcomes(answered, first, held) == [Outcome.REPLY, Outcome.FAILED, Outcome.FAILED]
    assert held.value is error
    assert len(stream.correlator) == 0
    assert not stream.hear("alarms")


@pytest.mark.parametrize(
    ("replies", "outcome"), [(0, Outcome.LOST), (1, Outcome.REPLY), (2, Outcome.LOST), (3, Outcome.LOST)]
)
def test_of_replies_that_are_held_a_single_one_counts_when_something_behind_is_answered(
    stream: Bench, replies: int, outcome: Outcome
) -> None:
    held, barrier = stream.ask(held=True), stream.ask(BARRIER)
    for _ in range(replies):
        assert stream.hear()
        assert outcomes(held) == [None]

    stream.later(HOUR)
    assert stream.hear(BARRIER)
    assert outcomes(held, barrier) == [outcome, Outcome.REPLY]
    assert stream.lost == ([held] if outcome is Outcome.LOST else [])


def test_what_takes_its_first_reply_and_proves_nothing_ends_alone(stream: Bench) -> None:
    other, stop = stream.ask("alarms"), stream.ask(proves=False)
    stream.hear()
    assert outcomes(other, stop) == [None, Outcome.REPLY]
    stream.hear("alarms")
    assert outcomes(other) == [Outcome.REPLY]
    assert not stream.lost


def test_a_reply_that_is_held_proves_nothing_for_it_may_have_come_alone(stream: Bench) -> None:
    other, held, barrier = stream.ask("alarms"), stream.ask(held=True), stream.ask(BARRIER)
    assert stream.hear()
    assert outcomes(other, held, barrier) == [None, None, None]
    assert stream.hear("alarms")
    assert stream.hear(BARRIER)
    assert outcomes(other, held, barrier) == [Outcome.REPLY] * 3


# With datagrams


def test_where_messages_overtake_what_was_sent_before_is_lost_a_window_later(datagrams: Bench) -> None:
    first = datagrams.ask()
    datagrams.later(1.0)
    barrier = datagrams.ask(BARRIER)
    datagrams.later(5.0)
    datagrams.hear(BARRIER)
    assert outcomes(first, barrier) == [None, Outcome.REPLY]
    assert datagrams.correlator.newest("pose") is first
    datagrams.later(0.99)
    assert datagrams.correlator.newest("pose") is first
    datagrams.later(0.01)
    assert datagrams.correlator.newest("pose") is None
    assert outcomes(first) == [Outcome.LOST]


def test_a_reply_that_was_overtaken_is_taken_until_then(datagrams: Bench) -> None:
    first = datagrams.ask()
    datagrams.later(1.0)
    datagrams.ask(BARRIER)
    datagrams.hear(BARRIER)
    datagrams.later(0.99)
    assert datagrams.hear()
    assert outcomes(first) == [Outcome.REPLY]


def test_what_was_sent_within_the_window_is_not_proven_lost(datagrams: Bench) -> None:
    first = datagrams.ask()
    datagrams.later(0.99)
    datagrams.ask(BARRIER)
    datagrams.hear(BARRIER)
    datagrams.later(HOUR)
    assert datagrams.correlator.newest("pose") is first


def test_the_first_proof_counts(datagrams: Bench) -> None:
    first = datagrams.ask()
    datagrams.later(1.0)
    datagrams.ask(BARRIER)
    datagrams.ask("alarms")
    datagrams.hear(BARRIER)
    datagrams.later(0.5)
    datagrams.hear("alarms")
    datagrams.later(0.5)
    assert datagrams.correlator.newest("pose") is None
    assert outcomes(first) == [Outcome.LOST]


def test_a_frame_within_two_windows_of_the_last_one_of_its_key_may_be_a_copy(datagrams: Bench) -> None:
    assert datagrams.correlator.calm_at("pose") == -math.inf
    datagrams.ask()
    heard_at = datagrams.clock()
    assert datagrams.hear()
    assert datagrams.correlator.calm_at("pose") == heard_at + 2
    assert datagrams.correlator.calm_at("alarms") == -math.inf
    second, other = datagrams.ask(), datagrams.ask("alarms")
    datagrams.later(1.99)
    assert not datagrams.hear()
    assert datagrams.hear("alarms")
    assert datagrams.correlator.calm_at("pose") == heard_at + 2
    datagrams.later(0.01)
    assert datagrams.hear()
    assert outcomes(second, other) == [Outcome.REPLY, Outcome.REPLY]


def test_a_stream_is_always_calm(stream: Bench) -> None:
    stream.ask()
    stream.hear()
    assert stream.correlator.calm_at("pose") <= stream.clock()
    second = stream.ask()
    assert stream.hear()
    assert outcomes(second) == [Outcome.REPLY]


# A stream


@dataclass(eq=False)
class Asked:
    """A request as the oracle knows it.

    Attributes:
        sent: When it was sent, in steps.
        over: Whether no reply to it can come in its turn any more, as somebody knows who sees the whole line.
        aside: Whether its reply left the line, to come alone.
        ended: What is expected of its outcome.
        woken: How often who waits for it was woken.
    """

    request: Request[Reply]
    echo: int
    sent: int
    over: bool = False
    aside: bool = False
    ended: Outcome | None = None
    woken: int = 0
    held: list[Reply] = field(default_factory=list)

    @property
    def key(self) -> str:
        return str(self.request.key)

    def wake(self) -> None:
        assert self.request.outcome
        self.woken += 1


class StreamMachine(RuleBasedStateMachine):
    """Two queues, of requests and of replies, which lose what they like and take as long as they like.

    A reply may leave the line at the moment of its turn, and come alone at any time after that, one of each key at a
    time. Until it has come every request of its key is held, is alone, and is not lost itself: this far goes what held
    requests are there for.
    """

    def __init__(self) -> None:
        super().__init__()
        self.clock = Clock()
        self.lost: list[Request[Reply]] = []
        self.correlator: Correlator[Reply] = Correlator(self.clock, lambda: 0.0, self.lost.append)
        self.steps = count()
        self.asked: list[Asked] = []
        self.outstanding: list[Asked] = []
        self.requests: list[Asked] = []
        self.replies: list[Reply] = []
        self.aside: dict[str, Reply] = {}

    def may_ask(self, key: str, *, held: bool) -> bool:
        """Whether a request may go out: beside one that is held none of its key, and held ones alone."""
        same = [asked for asked in self.outstanding if asked.key == key]
        if any(asked.request.held is not None for asked in same):
            return False

        return not same if held else key not in self.aside

    def send(self, key: str, echo: int, *, held: bool) -> Asked:
        asked = Asked(self.correlator.sent(key, fits(echo), held=held), echo, next(self.steps))
        asked.request.wakers.append(asked.wake)
        self.asked.append(asked)
        self.outstanding.append(asked)
        self.requests.append(asked)
        return asked

    @rule(key=st.sampled_from(sorted(ECHOES)), which=WHICH, held=st.sampled_from([False, False, True]))
    def ask(self, key: str, which: int, held: bool) -> None:
        held = held or key in self.aside
        if self.may_ask(key, held=held):
            self.send(key, pick(ECHOES[key], which), held=held)

    @rule(key=st.sampled_from([BARRIER, "other barrier"]))
    def ask_barrier(self, key: str) -> None:
        self.send(key, 0, held=False)

    @precondition(lambda self: self.requests)
    @rule(many=st.integers(1, 4))
    def peer_answers(self, many: int) -> None:
        for _ in range(min(many, len(self.requests))):
            asked = self.requests.pop(0)
            self.replies.append(Reply(asked.key, asked.echo, asked.request.number, next(self.steps)))

    def may_be_lost(self, asked: Asked) -> bool:
        """Whether it does without its reply: not if it may be given, or was given, one that comes alone."""
        return asked.request.held is None or not (asked.key in self.aside or asked.held)

    @rule(key=st.sampled_from(sorted(ECHOES)), aside=st.booleans())
    def ask_behind_a_barrier(self, key: str, aside: bool) -> None:
        """The common case as one step, so that rare cases need few: all is answered, or all but the first."""
        held = key in self.aside
        if self.requests or self.replies or not self.may_ask(key, held=held):
            return

        self.send(key, 0, held=held)
        self.send(BARRIER, 0, held=False)
        self.peer_answers(2)
        if aside and self.may_leave():
            self.put_aside()

        self.hear(2)

    @precondition(lambda self: self.requests)
    @rule(which=WHICH)
    def lose_request(self, which: int) -> None:
        asked = pick(self.requests, which)
        if self.may_be_lost(asked):
            self.requests.remove(asked)
            asked.over = True

    @precondition(lambda self: self.replies)
    @rule(which=WHICH)
    def lose_reply(self, which: int) -> None:
        reply = pick(self.replies, which)
        asked = self.asked[reply.owner]
        if self.may_be_lost(asked):
            self.replies.remove(reply)
            asked.over = True

    @precondition(lambda self: self.replies)
    @rule(many=st.integers(1, 4))
    def hear(self, many: int) -> None:
        for _ in range(min(many, len(self.replies))):
            reply = self.replies.pop(0)
            owner = self.asked[reply.owner]
            assert owner.request.outcome is None, "it was ended although its reply was on the way"
            owner.over = True
            assert self.resolve(reply), "a reply was thrown away"

    def may_leave(self) -> bool:
        """Whether the next reply may come alone instead: it is of the only request of its key."""
        if not self.replies or self.replies[0].key in self.aside or self.replies[0].key not in ECHOES:
            return False

        owner = self.asked[self.replies[0].owner]
        return [asked for asked in self.outstanding if asked.key == owner.key] == [owner] and not owner.held

    @precondition(may_leave)
    @rule()
    def put_aside(self) -> None:
        reply = self.replies.pop(0)
        self.asked[reply.owner].over = self.asked[reply.owner].aside = True
        self.aside[reply.key] = reply

    @precondition(lambda self: self.aside)
    @rule(which=WHICH)
    def hear_late_reply(self, which: int) -> None:
        self.resolve(self.aside.pop(pick(sorted(self.aside), which)))

    @precondition(lambda self: self.aside)
    @rule(which=WHICH)
    def lose_late_reply(self, which: int) -> None:
        del self.aside[pick(sorted(self.aside), which)]

    @rule(key=st.sampled_from([*sorted(ECHOES), BARRIER, "nobody's"]))
    def hear_nonsense(self, key: str) -> None:
        assert not self.resolve(Reply(key, echo=-1))

    @rule(hours=st.sampled_from([0.0001, 1.0, 10000.0]))
    def wait(self, hours: float) -> None:
        self.clock.now += hours * HOUR
        self.correlator.expire()

    @precondition(lambda self: self.outstanding)
    @rule(which=WHICH)
    def abandon(self, which: int) -> None:
        """Nobody waits for it any more: the correlator hears nothing of that."""
        asked = pick(self.outstanding, which)
        asked.request.wakers.clear()
        asked.woken = 1

    def resolve(self, reply: Reply) -> bool:
        """Gives a reply to the correlator; it must end exactly what the reply proves."""
        place = next(
            (
                place
                for place, asked in enumerate(self.outstanding)
                if (asked.key, asked.echo) == (reply.key, reply.echo)
            ),
            None,
        )
        if place is not None:
            taker, earlier = self.outstanding[place], self.outstanding[:place]
            if taker.request.held is None:
                taker.ended = Outcome.REPLY
                del self.outstanding[: place + 1]
                for asked in earlier:
                    asked.ended = Outcome.REPLY if len(asked.held) == 1 else Outcome.LOST
            else:
                taker.held.append(reply)  # it may have come alone, and proves nothing

        taken = self.correlator.resolve(reply)
        assert taken == (place is not None)
        return taken

    @invariant()
    def exactly_what_is_proven_has_ended(self) -> None:
        assert [asked.request.outcome for asked in self.asked] == [asked.ended for asked in self.asked]
        assert len(self.correlator) == len(self.outstanding)
        for key in ECHOES:
            numbers = [asked.request.number for asked in self.outstanding if asked.key == key]
            newest = self.correlator.newest(key)
            assert (newest.number if newest else None) == max(numbers, default=None)
            assert self.correlator.earliest(key) == min(numbers, default=math.inf)

    @invariant()
    def no_reply_is_older_than_its_request(self) -> None:
        for asked in self.asked:
            if asked.request.outcome is Outcome.REPLY:
                reply = asked.request.value
                assert (reply.key, reply.echo) == (asked.key, asked.echo)
                assert reply.made > asked.sent, "a stale reply"

    @invariant()
    def what_is_lost_will_not_be_answered(self) -> None:
        assert self.lost == sorted(self.lost, key=lambda request: request.number)
        assert self.lost == [asked.request for asked in self.asked if asked.request.outcome is Outcome.LOST]
        assert all(asked.over for asked in self.asked if asked.request.outcome)

    @invariant()
    def who_waits_is_woken_once(self) -> None:
        assert all(asked.woken == 1 for asked in self.asked if asked.request.outcome)
        assert all(asked.woken <= 1 for asked in self.asked)

    def teardown(self) -> None:
        """Once nothing is lost any more one answer to a barrier ends all that was sent before it."""
        self.aside.clear()
        while self.requests or self.replies:
            if self.requests:
                self.peer_answers(4)

            if self.replies:
                self.hear(4)

        last = self.send("free", 0, held=False)
        self.peer_answers(1)
        self.hear(1)
        assert last.request.outcome is Outcome.REPLY
        assert all(asked.request.outcome for asked in self.asked)
        assert len(self.correlator) == 0
        self.exactly_what_is_proven_has_ended()
        self.no_reply_is_older_than_its_request()
        self.what_is_lost_will_not_be_answered()


StreamMachine.TestCase.settings = settings(max_examples=examples(300), stateful_step_count=50, deadline=None)
TestStream = StreamMachine.TestCase


# Datagrams


WINDOW = 20
PATIENCE = 150
LAST = WINDOW - 1
FATES = st.sampled_from([(0,), (0,), (LAST,), (LAST,), (WINDOW // 2,), (0, LAST), (LAST, 0), (0, 0), ()])
"""What becomes of a message: its copies, and by how much each is late."""


@dataclass(order=True)
class Coming:
    """A message that is on its way; `number` is that of its request."""

    at: float
    tie: int
    number: int = field(compare=False)
    reply: Reply | None = field(compare=False, default=None)


class DatagramMachine(RuleBasedStateMachine):
    """A net that takes messages in any order within the window, loses some and doubles some; a peer that answers all.

    Who asks does it as the link does: one question at a time, none while the frames of its key may be copies, and none
    of a key of which one is outstanding; then a barrier. The time of a barrier and of a question may be any.
    """

    def __init__(self) -> None:
        super().__init__()
        self.clock = Clock()
        self.lost: list[Request[Reply]] = []
        self.correlator: Correlator[Reply] = Correlator(self.clock, lambda: WINDOW, self.lost.append)
        self.steps = count()
        self.ties = count()
        self.asked: list[Asked] = []
        self.fates: dict[int, tuple[int, ...]] = {}
        self.coming: list[Coming] = []
        self.latency = 5.0
        self.awaited: Asked | None = None

    def carry(self, fate: tuple[int, ...], number: int, reply: Reply | None = None) -> None:
        for jitter in fate:
            heapq.heappush(self.coming, Coming(self.clock.now + self.latency + jitter, next(self.ties), number, reply))

    def send(self, key: str, echo: int, there: tuple[int, ...], back: tuple[int, ...]) -> Asked:
        assert self.clock.now >= self.correlator.calm_at(key)
        asked = Asked(self.correlator.sent(key, fits(echo)), echo, next(self.steps))
        asked.request.wakers.append(asked.wake)
        self.asked.append(asked)
        self.fates[asked.request.number] = back
        self.carry(there, asked.request.number)
        self.awaited = asked
        return asked

    def until(self, when: float) -> None:
        """Lets time pass, and what comes meanwhile come."""
        while self.coming and self.coming[0].at <= when:
            self.pass_time(self.coming[0].at)
            coming = heapq.heappop(self.coming)
            if coming.reply:
                self.hear(coming.reply)
            else:
                asked = self.asked[coming.number]
                reply = Reply(asked.key, asked.echo, coming.number, next(self.steps))
                self.carry(self.fates[coming.number], coming.number, reply)

        self.pass_time(when)

    def pass_time(self, when: float) -> None:
        while self.clock.now < when:
            self.clock.now = when if when > self.clock.now + 200 else min(when, self.clock.now + 1)
            self.correlator.expire()
            self.what_is_lost_will_not_be_answered()

    def hear(self, reply: Reply) -> None:
        before = [asked for asked in self.asked if not asked.request.outcome]
        taken = self.correlator.resolve(reply)
        got = [asked for asked in before if asked.request.outcome is Outcome.REPLY]
        assert len(got) == taken
        for asked in got:
            assert asked.request.value is reply
            assert reply.made > asked.sent, "a stale reply"
            assert reply.owner == asked.request.number or asked.key not in ECHOES, "a reply to another question"

    @property
    def busy(self) -> bool:
        """Whether a question is awaited: it is neither answered nor given up."""
        return self.awaited is not None and self.awaited.request.outcome is None

    def until_calm(self, key: str) -> None:
        while self.clock.now < self.correlator.calm_at(key):  # a reply that comes meanwhile puts it off
            self.until(self.correlator.calm_at(key))

    @precondition(lambda self: not self.busy)
    @rule(key=st.sampled_from(["pose", "io"]), which=WHICH, there=FATES, back=FATES)
    def ask(self, key: str, which: int, there: tuple[int, ...], back: tuple[int, ...]) -> None:
        self.until_calm(key)
        if self.correlator.newest(key) is None:
            self.send(key, pick(ECHOES[key], which), there, back)

    @precondition(lambda self: not self.busy)
    @rule(key=st.sampled_from([BARRIER, "other barrier"]), there=FATES, back=FATES)
    def ask_barrier(self, key: str, there: tuple[int, ...], back: tuple[int, ...]) -> None:
        """Its key need not be free: who asks it does not care whose answer it gets."""
        self.until_calm(key)
        self.send(key, 0, there, back)

    @precondition(lambda self: not self.busy)
    @rule(
        key=st.sampled_from(["pose", "io"]),
        fates=st.tuples(FATES, FATES, FATES, FATES),
        gap=st.sampled_from([WINDOW // 2, WINDOW // 2, 0, WINDOW, PATIENCE]),
        pause=st.sampled_from([PATIENCE, PATIENCE, 0, WINDOW]),
    )
    def ask_and_prove(self, key: str, fates: tuple[tuple[int, ...], ...], gap: int, pause: int) -> None:
        """The common case as one step, so that rare cases need few: a question, a barrier, and the question again."""
        there, back, *fates_of_barrier = fates
        self.ask(key, 0, there, back)
        self.until(self.clock.now + gap)
        self.until_calm(BARRIER)
        self.send(BARRIER, 0, *fates_of_barrier)
        self.until(self.clock.now + pause)
        self.ask(key, 0, (0,), (0,))

    @precondition(lambda self: not self.coming)
    @rule(seconds=st.sampled_from([1.0, 5.0, 1000.0, 1000 * HOUR]))
    def be_slow(self, seconds: float) -> None:
        """From now on each way takes so long."""
        self.latency = seconds

    @precondition(lambda self: self.busy)
    @rule()
    def give_up(self) -> None:
        """Who asked was cancelled."""
        self.awaited = None

    @rule(ticks=st.sampled_from([0, 1, 5, WINDOW - 1, WINDOW, 2 * WINDOW, PATIENCE]))
    def wait(self, ticks: int) -> None:
        self.until(self.clock.now + ticks)
        self.correlator.expire()

    @precondition(lambda self: not self.coming)
    @rule()
    def wait_for_hours(self) -> None:
        """Nothing that nothing has proven is lost by that."""
        due = [asked for asked in self.asked if not asked.request.outcome and asked.request.gone_at == math.inf]
        self.until(self.clock.now + 1000 * HOUR)
        self.correlator.expire()
        assert not any(asked.request.outcome for asked in due)

    @invariant()
    def what_is_lost_will_not_be_answered(self) -> None:
        assert not any(self.asked[coming.number].request.outcome is Outcome.LOST for coming in self.coming)

    @invariant()
    def the_lost_ones_are_noted(self) -> None:
        lost = [asked.request for asked in self.asked if asked.request.outcome is Outcome.LOST]
        assert sorted(self.lost, key=lambda request: request.number) == lost

    @invariant()
    def who_waits_is_woken_once(self) -> None:
        assert all(asked.woken == bool(asked.request.outcome) for asked in self.asked)

    def teardown(self) -> None:
        """Once nothing is lost any more one answer to a barrier ends all that was sent a window before it."""
        patience = 2 * (self.latency + 2 * WINDOW)
        self.until(self.clock.now + patience)
        self.until_calm("free")
        last = self.send("free", 0, (0,), (0,))
        self.until(self.clock.now + patience)
        assert last.request.outcome is Outcome.REPLY
        self.correlator.expire()
        assert all(asked.request.outcome for asked in self.asked)
        assert len(self.correlator) == 0


DatagramMachine.TestCase.settings = settings(max_examples=examples(300), stateful_step_count=50, deadline=None)
TestDatagrams = DatagramMachine.TestCase
