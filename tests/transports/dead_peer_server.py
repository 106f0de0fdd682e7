"""A program of its own, in a network of its own: echoes on TCP, TLS, WebSocket and both, and tells of who vanishes.

    dead_peer_server.py ADDRESS CERTIFICATE   prints its URLs, then a line for each client that has gone

Its WebSockets send no pings, so that only the client's own means count.
"""

# ruff: noqa: T201 - what it prints is what it is for

from __future__ import annotations

import asyncio
import ssl
import sys
import time
from collections.abc import Callable
from contextlib import AsyncExitStack, suppress
from typing import Any

from websockets.asyncio.server import serve
from websockets.exceptions import ConnectionClosed

from dobot_async.endpoints.listeners import on_tcp


class Echo:
    """A host of `listeners`: a client is what sends to it."""

    def client(self, deliver: Callable[[bytes], None], disconnect: Callable[[], None], **_: Any) -> Any:
        """Somebody has come."""
        return type("Client", (), {"send": staticmethod(deliver)})()

    def leave(self, client: Any) -> None:
        """Somebody has gone."""
        print(time.monotonic(), flush=True)


async def main() -> None:
    """Serves until it is killed."""
    address, certificate = sys.argv[1:]
    tls = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
    tls.load_cert_chain(certificate)
    async with AsyncExitStack() as stack:
        plain = await on_tcp(Echo(), stack, address=address, port=0)
        secure = await on_tcp(Echo(), stack, address=address, port=0, tls=tls)
        urls = [plain, secure.replace("tcp", "tls")]
        for scheme, context in (("ws", None), ("wss", tls)):
            server = await stack.enter_async_context(serve(echo, address, 0, ssl=context, ping_interval=None))
            urls.append(f"{scheme}://{address}:{next(iter(server.sockets)).getsockname()[1]}")

        print(*urls, flush=True)
        await asyncio.Event().wait()


async def echo(connection: Any) -> None:
    """Sends back what comes."""
    with suppress(ConnectionClosed):
        async for message in connection:
            await connection.send(message)


asyncio.run(main())
