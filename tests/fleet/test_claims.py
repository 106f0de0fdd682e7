"""Zones are exclusive, fair and never wait for ever: any parties, any order of requests and releases."""

from __future__ import annotations

from collections.abc import Iterable

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from dobot_async import DobotError, MotionStopped
from dobot_async.fleet import ZoneDeadlock, ZoneOccupied
from dobot_async.fleet.claims import Claim, Claims, Party, Pause

ZONES = "ABC"


class Asked(Claim):
    """A claim that keeps its answer."""

    __slots__ = ("told",)

    def __init__(self, party: Party, zones: Iterable[str], *others: Party, patient: bool = True) -> None:
        self.told: list[DobotError | None] = []
        super().__init__(party, frozenset([party, *others]), frozenset(zones), self.told.append, patient)

    @property
    def granted(self) -> bool:
        return self.told == [None]


def ask(claims: Claims, party: Party, zones: str, *others: Party, patient: bool = True) -> Asked:
    claim = Asked(party, zones, *others, patient=patient)
    claims.request(claim)
    return claim


class Machine(RuleBasedStateMachine):
    """Five parties, each of which waits for one claim at a time, and may hold any number."""

    def __init__(self) -> None:
        super().__init__()
        self.claims = Claims()
        self.parties = [Party(f"p{number}") for number in range(5)]
        self.asked: list[Asked] = []

    def waiting(self, party: Party) -> bool:
        return any(claim.party is party and not claim.told for claim in self.asked)

    def ready(self) -> list[Party]:
        return [party for party in self.parties if not self.waiting(party)]

    @precondition(lambda self: self.ready())
    @rule(data=st.data(), zones=st.sets(st.sampled_from(ZONES), min_size=1), patient=st.integers(0, 9))
    def request(self, data: st.DataObject, zones: set[str], patient: int) -> None:
        party = data.draw(st.sampled_from(self.ready()))
        before = [claim for claim in self.asked if not claim.told]
        claim = Asked(party, zones, patient=patient > 0)
        self.asked.append(claim)
        self.claims.request(claim)
        if claim.granted:
            # Whoever was before it, and still waits for the same, waits for this party.
            for earlier in before:
                if not earlier.told and earlier.zones & claim.zones:
                    assert party in self.reached(earlier)

    @precondition(lambda self: any(claim.granted for claim in self.asked))
    @rule(data=st.data())
    def release(self, data: st.DataObject) -> None:
        held = [claim for claim in self.asked if claim.granted and not self.waiting(claim.party)]
        if held:
            claim = data.draw(st.sampled_from(held))
            self.asked.remove(claim)
            self.claims.release(claim)

    @precondition(lambda self: any(not claim.told for claim in self.asked))
    @rule(data=st.data())
    def give_up(self, data: st.DataObject) -> None:
        claim = data.draw(st.sampled_from([claim for claim in self.asked if not claim.told]))
        self.asked.remove(claim)
        self.claims.release(claim)

    def holders(self, zones: Iterable[str]) -> set[Party]:
        return {claim.party for claim in self.asked if claim.granted and claim.zones & set(zones)}

    def reached(self, claim: Asked) -> set[Party]:
        """Whom a claim waits for, directly or not."""
        found: set[Party] = set()
        todo = [claim]
        while todo:
            each = todo.pop()
            index = self.asked.index(each)
            ahead = {other.party for other in self.asked[:index] if not other.told and other.zones & each.zones}
            new = ((self.holders(each.zones) | ahead) - {each.party}) - found
            found |= new
            todo += [other for other in self.asked if not other.told and other.party in new]

        return found

    @invariant()
    def each_zone_has_one_holder(self) -> None:
        for zone in ZONES:
            assert len(self.holders(zone)) <= 1
            assert set(self.claims.holders(zone)) == self.holders(zone)

    @invariant()
    def each_is_answered_once(self) -> None:
        assert all(len(claim.told) <= 1 for claim in self.asked)

    @invariant()
    def somebody_can_always_go_on(self) -> None:
        """Who waits, waits in the end for a party that does not wait: never for itself alone."""
        for claim in self.asked:
            if not claim.told:
                assert any(not self.waiting(party) for party in self.reached(claim)), "a deadlock that nobody was told"

    @invariant()
    def nothing_is_left_lying(self) -> None:
        """What is free, and wanted by nobody before, is granted."""
        ahead: set[str] = set()
        for claim in self.asked:
            if not claim.told:
                assert self.holders(claim.zones) - {claim.party} or claim.zones & ahead
                ahead |= claim.zones

    @invariant()
    def only_deadlocks_and_impatience_are_refused(self) -> None:
        for claim in self.asked:
            if claim.told and claim.told[0] is not None:
                assert isinstance(claim.told[0], ZoneOccupied if not claim.patient else ZoneDeadlock | ZoneOccupied)


Machine.TestCase.settings = settings(max_examples=150, stateful_step_count=40, deadline=None)
test_any_program_of_claims = Machine.TestCase


