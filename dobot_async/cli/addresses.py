"""URLs that other programs can connect to: 0.0.0.0 is where one listens, and nowhere that one can connect to."""

from __future__ import annotations

import socket
from contextlib import suppress

__all__ = ["connectable"]

ANYWHERE = {
    "//0.0.0.0:": (socket.AF_INET, "192.0.2.1", "//{}:", "127.0.0.1"),
    "//[::]:": (socket.AF_INET6, "2001:db8::1", "//[{}]:", "::1"),
}
"""How such a URL looks: its family, an address of nobody that one's own is learnt towards, and what to say without."""


def connectable(url: str) -> str:
    """Returns a URL with this computer's address where it has none of its own."""
    for anywhere, (family, nobody, form, own) in ANYWHERE.items():
        if anywhere in url:
            return url.replace(anywhere, form.format(address(family, nobody) or own), 1)

    return url


def address(family: socket.AddressFamily, towards: str) -> str | None:
    """Returns the address that this computer has towards another one; sends nothing."""
    with suppress(OSError), socket.socket(family, socket.SOCK_DGRAM) as way:
        way.connect((towards, 9))
        return str(way.getsockname()[0])

    return None
