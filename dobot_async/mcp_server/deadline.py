"""Connections that bring no request hold no place for long: a few, for a few seconds, as at the ports of a bridge.

    connection --> pending --head, body--> request: the answer takes as long as the arm does
                      `-- too late, too many: cut         `-- the next request of the connection: pending again

Who brings a request without the right token is answered, and its connection closed. So what is not pending is of
clients that were let in.
"""

from __future__ import annotations

import asyncio
import math
from collections import Counter

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

from dobot_async.bridge.handshake import PENDING

__all__ = ["PunctualHTTP"]

WHOLE = 20.0  # seconds from the beginning of a connection, or of a later request on it, to the request's last byte
MOST = 128  # connections with a request


class PunctualHTTP(H11Protocol):
    """A connection of uvicorn's on which each request has a deadline."""

    _deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]  # as uvicorn has it
        """Expect the first request."""
        super().connection_made(transport)
        self._expect()
        here = [each for each in self.connections if isinstance(each, PunctualHTTP) and not each.transport.is_closing()]
        pending = [each for each in here if each.due < math.inf]
        if len(here) - len(pending) > MOST:
            self.transport.abort()
        elif len(pending) > PENDING:
            ((most, _),) = Counter(each.address for each in pending).most_common(1)
            oldest = min((each for each in pending if each.address == most), key=lambda each: each.due)
            oldest.transport.abort()

    def data_received(self, data: bytes) -> None:
        """Take a part of a request."""
        self._expect()
        super().data_received(data)
        if self.conn.their_state not in {h11.IDLE, h11.SEND_BODY}:
            self._expect_nothing()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget it."""
        self._expect_nothing()
        super().connection_lost(exc)

    @property
    def address(self) -> str:
        """From where it comes."""
        return self.client[0] if self.client else "?"

    @property
    def due(self) -> float:
        """When its request has to be there, by the loop's clock; infinity if none is expected."""
        return self._deadline.when() if self._deadline else math.inf

    def _expect(self) -> None:
        self._deadline = self._deadline or self.loop.call_later(WHOLE, self.transport.abort)

    def _expect_nothing(self) -> None:
        if self._deadline:
            self._deadline.cancel()
            self._deadline = None
