"""Examples that move things: each, as a process of its own, ends with every part where it belongs."""

from __future__ import annotations

import asyncio
import json
import math
import subprocess
import sys
from itertools import pairwise
from pathlib import Path
from random import Random

import pytest
from PIL import Image, ImageDraw

from dobot_async import ColorPort, InfraredPort, Magician
from dobot_async.arms.magician.commands import AccessoryVersion
from dobot_async.simulator import simulate
from dobot_async.simulator.scene import Belt, Block, ColorSpot, LightBeam, Mount, PenTool, Piece, Place3, Scene

EXAMPLES = Path(__file__).parents[1] / "examples"
SHORT = 50  # an example has fewer lines
FAST = 20
V2 = AccessoryVersion.V2
SMALL = (20.0, 20.0, 20.0)


async def run(scene: Scene, name: str, *arguments: str, mount: Mount | None = None) -> list[str]:
    """Runs an example in a scene, and returns the lines that it printed."""
    async with simulate(scene=scene, mount=mount, listen="tcp://127.0.0.1:0", speed=FAST) as sim:
        async with Magician.connect(sim.url) as arm:
            await arm.home()

        command = [sys.executable, "-W", "error", str(EXAMPLES / name), sim.url, *arguments]
        done = await asyncio.to_thread(
            subprocess.run, command, capture_output=True, text=True, check=False, timeout=100
        )

    assert (done.returncode, done.stderr) == (0, "")
    assert not scene.crashes
    return done.stdout.splitlines()


@pytest.mark.parametrize(
    "name", ["color_sorter.py", "rail_pick_and_place.py", "svg_drawing.py", "teach_and_play.py", "palletise.py"]
)
def test_they_are_short(name: str) -> None:
    assert len((EXAMPLES / name).read_text(encoding="utf-8").splitlines()) < SHORT


@pytest.mark.full
async def test_the_sorter_puts_each_piece_into_the_box_of_its_colour() -> None:
    """The belt's top is 60 mm above the table, so that the cup, at arm z 0, touches a piece on it."""
    order = ("blue", "red", "green", "red")
    boxes = {"red": (120, -200), "green": (190, -150), "blue": (240, -60)}
    scene = Scene(
        pieces=[Piece(f"{color} {n}", (165 - 45 * n, 120), SMALL, color) for n, color in enumerate(order)],
        blocks=[Block(f"{color} box", place, (50, 50, 2)) for color, place in boxes.items()],
        belts=[Belt("belt", (100, 120), (320, 50, 58.5))],
        sensors=[
            LightBeam((230, 145, -70), (230, 95, -70), port=InfraredPort.GP4, version=V2),
            ColorSpot((200, -60, -138), (200, -60, -110), port=ColorPort.GP2, version=V2),
        ],
    )
    lines = await run(scene, "color_sorter.py")
    assert len(lines) == len(order)
    where = {name: piece.on for name, piece in scene.pieces.items()}
    assert where == {"blue 0": "blue box", "red 1": "red box", "green 2": "green box", "red 3": "red 1"}


@pytest.mark.full
async def test_the_rail_carries_each_piece_to_its_place() -> None:
    places = [(200, -60), (230, 0), (200, 60)]
    scene = Scene(pieces=[Piece(str(n), (x, y + 100)) for n, (x, y) in enumerate(places)])
    await run(scene, "rail_pick_and_place.py", mount=Mount(rail_yaw=90))
    for n, (x, y) in enumerate(places):
        assert scene.pieces[str(n)].position == pytest.approx((x, y + 700, -138), abs=0.1)


@pytest.mark.full
async def test_the_drawing_is_on_the_paper() -> None:
    """The pen has gone through each point of the path, and everywhere else was on its way between two."""
    board = Block("board", (230, 0), (100, 100, 38.5))
    scene = Scene(blocks=[board])
    path = "M 10 10 L 50 10 L 50 40 Z M 20 50 C 20 60 40 60 40 50"
    await run(scene, "svg_drawing.py", path, mount=Mount(tool=PenTool()))
    triangle, curve = scene.drawing
    corners = [(250, 20), (250, -20), (220, -20), (250, 20)]
    for corner in corners:
        assert distance(corner, [point[:2] for point in triangle]) < 0.2

    for x, y, z in triangle:
        assert min(off_line((x, y), a, b) for a, b in pairwise(corners)) < 0.2
        assert -99.6 < z < -98.9

    # The lowest point of the curve: three quarters of the way to its control points, 7.5 mm below its ends.
    assert distance((202.5, 0), [point[:2] for point in curve]) < 0.5
    assert length(triangle) == pytest.approx(40 + 30 + 50, abs=2)


