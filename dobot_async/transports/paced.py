"""A transport that leaves a gap between the frames that it sends, for peers that miss what follows too closely.

One request is under way at a time, and each frame goes to the inner transport whole, in one write.
"""

from __future__ import annotations

import asyncio

from dobot_async._core.protocol.transport import Transport

__all__ = ["Paced"]


class Paced:
    """A transport behind another one.

    Args:
        inner: Where the frames go.
        gap: Least seconds from the end of one frame's sending to the next one.
    """

    in_flight = 1
    window = 1

    def __init__(self, inner: Transport, gap: float) -> None:
        self._inner = inner
        self._gap = gap
        self._loop = asyncio.get_running_loop()
        self._free_at = self._loop.time()

    @property
    def reorder_window(self) -> float:
        """That of the inner transport."""
        return self._inner.reorder_window

    async def send(self, data: bytes) -> None:
        """Sends one frame, once the gap after the last one is over; cancelled before that, it has sent nothing."""
        wait = self._free_at - self._loop.time()
        if wait > 0:
            await asyncio.sleep(wait)

        try:
            await self._inner.send(data)
        finally:
            self._free_at = self._loop.time() + self._gap

    async def receive(self) -> bytes:
        """Returns the next bytes."""
        return await self._inner.receive()

    async def aclose(self) -> None:
        """Closes the inner transport."""
        await self._inner.aclose()
