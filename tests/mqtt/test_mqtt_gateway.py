"""The gateway at a real broker on loopback; what the simulated arm has executed decides."""

from __future__ import annotations

import asyncio
import gc
import itertools
import json
import logging
import socket
import warnings
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, suppress
from typing import Any

import aiomqtt
import pytest
from amqtt.broker import Broker as RealBroker
from bridge_rig import until

from dobot_async import Magician
from dobot_async._core.util.tasks import cancel_and_join
from dobot_async.arms.magician import commands as c
from dobot_async.errors import ConnectFailed
from dobot_async.fleet import Member
from dobot_async.fleet.cell import parse_cell
from dobot_async.mqtt import Broker, Gateway, broker_at
from dobot_async.remote import Works, open_site
from dobot_async.simulator import Simulation, simulate

IN_TIME = 30.0
NUMBERS = itertools.count(1)
FAR: dict[str, Any] = {"do": "move", "x": 0, "y": -250, "z": 60}


@pytest.fixture(autouse=True)
def quiet() -> Iterator[None]:
    """The broker logs what it does, and warns of what its peers do."""
    logger = logging.getLogger("amqtt")
    before, logger.level = logger.level, logging.CRITICAL
    yield
    logger.level = before


def free_port() -> int:
    with socket.socket() as place:
        place.bind(("127.0.0.1", 0))
        return int(place.getsockname()[1])


class Hall:
    """A broker that can be switched off and on."""

    def __init__(self) -> None:
        self.port = free_port()
        self._broker: RealBroker | None = None

    async def on(self) -> None:
        plugins = {"amqtt.plugins.authentication.AnonymousAuthPlugin": {"allow_anonymous": True}}
        bind = f"127.0.0.1:{self.port}"
        config = {"listeners": {"default": {"type": "tcp", "bind": bind}}, "plugins": plugins}
        self._broker = RealBroker(config)
        await self._broker.start()

    async def off(self) -> None:
        if self._broker:
            await self._broker.shutdown()
            self._broker = None


@asynccontextmanager
async def hall() -> AsyncIterator[Hall]:
    found = Hall()
    await found.on()
    try:
        yield found
    finally:
        await found.off()
        rest = [task for task in asyncio.all_tasks() if "amqtt" in repr(task.get_coro())]
        for task in rest:
            await cancel_and_join(task)

        del rest
        await asyncio.sleep(0)  # sockets that it has closed just now are closed in the loop's next turn
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ResourceWarning)
            gc.collect()  # the broker leaves the socket of a client that is cut off to the collector


class Ear:
    """A client that hears everything.

    Attributes:
        told: What was published last, by topic.
        all: All of it, in order.
    """

    def __init__(self, client: aiomqtt.Client) -> None:
        self.told: dict[str, str] = {}
        self.all: list[tuple[str, str]] = []
        self._client = client

    async def listen(self) -> None:
        with suppress(aiomqtt.MqttError):
            async for message in self._client.messages:
                assert isinstance(message.payload, bytes)
                text = message.payload.decode(errors="replace")
                self.told[str(message.topic)] = text
                self.all.append((str(message.topic), text))

    def json(self, topic: str) -> Any:
        return json.loads(self.told[topic])

    async def until(self, topic: str, good: Callable[[Any], object] = lambda _: True) -> Any:
        """Return what a topic says as soon as it is good."""
        await until(lambda: topic in self.told and good(self.json(topic)))
        return self.json(topic)

    async def say(self, payload: dict[str, Any] | bytes, **more: Any) -> None:
        data = payload if isinstance(payload, bytes) else json.dumps(payload).encode()
        await self._client.publish("dobot/arm/do", data, qos=1, **more)

    async def do(self, session: str, **command: Any) -> dict[str, Any]:
        """Give a command, and return its reply."""
        number = next(NUMBERS)
        await self.say({"session": session, "id": number, **command})
        found: dict[str, Any] = await self.until(f"dobot/arm/reply/{session}", lambda told: told["id"] == number)
        return found


@asynccontextmanager
async def ear(port: int) -> AsyncIterator[Ear]:
    async with aiomqtt.Client("127.0.0.1", port, clean_session=True) as client:
        await client.subscribe("#", qos=0)  # this broker waits for who acknowledges slowly
        found = Ear(client)
        task = asyncio.create_task(found.listen())
        try:
            yield found
        finally:
            await cancel_and_join(task)


