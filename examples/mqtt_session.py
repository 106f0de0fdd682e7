"""An arm at an MQTT broker, and a program there that takes the lease and moves it.

    python mqtt_session.py [mqtt://broker [serial:///dev/ttyUSB0 | ...]]

It needs the extra `mqtt`; without a broker it starts one of its own, with amqtt. On a real arm: home it first.
"""

from __future__ import annotations

import asyncio
import json
import logging
import os
import socket
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import aiomqtt

from dobot_async import Magician
from dobot_async.fleet import Member
from dobot_async.mqtt import Broker, Gateway, broker_at
from dobot_async.remote import Works, open_site

BROKER = sys.argv[1] if len(sys.argv) > 1 else ""
URL = sys.argv[2] if len(sys.argv) > 2 else os.environ.get("DOBOT_URL", "sim:?speed=20")


@asynccontextmanager
async def broker() -> AsyncIterator[Broker]:
    """The broker that was named, or one of this program's own."""
    if BROKER:
        yield broker_at(BROKER)
        return

    from amqtt.broker import Broker as OwnBroker

    with socket.socket() as place:
        place.bind(("127.0.0.1", 0))
        port: int = place.getsockname()[1]

    logging.getLogger("amqtt").setLevel(logging.CRITICAL)
    own = OwnBroker({"listeners": {"default": {"type": "tcp", "bind": f"127.0.0.1:{port}"}}, "plugins": PLUGINS})
    await own.start()
    yield Broker("127.0.0.1", port)
    await own.shutdown()


PLUGINS: dict[str, Any] = {"amqtt.plugins.authentication.AnonymousAuthPlugin": {"allow_anonymous": True}}


async def program(place: Broker) -> None:
    """What somebody else would write, in any language that has MQTT: it knows topics and JSON alone."""
    async with aiomqtt.Client(place.host, place.port) as client:
        await client.subscribe("dobot/arm/reply/example", qos=1)
        commands: list[dict[str, Any]] = [
            {"id": 1, "do": "move", "x": 220, "y": 0, "z": 60},
            {"id": 2, "do": "take_lease", "seconds": 30},
            {"id": 3, "do": "move", "x": 220, "y": 0, "z": 60},
            {"id": 4, "do": "move", "x": 900, "y": 0, "z": 60},
            {"id": 5, "do": "release_lease"},
        ]
        for command in commands:
            await client.publish("dobot/arm/do", json.dumps({"session": "example", **command}), qos=1)
            message = await anext(aiter(client.messages))
            assert isinstance(message.payload, bytes)
            told = json.loads(message.payload)
            what = "done" if told["ok"] else f"refused ({told['error']['kind']})"
            print(f"{command['id']} {command['do']}: {what}")


async def main() -> None:
    """Serve the arm, and be somebody else at the same time."""
    async with broker() as place, open_site(Member(URL, Magician), allow_motion=True) as site:
        gateway = Gateway(Works(site), place)
        serving = asyncio.create_task(gateway.run())
        await gateway.connected.wait()
        await program(place)
        serving.cancel()
        await asyncio.wait([serving])


asyncio.run(main())
