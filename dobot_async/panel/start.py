"""Starts a panel: access first, then the port, then the arms; ends it in the other order.

panel(arm | fleet | members) --> Sources --> PanelState (stations, sessions) --> Web --> port
"""

from __future__ import annotations

import asyncio
import secrets
import socket
from collections.abc import AsyncGenerator, Collection, Mapping
from contextlib import AsyncExitStack, asynccontextmanager
from functools import partial
from pathlib import Path
from typing import Any

from dobot_async import Arm, ConnectFailed, Fleet
from dobot_async._core.util.events import Events
from dobot_async._core.util.tasks import cancel_and_join, run_shielded
from dobot_async.bridge.listeners import served_with
from dobot_async.fleet.member import Member
from dobot_async.panel.access import Access, Role, is_loopback
from dobot_async.panel.lease import OperatorLease
from dobot_async.panel.scene import show_scene
from dobot_async.panel.sources import sources_of
from dobot_async.panel.state import PanelState
from dobot_async.simulator.scene import Scene

__all__ = ["Panel", "panel"]

Arms = Arm | Fleet[Any] | Mapping[str, Arm | Member[Any]]
Edge = float | None


class Panel:
    """A panel that runs; made by `panel`.

    Attributes:
        host: The address at which it listens.
        port: The port.
        secure: Whether it speaks TLS.
    """

    def __init__(self, state: PanelState, access: Access, host: str, port: int, *, secure: bool) -> None:
        self.host = host
        self.port = port
        self.secure = secure
        self._state = state
        self._access = access

    @property
    def url(self) -> str:
        """Where the page is, without a token."""
        return self.url_at(self.host)

    @property
    def operator_url(self) -> str:
        """What to open to move arms: it has the token of operators, and is a secret."""
        return self.with_token(self.url, Role.OPERATOR)

    @property
    def viewer_url(self) -> str:
        """What to open to look on: it has the token of viewers."""
        return self.with_token(self.url, Role.VIEWER)

    def url_at(self, host: str) -> str:
        """Return where the page is for who calls this computer by another address or name."""
        name = f"[{host}]" if ":" in host else host
        return f"{'https' if self.secure else 'http'}://{name}:{self.port}/"

    def with_token(self, url: str, role: Role) -> str:
        """Return a URL that lets its reader in."""
        return f"{url}?token={self._access.operator if role is Role.OPERATOR else self._access.viewer}"

    @property
    def events(self) -> Events[Mapping[str, Any]]:
        """What happens, in lines: each with `time` (of the clock on the wall), `text` and `level`."""
        return self._state.hub.lines

    @property
    def pages(self) -> int:
        """How many pages are connected."""
        return len(self._state.sessions)

    def holder(self, name: str | None = None) -> str | None:
        """Return who moves an arm, None while nobody does.

        Args:
            name: Of the arm; need not be given if there is one alone.

        Raises:
            KeyError: There is no such arm.
        """
        holder = self._lease(name).holder
        return holder.name if holder else None

    @asynccontextmanager
    async def reserved(self, name: str | None = None, *, takeover: bool = False) -> AsyncGenerator[None, None]:
        """Keep an arm for the program for the length of a block: no page moves it, and all see that.

        Every page can still stop it.

        Args:
            name: Of the arm; need not be given if there is one alone.
            takeover: Take it from the page that has it, whose motion is stopped first; else wait until it is given
                back.

        Raises:
            KeyError: There is no such arm.
        """
        lease, program = self._lease(name), Program()
        while lease.holder is not None and not takeover:
            await lease.freed.wait()

        await lease.take(program, takeover=takeover)
        try:
            yield
        finally:
            await run_shielded(lease.end(program, "the program gives it back"))

    def _lease(self, name: str | None) -> OperatorLease:
        stations = self._state.stations
        if name is None and len(stations) == 1:
            name = next(iter(stations))

        if name not in stations:
            raise KeyError(f"say which arm: one of {', '.join(stations)}, not {name!r}")

        return stations[name].lease


