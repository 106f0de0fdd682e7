"""Where an arm is, as old programs say it: a port's name, an address, or nothing at all.

    "COM3", "/dev/ttyUSB0"   serial://COM3, serial:///dev/ttyUSB0
    "192.168.1.20"           udp://192.168.1.20, the arm's Wi-Fi module
    "", None                 DOBOT_URL, else the first port with the USB chip of an arm
    any URL                  itself, as docs/getting-started.md lists them

`DOBOT_PORTS="COM3=udp://192.168.1.20,COM4=sim:"` takes ports that a program has in its text elsewhere.
"""

from __future__ import annotations

import ipaddress
import os
from collections.abc import Mapping

from dobot_async.discovery.families import MAGICIAN
from dobot_async.errors import ConnectFailed

__all__ = ["ports_with_arms", "url_of"]

URL, PORTS = "DOBOT_URL", "DOBOT_PORTS"


def url_of(port: str | None) -> str:
    """Return the URL of an arm.

    Args:
        port: A port's name, an IP address or a URL; nothing for the first arm that there is.

    Raises:
        ConnectFailed: Nothing is named, and no port has the USB chip of an arm.
        ValueError: The environment's `DOBOT_PORTS` is not made of PORT=URL.
    """
    if not port:
        found = os.environ.get(URL) or next(iter(ports_with_arms()), None)
        if not found:
            raise ConnectFailed(f"no port has the USB chip of an arm: plug it in, name its port, or set {URL}")

        return url_of(found)

    port = elsewhere().get(port, port)
    if "://" in port or port.startswith(("sim:", "ble:")):
        return port

    return f"udp://{port}" if is_address(port) else f"serial://{port}"


def ports_with_arms() -> list[str]:
    """Return the serial ports of this computer whose USB chip is one that a Magician has; the wire is not used."""
    from serial.tools import list_ports  # noqa: PLC0415 - it reads what is plugged in, and nobody else needs it

    return [port.device for port in sorted(list_ports.comports()) if (port.vid, port.pid) in MAGICIAN.usb]


def elsewhere() -> Mapping[str, str]:
    """The ports that the environment takes elsewhere."""
    pairs = [pair.partition("=") for pair in os.environ.get(PORTS, "").split(",") if pair.strip()]
    for port, _, url in pairs:
        if not (port.strip() and url.strip()):
            raise ValueError(f"{PORTS} is PORT=URL, several with commas between them, not {os.environ[PORTS]!r}")

    return {port.strip(): url.strip() for port, _, url in pairs}


def is_address(port: str) -> bool:
    """Whether a port is an IP address."""
    try:
        ipaddress.ip_address(port)
    except ValueError:
        return False

    return True
