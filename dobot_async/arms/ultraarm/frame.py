r"""The ultraArm's lines. Bytes in, answers out; no I/O.

    request    G0 X200 Y0 Z0 F100 \r  M120 \r  M114 \r                            key: M120 M114
    answer     ok \r\n  QUEUE SIZE[3] \r\n  DATA : COORDS[200.00,0.00,0.00,0.00] \r\n

A command may be answered with no line, one or several, and nothing in them says whose they are. But the arm reads its
lines in order, and answers readings by name. Hence:

1. Each request ends with M114. COORDS, which nothing else is answered with, closes the answer, and whatever text came
   before it belongs to this request. What is no reading has M120 before that, as the vendor's own library has it. M9,
   whose answer may be any text, has M120 and M119.
2. The key of a request is the series of readings that it asks for, that of an answer the series that it shows. Other
   text, errors included, takes no part in it. The key of an answer that lost a reading on the way, or that ran together
   with the next one, is no longer that of its request: nobody gets it, and a barrier proves it lost.
3. Barriers ask for readings in an order that no command has.

Manual 3 and 4.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import lru_cache
from itertools import groupby, product
from typing import Any, NamedTuple

from dobot_async._core.protocol.wire import Command, Queueing

__all__ = [
    "ANGLES",
    "BARRIERS",
    "CLOSING",
    "COORDS",
    "END",
    "LONGEST",
    "SIZE",
    "STATUS",
    "SWITCHES",
    "Frame",
    "Parser",
    "bracket",
    "encode",
    "errors",
    "key_of",
    "printable",
    "readings_asked",
    "readings_shown",
    "split_words",
]

END = b"\r"
SIZE, SWITCHES, ANGLES, COORDS = b"M120", b"M119", b"M12", b"M114"
STATUS = b"M9"
READINGS = {b"QUEUESIZE": SIZE, b"ENDSTOP": SWITCHES, b"ANGLES": ANGLES, b"COORDS": COORDS}
"""What the readings are called that make up a key, blanks left out; later firmware has more, and older may not."""
LONGEST = 2048
"""Bytes of an answer that is not closed yet; what is older is given up."""
PRINTABLE = bytes(range(0x20, 0x7F)) + b"\r\n\t"
NOISE = bytes(set(range(256)) - set(PRINTABLE))
CLOSING = re.compile(rb"COORDS\s*\[[^\[\]]*\]", re.IGNORECASE)
READING = re.compile(rb"(QUEUE\s*SIZE|ENDSTOP|ANGLES|COORDS)\s*\[[^\[\]]*\]", re.IGNORECASE)
ERROR = re.compile(rb"ERROR\s*:\s*([^\r\n]*)", re.IGNORECASE)
WORD = re.compile(rb"([A-Z])([-+]?\d*\.?\d*)")


class Frame(NamedTuple):
    """A request, or the whole answer to one.

    Attributes:
        word: What names the command, such as b"G0"; empty in an answer.
        params: What stands behind it; in an answer, all of its text.
        behind: What else is asked with it.
    """

    word: bytes
    params: bytes
    behind: bytes = b""

    @property
    def key(self) -> str:
        """The readings that a request asks for, or an answer shows, in order: "M120 M114"."""
        return readings_asked(bytes(self)) if self.word else readings_shown(self.params)

    @property
    def line(self) -> bytes:
        """The command without what closes its answer."""
        return self.word + self.params + END

    def __bytes__(self) -> bytes:
        if not self.word:
            return self.params + b"\r\n"

        return self.line + self.behind + (COORDS + END) * (self.word != COORDS)


@lru_cache(maxsize=64)
def readings_asked(lines: bytes) -> str:
    """Return the key of a request: the readings among its lines."""
    return key_of(line.strip().upper() for line in lines.split(END))


@lru_cache(maxsize=64)
def readings_shown(text: bytes) -> str:
    """Return the key of an answer: the readings in its text."""
    return key_of(READINGS[b"".join(name.upper().split())] for name in READING.findall(text))


def key_of(words: Iterable[bytes]) -> str:
    """Return the key of commands. Some firmware acknowledges with QUEUE SIZE: several in a row count as one."""
    groups = groupby(word for word in words if word in READINGS.values())
    return b" ".join(word for word, group in groups for word in ([SIZE] if word == SIZE else group)).decode("ascii")


BARRIERS = tuple(
    Frame(first, b"", END.join(rest) + END)
    for length in (2, 3)
    for first, *rest in product((SWITCHES, ANGLES), repeat=length)
)
"""Cheap reads used as barriers: each series of two or three times ENDSTOP or ANGLES. None asks for QUEUE SIZE: with a
reading lost, it would pass for a receipt."""


def encode(command: Command[Any, Any], params: bytes, *, queued: bool) -> Frame:
    """Return the request that asks the arm to do, or tell, what a row of the table says."""
    if queued and command.queueing is Queueing.NEVER:
        raise ValueError(f"{command.name} cannot be queued")

    word = command.name.encode("ascii")
    behind = SIZE + END + SWITCHES + END if word == STATUS else (SIZE + END) * command.write
    return Frame(word, params, behind)


class Parser:
    """Finds answers in a stream that may be cut anywhere and may hold anything.

    Bytes that are no text are dropped wherever they stand.

    Attributes:
        junk_bytes: Bytes so far that are no text, or belong to no answer.
        bad_frames: Always 0: a line has no checksum.
    """

    def __init__(self) -> None:
        self.junk_bytes: int = 0
        self.bad_frames = 0
        self._buffer: bytes = b""

    def feed(self, data: bytes) -> list[Frame]:
        """Take the next bytes of the stream, return the answers that they close."""
        text = printable(data)
        self.junk_bytes += len(data) - len(text)
        buffer: bytes = self._buffer + text
        frames: list[Frame] = []
        at = 0
        for found in CLOSING.finditer(buffer):
            frames.append(Frame(b"", buffer[at : found.end()].strip()))
            at = found.end()

        self._buffer = buffer[at:].lstrip()
        surplus = max(0, len(self._buffer) - LONGEST)
        self.junk_bytes += surplus
        self._buffer = self._buffer[surplus:]
        return frames

    def resync(self) -> list[Frame]:
        """Return nothing: whatever was closed was returned, and half an answer may only be late."""
        return []

    def reset(self) -> None:
        """Forget the answer that is not closed yet: another stream begins."""
        self.junk_bytes += len(self._buffer)
        self._buffer = b""


def printable(data: bytes) -> bytes:
    """Return what of the data is text."""
    return bytes(data.translate(None, NOISE))


def bracket(keyword: str) -> re.Pattern[bytes]:
    """Return what finds the brackets behind a keyword, whatever the blanks."""
    words = rb"\s*".join(re.escape(word.encode()) for word in keyword.split())
    return re.compile(words + rb"\s*\[([^\[\]]*)\]", re.IGNORECASE)


def errors(text: bytes) -> tuple[str, ...]:
    """Return the errors that an answer tells of."""
    return tuple(found.decode("ascii", "replace").strip() for found in ERROR.findall(text))


def split_words(line: bytes) -> list[tuple[str, str]]:
    """Return a line as an arm reads it, each letter with the number behind it: blanks and case count for nothing.

    Raises:
        ValueError: There is something else in it.
    """
    bare = bytes(line.translate(None, b" \t\n\r")).upper()
    found = WORD.findall(bare)
    if sum(len(letter) + len(number) for letter, number in found) != len(bare):
        raise ValueError(f"{line!r} is not made of letters with numbers")

    return [(letter.decode(), number.decode()) for letter, number in found]
