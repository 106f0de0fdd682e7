"""Pictures as toolpaths: lines across, drawn where the picture is dark, or dots that are larger where it is darker.

    file --grey, scaled to lines--> rows of darkness, 0 to 1 --threshold, dither--> runs of black --> strokes
                                                             --grey-->  strokes with a power at each point
                                                             --halftone--> filled circles

One row of the scaled picture is one line of the pen, so that a pixel is as large as the pen is wide.
"""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Literal, SupportsFloat

from dobot_async._core.util.arguments import check_choice, to_float
from dobot_async.toolpath.errors import ToolpathFileError, library
from dobot_async.toolpath.sources import Source, content, name_of
from dobot_async.toolpath.stroke import FULL, Point, Stroke
from dobot_async.toolpath.toolpath import Toolpath

if TYPE_CHECKING:
    from PIL.Image import Image

__all__ = ["Darkness", "Shading", "darkness", "open_picture", "read_picture", "size_of"]

Darkness = list[list[float]]
"""Rows from top to bottom, each pixel 0 (white) to 1 (black)."""

Shading = Literal["threshold", "floyd-steinberg", "atkinson", "grey", "halftone"]
MOST = 4_000_000  # pixels of a scaled picture
LARGEST = 50_000_000  # pixels of a file
LEVELS = 32  # of power
FAINT = 0.5 / LEVELS
SQUARE_ROOT_2 = math.sqrt(2)


def read_picture(
    source: Source,
    *,
    width: SupportsFloat | None = None,
    height: SupportsFloat | None = None,
    shading: Shading = "floyd-steinberg",
    line: SupportsFloat = 0.4,
    threshold: SupportsFloat = 0.5,
    cell: SupportsFloat = 2.0,
) -> Toolpath:
    """Read a picture (PNG, JPEG, ...) as strokes that shade it; `trace_picture` draws its outlines.

    Args:
        source: The path of a file, or a stream.
        width: mm; by default what `height` and the picture's proportions make it, or 100 mm.
        height: mm; by default what `width` and the picture's proportions make it.
        shading: "threshold": black where it is darker than `threshold`; "floyd-steinberg", "atkinson": dithered;
            "grey": by the power at each point, for lasers; "halftone": dots in a grid that is turned by 45 degrees.
        line: mm between two lines: as wide as the pen or the laser's spot.
        threshold: The darkness, 0 to 1, from which on a pixel is black.
        cell: mm between two dots of a halftone.

    Returns:
        A toolpath in mm, with the picture's lower left corner at the origin. Lines go to and fro.

    Raises:
        ToolpathFileError: The file is broken, or no picture.
        ValueError: An argument is out of range, or the picture has more lines than a drawing.
        MissingLibrary: The extra `draw` is not installed.
    """
    check_choice("shading", shading, *SHADINGS)
    name = name_of(source)
    pitch, spot = positive(line, "line"), positive(cell, "cell")
    limit = to_float(threshold, "threshold")
    if not 0 < limit < 1:
        raise ValueError(f"threshold must be between 0 and 1, not {threshold!r}")

    picture = open_picture(source, name)
    size = size_of(picture, width, height)
    columns, rows = (max(1, round(side / pitch)) for side in size)
    if columns * rows > MOST:
        raise ValueError(f"{columns} x {rows} pixels are too many for a drawing: give a larger line, or a smaller size")

    if shading == "halftone":
        return Toolpath(tuple(halftone(picture, size, spot, pitch)))

    dark = darkness(picture, columns, rows)
    scale = size[0] / columns, size[1] / rows
    strokes = grey(dark, scale) if shading == "grey" else runs(SHADINGS[shading](dark, limit), scale)
    return Toolpath(tuple(strokes))


def open_picture(source: Source, name: str) -> Image:
    """Return a picture as grey on white, upright; raise ToolpathFileError if it is none."""
    with library():
        from PIL import Image, ImageOps, UnidentifiedImageError

    data = content(source)
    try:
        with Image.open(io.BytesIO(data)) as picture:
            if picture.width * picture.height > LARGEST:
                raise ToolpathFileError(name, "", f"{picture.width} x {picture.height} pixels are too many")

            upright = ImageOps.exif_transpose(picture).convert("RGBA")
    except UnidentifiedImageError:
        raise ToolpathFileError(name, "byte 0", "this is no picture that Pillow knows") from None
    except (OSError, SyntaxError, ValueError, EOFError, Image.DecompressionBombError) as error:
        if isinstance(error, ToolpathFileError):
            raise

        raise ToolpathFileError(name, f"within {len(data)} bytes", f"the picture is broken: {error}") from None

    paper = Image.new("RGBA", upright.size, "white")
    return Image.alpha_composite(paper, upright).convert("L")


def size_of(picture: Image, width: SupportsFloat | None, height: SupportsFloat | None) -> tuple[float, float]:
    """Return width and height in mm, with the picture's proportions where one is not given."""
    ratio = picture.height / picture.width
    up = None if height is None else positive(height, "height")
    if width is None:
        return (100.0, 100.0 * ratio) if up is None else (up / ratio, up)

    across = positive(width, "width")
    return across, across * ratio if up is None else up


def darkness(picture: Image, columns: int, rows: int) -> Darkness:
    """Return a picture's darkness at so many pixels."""
    from PIL import Image

    data = picture.resize((columns, rows), Image.Resampling.BOX).tobytes()
    return [[1 - value / 255 for value in data[row * columns : (row + 1) * columns]] for row in range(rows)]


