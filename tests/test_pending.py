"""Pending against models of the wire: a stream, on which one reply of a key may straggle, and a net of datagrams."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Hashable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import count
from random import Random
from typing import Any, TypeVar

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule
from virtual import run_virtual

from dobot_async.errors import ConnectionLost, ProtocolError
from dobot_async.pending import LINGER, SWALLOWED, Pending, Waiter

MISFIT = -1
ADDRESSES: dict[str, list[Hashable]] = {"pose": [None], "alarms": [None], "io": [1, 2]}
"""The keys of calls, and what their replies are told by."""

FENCES = ("end effector", "ptp common")
MANY_FENCES = tuple(f"parameters {number}" for number in range(12))
POSTED, URGENT = "posted", "stop"
WHICH = st.integers(0, 11)
T = TypeVar("T")


@dataclass(frozen=True)
class Reply:
    """What comes back: the number of the sending that it answers."""

    key: Hashable
    number: int
    echo: Hashable = None


def take(reply: Reply) -> int:
    """The value of a reply that fits."""
    if reply.number == MISFIT:
        raise ProtocolError("misfit")

    return reply.number


def of(echo: Hashable) -> Callable[[Reply], int]:
    """Accepts the replies of one address."""

    def accept(reply: Reply) -> int:
        if reply.echo != echo:
            raise ProtocolError("of another address")

        return take(reply)

    return accept


def only(number: int) -> Callable[[Reply], int]:
    """Accepts the reply with one number."""

    def accept(reply: Reply) -> int:
        if reply.number != number:
            raise ProtocolError("another")

        return number

    return accept


def pick(things: Sequence[T], which: int) -> T:
    """One of several."""
    return things[which % len(things)]


@dataclass(eq=False)
class Call:
    """One request as the test sees it."""

    waiter: Waiter[Reply]
    began: int
    sends: int = 0
    values: list[Any] = field(default_factory=list)
    nudged: bool = False
    robbed: bool = False
    left: int | None = None

    @property
    def key(self) -> Any:
        return self.waiter.key

    @property
    def waits(self) -> bool:
        """Whether it still waits for its first answer."""
        return self.left is None and not self.values

    @property
    def listens(self) -> bool:
        """Whether it would hear of an answer that comes now."""
        return self.waits and not self.nudged

    def hear(self, value: Any) -> None:
        """A reply, an error, or that a reply was swallowed that may have been this one's."""
        assert self.listens
        if value is SWALLOWED:
            assert self.waiter.repeatable
            self.nudged = True
        else:
            self.values.append(value)


@dataclass(eq=False)
class Sending:
    """A request on the wire.

    Attributes:
        until: When its reply would be too late to count on.
    """

    number: int
    call: Call
    at: float
    until: float

    @property
    def reply(self) -> Reply:
        return Reply(self.call.key, self.number, self.call.waiter.echo)


