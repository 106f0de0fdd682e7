from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from quick_suite import examples

from dobot_async.arms.magician.kinematics import JointLimits, Kinematics, Unreachable
from dobot_async.simulator.device.curve import Arc, LineSegment, arc, circle
from dobot_async.simulator.device.device import Device
from dobot_async.simulator.device.path import Segment, curve_segment, joint_segment, jump, travel
from dobot_async.simulator.device.profile import Profile, SpeedLimits, shared, trapezoid
from dobot_async.simulator.device.work import Activity, DeviceFault, Vector, Work

JOINTS = SpeedLimits((200.0,) * 4, (400.0,) * 4)
TOOL = SpeedLimits((100.0, 200.0), (400.0, 800.0))
SLOW = SpeedLimits((10.0, 1e6), (1e9, 1e9))


@dataclass(frozen=True)
class Solver:
    """The Magician's kinematics as the simulator wants them."""

    kinematics: Kinematics = field(default_factory=Kinematics)

    def forward(self, joints: Vector) -> Vector:
        return self.kinematics.forward(*joints)

    def inverse(self, point: Vector) -> Vector:
        try:
            return self.kinematics.check(*point)
        except Unreachable as error:
            raise DeviceFault(error.alarm) from None


SOLVER = Solver()


def at(*point: float) -> Vector:
    return SOLVER.inverse(point)


def leg_to(*target: float, start: Vector, pace: SpeedLimits = TOOL) -> Segment:
    return curve_segment(LineSegment(SOLVER.forward(start), target), start, SOLVER, pace)


def code_of(attempt: Callable[[], object]) -> int:
    with pytest.raises(DeviceFault) as caught:
        attempt()

    return caught.value.code


# Profiles.

lengths, speeds = st.floats(1e-3, 1e4), st.floats(1e-2, 1e4)
profiles = st.builds(trapezoid, lengths, speeds, speeds, enter=st.floats(0, 1e4), leave=st.floats(0, 1e4))


def test_trapezoid_and_triangle() -> None:
    long, short = trapezoid(100, 50, 100), trapezoid(9, 50, 100)
    assert long.duration == pytest.approx(2.5)
    assert [long.position(t) for t in (0.5, 1.25, 2.0)] == pytest.approx([12.5, 50, 87.5])
    assert short.duration == pytest.approx(0.6)
    assert short.peak == pytest.approx(30)


def test_joined_points_do_not_stop_between() -> None:
    first, second = trapezoid(10, 50, 100, leave=20), trapezoid(10, 50, 100, enter=20)
    assert (first.leave, second.enter) == (20, 20)
    assert first.duration + second.duration < trapezoid(10, 50, 100).duration * 2
    assert trapezoid(1, 50, 100, enter=50).leave == pytest.approx(math.sqrt(2300)), "too short to brake"
    assert trapezoid(1, 50, 100, leave=math.inf).leave == pytest.approx(math.sqrt(200)), "too short to get fast"


def test_no_way_and_no_speed() -> None:
    assert trapezoid(0, 50, 100).duration == 0
    for stuck in (trapezoid(10, 0, 100), trapezoid(10, 50, 0)):
        assert stuck.duration == math.inf
        assert stuck.position(1e9) == 0
        assert stuck.time(1) == math.inf
        assert stuck.time(0) == 0


@given(profiles, st.floats(0, 1))
def test_time_and_position_undo_each_other(profile: Profile, share: float) -> None:
    there = share * profile.length
    assert profile.position(profile.time(there)) == pytest.approx(there, rel=1e-6, abs=1e-6 * profile.length)
    assert profile.position(profile.duration) == profile.length


@given(profiles, st.lists(st.floats(-0.1, 1.1), min_size=2))
def test_a_profile_goes_forward_and_keeps_its_limits(profile: Profile, shares: list[float]) -> None:
    times = [share * profile.duration for share in sorted(shares)]
    places = [profile.position(time) for time in times]
    slack = 1e-9 * profile.length
    assert all(0 <= place <= profile.length + slack for place in places)
    for (t0, p0), (t1, p1) in pairwise(zip(times, places, strict=True)):
        assert -slack <= p1 - p0 <= profile.peak * (t1 - t0) * (1 + 1e-6) + slack


@given(lengths, speeds, speeds)
def test_rest_to_rest_takes_the_textbook_time(length: float, velocity: float, acceleration: float) -> None:
    ramp = velocity**2 / acceleration
    textbook = length / velocity + velocity / acceleration if length > ramp else 2 * math.sqrt(length / acceleration)
    assert trapezoid(length, velocity, acceleration).duration == pytest.approx(textbook)


