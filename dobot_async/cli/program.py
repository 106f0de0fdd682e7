"""`run`: program files, one verb a line, read and checked as a whole before anything is sent.

    # pick a piece up
    home
    move 200 0 50           # X Y Z [R], mm and degrees
    move 200 0 5 mode=movl
    suction on
    wait 0.5

A verb has its numbers or words in order, then options as name=value. Empty lines, and what follows a #, count for
nothing. What a line means is what the verb of the same name of `arm.queue` does.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TextIO, TypeVar

import click

from dobot_async._core.queue.motion import Motion
from dobot_async.cli.commands import ON_OFF
from dobot_async.cli.families import MODES
from dobot_async.cli.session import Session
from dobot_async.errors import ArmAlarm, DobotError
from dobot_async.magician.arm import Magician
from dobot_async.magician.params import IOFunction, PTPMode
from dobot_async.magician.verbs import Verbs
from dobot_async.wire import Command

__all__ = ["Step", "parse", "run_program"]

Q = TypeVar("Q")
Reader = Callable[[str], Any]
STANDS_WITHIN = 1.5  # seconds for which one waits, after an alarm, to hear which motion it has ended


@dataclass(frozen=True, slots=True)
class Step:
    """One line of a program: a command for the queue, checked."""

    line: int
    text: str
    command: Command[Any, Any]
    value: Any


class Steps(Verbs[tuple[Command[Any, Any], Any]]):
    """The verbs, each of which returns its command and value, if the arm could take them."""

    def perform(self, command: Command[Q, Any], value: Q, timeout: float | None) -> tuple[Command[Any, Any], Any]:
        """Checks a command; a line of a program has no timeout."""
        assert timeout is None
        command.request.encode(value)
        return command, value


@dataclass(frozen=True, slots=True)
class Verb:
    """How a verb is written: what to call, what stands behind it in order, how much of that must, and its options."""

    call: Callable[..., tuple[Command[Any, Any], Any]]
    arguments: tuple[tuple[str, Reader], ...] = ()
    needed: int = 0
    options: Mapping[str, Reader] = field(default_factory=dict)


def number(text: str) -> float:
    """A number."""
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(text)

    return value


def whole(text: str) -> int:
    """A whole number."""
    return int(text)


def mode(text: str) -> PTPMode:
    """A way to move: movj, movl, jump, ..."""
    return MODES[text.lower()]


def state(text: str) -> bool:
    """The word on or off."""
    return ON_OFF[text.lower()]


def function(text: str) -> IOFunction:
    """What a pin is for: do, pwm, di, adc, ..."""
    return FUNCTIONS[text.lower()]


def takes(reader: Reader, *names: str) -> tuple[tuple[str, Reader], ...]:
    """Arguments of one kind."""
    return tuple((name, reader) for name in names)


STEPS = Steps()
FUNCTIONS = {each.name.lower(): each for each in IOFunction}
XYZR = takes(number, "x", "y", "z", "r")
JOINTS = takes(number, "j1", "j2", "j3", "j4")
PIN = takes(whole, "address")

VERBS: Mapping[str, Verb] = {
    "home": Verb(STEPS.home),
    "move": Verb(STEPS.move_to, XYZR, 3, {"mode": mode, "l": number}),
    "joints": Verb(STEPS.move_joints, JOINTS, 4),
    "by": Verb(STEPS.move_by, XYZR, 3),
    "path": Verb(STEPS.path_to, XYZR[:3], 3),
    "engrave": Verb(STEPS.engrave_to, (*XYZR[:3], ("power", number)), 4),
    "wait": Verb(STEPS.wait, takes(number, "seconds"), 1),
    "wait-input": Verb(STEPS.wait_for_input, PIN, 1, {"level": state}),
    "suction": Verb(lambda on: STEPS.suction(on, pump=on), takes(state, "on"), 1),
    "gripper": Verb(STEPS.gripper, takes(state, "closed"), 1, {"pump": state}),
    "laser": Verb(STEPS.laser, takes(state, "on"), 1),
    "pin": Verb(STEPS.configure_io, (*PIN, ("function", function)), 2),
    "output": Verb(STEPS.set_output, (*PIN, ("level", state)), 2),
    "pwm": Verb(STEPS.set_pwm, (*PIN, *takes(number, "frequency", "duty_cycle")), 3),
    "conveyor": Verb(STEPS.conveyor, takes(whole, "speed"), 1, {"distance": whole, "motor": whole}),
    "speed": Verb(STEPS.set_speed, takes(number, "velocity", "acceleration"), 1),
}


def parse(lines: Iterable[str]) -> list[Step]:
    """Returns a program's steps.

    Raises:
        ValueError: Lines are wrong; the message has each with its number.
    """
    steps, wrong = [], []
    for line, written in enumerate(lines, 1):
        text = written.split("#", 1)[0].strip()
        if text:
            try:
                steps.append(Step(line, text, *parse_line(text)))
            except (ValueError, TypeError) as error:
                wrong.append(f"line {line}: {error}")

    if wrong:
        raise ValueError("\n".join(wrong))

    return steps


def parse_line(text: str) -> tuple[Command[Any, Any], Any]:
    """Returns the command and value of a line; raises ValueError or TypeError that names what is wrong."""
    name, *words = text.split()
    verb = VERBS.get(name.lower())
    if verb is None:
        raise ValueError(f"no verb {name!r}; there are: {', '.join(VERBS)}")

    given = [word for word in words if "=" not in word]
    if not verb.needed <= len(given) <= len(verb.arguments):
        raise ValueError(f"expected: {usage(name.lower(), verb)}")

    values = [read(label, reader, word) for (label, reader), word in zip(verb.arguments, given, strict=False)]
    options = {}
    for word in words:
        option, equals, written = word.partition("=")
        if not equals:
            continue

        if option not in verb.options or option in options:
            raise ValueError(f"{'twice' if option in options else 'no option'} {option!r}: {usage(name.lower(), verb)}")

        options[option] = read(option, verb.options[option], written)

    return verb.call(*values, **options)


def read(name: str, reader: Reader, text: str) -> Any:
    """Returns what a word stands for."""
    try:
        return reader(text)
    except (ValueError, KeyError):
        raise ValueError(f"{name} is {KINDS[reader]}, not {text!r}") from None


KINDS: Mapping[Reader, str] = {
    number: "a number",
    whole: "a whole number",
    mode: f"one of {', '.join(MODES)}",
    state: "on or off",
    function: f"one of {', '.join(FUNCTIONS)}",
}


def usage(name: str, verb: Verb) -> str:
    """How a verb is written."""
    labels = ["on|off" if reader is state else label.upper() for label, reader in verb.arguments]
    arguments = [label if place < verb.needed else f"[{label}]" for place, label in enumerate(labels)]
    return " ".join([name, *arguments, *(f"[{option}=...]" for option in verb.options)])


@click.command(
    name="run",
    epilog="Verbs: " + "; ".join(usage(name, verb) for name, verb in VERBS.items()) + ".",
)
@click.argument("file", type=click.File("r", encoding="utf-8-sig"))
@click.pass_obj
def run_program(session: Session, file: TextIO) -> None:
    """Run a program file.

    FILE (- is standard input) has one verb a line, as in: move 200 0 50 mode=movl. All lines are checked before
    anything is sent. What an earlier program left in the arm's queue is thrown away. Ctrl-C stops the arm.
    """
    session.only("magician")
    try:
        steps = parse(file)
    except UnicodeDecodeError as error:
        raise click.UsageError(f"{file.name} is not UTF-8 text: {error}") from None
    except ValueError as error:
        raise click.UsageError(f"{file.name} is wrong, and nothing was sent:\n{error}") from None

    if not steps:
        raise click.UsageError(f"{file.name} has no commands")

    with session.output.counting(file.name, len(steps)) as report:
        session.ask(lambda arm: execute(arm, steps, report))

    session.output.answer({"file": file.name, "commands": len(steps)}, f"{file.name}: {len(steps)} commands done")


async def execute(arm: Magician, steps: Sequence[Step], report: Callable[[int], None]) -> None:
    """Queues all steps, as room allows, and returns when the arm has executed the last; reports how many it has.

    Raises:
        DobotError: As `arm.queue.put` and the Motions do, with a note of the line that it is about.
    """
    motions: list[Motion] = []
    done = 0
    try:
        # Watching all the time finds an alarm while the program is still being sent.
        with arm.queue.watching():
            for step in steps:
                motions.append(await arm.queue.put(step.command, step.value))
                while done < len(motions) and motions[done].done:
                    await motions[done]
                    done += 1

                report(done)

            for motion in motions[done:]:
                await motion
                done += 1
                report(done)
    except DobotError as error:
        step = await ended_at(steps, motions, error)
        error.add_note(f"line {step.line} ({step.text})")
        raise


async def ended_at(steps: Sequence[Step], motions: Sequence[Motion], error: DobotError) -> Step:
    """Returns the first step that is known to have failed; if there is none, the one that was to be sent next.

    An alarm ends all Motions, but of those that the arm ticked off before it that is known only once the arm stands.
    """
    for step, motion in zip(steps, motions, strict=False):
        if motion.ended or isinstance(error, ArmAlarm):
            try:
                await motion.wait(STANDS_WITHIN)
            except DobotError:
                return step

    return steps[min(len(motions), len(steps) - 1)]