class StreamMachine(RuleBasedStateMachine):
    """Calls come and go; the wire is one line of the sendings of all keys that are not answered yet.

    The peer answers in order, or not at all. It pauses whenever time passes, and what its pauses have shown is the
    promise of `until`. One reply of each key may be put aside, to come later, alone.
    """

    def __init__(self) -> None:
        super().__init__()
        self.now = 100.0
        self.step = 0
        self.pending: Pending[Reply] = Pending(lambda: self.now)
        self.numbers = count()
        self.calls: list[Call] = []
        self.wire: list[Sending] = []
        self.aside: dict[str, Sending] = {}
        self.straggled: dict[str, float] = {}
        self.taken_at = 0.0
        self.sendings: list[Sending] = []

    def waiting(self) -> list[Call]:
        return [call for call in self.calls if call.waits]

    def present(self) -> list[Call]:
        return [call for call in self.calls if call.left is None]

    def enter(self, key: str, accept: Callable[[Reply], Any], **options: Any) -> Call:
        self.step += 1
        call = Call(self.pending.expect(key, accept, **options).__enter__(), self.step)
        self.calls.append(call)
        return call

    def exit(self, call: Call) -> None:
        self.step += 1
        call.waiter.__exit__(None, None, None)
        call.left = self.step
        self.expire()

    def send(self, call: Call, number: int | None = None) -> None:
        number = next(self.numbers) if number is None else number
        sending = Sending(number, call, self.now, self.now + LINGER)
        self.wire.append(sending)
        self.sendings.append(sending)
        call.sends += 1
        call.nudged = False
        call.waiter.listen(call.hear)
        call.waiter.sent()

    def send_fenced(self, call: Call) -> None:
        """Sends as the link does: behind something else, if replies of the key are owed."""
        if self.pending.owed(call.key, but=call.waiter) is not None:
            for key in FENCES:
                if self.pending.owed(key) is None:
                    fence = self.enter(key, lambda _: None)
                    self.send(fence)
                    self.exit(fence)
                    break

        self.send(call)

    def expire(self) -> None:
        """Loses the replies that are too late to count on."""
        self.wire = [sending for sending in self.wire if sending.until > self.now or sending.call.listens]
        self.aside = {key: sending for key, sending in self.aside.items() if sending.at + LINGER > self.now}

    def resolve(self, reply: Reply, owner: Call | None) -> None:
        """Gives a reply to Pending, and judges who got it."""
        before = {call: len(call.values) for call in self.calls}
        taken = self.pending.resolve(reply)
        got = [call for call in self.calls if len(call.values) > before[call]]
        assert len(got) <= taken
        if taken:
            self.taken_at = self.now

        if owner and owner.waits and not got:
            owner.robbed = True

        for call in got:
            assert call.values == [reply.number]
            assert owner is not None
            assert (call.key, call.waiter.echo) == (reply.key, reply.echo)
            assert owner.left is None or call.began < owner.left, "a late reply answered a later request"

    @rule(key=st.sampled_from(sorted(ADDRESSES)), which=WHICH, repeatable=st.sampled_from([True, True, False]))
    def call(self, key: str, which: int, repeatable: bool) -> None:
        if any(call.key == key for call in self.present()):
            return  # one of each key has its turn

        echo = ADDRESSES[key][which % len(ADDRESSES[key])]
        self.send_fenced(self.enter(key, of(echo), echo=echo, repeatable=repeatable))

    @rule()
    def call_urgently(self) -> None:
        """Goes ahead of others of its key, and behind no fence."""
        self.send(self.enter(URGENT, take, repeatable=True))

    @rule()
    def post(self) -> None:
        """Is told from others by the content of its reply."""
        number = next(self.numbers)
        self.send(self.enter(POSTED, only(number), tombstone=False), number)

    @precondition(lambda self: any(call.waiter.repeatable for call in self.waiting()))
    @rule(which=WHICH)
    def send_again(self, which: int) -> None:
        self.send_fenced(pick([call for call in self.waiting() if call.waiter.repeatable], which))

    @precondition(lambda self: self.wire)
    @rule(lost=st.integers(0, 3))
    def reply(self, lost: int) -> None:
        """The next reply comes; some before it are lost."""
        del self.wire[: min(lost, len(self.wire) - 1)]
        sending = self.wire.pop(0)
        late = self.now - sending.at
        for other in self.wire if sending.call.waiter.tombstone else []:
            other.until = max(other.until, min(other.at + 2 * late, self.now + LINGER))

        self.resolve(sending.reply, sending.call)
        self.expire()

    @precondition(lambda self: self.wire)
    @rule(which=WHICH)
    def lose(self, which: int) -> None:
        self.wire.remove(pick(self.wire, which))

    def may_straggle(self) -> list[Sending]:
        return [
            sending
            for sending in self.wire
            if sending.call.key in ADDRESSES and sending.at >= self.straggled.get(sending.call.key, 0.0) + LINGER
        ]

    @precondition(lambda self: bool(self.may_straggle()))
    @rule(which=WHICH)
    def put_aside(self, which: int) -> None:
        sending = pick(self.may_straggle(), which)
        self.wire.remove(sending)
        self.aside[sending.call.key] = sending
        self.straggled[sending.call.key] = sending.at
        self.expire()

    def may_come(self) -> list[str]:
        """Whose straggler may come: behind all that was asked before its request.

        Not between the reply that was swallowed in its place and the one that the call behind it then waits for:
        either of two replies may be the straggler.
        """
        robbed = {call.key for call in self.waiting() if call.robbed}
        overtaken = min((sending.number for sending in self.wire), default=math.inf)
        return sorted(key for key, sending in self.aside.items() if key not in robbed and sending.number < overtaken)

    @precondition(lambda self: bool(self.may_come()))
    @rule(which=WHICH)
    def straggler(self, which: int) -> None:
        sending = self.aside.pop(pick(self.may_come(), which))
        self.resolve(sending.reply, sending.call)
        self.expire()

    @rule(key=st.sampled_from(["pose", "alarms", "nobody's"]))
    def reply_that_does_not_fit(self, key: str) -> None:
        self.resolve(Reply(key, MISFIT), None)
        assert not self.pending.resolve(Reply(key, MISFIT))

    @precondition(lambda self: bool(self.present()))
    @rule(which=WHICH)
    def leave(self, which: int) -> None:
        """A call returns, times out, or is cancelled."""
        self.exit(pick(self.present(), which))

    @rule(seconds=st.sampled_from([0.01, 0.1, 0.5, 1.5, LINGER, 2 * LINGER]))
    def wait(self, seconds: float) -> None:
        self.now += seconds
        self.expire()

    @precondition(lambda self: bool(self.waiting()))
    @rule()
    def link_ends(self) -> None:
        error = ConnectionLost("gone")
        listening = [call for call in self.calls if call.listens]
        self.pending.fail(error)
        assert all(call.values == [error] for call in listening)
        assert len(self.pending) == 0
        for call in self.present():
            self.exit(call)

        self.wire, self.aside = [], {}
        assert len(self.pending) == 0

    @invariant()
    def nobody_is_answered_twice(self) -> None:
        assert all(len(call.values) <= 1 for call in self.calls)

    @invariant()
    def memory_is_bounded(self) -> None:
        if self.now >= self.taken_at + LINGER:
            assert len(self.pending) <= sum(
                sending.call.listens or sending.at + LINGER > self.now for sending in self.sendings
            )

    def teardown(self) -> None:
        for call in self.present():
            self.exit(call)

        self.now += LINGER
        assert len(self.pending) == 0


