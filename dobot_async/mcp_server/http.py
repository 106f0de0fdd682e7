"""Clients by streamable HTTP, at `/mcp`.

    request --> Host, Origin, token --> MCP --> tool ...
                                         `-- the connection ends: the tools that it waits for are ended

A client that only closes its connection cancels nothing in earlier versions of the protocol. Here it does: nobody would
hear how the motion ended. A computer that is gone without a word is found out within 9 s, as on every connection.
"""

from __future__ import annotations

import asyncio
import logging
import socket
from collections.abc import AsyncGenerator, Collection, Generator
from contextlib import asynccontextmanager, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import uvicorn
from mcp.server.transport_security import TransportSecuritySettings
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from dobot_async._core.util.hosts import HostAndPort, is_for_us, is_loopback
from dobot_async._core.util.tasks import cancel_and_join, run_shielded
from dobot_async.bridge.handshake import Authenticator
from dobot_async.errors import ConnectFailed
from dobot_async.mcp_server.deadline import PunctualHTTP
from dobot_async.mcp_server.server import ArmServer
from dobot_async.mcp_server.tools import GONE
from dobot_async.transports.keep_alive import keep_alive

__all__ = ["serve_http"]

logger: logging.Logger = logging.getLogger("dobot_async.mcp")
PATH = "/mcp"
LARGEST = 1 << 20  # bytes of a request
BACKLOG, SESSIONS = 64, 16
IDLE = 600.0  # seconds until a session that asks nothing is forgotten
TEARDOWN = 1  # seconds for which open connections are waited for at the end
AHEAD = 4  # messages of a request that are taken before they are wanted


@dataclass(frozen=True, slots=True)
class AccessCheck:
    """Who comes in.

    Attributes:
        app: What is behind it.
        authenticator: Knows the token, and the web pages that may come.
        names: What this server is called besides its addresses.
    """

    app: ASGIApp
    authenticator: Authenticator
    names: Collection[str]

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Take a request."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return

        refused = self._refused(scope["headers"])
        if refused:
            await answer(send, *refused)
            return

        await HttpRequest(self.app).serve(scope, receive, send)

    def _refused(self, headers: list[tuple[bytes, bytes]]) -> tuple[int, str] | None:
        """The status and the reason for a request that is not let in."""

        def given(name: bytes) -> list[str]:
            return [value.decode("latin-1").strip() for each, value in headers if each == name]

        hosts, origins, tokens = given(b"host"), given(b"origin"), given(b"authorization")
        if len(hosts) != 1 or not is_for_us(hosts[0], self.names):
            return 421, "this is no name of this server"

        if not self.authenticator.origins.issuperset(origins):
            return 403, "this web page may not come in"

        kind, _, token = (tokens[0] if len(tokens) == 1 else "").partition(" ")
        bearer = kind.lower() == "bearer" and self.authenticator.knows(token.encode("latin-1", "replace"))
        return None if bearer or self.authenticator.token is None else (401, "a wrong token, or none")


async def answer(send: Send, status: int, reason: str) -> None:
    """Refuse a request."""
    headers = [(b"content-type", b"text/plain; charset=utf-8"), (b"connection", b"close")]
    if status == 401:
        headers.append((b"www-authenticate", b"Bearer"))

    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": f"{reason}\n".encode()})


class HttpRequest:
    """One request, of which it is noticed at once when its client is gone.

    Args:
        app: What answers it.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app
        self._gone = asyncio.Event()
        self._taken: asyncio.Queue[Message] = asyncio.Queue(AHEAD)

    async def serve(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Have it answered."""
        scope[GONE] = self._gone
        taking = asyncio.create_task(self._take(receive), name="dobot_async mcp request")
        try:
            await self._app(scope, self._next, send)
        finally:
            await cancel_and_join(taking)

    async def _take(self, receive: Receive) -> None:
        while not self._gone.is_set():
            message = await receive()
            if message["type"] == "http.disconnect":
                self._gone.set()

            await self._taken.put(message)

    async def _next(self) -> Message:
        if self._gone.is_set() and self._taken.empty():
            return {"type": "http.disconnect"}

        return await self._taken.get()


class Server(uvicorn.Server):
    """A server that leaves the signals to the program."""

    @contextmanager
    def capture_signals(self) -> Generator[None]:
        """Capture none."""
        yield


