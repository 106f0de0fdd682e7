"""The handshake of tcp and ws: a connection is pending until it is authenticated.

    connected --> PendingConnection --token, or a family's first bytes--> Host.client
                    `-- too late, too many, wrong: turned away

1. Pending connections are `PENDING` a port, TLS that is not agreed upon among them. One more takes the place of the
   oldest from the address that has most of them: who comes last is the likeliest to mean it.
2. Each has `HANDSHAKE` seconds for its token. Without a token only the first bytes decide, whenever they come.
3. Nothing of a pending connection reaches the arm, and no more than `MOST` bytes of it are kept.
"""

from __future__ import annotations

import asyncio
import hmac
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from dobot_async.endpoints.listeners import Host, Peer
from dobot_async.transports.network import LONGEST_TOKEN

__all__ = [
    "HANDSHAKE",
    "LONGEST_LINE",
    "PENDING",
    "TOKEN",
    "Authenticator",
    "Handshakes",
    "PendingConnection",
    "TokenHandshake",
]

HANDSHAKE = 5.0  # seconds
PENDING = 32
TOKEN = b"TOKEN "
LONGEST_LINE = len(TOKEN) + LONGEST_TOKEN + 2
MOST = 8192


@dataclass(frozen=True, slots=True)
class Authenticator:
    """Who is let in.

    Attributes:
        token: What has to be presented; None lets everybody in.
        origins: Web pages that may come without.
        begins: Whether bytes are the beginning of what clients of the arm's family send; None while too few are there.
        refuse: Called with who was not let in, and why.
    """

    token: str | None
    origins: frozenset[str]
    begins: Callable[[bytes], bool | None]
    refuse: Callable[[str, str], None]

    def knows(self, token: bytes) -> bool:
        """Return whether this is the token, in the same time whatever it is; blanks around it do not count."""
        return self.token is None or hmac.compare_digest(token.strip(), self.token.encode())


class Handshakes:
    """The pending connections of one port; a `Host` for whoever listens there.

    Args:
        host: Where connections go that are let in.
        authenticator: Decides who is.
        kind: What a connection is while it is pending, and after that.
    """

    def __init__(self, host: Host[Any], authenticator: Authenticator, kind: type[PendingConnection]) -> None:
        self.host = host
        self.authenticator = authenticator
        self._kind = kind
        self._pending: dict[PendingConnection, str] = {}

    def client(
        self,
        deliver: Callable[[bytes], None],
        disconnect: Callable[[], None],
        *,
        ordered: bool,
        pause_reading: Callable[[bool], None] = lambda _: None,
        name: str = "",
    ) -> PendingConnection:
        """Somebody has connected."""
        connection = self._kind(self, deliver, disconnect, pause_reading, name, ordered=ordered)
        self._pending[connection] = name.rpartition(":")[0]
        if len(self._pending) > PENDING:
            ((most, _),) = Counter(self._pending.values()).most_common(1)
            oldest = next(each for each, address in self._pending.items() if address == most)
            oldest.turn_away("too many others want to come in")

        return connection

    def leave(self, client: PendingConnection) -> None:
        """It has gone."""
        client.close()
        if client.peer:
            self.host.leave(client.peer)

    def close(self) -> None:
        """Hang up on those who are not in yet."""
        for connection in list(self._pending):
            connection.turn_away("the bridge has ended")

    def decided(self, connection: PendingConnection) -> None:
        """A connection is not pending any more."""
        self._pending.pop(connection, None)


class PendingConnection(ABC):
    """One connection, from its beginning to its end.

    Attributes:
        peer: What the host keeps of it, once it was let in.
        name: Who it is, for people.
    """

    patient = False
    """Whether it has all the time that it wants where no token is needed."""

    def __init__(
        self,
        handshakes: Handshakes,
        deliver: Callable[[bytes], None],
        disconnect: Callable[[], None],
        pause_reading: Callable[[bool], None],
        name: str,
        *,
        ordered: bool,
    ) -> None:
        self.peer: Peer | None = None
        self.name = name
        self.authenticator: Authenticator = handshakes.authenticator
        self._handshakes = handshakes
        self._write = deliver
        self._disconnect = disconnect
        self._pause_reading = pause_reading
        self._ordered = ordered
        self._away = False
        self._timer: asyncio.TimerHandle | None = None
        if self.authenticator.token is not None or not self.patient:
            late = "it has not said its token in time" if self.authenticator.token else "it has not come in in time"
            self._timer = asyncio.get_running_loop().call_later(HANDSHAKE, self.turn_away, late)

    def send(self, data: bytes) -> None:
        """It has sent something."""
        if not self._away:
            self.receive(data)

    @abstractmethod
    def receive(self, data: bytes) -> None:
        """Take what it has sent: let it in, turn it away, or pass on what it wants of the host."""

    def deliver(self, data: bytes) -> None:
        """Send it what the host has for it."""
        self._write(data)

    def enter(self) -> Peer:
        """Let it in."""
        self._decided()
        peer: Peer = self._handshakes.host.client(
            self.deliver, self.disconnect, ordered=self._ordered, pause_reading=self._pause_reading, name=self.name
        )
        self.peer = peer
        return peer

    def turn_away(self, reason: str) -> None:
        """Hang up on somebody who is not let in."""
        if not self._away:
            self.authenticator.refuse(self.name, reason)
            self.disconnect()

    def disconnect(self) -> None:
        """End it."""
        if not self._away:
            self.close()
            self._disconnect()

    def close(self) -> None:
        """Ignores what arrives from now on."""
        self._away = True
        self._decided()

    def _decided(self) -> None:
        self._handshakes.decided(self)
        if self._timer:
            self._timer.cancel()
            self._timer = None


class TokenHandshake(PendingConnection):
    """A TCP connection. The first line is the token where one is needed; then, or else at once, come frames.

    Where none is needed a token is taken all the same, for a client may present one everywhere. What begins in another
    way is no client of this arm, but a web browser or TLS, in whose bytes a page can hide a whole frame.
    """

    patient = True

    def __init__(self, *args: Any, **details: Any) -> None:
        super().__init__(*args, **details)
        self._first = bytearray()

    def receive(self, data: bytes) -> None:
        """Look at the first bytes; pass on the others."""
        if self.peer:
            self.peer.send(data)
            return

        self._first += data
        first = bytes(self._first)
        if first.startswith(TOKEN) or TOKEN.startswith(first):
            self._check_token(first)
        elif self.authenticator.token is not None:
            self.turn_away("a wrong token, or none")
        else:
            self._check_beginning(first)

    def _check_token(self, first: bytes) -> None:
        line, end, rest = first.partition(b"\n")
        if len(line) > LONGEST_LINE or (end and not self.authenticator.knows(line.removeprefix(TOKEN))):
            self.turn_away("a wrong token, or none")
        elif end:
            peer = self.enter()
            if rest:
                peer.send(rest)

    def _check_beginning(self, first: bytes) -> None:
        begins = self.authenticator.begins(first)
        if begins:
            self.enter().send(first)
        elif begins is False or len(first) > MOST:
            self.turn_away("what it says is nothing that this arm is told; does it speak HTTP, or TLS?")
