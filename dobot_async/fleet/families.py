"""The families in a fleet: their arms with a queue that tells the fleet what happens, and asks it before it sends.

    arm.queue.put_all --> Overseer.admitted --> the arm
    arm.queue.fail    --> Overseer.ended

A family is one of `FAMILIES`.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, nullcontext
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol, TypeVar, cast

from dobot_async._core.queue.motion import Motion
from dobot_async._core.util.hooks import Hooks
from dobot_async.errors import ReplyTimeout
from dobot_async.families import Each
from dobot_async.fleet.frames import Place
from dobot_async.fleet.magician_planner import MagicianPlanner
from dobot_async.fleet.planner import Planner, Unplanned
from dobot_async.fleet.queue import FleetQueue
from dobot_async.magician import commands as magician
from dobot_async.magician.arm import Magician
from dobot_async.magician.jogs import Jog
from dobot_async.magician.queue import Batch, MagicianQueue
from dobot_async.magician.stopping import STILL
from dobot_async.mycobot import commands as mycobot
from dobot_async.mycobot.arm import MyCobot
from dobot_async.mycobot.queue import CobotBatch, CobotQueue
from dobot_async.ultraarm.arm import UltraArm, UltraArmJog
from dobot_async.ultraarm.queue import UltraArmBatch, UltraArmQueue
from dobot_async.wire import Command

__all__ = ["FAMILIES", "MAGICIAN", "MYCOBOT", "ULTRAARM", "AnyArm", "Family", "family_of"]

AnyArm = Magician | MyCobot | UltraArm
PLENTY = 1000
"""Commands that a queue on this side takes."""

LOOK = 0.1  # seconds between two looks at an arm that still does what was left in its queue
WAYS_DEPEND_ON = (
    magician.EndEffectorParams,
    magician.PTPJumpParams,
    magician.PTPJump2Params,
    magician.DeviceWithL,
    magician.JOGCmd,
)
Q = TypeVar("Q")
R = TypeVar("R")


class FleetMagicianQueue(FleetQueue, MagicianQueue):
    """A Magician's queue in a fleet."""


class FleetCobotQueue(FleetQueue, CobotQueue):
    """A myCobot's queue in a fleet."""


class FleetUltraArmQueue(FleetQueue, UltraArmQueue):
    """An ultraArm's queue in a fleet."""


class FleetMagician(Magician):
    """A Magician in a fleet."""

    def __init__(self, link: Any, **options: Any) -> None:
        super().__init__(link, **options)
        self._executor.on_unknown = Hooks()  # it told the queue that this one replaces
        self.queue: FleetMagicianQueue = FleetMagicianQueue(self._executor)

    async def request(self, command: Command[Q, R], value: Q, *, timeout: float | None = None) -> R:
        """Sends any row immediately; what ways depend on, once the fleet allows it; see `Magician.request`."""
        async with self.queue.changing(value) if isinstance(value, WAYS_DEPEND_ON) else nullcontext():
            return await super().request(command, value, timeout=timeout)

    async def set_end_effector(self, tool: magician.EndEffectorParams, *, timeout: float | None = None) -> None:
        """Says which tool is on the arm, once the fleet allows it; see `Magician.set_end_effector`."""
        async with self.queue.changing(tool):
            await super().set_end_effector(tool, timeout=timeout)

    async def set_rail(self, *, on: bool = True, **options: Any) -> None:
        """Says whether the arm stands on a rail, once the fleet allows it; see `Magician.set_rail`."""
        async with self.queue.changing(magician.DeviceWithL(on)):
            await super().set_rail(on=on, **options)

    @asynccontextmanager
    async def jogging(self, direction: Jog | str) -> AsyncIterator[None]:
        """Jogs until the block ends, once the fleet allows it; see `Magician.jogging`.

        Raises:
            MotionStopped: It has come to the limits of the arm, where it was stopped.
        """

        async def halt() -> None:
            await self.link.request(magician.SET_JOG_CMD, STILL, timeout=math.inf, urgent=True)

        async with self.queue.roaming(halt), super().jogging(direction):
            yield


class FleetMyCobot(MyCobot):
    """An arm of the myCobot family in a fleet."""

    def __init__(self, link: Any, *arguments: Any, **options: Any) -> None:
        super().__init__(link, *arguments, **options)
        self._executor.on_unknown = Hooks()
        self.queue: FleetCobotQueue = FleetCobotQueue(self._executor, self.model)

    @asynccontextmanager
    async def jogging(self, direction: str, **options: Any) -> AsyncIterator[None]:
        """Jogs until the block ends, once the fleet allows it; see `MyCobot.jogging`."""
        async with self.queue.roaming(), super().jogging(direction, **options):
            yield


class FleetUltraArm(UltraArm):
    """An ultraArm in a fleet."""

    def __init__(self, link: Any, **options: Any) -> None:
        super().__init__(link, **options)
        self._executor.on_unknown = Hooks()
        self.queue: FleetUltraArmQueue = FleetUltraArmQueue(self._executor, self.pump)

    @asynccontextmanager
    async def jogging(self, direction: UltraArmJog | str, **options: Any) -> AsyncIterator[None]:
        """Jogs until the block ends, once the fleet allows it; see `UltraArm.jogging`."""
        async with self.queue.roaming(), super().jogging(direction, **options):
            yield


