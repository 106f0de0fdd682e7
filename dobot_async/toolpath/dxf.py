"""DXF files as toolpaths: the entities of the model space and of the blocks in it, as far as they are lines.

The unit is that of the file ($INSUNITS); a file that tells none is taken to be in mm.
"""

from __future__ import annotations

import io
import logging
import re
from collections.abc import Iterator
from typing import Any

from dobot_async._core.util.arguments import check_duration
from dobot_async.toolpath.errors import ToolpathFileError, library
from dobot_async.toolpath.sources import FINE, Source, check_tolerance, content, name_of
from dobot_async.toolpath.stroke import Stroke
from dobot_async.toolpath.toolpath import Toolpath

__all__ = ["read_dxf"]

logger: logging.Logger = logging.getLogger("dobot_async.toolpath")
LAYOUT_ONLY = frozenset({"VIEWPORT", "ATTDEF"})
FEWEST = 4  # ways of an arc, however small


def read_dxf(source: Source, *, tolerance: float = FINE, unit: float | None = None) -> Toolpath:
    """Read a DXF file.

    What is on layers that are off, frozen or not plotted, and what is invisible, is left out. Of hatches the outline is
    drawn; text and pictures are not, and each is told in the log, with its handle. Z is left out.

    Args:
        source: The path of a file, or a stream.
        tolerance: mm by which straight ways may miss a curve.
        unit: mm of one unit of the file; None takes the file's own.

    Returns:
        A toolpath in mm, with the file's layers.

    Raises:
        ToolpathFileError: The file is broken; it tells the line, or the entity.
        MissingLibrary: The extra `draw` is not installed.
    """
    with library():
        import ezdxf
        from ezdxf import disassemble, units
        from ezdxf.enums import InsertUnits
        from ezdxf.lldxf.const import DXFError

    check_tolerance(tolerance)
    name = name_of(source)
    try:
        document = document_of(content(source), ezdxf)
    except (DXFError, ValueError, LookupError, AttributeError, TypeError, OverflowError) as error:
        reason = " ".join((str(error) or type(error).__name__).split())
        raise ToolpathFileError(name, place_of(reason), f"ezdxf cannot read it: {reason}") from None

    if unit is None:
        try:
            unit = (
                units.conversion_factor(InsertUnits(document.units), InsertUnits.Millimeters) if document.units else 1
            )
        except ValueError:
            raise ToolpathFileError(name, "$INSUNITS", f"{document.units} is no unit; give unit= in mm") from None
    elif not check_duration(unit, "unit"):
        raise ValueError("unit must be above 0 mm")

    strokes: list[Stroke] = []
    unseen = {layer.dxf.name.lower() for layer in document.layers if not is_plotted(layer)} | {"defpoints"}
    for entity in entities_of(document, disassemble, name):
        layer = entity.dxf.get("layer", "0")
        if entity.dxf.get("invisible", 0) or layer.lower() in unseen:
            continue

        place = f"entity {entity.dxftype()} #{entity.dxf.get('handle') or 'of a block'}"
        try:
            strokes += [
                Stroke(tuple((x * unit, y * unit) for x, y in line), layer=layer)
                for line in lines(entity, tolerance / unit, place)
            ]
        except (DXFError, ValueError, TypeError, AttributeError, ZeroDivisionError, OverflowError) as error:
            raise ToolpathFileError(name, place, str(error) or type(error).__name__) from None

    return Toolpath(tuple(strokes))


def entities_of(document: Any, disassemble: Any, name: str) -> list[Any]:
    """All entities of the model space, those of blocks among them."""
    try:
        return list(disassemble.recursive_decompose(document.modelspace()))
    except (ValueError, LookupError, AttributeError, TypeError, OverflowError, RecursionError) as error:
        raise ToolpathFileError(name, "model space", f"ezdxf cannot read it: {error!r}") from None


def place_of(reason: str) -> str:
    """Where a file is broken, as ezdxf tells it."""
    if found := re.search(r"line:? (\d+)", reason):
        return f"line {found[1]}"

    return "end of the file" if "missing" in reason else ""


def is_plotted(layer: Any) -> bool:
    """Whether what is on a layer is to be seen on paper."""
    return bool(layer.is_on() and not layer.is_frozen() and layer.dxf.get("plot", 1))


def document_of(data: bytes, ezdxf: Any) -> Any:
    """The document of a file's bytes, ASCII or binary; raises DXFStructureError with the line."""
    if data.startswith(b"AutoCAD Binary DXF"):
        from ezdxf.document import Drawing
        from ezdxf.lldxf.tagger import binary_tags_loader

        return Drawing.load(binary_tags_loader(data))

    encoding = "cp1252" if b"$DWGCODEPAGE" in data and b"AC1021" not in data and not is_utf8(data) else "utf-8"
    return ezdxf.read(io.StringIO(data.decode(encoding, errors="surrogateescape"), newline=None))


def is_utf8(data: bytes) -> bool:
    """Whether bytes are UTF-8."""
    try:
        data.decode()
    except UnicodeDecodeError:
        return False

    return True


def lines(entity: Any, distance: float, place: str) -> Iterator[list[tuple[float, float]]]:
    """The lines that an entity consists of, each by its points."""
    from ezdxf.path import make_path

    if entity.dxftype() == "POINT":
        yield [(entity.dxf.location.x, entity.dxf.location.y)]
        return

    try:
        path = make_path(entity)
    except TypeError:
        if entity.dxftype() not in LAYOUT_ONLY:
            logger.warning("%s is not drawn: it is no line", place)

        return

    for part in path.sub_paths() if path.has_sub_paths else [path]:
        points = [(float(x), float(y)) for x, y, _ in part.flattening(distance, FEWEST)]
        if len(points) > 1:
            yield points
