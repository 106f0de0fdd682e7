"""The families in a fleet: their arms with a queue that tells the fleet what happens, and asks it before it sends.

    arm.queue.put_all --> Overseer.admitted --> the arm
    arm.queue.fail    --> Overseer.ended

A family is one of `FAMILIES`.
"""

from __future__ import annotations

from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from dataclasses import dataclass
from typing import Any, Protocol, cast

from dobot_async._core.queue.motion import Motion
from dobot_async._core.queue.queue import MotionQueue
from dobot_async._core.util.arguments import check_timeout
from dobot_async._core.util.hooks import Hooks
from dobot_async.errors import DobotError
from dobot_async.families import Each
from dobot_async.fleet.frames import Place
from dobot_async.magician import commands as magician
from dobot_async.magician.arm import Jog, Magician
from dobot_async.magician.queue import Batch, MagicianQueue
from dobot_async.mycobot import commands as mycobot
from dobot_async.mycobot.arm import MyCobot
from dobot_async.mycobot.queue import CobotBatch, CobotQueue
from dobot_async.ultraarm.arm import UltraArm, UltraArmJog
from dobot_async.ultraarm.queue import UltraArmBatch, UltraArmQueue
from dobot_async.wire import Command

__all__ = ["FAMILIES", "MAGICIAN", "MYCOBOT", "ULTRAARM", "AnyArm", "Family", "FleetQueue", "Overseer", "family_of"]

AnyArm = Magician | MyCobot | UltraArm
PLENTY = 1000
"""Commands that a queue on this side takes."""


class Overseer(Protocol):
    """What a queue of the fleet reports to."""

    def admitted(self, motions: Sequence[Motion], timeout: float | None) -> AbstractAsyncContextManager[float | None]:
        """While this is entered, motions may be sent; raises if they may not be. Yields the seconds that are left."""

    def roaming(self) -> AbstractAsyncContextManager[None]:
        """While this is entered, the arm may go anywhere; raises if it may not."""

    def ended(self, error: DobotError) -> None:
        """Takes note of what ends all motions of the arm."""


class FleetQueue(MotionQueue):
    """The part of a queue that reports to the fleet.

    Attributes:
        overseer: To whom; None until the arm is in its fleet.
    """

    overseer: Overseer | None = None

    async def put_all(self, motions: Sequence[Motion], *, timeout: float | None = None) -> None:
        """Gives several commands to the arm's queue once the fleet allows them; see `MotionQueue.put_all`."""
        if self.overseer is None:
            await super().put_all(motions, timeout=timeout)
            return

        async with self.overseer.admitted(motions, check_timeout(timeout)) as left:
            await super().put_all(motions, timeout=left)

    def fail(self, error: DobotError, *, spare: Sequence[Motion] = ()) -> None:
        """Ends all Motions with an error, and tells the fleet; see `MotionQueue.fail`."""
        if self.overseer:
            self.overseer.ended(error)

        super().fail(error, spare=spare)

    @asynccontextmanager
    async def roaming(self) -> AsyncIterator[None]:
        """While this is entered, the arm may go anywhere."""
        if self.overseer is None:
            yield
            return

        async with self.overseer.roaming():
            yield


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

    @asynccontextmanager
    async def jogging(self, direction: Jog | str) -> AsyncIterator[None]:
        """Jogs until the block ends, once the fleet allows it; see `Magician.jogging`."""
        async with self.queue.roaming(), super().jogging(direction):
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
    ask: Callable[[Any], Awaitable[object]]
    place: Callable[[Any], Awaitable[Place]]
    room: Callable[[Any], Awaitable[int]]
    pauses: bool = True
    stop: Command[None, Any] | None = None


async def magician_place(arm: Magician) -> Place:
    """Where a Magician's tool is."""
    pose = await arm.get_pose()
    return Place(pose.x, pose.y, pose.z, pose.r)


async def coords_place(arm: MyCobot | UltraArm) -> Place:
    """Where the tool of another arm is."""
    coords = await arm.get_coords()
    return Place(coords.x, coords.y, coords.z)


async def plenty(_: object) -> int:
    """What a queue on this side takes, and one that does not have to be paused."""
    return PLENTY


MAGICIAN = Family(
    arm=Magician,
    name="magician",
    kind=FleetMagician,
    batch=lambda arm: Batch(arm.queue),
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
    ask=lambda arm: cast(MyCobot, arm).request(mycobot.IS_POWER_ON, None),
    place=coords_place,
    room=plenty,
)

ULTRAARM = Family(
    arm=UltraArm,
    name="ultraarm",
    kind=FleetUltraArm,
    batch=lambda arm: UltraArmBatch(arm.queue, arm.pump),
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
