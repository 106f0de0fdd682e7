"""Requests have to be there in time: who opens a connection and says nothing, or little, holds no place for long.

connection --> deadline --> head, body --> no deadline any more: the answer takes as long as the arm does
`-- the next request of the connection: a new deadline
"""

from __future__ import annotations

import asyncio

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

__all__ = ["PunctualHTTP"]

WHOLE = 20.0  # seconds from the beginning of a connection, or of a later request on it, to the request's last byte


class PunctualHTTP(H11Protocol):
    """A connection of uvicorn's on which each request has a deadline."""

    _deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]  # as uvicorn has it
        """Expect the first request."""
        super().connection_made(transport)
        self._expect()

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

    def _expect(self) -> None:
        self._deadline = self._deadline or self.loop.call_later(WHOLE, self.transport.abort)

    def _expect_nothing(self) -> None:
        if self._deadline:
            self._deadline.cancel()
            self._deadline = None
