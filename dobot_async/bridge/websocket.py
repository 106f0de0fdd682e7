"""The WebSocket door: bytes of the protocol in binary messages, cut anywhere."""

from __future__ import annotations

import asyncio
import ssl
from contextlib import AsyncExitStack, suppress
from http import HTTPStatus
from typing import Any
from urllib.parse import parse_qs, urlsplit

from dobot_async.bridge.doors import FIRST_LINE, LONGEST_LINE, STRANGERS, Guard
from dobot_async.transports.listen import Host, url_of
from dobot_async.transports.websocket import PING, PONG_WITHIN, quiet, websockets

__all__ = ["on_ws"]

BIGGEST_MESSAGE = 4096
OUTBOX = 256  # messages; a client that does not read so many does not live
BEARER, TOKEN = "Bearer ", "TOKEN "
ENDED = 1008  # "policy violation": the code for everything that is not the network's fault


async def on_ws(
    host: Host[Any], stack: AsyncExitStack, guard: Guard, *, address: str, port: int, tls: ssl.SSLContext | None
) -> str:
    """A WebSocket port; returns its URL."""
    door = Door(host, guard)
    server = await websockets("server").serve(
        door.serve,
        address,
        port,
        ssl=tls,
        process_request=door.look,
        compression=None,
        max_size=BIGGEST_MESSAGE,
        max_queue=4,
        ping_interval=PING,
        ping_timeout=PONG_WITHIN,
        open_timeout=FIRST_LINE,
        close_timeout=0.5,
        logger=quiet(),
        server_header=None,
    )
    stack.push_async_callback(server.wait_closed)
    stack.callback(server.close)
    return url_of("wss" if tls else "ws", next(iter(server.sockets)).getsockname())


class Door:
    """Lets WebSocket clients in."""

    def __init__(self, host: Host[Any], guard: Guard) -> None:
        self._host = host
        self._guard = guard
        self._strangers = 0

    def look(self, connection: Any, request: Any) -> Any:
        """Called with each request for a connection; returns a response to refuse it.

        A browser that presents no token must belong to a page that may come without, for it serves any page.
        """
        name = url_of("ws", connection.remote_address)
        given = presented(request)
        if given is not None and not self._guard.knows(given):
            self._guard.refuse(name, "a wrong token")
            return connection.respond(HTTPStatus.UNAUTHORIZED, "wrong token\n")

        connection.token_known = self._guard.token is None or given is not None
        origin = request.headers.get("Origin")
        if origin and self._guard.token is None and origin not in self._guard.origins:
            self._guard.refuse(name, f"a web page of {origin}")
            return connection.respond(HTTPStatus.FORBIDDEN, "this web page may not connect without a token\n")

        return None

    async def serve(self, connection: Any) -> None:
        """One client, from its first message to its end."""
        name = url_of("ws", connection.remote_address)
        closed = websockets("exceptions").ConnectionClosed
        with suppress(closed):
            if not (connection.token_known or await self._hear_token(connection)):
                self._guard.refuse(name, "a wrong token, or none in time")
                await connection.close(ENDED, "wrong token")
                return

            client = Guest(self._host, name)
            sending = asyncio.create_task(client.deliver_to(connection), name=f"dobot_async bridge to {name}")
            try:
                async for message in connection:
                    if isinstance(message, bytes):
                        client.peer.send(message)
                        await client.room.wait()
            finally:
                self._host.leave(client.peer)
                sending.cancel()
                await asyncio.wait([sending])

    async def _hear_token(self, connection: Any) -> bool:
        """Whether the first message is the token, in time."""
        if self._strangers == STRANGERS:
            return False

        self._strangers += 1
        try:
            async with asyncio.timeout(FIRST_LINE):
                first = await connection.recv()
        except TimeoutError:
            return False
        finally:
            self._strangers -= 1

        line = isinstance(first, str) and len(first) <= LONGEST_LINE and first.startswith(TOKEN)
        return line and self._guard.knows(first.removeprefix(TOKEN).strip())


class Guest:
    """A client that was let in.

    Attributes:
        peer: What the host keeps of it.
        room: Set while it may send.
    """

    def __init__(self, host: Host[Any], name: str) -> None:
        self.room = asyncio.Event()
        self.room.set()
        self._outbox: asyncio.Queue[bytes | None] = asyncio.Queue(OUTBOX)
        self.peer = host.client(self._deliver, self._hang_up, ordered=True, hold=self._hold, name=name)

    async def deliver_to(self, connection: Any) -> None:
        """Sends what the host has for it, until the host hangs up or it does."""
        with suppress(websockets("exceptions").ConnectionClosed):
            while (data := await self._outbox.get()) is not None:
                await connection.send(data)

            await connection.close(ENDED, "the bridge has ended this connection")

    def _deliver(self, data: bytes) -> None:
        try:
            self._outbox.put_nowait(data)
        except asyncio.QueueFull:
            self._hang_up()

    def _hang_up(self) -> None:
        """What it has not read is lost with it."""
        self.room.set()
        while not self._outbox.empty():
            self._outbox.get_nowait()

        self._outbox.put_nowait(None)

    def _hold(self, held: bool) -> None:
        if held:
            self.room.clear()
        else:
            self.room.set()


def presented(request: Any) -> str | None:
    """The token in the headers, or the URL, of a request."""
    header: str = request.headers.get("Authorization", "")
    if header.startswith(BEARER):
        return header.removeprefix(BEARER).strip()

    tokens = parse_qs(urlsplit(request.path).query).get("token", [])
    return tokens[0] if tokens else None
