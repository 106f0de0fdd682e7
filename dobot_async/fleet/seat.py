"""One arm in its fleet: what it may send, what it holds, and what becomes of the fleet when it fails."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import AsyncIterator, Callable, Iterable, Mapping, Sequence
from contextlib import asynccontextmanager, nullcontext, suppress
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

import anyio

from dobot_async._core.queue.motion import Motion
from dobot_async.contract import LinkState
from dobot_async.errors import ConnectionLost, DobotError, MotionStopped, ReplyTimeout, another
from dobot_async.fleet.claims import Party, Pause
from dobot_async.fleet.families import Family, FleetQueue, family_of
from dobot_async.fleet.frames import BaseFrame
from dobot_async.fleet.guard import Guard, Mode, Step
from dobot_async.fleet.shapes import Box
from dobot_async.fleet.work import named
from dobot_async.fleet.zones import Zones, here

__all__ = ["Member", "Seat", "tell_to_stop"]

A = TypeVar("A")


@dataclass(frozen=True)
class Member(Generic[A]):
    """An arm that is to be in a fleet.

    Attributes:
        url: Where it is.
        kind: Its class: Magician, MyCobot or UltraArm.
        options: What `connect` of its class takes beside the URL, such as {"model": "myarm300"}.
        base: Where it stands in the cell.
        group: The name of its group; None for the whole fleet.
        guard: "wait" lets its motions wait for zones that others hold, "raise" refuses them, "off" looks at none.
        clearance: mm around the tool that have to stay out of such zones.
        limits: Where in the cell its tool may be at all; None leaves it to the arm.
    """

    url: str
    kind: type[A]
    options: Mapping[str, Any] = field(default_factory=dict)
    base: BaseFrame = field(default_factory=BaseFrame)
    group: str | None = None
    guard: Mode = "off"
    clearance: float = 0.0
    limits: Box | None = None

    def __post_init__(self) -> None:
        family = family_of(self.kind)
        if self.guard not in {"off", "wait", "raise"} or not self.clearance >= 0:
            raise ValueError('expected guard "off", "wait" or "raise", and clearance >= 0')

        if self.limits and (family.name != "magician" or self.guard == "off"):
            raise ValueError("limits are kept by the guard, and of a Magician alone: the ways of others are not known")


def tell_to_stop(seats: Iterable[Seat]) -> None:
    """Tells arms to stop before this returns, as far as their links can; `begin_stop` of each is to follow."""
    for seat in seats:
        seat.tell_to_stop()


class Seat:
    """The place of one arm in its fleet; the `Overseer` of its queue.

    Attributes:
        name: The arm's.
        member: What it is.
        family: Its family.
        party: As what it holds zones.
        arm: The arm, once it is connected.
        stopped: Why it may not move; None while all is well.
        commands: Whether it is connected to command it, not only to look on.
        stops_on_error: Whether it stops when the fleet is left by an error.
    """

    def __init__(
        self,
        name: str,
        member: Member[Any],
        zones: Zones,
        failed: Callable[[Seat, DobotError], None],
        works: Callable[[Seat], None],
    ) -> None:
        self.name = name
        self.member = member
        self.family: Family = family_of(member.kind)
        self.party = zones.arms[name]
        self.arm: Any = None
        self.stopped: DobotError | None = None
        self.commands = self.stops_on_error = False
        self._zones = zones
        self._failed = failed
        self._works = works
        self._guard: Guard | None = None
        self._steps: deque[Step] = deque()
        self._order = anyio.Lock(fast_acquire=True)
        self._commanding: tuple[Party, ...] = ()
        self._halts = 0
        self._halted: DobotError = MotionStopped("the arm was stopped")
        self._halting: Any = None  # the frame that stops the arm, ready to be sent
        self._quiet = False
        self._tasks: set[asyncio.Task[None]] = set()
        self._follower: asyncio.Task[None] | None = None

    @property
    def queue(self) -> FleetQueue:
        """The arm's queue."""
        queue = self.arm.queue
        assert isinstance(queue, FleetQueue)
        return queue

    async def begin(self, arm: Any, options: Mapping[str, Any]) -> None:
        """Takes an arm that was just connected, with these options."""
        self.arm = arm
        member = self.member
        self.commands = options.get("control", True)
        self.stops_on_error = self.commands and options.get("on_error", "stop") == "stop"
        if self.family.stop and self.commands:
            self._halting = arm.link.frame(self.family.stop, None)

        if member.guard != "off":
            self._guard = Guard(
                self._steps,
                arm,
                self.family,
                self._zones,
                self.party,
                base=member.base,
                mode=member.guard,
                clearance=member.clearance,
                limits=member.limits,
            )
            await self._guard.locate()
            self._zones.guards.append(self._guard.catch_up)

        self.queue.overseer = self
        if arm.link.state.value is LinkState.LOST:  # when its queue could not tell yet
            self.ended(ConnectionLost(f"the connection to {arm.link.url} was lost"))

    def end(self) -> set[asyncio.Task[None]]:
        """Leaves the arm to itself; returns the tasks that end because of it."""
        if self.arm:
            self.queue.overseer = None

        for task in self._tasks:
            task.cancel()

        return set(self._tasks)

    @asynccontextmanager
    async def admitted(self, motions: Sequence[Motion], timeout: float | None) -> AsyncIterator[float | None]:
        """While this is entered, motions may be sent. Yields the seconds that are left for it."""
        loop = asyncio.get_running_loop()
        deadline = None if timeout is None else loop.time() + timeout
        try:
            await self._admit(motions, deadline)
        except BaseException as error:
            reason = error if isinstance(error, DobotError) else MotionStopped(f"it was not sent: {error}")
            for motion in motions:
                motion.end(reason)

            raise

        try:
            yield None if deadline is None else max(0.0, deadline - loop.time())
        finally:
            self._order.release()
            self.follow()

    @asynccontextmanager
    async def roaming(self) -> AsyncIterator[None]:
        """While this is entered, the arm may go anywhere."""
        self.check()
        await self._take_turn()
        try:
            async with self._guard.roaming() if self._guard else nullcontext():
                yield
        finally:
            self._order.release()

    def ended(self, error: DobotError) -> None:
        """Takes note of what ends all motions of the arm; whatever is no stop is a failure."""
        self._halts += 1
        self._halted = error
        if self._guard:
            self._guard.unsure()

        self._zones.claims.interrupt(self.party, error)
        if not isinstance(error, MotionStopped):
            named(self.name, error)
            self._failed(self, error)

    def check(self, halts: int | None = None) -> None:
        """Raises MotionStopped if the arm may not move, and the reason of its last stop if it had fewer before."""
        if self.stopped:
            raise MotionStopped(f"{self.stopped}; the fleet stays stopped until fleet.recover()")

        if halts is not None and halts != self._halts:
            raise another(self._halted)

    def tell_to_stop(self) -> None:
        """Writes a stop before this returns, if the link can; nobody waits for its answer."""
        if self._halting is not None:
            with suppress(DobotError):  # of a link that is gone everybody hears otherwise
                self.arm.link.send_nowait(self._halting)

    def begin_stop(self, error: DobotError) -> asyncio.Task[None]:
        """Ends all Motions with an error; returns the task that tells the arm to stop until it has heard it."""
        return self.queue.begin_stop(error)

    async def stop_heard(self, stop: asyncio.Task[None]) -> str:
        """Waits for what `begin_stop` has begun, for so long as one does on the way out of a block.

        Returns:
            Why it is not known whether the arm stands, "" if it does.
        """
        failure = await self.arm.link.cleanup.finish(stop)
        return f"{self.name}: it is not known whether the arm stands: {failure}" if failure else ""

    def quiet(self, quiet: bool) -> None:
        """Says whether the arm is to be left alone for now, although it has motions that nobody awaits."""
        self._quiet = quiet
        self.follow()

    async def locate(self) -> None:
        """Finds out anew which zones the arm is in."""
        if self._guard:
            await self._guard.locate()

    async def aclose(self) -> None:
        """Joins what `end` has cancelled."""
        if self._tasks:
            await asyncio.wait(self._tasks)

    def follow(self) -> None:
        """Watches motions to their end, though nobody may await them: an arm that fails is to stop the others."""
        if self._steps and not self._quiet and (self._follower is None or self._follower.done()):
            self._follower = self._spawn(self._follow(), "follower")

    async def _admit(self, motions: Sequence[Motion], deadline: float | None) -> None:
        """Takes the lock of the order, and returns when motions may be sent."""
        self.check()
        halts = self._halts
        try:
            async with asyncio.timeout_at(deadline):
                await self._take_turn()
        except TimeoutError:
            raise ReplyTimeout(f"{self.name}: others were before it, and took too long") from None

        try:
            if self._guard:
                await self._guard.admit(motions, deadline)
            else:
                self._steps.extend(Step(motion) for motion in motions)

            self.check(halts)
        except BaseException:
            self._order.release()
            self.follow()
            raise

        self._works(self)

    async def _take_turn(self) -> None:
        """Takes the lock of the order; raises ZoneDeadlock if who has it waits, in the end, for who asks."""
        program = here()
        stuck = self._zones.driven(program) | {program.party}
        turn = Pause(f"to command {self.name} behind", program.party, stuck, lambda: self._commanding)
        with self._zones.claims.pausing(turn) if self._order.locked() else nullcontext():
            await self._order.acquire()

        self._commanding = (program.party,)

    async def _follow(self) -> None:
        """Takes the steps as their motions end."""
        while self._steps and not self._quiet:
            step = self._steps[0]
            with suppress(DobotError):
                await step.motion

            if self._guard:
                await self._guard.catch_up()
            elif step in self._steps:
                self._steps.remove(step)

    def _spawn(self, work: Any, what: str) -> asyncio.Task[None]:
        """Starts a task that ends with the seat."""
        task: asyncio.Task[None] = asyncio.create_task(work, name=f"dobot_async {self.name} {what}")
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task
