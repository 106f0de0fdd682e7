"""Who gets a zone, who passes whom, and who is told that it would wait for ever; `test_waits.py` takes any order."""

from __future__ import annotations

from collections.abc import Iterable

import pytest

from dobot_async import DobotError, MotionStopped
from dobot_async.fleet import ZoneDeadlock, ZoneOccupied
from dobot_async.fleet.zone_locks import ProgramWait, ZoneHolder, ZoneLocks, ZoneRequest


class Asked(ZoneRequest):
    """A claim that keeps its answer."""

    __slots__ = ("told",)

    def __init__(self, holder: ZoneHolder, zones: Iterable[str], *others: ZoneHolder, patient: bool = True) -> None:
        self.told: list[DobotError | None] = []
        super().__init__(holder, frozenset([holder, *others]), frozenset(zones), self.told.append, patient)

    @property
    def granted(self) -> bool:
        return self.told == [None]


def ask(claims: ZoneLocks, holder: ZoneHolder, zones: str, *others: ZoneHolder, patient: bool = True) -> Asked:
    claim = Asked(holder, zones, *others, patient=patient)
    claims.request(claim)
    return claim


LEFT, RIGHT, MIDDLE = ZoneHolder("left"), ZoneHolder("right"), ZoneHolder("middle")


def test_a_cycle_names_its_parties_and_zones() -> None:
    claims = ZoneLocks()
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
    claims = ZoneLocks()
    held = ask(claims, LEFT, "A")
    first, second = ask(claims, RIGHT, "AB"), ask(claims, MIDDLE, "B")
    assert not second.told, "B is free, but right was before"
    claims.release(held)
    assert first.granted
    assert not second.told
    claims.release(first)
    assert second.granted


def test_who_is_waited_for_may_pass() -> None:
    claims = ZoneLocks()
    ask(claims, LEFT, "A")
    right = ask(claims, RIGHT, "AB")
    assert ask(claims, LEFT, "B").granted, "right waits for left anyway"
    assert not right.told


def test_an_impatient_claim_is_refused_at_once() -> None:
    claims = ZoneLocks()
    ask(claims, LEFT, "A")
    refused = ask(claims, RIGHT, "AB", patient=False)
    with pytest.raises(ZoneOccupied, match="right may not pass: left holds zone A"):
        raise refused.told[0] or AssertionError

    assert not claims.holders("B")


def test_a_party_acts_for_others() -> None:
    claims = ZoneLocks()
    ask(claims, LEFT, "A")
    assert ask(claims, MIDDLE, "A", LEFT).granted
    assert not ask(claims, RIGHT, "A", LEFT).told, "middle has it as well"


def test_a_holder_that_has_failed_is_not_waited_for() -> None:
    claims = ZoneLocks()
    broken = ZoneHolder("broken")
    ask(claims, broken, "A")
    waiting = ask(claims, LEFT, "A")
    broken.failure = MotionStopped("an alarm")
    claims.settle()
    for claim in (waiting, ask(claims, RIGHT, "A")):
        assert isinstance(claim.told[0], ZoneOccupied)
        assert "an alarm" in str(claim.told[0])


def test_who_only_may_be_in_a_zone_beside_another_waits() -> None:
    claims, left = ZoneLocks(), ZoneHolder("left")
    for holder in (left, RIGHT):
        claims.take(ZoneRequest(holder, frozenset([holder]), frozenset("A")))

    assert not ask(claims, left, "A").told


def test_who_is_in_a_zone_beside_another_may_move_out() -> None:
    claims, left = ZoneLocks(), ZoneHolder("left", inside=frozenset("A"))
    for holder in (left, RIGHT):
        claims.take(ZoneRequest(holder, frozenset([holder]), frozenset("A")))

    assert claims.holders("A") == [left, RIGHT]
    assert ask(claims, left, "AB").granted
    assert not ask(claims, MIDDLE, "A").told


def test_parts_are_released() -> None:
    claims = ZoneLocks()
    both = ask(claims, LEFT, "AB")
    waiting = ask(claims, RIGHT, "A")
    claims.keep([both], frozenset("B"))
    assert waiting.granted
    assert claims.holders("B") == [LEFT]


def test_what_a_party_leaves_with_several_claims_it_leaves_at_once() -> None:
    moving = True
    arm = ZoneHolder("arm", moving=lambda: moving)
    claims = ZoneLocks()
    held = [ask(claims, arm, "A"), ask(claims, arm, "A")]
    ask(claims, RIGHT, "B")
    own, other = ask(claims, arm, "B"), ask(claims, RIGHT, "A")
    moving = False
    claims.keep(held, frozenset())
    assert other.granted
    assert not own.told


def test_an_arm_that_moves_may_leave_a_zone_by_itself() -> None:
    moving = True
    arm = ZoneHolder("arm", moving=lambda: moving)
    claims = ZoneLocks()
    for holder, zone in ((arm, "A"), (RIGHT, "B")):
        ask(claims, holder, zone)

    own, other = ask(claims, arm, "B"), ask(claims, RIGHT, "A")
    assert not own.told
    assert not other.told
    moving = False
    claims.settle()
    assert isinstance(other.told[0], ZoneDeadlock)
    assert not own.told


def test_a_claim_passes_one_that_waits_at_a_barrier_for_who_asks() -> None:
    claims = ZoneLocks()
    ask(claims, LEFT, "A")
    earlier = ask(claims, MIDDLE, "AB")
    with claims.pausing(ProgramWait("at a barrier for", LEFT, frozenset([LEFT]), lambda: [RIGHT])):
        assert ask(claims, RIGHT, "B").granted
        assert not earlier.told


def test_waiting_can_be_ended() -> None:
    claims = ZoneLocks()
    ask(claims, LEFT, "A")
    acting, own = ask(claims, MIDDLE, "A", RIGHT), ask(claims, RIGHT, "A")
    error = MotionStopped("enough")
    claims.interrupt(RIGHT, error)
    assert own.told == [error]
    assert not acting.told
    claims.fail([RIGHT], error)
    assert acting.told == [error]
