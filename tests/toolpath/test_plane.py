"""Work planes, grids, calibrations: maps there and back, and what is refused."""

from __future__ import annotations

import json
import math
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from quick_suite import examples

from dobot_async.arms.magician.commands import Pose
from dobot_async.calibration import Calibration
from dobot_async.grid import Grid
from dobot_async.toolpath import WorkPlane

numbers = st.floats(-200, 200)
places = st.tuples(numbers, numbers, numbers)


@given(places, st.floats(-360, 360), places)
def test_a_plane_maps_there_and_back(
    origin: tuple[float, float, float], rotation: float, place: tuple[float, ...]
) -> None:
    plane = WorkPlane.flat(*origin, rotation=rotation)
    assert plane.to_plane(*plane.to_arm(*place)) == pytest.approx(place, abs=1e-6)
    assert plane.normal == pytest.approx((0, 0, 1))
    assert plane.pressed(place[:2], 100)[2] == pytest.approx(origin[2])  # type: ignore[arg-type]


def test_three_taught_corners_are_a_plane_that_may_lie_aslant() -> None:
    plane = WorkPlane.from_corners((200, -50, -60), Pose(200, 50, -58, 0, 0, 0, 0, 0), (120, -50, -60.5))
    assert plane.to_arm(0, 0) == (200, -50, -60)
    assert plane.to_arm(math.hypot(100, 2), 0) == pytest.approx((200, 50, -58))
    x, y, height = plane.to_plane(120, -50, -60.5)
    assert (x, height) == pytest.approx((0, 0), abs=0.02)
    assert y == pytest.approx(80, abs=0.1)
    up = plane.to_arm(10, 20, 5)
    assert math.dist(up, plane.to_arm(10, 20)) == pytest.approx(5)
    assert up[2] > plane.to_arm(10, 20)[2]


@pytest.mark.parametrize(
    ("corners", "reason"),
    [
        (((0, 0, 0), (0, 100, 0), (100, 0, 0)), "mirror"),
        (((0, 0, 0), (0.5, 0, 0), (0, 100, 0)), "apart"),
        (((0, 0, 0), (100, 0, 0), (100, 100, 0)), "angle of 45.0"),
        (((0, 0, 0), (100, 0, 0), (0, 0, 100)), "upright"),
        (((0, 0, 0), (math.nan, 0, 0), (0, 0, 100)), "along_x"),
        (((0, 0), (100, 0, 0), (0, 0, 100)), "origin"),
    ],
)
def test_corners_that_are_no_paper_are_refused(corners: Any, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        WorkPlane.from_corners(*corners)


@pytest.mark.parametrize("options", [{"lift": -1}, {"press": math.inf}])
def test_heights_are_checked(options: Any) -> None:
    with pytest.raises(ValueError, match=next(iter(options))):
        WorkPlane.flat(0, 0, 0, **options)


CORNERS = [(200, 0, -10), (200, 90, -10), (260, 0, -4)]


def test_a_grid_is_a_sequence_of_its_places() -> None:
    grid = Grid(CORNERS, rows=3, columns=4, layers=2, layer_height=20)
    assert len(grid) == 24
    assert tuple(grid[0]) == pytest.approx((200, 0, -10))
    assert grid[3] == pytest.approx((200, 90, -10))
    assert grid[11] == pytest.approx((260, 90, -4))
    assert grid[-1] == pytest.approx((260, 90, 16))
    assert grid.at(1, 2) == pytest.approx((230, 60, -7))
    assert list(grid)[4:6] == grid[4:6] == [grid.at(1, 0), grid.at(1, 1)]
    assert grid.cell(17) == (1, 1, 1)


@pytest.mark.parametrize(
    ("order", "cells"),
    [
        ("rows", [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2)]),
        ("columns", [(0, 0), (1, 0), (0, 1), (1, 1), (0, 2), (1, 2)]),
        ("rows-snake", [(0, 0), (0, 1), (0, 2), (1, 2), (1, 1), (1, 0)]),
        ("columns-snake", [(0, 0), (1, 0), (1, 1), (0, 1), (0, 2), (1, 2)]),
    ],
)
def test_orders(order: Any, cells: list[tuple[int, int]]) -> None:
    grid = Grid(CORNERS, 2, 3, order=order)
    assert [grid.cell(number)[:2] for number in range(6)] == cells


def test_a_fourth_corner_bends_it() -> None:
    grid = Grid([*CORNERS, (280, 110, 0)], 2, 2)
    assert [grid[i] for i in range(4)] == [*map(tuple, CORNERS[:2]), CORNERS[2], (280, 110, 0)]
    assert Grid([*CORNERS, (280, 110, 0)], 3, 3).at(1, 1) == pytest.approx((235, 50, -6))


@pytest.mark.parametrize(
    "make",
    [
        lambda: Grid(CORNERS[:2], 2, 2),
        lambda: Grid(CORNERS, 0, 2),
        lambda: Grid(CORNERS, 2, 2, layers=2),
        lambda: Grid(CORNERS, 2, 2, order="spiral"),  # type: ignore[arg-type]
        lambda: Grid([(0, 0, math.nan), *CORNERS[1:]], 2, 2),
    ],
)
def test_grids_that_are_none_are_refused(make: Any) -> None:
    with pytest.raises(ValueError, match=r"."):
        make()


def test_places_beyond_the_grid_are_index_errors() -> None:
    grid = Grid(CORNERS, 2, 2)
    for number in (4, -5):
        with pytest.raises(IndexError):
            grid[number]

    for row, column in ((2, 0), (0, -1)):
        with pytest.raises(IndexError):
            grid.at(row, column)

    with pytest.raises(TypeError, match="whole"):
        Grid(CORNERS, 2.0, 2)  # type: ignore[arg-type]


