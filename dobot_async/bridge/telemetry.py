"""What an arm does, as JSON on Zenoh, for dashboards and recorders; only what somebody subscribes to is asked for.

    dobot/NAME/pose, motion, alarms     asked of the arm, one read at a time, behind whatever else is to be sent
    dobot/NAME/link                     figures of the line to the arm, and who moves it

Each message stands for itself. It may be dropped where a network is too slow; nothing here ever waits for a reader.
"""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from dobot_async.arms.bridge_adapter import TelemetryRead
from dobot_async.bridge.service import Bridge
from dobot_async.errors import DobotError
from dobot_async.transports.zenoh.config import library
from dobot_async.transports.zenoh.session import KeyExpressions, ZenohSession
from dobot_async.transports.zenoh.typed import TopicPublisher

__all__ = ["LINK_PERIOD", "Telemetry"]

LINK_PERIOD = 1.0
UNREACHABLE = 1.0  # seconds until the arm is asked again


class Topic:
    """One key.

    Attributes:
        publisher: Where it is published.
        watched: Set while somebody subscribes.
    """

    def __init__(self, session: ZenohSession, key: str) -> None:
        zenoh = library()
        self.watched: asyncio.Event = asyncio.Event()
        publisher = session.raw.declare_publisher(
            key,
            encoding=zenoh.Encoding.APPLICATION_JSON,
            congestion_control=zenoh.CongestionControl.DROP,
            priority=zenoh.Priority.DATA_LOW,
        )
        self.publisher: TopicPublisher = publisher
        self._listener: object = publisher.declare_matching_listener(
            session.crossing.to(self._notice, lambda status: status.matching)
        )
        self._notice(publisher.matching_status)

    def _notice(self, watched: bool) -> None:
        if watched:
            self.watched.set()
        else:
            self.watched.clear()


class Telemetry:
    """Publishes what an arm does, from `start` to `aclose`."""

    def __init__(self, bridge: Bridge[Any], session: ZenohSession, keys: KeyExpressions) -> None:
        self._bridge = bridge
        self._session = session
        self._keys = keys
        self._tasks: list[asyncio.Task[None]] = []

    def start(self) -> None:
        """Begins."""
        readings: Mapping[str, TelemetryRead[Any] | None] = {**self._bridge.family.readings, "link": None}
        for name, reading in readings.items():
            topic = Topic(self._session, self._keys.reading(name))
            work = self._publish(topic, name, reading)
            self._tasks.append(asyncio.create_task(work, name=f"dobot_async telemetry {name}"))

    async def aclose(self) -> None:
        """Ends."""
        for task in self._tasks:
            task.cancel()

        if self._tasks:
            await asyncio.wait(self._tasks)

    async def _publish(self, topic: Topic, name: str, reading: TelemetryRead[Any] | None) -> None:
        """Publishes one reading after the other while somebody wants it."""
        while True:
            await topic.watched.wait()
            try:
                told = await self._read(name, reading) if reading else self._link()
            except DobotError:
                await asyncio.sleep(UNREACHABLE)
                continue

            topic.publisher.put(json.dumps({"time": time.time(), **told}))
            await asyncio.sleep(reading.period if reading else LINK_PERIOD)

    async def _read(self, name: str, reading: TelemetryRead[Any]) -> dict[str, Any]:
        """Asks the arm."""
        reply = await self._bridge.ask(reading.request)
        told = dict(reading.tell(reply))
        if name == "motion":
            told |= {"moving": self._bridge.moving(reply), "controller": self._bridge.holder}

        return told

    def _link(self) -> dict[str, Any]:
        """How the line is, and the bridge."""
        link = self._bridge.link
        return {
            "state": link.state.value.value,
            "outages": link.outages,
            "clients": self._bridge.clients,
            "controller": self._bridge.holder,
            **asdict(link.stats),
        }
