"""Pending against a model of the wire: replies come in the order of their requests, or never, or late, or twice."""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass, field
from typing import Any

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from dobot_async.errors import ConnectionLost, ProtocolError
from dobot_async.pending import LINGER, SPREAD, Pending, Waiter

KEYS = ("pose", "alarms")
MISFIT = -1


@dataclass(frozen=True)
class Reply:
    """What comes back: the number of the sending that it answers."""

    key: str
    number: int


def take(reply: Reply) -> int:
    """The value of a reply that fits."""
    if reply.number == MISFIT:
        raise ProtocolError("misfit")

    return reply.number


@dataclass
class Call:
    """One request as the test sees it."""

    waiter: Waiter[Reply]
    key: str
    began: int
    sendings: list[int] = field(default_factory=list)
    values: list[Any] = field(default_factory=list)
    hurried: int = 0
    left: int | None = None
    guarded_until: float = math.inf

    def hurry(self) -> None:
        """A reply was swallowed that may have been this one's."""
        self.hurried += 1

    @property
    def waits(self) -> bool:
        """Whether it still waits for its first answer."""
        return self.left is None and not self.values


class PendingMachine(RuleBasedStateMachine):
    """Calls come and go; the wire of each key is a line of sendings that the arm has not answered yet."""

    def __init__(self) -> None:
        super().__init__()
        self.now = 100.0
        self.step = 0
        self.pending: Pending[Reply] = Pending(lambda: self.now)
        self.calls: list[Call] = []
        self.owner: dict[int, Call] = {}
        self.wire: dict[str, list[int]] = defaultdict(list)
        self.answered: list[Reply] = []
        self.doubled: set[str] = set()

    @initialize()
    def begin(self) -> None:
        assert len(self.pending) == 0

    def waiting(self) -> list[Call]:
        return [call for call in self.calls if call.waits]

    def send(self, call: Call) -> None:
        number = len(self.owner)
        self.owner[number] = call
        call.sendings.append(number)
        self.wire[call.key].append(number)
        call.waiter.listen(call.values.append)
        call.waiter.hurry = call.hurry
        call.waiter.sent()

    def resolve(self, reply: Reply) -> Call | None:
        """Gives a reply to Pending; returns who got it."""
        before = {id(call): len(call.values) for call in self.calls}
        taken = self.pending.resolve(reply)
        got = [call for call in self.calls if len(call.values) > before[id(call)]]
        assert len(got) <= 1
        assert taken or not got
        for call in got:
            assert call.left is None
            assert call.key == reply.key
            assert call.values == [reply.number]

        return got[0] if got else None

    @rule(key=st.sampled_from(KEYS))
    def call(self, key: str) -> None:
        self.step += 1
        call = Call(self.pending.expect(key, take), key, self.step)
        call.waiter.__enter__()
        self.calls.append(call)
        self.send(call)

    @precondition(lambda self: self.waiting())
    @rule(data=st.data())
    def send_again(self, data: st.DataObject) -> None:
        self.step += 1
        self.send(data.draw(st.sampled_from(self.waiting())))

    @precondition(lambda self: any(self.wire.values()))
    @rule(data=st.data())
    def reply(self, data: st.DataObject) -> None:
        """The next reply of a key comes; it belongs to the oldest sending that was not lost."""
        key = data.draw(st.sampled_from([key for key, line in self.wire.items() if line]))
        reply = Reply(key, self.wire[key].pop(0))
        self.answered.append(reply)
        owner = self.owner[reply.number]
        got = self.resolve(reply)
        if got in (None, owner) or key in self.doubled:
            return

        late = owner.left is not None and got.began > owner.left
        assert not late or self.now >= owner.guarded_until, "a late reply answered a later request"

    @precondition(lambda self: any(self.wire.values()))
    @rule(data=st.data())
    def lose(self, data: st.DataObject) -> None:
        key = data.draw(st.sampled_from([key for key, line in self.wire.items() if line]))
        self.wire[key].pop(0)

    @precondition(lambda self: self.answered)
    @rule(data=st.data())
    def reply_twice(self, data: st.DataObject) -> None:
        """The network doubles a reply: nothing is promised about whom it reaches, but nobody hears twice."""
        reply = data.draw(st.sampled_from(self.answered))
        self.doubled.add(reply.key)
        self.resolve(reply)

    @rule(key=st.sampled_from([*KEYS, "nobody's"]))
    def reply_that_does_not_fit(self, key: str) -> None:
        assert self.resolve(Reply(key, MISFIT)) is None
        assert not self.pending.resolve(Reply(key, MISFIT))

    @precondition(lambda self: any(call.left is None for call in self.calls))
    @rule(data=st.data())
    def leave(self, data: st.DataObject) -> None:
        """A call returns, times out, or is cancelled."""
        self.step += 1
        call = data.draw(st.sampled_from([call for call in self.calls if call.left is None]))
        call.waiter.__exit__(None, None, None)
        call.left = self.step
        assert call.waiter.quiet == 0 or call.values
        call.guarded_until = self.now + call.waiter.quiet if call.waiter.quiet else call.waiter.sent_at + LINGER

    @rule(seconds=st.sampled_from([0.01, SPREAD, 0.5, 1.5, LINGER]))
    def wait(self, seconds: float) -> None:
        self.now += seconds

    @precondition(lambda self: self.waiting())
    @rule()
    def link_ends(self) -> None:
        error = ConnectionLost("gone")
        waiting = self.waiting()
        self.pending.fail(error)
        assert all(call.values == [error] for call in waiting)
        assert len(self.pending) == 0
        self.wire.clear()
        for call in self.calls:
            if call.left is None:
                call.waiter.__exit__(None, None, None)
                assert call.waiter.quiet == 0
                call.left, call.guarded_until = self.step, self.now

    @invariant()
    def nobody_is_answered_twice(self) -> None:
        assert all(len(call.values) <= 1 for call in self.calls)

    @invariant()
    def memory_is_bounded(self) -> None:
        assert len(self.pending) <= len(
            [call for call in self.calls if call.left is None or call.guarded_until > self.now]
        )

    def teardown(self) -> None:
        for call in self.calls:
            if call.left is None:
                call.waiter.__exit__(None, None, None)

        self.now += LINGER
        assert len(self.pending) == 0
        assert not self.pending._lines


