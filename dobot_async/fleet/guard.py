"""Keeps one arm out of zones that others hold: looks at each way before it is sent, and holds what is on it.

    put --> way (paths) --> zones on it --claim--> sent --> done --> the zones that are behind are released

The arm holds a zone from before a motion into it is sent until the arm is known to be outside again, so that two
guarded arms are never in one zone, whatever programs do. A way that is not known, as of homing, counts as through all
zones that the arm can reach. What is looked at is the tool's place; `clearance` is for what is around it.
"""

from __future__ import annotations

import asyncio
import math
from collections import deque
from collections.abc import AsyncIterator, Iterable, Sequence
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass
from typing import Any, Literal

from dobot_async._core.queue.motion import Motion
from dobot_async.errors import DobotError
from dobot_async.fleet.claims import Claim, Party
from dobot_async.fleet.families import Family
from dobot_async.fleet.frames import BaseFrame, Place
from dobot_async.fleet.paths import STEP, XYZ, Lift, reach_of, way_of
from dobot_async.fleet.shapes import Box
from dobot_async.fleet.zones import Zones, here
from dobot_async.magician import commands as c
from dobot_async.magician.arm import Magician
from dobot_async.magician.kinematics import Joints

__all__ = ["Guard", "Mode", "Step"]

Mode = Literal["off", "wait", "raise"]
AT_REST = 0.5  # mm between two readings of an arm that stands
BETWEEN_READINGS = 0.05
ROUNDING = 0.01  # mm; what numbers lose on the line


@dataclass(eq=False, slots=True)
class Step:
    """One command on its way.

    Attributes:
        motion: The command.
        zones: What it leads through.
        after: The zones in which it ends; None if that is not known.
    """

    motion: Motion
    zones: frozenset[str] = frozenset()
    after: frozenset[str] | None = frozenset()


