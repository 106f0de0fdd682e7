"""One client of a bridge: its bytes become frames, its frames become requests, as fast as it may and as it can wait.

    bytes --> inbox --> Parser --> waiting --> requests, a few at a time --> RequestHandler
                          `-- stops: at once

What it sends beyond its limits waits with it: the inbox is bounded, and a stream is not read while it is full. Nothing
of it can hold up anybody else: it is on the arm's line with a few requests at a time, one of each key.

A write is settled before the next request of its client begins: what a program reads after a command, to find out what
became of it, must not be older than the command. A read that is repeated while it waits is asked once, and answered
as often.
"""

from __future__ import annotations

import asyncio
import math
from collections import deque
from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

from dobot_async._core.link.admission import Admission
from dobot_async._core.protocol.contract import Frame
from dobot_async.arms.bridge_adapter import BridgeAdapter, ClientWatch, RequestKind
from dobot_async.bridge.answers import ClientAnswers
from dobot_async.bridge.limits import Allowance, Limits
from dobot_async.bridge.requests import ClientRequest, Refused, RequestHandler
from dobot_async.errors import DobotError

__all__ = ["Client"]

F = TypeVar("F", bound=Frame)
INBOX = 8192  # bytes
SLICE = 1024  # bytes that are parsed at a time
WAITING = 32  # requests
AT_ONCE = 8  # requests that wait for each other, or for the arm
ON_THE_LINE = 4  # reads that wait for the arm
MOST_TIMES = 8  # a read is answered at once
AGAIN = 5.0  # seconds until the same refusal is told once more
HALF = 0.5  # seconds after which the rest of a frame is overdue


