"""The arm's Wi-Fi: which network it joins, and whether it is in it. Manual 2.18.

    configuration mode on --> name, password, address --> configuration mode off --> joining ... --> connected

The arm keeps all of it without power. The password is written and never read.
"""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
from ipaddress import IPv4Address, IPv4Network
from typing import Any

from dobot_async._core.link.link import Link
from dobot_async._core.protocol.wire import Command
from dobot_async._core.util.arguments import check_timeout
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.frame import Frame
from dobot_async.errors import ReplyTimeout

__all__ = ["WiFi", "WiFiSettings"]

INTERVAL = 0.5
NONE = IPv4Address(0)


@dataclass(frozen=True, slots=True)
class WiFiSettings:
    """What the arm's Wi-Fi is set to, the password left out.

    Attributes:
        ssid: The network's name.
        dhcp: Whether the network gives it an address; the other attributes then mean nothing.
        address: Its own.
        netmask: Of its network.
        gateway: 0.0.0.0 for none.
        dns: The name server; 0.0.0.0 for none.
    """

    ssid: str
    dhcp: bool
    address: IPv4Address
    netmask: IPv4Address
    gateway: IPv4Address
    dns: IPv4Address


class WiFi:
    """An arm's Wi-Fi; `arm.wifi`. It needs the vendor's Wi-Fi module in the arm's serial socket."""

    def __init__(self, link: Link[Frame]) -> None:
        self._link = link

    async def get_settings(self, *, timeout: float | None = None) -> WiFiSettings:
        """Returns what it is set to. Manual 2.18.2 to 2.18.7.

        Raises:
            ReplyTimeout: No answer came.
            ConnectionLost: The link is gone.
        """
        address = await self._link.request(c.GET_WIFI_IP_ADDRESS, None, timeout=timeout)
        netmask = await self._link.request(c.GET_WIFI_NETMASK, None, timeout=timeout)
        gateway = await self._link.request(c.GET_WIFI_GATEWAY, None, timeout=timeout)
        dns = await self._link.request(c.GET_WIFI_DNS, None, timeout=timeout)
        return WiFiSettings(
            ssid=await self._link.request(c.GET_WIFI_SSID, None, timeout=timeout),
            dhcp=address.dhcp,
            address=IPv4Address(bytes(address.addr)),
            netmask=IPv4Address(bytes(netmask.addr)),
            gateway=IPv4Address(bytes(gateway.addr)),
            dns=IPv4Address(bytes(dns.addr)),
        )

    async def configure(
        self,
        ssid: str,
        password: str,
        *,
        address: str | None = None,
        netmask: str = "255.255.255.0",
        gateway: str | None = None,
        dns: str | None = None,
        timeout: float | None = None,
    ) -> None:
        """Lets the arm join a network; `wait_connected` tells when it has. Manual 2.18.1 to 2.18.7.

        If this fails half way the arm stays in its configuration mode, so that it does not act on half of the
        settings: do it again.

        Args:
            ssid: The network's name, 1 to 32 bytes of UTF-8.
            password: Up to 64 bytes; "" for an open network.
            address: The arm's own IPv4 address; None lets the network give it one (DHCP).
            netmask: Of the network; only with an address.
            gateway: The router; only with an address.
            dns: The name server; only with an address.
            timeout: Seconds for each of the commands; the rows' own by default.

        Raises:
            ValueError: An argument is wrong, or the connection only reads; nothing was sent.
            ReplyTimeout: No answer came.
            ConnectionLost: The link is gone.
        """
        if not ssid:
            raise ValueError("the network's name (SSID) must not be empty")

        steps: list[tuple[Command[Any, None], Any]] = [
            (c.SET_WIFI_CONFIG_MODE, True),
            (c.SET_WIFI_SSID, ssid),
            (c.SET_WIFI_PASSWORD, password),
            *addressing(address, netmask, gateway, dns),
            (c.SET_WIFI_CONFIG_MODE, False),
        ]
        for command, value in steps:
            self._link.frame(command, value)

        for command, value in steps:
            await self._link.request(command, value, timeout=timeout)

    async def connected(self, *, timeout: float | None = None) -> bool:
        """Returns whether the arm is in its network. Manual 2.18.8.

        Raises:
            ReplyTimeout: No answer came.
            ConnectionLost: The link is gone.
        """
        return await self._link.request(c.GET_WIFI_CONNECT_STATUS, None, timeout=timeout)

    async def wait_connected(self, timeout: float = 30.0) -> None:
        """Returns when the arm is in its network.

        Args:
            timeout: Seconds that it may take to join.

        Raises:
            ReplyTimeout: It was not in time; the message says what to check.
            ConnectionLost: The link is gone.
        """
        seconds = check_timeout(timeout)
        try:
            async with asyncio.timeout(seconds):
                while True:
                    if await self.connected():
                        return

                    await asyncio.sleep(INTERVAL)
        except TimeoutError as error:
            if isinstance(error, ReplyTimeout):
                raise

            raise ReplyTimeout(
                f"the arm did not join its Wi-Fi within {timeout:.3g} s; are name and password right, is the network a "
                "2.4 GHz one and in range, and is the Wi-Fi module plugged in?"
            ) from None


def addressing(
    address: str | None, netmask: str, gateway: str | None, dns: str | None
) -> list[tuple[Command[Any, None], Any]]:
    """The commands that say how the arm gets its address; raises ValueError for one that cannot work."""
    if address is None:
        if gateway or dns:
            raise ValueError("with DHCP the network tells gateway and name server; give an address, or neither of them")

        return [(c.SET_WIFI_IP_ADDRESS, c.WIFIIPAddress(dhcp=True))]

    network = IPv4Network((address, netmask), strict=False)
    router = IPv4Address(gateway or NONE)
    if router != NONE and router not in network:
        raise ValueError(f"the gateway {router} is not in the arm's own network {network}")

    return [
        (c.SET_WIFI_IP_ADDRESS, c.WIFIIPAddress(dhcp=False, addr=octets(IPv4Address(address)))),
        (c.SET_WIFI_NETMASK, c.WIFINetmask(octets(network.netmask))),
        (c.SET_WIFI_GATEWAY, c.WIFIGateway(octets(router))),
        (c.SET_WIFI_DNS, c.WIFIDNS(octets(IPv4Address(dns or NONE)))),
    ]


def octets(address: IPv4Address) -> tuple[int, int, int, int]:
    """The four numbers of an address."""
    first, second, third, fourth = address.packed
    return first, second, third, fourth
