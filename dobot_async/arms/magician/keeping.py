"""Workspace check of a Magician: the paths of its motions, as far as they are known; see `paths`.

Not known is where the arm is behind `home`, and behind what it cannot reach: of motions that begin there the target
alone is looked at, and increments are refused. On a rail, all is seen from the arm, as its coordinates are.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from dobot_async._core.protocol.wire import Command
from dobot_async._core.queue.executor import Entry
from dobot_async._core.queue.keeper import Keeper
from dobot_async._core.queue.motion import Motion
from dobot_async._core.util.workspace import OutsideWorkspace, Workspace
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.goals import Goal, follow
from dobot_async.arms.magician.kinematics import Joints, Kinematics, Unreachable
from dobot_async.arms.magician.paths import Lift, way_of
from dobot_async.arms.magician.reach import ANGLES, is_relative

__all__ = ["MagicianKeeper", "Stand", "check_jog"]

R = TypeVar("R")
JUMPS = frozenset({c.PTPMode.JUMP_XYZ, c.PTPMode.JUMP_ANGLE, c.PTPMode.JUMP_MOVL_XYZ})
ON_A_RAIL = (c.PTPWithLCmd, c.PTPPOWithLCmd)
VIA = (c.ARCCmd, c.CircleCmd)
MOTIONS = (c.PTPCmd, c.PTPPOCmd, *ON_A_RAIL, c.CPCmd, c.CPLECmd, *VIA)
ANYWHERE = (c.HOMECmd, c.AutoLevelingCmd)
LIFTS = (c.PTPJumpParams, c.PTPJump2Params)
CONCERNED = (*MOTIONS, *ANYWHERE, *LIFTS, c.EndEffectorParams)


@dataclass(frozen=True, slots=True)
class Stand:
    """Where a way begins.

    Attributes:
        kinematics: The arm's, with its end effector.
        joints: None where they are not known.
        lifts: Of jumps, that are on their way to the arm.
    """

    kinematics: Kinematics
    joints: Joints | None
    lifts: frozenset[Lift] = frozenset()


class MagicianKeeper(Keeper[Stand]):
    """See the module, and `Keeper`.

    Args:
        workspace: Where the tool may be.
        stand: Reads where the arm stands.
        ask: Reads from the arm.
    """

    def __init__(
        self,
        workspace: Workspace,
        stand: Callable[[], Awaitable[Stand]],
        ask: Callable[[Command[None, R]], Awaitable[R]],
    ) -> None:
        super().__init__(workspace)
        self._stand = stand
        self._ask: Callable[[Command[None, Any]], Awaitable[Any]] = ask

    def check_target(self, value: Any) -> None:
        """Raise ValueError for what leads to a place outside, whatever the tool is, and for a jog without an end."""
        check_jog(value)
        if isinstance(value, MOTIONS) and getattr(value, "ptp_mode", None) not in ANGLES:
            self._check_places(Goal(Kinematics()), value)

    def concerns(self, entry: Entry) -> bool:
        """Return whether a command moves the arm, or changes what ways are."""
        return isinstance(entry.value, CONCERNED)

    async def admit_stored(self, motions: Sequence[Motion], kinematics: Kinematics) -> None:
        """Raise OutsideWorkspace if a program to be stored leads outside, begun wherever the arm stands then."""
        start = Stand(kinematics, None)
        for motion in motions:
            if self.concerns(motion.entry):
                start = await self.follow(motion.entry, start)

    async def look(self) -> Stand:
        """Read where the arm stands."""
        return await self._stand()

    async def follow(self, entry: Entry, start: Stand) -> Stand:
        """Return where a command leads; raise OutsideWorkspace if that is outside, or the way is."""
        value = entry.value
        if isinstance(value, LIFTS):
            return replace(start, lifts=start.lifts | {lift_of(value)})

        if isinstance(value, c.EndEffectorParams):
            kinematics = replace(start.kinematics, x_bias=value.x_bias, y_bias=value.y_bias, z_bias=value.z_bias)
            return replace(start, kinematics=kinematics)

        if isinstance(value, ANYWHERE):
            return replace(start, joints=None)

        if isinstance(value, ON_A_RAIL):
            value = c.PTPCmd(value.ptp_mode, value.x, value.y, value.z, value.r)

        return replace(start, joints=await self._follow(value, start))

    async def _follow(self, value: Any, start: Stand) -> Joints | None:
        """Where a motion of the arm itself leads."""
        here = start.joints and start.kinematics.forward(*start.joints)
        goal = self._check_places(Goal(start.kinematics, *(here or ())), value)
        if start.joints is None:
            if is_relative(value) and not isinstance(value, c.CircleCmd):
                raise OutsideWorkspace(
                    "nothing tells where increments lead from where the arm will be then, behind home or behind what "
                    "an earlier program has left: say the place, or await what is before"
                )

            return joints_of(goal)

        try:
            ways = [way_of(value, start.joints, start.kinematics, each) for each in await self._lifts(value, start)]
        except Unreachable:  # as the arm will say
            return None

        known = [way for way in ways if way]
        for way in known:
            self.workspace.check_way(way.places)

        return known[0].end if known else None

    def _check_places(self, goal: Goal, value: Any) -> Goal:
        """Check where a motion leads, and by which place, as far as that is known; return the goal."""
        if isinstance(value, VIA):
            for what, point in (("via", value.cir_point), ("to", value.to_point)):
                self.workspace.check_place((point.x, point.y, point.z), what)

        goal = follow(goal, value)
        if goal.x is not None and goal.y is not None and goal.z is not None:
            self.workspace.check_place((goal.x, goal.y, goal.z))

        return goal

    async def _lifts(self, value: Any, start: Stand) -> list[list[Lift]]:
        """The lifts that a jump may have, one for each way: those that the arm keeps, and those on their way to it."""
        if getattr(value, "ptp_mode", None) not in JUMPS:
            return [[]]

        kept = [await self._ask(row) for row in (c.GET_PTP_JUMP_PARAMS, c.GET_PTP_JUMP2_PARAMS)]
        return [[lift] for lift in {*map(lift_of, kept), *start.lifts}]


def check_jog(value: Any) -> None:
    """Raise ValueError for a jog that nobody watches."""
    if isinstance(value, c.JOGCmd) and value.cmd is not c.JOGKey.IDLE:
        raise ValueError("a jog without an end can leave the workspace: use arm.jog(...) or arm.jogging(...)")


def joints_of(goal: Goal) -> Joints | None:
    """The joints at a goal; the tool's rotation, which is not always known, does not matter to where the tool is."""
    if goal.x is None or goal.y is None or goal.z is None:
        return None

    try:
        return goal.kinematics.inverse(goal.x, goal.y, goal.z, goal.r or 0.0)
    except Unreachable:
        return None


def lift_of(value: c.PTPJumpParams | c.PTPJump2Params) -> Lift:
    """What the parameters of jumps say."""
    if isinstance(value, c.PTPJumpParams):
        return Lift(value.jump_height, value.jump_height, value.z_limit)

    return Lift(value.start_jump_height, value.end_jump_height, value.z_limit)
