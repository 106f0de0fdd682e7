"""Connections that have not shown yet that they may come in: a few, for a few seconds, as at the ports of a bridge.

    accepted --> connection --TLS, if there is any--> a request with a right token or cookie --> in
                    `-- too late, too many: cut

1. Pending connections are `PENDING`, TLS that is not agreed upon among them; those that have gone do not count. One
   more takes the place of the oldest from the address that has most of them.
2. Each has `HANDSHAKE` seconds for all of that, however it sends.
3. All connections together are `MOST`.
"""

from __future__ import annotations

import asyncio
import ssl
from collections import Counter
from collections.abc import Callable
from typing import cast

from aiohttp.web import Server
from aiohttp.web_protocol import RequestHandler

from dobot_async._core.util.tasks import cancel_and_join
from dobot_async.bridge.handshake import HANDSHAKE, PENDING

__all__ = ["PendingConnections"]

MOST = 128
Handshake = asyncio.Task[asyncio.Transport | None]


class PendingConnections:
    """See the module; called for each connection.

    Args:
        server: Makes what serves a connection.
        refuse: Called with whom was not let in, and why.
        tls: What TLS needs, None for none.
    """

    def __init__(self, server: Server, refuse: Callable[[str, str], None], tls: ssl.SSLContext | None = None) -> None:
        self.server = server
        self.tls = tls
        self._refuse = refuse
        self._pending: dict[PanelConnection, asyncio.TimerHandle] = {}
        self._handshakes: set[Handshake] = set()
        self._closed = False

    def __call__(self) -> asyncio.BaseProtocol:
        """Somebody has connected."""
        return PanelConnection(self)

    def let_in(self, handler: RequestHandler) -> None:
        """A connection has shown that it may come in."""
        connection = next((each for each in self._pending if each.handler is handler), None)
        if connection:
            self.forget(connection)
            connection.leave_to_handler()

    async def aclose(self) -> None:
        """Take no more, and end those that have not agreed upon TLS; who serves ends the others."""
        self._closed = True
        for connection in list(self._pending):
            self.forget(connection)

        for handshake in list(self._handshakes):
            await cancel_and_join(handshake)

    def connected(self, connection: PanelConnection) -> bool:
        """Take note of a connection; return whether it may stay for now."""
        if self._closed or len(self.server.connections) >= MOST:
            self._refuse(connection.address, "there are too many connections")
            return False

        later = asyncio.get_running_loop().call_later
        self._pending[connection] = later(HANDSHAKE, self._cut, connection, "it has not come in in time")
        if len(self._pending) > PENDING:
            ((most, _),) = Counter(each.address for each in self._pending).most_common(1)
            oldest = next(each for each in self._pending if each.address == most)
            self._cut(oldest, "too many others want to come in")

        return True

    def agree(self, connection: PanelConnection, transport: asyncio.Transport) -> Handshake:
        """Begin with TLS."""
        assert self.tls
        agree = asyncio.get_running_loop().start_tls(
            transport, connection, self.tls, server_side=True, ssl_handshake_timeout=HANDSHAKE
        )
        handshake = asyncio.create_task(agree, name="dobot_async panel TLS")
        self._handshakes.add(handshake)
        handshake.add_done_callback(self._handshakes.discard)
        handshake.add_done_callback(connection.agreed)
        return handshake

    def forget(self, connection: PanelConnection) -> None:
        """A connection is not pending any more."""
        timer = self._pending.pop(connection, None)
        if timer:
            timer.cancel()

    def _cut(self, connection: PanelConnection, why: str) -> None:
        self.forget(connection)
        self._refuse(connection.address, why)
        connection.cut()


class PanelConnection(asyncio.Protocol):
    """One connection until it is let in; what it sends is passed on to what serves it, once TLS is agreed upon.

    Attributes:
        address: From where it comes.
        handler: What serves it, None until TLS is agreed upon.
    """

    def __init__(self, pending: PendingConnections) -> None:
        self.address: str = "?"
        self.handler: RequestHandler | None = None
        self._pending = pending
        self._early = bytearray()
        self._transport: asyncio.Transport | None = None
        self._handshake: Handshake | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """It begins."""
        self._transport = cast("asyncio.Transport", transport)
        self.address = str((transport.get_extra_info("peername") or ("?",))[0])
        if not self._pending.connected(self):
            self.cut()
        elif self._transport.is_closing():
            return  # it was the one that was cut
        elif self._pending.tls:
            self._handshake = self._pending.agree(self, self._transport)
        else:
            self._serve(self._transport)

    def agreed(self, handshake: Handshake) -> None:
        """TLS is agreed upon, or not."""
        self._handshake = None
        transport = None if handshake.cancelled() or handshake.exception() else handshake.result()
        if transport is None or self._transport is None:
            self._pending.forget(self)
            self.cut()
        else:
            self._serve(transport)

    def data_received(self, data: bytes) -> None:
        """It has sent something, perhaps before the transports are exchanged."""
        if self.handler:
            self.handler.data_received(data)
        else:
            self._early += data

    def eof_received(self) -> None:
        """It sends no more, which ends it."""
        if self.handler:
            self.handler.eof_received()

    def pause_writing(self) -> None:
        """It does not read."""
        if self.handler:
            self.handler.pause_writing()

    def resume_writing(self) -> None:
        """It reads again."""
        if self.handler:
            self.handler.resume_writing()

    def connection_lost(self, exc: Exception | None) -> None:
        """It has gone."""
        self._pending.forget(self)
        self._transport = None
        if self.handler:
            self.handler.connection_lost(exc)

    def leave_to_handler(self) -> None:
        """From now on nothing stands between it and what serves it."""
        if self._transport and self.handler:
            self._transport.set_protocol(self.handler)

    def cut(self) -> None:
        """End it at once; TLS that has not begun yet would begin with what has been ended."""
        if self._handshake:
            self._handshake.cancel()

        if self.handler:
            self.handler.force_close()

        if self._transport:
            self._transport.abort()

    def _serve(self, transport: asyncio.Transport) -> None:
        self._transport, self.handler = transport, self._pending.server()
        self.handler.connection_made(transport)
        if self._early:
            self.handler.data_received(bytes(self._early))
            self._early.clear()
