"""A toolpath as a picture: strokes in the colours of their order, travel dashed, what is out of reach red.

Scene (mm) --svg--> text
           --png--> Pillow, four times as large and then smaller, for smooth lines

Both show the same.
"""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

from dobot_async.toolpath.errors import library
from dobot_async.toolpath.stroke import Bounds, Point, Stroke, distance
from dobot_async.toolpath.toolpath import Toolpath

__all__ = ["Preview", "preview"]

CELLS = 120  # squares along the longer side in which a reach is looked at
MARGIN = 0.06  # of the longer side
LEGEND = 34  # px
SMOOTH = 4
RED, GREY, SHADE, PAPER, INK = "#e00000", "#9a9a9a", "#e4f3e4", "#ffffff", "#333333"
FIRST, LAST = (38, 84, 200), (240, 150, 20)
DASH, GAP = 3.0, 3.0  # px
Inside = Callable[[float, float], object]


@dataclass(frozen=True, slots=True)
class Preview:
    """A picture of a toolpath; made by `preview`.

    Attributes:
        toolpath: What is drawn.
        bounds: What is shown, mm.
        width: px.
        shade: Polygons of what can be reached, mm.
        unreachable: The parts of strokes that cannot.
        legend: A line of text.
    """

    toolpath: Toolpath
    bounds: Bounds
    width: int
    shade: Sequence[Sequence[Point]] = ()
    unreachable: Toolpath = field(default_factory=Toolpath)
    legend: str = ""

    @property
    def height(self) -> int:
        """How high the picture is, px."""
        return max(1, round(self.bounds.height * self.scale)) + LEGEND

    @property
    def scale(self) -> float:
        """How many px a mm is."""
        return self.width / self.bounds.width

    def svg(self) -> str:
        """Return it as SVG."""
        parts = [
            (
                f'<svg xmlns="http://www.w3.org/2000/svg" width="{self.width}" height="{self.height}" '
                f'viewBox="0 0 {self.width} {self.height}">'
            ),
            f'<rect width="100%" height="100%" fill="{PAPER}"/>',
            *(f'<polygon class="reach" points="{self._text(polygon)}" fill="{SHADE}"/>' for polygon in self.shade),
            *(
                f'<polyline class="travel" points="{self._text(way)}" fill="none" stroke="{GREY}" stroke-width="0.7" '
                f'stroke-dasharray="{DASH:g} {GAP:g}"/>'
                for way in travels(self.toolpath)
            ),
            *(self._svg_stroke(stroke, "stroke", color) for stroke, color in coloured(self.toolpath)),
            *(self._svg_stroke(stroke, "unreachable", RED) for stroke in self.unreachable),
            (
                f'<text x="8" y="{self.height - 12}" font-family="sans-serif" font-size="13" fill="{INK}">'
                f"{escape(self.legend)}</text>"
            ),
            "</svg>",
        ]
        return "\n".join(parts) + "\n"

    def png(self) -> bytes:
        """Return it as PNG; raise MissingLibrary if the extra `draw` is not installed."""
        with library():
            from PIL import Image, ImageDraw, ImageFont

        size = self.width * SMOOTH, self.height * SMOOTH
        picture = Image.new("RGB", size, PAPER)
        pen = ImageDraw.Draw(picture)
        for polygon in self.shade:
            pen.polygon([self._large(point) for point in polygon], fill=SHADE)

        for way in travels(self.toolpath):
            for dash in dashes(*map(self._large, way)):
                pen.line(dash, fill=GREY, width=SMOOTH // 2)

        for stroke, color in [*coloured(self.toolpath), *((stroke, RED) for stroke in self.unreachable)]:
            self._png_stroke(pen, stroke, color)

        picture = picture.resize((self.width, self.height), Image.Resampling.LANCZOS)
        font = ImageFont.load_default(13)
        ImageDraw.Draw(picture).text((8, self.height - 24), self.legend, fill=INK, font=font)
        data = io.BytesIO()
        picture.save(data, "PNG")
        return data.getvalue()

    def save(self, path: str | PathLike[str]) -> None:
        """Write it to a file whose name ends in .svg or .png; raise ValueError for others.

        Args:
            path: Of the file, which is replaced if it is there.

        Raises:
            ValueError: Its name ends otherwise.
            OSError: It cannot be written.
        """
        suffix = Path(path).suffix.lower()
        if suffix not in {".svg", ".png"}:
            raise ValueError(f"a preview is saved as .svg or .png, not as {str(path)!r}")

        Path(path).write_bytes(self.svg().encode() if suffix == ".svg" else self.png())

    def _svg_stroke(self, stroke: Stroke, name: str, color: str) -> str:
        if len(stroke.points) == 1:
            x, y = self._px(stroke.start)
            return f'<circle class="{name}" cx="{x:.2f}" cy="{y:.2f}" r="1.2" fill="{color}"/>'

        return (
            f'<polyline class="{name}" points="{self._text(stroke.points)}" fill="none" stroke="{color}" '
            'stroke-width="1.2" stroke-linejoin="round" stroke-linecap="round"/>'
        )

    def _png_stroke(self, pen: Any, stroke: Stroke, color: str) -> None:
        points = [self._large(point) for point in stroke.points]
        if len(points) == 1:
            (x, y), r = points[0], 1.2 * SMOOTH
            pen.ellipse((x - r, y - r, x + r, y + r), fill=color)
        else:
            pen.line(points, fill=color, width=round(1.2 * SMOOTH), joint="curve")

    def _px(self, point: Point) -> Point:
        return (point[0] - self.bounds.left) * self.scale, (self.bounds.top - point[1]) * self.scale

    def _large(self, point: Point) -> Point:
        x, y = self._px(point)
        return x * SMOOTH, y * SMOOTH

    def _text(self, points: Sequence[Point]) -> str:
        return " ".join(f"{x:.2f},{y:.2f}" for x, y in map(self._px, points))


def preview(
    toolpath: Toolpath,
    *,
    reachable: Inside | Sequence[Point] | None = None,
    bounds: tuple[float, float, float, float] | None = None,
    seconds: float | None = None,
    width: int = 800,
) -> Preview:
    """Return a picture of a toolpath, to be had as `svg()`, `png()`, or saved.

    Args:
        toolpath: What to show.
        reachable: What tells whether a place can be reached (such as `reachable(arm, plane)`), or a polygon around all
            that can: it is shaded, and what lies outside is red.
        bounds: What to show, mm: left, bottom, right, top; by default the toolpath, or the polygon too, with a margin.
        seconds: How long it takes (`estimate`), for the legend.
        width: px.

    Raises:
        ValueError: There is nothing to show, or a number is out of range.
    """
    if not hasattr(width, "__index__") or not 16 <= width <= 10_000:
        raise ValueError(f"width must be a whole number of 16 to 10000 px, not {width!r}")

    polygon = None if reachable is None or callable(reachable) else [(float(x), float(y)) for x, y in reachable]
    if polygon is not None and len(polygon) < 3:
        raise ValueError("a polygon has three points or more")

    inside: Inside | None = reachable if callable(reachable) else None
    if polygon:
        inside = within(polygon)

    shown = Bounds(*map(float, bounds)) if bounds else around(toolpath, polygon or [])
    if not (shown.width > 0 and shown.height > 0 and all(map(math.isfinite, shown))):
        raise ValueError(f"bounds must be left, bottom, right, top, in this order, not {bounds!r}")

    _, bad = toolpath.split(inside, step=1.0) if inside else (toolpath, Toolpath())
    shade = [polygon] if polygon else list(squares(inside, shown)) if inside else []
    text = f"{len(toolpath)} strokes, {toolpath.length:.0f} mm drawn, {toolpath.travel:.0f} mm travelled"
    if seconds is not None:
        text += f", {int(seconds) // 60}:{int(seconds) % 60:02d} min"

    if len(bad):
        text += f"; {bad.length:.0f} mm out of reach" if bad.length else "; dots out of reach"

    return Preview(toolpath, shown, width.__index__(), shade, bad, text)


def around(toolpath: Toolpath, polygon: Sequence[Point]) -> Bounds:
    """What is to be seen, with a margin."""
    each = [*(stroke.bounds for stroke in toolpath), *(Bounds(x, y, x, y) for x, y in polygon)]
    if not each:
        raise ValueError("there is nothing to show: the toolpath has no strokes")

    left, bottom = min(b.left for b in each), min(b.bottom for b in each)
    right, top = max(b.right for b in each), max(b.top for b in each)
    margin = max(MARGIN * max(right - left, top - bottom), 1.0)
    return Bounds(left - margin, bottom - margin, right + margin, top + margin)


def travels(toolpath: Toolpath) -> Iterator[tuple[Point, Point]]:
    """The ways between strokes."""
    for before, after in zip(toolpath.strokes, toolpath.strokes[1:], strict=False):
        if before.end != after.start:
            yield before.end, after.start


def coloured(toolpath: Toolpath) -> Iterator[tuple[Stroke, str]]:
    """Each stroke with its colour: from blue to orange."""
    last = max(1, len(toolpath) - 1)
    for number, stroke in enumerate(toolpath):
        share = number / last
        yield stroke, "#" + "".join(f"{round(a + share * (b - a)):02x}" for a, b in zip(FIRST, LAST, strict=True))


def dashes(a: Point, b: Point) -> Iterator[tuple[Point, Point]]:
    """The pieces of a dashed line, in large pixels."""
    length, step = distance(a, b), (DASH + GAP) * SMOOTH
    for number in range(math.ceil(length / step)):
        begin, end = number * step / length, min(1.0, (number * step + DASH * SMOOTH) / length)
        yield between(a, b, begin), between(a, b, end)


def between(a: Point, b: Point, share: float) -> Point:
    """A point on the way."""
    return a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])


def squares(inside: Inside, shown: Bounds) -> Iterator[list[Point]]:
    """What can be reached, as rows of squares."""
    side = max(shown.width, shown.height) / CELLS
    for row in range(math.ceil(shown.height / side)):
        low = shown.bottom + row * side
        begin: float | None = None
        for column in range(math.ceil(shown.width / side) + 1):
            left = shown.left + column * side
            good = left < shown.right and bool(inside(left + side / 2, low + side / 2))
            if good and begin is None:
                begin = left
            elif not good and begin is not None:
                yield [(begin, low), (left, low), (left, low + side), (begin, low + side)]
                begin = None


def within(polygon: Sequence[Point]) -> Callable[[float, float], bool]:
    """What tells whether a place lies within a polygon, by how often a ray from it crosses the edges."""
    edges = list(zip(polygon, [*polygon[1:], polygon[0]], strict=True))

    def inside(x: float, y: float) -> bool:
        crossings = 0
        for (ax, ay), (bx, by) in edges:
            if (ay > y) != (by > y) and x < ax + (y - ay) / (by - ay) * (bx - ax):
                crossings += 1

        return crossings % 2 == 1

    return inside
