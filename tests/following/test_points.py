"""What lies between two places, and what a target says."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dobot_async.following.points import TargetPoint, apart, nearer_than, part_of_way, read_point, turns_back, way_along
from dobot_async.following.trajectory import Trajectory

AXES = ("x", "y", "z", "rx", "ry", "rz")
numbers = st.floats(-500, 500)
angles = st.floats(-180, 180)
places = st.builds(
    lambda xyz, turned: TargetPoint((*xyz, *turned)), st.tuples(*[numbers] * 3), st.tuples(*[angles] * 3)
)
joints = st.builds(lambda each: TargetPoint(each, joints=True), st.tuples(*[angles] * 6))
steps = st.floats(0.1, 50)


@dataclass
class Pose:
    x: float = 1
    y: float = 2
    z: float = 3
    rx: float = 4
    ry: float = 5
    rz: float = 6
    joints: tuple[float, ...] = (10, 20, 30, 40, 50, 60)


@given(places, places, steps, steps)
def test_a_step_is_no_longer_than_it_may_be_and_leads_there(
    start: TargetPoint, end: TargetPoint, mm: float, degrees: float
) -> None:
    step = part_of_way(start, end, mm, degrees, turns=True)
    length, turn = way_along(start, step, turns=True)
    assert length <= mm + 1e-6
    assert turn <= degrees + 1e-6
    before, after = way_along(start, end, turns=True), way_along(step, end, turns=True)
    assert after[0] <= before[0] + 1e-6
    assert after[1] <= before[1] + 1e-6
    assert step == end or length >= mm - 1e-6 or turn >= degrees - 1e-6
    assert all(-180 <= angle <= 180 for angle in step.numbers[3:])


@given(joints, joints, steps)
def test_a_step_in_joints_knows_degrees_alone(start: TargetPoint, end: TargetPoint, degrees: float) -> None:
    step = part_of_way(start, end, 0.0, degrees)
    assert step.joints
    assert way_along(start, step)[0] == 0
    assert way_along(start, step)[1] <= degrees + 1e-6


def test_angles_go_the_short_way_round() -> None:
    start, end = TargetPoint((0, 0, 0, 0, 0, 175)), TargetPoint((0, 0, 0, 0, 0, -175))
    assert way_along(start, end, turns=True) == pytest.approx((0, 10))
    assert part_of_way(start, end, 1, 7, turns=True).numbers[5] == pytest.approx(-178)
    assert way_along(start, end)[1] == 350  # of an arm whose angles are not the same after a turn


def test_what_is_near_and_what_is_behind() -> None:
    here, sent = TargetPoint((0.0, 0.0, 0.0, 0.0)), TargetPoint((10.0, 0.0, 0.0, 0.0))
    assert nearer_than(here, TargetPoint((0.3, 0.4, 0.0, 0.5)), (0.5, 0.5))
    assert not nearer_than(here, TargetPoint((0.3, 0.4, 0.1, 0.5)), (0.5, 0.5))
    assert not nearer_than(here, TargetPoint((0.0, 0.0, 0.0, 0.6)), (0.5, 0.5))
    assert apart(here, TargetPoint((3.0, 4.0, 0.0, 12.0))) == 13
    assert turns_back(here, sent, TargetPoint((-1.0, 5.0, 0.0, 0.0)))
    assert not turns_back(here, sent, TargetPoint((1.0, 50.0, 0.0, 0.0)))


@pytest.mark.parametrize(
    ("target", "as_joints", "expected"),
    [
        (Pose(), False, (1, 2, 3, 4, 5, 6)),
        (Pose(), True, (10, 20, 30, 40, 50, 60)),
        ((7, 8, 9), False, (7, 8, 9, 0.1, 0.2, 0.3)),
        ([7, 8, 9, 1], False, (7, 8, 9, 1, 0.2, 0.3)),
        ((1, 2, 3, 4, 5, 6), True, (1, 2, 3, 4, 5, 6)),
    ],
)
def test_a_target_is_a_pose_or_numbers(target: Any, as_joints: bool, expected: tuple[float, ...]) -> None:
    here = TargetPoint((0, 0, 0, 0.1, 0.2, 0.3))
    assert read_point(target, AXES, 6, here, as_joints=as_joints) == TargetPoint(expected, as_joints)


@pytest.mark.parametrize(
    ("target", "as_joints", "error", "words"),
    [
        ((1, 2), False, ValueError, "the first three at least"),
        ((1, 2, 3, 4, 5, 6, 7), False, ValueError, "target must have x, y"),
        ((1, 2, math.nan), False, ValueError, "z of the target must be finite"),
        ((1, 2, "3"), False, TypeError, "z must be a number"),
        ("123", False, TypeError, "target must be a pose"),
        (5, False, TypeError, "target must be a pose"),
        ((1, 2, 3, 4, 5), True, ValueError, "target must have j1, j2"),
        ((1, 2, 3, 4, 5, math.inf), True, ValueError, "j6 of the target"),
    ],
)
def test_what_is_no_target_is_told(target: Any, as_joints: bool, error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words):
        read_point(target, AXES, 6, TargetPoint((0.0,) * 6), as_joints=as_joints)


def test_angles_that_nothing_tells_have_to_be_given() -> None:
    with pytest.raises(ValueError, match="give all of x, y"):
        read_point((1, 2, 3), AXES, 6, TargetPoint((0.0,) * 6, joints=True))


def trajectory(*points: tuple[float, Any], mm: float = 100.0, degrees: float = 90.0) -> Trajectory:
    here = TargetPoint((0.0,) * 6)
    read = partial(read_point, axes=AXES, joints=6, here=here)
    return Trajectory(points, read, lambda start, end: None, mm=mm, degrees=degrees, turns=True)


def test_a_trajectory_goes_straight_from_point_to_point_in_time() -> None:
    way = trajectory((5, (0, 0, 0)), (6, (10, 0, 0)), (8, (10, 20, 0)))
    assert way.seconds == 3
    assert [way.at(seconds).numbers[:2] for seconds in (0, 0.5, 1, 2, 3, 9)] == [
        (0, 0),
        (5, 0),
        (10, 0),
        (10, 10),
        (10, 20),
        (10, 20),
    ]


@pytest.mark.parametrize(
    ("points", "words"),
    [
        ([], "a point at least"),
        ([(0, (0, 0, 0)), (0, (1, 0, 0))], r"point 1 .* its time, 0 s, is not later"),
        ([(0, (0, 0, 0)), (1, (1, 0))], r"point 1 .* the first three"),
        ([(-1, (0, 0, 0))], r"point 0 .* the time must be 0 or more"),
        ([(0, (0, 0, 0)), (1, (50, 0, 0)), (2, (250, 0, 0))], r"point 2 .* 200 mm/s .* 100 are allowed"),
        ([(0, (0, 0, 0)), (1, (0, 0, 0, 120))], r"point 1 .* 120 degrees/s .* 90 are allowed"),
    ],
)
def test_a_trajectory_is_checked_as_a_whole(points: list[tuple[float, Any]], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        trajectory(*points)
