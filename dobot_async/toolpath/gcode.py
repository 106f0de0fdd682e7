"""G-code of pen plotters and lasers as toolpaths.

    line --words--> Machine: place, mode, tool --ways with the tool down--> strokes

The tool is down on the ways of G1, G2 and G3, never on those of G0, if

1. the laser (or the spindle, or the pen's servo) is on: after M3, M4 or M106 with a power above 0, until M5, M107 or a
   power of 0. A program that has none of these is drawn with the tool on all the time;
2. Z is low: at or below the middle of the values of Z in the program. A program in which Z does not change is not
   looked at for that.

Read are G0 to G3, G20/21, G90/91, G90.1/91.1, G92, G28, M3 to M5, M21 P (the ultraArm's laser), M106/107, F in units
per minute. Other M codes and GRBL's $ lines say nothing of the way. A line ends at LF or CR LF, and nowhere else.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from dobot_async._core.util.arguments import to_float
from dobot_async.toolpath import curves
from dobot_async.toolpath.errors import ToolpathFileError
from dobot_async.toolpath.gcode_lines import INCH, GCodeWords, WrongLine, lines_of, low_of, switched
from dobot_async.toolpath.sources import FINE, Source, check_tolerance, content, name_of
from dobot_async.toolpath.stroke import FULL, Point, Stroke
from dobot_async.toolpath.toolpath import Toolpath

__all__ = ["read_gcode"]

UNTIDY = 0.01  # by how much radii of one arc may differ, as a share, and in mm
BYTE = 255.0
ARC_AXES = "IJKR"
NOT_READ = {18: "another plane than XY", 19: "another plane than XY", 5: "splines", 93: "inverse time feeds"}
IGNORED = frozenset({4, 17, 40, 43, 49, 53, 54, 55, 56, 57, 58, 59, 61, 64, 80, 94, 98, 99})


class GCodeProblem(ValueError):
    """What is wrong with a line."""


@dataclass(slots=True)
class Machine:
    """What a program has told so far.

    Attributes:
        tolerance: mm by which ways may miss an arc.
        full: The S of full power.
        switched: Whether the program switches a laser at all.
        low: The Z at or below which the tool is down; None if that says nothing.
    """

    tolerance: float
    full: float
    switched: bool
    low: float | None
    place: complex = 0j
    z: float = 0.0
    unit: float = 1.0
    absolute: bool = True
    arc_absolute: bool = False
    motion: int | None = None
    feed: float | None = None
    on: bool = False
    power: float = FULL
    origin: complex = 0j
    strokes: list[Stroke] = field(default_factory=list[Stroke])
    points: list[Point] = field(default_factory=list[Point])
    powers: list[float] = field(default_factory=list[float])
    speed: float | None = None

    def run(self, line: GCodeWords) -> None:
        """Do one line: settings first, as machines do, then the way."""
        moving = any(letter in "XYZ" for letter, _ in line.words)
        way = None
        for letter, number in line.words:
            if letter == "G":
                way = self._g(number) or way
            elif letter == "M":
                self._m(int(number), line)

        feed, power = line.get("F"), line.get("S")
        if feed is not None:
            if feed <= 0:
                raise GCodeProblem(f"F{feed:g}: a feed is above 0")
            self.feed = feed * self.unit / 60

        if power is not None and not any(letter == "M" and number in {106, 280} for letter, number in line.words):
            self.power = self._percent(power, self.full)

        if way == "set":
            self._set_origin(line)
        elif way == "home":
            self._go(0j, self.z, down=False)
        elif moving or (self.motion in {2, 3} and line.get("I") is not None):
            self._move(line)

    def finish(self) -> None:
        """End the stroke that is being drawn."""
        if len(self.points) > 1 or (self.points and self.low is not None):  # a pen that is lowered makes a dot
            self.strokes.append(Stroke(tuple(self.points), tuple(self.powers), self.speed))

        self.points, self.powers = [], []

    @property
    def down(self) -> bool:
        """Whether a way of G1 to G3 is drawn."""
        lit = not self.switched or (self.on and self.power > 0)
        return lit and (self.low is None or self.z <= self.low)

    def _g(self, number: float) -> str | None:
        """A G word; returns "set" and "home" for those whose axes are no way."""
        if number in SETTINGS:
            SETTINGS[number](self)
        elif number in {0, 1, 2, 3}:
            self.motion = int(number)
        elif number == 92:
            return "set"
        elif number in {28, 30}:
            return "home"
        elif number in NOT_READ:
            raise GCodeProblem(f"G{number:g}: {NOT_READ[int(number)]} cannot be drawn")
        elif number not in IGNORED:
            raise GCodeProblem(f"G{number:g} is not known here")

        return None

    def _m(self, number: int, line: GCodeWords) -> None:
        """An M word."""
        if number in {3, 4}:
            self.on = True
        elif number in {5, 107}:
            self.on = False
        elif number == 21 and (duty := line.get("P")) is not None:
            self.power = self._percent(duty, BYTE, "P")
        elif number == 106:
            given = line.get("S")
            self.on, self.power = True, self._percent(BYTE if given is None else given, BYTE)

    def _percent(self, power: float, full: float, letter: str = "S") -> float:
        if not 0 <= power <= full:
            raise GCodeProblem(f"{letter}{power:g} is not in 0 to {full:g}; if it is no mistake, give full_power=")

        return FULL * power / full

    def _set_origin(self, line: GCodeWords) -> None:
        """G92: what follows counts from another origin; the place stays."""
        x, y = (line.get(letter) for letter in "XY")
        if x is y is None and line.get("Z") is None:
            self.origin = 0j

        here = self.place - self.origin
        wanted = complex(here.real if x is None else x * self.unit, here.imag if y is None else y * self.unit)
        self.origin += here - wanted

    def _move(self, line: GCodeWords) -> None:
        """A way by the motion that holds."""
        if self.motion is None:
            raise GCodeProblem("axes without G0 to G3 before them")

        here = self.place - self.origin
        x, y, z = (None if (given := line.get(letter)) is None else given * self.unit for letter in "XYZ")
        if self.absolute:
            target = complex(here.real if x is None else x, here.imag if y is None else y)
            height = self.z if z is None else z
        else:
            target = here + complex(x or 0.0, y or 0.0)
            height = self.z + (z or 0.0)

        target += self.origin
        if self.motion in {2, 3}:
            self._go(target, height, down=self.motion > 0, through=self._arc(line, target))
        else:
            self._go(target, height, down=self.motion > 0)

    def _go(self, target: complex, height: float, *, down: bool, through: list[complex] | None = None) -> None:
        """Go somewhere, and draw if the tool is down."""
        stays = target == self.place and not through
        self.z = height
        if down and self.down:
            if len(self.points) > 1 and self.speed != self.feed and not stays:
                self.finish()

            if len(self.points) < 2:
                self.points, self.powers, self.speed = [(self.place.real, self.place.imag)], [self.power], self.feed

            for point in [] if stays else through or [target]:
                self.points.append((point.real, point.imag))
                self.powers.append(self.power)
        elif not (stays and self.down):
            self.finish()

        self.place = target

    def _arc(self, line: GCodeWords, target: complex) -> list[complex]:
        """The points of an arc, but for its first one."""
        i, j, _, r = (None if (given := line.get(letter)) is None else given * self.unit for letter in ARC_AXES)
        left = self.motion == 3
        if r is not None:
            centre = centre_of(self.place, target, r, left=left)
        elif i is None and j is None:
            raise GCodeProblem("an arc needs I and J, or R")
        elif self.arc_absolute:
            centre = complex(self.place.real if i is None else i, self.place.imag if j is None else j) + self.origin
        else:
            centre = self.place + complex(i or 0.0, j or 0.0)

        start, end = self.place - centre, target - centre
        if abs(abs(start) - abs(end)) > UNTIDY * max(abs(start), 1.0):
            raise GCodeProblem(f"the arc's ends are {abs(start):.3f} and {abs(end):.3f} mm from its centre")

        sweep = math.fmod(cmath.phase(end) - cmath.phase(start), math.tau)
        if target == self.place or sweep == 0:
            sweep = math.tau if left else -math.tau
        elif (sweep > 0) != left:
            sweep += math.tau if left else -math.tau

        return [*curves.circular(self.tolerance, centre, self.place, sweep)[:-1], target]


def centre_of(start: complex, end: complex, radius: float, *, left: bool) -> complex:
    """The centre of an arc by its radius; a negative one takes the longer way round."""
    chord = end - start
    if not chord:
        raise GCodeProblem("an arc by R must end elsewhere than it begins")

    square = radius**2 - abs(chord) ** 2 / 4
    if square < -UNTIDY * radius**2:
        raise GCodeProblem(f"R{radius:g} is too small for ends that are {abs(chord):.3f} mm apart")

    aside = chord / abs(chord) * 1j * math.sqrt(max(0.0, square))
    return (start + end) / 2 + (aside if left == (radius > 0) else -aside)


def set_(name: str, value: object) -> Callable[[Machine], None]:
    """What sets one of a machine's attributes."""
    return lambda machine: setattr(machine, name, value)


