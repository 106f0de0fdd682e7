"""From a file to strokes, from strokes to a picture, and to an arm that draws them; docs/toolpath.md.

    from dobot_async.toolpath import WorkPlane, draw, read_svg

    toolpath = read_svg("logo.svg").fit(80, 80).order()
    await draw(arm, toolpath, WorkPlane.flat(200, -40, -50))

Readers of files need the extra `draw`, and say so where it is missing; `import dobot_async` imports nothing of this.
"""

from dobot_async.toolpath.drawing import Drawing
from dobot_async.toolpath.dxf import read_dxf
from dobot_async.toolpath.errors import MissingLibrary, ToolpathFileError, UnreachableStroke
from dobot_async.toolpath.estimate import Estimate, estimate
from dobot_async.toolpath.gcode import read_gcode
from dobot_async.toolpath.picture import read_picture
from dobot_async.toolpath.plane import OnPlane, WorkPlane
from dobot_async.toolpath.preview import Preview, preview
from dobot_async.toolpath.progress import Progress
from dobot_async.toolpath.reach import check_toolpath, reach_of, reachable
from dobot_async.toolpath.stroke import Bounds, Matrix, Point, Stroke
from dobot_async.toolpath.svg import read_svg
from dobot_async.toolpath.text import fonts, write_text
from dobot_async.toolpath.toolpath import Toolpath
from dobot_async.toolpath.trace import trace_picture
from dobot_async.toolpath.verbs import draw, engrave

__all__ = [
    "Bounds",
    "Drawing",
    "Estimate",
    "Matrix",
    "MissingLibrary",
    "OnPlane",
    "Point",
    "Preview",
    "Progress",
    "Stroke",
    "Toolpath",
    "ToolpathFileError",
    "UnreachableStroke",
    "WorkPlane",
    "check_toolpath",
    "draw",
    "engrave",
    "estimate",
    "fonts",
    "preview",
    "reach_of",
    "reachable",
    "read_dxf",
    "read_gcode",
    "read_picture",
    "read_svg",
    "trace_picture",
    "write_text",
]
