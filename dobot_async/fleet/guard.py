"""Keeps one arm out of zones that others hold: plans each motion before it is sent, and holds the zones on its path.

    put --> plan (planner) --> zones on it --request--> enter --> sent --> done --> the zones behind are released

The arm holds a zone from before a motion into it is sent until the arm is known to stand outside, so that two guarded
arms are never in one zone, whatever programs do. Where it may be, `zone_tracker` knows; the path of an un-homed arm
may lead anywhere in its reach.

Paths are those of the tool centre point; `clearance` is for what is around it.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import AsyncGenerator, Awaitable, Callable, Sequence
from contextlib import asynccontextmanager
from typing import Literal, TypeVar

from dobot_async._core.queue.motion import Motion
from dobot_async._core.util.bounds import ToolBounds
from dobot_async.fleet.frames import BaseFrame
from dobot_async.fleet.limits import FleetLimits
from dobot_async.fleet.planned_steps import PlannedStep, PlannedSteps, shifted
from dobot_async.fleet.planner import Planner, Stance
from dobot_async.fleet.zone_locks import ZoneHolder, ZoneRequest
from dobot_async.fleet.zone_tracker import StopWaiter, ZoneTracker
from dobot_async.fleet.zones import Zones, here

__all__ = ["Guard", "Mode"]

Mode = Literal["off", "wait", "raise"]
S = TypeVar("S", bound=Stance)


class Guard(ZoneTracker[S]):
    """The guard of one arm.

    Args:
        steps: What the arm has to do.
        planner: What is known of its ways.
        queue: Its queue.
        zones: Those of the cell.
        holder: As what it holds them.
        base: Where it stands.
        mode: What it does where another one holds a zone: "wait" or "raise".
        clearance: mm around the tool.
        limits: Where the tool may be at all.
    """

    def __init__(
        self,
        steps: deque[PlannedStep],
        planner: Planner[S],
        queue: StopWaiter,
        zones: Zones,
        holder: ZoneHolder,
        *,
        base: BaseFrame,
        mode: Mode,
        clearance: float,
        limits: FleetLimits,
    ) -> None:
        super().__init__(steps, planner, queue, zones, holder, base=base, clearance=clearance)
        self.patient: bool = mode == "wait"
        self._limits = limits

    async def plan(self, motions: Sequence[Motion]) -> PlannedSteps[S]:
        """Look at commands that are to be sent together; nothing is held yet.

        Raises:
            ValueError: They lead out of the limits of the arm, or where the arm cannot go.
            DobotError: The arm does not say where it is.
        """
        moves = any(motion.moves for motion in motions)
        if moves:
            await self._be_sure()

        planner, ahead = self._planner, list(self._steps)
        stance, steps, changes = self._stance, list[PlannedStep](), False
        for motion in motions:
            value = motion.entry.value
            plan = await planner.plan(value, stance) if motion.moves else planner.change(value, stance)
            if plan is None:
                steps.append(PlannedStep(motion))
                continue

            if motion.moves:
                if plan.outline != () and not any(planner.homes(each.motion.entry.value) for each in ahead + steps):
                    self._check_homed()

                self._limits.check(plan.outline, stance.tool if stance else None)

            changes = True
            after = None if plan.end is None else self._zones_of(plan.end.region)
            zones, region = self._zones_of(plan.region), plan.region if motion.moves else None
            steps.append(step := PlannedStep(motion, zones, after, region, plan.shift))
            if plan.shift:
                step.zones = zones.union(*(self._zones_of(*stopped) for stopped in shifted(ahead + steps)))

            stance = plan.end

        return PlannedSteps(steps, stance, changes)

    async def request(self, zones: frozenset[str], deadline: float | None) -> ZoneRequest | None:
        """Wait for zones, or raise, as the mode says.

        Raises:
            ZoneOccupied: Another holds one of them, and this arm does not wait, or in vain.
            ZoneDeadlock: Waiting for it would never end.
            ReplyTimeout: Waiting took too long.
            MotionUnknown: The arm was switched off and on meanwhile.
        """
        program = here()
        self._zones.drive(self._holder.name, program)
        if not zones:
            return None

        # Only its own programs let it in: two arms that one program moves must not meet, either.
        own = frozenset(each.holder for each in program.line()) | {self._holder}
        request = ZoneRequest(
            self._holder,
            own,
            zones,
            patient=self.patient,
            stuck=self._zones.driven(program),
            asker=program.holder,
            parked=self._zones.parked(program),
        )
        left = None if deadline is None else max(0.0, deadline - asyncio.get_running_loop().time())
        return await self._zones.request(request, left, self._planner.check)

    async def check(self) -> None:
        """Raise MotionUnknown if the arm was switched off and on, as it may be while it waits for zones."""
        await self._planner.check()

    @asynccontextmanager
    async def unplanned_motion(self) -> AsyncGenerator[None]:
        """While this is entered, the arm may go anywhere."""
        if self.is_limited:
            await self._be_sure()
            self._check_homed()

        request = await self.request(self._anywhere(), None)
        async with self._loosened(request):
            yield

    @asynccontextmanager
    async def changing(self, value: object) -> AsyncGenerator[None]:
        """While this is entered, something that ways depend on changes at once, such as the end effector.

        What was looked at before, and has not ended, may lead anywhere then.
        """
        moving = any(step.motion.moves and not step.motion.ended for step in self._steps)
        if not moving:
            await self._be_sure()

        plan = self._planner.change(value, None if moving else self._stance)
        if plan is None:
            yield
            return

        request = await self.request(self._zones_of(plan.region), None)
        self._planner.begun(value)
        async with self._loosened(request):
            for step in self._steps:
                if step.motion.moves:
                    step.zones, step.after = self._anywhere(), None

            yield

    async def halt_at_limits(self, halt: Callable[[], Awaitable[None]]) -> str:
        """Stop a jog before the tool leaves the limits, and return why it was stopped."""
        why = await self._limits.watch(self._planner.tool)
        await halt()
        return why

    @property
    def bounds(self) -> ToolBounds | None:
        """The limits, for who sends the arm about without its queue; None if there are none."""
        return self._limits if self.is_limited else None

    @property
    def is_limited(self) -> bool:
        """Whether there are limits."""
        return self._limits.box is not None

    def _check_homed(self) -> None:
        """Raise ValueError if the arm has limits, and does not know where it is."""
        if self.is_limited and self._planner.astray:
            raise ValueError(
                f"{self._holder.name}: it has lost its place, and cannot be kept within its limits until it was homed; "
                "await home() first"
            )
