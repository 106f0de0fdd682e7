"""One arm of the panel: its connection, its lease, its tasks, and the status that all pages get.

    run: connected? --> ArmPoller (reads, while a page is connected)
                        OperatorLease --> ArmTasks (tasks that move it)
                        stop: anybody's, ahead of everything

An arm that the panel has connected itself is connected anew when its link is lost. One that belongs to a program is
left to it.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Awaitable, Callable
from contextlib import suppress
from typing import Any
from urllib.parse import urlsplit

from dobot_async import LinkState
from dobot_async._core.util.tasks import cancel_and_join
from dobot_async._core.util.text import printable
from dobot_async.errors import DobotError
from dobot_async.panel.arm_tasks import ArmTask, ArmTasks
from dobot_async.panel.arms import ArmView, view_of
from dobot_async.panel.hold_to_run import HoldToRun
from dobot_async.panel.lease import Operator, OperatorLease
from dobot_async.panel.messages import Hub
from dobot_async.panel.poller import ArmPoller
from dobot_async.panel.problems import PanelRefusal
from dobot_async.panel.sources import Source
from dobot_async.panel.taught_list import Taught

__all__ = ["Station"]

logger: logging.Logger = logging.getLogger("dobot_async.panel")
RETRY = 2.0  # seconds until an arm that did not answer is tried again
WAY_OUT = 1.9  # seconds for all that is put in order when a lease ends, on a line that is dead as well
AT_LEAST = 0.1  # seconds of them for what comes last
SHARED = ("tcp", "ws", "wss", "zenoh")
"""Ways that may lead to a bridge, whose lease lasts as long as the connection: it is given back with the panel's."""


