"""A transport with one reading task, reopened when it breaks if that is wanted, and one door of death.

Whatever breaks first is kept as the cause, everybody who waits hears of it once, and every later call fails with it at
once. Nothing is held open across the caller's code: the reader is a plain task that `aclose` cancels and joins.
"""

from __future__ import annotations

import asyncio
import logging
import random
from abc import ABC, abstractmethod
from collections.abc import Awaitable, Callable
from typing import TypeVar

import anyio

from dobot_async._core.protocol.contract import LinkState
from dobot_async._core.protocol.transport import Transport, nowait_writer, read_loop
from dobot_async._core.util.events import Watched
from dobot_async._core.util.tasks import cancel_and_join
from dobot_async._core.util.urls import hidden
from dobot_async.errors import ConnectFailed, ConnectionLost

__all__ = ["Connection", "Reopen"]

T = TypeVar("T")
Reopen = Callable[[], Awaitable[Transport]]
logger = logging.getLogger("dobot_async.link")
CLOSE_TIMEOUT = 2.0
FIRST_PAUSE, LAST_PAUSE = 0.1, 5.0
BROKEN = (anyio.EndOfStream, anyio.BrokenResourceError, anyio.ClosedResourceError, OSError)
DEAD = {LinkState.LOST, LinkState.CLOSED}


class Connection(ABC):
    """One transport after the other.

    Args:
        transport: The first one.
        url: Where the arm is, for messages.
        reopen: Opens the next one when one breaks; None ends with the first.

    Attributes:
        url: Where the arm is, without secrets.
        state: Its `value` says whether it is open, is being reopened, was lost or closed; `async for` yields changes.
        outages: How often it was lost and reopened.
    """

    def __init__(self, transport: Transport, url: str, reopen: Reopen | None) -> None:
        self.url: str = hidden(url)
        self.state: Watched[LinkState] = Watched(LinkState.OPEN)
        self.outages: int = 0
        self._transport = transport
        self._write = nowait_writer(transport)
        self._reopen = reopen
        self._sending = asyncio.Lock()
        self._cause: BaseException | None = None
        self._reader = asyncio.create_task(self._read(), name=f"dobot_async reader {self.url}")

    @abstractmethod
    def _feed(self, data: bytes) -> None:
        """Take what arrives."""

    @abstractmethod
    def _reopened(self) -> None:
        """Another transport is open."""

    @abstractmethod
    def _ended(self, error: ConnectionLost) -> None:
        """It is dead; called once, with what every later call raises."""

    @property
    def open(self) -> bool:
        """Whether it is open just now."""
        return self.state.value is LinkState.OPEN

    async def opened(self) -> None:
        """Return when it is open, at once or when it has been reopened; raise ConnectionLost if it is dead."""
        while self.state.value is LinkState.REOPENING:
            await anext(self.state.__aiter__())

        self._check()

    async def aclose(self) -> None:
        """Close it; everybody who still waits gets ConnectionLost. Takes 2 s at most."""
        with anyio.CancelScope(shield=True), anyio.move_on_after(CLOSE_TIMEOUT, shield=True):
            self._end(None)
            try:
                await cancel_and_join(self._reader)
            finally:
                await self._transport.aclose()

    def _write_now(self, data: bytes) -> bool:
        """Send bytes before this returns; False if that cannot be, and nothing was sent."""
        return self.open and not self._sending.locked() and self._write(data)

    async def _write_in_turn(self, data: bytes, sending: Callable[[], T]) -> T:
        """Send bytes behind those of others; return what `sending` does, which is called when their turn has come."""
        await self.opened()
        async with self._sending:
            self._check()
            result = sending()
            try:
                await self._transport.send(data)
            except BROKEN as error:
                if not self._reopen:
                    self._end(error.__cause__ or error)
                    self._check()

                # As if it had been lost on the way: the reader finds the end, and mends it.
                await self._transport.aclose()

            return result

    def _check(self) -> None:
        """Raise ConnectionLost, each time another instance, if the connection is dead."""
        if self.state.value in DEAD:
            raise self._lost() from self._cause

    def _lost(self) -> ConnectionLost:
        if self._cause is None:
            return ConnectionLost(f"the connection to {self.url} was closed")

        reason = str(self._cause) or type(self._cause).__name__
        return ConnectionLost(f"the connection to {self.url} was lost: {reason}; is the arm powered and the cable in?")

    def _end(self, cause: BaseException | None) -> None:
        """Be closed from now on, or lost if there is a cause; only the first one counts."""
        if self.state.value not in DEAD:
            self._cause = cause
            self.state.change(LinkState.LOST if cause else LinkState.CLOSED)
            self.state.close()
            self._ended(self._lost())

    async def _read(self) -> None:
        """Read until the transport ends, and from the next one if there is to be one."""
        try:
            while True:
                try:
                    await read_loop(self._transport, self._feed)
                except BROKEN as error:
                    if not self._reopen:
                        self._end(error.__cause__ or error)
                        return

                    await self._mend(self._reopen, error)
        except Exception as error:
            self._end(error)  # a bug in a parser must not leave callers waiting for a reader that is gone
            raise

    async def _mend(self, reopen: Reopen, cause: Exception) -> None:
        """Open the next transport, as often as it takes, at growing intervals that differ from arm to arm."""
        logger.warning("%s: the connection broke (%r) and is opened anew", self.url, cause)
        self.state.change(LinkState.REOPENING)
        await self._transport.aclose()
        pause = FIRST_PAUSE
        while True:
            try:
                self._transport = await reopen()
                break
            except (ConnectFailed, OSError):
                await asyncio.sleep(pause * random.uniform(0.5, 1.0))  # noqa: S311 - no secret
                pause = min(2 * pause, LAST_PAUSE)

        self._write = nowait_writer(self._transport)
        self.outages += 1
        self._reopened()
        self.state.change(LinkState.OPEN)
        logger.warning("%s: the connection is open again", self.url)
