"""`wifi`: brings an arm that is on USB into a Wi-Fi, and finds it there.

The password comes from a prompt or from standard input: never from an argument, which everybody on the computer could
read.
"""

from __future__ import annotations

import sys
from collections.abc import AsyncGenerator, Sequence
from contextlib import aclosing
from dataclasses import dataclass

import click

from dobot_async.cli.commands.discover import broadcast_option
from dobot_async.cli.params import ABOVE_ZERO
from dobot_async.cli.session import CommandSession, run
from dobot_async.discovery.families import probe_magician
from dobot_async.discovery.found import Found
from dobot_async.discovery.wifi import PORT, WiFiModules
from dobot_async.errors import ConnectFailed, DobotError

__all__ = ["set_up_wifi"]

PROBE = 5.0


@dataclass(frozen=True, slots=True)
class Joined:
    """An arm that has joined a network.

    Attributes:
        ssid: The network's name.
        serial_number: The arm's.
        url: Where it is in that network.
    """

    ssid: str
    serial_number: str
    url: str


@click.command("wifi")
@click.argument("ssid")
@click.option("--open", "is_open", is_flag=True, help="The network has no password.")
@click.option("--address", help="The arm's own IPv4 address. Default: the network gives it one (DHCP).")
@click.option("--netmask", default="255.255.255.0", show_default=True, help="Of the network; with --address.")
@click.option("--gateway", help="The router; with --address.")
@click.option("--dns", help="The name server; with --address.")
@click.option("--timeout", type=ABOVE_ZERO, default=30.0, show_default=True, help="Seconds to join.")
@click.option("--search", type=ABOVE_ZERO, default=10.0, show_default=True, help="Seconds to search for the arm then.")
@broadcast_option
@click.pass_obj
def set_up_wifi(
    session: CommandSession,
    ssid: str,
    is_open: bool,
    address: str | None,
    netmask: str,
    gateway: str | None,
    dns: str | None,
    timeout: float,
    search: float,
    broadcast: Sequence[tuple[str, int]],
) -> None:
    """Bring an arm on USB into a Wi-Fi.

    Asks for the password, or reads it from standard input if that is no terminal. Ends with the URL of the arm in
    that network, once it has joined and was found. The arm keeps the settings when it is switched off.
    """
    if session.arm != "magician":
        raise click.UsageError("only a Magician has a Wi-Fi module that can be set up")

    session.target()
    password = "" if is_open else read_password(ssid)

    async def join() -> Joined:
        async with session.connect(queue="keep", on_error="leave") as arm:
            number = (await arm.get_info()).serial_number
            await arm.wifi.configure(ssid, password, address=address, netmask=netmask, gateway=gateway, dns=dns)
            await arm.wifi.wait_connected(timeout)

        # The arm may answer one line at a time only: the one that was used is closed by now.
        places = broadcast or ([(address, PORT)] if address else ())
        return Joined(ssid, number, await find(WiFiModules(places).search(search), address, number))

    with session.output.working(f"joining {ssid}"):
        joined = run(join())

    session.output.answer(joined, joined.url)


def read_password(ssid: str) -> str:
    """Asks for the password without showing it, or reads the first line of standard input."""
    if sys.stdin is not None and sys.stdin.isatty():
        answer: str = click.prompt(f"Password of {ssid}", hide_input=True, err=True)
        return answer

    try:
        line = sys.stdin.readline() if sys.stdin is not None else ""
    except UnicodeDecodeError:
        raise click.UsageError(
            f"the password on standard input is no {sys.stdin and sys.stdin.encoding} text"
        ) from None

    if not line.strip("\r\n"):
        raise click.UsageError("standard input has no password on its first line; --open is for networks without one")

    return line.rstrip("\r\n")


async def find(search: AsyncGenerator[Found, None], address: str | None, serial_number: str) -> str:
    """Returns the URL of an arm in the Wi-Fi, known by the address that it was given, or by its serial number.

    Raises:
        ConnectFailed: It is not there, or cannot be told from others.
    """
    others: dict[str, str] = {}
    reason = ""
    try:
        async with aclosing(search) as answers:
            async for found in answers:
                # One that did not tell its number is asked again whenever it answers the search again.
                if not address and not others.get(found.url):
                    others[found.url] = await serial_number_at(found.url)

                if found.url == f"udp://{address}" or (serial_number and others.get(found.url) == serial_number):
                    return found.url
    except OSError as error:
        reason = str(error)

    numbers = [f"{url} ({number or 'does not tell its serial number'})" for url, number in others.items()]
    reason = reason or (f"it is none of {', '.join(numbers)}" if numbers else "nothing answers there")
    raise ConnectFailed(
        f"the arm {serial_number} has joined the Wi-Fi, but was not found in the networks of this computer: {reason}; "
        "is this computer in the same network, and does the router let its devices reach one another? The router's "
        "list of devices tells the arm's address"
    )


async def serial_number_at(url: str) -> str:
    """Returns the serial number of the arm at a URL; "" if it does not tell."""
    try:
        return (await probe_magician(url, PROBE)).serial_number
    except (DobotError, OSError):
        return ""
