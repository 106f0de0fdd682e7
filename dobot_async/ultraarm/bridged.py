r"""The ultraArm as a bridge sees it: lines instead of frames, whose answers tell by their order alone whose they are.

    a client's line      G0 X200 F100 \r                              a write, sent once
    to the arm           G0 X200 F100 \r M120 \r M114 \r              what closes its answer is asked with it
    from the arm         ok \r\n QUEUE SIZE[3] \r\n COORDS[...] \r\n
    to the client        ok \r\n                                      the rest was the bridge's own question

A reading that comes with the lines that close its answer, as this package sends it, goes to the arm as it is. A line of
plain text that the arm says without being asked is a frame of another key, so that it can be passed on at once.
"""

from __future__ import annotations

import math
import re
import time
from collections import deque
from collections.abc import Callable, Hashable, Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from types import MappingProxyType
from typing import Any

from dobot_async.bridged import Kind, Reading
from dobot_async.contract import Parser
from dobot_async.errors import ProtocolError
from dobot_async.link import Link
from dobot_async.transports import Transport
from dobot_async.ultraarm import commands as c
from dobot_async.ultraarm.arm import opened
from dobot_async.ultraarm.frame import (
    CLOSING,
    COORDS,
    END,
    LONGEST,
    SIZE,
    STATUS,
    SWITCHES,
    bracket,
    encode,
    errors,
    printable,
    split_words,
)
from dobot_async.ultraarm.layouts import STATUS as STATUS_LAYOUT
from dobot_async.ultraarm.layouts import Bracket
from dobot_async.wire import Command

__all__ = ["BRIDGED", "BridgedUltraArm", "Line", "UltraArmWatch"]

LONGEST_LINE = 256
ASKED = 16  # requests that the arm has not answered
ANSWER = 1.5  # seconds that an answer to an unknown line may take
SILENCE = 5.0  # the same for a reading, which may have to wait until somebody else's line was given up
BEGINS = 0.1  # seconds within which a motion begins
ASIDE = "aside"
NAMED = re.compile(rb"[A-Z0-9]\s*\[", re.IGNORECASE)
PATTERNS: Mapping[bytes, re.Pattern[bytes]] = MappingProxyType(
    {row.name.encode(): row.reply.pattern for row in c.ALL if isinstance(row.reply, Bracket)}
    | {SIZE: bracket("QUEUE SIZE")}
)
"""What a reading is answered with; M9 with any text."""
PREFIX = re.compile(rb"DATA\s*:\s*\Z", re.IGNORECASE)
CALIBRATION = (c.SET_GRIPPER_ZERO, c.SET_GRIPPER_CLOSE_POSITION, c.CALIBRATE_J1, c.SET_SERVO_REGISTER)
STOPS = frozenset({c.JOG_STOP, c.RELEASE})
JOGS = frozenset({c.JOG_JOINT, c.JOG_COORD})


@dataclass(frozen=True, slots=True)
class Line:
    """A line, or several that belong together.

    Attributes:
        text: What a client has said, or what it is told.
        closing: What is asked behind it, so that the end of the answer is known.
        key: The same for all answers, for their order tells whose they are.
    """

    text: bytes
    closing: bytes = b""
    key: str = "answer"

    @property
    def params(self) -> bytes:
        """All of it."""
        return self.text

    def __bytes__(self) -> bytes:
        return self.text + self.closing


class Requests:
    """Finds the lines of a client, each with what closes its answer.

    Attributes:
        junk_bytes: Bytes that are no text, and those of lines that never ended.
        bad_frames: Always 0.
    """

    def __init__(self) -> None:
        self.junk_bytes = self.bad_frames = 0
        self._buffer = b""

    def feed(self, data: bytes) -> list[Line]:
        """Takes the next bytes, returns the requests that they complete."""
        *lines, rest = (self._buffer + printable(data).replace(b"\n", b"")).split(END)
        self._buffer = rest if len(rest) <= LONGEST_LINE else b""
        self.junk_bytes += len(rest) - len(self._buffer)
        return list(together([line + END for line in lines if line.strip()]))

    def resync(self) -> list[Line]:
        """Half a line may yet become a whole one: somebody may be typing it."""
        return []

    def reset(self) -> None:
        """Forgets half a line."""
        self._buffer = b""


