"""`replay:FILE`: a device that answers as a recorded one did, to go through a report again with no arm.

link --request--> ReplayTransport --> Script: what was said to it, after how long
link <--bytes---- each when its time has come, replies in the order of their requests unless one came late
"""

from __future__ import annotations

import asyncio
import heapq
import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import SplitResult, unquote, urlsplit
from weakref import WeakValueDictionary

import anyio

from dobot_async.arms.registry import Parts, families
from dobot_async.errors import ConnectFailed
from dobot_async.traces.exchanges import RecordedReply, RecordedRequest
from dobot_async.traces.reader import Trace, TraceLine, TraceProblem, read_trace
from dobot_async.traces.script import Script, Unrecorded
from dobot_async.transports.options import Option, number, options, words

__all__ = ["Replay", "ReplayTransport", "open_url"]

SCHEME = "replay"
OPTIONS: dict[str, Option | Callable[[str], Any]] = {
    "arm": words,
    "connection": number(int, "the number of a connection", least=1, most=1_000_000),
    "session": words,
}
TICK = 1e-6  # seconds that count as none: the loop's timers may fire a moment early
Retime = Callable[[bytes, float], bytes]
"""Return an answer as it would be so many seconds later: where it tells of the arm's own clock, it is another one."""
RETIMES: Parts[Retime] = Parts("replay")
sessions: WeakValueDictionary[str, Replay] = WeakValueDictionary()
"""Replays that may be opened again, as the connection was that they are of."""
names: itertools.count[int] = itertools.count(1)


async def open_url(url: SplitResult, *, arm: str) -> ReplayTransport:
    """Open `replay:trace.jsonl` or `replay:///home/me/trace.jsonl`.

    `?arm=` is one of several arms in it, `?connection=` not its first connection but a later one.

    Raises:
        ValueError: The file is no trace, or one of another family's arm.
        ConnectFailed: It cannot be read.
    """
    given = options(url, OPTIONS)
    session = given.pop("session", None)
    if session is not None:
        replay = sessions.get(session)
        if replay is None:
            raise ValueError("session= is for a connection that is opened again, and there is none")

        return replay.reopened()

    mine = recorded(url, given)
    check_family(mine.lines[0], arm)
    name = f"{next(names)}"
    separator = "&" if url.query else "?"
    retime = RETIMES.get(mine.lines[0].text("family"), unchanged)
    replay = Replay(mine.lines[0], Script(mine), f"{url.geturl()}{separator}session={name}", retime)
    sessions[name] = replay
    return ReplayTransport(replay)


def recorded(url: SplitResult, given: Mapping[str, Any]) -> Trace:
    """Return what was recorded of the connection that a URL names."""
    path = unquote(url.netloc + url.path)
    if not path:
        raise ValueError("expected replay:FILE, with a file of --trace or record=")

    try:
        trace = read_trace(path)
    except OSError as error:
        raise ConnectFailed(f"cannot read the trace {path}: {error.strerror or error}") from error

    if not trace.whole:
        raise TraceProblem(f"the beginning of {path} was rotated away, and a replay needs it: keep more parts")

    return trace.of(given.get("arm"), given.get("connection", 1))


def recorded_times(url: str) -> tuple[float, float] | None:
    """Return the seconds, the least and the most, until a request was sent again; None for what is no replay."""
    parts = urlsplit(url)
    if parts.scheme != SCHEME:
        return None

    try:
        connection = recorded(parts, options(parts, OPTIONS)).lines[0]
    except (ValueError, ConnectFailed):
        return None  # who opens it says so

    match connection.numbers("reply_timeout"):
        case (least, most) if 0 < least <= most:
            return least, most
        case _:
            return None


def unchanged(data: bytes, _: float) -> bytes:
    """Return an answer of an arm that tells of no clock."""
    return data


def check_family(connection: TraceLine, arm: str) -> None:
    """Raise ValueError if an arm of another family is to be driven than the one that was recorded."""
    family = connection.text("family")
    wanted = next((name for name, family in families() if arm in {name, *family.models}), arm)
    if wanted != family:
        raise ValueError(f"this is a trace of a {connection.text('model') or family}, and no {arm}")


