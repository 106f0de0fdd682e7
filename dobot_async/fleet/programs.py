"""The programs of a fleet: side by side, one for each arm, where they meet, and what they keep to themselves."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Coroutine, Mapping
from contextlib import AbstractAsyncContextManager
from functools import partial
from typing import Any, Concatenate, ParamSpec, TypeVar, overload

from dobot_async.errors import DobotError
from dobot_async.fleet.concurrent import run_concurrently, with_arm_name
from dobot_async.fleet.fleet_arm import FleetArm
from dobot_async.fleet.fleet_base import FleetBase
from dobot_async.fleet.zone_locks import ZoneHolder
from dobot_async.fleet.zones import FleetProgram, Run, here, running

__all__ = ["Programs"]

A = TypeVar("A")
T = TypeVar("T")
P = ParamSpec("P")


class Programs(FleetBase[A]):
    """The part of `Fleet` that runs programs."""

    @overload
    async def each(self, verb: str, *args: Any, **kwargs: Any) -> dict[str, Any]: ...

    @overload
    async def each(
        self, verb: Callable[Concatenate[A, P], Awaitable[T]], *args: P.args, **kwargs: P.kwargs
    ) -> dict[str, T]: ...

    async def each(self, verb: Any, *args: Any, **kwargs: Any) -> dict[str, Any]:
        """Does the same with all arms at the same time, and returns what each has returned.

        Args:
            verb: The name of a method, or something to call with each arm, such as `Magician.home`.
            *args: What it takes.
            **kwargs: What it takes.

        Raises:
            DobotError: The first failure, with the arm's name; what the others did was cancelled, so that they stop,
                unless their group goes on.
        """
        parent, epoch = here(), self._epoch

        async def done(fleet_arm: FleetArm) -> Any:
            does: Callable[..., Awaitable[Any]] = (
                getattr(fleet_arm.arm, verb) if isinstance(verb, str) else partial(verb, fleet_arm.arm)
            )
            part = FleetProgram(ZoneHolder(f"each {fleet_arm.name}"), asyncio.current_task(), parent, epoch=epoch)
            try:
                with running(part):
                    part.check()
                    return await does(*args, **kwargs)
            except (DobotError, ValueError) as error:
                with_arm_name(fleet_arm.name, error)
                raise

        async with self._stopping_others():
            work = {name: done(fleet_arm) for name, fleet_arm in self._fleet_arms.items()}
            return await run_concurrently(work, ends=self._ends, causes=self._causes)

    async def run(self, programs: Mapping[str, Coroutine[Any, Any, T]]) -> dict[str, T]:
        """Runs programs side by side, and returns what each has returned.

        Args:
            programs: Coroutines, by the name of the arm that each commands, or by another name.

        Raises:
            BaseException: The first failure, when all have ended; the others were cancelled, unless the group of the
                arm that failed lets them go on.
        """
        parent, epoch = here(), self._epoch
        run = Run({name: ZoneHolder(f"program {name}") for name in programs}, set(programs))

        async def ran(name: str, program: Coroutine[Any, Any, T]) -> T:
            arm = name if name in self._fleet_arms else None
            part = FleetProgram(run.holders[name], asyncio.current_task(), parent, arm, run, epoch)
            if arm:
                self._zones.drive(arm, part)

            why = "has ended"
            try:
                with running(part):
                    return await program
            except BaseException as error:
                why = f"has failed: {error or type(error).__name__}"
                if arm and isinstance(error, ValueError):
                    with_arm_name(name, error)

                raise
            finally:
                self._barriers.leave(name, f"{name} {why}", run=run)
                self._zones.leave(part, name)

        async with self._stopping_others():
            try:
                work = {name: ran(name, each) for name, each in programs.items()}
                return await run_concurrently(work, ends=self._ends, causes=self._causes)
            finally:
                self._barriers.forget(run)

    async def barrier(self, name: str, *parties: str, timeout: float | None = None) -> None:
        """Returns when all parties have come to this barrier; it may be passed any number of times.

        Args:
            name: Of the barrier.
            parties: Who has to come; by default all programs of the same `run`, outside of one all arms of the fleet.
            timeout: Seconds to wait.

        Raises:
            BarrierBroken: One of them failed, ended or gave up; it stays broken for the run, or until `recover`.
            ZoneDeadlock: Among programs of a `run`: one of them waits, in the end, for a zone that this one holds.
            ReplyTimeout: They did not all come in time.
            MotionStopped: The fleet was stopped meanwhile.
        """
        program = here()
        part = program.part()
        names = parties or (part.run.holders if part and part.run else self._fleet_arms)
        arms = self._zones.driven(program)
        await self._barriers.wait(name, frozenset(names), program, arms, timeout, self._epoch)

    def zone(self, name: str, *arms: str, timeout: float | None = None) -> AbstractAsyncContextManager[None]:
        """Holds a zone for the length of a block; nobody else does.

        Args:
            name: Of the zone.
            arms: Whose being in the zone is no hindrance. The arm of a program of `run`, and those that this task has
                moved, need not be named.
            timeout: Seconds to wait for it.

        Raises:
            ValueError: There is no such zone.
            ZoneDeadlock: Its holder waits, in the end, for who asks.
            ZoneOccupied: An arm that has failed may be in it; or, in a `run`, one is that no program moves any more.
            ReplyTimeout: It was not free in time.
            MotionStopped: The fleet was stopped while this waited.
        """
        for arm in arms:
            self._fleet_arm(arm)

        return self._zones.hold(name, arms, timeout, self._epoch)

    def holders(self, zone: str) -> list[str]:
        """Returns the names of those who hold a zone."""
        return [holder.name for holder in self._zones.locks.holders(zone)]
