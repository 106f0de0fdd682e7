"""The ways of a Magician, with its end effector and on its rail, as far as they are known; see `paths`.

What the arm keeps beside its joints is read together with them: after a restart it has forgotten its end effector. The
tool that the program has last said to be on the arm is remembered here: if the arm believes something else, its tool
may be elsewhere by the difference (`slack`).

So is whether it was switched off and on: until it was homed after that it is elsewhere than it tells (`astray`), and
until it was homed on its rail, anywhere along that.

On a rail the arm and the rail go at once, and nothing tells how fast: a way is all that the arm can touch on it, from
wherever the rail comes along.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple, Protocol, TypeVar

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.kinematics import Joints, Kinematics
from dobot_async.arms.magician.paths import STEP, Lift, Way, reach_of, way_of
from dobot_async.arms.magician.reach import destination
from dobot_async.fleet.magician_stance import MagicianStance, Span, centres, kinematics_of, numbers, shifted
from dobot_async.fleet.planner import XYZ, Discs, Plan, Region

__all__ = ["MagicianPlanner"]

Q = TypeVar("Q")
R = TypeVar("R")
RAIL_LENGTH = 1000.0  # mm
SAME_TOOL = 0.01  # mm


class MagicianReads(Protocol):
    """A Magician, as far as it is asked."""

    @property
    def restarts(self) -> int:
        """How often it was seen to have been switched off and on."""
        ...

    async def check_restart(self) -> None:
        """Raise MotionUnknown if it was switched off and on since this was asked last; its motions end."""

    async def request(self, command: Command[Q, R], value: Q) -> R:
        """Send any row of the command table immediately, and return the arm's answer."""
        ...


class Homing(NamedTuple):
    """A homing that was begun: after how many restarts, and whether the arm was told of its rail then."""

    restarts: int
    rides: bool


