"""What has to be known of each family of arms to handle parts: straight lines, and how long its tools need."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from dobot_async._core.queue.epoch import Epoch
from dobot_async._core.util.arguments import to_float
from dobot_async.arms.base import Arm
from dobot_async.arms.magician.arm import Magician
from dobot_async.arms.magician.params import Pose, PTPMode
from dobot_async.arms.mycobot.arm import MyCobot
from dobot_async.arms.mycobot.params import MoveMode
from dobot_async.arms.mycobot.pose import CobotPose
from dobot_async.arms.ultraarm import commands as u
from dobot_async.arms.ultraarm.arm import UltraArm
from dobot_async.arms.ultraarm.verbs import SPEED, check_speed
from dobot_async.grid import GridPlace
from dobot_async.grid import place as to_place

__all__ = [
    "AIR",
    "Check",
    "HandlingTraits",
    "gripper_holds",
    "handling_traits",
    "move_straight",
    "settle_time",
    "stop_check",
    "target_of",
    "to_arguments",
]

Check = Callable[[], bool | Awaitable[bool]]
"""Tells whether there is a part in the tool."""

CLOSED = 3.0
"""Percent of its opening up to which a gripper counts as closed on nothing."""

POSES = (Pose, CobotPose, u.UltraArmPose)


Release = Callable[[Any], Awaitable[None]]


@dataclass(frozen=True, slots=True)
class HandlingTraits:
    """What a family of arms has to be known for to handle parts.

    Attributes:
        title: What it is called.
        straight: Moves to a place along a straight line; takes what `move_to` takes besides.
        check: Raises ValueError for x, y, z that it cannot reach.
        settle: Seconds that a tool needs after its verb has returned.
        release: Lets go, where that is more than the verb with False.
        lacks: The tools that it does not have.
    """

    title: str
    straight: Callable[..., Awaitable[None]]
    check: Callable[[Any, Any], None]
    settle: Mapping[str, float]
    release: Mapping[str, Callable[[Any], Awaitable[None]]] = field(
        default_factory=dict[str, Callable[[Any], Awaitable[None]]]
    )
    lacks: frozenset[str] = frozenset()


def target_of(where: Any) -> Any:
    """Return a pose as it is, or three numbers as a place; raise ValueError or TypeError for anything else."""
    return where if isinstance(where, POSES) else to_place(where)


def to_arguments(target: Any) -> tuple[Any, ...]:
    """Return what `move_to` takes of a target."""
    return tuple(target) if isinstance(target, GridPlace) else (target,)


def check_magician(arm: Magician, target: Any) -> None:
    """The joints are within their limits; without a pose the tool's rotation is 0."""
    arm.kinematics.check(target.x, target.y, target.z, getattr(target, "r", 0.0))


def check_mycobot(arm: MyCobot, target: Any) -> None:
    """The coordinates are within the model's reach."""
    for number, axis in enumerate("xyz", 1):
        arm.model.check_coord(number, getattr(target, axis))


def check_ultraarm(arm: UltraArm, target: Any) -> None:
    """The coordinates are within the limits."""
    arm.limits.check(u.CoordsMove(target.x, target.y, target.z))


async def straight_magician(arm: Any, target: Any, **more: Any) -> None:
    """MOVL."""
    await arm.move_to(*to_arguments(target), **{"mode": PTPMode.MOVL_XYZ, **more})


async def straight_mycobot(arm: Any, target: Any, **more: Any) -> None:
    """LINEAR."""
    await arm.move_to(*to_arguments(target), **{"mode": MoveMode.LINEAR, **more})


async def straight_other(arm: Any, target: Any, **more: Any) -> None:
    """As the arm goes."""
    await arm.move_to(*to_arguments(target), **more)


async def straight_ultraarm(arm: UltraArm, target: Any, *, speed: float | None = SPEED) -> None:
    """G1: with G0 the joints go their own ways."""
    value = u.CoordsMove(target.x, target.y, target.z, getattr(target, "e", None), f=check_speed(speed))
    await arm.perform(u.MOVE_LINE, value, None)


AIR, FINGERS = 0.3, 0.6
"""Seconds: a cup holds 0.2 s after its valve, a gripper 0.5 s, and the air is not to be the slower one for once."""

HANDS: Mapping[type, HandlingTraits] = {
    Magician: HandlingTraits(
        "a Magician",
        straight_magician,
        check_magician,
        {"suction": AIR, "gripper": FINGERS},
        {"suction": lambda arm: arm.suction(False, pump=False)},
    ),
    MyCobot: HandlingTraits(
        "a myCobot",
        straight_mycobot,
        check_mycobot,
        {"gripper": 0.0},  # its verb returns when the fingers rest
        lacks=frozenset({"suction"}),
    ),
    UltraArm: HandlingTraits("an ultraArm", straight_ultraarm, check_ultraarm, {"suction": AIR, "gripper": FINGERS}),
}
OTHER = HandlingTraits(
    "the arm",
    straight_other,
    lambda arm, target: None,  # noqa: ARG005 - nothing is known of it
    {"suction": AIR, "gripper": FINGERS},
)


def handling_traits(arm: object) -> HandlingTraits:
    """Return what is known of an arm; of one of another family only what `Arm` says."""
    return next((hand for kind, hand in HANDS.items() if isinstance(arm, kind)), OTHER)


def settle_time(arm: Arm, tool: str) -> float:
    """Return how many seconds a tool ("suction", "gripper") of an arm needs once its verb has returned."""
    return handling_traits(arm).settle.get(tool, 0.0)


async def move_straight(arm: Arm, where: Any, **moves: Any) -> None:
    """Move the tool along a straight line to a place: x, y, z in mm, or a pose of the arm's family.

    Raises:
        DobotError: As the arm's `move_to`.
    """
    await handling_traits(arm).straight(arm, target_of(where), **moves)


def gripper_holds(arm: MyCobot, *, least: float = CLOSED) -> Check:
    """Return a check for `pick`: a gripper that tells its opening holds a part if that has kept it open.

    Args:
        arm: One whose gripper tells how far it is open.
        least: Percent up to which it counts as closed on nothing.
    """
    least = to_float(least, "least")

    async def holds() -> bool:
        return await arm.get_gripper() > least

    return holds


def stop_check(arm: Arm) -> Callable[[], None]:
    """Return what raises MotionStopped once the arm was stopped: what takes several steps does not go on past a stop.

    It is called right before each step, with nothing awaited in between.
    """
    epoch = getattr(arm.queue, "epoch", None)
    return epoch.check if isinstance(epoch, Epoch) else lambda: None
