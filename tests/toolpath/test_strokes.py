"""Strokes and toolpaths: what may be made, and what transforms, simplification, splitting and ordering keep."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import FrozenInstanceError
from typing import Any

import numpy as np
import pytest
from geometry import apart, lines_of
from hypothesis import given, settings
from hypothesis import strategies as st
from quick_suite import examples

from dobot_async.toolpath import Matrix, Point, Stroke, Toolpath
from dobot_async.toolpath.ordering import travel_of

numbers = st.floats(-300, 300).map(lambda number: round(number, 3))
points = st.tuples(numbers, numbers)


@st.composite
def strokes(draw: st.DrawFn, most: int = 8) -> Stroke:
    line = draw(st.lists(points, min_size=1, max_size=most))
    power = draw(st.one_of(st.just(100.0), st.lists(st.floats(0, 100), min_size=len(line), max_size=len(line))))
    layer, speed = draw(st.sampled_from(["", "a"])), draw(st.sampled_from([None, 10.0]))
    return Stroke(tuple(line), power if isinstance(power, float) else tuple(power), speed, layer)


toolpaths = st.lists(strokes(), max_size=12).map(lambda found: Toolpath(tuple(found)))
drawings = st.lists(strokes(), min_size=1, max_size=12).map(lambda found: Toolpath(tuple(found)))


def near(a: Toolpath, b: Toolpath, tolerance: float = 1e-6) -> bool:
    """Whether they have the same points in the same order."""
    return len(a) == len(b) and all(
        len(x.points) == len(y.points)
        and all(math.dist(p, q) <= tolerance for p, q in zip(x.points, y.points, strict=True))
        for x, y in zip(a, b, strict=True)
    )


def either_way(stroke: Stroke) -> tuple[Any, ...]:
    """The same for a stroke and its reverse."""
    turned = stroke.reversed()
    return (*min((stroke.points, stroke.powers), (turned.points, turned.powers)), stroke.speed or 0.0, stroke.layer)


def ways(toolpath: Toolpath) -> Counter[tuple[Any, ...]]:
    """All straight ways, whichever way they go, each with its power."""
    return Counter((*sorted((a, b)), power) for stroke in toolpath for a, b, power in stroke.ways() if a != b)


@pytest.mark.parametrize(
    "make",
    [
        lambda: Stroke(()),
        lambda: Stroke(((0, math.nan),)),
        lambda: Stroke(((0, 0),), power=101),
        lambda: Stroke(((0, 0),), power=(1.0, 2.0)),
        lambda: Stroke(((0, 0),), speed=0),
        lambda: Toolpath.of([(0, 0)]).scale(0),
        lambda: Toolpath.of([(0, 0)]).translate(math.inf),
        lambda: Toolpath.of([(0, 0)]).simplify(-1),
        lambda: Toolpath.of([(0, 0)]).fit(10, 10, margin=5),
        lambda: Toolpath.of([(0, 0)]).mirror("z"),  # type: ignore[arg-type]
        lambda: Toolpath.of([(0, 0)]).split(lambda x, y: True, step=0),
        lambda: Toolpath.of([(0, 0)]).only("cut"),
        lambda: Toolpath().bounds,
    ],
)
def test_what_makes_no_sense_is_refused(make: Callable[[], object]) -> None:
    with pytest.raises(ValueError, match=r"."):
        make()


def test_nothing_can_be_changed() -> None:
    stroke = Stroke(((0, 0), (1, 1)))
    with pytest.raises(FrozenInstanceError):
        stroke.power = 3  # type: ignore[misc]

    with pytest.raises(TypeError, match="Strokes"):
        Toolpath(("a",))  # type: ignore[arg-type]


def test_numpy_numbers_are_numbers() -> None:
    stroke = Stroke(tuple(np.array([[0, 1], [2, 3]], dtype=np.float32)), np.float64(50))
    assert stroke.points == ((0.0, 1.0), (2.0, 3.0))
    assert all(type(number) is float for point in stroke.points for number in point)
    assert Toolpath((stroke,)).scale(np.int32(2)).bounds == (0, 2, 4, 6)


def test_a_power_belongs_to_the_way_to_its_point() -> None:
    stroke = Stroke(((0, 0), (1, 0), (3, 0)), (5.0, 10.0, 20.0))
    assert stroke.powers == (10.0, 10.0, 20.0)
    assert stroke.reversed().powers == (20.0, 20.0, 10.0)
    assert Stroke(((0, 0), (1, 0)), (7.0, 7.0)).power == 7.0


@given(strokes())
def test_a_stroke_that_is_reversed_twice_is_the_same(stroke: Stroke) -> None:
    assert stroke.reversed().reversed() == stroke
    assert stroke.reversed().length == pytest.approx(stroke.length)


@given(toolpaths, points, st.floats(-720, 720), points, st.floats(0.1, 10))
def test_transforms_have_inverses(path: Toolpath, by: Point, degrees: float, about: Point, factor: float) -> None:
    assert near(path.translate(*by).translate(-by[0], -by[1]), path)
    assert near(path.rotate(degrees, about=about).rotate(-degrees, about=about), path)
    assert near(path.scale(factor, about=about).scale(1 / factor, about=about), path)
    for axis in ("x", "y"):
        assert near(path.mirror(axis, about=about).mirror(axis, about=about), path)


@given(toolpaths, st.floats(-720, 720), st.floats(0.1, 10))
def test_lengths_scale_and_do_not_turn(path: Toolpath, degrees: float, factor: float) -> None:
    assert path.rotate(degrees).length == pytest.approx(path.length, abs=1e-6)
    assert path.scale(-factor).length == pytest.approx(factor * path.length, abs=1e-6)


@given(points, points)
def test_the_point_about_which_something_turns_stays(point: Point, other: Point) -> None:
    for path in (Toolpath.of([point]).rotate(33, about=point), Toolpath.of([point]).scale(3, about=point)):
        assert math.dist(path.strokes[0].start, point) < 1e-9

    assert Matrix(0, 1, -1, 0, 0, 0)((1, 0)) == (0, 1)  # to the left


@given(drawings, st.floats(5, 300), st.floats(5, 300), points, st.booleans())
def test_what_fits_lies_in_the_middle_of_its_rectangle_and_touches_it(
    path: Toolpath, width: float, height: float, at: Point, turn: bool
) -> None:
    bounds = path.bounds
    fitted = path.fit(width, height, at=at, margin=2, rotate=turn).bounds
    assert fitted.width <= width - 4 + 1e-6
    assert fitted.height <= height - 4 + 1e-6
    assert fitted.centre == pytest.approx((at[0] + width / 2, at[1] + height / 2), abs=1e-6)
    if max(bounds.width, bounds.height) > 1:
        assert max(fitted.width / (width - 4), fitted.height / (height - 4)) == pytest.approx(1, abs=1e-6)


@given(drawings, st.floats(0.001, 50))
def test_what_is_simplified_is_missed_by_no_more_than_the_tolerance(path: Toolpath, tolerance: float) -> None:
    simple = path.simplify(tolerance)
    assert len(simple) == len(path)
    for before, after in zip(path, simple, strict=True):
        assert (after.start, after.end) == (before.start, before.end)
        assert set(after.points) <= set(before.points)
        assert apart([before.points], [after.points], step=5.0) <= tolerance + 1e-9
        assert len(set(after.powers)) == len(set(before.powers))


def test_a_straight_way_of_many_points_becomes_one_of_two() -> None:
    line = [(x / 10, 0.0) for x in range(1000)]
    assert Toolpath.of(line).simplify(0.01).strokes[0].points == (line[0], line[-1])


@settings(max_examples=examples(200))
@given(toolpaths, st.one_of(st.none(), points), st.booleans())
def test_ordering_loses_and_doubles_no_stroke(path: Toolpath, start: Point | None, reverse: bool) -> None:
    found = path.order(start=start, merge=None, reverse=reverse)
    key = either_way if reverse else lambda stroke: (stroke.points, stroke.powers, stroke.speed or 0.0, stroke.layer)
    assert Counter(map(key, found)) == Counter(map(key, path))
    assert travel_of(found.strokes, start) <= travel_of(path.strokes, start) + 1e-9


@settings(max_examples=examples(200))
@given(
    st.lists(st.tuples(st.integers(0, 3), st.integers(0, 3), st.integers(0, 3), st.integers(0, 3)), max_size=14),
    st.booleans(),
)
def test_merging_loses_and_doubles_no_way(ends: list[tuple[int, int, int, int]], reverse: bool) -> None:
    path = Toolpath(tuple(Stroke(((a, b), (c, d)), float(7 * number)) for number, (a, b, c, d) in enumerate(ends)))
    found = path.order(reverse=reverse)
    assert ways(found) == ways(path)
    assert len(found) <= len(path)


def test_strokes_that_meet_become_one_and_others_do_not() -> None:
    path = Toolpath.of([(0, 0), (10, 0)], [(20, 10), (20, 0)], [(10, 0.005), (20, 0)], [(50, 50), (60, 50)])
    found = path.order()
    assert [stroke.points for stroke in found] == [
        ((0, 0), (10, 0), (10, 0.005), (20, 0), (20, 10)),
        ((50, 50), (60, 50)),
    ]
    assert len(path.order(reverse=False)) == 3
    assert len(path.order(merge=None)) == 4
    assert len(Toolpath((Stroke(((0, 0), (1, 0)), layer="a"), Stroke(((1, 0), (2, 0)), layer="b"))).order()) == 2


def test_a_comb_is_drawn_to_and_fro() -> None:
    teeth = Toolpath.of(*[[(x, 0), (x, 50)] for x in range(0, 100, 5)])
    assert teeth.travel > 900
    assert teeth.order().travel == 19 * 5
    assert teeth.order(start=(0, 60)).strokes[0].start == (0, 50)


@pytest.mark.full
def test_thousands_of_strokes_are_ordered_well() -> None:
    random = np.random.default_rng(1)
    path = Toolpath.of(*[[(x, y), (x + 1, y)] for x, y in random.uniform(0, 200, (3000, 2)).tolist()])
    assert path.order(merge=None).travel < path.travel / 30


@given(drawings, points, st.floats(1, 300))
def test_what_is_split_is_all_of_it(path: Toolpath, centre: Point, radius: float) -> None:
    inner, outer = path.split(lambda x, y: math.dist((x, y), centre) <= radius)
    cuts = len(inner) + len(outer) - len(path)
    assert inner.length + outer.length == pytest.approx(path.length, abs=0.001 * cuts + 1e-6)
    assert all(math.dist(point, centre) <= radius + 1e-9 for stroke in inner for point in stroke.points)
    assert all(math.dist(point, centre) > radius - 1e-9 for stroke in outer for point in stroke.points)


def test_a_way_is_cut_where_it_leaves() -> None:
    inner, outer = Toolpath.of([(0, 0), (100, 0), (100, 10), (0, 10)]).split(lambda x, _: x <= 40)
    assert [len(stroke.points) for stroke in inner] == [2, 2]
    assert inner.strokes[0].end[0] == pytest.approx(40, abs=0.002)
    assert outer.length == pytest.approx(130, abs=0.01)
    assert lines_of(outer)[0][1:3] == [(100, 0), (100, 10)] or lines_of(outer)[0][1:3] == ((100, 0), (100, 10))
