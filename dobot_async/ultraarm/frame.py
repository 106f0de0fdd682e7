r"""The ultraArm's lines. Bytes in, answers out; no I/O.

    request    G0 X200 Y0 Z0 F100 \r  M120 \r  M114 \r
    answer     ok \r\n  QUEUE SIZE[3] \r\n  DATA : COORDS[200.00,0.00,0.00,0.00] \r\n

A command may be answered with no line, one or several, and nothing in them says whose they are. Therefore each request
ends with M114: the arm reads its line in order, so that COORDS, which nothing else is answered with, closes the answer,
and whatever text came before it belongs to this request. What is no reading has M120 before that, as the vendor's own
library has it. M9, whose answer may be any text, has M120 and M119, so that its answer is like no other.
Manual 3 and 4.
"""

from __future__ import annotations

import re
from typing import Any, NamedTuple

from dobot_async.wire import Command, Queueing

__all__ = [
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
    "printable",
    "split_words",
]

END = b"\r"
SIZE, SWITCHES, COORDS = b"M120", b"M119", b"M114"
STATUS = b"M9"
LONGEST = 2048
"""Bytes of an answer that is not closed yet; what is older is given up."""
PRINTABLE = bytes(range(0x20, 0x7F)) + b"\r\n\t"
NOISE = bytes(set(range(256)) - set(PRINTABLE))
CLOSING = re.compile(rb"COORDS\s*\[[^\[\]]*\]", re.IGNORECASE)
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
        """What answers are matched by: nothing but their order and their text, so that it is the same for all."""
        return "answer"

    @property
    def line(self) -> bytes:
        """The command without what closes its answer."""
        return self.word + self.params + END

    def __bytes__(self) -> bytes:
        if not self.word:
            return self.params + b"\r\n"

        return self.line + self.behind + (COORDS + END) * (self.word != COORDS)


def encode(command: Command[Any, Any], params: bytes, *, queued: bool) -> Frame:
    """Returns the request that asks the arm to do, or tell, what a row of the table says."""
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
        self.junk_bytes = 0
        self.bad_frames = 0
        self._buffer = b""

    def feed(self, data: bytes) -> list[Frame]:
        """Takes the next bytes of the stream, returns the answers that they close."""
        text = printable(data)
        self.junk_bytes += len(data) - len(text)
        buffer = self._buffer + text
        frames = []
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
        """An answer that is not closed hides nothing; there is nothing to give up."""
        return []

    def reset(self) -> None:
        """Forgets the answer that is not closed yet: another stream begins."""
        self.junk_bytes += len(self._buffer)
        self._buffer = b""


def printable(data: bytes) -> bytes:
    """What of the data is text."""
    return bytes(data.translate(None, NOISE))


def bracket(keyword: str) -> re.Pattern[bytes]:
    """What finds the brackets behind a keyword, whatever the blanks."""
    words = rb"\s*".join(re.escape(word.encode()) for word in keyword.split())
    return re.compile(words + rb"\s*\[([^\[\]]*)\]", re.IGNORECASE)


def errors(text: bytes) -> tuple[str, ...]:
    """The errors that an answer tells of."""
    return tuple(found.decode("ascii", "replace").strip() for found in ERROR.findall(text))


def split_words(line: bytes) -> list[tuple[str, str]]:
    """A line as an arm reads it, each letter with the number behind it: blanks and case count for nothing.

    Raises:
        ValueError: There is something else in it.
    """
    bare = bytes(line.translate(None, b" \t\n\r")).upper()
    found = WORD.findall(bare)
    if sum(len(letter) + len(number) for letter, number in found) != len(bare):
        raise ValueError(f"{line!r} is not made of letters with numbers")

    return [(letter.decode(), number.decode()) for letter, number in found]
