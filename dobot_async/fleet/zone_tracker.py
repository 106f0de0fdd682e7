"""The zones that one arm may be in, and so has to hold.

    enter --> steps --> each done: what is behind is released
    jogs, homing, leftovers: all within its reach, until it rests --locate--> where it stands

1. Where the arm may be is `standing`, the zones of all steps that have not ended, and everything in its reach while it
   is on a way that is not known: homing, jogs, and what an earlier program has left in its queue.
2. It is read from the arm only when no step is left and the arm has acknowledged its stop and rests.
3. The pose of an idle arm is read again before its next motion: it may have been switched off, or guided by hand.
4. An arm that was switched off and on does not know where it is: it may be anywhere in its reach until it was homed.
5. When a step, a jog or a reading ends, all requests are decided again: an arm whose pose cannot be read keeps its
   zones, and yet it rests. It is read again until it answers.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import AsyncGenerator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress
from typing import Generic, Protocol, TypeVar

from dobot_async.arms.magician.paths import STEP
from dobot_async.errors import DobotError
from dobot_async.fleet.frames import BaseFrame
from dobot_async.fleet.planned_steps import PlannedStep, PlannedSteps
from dobot_async.fleet.planner import Planner, Region, Stance
from dobot_async.fleet.zone_locks import ZoneHolder, ZoneRequest
from dobot_async.fleet.zones import Zones

__all__ = ["StopWaiter", "ZoneTracker"]

S = TypeVar("S", bound=Stance)
BETWEEN_READINGS = 0.1  # seconds
AT_REST = 0.05  # mm between two readings of an arm that stands; the slowest of jogs comes further
ROUNDING = 0.1  # mm; what numbers lose on the line, and an arc bulges between two places


class StopWaiter(Protocol):
    """The arm's queue, as far as the guard is concerned."""

    async def stops_heard(self) -> None:
        """Return when no stop goes on any more; raise ReplyTimeout if the arm does not hear it."""


