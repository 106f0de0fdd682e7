"""Frames, shapes and ways: what is computed before anything is sent."""

from __future__ import annotations

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dobot_async import Kinematics, PTPMode, Unreachable
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.kinematics import Joints
from dobot_async.arms.magician.paths import STEP, Lift, Way, way_of
from dobot_async.fleet import BaseFrame, Box, Cylinder

Four = tuple[float, float, float, float]
ARM = Kinematics()
START = ARM.inverse(200, 0, 50, 0)
LIFTS = [Lift(20, 20, 100)]
numbers = st.floats(-500, 500)
degrees = st.floats(-720, 720)


def way(value: object, start: Joints = START, lifts: list[Lift] = LIFTS) -> Way:
    found = way_of(value, start, ARM, lifts)
    assert found
    return found


def ptp(mode: PTPMode, *values: float) -> c.PTPCmd:
    return c.PTPCmd(mode, *values)


four = st.tuples(numbers, numbers, numbers, degrees)


@given(four, four)
def test_frames_there_and_back(stands: Four, place: Four) -> None:
    base = BaseFrame(*stands)
    assert base.to_arm(*base.to_cell(*place)) == pytest.approx(place, abs=1e-6)
    assert base.to_cell(*base.to_arm(*place)) == pytest.approx(place, abs=1e-6)


def test_a_frame_that_faces_left() -> None:
    assert BaseFrame(100, 0, 10, 90).to_cell(200, 0, 40, 5) == pytest.approx((100, 200, 50, 95))


def test_a_frame_is_finite() -> None:
    with pytest.raises(ValueError, match="finite"):
        BaseFrame(math.nan)


def test_shapes() -> None:
    box = Box(x=(0, 10), y=(-5, 5))
    assert box.contains(10, 5, 1e9)
    assert not box.contains(10.1, 5, 0)
    assert box.contains(10.1, 5, 0, margin=0.2)
    cylinder = Cylinder(10, 10, 5, z=(0, 10))
    assert cylinder.contains(13, 14, 0)
    assert not cylinder.contains(14, 14, 0)
    assert cylinder.contains(14, 14, -1, margin=1)
    for wrong in (lambda: Box(x=(1, 1)), lambda: Cylinder(0, 0, 0), lambda: Cylinder(0, 0, 1, z=(2, 1))):
        with pytest.raises(ValueError, match=r"."):
            wrong()


@pytest.mark.parametrize(
    "value",
    [
        ptp(PTPMode.MOVL_XYZ, 250, 80, 20, 10),
        ptp(PTPMode.MOVJ_XYZ, 250, 80, 20, 10),
        ptp(PTPMode.JUMP_XYZ, 250, 80, 20, 10),
        ptp(PTPMode.JUMP_MOVL_XYZ, 250, 80, 20, 10),
        ptp(PTPMode.MOVL_INC, 50, 80, -30, 10),
        ptp(PTPMode.MOVJ_XYZ_INC, 50, 80, -30, 10),
        ptp(PTPMode.MOVJ_ANGLE, *ARM.inverse(250, 80, 20, 10)),
        ptp(PTPMode.MOVL_ANGLE, *ARM.inverse(250, 80, 20, 10)),
        ptp(PTPMode.JUMP_ANGLE, *ARM.inverse(250, 80, 20, 10)),
        ptp(PTPMode.MOVJ_INC, *(b - a for a, b in zip(START, ARM.inverse(250, 80, 20, 10), strict=True))),
        c.PTPPOCmd(PTPMode.MOVL_XYZ, 250, 80, 20, 10, ()),
        c.ARCCmd(c.ARCPoint(220, 60, 60, 0), c.ARCPoint(250, 80, 20, 10)),
        c.CPCmd(c.CPMode.ABSOLUTE, 250, 80, 20),
        c.CPLECmd(c.CPMode.RELATIVE, 50, 80, -30, 0),
    ],
)
def test_a_way_goes_from_here_to_there_in_small_steps(value: object) -> None:
    places = way(value).places
    assert places[0] == pytest.approx((200, 0, 50), abs=1e-6)
    assert places[-1] == pytest.approx((250, 80, 20), abs=1e-6)
    assert ARM.forward(*way(value).end)[:3] == pytest.approx((250, 80, 20), abs=1e-6)
    assert max(math.dist(a, b) for a, b in itertools.pairwise(places)) <= STEP + 1e-9


@given(st.floats(160, 290), st.floats(-140, 140), st.floats(-20, 100))
def test_the_steps_of_the_joints_are_small_everywhere(x: float, y: float, z: float) -> None:
    try:
        places = way(ptp(PTPMode.MOVJ_XYZ, x, y, z, 0)).places
    except Unreachable:
        return

    assert max(math.dist(a, b) for a, b in itertools.pairwise(places)) <= STEP + 1e-9


def test_a_jump_goes_over_and_not_above_the_ceiling() -> None:
    assert max(z for _, _, z in way(ptp(PTPMode.JUMP_MOVL_XYZ, 250, 80, 20, 0)).places) == pytest.approx(70)
    low = [Lift(20, 20, 60)]
    assert max(z for _, _, z in way(ptp(PTPMode.JUMP_MOVL_XYZ, 250, 80, 20, 0), lifts=low).places) == pytest.approx(60)
    both = way(ptp(PTPMode.JUMP_MOVL_XYZ, 250, 80, 20, 0), lifts=[*low, *LIFTS]).places
    assert {60.0, 70.0} <= {round(z, 6) for _, _, z in both}


def test_a_joint_motion_swings_out_where_a_line_does_not() -> None:
    start = ARM.inverse(0, 250, 50, 0)
    assert max(math.hypot(x, y) for x, y, _ in way(ptp(PTPMode.MOVJ_XYZ, 250, 0, 50, 0), start).places) > 249.9
    assert min(math.hypot(x, y) for x, y, _ in way(ptp(PTPMode.MOVL_XYZ, 250, 0, 50, 0), start).places) < 177


def test_a_circle_comes_back() -> None:
    found = way(c.CircleCmd(c.ARCPoint(220, 20, 50), c.ARCPoint(240, 0, 50), 3))
    assert found.places[0] == pytest.approx(found.places[-1])
    assert {round(math.dist(place, (220, 0, 50)), 6) for place in found.places} == {20.0}
    assert found.end == START


@pytest.mark.parametrize(
    "value",
    [
        c.HOMECmd(),
        c.PTPWithLCmd(PTPMode.MOVL_XYZ, 250, 0, 50, 0, 100),
        c.ARCCmd(c.ARCPoint(210, 0, 50), c.ARCPoint(220, 0, 50)),
    ],
)
def test_some_ways_are_not_known(value: object) -> None:
    assert way_of(value, START, ARM, LIFTS) is None


def test_a_way_out_of_reach() -> None:
    with pytest.raises(Unreachable):
        way(ptp(PTPMode.MOVL_XYZ, 500, 0, 50, 0))
