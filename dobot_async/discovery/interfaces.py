"""The broadcast address of each network of this computer."""

from __future__ import annotations

import socket
import struct
import sys
from contextlib import suppress

__all__ = ["EVERYBODY", "broadcast_targets"]

ANY, EVERYBODY = "0.0.0.0", "255.255.255.255"  # noqa: S104 - answers come to whatever address asked
SIOCGIFFLAGS, SIOCGIFBRDADDR = 0x8913, 0x8919
UP, BROADCAST = 0x1, 0x2
LINUX = sys.platform == "linux"


def broadcast_targets() -> list[tuple[str, str]]:
    """Returns pairs of an address to bind to and a broadcast address, one for each IPv4 network.

    Linux tells the broadcast address of each interface. Elsewhere everybody is asked from each address of this
    computer, as far as its host name tells them.
    """
    if LINUX:
        return [(ANY, address) for address in sorted(broadcast_addresses())]

    own = {ANY}
    with suppress(OSError):
        own.update(socket.gethostbyname_ex(socket.gethostname())[2])

    return [(address, EVERYBODY) for address in sorted(own) if not address.startswith("127.")]


def broadcast_addresses() -> list[str]:
    """Returns the broadcast address of each interface that is up and has one; Linux only."""
    import fcntl

    found: list[str] = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as query:
        for _, name in socket.if_nameindex():
            request = struct.pack("256s", name.encode())
            # An interface may have no IPv4 address, or may vanish meanwhile.
            with suppress(OSError):
                (flags,) = struct.unpack_from("H", fcntl.ioctl(query, SIOCGIFFLAGS, request), 16)
                if flags & UP and flags & BROADCAST:
                    found.append(socket.inet_ntoa(fcntl.ioctl(query, SIOCGIFBRDADDR, request)[20:24]))

    return found
