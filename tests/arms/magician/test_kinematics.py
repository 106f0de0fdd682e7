from __future__ import annotations

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from dobot_async.arms.magician.kinematics import JointLimits, Joints, Kinematics, Point, Unreachable

GOLDEN_JOINTS = Joints(86.7176742553711, 14.331169128417969, 59.5638313293457, 0.0)
GOLDEN_POINT = Point(10.184884071350098, 177.5911865234375, 4.0564422607421875, 86.7176742553711)
LASER = Kinematics(x_bias=70.0)

biases = st.builds(Kinematics, x_bias=st.floats(0, 120), y_bias=st.floats(-30, 30), z_bias=st.floats(-100, 100))


@st.composite
def allowed_joints(draw: st.DrawFn) -> Joints:
    j2 = draw(st.floats(-5, 90))
    low, high = JointLimits().span(3, (0.0, j2, 0.0, 0.0))
    return Joints(draw(st.floats(-125, 125)), j2, draw(st.floats(low, high)), draw(st.floats(-150, 150)))


def test_pose_of_a_real_arm() -> None:
    assert LASER.forward(*GOLDEN_JOINTS) == pytest.approx(GOLDEN_POINT, abs=1e-4)
    assert LASER.inverse(*GOLDEN_POINT) == pytest.approx(GOLDEN_JOINTS, abs=1e-4)
    assert LASER.check(*GOLDEN_POINT) == LASER.inverse(*GOLDEN_POINT)


@pytest.mark.parametrize(
    ("joints", "point"),
    [
        ((0, 45, 45, 0), (259.104, 0, -8.485, 0)),
        ((0, 0, 0, 0), (206.7, 0, 135, 0)),
        ((90, 0, 0, 10), (0, 206.7, 135, 100)),
    ],
)
def test_known_places(joints: tuple[float, float, float, float], point: tuple[float, ...]) -> None:
    assert Kinematics().forward(*joints) == pytest.approx(point, abs=1e-3)


def test_biases_point_forward_left_and_down() -> None:
    home = Kinematics().forward(0, 45, 45, 0)
    assert Kinematics(x_bias=69.7).forward(0, 45, 45, 0) == pytest.approx(home._replace(x=home.x + 10))
    assert Kinematics(y_bias=10).forward(0, 45, 45, 0) == pytest.approx(home._replace(y=10))
    assert Kinematics(z_bias=10).forward(0, 45, 45, 0) == pytest.approx(home._replace(z=home.z - 10))


@given(biases, allowed_joints())
def test_joints_survive_the_way_there_and_back(kinematics: Kinematics, joints: Joints) -> None:
    assert kinematics.check(*kinematics.forward(*joints)) == pytest.approx(joints, abs=1e-6)


@given(biases, st.floats(-400, 400), st.floats(-400, 400), st.floats(-400, 400), st.floats(-180, 180))
def test_every_place_is_either_reached_or_explained(
    kinematics: Kinematics, x: float, y: float, z: float, r: float
) -> None:
    square = x * x + y * y - kinematics.y_bias**2
    wrist = math.hypot(math.sqrt(max(0.0, square)) - kinematics.x_bias, z + kinematics.z_bias)
    assume(abs(square) > 1e-3)
    assume(min(abs(wrist - 12), abs(wrist - 282)) > 1e-3)
    if square > 0 and 12 < wrist < 282:
        joints = kinematics.inverse(x, y, z, r)
        assert kinematics.forward(*joints) == pytest.approx((x, y, z, r), abs=1e-6)
        assert -180 <= joints.j1 <= 180
    else:
        with pytest.raises(Unreachable, match="too far" if square > 0 and wrist > 282 else "too near|axis") as caught:
            kinematics.inverse(x, y, z, r)

        assert caught.value.alarm == (0x11 if x or y else 0x10)


