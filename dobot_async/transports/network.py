"""TCP and UDP: anyio's own sockets, with a token and TLS where a bridge asks for them.

UDP carries the arm's serial stream in datagrams, which may be lost, doubled, merged and split: it is parsed as a stream
like any other, one request is under way at a time, and a lost one is silence.
"""

from __future__ import annotations

import ssl
from typing import Any
from urllib.parse import SplitResult

import anyio
from anyio.abc import SocketAttribute

from dobot_async.errors import ConnectFailed
from dobot_async.transports.base import MANY, Transport, Wrapped, options

__all__ = ["UDP_PORT", "open_url", "secret", "trust"]

UDP_PORT = 8899
WINDOW = 16
DISORDER = 0.015  # seconds; one access point keeps datagrams in order, and doubles them within a few milliseconds
TOKEN_LINE = b"TOKEN %s\n"
SYSTEM = "system"
ENDS = SocketAttribute.local_address, SocketAttribute.remote_address


async def open_url(url: SplitResult, *, arm: str) -> Transport:  # noqa: ARG001 - for `sim:`
    """Opens `udp://host[:8899]` or `tcp://host:port`.

    Both take `?token=`, which a bridge asks for. `?disorder=` says if a network is worse than `DISORDER`; `?ca=` turns
    TLS on: a PEM file with the certificate to trust, or "system" for those that the computer trusts.
    """
    known: dict[str, Any] = {"disorder": float} if url.scheme == "udp" else {"ca": str}
    given = options(url, {**known, "token": secret})
    host, port = url.hostname, url.port
    if not host or url.path.strip("/") or port == 0 or (url.scheme == "tcp" and port is None):
        raise ValueError(f"expected {'udp://host' if url.scheme == 'udp' else 'tcp://host:port'}")

    greeting = TOKEN_LINE % given["token"].encode() if "token" in given else b""
    place = f"{url.scheme}://{url.netloc}"
    try:
        if url.scheme == "udp":
            datagrams = await anyio.create_connected_udp_socket(host, port or UDP_PORT)
            disorder = given.get("disorder", DISORDER)
            return Wrapped(Presenting(datagrams, greeting), in_flight=1, window=1, disorder=disorder)

        return await connect(host, port or 0, given.get("ca"), greeting)
    except OSError as error:
        raise ConnectFailed(
            f"cannot reach {place}: {error}; is the address right, "
            "and is the arm (or its serial server) in this network?"
        ) from error


async def connect(host: str, port: int, ca: str | None, greeting: bytes) -> Transport:
    """Opens a TCP connection, and says first what has to be said."""
    stream: Any
    if ca is None:
        stream = await anyio.connect_tcp(host, port)
    else:
        stream = await anyio.connect_tcp(
            host, port, tls=True, ssl_context=trust(ca), tls_standard_compatible=False, tls_hostname=host
        )

    ends = {stream.extra(end, None) for end in ENDS}  # noqa: S610 - not Django's; who hung up at once has no address
    if len(ends) == 1:
        # Where nobody listens on this computer, the system may give the caller the very port that it calls.
        await anyio.aclose_forcefully(stream)
        raise ConnectionRefusedError("nobody listens there, and the connection met itself")

    if greeting:
        try:
            await stream.send(greeting)
        except BaseException as error:
            await anyio.aclose_forcefully(stream)
            if isinstance(error, anyio.BrokenResourceError):
                raise ConnectionResetError("it hung up") from error

            raise

    return Wrapped(stream, in_flight=MANY, window=WINDOW)


def secret(token: str) -> str:
    """Returns a token as it may be presented; raises ValueError for one that is no word."""
    if not token.isascii() or not token.isprintable() or not token or " " in token:
        raise ValueError

    return token


def trust(ca: str | None) -> ssl.SSLContext:
    """Returns whom to trust: the certificates in a PEM file, or those that the computer trusts."""
    try:
        return ssl.create_default_context(cafile=None if ca in {None, SYSTEM} else ca)
    except OSError as error:
        raise ValueError(f"ca={ca}: {error}") from None


class Presenting:
    """Datagrams with a token in each: any of them may be the first that arrives."""

    def __init__(self, datagrams: Any, greeting: bytes) -> None:
        self._datagrams = datagrams
        self._greeting = greeting
        self.receive = datagrams.receive
        self.aclose = datagrams.aclose

    async def send(self, data: bytes) -> None:
        """Sends one datagram."""
        await self._datagrams.send(self._greeting + data)