@asynccontextmanager
async def running(
    port: int, sim: Simulation[Any], *, allow_motion: bool = True, **details: Any
) -> AsyncIterator[Gateway]:
    async with open_site(Member(sim.url, Magician), allow_motion=allow_motion) as site:
        gateway = Gateway(Works(site), Broker("127.0.0.1", port), interval=0.1)
        task = asyncio.create_task(gateway.run())
        try:
            async with asyncio.timeout(IN_TIME):
                await gateway.connected.wait()

            yield gateway
        finally:
            await cancel_and_join(task)


def moves(sim: Simulation[Any], outcome: str | None = None) -> list[tuple[float, float, float]]:
    return [
        (each.value.x, each.value.y, each.value.z)
        for each in sim.arm.executed
        if each.command is c.SET_PTP_CMD and outcome in {None, each.outcome}
    ]


async def started(sim: Simulation[Any]) -> None:
    before = sim.arm.pose
    await until(lambda: sim.arm.pose != before)


async def stands(sim: Simulation[Any]) -> None:
    """Return when the arm has nothing to do any more; fail if it has come to where it was to go."""
    await until(lambda: sim.arm.device.idle)
    pose = sim.arm.pose
    await asyncio.sleep(0.2)
    assert sim.arm.pose == pose
    assert (0, -250, 60) not in moves(sim, "done")


async def test_the_state_of_an_arm_is_told_and_home_assistant_finds_it() -> None:
    async with hall() as broker, ear(broker.port) as heard, simulate("magician", speed=20) as sim:
        async with running(broker.port, sim):
            state = await heard.until("dobot/arm/state")
            assert state["pose"]["x"] == pytest.approx(sim.arm.pose.x, abs=0.01)
            assert (state["link"], state["pending"], state["doing"]) == ("open", 0, None)
            assert heard.told["dobot/arm/available"] == heard.told["dobot/gateways/arm"] == "online"
            assert heard.json("dobot/arm/lease") == {"holder": None}
            found = heard.json("homeassistant/device/dobot_arm/config")

        await until(lambda: heard.told["dobot/gateways/arm"] == "offline")

    assert found["availability"] == [{"topic": "dobot/gateways/arm"}, {"topic": "dobot/arm/available"}]
    components = found["components"]
    assert {each["platform"] for each in components.values()} == {"sensor", "binary_sensor", "button", "switch"}
    assert len({each["unique_id"] for each in components.values()}) == len(components)
    assert components["dobot_arm_stop"]["command_topic"] == "dobot/arm/do"
    json.loads(components["dobot_arm_lease"]["payload_on"])


@pytest.mark.full
async def test_what_home_assistant_sends_moves_the_arm() -> None:
    """Its switch takes the lease, and its button homes the arm, twice delivered and once done."""
    async with hall() as broker, ear(broker.port) as heard, simulate("magician", speed=20) as sim:
        async with running(broker.port, sim):
            found = (await heard.until("homeassistant/device/dobot_arm/config"))["components"]
            await heard.say(found["dobot_arm_lease"]["payload_on"].encode())
            assert await heard.until("dobot/arm/lease", lambda told: told["holder"] == "homeassistant")
            press = found["dobot_arm_home"]["command_template"].replace("{{ now().timestamp() }}", "1764540000.5")
            await heard.say(press.encode())
            await heard.say(press.encode())
            reply = await heard.until("dobot/arm/reply/homeassistant", lambda told: told["id"] == "1764540000.5")
            assert reply["ok"]
            assert len([each for each in sim.arm.executed if each.command is c.SET_HOME_CMD]) == 1
            await heard.say(found["dobot_arm_lease"]["payload_off"].encode())
            assert await heard.until("dobot/arm/lease", lambda told: told["holder"] is None)


async def test_without_leave_to_move_there_is_nothing_to_command() -> None:
    async with hall() as broker, ear(broker.port) as heard, simulate("magician", speed=20) as sim:
        async with running(broker.port, sim, allow_motion=False):
            found = await heard.until("homeassistant/device/dobot_arm/config")
            assert {each["platform"] for each in found["components"].values()} == {"sensor", "binary_sensor"}
            for do in ("take_lease", "home", "stop", "move"):
                await heard.say({"session": "s", "id": do, "do": do, "x": 220, "y": 0, "z": 40})

            before = len(heard.all)
            await until(lambda: len(heard.all) > before)
            assert not sim.arm.executed
            assert not any("reply" in topic or "lease" in topic for topic in heard.told)


