"""The families in a fleet: their arms with a queue that tells the fleet what happens, and asks it before it sends.

    arm.queue.put_all --> MotionGate.admitted --> the arm
    arm.queue.fail    --> MotionGate.ended

A family is one of `FAMILIES`.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncGenerator, Awaitable, Callable
from contextlib import asynccontextmanager, nullcontext
from dataclasses import dataclass
from typing import Any, TypeVar

from dobot_async._core.protocol.wire import Command
from dobot_async._core.queue.motion import Motion
from dobot_async._core.util.hooks import Hooks
from dobot_async.arms.base import Arm
from dobot_async.arms.magician import commands as magician
from dobot_async.arms.magician.arm import Magician
from dobot_async.arms.magician.jogs import Jog
from dobot_async.arms.magician.queue import Batch, MagicianQueue
from dobot_async.arms.magician.stopping import STILL
from dobot_async.arms.mycobot import commands as mycobot
from dobot_async.arms.mycobot.arm import MyCobot
from dobot_async.arms.mycobot.queue import CobotBatch, CobotQueue
from dobot_async.arms.registry import Each
from dobot_async.arms.ultraarm import commands as ultraarm
from dobot_async.arms.ultraarm.arm import UltraArm, UltraArmJog
from dobot_async.arms.ultraarm.queue import UltraArmBatch, UltraArmQueue
from dobot_async.errors import MotionUnknown, ReplyTimeout
from dobot_async.fleet.magician_planner import MagicianPlanner
from dobot_async.fleet.planner import Planner, Unplanned
from dobot_async.fleet.queue import FleetQueue

__all__ = ["FAMILIES", "MAGICIAN", "MYCOBOT", "ULTRAARM", "AnyArm", "FleetFamily", "family_of"]

AnyArm = Magician | MyCobot | UltraArm
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
        self.queue: FleetMagicianQueue = FleetMagicianQueue(self._executor)  # pyright: ignore[reportIncompatibleVariableOverride] - only set here

    @property
    def restarts(self) -> int:
        """How often it was seen to have been switched off and on."""
        return self._executor.status.restarts

    async def check_restart(self) -> None:
        """Raises MotionUnknown if an arm with nothing to do was switched off and on; it has failed then."""
        try:
            await self._executor.status.check_idle()
        except MotionUnknown as error:
            self.queue.give_up(error)
            raise

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
    async def jogging(self, direction: Jog | str) -> AsyncGenerator[None]:
        """Jogs until the block ends, once the fleet allows it; see `Magician.jogging`.

        Raises:
            MotionStopped: It has come to the limits of the arm, where it was stopped.
        """

        async def halt() -> None:
            await self.link.request(magician.SET_JOG_CMD, STILL, timeout=math.inf, urgent=True)

        async with self.queue.unplanned_motion(halt), super().jogging(direction):
            yield


class FleetMyCobot(MyCobot):
    """An arm of the myCobot family in a fleet."""

    def __init__(self, link: Any, *arguments: Any, **options: Any) -> None:
        super().__init__(link, *arguments, **options)
        self._executor.on_unknown = Hooks()
        self.queue: FleetCobotQueue = FleetCobotQueue(self._executor, self.model)  # pyright: ignore[reportIncompatibleVariableOverride] - only set here

    @asynccontextmanager
    async def jogging(self, direction: str, **options: Any) -> AsyncGenerator[None]:
        """Jogs until the block ends, once the fleet allows it; see `MyCobot.jogging`."""
        async with self.queue.unplanned_motion(), super().jogging(direction, **options):
            yield


class FleetUltraArm(UltraArm):
    """An ultraArm in a fleet."""

    def __init__(self, link: Any, **options: Any) -> None:
        super().__init__(link, **options)
        self._executor.on_unknown = Hooks()
        self.queue: FleetUltraArmQueue = FleetUltraArmQueue(self._executor, self.pump)  # pyright: ignore[reportIncompatibleVariableOverride] - only set here

    @property
    def homed(self) -> bool:
        """False once its motors were told to let go, until it was home; that it was switched off does not show."""
        return self._runner.state.homed

    @asynccontextmanager
    async def jogging(self, direction: UltraArmJog | str, **options: Any) -> AsyncGenerator[None]:
        """Jogs until the block ends, once the fleet allows it; see `UltraArm.jogging`."""
        async with self.queue.unplanned_motion(), super().jogging(direction, **options):
            yield


@dataclass(frozen=True, slots=True)
class FleetFamily:
    """What the fleet has to know of a family.

    Attributes:
        arm: Its public class.
        name: Its word in a cell file.
        kind: Its class in a fleet.
        batch: Makes an empty batch for a queue.
        planner: Makes what knows its ways, and the heading of its rail.
        leftovers: Waits until it has done what an earlier program has left in its queue.
        stop: The command that stops it, is acknowledged, and may be sent twice; None if there is none.
        ask: A cheap question, for measuring how long an answer takes.
        room: The question how many commands the arm's queue can take; None for a queue on this side, which takes many.
        pauses: Whether its queue can be paused.
    """

    arm: type[Any]
    name: str
    kind: type[Any]
    batch: Callable[[Any], Any]
    planner: Callable[[Any, float | None], Planner[Any]]
    leftovers: Callable[[Any], Awaitable[None]]
    ask: Command[None, Any]
    room: Command[None, int] | None = None
    pauses: bool = True
    stop: Command[None, Any] | None = None


def mycobot_planner(arm: FleetMyCobot, _: float | None) -> Unplanned:
    """What knows no ways of an arm that always knows its place."""
    return Unplanned(arm, lambda: False)


def ultraarm_planner(arm: FleetUltraArm, _: float | None) -> Unplanned:
    """What knows no ways of an arm that has to be homed."""
    return Unplanned(arm, lambda: not arm.homed)


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


async def nothing_left(_: Arm) -> None:
    """An arm without a queue has nothing left but the motion that it is at, which shows."""


async def ultraarm_leftovers(arm: FleetUltraArm) -> None:
    """Waits until an ultraArm's own queue is empty."""
    while await arm.get_queue_size():  # noqa: ASYNC110 - the arm is asked
        await asyncio.sleep(LOOK)


