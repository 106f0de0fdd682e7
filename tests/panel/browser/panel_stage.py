"""What the tests of the page share: a simulated arm, a panel, a line that can be cut, pages on a phone and a desktop.

What the arm recorded decides: `Stage.sim`. Each page keeps what its console said and which addresses it asked for.
"""

from __future__ import annotations

import asyncio
import logging
import os
import re
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from panel_cut import Cut
from playwright.async_api import Browser, BrowserContext, ConsoleMessage, Error, Page, Request, expect

from dobot_async import Magician
from dobot_async.panel import Panel, panel
from dobot_async.simulator import SimulatedMagician, Simulation, simulate
from dobot_async.simulator.scene import Belt, Block, Piece, Scene

__all__ = ["DESKTOP", "PHONE", "Shown", "Stage", "stage", "until"]

logger = logging.getLogger(__name__)
VIEW = "dobot-async view"
IN_TIME = 20.0  # seconds for what takes far less: the machine may be busy
PHONE: dict[str, Any] = {
    "viewport": {"width": 412, "height": 915},
    "has_touch": True,
    "is_mobile": True,
    "device_scale_factor": 2.0,
}
DESKTOP: dict[str, Any] = {"viewport": {"width": 1440, "height": 900}}
SCREENSHOTS = os.environ.get("DOBOT_SCREENSHOTS", "")
SAID = "[...document.querySelectorAll('#toasts, .banners, .log')].map(each => each.innerText).join(' | ')"
EXPECTED = re.compile(r"GPU stall due to ReadPixels|WebGL-0x|Automatic fallback to software WebGL")


async def until(true: Callable[[], object], what: str, seconds: float = IN_TIME) -> None:
    """Return once something is so; fail if it is not in time."""
    try:
        async with asyncio.timeout(seconds):
            while not true():  # noqa: ASYNC110 - the simulated arm has no event for where it is
                await asyncio.sleep(0.02)
    except TimeoutError:
        raise AssertionError(what) from None


@dataclass
class Shown:
    """A page, and what went wrong in it.

    Attributes:
        page: The page.
        context: Its browser profile.
        console: Errors and warnings of its console.
        asked: The addresses that it asked for.
    """

    page: Page
    context: BrowserContext
    console: list[str] = field(default_factory=list)
    asked: list[str] = field(default_factory=list)

    def watch(self) -> None:
        """Keep what the page says and asks."""
        self.page.on("console", self._said)
        self.page.on("pageerror", lambda error: self.console.append(f"error: {error}"))
        self.page.on("request", self._asked)
        self.page.on("websocket", lambda socket: self.asked.append(socket.url))

    def _said(self, message: ConsoleMessage) -> None:
        if message.type in {"error", "warning"} and not EXPECTED.search(message.text):
            self.console.append(f"{message.type}: {message.text} ({message.location})")

    def _asked(self, request: Request) -> None:
        self.asked.append(request.url)

    async def take_control(self) -> None:
        """Press the button, and wait until it is so."""
        await self.page.get_by_role("button", name="Take control").click()
        await expect(self.page.get_by_role("button", name="Release")).to_be_visible(timeout=IN_TIME * 1000)

    async def tab(self, name: str) -> None:
        """Show a panel on a phone; a desktop shows all."""
        button = self.page.get_by_role("navigation").get_by_role("button", name=name, exact=True)
        if await button.is_visible():
            await button.click()

    async def press(self, name: str) -> None:
        """Put the mouse on a button and press it, without letting go."""
        button = self.page.get_by_role("button", name=name, exact=True)
        await button.scroll_into_view_if_needed()
        box = await button.bounding_box()
        assert box
        await self.page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        await self.page.mouse.down()

    async def picture(self, name: str) -> None:
        """Keep a screenshot, where they are wanted."""
        if SCREENSHOTS:
            await self.page.screenshot(path=Path(SCREENSHOTS) / f"{name}.png")

    def check(self) -> None:
        """Nothing went wrong, and nobody else was asked."""
        assert not self.console
        hosts = {urlsplit(url).hostname for url in self.asked if not url.startswith(("data:", "blob:"))}
        assert hosts == {"127.0.0.1"}, hosts


