"""Access control: tokens and roles, the host names of this server, and the security headers for browsers.

    GET /?token=T --right--> cookie: HttpOnly, SameSite=Strict, one for each port
    every request --Host, Origin, Sec-Fetch-Site--> cookie --> Role

1. `Host` has to be an address, this computer's own name, or one that was given: a name that somebody has made to lead
   here (DNS rebinding) is none of them.
2. `Origin` has to be this server, and is required where anything is changed: of other pages a browser tells theirs.
3. The cookie is made from the token of its role: it holds as long as the token does, and is kept nowhere.
"""

from __future__ import annotations

import enum
import hashlib
import hmac
import ipaddress
import socket
from collections.abc import Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from urllib.parse import SplitResult, urlsplit

from dobot_async.transports.network import secret

__all__ = ["HEADERS", "Access", "AccessDenied", "Role", "is_loopback"]

SHORTEST = 12  # characters of a token
PORTS = {"http": 80, "https": 443, "ws": 80, "wss": 443}
WEEK = 7 * 24 * 3600
PURPOSE = b"dobot_async panel cookie "
FETCHED_FROM = {"same-origin", "none"}
HEADERS: Mapping[str, str] = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
        "font-src 'self'; manifest-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), geolocation=(), microphone=()",
}
"""What every answer says."""


class Role(enum.Enum):
    """What somebody may do."""

    VIEWER = "viewer"
    """Look, and stop."""
    OPERATOR = "operator"
    """Move an arm, with its lease."""


class AccessDenied(Exception):
    """Somebody is not let in.

    Attributes:
        status: Of HTTP.
        words: What it is told.
    """

    def __init__(self, status: int, text: str, words: str = "") -> None:
        super().__init__(text)
        self.status = status
        self.words: str = words or text


@dataclass(frozen=True, slots=True)
class Access:
    """See the module.

    Attributes:
        operator: The token of operators.
        viewer: That of viewers.
        names: Under which the server is called beside its addresses, as "panel.example.org" or "panel.local:8443".
        secure: It speaks TLS itself.
        port: Where it listens; part of the cookie's name, for cookies do not tell ports apart.
    """

    operator: str = field(repr=False)
    viewer: str = field(repr=False)
    names: Collection[str] = ()
    secure: bool = False
    port: int = 0

    def __post_init__(self) -> None:
        for token in (self.operator, self.viewer):
            try:
                secret(token)
            except ValueError:
                raise ValueError(
                    "a token is a word of printable ASCII without blanks, 200 characters at most"
                ) from None

            if len(token) < SHORTEST:
                raise ValueError(f"a token has {SHORTEST} characters at least")

        if hmac.compare_digest(self.operator.encode(), self.viewer.encode()):
            raise ValueError("viewers and operators need tokens of their own")

        for name in self.names:
            if not name or "/" in name or "@" in name:
                raise ValueError(f"a name of the server is as in panel.example.org or panel.local:8443, not {name!r}")

    @property
    def cookie_name(self) -> str:
        """What the cookie is called."""
        return f"dobot_panel_{self.port}"

    def cookie(self, role: Role) -> str:
        """Return what the browser keeps, and what says how it may be used."""
        secure = "; Secure" if self.secure else ""
        return f"{self.cookie_name}={self._value(role)}; Path=/; Max-Age={WEEK}; HttpOnly; SameSite=Strict{secure}"

    def role_of_token(self, token: str) -> Role | None:
        """Return whose token it is, in the same time whatever it is; None for nobody's."""
        given = token.encode(errors="surrogateescape")
        return self._match(given, {Role.OPERATOR: self.operator.encode(), Role.VIEWER: self.viewer.encode()})

    def role_of_cookie(self, value: str) -> Role | None:
        """Return whose cookie it is; None for nobody's."""
        given = value.encode(errors="surrogateescape")
        return self._match(given, {role: self._value(role).encode() for role in Role})

    def check(self, host: str, origin: str | None, fetched_from: str | None, *, changes: bool, navigates: bool) -> None:
        """Raise TurnedAway for a request that does not come from this server's own page.

        Args:
            host: Its header `Host`.
            origin: Its header `Origin`.
            fetched_from: Its header `Sec-Fetch-Site`, which browsers send.
            changes: It changes something, or opens a WebSocket.
            navigates: It asks for the page itself, to which any other page may have a link.
        """
        if not self.is_own(host):
            raise AccessDenied(421, "this server is not called so; --name says under which names it may be called")

        if origin is None and changes:
            raise AccessDenied(403, "a browser says from which page this comes")

        if origin is not None and not same_place(origin, host):
            raise AccessDenied(403, "another page may not do this")

        if fetched_from is not None and fetched_from not in FETCHED_FROM and not navigates:
            raise AccessDenied(403, "another page may not do this")

    def is_own(self, host: str) -> bool:
        """Return whether a `Host` is a name of this server."""
        place = parsed(f"//{host}")
        if place is None or not place.hostname or place.username is not None:
            return False

        if host.lower() in self.names or place.hostname in self.names:
            return True

        port = place.port or PORTS["https" if self.secure else "http"]
        return port == self.port and (is_address(place.hostname) or place.hostname in own_names())

    def _value(self, role: Role) -> str:
        token = self.operator if role is Role.OPERATOR else self.viewer
        return hmac.new(token.encode(), PURPOSE + role.value.encode(), hashlib.sha256).hexdigest()

    def _match(self, given: bytes, known: Mapping[Role, bytes]) -> Role | None:
        found = [role for role, each in known.items() if hmac.compare_digest(given, each)]
        return found[0] if found else None


def own_names() -> set[str]:
    """Return how this computer calls itself."""
    name = socket.gethostname().lower().removesuffix(".local")
    return {"localhost", name, f"{name}.local"}


def is_address(host: str) -> bool:
    """Return whether a host is an address, which nobody can make lead elsewhere."""
    with suppress(ValueError):
        ipaddress.ip_address(host)
        return True

    return False


def is_loopback(host: str) -> bool:
    """Return whether this computer alone reaches a host."""
    with suppress(ValueError):
        return ipaddress.ip_address(host).is_loopback

    return host == "localhost"


def parsed(url: str) -> SplitResult | None:
    """Return the parts of a URL, None if it is none."""
    try:
        place = urlsplit(url)
        _ = place.port, place.hostname
    except ValueError:
        return None

    return place


def same_place(origin: str, host: str) -> bool:
    """Return whether an `Origin` is the page of a `Host`."""
    page, here = parsed(origin), parsed(f"//{host}")
    if page is None or here is None or page.scheme not in {"http", "https"} or page.path or page.query:
        return False

    usual = PORTS[page.scheme]
    return (page.hostname, page.port or usual) == (here.hostname, here.port or usual)
