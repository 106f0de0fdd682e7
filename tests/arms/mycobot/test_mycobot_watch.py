"""When a motion counts as over: the decisions, without an arm."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.standstill import Goal, StandstillDetector, Verdict, cannot_read_servos, turned

GOAL = Goal(c.GET_ANGLES, {0: 10.0}, [2.0])
STEP = 0.05
Told = tuple[float, bool]


def verdicts(tell: Callable[[float], Told], seconds: float, goal: Goal = GOAL) -> list[tuple[float, Verdict]]:
    """What is made of an arm that tells its angle and its moving flag at each time."""
    watch, found = StandstillDetector(goal, 0.0), []
    for number in range(round(seconds / STEP)):
        now = number * STEP
        angle, moving = tell(now)
        found.append((now, watch.look(now, [angle, 0.0], moving=moving)))
        if found[-1][1] is not Verdict.GOING:
            break

    return found


def last(tell: Callable[[float], Told], seconds: float = 10.0) -> tuple[float, Verdict]:
    return verdicts(tell, seconds)[-1]


def test_it_arrives_once_it_stands_there() -> None:
    now, verdict = last(lambda now: (min(10 * now, 10), now < 1))
    assert verdict is Verdict.ARRIVED
    assert 1.0 <= now <= 1.3


def test_one_still_look_on_the_way_is_no_arrival() -> None:
    assert last(lambda now: (10.0, abs(now - 0.5) > 0.01 and now < 1))[0] > 1.0


def test_the_end_of_a_fast_motion_is_believed_at_the_first_still_look() -> None:
    now, verdict = last(lambda now: (min(40 * now, 10), now < 0.25))
    assert verdict is Verdict.ARRIVED
    assert now == pytest.approx(0.3), "0.25 is the first look at which it is there, and 0.3 the one that is the same"


def test_a_fast_arm_that_is_there_needs_its_flag_alone() -> None:
    watch = StandstillDetector(GOAL, 0.0)
    for now, angle, settled in ((0.0, 0.0, False), (0.1, 6.0, False), (0.2, 9.5, False), (0.25, 9.6, True)):
        watch.look(now, [angle], moving=True)
        assert watch.settled is settled

    watch.look(0.3, [5.0], moving=True)
    assert not watch.settled


def test_a_creeping_arm_has_to_stand_still_twice() -> None:
    creep = verdicts(lambda now: (9 + now, abs(now - 0.5) > 0.01 and now < 1), 10)
    assert creep[-1][0] > 1.0, "one look without its flag, on its way and near its goal, is not believed"


def test_the_end_is_expected_where_its_speed_leads() -> None:
    watch = StandstillDetector(GOAL, 0.0)
    for now, angle in ((0.0, 0.0), (0.1, 2.0), (0.2, 4.0)):
        watch.look(now, [angle], moving=True)

    assert watch.ends_at == pytest.approx(0.5)
    watch.look(0.3, [3.0], moving=True)
    assert math.isinf(watch.ends_at), "it goes away from it"


def test_it_need_not_move_to_be_there() -> None:
    now, verdict = last(lambda _: (10.5, False))
    assert verdict is Verdict.ARRIVED
    assert now <= 0.2


def test_an_arm_that_never_moves_is_idle() -> None:
    now, verdict = last(lambda _: (0.0, False))
    assert verdict is Verdict.IDLE
    assert 1.4 <= now <= 1.7


def test_an_arm_that_comes_to_rest_elsewhere_falls_short() -> None:
    now, verdict = last(lambda now: (min(5 * now, 5), now < 1))
    assert verdict is Verdict.SHORT
    assert 1.9 <= now <= 2.3


def test_a_slow_arm_whose_flag_says_nothing_is_waited_for() -> None:
    assert last(lambda now: (min(1.5 * now, 10), False), 20)[1] is Verdict.ARRIVED


def test_a_flag_that_is_stuck_is_not_believed_for_ever() -> None:
    now, verdict = last(lambda now: (min(10 * now, 10), True))
    assert verdict is Verdict.ARRIVED
    assert 2.5 <= now <= 3.5
    assert last(lambda now: (min(5 * now, 5), True))[1] is Verdict.SHORT


def test_an_arm_that_begins_late_is_waited_for() -> None:
    assert last(lambda now: (min(max(0.0, 10 * (now - 1.2)), 10), 1.2 < now < 2.2))[1] is Verdict.ARRIVED


def test_a_pause_starts_all_clocks_anew() -> None:
    watch = StandstillDetector(GOAL, 0.0)
    watch.look(0.0, [0.0], moving=False)
    watch.hold(5.0)
    assert watch.look(5.0, [0.0], moving=False) is Verdict.GOING
    assert watch.look(6.0, [0.0], moving=False) is Verdict.GOING
    assert watch.look(6.6, [0.0], moving=False) is Verdict.IDLE


@given(st.lists(st.floats(-170, 170), min_size=1, max_size=60))
def test_no_reading_makes_an_arm_arrive_that_is_not_there(angles: list[float]) -> None:
    watch = StandstillDetector(GOAL, 0.0)
    found = [watch.look(number * STEP, [angle], moving=False) for number, angle in enumerate(angles)]
    for place, verdict in enumerate(found):
        if verdict is Verdict.ARRIVED:
            assert all(abs(angle - 10) <= 2.5 for angle in angles[place - 1 : place + 1])
            break


def test_the_same_turn_in_other_angles_is_no_miss() -> None:
    whole = dict(enumerate((100.0, 0.0, 200.0, 180.0, 0.0, -90.0)))
    goal = Goal(c.GET_COORDS, whole, (5, 5, 5, 2), rotation=True)
    assert not goal.missed((101, 1, 199, -180, 0, -90))
    assert not goal.missed((100, 0, 200, 0, 180, 90))
    assert goal.missed((100, 0, 200, 180, 0, -80)) == pytest.approx(10)
    assert goal.missed((110, 0, 200, 180, 0, -90)) == pytest.approx(10)
    one = Goal(c.GET_COORDS, {3: 179.5}, (5, 5, 5, 2), round=frozenset({3, 4, 5}))
    assert not one.missed((0, 0, 0, -179.5, 0, 0))


@given(st.tuples(*[st.floats(-180, 180)] * 3))
def test_nothing_is_turned_against_itself(angles: tuple[float, ...]) -> None:
    assert turned(angles, angles) == pytest.approx(0, abs=1e-4)
    assert turned(angles, (angles[0] + 360, angles[1], angles[2])) == pytest.approx(0, abs=1e-4)


def test_the_angles_of_lost_servos() -> None:
    assert cannot_read_servos((180.08, -180.08, 180.08))
    assert not cannot_read_servos((180.08, 0.0, 180.08))
    assert not cannot_read_servos((180.0,) * 6)
    assert math.isclose(-18008 / 100, -180.08)
