"""Pick and place, for an arm of any family: approach, tool, retreat, and whether there is a part.

    above o------+    1 above the place, as the joints like     4 the tool, and the time that it needs
          |      |    2 a gripper opens                         5 back up, straight
    place o   <--'    3 down, straight                          6 is there a part?

    await pick_and_place(arm, feeder, pallet[0], tool="suction")

What is wrong with a place, or with a tool that the arm does not have, is raised before a byte is sent. A part that is
not there is told when the arm is above the place again.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal, SupportsFloat

from dobot_async._core.util.arguments import check_choice, check_duration, to_float
from dobot_async.arms.base import Arm
from dobot_async.errors import DobotError, UnsupportedError
from dobot_async.grid import GridPlace
from dobot_async.handling.arms import (
    AIR,
    Check,
    gripper_holds,
    handling_traits,
    move_straight,
    stop_check,
    target_of,
    to_arguments,
)

__all__ = ["HandlingError", "PartMissing", "PartStuck", "Tool", "gripper_holds", "pick", "pick_and_place", "place"]

Switch = Callable[[bool], Awaitable[object]]
Tool = Literal["suction", "gripper"] | Switch
"""The arm's suction cup, its gripper, or a function of your own: called with True to take, with False to let go."""

APPROACH = 40.0


class HandlingError(DobotError):
    """A part is not where it should be. The arm is above the place, and its tool has let go.

    Attributes:
        place: Where it should have been picked, or where it was to be placed.
    """

    def __init__(self, message: str, where: object) -> None:
        super().__init__(message)
        self.place = where


class PartMissing(HandlingError):
    """There is no part in the tool where there should be one."""


class PartStuck(HandlingError):
    """The part is still in the tool."""


@dataclass(frozen=True, slots=True)
class Handling:
    """One picking or placing, checked.

    Attributes:
        arm: Who does it.
        target: Where.
        above: Where it begins and ends.
        tool: With what.
        seconds: That the tool needs.
        check_stop: Raises if the arm was stopped since this was planned.
        moves: What each motion takes besides.
    """

    arm: Any
    target: Any
    above: Any
    tool: Tool
    seconds: float
    check_stop: Callable[[], None]
    moves: Mapping[str, Any]

    async def switch(self, *, take: bool) -> None:
        """Let the tool take, or let go, and return when it has."""
        release = handling_traits(self.arm).release
        self.check_stop()
        if callable(self.tool):
            await self.tool(take)
        elif not take and self.tool in release:
            await release[self.tool](self.arm)
        else:
            await getattr(self.arm, self.tool)(take)

        if self.seconds:
            self.check_stop()
            await self.arm.wait(self.seconds)

    async def approach(self) -> None:
        """Go above the place."""
        self.check_stop()
        await self.arm.move_to(*to_arguments(self.above), **self.moves)

    async def touch(self, *, take: bool) -> None:
        """Go down, let the tool take or let go, and come up."""
        self.check_stop()
        await move_straight(self.arm, self.target, **self.moves)
        await self.switch(take=take)
        self.check_stop()
        await move_straight(self.arm, self.above, **self.moves)


def planned(
    arm: Arm,
    where: object,
    tool: Tool,
    approach: SupportsFloat,
    travel_z: SupportsFloat | None,
    seconds: SupportsFloat | None,
    moves: Mapping[str, Any],
) -> Handling:
    """Check everything, and send nothing; raise ValueError, TypeError or UnsupportedError."""
    if not callable(tool):
        check_choice("tool", tool, "suction", "gripper")

    hand = handling_traits(arm)
    if tool in hand.lacks:
        raise UnsupportedError(f"{hand.title} has no {tool} of its own; give a function as tool=, that switches yours")

    height = to_float(approach, "approach")
    if not 0 < height < math.inf:
        raise ValueError(f"approach must be above 0 mm and finite, not {approach!r}")

    target = target_of(where)
    z = target.z + height
    if travel_z is not None:
        travel = to_float(travel_z, "travel_z")
        if not math.isfinite(travel):
            raise ValueError(f"travel_z must be finite mm, not {travel_z!r}")

        z = max(z, travel)

    above = target._replace(z=z) if isinstance(target, GridPlace) else replace(target, z=z)
    for each in (target, above):
        hand.check(arm, each)

    usual = AIR if callable(tool) else hand.settle[tool]
    needed = usual if seconds is None else check_duration(seconds, "settle")
    return Handling(arm, target, above, tool, needed, stop_check(arm), moves)


async def holds_part(check: Check | None, default: bool) -> bool:
    """Return what a check tells."""
    if check is None:
        return default

    found = check()
    return bool(await found if inspect.isawaitable(found) else found)


async def pick(
    arm: Arm,
    where: object,
    *,
    tool: Tool,
    approach: float = APPROACH,
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
        check: Tells whether there is a part, by a sensor or otherwise: a function, async or not. It is called when the
            arm is above the place again. `gripper_holds(arm)` is one.
        moves: What `move_to` of the arm takes besides the place, such as speed=20 of a myCobot or an ultraArm.

    Raises:
        PartMissing: `check` says so. The arm is above the place, and the tool has let go.
        ValueError: The arm cannot reach the place, or a number is out of range; nothing was sent.
        UnsupportedError: The arm has no such tool; nothing was sent.
        DobotError: As the verbs of the arm.
    """
    handling = planned(arm, where, tool, approach, travel_z, settle, moves)
    await _pick(handling, check)


async def place(
    arm: Arm,
    where: object,
    *,
    tool: Tool,
    approach: float = APPROACH,
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
    handling = planned(arm, where, tool, approach, travel_z, settle, moves)
    await _place(handling, check)


async def pick_and_place(
    arm: Arm,
    source: object,
    target: object,
    *,
    tool: Tool,
    approach: float = APPROACH,
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
    picking, placing = (planned(arm, each, tool, approach, travel_z, settle, moves) for each in (source, target))
    await _pick(picking, check)
    await _place(placing, check)


async def _pick(handling: Handling, check: Check | None) -> None:
    await handling.approach()
    if handling.tool == "gripper":
        await handling.switch(take=False)

    await handling.touch(take=True)
    if not await holds_part(check, default=True):
        await handling.switch(take=False)
        raise PartMissing(f"there was no part to pick at {words(handling.target)}", handling.target)


async def _place(handling: Handling, check: Check | None) -> None:
    await handling.approach()
    if not await holds_part(check, default=True):
        await handling.switch(take=False)
        raise PartMissing(f"the part was lost on the way to {words(handling.target)}", handling.target)

    await handling.touch(take=False)
    if await holds_part(check, default=False):
        raise PartStuck(
            f"the tool still holds the part that was to be placed at {words(handling.target)}", handling.target
        )


def words(target: Any) -> str:
    """A place, in mm."""
    return f"({target.x:g}, {target.y:g}, {target.z:g})"
