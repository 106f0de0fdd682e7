"""`GET /metrics` and nothing else, at a port of its own.

    connected --request--> Host? token? --> the figures, at most once a second --> closed

A connection has 5 s and 8 kB for its request, and there are 16 at a time: one more takes the place of the oldest. On
any address but this computer's own a token is needed (`Authorization: Bearer`), as at a bridge.
"""

from __future__ import annotations

import asyncio
import hmac
from collections.abc import AsyncGenerator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress
from email.parser import BytesParser
from http import HTTPStatus

from dobot_async._core.util.hosts import HostAndPort, is_for_us, is_loopback
from dobot_async._core.util.tasks import cancel_and_join
from dobot_async.errors import ConnectFailed
from dobot_async.metrics.text import CONTENT_TYPE

__all__ = ["serve_metrics"]

PATIENCE = 5.0
LONGEST = 8192
AT_ONCE = 16
FRESH = 1.0
"""Seconds for which figures are given again: who asks more often does not load the line to the arm."""


class MetricsPage:
    """The page, and those who ask for it."""

    def __init__(self, text: Callable[[], Awaitable[bytes]], token: str | None) -> None:
        self._text = text
        self._token = token
        self._asked: dict[asyncio.Task[None], asyncio.StreamWriter] = {}
        self._reading = asyncio.Lock()
        self._told: tuple[float, bytes] | None = None

    def connected(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Somebody has connected."""
        if len(self._asked) >= AT_ONCE:
            oldest = next(iter(self._asked))
            self._asked.pop(oldest).transport.abort()  # at once: in a flood the next ones need its file
            oldest.cancel()

        task = asyncio.create_task(self._serve(reader, writer), name="dobot_async metrics")
        self._asked[task] = writer
        task.add_done_callback(lambda task: self._asked.pop(task, None))

    async def aclose(self) -> None:
        """End all connections."""
        for task in list(self._asked):
            await cancel_and_join(task)

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            with suppress(TimeoutError, OSError, asyncio.IncompleteReadError, asyncio.LimitOverrunError):
                async with asyncio.timeout(PATIENCE):
                    request = await reader.readuntil(b"\r\n\r\n")

                status, body = await self._answer(request)
                writer.write(response(status, body))
                async with asyncio.timeout(PATIENCE):
                    await writer.drain()
        finally:
            writer.close()

    async def _answer(self, request: bytes) -> tuple[HTTPStatus, bytes]:
        line, _, rest = request.partition(b"\r\n")
        headers = BytesParser().parsebytes(rest, headersonly=True)
        hosts = headers.get_all("Host", [])
        if len(hosts) != 1 or not is_for_us(str(hosts[0]).strip()):
            return HTTPStatus.MISDIRECTED_REQUEST, b"this is no name of this server\n"

        given = str(headers.get("Authorization", "")).encode("latin-1", "replace")
        if self._token is not None and not hmac.compare_digest(given, b"Bearer " + self._token.encode()):
            return HTTPStatus.UNAUTHORIZED, b"a wrong token, or none\n"

        method, _, target = line.decode("latin-1").partition(" ")
        if target.split(" ")[0].partition("?")[0] != "/metrics":
            return HTTPStatus.NOT_FOUND, b"there is /metrics\n"

        if method != "GET":
            return HTTPStatus.METHOD_NOT_ALLOWED, b"GET it\n"

        return HTTPStatus.OK, await self._figures()

    async def _figures(self) -> bytes:
        now = asyncio.get_running_loop().time
        async with self._reading:
            if self._told is None or now() > self._told[0] + FRESH:
                text = await self._text()
                self._told = now(), text

            return self._told[1]


def response(status: HTTPStatus, body: bytes) -> bytes:
    """A whole answer."""
    kind = CONTENT_TYPE if status is HTTPStatus.OK else "text/plain; charset=utf-8"
    challenge = "WWW-Authenticate: Bearer\r\n" if status is HTTPStatus.UNAUTHORIZED else ""
    head = (
        f"HTTP/1.1 {status.value} {status.phrase}\r\nContent-Type: {kind}\r\nContent-Length: {len(body)}\r\n"
        f"{challenge}X-Content-Type-Options: nosniff\r\nConnection: close\r\n\r\n"
    )
    return head.encode() + body


@asynccontextmanager
async def serve_metrics(
    place: HostAndPort, text: Callable[[], Awaitable[bytes]], *, token: str | None = None
) -> AsyncGenerator[str]:
    """Serve `/metrics` for the length of a block; yields its URL.

    Args:
        place: Where to listen, such as ("127.0.0.1", 9464); port 0 takes a free one.
        text: Makes the page, of `metrics_text`.
        token: What has to be presented as `Authorization: Bearer`.

    Raises:
        ValueError: The address is not this computer's own, and there is no token.
        ConnectFailed: It cannot listen there.
    """
    host, port = place
    if token is None and not is_loopback(host):
        raise ValueError(f"metrics at {host} need a token: others than this computer's programs reach it")

    page = MetricsPage(text, token)
    try:
        server = await asyncio.start_server(page.connected, host, port, limit=LONGEST, backlog=AT_ONCE)
    except OSError as error:
        raise ConnectFailed(f"cannot serve metrics at {host}:{port}: {error.strerror or error}") from error

    try:
        named = f"[{host}]" if ":" in host else host
        yield f"http://{named}:{server.sockets[0].getsockname()[1]}/metrics"
    finally:
        server.close()
        await page.aclose()
        await server.wait_closed()
