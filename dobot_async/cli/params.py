"""What the options of several commands hold: a place to ask for arms, numbers above 0, times, and the text of files."""

from __future__ import annotations

import errno
import math
import sys
from contextlib import suppress
from ipaddress import IPv4Address
from pathlib import Path
from typing import Any, NamedTuple, cast

import click

from dobot_async._core.util.hosts import host_and_port
from dobot_async.cli.failures import WrongFile
from dobot_async.program.text import LARGEST, read_text

__all__ = [
    "ABOVE_ZERO",
    "DURATION",
    "FINITE",
    "HOST_AND_PORT",
    "NOT_BELOW_ZERO",
    "PERCENT",
    "PROGRAM",
    "AddressType",
    "TextSource",
    "standard_input",
]

PORTS = range(1 << 16)
MOST_SECONDS = 86400.0  # a day


class AddressType(click.ParamType[tuple[str, int]]):
    """An IPv4 address, with the port where modules are asked unless it has one of its own."""

    name = "address"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, int]:
        """Reads ADDRESS or ADDRESS:PORT."""
        from dobot_async.discovery.wifi import PORT

        if isinstance(value, tuple):
            return cast("tuple[str, int]", value)

        host, _, written = value.partition(":")
        address, port = host, -1
        with suppress(ValueError):
            address, port = str(IPv4Address(host)), int(written or PORT)

        if port not in PORTS:
            self.fail(f"{value!r} is no IPv4 address such as 192.168.1.255, or 192.168.1.255:{PORT}", param, ctx)

        return address, port


class HostPort(click.ParamType[tuple[str, int]]):
    """Where to listen: HOST:PORT."""

    name = "host:port"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, int]:
        """Reads HOST:PORT."""
        if isinstance(value, tuple):
            return cast("tuple[str, int]", value)

        try:
            return host_and_port(str(value))
        except ValueError as error:
            self.fail(str(error), param, ctx)


class FiniteRange(click.FloatRange):
    """Numbers of a range; no range of click's keeps out what is no number."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Reads a number."""
        number = float(super().convert(value, param, ctx))
        if not math.isfinite(number):
            self.fail(f"{value!r} is no finite number", param, ctx)

        return number


class FiniteNumber(click.ParamType[float]):
    """Numbers, below 0 as well."""

    name = "number"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Reads a number."""
        return EVERY.convert(value, param, ctx)


class TextSource(NamedTuple):
    """The text of a file.

    Attributes:
        name: Of the file.
        text: What is in it.
    """

    name: str
    text: str


class TextFile(click.ParamType[TextSource]):
    """A file of UTF-8 text, or - for standard input; read before anything else is done."""

    name = "file"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> TextSource:
        """Reads the file."""
        if isinstance(value, TextSource):
            return value

        name = "standard input" if value == "-" else click.format_filename(value)
        try:
            return TextSource(name, read_text(standard_input() if value == "-" else Path(value)))
        except OSError as error:
            self.fail(f"{name}: {error.strerror or error}", param, ctx)
        except ValueError as error:
            raise WrongFile(f"{name}: {error}; nothing was sent", ctx) from None


def standard_input() -> bytes:
    """Returns what standard input holds."""
    if sys.stdin is None or sys.stdin.closed:
        raise OSError(errno.EBADF, "it is closed")

    return sys.stdin.buffer.read(LARGEST + 1)


PROGRAM = TextFile()
EVERY = FiniteRange()
ABOVE_ZERO = FiniteRange(0, min_open=True)
FINITE = FiniteNumber()
HOST_AND_PORT = HostPort()
NOT_BELOW_ZERO = FiniteRange(0)
PERCENT = FiniteRange(0, 100, min_open=True)
DURATION = FiniteRange(0, max=MOST_SECONDS)
