"""The ways to an arm, chosen by URL; each scheme's module is imported when it is first used."""

from __future__ import annotations

from importlib import import_module
from typing import Any, cast
from urllib.parse import urlsplit

from dobot_async._core.protocol.transport import Transport
from dobot_async._core.util.urls import hidden

__all__ = ["SCHEMES", "Transport", "open_transport"]

SCHEMES = {
    "serial": ("dobot_async.transports.serial_port", "serial:///dev/ttyUSB0, serial://COM3 (?baud=115200)"),
    "udp": ("dobot_async.transports.network", "udp://192.168.1.20 (port 8899)"),
    "tcp": ("dobot_async.transports.network", "tcp://host:port"),
    "ws": ("dobot_async.transports.websocket", "ws://host:port (a bridge; ?token=)"),
    "wss": ("dobot_async.transports.websocket", "wss://host:port (?token=&ca=)"),
    "zenoh": (
        "dobot_async.transports.zenoh.transport",
        "zenoh://NAME (a served arm; ?connect=tcp/host:port&config=FILE)",
    ),
    "ble": ("dobot_async.transports.ble.opening", "ble://NAME, ble://ADDRESS, ble: (the first arm in range)"),
    "sim": ("dobot_async.simulator.url", "sim: (?speed=10&seed=1&loss=0.05&latency=0.01)"),
    "replay": ("dobot_async.traces.replay", "replay:FILE (an arm that answers as in a trace; ?arm=&connection=)"),
}


async def open_transport(url: str, *, arm: str) -> Transport:
    """Opens the way to an arm.

    Args:
        url: One of the forms in `SCHEMES`.
        arm: The model that `sim:` is to simulate.

    Raises:
        ValueError: The URL is none; the message says what is wrong with it.
        ConnectFailed: Nothing could be opened there; the message says what to check.
    """
    try:
        parts = urlsplit(url)
        return cast(Transport, await module_of(parts.scheme).open_url(parts, arm=arm))
    except ValueError as error:
        shown = hidden(url)
        # What it quotes of the URL may be the secret.
        reason = "the port is no number" if shown != url and str(error).startswith("Port") else error
        raise ValueError(f"{shown!r}: {reason}") from None


def module_of(scheme: str) -> Any:
    """The module that opens a scheme's URLs."""
    if scheme not in SCHEMES:
        forms = "; ".join(form for _, form in SCHEMES.values())
        raise ValueError(f"this has no scheme that leads to an arm; use one of: {forms}")

    module, _ = SCHEMES[scheme]
    return import_module(module)
