"""The three families as arms that follow: where each begins, what it tells of itself, and a line of datagrams."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Coroutine, Mapping
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import pytest

from dobot_async import Magician, MyCobot, UltraArm
from dobot_async._core.protocol.transport import Transport
from dobot_async.simulator import Faults, Simulation, UltraArmQuirks, simulate

__all__ = [
    "BY_NAME",
    "FAMILIES",
    "Family",
    "LateLine",
    "Rig",
    "SteppedTask",
    "each_family",
    "now",
    "rig",
]

Place = tuple[float, float, float]


@dataclass(frozen=True)
class Family:
    """One family.

    Attributes:
        name: Of its model.
        kind: Its class.
        joints: Where it begins.
        centre: Where that is, or near it: a place with room around it.
        details: What `simulate` needs.
    """

    name: str
    kind: Any
    joints: tuple[float, ...]
    centre: Place
    details: Mapping[str, Any] = field(default_factory=dict, compare=False)

    def connect(self, url: str, **options: Any) -> AbstractAsyncContextManager[Any]:
        """Its `connect`."""
        connection: AbstractAsyncContextManager[Any] = self.kind.connect(url, **options)
        return connection


FAMILIES = (
    Family("magician", Magician, (0, 30, 40, 0, 0), (239.8, 0, 22.4), {"homed": True}),
    Family("mycobot280", MyCobot, (0, -30, -60, 0, 0, 0), (226.3, -63.4, 181.2)),
    Family(
        "ultraarm",
        UltraArm,
        (0, 30, 40, 0),
        (263.1, 0, 9.7),
        {"homed": True, "quirks": UltraArmQuirks(constant_speed=True)},
    ),
)
BY_NAME = {family.name: family for family in FAMILIES}
each_family = pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.name)


@dataclass
class Rig:
    """A simulated arm, and the driver connected to it."""

    family: Family
    sim: Simulation
    arm: Any

    def following(self, **options: Any) -> AbstractAsyncContextManager[Any]:
        """Follow; an ultraArm without ramps, so that it gets on."""
        more = {"constant_speed": True} if self.family.kind is UltraArm else {}
        block: AbstractAsyncContextManager[Any] = self.arm.following(**{**more, **options})
        return block

    def beside(self, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Place:
        """A place beside the centre, mm."""
        a, b, c = self.family.centre
        return a + x, b + y, c + z

    @property
    def place(self) -> Place:
        """Where the tool really is."""
        if self.family.kind is MyCobot:
            x, y, z = self.sim.arm.coords[:3]
            return x, y, z

        return self.sim.arm.pose.x, self.sim.arm.pose.y, self.sim.arm.pose.z

    @property
    def moving(self) -> bool:
        """Whether it moves."""
        return bool(self.sim.arm.device.moving)

    async def stands(self, *, within: float = 0.2, seconds: float = 3.0) -> None:
        """Fails unless the arm rests within a time, and goes on resting."""
        await asyncio.sleep(within)
        before, ends = self.sim.arm.device.joints, now() + seconds
        while now() < ends:
            assert not self.moving
            assert self.sim.arm.device.joints == before
            await asyncio.sleep(0.02)

    async def sets_out(self) -> None:
        """Returns when it moves; fails if it does not within a second."""
        ends = now() + 1
        while not self.moving:
            assert now() < ends
            await asyncio.sleep(0.005)


def now() -> float:
    """The time of the running loop."""
    return asyncio.get_running_loop().time()


@asynccontextmanager
async def rig(family: Family, *, faults: Faults | None = None, **options: Any) -> AsyncIterator[Rig]:
    """A simulated arm where its family begins, and the driver; each message takes 3 ms unless faults are given."""
    details: dict[str, Any] = {**family.details, "faults": faults or Faults(latency=0.003)}
    async with simulate(family.name, **details) as sim:
        sim.arm.device.place(family.joints)
        async with family.connect(sim.url, **options) as arm:
            yield Rig(family, sim, arm)


class SteppedTask:
    """A task of a program, cancelled when it waits for the n-th time.

    Attributes:
        task: The task.
        waits: How often it has waited so far.
    """

    def __init__(self, program: Coroutine[Any, Any, Any], cancel_at: int) -> None:
        self.waits = 0
        self._cancel_at = cancel_at
        self.task = asyncio.create_task(self._run(program))

    async def _run(self, program: Coroutine[Any, Any, Any]) -> Any:
        return await Counted(program, self._wait)

    def _wait(self) -> None:
        self.waits += 1
        if self.waits == self._cancel_at:
            asyncio.get_running_loop().call_soon(self.task.cancel)


class Counted:
    """An awaitable that tells each time its coroutine waits."""

    def __init__(self, program: Coroutine[Any, Any, Any], waits: Callable[[], None]) -> None:
        self._program = program
        self._waits = waits

    def __await__(self) -> Any:
        inner = self._program.__await__()
        step: Callable[[], Any] = lambda: inner.send(None)  # noqa: E731
        while True:
            try:
                waited_for = step()
            except StopIteration as stop:
                return stop.value

            self._waits()
            try:
                yield waited_for
            except BaseException as error:  # noqa: BLE001 - it goes on inside
                step = partial(inner.throw, error)
            else:
                step = lambda: inner.send(None)  # noqa: E731


class LateLine:
    """A line of datagrams to a simulation: what a test says is late, and is overtaken by what is sent behind it."""

    in_flight = window = 1

    def __init__(self, inner: Transport, reorder_window: float) -> None:
        self.reorder_window = reorder_window
        self.late: Callable[[bytes], float] = lambda _: 0.0
        self._inner = inner
        self._tasks: set[asyncio.Task[None]] = set()

    async def send(self, data: bytes) -> None:
        """Sends a datagram, now or later."""
        seconds = self.late(data)
        if not seconds:
            await self._inner.send(data)
            return

        task = asyncio.create_task(self._send_later(data, seconds))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def receive(self) -> bytes:
        """Returns the next datagram of the arm."""
        return await self._inner.receive()

    async def aclose(self) -> None:
        """Closes the line."""
        for task in list(self._tasks):
            task.cancel()

        await self._inner.aclose()

    async def _send_later(self, data: bytes, seconds: float) -> None:
        await asyncio.sleep(seconds)
        await self._inner.send(data)