SETTINGS: Mapping[float, Callable[[Machine], None]] = {
    20: set_("unit", INCH),
    21: set_("unit", 1.0),
    90: set_("absolute", True),
    91: set_("absolute", False),
    90.1: set_("arc_absolute", True),
    91.1: set_("arc_absolute", False),
}


def read_gcode(
    source: Source, *, tolerance: float = FINE, full_power: float = 1000.0, pen_z: float | None = None
) -> Toolpath:
    """Read the G-code of a pen plotter or a laser, as LaserGRBL, Inkscape and Luban write it.

    Args:
        source: The path of a file, or a stream.
        tolerance: mm by which straight ways may miss an arc.
        full_power: The S of full power: GRBL's $30, 1000 unless somebody has changed it; 255 for many others.
        pen_z: The Z in mm at or below which the tool is down; None takes the middle of those in the program.

    Returns:
        A toolpath in mm, with powers in percent of `full_power`, and speeds in mm/s.

    Raises:
        ToolpathFileError: A line is wrong, or cannot be drawn; it tells which.
    """
    check_tolerance(tolerance)
    if not 0 < to_float(full_power, "full_power") < math.inf:
        raise ValueError(f"full_power must be above 0 and finite, not {full_power!r}")

    name = name_of(source)
    try:
        text = content(source).decode("utf-8-sig", errors="replace")
        program = list(lines_of(text))
        machine = Machine(
            tolerance, float(full_power), switched(program), pen_z if pen_z is not None else low_of(program)
        )
        for line in program:
            try:
                machine.run(line)
            except (ValueError, OverflowError) as error:
                raise WrongLine(line.number, str(error)) from None
    except WrongLine as error:
        raise ToolpathFileError(name, f"line {error.number}", error.reason) from None

    machine.finish()
    return Toolpath(tuple(machine.strokes))
