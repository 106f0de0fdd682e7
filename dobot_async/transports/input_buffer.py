"""What transports of a byte stream share: received bytes that wait for `receive`, and how the connection ends.

1. `receive` returns what has arrived, or waits. What arrived before the connection ended is returned first.
2. The first end counts: closed by the caller (`ClosedResourceError`), or lost (`BrokenResourceError` from its reason).
"""

from __future__ import annotations

import asyncio

import anyio

__all__ = ["BUFFER", "InputBuffer"]

BUFFER = 1 << 16
"""Bytes that are kept until somebody takes them."""


class InputBuffer:
    """The receiving half of a transport; for the loop in which it is made."""

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._lost: asyncio.Future[None] = self._loop.create_future()
        self._cause: BaseException | None = None
        self._closed = False  # by the caller
        self._buffer = bytearray()
        self._arrived: asyncio.Future[None] | None = None

    async def receive(self) -> bytes:
        """Return what has arrived, at least one byte."""
        while not self._buffer:
            await self._arrival()

        data = bytes(self._buffer)
        self._buffer.clear()
        return data

    async def _arrival(self) -> None:
        """Return when something arrives or ends; raise if nothing will arrive any more."""
        self._check_input()
        self._arrived = self._loop.create_future()
        await self._arrived

    def _wake(self) -> None:
        if self._arrived and not self._arrived.done():
            self._arrived.set_result(None)

    def _check(self) -> None:
        """Raise if the transport is closed or lost."""
        if self._closed:
            raise anyio.ClosedResourceError

        if self._lost.done():
            raise anyio.BrokenResourceError from self._reason()

    def _check_input(self) -> None:
        """Raise if nothing will arrive any more."""
        self._check()

    def _reason(self) -> BaseException | None:
        """Why the connection was lost, as the caller is told."""
        return self._cause
