"""The bridge itself: one link to the arm, many clients, and the lease that says whose motion it is.

    client --Request--> refused?  denied, or somebody else moves the arm, or a stop came before it was sent
                          |
                          +- read   --> link, one of each key at a time, from one client after the other
                          +- write  --> lease --> link, in the client's order, sent once
                          `- stop   --> link, ahead of everything; what waits to be written is thrown away
    client <-- the reply, and nobody else gets it

The lease is taken with the first write and ends with the connection. If the arm is then in the middle of a motion it
is stopped, and until it has heard that nobody else may write. A stop by somebody else ends the lease and its
holder's connection, too: a program whose motion was stopped behind its back must not take it for done.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Collection, Coroutine
from contextlib import suppress
from functools import partial
from typing import Any, Generic, Literal, TypeVar

from dobot_async._core.link.admission import Priority
from dobot_async._core.link.link import Link
from dobot_async._core.protocol.contract import Frame, LinkState
from dobot_async._core.util.events import Events
from dobot_async.arms.bridge_adapter import BridgeAdapter, RequestKind
from dobot_async.bridge.client import Client
from dobot_async.bridge.events import BridgeEvent, BridgeLog
from dobot_async.bridge.lease import Lease
from dobot_async.bridge.limits import Limits
from dobot_async.bridge.line import ArmLink
from dobot_async.bridge.requests import ClientRequest, Refused
from dobot_async.bridge.standstill import Standstill
from dobot_async.errors import ProtocolError, ReplyTimeout

__all__ = ["Bridge"]

F = TypeVar("F", bound=Frame)
TEARDOWN = 1.5  # seconds: with the closing of the link that is 2, for who is cancelled


class Bridge(Generic[F]):
    """A bridge that runs; made by `bridge`.

    Attributes:
        urls: Where it can be reached, in the order in which that was asked for.
        token: What clients have to present on anything but this computer's own addresses; None if nothing.
        family: How the arm is bridged.
        link: The way to the arm.
        events: What happens, as `BridgeEvent`s.
        stops: How often something stopped the arm.
    """

    def __init__(
        self,
        link: Link[F],
        family: BridgeAdapter[F],
        *,
        takeover: bool,
        on_vanish: Literal["stop", "leave"],
        denied: Collection[Any],
        limits: Limits,
    ) -> None:
        self.urls: tuple[str, ...] = ()
        self.token: str | None = None
        self.link = link
        self._log = BridgeLog()
        self.events: Events[BridgeEvent] = self._log.events
        self.stops: int = 0
        self.family = family
        self._denied = denied
        self._limits = limits
        self._clients: set[Client[F]] = set()
        self._ended = False
        self._line = ArmLink(link, family)
        leave = Standstill(self._line, family, self._tell).reach if on_vanish == "stop" else let_finish
        self._lease = Lease(takeover=takeover, leave=leave, cut=self.cut, tell=self._tell)
        self._teardowns: set[asyncio.Task[None]] = set()
        link.on_unsolicited.add(self._unasked)
        self._watching = asyncio.create_task(self._watch_link(), name="dobot_async bridge link")

    @property
    def url(self) -> str:
        """Where it can be reached: the first of `urls`."""
        return self.urls[0]

    @property
    def holder(self) -> str | None:
        """Who may move the arm, None while nobody does."""
        return self._lease.holder.name if self._lease.holder else None

    @property
    def clients(self) -> int:
        """How many there are."""
        return len(self._clients)

    def moving(self, reply: F) -> bool | None:
        """Returns whether the arm is in the middle of what its mover told it, None while nobody may move it.

        Args:
            reply: The arm's answer to the question of a `Watch`.
        """
        return self._lease.holder.watch.moving(reply) if self._lease.holder else None

    async def ask(self, frame: F) -> F:
        """Returns the arm's reply to a read of the bridge's own; raises DobotError if there is none."""
        return await self._line.ask(frame)

    def client(
        self,
        deliver: Callable[[bytes], None],
        disconnect: Callable[[], None],
        *,
        ordered: bool,
        pause_reading: Callable[[bool], None] = lambda _: None,
        name: str = "",
    ) -> Client[F]:
        """Called by a listener: somebody was let in."""
        client = Client(
            self,
            self.family,
            deliver,
            disconnect,
            pause_reading=pause_reading,
            name=name,
            ordered=ordered,
            limits=self._limits,
        )
        self._clients.add(client)
        if self._ended or len(self._clients) > self._limits.clients:
            reason = "the bridge has ended" if self._ended else "there are too many clients"
            asyncio.get_running_loop().call_soon(self.cut, client, reason)
        else:
            self._tell("connected", client)

        return client

    def leave(self, client: Client[F]) -> None:
        """Called by a listener: a client has gone."""
        if client.left:
            return

        client.leave()
        self._begin(self._teardown(client))

    def cut(self, client: Client[F], reason: str) -> None:
        """Ends a connection."""
        self._tell("cut", client, reason)
        client.dismiss()
        self._begin(self._lease.end(client))  # a datagram client leaves later

    def refused(self, client: Client[F], name: str, reason: str) -> None:
        """Takes note that a request was not passed on."""
        self._tell("refused", client, f"{name}: {reason}")

    def turned_away(self, name: str, reason: str) -> None:
        """Takes note that somebody was not let in."""
        self._tell("turned away", name, reason)

    async def answer(self, client: Client[F], request: ClientRequest[F]) -> F | None:
        """Returns the arm's reply; raises Refused, or DobotError if there should be one."""
        if self.family.subject(request.frame) in self._denied:
            raise Refused("it is denied here")

        try:
            self.family.check(request.frame)
        except ProtocolError as error:
            raise Refused(str(error)) from None

        try:
            return await self._pass_on(client, request)
        except ReplyTimeout:
            if self.family.ack_optional(request.frame):
                return None

            raise

    def end(self) -> None:
        """Ends all connections, and takes no more."""
        self._ended = True
        for client in list(self._clients):
            client.dismiss()
            self.leave(client)

    async def aclose(self) -> None:
        """Stops the arm if it moves for somebody, and ends everything; takes a few seconds at most."""
        with suppress(TimeoutError):
            async with asyncio.timeout(TEARDOWN):
                while self._teardowns:
                    await asyncio.wait(self._teardowns)

        for task in [self._watching, *self._teardowns]:
            task.cancel()

        await asyncio.wait([self._watching, *self._teardowns])
        for client in list(self._clients):
            await client.aclose()

        self.events.close()
        await self.link.aclose()

    async def _pass_on(self, client: Client[F], request: ClientRequest[F]) -> F:
        """Passes a request on in the way of its kind."""
        frame = request.frame
        if request.kind is RequestKind.STOP:
            return await self._stop(client, frame)

        if request.kind is RequestKind.OFF:
            return await self._urge(client, frame)

        await client.take_turn(request)
        try:
            return await (self._write if request.kind is RequestKind.WRITE else self._read)(client, request)
        finally:
            client.end_turn(request)

    async def _read(self, client: Client[F], request: ClientRequest[F]) -> F:
        """Passes on what changes nothing."""
        frame = request.frame
        if not client.reads.try_acquire(frame.key, Priority.IMMEDIATE):
            await client.reads.acquire(frame.key, Priority.IMMEDIATE)

        try:
            return await self._line.ask(frame, ready=partial(client.sending, request))
        finally:
            client.reads.release(frame.key, Priority.IMMEDIATE)

    async def _stop(self, client: Client[F], frame: F) -> F:
        """Passes on what stops the arm; nothing that was to be written before it is sent after it."""
        self.stops += 1
        holder = self._lease.holder
        if holder and holder is not client and not holder.gone:
            self.cut(holder, f"{client.name} has stopped the arm")

        return await self._urge(client, frame)

    async def _urge(self, client: Client[F], frame: F) -> F:
        """Passes something on ahead of everything else."""
        client.watch.sent(frame)
        reply = await self._line.ask(frame, urgent=True)
        client.watch.answered(frame, reply)
        return reply

    async def _write(self, client: Client[F], request: ClientRequest[F]) -> F:
        """Passes on what changes something, once, for the holder of the lease."""
        frame = request.frame
        await self._lease.take(client)

        def ready() -> None:
            if client.gone or self._lease.holder is not client:
                raise Refused("the lease has ended")

            if request.stops != self.stops:
                raise Refused("the arm was stopped before it was sent")

            client.end_turn(request)
            client.watch.sent(frame)

        reply = await self._line.ask(frame, ready=ready)
        client.watch.answered(frame, reply)
        return reply

    def _unasked(self, frame: F) -> None:
        """The arm has said something that nobody waits for."""
        if self._lease.holder and self.family.is_unsolicited(frame):
            self._lease.holder.tell(bytes(frame))

    async def _teardown(self, client: Client[F]) -> None:
        """Ends the lease of a client that has gone, and lets its last requests end."""
        try:
            await self._lease.end(client)
            await client.settled()
        finally:
            self._tell("left", client)
            await client.aclose()
            self._clients.discard(client)

    def _begin(self, work: Coroutine[Any, Any, None]) -> None:
        """Begins with what the end of the bridge waits for."""
        task = asyncio.create_task(work, name="dobot_async bridge teardown")
        self._teardowns.add(task)
        task.add_done_callback(self._teardowns.discard)

    async def _watch_link(self) -> None:
        """Tells when the link to the arm breaks and comes back."""
        async for state in self.link.state:
            words = {LinkState.OPEN: "the arm can be reached again", LinkState.REOPENING: "the line to the arm broke"}
            self._tell("link", "", words.get(state, state.value))

    def _tell(self, what: str, client: Client[F] | str, detail: str = "") -> None:
        """Tells what has happened."""
        self._log.tell(what, client if isinstance(client, str) else client.name, detail)


async def let_finish(_: object) -> None:
    """Do nothing to the arm when its mover has gone."""