class Client(Generic[F]):
    """See the module.

    Attributes:
        name: Who it is, for people.
        gone: Nothing of it is sent any more, and nothing to it.
        left: Its connection has ended.
        ordered: Whether its bytes come in order; if not, what does not fit is lost.
        watch: What it has made the arm do.
        reads: Its reads are few at a time, one of each key.
    """

    def __init__(
        self,
        handler: RequestHandler[F],
        family: BridgeAdapter[F],
        deliver: Callable[[bytes], None],
        disconnect: Callable[[], None],
        *,
        pause_reading: Callable[[bool], None],
        name: str,
        ordered: bool,
        limits: Limits,
    ) -> None:
        self.name = name
        self.gone: bool = False
        self.left: bool = False
        self.ordered = ordered
        self.watch: ClientWatch[F] = family.watch()
        self.reads: Admission = Admission(ON_THE_LINE)
        self._handler = handler
        self._family = family
        self._deliver = deliver
        self._disconnect = disconnect
        self._pause_reading = pause_reading
        self._limits = limits
        self._loop = asyncio.get_running_loop()
        self._parser = family.requests()
        self._inbox = bytearray()
        self._waiting: deque[ClientRequest[F]] = deque()
        self._bytes = Allowance(limits.data, self._loop.time)
        self._frames = Allowance(limits.frames, self._loop.time)
        self._room = asyncio.Semaphore(AT_ONCE)
        self._order = asyncio.Lock()
        self._news = asyncio.Event()
        self._held = False
        self._junk = 0
        self._complaint = ("", "")
        self._complained = -math.inf
        self._half = False
        self._heard = self._loop.time()
        self._requests: set[asyncio.Task[None]] = set()
        self._writing: asyncio.Task[None] | None = None
        self._unsent: dict[Hashable, ClientRequest[F]] = {}
        self._stopping: set[bytes] = set()
        self._answers: ClientAnswers[F] = ClientAnswers(in_order=family.in_order, deliver=self.tell)
        self._work = self._loop.create_task(self._run(), name=f"dobot_async bridge {name}")
        self._work.add_done_callback(self._ended)

    def send(self, data: bytes) -> None:
        """Takes what the client has sent."""
        self._heard = self._loop.time()
        if self.gone or (not self.ordered and len(self._inbox) > INBOX):
            return

        self._inbox += data
        self._read()
        if len(self._inbox) > INBOX and self.ordered:
            self._held = True
            self._pause_reading(True)

        self._news.set()

    def tell(self, data: bytes) -> None:
        """Sends bytes to the client, if it is there."""
        if not self.gone:
            self._deliver(data)

    def dismiss(self) -> None:
        """Ends the connection as far as it can be ended, and ignores the client from now on."""
        if not self.gone:
            self.gone = True
            self._inbox.clear()
            self._waiting.clear()
            # A datagram client stays known, so that its later datagrams are not taken for a new client's.
            if self.ordered:
                self._disconnect()

    def leave(self) -> None:
        """The connection has ended."""
        self.gone = self.left = True
        self._work.cancel()

    async def take_turn(self, request: ClientRequest[F]) -> None:
        """Waits until what the client has asked before is on the arm's line.

        The arm answers in order, and so the client is answered: it takes an answer that comes in front of another one
        for the proof that the other one was lost.
        """
        await self._order.acquire()
        request.in_turn = True

    def end_turn(self, request: ClientRequest[F]) -> None:
        """A request is sent now, or will never be; may be called again."""
        if request.in_turn:
            request.in_turn = False
            self._order.release()

    def sending(self, request: ClientRequest[F]) -> None:
        """A read is sent now: what is repeated from here on is asked anew."""
        if self.gone:
            raise Refused("the client has gone")

        self.end_turn(request)
        self._forget(request)

    async def settled(self) -> None:
        """Returns when none of its requests is on its way any more."""
        while self._requests:
            await asyncio.wait(self._requests)

    async def aclose(self) -> None:
        """Ends all that it has going on."""
        self.leave()
        for task in self._requests:
            task.cancel()

        await asyncio.wait({self._work, *self._requests})

    async def _run(self) -> None:
        """Passes on what waits, as fast as the limits allow; notices half frames and, on datagrams, silence."""
        while True:
            try:
                async with asyncio.timeout(HALF):
                    await self._news.wait()
            except TimeoutError:
                self._overdue()
                continue

            self._news.clear()
            while self._waiting or self._inbox:
                await asyncio.sleep(max(self._bytes.wait, self._frames.wait))
                self._read()
                await self._pass_on()

            if self._held:
                self._held = False
                self._pause_reading(False)

    def _overdue(self) -> None:
        """Nothing has come for a while: gives up half a frame, and a client that cannot say that it goes."""
        if self._half:
            self._half = False
            self._sort(self._parser.resync())
            self._news.set()

        if not self.ordered and self._loop.time() - self._heard > self._limits.silence:
            self._disconnect()

    def _read(self) -> None:
        """Makes requests of what has come, no more than may wait."""
        while self._inbox and len(self._waiting) < WAITING and not self._bytes.wait and not self.gone:
            piece = bytes(self._inbox[:SLICE])
            del self._inbox[:SLICE]
            self._bytes.spend(len(piece))
            frames = self._parser.feed(piece)
            self._half = True
            self._junk = 0 if frames else self._junk + len(piece)
            self._sort(frames)
            if self._junk > self._limits.junk:
                self._handler.cut(self, f"{self._junk} bytes without a request among them")

    def _sort(self, frames: list[F]) -> None:
        """Lets requests wait; not what stops the arm."""
        for frame in frames:
            request = ClientRequest(frame, self._family.kind(frame), self._handler.stops)
            if request.kind is RequestKind.READ:
                self._ask(request)
                continue

            self._unsent.clear()
            stop = bytes(frame)
            if request.kind is RequestKind.WRITE:
                self._take(request)
            elif stop not in self._stopping:
                self._stopping.add(stop)
                request.ahead = True
                self._take(request)
            elif self._family.in_order:
                # The same stop again tells the arm nothing new while it has not answered the first one.
                self._take(request)

    def _ask(self, request: ClientRequest[F]) -> None:
        """Lets a read wait, or joins it with the one before it if that is the same and waits as well."""
        last = self._unsent.get(request.frame.key)
        if last and last.frame == request.frame and last.times < MOST_TIMES:
            last.times += 1
            self._frames.spend(1)
        else:
            self._unsent = {request.frame.key: request}
            self._take(request)

    def _take(self, request: ClientRequest[F]) -> None:
        """Begins with a request, or lets it wait."""
        self._answers.expect(request)
        if request.ahead:
            self._start(request)
        else:
            self._waiting.append(request)

    def _forget(self, request: ClientRequest[F]) -> None:
        """Joins nothing more with a read."""
        if self._unsent.get(request.frame.key) is request:
            del self._unsent[request.frame.key]

    async def _pass_on(self) -> None:
        """Begins with the next request when not too many are under way, and no write."""
        if self._waiting:
            await self._room.acquire()
            if self._family.in_order:
                await self.settled()
            elif self._writing:
                await asyncio.wait([self._writing])

            if not self._waiting:  # what it waited for was not answered
                self._room.release()
                return

            self._frames.spend(1)
            request = self._waiting.popleft()
            task = self._start(request)
            self._writing = task if request.kind is RequestKind.WRITE else None

    def _start(self, request: ClientRequest[F]) -> asyncio.Task[None]:
        task = self._loop.create_task(self._serve(request), name=f"dobot_async bridge request of {self.name}")
        self._requests.add(task)
        task.add_done_callback(self._requests.discard)
        return task

    async def _serve(self, request: ClientRequest[F]) -> None:
        """Has a request answered, and hands over the answer."""
        try:
            reply = await self._handler.answer(self, request)
        except (Refused, DobotError) as error:
            self._complain(self._family.name(request.frame), str(error))
            self._answers.give(request, self._family.refusal(str(error)) if isinstance(error, Refused) else b"")
            if self._family.in_order and isinstance(error, DobotError):
                self._drop()
        else:
            self._answers.give(request, b"" if reply is None else bytes(reply))
        finally:
            self._forget(request)
            if request.ahead:
                self._stopping.discard(bytes(request.frame))
            else:
                self._room.release()

    def _drop(self) -> None:
        """Gives up what came behind a request that was not answered: answers to it would pass for that one's."""
        self._inbox.clear()
        self._parser.reset()
        self._unsent.clear()
        while self._waiting:
            self._answers.give(self._waiting.popleft(), b"")

    def _complain(self, name: str, reason: str) -> None:
        """Tells that a request was not passed on; not of each repetition, for it is asked again and again."""
        now = self._loop.time()
        if not self.gone and ((name, reason) != self._complaint or now > self._complained + AGAIN):
            self._complaint, self._complained = (name, reason), now
            self._handler.refused(self, name, reason)

    def _ended(self, work: asyncio.Task[None]) -> None:
        """A bug that ends the work must not leave a client that waits for ever."""
        if not work.cancelled() and (error := work.exception()):
            self._handler.cut(self, f"{type(error).__name__}: {error}")
