"""Files made for the purpose, each compared with what somebody else reads of it: svgpathtools, ezdxf, a rasteriser."""

from __future__ import annotations

import cmath
import io
import logging
import math
from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise

import ezdxf
import numpy as np
import pytest
from ezdxf import disassemble
from geometry import FILES, Line, apart, lines_of
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image, ImageChops, ImageDraw, ImageFilter, ImageOps
from quick_suite import examples

from dobot_async.toolpath import (
    Toolpath,
    ToolpathFileError,
    read_dxf,
    read_gcode,
    read_picture,
    read_svg,
    trace_picture,
    write_text,
)
from dobot_async.toolpath.outlines import outlines

CLOSE = 0.05  # mm
PX = 25.4 / 96
READERS: dict[str, Callable[..., Toolpath]] = {
    ".svg": read_svg,
    ".dxf": read_dxf,
    ".nc": read_gcode,
    ".png": read_picture,
}


def wrong(read: Callable[[], Toolpath]) -> ToolpathFileError | None:
    """What a reader raises, None if it reads."""
    try:
        read()
    except ToolpathFileError as error:
        return error

    return None


def by_svgpathtools(name: str, scale: float, height: float, start: tuple[float, float] = (0, 0)) -> list[Line]:
    """What svgpathtools reads, which knows groups and transforms; of the viewBox it is told scale and height in mm."""
    import svgpathtools  # SciPy comes with it, and takes half a second

    found: list[Line] = []
    for path in svgpathtools.Document(str(FILES / name)).paths():
        for part in path.continuous_subpaths():
            shares = [(segment, i / 400) for segment in part for i in range(401)]
            found.append(
                [
                    ((p.real - start[0]) * scale, height - (p.imag - start[1]) * scale)
                    for p in (segment.point(share) for segment, share in shares)
                ]
            )

    return found


@pytest.mark.full
@pytest.mark.parametrize(("name", "scale", "height"), [("shapes.svg", 0.5, 80.0), ("paths.svg", PX, 100 * PX)])
def test_svg_is_what_svgpathtools_reads(name: str, scale: float, height: float) -> None:
    assert apart(lines_of(read_svg(FILES / name)), by_svgpathtools(name, scale, height)) < CLOSE


def test_svg_has_the_layers_of_its_groups() -> None:
    path = read_svg(FILES / "shapes.svg")
    assert path.layers == ("frame", "round", "straight")
    assert path.only("frame").bounds == pytest.approx((5, 5, 115, 75))


def test_hidden_elements_are_left_out_and_text_is_told(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING, "dobot_async.toolpath"):
        path = read_svg(FILES / "hidden.svg")

    assert apart(lines_of(path), [[(5, y), (45, y)] for y in (45, 5, 25)]) < 1e-6
    assert len(path) == 3
    assert [record.getMessage() for record in caplog.records] == ["line 16: <text> is not drawn: convert it to paths"]


def test_uses_symbols_and_viewports_are_where_they_belong() -> None:
    # 400 x 100 units in 101.6 x 50.8 mm, to the left and at the bottom: 0.254 mm each, the units end at y = 0.
    def at(x: float, y: float) -> tuple[float, float]:
        return x * 0.254, (100 - y) * 0.254

    expected = [
        [at(100, 50), at(120, 50), at(120, 60), at(100, 60), at(100, 50)],
        [at(200, 20), at(200, 40), at(190, 40), at(190, 20), at(200, 20)],
        [at(300, 10), at(340, 50)],
        [at(112.5, 0), at(137.5, 50)],
    ]
    path = read_svg(FILES / "uses.svg")
    assert apart(lines_of(path), expected) < 1e-6
    assert path.layers == ("copies", "")


@pytest.mark.parametrize(
    ("width", "mm"),
    [("10mm", 10), ("1cm", 10), ("1in", 25.4), ("72pt", 25.4), ("6pc", 25.4), ("96", 25.4), ("96px", 25.4)],
)
def test_units_of_a_page(width: str, mm: float) -> None:
    page = f'width="{width}" height="{width}" viewBox="0 0 1 1"'
    text = f'<svg xmlns="http://www.w3.org/2000/svg" {page}><path d="M0 0H1V1"/></svg>'
    assert read_svg(io.StringIO(text)).bounds == pytest.approx((0, 0, mm, mm))


