"""TCP connections of clients, with or without TLS: made, watched by the system, and closed in bounded time."""

from __future__ import annotations

import asyncio
import socket
import ssl
from collections.abc import Callable, Coroutine, Iterable
from functools import partial
from typing import Any

from dobot_async._core.util.tasks import cancel_and_join
from dobot_async.transports.byte_stream import DRAIN, ByteStreamTransport
from dobot_async.transports.keep_alive import PeerWatch, keep_alive

__all__ = ["SocketTransport", "connect"]

NEXT_ADDRESS = 0.25  # seconds until the next address of a name is tried as well; RFC 8305
HANDSHAKE = 10.0


async def connect(host: str, port: int, tls: ssl.SSLContext | None) -> SocketTransport:
    """Open a TCP connection.

    Raises:
        OSError: There is none, or TLS failed.
    """
    found = await asyncio.get_running_loop().getaddrinfo(host, port, type=socket.SOCK_STREAM)
    secure = {"ssl": tls, "server_hostname": host, "ssl_handshake_timeout": HANDSHAKE} if tls else {}
    return await race(partial(dial, numeric(place), port, secure) for *_, place in found)


async def dial(address: str, port: int, secure: dict[str, Any]) -> SocketTransport:
    """Open a TCP connection to an address."""
    loop = asyncio.get_running_loop()
    connection: SocketTransport
    _, connection = await loop.create_connection(SocketTransport, address, port, **secure)
    if connection.met_itself:
        # Where nobody listens on this computer, the system may give the caller the very port that it calls.
        await connection.aclose()
        raise ConnectionRefusedError("nobody listens there, and the connection met itself")

    return connection


async def race(attempts: Iterable[Callable[[], Coroutine[Any, Any, SocketTransport]]]) -> SocketTransport:
    """Make attempts, each when the last one has failed or takes its time; return the first connection, end the rest.

    asyncio's own race (`happy_eyeballs_delay`) leaks sockets when it is cancelled.

    Raises:
        OSError: All of them failed; the first one's error.
    """
    tasks: list[asyncio.Task[SocketTransport]] = []
    winner: asyncio.Task[SocketTransport] | None = None
    coming = iter(attempts)
    try:
        while winner is None:
            attempt = next(coming, None)
            if attempt:
                tasks.append(asyncio.create_task(attempt()))

            running = [task for task in tasks if not task.done()]
            if not running:
                break

            await asyncio.wait(running, timeout=NEXT_ADDRESS if attempt else None, return_when=asyncio.FIRST_COMPLETED)
            winner = next((task for task in tasks if task.done() and not task.exception()), None)
    finally:
        for task in tasks:
            if task is not winner:
                await discarded(task)

    return (winner or tasks[0]).result()


async def discarded(task: asyncio.Task[SocketTransport]) -> None:
    """End an attempt that has lost, and the connection that it has made, if it has made one."""
    await cancel_and_join(task)
    if not task.cancelled() and not task.exception():
        await task.result().aclose()


class SocketTransport(ByteStreamTransport):
    """A TCP connection, with or without TLS."""

    @property
    def met_itself(self) -> bool:
        """Whether both ends are the same."""
        ends = {self._transport.get_extra_info(end) for end in ("sockname", "peername")}
        return len(ends) == 1

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Keep the connection, and have the system watch it."""
        super().connection_made(transport)
        connection = transport.get_extra_info("socket")
        keep_alive(connection)
        self._watch = PeerWatch(connection, self._silent)

    def connection_lost(self, exc: Exception | None) -> None:
        """Note that it is gone or closed; called once."""
        self._watch.stop()
        super().connection_lost(exc)

    def eof_received(self) -> None:
        """End it: the other side has, and what it will not read need not be sent."""
        self._loop.call_soon(self._abort)  # TLS is in the middle of it

    def _silent(self, error: TimeoutError) -> None:
        """End it: the other side is gone without a word."""
        self._cause = error
        self._abort()

    async def _drain(self) -> None:
        """Say goodbye, and wait for the output for a moment."""
        if not self._lost.done():
            self._transport.close()
            await asyncio.wait([self._lost], timeout=DRAIN)

    def _abort(self) -> None:
        """End the connection, if it has not ended."""
        if not self._lost.done():
            self._transport.abort()


def numeric(place: tuple[Any, ...]) -> str:
    """Return the address of a socket's place, with its network interface where it has one."""
    host, *_ = place
    scope = place[3] if len(place) == 4 else 0
    return f"{host}%{scope}" if scope else str(host)
