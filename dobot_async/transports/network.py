"""TCP and UDP, with a token and TLS where a bridge asks for them.

UDP carries the arm's serial stream in datagrams, which may be lost, doubled, merged and split: it is parsed as a stream
like any other, one request is under way at a time, and a lost one is silence.
"""

from __future__ import annotations

import ssl
from typing import Any
from urllib.parse import SplitResult

import anyio

from dobot_async.errors import ConnectFailed
from dobot_async.transports.base import Option, StreamTransport, Transport, number, options, words
from dobot_async.transports.byte_stream import WINDOW
from dobot_async.transports.tcp import connect

__all__ = ["CA", "TOKEN", "UDP_PORT", "WINDOW", "open_url", "secret", "trust"]

UDP_PORT = 8899
REORDER_WINDOW = 0.015  # seconds; one access point keeps datagrams in order, and doubles them within a few milliseconds
TOKEN_LINE = b"TOKEN %s\n"
SYSTEM = "system"


def secret(token: str) -> str:
    """Return a token as it may be presented; raise ValueError for one that is no word."""
    if not token.isascii() or not token.isprintable() or not token or " " in token:
        raise ValueError

    return token


TOKEN = Option(secret, "a word of printable ASCII without blanks", secret=True)
CA = Option(words, "a PEM file, or system")
OPTIONS: dict[str, dict[str, Option]] = {
    "udp": {"reorder_window": number(float, "seconds", least=0, most=10), "token": TOKEN},
    "tcp": {"ca": CA, "token": TOKEN},
}


async def open_url(url: SplitResult, *, arm: str) -> Transport:  # noqa: ARG001 - for `sim:`
    """Open `udp://host[:8899]` or `tcp://host:port`.

    Both take `?token=`, which a bridge asks for. `?reorder_window=` says if a network is worse than `REORDER_WINDOW`;
    `?ca=` turns TLS on: a PEM file with the certificate to trust, or "system" for those that the computer trusts.
    """
    given = options(url, OPTIONS[url.scheme])
    host = url.hostname
    port = UDP_PORT if url.scheme == "udp" and url.port is None else url.port
    if not host or not port or url.path.strip("/"):
        raise ValueError(f"expected {'udp://host' if url.scheme == 'udp' else 'tcp://host:port'}")

    try:
        return await (reach_udp if url.scheme == "udp" else reach_tcp)(host, port, **given)
    except OSError as error:
        raise ConnectFailed(
            f"cannot reach {url.scheme}://{url.netloc}: {str(error) or 'it hung up'}; is the address right, "
            "and is the arm (or its serial server) in this network?"
        ) from error


async def reach_udp(
    host: str, port: int, *, token: str | None = None, reorder_window: float = REORDER_WINDOW
) -> Transport:
    """Open a UDP socket that sends to one address."""
    datagrams = await anyio.create_connected_udp_socket(host, port)
    tokens = TokenDatagrams(datagrams, greeting(token))
    return StreamTransport(tokens, in_flight=1, window=1, reorder_window=reorder_window)


async def reach_tcp(host: str, port: int, *, token: str | None = None, ca: str | None = None) -> Transport:
    """Open a TCP connection, and say first what has to be said."""
    connection = await connect(host, port, trust(ca) if ca is not None else None)
    connection.write(greeting(token))
    return connection


def greeting(token: str | None) -> bytes:
    """Return what presents a token."""
    return TOKEN_LINE % token.encode() if token else b""


def trust(ca: str | None) -> ssl.SSLContext:
    """Return whom to trust: the certificates in a PEM file, or those that the computer trusts."""
    try:
        return ssl.create_default_context(cafile=None if ca in {None, SYSTEM} else ca)
    except OSError as error:
        raise ValueError(f"ca={ca}: {error}") from None


class TokenDatagrams:
    """Datagrams with a token in each: any of them may be the first that arrives."""

    def __init__(self, datagrams: Any, greeting: bytes) -> None:
        self._datagrams = datagrams
        self._greeting = greeting
        self.receive = datagrams.receive
        self.aclose = datagrams.aclose

    async def send(self, data: bytes) -> None:
        """Send one datagram."""
        await self._datagrams.send(self._greeting + data)
