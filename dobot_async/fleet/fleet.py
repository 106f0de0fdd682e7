"""Several arms as one: connected together, closed together, and stopped together when one of them fails.

    async with Fleet.connect({"left": url, "right": url}) as fleet:
        await fleet.each("home")
        async with fleet.together("left", "right") as together:
            together["left"].move_to(220, 0, 40)
            together["right"].move_to(220, 0, 40)

Coordinates are each arm's own; its base frame turns those of the cell into them.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Iterator, Mapping
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from pathlib import Path
from typing import Any, TypeVar, cast, overload

from dobot_async._core.util.arguments import check_timeout
from dobot_async._core.util.shapes import Shape
from dobot_async._core.util.tasks import STAYING
from dobot_async.arms.magician.arm import Magician
from dobot_async.arms.magician.queue import Batch
from dobot_async.arms.mycobot.arm import MyCobot
from dobot_async.arms.mycobot.queue import CobotBatch
from dobot_async.arms.ultraarm.arm import UltraArm
from dobot_async.arms.ultraarm.queue import UltraArmBatch
from dobot_async.errors import MotionStopped, ReplyTimeout
from dobot_async.fleet.cell import read_cell
from dobot_async.fleet.concurrent import run_all
from dobot_async.fleet.families import AnyArm
from dobot_async.fleet.fleet_arm import Member
from dobot_async.fleet.fleet_base import OnFailure
from dobot_async.fleet.frames import BaseFrame, Place
from dobot_async.fleet.programs import Programs
from dobot_async.fleet.together import SynchronizedStart, Together, abandon
from dobot_async.fleet.zones import here

__all__ = ["Fleet", "OnFailure"]

A = TypeVar("A")
K = TypeVar("K")


class Fleet(Programs[A]):
    """Connected arms by name; made by `connect` or `from_file`, for the length of a block.

    Attributes:
        failures: Why arms failed, by name, since they were last known to work.
    """

    @overload
    @classmethod
    def connect(
        cls,
        arms: Mapping[str, str],
        *,
        zones: Mapping[str, Shape | None] | None = None,
        groups: Mapping[str, OnFailure] | None = None,
        **options: Any,
    ) -> AbstractAsyncContextManager[Fleet[Magician]]: ...

    @overload
    @classmethod
    def connect(
        cls,
        arms: Mapping[str, Member[K]],
        *,
        zones: Mapping[str, Shape | None] | None = None,
        groups: Mapping[str, OnFailure] | None = None,
        **options: Any,
    ) -> AbstractAsyncContextManager[Fleet[K]]: ...

    @classmethod
    def connect(
        cls,
        arms: Mapping[str, Any],
        *,
        zones: Mapping[str, Shape | None] | None = None,
        groups: Mapping[str, OnFailure] | None = None,
        **options: Any,
    ) -> AbstractAsyncContextManager[Fleet[Any]]:
        """Connects to all arms at the same time, or to none.

        Args:
            arms: By name: URLs of Magicians, or a Member for each arm.
            zones: What only one arm at a time may be in, by name; None for a zone that is nowhere in particular.
            groups: Which arms stop when one of a group fails: those of the "fleet", of the "group", or it "alone".
            **options: For `connect` of every arm, such as check_reach=True.

        Raises:
            ValueError: A URL or an argument is wrong.
            ConnectFailed: An arm did not answer; the message names it.
        """
        members = {name: as_member(arm) for name, arm in arms.items()}
        groups = groups or {}
        if not members:
            raise ValueError("a fleet has at least one arm")

        unknown = {member.group for member in members.values() if member.group} - groups.keys()
        if unknown or not set(groups.values()) <= {"fleet", "group", "alone"}:
            raise ValueError(
                f'each group is in groups, with "fleet", "group" or "alone"; not so: {sorted(unknown) or dict(groups)}'
            )

        fleet = cls(members, zones or {}, groups)
        return fleet._connected(options)

    @classmethod
    def from_file(cls, path: str | Path, **options: Any) -> AbstractAsyncContextManager[Fleet[AnyArm]]:
        """Connects to the arms of a cell file; see docs/fleet.md for what stands in it.

        Args:
            path: Of the TOML file.
            **options: For `connect` of every arm.

        Raises:
            ValueError: The file is wrong; the message says where.
            OSError: It cannot be read.
            ConnectFailed: An arm did not answer.
        """
        cell = read_cell(Path(path))
        return cls.connect(cell.members, zones=cell.zones, groups=cell.groups, **options)

    def __getitem__(self, name: str) -> A:
        return cast(A, self._fleet_arm(name).arm)

    def __iter__(self) -> Iterator[str]:
        return iter(self._fleet_arms)

    def __len__(self) -> int:
        return len(self._fleet_arms)

    def __contains__(self, name: object) -> bool:
        return name in self._fleet_arms

    def arm(self, name: str, kind: type[K]) -> K:
        """Returns an arm of a family, typed; raises TypeError if it is of another.

        Args:
            name: Of the arm.
            kind: Its class: Magician, MyCobot or UltraArm.

        Raises:
            KeyError: There is no such arm.
            TypeError: It is of another family.
        """
        arm = self._fleet_arm(name).arm
        if not isinstance(arm, kind):
            raise TypeError(f"{name} is a {self._fleet_arm(name).member.kind.__name__}, not a {kind.__name__}")

        return arm

    def member(self, name: str) -> Member[A]:
        """Returns what the fleet was told of an arm before it was connected; raises KeyError if there is none."""
        return self._fleet_arm(name).member

    @property
    def zones(self) -> Mapping[str, Shape | None]:
        """Where each zone is, by name; None for one that is nowhere in particular."""
        return dict(self._zones.shapes)

    def base(self, name: str) -> BaseFrame:
        """Returns where an arm stands in the cell; raises KeyError if there is no such arm."""
        return self._fleet_arm(name).member.base

    def to_cell(self, name: str, x: float, y: float, z: float, r: float = 0.0) -> Place:
        """Returns where in the cell a place of an arm is.

        Args:
            name: Of the arm.
            x: mm, as the arm counts.
            y: mm.
            z: mm.
            r: Degrees.

        Raises:
            KeyError: There is no such arm.
        """
        return self.base(name).to_cell(x, y, z, r)

    def to_arm(self, name: str, x: float, y: float, z: float, r: float = 0.0) -> Place:
        """Returns what a place of the cell is for an arm.

        Args:
            name: Of the arm.
            x: mm, as the cell counts.
            y: mm.
            z: mm.
            r: Degrees.

        Raises:
            KeyError: There is no such arm.
        """
        return self.base(name).to_arm(x, y, z, r)

    async def stop(self, *, timeout: float = STAYING) -> None:
        """Stops all arms, at the same time; pending Motions raise MotionStopped.

        Nothing that has begun before goes on: programs of `run` and `each`, and blocks of `together`, get MotionStopped
        wherever they are, at barriers and while they wait for zones too, and for whatever they command after it. The
        program that calls this goes on: it knows.

        Args:
            timeout: Seconds to wait for the arms to acknowledge it; it is repeated after that, too, and when this call
                is cancelled, until each of them does or its connection ends.

        Raises:
            ValueError: All arms are only looked at (control=False).
            ReplyTimeout: An arm has not acknowledged it yet.
            DobotError: An arm could not be stopped; the others were.
        """
        within = check_timeout(timeout)
        fleet_arms = [fleet_arm for fleet_arm in self._fleet_arms.values() if fleet_arm.commands]
        if not fleet_arms:
            raise ValueError("a stop is a command, and these connections only read (control=False)")

        for fleet_arm in fleet_arms:
            fleet_arm.tell_to_stop()

        error = MotionStopped("the fleet was stopped")
        self._epoch = self._epoch.end(error)
        here().go_on(self._epoch)
        self._barriers.stop()
        self._zones.locks.stop(error)
        stops = {
            fleet_arm.name: fleet_arm.begin_stop(MotionStopped("the arm was told to stop")) for fleet_arm in fleet_arms
        }
        await asyncio.wait(stops.values(), timeout=within)
        await run_all({name: stopped(stop, timeout) for name, stop in stops.items()})

    async def recover(self) -> None:
        """Makes all arms ready again after a failure: clears alarms and queues, and lets them move.

        Raises:
            DobotError: An arm does not recover; the fleet stays stopped.
        """
        await self._stops_heard()
        reasons = {name: fleet_arm.stopped for name, fleet_arm in self._fleet_arms.items()}
        await run_all({name: fleet_arm.recover() for name, fleet_arm in self._fleet_arms.items()})
        self._barriers.forget()
        for name, fleet_arm in self._fleet_arms.items():
            if fleet_arm.stopped is reasons[name]:  # else another failure has stopped it meanwhile
                fleet_arm.stopped = None
                self._works(fleet_arm)

    @overload
    def together(
        self: Fleet[Magician], *names: str, timeout: float | None = None
    ) -> AbstractAsyncContextManager[Together[Batch]]: ...

    @overload
    def together(
        self: Fleet[MyCobot], *names: str, timeout: float | None = None
    ) -> AbstractAsyncContextManager[Together[CobotBatch]]: ...

    @overload
    def together(
        self: Fleet[UltraArm], *names: str, timeout: float | None = None
    ) -> AbstractAsyncContextManager[Together[UltraArmBatch]]: ...

    @overload
    def together(self, *names: str, timeout: float | None = None) -> AbstractAsyncContextManager[Together[Any]]: ...

    @asynccontextmanager
    async def together(self, *names: str, timeout: float | None = None) -> AsyncGenerator[Together[Any]]:
        """Collects a batch for each of several arms, and starts them at one instant when the block ends.

        The arms first finish what they have to do. Motions return as usual; `start` and `skew` of what this yields tell
        how well it went. Guarded arms get all zones on their ways at once.

        Args:
            *names: Of the arms; all by default.
            timeout: Seconds for the arms to finish what they do, and again for zones, and for room in their queues.

        Raises:
            MotionStopped: One of the arms was stopped since the block began.
            ZoneDeadlock: The ways of two of the arms lead through one zone.
            DobotError: The batches could not be loaded or released; the arms were stopped.
        """
        fleet_arms = {name: self._fleet_arm(name) for name in names or self._fleet_arms}
        batches = {name: fleet_arm.family.batch(fleet_arm.arm) for name, fleet_arm in fleet_arms.items()}
        together, epochs = Together(batches), {name: fleet_arm.queue.epoch for name, fleet_arm in fleet_arms.items()}
        try:
            yield together
        except BaseException:
            abandon(batches)
            raise

        commanded = {name: fleet_arm for name, fleet_arm in fleet_arms.items() if batches[name].motions}
        if commanded:
            try:
                together.start = await SynchronizedStart(
                    commanded, batches, epochs, self._zones, check_timeout(timeout)
                ).run()
            except BaseException:
                abandon(batches)
                raise


def as_member(arm: str | Member[Any]) -> Member[Any]:
    """What a fleet is told of an arm; a URL is that of a Magician."""
    return arm if isinstance(arm, Member) else Member(arm, Magician)


async def stopped(stop: asyncio.Task[None], timeout: float) -> None:
    """Raises what has become of a stop that had so many seconds, unless it was heard."""
    if not stop.done():
        raise ReplyTimeout(
            f"the arm has not acknowledged within {timeout:.3g} s that it is to stop; this is repeated until it does"
        )

    stop.result()