def test_the_slowest_joint_leads() -> None:
    pace = SpeedLimits((100.0, 10.0, 100.0), (1000.0, 100.0, 1000.0))
    assert shared((50, -50, 0), pace).duration == pytest.approx(trapezoid(50, 10, 100).duration)
    assert shared((50, 1e-12, 0), pace).duration == pytest.approx(trapezoid(50, 100, 1000).duration)
    assert shared((0, 0, 0), pace).duration == 0
    assert shared((50, 0, 0), pace.scaled(0, 1)).duration == math.inf
    assert shared((50, 0, 0), pace.scaled(0.5, 0.1)).duration == pytest.approx(trapezoid(50, 50, 100).duration)


# Curves.


def test_arc_goes_through_its_points() -> None:
    curve = arc((200, 0, 0, 0), (250, 50, 0, 99), (300, 0, 0, 90))
    assert curve.length == pytest.approx(50 * math.pi)
    assert curve.point(0) == pytest.approx((200, 0, 0, 0))
    assert curve.point(0.5) == pytest.approx((250, 50, 0, 45))
    assert curve.point(1) == pytest.approx((300, 0, 0, 90))


def test_the_long_way_round() -> None:
    curve = arc((200, 0, 0), (250, 50, 0), (250, -50, 0))
    assert curve.length == pytest.approx(75 * math.pi)
    assert curve.point(1 / 3) == pytest.approx((250, 50, 0))


coordinates = st.floats(-300, 300)
places = st.tuples(coordinates, coordinates, coordinates)


@given(places, places, places)
def test_any_three_points(start: Vector, through: Vector, end: Vector) -> None:
    first, last, other = math.dist(start, through), math.dist(start, end), math.dist(through, end)
    half = (first + last + other) / 2
    area = math.sqrt(max(0.0, half * (half - first) * (half - last) * (half - other)))
    assume(min(first, last, other) > 1 and area > 1)
    curve = arc(start, through, end)
    radius = math.hypot(*curve.ahead)
    assert 0 < curve.sweep < math.tau
    assert radius == pytest.approx(first * last * other / (4 * area), rel=1e-6)
    assert math.dist(curve.centre, through) == pytest.approx(radius, rel=1e-6)
    assert curve.point(1) == pytest.approx(end, abs=1e-6 * radius)


def test_circle_comes_back_as_often_as_wanted() -> None:
    curve = circle((200, 0, 0, 10), (250, 50, 0, 0), (300, 0, 0, 90), 3)
    assert curve.length == pytest.approx(300 * math.pi)
    assert curve.turn == 0
    assert curve.point(1 / 6) == pytest.approx((300, 0, 0, 10))
    assert curve.point(1) == pytest.approx((200, 0, 0, 10))


@pytest.mark.parametrize("make", [arc, partial(circle, count=1)])
def test_points_that_make_no_circle(make: Callable[[Vector, Vector, Vector], Arc]) -> None:
    assert code_of(lambda: make((0, 0, 0), (0, 0, 0), (1, 0, 0))) == 0x13
    assert code_of(lambda: make((0, 0, 0), (1, 0, 0), (1, 0, 0))) == 0x13
    assert code_of(lambda: make((0, 0, 0), (1, 0, 0), (0, 0, 0))) == 0x13
    assert code_of(lambda: make((0, 0, 0), (10, 10, 10), (30, 30, 30))) == 0x14


# Legs.


def test_a_straight_line_is_straight() -> None:
    start = at(200, -100, 0, 0)
    leg = leg_to(200, 100, 50, 30, start=start)
    assert leg.fault is None
    assert leg.duration == pytest.approx(trapezoid(math.hypot(200, 50), 100, 400).duration)
    assert leg.at(0) == start
    assert SOLVER.forward(leg.at(leg.duration / 2)) == pytest.approx((200, 0, 25, 15))
    assert SOLVER.forward(leg.end) == pytest.approx((200, 100, 50, 30))


def test_a_turn_on_the_spot_takes_the_time_of_the_turn() -> None:
    leg = leg_to(200, 0, 0, 90, start=at(200, 0, 0, 0))
    assert leg.duration == pytest.approx(trapezoid(90, 200, 800).duration)


def test_joints_go_together() -> None:
    leg = joint_segment((0, 0, 0, 0), (100, 50, -25, 0), JOINTS)
    assert leg.at(leg.duration / 2) == pytest.approx((50, 25, -12.5, 0))
    assert leg.end == (100, 50, -25, 0)


