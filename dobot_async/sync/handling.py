"""Pick and place, for programs without asyncio.

Written by tests/sync/write_sync.py: change what that reads, and run it again.
"""

from __future__ import annotations

from typing import Any

from dobot_async.handling import gripper_holds as async_gripper_holds
from dobot_async.handling import pick as async_pick
from dobot_async.handling import pick_and_place as async_pick_and_place
from dobot_async.handling import place as async_place
from dobot_async.sync.given import Check, Tool, arm_of, blocking, check_of, tool_of
from dobot_async.sync.mycobot import MyCobot
from dobot_async.sync.portal import PORTAL
from dobot_async.sync.twins import AnyArm

__all__ = ["gripper_holds", "pick", "pick_and_place", "place"]


def gripper_holds(arm: MyCobot, *, least: float = 3.0) -> Check:
    """Return a check for `pick`: a gripper that tells its opening holds a part if that has kept it open.

    Args:
        arm: One whose gripper tells how far it is open.
        least: Percent up to which it counts as closed on nothing.
    """
    return blocking(PORTAL.look(lambda: async_gripper_holds(arm_of(arm), least=least)))


def pick(
    arm: AnyArm,
    where: object,
    *,
    tool: Tool,
    approach: float = 40.0,
    travel_z: float | None = None,
    settle: float | None = None,
    check: Check | None = None,
    **moves: Any,
) -> None:
    """Pick a part up: from above the place straight down, and straight up again.

    Args:
        arm: An arm of any family.
        where: x, y, z in mm at which the tool holds the part, such as a place of a `Grid`; or a pose of the arm's
            family, if the tool is to be turned.
        tool: "suction", "gripper", or a function that is called with True to take and False to let go.
        approach: mm above the place where the way down begins and the way up ends, above 0.
        travel_z: mm, as a coordinate; the way begins and ends no lower, above what is in the way to the next place.
        settle: Seconds that the tool needs to hold; by default 0.3 for a cup, 0.6 for a gripper that tells nothing, and
            none for one whose verb returns when it rests.
        check: Tells whether there is a part, by a sensor or otherwise: a function. It is called when the
            arm is above the place again. `gripper_holds(arm)` is one.
        moves: What `move_to` of the arm takes besides the place, such as speed=20 of a myCobot or an ultraArm.

    Raises:
        PartMissing: `check` says so. The arm is above the place, and the tool has let go.
        ValueError: The arm cannot reach the place, or a number is out of range; nothing was sent.
        UnsupportedError: The arm has no such tool; nothing was sent.
        DobotError: As the verbs of the arm.
    """
    PORTAL.run(
        lambda: async_pick(
            arm_of(arm),
            where,
            tool=tool_of(tool),
            approach=approach,
            travel_z=travel_z,
            settle=settle,
            check=check_of(check),
            **moves,
        )
    )


def pick_and_place(
    arm: AnyArm,
    source: object,
    target: object,
    *,
    tool: Tool,
    approach: float = 40.0,
    travel_z: float | None = None,
    settle: float | None = None,
    check: Check | None = None,
    **moves: Any,
) -> None:
    """Carry a part from one place to another; both are checked before the arm moves.

    Args:
        arm: An arm of any family.
        source: Where it is; as `where` of `pick`.
        target: Where it is to be.
        tool: As for `pick`.
        approach: As for `pick`, at both places.
        travel_z: As for `pick`.
        settle: As for `pick`.
        check: As for `pick`, and for `place`.
        moves: As for `pick`.

    Raises:
        PartMissing: There was none at the source, or it was lost on the way: `place` tells which.
        PartStuck: The tool holds it still.
        ValueError: As `pick`.
        UnsupportedError: As `pick`.
        DobotError: As the verbs of the arm.
    """
    PORTAL.run(
        lambda: async_pick_and_place(
            arm_of(arm),
            source,
            target,
            tool=tool_of(tool),
            approach=approach,
            travel_z=travel_z,
            settle=settle,
            check=check_of(check),
            **moves,
        )
    )


def place(
    arm: AnyArm,
    where: object,
    *,
    tool: Tool,
    approach: float = 40.0,
    travel_z: float | None = None,
    settle: float | None = None,
    check: Check | None = None,
    **moves: Any,
) -> None:
    """Put down what the tool holds: `pick`, the other way round.

    Args:
        arm: An arm of any family.
        where: As for `pick`.
        tool: As for `pick`.
        approach: As for `pick`.
        travel_z: As for `pick`.
        settle: Seconds that the tool needs to let go; as for `pick`.
        check: As for `pick`. It is asked above the place, before the tool goes down, and once more at the end.
        moves: As for `pick`.

    Raises:
        PartMissing: There is none above the place any more: it was lost on the way. The tool has let go.
        PartStuck: The tool holds it still, when it is above the place again.
        ValueError: As `pick`.
        UnsupportedError: As `pick`.
        DobotError: As the verbs of the arm.
    """
    PORTAL.run(
        lambda: async_place(
            arm_of(arm),
            where,
            tool=tool_of(tool),
            approach=approach,
            travel_z=travel_z,
            settle=settle,
            check=check_of(check),
            **moves,
        )
    )