@pytest.mark.full
@settings(max_examples=examples(60), deadline=None)
@given(st.lists(st.complex_numbers(max_magnitude=100), min_size=4, max_size=4), st.floats(0.002, 1))
def test_curves_are_missed_by_no_more_than_the_tolerance(controls: Sequence[complex], tolerance: float) -> None:
    data = "M{} {}C{} {} {} {} {} {}".format(*(f"{n:.4f}" for c in controls for n in (c.real, c.imag)))
    page = 'width="100mm" height="100mm" viewBox="0 0 100 100"'
    text = f'<svg xmlns="http://www.w3.org/2000/svg" {page}><path d="{data}"/></svg>'
    import svgpathtools

    curve = svgpathtools.parse_path(data)[0]
    fine: list[Line] = [[((p := curve.point(i / 500)).real, 100 - p.imag) for i in range(501)]]
    assert apart(fine, lines_of(read_svg(io.StringIO(text), tolerance=tolerance)), step=1.0) <= tolerance + 0.02


def by_ezdxf(name: str, scale: float, layers: set[str]) -> list[Line]:
    """The primitives of ezdxf's own renderer, ten times as fine."""
    document = ezdxf.readfile(FILES / name)  # type: ignore[attr-defined]
    entities = (
        entity
        for entity in disassemble.recursive_decompose(document.modelspace())
        if entity.dxf.layer in layers and not entity.dxf.get("invisible", 0) and entity.dxftype() != "TEXT"
    )
    found: list[Line] = []
    for primitive in disassemble.to_primitives(entities, max_flattening_distance=0.001):
        points = [(v.x * scale, v.y * scale) for v in primitive.vertices()]
        found.append(points if len(points) > 1 else points * 2)

    return found


@pytest.mark.full
@pytest.mark.parametrize(
    ("name", "scale", "layers"), [("entities.dxf", 1.0, {"cut", "engrave", "0"}), ("blocks_inch.dxf", 25.4, {"0"})]
)
def test_dxf_is_what_ezdxf_draws(name: str, scale: float, layers: set[str]) -> None:
    assert apart(lines_of(read_dxf(FILES / name)), by_ezdxf(name, scale, layers)) < CLOSE


def test_dxf_has_its_layers_and_a_unit_may_be_given(caplog: pytest.LogCaptureFixture) -> None:
    path = read_dxf(FILES / "entities.dxf")
    assert set(path.layers) == {"cut", "engrave", "0"}
    assert [len(stroke.points) for stroke in path.only("0")] == [1]  # POINT
    assert "TEXT" in caplog.text
    assert read_dxf(FILES / "entities.dxf", unit=25.4).length == pytest.approx(25.4 * path.length, rel=1e-3)


def test_dxf_may_be_binary() -> None:
    data = io.BytesIO()
    ezdxf.readfile(FILES / "entities.dxf").write(data, fmt="bin")  # type: ignore[attr-defined]
    assert len(read_dxf(io.BytesIO(data.getvalue()))) == len(read_dxf(FILES / "entities.dxf"))


def curve(centre: complex, start: complex, degrees: float) -> Line:
    """A fine arc."""
    turned = (centre + (start - centre) * cmath.exp(1j * math.radians(degrees * i / 500)) for i in range(501))
    return [(p.real, p.imag) for p in turned]


def test_a_program_of_lasergrbl() -> None:
    path = read_gcode(FILES / "lasergrbl.nc")
    assert [stroke.speed for stroke in path] == [20, 20]
    first, second = path
    assert list(first.points) == [(10, 10), (30, 10), (40, 10)]
    assert list(first.powers) == [25, 25, 100]
    expected = [[(0, 20), (0, 30)], curve(10 + 30j, 30j, -90), curve(10 + 50j, 10 + 40j, 90)]
    assert second.power == 50
    assert apart([second.points], expected) < CLOSE


def test_a_program_of_inkscape_in_inches_with_a_pen_on_z() -> None:
    path = read_gcode(FILES / "inkscape.nc")
    line = [(25.4, 25.4), (50.8, 25.4)]
    assert apart([path.strokes[0].points], [line, curve(50.8 + 0j, 50.8 + 25.4j, -90)]) < CLOSE
    assert path.strokes[0].speed == pytest.approx(400 * 25.4 / 60)
    assert list(path.strokes[1].points) == [(12.7, 12.7)]
    assert len(path) == 2


def test_a_program_of_luban_with_crlf_and_increments() -> None:
    (stroke,) = read_gcode(FILES / "luban.nc", full_power=255)
    assert list(stroke.points) == [(5, 5), (15, 5), (15, 15), (5, 15), (5, 5)]
    assert stroke.power == 50