@pytest.mark.parametrize(("target", "code"), [((400, 0, 0, 0), 0x11), ((0, 0, 0, 0), 0x10), ((150, 0, 150, 0), 0x12)])
def test_a_target_out_of_reach_fails_in_planning(target: Vector, code: int) -> None:
    assert code_of(lambda: leg_to(*target, start=at(250, 0, 0, 0))) == code


def test_a_line_through_the_base_ends_where_the_reach_ends() -> None:
    leg = leg_to(20, 200, 0, 90, start=at(20, -200, 0, -90), pace=SLOW)
    assert leg.fault is not None
    assert leg.fault.code == 0x22
    x, y, z, r = SOLVER.forward(leg.end)
    assert (x, z) == pytest.approx((20, 0))
    assert leg.duration == pytest.approx((y + 200) / 10, abs=1e-3), "10 mm a second"
    assert leg.at(leg.duration + 10) == leg.end
    assert SOLVER.inverse((x, y - 0.01, z, r))
    assert code_of(lambda: SOLVER.inverse((x, y + 0.01, z, r))) == 0x12


@pytest.mark.parametrize("begin", range(-220, -140, 5))
def test_a_line_that_leaves_the_reach_for_a_moment_raises_the_alarm(begin: int) -> None:
    """It passes too near to the base for 2 cm, wherever along the line they lie, and both of its ends are in reach."""
    device, now = device_at(109.5, begin, 0, 0)
    target = (109.5, 200, 0, 0)
    assert at(*target)
    assert code_of(lambda: at(109.5, 0, 0, 0)) == 0x12
    device.put(Work("line", lambda device: travel([leg_to(*target, start=device.joints)]), moves=True))
    now[0] = 60.0
    assert [each.outcome for each in device.executed] == ["alarm"]
    assert 0x22 in device.alarms
    assert SOLVER.forward(device.joints) == pytest.approx((109.5, -10, 0, 0), abs=0.2), "it ends where the reach ends"


def test_an_arc_that_swings_too_far_out() -> None:
    wide = Solver(Kinematics(limits=JointLimits(j3=(-90, 90), fold=(-90, 180))))
    start = wide.inverse((250, 0, 0, 0))
    leg = curve_segment(arc((250, 0, 0, 0), (350, 0, 50, 0), (250, 0, 100, 0)), start, wide, TOOL)
    assert leg.fault is not None
    assert leg.fault.code == 0x21
    assert 0 < leg.stop < 0.5


def test_the_arm_may_move_back_from_beyond_a_limit() -> None:
    beyond = Kinematics().inverse(200, 0, 0, 160)
    back = leg_to(200, 0, 0, 0, start=beyond)
    assert back.fault is None
    assert SOLVER.forward(back.joints(0.5)) == pytest.approx((200, 0, 0, 80))
    further = curve_segment(LineSegment((200, 0, 0, 160), (200, 0, 0, 190)), beyond, SOLVER, TOOL, must_arrive=False)
    assert further.fault is not None
    assert (further.fault.code, further.end, further.duration) == (0x22, beyond, 0)


def test_an_end_that_need_not_be_reached() -> None:
    line = LineSegment((250, 0, 0, 0), (1250, 0, 0, 0))
    leg = curve_segment(line, at(*line.start), SOLVER, SLOW, must_arrive=False)
    assert leg.fault is not None
    assert leg.fault.code in {0x21, 0x22}
    assert SOLVER.forward(leg.end)[0] == pytest.approx(250 + 1000 * leg.stop)
    assert 300 < SOLVER.forward(leg.end)[0] < 342


def test_only_the_end_is_looked_at_when_nothing_else_is_asked_for() -> None:
    line = LineSegment((20, -200, 0, -90), (20, 200, 0, 90))
    leg = curve_segment(line, at(*line.start), SOLVER, TOOL, every=math.inf)
    assert leg.fault is None
    assert leg.joints(0.5) == at(*line.start), "shown where it was last seen"
    assert leg.end == at(*line.end)


def test_points_of_a_path_keep_their_speed() -> None:
    line = LineSegment((200, 0, 0, 0), (210, 0, 0, 0))
    leg = curve_segment(line, at(*line.start), SOLVER, TOOL, enter=100, leave=100)
    assert leg.duration == pytest.approx(0.1)


def test_six_joints_and_six_coordinates() -> None:
    class Straight:
        def forward(self, joints: Vector) -> Vector:
            return joints

        def inverse(self, point: Vector) -> Vector:
            return point

    start, end = (0.0,) * 6, (30.0, 40.0, 0.0, 90.0, 0.0, -180.0)
    leg = curve_segment(LineSegment(start, end), start, Straight(), SpeedLimits((100.0, 90.0), (1e9, 1e9)))
    assert leg.duration == pytest.approx(2.0, abs=1e-3)
    assert leg.end == end


