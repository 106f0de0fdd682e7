"""Which arms there are, and within which limits others may move them; connected for the length of a block."""

from __future__ import annotations

import math
from collections.abc import AsyncGenerator, Awaitable, Callable, Iterator, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass, field, replace
from typing import Any

from dobot_async._core.util.arguments import to_float
from dobot_async._core.util.workspace import Workspace
from dobot_async.arms.base import Arm
from dobot_async.fleet.cell import Cell
from dobot_async.fleet.fleet import Fleet
from dobot_async.fleet.frames import BaseFrame
from dobot_async.fleet.member import Member
from dobot_async.remote.family_traits import FamilyTraits, traits_of
from dobot_async.toolpath import reach_of

__all__ = ["SPEED", "RemoteArm", "Site", "open_site"]

SPEED = 50.0
"""Percent of its speed that an arm has at the most, unless that is said."""

Spot = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class RemoteArm:
    """One arm, with what others may do to it.

    Attributes:
        name: What it is called.
        arm: The arm.
        traits: Its family's.
        fastest: Percent of its speed, at the most.
        workspace: Where its tool may be; None is wherever it reaches.
        base: Where it stands in its cell, None for one that stands in none.
        recover: Makes it ready again after an alarm.
    """

    name: str
    arm: Arm
    traits: FamilyTraits
    fastest: float
    workspace: Workspace | None
    base: BaseFrame | None
    recover: Callable[[], Awaitable[None]]

    def check_speed(self, percent: float | None) -> float:
        """Return a speed in percent, the fastest one for None; raise ValueError for one that is not allowed."""
        if percent is None:
            return self.fastest

        if not 0 < to_float(percent, "speed") <= self.fastest:
            raise ValueError(f"speed must be above 0 and at most {self.fastest:g} percent here, not {percent!r}")

        return float(percent)

    def check_spot(self, spot: Spot, what: str = "the target") -> None:
        """Raise ValueError, with the reason, for a place where the tool cannot go, or may not.

        Args:
            spot: x, y, z, mm.
            what: What it is.
        """
        if not all(map(math.isfinite, spot)):
            raise ValueError(f"{what} must be finite mm, not {spot}")

        if self.workspace:
            self.workspace.check_place(spot, what)

        reach_of(self.arm)(spot)

    def allows(self, spot: Spot) -> bool:
        """Return whether the tool may go to a place, mm."""
        try:
            self.check_spot(spot)
        except ValueError:
            return False

        return True

    def check_straight(self, start: Spot, end: Spot) -> None:
        """Raise OutsideWorkspace for a straight way that leads out of the workspace, mm."""
        if self.workspace:
            self.workspace.check_way([start, end])


@dataclass(frozen=True, slots=True)
class Site:
    """All arms.

    Attributes:
        arms: By their names.
        moves: Whether others may move them.
        zones: Of a cell: what only one arm at a time may be in.
    """

    arms: Mapping[str, RemoteArm]
    moves: bool
    zones: Mapping[str, Any] = field(default_factory=dict[str, Any])

    def __iter__(self) -> Iterator[RemoteArm]:
        return iter(self.arms.values())

    def named(self, name: str | None) -> RemoteArm:
        """Return the arm of a name, or the only one for None; raise ValueError if there is no such arm."""
        if name is None and len(self.arms) == 1:
            return next(iter(self.arms.values()))

        if name is None or name not in self.arms:
            raise ValueError(f"which arm? There are: {', '.join(self.arms)}")

        return self.arms[name]


@asynccontextmanager
async def open_site(
    where: Cell | Member[Any],
    *,
    name: str = "arm",
    allow_motion: bool = False,
    speed: float = SPEED,
    workspace: Workspace | None = None,
) -> AsyncGenerator[Site]:
    """Connect to an arm, or to those of a cell, for the length of a block.

    Without `allow_motion` the connections only read: nothing that is sent by them can move an arm.

    Args:
        where: The cell, or one arm.
        name: What the one arm is called.
        allow_motion: Whether others may move the arms.
        speed: Percent of their speeds, at the most, above 0 and up to 100.
        workspace: Where the tools may be, in mm and each arm's own coordinates; a cell's `limits` hold besides.

    Raises:
        ValueError: An argument is wrong.
        ConnectFailed: An arm does not answer.
    """
    if not 0 < to_float(speed, "speed") <= 100:
        raise ValueError(f"speed must be above 0 and at most 100 percent, not {speed!r}")

    members: Mapping[str, Member[Any]] = where.members if isinstance(where, Cell) else {name: where}
    options: dict[str, Any] = {"control": allow_motion, "reconnect": True, "queue": "fresh" if allow_motion else "keep"}
    if workspace and allow_motion:
        options["workspace"] = workspace

    limited = {
        each: replace(member, options={**traits_of(member.kind).options, **member.options, **options})
        for each, member in members.items()
    }

    def known(each: str, arm: Arm, recover: Callable[[], Awaitable[None]]) -> RemoteArm:
        base = members[each].base if isinstance(where, Cell) else None
        return RemoteArm(each, arm, traits_of(type(arm)), float(speed), workspace, base, recover)

    if not isinstance(where, Cell):
        async with limited[name].kind.connect(where.url, **limited[name].options) as arm:
            yield Site({name: known(name, arm, arm.recover)}, allow_motion)

        return

    async with Fleet.connect(limited, zones=where.zones, groups=where.groups) as fleet:
        arms = {each: known(each, fleet[each], fleet.recover) for each in fleet}
        yield Site(arms, allow_motion, where.zones)
