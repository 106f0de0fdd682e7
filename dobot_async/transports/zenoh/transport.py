"""An arm that is served on Eclipse Zenoh, by its name: `zenoh://left`. Needs the `zenoh` extra.

    open a session --> wait for the arm's token --> ask to be let in --> numbered messages, both ways
                                  `-- it goes: the connection is broken

Each transport is a session of its own, so that its liveliness token says just this: this program, and this connection.
"""

from __future__ import annotations

import asyncio
import json
import os
import socket
from collections import deque
from typing import TYPE_CHECKING, Any
from urllib.parse import SplitResult

import anyio

from dobot_async._core.protocol.transport import MANY, Transport
from dobot_async.errors import ConnectFailed
from dobot_async.transports.network import WINDOW
from dobot_async.transports.zenoh.config import ZenohConfig, library
from dobot_async.transports.zenoh.messages import DATA, END, Lost, Numbered, SendQueue
from dobot_async.transports.zenoh.session import VERSION, KeyExpressions, ZenohSession

if TYPE_CHECKING:
    import zenoh

__all__ = ["ZenohTransport", "open_url"]

PRESENT = 3.0  # seconds until the arm's token must have been seen
LET_IN = 2.0
ASK_AGAIN = 0.1
UNREAD = 1 << 20
"""Bytes that may wait for a program that does not receive them; the connection of one that leaves more is over."""


async def open_url(url: SplitResult, *, arm: str) -> Transport:
    """Opens `zenoh://name`, with `?config=FILE` and `?connect=tcp/host:port[,...]`."""
    place = ZenohConfig.of(url, serving=False)
    transport = ZenohTransport(place)
    try:
        await transport.enter(arm)
    except BaseException:
        with anyio.CancelScope(shield=True):
            await transport.aclose()

        raise

    return transport