# Jumps.


def jump_to(
    *target: float, start: Vector, height: float = 20, ceiling: float = 150, straight: bool = False
) -> list[Segment]:
    across = TOOL if straight else JOINTS
    return jump(start, target, SOLVER, height=height, ceiling=ceiling, vertical=TOOL, across=across, straight=straight)


@pytest.mark.parametrize("straight", [False, True])
@pytest.mark.parametrize(("ceiling", "apex"), [(150, 50), (40, 40), (30, 30)])
def test_a_jump_goes_up_across_and_down(straight: bool, ceiling: float, apex: float) -> None:
    legs = jump_to(200, 100, 30, 0, start=at(250, 0, 0, 0), ceiling=ceiling, straight=straight)
    corners = [SOLVER.forward(leg.end) for leg in legs]
    assert corners[0] == pytest.approx((250, 0, apex, 0))
    assert corners[1] == pytest.approx((200, 100, apex, 0))
    assert corners[2] == pytest.approx((200, 100, 30, 0))
    assert legs[2].end == at(200, 100, 30, 0)
    middle = SOLVER.forward(legs[1].joints(0.5))
    assert (middle == pytest.approx((225, 50, apex, 0))) == straight


def test_jumps_that_cannot_be() -> None:
    start = at(250, 0, 0, 0)
    assert code_of(lambda: jump_to(200, 100, 60, 0, start=start, ceiling=50)) == 0x15
    assert code_of(lambda: jump_to(200, 100, 0, 0, start=at(250, 0, 60, 0), ceiling=50)) == 0x15
    assert code_of(lambda: jump_to(250, 0, 0, 0, start=start, straight=True)) == 0x13
    assert code_of(lambda: jump_to(400, 0, 0, 0, start=start)) == 0x11
    assert [leg.fault for leg in jump_to(250, 0, 0, 0, start=start)] == [None, None, None]


def test_a_jump_that_rises_out_of_reach_ends_there() -> None:
    (up,) = jump_to(200, 100, 0, 0, start=at(200, 0, 0, 0), height=200, ceiling=300)
    assert up.fault is not None
    assert up.fault.code == 0x22
    assert 100 < SOLVER.forward(up.end)[2] < 200


def test_a_jump_whose_far_corner_is_out_of_reach_ends_before_it() -> None:
    up, across = jump_to(310, 0, 0, 0, start=at(240, 0, 0, 0), height=150)
    assert up.fault is None
    assert across.fault is not None
    assert (across.fault.code, across.duration) == (0x21, 0)
    assert SOLVER.forward(across.end) == pytest.approx((240, 0, 150, 0))
    up, across = jump_to(310, 0, 0, 0, start=at(240, 0, 0, 0), height=150, straight=True)
    assert across.fault is not None
    assert across.fault.code == 0x22
    assert SOLVER.forward(across.end)[0] > 245


# On the device.


def device_at(*point: float) -> tuple[Device, list[float]]:
    now = [0.0]
    return Device(lambda: now[0], at(*point)), now


def test_a_jump_in_time() -> None:
    device, now = device_at(250, 0, 0, 0)
    legs: list[Segment] = []

    def begin(device: Device) -> Activity:
        legs.extend(jump_to(200, 100, 30, 0, start=device.joints))
        return travel(legs)

    device.put(Work("jump", begin, moves=True))
    total = sum(leg.duration for leg in legs)
    now[0] = legs[0].duration
    assert SOLVER.forward(device.joints) == pytest.approx((250, 0, 50, 0))
    now[0] = legs[0].duration + legs[1].duration
    assert SOLVER.forward(device.joints) == pytest.approx((200, 100, 50, 0))
    now[0] = total + 5
    assert device.joints == at(200, 100, 30, 0)
    assert device.executed[0].finished == pytest.approx(total)


@settings(max_examples=examples(50), deadline=None)
@given(st.lists(st.floats(0, 1.2), max_size=10))
def test_a_line_that_leaves_the_reach_ends_the_same_however_it_is_watched(looks: list[float]) -> None:
    device, now = device_at(20, -200, 0, -90)
    device.put(Work("line", lambda device: travel([leg_to(20, 200, 0, 90, start=device.joints)]), moves=True))
    expected = leg_to(20, 200, 0, 90, start=at(20, -200, 0, -90))
    for share in sorted(looks):
        now[0] = share * expected.duration
        device.advance()

    now[0] = 60.0
    assert device.joints == expected.end
    assert [(e.finished, e.outcome) for e in device.executed] == [(expected.duration, "alarm")]
    assert device.alarms == {0x00, 0x22}
