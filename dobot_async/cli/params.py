"""What the options of several commands hold: a place to ask for arms, and numbers above 0."""

from __future__ import annotations

import math
from ipaddress import IPv4Address
from typing import Any

import click

from dobot_async.discovery.wifi import PORT

__all__ = ["ABOVE_ZERO", "Place"]

PORTS = range(1 << 16)


class Place(click.ParamType[tuple[str, int]]):
    """An IPv4 address, with the port where modules are asked unless it has one of its own."""

    name = "address"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, int]:
        """Reads ADDRESS or ADDRESS:PORT."""
        if isinstance(value, tuple):
            return value

        host, _, written = value.partition(":")
        try:
            address, port = str(IPv4Address(host)), int(written or PORT)
        except ValueError:
            port = -1

        if port not in PORTS:
            self.fail(f"{value!r} is no IPv4 address such as 192.168.1.255, or 192.168.1.255:{PORT}", param, ctx)

        return address, port


class AboveZero(click.FloatRange):
    """A number above 0; no range of click's keeps out what is no number."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Reads a number."""
        number = float(super().convert(value, param, ctx))
        if math.isnan(number):
            self.fail(f"{value!r} is no number", param, ctx)

        return number


ABOVE_ZERO = AboveZero(0, min_open=True)
