"""WebSocket, to a bridge: bytes of the protocol in binary messages, cut anywhere. Needs the `bridge` extra."""

from __future__ import annotations

import asyncio
import logging
from types import ModuleType
from typing import Any
from urllib.parse import SplitResult

import anyio

from dobot_async._core.protocol.transport import MANY, Transport
from dobot_async.errors import ConnectFailed
from dobot_async.transports.keep_alive import keep_alive
from dobot_async.transports.network import CA, TOKENS, WINDOW, token_of, trust
from dobot_async.transports.options import options

__all__ = ["WebSocketTransport", "open_url", "quiet", "websockets"]

PING, PONG_WITHIN = (
    2.0,
    6.0,
)  # seconds; so a computer that is gone is noticed where the system does not notice it earlier
CLOSE = 0.5
OPTIONS = {"ws": TOKENS, "wss": {**TOKENS, "ca": CA}}
UNAUTHORIZED = 401


async def open_url(url: SplitResult, *, arm: str) -> Transport:  # noqa: ARG001 - for `sim:`
    """Open `ws://host:port` or `wss://host:port`; both take `?token=` or `?token_file=`, wss `?ca=` as tcp."""
    given = options(url, OPTIONS[url.scheme])
    token = token_of(given)
    if not url.hostname or url.port == 0 or url.path.strip("/") or "@" in url.netloc:
        raise ValueError(f"expected {url.scheme}://host:port, and ?token= for a token")

    client = websockets("client")
    place = f"{url.scheme}://{url.netloc}"
    try:
        socket = await client.connect(
            place,
            additional_headers={"Authorization": f"Bearer {token}"} if token else {},
            ssl=trust(given.get("ca")) if url.scheme == "wss" else None,
            compression=None,
            ping_interval=PING,
            ping_timeout=PONG_WITHIN,
            close_timeout=CLOSE,
            proxy=None,
            logger=quiet(),
        )
    except OSError as error:
        raise ConnectFailed(f"cannot reach {place}: {error}; is the address right, and does a bridge run?") from error
    except websockets("exceptions").InvalidHandshake as error:
        response = getattr(error, "response", None)
        wrong = "its token is another one" if getattr(response, "status_code", 0) == UNAUTHORIZED else str(error)
        raise ConnectFailed(f"{place} does not let this client in: {wrong}") from error

    keep_alive(socket.transport.get_extra_info("socket"))
    return WebSocketTransport(socket, websockets("exceptions").ConnectionClosed)


def websockets(module: str) -> ModuleType:
    """Return a module of the websockets library; raise ConnectFailed where it is not installed."""
    try:
        from websockets import exceptions, frames, server  # noqa: PLC0415 - only who uses WebSocket needs it
        from websockets.asyncio import client  # noqa: PLC0415
    except ImportError:
        raise ConnectFailed("ws:// needs the package websockets: pip install 'dobot-async[bridge]'") from None

    return {"client": client, "server": server, "exceptions": exceptions, "frames": frames}[module]


def quiet() -> logging.Logger:
    """Return a logger that says nothing: the library would write the token down."""
    logger = logging.getLogger("dobot_async.websockets")
    logger.disabled = True
    return logger


class WebSocketTransport:
    """An open WebSocket."""

    in_flight = MANY
    window = WINDOW
    reorder_window: float = 0.0

    def __init__(self, socket: Any, closed: type[Exception]) -> None:
        self._socket = socket
        self._closed = closed
        self._closing = False

    async def send(self, data: bytes) -> None:
        """Send one binary message; cancelled, it is sent whole or not at all."""
        if self._closing:
            raise anyio.ClosedResourceError

        try:
            await self._socket.send(data)
        except self._closed as error:
            raise self._over() from why(error)

        if self._closing:
            raise anyio.ClosedResourceError

    async def receive(self) -> bytes:
        """Return the next binary message; text is for people, and left out."""
        while True:
            if self._closing:
                raise anyio.ClosedResourceError

            try:
                message = await self._socket.recv()
            except self._closed as error:
                raise self._over() from why(error)

            if isinstance(message, bytes) and message:
                return message

    def _over(self) -> Exception:
        """Return what is raised when the library says that it is closed."""
        return anyio.ClosedResourceError() if self._closing else anyio.BrokenResourceError()

    async def aclose(self) -> None:
        """Close it, within a second."""
        self._closing = True
        try:
            async with asyncio.timeout(CLOSE):
                await self._socket.close()
        except TimeoutError:
            self._socket.transport.abort()
        except BaseException:
            self._socket.transport.abort()
            raise

        await self._socket.wait_closed()


def why(closed: Exception) -> Exception:
    """Return why a WebSocket is closed: what the system says, if it has ended it, else what the library says."""
    return closed.__cause__ if isinstance(closed.__cause__, OSError) else closed