def positive(value: SupportsFloat, name: str) -> float:
    """A length above 0."""
    found = to_float(value, name)
    if not 0 < found < math.inf:
        raise ValueError(f"{name} must be above 0 mm and finite, not {value!r}")

    return found


def by_threshold(dark: Darkness, limit: float) -> Darkness:
    """Black where it is dark enough."""
    return [[float(value >= limit) for value in row] for row in dark]


def diffused(weights: Mapping[tuple[int, int], float]) -> Callable[[Darkness, float], Darkness]:
    """Dithering: what a pixel is too dark or too light is made good by those to its right and below."""

    def dither(dark: Darkness, limit: float) -> Darkness:
        values = [list(row) for row in dark]
        width = len(values[0])
        for y, row in enumerate(values):
            for x, value in enumerate(row):
                row[x] = float(value >= limit)
                error = value - row[x]
                for (right, below), weight in weights.items():
                    if 0 <= x + right < width and y + below < len(values):
                        values[y + below][x + right] += error * weight
        return values

    return dither


SHADINGS: Mapping[str, Callable[[Darkness, float], Darkness]] = {
    "threshold": by_threshold,
    "floyd-steinberg": diffused({(1, 0): 7 / 16, (-1, 1): 3 / 16, (0, 1): 5 / 16, (1, 1): 1 / 16}),
    "atkinson": diffused(dict.fromkeys([(1, 0), (2, 0), (-1, 1), (0, 1), (1, 1), (0, 2)], 1 / 8)),
    "grey": by_threshold,
    "halftone": by_threshold,
}


def runs(black: Darkness, scale: tuple[float, float]) -> Iterator[Stroke]:
    """A stroke along each run of black pixels, to and fro."""
    for number, row in enumerate(black):
        y = (len(black) - number - 0.5) * scale[1]
        edges = [x for x in range(len(row) + 1) if at(row, x - 1) != at(row, x)]
        pairs = list(zip(edges[::2], edges[1::2], strict=True))
        for first, last in pairs[::-1] if number % 2 else pairs:
            ends = inner(first, last, scale[0])
            points = ((ends[0], y), (ends[1], y)) if ends[0] < ends[1] else ((ends[0], y),)
            yield Stroke(points[::-1] if number % 2 else points)


def inner(first: int, last: int, scale: float) -> tuple[float, float]:
    """From the middle of the first pixel to that of the last one: the pen itself covers the rest."""
    return (first + 0.5) * scale, (last - 0.5) * scale


def at(row: list[float], x: int) -> float:
    """A pixel; white beyond the edges."""
    return row[x] if 0 <= x < len(row) else 0.0


def grey(dark: Darkness, scale: tuple[float, float]) -> Iterator[Stroke]:
    """Strokes along what is not white, with a power for each run of one darkness, to and fro."""
    for number, row in enumerate(dark):
        y = (len(dark) - number - 0.5) * scale[1]
        levels = [round(value * LEVELS) / LEVELS if value > FAINT else 0.0 for value in row]
        x = 0
        strokes: list[Stroke] = []
        while x < len(levels):
            if not levels[x]:
                x += 1
                continue

            points: list[Point] = [(x * scale[0], y)]
            powers = [levels[x] * FULL]
            while x < len(levels) and levels[x]:
                level = levels[x]
                while x < len(levels) and levels[x] == level:
                    x += 1
                points.append((x * scale[0], y))
                powers.append(level * FULL)

            strokes.append(Stroke(tuple(points), tuple(powers)))

        yield from (stroke.reversed() for stroke in reversed(strokes)) if number % 2 else strokes


def halftone(picture: Image, size: tuple[float, float], cell: float, line: float) -> Iterator[Stroke]:
    """A filled circle in each cell that is as dark as the picture there."""
    columns, rows = (max(1, round(side / cell * 2)) for side in size)
    dark = darkness(picture, columns, rows)
    reach = math.ceil((size[0] + size[1]) / cell / SQUARE_ROOT_2) + 1
    for i in range(-reach, reach + 1):
        for j in range(-reach, reach + 1)[:: -1 if i % 2 else 1]:
            x, y = (i + j) * cell / SQUARE_ROOT_2, (i - j) * cell / SQUARE_ROOT_2
            if 0 <= x <= size[0] and 0 <= y <= size[1]:
                column = min(columns - 1, int(x / size[0] * columns))
                row = min(rows - 1, int((size[1] - y) / size[1] * rows))
                radius = cell * math.sqrt(dark[row][column] / math.pi)
                if radius > line / 4:
                    yield disc((x, y), radius, line)


def disc(centre: Point, radius: float, line: float) -> Stroke:
    """A spiral from the middle out, and once round; a dot where the pen alone is as large."""
    outer = radius - line / 2
    if outer < line / 4:
        return Stroke((centre,))

    turns = max(1, math.ceil(outer / line))
    steps = 12 * turns
    points = [spoke(centre, outer * step / steps, math.tau * turns * step / steps) for step in range(steps)]
    return Stroke((*points, *(spoke(centre, outer, math.tau * step / 16) for step in range(17))))


def spoke(centre: Point, radius: float, angle: float) -> Point:
    """A point around another."""
    return centre[0] + radius * math.cos(angle), centre[1] + radius * math.sin(angle)
