"""What the tests of the panel share: a simulated arm, a panel, and pages that know JSON and no browser."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager
from typing import Any, NamedTuple

import aiohttp

from dobot_async import Magician
from dobot_async.fleet.member import Member
from dobot_async.panel import Panel, Role, panel
from dobot_async.panel.session import PageSession
from dobot_async.panel.sources import sources_of
from dobot_async.panel.state import PanelState
from dobot_async.simulator import Simulation, simulate

__all__ = ["IN_TIME", "Page", "Seen", "Shown", "VirtualPage", "browser", "desk_of", "page", "shown", "until"]

IN_TIME = 20.0
ARM = "arm"


class Seen:
    """What a page was told.

    Attributes:
        messages: All of it, in order.
    """

    def __init__(self) -> None:
        self.messages: list[dict[str, Any]] = []
        self._numbers = 0
        self._press = 0

    def of(self, kind: str) -> list[dict[str, Any]]:
        """The messages of a kind."""
        return [each for each in self.messages if each["type"] == kind]

    def last(self, kind: str) -> dict[str, Any]:
        """The newest of a kind; {} if there was none."""
        return next((each for each in reversed(self.messages) if each["type"] == kind), {})

    @property
    def tick(self) -> int:
        """The newest tick."""
        return int(self.last("tick").get("n", 0))

    def reply(self, number: int) -> dict[str, Any] | None:
        """What was answered to a message."""
        return next((each for each in self.of("reply") if each["id"] == number), None)

    def next_number(self) -> int:
        self._numbers += 1
        return self._numbers

    def next_press(self) -> int:
        self._press += 1
        return self._press


class Page(Seen):
    """A page over a real WebSocket."""

    def __init__(self, socket: aiohttp.ClientWebSocketResponse) -> None:
        super().__init__()
        self.socket = socket
        self.ended = asyncio.Event()

    async def read(self) -> None:
        async for message in self.socket:
            if message.type is aiohttp.WSMsgType.TEXT:
                self.messages.append(json.loads(message.data))

        self.ended.set()

    async def send(self, do: str, **more: Any) -> int:
        """Ask for something; return the number of the answer."""
        number = self.next_number()
        await self.socket.send_str(json.dumps({"id": number, "do": do, **more}))
        return number

    async def ask(self, do: str, **more: Any) -> dict[str, Any]:
        """Ask for something, and return the answer."""
        number = await self.send(do, **more)
        await until(lambda: self.reply(number))
        answer = self.reply(number)
        assert answer
        return answer

    async def get(self, do: str, **more: Any) -> Any:
        """Ask for something that has to go well."""
        answer = await self.ask(do, **more)
        assert answer["ok"], answer
        return answer["value"]

    async def refused(self, do: str, **more: Any) -> str:
        """Ask for something that has to be refused; return the kind of the error."""
        answer = await self.ask(do, **more)
        assert not answer["ok"], answer
        return str(answer["error"]["kind"])

    async def press(self, direction: str, **more: Any) -> tuple[int, int]:
        """Press a key of the jog pad once; return the number of the answer, and of the press."""
        await until(lambda: self.tick)
        press = self.next_press()
        number = await self.send("jog", arm=ARM, direction=direction, press=press, tick=self.tick, **more)
        return number, press

    async def hold(self, press: int, until_: Callable[[], object]) -> None:
        """Send beats until something has come about."""
        async with asyncio.timeout(IN_TIME):
            while not until_():
                await self.send("beat", arm=ARM, press=press, tick=self.tick)
                await asyncio.sleep(0.03)


class Shown(NamedTuple):
    """A simulated arm, and the panel that shows it."""

    sim: Simulation[Any]
    panel: Panel

    def __str__(self) -> str:
        return self.panel.url

    @property
    def origin(self) -> Mapping[str, str]:
        """What a page of this panel says of itself."""
        return {"Origin": self.panel.url.rstrip("/")}


@asynccontextmanager
async def shown(
    *, speed: float = 1.0, model: str = "magician", kind: type[Any] = Magician, line: Any = None, **options: Any
) -> AsyncIterator[Shown]:
    """A simulated arm that a panel has connected."""
    async with (
        simulate(model, speed=speed, faults=line) as sim,
        panel({ARM: Member(sim.url, kind)}, port=0, **options) as running,
    ):
        yield Shown(sim, running)


@asynccontextmanager
async def browser() -> AsyncIterator[aiohttp.ClientSession]:
    """Something that keeps cookies."""
    jar = aiohttp.CookieJar(unsafe=True)  # addresses have cookies too
    async with aiohttp.ClientSession(cookie_jar=jar) as http:
        yield http


@asynccontextmanager
async def page(rig: Shown, role: Role = Role.OPERATOR) -> AsyncIterator[Page]:
    """A page of a browser of its own, which has the arm connected."""
    url = rig.panel.operator_url if role is Role.OPERATOR else rig.panel.viewer_url
    async with browser() as http:
        async with http.get(url) as answer:
            assert answer.status == 200

        async with http.ws_connect(f"{rig.panel.url}ws", headers=rig.origin) as socket:
            found = Page(socket)
            reading = asyncio.create_task(found.read())
            try:
                await until(lambda: found.last("state"))
                yield found
            finally:
                await socket.close()
                await reading


async def until(condition: Callable[[], object]) -> None:
    """Returns when something has come about."""
    async with asyncio.timeout(IN_TIME):
        while not condition():  # noqa: ASYNC110 - the arm is looked at
            await asyncio.sleep(0.005)


class VirtualPage(Seen):
    """A page without a network, for virtual time."""

    def __init__(self, session: PageSession) -> None:
        super().__init__()
        self.session = session

    async def read(self) -> None:
        while (text := await self.session.outlet.get()) is not None:
            self.messages.append(json.loads(text))

    def send(self, do: str, **more: Any) -> int:
        number = self.next_number()
        self.session.receive(json.dumps({"id": number, "do": do, **more}))
        return number

    async def ask(self, do: str, **more: Any) -> dict[str, Any]:
        return await self.answer(self.send(do, **more))

    async def answer(self, number: int) -> dict[str, Any]:
        async with asyncio.timeout(60):
            while not (answer := self.reply(number)):  # noqa: ASYNC110 - no time passes for it
                await asyncio.sleep(0.001)

        return answer

    async def get(self, do: str, **more: Any) -> Any:
        answer = await self.ask(do, **more)
        assert answer["ok"], answer
        return answer["value"]

    def press(self, direction: str, **more: Any) -> tuple[int, int]:
        press = self.next_press()
        return self.send("jog", arm=ARM, direction=direction, press=press, tick=self.tick, **more), press


@asynccontextmanager
async def desk_of(arms: Any) -> AsyncIterator[tuple[PanelState, Callable[..., VirtualPage]]]:
    """What is behind a panel, without its port; and what makes pages."""
    sources, zones, _ = sources_of(arms)
    desk = PanelState(sources, zones, scene=False, stop_all=None)
    desk.start()
    reading: list[asyncio.Task[None]] = []

    def join(role: Role = Role.OPERATOR) -> VirtualPage:
        found = VirtualPage(desk.join(role, "here"))
        reading.append(asyncio.create_task(found.read()))
        return found

    try:
        while not all(station.connected for station in desk.stations.values()):  # noqa: ASYNC110 - as above
            await asyncio.sleep(0.01)

        yield desk, join
    finally:
        await desk.aclose()
        await asyncio.gather(*reading)
