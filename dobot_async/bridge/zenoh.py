"""The Zenoh listener: an arm under a name, found by its liveliness token; see `dobot_async.transports.zenoh.session`.

    token of a client + its query --> let in --> messages --> Host.client(...).send
    its token goes                --> Host.leave, as if a line were cut

Nothing here waits for a client: what it is answered goes by way of its own `SendQueue`, and whatever else it is told is
little, and dropped if Zenoh cannot take it at once.
"""

from __future__ import annotations

import asyncio
import json
import re
import socket
from collections.abc import Callable
from contextlib import AsyncExitStack, suppress
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any
from urllib.parse import SplitResult

from dobot_async._core.util.tasks import run_shielded
from dobot_async._core.util.text import printable
from dobot_async.bridge.client import Client
from dobot_async.bridge.limits import Allowance
from dobot_async.bridge.service import Bridge
from dobot_async.bridge.telemetry import Telemetry
from dobot_async.errors import ConnectFailed
from dobot_async.transports.zenoh.config import ZenohConfig, address, library
from dobot_async.transports.zenoh.messages import DATA, END, Lost, Numbered, SendQueue
from dobot_async.transports.zenoh.session import VERSION, KeyExpressions, ZenohSession
from dobot_async.transports.zenoh.typed import LivelinessToken, answering, declared

if TYPE_CHECKING:
    import zenoh

__all__ = ["on_zenoh"]

HELD = 65_536
"""Bytes that are kept of a client that has to wait; one that sends more than that is cut off."""

GIVES_WAY = 1.0  # seconds until one of two that began at the same time has taken its token back
PRESENT = 1024  # tokens of clients that are kept; those of clients that are let in always
CHUNK = re.compile(r"[^*$/]{1,64}")
UNAUTHENTICATED = 100  # answers a second to those who are no clients, all together
LONGEST_NAME, LONGEST_INTRODUCTION = 80, 1024
EVERYWHERE = {"/0.0.0.0:": "/127.0.0.1:", "/[::]:": "/[::1]:"}


async def on_zenoh(bridge: Bridge[Any], stack: AsyncExitStack, url: SplitResult) -> str:
    """Serves an arm on Zenoh until the stack is closed; returns the URL for clients on this computer."""
    place = ZenohConfig.of(url, serving=True)
    place = replace(place, listen=tuple(map(with_port, place.listen)))
    listener = ZenohListener(bridge, place)
    stack.push_async_callback(listener.aclose)
    await listener.open()
    telemetry = Telemetry(bridge, listener.session, listener.keys)
    stack.push_async_callback(telemetry.aclose)
    telemetry.start()
    return address(place.name, connect=tuple(map(reachable, place.listen or place.connect)))


def with_port(endpoint: str) -> str:
    """An endpoint with a free port in place of 0: Zenoh would not tell which one it takes."""
    before, colon, port = endpoint.rpartition(":")
    if colon and port == "0":
        with socket.socket(socket.AF_INET6 if "[" in before else socket.AF_INET) as probe:
            probe.bind((before.partition("/")[2].strip("[]"), 0))
            return f"{before}:{probe.getsockname()[1]}"

    return endpoint


def reachable(endpoint: str) -> str:
    """Where a client on this computer finds what listens at an endpoint."""
    for everywhere, here in EVERYWHERE.items():
        endpoint = endpoint.replace(everywhere, here)

    return endpoint