LEFT, RIGHT, MIDDLE = Party("left"), Party("right"), Party("middle")


def test_a_cycle_names_its_parties_and_zones() -> None:
    claims = Claims()
    ask(claims, LEFT, "A")
    ask(claims, RIGHT, "B")
    ask(claims, MIDDLE, "C")
    first, second = ask(claims, LEFT, "B"), ask(claims, RIGHT, "C")
    last = ask(claims, MIDDLE, "A")
    assert not first.told
    assert not second.told
    assert isinstance(last.told[0], ZoneDeadlock)
    for words in ("middle waits for zone A, which left holds", "left waits for zone B", "right waits for zone C"):
        assert words in str(last.told[0])


def test_first_come_first_served() -> None:
    claims = Claims()
    held = ask(claims, LEFT, "A")
    first, second = ask(claims, RIGHT, "AB"), ask(claims, MIDDLE, "B")
    assert not second.told, "B is free, but right was before"
    claims.release(held)
    assert first.granted
    assert not second.told
    claims.release(first)
    assert second.granted


def test_who_is_waited_for_may_pass() -> None:
    claims = Claims()
    ask(claims, LEFT, "A")
    right = ask(claims, RIGHT, "AB")
    assert ask(claims, LEFT, "B").granted, "right waits for left anyway"
    assert not right.told


def test_an_impatient_claim_is_refused_at_once() -> None:
    claims = Claims()
    ask(claims, LEFT, "A")
    refused = ask(claims, RIGHT, "AB", patient=False)
    with pytest.raises(ZoneOccupied, match="right may not pass: left holds zone A"):
        raise refused.told[0] or AssertionError

    assert not claims.holders("B")


def test_a_party_acts_for_others() -> None:
    claims = Claims()
    ask(claims, LEFT, "A")
    assert ask(claims, MIDDLE, "A", LEFT).granted
    assert not ask(claims, RIGHT, "A", LEFT).told, "middle has it as well"


def test_a_holder_that_has_failed_is_not_waited_for() -> None:
    claims = Claims()
    broken = Party("broken")
    ask(claims, broken, "A")
    waiting = ask(claims, LEFT, "A")
    broken.failure = MotionStopped("an alarm")
    claims.settle()
    for claim in (waiting, ask(claims, RIGHT, "A")):
        assert isinstance(claim.told[0], ZoneOccupied)
        assert "an alarm" in str(claim.told[0])


def test_who_is_in_a_zone_beside_another_may_move_out() -> None:
    claims = Claims()
    for party in (LEFT, RIGHT):
        claims.take(Claim(party, frozenset([party]), frozenset("A")))

    assert claims.holders("A") == [LEFT, RIGHT]
    assert ask(claims, LEFT, "AB").granted
    assert not ask(claims, MIDDLE, "A").told


def test_parts_are_released() -> None:
    claims = Claims()
    both = ask(claims, LEFT, "AB")
    waiting = ask(claims, RIGHT, "A")
    claims.keep([both], frozenset("B"))
    assert waiting.granted
    assert claims.holders("B") == [LEFT]


def test_what_a_party_leaves_with_several_claims_it_leaves_at_once() -> None:
    moving = True
    arm = Party("arm", moving=lambda: moving)
    claims = Claims()
    held = [ask(claims, arm, "A"), ask(claims, arm, "A")]
    ask(claims, RIGHT, "B")
    own, other = ask(claims, arm, "B"), ask(claims, RIGHT, "A")
    moving = False
    claims.keep(held, frozenset())
    assert other.granted
    assert not own.told


def test_an_arm_that_moves_may_leave_a_zone_by_itself() -> None:
    moving = True
    arm = Party("arm", moving=lambda: moving)
    claims = Claims()
    for party, zone in ((arm, "A"), (RIGHT, "B")):
        ask(claims, party, zone)

    own, other = ask(claims, arm, "B"), ask(claims, RIGHT, "A")
    assert not own.told
    assert not other.told
    moving = False
    claims.settle()
    assert isinstance(other.told[0], ZoneDeadlock)
    assert not own.told


def test_a_claim_passes_one_that_waits_at_a_barrier_for_who_asks() -> None:
    claims = Claims()
    ask(claims, LEFT, "A")
    earlier = ask(claims, MIDDLE, "AB")
    with claims.pausing(Pause("at a barrier for", LEFT, frozenset([LEFT]), lambda: [RIGHT])):
        assert ask(claims, RIGHT, "B").granted
        assert not earlier.told


def test_waiting_can_be_ended() -> None:
    claims = Claims()
    ask(claims, LEFT, "A")
    acting, own = ask(claims, MIDDLE, "A", RIGHT), ask(claims, RIGHT, "A")
    error = MotionStopped("enough")
    claims.interrupt(RIGHT, error)
    assert own.told == [error]
    assert not acting.told
    claims.fail([RIGHT], error)
    assert acting.told == [error]
