"""A gateway: arms on one side, a broker on the other; the broker may be lost, and come back.

    connected --> subscribe --> "online", discovery, states --> messages ... --> lost: leases end, arms stop
        ^                                                                           |
        `----------------------------- later and later ----------------------------'

1. Messages that the broker has kept (retained) are not obeyed: nobody means them now.
2. Commands are subscribed to with QoS 1, which may deliver one twice: its id tells.
3. The last will says "offline" when the gateway is gone without a word.
"""

from __future__ import annotations

import asyncio
import json
import logging
from collections.abc import AsyncGenerator, Collection, Mapping
from contextlib import asynccontextmanager, suppress
from typing import Any

import aiomqtt

from dobot_async._core.util.tasks import cancel_and_join
from dobot_async.errors import ConnectFailed, DobotError
from dobot_async.mqtt.broker import Broker
from dobot_async.mqtt.command_handler import LONGEST, CommandHandler
from dobot_async.mqtt.discovery import discovery_of, discovery_topic
from dobot_async.mqtt.topics import OFFLINE, ONLINE, Topics, check_word, will_topic
from dobot_async.remote import RemoteArm, Works, state_told

__all__ = ["Gateway"]

logger: logging.Logger = logging.getLogger("dobot_async.mqtt")
KEEP_ALIVE = 5  # seconds
PATIENCE = 5.0  # seconds for an answer of the broker
AT_ONCE = 64  # messages that wait to be published; of more the oldest are dropped
UNREAD = 256  # commands that wait to be read
RETRY, SLOWEST = 0.5, 10.0  # seconds until a broker that is gone is looked for again
LATEST = 30.0  # seconds after which a state is told again, though nothing has changed