async def test_who_has_the_lease_moves_the_arm_and_nobody_else() -> None:
    async with hall() as broker, ear(broker.port) as heard, simulate("magician", speed=20) as sim:
        async with running(broker.port, sim):
            target: dict[str, Any] = {"do": "move", "x": 220, "y": 0, "z": 40}
            assert "lease" in (await heard.do("one", **target))["error"]["text"]
            assert (await heard.do("one", do="take_lease", seconds=60))["ok"]
            refused = await heard.do("two", do="take_lease")
            assert refused["error"] == {"kind": "Refused", "text": "one moves the arm"}
            assert (await heard.do("two", **target))["error"]["kind"] == "Refused"
            assert not moves(sim)
            done = await heard.do("one", **target)
            assert (done["value"]["pose"]["x"], done["value"]["pose"]["z"]) == (220, 40)
            assert (await heard.do("one", do="release_lease"))["ok"]
            assert (await heard.do("two", do="take_lease"))["ok"]
            assert (await heard.do("two", do="grip", hold=True))["ok"]
            assert sim.arm.suction


async def test_a_command_that_comes_twice_is_done_once_and_answered_again() -> None:
    async with hall() as broker, ear(broker.port) as heard, simulate("magician", speed=20) as sim:
        async with running(broker.port, sim):
            await heard.do("one", do="take_lease", seconds=60)
            command = {"session": "one", "id": "a", "do": "move", "x": 220, "y": 0, "z": 40}
            for _ in range(3):
                await heard.say(command)

            await heard.until("dobot/arm/reply/one", lambda told: told["id"] == "a")
            assert moves(sim) == [(220, 0, 40)]
            heard.told.clear()
            await heard.say(command)
            assert (await heard.until("dobot/arm/reply/one"))["ok"]
            assert moves(sim) == [(220, 0, 40)]


async def test_a_session_that_is_not_heard_of_any_more_stops_the_arm() -> None:
    async with hall() as broker, ear(broker.port) as heard, simulate("magician", speed=1) as sim:
        async with running(broker.port, sim):
            await heard.do("one", do="take_lease", seconds=1.0)
            await heard.say({"session": "one", "id": "far", **FAR})
            await started(sim)
            reply = await heard.until("dobot/arm/reply/one", lambda told: told["id"] == "far")
            assert reply["error"]["kind"] == "MotionStopped"
            await stands(sim)
            assert (await heard.until("dobot/arm/lease", lambda told: told["holder"] is None)) == {"holder": None}


@pytest.mark.full
async def test_a_lease_that_is_taken_again_in_time_goes_on() -> None:
    async with hall() as broker, ear(broker.port) as heard, simulate("magician", speed=1) as sim:
        async with running(broker.port, sim):
            await heard.do("one", do="take_lease", seconds=1.0)
            await heard.say({"session": "one", "id": "far", "do": "move", "x": 200, "y": 150, "z": 60, "speed": 10})
            reply: dict[str, Any] = {}
            while reply.get("id") != "far":
                await heard.say({"session": "one", "do": "take_lease", "seconds": 1.0})
                await asyncio.sleep(0.2)
                reply = json.loads(
                    next((text for topic, text in reversed(heard.all) if '"far"' in text and "reply" in topic), "{}")
                )

            assert reply["ok"], reply
            assert moves(sim, "done") == [(200, 150, 60)]


async def test_anybody_stops_the_arm_and_that_ends_the_lease() -> None:
    async with hall() as broker, ear(broker.port) as heard, simulate("magician", speed=1) as sim:
        async with running(broker.port, sim):
            await heard.do("one", do="take_lease", seconds=60)
            await heard.say({"session": "one", "id": "far", **FAR})
            await started(sim)
            await heard.say({"session": "two", "do": "stop"})
            await stands(sim)
            assert (await heard.until("dobot/arm/reply/one", lambda told: told["id"] == "far"))["error"]
            assert await heard.until("dobot/arm/lease", lambda told: told["holder"] is None)
            assert (await heard.do("one", **FAR))["error"]["kind"] == "Refused"


