"""Several arms as one, for programs without asyncio: each program of a fleet has a thread of its own.

with Fleet.connect({"left": url, "right": url}) as fleet:
fleet.each("home")
fleet.run({"left": lambda: load(fleet["left"]), "right": lambda: weld(fleet["right"])})
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import Any, Concatenate, Generic, ParamSpec, TypeVar, cast, overload

from dobot_async import DobotError
from dobot_async import Fleet as AsyncFleet
from dobot_async._core.util.shapes import Shape
from dobot_async.fleet import BaseFrame, Place
from dobot_async.fleet import Member as AsyncMember
from dobot_async.fleet.fleet_base import OnFailure
from dobot_async.sync.calls import in_thread
from dobot_async.sync.magician import Batch, Magician
from dobot_async.sync.mycobot import CobotBatch, MyCobot
from dobot_async.sync.portal import PORTAL
from dobot_async.sync.together import Together
from dobot_async.sync.twin import BlockingContext, Twin
from dobot_async.sync.twins import AnyArm, asynchronous_of, blocking_of, twin_of
from dobot_async.sync.ultraarm import UltraArm, UltraArmBatch

__all__ = ["Fleet", "Member"]

A = TypeVar("A")
B = TypeVar("B")
K = TypeVar("K")
T = TypeVar("T")
P = ParamSpec("P")


@dataclass(frozen=True)
class Member(AsyncMember[A]):
    """An arm that is to be in a fleet; see `dobot_async.fleet.Member`. Its class is one of `dobot_async.sync`."""

    def __post_init__(self) -> None:
        self.asynchronous()

    def asynchronous(self) -> AsyncMember[Any]:
        """What the fleet is told; raises ValueError if something does not fit."""
        given: dict[str, Any] = {field.name: getattr(self, field.name) for field in fields(self)}
        given["kind"] = asynchronous_of(self.kind)
        return AsyncMember(**given)


class Fleet(Twin[AsyncFleet[Any]], Generic[A]):
    """Connected arms by name; made by `connect` or `from_file`, for the length of a block."""

    __slots__ = ()

    @overload
    @classmethod
    def connect(
        cls,
        arms: Mapping[str, str],
        *,
        zones: Mapping[str, Shape | None] | None = None,
        groups: Mapping[str, OnFailure] | None = None,
        **options: Any,
    ) -> AbstractContextManager[Fleet[Magician]]: ...

    @overload
    @classmethod
    def connect(
        cls,
        arms: Mapping[str, Member[K]],
        *,
        zones: Mapping[str, Shape | None] | None = None,
        groups: Mapping[str, OnFailure] | None = None,
        **options: Any,
    ) -> AbstractContextManager[Fleet[K]]: ...

    @classmethod
    def connect(
        cls,
        arms: Mapping[str, Any],
        *,
        zones: Mapping[str, Shape | None] | None = None,
        groups: Mapping[str, OnFailure] | None = None,
        **options: Any,
    ) -> AbstractContextManager[Fleet[Any]]:
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
        members = {name: arm.asynchronous() if isinstance(arm, Member) else arm for name, arm in arms.items()}
        connect = partial(AsyncFleet.connect, cast("Any", members), zones=zones, groups=groups, **options)
        return BlockingContext(connect, Fleet[Any], f"the fleet of {', '.join(arms)}")

    @classmethod
    def from_file(cls, path: str | Path, **options: Any) -> AbstractContextManager[Fleet[AnyArm]]:
        """Connects to the arms of a cell file; see docs/fleet.md for what stands in it.

        Args:
            path: Of the TOML file.
            **options: For `connect` of every arm.

        Raises:
            ValueError: The file is wrong; the message says where.
            OSError: It cannot be read.
            ConnectFailed: An arm did not answer.
        """
        return BlockingContext(lambda: AsyncFleet.from_file(path, **options), Fleet[AnyArm], f"the fleet of {path}")

    @property
    def failures(self) -> dict[str, DobotError]:
        """Why arms failed, by name, since they were last known to work."""
        return dict(self.asynchronous.failures)

    def __getitem__(self, name: str) -> A:
        return cast(A, twin_of(self.asynchronous[name]))

    def __iter__(self) -> Iterator[str]:
        return iter(self.asynchronous)

    def __len__(self) -> int:
        return len(self.asynchronous)

    def __contains__(self, name: object) -> bool:
        return name in self.asynchronous

    def arm(self, name: str, kind: type[K]) -> K:
        """Returns an arm of a family, typed; raises TypeError if it is of another."""
        return cast(K, twin_of(self.asynchronous.arm(name, asynchronous_of(kind))))

    def member(self, name: str) -> Member[A]:
        """Returns what the fleet was told of an arm before it was connected."""
        told = self.asynchronous.member(name)
        given: dict[str, Any] = {field.name: getattr(told, field.name) for field in fields(told)}
        given["kind"] = blocking_of(told.kind)
        return Member(**given)

    @property
    def zones(self) -> Mapping[str, Shape | None]:
        """Where each zone is, by name; None for one that is nowhere in particular."""
        return self.asynchronous.zones

    def base(self, name: str) -> BaseFrame:
        """Returns where an arm stands in the cell."""
        return self.asynchronous.base(name)

    def to_cell(self, name: str, x: float, y: float, z: float, r: float = 0.0) -> Place:
        """Returns where in the cell a place of an arm is."""
        return self.asynchronous.to_cell(name, x, y, z, r)

    def to_arm(self, name: str, x: float, y: float, z: float, r: float = 0.0) -> Place:
        """Returns what a place of the cell is for an arm."""
        return self.asynchronous.to_arm(name, x, y, z, r)

    @overload
    def each(self, verb: str, *args: Any, **kwargs: Any) -> dict[str, Any]: ...

    @overload
    def each(self, verb: Callable[Concatenate[A, P], T], *args: P.args, **kwargs: P.kwargs) -> dict[str, T]: ...

    def each(self, verb: Any, *args: Any, **kwargs: Any) -> dict[str, Any]:
        """Does the same with all arms at the same time, and returns what each has returned.

        Args:
            verb: The name of a method, or something to call with each arm, such as `Magician.home`; each call has a
                thread of its own.
            *args: What it takes.
            **kwargs: What it takes.

        Raises:
            DobotError: The first failure, with the arm's name; what the others did was cancelled, so that they stop,
                unless their group goes on.
        """
        if isinstance(verb, str):
            method = verb
            return PORTAL.run(lambda: self.asynchronous.each(method, *args, **kwargs))

        async def done(arm: Any) -> Any:
            return await in_thread(lambda: verb(twin_of(arm), *args, **kwargs))

        return PORTAL.run(lambda: self.asynchronous.each(done))

    def stop(self, *, timeout: float = 5.0) -> None:
        """Stops all arms, at the same time; pending Motions raise MotionStopped.

        Nothing that has begun before goes on: programs of `run` and `each`, and blocks of `together`, get MotionStopped
        wherever they are, at barriers and while they wait for zones too, and for whatever they command after it. The
        program that calls this goes on: it knows.

        Args:
            timeout: Seconds to wait for the arms to acknowledge it; it is repeated after that, too, and when this call
                is interrupted, until each of them does or its connection ends.

        Raises:
            ValueError: All arms are only looked at (control=False).
            ReplyTimeout: An arm has not acknowledged it yet.
            DobotError: An arm could not be stopped; the others were.
        """
        PORTAL.run(lambda: self.asynchronous.stop(timeout=timeout))

    def recover(self) -> None:
        """Makes all arms ready again after a failure: clears alarms and queues, and lets them move.

        Raises:
            DobotError: An arm does not recover; the fleet stays stopped.
        """
        PORTAL.run(self.asynchronous.recover)

    def run(self, programs: Mapping[str, Callable[[], T]]) -> dict[str, T]:
        """Runs programs side by side, each in a thread of its own, and returns what each has returned.

        A program that is ended because another one failed gets asyncio.CancelledError, a BaseException, out of the call
        that it waits for, or out of its next one.

        Args:
            programs: Functions, by the name of the arm that each commands, or by another name.

        Raises:
            BaseException: The first failure, when all have ended; the others were cancelled, unless the group of the
                arm that failed lets them go on.
        """
        return PORTAL.run(
            lambda: self.asynchronous.run({name: in_thread(program) for name, program in programs.items()})
        )

    def barrier(self, name: str, *parties: str, timeout: float | None = None) -> None:
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
        PORTAL.run(lambda: self.asynchronous.barrier(name, *parties, timeout=timeout))

    def zone(self, name: str, *arms: str, timeout: float | None = None) -> AbstractContextManager[None]:
        """Holds a zone for the length of a block; no other thread does.

        Args:
            name: Of the zone.
            arms: Whose being in the zone is no hindrance. The arm of a program of `run`, and those that this thread has
                moved, need not be named.
            timeout: Seconds to wait for it.

        Raises:
            ValueError: There is no such zone.
            ZoneDeadlock: Its holder waits, in the end, for who asks.
            ZoneOccupied: An arm that has failed may be in it; or, in a `run`, one is that no program moves any more.
            ReplyTimeout: It was not free in time.
            MotionStopped: The fleet was stopped while this waited.
        """
        return BlockingContext(
            lambda: self.asynchronous.zone(name, *arms, timeout=timeout), twin_of, f"the zone {name}"
        )

    def holders(self, zone: str) -> list[str]:
        """Returns the names of those who hold a zone."""
        return PORTAL.look(lambda: self.asynchronous.holders(zone))

    @overload
    def together(
        self: Fleet[Magician], *names: str, timeout: float | None = None
    ) -> AbstractContextManager[Together[Batch]]: ...

    @overload
    def together(
        self: Fleet[MyCobot], *names: str, timeout: float | None = None
    ) -> AbstractContextManager[Together[CobotBatch]]: ...

    @overload
    def together(
        self: Fleet[UltraArm], *names: str, timeout: float | None = None
    ) -> AbstractContextManager[Together[UltraArmBatch]]: ...

    @overload
    def together(self, *names: str, timeout: float | None = None) -> AbstractContextManager[Together[Any]]: ...

    def together(self, *names: str, timeout: float | None = None) -> AbstractContextManager[Together[Any]]:
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
        return BlockingContext(lambda: self.asynchronous.together(*names, timeout=timeout), Together[Any], "together")
