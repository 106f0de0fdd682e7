"""Pictures of toolpaths, looked at pixel by pixel and element by element; and what is said of a missing library."""

from __future__ import annotations

import io
import re
import subprocess
import sys
from pathlib import Path
from typing import cast
from xml.etree import ElementTree as ET

import pytest
from PIL import Image

from dobot_async import Kinematics
from dobot_async.toolpath import Toolpath, WorkPlane, preview, reachable

PATH = Toolpath.of([(0, 0), (40, 0)], [(40, 30), (0, 30)], [(80, 0), (80, 30)], [(60, 15)])
SECTOR = [(-10.0, -10.0), (70.0, -10.0), (70.0, 40.0), (-10.0, 40.0)]
NAME = "{http://www.w3.org/2000/svg}"


def elements(text: str, name: str) -> list[ET.Element]:
    return [each for each in ET.fromstring(text).iter() if each.get("class") == name]


def test_svg_has_strokes_in_the_colours_of_their_order_and_dashed_travel() -> None:
    text = preview(PATH).svg()
    strokes = elements(text, "stroke")
    colours = [each.get("stroke") or each.get("fill") for each in strokes]
    assert len(set(colours)) == 4
    assert [each.tag.removeprefix(NAME) for each in strokes] == ["polyline", "polyline", "polyline", "circle"]
    travel = elements(text, "travel")
    assert len(travel) == 3
    assert all(each.get("stroke-dasharray") for each in travel)
    assert not elements(text, "reach")
    assert not elements(text, "unreachable")


def test_the_legend_tells_lengths_and_time() -> None:
    text = preview(PATH, seconds=125.7, reachable=SECTOR).svg()
    assert re.search(r"4 strokes, 110 mm drawn, \d+ mm travelled, 2:05 min; 30 mm out of reach<", text)


def test_a_polygon_is_shaded_and_what_is_outside_is_red() -> None:
    text = preview(PATH, reachable=SECTOR).svg()
    assert len(elements(text, "reach")) == 1
    (red,) = elements(text, "unreachable")
    assert len((red.get("points") or "").split()) == 2


def test_the_reach_of_an_arm_is_shaded() -> None:
    plane = WorkPlane.flat(200, -40, -50)
    picture = preview(
        PATH.scale(4), reachable=reachable(Kinematics(61), plane), bounds=(-300, -300, 200, 300), width=400
    )
    text = picture.svg()
    assert len(elements(text, "reach")) > 50
    assert elements(text, "unreachable")
    shown = Image.open(io.BytesIO(picture.png()))
    assert shown.size == (400, 400 * 600 // 500 + 34)
    assert shown.getpixel((398, 2)) == (255, 255, 255)
    assert shown.getpixel((256, 208)) == (228, 243, 228)


def test_png_shows_what_svg_shows() -> None:
    picture = preview(PATH, reachable=SECTOR, bounds=(-10, -10, 90, 40), width=500)
    shown = Image.open(io.BytesIO(picture.png())).convert("RGB")
    assert shown.size == (500, 250 + 34)

    def at(x: float, y: float) -> tuple[int, int, int]:
        return cast("tuple[int, int, int]", shown.getpixel((round((x + 10) * 5), round((40 - y) * 5))))

    assert at(80, 15)[0] > 180
    assert at(80, 15)[1] < 120
    assert at(20, 0)[2] > 120  # blue is first
    assert at(30, 15) == (228, 243, 228)
    assert at(85, 35) == (255, 255, 255)
    legend = shown.crop((0, 252, 500, 284)).convert("L")
    assert legend.getextrema()[0] < 120  # type: ignore[operator]


def test_it_is_saved_by_the_name_of_the_file(tmp_path: Path) -> None:
    picture = preview(PATH)
    picture.save(tmp_path / "a.svg")
    picture.save(tmp_path / "a.PNG")
    assert (tmp_path / "a.svg").read_text() == picture.svg()
    assert (tmp_path / "a.PNG").read_bytes().startswith(b"\x89PNG")
    with pytest.raises(ValueError, match="saved as"):
        picture.save(tmp_path / "a.gif")


@pytest.mark.parametrize(
    "options",
    [{"width": 0}, {"bounds": (0, 0, 0, 1)}, {"reachable": [(0, 0), (1, 1)]}, {"bounds": (0, 0, float("inf"), 1)}],
)
def test_what_makes_no_picture_is_refused(options: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=r"."):
        preview(PATH, **options)  # type: ignore[arg-type]

    with pytest.raises(ValueError, match="nothing to show"):
        preview(Toolpath())


@pytest.mark.cases(1)
@pytest.mark.parametrize(
    ("library", "call"),
    [
        ("svgelements", "read_svg(io.StringIO('<svg/>'))"),
        ("ezdxf", "read_dxf(io.StringIO(''))"),
        ("PIL", "read_picture(io.BytesIO())"),
        ("numpy", "trace_picture(io.BytesIO())"),
        ("HersheyFonts", "write_text('a')"),
        ("PIL", "preview(Toolpath.of([(0, 0), (1, 1)])).png()"),
    ],
)
def test_a_missing_library_is_an_import_error_that_names_the_extra(library: str, call: str) -> None:
    program = (
        f"import io, sys; sys.modules[{library!r}] = None\n"
        "from dobot_async.toolpath import *\n"
        f"try: {call}\n"
        "except MissingLibrary as error: print(isinstance(error, ImportError), error)\n"
    )
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=True)
    assert ran.stdout.startswith(f"True {library}")
    assert "pip install 'dobot-async[draw]'" in ran.stdout


@pytest.mark.full
def test_what_needs_no_library_works_without_the_extra() -> None:
    missing = ("svgelements", "ezdxf", "PIL", "HersheyFonts", "numpy")
    program = (
        f"import io, sys; sys.modules.update(dict.fromkeys({missing!r}))\n"
        "from dobot_async.toolpath import *\n"
        "from dobot_async.calibration import Calibration\n"
        "path = read_gcode(io.StringIO('G1 X10 Y10')).order().simplify(0.1)\n"
        "print(len(preview(path).svg()) > 100, estimate(path, WorkPlane.flat(200, 0, 0)).seconds > 0)\n"
    )
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=True)
    assert ran.stdout == "True True\n"
