"""The state that all sessions of a panel share: arms, files, ticks, and which pages are connected."""

from __future__ import annotations

import asyncio
import itertools
import time
from collections.abc import Awaitable, Callable, Mapping
from typing import Any

from dobot_async._core.util.tasks import cancel_and_join
from dobot_async._core.util.text import printable
from dobot_async.panel.access import Role
from dobot_async.panel.drawings import Drawings
from dobot_async.panel.hold_to_run import BEAT, PATIENCE, Ticks
from dobot_async.panel.messages import Hub, as_json
from dobot_async.panel.problems import PanelRefusal
from dobot_async.panel.session import PageSession
from dobot_async.panel.sources import Source
from dobot_async.panel.station import Station

__all__ = ["PanelState"]

VERSION = 1
SESSIONS = 32


class PanelState:
    """See the module.

    Attributes:
        hub: All pages.
        stations: The arms, by name.
        drawings: The files that were dropped.
        ticks: By which beats are known to be new.
        sessions: The pages that are connected.
    """

    def __init__(
        self,
        sources: Mapping[str, Source],
        zones: list[dict[str, Any]],
        *,
        scene: bool,
        stop_all: Callable[[], Awaitable[None]] | None,
    ) -> None:
        self.hub: Hub = Hub()
        self.stations: dict[str, Station] = {
            name: Station(name, source, self.hub, self._told) for name, source in sources.items()
        }
        self.drawings: Drawings = Drawings()
        self.ticks: Ticks = Ticks()
        self.sessions: set[PageSession] = set()
        self._zones = zones
        self._scene = scene
        self._stop_all = stop_all
        self._numbers = itertools.count(1)
        self._tasks: list[asyncio.Task[None]] = []
        self._ticking: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Begin to connect the arms."""
        for name, station in self.stations.items():
            self._tasks.append(asyncio.create_task(station.run(), name=f"dobot_async panel {name}"))

    async def aclose(self) -> None:
        """Leave all pages and all arms; what they did for pages stops first."""
        await asyncio.gather(*(session.aclose() for session in list(self.sessions)))
        for station in self.stations.values():
            station.close()

        if self._tasks:
            await asyncio.wait(self._tasks)

        if self._ticking:
            await cancel_and_join(self._ticking)

        self.hub.lines.close()
        for task in self._tasks:
            task.result()

    def station(self, name: object) -> Station:
        """Return an arm; raise Refusal if there is none of that name."""
        if not isinstance(name, str) or name not in self.stations:
            raise PanelRefusal(
                "wrong", f"there is no arm {printable(repr(name))}; there are: {', '.join(self.stations)}"
            )

        return self.stations[name]

    def join(self, role: Role, address: str) -> PageSession:
        """Somebody has connected; raise Refusal if there are too many."""
        if len(self.sessions) >= SESSIONS:
            raise PanelRefusal("rate", f"{SESSIONS} pages are connected, which is as many as may be")

        name = f"{role.value} {next(self._numbers)} ({printable(address, 60)})"
        session = PageSession(self, role, name)
        self.sessions.add(session)
        session.outlet.put(as_json(self._hello(session)))
        for station in self.stations.values():
            session.tell("lease", **self._lease(station, session))

        self.hub.add(session.outlet)
        return session

    def leave(self, session: PageSession) -> None:
        """A page has gone."""
        self.sessions.discard(session)
        self.hub.remove(session.outlet)

    async def stop_all(self, by: PageSession) -> None:
        """Stop all arms, at the same time."""
        work: list[Awaitable[None]] = [station.stop(by) for station in self.stations.values() if station.connected]
        if self._stop_all:
            work.append(self._stop_all())

        failures = [each for each in await asyncio.gather(*work, return_exceptions=True) if each is not None]
        if failures:
            raise failures[0]

    def log(self, text: str) -> None:
        """Tell everybody something that is about no arm."""
        self.hub.log(time=time.time(), text=text, level="info")

    def _hello(self, session: PageSession) -> dict[str, Any]:
        return {
            "type": "hello",
            "role": session.role.value,
            "you": session.name,
            "version": VERSION,
            "beat": BEAT,
            "patience": PATIENCE,
            "arms": [station.describe() for station in self.stations.values()],
            "zones": self._zones,
            "scene": self._scene,
        }

    def _lease(self, station: Station, session: PageSession) -> dict[str, Any]:
        holder = station.lease.holder
        return {"arm": station.name, "holder": holder.name if holder else None, "mine": holder is session}

    def _told(self, station: Station) -> None:
        """An arm was connected or lost, or belongs to somebody else now."""
        arm = as_json({"type": "arm", "arm": station.describe()})
        for session in self.sessions:
            session.outlet.put(arm, ("arm", station.name))
            session.tell("lease", **self._lease(station, session))

        if self._ticking is None and self._leased():
            self._ticking = asyncio.create_task(self._tick(), name="dobot_async panel ticks")

    def _leased(self) -> set[PageSession]:
        holders = {station.lease.holder for station in self.stations.values()}
        return {session for session in self.sessions if session in holders}

    async def _tick(self) -> None:
        """Send ticks while somebody has a lease."""
        while holders := self._leased():
            text = as_json({"type": "tick", "n": self.ticks.next()})
            for session in holders:
                session.outlet.put(text, "tick")

            await asyncio.sleep(BEAT)

        self._ticking = None
