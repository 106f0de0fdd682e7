"""Pending against a model of the wire: replies come in the order of their requests, or never, or late, or twice."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import count
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from dobot_async.errors import ConnectionLost, ProtocolError
from dobot_async.pending import LEAST_SILENCE, LINGER, SWALLOWED, Pending, Waiter

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
    nudged: bool = False
    left: int | None = None
    last_sent: float = 0.0

    def hear(self, value: Any) -> None:
        """A reply, an error, or that a reply was swallowed that may have been this one's."""
        if value is SWALLOWED:
            assert self.waiter.repeatable
            self.nudged = True
        else:
            self.values.append(value)

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
        self.sent: dict[int, float] = {}
        self.wire: dict[str, list[int]] = defaultdict(list)
        self.answered: list[Reply] = []
        self.disordered: set[str] = set()

    @initialize()
    def begin(self) -> None:
        assert len(self.pending) == 0

    def waiting(self) -> list[Call]:
        return [call for call in self.calls if call.waits]

    def send(self, call: Call) -> None:
        number = len(self.owner)
        self.owner[number] = call
        call.sendings.append(number)
        self.sent[number] = call.last_sent = self.now
        self.wire[call.key].append(number)
        call.nudged = False
        call.waiter.listen(call.hear)
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

        for call in self.calls:
            if call.nudged:
                self.send(call)

        return got[0] if got else None

    @rule(key=st.sampled_from(KEYS), repeatable=st.booleans())
    def call(self, key: str, repeatable: bool) -> None:
        self.step += 1
        call = Call(self.pending.expect(key, take, repeatable=repeatable), key, self.step)
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
        late = self.now - self.sent[reply.number]
        abandoned = owner.left is not None and not owner.values
        if late >= LINGER or (owner.values and late >= 2 * LEAST_SILENCE):
            self.disordered.add(key)  # it may have been forgotten; then it is taken for one that is still owed

        got = self.resolve(reply)
        if got and abandoned and key not in self.disordered:
            assert got.began < (owner.left or 0), "a late reply answered a later request"

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
        self.disordered.add(reply.key)
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

    @rule(seconds=st.sampled_from([0.01, LEAST_SILENCE, 0.5, 1.5, LINGER]))
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
                call.left = self.step

        assert len(self.pending) == 0

    @invariant()
    def nobody_is_answered_twice(self) -> None:
        assert all(len(call.values) <= 1 for call in self.calls)

    @invariant()
    def memory_is_bounded(self) -> None:
        owed = [call for call in self.calls if call.left is None or call.values or call.last_sent + LINGER > self.now]
        assert len(self.pending) <= len(owed)

    def teardown(self) -> None:
        for call in self.calls:
            if call.left is None:
                call.waiter.__exit__(None, None, None)

        self.now += 2 * (self.now + LINGER)
        assert len(self.pending) == 0


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


def only(number: int) -> Callable[[Reply], int]:
    """Accepts the reply with one number."""

    def accept(reply: Reply) -> int:
        if reply.number != number:
            raise ProtocolError("another")

        return number

    return accept


def ask(
    pending: Pending[Reply], *, tombstone: bool = True, repeatable: bool = False
) -> tuple[Waiter[Reply], list[Any]]:
    """A waiter whose request was sent, and what it hears."""
    heard: list[Any] = []
    waiter = pending.expect("pose", take, repeatable=repeatable, tombstone=tombstone).__enter__()
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


def test_a_swallowed_reply_nudges_who_waits_behind_it_and_may_repeat(pending: Pending[Reply]) -> None:
    _, ahead = ask(pending, repeatable=True)
    ask(pending)[0].__exit__()
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


@pytest.mark.parametrize(("late", "taken"), [(LINGER - 0.001, []), (LINGER, [1])])
def test_one_reply_may_be_late_by_linger_although_the_call_was_answered(
    pending: Pending[Reply], clock: Clock, late: float, taken: list[int]
) -> None:
    waiter, heard = ask(pending)
    clock.now = 0.05
    waiter.sent()
    pending.resolve(Reply("pose", 0))
    waiter.__exit__()
    clock.now = 0.05 + late
    _, later = ask(pending)
    pending.resolve(Reply("pose", 1))
    assert (heard, later) == ([0], taken)


def test_of_several_replies_owed_to_an_answered_call_one_is_remembered_long(
    pending: Pending[Reply], clock: Clock
) -> None:
    waiter, _ = ask(pending)
    waiter.sent()
    waiter.sent()
    pending.resolve(Reply("pose", 0))
    waiter.__exit__()
    assert len(waiter.owed) == 2

    clock.now = 2 * LEAST_SILENCE
    assert len(pending) == 1
    assert waiter.owed == [LINGER]


def test_of_a_burst_all_are_swallowed_whoever_takes_the_first(pending: Pending[Reply], clock: Clock) -> None:
    ask(pending)[0].__exit__()
    waiter, heard = ask(pending)
    waiter.sent()
    waiter.sent()
    clock.now = 2.5
    assert [pending.resolve(Reply("alarms", 0)), pending.resolve(Reply("pose", 0))] == [False, True]
    pending.resolve(Reply("pose", 1))
    waiter.__exit__()
    _, later = ask(pending)
    for number in (2, 3, 4):
        pending.resolve(Reply("pose", number))

    assert (heard, later) == ([1], [4])


def test_the_silence_before_a_request_is_not_the_peers(pending: Pending[Reply], clock: Clock) -> None:
    clock.now = 3600.0
    waiter, _ = ask(pending)
    waiter.sent()
    waiter.sent()
    pending.resolve(Reply("pose", 0))
    waiter.__exit__()
    clock.now += LINGER
    assert len(pending) == 0


def client(pending: Pending[Reply], clock: Clock, lost: Callable[[], bool], timeout: float) -> int | None:
    """One call as the link makes it, on a wire without delay; returns how often it sent, None if in vain."""
    deadline = clock.now + timeout
    with pending.expect("pose", take, repeatable=True) as waiter:
        for sends in count(1):
            heard: list[Any] = []
            waiter.listen(heard.append)
            waiter.sent()
            if not lost():
                pending.resolve(Reply("pose", sends))

            if heard and heard[0] is not SWALLOWED:
                return sends

            if not heard:
                clock.now += 0.1
                if clock.now >= deadline:
                    break

    return None


@given(st.integers(0, 200), st.floats(0.1, 2.0))
def test_after_any_outage_who_keeps_asking_is_soon_answered(outage: int, timeout: float) -> None:
    clock = Clock()
    pending: Pending[Reply] = Pending(clock)
    fates = iter([True] * outage)
    sends = None
    while next(fates, None):
        client(pending, clock, lambda: next(fates, False), timeout)

    while sends is None:
        sends = client(pending, clock, lambda: False, timeout)

    assert sends <= LINGER / 0.1 + 2
    assert max(client(pending, clock, lambda: False, timeout) or 99 for _ in range(20)) <= LINGER / 0.1 + 2
    clock.now += LINGER
    assert client(pending, clock, lambda: False, timeout) == 1


@pytest.mark.parametrize("every", [2, 3, 5])
def test_steady_loss_costs_each_call_some_requests_not_ever_more(
    pending: Pending[Reply], clock: Clock, every: int
) -> None:
    number = count(1)
    sends = [client(pending, clock, lambda: next(number) % every == 0, 10.0) for _ in range(300)]
    assert None not in sends
    assert max(filter(None, sends)) <= 8


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
