"""Programs of a cell: one file for all arms, of which each runs its own lines, side by side with the others.

*: home
left: move 220 0 40
left, right: barrier ready      # nobody goes on before both are here
right: zone bin                 # until leave, or its last line
right: move 250 0 20 mode=movl
right: leave bin
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import AbstractAsyncContextManager, AsyncExitStack
from dataclasses import dataclass
from typing import Any

from dobot_async.cli.commands import ON_OFF
from dobot_async.cli.program import parse_line
from dobot_async.errors import DobotError
from dobot_async.fleet.cell import Cell
from dobot_async.fleet.fleet import Fleet
from dobot_async.magician.arm import Magician

__all__ = ["Line", "execute", "parse_cell_program"]

METHODS = {"home": "home", "move": "move_to", "joints": "move_joints", "wait": "wait", "suction": "suction"}
"""The verbs of arms other than Magicians: what they are called on their queues."""

WHOLE = {"wait"}


@dataclass(frozen=True, slots=True)
class Line:
    """What an arm is to do at one line of a program.

    Attributes:
        number: Of the line.
        text: As it was written.
        word: barrier, zone, leave, or the verb.
        arguments: The name of the barrier or zone; the command and its value; or what the verb takes.
        meets: The arms that come to the barrier.
    """

    number: int
    text: str
    word: str
    arguments: tuple[Any, ...]
    meets: tuple[str, ...] = ()


def parse_cell_program(lines: Iterable[str], cell: Cell) -> dict[str, list[Line]]:
    """Returns the lines of each arm.

    Raises:
        ValueError: Lines are wrong; the message has each with its number.
    """
    program: dict[str, list[Line]] = {name: [] for name in cell.members}
    wrong = []
    for number, written in enumerate(lines, 1):
        text = written.split("#", 1)[0].strip()
        if not text:
            continue

        try:
            for name in arms_of(text, cell):
                program[name].append(parse(number, text, name, cell))
        except (ValueError, TypeError) as error:
            wrong.append(f"line {number}: {error}")

    if not wrong and not any(program.values()):
        wrong.append("it has no commands")

    if wrong:
        raise ValueError("\n".join(wrong))

    return {name: each for name, each in program.items() if each}


def arms_of(text: str, cell: Cell) -> list[str]:
    """The arms that a line is for."""
    before, colon, _ = text.partition(":")
    if not colon:
        raise ValueError("expected ARM: VERB ..., with names of arms, or *, before the colon")

    names = [name.strip() for name in before.split(",")]
    if names == ["*"]:
        return list(cell.members)

    for name in names:
        if name not in cell.members:
            raise ValueError(f"no arm {name!r}; there are: {', '.join(cell.members)}")

    return list(dict.fromkeys(names))


def parse(number: int, text: str, name: str, cell: Cell) -> Line:
    """What a line means for one of its arms."""
    rest = text.partition(":")[2].strip()
    word, *words = rest.split() or [""]
    if word in {"barrier", "zone", "leave"}:
        if len(words) != 1:
            raise ValueError(f"expected: {word} NAME")

        if word != "barrier" and words[0] not in cell.zones:
            raise ValueError(f"no zone {words[0]!r}; there are: {', '.join(cell.zones) or 'none'}")

        return Line(number, rest, word, tuple(words), tuple(arms_of(text, cell)))

    if issubclass(cell.members[name].kind, Magician):
        return Line(number, rest, word, parse_line(rest))

    if word not in METHODS:
        raise ValueError(f"no verb {word!r} for {name}; there are: {', '.join([*METHODS, 'barrier', 'zone', 'leave'])}")

    return Line(number, rest, word, tuple(argument(word, each) for each in words))


def argument(word: str, text: str) -> Any:
    """What an argument of a verb stands for."""
    try:
        return ON_OFF[text] if word == "suction" else int(text) if word in WHOLE else float(text)
    except (ValueError, KeyError):
        raise ValueError(f"{word}: {text!r} is not what it takes") from None


async def execute(fleet: Fleet[Any], program: Mapping[str, Sequence[Line]]) -> None:
    """Runs the lines of all arms side by side.

    Raises:
        DobotError: An arm failed; a note has the line that was to be done.
        ValueError: It leads where an arm cannot or must not go; the message has the line.
    """
    await fleet.run({name: follow(fleet, name, lines) for name, lines in program.items()})


async def follow(fleet: Fleet[Any], name: str, lines: Sequence[Line]) -> None:
    """Runs the lines of one arm: its queue is filled, and awaited before it meets others."""
    queue = fleet[name].queue
    held: dict[str, AsyncExitStack] = {}
    line = lines[0]
    async with AsyncExitStack() as stack:
        try:
            for line in lines:
                if line.word in {"barrier", "zone", "leave"}:
                    await queue.join()
                    await meet(fleet, line, held, stack)
                elif line.arguments and not isinstance(line.arguments[0], (int, float)):
                    await queue.put(*line.arguments)
                else:
                    await getattr(queue, METHODS[line.word])(*line.arguments)

            await queue.join()
        except DobotError as error:
            error.add_note(f"{name}, line {line.number} ({line.text})")
            raise
        except ValueError as error:
            raise ValueError(f"line {line.number} ({line.text}): {error}") from None


async def meet(fleet: Fleet[Any], line: Line, held: dict[str, AsyncExitStack], stack: AsyncExitStack) -> None:
    """Does what concerns the other arms too."""
    name = line.arguments[0]
    if line.word == "barrier":
        await fleet.barrier(name, *line.meets)
    elif line.word == "leave":
        if name in held:
            await held.pop(name).aclose()
    elif name not in held:
        zone: AbstractAsyncContextManager[None] = fleet.zone(name)
        held[name] = await stack.enter_async_context(AsyncExitStack())
        await held[name].enter_async_context(zone)
