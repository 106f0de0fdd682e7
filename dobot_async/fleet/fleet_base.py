"""The connections of a fleet, one task each, and what stops when an arm fails.

Each arm has a task of its own in which its connection's block is entered and left, so that no context is held open
across the caller's code, and the caller's exceptions arrive unchanged.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Collection, Mapping
from contextlib import ExitStack, asynccontextmanager
from typing import Any, Generic, Literal, Self, TypeVar

from dobot_async._core.queue.epoch import Epoch
from dobot_async._core.util.shapes import Shape
from dobot_async._core.util.tasks import run_shielded
from dobot_async.errors import DobotError, MotionStopped
from dobot_async.fleet.barriers import Barriers
from dobot_async.fleet.concurrent import ended, on_the_way_out, with_arm_name
from dobot_async.fleet.fleet_arm import FleetArm, Member
from dobot_async.fleet.zone_locks import ZoneHolder
from dobot_async.fleet.zones import Zones
from dobot_async.traces.recorder import shared

__all__ = ["FleetBase", "OnFailure"]

A = TypeVar("A")
OnFailure = Literal["fleet", "group", "alone"]


class FleetBase(Generic[A]):
    """The part of `Fleet` that is not for its users.

    Attributes:
        failures: Why arms failed, by name, since they were last known to work.
    """

    def __init__(
        self,
        members: Mapping[str, Member[A]],
        zones: Mapping[str, Shape | None],
        groups: Mapping[str, OnFailure],
    ) -> None:
        self.failures: dict[str, DobotError] = {}
        self._groups = groups
        self._zones = Zones(dict(zones), {name: ZoneHolder(name) for name in members})
        self._barriers = Barriers(self._zones.locks)
        self._fleet_arms = {
            name: FleetArm(name, member, self._zones, self._fail, self._works) for name, member in members.items()
        }
        self._stopping: dict[asyncio.Task[None], FleetArm] = {}
        self._leaving = False
        self._epoch = Epoch()

    @asynccontextmanager
    async def _connected(self, options: Mapping[str, Any]) -> AsyncGenerator[Self]:
        """Holds all arms for the length of a block; a trace of all of them is one file."""
        given = {name: dict(options) for name in self._fleet_arms}
        with ExitStack() as stack:
            if options.get("record") is not None:
                file = stack.enter_context(shared(options["record"]))
                given = {name: {**each, "record": file.named(name)} for name, each in given.items()}

            async with self._held(given):
                yield self

    @asynccontextmanager
    async def _held(self, options: Mapping[str, Mapping[str, Any]]) -> AsyncGenerator[None]:
        """Holds all arms, each in a task of its own, with its own options, for the length of a block."""
        leave = asyncio.Event()
        ready = {name: asyncio.get_running_loop().create_future() for name in self._fleet_arms}
        hosts = {
            asyncio.create_task(host(fleet_arm, options[name], ready[name], leave), name=f"dobot_async {name}"): name
            for name, fleet_arm in self._fleet_arms.items()
        }
        try:
            await all_ready(hosts, ready.values())
            yield
        except BaseException as error:
            self._leaving = True
            for fleet_arm in self._fleet_arms.values():
                if fleet_arm.stops_on_error:
                    fleet_arm.tell_to_stop()

            await on_the_way_out(error, ended(hosts))
            raise

        self._leaving = True
        await run_shielded(self._left(hosts, leave))

    async def _left(self, hosts: Collection[asyncio.Task[None]], leave: asyncio.Event) -> None:
        """Leaves all arms; those that a failure has stopped get time to hear of it."""
        await self._stops_heard()
        leave.set()
        await asyncio.wait(hosts)
        for task in hosts:
            task.result()

    def _fleet_arm(self, name: str) -> FleetArm:
        """The place of an arm."""
        if name not in self._fleet_arms:
            raise KeyError(f"no arm {name!r} in this fleet; there are: {', '.join(self._fleet_arms)}")

        return self._fleet_arms[name]

    def _affected(self, name: str) -> Collection[FleetArm]:
        """The arms that stop when one fails, itself among them unless it fails alone."""
        group = self._fleet_arms[name].member.group
        reach = self._groups[group] if group else "fleet"
        if reach == "alone":
            return ()

        return [
            fleet_arm for fleet_arm in self._fleet_arms.values() if reach == "fleet" or fleet_arm.member.group == group
        ]

    def _ends(self, name: str, error: BaseException) -> bool:
        """Whether a failure in the work of an arm cancels the work of the others."""
        alone = name in self._fleet_arms and len(self._affected(name)) < len(self._fleet_arms)
        return not (alone and isinstance(error, DobotError))

    def _causes(self, error: BaseException) -> Collection[str]:
        """The arms through whose failures others were stopped."""
        return self.failures if isinstance(error, MotionStopped) else ()

    def _fail(self, failed: FleetArm, error: DobotError) -> None:
        """An arm has failed: the others stop, and nobody waits for it any more."""
        if self._leaving:
            return

        self.failures[failed.name] = error
        failed.holder.failure = error
        self._zones.locks.fail([failed.holder], error)
        self._barriers.fail(failed.name, str(error))
        affected = [fleet_arm for fleet_arm in self._affected(failed.name) if not fleet_arm.stopped]
        others = [fleet_arm for fleet_arm in affected if fleet_arm is not failed]
        for fleet_arm in others:
            fleet_arm.tell_to_stop()

        if failed in affected:
            failed.stopped = MotionStopped(f"{failed.name} does not move, for it has failed: {error}")

        for fleet_arm in others:
            fleet_arm.stopped = MotionStopped(f"{fleet_arm.name} was stopped because another arm failed: {error}")
            if not fleet_arm.connected:
                continue

            if fleet_arm.commands:
                task = fleet_arm.queue.begin_stop(fleet_arm.stopped)
                self._stopping[task] = fleet_arm
                task.add_done_callback(self._stopping.pop)

            self._zones.locks.fail([fleet_arm.holder], fleet_arm.stopped)

    def _works(self, fleet_arm: FleetArm) -> None:
        """An arm may move, whatever it has failed with before."""
        if fleet_arm.holder.failure:
            fleet_arm.holder.failure = None
            self._barriers.join(fleet_arm.name)
            del self.failures[fleet_arm.name]

    @asynccontextmanager
    async def _stopping_others(self) -> AsyncGenerator[None]:
        """When this is left, the arms that a failure has stopped have heard of it, or had their time to."""
        try:
            yield
        except BaseException as error:
            await on_the_way_out(error, self._stops_heard())
            raise

        await run_shielded(self._stops_heard())

    async def _stops_heard(self) -> list[str]:
        """Waits for the stops that a failure has begun; returns of which arms it is not known whether they stand."""
        heard = await asyncio.gather(*(fleet_arm.stop_heard(task) for task, fleet_arm in self._stopping.items()))
        return [problem for problem in heard if problem]


async def host(
    fleet_arm: FleetArm, options: Mapping[str, Any], ready: asyncio.Future[None], leave: asyncio.Event
) -> None:
    """Holds one arm's connection until all are to be left; cancelled, it leaves it as by an error."""
    member = fleet_arm.member
    try:
        options = {**options, **member.options}
        async with fleet_arm.family.kind.connect(member.url, **options) as arm:
            try:
                await fleet_arm.begin(arm, options)
                ready.set_result(None)
                await leave.wait()
            finally:
                fleet_arm.end()
    except (DobotError, ValueError) as error:
        with_arm_name(fleet_arm.name, error)
        raise
    finally:
        await run_shielded(fleet_arm.aclose())


async def all_ready(hosts: Collection[asyncio.Task[None]], ready: Collection[asyncio.Future[None]]) -> None:
    """Returns when all arms are connected; raises the first failure."""
    waiting = set(ready)
    while waiting:
        done, _ = await asyncio.wait([*waiting, *hosts], return_when=asyncio.FIRST_COMPLETED)
        for task in hosts:
            if task in done:
                task.result()

        waiting -= done
