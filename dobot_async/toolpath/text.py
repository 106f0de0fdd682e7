"""Text in single-stroke (Hershey) fonts, as plotters write it: each letter is lines, and no outline."""

from __future__ import annotations

from typing import Any, Literal, SupportsFloat

from dobot_async._core.util.arguments import check_choice, to_float
from dobot_async.toolpath.errors import library
from dobot_async.toolpath.stroke import Stroke
from dobot_async.toolpath.toolpath import Toolpath

__all__ = ["fonts", "write_text"]

SHARES = {"left": 0.0, "centre": 0.5, "right": 1.0}


def fonts() -> tuple[str, ...]:
    """Return the names of the fonts; raise MissingLibrary if the extra `draw` is not installed."""
    return tuple(sorted(hershey().default_font_names))


def write_text(
    text: str,
    height: SupportsFloat = 10.0,
    *,
    font: str = "futural",
    line_spacing: SupportsFloat = 1.6,
    letter_spacing: SupportsFloat = 0.0,
    align: Literal["left", "centre", "right"] = "left",
) -> Toolpath:
    """Return a text as a toolpath; the first line stands on y = 0, and begins at x = 0.

    Args:
        text: One line or several.
        height: Of a capital letter, mm.
        font: One of `fonts()`: "futural" is plain, "scripts" handwriting, "timesr" has serifs, "greek" and "cyrillic"
            put their letters in the places of Latin ones.
        line_spacing: From one line to the next, in heights.
        letter_spacing: Between two letters, beside what the font has, mm.
        align: How lines of different lengths stand to each other; with "centre" x = 0 is their middle.

    Raises:
        ValueError: There is no such font, or the font has no such character, or a number is out of range.
        MissingLibrary: The extra `draw` is not installed.
    """
    check_choice("align", align, *SHARES)
    size = to_float(height, "height")
    if not 0 < size < float("inf"):
        raise ValueError(f"height must be above 0 mm and finite, not {height!r}")

    found = hershey()
    if font not in found.default_font_names:
        raise ValueError(f"no font {font!r}; there are: {', '.join(fonts())}")

    found.load_default_font(font)
    glyphs = found.all_glyphs
    spaces = to_float(line_spacing, "line_spacing"), to_float(letter_spacing, "letter_spacing")
    strokes: list[Stroke] = []
    for number, line in enumerate(text.split("\n")):
        missing = [character for character in line if character not in glyphs]
        if missing:
            raise ValueError(f"the font {font!r} has no {missing[0]!r} (line {number + 1} of the text)")

        strokes += write_line([glyphs[each] for each in line], size, -number * spaces[0] * size, spaces[1], align)

    return Toolpath(tuple(strokes))


def write_line(glyphs: list[Any], size: float, base: float, spacing: float, align: str) -> list[Stroke]:
    """One line of letters; a font's y goes down, from its cap line to its base line."""
    scales = [size / (glyph.base_line - glyph.cap_line) for glyph in glyphs]
    widths = [glyph.char_width * scale + spacing for glyph, scale in zip(glyphs, scales, strict=True)]
    at = -SHARES[align] * (sum(widths) - spacing)
    strokes: list[Stroke] = []
    for glyph, scale, width in zip(glyphs, scales, widths, strict=True):
        left = at - glyph.left_offset * scale
        for line in glyph.strokes:
            points = tuple((left + x * scale, base + (glyph.base_line - y) * scale) for x, y in line)
            if points:
                strokes.append(Stroke(points))

        at += width

    return strokes


def hershey() -> Any:
    """The library's fonts."""
    with library():
        from HersheyFonts import HersheyFonts

    return HersheyFonts()
