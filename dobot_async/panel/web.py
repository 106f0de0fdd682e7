"""The HTTP side: who may come in, the page's files, the WebSocket, uploads and downloads.

    connection --PendingConnections--> request --Access--> Role --> file, socket, upload, download

What is refused is a short text, or JSON where the page asked; nothing that was received is in it.
"""

from __future__ import annotations

import asyncio
import logging
import ssl
from collections.abc import Awaitable, Callable
from pathlib import Path

from aiohttp import WSMsgType, web

from dobot_async._core.util.tasks import cancel_and_join, run_shielded
from dobot_async._core.util.text import printable
from dobot_async.bridge.limits import Allowance
from dobot_async.metrics import CONTENT_TYPE
from dobot_async.panel.access import HEADERS, Access, AccessDenied, Role
from dobot_async.panel.answers import as_json, plain, safe, served
from dobot_async.panel.drawings import MODES
from dobot_async.panel.metrics import panel_metrics
from dobot_async.panel.pending_connections import PendingConnections
from dobot_async.panel.problems import PanelRefusal, told
from dobot_async.panel.session import PageSession
from dobot_async.panel.state import PanelState
from dobot_async.panel.static_files import StaticFiles

__all__ = ["Web"]

logger: logging.Logger = logging.getLogger("dobot_async.panel")
STATIC = Path(__file__).parent / "static"
METRICS = "/metrics"
LARGEST_MESSAGE = 4096  # bytes, in characters of a page
LARGEST_FILE = 4 * 2**20
LARGEST_RECORDING = 2**20
UPLOAD_WITHIN = 30.0  # seconds
UPLOADS, UPLOAD_BURST = 10 / 60, 10.0  # a second, and at once
PINGS = 10 / 3  # seconds; one that is not answered half of that later ends the connection
TOLD, TOLD_BURST = 0.5, 40.0  # lines of the log that any peer can cause, a second and at once
STATUS = {"rate": 429, "busy": 429, "role": 403, "lease": 403, "link": 503}
WELCOME = (
    '<!doctype html><meta charset="utf-8"><meta http-equiv="refresh" content="0;url=/">'
    '<link rel="icon" href="data:,"><title>Panel</title>'
)
NOT_IN = (
    "This panel wants to know you: open the address that was shown where it was started, with its token, or the QR "
    "code."
)
Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


