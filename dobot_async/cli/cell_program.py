"""Programs of a cell: one file for all arms, of which each runs its own lines, side by side with the others.

    *: home
    left: move 220 0 40
    left, right: barrier ready      # nobody goes on before both are here
    right: zone bin                 # until leave, or its last line
    right: move 250 0 20 mode=movl
    right: leave bin

Each line is read and checked for each of its arms, as a line of `run` is, before anything is sent to any arm.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractAsyncContextManager, AsyncExitStack
from dataclasses import dataclass
from typing import Any

from dobot_async.cli.failures import StepRefused
from dobot_async.cli.program_files import execute
from dobot_async.errors import DobotError
from dobot_async.fleet.cell import Cell
from dobot_async.fleet.families import family_of
from dobot_async.fleet.fleet import Fleet
from dobot_async.fleet.fleet_arm import Member
from dobot_async.program import VOCABULARIES, ProgramError, Step
from dobot_async.program.text import shortened
from dobot_async.program.vocabulary import ProgramReader, bare

__all__ = ["CellProgram", "Meeting", "parse_cell_program", "run_cell_program", "word_of"]

WORDS = {"barrier", "zone", "leave"}
UNGUARDED = {"rail", "tool"}
"""What changes where an arm's tool is: a guard, which knows the way of each motion, does not hear of it in time."""

ROUNDING = 1e-6  # mm


@dataclass(frozen=True, slots=True)
class Meeting:
    """A line that concerns other arms, too.

    Attributes:
        number: Of the line.
        text: As it was written.
        word: barrier, zone or leave.
        name: Of the barrier, or the zone.
        arms: Those that come to the barrier.
    """

    number: int
    text: str
    word: str
    name: str
    arms: tuple[str, ...]

    def __str__(self) -> str:
        return f"line {self.number} ({shortened(self.text)})"


CellProgram = Mapping[str, Sequence[Step | Meeting]]
"""The lines of each arm."""


def parse_cell_program(lines: Iterable[str], cell: Cell) -> CellProgram:
    """Returns the lines of each arm.

    Raises:
        ProgramError: Lines are wrong, for at least one of their arms.
    """
    barriers: dict[str, tuple[str, ...]] = {}
    parts = {name: ArmProgram(name, member, cell, barriers) for name, member in cell.members.items()}
    problems: list[tuple[int, str]] = []
    for number, written in enumerate(lines, 1):
        text = bare(written)
        if not text:
            continue

        try:
            arms = arms_of(text, cell)
        except ValueError as error:
            problems.append((number, str(error)))
            continue

        wrong: dict[str, str] = {}
        for name in arms:
            try:
                parts[name].read(number, text.partition(":")[2].strip(), arms)
            except (ValueError, TypeError) as error:
                wrong.setdefault(str(error), name)

        problems += [(number, f"{name}: {problem}" if len(arms) > 1 else problem) for problem, name in wrong.items()]

    if problems:
        raise ProgramError(problems)

    return {name: part.lines for name, part in parts.items() if part.lines}


def arms_of(text: str, cell: Cell) -> tuple[str, ...]:
    """The arms that a line is for."""
    before, colon, _ = text.partition(":")
    if not colon:
        raise ValueError("expected ARM: VERB ..., with names of arms, or *, before the colon")

    names = [name.strip() for name in before.split(",")]
    if names == ["*"]:
        return tuple(cell.members)

    for name in names:
        if name not in cell.members:
            raise ValueError(f"no arm {shortened(name)!r}; there are: {', '.join(cell.members)}")

    return tuple(dict.fromkeys(names))


def word_of(member: Member[Any]) -> str:
    """The word of an arm's family, or of its model."""
    return str(member.options.get("model", family_of(member.kind).name))