class ZoneTracker(Generic[S]):
    """The part of `Guard` that follows its arm.

    Args:
        steps: What the arm has to do.
        planner: What is known of its ways.
        queue: Its queue.
        zones: Those of the cell.
        holder: As what it holds them.
        base: Where it stands.
        clearance: mm around the tool.
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
        clearance: float,
    ) -> None:
        self._steps = steps
        self._planner = planner
        self._queue = queue
        self._zones = zones
        self._holder = holder
        self._base = base
        self._margin = clearance + STEP / 2 + ROUNDING
        self._requests: list[ZoneRequest] = []
        self._stance: S | None = None  # after all steps
        self._standing: frozenset[str] = frozenset()
        self._located = False
        self._loose: list[frozenset[str]] = []  # where the arm may be by what is no step: jogs, leftovers, changes
        self._silent = False  # whether it did not tell where it is when it was asked last
        self._looking = 0
        self._plans = 0
        holder.moving = lambda: bool(steps or self._loose or self._looking)

    @property
    def holds(self) -> frozenset[str]:
        """The zones that the arm is in, or has ahead."""
        return frozenset[str]().union(*(request.zones for request in self._requests))

    def enter(self, course: PlannedSteps[S], request: ZoneRequest | None) -> None:
        """Take note that what was looked at is sent now, with a request on its zones that was granted."""
        if request:
            self._requests.append(request)

        self._steps.extend(course.steps)
        for step in course.steps:
            step.homing = self._planner.begun(step.motion.entry.value)
            if step.motion.moves:
                self._holder.inside &= step.after or frozenset()

        if course.moves:
            self._plans += 1
            self._stance = course.end

    async def assume_anywhere(self) -> None:
        """Take the arm to go anywhere in its reach, from now on until `until` has ended."""
        await self._planner.look()
        self._loose.append(self._anywhere())
        self.unsure()
        self._settle()

    async def until(self, leftovers: Callable[[], Awaitable[None]]) -> None:
        """Wait until the arm has done what an earlier program has left behind, and find out where it stands then."""
        with suppress(DobotError):
            await leftovers()

        self._standing |= self._loose.pop()
        await self.catch_up()

    async def catch_up(self) -> None:
        """Take note of all that is known to have ended: what it held may be what is asked for next."""
        self._doubt()
        try:
            while self._steps and self._steps[0].motion.ended:
                if self._steps[0].motion.exception():
                    self._forget()
                else:
                    self._done(self._steps.popleft())

            if self.is_sought:
                await self.locate()
        except DobotError:
            pass  # it does not tell, and keeps what it holds until it does
        finally:
            self._settle()

    def _done(self, step: PlannedStep) -> None:
        """Take note that the first step is done."""
        if step.homing is not None:
            self._planner.homed(step.homing)

        if step.after is not None:
            self._standing, self._located = step.after, True
        elif step.motion.moves or step.zones:
            self._standing |= step.zones
            self._located = False

    def unsure(self) -> None:
        """Take note that the arm is stopped, somewhere on its way."""
        self._located, self._stance = False, None
        self._plans += 1

    async def locate(self) -> None:
        """Find out where the arm stands once it does; raise DobotError if it does not tell."""
        plans = self._plans
        self._looking += 1
        self._silent = True
        try:
            await self._queue.stops_heard()
            await self._rest()
            stance = await self._planner.look()
            self._silent = False
            if plans == self._plans and not self._loose:
                self._stands(stance)
        finally:
            self._looking -= 1
            self._settle()

    @property
    def is_sought(self) -> bool:
        """Whether the arm rests somewhere that it is still to be asked about. One that has failed is asked once."""
        return not (self._located or self._busy or (self._silent and self._holder.failure))

    @property
    def _busy(self) -> bool:
        """Whether the arm has something to do, so that where it stands says little."""
        return bool(self._steps or self._loose)

    async def _be_sure(self) -> None:
        """Know where the arm stands, if it has nothing to do; it may have moved since it was looked at last."""
        self._doubt()
        if not self._located:
            self._forget()
        elif not (self._busy or self._planner.astray):
            plans, seen = self._plans, await self._planner.look()
            if plans == self._plans and self._stance and self._stance.near(seen):
                self._planner.settled(seen)
                self._stance = seen
            else:
                self.unsure()

        if not (self._located or self._busy):
            await self.locate()

    def _doubt(self) -> None:
        """Trust no place that was read before the arm lost it."""
        if self._planner.astray and self._stance:
            self.unsure()

    @asynccontextmanager
    async def _loosened(self, request: ZoneRequest | None) -> AsyncGenerator[None]:
        """While this is entered, the arm may be wherever a request lets it, and its stance is not known."""
        if request:
            self._requests.append(request)

        zones = request.zones if request else frozenset[str]()
        self._loose.append(zones)
        self.unsure()
        try:
            yield
        finally:
            self._loose.remove(zones)
            self._standing |= zones
            self.unsure()
            await self.catch_up()

    async def _rest(self) -> None:
        """Return when the tool stands."""
        before = await self._planner.tool()
        while True:
            await asyncio.sleep(BETWEEN_READINGS)
            now = await self._planner.tool()
            if all(abs(a - b) < AT_REST for a, b in zip(before, now, strict=True)):
                return

            before = now

    def _stands(self, stance: S) -> None:
        """Take note of where the arm stands, with nothing to do."""
        self._planner.settled(stance)
        self._located = True
        if self._planner.astray:
            self._stance = None
            self._standing |= self._anywhere()
            self._holder.inside &= self.holds  # another one may be where it was looked at last
        else:
            region, self._stance = stance.region, stance
            self._standing = self._zones_of(region)
            inside = region.zones(self._zones, self._base, ROUNDING)
            self._holder.inside = inside if region.known else frozenset()

    def _forget(self) -> None:
        """Drop steps that have failed; the arm may be anywhere on their way."""
        while self._steps and self._steps[0].motion.ended:
            self._standing |= self._steps.popleft().zones

    def _anywhere(self) -> frozenset[str]:
        """The zones in its reach."""
        return self._zones_of(self._planner.reach(self._stance))

    def _zones_of(self, region: Region, shift: float = 0.0) -> frozenset[str]:
        """The zones in a region, of a tool that may be so many mm elsewhere."""
        return region.zones(self._zones, self._base, self._margin + shift)

    def _settle(self) -> None:
        """Hold what the arm is in or has ahead, and nothing else.

        A zone that another arm holds is not taken by who is only near it: who holds a zone may move in it.
        """
        ahead = frozenset[str]().union(*self._loose, *(step.zones for step in self._steps))
        others = (request.zones for request in self._zones.locks.held if request.holder is not self._holder)
        needed = ahead | self._standing
        missing = (ahead | self._holder.inside & self._standing | self._standing.difference(*others)) - self.holds
        if missing:
            request = ZoneRequest(self._holder, frozenset([self._holder]), missing)
            self._requests.append(request)
            self._zones.locks.take(request)

        self._zones.locks.keep(self._requests, needed)
        self._requests = [request for request in self._requests if request.zones]
