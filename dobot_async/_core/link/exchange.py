"""Requests over a connection, with their replies told apart and their losses noticed.

A request goes out once. If no answer comes within the reply timeout a barrier is asked behind it: a cheap read of
another key, whose answer proves that the request was lost (`Correlator`, rule 2); only then, and if that is allowed, is
it sent again. Whoever finds a request of his key outstanding, given up by its caller, asks a barrier first. On a silent
line there is one barrier a timeout, whoever waits for it, and the timeout grows. An urgent request, a stop, waits for
nothing: it is sent again until one of its copies is acknowledged.
"""

from __future__ import annotations

import asyncio
import logging
import math
from collections.abc import Callable, Hashable, Sequence
from contextlib import suppress
from functools import partial
from typing import Any, Generic, TypeVar

from dobot_async._core.link.connection import Connection, Reopen
from dobot_async._core.link.correlator import Correlator, Outcome, Request
from dobot_async._core.link.deadlines import Deadlines, release
from dobot_async._core.link.round_trip import RoundTrip
from dobot_async._core.link.silence import Silence
from dobot_async._core.link.stragglers import Stragglers
from dobot_async._core.protocol.contract import Frame, LinkStats
from dobot_async._core.protocol.transport import Transport
from dobot_async.errors import ReplyTimeout

__all__ = ["Exchange"]

F = TypeVar("F", bound=Frame)
logger = logging.getLogger("dobot_async.link")
TICK = 1e-6  # seconds that count as none
MOST = 20_000  # outstanding requests with which the link is given up: an hour of an arm that answers nothing