StreamMachine.TestCase.settings = settings(max_examples=300, stateful_step_count=50, deadline=None)
TestStream = StreamMachine.TestCase


DISORDER, LATENCY = 0.02, 0.005
MOST = 0.999 * DISORDER  # what comes at the very end of it may pass for what comes behind it
PATIENCE = 2 * (LATENCY + DISORDER) + 0.01


class Net:
    """Datagrams: each arrives within the disorder, or is lost, and some arrive twice; the peer answers all it gets."""

    def __init__(self, random: Random, loss: float, dup: float) -> None:
        self.random, self.loss, self.dup = random, loss, dup
        self.loop = asyncio.get_running_loop()
        self.pending: Pending[Reply] = Pending(self.loop.time, disorder=lambda: DISORDER)
        self.numbers = count()
        self.flying = 0
        self.answered = 0

    def carry(self, arrive: Callable[[], None]) -> None:
        """Takes a message to the other side: at any time within the disorder, or twice, or never."""

        def land() -> None:
            self.flying -= 1
            arrive()

        if self.random.random() >= self.loss:
            for _ in range(1 + (self.random.random() < self.dup)):
                self.flying += 1
                delay = self.random.choice([0.0, MOST, self.random.uniform(0, MOST)])
                self.loop.call_later(LATENCY + delay, land)

    async def ask(self, waiter: Waiter[Reply], number: int, patience: float) -> Any:
        """Sends a request; returns what is heard, None if nothing."""
        answered = asyncio.Event()
        heard: list[Any] = []

        def hear(value: Any) -> None:
            heard.append(value)
            answered.set()

        def arrive() -> None:
            self.pending.resolve(Reply(waiter.key, number, waiter.echo))

        waiter.listen(hear)
        waiter.sent()
        self.carry(lambda: self.carry(arrive))
        with suppress(TimeoutError):
            async with asyncio.timeout(patience):
                await answered.wait()

        return heard[0] if heard else None

    async def until(self, when: float) -> None:
        await asyncio.sleep(when - self.loop.time())

    async def ready(self, waiter: Waiter[Reply]) -> None:
        """Waits as the link does: for what is owed, behind something else, and for second copies."""
        owed = self.pending.owed(waiter.key, but=waiter)
        if owed is not None:
            key = next((key for key in FENCES if self.pending.owed(key) is None), None)
            if key is not None:
                await self.until(self.pending.calm_at(key))
                await self.until(owed + DISORDER)
                with self.pending.expect(key, lambda _: None) as fence:
                    await self.ask(fence, next(self.numbers), PATIENCE)

                await asyncio.sleep(DISORDER)

        await self.until(self.pending.calm_at(waiter.key))

    async def call(self, key: str, echo: Hashable, timeout: float, *, repeatable: bool, lenient: bool) -> None:
        """One call; its answer must be the reply to one of its own requests."""
        mine: set[int] = set()
        deadline = self.loop.time() + timeout
        with self.pending.expect(key, of(echo), echo=echo, repeatable=repeatable, lenient=lenient) as waiter:
            while (left := deadline - self.loop.time()) > 0.001:
                await self.ready(waiter)
                number = next(self.numbers)
                mine.add(number)
                answer = await self.ask(waiter, number, min(left, PATIENCE) if repeatable else left)
                if answer is not None and answer is not SWALLOWED:
                    assert answer in mine, "a reply answered a call that had not asked for it"
                    self.answered += 1
                    break

    async def caller(self, key: str, calls: int) -> None:
        """Calls one after another; some are cancelled early, or come after a rest."""
        for _ in range(calls):
            await asyncio.sleep(self.random.choice([0, 0, 0.01, 0.1]))
            await self.call(
                key,
                self.random.choice(ADDRESSES[key]),
                self.random.choice([0.004, 0.02, 0.05, 0.3, 1.0]),
                repeatable=self.random.random() < 0.7,
                lenient=self.random.random() < 0.3,
            )


