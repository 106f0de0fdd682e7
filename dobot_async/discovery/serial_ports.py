"""Serial ports whose USB chip is one that arms have."""

from __future__ import annotations

from collections.abc import AsyncGenerator, Callable, Iterable
from typing import Protocol

from anyio import to_thread

from dobot_async.discovery.families import FAMILIES, DiscoverableFamily
from dobot_async.discovery.found import Found, printable

__all__ = ["SerialPort", "SerialPorts"]


class SerialPort(Protocol):
    """What pyserial tells of a port."""

    device: str
    description: str
    location: str | None
    vid: int | None
    pid: int | None


class SerialPorts:
    """Finds arms on USB; there is nothing to wait for.

    Args:
        families: Whose USB ids to look for.
        ports: Lists the ports of this computer.
    """

    name = "serial"
    probes_at_once = 8

    def __init__(
        self, families: Iterable[DiscoverableFamily] = FAMILIES, ports: Callable[[], Iterable[SerialPort]] | None = None
    ) -> None:
        self._families = families
        self._ports = ports or list_ports

    async def search(self, timeout: float) -> AsyncGenerator[Found, None]:  # noqa: ARG002 - the system knows its ports at once
        """Yields each port with an arm's USB id; one that two drivers show is one port."""
        for port in await to_thread.run_sync(self._ports, abandon_on_cancel=True):
            families = tuple(family.name for family in self._families if (port.vid, port.pid) in family.usb)
            if families:
                yield Found(
                    url=f"serial://{port.device}",
                    source=self.name,
                    identity=port.location or port.device,
                    description=printable(port.description),
                    families=families,
                )


def list_ports() -> Iterable[SerialPort]:
    """The ports of this computer, by name, so that the same one of two for one device wins each time."""
    from serial.tools.list_ports import comports

    ports: Iterable[SerialPort] = sorted(comports(), key=lambda port: port.device, reverse=True)
    return ports