def test_a_program_of_the_ultraarms_vendor() -> None:
    (stroke,) = read_gcode(FILES / "ultraarm.nc")
    assert list(stroke.points) == [(200, 0), (210, 0), (210, 10), (200, 10)]
    assert list(stroke.powers) == [20, 20, 20, 100]
    assert stroke.speed == 25


@pytest.mark.parametrize(
    ("program", "line", "reason"),
    [
        ("G1 X1\nG1 X1.2.3", 2, "no word"),
        ("G1 X1\nG1 X", 2, "no word"),
        ("G2 X5 Y5", 1, "I and J"),
        ("G2 X50 Y0 R5", 1, "too small"),
        ("G2 X50 Y0 I5 J5", 1, "ends are"),
        ("G18", 1, "plane"),
        ("G1 X1 F0", 1, "above 0"),
        ("X5", 1, "without G0"),
        ("M3 S2000", 1, "full_power"),
        ("; a comment\x0cG1 X5\nG77", 2, "not known"),
    ],
)
def test_a_line_that_is_wrong_is_named(program: str, line: int, reason: str) -> None:
    with pytest.raises(ToolpathFileError, match=reason) as caught:
        read_gcode(io.StringIO(program))

    assert caught.value.place == f"line {line}"


@settings(max_examples=examples(200))
@given(st.text(st.sampled_from("GXYZIJRMSFN0123456789.-+ ();%\n\r\f\x85"), max_size=80))
def test_any_text_is_a_program_or_names_a_line(text: str) -> None:
    found = wrong(lambda: read_gcode(io.StringIO(text)))
    assert found is None or found.place.startswith("line ")


@pytest.mark.parametrize(
    ("name", "place", "reason"),
    [
        ("broken_xml.svg", "line 4", "mismatched tag"),
        ("broken_path.svg", "line 3", "C has too few numbers at character 20"),
        ("broken.dxf", "line 1", "Invalid tag"),
        ("broken.nc", "line 5", "column 6: 'O Y10'"),
        ("broken.png", "within 627 bytes", "truncated"),
    ],
)
def test_a_broken_file_is_one_error_with_its_place(name: str, place: str, reason: str) -> None:
    with pytest.raises(ToolpathFileError, match=reason) as caught:
        READERS[(FILES / name).suffix](FILES / name)

    assert str(caught.value).startswith(f"{name}: {place}")
    assert caught.value.file == name


@pytest.mark.parametrize("name", ["shapes.svg", "uses.svg", "entities.dxf", "shapes.png"])
def test_a_file_that_is_cut_anywhere_is_one_error_or_less_of_it(name: str) -> None:
    data = (FILES / name).read_bytes()
    for end in range(0, len(data), max(1, len(data) // 40)):
        found = wrong(partial(READERS[(FILES / name).suffix], io.BytesIO(data[:end])))
        assert found is None or found.reason


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ('<use href="#nothing"/>', "not in the file"),
        ('<g id="a"><use href="#a"/></g>', "uses itself"),
        ('<rect width="5q5" height="1"/>', "no length"),
        ('<polygon points="1,2,3"/>', "pairs"),
        ('<g transform="turn(3)"><rect width="1" height="1"/></g>', "not understood"),
        ('<path d="M0 0 L1e999 0"/>', "finite"),
        ('<path d="0 0 L1 0"/>', "begin with M"),
        ('<path d="M0 0 A1 1 0 2 0 5 5"/>', "no path data"),
        ('<svg viewBox="0 0 0 5"/>', "above 0"),
        ('<svg viewBox="0 0 5"/>', "4 numbers"),
    ],
)
def test_what_is_wrong_in_svg_is_named_with_its_line(body: str, reason: str) -> None:
    text = f'<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9">\n\n{body}</svg>'
    with pytest.raises(ToolpathFileError, match=reason) as caught:
        read_svg(io.StringIO(text))

    assert caught.value.place == "line 3"


@pytest.mark.full
def test_uses_that_multiply_are_refused() -> None:
    bombs = "".join(f'<g id="g{n}">{f"""<use href="#g{n + 1}"/>""" * 10}</g>' for n in range(8))
    bombs += '<g id="g8"><path d="M0 0H1"/></g>'
    text = f'<svg xmlns="http://www.w3.org/2000/svg"><defs>{bombs}</defs><use href="#g0"/></svg>'
    with pytest.raises(ToolpathFileError, match="more elements"):
        read_svg(io.StringIO(text))


