"""A link over a line in memory, with a peer at its far end that answers in order; a test decides what becomes of it."""

from __future__ import annotations

import asyncio
import struct
from collections import deque
from collections.abc import AsyncIterator, Iterator
from contextlib import aclosing, asynccontextmanager
from itertools import repeat
from typing import Any

import anyio

from dobot_async._core.link.link import Link
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.frame import FILLER, MAX_LENGTH, OVERHEAD, Frame, Parser, request

__all__ = [
    "BARRIERS",
    "LATENCY",
    "LOST",
    "QUESTIONS",
    "TIME",
    "Line",
    "StrictParser",
    "asked",
    "line",
    "link_over",
    "now",
    "number_in",
    "question",
    "start",
]

TIME = c.GET_DEVICE_TIME
QUESTIONS = (
    TIME,
    c.GET_POSE,
    c.GET_DEVICE_ID,
    c.GET_PTP_COMMON_PARAMS,
    c.GET_PTP_JOINT_PARAMS,
    c.GET_PTP_COORDINATE_PARAMS,
    c.GET_PTP_JUMP_PARAMS,
    c.GET_HOME_PARAMS,
    c.GET_JOG_JOINT_PARAMS,
    c.GET_JOG_COORDINATE_PARAMS,
)
"""Ten reads of ten keys."""

LATENCY = 0.005
TICK = 1e-6  # two timers for one moment fire in any order
LOST = -1.0
"""The fate of a request that is lost on its way."""


def question(command: Any) -> Frame:
    """The frame of a command without parameters."""
    return request(command, b"", queued=False)


BARRIERS = (question(c.GET_DEVICE_NAME), question(c.GET_DEVICE_SN), question(c.GET_END_EFFECTOR_PARAMS))


def now() -> float:
    """The virtual time."""
    return asyncio.get_running_loop().time()


def start(work: Any) -> asyncio.Task[Any]:
    """Begins a call."""
    return asyncio.ensure_future(work)


def number_in(answer: Frame) -> int:
    """Which request it was that was answered."""
    return int(struct.unpack_from("<I", answer.params)[0])


class StrictParser:
    """Finds frames as an arm does that believes every length, however long it waits for the rest."""

    def __init__(self) -> None:
        self._buffer = b""

    def feed(self, data: bytes) -> list[Frame]:
        self._buffer += data
        frames = []
        while (at := self._buffer.find(b"\xaa\xaa")) >= 0 and len(self._buffer) > at + 2:
            length = self._buffer[at + 2]
            end = at + OVERHEAD + length
            if not 2 <= length <= MAX_LENGTH:
                self._buffer = self._buffer[at + 1 :]
                continue

            if len(self._buffer) < end:
                break

            found, self._buffer = self._buffer[at:end], self._buffer[end:]
            if not sum(found[3:]) & 0xFF:
                frames.append(Frame(found[3], found[4], found[5:-1]))

        return frames


