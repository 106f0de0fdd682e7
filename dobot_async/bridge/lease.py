"""The lease of an arm: one holder at a time may command it, until the holder is gone.

When a holder is gone, `leave` brings the arm to rest, and nobody has the lease until that has returned.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Generic, Protocol, TypeVar

from dobot_async.bridge.requests import Refused

__all__ = ["Holder", "Lease"]


class Holder(Protocol):
    """Who may have a lease."""

    @property
    def name(self) -> str:
        """Who it is, for people."""
        ...

    @property
    def gone(self) -> bool:
        """Whether it has gone, or was cut off."""
        ...


H = TypeVar("H", bound=Holder)


class Lease(Generic[H]):
    """See the module.

    Args:
        takeover: Whoever asks takes the lease from who has it; else the first one keeps it.
        leave: Called with a holder that has gone, before anybody else may have the lease.
        cut: Ends the connection, or the session, of a holder.
        tell: Takes note of what happens to whom.

    Attributes:
        holder: Who has it, None if nobody does.
    """

    def __init__(
        self,
        *,
        takeover: bool,
        leave: Callable[[H], Awaitable[None]],
        cut: Callable[[H, str], None],
        tell: Callable[[str, H, str], None],
    ) -> None:
        self.holder: H | None = None
        self._takeover = takeover
        self._leave = leave
        self._cut = cut
        self._tell = tell
        self._changing = asyncio.Lock()

    async def take(self, client: H) -> None:
        """Return when a client has the lease; raise Refused if it may not have it."""
        async with self._changing:
            holder = self.holder
            if holder is client:
                return

            if client.gone:
                raise Refused("the client has gone")

            if holder and not holder.gone:
                if not self._takeover:
                    raise Refused(f"{holder.name} moves the arm")

                self._cut(holder, f"{client.name} takes over")

            if holder:
                await self._release(holder)

            self.holder = client
            self._tell("lease", client, "moves the arm from now on")

    async def end(self, client: H) -> None:
        """End the lease of a client that has gone, if it has it."""
        async with self._changing:
            if self.holder is client:
                await self._release(client)

    async def _release(self, holder: H) -> None:
        """End the lease, when all is done for the arm that has to be."""
        await self._leave(holder)
        self.holder = None
        self._tell("released", holder, "anybody may move the arm")
