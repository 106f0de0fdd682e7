"""SVG files as toolpaths: shapes, paths, groups, transforms, viewBox and units; what is hidden is left out.

A shape's outline is drawn, whether the file strokes or fills it; one that it neither strokes nor fills is not. One px
is 1/96 inch, as in CSS. The page's lower left corner is the origin of the work plane.
"""

from __future__ import annotations

import io
import math
from collections.abc import Mapping
from typing import Any

from dobot_async.toolpath import curves
from dobot_async.toolpath.errors import ToolpathFileError, library
from dobot_async.toolpath.sources import FINE, Source, check_tolerance, content, name_of
from dobot_async.toolpath.stroke import Matrix, Stroke
from dobot_async.toolpath.svg_checks import SVGProblem
from dobot_async.toolpath.svg_tree import parse_tree, plain
from dobot_async.toolpath.toolpath import Toolpath

__all__ = ["read_svg"]

MM = 25.4 / 96


def read_svg(source: Source, *, tolerance: float = FINE) -> Toolpath:
    """Read an SVG file.

    Text and pictures in it are not drawn; each is told in the log, with its line.

    Args:
        source: The path of a file, or a stream.
        tolerance: mm by which straight ways may miss a curve.

    Returns:
        A toolpath in mm. Each stroke's layer is the name of the outermost group that it is in.

    Raises:
        ToolpathFileError: The file is broken; it tells the line.
        MissingLibrary: The extra `draw` is not installed.
    """
    with library():
        import svgelements

    elements: Any = svgelements  # it has no types
    check_tolerance(tolerance)
    name = name_of(source)
    try:
        text, height = plain(parse_tree(content(source)))
        found = elements.SVG.parse(io.StringIO(text), reify=False, ppi=96)
        strokes: list[Stroke] = []
        for shape in found.elements():
            if isinstance(shape, elements.Shape) and is_painted(shape):
                layer = shape.values.get("data-layer", "")
                try:
                    strokes += [
                        Stroke(tuple((p.real * MM, (height - p.imag) * MM) for p in points), layer=layer)
                        for points in outlines(shape, elements, tolerance / MM)
                    ]
                except (ValueError, ZeroDivisionError, OverflowError) as error:
                    raise SVGProblem(int(shape.values.get("data-line", 0)), str(error)) from error
    except SVGProblem as error:
        raise ToolpathFileError(name, f"line {error.line}", error.reason) from None
    except (ValueError, ZeroDivisionError, OverflowError, TypeError, AttributeError, IndexError) as error:
        raise ToolpathFileError(name, "", f"svgelements cannot read it: {error}") from error

    return Toolpath(tuple(strokes))


def is_painted(shape: Any) -> bool:
    """Whether anything of it is to be seen."""
    if shape.values.get("visibility") in {"hidden", "collapse"} or shape.values.get("display") == "none":
        return False

    return any(paint is not None and paint.value is not None for paint in (shape.stroke, shape.fill))


def outlines(shape: Any, svgelements: Any, tolerance: float) -> list[list[complex]]:
    """The outlines of a shape as points in px.

    Curves become straight ways before they are transformed: svgelements transforms an arc's half axes, which are no
    half axes any more once it is skewed.
    """
    matrix = shape.transform
    stretch = math.hypot(matrix.a, matrix.b, matrix.c, matrix.d)
    if not 0 < stretch < math.inf:
        return []

    found: list[list[complex]] = []
    for segment in svgelements.Path(shape.segments(transformed=False)):
        start, end = (None if point is None else complex(point.x, point.y) for point in (segment.start, segment.end))
        if isinstance(segment, svgelements.Move):
            found.append([end] if end is not None else [])
        elif start is None or end is None:
            continue
        else:
            if not found[-1] or found[-1][-1] != start:
                found.append([start])
            found[-1] += way(segment, svgelements, tolerance / stretch)

    place = Matrix(matrix.a, matrix.b, matrix.c, matrix.d, float(matrix.e), float(matrix.f))
    return [[complex(*place((p.real, p.imag))) for p in points] for points in found if len(points) > 1]


def way(segment: Any, svgelements: Any, tolerance: float) -> list[complex]:
    """Points on one segment, but for its first one."""
    if isinstance(segment, svgelements.Arc):
        radius = max(abs(segment.rx), abs(segment.ry))
        points = curves.arc(tolerance, radius, segment.sweep, lambda share: complex(*segment.point(share)))
        return [*points[:-1], complex(*segment.end)]  # what follows begins exactly there

    names = CONTROLS.get(type(segment).__name__, ("start", "end"))
    points = [complex(*getattr(segment, name)) for name in names]
    return curves.bezier(tolerance, *points) if len(points) > 2 else points[1:]


CONTROLS: Mapping[str, tuple[str, ...]] = {
    "CubicBezier": ("start", "control1", "control2", "end"),
    "QuadraticBezier": ("start", "control", "end"),
}