MAGICIAN = FleetFamily(
    arm=Magician,
    name="magician",
    kind=FleetMagician,
    batch=lambda arm: Batch(arm.queue),
    planner=MagicianPlanner,
    leftovers=magician_leftovers,
    ask=magician.GET_QUEUED_CMD_CURRENT_INDEX,
    room=magician.GET_QUEUED_CMD_LEFT_SPACE,
    stop=magician.SET_QUEUED_CMD_FORCE_STOP_EXEC,
)

MYCOBOT = FleetFamily(
    arm=MyCobot,
    name="mycobot",
    kind=FleetMyCobot,
    batch=lambda arm: CobotBatch(arm.queue, arm.model),
    planner=mycobot_planner,
    leftovers=nothing_left,
    ask=mycobot.IS_POWER_ON,
)

ULTRAARM = FleetFamily(
    arm=UltraArm,
    name="ultraarm",
    kind=FleetUltraArm,
    batch=lambda arm: UltraArmBatch(arm.queue, arm.pump),
    planner=ultraarm_planner,
    leftovers=ultraarm_leftovers,
    ask=ultraarm.GET_QUEUE_SIZE,
    pauses=False,
)

FAMILIES: Each[FleetFamily] = Each("fleet")
"""All of them."""


def family_of(kind: type[Any]) -> FleetFamily:
    """Returns what a fleet knows of a class of arms; raises ValueError for another class."""
    found = next((family for family in FAMILIES if family.arm is kind), None)
    if found is None:
        names = ", ".join(family.arm.__name__ for family in FAMILIES)
        raise ValueError(f"a fleet has arms of the families {names}, not {kind!r}")

    return found
