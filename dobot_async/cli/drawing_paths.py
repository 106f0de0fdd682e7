"""From a file, or a text, to a toolpath whose lower left corner is the origin."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from dobot_async.toolpath import (
    Toolpath,
    read_dxf,
    read_gcode,
    read_picture,
    read_svg,
    trace_picture,
    write_text,
)
from dobot_async.toolpath.picture import open_picture

__all__ = ["of_file", "of_text", "with_share_of_power"]

Size = tuple[float, float] | None
READERS: Mapping[str, Callable[[Path], Toolpath]] = {
    ".svg": read_svg,
    ".dxf": read_dxf,
    **dict.fromkeys((".gcode", ".nc", ".ngc", ".g", ".gc", ".tap"), read_gcode),
}
PICTURES = (".png", ".jpg", ".jpeg", ".bmp", ".gif", ".tif", ".tiff", ".webp")
TRAVEL_MATTERS = (".svg", ".dxf")  # a program has its order, and the rows of a picture are in the best one


def of_file(file: Path, size: Size, mode: str | None, line: float | None, *, keep_order: bool) -> Toolpath:
    """Return what a file holds; by its ending it is known what kind of file it is.

    Args:
        file: The file.
        size: Of a rectangle into which it is to fit, mm.
        mode: How a picture becomes strokes.
        line: mm between two lines of a picture.
        keep_order: Whether the strokes stay in the file's order.

    Raises:
        UsageError: No reader knows such a file, or an option is for others.
        ValueError: As the readers.
        MissingLibrary: The extra `draw` is not installed.
    """
    kind = file.suffix.lower()
    if kind not in READERS and kind not in PICTURES:
        raise click.UsageError(f"{file.name}: it ends in none of {', '.join((*READERS, *PICTURES))}")

    if kind in PICTURES:
        return at_origin(of_picture(file, size, mode, line))

    for option, value in (("--mode", mode), ("--line", line)):
        if value is not None:
            raise click.UsageError(f"{option} is for pictures alone, not for {kind} files")

    path = READERS[kind](file)
    if kind in TRAVEL_MATTERS and not keep_order:
        path = path.order()

    return fitted(path, size)


def of_picture(file: Path, size: Size, mode: str | None, line: float | None) -> Toolpath:
    """A picture; its lines are as far from each other as they are to be when it has its size."""
    sides: dict[str, Any] = {}
    if size:
        picture = open_picture(file, file.name)
        sides["width"] = picture.width * min(size[0] / picture.width, size[1] / picture.height)

    if mode == "outline":
        if line is not None:
            raise click.UsageError("--line is not for outlines")

        return trace_picture(file, **sides).order()

    options: dict[str, Any] = {"shading": mode, "line": line}
    return read_picture(file, **sides, **{name: value for name, value in options.items() if value is not None})


def of_text(text: str, size: Size, height: float | None, font: str, align: Any) -> Toolpath:
    r"""A text; \n in it begins a line."""
    if size and height is not None:
        raise click.UsageError("give --size or --height, not both")

    lines = text.replace("\\n", "\n")
    return fitted(write_text(lines, 10.0 if height is None else height, font=font, align=align), size)


def fitted(path: Toolpath, size: Size) -> Toolpath:
    """It in the middle of a rectangle; without one as large as it is, in the corner."""
    return path.fit(*size) if size and path.strokes else at_origin(path)


def at_origin(path: Toolpath) -> Toolpath:
    """It with its lower left corner at the origin."""
    return path.translate(-path.bounds.left, -path.bounds.bottom) if path.strokes else path


def with_share_of_power(path: Toolpath, percent: float) -> Toolpath:
    """It with so much of the power that it has."""
    share = percent / 100
    return Toolpath(
        tuple(replace(stroke, power=tuple(power * share for power in stroke.powers)) for stroke in path.strokes)
    )
