"""Who an HTTP request says that it is for, and which web page it comes from: what keeps pages of others out.

A page whose name was made to lead to this computer (DNS rebinding) says its own name as the `Host`. A number is no
name, so requests for addresses are as good as those for `localhost`.
"""

from __future__ import annotations

import ipaddress
from collections.abc import Collection
from contextlib import suppress
from urllib.parse import urlsplit

__all__ = ["HostAndPort", "host_and_port", "is_for_us", "is_loopback"]

HostAndPort = tuple[str, int]


def is_for_us(host: str, names: Collection[str] = ()) -> bool:
    """Return whether a request with this `Host` header may be for this server.

    Args:
        host: The header, with or without a port.
        names: What the server is called besides `localhost` and its addresses.
    """
    try:
        name = urlsplit(f"//{host}").hostname
    except ValueError:
        return False

    if name is None or "@" in host or "/" in host:
        return False

    return name == "localhost" or name in {each.lower() for each in names} or is_address(name)


def is_address(name: str) -> bool:
    """Whether it is an IP address."""
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False

    return True


def is_loopback(host: str) -> bool:
    """Return whether only programs on this computer reach a server that listens at a host."""
    return host == "localhost" or (is_address(host) and ipaddress.ip_address(host).is_loopback)


def host_and_port(text: str) -> HostAndPort:
    """Return where to listen; raise ValueError for anything but HOST:PORT.

    Args:
        text: Such as 127.0.0.1:9464, or [::1]:0 for a port that is free.
    """
    with suppress(ValueError):
        place = urlsplit(f"//{text}")
        host, port = place.hostname, place.port
        if host and port is not None and not (place.path or place.query or place.fragment or "@" in text):
            return host, port

    raise ValueError(f"expected HOST:PORT, such as 127.0.0.1:9464, not {text!r}")