@given(st.integers(0), st.sampled_from([0.0, 0.1, 0.5]), st.sampled_from([0.0, 0.2, 1.0]))
@settings(max_examples=150)
def test_datagrams_that_overtake_and_are_doubled_answer_nobody_wrongly(seed: int, loss: float, dup: float) -> None:
    async def calls() -> None:
        net = Net(Random(seed), loss, dup)
        async with asyncio.TaskGroup() as group:
            for key in ADDRESSES:
                group.create_task(net.caller(key, 12))

        assert net.answered or loss
        await asyncio.sleep(2 * LINGER)
        assert net.flying == len(net.pending) == 0

    run_virtual(calls())


class Clock:
    """Seconds that pass when the test says so."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    """A clock at zero."""
    return Clock()


@pytest.fixture
def pending(clock: Clock) -> Pending[Reply]:
    """Nobody waits yet, on a stream."""
    return Pending(clock)


@pytest.fixture
def datagrams(clock: Clock) -> Pending[Reply]:
    """Nobody waits yet, on a link with a disorder of 10 ms."""
    return Pending(clock, disorder=lambda: 0.01)


def ask(
    pending: Pending[Reply], key: str = "pose", echo: Hashable = None, **options: bool
) -> tuple[Waiter[Reply], list[Any]]:
    """A waiter whose request was sent, and what it hears."""
    heard: list[Any] = []
    waiter = pending.expect(key, of(echo), echo=echo, **options).__enter__()
    waiter.listen(heard.append)
    waiter.sent()
    return waiter, heard


def abandon(pending: Pending[Reply], key: str = "pose", echo: Hashable = None) -> None:
    """A request was sent, and nobody waits for its reply any more."""
    ask(pending, key, echo)[0].__exit__()


def fence(pending: Pending[Reply]) -> None:
    """Something else is asked and answered."""
    abandon(pending, FENCES[0])
    assert pending.resolve(Reply(FENCES[0], 0))


def test_replies_reach_the_requests_of_a_key_in_order(pending: Pending[Reply]) -> None:
    calls = [ask(pending) for _ in range(3)]
    for number in range(3):
        assert pending.resolve(Reply("pose", number))

    assert [heard for _, heard in calls] == [[0], [1], [2]]


def test_a_reply_of_another_key_reaches_nobody(pending: Pending[Reply]) -> None:
    _, heard = ask(pending)
    assert not pending.resolve(Reply("alarms", 1))
    assert heard == []


def test_who_left_without_an_answer_swallows_one_reply(pending: Pending[Reply]) -> None:
    waiter, lost = ask(pending)
    waiter.__exit__()
    _, heard = ask(pending)
    assert pending.resolve(Reply("pose", 1))
    assert pending.resolve(Reply("pose", 2))
    assert (lost, heard) == ([], [2])


def test_who_left_before_its_request_was_sent_swallows_nothing(pending: Pending[Reply]) -> None:
    with pending.expect("pose", take):
        pass

    assert len(pending) == 0


def test_a_tombstone_is_forgotten_in_time(pending: Pending[Reply], clock: Clock) -> None:
    abandon(pending)
    clock.now = LINGER - 0.001
    assert (len(pending), pending.owed("pose")) == (1, 0.0)

    clock.now = LINGER
    assert pending.owed("pose") is None
    _, heard = ask(pending)
    assert pending.resolve(Reply("pose", 1))
    assert heard == [1]


def test_who_knows_its_reply_by_its_content_leaves_no_tombstone(pending: Pending[Reply]) -> None:
    waiter, _ = ask(pending, tombstone=False)
    waiter.__exit__()
    assert len(pending) == 0


def test_a_reply_that_does_not_fit_is_remembered_and_passed_on(pending: Pending[Reply]) -> None:
    waiter, heard = ask(pending)
    assert not pending.resolve(Reply("pose", MISFIT))
    assert str(waiter.misfit) == "misfit"
    assert pending.resolve(Reply("pose", 1))
    assert heard == [1]


def test_who_was_answered_takes_no_reply_from_the_next(pending: Pending[Reply]) -> None:
    (_, first), (_, second) = ask(pending), ask(pending)
    assert pending.resolve(Reply("pose", 1))
    assert pending.resolve(Reply("pose", 2))
    assert not pending.resolve(Reply("pose", 3))
    assert (first, second) == ([1], [2])


def test_a_swallowed_reply_nudges_who_waits_behind_it_and_may_repeat(pending: Pending[Reply]) -> None:
    _, ahead = ask(pending, repeatable=True)
    abandon(pending)
    (_, once), (waiter, again) = ask(pending), ask(pending, repeatable=True)
    pending.resolve(Reply("pose", 0))
    assert (ahead, again) == ([0], [])

    pending.resolve(Reply("pose", 1))
    assert (ahead, once, again) == ([0], [], [SWALLOWED])

    waiter.listen(again.append)
    pending.resolve(Reply("pose", 2))
    pending.resolve(Reply("pose", 3))
    assert (once, again) == ([2], [SWALLOWED, 3])


def test_who_knows_its_reply_by_its_content_is_passed_by_a_reply_of_another(pending: Pending[Reply]) -> None:
    heard: list[Any] = []
    with pending.expect("pose", only(7), tombstone=False) as waiter:
        waiter.listen(heard.append)
        waiter.sent()
        assert not pending.resolve(Reply("pose", 6))
        assert pending.resolve(Reply("pose", 7))

    assert heard == [7]


def test_replies_that_are_late_together_as_after_a_pause_are_all_swallowed(
    pending: Pending[Reply], clock: Clock
) -> None:
    waiter, heard = ask(pending, repeatable=True)
    for _ in range(4):
        clock.now += 0.25
        waiter.sent()

    clock.now += 4.0  # longer than any reply is remembered that nobody has heard of
    pending.resolve(Reply("pose", 0))
    waiter.__exit__()
    _, later = ask(pending)
    for number in range(1, 5):
        assert pending.resolve(Reply("pose", number))

    pending.resolve(Reply("pose", 5))
    assert (heard, later) == ([0], [5])


@pytest.mark.parametrize(("pause", "until"), [(1.0, 3.0), (2.0, 4.0), (2.5, 5.0), (6.0, 9.0)])
def test_after_a_pause_what_was_sent_is_awaited_for_twice_as_long(
    pending: Pending[Reply], clock: Clock, pause: float, until: float
) -> None:
    ask(pending)
    other = ask(pending, "alarms")[0]
    clock.now = pause
    assert pending.resolve(Reply("pose", 0))
    other.__exit__()
    clock.now = until - 0.001
    assert len(pending) == 1
    clock.now = until
    assert len(pending) == 0


def test_what_is_owed_may_yet_straggle_behind_the_answer_to_a_later_request(
    pending: Pending[Reply], clock: Clock
) -> None:
    waiter, _ = ask(pending)
    clock.now = 0.5
    waiter.sent()
    waiter.sent()
    waiter.__exit__()
    assert (len(pending), pending.owed("pose")) == (3, 0.5)

    fence(pending)
    assert (len(pending), pending.owed("pose")) == (3, None)

    clock.now = LINGER
    assert len(pending) == 2
    clock.now = 0.5 + LINGER - 0.001
    assert len(pending) == 2
    clock.now = 0.5 + LINGER
    assert len(pending) == 0


def test_with_disorder_only_the_last_one_is_known_if_it_straggles(datagrams: Pending[Reply], clock: Clock) -> None:
    for _ in range(3):
        abandon(datagrams)

    clock.now = 0.01
    fence(datagrams)
    clock.now = 0.02
    assert len(datagrams) == 1


def test_the_answer_to_an_earlier_request_ends_nothing(pending: Pending[Reply]) -> None:
    abandon(pending, FENCES[0])
    for _ in range(3):
        abandon(pending)

    pending.resolve(Reply(FENCES[0], 0))
    assert (len(pending), pending.owed("pose")) == (3, 0.0)


def test_what_somebody_waits_for_is_not_lost_for_being_passed(pending: Pending[Reply], clock: Clock) -> None:
    _, heard = ask(pending)
    fence(pending)
    clock.now = 2 * LINGER
    assert pending.resolve(Reply("pose", 1))
    assert heard == [1]


def test_what_a_call_itself_is_owed_need_not_be_fenced(pending: Pending[Reply], clock: Clock) -> None:
    abandon(pending)
    clock.now = 1.0
    waiter, _ = ask(pending)
    assert (pending.owed("pose"), pending.owed("pose", but=waiter)) == (1.0, 0.0)

    fence(pending)
    assert (pending.owed("pose"), pending.owed("alarms")) == (None, None)


def test_the_peer_is_not_asked_again_who_has_just_answered(pending: Pending[Reply]) -> None:
    _, heard = ask(pending)
    pending.resolve(Reply("pose", 1))
    assert (heard, pending.owed("pose"), len(pending)) == ([1], None, 0)


@pytest.mark.parametrize(("late", "taken"), [(LINGER - 0.001, []), (LINGER, [1])])
def test_a_straggler_is_recognised_for_linger(
    pending: Pending[Reply], clock: Clock, late: float, taken: list[int]
) -> None:
    abandon(pending)
    fence(pending)
    clock.now = late
    _, later = ask(pending)
    assert pending.resolve(Reply("pose", 1))
    assert later == taken


def test_each_straggler_is_recognised_for_its_own_time(pending: Pending[Reply], clock: Clock) -> None:
    abandon(pending)
    clock.now = 1.4
    abandon(pending)
    fence(pending)
    clock.now = 1.5
    assert pending.resolve(Reply("pose", 0))
    clock.now = 1.4 + LINGER - 0.001
    assert len(pending) == 1
    clock.now = 1.4 + LINGER
    assert len(pending) == 0


def test_who_succeeds_a_straggler_may_be_followed_by_it(pending: Pending[Reply], clock: Clock) -> None:
    abandon(pending)
    fence(pending)
    clock.now = 1.0
    waiter, heard = ask(pending, repeatable=True)
    pending.resolve(Reply("pose", 1))
    assert heard == [SWALLOWED]

    waiter.listen(heard.append)
    waiter.sent()
    pending.resolve(Reply("pose", 2))
    waiter.__exit__()
    assert heard == [SWALLOWED, 2]
    assert len(pending) == 1  # either the straggler or nothing: which was the first is not known

    fence(pending)
    clock.now = LINGER - 0.001
    assert len(pending) == 1
    clock.now = LINGER  # the straggler's time, not that of the request in whose place it may come
    assert len(pending) == 0


def test_a_reply_in_its_turn_leaves_no_straggler_behind(pending: Pending[Reply], clock: Clock) -> None:
    abandon(pending)
    waiter, _ = ask(pending)
    pending.resolve(Reply("pose", 0))
    pending.resolve(Reply("pose", 1))
    waiter.__exit__()
    assert len(pending) == 0


def test_who_is_told_by_an_address_is_swallowed_only_for_its_own(pending: Pending[Reply]) -> None:
    abandon(pending, "io", 1)
    fence(pending)
    (_, second), (_, first) = ask(pending, "io", 2), ask(pending, "io", 1)
    pending.resolve(Reply("io", 10, echo=2))
    assert (second, first) == ([10], [])

    pending.resolve(Reply("io", 11, echo=1))
    assert first == []
    pending.resolve(Reply("io", 12, echo=1))
    assert first == [12]


def test_each_address_keeps_a_straggler_of_its_own(datagrams: Pending[Reply], clock: Clock) -> None:
    for address in (1, 2, 1, 2):
        abandon(datagrams, "io", address)

    clock.now = 0.01
    fence(datagrams)
    clock.now = 0.02
    assert len(datagrams) == 2
    assert datagrams.resolve(Reply("io", 0, echo=2))
    assert len(datagrams) == 1


def test_who_is_lenient_is_answered_past_a_straggler_but_not_past_what_is_owed(pending: Pending[Reply]) -> None:
    abandon(pending)
    waiter, heard = ask(pending, lenient=True)
    pending.resolve(Reply("pose", 0))
    assert heard == []

    waiter.__exit__()
    fence(pending)
    assert len(pending) == 1
    _, heard = ask(pending, lenient=True)
    pending.resolve(Reply("pose", 1))
    assert heard == [1]
    _, strict = ask(pending)
    pending.resolve(Reply("pose", 2))
    assert strict == []


def test_a_second_copy_answers_nobody_until_it_is_calm(datagrams: Pending[Reply], clock: Clock) -> None:
    assert datagrams.calm_at("pose") == -math.inf
    clock.now = 1.0
    _, first = ask(datagrams)
    datagrams.resolve(Reply("pose", 1))
    assert (first, datagrams.calm_at("pose"), datagrams.calm_at("alarms")) == ([1], 1.02, -math.inf)

    _, second = ask(datagrams)
    clock.now = 1.019
    assert not datagrams.resolve(Reply("pose", 1))
    assert (second, datagrams.calm_at("pose")) == ([], 1.02)

    clock.now = 1.02
    datagrams.resolve(Reply("pose", 2))
    assert second == [2]


def test_a_stream_is_always_calm(pending: Pending[Reply], clock: Clock) -> None:
    ask(pending)
    pending.resolve(Reply("pose", 1))
    assert pending.calm_at("pose") <= clock.now


def test_with_disorder_nothing_is_passed_by_what_was_sent_or_answered_too_soon_after(
    datagrams: Pending[Reply], clock: Clock
) -> None:
    abandon(datagrams)
    clock.now = 0.009
    fence(datagrams)
    clock.now = 1.0
    assert datagrams.owed("pose") == 0.0

    fence(datagrams)
    clock.now = 1.009
    assert datagrams.owed("pose") == 0.0
    clock.now = 1.011
    assert datagrams.owed("pose") is None


def other(pending: Pending[Reply]) -> str | None:
    """What the link may ask beside a question."""
    return next((key for key in MANY_FENCES if not pending.line(key)), None)


def client(pending: Pending[Reply], clock: Clock, lost: Callable[[], bool], timeout: float) -> int | None:
    """One call as the link makes it, on a wire without delay; returns how often it sent, None if in vain."""
    sends = 0

    def send(waiter: Waiter[Reply], deliver: Callable[[Any], None], *, proof: bool = False) -> None:
        nonlocal sends
        sends += 1
        waiter.listen(deliver)
        waiter.sent()
        if proof:
            waiter.hold()

        if not lost():
            pending.resolve(Reply(str(waiter.key), sends))

    def ask_other(key: str, deliver: Callable[[Any], None]) -> None:
        with pending.expect(key, lambda _: None) as waiter:
            send(waiter, deliver)

    deadline = clock.now + timeout
    with pending.expect("pose", take, repeatable=True) as waiter:
        while clock.now < deadline:
            if (fence := other(pending)) and pending.owed("pose", but=waiter) is not None:
                ask_other(fence, lambda _: None)

            heard: list[Any] = []
            witness = other(pending) if pending.haunted(waiter) else None
            send(waiter, heard.append, proof=witness is not None)
            if witness:
                ask_other(witness, waiter.prove)

            waiter.give_up()
            if heard and heard[0] is not SWALLOWED:
                return sends

            if not heard:
                clock.now += 0.1

    return None


@given(st.integers(0, 100), st.floats(0.1, 2.0))
@settings(max_examples=50)
def test_after_any_outage_who_keeps_asking_is_soon_answered(outage: int, timeout: float) -> None:
    clock = Clock()
    pending: Pending[Reply] = Pending(clock)
    fates = iter([True] * outage)
    while next(fates, None):
        client(pending, clock, lambda: next(fates, False), timeout)

    sends = [client(pending, clock, lambda: False, 1.0) for _ in range(20)]
    assert None not in sends
    clock.now += LINGER
    assert client(pending, clock, lambda: False, timeout) == 1


@pytest.mark.parametrize("every", [3, 5, 7, 13])
def test_steady_loss_costs_each_call_some_requests_not_ever_more(
    pending: Pending[Reply], clock: Clock, every: int
) -> None:
    number = count(1)
    sends = [client(pending, clock, lambda: next(number) % every == 0, 10.0) or math.inf for _ in range(600)]
    assert max(sends) < 200
    assert sum(sends[300:]) < 1.2 * sum(sends[:300]) < 1.2 * 300 * 12


def test_the_end_of_the_link_reaches_everybody_once(pending: Pending[Reply]) -> None:
    calls = [ask(pending) for _ in range(3)]
    pending.resolve(Reply("pose", 1))
    error = ConnectionLost("gone")
    pending.fail(error)
    pending.fail(ConnectionLost("again"))
    for waiter, _ in calls:
        waiter.__exit__()

    assert [heard for _, heard in calls] == [[1], [error], [error]]
    assert len(pending) == 0


def haunted(pending: Pending[Reply], clock: Clock) -> tuple[Waiter[Reply], list[Any]]:
    """A call that holds its replies back, because one of before may come late and alone."""
    abandon(pending)
    clock.now = 0.6
    fence(pending)
    waiter, heard = ask(pending, repeatable=True)
    assert pending.haunted(waiter)
    waiter.hold()
    return waiter, heard


def test_a_single_reply_by_the_time_that_something_behind_it_is_answered_is_the_right_one(
    pending: Pending[Reply], clock: Clock
) -> None:
    waiter, heard = haunted(pending, clock)
    assert pending.resolve(Reply("pose", 1))
    assert heard == []
    waiter.prove()
    assert heard == [1]
    assert len(pending) == 1, "the straggler may still come"


def test_of_two_replies_none_is_taken_and_the_question_is_asked_again(pending: Pending[Reply], clock: Clock) -> None:
    waiter, heard = haunted(pending, clock)
    pending.resolve(Reply("pose", 1))
    pending.resolve(Reply("pose", 0))
    waiter.prove()
    assert heard == [SWALLOWED]
    assert len(pending) == 0, "the straggler has come"


def test_no_reply_by_then_was_lost(pending: Pending[Reply], clock: Clock) -> None:
    waiter, heard = haunted(pending, clock)
    waiter.prove()
    assert heard == [SWALLOWED]


def test_without_proof_in_time_what_came_counts_for_what_was_asked_first(pending: Pending[Reply], clock: Clock) -> None:
    waiter, heard = haunted(pending, clock)
    pending.resolve(Reply("pose", 1))
    waiter.give_up()
    assert heard == []
    assert pending.haunted(waiter), "it may have been the straggler, or not"


def test_who_leaves_while_replies_are_held_back_holds_back_nobody_elses(pending: Pending[Reply], clock: Clock) -> None:
    waiter, heard = haunted(pending, clock)
    pending.resolve(Reply("pose", 1))
    waiter.__exit__()
    assert len(pending) == 1
    pending.resolve(Reply("pose", 0))
    assert heard == []
    assert len(pending) == 0


def test_a_second_call_of_the_same_command_ends_the_proof_of_the_first(pending: Pending[Reply], clock: Clock) -> None:
    """Else the first would hold back the replies to the second, which would be asked again and again."""
    first, heard_first = haunted(pending, clock)
    pending.resolve(Reply("pose", 1))
    _, heard_second = ask(pending, repeatable=True)
    assert first.held is None
    pending.resolve(Reply("pose", 2))
    assert (heard_first, heard_second) == ([2], [])
    pending.resolve(Reply("pose", 3))
    assert heard_second == [3]
