"""Where clients come in, and who is let in: addresses, tokens, TLS.

    pty          whoever may open the terminal
    tcp          the first line is TOKEN and the token
    udp          any datagram may begin with that line; its sender is then known for a while
    zenoh        who may is Zenoh's own affair: its access control, TLS, and where it listens
    ws           a header (Authorization: Bearer), ?token= in the URL, or the line as the first text message

A token is needed on every address but this computer's own. Without one a web page must not get through to the arm,
either: browsers send what any page likes to this computer's ports.
"""

from __future__ import annotations

import asyncio
import hmac
import ipaddress
import re
import secrets
import ssl
from collections.abc import Callable, Collection, Sequence
from contextlib import AsyncExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import SplitResult, urlsplit

from dobot_async.bridge.service import Bridge
from dobot_async.errors import ConnectFailed
from dobot_async.transports.listen import Host, Peer, on_tcp, on_udp
from dobot_async.transports.network import secret
from dobot_async.transports.terminal import on_pty

__all__ = ["Doors", "Guard", "open_doors"]

FORMS = "tcp://127.0.0.1:0, udp://127.0.0.1:0, ws://127.0.0.1:0, zenoh://name or pty"
TOKEN = b"TOKEN "
LONGEST_LINE = 256
FIRST_LINE = 5.0  # seconds
STRANGERS = 32  # connections that have not said their token yet
HTTP = re.compile(rb"[A-Z]{3,8} /")
PERHAPS_HTTP = re.compile(rb"[A-Z]{0,8} ?")


@dataclass(frozen=True, slots=True)
class Guard:
    """Who is let in.

    Attributes:
        token: What has to be presented; None lets everybody in.
        origins: Web pages that may come without.
        refuse: Called with who was not let in, and why.
    """

    token: str | None
    origins: frozenset[str]
    refuse: Callable[[str, str], None]

    def knows(self, token: str) -> bool:
        """Whether this is the token, in the same time whatever it is."""
        return self.token is None or hmac.compare_digest(token.encode(errors="surrogateescape"), self.token.encode())


@dataclass(frozen=True, slots=True)
class Doors:
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
    ) -> Doors:
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
            raise ValueError("a token is one word of printable ASCII characters") from None

        if token is None and not all(local(place) for place in places):
            token = secrets.token_urlsafe(24)

        return cls(places, token, tls, frozenset(origins))


async def open_doors(
    doors: Doors, host: Bridge[Any], stack: AsyncExitStack, refuse: Callable[[str, str], None]
) -> tuple[str, ...]:
    """Lets clients of a host in until the stack is closed; returns the URLs in their order.

    `refuse` is called with who was not let in, and why.
    """
    guard = Guard(doors.token, doors.origins, refuse)
    urls = []
    for place in doors.places:
        address, port = place.hostname or "", place.port or 0
        try:
            if place.scheme == "pty":
                urls.append(await on_pty(host, stack, lasting=False))
            elif place.scheme == "tcp":
                reception = Reception(host, guard)
                urls.append(await on_tcp(reception, stack, address=address, port=port, tls=doors.tls))
                stack.callback(reception.close)
            elif place.scheme == "udp":
                known = Datagrams(guard)
                urls.append(await on_udp(host, stack, address=address, port=port, admit=known.admit, evict=False))
            elif place.scheme == "zenoh":
                from dobot_async.bridge.zenoh import on_zenoh  # noqa: PLC0415 - it needs an extra

                urls.append(await on_zenoh(host, stack, place))
            else:
                from dobot_async.bridge.websocket import on_ws  # noqa: PLC0415 - it needs an extra

                urls.append(await on_ws(host, stack, guard, address=address, port=port, tls=doors.tls))
        except OSError as error:
            raise ConnectFailed(f"cannot listen at {place.geturl()}: {error}") from error

    return tuple(urls)


def place_of(listen: str) -> SplitResult:
    """Parses where to listen."""
    with suppress(ValueError):
        place = urlsplit("pty:" if listen == "pty" else listen)
        if place.scheme == "pty" and place.geturl() in {"pty:", "pty://"}:
            return place

        if place.scheme == "zenoh" and place.netloc:
            return place

        known = place.scheme in {"tcp", "udp", "ws", "wss"}
        if known and place.hostname and place.port is not None and not (place.path.strip("/") or place.query):
            return place

    raise ValueError(f"cannot listen at {listen!r}; use {FORMS}")


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


