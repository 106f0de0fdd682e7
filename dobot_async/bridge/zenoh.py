"""The Zenoh door: an arm under a name, found by its liveliness token; see `dobot_async.transports.zenoh_session`.

    token of a client + its query --> let in --> messages --> Host.client(...).send
    its token goes                --> Host.leave, as if a line were cut

Nothing here waits for a client: an answer that Zenoh cannot take at once is dropped, and the client then finds that a
message is missing, and takes the connection for broken.
"""

from __future__ import annotations

import asyncio
import json
import socket
from contextlib import AsyncExitStack, suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any
from urllib.parse import SplitResult

from dobot_async.bridge.client import Client
from dobot_async.bridge.service import Bridge
from dobot_async.bridge.telemetry import Telemetry
from dobot_async.errors import ConnectFailed
from dobot_async.transports.zenoh_place import Place, address, library
from dobot_async.transports.zenoh_session import DATA, END, VERSION, Keys, Lost, Numbered, Session

if TYPE_CHECKING:
    import zenoh

__all__ = ["on_zenoh"]

HELD = 65_536
"""Bytes that are kept of a client that has to wait; one that sends more than that is cut off."""

LONGEST_NAME = 80
EVERYWHERE = {"/0.0.0.0:": "/127.0.0.1:", "/[::]:": "/[::1]:"}


async def on_zenoh(bridge: Bridge[Any], stack: AsyncExitStack, url: SplitResult) -> str:
    """Serves an arm on Zenoh until the stack is closed; returns the URL for clients on this computer."""
    place = Place.of(url, serving=True)
    place = replace(place, listen=tuple(map(with_port, place.listen)))
    door = Door(bridge, place)
    stack.push_async_callback(door.aclose)
    await door.open()
    telemetry = Telemetry(bridge, door.session, door.keys)
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


class Door:
    """Lets clients in.

    Attributes:
        session: The session.
        keys: The keys of the arm.
    """

    def __init__(self, bridge: Bridge[Any], place: Place) -> None:
        self.keys = Keys(place.name)
        self._bridge = bridge
        self.session = Session(place, serving=True)
        self._name = place.name
        self._present: set[str] = set()
        self._guests: dict[str, Guest] = {}
        self._token: zenoh.LivelinessToken | None = None

    async def open(self) -> None:
        """Opens the session, listens for clients, and then lets everybody know of the arm.

        Raises:
            ValueError: The configuration is no good.
            ConnectFailed: Zenoh cannot be started, or there is an arm of that name.
        """
        await self.session.open(self._begin)
        if await self.session.tokens(f"{self.keys.arm}/*/*"):
            raise ConnectFailed(f"an arm called {self._name} is on Zenoh already; give this one another name")

        key = f"{self.keys.arm}/{self._bridge.family.model}/{self.session.id}"
        self._token = self.session.raw.liveliness().declare_token(key)

    async def aclose(self) -> None:
        """Takes back the name, and ends the session."""
        for name in list(self._guests):
            self.leave(name, "the arm is not served any more")

        await self.session.aclose()

    def _begin(self, session: zenoh.Session) -> None:
        """Listens for clients, before they can know of the arm."""
        put, cross, link = library().SampleKind.PUT, self.session.crossing.to, self.keys.link
        session.declare_subscriber(f"{link}/*/up", self._messages())
        session.declare_queryable(f"{link}/*", cross(self._asked, lambda query: query))
        session.liveliness().declare_subscriber(
            f"{link}/*", cross(self._notice, lambda sample: (last(sample.key_expr), sample.kind == put)), history=True
        )

    def _messages(self) -> Any:
        """The handler of what clients send; each message counts with its size."""

        def read(sample: zenoh.Sample) -> tuple[str, bytes]:
            return str(sample.key_expr).split("/")[-2], sample.payload.to_bytes()

        return self.session.crossing.to(self._heard, read, lambda message: (message[0], len(message[1])))

    def _notice(self, change: tuple[str, bool]) -> None:
        """A client's token has come or gone."""
        name, present = change
        if present:
            self._present.add(name)
        else:
            self._present.discard(name)
            self.leave(name, "its token has gone")

    def _asked(self, query: zenoh.Query) -> None:
        """Somebody wants to be let in; asks again if the answer does not arrive."""
        name = last(query.key_expr)
        given = introduction(query)
        if given is None:
            query.reply_err(f"this server speaks version {VERSION}; bring both to one release".encode())
        elif name not in self._present:
            query.reply_err(b"its liveliness token has not been seen")
        else:
            if name not in self._guests:
                self._guests[name] = Guest(self, name, f"zenoh:{given}")

            query.reply(query.key_expr, b"")

    def _heard(self, message: tuple[str, bytes]) -> None:
        """A client has sent something; who is none any more, or not yet, is told so."""
        name, data = message
        guest = self._guests.get(name)
        if guest:
            guest.send(data)
        else:
            self.put(name, Numbered().pack(b"its connection has ended", END))

    def put(self, name: str, message: bytes) -> None:
        """Sends a message to a client; drops it if Zenoh cannot take it."""
        with suppress(library().ZError):
            self.session.put(f"{self.keys.link}/{name}/down", message, waits=False)

    def leave(self, name: str, why: str) -> None:
        """Ends the connection of a client, as far as there is one."""
        guest = self._guests.pop(name, None)
        if guest:
            self.put(name, guest.farewell(why))
            self._bridge.leave(guest.peer)

    def client(self, guest: Guest, name: str) -> Client[Any]:
        """What the bridge keeps of a client."""
        return self._bridge.client(guest.deliver, guest.hang_up, ordered=True, hold=guest.hold, name=name)


