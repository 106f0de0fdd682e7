"""TCP and UDP, with a token and TLS where a bridge asks for them.

UDP carries the arm's serial stream in datagrams, which may be lost, doubled, merged and split: it is parsed as a stream
like any other, one request is under way at a time, and a lost one is silence.
"""

from __future__ import annotations

import ssl
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any
from urllib.parse import SplitResult

import anyio
from anyio.abc import ConnectedUDPSocket

from dobot_async._core.protocol.transport import Transport
from dobot_async.errors import ConnectFailed
from dobot_async.transports.byte_stream import WINDOW
from dobot_async.transports.options import Option, number, options, words
from dobot_async.transports.stream import StreamTransport
from dobot_async.transports.tcp import connect

__all__ = ["CA", "LONGEST_TOKEN", "TOKENS", "UDP_PORT", "WINDOW", "open_url", "secret", "token_in", "token_of", "trust"]

UDP_PORT = 8899
REORDER_WINDOW = 0.015  # seconds; one access point keeps datagrams in order, and doubles them within a few milliseconds
TOKEN_LINE = b"TOKEN %s\n"
SYSTEM = "system"
LONGEST_TOKEN = 200
"""Characters; with a frame behind it a token still fits into one datagram of any network."""
LARGEST_FILE = 4096
"""Bytes of a token file; one that has more is none."""


def secret(token: str) -> str:
    """Return a token as it may be presented; raise ValueError for one that is no word, or too long."""
    if not token.isascii() or not token.isprintable() or not 0 < len(token) <= LONGEST_TOKEN or " " in token:
        raise ValueError

    return token


def token_in(file: str | Path) -> str:
    """Return the token in a file, blanks and ends of lines around it left out.

    Raises:
        ValueError: There is no such file, or no token in it; the message shows nothing of what is.
    """
    try:
        with Path(file).open("rb") as opened:  # which may be one without an end
            found = opened.read(LARGEST_FILE + 1)

        return secret(found.decode("ascii").strip() if len(found) <= LARGEST_FILE else "")
    except OSError as error:
        raise ValueError(f"cannot read the token file {file}: {error.strerror}") from None
    except ValueError:
        raise ValueError(f"{file} has no token: {TOKEN.expected}") from None


def token_of(given: dict[str, Any]) -> str | None:
    """Take `token` or `token_file` out of the options of a URL; return the token, None if there is none."""
    file = given.pop("token_file", None)
    if file is not None and "token" in given:
        raise ValueError("give token or token_file, not both")

    token: str | None = given.pop("token", None)
    return token if file is None else token_in(file)


TOKEN = Option(secret, f"a word of printable ASCII without blanks, {LONGEST_TOKEN} characters at most", secret=True)
TOKENS = {"token": TOKEN, "token_file": Option(words, "a file with the token")}
CA = Option(words, "a PEM file, or system")
OPTIONS: dict[str, dict[str, Option]] = {
    "udp": {"reorder_window": number(float, "seconds", least=0, most=10), **TOKENS},
    "tcp": {"ca": CA, **TOKENS},
}


async def open_url(url: SplitResult, *, arm: str) -> Transport:  # noqa: ARG001 - for `sim:`
    """Open `udp://host[:8899]` or `tcp://host:port`.

    Both take `?token=` or `?token_file=`, which a bridge asks for. `?reorder_window=` says if a network is worse than
    `REORDER_WINDOW`; `?ca=` turns TLS on: a PEM file with the certificate to trust, or "system" for those that the
    computer trusts.
    """
    given = options(url, OPTIONS[url.scheme])
    token = token_of(given)
    host = url.hostname
    port = UDP_PORT if url.scheme == "udp" and url.port is None else url.port
    if not host or not port or url.path.strip("/") or "@" in url.netloc:
        raise ValueError(
            f"expected {'udp://host' if url.scheme == 'udp' else 'tcp://host:port'}, and ?token= for a token"
        )

    try:
        return await (reach_udp if url.scheme == "udp" else reach_tcp)(host, port, token=token, **given)
    except OSError as error:
        raise ConnectFailed(
            f"cannot reach {url.scheme}://{url.netloc}: {str(error) or 'the connection was closed'}; is the address "
            "right, and is the arm (or its serial server) in this network?"
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

    def __init__(self, datagrams: ConnectedUDPSocket, greeting: bytes) -> None:
        self._datagrams = datagrams
        self._greeting = greeting
        self.receive: Callable[[], Coroutine[Any, Any, bytes]] = datagrams.receive
        self.aclose: Callable[[], Coroutine[Any, Any, None]] = datagrams.aclose

    async def send(self, data: bytes) -> None:
        """Send one datagram."""
        await self._datagrams.send(self._greeting + data)
