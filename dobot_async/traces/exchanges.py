"""The requests of a recorded connection with their replies.

Replies are matched to requests by the link's own rules (`Correlator`); an unsolicited frame belongs to the request
before it. A request whose reply was lost has none.
"""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass, field

from dobot_async._core.link.correlator import Correlator
from dobot_async.traces.reader import Trace, TraceLine
from dobot_async.traces.words import masked

__all__ = ["JUNK", "Exchanges", "RecordedReply", "RecordedRequest"]

JUNK = b"\0"  # begins a frame of no family


@dataclass(slots=True)
class RecordedReply:
    """Something that came from the arm.

    Attributes:
        number: Its place among all that came.
        after: Seconds since what it belongs to was asked.
        data: The bytes; None where the connection broke.
        ordered: Whether it is a reply that came in its turn: what was asked later was answered later.
        outage: Seconds for which it could not be opened again then; infinite if it never was.
    """

    number: int
    after: float
    data: bytes | None
    ordered: bool = False
    outage: float = math.inf


@dataclass(slots=True)
class RecordedRequest:
    """A request that was recorded.

    Attributes:
        number: Of its line.
        place: Its place among all requests.
        t: When it was sent, in the trace's seconds.
        name: The command's.
        write: Whether it changes anything.
        once: Whether to send it twice is to do it twice.
        raw: Its bytes, cut where something secret was left out.
        pieces: What came from the arm.
        latency: Seconds until its reply came; None where none did.
    """

    number: int
    place: int
    t: float
    name: str = ""
    write: bool = False
    once: bool = False
    raw: tuple[bytes | None, ...] = ()
    pieces: list[RecordedReply] = field(default_factory=list[RecordedReply])
    latency: float | None = None

    @property
    def secret(self) -> bool:
        """Whether something was left out of it."""
        return None in self.raw

    def fits(self, data: bytes) -> bool:
        """Whether it can have been these bytes."""
        at = 0
        for part in filter(None, self.raw):
            at = data.find(part, at)
            if at < 0:
                return False

            at += len(part)

        return True


@dataclass(frozen=True, slots=True)
class Said:
    """A recorded frame of the arm, as the correlator takes it."""

    key: Hashable
    params: bytes = b""

    def __bytes__(self) -> bytes:
        return self.params


class Exchanges:
    """All that was asked on one connection, with what came.

    Args:
        trace: Of one connection.

    Attributes:
        opening: What came before anything was asked.
        asked: What was asked, in order.
        came: When frames of the arm came, in the trace's seconds.
        end: The time of the last line.
    """

    def __init__(self, trace: Trace) -> None:
        first = trace.lines[0]
        self.opening: RecordedRequest = RecordedRequest(-1, -1, first.t)
        self.asked: list[RecordedRequest] = []
        self.came: list[float] = []
        self.end: float = trace.lines[-1].t
        self._now = first.t
        self._last = self.opening
        self._answered: list[RecordedRequest] = []
        window = first.number("reorder_window")
        self._correlator: Correlator[Said] = Correlator(lambda: self._now, lambda: window, lambda _: None)
        for number, line in enumerate(trace.lines):
            self._now = line.t
            if line.kind == "frame" and line.outgoing:
                self._ask(number, line)
            elif line.kind == "frame":
                self._say(number, line)
            elif line.kind == "junk":
                add(self._last, number, line)
            elif line.kind == "state" and line.text("state") in {"lost", "reopening"}:
                outage = reopened_at(trace, number) - line.t
                self._last.pieces.append(RecordedReply(number, line.t - self._last.t, None, outage=outage))

        self._find_ordered()

    def _ask(self, number: int, line: TraceLine) -> None:
        raw, name = tuple(masked(line.text("raw"))), line.text("command") or "?"
        write, once = bool(line.fields.get("write")), bool(line.fields.get("once"))
        self._last = asked = RecordedRequest(number, len(self.asked), line.t, name, write, once, raw)
        self.asked.append(asked)
        self._correlator.sent(line.text("key"), lambda _: self._answered.append(asked))

    def _say(self, number: int, line: TraceLine) -> None:
        self.came.append(line.t)
        self._answered.clear()
        if self._correlator.resolve(Said(line.text("key"))):
            asked = self._answered[0]
            asked.latency = line.t - asked.t
            add(asked, number, line, ordered=True)
        else:
            add(self._last, number, line)

    def _find_ordered(self) -> None:
        """Tell the replies that came behind one to a later request."""
        first = math.inf
        for asked in reversed(self.asked):
            for piece in asked.pieces:
                piece.ordered = piece.ordered and piece.number < first
                first = min(first, piece.number if piece.ordered else math.inf)


def reopened_at(trace: Trace, number: int) -> float:
    """Return when the connection was open again, behind a line; infinite if it never was."""
    later = (line.t for line in trace.lines[number:] if line.kind == "state" and line.text("state") == "open")
    return next(later, math.inf)


def add(asked: RecordedRequest, number: int, line: TraceLine, *, ordered: bool = False) -> None:
    """Add what came to what was asked."""
    asked.pieces.append(RecordedReply(number, max(line.t - asked.t, 0.0), said(line), ordered))


def said(line: TraceLine) -> bytes:
    """Return the bytes of what came: of junk that was only counted, as many that are junk to all families."""
    if line.text("raw"):
        return b"".join(part for part in masked(line.text("raw")) if part)

    return JUNK * int(line.number("count"))
