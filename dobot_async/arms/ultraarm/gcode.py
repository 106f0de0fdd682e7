"""G-code programs: read and checked as a whole before anything is sent, then streamed through the arm's queue.

    ; a comment                    (another one)
    G90
    G1 X200 Y0 Z40 F100            G0 and G1 are sent as they are
    X210                           a line of axes alone goes on with the motion before it, at its F
    G4 S0.5                        the arm waits whole seconds, the rest passes on this side
    M3
    M30                            ends the program, as M2 does

Line numbers (N10) and checksums (*71) count for nothing, nor do G17, G21, G40, G49, G80 and G94, which say what is so
anyway. F is mm/s, as the arm has it, not mm/min. What the arm has no command for is an error, and so is what asks it
something, a letter twice in one command, and a comment that is not closed in its line. A % stands alone on its line. A
program begins in absolute coordinates, and leaves the arm in them, whatever becomes of it.
"""

from __future__ import annotations

import os
import re
from collections.abc import AsyncIterator, Callable, Generator, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from dobot_async._core.protocol.wire import Command, Queueing
from dobot_async._core.queue.motion import Motion
from dobot_async._core.queue.queue import MotionQueue
from dobot_async._core.util.tasks import Cleanup
from dobot_async.arms.ultraarm import commands as c
from dobot_async.arms.ultraarm.frame import split_words
from dobot_async.arms.ultraarm.gcode_text import bare
from dobot_async.arms.ultraarm.goals import AXES, INCREMENTS
from dobot_async.arms.ultraarm.keeping import Stand, UltraArmKeeper
from dobot_async.arms.ultraarm.layouts import Words
from dobot_async.errors import DobotError, MotionStopped, ProtocolError
from dobot_async.program.step import ProgramError
from dobot_async.program.step import Step as GCodeLine
from dobot_async.program.text import lines_in, read_text, shortened

__all__ = ["GCodeLine", "GCodeRun", "Source", "parse_gcode"]

Source = str | os.PathLike[str] | Iterable[str]
EXPONENT = re.compile(r"\de[-+]?\d")
IGNORED = {"G17", "G21", "G40", "G49", "G80", "G94"}
ENDING = {"M2", "M30"}
MOVING = "XYZEF"
DWELL = Words(c.Dwell)
"""What a program may say behind G4: fractions too."""

MODES = {c.ABSOLUTE: False, c.RELATIVE: True}


def parse_gcode(
    source: Source, limits: c.UltraArmLimits = c.MANUAL_LIMITS, keeper: UltraArmKeeper | None = None
) -> tuple[GCodeLine, ...]:
    """Return a program's commands; do no more than to read the file.

    Args:
        source: A file's path, or lines.
        limits: What the arm may be told. Of increments the goal is looked at, where it is known from where.
        keeper: What keeps the arm in its workspace, from the first place on that is known.

    Raises:
        ProgramError: Lines are wrong; the message has each with its number.
        ValueError: The file is not UTF-8 text.
        OSError: The file cannot be read.
    """
    reader = GCodeReader(limits, keeper)
    found: list[GCodeLine] = []
    wrong: list[tuple[int, str]] = []
    for number, written in enumerate(lines_of(source), 1):
        try:
            for command, value in reader.read(bare(written)):
                found.append(GCodeLine(number, written.strip(), command, value))
        except (ValueError, TypeError, ProtocolError) as error:
            wrong.append((number, str(error)))

        if reader.ended:
            break

    if wrong:
        raise ProgramError(wrong)

    return tuple(found)


def lines_of(source: Source) -> Iterable[str]:
    """Return the lines of a program."""
    if isinstance(source, (str, os.PathLike)):
        return lines_in(read_text(Path(source)))

    return source


class GCodeReader:
    """What the lines so far mean for the next one.

    Attributes:
        ended: Whether the program has said that it ends.
    """

    def __init__(self, limits: c.UltraArmLimits, keeper: UltraArmKeeper | None = None) -> None:
        self.ended: bool = False
        self._keeper = keeper
        self._stand = Stand()
        self._limits = limits
        self._relative = False
        self._motion = ""  # what a line of axes alone goes on with
        self._speed: float | None = None
        self._here: dict[str, float | None] = dict.fromkeys(AXES)

    def read(self, text: str) -> Iterator[tuple[Command[Any, Any], Any]]:
        """Yield the commands of a line, each with its parameters."""
        if not text:
            return

        for name, letters in self._groups(text):
            if name in IGNORED:
                continue

            if name in ENDING:
                self.ended = True
                return

            command = row_of(name)
            letters_only = [each[0] for each in letters]
            if len({*letters_only}) < len(letters):
                raise ValueError(f"{name} has a letter twice")

            layout = DWELL if command is c.WAIT else command.request
            value = layout.decode("".join(letters).encode("ascii"))
            if isinstance(value, c.CoordsMove) and all(getattr(value, axis) is None for axis in AXES):
                self._speed = value.f
                continue

            value = self._checked(command, value)
            self._motion = name if command in INCREMENTS else self._motion
            yield command, value

    def _groups(self, text: str) -> Iterator[tuple[str, list[str]]]:
        """Yield the commands of a line, each with its own words."""
        if EXPONENT.search(text):
            raise ValueError(f"{shortened(text)!r} has an exponent, which the arm would read as its fourth axis")

        try:
            words = split_words(text.encode("ascii"))
        except ValueError:
            raise ValueError(f"{shortened(text)!r} is no G-code") from None

        groups: list[tuple[str, list[str]]] = []
        for letter, number in words:
            if letter == "N" and not groups:
                continue

            if letter in "GM" and not (groups and letter in letters_of(groups[-1][0])):
                groups.append((f"{letter}{int(number)}" if number.isdigit() else letter + number, []))
            elif groups:
                groups[-1][1].append(letter + number)
            elif letter in MOVING and self._motion:
                groups.append((self._motion, [letter + number]))
            else:
                raise ValueError(f"{letter}{number} belongs to no command")

        yield from groups

    def _checked(self, command: Command[Any, Any], value: Any) -> Any:
        """Return the parameters with the speed that still holds; raise ValueError where the arm could not take them."""
        if isinstance(value, (c.CoordsMove, c.JointMove, c.JointsMove)):
            self._speed = self._speed if value.f is None else value.f
            value = replace(value, f=self._speed)

        command.request.encode(value)
        if self._keeper:
            self._stand = self._keeper.lead(command, value, self._stand)

        if command in INCREMENTS:
            self._move(value)
        else:
            self._limits.check(value)
            self._relative = MODES.get(command, self._relative)
            if command is c.SET_POSITION:
                self._here |= {axis: at for axis in AXES if (at := getattr(value, axis)) is not None}
            elif command.moves or command is c.RELEASE:
                self._here = dict.fromkeys(AXES)

        return value

    def _move(self, value: c.CoordsMove) -> None:
        """Go along with a motion, as far as it is known where it begins."""
        there = dict(self._here)
        for axis in AXES:
            given, at = getattr(value, axis), self._here[axis]
            if given is not None:
                there[axis] = given if not self._relative else None if at is None else at + given

        self._limits.check(c.CoordsMove(**there))
        self._here = there


