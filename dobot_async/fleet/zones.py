"""Zones for programs: `async with fleet.zone("bin")`, and the claims of guarded arms.

A zone is held by a party: an arm, for as long as it is in it or has a way through it ahead, or a program, for the
length of a block. A program is a task; the tasks that it starts act for it, but do not share what they hold with each
other.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Collection, Iterator, Mapping
from contextlib import asynccontextmanager, contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field

from dobot_async.errors import DobotError, ReplyTimeout, another
from dobot_async.fleet.claims import Claim, Claims, Party
from dobot_async.fleet.shapes import Shape

__all__ = ["Program", "Run", "Zones", "here", "running"]


@dataclass(frozen=True, eq=False, slots=True)
class Run:
    """Programs that run side by side.

    Attributes:
        parties: As what they hold zones, by name.
    """

    parties: Mapping[str, Party]


@dataclass(eq=False)
class Program:
    """A task that commands arms.

    Attributes:
        party: As what it holds zones.
        task: Which task.
        parent: The program that started it.
        arm: The arm that it is the program of, if it is.
        run: The programs that run beside it, if it is one of several.
    """

    party: Party
    task: asyncio.Task[object] | None
    parent: Program | None = None
    arm: str | None = None
    run: Run | None = None

    def line(self) -> Iterator[Program]:
        """Yields it and those that it acts for."""
        program: Program | None = self
        while program:
            yield program
            program = program.parent

    def part(self) -> Program | None:
        """Returns the program of a run that it is, or acts for."""
        return next((each for each in self.line() if each.run), None)


current: ContextVar[Program | None] = ContextVar("dobot_async program", default=None)


def here() -> Program:
    """Returns the program that runs now, always the same one in a task."""
    found, task = current.get(), asyncio.current_task()
    if found and found.task is task:
        return found

    program = Program(Party(task.get_name() if task else "nobody"), task, found)
    current.set(program)
    return program


@contextmanager
def running(program: Program) -> Iterator[None]:
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
        arms: The parties of the arms.
        claims: Who holds what.
        guards: To be called before a claim is judged: what has ended meanwhile is released.
        drivers: Which task has moved an arm last.
    """

    shapes: Mapping[str, Shape | None]
    arms: Mapping[str, Party]
    claims: Claims = field(default_factory=Claims)
    guards: list[Callable[[], Awaitable[None]]] = field(default_factory=list)
    drivers: dict[str, asyncio.Task[object] | None] = field(default_factory=dict)

    def near(self, x: float, y: float, reach: float) -> frozenset[str]:
        """Returns the zones that are at most so far from a vertical line of the cell."""
        return frozenset(name for name, shape in self.shapes.items() if shape and shape.distance(x, y) <= reach)

    def around(self, x: float, y: float, z: float, margin: float) -> set[str]:
        """Returns the zones that a place of the cell is in, or nearer to than `margin`."""
        return {name for name, shape in self.shapes.items() if shape and shape.contains(x, y, z, margin)}

    def driven(self, program: Program) -> frozenset[Party]:
        """Returns the arms that a program has moved last."""
        return frozenset(self.arms[arm] for arm, task in self.drivers.items() if task is program.task)

    def own(self, program: Program, *arms: str) -> frozenset[Party]:
        """Returns the parties that a program acts for: itself, its parents, the arms that they are for, and others."""
        line = list(program.line())
        named = {*arms, *(each.arm for each in line if each.arm)}
        return frozenset(each.party for each in line) | {self.arms[arm] for arm in named}

    @asynccontextmanager
    async def hold(self, zone: str, arms: Collection[str], timeout: float | None) -> AsyncIterator[None]:
        """Holds a zone for the length of a block."""
        if zone not in self.shapes:
            raise ValueError(f"no zone {zone!r}; there are: {', '.join(self.shapes) or 'none'}")

        program = here()
        own = self.own(program, *arms) | self.driven(program)
        claim = await self.claim(Claim(program.party, own, frozenset([zone])), timeout)
        try:
            with running(program):
                yield
        finally:
            self.claims.release(claim)

    async def claim(self, claim: Claim, timeout: float | None) -> Claim:
        """Returns a claim once it is granted.

        Raises:
            ZoneOccupied: It would have to wait, and is not patient; or a holder has failed.
            ZoneDeadlock: It would wait for itself.
            ReplyTimeout: It had to wait for too long.
        """
        answered: asyncio.Future[DobotError | None] = asyncio.get_running_loop().create_future()

        def answer(error: DobotError | None) -> None:
            if not answered.done():
                answered.set_result(error)

        claim.answer = answer
        try:
            async with asyncio.timeout(timeout):
                with self.claims.preparing(claim):
                    await asyncio.gather(*(catch_up() for catch_up in self.guards))

                if not answered.done():
                    self.claims.request(claim)

                error = await answered
        except BaseException as failure:
            self.claims.release(claim)
            if isinstance(failure, TimeoutError):
                waited = ", ".join(sorted(claim.zones))
                raise ReplyTimeout(f"{claim.party.name} did not get zone {waited} within {timeout:.3g} s") from None

            raise

        if error:
            raise another(error)  # a failure may answer several claims

        return claim

    def drop(self, party: Party) -> None:
        """Releases what the programs of an arm hold; what the arm itself is in, it keeps."""
        for claim in self.claims.held:
            if party in claim.own and claim.party is not party:
                self.claims.release(claim)