class Program:
    """The program that runs beside a panel, as a `Operator` of leases."""

    def __init__(self) -> None:
        self.name = "the program"
        self.gone = False
        self.yields = False


@asynccontextmanager
async def panel(
    arms: Arms,
    *,
    host: str = "127.0.0.1",
    port: int = 8080,
    operator_token: str | None = None,
    viewer_token: str | None = None,
    names: Collection[str] = (),
    certificate: str | Path | None = None,
    key: str | Path | None = None,
    scene: Scene | None = None,
) -> AsyncGenerator[Panel, None]:
    """Show arms in browsers, and let operators move them, for the length of a block.

    Args:
        arms: A connected arm, a connected fleet, or several by name: connected arms, and `Member`s, which the panel
            connects itself, and connects anew when they are lost.
        host: The address to listen at. Any but this computer's own needs both tokens to be given.
        port: 0 takes a free one.
        operator_token: What operators present, 12 to 200 characters; made up if it is not given.
        viewer_token: The same of viewers.
        names: Under which browsers call this server beside its addresses and this computer's name, as behind a reverse
            proxy: "panel.example.org", with a port if it is not the usual one.
        certificate: PEM file with a certificate: the panel speaks TLS.
        key: PEM file with its key, if that is not in the same file.
        scene: The scene in which simulated arms stand, to be shown.

    Raises:
        ValueError: An argument is wrong; or it is to listen for others, and a token is not given.
        TypeError: `arms` is something else.
        ConnectFailed: It cannot listen there.
        ImportError: The extra `panel` is not installed.
    """
    if not is_loopback(host) and not (operator_token and viewer_token):
        raise ValueError(
            f"others reach {host}, so give operator_token= and viewer_token=; at 127.0.0.1 they are made up"
        )

    tls = served_with(certificate, key) if certificate else None
    if key and not certificate:
        raise ValueError("a key needs its certificate")

    listener = listening(host, port)
    try:
        bound = listener.getsockname()[1]
        access = Access(
            operator_token or secrets.token_urlsafe(24),
            viewer_token or secrets.token_urlsafe(24),
            frozenset(name.lower() for name in names),
            secure=tls is not None,
            port=bound,
        )
        sources, zones, fleet = sources_of(arms)
        web_of = imported()
    except BaseException:
        listener.close()
        raise

    state = PanelState(sources, zones, scene=scene is not None, stop_all=fleet.stop if fleet else None)
    web = web_of(state, access)
    async with AsyncExitStack() as stack:
        stack.push_async_callback(lambda: run_shielded(web.aclose()))
        stack.push_async_callback(lambda: run_shielded(state.aclose()))
        stack.callback(listener.close)
        factory = await web.start(tls)
        server = await asyncio.get_running_loop().create_server(factory, sock=listener)
        stack.callback(server.close)
        state.start()
        if scene is not None:
            showing = asyncio.create_task(show_scene(scene, state.hub), name="dobot_async panel scene")
            stack.push_async_callback(partial(cancel_and_join, showing))

        yield Panel(state, access, host, bound, secure=tls is not None)


def imported() -> type[Any]:
    """Return the HTTP side; say which extra it is in if aiohttp is missing."""
    try:
        from dobot_async.panel.web import Web  # noqa: PLC0415 - it needs an extra
    except ImportError as error:
        raise ImportError(
            f"{error.name or error} is not installed, and a panel needs it: pip install 'dobot-async[panel]'",
            name=error.name,
        ) from error

    return Web


def listening(host: str, port: int) -> socket.socket:
    """Return a socket that listens; raise ConnectFailed if it cannot."""
    try:
        family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0][0]
        return socket.create_server((host, port), family=family, backlog=64)
    except (OSError, OverflowError) as error:
        raise ConnectFailed(f"cannot listen at {host}, port {port}: {error}") from error