@asynccontextmanager
async def serve_http(
    server: ArmServer,
    place: HostAndPort,
    *,
    token: str | None = None,
    names: Collection[str] = (),
    origins: Collection[str] = (),
    certificate: str | Path | None = None,
    key: str | Path | None = None,
) -> AsyncGenerator[str]:
    """Serve clients by streamable HTTP for the length of a block; yields the URL.

    Args:
        server: Of `make_server`; used for this once.
        place: Where to listen, such as ("127.0.0.1", 8765); port 0 takes a free one.
        token: What clients present as `Authorization: Bearer`; needed on any address but this computer's own.
        names: What this server is called besides its addresses, for the `Host` of requests.
        origins: Web pages, as `https://host`, that may come in.
        certificate: PEM file with the certificate for TLS.
        key: PEM file with its key, if that is not in the same file.

    Raises:
        ValueError: A token is needed; or there is a key without a certificate.
        ConnectFailed: It cannot listen there.
    """
    host, port = place
    if token is None and not is_loopback(host):
        raise ValueError(f"at {host} a token is needed: others than this computer's programs reach it")

    if key and not certificate:
        raise ValueError("a key needs its certificate")

    guard = AccessCheck(app_of(server), Authenticator(token, frozenset(origins), begins=ignored, refuse=ignored), names)
    listening = listen(host, port)
    running, before = Server(config_of(guard, certificate, key)), watchers()
    serving = asyncio.create_task(running.serve([listening]), name="dobot_async mcp http")
    try:
        await started(running, serving)
        named = f"[{host}]" if ":" in host else host
        yield f"{'https' if certificate else 'http'}://{named}:{listening.getsockname()[1]}{PATH}"
    finally:
        server.works.close()
        await run_shielded(ended(running, serving, listening, before))


def ignored(*_: object) -> None:
    """Do nothing: HTTP is told apart, and refused, by the guard."""


def app_of(server: ArmServer) -> ASGIApp:
    """What answers those who were let in: who that is was looked at before."""
    return server.streamable_http_app(
        streamable_http_path=PATH,
        max_request_body_size=LARGEST,
        session_idle_timeout=IDLE,
        max_sessions=SESSIONS,
        transport_security=TransportSecuritySettings(enable_dns_rebinding_protection=False),
    )


def config_of(app: ASGIApp, certificate: str | Path | None, key: str | Path | None) -> uvicorn.Config:
    """How it is served."""
    tls: dict[str, Any] = {"ssl_certfile": certificate, "ssl_keyfile": key} if certificate else {}
    return uvicorn.Config(
        app,
        http=PunctualHTTP,
        ws="none",
        lifespan="on",
        log_config=None,
        access_log=False,
        server_header=False,
        timeout_graceful_shutdown=TEARDOWN,
        **tls,
    )


def listen(host: str, port: int) -> socket.socket:
    """A listening socket whose connections find out when their other end is gone."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listening = socket.socket(family, socket.SOCK_STREAM)
    try:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        keep_alive(listening)  # what is accepted inherits it
        listening.bind((host, port))
        listening.listen(BACKLOG)
        listening.setblocking(False)
    except OSError as error:
        listening.close()
        raise ConnectFailed(f"cannot listen at {host}:{port}: {error.strerror or error}") from error

    return listening


async def started(running: Server, serving: asyncio.Task[None]) -> None:
    """Return when clients may come; raise what went wrong if they cannot."""
    while not running.started:
        await asyncio.wait([serving], timeout=0.01)
        if serving.done():
            serving.result()
            raise ConnectFailed("the HTTP server has not started")


def watchers() -> set[asyncio.Task[Any]]:
    """The tasks of sse_starlette that wait for the end of a server, one a loop; nothing else ends them."""
    name = "_shutdown_watcher"
    return {task for task in asyncio.all_tasks() if getattr(task.get_coro(), "__qualname__", "") == name}


async def ended(
    running: Server, serving: asyncio.Task[None], listening: socket.socket, before: set[asyncio.Task[Any]]
) -> None:
    """End it: open connections have a second."""
    running.should_exit = True
    left = set(running.server_state.tasks)
    with suppress(OSError):
        await serving

    listening.close()
    for task in left | (watchers() - before):
        await cancel_and_join(task)
