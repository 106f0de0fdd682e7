"""What `draw`, `engrave` and `write` take: where the paper is, how the tool is used, what is done of it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, NamedTuple, TypeVar

import click

from dobot_async.cli.params import ABOVE_ZERO, FINITE, NOT_BELOW_ZERO, PERCENT

__all__ = ["Begin", "about_pictures", "in_file", "with_laser", "with_paper", "with_pen"]

F = TypeVar("F", bound=Callable[..., Any])
MODES = ("threshold", "floyd-steinberg", "atkinson", "grey", "halftone", "outline")


class Begin(NamedTuple):
    """Where a drawing begins.

    Attributes:
        stroke: Its number, from 0.
        point: How far in it, in points; for lasers.
    """

    stroke: int = 0
    point: float = 0.0

    def __str__(self) -> str:
        return f"{self.stroke}:{self.point}" if self.point else str(self.stroke)


class BeginType(click.ParamType[Begin]):
    """STROKE, or STROKE:POINT."""

    name = "stroke"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Begin:
        """Reads where to begin."""
        if isinstance(value, Begin):
            return value

        stroke, _, point = value.partition(":")
        try:
            return Begin(int(stroke), float(point or 0))
        except ValueError:
            self.fail(f"{value!r} is no stroke such as 12, nor a stroke and a point such as 12:7.25", param, ctx)


class PictureFile(click.Path):
    """The name of a file to be written, .svg or .png."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Reads the name."""
        if Path(value).suffix.lower() not in {".svg", ".png"}:
            self.fail(f"{value!r} ends neither in .svg nor in .png", param, ctx)

        return super().convert(value, param, ctx)


def several(*options: Callable[[F], F]) -> Callable[[F], F]:
    """Options, in the order of the help."""

    def decorate(function: F) -> F:
        for option in reversed(options):
            function = option(function)

        return function

    return decorate


in_file: Final = click.argument("file", type=click.Path(exists=True, dir_okay=False, path_type=Path))

with_paper: Final = several(
    click.option(
        "--at",
        nargs=3,
        type=FINITE,
        required=True,
        metavar="X Y Z",
        help="Where the tool touches the paper at the drawing's lower left corner, in mm of the arm.",
    ),
    click.option(
        "--size",
        nargs=2,
        type=ABOVE_ZERO,
        metavar="W H",
        help="Make it as large as this rectangle allows, in its middle, mm.  [default: as large as the file says]",
    ),
    click.option(
        "--rotate",
        type=FINITE,
        default=0.0,
        metavar="DEGREES",
        help="Turn it to the left about its corner. Not turned, it goes away from the arm as it goes to the right; "
        "-90 is upright for who faces the arm, 90 for who stands behind it.",
    ),
    click.option(
        "--lift", type=NOT_BELOW_ZERO, default=5.0, show_default=True, help="mm above the paper to travel in."
    ),
    click.option(
        "--tool",
        nargs=3,
        type=FINITE,
        metavar="X Y Z",
        help="How a magician's tool sits, mm from the wrist.  [default: as its pen holder, or its laser]",
    ),
    click.option("--speed", type=ABOVE_ZERO, help="mm/s.  [default: the file's, or 50 with a pen and 20 with a laser]"),
    click.option(
        "--percent", type=click.IntRange(1, 100), help="Of the speed of a mycobot, which knows no mm/s.  [default: 20]"
    ),
    click.option(
        "--from-stroke",
        "begin",
        type=BeginType(),
        default=Begin(),
        metavar="N[:POINT]",
        help="Leave out what lies before it: as the message of an interrupted drawing says, with the same options.",
    ),
    click.option(
        "--preview",
        type=PictureFile(dir_okay=False, writable=True),
        metavar="OUT",
        help="Save a picture of it first, .svg or .png: out of reach is red.",
    ),
    click.option("--dry-run", is_flag=True, help="Only check it, and estimate the time: nothing is sent."),
)

with_pen: Final = several(
    click.option(
        "--press", type=NOT_BELOW_ZERO, default=0.0, help="mm below the paper at full power, for a pen on a spring."
    ),
    click.option("--power", type=PERCENT, help="Percent of the file's pressure; needs --press."),
)

with_laser: Final = click.option(
    "--power", type=PERCENT, help="Percent of the file's power, which is full unless it says."
)

about_pictures: Final = several(
    click.option(
        "--mode",
        type=click.Choice(MODES),
        help="How a picture becomes strokes: black where it is dark (threshold), dithered (floyd-steinberg, the "
        "default, or atkinson), by power (grey), dots (halftone), or outlines.",
    ),
    click.option("--line", type=ABOVE_ZERO, help="mm between two lines of a picture.  [default: 0.4]"),
    click.option("--keep-order", is_flag=True, help="Draw strokes in the file's order, not with little travel."),
)
