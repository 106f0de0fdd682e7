r"""The ultraArm as a bridge sees it: lines instead of frames, whose answers tell by their order alone whose they are.

    a client's line      G0 X200 F100 \r                              a write, sent once
    to the arm           G0 X200 F100 \r M120 \r M114 \r              what closes its answer is asked with it
    from the arm         ok \r\n QUEUE SIZE[3] \r\n COORDS[...] \r\n
    to the client        ok \r\n                                      the rest was the bridge's own question

A reading that comes with the lines that close its answer, as this package sends it, goes to the arm as it is. A line of
plain text that the arm says without being asked is a frame of another key, so that it can be passed on at once.
"""

from __future__ import annotations

import asyncio
import math
import re
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from dobot_async._core.link.link import Link
from dobot_async._core.protocol.contract import Parser
from dobot_async._core.protocol.transport import Transport
from dobot_async._core.protocol.wire import Command
from dobot_async.arms.bridge_adapter import RequestKind, Switch, TelemetryRead
from dobot_async.arms.ultraarm import commands as c
from dobot_async.arms.ultraarm.answers import STATUS as STATUS_LAYOUT
from dobot_async.arms.ultraarm.bridge_lines import (
    PATTERNS,
    PREFIX,
    Answers,
    BridgedLine,
    Requests,
    fits,
    understood,
    words_of,
)
from dobot_async.arms.ultraarm.frame import BARRIERS, END, encode
from dobot_async.arms.ultraarm.opening import opened
from dobot_async.errors import ProtocolError

__all__ = ["BRIDGED", "BridgedUltraArm", "UltraArmWatch"]

ANSWER = 1.5  # seconds that an answer to an unknown line may take
SILENCE = 5.0  # the same for a reading, which may have to wait until somebody else's line was given up
BEGINS = 0.1  # seconds within which a motion begins
CALIBRATION = (c.SET_GRIPPER_ZERO, c.SET_GRIPPER_CLOSE_POSITION, c.CALIBRATE_J1, c.SET_SERVO_REGISTER)
FIRST_WORD = re.compile(rb"\s*[A-Z][ \t]*\d", re.IGNORECASE)
PART_OF_A_WORD = re.compile(rb"\s*([A-Z][ \t]*)?", re.IGNORECASE)
STOPS = frozenset({c.JOG_STOP, c.RELEASE})
JOGS = frozenset({c.JOG_JOINT, c.JOG_COORD})