class Web:
    """See the module.

    Args:
        state: What is behind it.
        access: Who may come in.
    """

    def __init__(self, state: PanelState, access: Access) -> None:
        self._state = state
        self._access = access
        self._pages = StaticFiles(STATIC)
        now = asyncio.get_running_loop().time
        self._uploads = Allowance(UPLOADS, now, most=UPLOAD_BURST)
        self._lines = Allowance(TOLD, now, most=TOLD_BURST)
        self._left_out = 0
        self._keeper: PendingConnections | None = None
        self._app = web.Application(middlewares=[self._guard], client_max_size=LARGEST_FILE)
        self._app.add_routes(
            [
                web.get("/", self._index),
                web.get("/static/{name:.+}", self._static),
                web.get("/ws", self._socket),
                web.post("/files", self._upload),
                web.get("/recordings/{name}", self._download),
                web.get(METRICS, self._metrics),
                web.post("/recordings/{name}", self._load),
            ]
        )
        self._runner = web.AppRunner(
            self._app,
            access_log=None,  # a token is in the first URL
            keepalive_timeout=15.0,
            shutdown_timeout=1.0,
            max_headers=64,
            lingering_time=0.0,
        )

    async def start(self, tls: ssl.SSLContext | None = None) -> Callable[[], asyncio.BaseProtocol]:
        """Get ready; return what makes the protocol of each connection, which agrees upon TLS itself."""
        await self._runner.setup()
        server = self._runner.server
        assert server
        self._keeper = PendingConnections(server, self._turned_away, tls)
        return self._keeper

    async def aclose(self) -> None:
        """End all connections."""
        if self._keeper:
            await self._keeper.aclose()

        await self._runner.cleanup()

    @web.middleware
    async def _guard(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        """Let in who may; say everywhere what a browser is to allow."""
        try:
            response = await self._let_in(request, handler)
        except web.HTTPException as error:
            response = plain(error.status, f"{error.reason}\n")
        except AccessDenied as error:
            self._turned_away(request.remote or "?", str(error))
            response = plain(error.status, f"{error.words}\n")
            response.force_close()
        except (PanelRefusal, ValueError, ImportError) as error:
            what = told(error)
            response = as_json({"error": what}, STATUS.get(what["kind"], 400))

        if not response.prepared:
            response.headers.update(HEADERS)
            response.headers.setdefault("Cache-Control", "no-store")

        return response

    async def _let_in(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        headers, access = request.headers, self._access
        opens, navigates = request.path == "/ws", request.path == "/" and request.method == "GET"
        if len(headers.getall("Host", [])) != 1 or len(headers.getall("Origin", [])) > 1:
            raise AccessDenied(400, "one Host, and one Origin")

        access.check(
            headers["Host"],
            headers.get("Origin"),
            headers.get("Sec-Fetch-Site"),
            changes=opens or request.method not in {"GET", "HEAD"},
            navigates=navigates,
        )
        if navigates and "token" in request.query:
            return self._welcome(request.query["token"], request)

        self._role(request)
        self._known(request)
        return await handler(request)

    def _role(self, request: web.Request) -> Role:
        """Return what who asks may do; raise AccessDenied for who is not known."""
        role = self._access.role_of_cookie(request.cookies.get(self._access.cookie_name, ""))
        if role is None and request.path == METRICS:  # Prometheus has no cookies
            role = self._access.role_of_token(request.headers.get("Authorization", "").removeprefix("Bearer "))

        if role is None:
            raise AccessDenied(401, "it has no cookie", NOT_IN)

        return role

    def _check_operator(self, request: web.Request) -> None:
        """Raise Refusal for viewers."""
        if self._role(request) is not Role.OPERATOR:
            raise PanelRefusal("role", "viewers look on, and stop")

    def _welcome(self, token: str, request: web.Request) -> web.Response:
        """Give who has a token its cookie; the page comes by a request of its own, for which that counts."""
        role = self._access.role_of_token(token)
        if role is None:
            raise AccessDenied(401, "a wrong token")

        self._known(request)
        response = web.Response(text=WELCOME, content_type="text/html")
        response.headers["Set-Cookie"] = self._access.cookie(role)
        return response

    def _known(self, request: web.Request) -> None:
        if self._keeper and request.protocol:
            self._keeper.let_in(request.protocol)

    async def _index(self, request: web.Request) -> web.Response:
        return served(self._pages.get("index.html"), request)

    async def _static(self, request: web.Request) -> web.Response:
        return served(self._pages.get(request.match_info["name"]), request)

    async def _metrics(self, _request: web.Request) -> web.Response:
        """Give out the figures of the arms; needs the extra `metrics`."""
        text = await panel_metrics(self._state)
        return web.Response(body=text, headers={"Content-Type": CONTENT_TYPE})

    async def _socket(self, request: web.Request) -> web.StreamResponse:
        """Serve a page until it goes, or does not answer any more."""
        session = self._state.join(self._role(request), request.remote or "?")
        socket = web.WebSocketResponse(heartbeat=PINGS, max_msg_size=LARGEST_MESSAGE, compress=False, timeout=1.0)
        socket.headers.update(HEADERS)
        pumping: asyncio.Task[None] | None = None
        try:
            await socket.prepare(request)
            pumping = asyncio.create_task(pump(session, socket), name=f"dobot_async panel pump of {session.name}")
            async for message in socket:
                if message.type is not WSMsgType.TEXT:
                    break

                session.receive(message.data)
        finally:
            await run_shielded(self._left(session, pumping))

        return socket

    async def _left(self, session: PageSession, pumping: asyncio.Task[None] | None) -> None:
        """End all that a page has going on."""
        await session.aclose()
        if pumping:
            await cancel_and_join(pumping)

    async def _upload(self, request: web.Request) -> web.Response:
        """Take a file to be drawn."""
        self._check_operator(request)
        self._state.station(request.query.get("arm"))
        name, mode = printable(request.query.get("name", ""), 100), request.query.get("mode", "outline")
        if mode not in MODES:
            raise ValueError(f"mode must be one of {', '.join(MODES)}")

        data = await self._body(request, LARGEST_FILE)
        return as_json(await self._state.drawings.add(data, name, mode))

    async def _load(self, request: web.Request) -> web.Response:
        """Take a recording, which the page loads by `teach_load`."""
        self._check_operator(request)
        station = self._state.station(request.match_info["name"])
        data = await self._body(request, LARGEST_RECORDING)
        return as_json(await station.taught.add(data, printable(request.query.get("name", ""), 100)))

    async def _download(self, request: web.Request) -> web.Response:
        """Give out a recording."""
        name, _, suffix = request.match_info["name"].rpartition(".")
        if suffix not in {"json", "playback"}:
            raise web.HTTPNotFound

        station = self._state.station(name)
        text = station.taught.text(suffix)
        headers = {"Content-Disposition": f'attachment; filename="{safe(name)}.{suffix}"'}
        return web.Response(body=text.encode(), content_type="application/octet-stream", headers=headers)

    async def _body(self, request: web.Request, largest: int) -> bytes:
        """Return what was uploaded; not too much of it, not too often, and not too slowly."""
        self._uploads.spend(1)
        if self._uploads.wait:
            raise PanelRefusal("rate", "too many files: wait for a few seconds")

        if (request.content_length or 0) > largest:
            raise Oversize(largest)

        data = bytearray()
        try:
            async with asyncio.timeout(UPLOAD_WITHIN):
                async for chunk in request.content.iter_chunked(65536):
                    data += chunk
                    if len(data) > largest:
                        raise Oversize(largest)
        except TimeoutError:
            raise PanelRefusal("timeout", "the file comes too slowly") from None

        return bytes(data)

    def _turned_away(self, who: str, why: str) -> None:
        """Take note that somebody was not let in; of what any peer can cause, a limited number."""
        if self._lines.wait:
            self._left_out += 1
            return

        self._lines.spend(1)
        more = f" (and {self._left_out} more that are not told one by one)" if self._left_out else ""
        self._left_out = 0
        logger.info("%s: turned away: %s%s", printable(who), printable(why), more)


class Oversize(AccessDenied):
    """Too many bytes."""

    def __init__(self, largest: int) -> None:
        super().__init__(413, f"a file has {largest // 1024} kB at most")


async def pump(session: PageSession, socket: web.WebSocketResponse) -> None:
    """Send what waits for a page; end its connection when nothing more will come."""
    try:
        while (text := await session.outlet.get()) is not None:
            await socket.send_str(text)
    except ConnectionError:
        return

    await socket.close(code=1001, message=b"the panel leaves this page")