class ZenohTransport:
    """A connection to an arm that is served on Zenoh; `enter` comes first."""

    in_flight = MANY
    window = WINDOW
    reorder_window: float = 0.0

    def __init__(self, place: ZenohConfig) -> None:
        self._name = place.name
        self._keys = KeyExpressions(place.name)
        self._session = ZenohSession(place)
        self._link = ""
        self._token: zenoh.LivelinessToken | None = None
        self._up: SendQueue | None = None
        self._down = Numbered()
        self._arrived: deque[bytes] = deque()
        self._unread = 0
        self._servers: set[str] = set()
        self._server: str | None = None
        self._news = asyncio.Event()
        self._broken: Exception | None = None
        self._closing = False

    async def enter(self, arm: str) -> None:
        """Opens the session, waits for the arm, and asks to be let in. After an error, too, it has to be closed.

        Raises:
            ValueError: The configuration is no good.
            ConnectFailed: It is not there, or does not let this program in; the message says what to check.
        """
        await self._session.open(self._begin)
        where = f"zenoh://{self._name}"
        try:
            async with asyncio.timeout(PRESENT):
                await self._until(lambda: bool(self._servers))
        except TimeoutError:
            raise ConnectFailed(
                f"no arm called {self._name} is on Zenoh: is it served, is its address right (?connect=tcp/host:port, "
                "?config=FILE), and may this program in? `dobot-async discover` lists those that it can see"
            ) from None

        known = await self._session.tokens(f"{self._keys.arm}/*/*")
        server = self._only({*self._servers, *known})
        model = server.split("/")[-2]
        if model != arm:
            raise ConnectFailed(f"{where} is a {model}, and not a {arm}")

        refusal = "it does not answer; does Zenoh's access control allow this program to move it?"
        try:
            async with asyncio.timeout(LET_IN):
                while (answer := await self._ask()) != "":
                    refusal = answer or refusal
                    await asyncio.sleep(ASK_AGAIN)
        except TimeoutError:
            raise ConnectFailed(f"{where} does not let this program in: {refusal}") from None

        if self._only(self._servers) != server:
            raise ConnectFailed(f"{where} has just gone")

        self._server = server
        way = self._session.way(f"{self._link}/up", waits=True)
        self._up = SendQueue(way, lambda why: self._break(ConnectionResetError(why)), self._name)

    async def send(self, data: bytes) -> None:
        """Sends bytes, which wait here while the network cannot take them: far more than a link has under way."""
        self._check()
        assert self._up
        self._up.send(data)

    async def receive(self) -> bytes:
        """Returns the bytes of the next message."""
        while True:
            await self._until(lambda: bool(self._arrived) or self._broken is not None or self._closing)
            if not self._arrived or self._closing:
                self._check()

            message = self._arrived.popleft()
            self._unread -= len(message)
            kind, data = self._unpacked(message)
            if kind == END:
                self._arrived.clear()
                self._break(ConnectionResetError(data.decode(errors="replace")))
            elif data:
                return data

    async def aclose(self) -> None:
        """Closes the session, and with it takes back its token."""
        self._closing = True
        self._news.set()
        try:
            if self._up:
                await self._up.aclose()
        finally:
            await self._session.aclose()

    def _begin(self, session: zenoh.Session) -> None:
        """Declares what is needed to be let in."""
        put, cross = library().SampleKind.PUT, self._session.crossing.to
        self._link = f"{self._keys.link}/{session.zid()}"
        session.declare_subscriber(
            f"{self._link}/down",
            cross(self._hear, lambda sample: sample.payload.to_bytes(), lambda message: ("down", len(message))),
        )
        self._token = session.liveliness().declare_token(self._link)
        session.liveliness().declare_subscriber(
            f"{self._keys.arm}/*/*",
            cross(self._notice, lambda sample: (str(sample.key_expr), sample.kind == put)),
            history=True,
        )

    async def _ask(self) -> str | None:
        """Asks to be let in; returns "" if it is, None if nobody answers, or why not."""
        answers: asyncio.Queue[str] = asyncio.Queue()
        who = {"version": VERSION, "who": f"{socket.gethostname()}/{os.getpid()}"}
        self._session.raw.get(
            self._link,
            self._session.crossing.to(answers.put_nowait, read_answer),
            payload=json.dumps(who).encode(),
            timeout=LET_IN,
            congestion_control=library().CongestionControl.BLOCK,
        )
        try:
            async with asyncio.timeout(LET_IN / 4):
                return await answers.get()
        except TimeoutError:
            return None

    def _unpacked(self, message: bytes) -> tuple[int, bytes]:
        """Kind and bytes of a message; a lost one ends the connection, and a doubled one has no bytes."""
        try:
            return self._down.unpack(message) or (DATA, b"")
        except Lost as error:
            return END, str(error).encode()

    def _hear(self, message: bytes) -> None:
        """A message has come; none that comes later counts if one could not be kept."""
        if self._unread + len(message) > UNREAD:
            self._break(ConnectionAbortedError(f"this program left {self._unread} bytes unread"))
        elif not self._broken:
            self._unread += len(message)
            self._arrived.append(message)
            self._news.set()

    def _only(self, servers: set[str]) -> str:
        """The one that serves the arm; raises ConnectFailed if there are more, or none any more."""
        if len(servers) > 1:
            raise ConnectFailed(f"{len(servers)} arms are called {self._name} on Zenoh; rename all but one")

        for server in servers:
            return server

        raise ConnectFailed(f"zenoh://{self._name} has just gone")

    def _notice(self, change: tuple[str, bool]) -> None:
        """A server's token has come or gone."""
        key, present = change
        if present:
            self._servers.add(key)
        else:
            self._servers.discard(key)
            if key == self._server:
                self._break(ConnectionResetError("who served it is not on Zenoh any more, or cannot be reached"))

        self._news.set()

    def _break(self, why: Exception) -> None:
        """It is over; what has arrived before that can still be received."""
        self._broken = self._broken or why
        self._news.set()

    def _check(self) -> None:
        if self._closing:
            raise anyio.ClosedResourceError

        if self._broken:
            raise anyio.BrokenResourceError from self._broken

    async def _until(self, condition: Any) -> None:
        while not condition():
            self._news.clear()
            await self._news.wait()


def read_answer(reply: zenoh.Reply) -> str:
    """Why a server does not let a program in, "" if it does."""
    if reply.err is None:
        return ""

    return reply.err.payload.to_bytes().decode(errors="replace") or "it gives no reason"