@dataclass(frozen=True, slots=True)
class Family:
    """What the fleet has to know of a family.

    Attributes:
        arm: Its public class.
        name: Its word in a cell file.
        kind: Its class in a fleet.
        batch: Makes an empty batch for a queue.
        planner: Makes what knows its ways, and the heading of its rail.
        recover: Makes it ready again after a failure.
        leftovers: Waits until it has done what an earlier program has left in its queue.
        stop: The command that stops it, is acknowledged, and may be sent twice; None if there is none.
        ask: A cheap question, for measuring how long an answer takes.
        place: Tells where the tool is.
        room: Tells how many commands the queue can take while it is paused.
        pauses: Whether its queue can be paused.
    """

    arm: type[Any]
    name: str
    kind: type[Any]
    batch: Callable[[Any], Any]
    planner: Callable[[Any, float | None], Planner[Any]]
    recover: Callable[[Any], Awaitable[None]]
    leftovers: Callable[[Any], Awaitable[None]]
    ask: Callable[[Any], Awaitable[object]]
    place: Callable[[Any], Awaitable[Place]]
    room: Callable[[Any], Awaitable[int]]
    pauses: bool = True
    stop: Command[None, Any] | None = None


class HasCoords(Protocol):
    """An arm that tells where its tool is."""

    async def get_coords(self) -> Coords:
        """Returns it."""


class Coords(Protocol):
    """Where a tool is, mm."""

    @property
    def x(self) -> float:
        """Forward."""

    @property
    def y(self) -> float:
        """To the left."""

    @property
    def z(self) -> float:
        """Up."""


async def magician_place(arm: Magician) -> Place:
    """Where a Magician's tool is."""
    pose = await arm.get_pose()
    return Place(pose.x, pose.y, pose.z, pose.r)


async def coords_place(arm: HasCoords) -> Place:
    """Where the tool of another arm is."""
    coords = await arm.get_coords()
    return Place(coords.x, coords.y, coords.z)


def unplanned(arm: HasCoords, _: float | None) -> Unplanned:
    """What knows no ways."""
    return Unplanned(partial(coords_place, arm))


async def cleared(arm: FleetMyCobot | FleetUltraArm) -> None:
    """Empties the queue of an arm, and lets it run."""
    await arm.queue.clear()


async def magician_leftovers(arm: FleetMagician) -> None:
    """Waits for a mark behind what lies in the queue: the index alone tells how far the arm is with all before it."""
    mark = Motion(arm.queue, arm.queue.prepare(magician.SET_WAIT_CMD, magician.WAITCmd(0)))
    while True:
        try:
            await arm.queue.put_admitted([mark], None, arm.queue.epoch)
        except ReplyTimeout:
            await asyncio.sleep(LOOK)
            mark = Motion(arm.queue, mark.entry)
        else:
            break

    await mark


async def nothing_left(_: object) -> None:
    """An arm without a queue has nothing left but the motion that it is at, which shows."""


async def ultraarm_leftovers(arm: FleetUltraArm) -> None:
    """Waits until an ultraArm's own queue is empty."""
    while await arm.get_queue_size():  # noqa: ASYNC110 - the arm is asked
        await asyncio.sleep(LOOK)


async def plenty(_: object) -> int:
    """What a queue on this side takes, and one that does not have to be paused."""
    return PLENTY


MAGICIAN = Family(
    arm=Magician,
    name="magician",
    kind=FleetMagician,
    batch=lambda arm: Batch(arm.queue),
    planner=MagicianPlanner,
    recover=lambda arm: cast(Magician, arm).recover(),
    leftovers=magician_leftovers,
    ask=lambda arm: cast(Magician, arm).request(magician.GET_QUEUED_CMD_CURRENT_INDEX, None),
    place=magician_place,
    room=lambda arm: cast(Magician, arm).request(magician.GET_QUEUED_CMD_LEFT_SPACE, None),
    stop=magician.SET_QUEUED_CMD_FORCE_STOP_EXEC,
)

MYCOBOT = Family(
    arm=MyCobot,
    name="mycobot",
    kind=FleetMyCobot,
    batch=lambda arm: CobotBatch(arm.queue, arm.model),
    planner=unplanned,
    recover=cleared,
    leftovers=nothing_left,
    ask=lambda arm: cast(MyCobot, arm).request(mycobot.IS_POWER_ON, None),
    place=coords_place,
    room=plenty,
)

ULTRAARM = Family(
    arm=UltraArm,
    name="ultraarm",
    kind=FleetUltraArm,
    batch=lambda arm: UltraArmBatch(arm.queue, arm.pump),
    planner=unplanned,
    recover=cleared,
    leftovers=ultraarm_leftovers,
    ask=lambda arm: cast(UltraArm, arm).get_queue_size(),
    place=coords_place,
    room=plenty,
    pauses=False,
)

FAMILIES: Each[Family] = Each("fleet")
"""All of them."""


def family_of(kind: type[Any]) -> Family:
    """Returns what a fleet knows of a class of arms; raises ValueError for another class."""
    found = next((family for family in FAMILIES if family.arm is kind), None)
    if found is None:
        names = ", ".join(family.arm.__name__ for family in FAMILIES)
        raise ValueError(f"a fleet has arms of the families {names}, not {kind!r}")

    return found
