"""The outlines of what is dark in a picture, by potrace."""

from __future__ import annotations

from typing import Any, SupportsFloat

from dobot_async._core.util.arguments import to_float
from dobot_async.toolpath import curves
from dobot_async.toolpath.errors import library
from dobot_async.toolpath.picture import open_picture, size_of
from dobot_async.toolpath.sources import FINE, Source, check_tolerance, name_of
from dobot_async.toolpath.stroke import Stroke
from dobot_async.toolpath.toolpath import Toolpath

__all__ = ["trace_picture"]

MOST = 2000  # pixels of the longer side: potrace in Python takes its time


def trace_picture(
    source: Source,
    *,
    width: SupportsFloat | None = None,
    height: SupportsFloat | None = None,
    threshold: SupportsFloat = 0.5,
    speckle: int = 2,
    smooth: SupportsFloat = 1.0,
    tolerance: float = FINE,
) -> Toolpath:
    """Read a picture (PNG, JPEG, ...) as the outlines of what is dark in it.

    Args:
        source: The path of a file, or a stream.
        width: mm; by default what `height` and the picture's proportions make it, or 100 mm.
        height: mm; by default what `width` and the picture's proportions make it.
        threshold: The darkness, 0 to 1, from which on a pixel is black.
        speckle: Spots of so many pixels and less are left out (potrace's turdsize).
        smooth: 0 draws corners alone, 1.34 none at all (potrace's alphamax).
        tolerance: mm by which straight ways may miss a curve.

    Returns:
        A toolpath in mm of closed strokes, with the picture's lower left corner at the origin.

    Raises:
        ToolpathFileError: The file is broken, or no picture.
        ValueError: An argument is out of range.
        MissingLibrary: The extra `draw` is not installed.
    """
    check_tolerance(tolerance)
    limit, corners = to_float(threshold, "threshold"), to_float(smooth, "smooth")
    if not 0 < limit < 1:
        raise ValueError(f"threshold must be between 0 and 1, not {threshold!r}")

    if not 0 <= corners <= 1.34:
        raise ValueError(f"smooth must be 0 to 1.34, not {smooth!r}")

    with library():
        import numpy as np
        import potrace

    picture = open_picture(source, name_of(source))
    size = size_of(picture, width, height)
    picture.thumbnail((MOST, MOST))
    white = np.asarray(picture) > 255 * (1 - limit)
    scale = size[0] / picture.width, size[1] / picture.height
    tracer: Any = potrace  # it has no types
    traced = tracer.Bitmap(white).trace(turdsize=speckle, alphamax=corners)
    lines = (outline(curve, tolerance / max(scale)) for curve in traced)
    return Toolpath(
        tuple(Stroke(tuple((p.real * scale[0], (picture.height - p.imag) * scale[1]) for p in line)) for line in lines)
    )


def outline(curve: Any, tolerance: float) -> list[complex]:
    """A curve's points, in pixels."""
    points = [place(curve.start_point)]
    for segment in curve.segments:
        if segment.is_corner:
            points += [place(segment.c), place(segment.end_point)]
        else:
            controls = (place(each) for each in (segment.c1, segment.c2, segment.end_point))
            points += curves.bezier(tolerance, points[-1], *controls)

    if points[0] != points[-1]:
        points.append(points[0])

    return points


def place(point: Any) -> complex:
    """A point of potrace's."""
    return complex(point.x, point.y)