def row_of(name: str) -> Command[Any, Any]:
    """Return the row of a word; raise ValueError where a program cannot have it."""
    command = c.BY_WORD.get(name)
    if command is None:
        raise ValueError(f"the arm has no command {name}")

    if command.queueing is Queueing.NEVER:
        raise ValueError(f"{name} is no command for a program")

    return command


def letters_of(name: str) -> str:
    """Return the letters that may stand behind a word."""
    request = c.BY_WORD[name].request if name in c.BY_WORD else None
    return "".join(field.letter.letter for field in request.fields) if isinstance(request, Words) else ""


class GCodeRun:
    """A program that is checked, and sent when this is awaited or iterated over; it yields each line that is done.

    It belongs to who awaits it: a cancellation stops the arm. A line that fails is named in a note of the error.

    Attributes:
        lines: Its commands.
    """

    def __init__(
        self,
        queue: MotionQueue,
        cleanup: Cleanup,
        lines: Sequence[GCodeLine],
        *,
        send: bool = True,
        constant_speed: bool = False,
        progress: Callable[[int, int], None] | None = None,
    ) -> None:
        before = [GCodeLine(0, "G90", c.ABSOLUTE, None)]
        after = [GCodeLine(0, "G90", c.ABSOLUTE, None)]
        if constant_speed:
            before.append(GCodeLine(0, "M16 S0", c.SET_SPEED_MODE, c.ModeOfSpeed(c.SpeedMode.CONSTANT)))
            after.append(GCodeLine(0, "M16 S2", c.SET_SPEED_MODE, c.ModeOfSpeed(c.SpeedMode.RAMPED)))

        self.lines: tuple[GCodeLine, ...] = tuple(lines)
        self._queue = queue
        self._cleanup = cleanup
        self._todo = [*before, *lines, *after] if send and lines else []
        self._progress = progress
        self._constant_speed = constant_speed

    def __await__(self) -> Generator[Any, None, None]:
        return self._run().__await__()

    async def __aiter__(self) -> AsyncIterator[GCodeLine]:
        motions: list[Motion] = []
        done, count, epoch = 0, 0, self._queue.epoch
        try:
            with self._queue.watching():
                for step in [*self._todo, None]:
                    if step:
                        motions.append(await self._queue.put(step.command, step.value, epoch=epoch))

                    while done < len(motions) and (step is None or motions[done].done):
                        await motions[done]
                        line = self._todo[done]
                        done += 1
                        if line.number:
                            count += 1
                            self._report(count)
                            yield line
        except DobotError as error:
            error.add_note(str(self._failed(motions)))
            self._ramp()
            raise
        except BaseException as error:  # a cancellation, or who iterates has left; or `progress` has failed
            stopped = MotionStopped("the program that it belonged to was cancelled, or left")
            failure = await self._cleanup.finish(self._queue.begin_stop(stopped))
            if failure:
                error.add_note(str(failure))

            self._ramp()
            raise

    def _ramp(self) -> None:
        """Go back to ramps, behind the stop that ends the program before it does so itself."""
        if self._constant_speed:
            self._cleanup.start(self._back_to_ramps(), "going back to ramps")

    async def _back_to_ramps(self) -> None:
        with suppress(DobotError):
            await (await self._queue.put(c.SET_SPEED_MODE, c.ModeOfSpeed(c.SpeedMode.RAMPED)))

    async def _run(self) -> None:
        async for _ in self:
            pass

    def _report(self, done: int) -> None:
        if self._progress:
            self._progress(done, len(self.lines))

    def _failed(self, motions: Sequence[Motion]) -> GCodeLine:
        """Return the first line that is known to have failed; if there is none, the one that was to be sent next."""
        for line, motion in zip(self._todo, motions, strict=False):
            if motion.ended and motion.exception():
                return line

        return self._todo[min(len(motions), len(self._todo) - 1)]