async def test_a_broker_that_is_lost_stops_the_arm_and_comes_back() -> None:
    async with hall() as broker, simulate("magician", speed=1) as sim, running(broker.port, sim) as gateway:
        off = False
        with suppress(aiomqtt.MqttError):  # before aiomqtt 2.5 the listener's own end tells that the broker is gone
            async with ear(broker.port) as heard:
                await heard.do("one", do="take_lease", seconds=60)
                await heard.say({"session": "one", "id": "far", **FAR})
                await started(sim)
                await broker.off()
                off = True

        assert off
        await stands(sim)
        assert gateway.holders == {"arm": None}
        await broker.on()
        async with ear(broker.port) as heard:
            await until(lambda: heard.told.get("dobot/gateways/arm") == "online")
            await heard.until("dobot/arm/state", lambda told: told["doing"] is None)
            await heard.until("homeassistant/device/dobot_arm/config")
            assert (await heard.do("one", do="move", x=220, y=0, z=40))["error"]["kind"] == "Refused"
            assert (await heard.do("one", do="take_lease", seconds=60))["ok"]


@pytest.mark.full
async def test_the_last_will_tells_of_a_gateway_that_is_gone_without_a_word() -> None:
    async with hall() as broker, ear(broker.port) as heard, simulate("magician", speed=20) as sim:
        relay = await asyncio.start_server(lambda r, w: through(r, w, broker.port), "127.0.0.1", 0)
        port = relay.sockets[0].getsockname()[1]
        async with running(port, sim):
            await until(lambda: heard.told.get("dobot/gateways/arm") == "online")
            relay.close()
            for writer in WRITERS:
                writer.transport.abort()

            await until(lambda: heard.told["dobot/gateways/arm"] == "offline")


WRITERS: list[asyncio.StreamWriter] = []


async def through(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, port: int) -> None:
    """Passes bytes on, both ways."""
    other, onward = await asyncio.open_connection("127.0.0.1", port)
    WRITERS[:] = [writer, onward]

    async def pass_on(source: asyncio.StreamReader, target: asyncio.StreamWriter) -> None:
        with suppress(OSError):
            while data := await source.read(4096):
                target.write(data)

    await asyncio.gather(pass_on(reader, onward), pass_on(other, writer))


@pytest.mark.full
async def test_a_command_that_the_broker_has_kept_is_not_obeyed() -> None:
    async with hall() as broker, ear(broker.port) as heard, simulate("magician", speed=20) as sim:
        await heard.say({"session": "one", "id": "old", "do": "take_lease"}, retain=True)
        async with running(broker.port, sim) as gateway:
            await heard.until("dobot/arm/state")
            assert (await heard.do("two", do="take_lease"))["ok"]
            assert gateway.holders == {"arm": "two"}


@pytest.mark.full
async def test_an_arm_that_does_not_answer_is_not_available() -> None:
    async with hall() as broker, ear(broker.port) as heard, simulate("magician", speed=20) as sim:
        async with running(broker.port, sim):
            await until(lambda: heard.told.get("dobot/arm/available") == "online")
            sim.faults.silent = True
            await until(lambda: heard.told["dobot/arm/available"] == "offline")
            assert heard.told["dobot/gateways/arm"] == "online"
            sim.faults.silent = False
            await until(lambda: heard.told["dobot/arm/available"] == "online")


GARBAGE = (
    b"",
    b"null",
    b"[]",
    b"{",
    b"\xff\xfe",
    b"[" * 100_000,
    b'{"session": "one"}',
    b'{"session": "../#", "id": "g1", "do": "home"}',
    b'{"session": ["one"], "id": "g1", "do": "home"}',
    b'{"session": "one", "do": "home"}',
    b'{"session": "one", "id": [], "do": "home"}',
    b'{"session": "one", "id": true, "do": "home"}',
    b'{"session": "one", "id": "g2", "do": 5}',
    b'{"session": "one", "id": "g3", "do": "__class__"}',
    b'{"session": "one", "id": "g4", "do": "move", "x": NaN, "y": 0, "z": 40}',
    b'{"session": "one", "id": "g5", "do": "move", "x": 1e999, "y": 0, "z": 40}',
    b'{"session": "one", "id": "g6", "do": "move", "x": "220", "y": 0, "z": 40}',
    b'{"session": "one", "id": "g7", "do": "move", "x": 900, "y": 0, "z": 40}',
    b'{"session": "one", "id": "g8", "do": "move", "x": 220, "y": 0, "z": 40, "speed": 99}',
    b'{"session": "one", "id": "g9", "do": "move", "x": 220, "y": 0, "z": 40, "and": "more"}',
    b'{"session": "one", "id": "g10", "do": "grip", "hold": "Ignore all previous instructions"}',
    b'{"session": "one", "id": "g11", "do": "pick", "x": 220, "y": 0}',
    b'{"session": "one", "do": "take_lease", "seconds": 1e9}',
    b'{"session": "one", "do": "take_lease", "seconds": true}',
    b'{"session": "one", "do": "stop", "now": true}',
    b"x" * 300_000,
)


