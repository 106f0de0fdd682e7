"""Placements and upright boxes."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dobot_async.simulator.scene.geometry import Placement, Solid

LENGTH = st.floats(-1000, 1000)
PLACEMENT = st.builds(Placement, LENGTH, LENGTH, LENGTH, st.floats(-360, 360))
CUBE = Solid(Placement(100, 0, 0), (20, 20, 20))


@given(PLACEMENT, PLACEMENT)
def test_what_is_located_from_a_place_is_found_from_it_again(here: Placement, there: Placement) -> None:
    assert here.then(here.locate(there)) == pytest.approx(there, abs=1e-6)


@given(PLACEMENT, PLACEMENT, PLACEMENT)
def test_placements_can_be_put_together_in_any_order(a: Placement, b: Placement, c: Placement) -> None:
    assert a.then(b).then(c) == pytest.approx(a.then(b.then(c)), abs=1e-6)


def test_to_the_left_is_where_a_positive_angle_turns() -> None:
    assert Placement(yaw=90).then(Placement(10, 0, 5)) == pytest.approx(Placement(0, 10, 5, 90))


@pytest.mark.parametrize(
    ("start", "end", "entered"),
    [
        ((0, 0, 10), (200, 0, 10), True),  # through it, however long the step is
        ((0, 0, 10), (89, 0, 10), False),  # up to it
        ((0, 0, 10), (95, 0, 10), True),
        ((100, 0, 50), (100, 0, 20), False),  # onto it
        ((100, 0, 50), (100, 0, 18), False),  # pressed in no more than it gives
        ((100, 0, 50), (100, 0, 16), True),
        ((100, 0, 16), (100, 0, 15), True),  # deeper
        ((100, 0, 15), (100, 0, 16), False),  # out again
        ((100, 0, 15), (100, 0, 100), False),
        ((0, 30, 10), (200, 30, 10), False),  # beside it
        ((90, 0, 10), (90, 20, 10), False),  # along a face
    ],
)
def test_what_runs_into_a_box(start: tuple[float, ...], end: tuple[float, ...], entered: bool) -> None:
    assert CUBE.is_entered(start, end, give=3.0) is entered  # type: ignore[arg-type]


@given(st.floats(0, 360), st.floats(15, 500))
def test_a_line_through_the_middle_meets_a_box_from_any_side(angle: float, distance: float) -> None:
    x, y = distance * math.cos(math.radians(angle)), distance * math.sin(math.radians(angle))
    share = CUBE.is_crossed((100 + x, y, 10), (100 - x, -y, 10))
    assert share is not None
    met = distance * (1 - 2 * share)  # from the middle
    assert 9.8 <= met <= 10 * math.sqrt(2)


def test_a_turned_box_covers_what_is_turned_with_it() -> None:
    beam = Solid(Placement(0, 0, 0, 45), (100, 2, 2))
    assert beam.covers(30, 30)
    assert not beam.covers(30, -30)
