"""The outlines of what is dark in a picture."""

from __future__ import annotations

from typing import SupportsFloat, SupportsIndex

from dobot_async._core.util.arguments import to_float
from dobot_async.toolpath.errors import library
from dobot_async.toolpath.outlines import area, outlines
from dobot_async.toolpath.picture import open_picture, size_of
from dobot_async.toolpath.sources import FINE, Source, check_tolerance, name_of
from dobot_async.toolpath.stroke import Stroke
from dobot_async.toolpath.toolpath import Toolpath

__all__ = ["trace_picture"]

MOST = 2000  # pixels of the longer side
SMOOTHEST = 20.0  # pixels


def trace_picture(
    source: Source,
    *,
    width: SupportsFloat | None = None,
    height: SupportsFloat | None = None,
    threshold: SupportsFloat = 0.5,
    speckle: SupportsIndex = 2,
    smooth: SupportsFloat = 1.0,
    tolerance: float = FINE,
) -> Toolpath:
    """Read a picture (PNG, JPEG, ...) as the outlines of what is dark in it.

    Args:
        source: The path of a file, or a stream.
        width: mm; by default what `height` and the picture's proportions make it, or 100 mm.
        height: mm; by default what `width` and the picture's proportions make it.
        threshold: The darkness, 0 to 1, from which on a pixel is black.
        speckle: Spots of so many pixels and less are left out, and so are holes.
        smooth: Pixels, 0 to 20, over which the picture is blurred first, so that the steps between pixels are no steps
            of the outline: 0 follows hard edges of pixels, more rounds corners.
        tolerance: mm by which straight ways may miss the outline.

    Returns:
        A toolpath in mm of closed strokes, with the picture's lower left corner at the origin.

    Raises:
        ToolpathFileError: The file is broken, or no picture.
        ValueError: An argument is out of range.
        MissingLibrary: The extra `draw` is not installed.
    """
    check_tolerance(tolerance)
    limit, blur, spot = to_float(threshold, "threshold"), to_float(smooth, "smooth"), speckle.__index__()
    if not 0 < limit < 1:
        raise ValueError(f"threshold must be between 0 and 1, not {threshold!r}")

    if not 0 <= blur <= SMOOTHEST:
        raise ValueError(f"smooth must be 0 to {SMOOTHEST:g} pixels, not {smooth!r}")

    if spot < 0:
        raise ValueError(f"speckle must be 0 pixels or more, not {speckle!r}")

    with library():
        import numpy as np
        from PIL import ImageFilter

    picture = open_picture(source, name_of(source))
    size = size_of(picture, width, height)
    picture.thumbnail((MOST, MOST))
    soft = picture.filter(ImageFilter.GaussianBlur(blur)) if blur else picture
    dark = 1 - np.asarray(soft, dtype=float) / 255
    across, up = size[0] / picture.width, size[1] / picture.height
    found = [line for line in outlines(dark, limit) if area(line) > spot]
    path = Toolpath(tuple(Stroke(tuple((x * across, size[1] - y * up) for x, y in line)) for line in found))
    return path.simplify(tolerance)