class Gateway:
    """See the module.

    Args:
        works: What is done with the arms; `Works(site)`.
        broker: Where the broker is.
        base: What all topics begin with.
        identifier: What the gateway is called; by default as its arms.
        discovery: What Home Assistant's topics begin with; "" tells it nothing.
        interval: Seconds between two readings of an arm.

    Attributes:
        connected: Set while there is a broker.

    Raises:
        ValueError: An arm has a name that cannot be a part of a topic; or a number is out of range.
    """

    def __init__(
        self,
        works: Works,
        broker: Broker,
        *,
        base: str = "dobot",
        identifier: str | None = None,
        discovery: str = "homeassistant",
        interval: float = 1.0,
    ) -> None:
        site = works.site
        self.check(list(site.arms), base=base, identifier=identifier, discovery=discovery, interval=interval)
        self.connected: asyncio.Event = asyncio.Event()
        self._works = works
        self._broker = broker
        self._will = will_topic(base, identifier or "-".join(site.arms)[:64])
        self._discovery = discovery
        self._interval = interval
        self._topics = {on.name: Topics(base, on.name) for on in site}
        self._handlers = {on.name: self._handler(on) for on in site} if site.moves else {}
        self._out: asyncio.Queue[tuple[str, str, bool]] = asyncio.Queue()
        self._told: dict[str, tuple[float, str]] = {}
        self._announced: set[str] = set()

    @staticmethod
    def check(names: Collection[str], *, base: str, identifier: str | None, discovery: str, interval: float) -> None:
        """Raise ValueError for what a gateway cannot be made of, before there are arms.

        Args:
            names: Of the arms.
            base: As for `Gateway`; so are the others.
            identifier: None for the default.
            discovery: "" for none.
            interval: Seconds.
        """
        if not 0.05 <= interval <= 3600:
            raise ValueError(f"interval must be 0.05 to 3600 seconds, not {interval!r}")

        for each in (*base.split("/"), *(discovery.split("/") if discovery else ())):
            check_word("a topic", each)

        for each in names:
            check_word("an arm", each)

        if identifier is not None:
            check_word("the gateway", identifier)

    @property
    def holders(self) -> Mapping[str, str | None]:
        """Which session has the lease of each arm."""
        return {name: handler.holder for name, handler in self._handlers.items()}

    async def run(self, *, patient: bool = True) -> None:
        """Serve until this is cancelled. A broker that is lost is looked for again and again.

        Args:
            patient: Look for it again and again from the beginning; else it has to be there then.

        Raises:
            ConnectFailed: It cannot be reached at first.
        """
        watches = [
            asyncio.create_task(self._watch(on), name=f"dobot_async mqtt watch of {on.name}") for on in self._works.site
        ]
        try:
            await self._stay_connected(patient)
        finally:
            self._works.close()
            for handler in self._handlers.values():
                await handler.aclose()

            for watch in watches:
                await cancel_and_join(watch)

    async def _stay_connected(self, patient: bool) -> None:
        delay = RETRY
        while True:
            try:
                async with self._client() as client:
                    patient, delay = True, RETRY
                    logger.info("connected to %s", self._broker)
                    await self._serve(client)
            except (aiomqtt.MqttError, OSError) as error:
                if not patient:
                    raise ConnectFailed(f"no broker at {self._broker}: {error}; is its address right?") from error

                logger.warning("%s: %s; it is looked for again", self._broker, error)
            finally:
                self.connected.clear()
                for handler in self._handlers.values():
                    handler.lose()

            await asyncio.sleep(delay)
            delay = min(2 * delay, SLOWEST)

    @asynccontextmanager
    async def _client(self) -> AsyncGenerator[aiomqtt.Client]:
        broker = self._broker
        client = aiomqtt.Client(
            broker.host,
            broker.port,
            username=broker.user,
            password=broker.password,
            tls_context=broker.tls,
            will=aiomqtt.Will(self._will, OFFLINE, qos=1, retain=True),
            clean_session=True,
            keepalive=KEEP_ALIVE,
            timeout=PATIENCE,
            max_queued_incoming_messages=UNREAD,
            max_queued_outgoing_messages=AT_ONCE,
        )
        async with client:
            yield client

    async def _serve(self, client: aiomqtt.Client) -> None:
        """Be there until the connection is lost."""
        self._out = asyncio.Queue()
        self._told.clear()
        self._announced.clear()
        for name in self._handlers:
            await client.subscribe(self._topics[name].do, qos=1)

        await client.publish(self._will, ONLINE, qos=1, retain=True)
        self.connected.set()
        for name in self._handlers:
            self._tell_lease(name)

        tasks = [
            asyncio.create_task(self._hear(client), name="dobot_async mqtt commands"),
            asyncio.create_task(self._publish(client), name="dobot_async mqtt publisher"),
        ]
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                task.result()
        except asyncio.CancelledError:
            with suppress(aiomqtt.MqttError, TimeoutError):
                async with asyncio.timeout(1):
                    await client.publish(self._will, OFFLINE, qos=1, retain=True)

            raise
        finally:
            for task in tasks:
                await cancel_and_join(task)

    async def _hear(self, client: aiomqtt.Client) -> None:
        """Take commands."""
        arms = {topics.do: name for name, topics in self._topics.items()}
        async for message in client.messages:
            name, payload = arms.get(str(message.topic)), message.payload
            if message.retain or name is None:
                logger.info("%s: a retained command is not obeyed", name)
            elif isinstance(payload, bytes) and len(payload) <= LONGEST:
                self._handlers[name].take(payload)

    async def _publish(self, client: aiomqtt.Client) -> None:
        """Publish what there is to tell."""
        while True:
            topic, text, retain = await self._out.get()
            await client.publish(topic, text, qos=1, retain=retain)

    async def _watch(self, on: RemoteArm) -> None:
        """Tell what an arm does, while there is a broker."""
        topics = self._topics[on.name]
        while True:
            await self.connected.wait()
            try:
                state = await state_told(on, self._works.doing(on.name))
            except DobotError as error:
                logger.info("%s: %s", on.name, error)
                self._tell(topics.available, OFFLINE)
            else:
                self._announce(on, topics, len(state["pose"]["joints"]))
                self._tell(topics.available, ONLINE)
                self._tell(topics.state, json.dumps(state))

            await asyncio.sleep(self._interval)

    def _announce(self, on: RemoteArm, topics: Topics, joints: int) -> None:
        """Tell Home Assistant of an arm, once a connection."""
        if self._discovery and on.name not in self._announced:
            self._announced.add(on.name)
            told = discovery_of(on, topics, self._will, joints=joints, moves=on.name in self._handlers)
            self._put(discovery_topic(self._discovery, on.name), json.dumps(told), retain=True)

    def _tell(self, topic: str, text: str) -> None:
        """Tell something that may have changed."""
        now = asyncio.get_running_loop().time()
        at, before = self._told.get(topic, (0.0, ""))
        if text != before or now > at + LATEST:
            self._told[topic] = now, text
            self._put(topic, text, retain=True)

    def _tell_lease(self, name: str) -> None:
        self._put(self._topics[name].lease, json.dumps({"holder": self._handlers[name].holder}), retain=True)

    def _handler(self, on: RemoteArm) -> CommandHandler:
        topics = self._topics[on.name]

        def reply(session: str, told: dict[str, Any]) -> None:
            self._put(topics.reply(session), json.dumps(told), retain=False)

        return CommandHandler(self._works, on, reply, lambda: self._tell_lease(on.name))

    def _put(self, topic: str, text: str, *, retain: bool) -> None:
        """Have something published; who is not connected has nothing to say, and of too much the oldest is dropped."""
        if not self.connected.is_set():
            return

        while self._out.qsize() >= AT_ONCE:
            self._out.get_nowait()

        self._out.put_nowait((topic, text, retain))