class ZenohListener:
    """Lets clients in.

    Attributes:
        bridge: Where they go in.
        session: The session.
        keys: The keys of the arm.
    """

    def __init__(self, bridge: Bridge[Any], place: ZenohConfig) -> None:
        self.keys: KeyExpressions = KeyExpressions(place.name)
        self.session: ZenohSession = ZenohSession(place, serving=True)
        self.bridge = bridge
        self._name = place.name
        self._present: dict[str, None] = {}
        self._connections: dict[str, ZenohConnection] = {}
        self._leaving: set[asyncio.Task[None]] = set()
        self._told = Allowance(UNAUTHENTICATED, asyncio.get_running_loop().time)
        self._token: LivelinessToken | None = None

    async def open(self) -> None:
        """Opens the session, listens for clients, and then lets everybody know of the arm.

        Raises:
            ValueError: The configuration is no good.
            ConnectFailed: Zenoh cannot be started, or there is an arm of that name.
        """
        await self.session.open(self._begin)
        if await self._others():
            raise ConnectFailed(self._taken())

        # Another one may have looked at the same time. Who comes behind sees both now; where both do, one gives way.
        key = f"{self.keys.arm}/{self.bridge.family.model}/{self.session.id}"
        self._token = declared(self.session.raw.liveliness().declare_token(key))
        others = await self._others()
        if others and self.session.id < min(others):
            await asyncio.sleep(GIVES_WAY)
            others = await self._others()

        if others:
            self._token.undeclare()
            raise ConnectFailed(self._taken())

    async def aclose(self) -> None:
        """Tells all clients, takes back the name, and ends the session; takes a few seconds at most."""
        self.session.crossing.close()
        for connection in list(self._connections.values()):
            self.leave(connection, "the arm is not served any more")

        await run_shielded(self._end())

    def way(self, name: str, *, waits: bool) -> Callable[[bytes], None]:
        """Returns the way to a client."""
        return self.session.way(f"{self.keys.link}/{name}/down", waits=waits)

    def cut(self, connection: ZenohConnection, why: str) -> None:
        """Ends the connection of a client that does what it must not."""
        if self._connections.get(connection.name) is connection:
            self.bridge.cut(connection.peer, why)
            self.leave(connection, why)

    def leave(self, connection: ZenohConnection, why: str) -> None:
        """Ends the connection of a client, as far as there is one."""
        if self._connections.get(connection.name) is connection:
            del self._connections[connection.name]
            self.bridge.leave(connection.peer)
            connection.outbox.end(why)
            leaving = asyncio.create_task(
                connection.outbox.aclose(), name=f"dobot_async zenoh teardown {connection.name}"
            )
            self._leaving.add(leaving)
            leaving.add_done_callback(self._leaving.discard)

    async def _others(self) -> set[str]:
        """The ids of those who serve an arm of this name as well."""
        return {token.rpartition("/")[2] for token in await self.session.tokens(f"{self.keys.arm}/*/*")} - {
            self.session.id
        }

    def _taken(self) -> str:
        return f"an arm called {self._name} is on Zenoh already; give this one another name"

    async def _end(self) -> None:
        if self._leaving:
            await asyncio.wait(self._leaving)

        await self.session.aclose()

    def _begin(self, session: zenoh.Session) -> None:
        """Listens for clients, before they can know of the arm."""
        put, cross, link = library().SampleKind.PUT, self.session.crossing.to, self.keys.link
        session.declare_subscriber(f"{link}/*/up", cross(self._heard, read_message, self._weigh))
        session.declare_queryable(f"{link}/*", cross(self._asked, lambda query: query))
        session.liveliness().declare_subscriber(
            f"{link}/*", cross(self._notice, lambda sample: (last(sample.key_expr), sample.kind == put)), history=True
        )

    def _weigh(self, message: tuple[str, bytes]) -> tuple[str, int]:
        """The sender whose share of the input a message takes; all peers that are no clients share one."""
        name, data = message
        return name if name in self._connections else "", len(data)

    def _notice(self, change: tuple[str, bool]) -> None:
        """A client's token has come or gone."""
        name, present = change
        if present and CHUNK.fullmatch(name):
            self._present[name] = None
            if len(self._present) > PRESENT:
                del self._present[next(each for each in self._present if each not in self._connections)]
        elif not present:
            self._present.pop(name, None)
            connection = self._connections.get(name)
            if connection:
                self.leave(connection, "its token has gone")

    def _asked(self, query: zenoh.Query) -> None:
        """Somebody wants to be let in; asks again if the answer does not arrive."""
        if not self._may_tell():
            return

        name = last(query.key_expr)
        given, answer = introduction(query), answering(query)
        if given is None:
            answer.reply_err(f"this server speaks version {VERSION}; bring both to one release".encode())
        elif name not in self._present:
            answer.reply_err(b"its liveliness token has not been seen")
        else:
            if name not in self._connections:
                self._connections[name] = ZenohConnection(self, name, f"zenoh:{given}")

            answer.reply(query.key_expr, b"")

    def _heard(self, message: tuple[str, bytes]) -> None:
        """A client has sent something; who is none any more, or not yet, is told so.

        A name with a wildcard is not answered: it would be all clients at once.
        """
        name, data = message
        connection = self._connections.get(name)
        if connection:
            connection.send(data)
        elif CHUNK.fullmatch(name) and self._may_tell():
            with suppress(library().ZError):
                self.way(name, waits=False)(Numbered().pack(b"its connection has ended", END))

    def _may_tell(self) -> bool:
        """Whether somebody who is no client can be answered: not everybody who asks without end."""
        if self._told.wait:
            return False

        self._told.spend(1)
        return True


class ZenohConnection:
    """A client that was let in.

    Attributes:
        name: The name of its keys.
        outbox: What goes to it.
        peer: What the bridge keeps of it.
    """

    def __init__(self, listener: ZenohListener, name: str, shown: str) -> None:
        self.name = name
        self.outbox: SendQueue = SendQueue(listener.way(name, waits=True), partial(listener.cut, self), name)
        self._listener = listener
        self._numbers = Numbered()
        self._held = False
        self._waiting = bytearray()
        self.peer: Client[Any] = listener.bridge.client(
            self.outbox.send, self._disconnect, ordered=True, pause_reading=self._pause_reading, name=shown
        )

    def send(self, message: bytes) -> None:
        """It has sent something."""
        try:
            taken = self._numbers.unpack(message)
        except Lost as error:
            self._listener.cut(self, str(error))
            return

        if taken and taken[0] == DATA:
            self._waiting += taken[1]
            self._pass_on()
            if len(self._waiting) > HELD:
                self._listener.cut(self, "it sends more than it may")

    def _disconnect(self) -> None:
        """Ends its connection soon."""
        asyncio.get_running_loop().call_soon(self._listener.leave, self, "the bridge has ended this connection")

    def _pause_reading(self, held: bool) -> None:
        """Keeps what it sends, or passes it on again."""
        self._held = held
        self._pass_on()

    def _pass_on(self) -> None:
        if self._waiting and not self._held:
            data = bytes(self._waiting)
            self._waiting.clear()
            self.peer.send(data)


def introduction(query: zenoh.Query) -> str | None:
    """What a client calls itself, for people; None if it speaks another version."""
    payload = query.payload.to_bytes() if query.payload else b""
    with suppress(ValueError, AttributeError, RecursionError):
        told: Any = json.loads(payload) if len(payload) <= LONGEST_INTRODUCTION else {}
        if told.get("version") == VERSION:
            return printable(str(told.get("who", "")), LONGEST_NAME)

    return None


def read_message(sample: zenoh.Sample) -> tuple[str, bytes]:
    """Who has sent a message, and the message."""
    return str(sample.key_expr).split("/")[-2], sample.payload.to_bytes()


def last(key: zenoh.KeyExpr) -> str:
    """The last chunk of a key."""
    return str(key).rpartition("/")[2]
