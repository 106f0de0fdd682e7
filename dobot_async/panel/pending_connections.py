"""Connections that have not shown yet that they may come in: a few, for a few seconds, as at the ports of a bridge.

    accepted --> pending --a request with a right token or cookie--> in
                    `-- too late, too many: cut

1. Pending connections are `PENDING`, TLS that is not agreed upon among them. One more takes the place of the oldest
   from the address that has most of them.
2. Each has `HANDSHAKE` seconds, however it sends.
3. All connections together are `MOST`.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable

from aiohttp.web import Server
from aiohttp.web_protocol import RequestHandler

from dobot_async.bridge.handshake import HANDSHAKE, PENDING

__all__ = ["PendingConnections"]

MOST = 128


class RefusedConnection(asyncio.Protocol):
    """A connection that is not taken."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """End it."""
        if isinstance(transport, asyncio.Transport):
            transport.abort()


class PendingConnections:
    """See the module; called for each connection.

    Args:
        server: Makes what serves a connection.
        refuse: Called with whom was not let in, and why.
    """

    def __init__(self, server: Server, refuse: Callable[[str, str], None]) -> None:
        self._server = server
        self._refuse = refuse
        self._loop = asyncio.get_running_loop()
        self._pending: dict[RequestHandler, asyncio.TimerHandle] = {}

    def __call__(self) -> asyncio.BaseProtocol:
        """Somebody has connected."""
        if len(self._server.connections) >= MOST:
            self._refuse("?", "there are too many connections")
            return RefusedConnection()

        handler = self._server()
        self._pending[handler] = self._loop.call_later(HANDSHAKE, self._cut, handler, "it has not come in in time")
        if len(self._pending) > PENDING:
            self._make_room()

        return handler

    def let_in(self, handler: RequestHandler) -> None:
        """A connection has shown that it may come in."""
        timer = self._pending.pop(handler, None)
        if timer:
            timer.cancel()

    def close(self) -> None:
        """Forget all."""
        for timer in self._pending.values():
            timer.cancel()

        self._pending.clear()

    def _make_room(self) -> None:
        """Cut the oldest from the address that has most of them."""
        addresses = {handler: address_of(handler) for handler in self._pending}
        counted = Counter(each for each in addresses.values() if each)
        if not counted:
            return

        ((most, _),) = counted.most_common(1)
        oldest = next(handler for handler, address in addresses.items() if address == most)
        self._cut(oldest, "too many others want to come in")

    def _cut(self, handler: RequestHandler, why: str) -> None:
        timer = self._pending.pop(handler, None)
        if timer:
            timer.cancel()

        transport = handler.transport
        if transport is not None:  # else it has gone, or TLS is not agreed upon, which has a limit of its own
            self._refuse(address_of(handler), why)
            handler.force_close()
            transport.abort()


def address_of(handler: RequestHandler) -> str:
    """Return from where it comes."""
    peer = handler.transport.get_extra_info("peername") if handler.transport else None
    return str(peer[0]) if peer else ""