class Answers:
    """Finds the arm's answers, each closed by COORDS, and the plain text that answers nothing.

    Attributes:
        junk_bytes: Bytes that are no text, or belong to no answer.
        bad_frames: Always 0.
    """

    def __init__(self) -> None:
        self.junk_bytes = self.bad_frames = 0
        self._buffer = b""
        self._asked: deque[Line] = deque(maxlen=ASKED)

    def follow(self, outgoing: bool, frame: Line) -> None:
        """Takes note of what goes out to the arm."""
        if outgoing:
            self._asked.append(frame)

    def feed(self, data: bytes) -> list[Line]:
        """Takes the next bytes, returns the answers that they complete and the lines that answer nothing."""
        text = printable(data)
        self.junk_bytes += len(data) - len(text)
        text = self._buffer + text
        found: list[Line] = []
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

    def resync(self) -> list[Line]:
        """Half an answer hides nothing."""
        return []

    def reset(self) -> None:
        """Forgets half an answer: another stream begins."""
        self.junk_bytes += len(self._buffer)
        self._buffer = b""
        self._asked.clear()

    def _answers(self, text: bytes) -> list[Line]:
        """A whole answer, and what stands in it that is none to a reading: it came unasked meanwhile."""
        while self._asked:
            asked = self._asked.popleft()
            if fits(asked, text):
                if named_alone(asked) and not errors(text):
                    text, asides = sorted_out(text)
                    return [*asides, Line(text)]

                break

        return [Line(text + b"\r\n")]


class UltraArmWatch:
    """What one program has made the arm do: it moves until it rests and nothing waits in its queue."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self.question = question(c.GET_STATUS)
        self._clock = clock
        self._told = self._laser = self._pwm = False
        self._begins_by = -math.inf

    def sent(self, request: Line) -> None:
        """A request that is no read goes out."""
        row, value = understood(request)
        if row in STOPS:
            self._begins_by = -math.inf
        elif row in {c.LASER_ON, c.LASER_OFF}:
            self._laser = row is c.LASER_ON
        elif row is c.SET_PWM:
            self._pwm = value != c.PWM(0)
        elif row is None or row.moves or row in JOGS or row is c.WAIT:
            self._told = True
            self._begins_by = self._clock() + BEGINS

    def answered(self, request: Line, reply: Line) -> None:
        """It was answered, which does not say that it is done."""

    def moving(self, reply: Line | None) -> bool:
        """Returns whether the arm is, or may be, in the middle of what it was told; `reply` is that to the question."""
        if self._laser or self._pwm or not self._told:
            return self._laser or self._pwm

        if reply is None or self._clock() < self._begins_by:
            return True

        status = STATUS_LAYOUT.decode(reply.params)
        return status.queue_size > 0 or not status.at_rest


class BridgedUltraArm:
    """See `dobot_async.bridged.Bridged`."""

    model = "ultraarm"
    filler = END
    proves_stop = False
    in_order = True

    def __init__(self) -> None:
        self.greeting = question(c.GET_QUEUE_SIZE)
        self.stopping = (question(c.JOG_STOP), question(c.LASER_OFF), question(c.SET_PWM, c.PWM(0)))
        self.insisting = (question(c.RELEASE), *self.stopping)
        self.denials = {"calibration": frozenset(row.name for row in CALIBRATION)}
        self.readings = {
            "pose": Reading(question(c.GET_COORDS), 0.2, lambda reply: told(c.GET_COORDS, reply)),
            "joints": Reading(question(c.GET_ANGLES), 0.2, lambda reply: told(c.GET_ANGLES, reply)),
            "motion": Reading(question(c.GET_STATUS), 0.2, lambda reply: told(c.GET_STATUS, reply)),
        }

    async def open(self, url: str, timeout: float) -> Transport:
        """Opens the way to the arm; raises ValueError for one that does not keep the order."""
        return await opened(url, timeout)

    def encode(self, command: Command[Any, Any], params: bytes, *, queued: bool) -> Line:
        """Makes the request of a row."""
        frame = encode(command, params, queued=queued)
        return Line(bytes(frame))

    def parser(self) -> Answers:
        """Returns a parser for the arm's stream."""
        return Answers()

    def requests(self) -> Parser[Line]:
        """Returns a parser for a client's stream."""
        return Requests()

    def attach(self, link: Link[Line], parser: Parser[Line]) -> None:
        """Lets the parser know what is asked."""
        if isinstance(parser, Answers):
            link.trace = parser.follow

    def watch(self) -> UltraArmWatch:
        """Returns what follows one program."""
        return UltraArmWatch()

    def kind(self, request: Line) -> Kind:
        """Returns what a request is; a line that is not wholly understood is a write."""
        row, _ = understood(request)
        if row in STOPS:
            return Kind.STOP

        return Kind.WRITE if row is None or row.write else Kind.READ

    def subject(self, request: Line) -> Hashable:
        """Returns the line's command."""
        return self.name(request)

    def name(self, request: Line) -> str:
        """Returns the line's command, the first if there are several."""
        words = words_of(request)
        return next((name for letter, name in words if letter in "GM"), words[0][1] if words else "?")

    def patience(self, request: Line) -> float:
        """Returns the seconds that an answer may take."""
        row, _ = understood(request)
        if row is None:
            return ANSWER

        return row.timeout if row.write else SILENCE

    def repeatable(self, request: Line) -> bool:
        """Returns whether it may be sent again: what reads, and what stops."""
        return self.kind(request) is not Kind.WRITE

    def may_be_silent(self, request: Line) -> bool:  # noqa: ARG002 - what closes each answer is asked with it
        """Returns False."""
        return False

    def accept(self, request: Line, reply: Line) -> Line:
        """Returns what the client is told; raises ProtocolError if it is not the answer to this request."""
        if not fits(request, reply.text):
            raise ProtocolError(f"{reply.text!r} is no answer to {self.name(request)}")

        text = reply.text
        for word in reversed(request.closing.split(END)):
            if word:
                *_, last = PATTERNS[word].finditer(text)
                text = PREFIX.sub(b"", text[: last.start()]) + text[last.end() :].lstrip()

        text = text.strip()
        return Line(text + b"\r\n" if text else b"")

    def aside(self, frame: Line) -> bool:
        """Returns whether the arm has said something that answers nothing."""
        return frame.key == ASIDE

    def refusal(self, reason: str) -> bytes:
        """Returns what a client is told whose request is not passed on."""
        return f"ERROR: {' '.join(reason.split())}\r\n".encode("ascii", "replace")

    def check(self, request: Line) -> None:
        """Raises ProtocolError for what is no line, or holds several commands."""
        words = words_of(request)
        row, _ = understood(request)
        if not words or (row is None and sum(letter in "GM" for letter, _ in words) > 1):
            raise ProtocolError("COMMAND NOT RECOGNIZED: expected one command, letters with numbers")