@pytest.mark.parametrize(
    ("target", "alarm", "words"),
    [
        ((400, 0, 0, 0), 0x11, r"too far: the wrist would be 340\.3 mm from the shoulder, the arm reaches 282\.0 mm"),
        ((60, 0, 0, 0), 0x11, r"too near: the wrist would be 0\.3 mm from the shoulder, the arm folds to 12\.0 mm"),
        ((0, 0, 100, 0), 0x10, "axis of joint 1"),
        ((-200, 0, 0, 180), 0x12, r"joint 1 would be 180\.0 degrees, limit 125$"),
        ((150, 0, 150, 0), 0x12, r"joint 2 would be -23\.7 degrees, limit -5$"),
        ((150, 0, -50, 0), 0x12, r"joint 3 would be 91\.4 degrees, limit 90$"),
        ((200, 0, 0, 200), 0x12, r"joint 4 would be 200\.0 degrees, limit 150$"),
        (
            (300, 150, -50, 0),
            0x12,
            r"joint 2 .* limit 90; joint 3 would be 16\.5 degrees, limit 38\.5 with joint 2 at 93\.5$",
        ),
    ],
)
def test_why_not(target: tuple[float, float, float, float], alarm: int, words: str) -> None:
    with pytest.raises(Unreachable, match=words) as caught:
        Kinematics().check(*target)

    assert caught.value.alarm == alarm


def test_inverse_asks_no_limits() -> None:
    assert Kinematics().inverse(150, 0, 150, 0).j2 == pytest.approx(-23.7, abs=0.1)


def test_tool_beside_the_arm() -> None:
    with pytest.raises(Unreachable, match=r"7\.1 mm from the axis .* 20\.0 mm beside") as caught:
        Kinematics(y_bias=-20).inverse(5, 5, 0, 0)

    assert caught.value.alarm == 0x11


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_nonsense_is_not_a_place(bad: float) -> None:
    with pytest.raises(ValueError, match="finite"):
        Kinematics().inverse(200, bad, 0, 0)

    with pytest.raises(ValueError, match="finite"):
        Kinematics().check_joints(0, 0, bad, 0)


def test_parallelogram() -> None:
    kinematics = Kinematics()
    kinematics.check_joints(0, 80, 25, 0)
    kinematics.check_joints(0, 40, -15, 0)
    with pytest.raises(Unreachable, match=r"joint 3 would be 24\.0 degrees, limit 25 with joint 2 at 80\.0") as caught:
        kinematics.check_joints(0, 80, 24, 0)

    assert caught.value.alarm == 0x12
    with pytest.raises(Unreachable, match=r"joint 3 would be 71\.0 degrees, limit 70 with joint 2 at 0\.0"):
        kinematics.check_joints(0, 0, 71, 0)


@given(allowed_joints(), st.integers(1, 4), st.floats(0, 1))
def test_span_is_what_the_check_allows(joints: Joints, number: int, share: float) -> None:
    kinematics = Kinematics()
    low, high = kinematics.limits.span(number, joints)
    for angle, fine in ((low + (high - low) * share, True), (low - 0.1, False), (high + 0.1, False)):
        moved = (*joints[: number - 1], angle, *joints[number:])
        assert (not kinematics.limits.problems(moved)) == fine


def test_limits_can_be_chosen() -> None:
    measured = Kinematics(limits=JointLimits(j3=(-15, 60)))
    with pytest.raises(Unreachable, match=r"joint 3 would be 73\.9 degrees, limit 60"):
        measured.check(200, 0, -50, 0)

    Kinematics().check(200, 0, -50, 0)


def test_home_and_the_work_area_pass() -> None:
    kinematics = Kinematics()
    kinematics.check_joints(0, 45, 45, 0)
    for radius in range(200, 301, 5):
        for degrees in range(-90, 91, 15):
            for z in range(-50, 101, 5):
                angle = math.radians(degrees)
                kinematics.check(radius * math.cos(angle), radius * math.sin(angle), z, 0)