class MagicianPlanner:
    """The planner of one Magician; see `Planner`.

    Args:
        arm: The arm.
        heading: The direction in which l grows; None for an arm on no rail.
    """

    def __init__(self, arm: MagicianReads, heading: float | None) -> None:
        self._arm = arm
        self._heading = heading
        self._said: list[c.EndEffectorParams] = []  # one of these is on the arm
        self._bias = c.EndEffectorParams(0.0)
        self._longest = 0.0  # mm from the wrist, of all end effectors so far
        self._rides = False  # whether the arm was told of its rail, as far as that is known
        self._homed_in = 0  # after which of its restarts the arm was homed last
        self._rail_homed_in = 0

    @property
    def astray(self) -> bool:
        """Whether the arm was switched off and on, and has not been homed since."""
        return self._homed_in != self._arm.restarts

    async def check(self) -> None:
        """Make sure that it is still the same run of the arm."""
        await self._arm.check_restart()

    async def look(self) -> MagicianStance:
        """Read where the arm stands."""
        pose = await self._arm.request(c.GET_POSE, None)
        self._bias = bias = await self._arm.request(c.GET_END_EFFECTOR_PARAMS, None)
        self._longest = max(self._longest, math.hypot(*numbers(bias)))
        rail, rides = await self._read_rail(), False
        if self._heading is not None:
            rides = await self._arm.request(c.GET_DEVICE_WITH_L, None)

        self._rides = rides
        await self.check()  # last of all, so that what was read is of the same run of the arm
        joints = Joints(pose.j1, pose.j2, pose.j3, pose.j4)
        return MagicianStance(joints, bias, self._slack(bias), self._heading, rail, rides)

    async def tool(self) -> XYZ:
        """Read where its tool is."""
        pose = await self._arm.request(c.GET_POSE, None)
        (place,) = shifted([(pose.x, pose.y, pose.z)], self._heading, [sum(await self._read_rail()) / 2])
        return place

    async def plan(self, value: object, start: MagicianStance | None) -> Plan[MagicianStance]:
        """Return where a motion leads."""
        if isinstance(value, c.JOGCmd):
            raise ValueError("a jog without an end cannot be guarded; use arm.jogging(...)")  # noqa: TRY004

        if isinstance(value, (c.PTPWithLCmd, c.PTPPOWithLCmd)):
            return await self._ride(value, start)

        way = await self._way(value, start)
        if start is None or way is None:
            return Plan(self.reach(start), None, self._goal(value, start.rail if start else None))

        region = start.along(way.places, start.rail)
        return Plan(region, replace(start, joints=way.end), shifted(way.places, self._heading, start.rail))

    def change(self, value: object, start: MagicianStance | None) -> Plan[MagicianStance] | None:
        """Return what a command does that moves nothing."""
        if isinstance(value, (c.PTPJumpParams, c.PTPJump2Params)):
            end = start and replace(start, lifts=start.lifts | {lift_of(value)})
            return Plan(start.region if start else self.reach(start), end, ())

        if isinstance(value, c.DeviceWithL):
            end = start and replace(start, rides=value.is_with_l)
            return Plan(start.region if start else self.reach(start), end, ())

        if isinstance(value, c.JOGCmd) and value.cmd is not c.JOGKey.IDLE:
            raise ValueError("a jog without an end cannot be guarded; use arm.jogging(...)")

        return self._change_tool(value, start) if isinstance(value, c.EndEffectorParams) else None

    def homes(self, value: object) -> bool:
        """Return whether it is a homing."""
        return isinstance(value, c.HOMECmd)

    def begun(self, value: object) -> Homing | None:
        """Take note that a command is on its way: an end effector that the program says is on the arm from now on."""
        if isinstance(value, c.EndEffectorParams):
            self._said.append(value)
        elif isinstance(value, c.DeviceWithL):
            self._rides = value.is_with_l

        return Homing(self._arm.restarts, self._rides) if self.homes(value) else None

    def homed(self, homing: object) -> None:
        """Take note that a homing is done: of the arm, and of its rail if it was told of one."""
        if isinstance(homing, Homing):
            self._homed_in = homing.restarts
            if homing.rides:
                self._rail_homed_in = homing.restarts

    def settled(self, stance: MagicianStance) -> None:
        """Take note of the end effector that the arm was told of last, unless it has forgotten it."""
        if not self._said or self._is_said(stance.bias):
            self._said = [stance.bias]

    def reach(self, stance: MagicianStance | None) -> Region:
        """Return where the arm may come on ways that are not known: all around, and all along its rail."""
        bias = stance.bias if stance else c.EndEffectorParams(0.0)
        longest = max(self._longest, math.hypot(*numbers(bias)))
        around = reach_of(Kinematics(longest, longest, 0.0)) + (stance.slack if stance else 0.0) + STEP
        return Discs(centres(self._heading, (0.0, RAIL_LENGTH)) if self._heading is not None else ((0.0, 0.0),), around)

    async def _way(self, value: object, start: MagicianStance | None) -> Way | None:
        """The way of the arm itself, if it is known."""
        if start is None:
            return None

        return way_of(value, start.joints, start.kinematics, await self._lifts_for(value, start))

    async def _ride(self, value: c.PTPWithLCmd | c.PTPPOWithLCmd, start: MagicianStance | None) -> Plan[MagicianStance]:
        """Where a motion leads that takes the rail along."""
        if self._heading is None:
            raise ValueError("l: this guarded arm is on no rail; say where its rail leads, Member(..., rail=90)")

        if not 0 <= value.rail <= RAIL_LENGTH:
            raise ValueError(f"l must be in 0 to {RAIL_LENGTH:g} mm, not {value.rail:g}")

        arm = c.PTPCmd(value.ptp_mode, value.x, value.y, value.z, value.r)
        way = await self._way(arm, start)
        if start is None or way is None:
            return Plan(self.reach(start), None, self._goal(arm, (value.rail, value.rail)))

        # An arm that was not told of its rail leaves it alone.
        swept = (min(start.rail[0], value.rail), max(start.rail[1], value.rail)) if start.rides else start.rail
        there = (value.rail, value.rail) if start.rides and self._knows_rail else start.rail
        # A box that contains both ends of the rail's way contains what lies between.
        outline = shifted(way.places, self._heading, (*start.rail, *there))
        return Plan(start.along(way.places, swept), replace(start, joints=way.end, rail=there), outline)

    def _change_tool(self, bias: c.EndEffectorParams, start: MagicianStance | None) -> Plan[MagicianStance]:
        """Another end effector: the tool is elsewhere, though nothing has moved."""
        self._longest = max(self._longest, math.hypot(*numbers(bias)))
        if start is None:
            return Plan(self.reach(start), None, ())

        end = replace(start, bias=bias, slack=0.0)
        places = [stance.kinematics.forward(*start.joints)[:3] for stance in (start, end)]
        return Plan(start.along(places, start.rail), end, (), math.dist(numbers(start.bias), numbers(bias)))

    def _goal(self, value: object, rail: Span | None) -> Sequence[XYZ] | None:
        """Where a way that is not known ends, if that is given; none for what limits do not concern."""
        if isinstance(value, FREE):
            return ()

        target = destination(value)
        if isinstance(value, (c.CPCmd, c.CPLECmd)) and value.cp_mode is c.CPMode.ABSOLUTE:
            place: XYZ = value.x, value.y, value.z
        elif target is None:
            return None
        elif target.joints:
            place = kinematics_of(self._said[-1] if self._said else self._bias).forward(*target.numbers)[:3]
        else:
            place = target.numbers[:3]

        if self._heading is None:
            rail = 0.0, 0.0

        return shifted([place], self._heading, rail) if rail else None

    async def _lifts_for(self, value: object, start: MagicianStance) -> list[Lift]:
        """The lifts that a jump may have: those that the arm keeps, and those on their way to it."""
        if not isinstance(value, (c.PTPCmd, c.PTPPOCmd)) or value.ptp_mode not in JUMPS:
            return []

        same = await self._arm.request(c.GET_PTP_JUMP_PARAMS, None)
        apart = await self._arm.request(c.GET_PTP_JUMP2_PARAMS, None)
        return [lift_of(same), lift_of(apart), *start.lifts]

    async def _read_rail(self) -> Span:
        """Where the arm stands on its rail: anywhere, for one that does not tell, or does not know."""
        if self._heading is None:
            return 0.0, 0.0

        if not self._knows_rail:
            return 0.0, RAIL_LENGTH

        place = await self._arm.request(c.GET_POSE_L, None)
        return (place, place) if math.isfinite(place) else (0.0, RAIL_LENGTH)

    @property
    def _knows_rail(self) -> bool:
        """Whether the arm knows where it is on its rail, if it is told of that."""
        return self._rail_homed_in == self._arm.restarts

    def _slack(self, bias: c.EndEffectorParams) -> float:
        """How far the tool may be from where the arm believes it is: it has forgotten what was said last."""
        if not self._said or self._is_said(bias):
            return 0.0

        return max(math.dist(numbers(each), numbers(bias)) for each in self._said)

    def _is_said(self, bias: c.EndEffectorParams) -> bool:
        """Whether an end effector is one that the program has said."""
        return any(math.dist(numbers(each), numbers(bias)) < SAME_TOOL for each in self._said)


JUMPS = (c.PTPMode.JUMP_XYZ, c.PTPMode.JUMP_ANGLE, c.PTPMode.JUMP_MOVL_XYZ)
FREE = (c.HOMECmd, c.AutoLevelingCmd, type(None))
"""What limits do not concern: where these lead is the arm's own affair."""


def lift_of(value: c.PTPJumpParams | c.PTPJump2Params) -> Lift:
    """What the parameters of jumps say."""
    if isinstance(value, c.PTPJumpParams):
        return Lift(value.jump_height, value.jump_height, value.z_limit)

    return Lift(value.start_jump_height, value.end_jump_height, value.z_limit)
