"""The reply timeout: RFC 6298's arithmetic, its bounds, and how it grows and comes back."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dobot_async._core.link.round_trip import GRAIN, INITIAL, RoundTrip

FLOOR, CEILING = 0.02, 0.5
seconds = st.floats(0, 10)


def measured(*samples: float) -> RoundTrip:
    """An estimate after some round trips."""
    trip = RoundTrip(FLOOR, CEILING)
    for sample in samples:
        trip.sample(sample)

    return trip


def test_before_the_first_sample_the_timeout_is_the_initial_one() -> None:
    trip = RoundTrip()
    assert trip.smoothed is None
    assert trip.timeout == INITIAL


@given(st.floats(0.001, 5), st.floats(1, 10), st.lists(seconds, max_size=5))
def test_it_is_never_below_the_floor_nor_above_the_ceiling(floor: float, factor: float, samples: list[float]) -> None:
    trip = RoundTrip(floor, floor * factor)
    assert floor <= trip.timeout <= floor * factor
    for sample in samples:
        trip.sample(sample)
        trip.unanswered()
        assert floor <= trip.timeout <= floor * factor


def test_the_first_sample_counts_three_times() -> None:
    trip = measured(0.04)
    assert trip.smoothed == 0.04
    assert trip.timeout == pytest.approx(0.04 + 4 * 0.04 / 2)


def test_later_samples_weigh_an_eighth_and_their_deviation_a_quarter() -> None:
    trip = measured(0.04, 0.08)
    variation = 0.02 + (0.04 - 0.02) / 4  # of the estimate before this sample
    assert trip.smoothed == pytest.approx(0.045)
    assert trip.timeout == pytest.approx(0.045 + 4 * variation)


def test_a_standstill_counts_as_no_more_than_the_ceiling() -> None:
    assert measured(1e6).timeout == measured(CEILING).timeout
    assert measured(0.04, 1e6).smoothed == measured(0.04, CEILING).smoothed


def test_however_even_the_round_trips_are_a_grain_is_added() -> None:
    assert measured(*[0.04] * 100).timeout == pytest.approx(0.04 + GRAIN)


def test_floor_and_ceiling_bound_the_timeout() -> None:
    assert measured(0.001).timeout == FLOOR
    assert measured(5.0).timeout == CEILING


@pytest.mark.parametrize(("floor", "ceiling"), [(0.0, 1.0), (-1.0, 1.0), (2.0, 1.0)])
def test_bounds_that_bound_nothing_are_refused(floor: float, ceiling: float) -> None:
    with pytest.raises(ValueError, match="floor <= ceiling"):
        RoundTrip(floor, ceiling)


def test_each_timeout_that_passes_makes_the_next_a_quarter_longer() -> None:
    trip = RoundTrip()
    for times in range(5):
        assert trip.timeout == pytest.approx(INITIAL * 1.25**times)
        trip.unanswered()


def test_a_sample_takes_back_all_growth() -> None:
    trip = measured(0.04)
    for _ in range(5):
        trip.unanswered()

    trip.sample(0.04)
    assert trip.timeout == measured(0.04, 0.04).timeout


def test_a_long_outage_makes_it_four_times_as_long_and_no_longer() -> None:
    trip = RoundTrip()
    for _ in range(1000):
        trip.unanswered()

    assert trip.timeout == 4 * INITIAL
    trip.sample(0.01)
    assert trip.timeout < INITIAL


@given(st.floats(0.03, 0.4), st.floats(0.002, 0.02))
def test_a_link_that_becomes_slower_is_measured_with_the_first_answer(slow: float, fast: float) -> None:
    """As the link does it: a question is sent once, and every answer is a sample, however many timeouts have passed."""
    trip = measured(*[fast] * 20)
    for _ in range(20):
        waited = 0.0
        while waited + trip.timeout < slow:
            waited += trip.timeout
            trip.unanswered()

        trip.sample(slow)

    assert trip.timeout >= slow


@given(st.lists(st.one_of(seconds, st.just("unanswered"))))
def test_the_timeout_stays_within_its_bounds(history: list[float | str]) -> None:
    trip = RoundTrip(FLOOR, CEILING)
    for event in history:
        before = trip.timeout
        if isinstance(event, float):
            trip.sample(event)
        else:
            trip.unanswered()
            assert trip.timeout >= before

        assert FLOOR <= trip.timeout <= CEILING


@given(st.lists(seconds, min_size=1))
def test_the_average_lies_among_its_samples(samples: list[float]) -> None:
    smoothed = measured(*samples).smoothed
    assert smoothed is not None
    assert min(*samples, CEILING) - 1e-9 <= smoothed <= max(samples) + 1e-9


@given(st.floats(0.001, 0.4), seconds)
def test_an_even_link_is_learned_whatever_the_first_sample_was(even: float, first: float) -> None:
    assert measured(first, *[even] * 200).timeout == pytest.approx(min(max(even + GRAIN, FLOOR), CEILING), abs=1e-3)