def question(command: Command[Any, Any], value: Any = None) -> Line:
    """A request of the bridge's own; its answer is not cut."""
    return Line(bytes(encode(command, command.request.encode(value), queued=False)))


def told(command: Command[None, Any], reply: Line) -> dict[str, Any]:
    """What a reading says."""
    return asdict(command.reply.decode(reply.params))


def words_of(request: Line) -> list[tuple[str, str]]:
    """The words of a request's first line, each as its letter and as a whole: [("G", "G0"), ("X", "X200")]."""
    with suppress(ValueError):
        words = split_words(request.text.split(END)[0])
        return [(letter, letter + (str(int(number)) if number.isdigit() else number)) for letter, number in words]

    return []


def understood(request: Line) -> tuple[Command[Any, Any] | None, Any]:
    """The row of a request and its parameters; None for what is not wholly understood."""
    words = words_of(request)
    row = c.BY_WORD.get(words[0][1]) if words else None
    if row is None:
        return None, None

    try:
        return row, row.request.decode("".join(word for _, word in words[1:]).encode("ascii"))
    except ProtocolError:
        return None, None


def together(lines: list[bytes]) -> Iterator[Line]:
    """Makes requests of lines: a reading and what closes its answer are one, anything else is one each."""
    bare = [line.upper().strip() for line in lines]
    at = 0
    while at < len(lines):
        end = at + 1
        while end < len(lines) and bare[end] in {SIZE, SWITCHES}:
            end += 1

        row, _ = understood(Line(lines[at]))
        closed = end < len(lines) and bare[end] == COORDS and bare[at] != COORDS
        if row and not row.write and closed:
            yield Line(b"".join(lines[at : end + 1]))
            at = end + 1
        else:
            yield Line(lines[at], closing(bare[at], row))
            at += 1


def closing(line: bytes, row: Command[Any, Any] | None) -> bytes:
    """What has to be asked behind a line, so that the end of its answer is known."""
    if row is None or row.write:
        return SIZE + END + COORDS + END

    if line == STATUS:
        return SIZE + END + SWITCHES + END + COORDS + END

    return b"" if line == COORDS else COORDS + END


def named(request: Line) -> set[bytes]:
    """The readings that a request asks for, what closes its answer included."""
    words = (understood(Line(line))[0] for line in bytes(request).split(END) if line)
    return {row.name.encode() for row in words if row} & PATTERNS.keys()


def fits(request: Line, answer: bytes) -> bool:
    """Whether an answer is one to a request: the readings in it are those that were asked, or errors in their place."""
    asked = named(request)
    found = {word for word, pattern in PATTERNS.items() if pattern.search(answer)}
    if not errors(answer):
        return found == asked

    row, _ = understood(request)
    must = {SIZE, SWITCHES, COORDS} if row is c.GET_STATUS else {COORDS} | named(Line(request.closing))
    return must <= found <= asked


def named_alone(request: Line) -> bool:
    """Whether a request is a reading, whose answer is known by its name."""
    row, _ = understood(request)
    return row is not None and not row.write and row is not c.GET_STATUS


def sorted_out(text: bytes) -> tuple[bytes, list[Line]]:
    """The lines of a text: those of readings, and the others, which answer none."""
    lines = [line for line in text.replace(b"\n", END).split(END) if line.strip()]
    asides = [Line(line.strip() + b"\r\n", key=ASIDE) for line in lines if not NAMED.search(line)]
    return b"".join(line + b"\r\n" for line in lines if NAMED.search(line)), asides


BRIDGED = BridgedUltraArm()
"""What a bridge knows of it."""