class Datagrams:
    """Finds the token in datagrams."""

    def __init__(self, guard: Guard) -> None:
        self._guard = guard
        self._complained = -1e9

    def admit(self, data: bytes, known: bool) -> bytes | None:
        """Returns what is in a datagram besides the token, None if its sender is not let in."""
        line, end, rest = data.partition(b"\n")
        if line.startswith(TOKEN) and end and len(line) <= LONGEST_LINE:
            if self._guard.knows(line.removeprefix(TOKEN).decode("latin-1").strip()):
                return rest
        elif known or self._guard.token is None:
            return data

        # Datagrams cost their sender nothing: one line a second tells enough.
        now = asyncio.get_running_loop().time()
        if now > self._complained + 1:
            self._complained = now
            self._guard.refuse("udp", "a datagram of a stranger with a wrong token, or none")

        return None


class Reception:
    """Looks at the first bytes of each TCP connection; lets it in, or not."""

    def __init__(self, host: Host[Any], guard: Guard) -> None:
        self._host = host
        self._guard = guard
        self._strangers: dict[Guest, None] = {}

    def client(
        self,
        deliver: Callable[[bytes], None],
        hang_up: Callable[[], None],
        *,
        ordered: bool,
        hold: Callable[[bool], None] = lambda _: None,
        name: str = "",
    ) -> Guest:
        """Somebody has connected."""

        def let_in() -> Peer:
            self._strangers.pop(guest, None)
            peer: Peer = self._host.client(deliver, hang_up, ordered=ordered, hold=hold, name=name)
            return peer

        guest = Guest(self._guard, let_in, hang_up, name)
        self._strangers[guest] = None
        if len(self._strangers) > STRANGERS:
            next(iter(self._strangers)).turn_away("too many others want to come in")

        return guest

    def leave(self, client: Guest) -> None:
        """It has gone."""
        self._strangers.pop(client, None)
        client.close()
        if client.peer:
            self._host.leave(client.peer)

    def close(self) -> None:
        """Hangs up on those who are not in yet."""
        for guest in list(self._strangers):
            guest.turn_away("the bridge has ended")


class Guest:
    """A TCP connection.

    Attributes:
        peer: What the host keeps of it, once it was let in.
    """

    def __init__(self, guard: Guard, let_in: Callable[[], Peer], hang_up: Callable[[], None], name: str) -> None:
        self.peer: Peer | None = None
        self._guard = guard
        self._let_in = let_in
        self._hang_up = hang_up
        self._name = name
        self._first = bytearray()
        self._away = False
        late = "it has not said its token in time"
        loop = asyncio.get_running_loop()
        self._timer = loop.call_later(FIRST_LINE, self.turn_away, late) if guard.token else None

    def send(self, data: bytes) -> None:
        """It has sent something."""
        if self.peer and not self._away:
            self.peer.send(data)
            return

        self._first += data
        if self._away:
            self._first.clear()
        elif HTTP.match(self._first):
            self.turn_away("it speaks HTTP, as a web browser does")
        elif self._guard.token:
            self._check()
        elif not PERHAPS_HTTP.fullmatch(self._first):
            self._enter(bytes(self._first))

    def turn_away(self, reason: str) -> None:
        """Hangs up."""
        if not self._away:
            self._guard.refuse(self._name, reason)
            self.close()
            self._hang_up()

    def close(self) -> None:
        """Is deaf from now on."""
        self._away = True
        if self._timer:
            self._timer.cancel()

    def _check(self) -> None:
        """Lets it in if the first line is right."""
        line, end, rest = bytes(self._first).partition(b"\n")
        if end and line.startswith(TOKEN) and self._guard.knows(line.removeprefix(TOKEN).decode("latin-1").strip()):
            self._enter(rest)
        elif end or len(line) > LONGEST_LINE or not (TOKEN.startswith(line) or line.startswith(TOKEN)):
            self.turn_away("a wrong token, or none")

    def _enter(self, data: bytes) -> None:
        if self._timer:
            self._timer.cancel()

        self.peer = self._let_in()
        if data:
            self.peer.send(data)