class Guard:
    """The guard of one arm."""

    def __init__(
        self,
        steps: deque[Step],
        arm: Any,
        family: Family,
        zones: Zones,
        party: Party,
        *,
        base: BaseFrame,
        mode: Mode,
        clearance: float,
        limits: Box | None,
    ) -> None:
        self._steps = steps
        self._arm = arm
        self._family = family
        self._zones = zones
        self._party = party
        self._base = base
        self._mode = mode
        self._margin = clearance + STEP / 2
        self._limits = limits
        self._claims: list[Claim] = []
        self._joints: Joints | None = None
        self._lifts: set[Lift] = set()
        self._standing: frozenset[str] = frozenset()
        self._located = False
        self._roaming = False
        self._looking = 0
        self._plans = 0
        party.moving = lambda: bool(steps or self._roaming or self._looking)

    async def admit(self, motions: Sequence[Motion], deadline: float | None) -> None:
        """Returns when the arm may do what is to be sent together, and enters it.

        Raises:
            ValueError: It leads out of the limits of the arm, or where the arm cannot go.
            ZoneOccupied: Another holds a zone on the way, and this arm does not wait.
            ZoneDeadlock: Waiting for it would never end.
            ReplyTimeout: Waiting took too long.
        """
        moves = any(motion.moves for motion in motions)
        if moves and not self._located:
            self._forget()
            if not self._steps:
                await self.locate()

        steps, joints = [], self._joints
        for motion in motions:
            step, joints = await self._plan(motion, joints)
            steps.append(step)

        zones = frozenset[str]().union(*(step.zones for step in steps))
        if zones:
            claim = await self._claim(zones, deadline)
            self._claims.append(claim)

        self._steps.extend(steps)
        if moves:
            self._plans += 1
            self._joints = joints

    @asynccontextmanager
    async def roaming(self) -> AsyncIterator[None]:
        """While this is entered, the arm may go anywhere."""
        claim = await self._claim(self._anywhere(), None)
        self._claims.append(claim)
        self._roaming = True
        self.unsure()
        try:
            yield
        finally:
            self._roaming = False
            await self.catch_up()

    async def catch_up(self) -> None:
        """Takes note of all that is known to have ended: what it held may be what is asked for next."""
        with suppress(DobotError):
            while self._steps and self._steps[0].motion.done:
                step = self._steps[0]
                try:
                    await step.motion
                except DobotError:
                    await self.lost()
                else:
                    await self.done(step)

            if not (self._located or self._steps or self._roaming):
                await self.locate()

    async def done(self, step: Step) -> None:
        """Takes note that a step is done."""
        if step not in self._steps:
            return

        self._steps.remove(step)
        if step.motion.moves:
            self._located = step.after is not None
            self._standing = self._anywhere() if step.after is None else step.after

        if not (self._located or self._steps):
            await self.locate()

        self._settle()

    def unsure(self) -> None:
        """Takes note that the arm is stopped, somewhere on its way."""
        self._located, self._joints = False, None
        self._plans += 1

    async def lost(self) -> None:
        """Takes note that the first step has failed."""
        self._forget()
        if not self._steps:
            await self.locate()

    async def locate(self) -> None:
        """Finds out where the arm stands once it does; raises DobotError if it does not tell."""
        plans = self._plans
        self._looking += 1
        try:
            place = await self._rest()
            joints = await self._read_joints()
        finally:
            self._looking -= 1

        if plans == self._plans:
            self._joints, self._located = joints, True
            self._standing = frozenset(self._around([place[:3]]))
            self._settle()

    async def _rest(self) -> Place:
        """Where the arm stands, once it does."""
        before = await self._family.place(self._arm)
        while True:
            await asyncio.sleep(BETWEEN_READINGS)
            place = await self._family.place(self._arm)
            if math.dist(before[:3], place[:3]) < AT_REST:
                return place

            before = place

    def _forget(self) -> None:
        """Drops steps that have failed; the arm may be anywhere on their way."""
        while self._steps and self._steps[0].motion.ended:
            self._standing |= self._steps.popleft().zones

    async def _read_joints(self) -> Joints | None:
        """The joints of an arm whose kinematics are known."""
        if not isinstance(self._arm, Magician):
            return None

        pose = await self._arm.get_pose()
        return Joints(pose.j1, pose.j2, pose.j3, pose.j4)

    async def _plan(self, motion: Motion, joints: Joints | None) -> tuple[Step, Joints | None]:
        """What a command leads through, and the joints at its end; both of them as far as they are known."""
        value = motion.entry.value
        if isinstance(value, (c.PTPJumpParams, c.PTPJump2Params)):
            self._lifts.add(lift_of(value))

        if not motion.moves:
            return Step(motion), joints

        way = None
        if joints and isinstance(self._arm, Magician):
            way = way_of(value, joints, self._arm.kinematics, await self._lifts_for(value))

        if way is None:
            return Step(motion, self._anywhere(), None), None

        self._check_limits(way.places)
        last = self._arm.kinematics.forward(*way.end)[:3]
        return Step(motion, frozenset(self._around(way.places)), frozenset(self._around([last]))), way.end

    async def _lifts_for(self, value: Any) -> list[Lift]:
        """The lifts that a jump may have."""
        if getattr(value, "ptp_mode", None) not in JUMPS:
            return []

        set_last = [
            lift_of(await self._arm.request(c.GET_PTP_JUMP_PARAMS, None)),
            lift_of(await self._arm.request(c.GET_PTP_JUMP2_PARAMS, None)),
        ]
        return [*set_last, *self._lifts]

    def _around(self, places: Iterable[XYZ]) -> set[str]:
        """The zones at some places of the arm."""
        found: set[str] = set()
        for place in places:
            x, y, z, _ = self._base.to_cell(*place)
            found |= self._zones.around(x, y, z, self._margin)

        return found

    def _anywhere(self) -> frozenset[str]:
        """The zones that the arm may come into on a way that is not known."""
        reach = math.inf
        if isinstance(self._arm, Magician):
            reach = reach_of(self._arm.kinematics) + self._margin

        return self._zones.near(self._base.x, self._base.y, reach)

    def _check_limits(self, places: Iterable[XYZ]) -> None:
        """Raises ValueError if a way leaves the arm's limits."""
        for place in places if self._limits else ():
            x, y, z, _ = self._base.to_cell(*place)
            if self._limits and not self._limits.contains(x, y, z, ROUNDING):
                raise ValueError(
                    f"{self._party.name}: the way leaves the arm's limits, at ({x:.1f}, {y:.1f}, {z:.1f}) of the cell"
                )

    async def _claim(self, zones: frozenset[str], deadline: float | None) -> Claim:
        """Waits for zones, or raises, as the mode says."""
        program = here()
        self._zones.drivers[self._party.name] = program.task
        # Only its own programs let it in: two arms that one program moves must not meet, either.
        own = frozenset(each.party for each in program.line()) | {self._party}
        claim = Claim(
            self._party,
            own,
            zones,
            patient=self._mode == "wait",
            stuck=self._zones.driven(program),
            asker=program.party,
        )
        left = None if deadline is None else max(0.0, deadline - asyncio.get_running_loop().time())
        return await self._zones.claim(claim, left)

    def _settle(self) -> None:
        """Holds what the arm is in or has ahead, and nothing else."""
        needed = self._standing.union(*(step.zones for step in self._steps))
        missing = needed.difference(*(claim.zones for claim in self._claims))
        if missing:
            claim = Claim(self._party, frozenset([self._party]), missing)
            self._claims.append(claim)
            self._zones.claims.take(claim)

        self._zones.claims.keep(self._claims, needed)
        self._claims = [claim for claim in self._claims if claim.zones]


JUMPS = (c.PTPMode.JUMP_XYZ, c.PTPMode.JUMP_ANGLE, c.PTPMode.JUMP_MOVL_XYZ)


def lift_of(value: c.PTPJumpParams | c.PTPJump2Params) -> Lift:
    """What the parameters of jumps say."""
    if isinstance(value, c.PTPJumpParams):
        return Lift(value.jump_height, value.jump_height, value.z_limit)

    return Lift(value.start_jump_height, value.end_jump_height, value.z_limit)