class Exchange(Connection, Generic[F]):
    """The part of a link that asks; `Link` describes its arguments."""

    def __init__(
        self,
        transport: Transport,
        url: str,
        reopen: Reopen | None,
        *,
        barriers: Sequence[F],
        filler: bytes,
        round_trip: RoundTrip,
    ) -> None:
        if len({frame.key for frame in barriers}) < 2:
            raise ValueError("a link needs barriers of two keys at least, or nothing tells that an answer was lost")

        super().__init__(transport, url, reopen)
        self._loop = asyncio.get_running_loop()
        self._correlator: Correlator[F] = Correlator(
            self._loop.time, lambda: self._transport.reorder_window, self._lost_on_the_way
        )
        self.heard_at: float = -math.inf
        self._stragglers = Stragglers()
        self._round_trip = round_trip
        self._stats = LinkStats()
        self._barriers = tuple(barriers)
        self._barrier: Request[F] | None = None
        self._asking = asyncio.Lock()  # one barrier for all who need one
        self._filler = filler
        self._silence = Silence(self.url, self._loop.time)
        self._losses = 0  # that the log has not told yet
        self._deadlines = Deadlines()

    @property
    def reply_timeout(self) -> float:
        """Seconds after which a request counts as unanswered: as the round trips suggest, more on a silent line."""
        return max(self._round_trip.timeout, self._silence.pause)

    async def send(
        self,
        frame: F,
        accept: Callable[[F], Any],
        *,
        timeout: float = math.inf,
        held: bool = False,
        expected: bool = True,
        proves: bool = True,
    ) -> Request[F]:
        """Send a frame once, in its turn; its reply is awaited with `settle`, or by nobody.

        Args:
            frame: What is sent.
            accept: Returns the reply's value, or raises ProtocolError if a frame of this key is not the reply.
            timeout: Seconds for which the transport may be busy.
            held: See `Correlator`.
            expected: False if the arm may well not reply, so that it is no loss.
            proves: False if its reply may be one that came alone, late (`stragglers`).

        Raises:
            ReplyTimeout: The transport did not take it in time.
            ConnectionLost: The link is gone.
        """
        data = self._filler + bytes(frame) if self._silence.is_mute() else bytes(frame)
        sent = partial(self._sent, frame, accept, held=held, expected=expected, proves=proves)
        if not self._correlator.reorder_window and self._write_now(data):
            return sent()

        try:
            async with asyncio.timeout(None if timeout == math.inf else timeout):
                await self.opened()
                await asyncio.sleep(max(0.0, self._correlator.calm_at(frame.key) - self._loop.time()))
                return await self._write_in_turn(data, sent)
        except TimeoutError:
            raise ReplyTimeout(f"the line to {self.url} took nothing for {timeout:.3g} s") from None

    def send_nowait(self, frame: F) -> bool:
        """Send a frame before this returns; False if the transport would block. Its reply is for nobody."""
        if not self._write_now(bytes(frame)):
            return False

        self._sent(frame, ignore)
        return True

    async def settle(self, request: Request[F], timeout: float) -> bool:
        """Return whether a request was answered: its `value` is the reply then, else it is known to be lost.

        Raises:
            ReplyTimeout: The arm says nothing for so many seconds.
            ConnectionLost: The link is gone.
        """
        await self._settle(request, self._loop.time() + timeout)
        if request.outcome is Outcome.FAILED:
            self._check()
        elif request.outcome is None:
            raise ReplyTimeout(f"{self.url} has not answered for {timeout:.3g} s")

        return request.outcome is Outcome.REPLY

    async def _ask(
        self, frame: F, accept: Callable[[F], Any], deadline: float, ready: Callable[[], None], *, repeatable: bool
    ) -> Request[F] | None:
        """Send a request, again if it was lost and that is allowed; return what was sent last."""
        request: Request[F] | None = None
        with suppress(ReplyTimeout):
            while True:
                if self._correlator.newest(frame.key):
                    await self._clear(frame.key, deadline)

                if not (left := self._left(deadline)):
                    break

                ready()
                self._stats.repeated += request is not None
                held, misfit = self._suspected(frame.key), request.misfit if request else None
                request = await self.send(frame, accept, timeout=left, held=held)
                request.misfit = misfit
                if held:
                    await self._send_barrier(frame.key, deadline)

                await self._settle(request, deadline)
                if request.outcome is not Outcome.LOST or not repeatable:
                    break

        return request

    async def _urge(
        self, frame: F, accept: Callable[[F], Any], deadline: float, ready: Callable[[], None]
    ) -> Request[F] | None:
        """Send what stops something until one copy is answered; return that copy, or the last one."""
        copies: list[Request[F]] = []
        last: Request[F] | None = None
        while left := self._left(deadline):
            ready()
            self._stats.repeated += bool(copies)
            # Copies of an earlier stop, which nobody awaits any more, would take the answers to these one by one.
            behind = self._correlator.newest(frame.key) is not None
            alive = not copies or self.heard_at >= copies[-1].sent_at
            with suppress(ReplyTimeout):
                last = await self.send(frame, accept, timeout=left, proves=not self._suspected(frame.key))
                copies.append(last)
                if behind and alive:
                    await self._send_barrier(frame.key, deadline)

            await self._wait(self._overdue_at(deadline), *copies)
            for copy in copies:
                if copy.outcome in {Outcome.REPLY, Outcome.FAILED}:
                    return copy

            self._timeout()
            copies = [copy for copy in copies if copy.outcome is None]

        return last

    async def _settle(self, request: Request[F], deadline: float) -> None:
        """Return when a request has ended, or at the deadline: if it is overdue, a barrier tells."""
        await self._wait(self._overdue_at(deadline), request)
        if request.outcome is None:
            self._timeout()
            await self._clear(request.key, deadline)

        if request.outcome is Outcome.REPLY:
            self._round_trip.sample(self._loop.time() - request.sent_at)

    async def _clear(self, key: Hashable, deadline: float) -> None:
        """Return when no request of a key is outstanding, or at the deadline."""
        while (newest := self._correlator.newest(key)) and self._left(deadline):
            if newest.gone_at < math.inf:  # it was lost; a reply that was overtaken may come until then
                await self._wait(min(newest.gone_at + TICK, deadline), newest)
                continue

            barrier = await self._barrier_behind(newest, deadline)
            await self._wait(min(barrier.sent_at + self.reply_timeout, deadline), newest, barrier)

    async def _barrier_behind(self, request: Request[F], deadline: float) -> Request[F]:
        """Return a barrier that was sent after a request and is not overdue: the last one, or another one."""
        try:
            async with asyncio.timeout_at(None if deadline == math.inf else deadline), self._asking:
                barrier = self._barrier
                if barrier and barrier.outcome is None and barrier.number > request.number:
                    if self._left(barrier.sent_at + self.reply_timeout):
                        return barrier

                    self._timeout()

                return await self._send_barrier(request.key, deadline)
        except TimeoutError:
            raise ReplyTimeout(f"the line to {self.url} takes nothing") from None

    async def _send_barrier(self, key: Hashable, deadline: float) -> Request[F]:
        """Ask something cheap of another key.

        Its reply will belong to the earliest outstanding request of its key, so the one proves most of which none is
        outstanding, or none for long. On a silent line the same one is asked again and again, and the others stay good.
        """
        last = self._barrier
        silent = last is not None and last.outcome is None and self.heard_at < last.sent_at
        frames = [frame for frame in self._barriers if frame.key != key]
        again = [frame for frame in frames if silent and last is not None and frame.key == last.key]
        frame = max(again or frames, key=lambda frame: self._correlator.earliest(frame.key))
        self._barrier = await self.send(frame, ignore, timeout=self._left(deadline))
        return self._barrier

    async def _wait(self, until: float, *requests: Request[F]) -> None:
        """Return when one of several requests has ended, or at a time."""
        if any(request.outcome for request in requests):
            return

        ended = self._loop.create_future()
        wake = partial(release, ended)
        self._deadlines.add(ended, until)
        for request in requests:
            request.wakers.append(wake)

        try:
            await ended
        finally:
            self._deadlines.remove(ended)
            for request in requests:
                if request.outcome is None:
                    request.wakers.remove(wake)

        if not any(request.outcome for request in requests):
            self._resync()

    def _left(self, deadline: float) -> float:
        """The seconds until a deadline, 0 if it is over; the loop's timers may fire a moment early."""
        left = deadline - self._loop.time()
        return left if left > TICK else 0.0

    def _overdue_at(self, deadline: float) -> float:
        """When an answer to what is sent now is overdue."""
        return min(self._loop.time() + self.reply_timeout, deadline)

    def _timeout(self) -> None:
        """Take note that no answer came within the reply timeout."""
        self._round_trip.unanswered()
        self._silence.timeout()

    def _log_losses(self) -> None:
        """Tell the log what was lost, of several in a row at once."""
        if self._losses:
            logger.info("%s: %d requests, or the answers to them, were lost", self.url, self._losses)
            self._losses = 0

    def _heard(self) -> None:
        """Take note that something came."""
        self.heard_at = self._loop.time()
        self._silence.heard()

    def _suspected(self, key: Hashable) -> bool:
        """Whether a reply of a key may come alone, long after its turn; of datagrams any may."""
        return not self._correlator.reorder_window and self._stragglers.suspected(key, self._loop.time())

    def _sent(self, frame: F, accept: Callable[[F], Any], **flags: bool) -> Request[F]:
        """Take note of a frame that goes out, in the order in which the arm gets it."""
        if len(self._correlator) >= MOST:
            self._end(TimeoutError(f"the arm has not answered the last {MOST} requests"))
            self._check()

        self._stragglers.sent()
        self._note(True, frame)
        return self._correlator.sent(frame.key, accept, **flags)

    def _lost_on_the_way(self, request: Request[F]) -> None:
        """Take note of a request that will not be answered in its turn."""
        if not request.expected:
            return

        self._stragglers.lost(request.key, self._loop.time(), counts=not request.held)
        self._losses += 1
        self._stats.lost += 1

    def _note(self, outgoing: bool, frame: F) -> None:
        """Tell those who look on of a frame."""
        raise NotImplementedError

    def _resync(self) -> None:
        """Give up a frame the rest of which is overdue."""
        raise NotImplementedError


def ignore(_: object) -> None:
    """Accept any reply, and make nothing of it."""
