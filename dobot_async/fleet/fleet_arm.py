"""One arm in its fleet: admission of its motions, the zones that it holds, and the consequences of its failure."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import AsyncGenerator, Awaitable, Callable, Mapping, Sequence
from contextlib import asynccontextmanager, suppress
from contextvars import ContextVar
from typing import Any, cast

from dobot_async._core.protocol.contract import LinkState
from dobot_async._core.queue.epoch import Epoch
from dobot_async._core.queue.motion import Motion
from dobot_async._core.util.bounds import ToolBounds
from dobot_async._core.util.tasks import cancel_and_join
from dobot_async.arms.base import Arm
from dobot_async.errors import ConnectionLost, DobotError, MotionStopped
from dobot_async.fleet.concurrent import with_arm_name
from dobot_async.fleet.families import FleetFamily, family_of
from dobot_async.fleet.follower import Follower
from dobot_async.fleet.guard import Guard
from dobot_async.fleet.limits import FleetLimits
from dobot_async.fleet.member import Member
from dobot_async.fleet.planned_steps import PlannedStep, PlannedSteps
from dobot_async.fleet.queue import FleetQueue
from dobot_async.fleet.turn import Turn
from dobot_async.fleet.zone_locks import ZoneHolder, ZoneRequest
from dobot_async.fleet.zones import Zones, here

__all__ = ["FleetArm", "Member"]


recovering: ContextVar[FleetArm | None] = ContextVar("recovering", default=None)
"""The arm that is made ready again here: what that takes, such as power, passes though the arm is stopped."""


class FleetArm:
    """The place of one arm in its fleet; the `MotionGate` of its queue.

    Attributes:
        name: The arm's.
        member: What it is.
        family: Its family.
        holder: As what it holds zones.
        guard: What keeps it out of zones that others hold, if anything does.
        stopped: Why it may not move; None while all is well.
        commands: Whether it is connected to command it, not only to look on.
        stops_on_error: Whether it stops when the fleet is left by an error.
    """

    def __init__(
        self,
        name: str,
        member: Member[Any],
        zones: Zones,
        failed: Callable[[FleetArm, DobotError], None],
        works: Callable[[FleetArm], None],
    ) -> None:
        self.name = name
        self.member = member
        self.family: FleetFamily = family_of(member.kind)
        self.holder: ZoneHolder = zones.arms[name]
        self.guard: Guard[Any] | None = None
        self.stopped: DobotError | None = None
        self.commands: bool = False
        self.stops_on_error: bool = False
        self._arm: Arm | None = None
        self._zones = zones
        self._failed = failed
        self._works = works
        self._steps: deque[PlannedStep] = deque()
        self._turns = Turn(name, zones)
        self._halting: Any = None  # the frame that stops the arm, ready to be sent
        self._tasks: set[asyncio.Task[None]] = set()
        self._follower = Follower(self._steps, self._spawn)

    @property
    def connected(self) -> bool:
        """Whether there is an arm yet."""
        return self._arm is not None

    @property
    def arm(self) -> Arm:
        """The arm, once it is connected."""
        assert self._arm, f"{self.name} is not connected yet"
        return self._arm

    @property
    def queue(self) -> FleetQueue:
        """The arm's queue."""
        return cast(FleetQueue, self.arm.queue)  # each class of `FleetFamily.kind` has one

    @property
    def bounds(self) -> ToolBounds | None:
        """The limits of the arm, if it has any and is guarded."""
        return self.guard.bounds if self.guard else None

    async def begin(self, arm: Arm, options: Mapping[str, Any]) -> None:
        """Takes an arm that was just connected, with these options."""
        self._arm = arm
        member = self.member
        self.commands = options.get("control", True)
        self.stops_on_error = self.commands and options.get("on_error", "stop") == "stop"
        if self.family.stop and self.commands:
            self._halting = arm.link.frame(self.family.stop, None)

        if member.guard != "off":
            self.guard = self._follower.guard = guard = Guard(
                self._steps,
                self.family.planner(arm, member.rail),
                self.queue,
                self._zones,
                self.holder,
                base=member.base,
                mode=member.guard,
                clearance=member.clearance,
                limits=FleetLimits(self.name, member.limits, member.base),
            )
            if options.get("queue") == "keep" and self.commands:
                await guard.assume_anywhere()
                self._follower.leave(guard, lambda: self.family.leftovers(arm))
            else:
                await guard.locate()

            self._zones.guards.append(guard.catch_up)

        self.queue.gate = self
        if arm.link.state.value is LinkState.LOST:  # when its queue could not tell yet
            self.ended(ConnectionLost(f"the connection to {arm.link.url} was lost"))

    def end(self) -> set[asyncio.Task[None]]:
        """Leaves the arm to itself; returns the tasks that end because of it."""
        if self.connected:
            self.queue.gate = None

        for task in self._tasks:
            task.cancel()

        return set(self._tasks)

    @asynccontextmanager
    async def admitted(
        self, motions: Sequence[Motion], timeout: float | None, epoch: Epoch
    ) -> AsyncGenerator[float | None]:
        """While this is entered, motions may be sent. Yields the seconds that are left for it."""
        loop = asyncio.get_running_loop()
        deadline = None if timeout is None else loop.time() + timeout
        try:
            await self._admit(motions, deadline, epoch)
        except BaseException as error:
            reason = error if isinstance(error, DobotError) else MotionStopped(f"it was not sent: {error}")
            for motion in motions:
                motion.end(reason)

            raise

        try:
            yield None if deadline is None else max(0.0, deadline - loop.time())
        finally:
            self.end_turn()

    @asynccontextmanager
    async def unplanned_motion(self, halt: Callable[[], Awaitable[None]] | None) -> AsyncGenerator[None]:
        """While this is entered, the arm may go anywhere, but for its limits, where it is stopped."""
        guard = self.guard
        async with self._turn():
            if guard is None:
                yield
                return

            if halt is None or not guard.is_limited:
                async with guard.unplanned_motion():
                    yield

                return

            async with guard.unplanned_motion():
                watch = self._spawn(guard.halt_at_limits(halt), "limits")
                try:
                    yield
                finally:
                    await cancel_and_join(watch)

            if not watch.cancelled():
                raise MotionStopped(f"{self.name} was stopped in its jog: {watch.result()}")

    @asynccontextmanager
    async def changing(self, value: object) -> AsyncGenerator[None]:
        """While this is entered, something changes at once on which the arm's ways depend."""
        if self.guard is None:
            yield
            return

        async with self._turn(), self.guard.changing(value):
            yield

    @asynccontextmanager
    async def _turn(self) -> AsyncGenerator[None]:
        """While this is entered, nobody else commands the arm; raises MotionStopped if it was stopped meanwhile."""
        self.check()
        epoch = self.queue.epoch
        await self.take_turn(None)
        try:
            epoch.check()
            yield
        finally:
            self.end_turn()

    def ended(self, error: DobotError) -> None:
        """Takes note of what ends all motions of the arm; whatever is no stop is a failure."""
        if self.guard:
            self.guard.unsure()

        self._zones.locks.interrupt(self.holder, error)
        if not isinstance(error, MotionStopped):
            with_arm_name(self.name, error)
            self._failed(self, error)

    async def recover(self) -> None:
        """Makes the arm ready again, though it may not move yet, and finds out where it is."""
        before = recovering.set(self)
        try:
            await self.arm.recover()
        finally:
            recovering.reset(before)

        if self.guard:
            await self.guard.locate()

    def check(self) -> None:
        """Raises MotionStopped if the arm, or the program that asks, may not move any more."""
        here().check()
        if self.stopped and recovering.get() is not self:
            raise MotionStopped(f"{self.stopped}; the fleet stays stopped until fleet.recover()")

    def tell_to_stop(self) -> None:
        """Writes a stop before this returns, if the link can, unawaited; `begin_stop` is to follow."""
        if self._halting is not None:
            with suppress(DobotError):  # of a link that is gone everybody hears otherwise
                self.arm.link.send_nowait(self._halting)

    def begin_stop(self, error: DobotError) -> asyncio.Task[None]:
        """Ends all Motions with an error; returns the task that tells the arm to stop until it has heard it.

        The caller is told of it, and so the queue's `join` is not.
        """
        return self.queue.begin_own_stop(error)

    async def stop_heard(self, stop: asyncio.Task[None]) -> str:
        """Waits for what `begin_stop` has begun, for so long as one does on the way out of a block.

        Returns:
            Why it is not known whether the arm stands, "" if it does.
        """
        failure = await self.arm.link.cleanup.finish(stop)
        return f"{self.name}: it is not known whether the arm stands: {failure}" if failure else ""

    def quiet(self, quiet: bool) -> None:
        """Says whether the arm is to be left alone for now, although it has motions that nobody awaits."""
        self._follower.quiet = quiet
        self._follower.follow()

    async def aclose(self) -> None:
        """Joins what `end` has cancelled."""
        if self._tasks:
            await asyncio.wait(self._tasks)

    async def take_turn(self, deadline: float | None) -> None:
        """Returns when nobody else commands the arm, until `end_turn`; see `Turn.take`."""
        await self._turns.take(deadline)

    def end_turn(self) -> None:
        """Lets others command the arm, and watches to its end what it was told."""
        self._turns.end()
        self._follower.follow()

    async def plan(self, motions: Sequence[Motion]) -> PlannedSteps[Any]:
        """Looks at what is to be sent together; see `Guard.plan`."""
        if self.guard:
            return await self.guard.plan(motions)

        return PlannedSteps([PlannedStep(motion) for motion in motions], None, moves=False)

    def enter(self, course: PlannedSteps[Any], request: ZoneRequest | None) -> None:
        """Takes note of what is sent now, with the request on its zones."""
        if self.guard:
            self.guard.enter(course, request)
        else:
            self._steps.extend(course.steps)

        self._works(self)

    async def _admit(self, motions: Sequence[Motion], deadline: float | None, epoch: Epoch) -> None:
        """Takes the lock of the order, and returns when motions may be sent."""
        self.check()
        await self.take_turn(deadline)
        try:
            course = await self.plan(motions)
            request = await self.guard.request(course.zones, deadline) if self.guard else None
            try:
                self.check()
                epoch.check()
            except BaseException:
                if request:
                    self._zones.locks.release(request)

                raise

            self.enter(course, request)
        except BaseException:
            self.end_turn()
            raise

    def _spawn(self, work: Any, what: str) -> asyncio.Task[None]:
        """Starts a task that ends when the arm leaves its fleet."""
        task: asyncio.Task[None] = asyncio.create_task(work, name=f"dobot_async {self.name} {what}")
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task
