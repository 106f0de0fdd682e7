"""The listeners of a bridge, and who may connect: addresses, tokens, TLS.

    pty          whoever may open the terminal
    tcp          the first line is TOKEN and the token
    udp          any datagram may begin with that line; its sender is then known for a while
    zenoh        decided by Zenoh: its access control, TLS, and where it listens
    ws           a header (Authorization: Bearer), ?token= in the URL, or the line as the first text message

A token is needed on every address but this computer's own. Without one a web page must not get through to the arm,
either: browsers send what any page likes to this computer's ports. `handshake` has what tcp and ws share.
"""

from __future__ import annotations

import ipaddress
import secrets
import ssl
from collections.abc import Callable, Collection, Sequence
from contextlib import AsyncExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import SplitResult, urlsplit

from dobot_async._core.protocol.transport import MANY
from dobot_async._core.util.urls import hidden
from dobot_async.bridge.handshake import (
    LONGEST_LINE,
    TOKEN,
    Authenticator,
    Handshakes,
    PendingConnection,
    TokenHandshake,
)
from dobot_async.bridge.service import Bridge
from dobot_async.endpoints.listeners import on_tcp, on_udp
from dobot_async.endpoints.pty import on_pty
from dobot_async.errors import ConnectFailed
from dobot_async.transports.network import TOKEN as TOKEN_OPTION
from dobot_async.transports.network import secret

__all__ = ["Listeners", "open_listeners"]

FORMS = "tcp://127.0.0.1:0, udp://127.0.0.1:0, ws://127.0.0.1:0, zenoh://name or pty"


@dataclass(frozen=True, slots=True)
class Listeners:
    """Where a bridge listens.

    Attributes:
        places: The parsed URLs.
        token: The token, None where none is needed.
        tls: For tcp and ws, None for none.
        origins: Web pages that may come without a token.
    """

    places: tuple[SplitResult, ...]
    token: str | None
    tls: ssl.SSLContext | None
    origins: frozenset[str]

    @classmethod
    def of(
        cls,
        listen: Sequence[str],
        token: str | None,
        certificate: str | Path | None,
        key: str | Path | None,
        origins: Collection[str],
    ) -> Listeners:
        """Checks where to listen, and makes up a token where one is needed and none given.

        Raises:
            ValueError: A URL, the token or a certificate is wrong.
        """
        places = tuple(map(place_of, listen))
        tls = served_with(certificate, key) if certificate else None
        if not places or (key and not certificate):
            raise ValueError(f"expected a place to listen at, {FORMS}; and a certificate where there is a key")

        if tls is None and any(place.scheme == "wss" for place in places):
            raise ValueError("wss needs a certificate")

        try:
            token = secret(token) if token is not None else None
        except ValueError:
            raise ValueError(f"expected as the token {TOKEN_OPTION.expected}") from None

        if token is None and not all(local(place) for place in places):
            token = secrets.token_urlsafe(24)

        return cls(places, token, tls, frozenset(origins))


async def open_listeners(
    listeners: Listeners, host: Bridge[Any], stack: AsyncExitStack, refuse: Callable[[str, str], None]
) -> tuple[str, ...]:
    """Lets clients of a host in until the stack is closed; returns the URLs in their order.

    `refuse` is called with who was not let in, and why.
    """
    authenticator = Authenticator(listeners.token, listeners.origins, host.family.begins, refuse)
    urls: list[str] = []
    for place in listeners.places:
        address, port = place.hostname or "", place.port or 0
        try:
            if place.scheme == "pty":
                urls.append(await on_pty(host, stack, lasting=False))
            elif place.scheme == "udp":
                known = UDPListener(authenticator)
                urls.append(
                    await on_udp(host, stack, address=address, port=port, admit=known.admit, on_full=known.on_full)
                )
            elif place.scheme == "zenoh":
                from dobot_async.bridge.zenoh import on_zenoh  # noqa: PLC0415 - it needs an extra

                urls.append(await on_zenoh(host, stack, place))
            else:
                handshakes = Handshakes(host, authenticator, kind_of(place.scheme))
                scheme = "tcp" if place.scheme == "tcp" else "ws"
                tls = listeners.tls
                urls.append(await on_tcp(handshakes, stack, address=address, port=port, tls=tls, scheme=scheme))
                stack.callback(handshakes.close)
        except OSError as error:
            raise ConnectFailed(f"cannot listen at {place.geturl()}: {error}") from error

    return tuple(urls)


def kind_of(scheme: str) -> type[PendingConnection]:
    """What a connection to a port is; raises ConnectFailed where a package is missing for it."""
    if scheme == "tcp":
        return TokenHandshake

    from dobot_async.bridge.websocket import WebSocketConnection  # noqa: PLC0415 - it needs an extra
    from dobot_async.transports.websocket import websockets  # noqa: PLC0415 - as above

    websockets("server")
    return WebSocketConnection


def place_of(listen: str) -> SplitResult:
    """Parses where to listen."""
    with suppress(ValueError):
        place = urlsplit("pty:" if listen == "pty" else listen)
        if place.scheme == "pty" and place.geturl() in {"pty:", "pty://"}:
            return place

        if place.scheme == "zenoh" and place.netloc:
            return place

        known = place.scheme in {"tcp", "udp", "ws", "wss"}
        host = (place.hostname or "").encode("idna")  # a ValueError if nobody can have this name
        bare = not (place.path.strip("/") or place.query or place.fragment or "@" in place.netloc)
        if known and host and b"\0" not in host and place.port is not None and bare:
            return place

    raise ValueError(f"cannot listen at {hidden(listen)!r}; use {FORMS}")


def local(place: SplitResult) -> bool:
    """Whether no token is needed: only programs on this computer can come in, or Zenoh sees to it."""
    host = place.hostname
    if place.scheme in {"pty", "zenoh"} or host == "localhost":
        return True

    try:
        return ipaddress.ip_address(host or "").is_loopback
    except ValueError:
        return False


def served_with(certificate: str | Path, key: str | Path | None) -> ssl.SSLContext:
    """TLS for a server."""
    context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
    try:
        context.load_cert_chain(certificate, key, password=lambda: "")  # else it would ask for one at the terminal
    except OSError as error:
        raise ValueError(f"cannot use the certificate {certificate}: {error}") from None

    return context


class UDPListener:
    """Finds the token in datagrams."""

    def __init__(self, authenticator: Authenticator) -> None:
        self._authenticator = authenticator

    def admit(self, data: bytes, known: bool) -> bytes | None:
        """Returns what is in a datagram besides the token, None if its sender is not let in."""
        authenticator = self._authenticator
        line, end, rest = data.partition(b"\n")
        if line.startswith(TOKEN) and end and len(line) <= LONGEST_LINE:
            if authenticator.knows(line.removeprefix(TOKEN)):
                return rest
        elif known or (authenticator.token is None and authenticator.begins(data) is not False):
            return data

        reason = "a wrong token, or none" if authenticator.token else "what it says is nothing that this arm is told"
        authenticator.refuse("udp", f"a datagram of an unauthenticated client: {reason}")
        return None

    def on_full(self, name: str) -> None:
        """One more than there may be has sent something."""
        self._authenticator.refuse(name, f"{MANY} others use this port by udp, which is as many as may")