class Station:
    """See the module.

    Attributes:
        name: The arm's.
        lease: Whose it is.
        works: What it does.
        taught: What it was taught.
        holds: The hands that hold it in motion, or will when what they have held before has ended, by their presses.
        follow: What it follows, None while it follows nothing.
        armed_until: The loop's time until which the laser may be on.
    """

    def __init__(self, name: str, source: Source, hub: Hub, told: Callable[[Station], None]) -> None:
        self.name = name
        self.source = source
        self.hub = hub
        self.lease: OperatorLease = OperatorLease(self._begin_lease, self._end_lease, self._lease_changed)
        self.works: ArmTasks = ArmTasks(self._works_changed)
        self.taught: Taught = Taught(self)
        self.holds: dict[int, HoldToRun] = {}
        self.follow: Any = None
        self.armed_until: float = 0.0
        self.watched_inputs: tuple[int, ...] = ()
        self._told = told
        self._now = asyncio.get_running_loop().time
        self._view: ArmView | None = None
        self._gone = asyncio.Event()
        self._closed = asyncio.Event()
        self._there = asyncio.Event()
        self._darkening: asyncio.Task[None] | None = None
        self._stops: set[asyncio.Task[None]] = set()
        self._watch = ArmPoller(self)
        self._wrote = False

    @property
    def view(self) -> ArmView:
        """The arm; raises Refusal while it is not connected."""
        if self._view is None:
            raise PanelRefusal("link", f"{self.name} is not connected")

        return self._view

    @property
    def connected(self) -> bool:
        """Whether the arm is."""
        return self._view is not None

    def describe(self) -> dict[str, Any]:
        """Return what a page has to know of it."""
        x, y, z, yaw = self.source.base
        limits = self.source.limits
        return {
            "name": self.name,
            "base": {"x": x, "y": y, "z": z, "yaw": yaw},
            "limits": [list(limits.x), list(limits.y), list(limits.z)] if limits else None,
            "connected": self.connected,
            "simulated": urlsplit(self.source.url).scheme == "sim",
            **(self._view.describe() | {"reach": self._watch.reach} if self._view else {}),
        }

    def described(self) -> None:
        """Tell everybody what is known of the arm."""
        self._told(self)

    @property
    def pose(self) -> dict[str, float]:
        """The coordinates of the tool that were read last."""
        return self._watch.pose

    def log(self, text: str, level: str = "info") -> None:
        """Tell everybody, and the log, what has happened."""
        words = printable(text, 1000)
        logger.log(logging.INFO if level == "info" else logging.WARNING, "%s: %s", self.name, words)
        self.hub.log(time=time.time(), text=f"{self.name}: {words}", level=level)

    async def run(self) -> None:
        """Have the arm connected, until `close`."""
        before = ""
        while not self._closed.is_set():
            self._gone.clear()
            why = ""
            try:
                async with self.source.connect() as arm:
                    await self._serve(arm)
            except (DobotError, ValueError, OSError) as error:
                why = printable(str(error) or type(error).__name__, 500)

            if why and why != before:
                self.log(why, "warning")

            before = why
            self.hub.publish("link", self.name, state="lost" if why else "connecting", why=why, round_trip=None)
            if why or not self.source.owned:
                with suppress(TimeoutError):
                    async with asyncio.timeout(RETRY if self.source.owned else None):
                        await self._closed.wait()

    def close(self) -> None:
        """Let `run` end."""
        self._closed.set()
        self._gone.set()

    def let_go(self, why: str) -> None:
        """End all holds."""
        for each in self.holds.values():
            each.end(why)

    def start(self, work: ArmTask, doing: Callable[[ArmView], Awaitable[Any]], owner: Operator) -> asyncio.Task[Any]:
        """Begin something that moves the arm, for who has the lease; raise Refusal if that cannot be now."""
        self.lease.check(owner)
        view, self._wrote = self.view, True

        async def done() -> Any:
            return await doing(view)

        return self.works.start(work, done())

    async def stop(self, by: Operator) -> None:
        """Stop the arm now, for anybody; that of somebody else ends the lease of who has it.

        Raises:
            DobotError: The arm has not acknowledged it yet; it is told again until it does.
        """
        view, holder = self.view, self.lease.holder
        if not self._stops:  # a page says it again and again until it has an answer
            self.log(f"{by.name} stops the arm", "warning")

        self.let_go("stopped")
        stopping = asyncio.create_task(view.arm.stop(), name=f"dobot_async panel stop of {self.name}")
        self._stops.add(stopping)
        stopping.add_done_callback(self._stop_ended)
        await asyncio.sleep(0)  # the stop is on its way before anything else is done
        self.works.begin_to_end()
        view.tools.stopped()
        self.armed_until = 0.0
        self._watch.tools_changed()
        if holder and holder is not by:
            await self.lease.end(holder, f"{by.name} has stopped the arm")

        await asyncio.shield(stopping)
        view.tools.stopped()
        self._wrote = True
        if self.lease.holder is None:
            self._give_back()

    def arm_laser(self, seconds: float) -> None:
        """Allow the laser for some seconds; it goes off when they are over."""
        self.armed_until = self._now() + seconds
        if self._darkening is None or self._darkening.done():
            self._darkening = asyncio.create_task(self._darken(self.view), name=f"dobot_async panel laser {self.name}")

        self._watch.tools_changed()

    def check_armed(self) -> None:
        """Raise Refusal while the laser is not allowed."""
        if self._now() >= self.armed_until:
            raise PanelRefusal("wrong", "arm the laser first, and wear the glasses")

    @property
    def armed(self) -> float:
        """For how many seconds the laser is still allowed."""
        return max(0.0, self.armed_until - self._now())

    def tools_changed(self) -> None:
        """Tell everybody what the tools do."""
        self._watch.tools_changed()

    async def _serve(self, arm: Any) -> None:
        """Work with a connected arm until it is lost, or not wanted any more."""
        self._view = view_of(arm)
        self._there.set()
        self._wrote = False
        arm.link.on_lost.add(self._lost)
        watching = asyncio.create_task(self._watch.run(self._view), name=f"dobot_async panel watch of {self.name}")
        self.log("connected")
        self._told(self)
        self.taught.connected(self._view)
        try:
            if arm.link.state.value is not LinkState.LOST and not self._closed.is_set():
                await self._gone.wait()
        finally:
            if holder := self.lease.holder:
                await self.lease.end(holder, "the connection to the arm has ended")

            await self.works.end()
            for task in [watching, *self._stops, *([self._darkening] if self._darkening else [])]:
                await cancel_and_join(task)

            self._view = None
            self._there.clear()
            self._told(self)

    def _lost(self, error: Exception) -> None:
        self.log(str(error), "error")
        self._gone.set()

    async def _begin_lease(self) -> None:
        """Of an arm of the panel's own: let nothing begin to move that an earlier program has left behind.

        Behind a bridge this takes the bridge's lease, or raises if another program has it.
        """
        with suppress(TimeoutError):
            async with asyncio.timeout(RETRY):  # it may be connected anew just now
                await self._there.wait()

        view = self.view
        if not self.source.owned:
            return

        self._wrote = True
        try:
            await view.begin()
        except DobotError as error:
            raise PanelRefusal("lease", f"the arm does not take it; does another program move it? {error}") from error

    async def _end_lease(self) -> None:
        """The arm stands, and nothing burns or turns; what was set for jogs is set back."""
        deadline = self._now() + WAY_OUT
        self.let_go("left")
        await self.works.end()
        view = self._view
        if view is None:
            return

        self.armed_until = 0.0
        with suppress(DobotError, TimeoutError):
            async with asyncio.timeout_at(max(deadline, self._now() + AT_LEAST)):
                if view.tools.dangerous:
                    view.tools.stopped()
                    await view.arm.stop()

                await view.end_jogs()

        self._watch.tools_changed()
        self._give_back()

    def _give_back(self) -> None:
        """Let a bridge give the arm to others: it does when the connection ends that has written something."""
        if self.source.owned and self._wrote and urlsplit(self.source.url).scheme in SHARED:
            self._gone.set()

    async def _darken(self, view: ArmView) -> None:
        """Switch the laser off when its time is over."""
        while self.armed:  # noqa: ASYNC110 - it may be allowed for longer meanwhile
            await asyncio.sleep(self.armed)

        if view.tools.laser:
            self.log("the laser's time is over")
            try:
                await view.laser(on=False)
            except DobotError as error:
                self.log(f"the laser may be on: {error}; the arm is stopped", "error")
                with suppress(DobotError):
                    await view.arm.stop()

        self._watch.tools_changed()

    def _stop_ended(self, stopping: asyncio.Task[None]) -> None:
        self._stops.discard(stopping)
        if not stopping.cancelled() and (error := stopping.exception()):
            self.log(f"it is not known whether the arm stands: {error}", "error")

    def _lease_changed(self, words: str) -> None:
        self.log(words)
        self._told(self)

    def _works_changed(self) -> None:
        arm = self._view.arm if self._view else None
        self.hub.publish("queue", self.name, items=self.works.told(), pending=arm.queue.pending if arm else 0)
