"""What the verbs of a program file are, how they are written, and how a line is read.

    move 200 0 5 mode=movl        a verb, its numbers or words in order, then its options as name=value

Empty lines, and what follows a #, count for nothing. What a line means is what the verb of the same name of `arm.queue`
does.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

from dobot_async._core.protocol.wire import Command
from dobot_async.program.step import ProgramError, Step
from dobot_async.program.text import parse_number, shortened

__all__ = [
    "NUMBER",
    "ON_OFF",
    "WHOLE",
    "ArgumentKind",
    "ProgramReader",
    "Verb",
    "Vocabulary",
    "bare",
    "choice",
    "takes",
]

Result = tuple[Command[Any, Any], Any]


@dataclass(frozen=True, slots=True)
class ArgumentKind:
    """What a word may be.

    Attributes:
        read: Converts it; raises ValueError or LookupError.
        what: What it has to be.
        label: How it is shown in the place of its name; "" for the name.
    """

    read: Callable[[str], Any]
    what: str
    label: str = ""


def parse_whole(text: str) -> int:
    """A whole number."""
    found = parse_number(text)
    if not found.is_integer() or abs(found) > MOST:
        raise ValueError(text)

    return int(found)


def choice(words: Mapping[str, Any], label: str = "") -> ArgumentKind:
    """One of several words."""
    return ArgumentKind(lambda text: words[text.lower()], f"one of {', '.join(words)}", label)


MOST = 2**53
NUMBER = ArgumentKind(parse_number, "a number")
WHOLE = ArgumentKind(parse_whole, "a whole number")
ON_OFF = ArgumentKind(lambda text: {"on": True, "off": False}[text.lower()], "on or off", "on|off")


def takes(kind: ArgumentKind, *names: str) -> tuple[tuple[str, ArgumentKind], ...]:
    """Arguments of one kind."""
    return tuple((name, kind) for name in names)


@dataclass(frozen=True, slots=True)
class Verb:
    """How a verb is written.

    Attributes:
        call: Makes the command and its value, with the family's checked verbs before the arguments.
        arguments: What stands behind it, in order.
        needed: How much of that must.
        options: What may stand behind that, as name=value.
    """

    call: Callable[..., Result]
    arguments: tuple[tuple[str, ArgumentKind], ...] = ()
    needed: int = 0
    options: Mapping[str, ArgumentKind] = field(default_factory=dict[str, ArgumentKind])

    def usage(self, name: str) -> str:
        """How it is written."""
        labels = [kind.label or label.upper() for label, kind in self.arguments]
        arguments = [label if place < self.needed else f"[{label}]" for place, label in enumerate(labels)]
        options = [f"[{option}={kind.label or option.upper()}]" for option, kind in self.options.items()]
        return " ".join([name, *arguments, *options])


@dataclass(frozen=True, slots=True)
class Vocabulary:
    """The verbs of a family, or of one of its models.

    Attributes:
        arm: What the arm is called.
        verbs: By name.
        checked: Makes the family's verbs, which check what they are given and remember what it means for the steps
            behind it; of what `connect` is given.
    """

    arm: str
    verbs: Mapping[str, Verb]
    checked: Callable[[Mapping[str, Any]], Any]

    def reader(self, options: Mapping[str, Any] = MappingProxyType({})) -> ProgramReader:
        """Begin to read a program for an arm that is connected with these options."""
        return ProgramReader(self, self.checked(options))

    def parse(self, lines: Iterable[str], options: Mapping[str, Any] = MappingProxyType({})) -> tuple[Step, ...]:
        """Return a program's steps.

        Raises:
            ProgramError: Lines are wrong.
        """
        reader = self.reader(options)
        steps: list[Step] = []
        problems: list[tuple[int, str]] = []
        for number, written in enumerate(lines, 1):
            text = bare(written)
            if text:
                try:
                    steps.append(reader.read(number, text))
                except (ValueError, TypeError) as error:
                    problems.append((number, str(error)))

        if problems:
            raise ProgramError(problems)

        return tuple(steps)

    def usage(self) -> str:
        """How all verbs are written."""
        return "; ".join(verb.usage(name) for name, verb in self.verbs.items())


class ProgramReader:
    """Reads the lines of one program, each of which may depend on those before it.

    Attributes:
        checked: The family's verbs; `place` is where the tool is after the last step, None if that is not known.
    """

    def __init__(self, vocabulary: Vocabulary, checked: Any) -> None:
        self.checked = checked
        self._vocabulary = vocabulary

    def read(self, number: int, text: str) -> Step:
        """Return the step of a line; raise ValueError or TypeError that says what is wrong."""
        try:
            return self._read(number, text)
        except Exception:
            self.checked.lose_place()  # what is behind it is not to be wrong because of it
            raise

    def _read(self, number: int, text: str) -> Step:
        name, *words = text.split()
        name = name.lower()
        verbs = self._vocabulary.verbs
        verb = verbs.get(name)
        if verb is None:
            raise ValueError(
                f"no verb {shortened(name)!r} for the {self._vocabulary.arm}; there are: {', '.join(verbs)}"
            )

        given = [word for word in words if "=" not in word]
        if not verb.needed <= len(given) <= len(verb.arguments):
            raise ValueError(f"expected: {verb.usage(name)}")

        values = [read(label, kind, word) for (label, kind), word in zip(verb.arguments, given, strict=False)]
        options: dict[str, Any] = {}
        for word in words:
            option, equals, written = word.partition("=")
            if not equals:
                continue

            if option not in verb.options or option in options:
                how = "twice" if option in options else "no option"
                raise ValueError(f"{how} {shortened(option)!r}: {verb.usage(name)}")

            options[option] = read(option, verb.options[option], written)

        return Step(number, text, *verb.call(self.checked, *values, **options), verb=name)


def bare(written: str) -> str:
    """A line without its comment."""
    return written.split("#", 1)[0].strip()


def read(name: str, kind: ArgumentKind, text: str) -> Any:
    """Return what a word stands for."""
    try:
        return kind.read(text)
    except (ValueError, LookupError):
        raise ValueError(f"{name} is {kind.what}, not {shortened(text)!r}") from None