class Guest:
    """A client that was let in.

    Attributes:
        peer: What the bridge keeps of it.
    """

    def __init__(self, door: Door, name: str, shown: str) -> None:
        self._door = door
        self._name = name
        self._up = Numbered()
        self._down = Numbered()
        self._held = False
        self._waiting = bytearray()
        self._ended = False
        self.peer = door.client(self, shown)

    def send(self, message: bytes) -> None:
        """It has sent something."""
        try:
            taken = self._up.unpack(message)
        except Lost as error:
            self._door.leave(self._name, str(error))
            return

        if taken and taken[0] == DATA:
            self._waiting += taken[1]
            self._pass_on()
            if len(self._waiting) > HELD:
                self._door.leave(self._name, "it sends more than it may")

    def deliver(self, data: bytes) -> None:
        """Sends it something."""
        if not self._ended:
            self._door.put(self._name, self._down.pack(data))

    def hang_up(self) -> None:
        """Ends its connection soon."""
        asyncio.get_running_loop().call_soon(self._door.leave, self._name, "the bridge has ended this connection")

    def hold(self, held: bool) -> None:
        """Keeps what it sends, or passes it on again."""
        self._held = held
        self._pass_on()

    def farewell(self, why: str) -> bytes:
        """Returns the last message."""
        self._ended = True
        return self._down.pack(why.encode(), END)

    def _pass_on(self) -> None:
        if self._waiting and not self._held:
            data = bytes(self._waiting)
            self._waiting.clear()
            self.peer.send(data)


def introduction(query: zenoh.Query) -> str | None:
    """What a client calls itself, for people; None if it speaks another version."""
    with suppress(ValueError, TypeError, AttributeError):
        told = json.loads(query.payload.to_bytes() if query.payload else b"")
        if told.get("version") == VERSION:
            return printable(str(told.get("who", "")))[:LONGEST_NAME]

    return None


def printable(text: str) -> str:
    """What a client calls itself, without anything that a terminal would obey."""
    return "".join(character if character.isprintable() else "?" for character in text)


def last(key: zenoh.KeyExpr) -> str:
    """The last chunk of a key."""
    return str(key).rpartition("/")[2]