def picture(name: str, size: tuple[int, int]) -> Image.Image:
    """The grey picture on white, so large."""
    with Image.open(FILES / name) as found:
        upright = ImageOps.exif_transpose(found).convert("RGBA")

    paper = Image.new("RGBA", upright.size, "white")
    return Image.alpha_composite(paper, upright).convert("L").resize(size, Image.Resampling.BOX)


def rasterised(path: Toolpath, size: tuple[float, float], line: float, fine: int = 40) -> Image.Image:
    """What a round pen of a width leaves on paper, `fine` pixels to the mm, seen with ten to the mm."""
    paper = Image.new("L", (round(size[0] * fine), round(size[1] * fine)), 255)
    pen = ImageDraw.Draw(paper)
    r = line * fine / 2
    for stroke in path:
        places = [(x * fine, (size[1] - y) * fine) for x, y in stroke.points]
        for x, y in places:
            pen.ellipse((x - r, y - r, x + r - 1, y + r - 1), fill=0)
        for (ax, ay), (bx, by) in pairwise(places):
            if ay == by:
                pen.rectangle((min(ax, bx), ay - r, max(ax, bx) - 1, ay + r - 1), fill=0)
            else:
                pen.line((ax, ay, bx, by), fill=0, width=round(2 * r))

    return paper.resize((round(size[0] * 10), round(size[1] * 10)), Image.Resampling.BOX)


def difference(a: Image.Image, b: Image.Image, blur: float) -> float:
    """The greatest difference of two pictures seen from afar, 0 to 1."""
    soft = [ImageFilter.GaussianBlur(blur), ImageFilter.GaussianBlur(blur)]
    return float(np.asarray(ImageChops.difference(a.filter(soft[0]), b.filter(soft[1]))).max()) / 255


def test_a_threshold_draws_what_is_dark() -> None:
    path = read_picture(FILES / "shapes.png", width=60, shading="threshold", line=0.2)
    black = picture("shapes.png", (600, 400)).point(lambda value: 0 if value <= 127 else 255)
    assert difference(rasterised(path, (60, 40), 0.2), black, 8) < 0.2
    assert path.bounds.right < 60


@pytest.mark.parametrize("shading", ["floyd-steinberg", "atkinson", "halftone"])
def test_dithers_are_as_dark_as_the_picture(shading: str) -> None:
    path = read_picture(FILES / "shapes.png", width=60, shading=shading, line=0.2, cell=1.5)  # type: ignore[arg-type]
    drawn = np.asarray(rasterised(path, (60, 40), 0.2)) / 255
    given_ = np.asarray(picture("shapes.png", (600, 400))) / 255
    for box in ((slice(310, 350), slice(150, 450)), (slice(70, 110), slice(340, 380)), (slice(0, 40), slice(0, 600))):
        # Atkinson's leaves out a quarter of the error, so that it is lighter in the middle tones.
        assert drawn[box].mean() == pytest.approx(given_[box].mean(), abs=0.25 if shading == "atkinson" else 0.12)


def test_grey_is_a_power() -> None:
    path = read_picture(FILES / "shapes.png", width=60, shading="grey", line=0.5)
    (middle,) = [stroke for stroke in path if stroke.start[1] == 6.75]
    assert [round(power) for power in middle.powers] == [50, 50, 25]  # the last pixel lies half on the rectangle
    assert max(p for stroke in path for p in stroke.powers) == 100


def test_pictures_are_turned_as_their_camera_says() -> None:
    path = read_picture(FILES / "gradient.jpg", width=32, shading="grey", line=1)
    assert path.bounds.height == pytest.approx(63, abs=2)  # it lies on its side in the file


def test_outlines_enclose_what_is_dark() -> None:
    path = trace_picture(FILES / "shapes.png", width=60, threshold=0.6)
    assert [stroke.closed for stroke in path] == [True] * len(path)
    filled = Image.new("1", (600, 400), 1)
    for stroke in path:
        layer = Image.new("1", filled.size, 0)
        ImageDraw.Draw(layer).polygon([(x * 10, (40 - y) * 10) for x, y in stroke.points], fill=1)
        filled = ImageChops.logical_xor(filled, layer)

    black = picture("shapes.png", (600, 400)).point(lambda value: 0 if value <= 102 else 255)
    assert difference(filled.convert("L"), black, 6) < 0.5
    assert float(np.abs(np.asarray(filled, dtype=float) - np.asarray(black) / 255).mean()) < 0.01