def camera(random: Random) -> Any:
    """A camera that looks at a table from anywhere above it; returns where a pixel is on the table."""
    angle, scale = random.uniform(-3, 3), random.uniform(0.1, 0.4)
    g, h = random.uniform(-2e-4, 2e-4), random.uniform(-2e-4, 2e-4)
    x, y = random.uniform(-300, 300), random.uniform(-300, 300)

    def table(u: float, v: float) -> tuple[float, float]:
        w = 1 + g * u + h * v
        return (
            (x + scale * (math.cos(angle) * u - math.sin(angle) * v)) / w,
            (y + scale * (math.sin(angle) * u + math.cos(angle) * v)) / w,
        )

    return table


def pixels(random: Random, count: int) -> list[tuple[float, float]]:
    """Pixels spread over the picture."""
    corners = [(60, 50), (1860, 70), (1830, 1020), (80, 1000)]
    return [(u + random.uniform(-40, 40), v + random.uniform(-40, 40)) for u, v in corners][:count] + [
        (random.uniform(0, 1920), random.uniform(0, 1080)) for _ in range(count - 4)
    ]


@pytest.mark.full
@settings(deadline=None)
@given(st.integers(0, 10_000), st.integers(4, 20))
def test_a_homography_is_found_from_four_pairs_and_more(seed: int, count: int) -> None:
    random = Random(seed)
    table, seen = camera(random), pixels(random, count)
    found = Calibration.from_points(seen, [table(*pixel) for pixel in seen])
    assert found.error < 1e-6
    assert found.outliers == ()
    for pixel in pixels(random, 8):
        assert found.to_arm(pixel) == pytest.approx(table(*pixel), abs=1e-5)
        assert found.to_pixel(*table(*pixel)) == pytest.approx(pixel, abs=1e-3)


@pytest.mark.full
@settings(deadline=None, max_examples=examples(40))
@given(st.integers(0, 10_000), st.integers(8, 20))
def test_outliers_are_found_and_told_in_spite_of_noise(seed: int, count: int) -> None:
    random = Random(seed)
    table, seen = camera(random), pixels(random, count)
    wrong = set(random.sample(range(count), count // 4))
    targets = []
    for number, pixel in enumerate(seen):
        x, y = table(*pixel)
        noise = random.gauss(0, 0.1), random.gauss(0, 0.1)
        off = (random.choice([-1, 1]) * random.uniform(30, 90), 0) if number in wrong else noise
        targets.append((x + off[0], y + off[1]))

    found = Calibration.from_points(seen, targets)
    assert set(found.outliers) == wrong
    assert found.error < 0.4
    assert min(found.residuals[number] for number in wrong) > 5
    assert found == Calibration.from_points(seen, targets)


def test_three_pairs_are_an_affine_map_and_poses_and_arrays_will_do() -> None:
    targets = [Pose(200, 0, 5, 0, 0, 0, 0, 0), Pose(200, 100, 5, 0, 0, 0, 0, 0), np.array([100.0, 0.0])]
    found = Calibration.from_points(np.array([[0, 0], [1000, 0], [0, 1000]]), targets)
    assert found.to_arm((500, 500)) == pytest.approx((150, 50))
    assert found.residuals == pytest.approx((0, 0, 0), abs=1e-9)


@pytest.mark.parametrize(
    ("seen", "targets", "reason"),
    [
        ([(0, 0), (1, 0)], [(0, 0), (1, 0)], "three pairs"),
        ([(0, 0), (1, 0), (0, 1)], [(0, 0), (1, 0)], "3 pixels and 2"),
        ([(0, 0), (1, 1), (2, 2)], [(0, 0), (1, 0), (0, 1)], "line"),
        ([(0, 0), (1, 0), (2, 0), (0, 1)], [(0, 0), (1, 0), (2, 0), (0, 1)], "line"),
        ([(0, 0), (1, 0), (0, math.nan)], [(0, 0), (1, 0), (0, 1)], "finite"),
        ([(0, 0), (1, 0), (0, 1), (1, 1), (2, 1)], [(0, 0), (90, 50), (7, 70), (300, 2), (33, 90)], "fit together"),
    ],
)
def test_pairs_that_say_nothing_are_refused(seen: Any, targets: Any, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        Calibration.from_points(seen, targets, tolerance=0.01)


def test_beyond_the_horizon_is_no_place() -> None:
    seen = [(0, 0), (500, 0), (0, 500), (500, 500), (200, 300)]
    found = Calibration.from_points(seen, [(u / (1 + v / 1000), v / (1 + v / 1000)) for u, v in seen])
    with pytest.raises(ValueError, match="horizon"):
        found.to_arm((0, -1200))


def test_it_is_saved_and_loaded(tmp_path: Path) -> None:
    random = Random(1)
    table, seen = camera(random), pixels(random, 9)
    found = Calibration.from_points(seen, [table(*pixel) for pixel in seen])
    found.save(tmp_path / "camera.json")
    assert Calibration.load(tmp_path / "camera.json") == found
    good = json.loads(found.to_json())
    for bad in (
        "",
        "[]",
        "{}",
        json.dumps(good | {"kind": "x"}),
        json.dumps(good | {"matrix": [[1, 2, 3]]}),
        json.dumps(good | {"used": []}),
    ):
        (tmp_path / "bad.json").write_text(bad)
        with pytest.raises(ValueError, match=r"bad.json: this is no calibration"):
            Calibration.load(tmp_path / "bad.json")