class ArmProgram:
    """What one arm has to do, as far as it was read.

    Args:
        name: The arm's.
        member: What it is.
        cell: Where it is.
        barriers: The arms that come to each barrier, as far as the program was read.

    Attributes:
        lines: Its lines.
    """

    def __init__(self, name: str, member: Member[Any], cell: Cell, barriers: dict[str, tuple[str, ...]]) -> None:
        self.lines: list[Step | Meeting] = []
        self._name = name
        self._member = member
        self._zones = cell.zones
        self._barriers = barriers
        self._held: set[str] = set()
        self._reader: ProgramReader = VOCABULARIES[word_of(member)].reader(member.options)

    def read(self, number: int, text: str, arms: tuple[str, ...]) -> None:
        """Reads a line; raises ValueError or TypeError that says what is wrong."""
        if not text:
            raise ValueError("expected ARM: VERB ..., with a verb behind the colon")

        word = text.split(maxsplit=1)[0]
        self.lines.append(self._meeting(number, text, arms) if word in WORDS else self._step(number, text))

    def _step(self, number: int, text: str) -> Step:
        member = self._member
        if not member.options.get("control", True):
            raise ValueError(f"{self._name} takes no commands: its options say control = false")

        step = self._reader.read(number, text)
        place = self._reader.checked.place
        if member.guard != "off" and step.verb in UNGUARDED:
            raise ValueError(f"{step.verb} is not for an arm with a guard: it plans with the tool that it began with")

        if member.limits and place:
            x, y, z, _ = member.base.to_cell(*place[:3])
            if not member.limits.contains(x, y, z, ROUNDING):
                raise ValueError(f"({x:.1f}, {y:.1f}, {z:.1f}) of the cell is beyond the limits of {self._name}")

        return step

    def _meeting(self, number: int, text: str, arms: tuple[str, ...]) -> Meeting:
        word, *names = text.split()
        if len(names) != 1:
            raise ValueError(f"expected: {word} NAME")

        (name,) = names
        if word != "barrier" and name not in self._zones:
            raise ValueError(f"no zone {shortened(name)!r}; there are: {', '.join(self._zones) or 'none'}")

        if (word == "zone" and name in self._held) or (word == "leave" and name not in self._held):
            how = "is in it already" if word == "zone" else "is not in it"
            raise ValueError(f"{word} {name}: {self._name} {how}")

        if word == "barrier" and set(self._barriers.setdefault(name, arms)) != set(arms):
            raise ValueError(f"barrier {name} was for {', '.join(self._barriers[name])}, and is not for others later")

        if word != "barrier":
            self._held ^= {name}

        return Meeting(number, text, word, name, arms)


async def run_cell_program(fleet: Fleet[Any], program: CellProgram) -> None:
    """Runs the lines of all arms side by side.

    Raises:
        DobotError: An arm failed, or could not do a line; a note has the line.
    """
    await fleet.run({name: follow(fleet, name, lines) for name, lines in program.items()})


async def follow(fleet: Fleet[Any], name: str, lines: Sequence[Step | Meeting]) -> None:
    """Runs the lines of one arm: its queue is filled, and awaited before it meets others."""
    queue = fleet[name].queue
    held: dict[str, AsyncExitStack] = {}
    async with AsyncExitStack() as stack:
        try:
            for steps, meeting in stretches(lines):
                await execute(queue, steps)
                if meeting:
                    await meet(fleet, meeting, held, stack)
        except DobotError as error:
            error.__notes__ = [f"{name}, {note}" for note in getattr(error, "__notes__", ())]
            raise


def stretches(lines: Iterable[Step | Meeting]) -> Iterator[tuple[list[Step], Meeting | None]]:
    """Yields the steps up to each meeting, and those behind the last one."""
    steps: list[Step] = []
    for line in lines:
        if isinstance(line, Step):
            steps.append(line)
        else:
            yield steps, line
            steps = []

    yield steps, None


async def meet(fleet: Fleet[Any], meeting: Meeting, held: dict[str, AsyncExitStack], stack: AsyncExitStack) -> None:
    """Does what concerns the other arms too."""
    name = meeting.name
    try:
        if meeting.word == "barrier":
            await fleet.barrier(name, *meeting.arms)
        elif meeting.word == "leave":
            await held.pop(name).aclose()
        else:
            zone: AbstractAsyncContextManager[None] = fleet.zone(name)
            held[name] = await stack.enter_async_context(AsyncExitStack())
            await held[name].enter_async_context(zone)
    except DobotError as error:
        error.add_note(str(meeting))
        raise
    except ValueError as error:
        refused = StepRefused(str(error))
        refused.add_note(str(meeting))
        raise refused from error