PendingMachine.TestCase.settings = settings(max_examples=150, stateful_step_count=40, deadline=None)
TestPending = PendingMachine.TestCase


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
    """Nobody waits yet."""
    return Pending(clock)


def ask(pending: Pending[Reply], *, tombstone: bool = True) -> tuple[Waiter[Reply], list[Any]]:
    """A waiter whose request was sent, and what it hears."""
    heard: list[Any] = []
    waiter = pending.expect("pose", take, tombstone=tombstone).__enter__()
    waiter.listen(heard.append)
    waiter.sent()
    return waiter, heard


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
    waiter, _ = ask(pending)
    waiter.__exit__()
    clock.now = LINGER - 0.001
    assert len(pending) == 1

    clock.now = LINGER
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


def test_a_swallowed_reply_hurries_the_next_who_waits(pending: Pending[Reply]) -> None:
    ask(pending)[0].__exit__()
    waiter, _ = ask(pending)
    calls: list[str] = []
    waiter.hurry = lambda: calls.append("hurry")
    pending.resolve(Reply("pose", 1))
    assert calls == ["hurry"]

    pending.resolve(Reply("pose", 2))
    assert calls == ["hurry"]


def test_who_was_answered_after_a_quick_repetition_asks_for_quiet(pending: Pending[Reply], clock: Clock) -> None:
    waiter, heard = ask(pending)
    clock.now += 0.05
    waiter.sent()
    pending.resolve(Reply("pose", 1))
    waiter.__exit__()
    assert heard == [1]
    assert waiter.quiet == pytest.approx(0.05 + SPREAD)
    assert pending.resolve(Reply("pose", 2))

    clock.now += waiter.quiet
    assert len(pending) == 0


def test_who_was_answered_after_a_slow_repetition_leaves_a_tombstone(pending: Pending[Reply], clock: Clock) -> None:
    waiter, _ = ask(pending)
    clock.now += 0.5
    waiter.sent()
    pending.resolve(Reply("pose", 1))
    waiter.__exit__()
    assert waiter.quiet == 0
    clock.now += LINGER - 0.001
    assert pending.resolve(Reply("pose", 2))
    assert len(pending) == 0


def test_who_missed_its_answer_leaves_a_tombstone(pending: Pending[Reply]) -> None:
    waiter, _ = ask(pending)
    pending.resolve(Reply("pose", 1))
    waiter.listen(lambda _: None)
    waiter.sent()
    waiter.__exit__()
    assert waiter.quiet == 0
    assert len(pending) == 1


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
