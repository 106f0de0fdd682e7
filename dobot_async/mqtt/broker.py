"""Where the broker is, and how one comes in: `mqtt://[USER@]HOST[:PORT]`, `mqtts://` with TLS."""

from __future__ import annotations

import ssl
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import unquote, urlsplit

__all__ = ["Broker", "broker_at"]

PORTS = {"mqtt": 1883, "mqtts": 8883}


@dataclass(frozen=True, slots=True)
class Broker:
    """A broker.

    Attributes:
        host: Its name or address.
        port: Its port.
        user: Who comes in, None for nobody in particular.
        password: His password.
        tls: For mqtts, None for none.
    """

    host: str
    port: int = PORTS["mqtt"]
    user: str | None = None
    password: str | None = field(default=None, repr=False)
    tls: ssl.SSLContext | None = None

    def __str__(self) -> str:
        return f"mqtt{'s' if self.tls else ''}://{self.host}:{self.port}"


def broker_at(url: str, *, password: str | None = None, ca: str | Path | None = None) -> Broker:
    """Return the broker at a URL.

    Args:
        url: `mqtt://host`, or `mqtts://host` for TLS; with `user@` and `:port`.
        password: Of the user.
        ca: PEM file with the certificate to trust; by default those that the computer trusts.

    Raises:
        ValueError: It is no such URL, or has a password in it, where others can see it; or the file is no certificate.
    """
    try:
        place = urlsplit(url)
        host, port = place.hostname, place.port
    except ValueError:
        place, host, port = urlsplit(""), None, None

    if place.scheme not in PORTS or not host or place.path.strip("/") or place.query or place.fragment:
        raise ValueError("the broker is at mqtt://host, mqtts://host, with user@ before and :port behind it")

    if place.password is not None:
        raise ValueError("a password in a URL is seen by others on this computer: give it in a file, or a variable")

    if ca and place.scheme != "mqtts":
        raise ValueError("a certificate to trust is for mqtts://")

    user = unquote(place.username) if place.username else None
    if password is not None and user is None:
        raise ValueError("a password needs a user: mqtt://user@host")

    tls = trusting(ca) if place.scheme == "mqtts" else None
    return Broker(host, port or PORTS[place.scheme], user, password, tls)


def trusting(ca: str | Path | None) -> ssl.SSLContext:
    """TLS for a client."""
    try:
        return ssl.create_default_context(cafile=ca)
    except OSError as error:
        raise ValueError(f"cannot use the certificate {ca}: {error}") from None