@pytest.mark.full
async def test_what_was_taught_is_played_there_and_back(tmp_path: Path) -> None:
    scene = Scene(pieces=[Piece("red", (250, 0))])
    await run(scene, "teach_and_play.py", str(tmp_path / "taught.json"))
    ways = [(each.kind, round(each.place[1])) for each in scene.events]
    assert ways == [("picked", 0), ("dropped", 100), ("picked", 100), ("dropped", 0), ("picked", 0), ("dropped", 100)]
    assert scene.pieces["red"].position == pytest.approx((200, 100, -138), abs=0.1)


@pytest.mark.full
async def test_parts_are_stacked_by_their_colour() -> None:
    colors = ("red", "blue", "red", "green", "red", "blue")
    places = [(x, y) for x in (230, 270) for y in (-20, 0, 20)]
    small = (18.0, 18.0, 25.0)
    scene = Scene(
        pieces=[
            Piece(f"{n} {color}", at, small, color) for n, (color, at) in enumerate(zip(colors, places, strict=True))
        ],
        sensors=[ColorSpot((200, -60, -138), (200, -60, -110), port=ColorPort.GP2, version=V2)],
    )
    lines = await run(scene, "palletise.py")
    assert [line.rpartition(" ")[2] for line in lines] == list(colors)
    stacks = [
        [(120, 180, -138), (160, 180, -138), (120, 180, -113)],
        [(120, -220, -138), (160, -220, -138), (120, -220, -113)],
    ]
    for names, stack in ((("0 red", "2 red", "4 red"), stacks[0]), (("1 blue", "3 green", "5 blue"), stacks[1])):
        assert [scene.pieces[name].position for name in names] == [pytest.approx(place, abs=0.1) for place in stack]


MARKS = [(170, -120), (170, 120), (290, -120), (290, 120), (230, 0), (200, 60), (260, -60)]


def seen(x: float, y: float) -> tuple[float, float]:
    """Where a camera that looks aslant from behind the table sees a place on it, pixels."""
    away = 1 + (x - 230) / 900 + y / 4000
    return 320 + (y * 2.1 - (x - 230) * 0.1) / away, 240 + ((x - 230) * 1.9 + y * 0.05) / away


@pytest.mark.full
async def test_what_a_camera_sees_is_sorted_by_its_colour(tmp_path: Path) -> None:
    """The picture is drawn as the camera sees the tops of the parts; marks were touched and noted to a pixel."""
    parts = {
        "r1": ("red", (210, -70)),
        "b1": ("blue", (260, 20)),
        "r2": ("red", (275, 80)),
        "b2": ("blue", (190, 40)),
        "g1": ("green", (240, -30)),
    }
    sheet = Image.new("RGB", (640, 480), (190, 185, 175))
    pen = ImageDraw.Draw(sheet)
    for color, (x, y) in parts.values():
        corners = [seen(x + dx * 9, y + dy * 9) for dx, dy in ((-1, -1), (-1, 1), (1, 1), (1, -1))]
        pen.polygon(corners, fill={"red": (210, 40, 45), "blue": (35, 60, 205), "green": (40, 170, 60)}[color])

    random = Random(5)
    noise = bytes(random.randrange(256) for _ in range(640 * 480 * 3))
    sheet = Image.blend(sheet, Image.frombytes("RGB", sheet.size, noise), 0.08)
    pairs = [[*(round(pixel) for pixel in seen(x, y)), x, y] for x, y in MARKS]
    picture, calibration = tmp_path / "table.png", tmp_path / "marks.json"
    sheet.save(picture)
    calibration.write_text(json.dumps(pairs), encoding="utf-8")
    scene = Scene(pieces=[Piece(name, at, (18.0, 18.0, 25.0), color) for name, (color, at) in parts.items()])
    lines = await run(scene, "camera_sorter.py", str(picture), str(calibration))
    assert float(lines[0].split()[-2]) < 1.0
    assert len(lines) == 5
    assert {scene.pieces[name].position[2] for name in parts} == {-138}
    for names, (x, y) in (({"r1", "r2"}, (150, 170)), ({"b1", "b2"}, (150, -210))):
        stack = sorted(scene.pieces[name].position[:2] for name in names)
        assert stack == [pytest.approx(place, abs=1.0) for place in ((x, y), (x + 40, y))]

    assert scene.pieces["g1"].position == pytest.approx((240, -30, -138), abs=0.01)


def distance(place: tuple[float, float], points: list[tuple[float, float]]) -> float:
    return min(math.dist(place, point) for point in points)


def off_line(place: tuple[float, float], a: tuple[float, float], b: tuple[float, float]) -> float:
    """How far a place is from the line between two others."""
    way = math.dist(a, b)
    share = ((place[0] - a[0]) * (b[0] - a[0]) + (place[1] - a[1]) * (b[1] - a[1])) / way**2
    share = min(max(share, 0.0), 1.0)
    return math.dist(place, (a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])))


def length(stroke: tuple[Place3, ...]) -> float:
    """How long a stroke is on the paper."""
    return sum(math.dist(a[:2], b[:2]) for a, b in pairwise(stroke))