@pytest.mark.full
async def test_nonsense_moves_nothing_and_the_next_command_is_right() -> None:
    async with hall() as broker, ear(broker.port) as heard, simulate("magician", speed=20) as sim:
        async with running(broker.port, sim):
            assert (await heard.do("one", do="take_lease", seconds=60))["ok"]
            for payload in GARBAGE:
                await heard.say(payload)

            done = await heard.do("one", do="move", x=220, y=0, z=40)
            assert done["ok"], done
            assert moves(sim) == [(220, 0, 40)]
            replies = [json.loads(text) for topic, text in heard.all if "reply/one" in topic]
            refused = [told["id"] for told in replies if not told["ok"]]
            assert set(refused) == {None, *(f"g{number}" for number in range(2, 12))}


@pytest.mark.full
async def test_arms_of_a_cell_have_topics_of_their_own() -> None:
    async with hall() as broker, ear(broker.port) as heard:
        async with simulate("magician", speed=20) as left, simulate("ultraarm", speed=20) as right:
            text = f'[arms.left]\nurl = "{left.url}"\n[arms.right]\nurl = "{right.url}"\nfamily = "ultraarm"\n'
            async with open_site(parse_cell(text), allow_motion=True) as site:
                task = asyncio.create_task(
                    Gateway(Works(site), Broker("127.0.0.1", broker.port), base="lab/cell", interval=0.1).run()
                )
                await heard.until("lab/cell/right/state")
                await heard.until("lab/cell/left/state")
                assert heard.told["lab/cell/gateways/left-right"] == "online"
                await cancel_and_join(task)


async def test_a_broker_that_is_not_there_is_told() -> None:
    async with simulate("magician") as sim, open_site(Member(sim.url, Magician)) as site:
        with pytest.raises(ConnectFailed, match="no broker"):
            await Gateway(Works(site), Broker("127.0.0.1", free_port())).run(patient=False)


@pytest.mark.parametrize(
    "details",
    [{"base": "a/#"}, {"base": ""}, {"identifier": "+"}, {"discovery": "home assistant"}, {"interval": 0}],
)
async def test_what_no_topic_can_be_made_of_is_refused(details: dict[str, Any]) -> None:
    async with simulate("magician") as sim, open_site(Member(sim.url, Magician)) as site:
        with pytest.raises(ValueError):  # noqa: PT011 - each has its own words
            Gateway(Works(site), Broker("127.0.0.1"), **details)


@pytest.mark.parametrize(
    ("url", "details"),
    [
        ("127.0.0.1", {}),
        ("tcp://127.0.0.1", {}),
        ("mqtt://", {}),
        ("mqtt://h/topic", {}),
        ("mqtt://h:x", {}),
        ("mqtt://user:secret@h", {}),
        ("mqtt://h", {"password": "secret"}),
        ("mqtt://h", {"ca": "ca.pem"}),
        ("mqtts://h", {"ca": "/nowhere/ca.pem"}),
    ],
)
def test_a_url_that_leads_to_no_broker_is_refused_and_shows_no_password(url: str, details: dict[str, Any]) -> None:
    with pytest.raises(ValueError) as refused:  # noqa: PT011 - each has its own words
        broker_at(url, **details)

    assert "secret" not in str(refused.value)


def test_a_broker_shows_no_password() -> None:
    broker = broker_at("mqtt://me@[::1]:1884", password="secret")
    assert (broker.host, broker.port, broker.user, broker.password) == ("::1", 1884, "me", "secret")
    assert "secret" not in repr(broker) + str(broker)