@dataclass
class Stage:
    """An arm, its panel, and the browser."""

    sim: Simulation[SimulatedMagician]
    arm: Magician
    panel: Panel
    browser: Browser
    cut: Cut
    shown: list[Shown] = field(default_factory=list)

    async def open(
        self,
        device: dict[str, Any] = PHONE,
        *,
        viewer: bool = False,
        solid: bool = False,
        script: str = "",
        **options: Any,
    ) -> Shown:
        """Open the panel on a device, and wait until it has the arm.

        Args:
            device: `PHONE` or `DESKTOP`.
            viewer: With the viewers' token.
            solid: With the picture in 3-D, whose drawing in software is what costs most time in these tests.
            script: What runs in the page before its own scripts.
            options: More for the browser, such as color_scheme="dark".
        """
        context = await self.browser.new_context(**device, **options)
        shown = Shown(await context.new_page(), context)
        self.shown.append(shown)
        shown.watch()
        view = "3d" if solid else "2d"
        await shown.page.add_init_script(
            f"localStorage.getItem('{VIEW}') ?? localStorage.setItem('{VIEW}', '{view}');{script}"
        )

        url = urlsplit(self.panel.viewer_url if viewer else self.panel.operator_url)
        await shown.page.goto(url._replace(netloc=f"127.0.0.1:{self.cut.port}").geturl())
        await shown.page.wait_for_selector('.dot[data-state="open"]', state="attached", timeout=IN_TIME * 1000)
        await expect(shown.page.locator(".numbers dd").first).not_to_have_text("\u2013", timeout=IN_TIME * 1000)
        return shown

    def where(self) -> tuple[float, float, float]:
        """Where the arm is, as it recorded it."""
        pose = self.sim.arm.pose
        return pose.x, pose.y, pose.z

    async def hold(self, shown: Shown, name: str) -> None:
        """Press a button until the arm moves, and go on holding.

        On a busy machine beats come late, and the arm is right to stop: then the button is pressed anew.
        """
        before = self.where()
        for _ in range(10):
            await shown.press(name)
            with suppress(AssertionError):
                return await until(lambda: distance(self.where(), before) > 0.3, "the arm does not move", 2.0)

            await shown.page.mouse.up()

        raise AssertionError("the arm does not move")

    async def moves(self) -> None:
        """Return once the arm moves."""
        before = self.where()
        await until(lambda: distance(self.where(), before) > 0.3, "the arm does not move")

    async def lead(self, shown: Shown, grip: tuple[float, float], to: tuple[float, float]) -> None:
        """Press at a place, drag to another one until the arm follows, and go on holding; see `hold`."""
        before = self.where()
        for _ in range(8):
            await shown.page.mouse.move(*grip)
            await shown.page.mouse.down()
            with suppress(AssertionError):
                await expect(shown.page.get_by_text("Following", exact=True)).to_be_visible(timeout=6000)
                await shown.page.mouse.move(*to, steps=5)
                return await until(lambda: distance(self.where(), before) > 2.0, "the arm does not follow", 4.0)

            await shown.page.mouse.up()

        raise AssertionError("the arm does not follow")

    async def stands(self) -> None:
        """Return once the arm stands, with no alarm: it was stopped, and did not run into a limit."""
        seen = [self.where()]

        def same() -> bool:
            seen.append(self.where())
            return len(seen) > 20 and all(each == seen[-1] for each in seen[-20:])

        await until(same, "the arm does not stop")
        assert not self.sim.arm.alarms

    async def close(self) -> None:
        """Close all pages; what they say at last is shown with a test that failed."""
        for number, shown in enumerate(self.shown):
            with suppress(Error, TimeoutError):
                said = await asyncio.wait_for(shown.page.evaluate(SAID), 2.0)
                logger.info("page %d: %s %s", number, said, shown.console)

            with suppress(Error):
                await shown.context.close()


def distance(a: tuple[float, ...], b: tuple[float, ...]) -> float:
    """How far apart two places are, mm."""
    return float(sum((one - other) ** 2 for one, other in zip(a, b, strict=True)) ** 0.5)


def scene() -> Scene:
    """Something to look at."""
    return Scene(
        pieces=[Piece("red", (250, -20), color="red"), Piece("blue", (235, 60), color="blue", yaw=25)],
        blocks=[Block("pallet", (170, -170), (80, 80, 20))],
        belts=[Belt("belt", (60, 260), (240, 60, 30))],
    )


@asynccontextmanager
async def stage(browser: Browser, *, speed: float = 1.0) -> AsyncIterator[Stage]:
    """A simulated Magician in a scene, and its panel behind a line that can be cut.

    Args:
        browser: The browser.
        speed: Simulated seconds per second.
    """
    cut, around = Cut(), scene()
    async with (
        cut.open(),
        simulate(scene=around, homed=True, speed=speed) as sim,
        Magician.connect(sim.url) as arm,
        panel(arm, port=0, scene=around, names=[f"127.0.0.1:{cut.port}"]) as running,
    ):
        await arm.recover()
        cut.to = running.port
        made = Stage(sim, arm, running, browser, cut)
        try:
            yield made
        finally:
            await made.close()