class UltraArmWatch:
    """What one program has made the arm do: it moves until it rests and nothing waits in its queue.

    Laser and PWM wait in the queue as motions do, and a stop may throw them away: see `Switch`.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self.question: BridgedLine = question(c.GET_STATUS)
        self._clock = clock
        self._told = False
        self._switches = {c.LASER_ON.name: Switch(), c.SET_PWM.name: Switch()}
        self._begins_by = -math.inf

    def sent(self, request: BridgedLine) -> None:
        """A request that is no read goes out."""
        row, value = understood(request)
        switch = SWITCHED.get(row) if row else None
        if row in STOPS:
            self._begins_by = -math.inf
            for each in self._switches.values():
                each.empty()
        elif row and switch and switch.on(value):
            self._switches[switch.name].switch_on(queued=True)
        elif row is None or row.moves or row in JOGS or row is c.WAIT:
            self._told = True
            self._begins_by = self._clock() + BEGINS

    def answered(self, request: BridgedLine, reply: BridgedLine) -> None:  # noqa: ARG002 - whatever it was
        """It was answered, which does not say that it is done; but an "off" is in the queue."""
        row, value = understood(request)
        switch = SWITCHED.get(row) if row else None
        if switch and not switch.on(value):
            self._switches[switch.name].switch_off(queued=True)

    def moving(self, reply: BridgedLine | None) -> bool:
        """Return whether the arm is, or may be, in the middle of what it was told; `reply` is that to the question."""
        if any(switch.is_on(finished=True) for switch in self._switches.values()):
            return True

        if not self._told and not any(switch.is_on(finished=False) for switch in self._switches.values()):
            return False

        if reply is None or self._clock() < self._begins_by:
            return True

        status = STATUS_LAYOUT.decode(reply.params)
        return status.queue_size > 0 or not status.at_rest

    def off(self) -> Sequence[BridgedLine]:
        """Return nothing but what `stopping` has."""
        return ()


@dataclass(frozen=True, slots=True)
class Switched:
    """What a row switches.

    Attributes:
        name: The row that switches it on.
        on: Whether it does, with its parameters.
    """

    name: str
    on: Callable[[Any], bool]


SWITCHED: Mapping[Command[Any, Any], Switched] = {
    c.LASER_ON: Switched(c.LASER_ON.name, lambda _: True),
    c.LASER_OFF: Switched(c.LASER_ON.name, lambda _: False),
    c.SET_PWM: Switched(c.SET_PWM.name, lambda value: bool(value != c.PWM(0))),
}


class BridgedUltraArm:
    """See `dobot_async.arms.bridge_adapter.BridgeAdapter`."""

    model = "ultraarm"
    filler = b""  # it would let the arm do half a line; without it, that and the next one are an error
    barriers: tuple[BridgedLine, ...] = tuple(BridgedLine(bytes(frame)) for frame in BARRIERS)
    proves_stop = False
    in_order = True

    def __init__(self) -> None:
        self.greeting: BridgedLine = question(c.GET_QUEUE_SIZE)
        self.stopping: tuple[BridgedLine, BridgedLine, BridgedLine] = (
            question(c.JOG_STOP),
            question(c.LASER_OFF),
            question(c.SET_PWM, c.PWM(0)),
        )
        self.escalated_stop: tuple[BridgedLine, BridgedLine, BridgedLine, BridgedLine] = (
            question(c.RELEASE),
            *self.stopping,
        )
        self.deny_groups: dict[str, frozenset[str]] = {"calibration": frozenset(row.name for row in CALIBRATION)}
        self.readings: dict[str, TelemetryRead[BridgedLine]] = {
            "pose": TelemetryRead(question(c.GET_COORDS), 0.2, lambda reply: told(c.GET_COORDS, reply)),
            "joints": TelemetryRead(question(c.GET_ANGLES), 0.2, lambda reply: told(c.GET_ANGLES, reply)),
            "motion": TelemetryRead(question(c.GET_STATUS), 0.2, lambda reply: told(c.GET_STATUS, reply)),
        }

    async def open(self, url: str, timeout: float) -> Transport:
        """Open the way to the arm; raise ValueError for one that does not keep the order."""
        return await opened(url, timeout)

    def encode(self, command: Command[Any, Any], params: bytes, *, queued: bool) -> BridgedLine:
        """Make the request of a row."""
        frame = encode(command, params, queued=queued)
        return BridgedLine(bytes(frame))

    def parser(self) -> Answers:
        """Return a parser for the arm's stream."""
        return Answers()

    def requests(self) -> Parser[BridgedLine]:
        """Return a parser for a client's stream."""
        return Requests()

    def begins(self, data: bytes) -> bool | None:
        """Return whether bytes begin with a letter and a number, as all lines do; None while they may yet do so."""
        if FIRST_WORD.match(data):
            return True

        return None if PART_OF_A_WORD.fullmatch(data) else False

    def attach(self, link: Link[BridgedLine], parser: Parser[BridgedLine]) -> None:
        """Let the parser know what is asked."""
        if isinstance(parser, Answers):
            link.on_frame.add(parser.follow)

    def watch(self) -> UltraArmWatch:
        """Return what follows one program."""
        return UltraArmWatch(asyncio.get_running_loop().time)

    def kind(self, request: BridgedLine) -> RequestKind:
        """Return what a request is; a line that is not wholly understood is a write."""
        row, _ = understood(request)
        if row in STOPS:
            return RequestKind.STOP

        return RequestKind.WRITE if row is None or row.write else RequestKind.READ

    def subject(self, request: BridgedLine) -> Hashable:
        """Return the line's command."""
        return self.name(request)

    def name(self, request: BridgedLine) -> str:
        """Return the line's command, the first if there are several."""
        words = words_of(request)
        return next((name for letter, name in words if letter in "GM"), words[0][1] if words else "?")

    def patience(self, request: BridgedLine) -> float:
        """Return the seconds that an answer may take."""
        row, _ = understood(request)
        if row is None:
            return ANSWER

        return row.timeout if row.write else SILENCE

    def repeatable(self, request: BridgedLine) -> bool:
        """Return whether it may be sent again: what reads, and what stops."""
        return self.kind(request) is not RequestKind.WRITE

    def ack_optional(self, request: BridgedLine) -> bool:  # noqa: ARG002 - what closes each answer is asked with it
        """Return False."""
        return False

    def accept(self, request: BridgedLine, reply: BridgedLine) -> BridgedLine:
        """Return what the client is told; raise ProtocolError if it is not the answer to this request."""
        if not fits(request, reply.text):
            raise ProtocolError(f"{reply.text!r} is no answer to {self.name(request)}")

        text = reply.text
        for word in reversed(request.closing.split(END)):
            if word:
                *_, last = PATTERNS[word].finditer(text)
                text = PREFIX.sub(b"", text[: last.start()]) + text[last.end() :].lstrip()

        text = text.strip()
        return BridgedLine(text + b"\r\n" if text else b"")

    def is_unsolicited(self, frame: BridgedLine) -> bool:
        """Return whether the arm has said something that answers nothing."""
        return frame.aside

    def refusal(self, reason: str) -> bytes:
        """Return what a client is told whose request is not passed on."""
        return f"ERROR: {' '.join(reason.split())}\r\n".encode("ascii", "replace")

    def check(self, request: BridgedLine) -> None:
        """Raise ProtocolError for what is no line, or not just one command with a whole number.

        Whoever reads a line in another way than the arm does cannot say what is denied.
        """
        commands = [word[1:] for letter, word in words_of(request) if letter in "GM"]
        if len(commands) != 1 or not commands[0].isdigit():
            raise ProtocolError("COMMAND NOT RECOGNIZED: expected one command, letters with numbers")


def question(command: Command[Any, Any], value: Any = None) -> BridgedLine:
    """A request of the bridge's own; its answer is not cut."""
    return BridgedLine(bytes(encode(command, command.request.encode(value), queued=False)))


def told(command: Command[None, Any], reply: BridgedLine) -> dict[str, Any]:
    """What a reading says."""
    return asdict(command.reply.decode(reply.params))


BRIDGED = BridgedUltraArm()
"""What a bridge knows of it."""