class Line:
    """The transport, and the peer.

    Each reply begins with the number of its request, in the order in which the peer has got them.

    Attributes:
        sent: When each request went out, and what it was.
        heard: How many requests the peer has got.
        fates: For each request, after how many seconds it is answered; None if the reply is lost, LOST if the request.
        dead: Whether all that is sent is lost.
        blocked: Whether it takes nothing.
        send_error: What sending raises.
    """

    window = 16

    def __init__(self, *, in_flight: int = 8, reorder_window: float = 0.0) -> None:
        self.in_flight = in_flight
        self.reorder_window = reorder_window
        self.sent: list[tuple[float, Frame]] = []
        self.raw: list[bytes] = []
        self.heard = 0
        self.fates: Iterator[float | None] = repeat(LATENCY)
        self.dead = False
        self.blocked = False
        self.send_error: Exception | None = None
        self.parser: Any = Parser()
        self.closing = self.closed = 0
        self.closing_hangs = False
        self._still = False
        self._kept: deque[bytes] = deque()
        self._due = 0.0
        self._arrived: asyncio.Queue[bytes | Exception] = asyncio.Queue()
        self._free = asyncio.Event()

    async def send(self, data: bytes) -> None:
        while self.blocked:  # noqa: ASYNC110 - a test changes it
            await asyncio.sleep(0.01)

        if self.send_error:
            raise self.send_error

        self.take(data)

    def take(self, data: bytes) -> None:
        """A message goes out."""
        self.raw.append(data)
        self.sent += [(now(), frame) for frame in Parser().feed(data)]
        if self._still:
            self._kept.append(data)
        elif not self.dead:
            self._reach(data)

    def _reach(self, data: bytes) -> None:
        for frame in self.parser.feed(data):
            fate = next(self.fates, LATENCY)
            if fate == LOST:
                continue

            self.heard += 1
            if fate is not None:
                self._due = max(self._due + TICK, now() + fate)
                asyncio.get_running_loop().call_at(self._due, self._come, bytes(self.answer(frame)))

    def answer(self, frame: Frame) -> Frame:
        """What the peer says."""
        size = 0 if frame.write else ANSWERS.get(frame.id, 4)
        return frame._replace(params=struct.pack("<I", self.heard).ljust(size, b"\0")[:size])

    def _come(self, data: bytes) -> None:
        if self._still:
            self._kept.append(data)
        elif not self.dead:
            self._arrived.put_nowait(data)

    def say(self, *frames: Frame) -> None:
        """The peer says something unasked."""
        self._come(b"".join(map(bytes, frames)))

    def noise(self, data: bytes) -> None:
        """Bytes come."""
        self._arrived.put_nowait(data)

    def breaks(self, error: Exception) -> None:
        """The transport ends."""
        self._arrived.put_nowait(error)

    def stand_still(self) -> None:
        """From now on all that is on the line waits."""
        self._still = True

    def go_on(self) -> None:
        """What has waited arrives at once, in order: replies first, for they were made before."""
        self._still = False
        self._due = max(self._due, now())
        kept, self._kept = self._kept, deque()
        requests = []
        for data in kept:
            if data in self.raw:
                requests.append(data)
            else:
                self._come(data)

        for data in requests:
            self._reach(data)

    async def receive(self) -> bytes:
        found = await self._arrived.get()
        if isinstance(found, Exception):
            self._arrived.put_nowait(found)
            raise found

        return found

    async def aclose(self) -> None:
        self.closing += 1
        if self.closing_hangs:
            await asyncio.Event().wait()

        await asyncio.sleep(0)
        self.closed += 1
        self._arrived.put_nowait(anyio.ClosedResourceError())

    def times(self, key: int) -> list[float]:
        """When requests of a key went out."""
        return [at for at, frame in self.sent if frame.key == key]


class PromptLine(Line):
    """One that need not be awaited to send."""

    def write(self, data: bytes) -> bool:
        if self.blocked or self.send_error:
            return False

        self.take(data)
        return True


ANSWERS = {
    c.GET_POSE.id: 32,
    c.GET_DEVICE_ID.id: 12,
    c.GET_PTP_JOINT_PARAMS.id: 32,
    c.GET_PTP_COORDINATE_PARAMS.id: 16,
    c.GET_PTP_JUMP_PARAMS.id: 8,
    c.GET_HOME_PARAMS.id: 16,
    c.GET_JOG_JOINT_PARAMS.id: 32,
    c.GET_JOG_COORDINATE_PARAMS.id: 32,
    c.GET_END_EFFECTOR_PARAMS.id: 12,
}
"""Bytes of each answer."""


def link_over(transport: Any, **options: Any) -> Link[Frame]:
    """A link with the parser of a Magician."""
    options = {"barriers": BARRIERS, "filler": FILLER, **options}
    return Link(transport, Parser(), request, url="memory:", **options)


@asynccontextmanager
async def line(
    *, prompt: bool = False, in_flight: int = 8, reorder_window: float = 0.0, over: Line | None = None, **options: Any
) -> AsyncIterator[tuple[Link[Frame], Line]]:
    """A link and its line, closed at the end."""
    made = over or (PromptLine if prompt else Line)(in_flight=in_flight, reorder_window=reorder_window)
    async with aclosing(link_over(made, **options)) as link:
        yield link, made


async def asked(link: Link[Frame], command: Any = TIME, timeout: float | None = None) -> int:
    """Asks a question; returns which request was answered."""
    frame = link.frame(command, None)
    timeout = command.timeout if timeout is None else timeout
    return await link.exchange(frame, number_in, name=command.name, timeout=timeout, repeatable=True)