class Replay:
    """One recorded connection, through its outages.

    Args:
        connection: The line with which it begins.
        script: What is said to what is asked.
        url: By which it is opened again.
        retime: Lets what the arm tells of its own clock keep up.
    """

    def __init__(self, connection: TraceLine, script: Script, url: str, retime: Retime) -> None:
        self.connection = connection
        self.script = script
        self.url = url
        self.retime = retime
        self.open_from: float = -math.inf
        self.number = 0  # of the last piece that was delivered
        now = asyncio.get_running_loop().time()
        self.began: float = now - script.opening.t
        script.begin(now)

    def reopened(self) -> ReplayTransport:
        """Open it again; raise ConnectFailed while it could not be."""
        if asyncio.get_running_loop().time() < self.open_from:
            raise ConnectFailed("the connection was away at this time, when it was recorded")

        return ReplayTransport(self)


@dataclass(order=True, slots=True)
class Due:
    """What is to come, by its time."""

    at: float
    number: int
    piece: RecordedReply = field(compare=False)
    later: float = field(compare=False)  # seconds than in the recording, both counted from the beginning


class ReplayTransport:
    """A transport to what was recorded; it has the limits of the recorded one."""

    def __init__(self, replay: Replay) -> None:
        connection = replay.connection
        self.url: str = replay.url
        self.in_flight: int = int(connection.number("in_flight", 1))
        self.window: int = int(connection.number("window", 1))
        self.reorder_window: float = connection.number("reorder_window")
        self._replay = replay
        self._loop = asyncio.get_running_loop()
        self._due: list[Due] = []
        self._count = itertools.count()
        self._last_due = -math.inf  # of a reply that is in its turn: what was asked behind it is not answered before
        self._timer: asyncio.TimerHandle | None = None
        self._arrived: list[bytes] = []
        self._news = asyncio.Event()
        self._closed = False
        self._broken: Exception | None = None
        if replay.number == 0:
            self._plan(replay.script.opening)

    def write(self, data: bytes) -> bool:
        """Take a request; return False if the connection is gone."""
        if self._closed or self._broken:
            return False

        try:
            self._plan(self._replay.script.asked(data, self._loop.time(), self._replay.number))
        except Unrecorded as error:
            self._break(ConnectionResetError(str(error)))

        return True

    async def send(self, data: bytes) -> None:
        """Take a request."""
        self._check()
        self.write(data)

    async def receive(self) -> bytes:
        """Return the next bytes."""
        while not self._arrived:
            self._check()
            self._news.clear()
            await self._news.wait()

        return self._arrived.pop(0)

    async def aclose(self) -> None:
        """Close it; it may be called again."""
        self._closed = True
        self._news.set()
        if self._timer:
            self._timer.cancel()

    def _plan(self, asked: RecordedRequest) -> None:
        """Have what was said to a request come when its time has come."""
        now = self._loop.time()
        for piece in asked.pieces:
            at = now + piece.after
            if piece.ordered:
                at = self._last_due = max(at, self._last_due)

            later = at - self._replay.began - (asked.t + piece.after)
            heapq.heappush(self._due, Due(at, next(self._count), piece, later))

        self._go()

    def _go(self) -> None:
        if self._timer:
            self._timer.cancel()
            self._timer = None

        if self._due:
            self._timer = self._loop.call_at(self._due[0].at, self._deliver)

    def _deliver(self) -> None:
        self._timer = None
        while self._due and self._due[0].at <= self._loop.time() + TICK and not self._broken:
            due = heapq.heappop(self._due)
            piece = due.piece
            self._replay.number = max(self._replay.number, piece.number)
            if piece.data is None:
                self._replay.open_from = self._loop.time() + piece.outage
                self._break(ConnectionResetError("the connection broke here, when it was recorded"))
                return

            self._arrived.append(self._replay.retime(piece.data, due.later))
            self._news.set()

        self._go()

    def _break(self, error: Exception) -> None:
        self._broken = error
        self._due.clear()
        self._news.set()

    def _check(self) -> None:
        if self._closed:
            raise anyio.ClosedResourceError

        if self._broken:
            raise anyio.BrokenResourceError from self._broken