def test_text_is_as_high_as_asked_and_stands_on_its_line() -> None:
    path = write_text("HE\nHE", 10, line_spacing=2)
    assert path.bounds[1::2] == pytest.approx((-20, 10))
    assert path.bounds.left >= 0
    right = write_text("HELLO\nE", 10, align="right").bounds
    assert right.right <= 0
    centre = write_text("HH", 10, align="centre").bounds
    assert centre.left == pytest.approx(-centre.right)
    assert write_text("A A", 10, letter_spacing=3).bounds.width == pytest.approx(write_text("A A", 10).bounds.width + 6)


@pytest.mark.parametrize(
    ("text", "options", "reason"), [("ü", {}, "ü"), ("a", {"font": "x"}, "futural"), ("a", {"height": 0}, "above 0")]
)
def test_text_that_cannot_be_written_is_refused(text: str, options: dict[str, object], reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        write_text(text, **options)  # type: ignore[arg-type]


@settings(max_examples=80, deadline=None)
@given(
    st.lists(st.lists(st.integers(0, 4), min_size=1, max_size=9), min_size=1, max_size=9), st.sampled_from([1, 3, 5, 7])
)
def test_outlines_are_closed_and_enclose_what_a_flood_finds(rows: list[list[int]], level: int) -> None:
    """As many lines as there are spots and holes, by an independent flood fill of a picture enlarged by pixels."""
    width = max(map(len, rows))
    dark = np.array([[*row, *[0] * (width - len(row))] for row in rows]) / 4
    lines = list(outlines(dark, level / 8))
    assert all(line[0] == line[-1] and len(line) >= 4 for line in lines)
    ends = [start for line in lines for start in line[:-1]]
    assert len(set(ends)) >= len(ends) - 2 * len(lines)  # no way is gone twice
    inside = np.array([[odd(lines, x + 0.5, y + 0.5) for x in range(width)] for y in range(len(rows))])
    assert (inside == (dark >= level / 8)).all()


def odd(lines: list[list[tuple[float, float]]], x: float, y: float) -> bool:
    """Whether a place is enclosed, by the number of lines to its right."""
    y += 1e-7
    crossed = 0
    for line in lines:
        for (ax, ay), (bx, by) in pairwise(line):
            if (ay > y) != (by > y) and x <= ax + (bx - ax) * (y - ay) / (by - ay):
                crossed += 1

    return crossed % 2 == 1


@pytest.mark.parametrize("smooth", [0, 1.0])
def test_outlines_are_where_a_rasteriser_was_told_to_draw(smooth: float) -> None:
    """A disc and a slanting bar, drawn 16 times as fine and made small: 0.1 mm a pixel, found to half of that."""
    fine, size = 16, (400, 300)
    sheet = Image.new("L", (size[0] * fine, size[1] * fine), 255)
    pen = ImageDraw.Draw(sheet)
    disc, bar = ((120, 150), 80), [(240, 40), (380, 120), (360, 155), (220, 75)]
    (cx, cy), r = disc
    pen.ellipse([(cx - r) * fine, (cy - r) * fine, (cx + r) * fine, (cy + r) * fine], fill=0)
    pen.polygon([(x * fine, y * fine) for x, y in bar], fill=0)
    stream = io.BytesIO()
    sheet.resize(size, Image.Resampling.BOX).save(stream, "PNG")
    stream.seek(0)
    path = trace_picture(stream, width=40, smooth=smooth)
    circle = [(cx + r * math.cos(i / 500 * math.tau), cy + r * math.sin(i / 500 * math.tau)) for i in range(501)]
    expected = [[(x / 10, 30 - y / 10) for x, y in line] for line in (circle, [*bar, bar[0]])]
    assert len(path) == 2
    assert apart(lines_of(path), expected) < (CLOSE if smooth == 0 else 2 * CLOSE)  # a blur rounds corners
    assert path.points < 400


def test_specks_are_left_out_and_holes_are_drawn() -> None:
    sheet = Image.new("L", (60, 60), 255)
    pen = ImageDraw.Draw(sheet)
    pen.rectangle((10, 10, 49, 49), fill=0)
    pen.rectangle((20, 20, 39, 39), fill=255)
    pen.point((2, 2), fill=0)
    for speckle, count in ((2, 2), (0, 3)):
        stream = io.BytesIO()
        sheet.save(stream, "PNG")
        stream.seek(0)
        path = trace_picture(stream, width=60, smooth=0, speckle=speckle)
        assert len(path) == count
        assert max(stroke.bounds.right for stroke in path) == pytest.approx(50)

    for options, why in (({"smooth": 30}, "smooth"), ({"speckle": -1}, "speckle"), ({"threshold": 1}, "threshold")):
        with pytest.raises(ValueError, match=why):
            trace_picture(stream, **options)
