"""Zones for programs: `async with fleet.zone("bin")`, and the requests of guarded arms.

A zone is held by an arm, for as long as it is in it or has a way through it ahead, or a program, for the
length of a block. A program is a task; the tasks that it starts act for it, but do not share what they hold with each
other.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Awaitable, Callable, Collection, Generator, Iterator, Mapping
from contextlib import asynccontextmanager, contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from weakref import WeakSet

from dobot_async._core.queue.epoch import Epoch
from dobot_async._core.util.shapes import Shape
from dobot_async.errors import DobotError, ReplyTimeout, another
from dobot_async.fleet.zone_locks import ZoneHolder, ZoneLocks, ZoneRequest

__all__ = ["FleetProgram", "Run", "Zones", "here", "running"]


@dataclass(frozen=True, eq=False, slots=True)
class Run:
    """Programs that run side by side.

    Attributes:
        holders: As what they hold zones, by name.
        alive: The names of those that have not ended.
    """

    holders: Mapping[str, ZoneHolder]
    alive: set[str] = field(default_factory=set[str])


@dataclass(eq=False)
class FleetProgram:
    """A task that commands arms.

    Attributes:
        holder: As what it holds zones.
        task: Which task.
        parent: The program that started it.
        arm: The arm that it is the program of, if it is.
        run: The programs that run beside it, if it is one of several.
        epoch: That of the fleet in which it began; None for a task that the fleet has not begun.
    """

    holder: ZoneHolder
    task: asyncio.Task[object] | None
    parent: FleetProgram | None = None
    arm: str | None = None
    run: Run | None = None
    epoch: Epoch | None = None

    def check(self) -> None:
        """Raises MotionStopped if the fleet was stopped since it, or one that it acts for, began."""
        for program in self.line():
            if program.epoch:
                program.epoch.check()

    def go_on(self, epoch: Epoch) -> None:
        """Takes note that it has stopped the fleet itself, and so knows of it."""
        for program in self.line():
            program.epoch = program.epoch and epoch

    def line(self) -> Iterator[FleetProgram]:
        """Yields it and those that it acts for."""
        program: FleetProgram | None = self
        while program:
            yield program
            program = program.parent

    def part(self) -> FleetProgram | None:
        """Returns the program of a run that it is, or acts for."""
        return next((each for each in self.line() if each.run), None)


current: ContextVar[FleetProgram | None] = ContextVar("dobot_async program", default=None)


def here() -> FleetProgram:
    """Returns the program that runs now, always the same one in a task."""
    found, task = current.get(), asyncio.current_task()
    if found and found.task is task:
        return found

    program = FleetProgram(ZoneHolder(task.get_name() if task else "nobody"), task, found)
    current.set(program)
    return program


@contextmanager
def running(program: FleetProgram) -> Generator[None]:
    """While this is entered, `program` is the one that runs here."""
    before = current.get()
    current.set(program)
    try:
        yield
    finally:
        current.set(before)


@dataclass(eq=False)
class Zones:
    """The zones of a cell.

    Attributes:
        shapes: Where each is; None for one that is only a name.
        arms: The holders of the arms.
        locks: Who holds what.
        guards: To be called before a request is judged: what has ended meanwhile is released.
        drivers: Which task has moved an arm last; None if it has ended.
    """

    shapes: Mapping[str, Shape | None]
    arms: Mapping[str, ZoneHolder]
    locks: ZoneLocks = field(default_factory=ZoneLocks)
    guards: list[Callable[[], Awaitable[None]]] = field(default_factory=list[Callable[[], Awaitable[None]]])
    drivers: dict[str, asyncio.Task[object] | None] = field(default_factory=dict[str, asyncio.Task[object] | None])
    _watched: WeakSet[asyncio.Task[object]] = field(default_factory=WeakSet[asyncio.Task[object]])

    def near(self, x: float, y: float, reach: float) -> frozenset[str]:
        """Returns the zones that are at most so far from a vertical line of the cell."""
        return frozenset(name for name, shape in self.shapes.items() if shape and shape.distance(x, y) <= reach)

    def around(self, x: float, y: float, z: float, margin: float) -> set[str]:
        """Returns the zones that a place of the cell is in, or nearer to than `margin`."""
        return {name for name, shape in self.shapes.items() if shape and shape.contains(x, y, z, margin)}

    def drive(self, arm: str, program: FleetProgram) -> None:
        """Takes note that a program moves an arm."""
        self.drivers[arm] = task = program.task
        if task and task not in self._watched:
            self._watched.add(task)
            task.add_done_callback(self._ended)

    def parked(self, program: FleetProgram) -> Callable[[ZoneHolder], bool]:
        """Returns what tells of an arm that stands whether nobody is left who would move it while a program waits.

        That can be told in a run alone: whoever has begun it waits for its end.
        """
        line = list(program.line())
        runs = [(each.run, each.arm) for each in line if each.run]
        first = next((at for at, each in enumerate(line) if each.run), len(line))
        waiting = {each.task for each in line[first + 1 :]}
        names = {holder: arm for arm, holder in self.arms.items()}

        def parked(holder: ZoneHolder) -> bool:
            arm = names.get(holder)
            if arm is None or not runs or any(arm in run.alive and arm != own for run, own in runs):
                return False

            driver = self.drivers.get(arm)
            return driver is None or driver.done() or driver in waiting

        return parked

    def leave(self, program: FleetProgram, name: str) -> None:
        """Takes note that a program of a run has ended: what nobody moves any more is not waited for."""
        if program.run:
            program.run.alive.discard(name)

        self._ended(program.task)

    def driven(self, program: FleetProgram) -> frozenset[ZoneHolder]:
        """Returns the arms that a program has moved last."""
        return frozenset(self.arms[arm] for arm, task in self.drivers.items() if task is program.task)

    def own(self, program: FleetProgram, *arms: str) -> frozenset[ZoneHolder]:
        """Returns the holders that a program acts for: itself, its parents, the arms that they are for, and others."""
        line = list(program.line())
        named = {*arms, *(each.arm for each in line if each.arm)}
        return frozenset(each.holder for each in line) | {self.arms[arm] for arm in named}

    @asynccontextmanager
    async def hold(self, zone: str, arms: Collection[str], timeout: float | None, epoch: Epoch) -> AsyncGenerator[None]:
        """Holds a zone for the length of a block that begins in an epoch of the fleet."""
        if zone not in self.shapes:
            raise ValueError(f"no zone {zone!r}; there are: {', '.join(self.shapes) or 'none'}")

        program = here()
        program.check()
        own = self.own(program, *arms) | self.driven(program)
        parked = self.parked(program)
        request = await self.request(ZoneRequest(program.holder, own, frozenset([zone]), parked=parked), timeout)
        try:
            epoch.check()
            with running(program):
                yield
        finally:
            self.locks.release(request)

    async def request(
        self, request: ZoneRequest, timeout: float | None, check: Callable[[], Awaitable[None]] | None = None
    ) -> ZoneRequest:
        """Returns a request once it is granted.

        Args:
            request: The request.
            timeout: Seconds.
            check: Raises if the request has lost its purpose; called when it was not granted at once.

        Raises:
            ZoneOccupied: It would have to wait, and is not patient; or a holder has failed.
            ZoneDeadlock: It would wait for itself.
            ReplyTimeout: It had to wait for too long.
        """
        answered: asyncio.Future[DobotError | None] = asyncio.get_running_loop().create_future()

        def answer(error: DobotError | None) -> None:
            if not answered.done():
                answered.set_result(error)

        request.answer = answer
        try:
            async with asyncio.timeout(timeout):
                with self.locks.preparing(request):
                    await asyncio.gather(*(catch_up() for catch_up in self.guards))

                if not answered.done():
                    self.locks.request(request)

                waits = not answered.done()
                error = await answered
        except BaseException as failure:
            self.locks.release(request)
            if isinstance(failure, TimeoutError):
                waited = ", ".join(sorted(request.zones))
                raise ReplyTimeout(f"{request.holder.name} did not get zone {waited} within {timeout:.3g} s") from None

            raise

        if error:
            raise another(error)  # a failure may answer several requests

        if waits and check:
            try:
                await check()
            except BaseException:
                self.locks.release(request)
                raise

        return request

    def _ended(self, task: asyncio.Task[object] | None) -> None:
        """A task moves nothing any more."""
        for arm, driver in self.drivers.items():
            if driver is task:
                self.drivers[arm] = None

        self.locks.settle()
