"""The lines that pass a bridge to an ultraArm: a client's with what closes their answers, and the arm's answers."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.ultraarm import commands as c
from dobot_async.arms.ultraarm.answers import Bracket
from dobot_async.arms.ultraarm.frame import (
    CLOSING,
    COORDS,
    END,
    LONGEST,
    SIZE,
    STATUS,
    SWITCHES,
    bracket,
    errors,
    key_of,
    printable,
    readings_shown,
    split_words,
)
from dobot_async.errors import ProtocolError

__all__ = ["PATTERNS", "PREFIX", "Answers", "BridgedLine", "Requests", "fits", "understood", "words_of"]

LONGEST_LINE = 256
TOKEN = b"TOKEN "
"""How the line begins that a client with a token sends first; a listener without a token leaves it in the stream."""

ASKED = 16  # requests that the arm has not answered
NAMED = re.compile(rb"[A-Z0-9]\s*\[", re.IGNORECASE)
PATTERNS: Mapping[bytes, re.Pattern[bytes]] = MappingProxyType(
    {row.name.encode(): row.reply.pattern for row in c.ALL if isinstance(row.reply, Bracket)}
    | {SIZE: bracket("QUEUE SIZE")}
)
"""What a reading is answered with; M9 with any text."""
PREFIX = re.compile(rb"DATA\s*:\s*\Z", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class BridgedLine:
    """A line, or several that belong together.

    Attributes:
        text: What a client has said, or what it is told.
        closing: What is asked behind it, so that the end of the answer is known.
        aside: Whether the arm said it without being asked.
    """

    text: bytes
    closing: bytes = b""
    aside: bool = False

    @property
    def key(self) -> str:
        """The readings that it asks for, or shows; see `frame`."""
        return "aside" if self.aside else readings_shown(self.text) or key_of(asked(bytes(self)))

    @property
    def params(self) -> bytes:
        """All of it."""
        return self.text

    def __bytes__(self) -> bytes:
        return self.text + self.closing


class Requests:
    """Finds the lines of a client, each with what closes its answer; a token in front of them is left out.

    Attributes:
        junk_bytes: Bytes that are no text, and those of lines that never ended.
        bad_frames: Always 0.
    """

    def __init__(self) -> None:
        self.junk_bytes: int = 0
        self.bad_frames: int = 0
        self._buffer = b""
        self._first = b""  # the bytes of the first line, until it is known to be a token or none
        self._greeted = False

    def feed(self, data: bytes) -> list[BridgedLine]:
        """Take the next bytes, return the requests that they complete."""
        data = data if self._greeted else self._without_token(data)
        *lines, rest = (self._buffer + printable(data).replace(b"\n", b"")).split(END)
        self._buffer = rest if len(rest) <= LONGEST_LINE else b""
        self.junk_bytes += len(rest) - len(self._buffer)
        return list(together([line + END for line in lines if line.strip()]))

    def resync(self) -> list[BridgedLine]:
        """Half a line may yet become a whole one: somebody may be typing it."""
        return []

    def reset(self) -> None:
        """Forget half a line."""
        self._buffer = b""

    def _without_token(self, data: bytes) -> bytes:
        """The first bytes of a client without the line of its token."""
        first = self._first + data
        head = first[: len(TOKEN)]
        if head == TOKEN[: len(head)] and len(first) <= LONGEST_LINE + len(TOKEN):
            _, ended, rest = first.partition(b"\n")
            if not ended:
                self._first = first
                return b""

            first = rest if head == TOKEN else first

        self._first, self._greeted = b"", True
        return first


class Answers:
    """Finds the arm's answers, each closed by COORDS, and the plain text that answers nothing.

    Attributes:
        junk_bytes: Bytes that are no text, or belong to no answer.
        bad_frames: Always 0.
    """

    def __init__(self) -> None:
        self.junk_bytes: int = 0
        self.bad_frames: int = 0
        self._buffer = b""
        self._asked: deque[BridgedLine] = deque(maxlen=ASKED)

    def follow(self, outgoing: bool, frame: BridgedLine) -> None:
        """Take note of what goes out to the arm."""
        if outgoing:
            self._asked.append(frame)

    def feed(self, data: bytes) -> list[BridgedLine]:
        """Take the next bytes, return the answers that they complete and the lines that answer nothing."""
        text = printable(data)
        self.junk_bytes += len(data) - len(text)
        text = self._buffer + text
        found: list[BridgedLine] = []
        while closing := CLOSING.search(text):
            found += self._answers(text[: closing.end()].strip())
            text = text[closing.end() :].lstrip()

        if not self._asked:
            ended = max(text.rfind(b"\r"), text.rfind(b"\n")) + 1
            named, asides = sorted_out(text[:ended])
            text = named + text[ended:]
            found += asides

        self._buffer = text[-LONGEST:]
        self.junk_bytes += len(text) - len(self._buffer)
        return found

    def resync(self) -> list[BridgedLine]:
        """Half an answer hides nothing."""
        return []

    def reset(self) -> None:
        """Forget half an answer: another stream begins."""
        self.junk_bytes += len(self._buffer)
        self._buffer = b""
        self._asked.clear()

    def _answers(self, text: bytes) -> list[BridgedLine]:
        """A whole answer, and what stands in it that is none to a reading: it came unasked meanwhile."""
        while self._asked:
            asked = self._asked.popleft()
            if fits(asked, text):
                if named_alone(asked) and not errors(text):
                    text, asides = sorted_out(text)
                    return [*asides, BridgedLine(text)]

                break

        return [BridgedLine(text + b"\r\n")]


def words_of(request: BridgedLine) -> list[tuple[str, str]]:
    """The words of a request's first line, each as its letter and as a whole: [("G", "G0"), ("X", "X200")].

    The number of a command is written in one way, for an arm may take M31.0, M+31 and M031 for M31 as well.
    """
    with suppress(ValueError):
        return [(letter, letter + plain(number)) for letter, number in split_words(request.text.split(END)[0])]

    return []


def plain(number: str) -> str:
    """A whole number that is not negative, in digits alone; any other as it is."""
    with suppress(ValueError, OverflowError):
        value = float(number)
        if value == int(value) and value >= 0:
            return str(int(value))

    return number


def understood(request: BridgedLine) -> tuple[Command[Any, Any] | None, Any]:
    """The row of a request and its parameters; None for what is not wholly understood."""
    words = words_of(request)
    row = c.BY_WORD.get(words[0][1]) if words else None
    if row is None:
        return None, None

    try:
        return row, row.request.decode("".join(word for _, word in words[1:]).encode("ascii"))
    except ProtocolError:
        return None, None


def together(lines: list[bytes]) -> Iterator[BridgedLine]:
    """Make requests of lines: a reading and what closes its answer are one, anything else is one each."""
    bare = [line.upper().strip() for line in lines]
    at = 0
    while at < len(lines):
        end = at + 1
        while end < len(lines) and bare[end] in {SIZE, SWITCHES}:
            end += 1

        row, _ = understood(BridgedLine(lines[at]))
        closed = end < len(lines) and bare[end] == COORDS and bare[at] != COORDS
        if row and not row.write and closed:
            yield BridgedLine(b"".join(lines[at : end + 1]))
            at = end + 1
        else:
            yield BridgedLine(lines[at], closing(bare[at], row))
            at += 1


def closing(line: bytes, row: Command[Any, Any] | None) -> bytes:
    """What has to be asked behind a line, so that the end of its answer is known."""
    if row is None or row.write:
        return SIZE + END + COORDS + END

    if line == STATUS:
        return SIZE + END + SWITCHES + END + COORDS + END

    return b"" if line == COORDS else COORDS + END


def asked(lines: bytes) -> Iterator[bytes]:
    """Yield the commands of a request, as far as they are understood."""
    rows = (understood(BridgedLine(line))[0] for line in lines.split(END) if line)
    yield from (row.name.encode() for row in rows if row)


def named(request: BridgedLine) -> set[bytes]:
    """The readings that a request asks for, what closes its answer included."""
    return {word for word in asked(bytes(request)) if word in PATTERNS}


def fits(request: BridgedLine, answer: bytes) -> bool:
    """Whether an answer is one to a request: the readings in it are those that were asked, or errors in their place."""
    asked = named(request)
    found = {word for word, pattern in PATTERNS.items() if pattern.search(answer)}
    if not errors(answer):
        return found == asked

    row, _ = understood(request)
    must = {SIZE, SWITCHES, COORDS} if row is c.GET_STATUS else {COORDS} | named(BridgedLine(request.closing))
    return must <= found <= asked


def named_alone(request: BridgedLine) -> bool:
    """Whether a request is a reading, whose answer is known by its name."""
    row, _ = understood(request)
    return row is not None and not row.write and row is not c.GET_STATUS


def sorted_out(text: bytes) -> tuple[bytes, list[BridgedLine]]:
    """The lines of a text: those of readings, and the others, which answer none."""
    lines = [line for line in text.replace(b"\n", END).split(END) if line.strip()]
    asides = [BridgedLine(line.strip() + b"\r\n", aside=True) for line in lines if not NAMED.search(line)]
    return b"".join(line + b"\r\n" for line in lines if NAMED.search(line)), asides
