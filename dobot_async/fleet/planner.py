"""Where an arm comes along: what the guard asks of a family, and the answer of those whose ways are not known.

    stance = await planner.look()            where it stands now
    plan = await planner.plan(value, stance)     where a motion leads, and where the arm stands then
    plan = planner.change(value, stance)         the same of what moves nothing, such as another end effector

Lengths are mm, in the arm's coordinates where it stands at l = 0 of its rail.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, NamedTuple, Protocol, Self, TypeVar

from dobot_async.arms.base import Arm
from dobot_async.fleet.frames import BaseFrame
from dobot_async.fleet.zones import Zones

__all__ = ["XYZ", "Discs", "Plan", "Planner", "Points", "Region", "Stance", "Unplanned"]

XYZ = tuple[float, float, float]


class Region(Protocol):
    """Where a tool may be."""

    @property
    def known(self) -> bool:
        """Whether the tool is known to be in each zone of it; else in any of them, or in none."""
        ...

    def zones(self, zones: Zones, base: BaseFrame, margin: float) -> frozenset[str]:
        """Return the zones that it touches, or comes nearer to than `margin` mm."""
        ...


@dataclass(frozen=True, slots=True)
class Points:
    """Places so near to each other that the margin covers what lies between.

    Attributes:
        places: The places.
        slack: mm by which the tool may be elsewhere.
    """

    places: Sequence[XYZ]
    slack: float = 0.0

    @property
    def known(self) -> bool:
        """True, for those of a stance: there is one."""
        return True

    def zones(self, zones: Zones, base: BaseFrame, margin: float) -> frozenset[str]:
        """Return the zones at the places."""
        found: set[str] = set()
        for place in self.places:
            x, y, z, _ = base.to_cell(*place)
            found |= zones.around(x, y, z, margin + self.slack)

        return frozenset(found)


@dataclass(frozen=True, slots=True)
class Discs:
    """All that is at most so far from some upright lines, at any height.

    Attributes:
        centres: x and y of each line.
        radius: mm; infinite for everywhere.
    """

    centres: Sequence[tuple[float, float]] = ((0.0, 0.0),)
    radius: float = math.inf

    @property
    def known(self) -> bool:
        """False."""
        return False

    def zones(self, zones: Zones, base: BaseFrame, margin: float) -> frozenset[str]:
        """Return the zones that they touch."""
        places = [base.to_cell(x, y, 0.0) for x, y in self.centres]
        return frozenset[str]().union(*(zones.near(place.x, place.y, self.radius + margin) for place in places))


class Stance(Protocol):
    """Where an arm stands, with all that its next way depends on."""

    @property
    def tool(self) -> XYZ:
        """The place of the tool."""
        ...

    @property
    def region(self) -> Region:
        """Where the tool may be, as far as that is known."""
        ...

    def near(self, other: Self) -> bool:
        """Return whether another one is the same, but for what numbers lose on the line."""
        ...


S = TypeVar("S", bound=Stance)


class Plan(NamedTuple, Generic[S]):
    """Where a command leads.

    Attributes:
        region: Where the tool comes along.
        end: Where the arm stands then; None if that is not known.
        outline: Places that limits have to contain for the way to be within them; None if not even its end is known,
            none for what limits do not concern.
        shift: mm by which it puts the tool elsewhere, wherever the arm stands then.
    """

    region: Region
    end: S | None
    outline: Sequence[XYZ] | None
    shift: float = 0.0


class Planner(Protocol[S]):
    """What a family knows of the ways of its arms."""

    @property
    def astray(self) -> bool:
        """Whether the arm has lost its place: it is elsewhere than it tells, until it was homed."""
        ...

    async def check(self) -> None:
        """Make sure that it is still the same run of the arm.

        Raises:
            MotionUnknown: It turns out to have been switched off and on; its queue was told.
        """

    async def look(self) -> S:
        """Read where the arm stands, and make sure that it is still the same run of the arm.

        Raises:
            MotionUnknown: It turns out to have been switched off and on; its queue was told.
        """
        ...

    async def tool(self) -> XYZ:
        """Read where its tool is, and nothing else."""
        ...

    async def plan(self, value: object, start: S | None) -> Plan[S]:
        """Return where a motion leads from a stance.

        Args:
            value: The command's parameters.
            start: The stance where it begins; None if that is not known.

        Raises:
            ValueError: It leads where the arm cannot go, or cannot be guarded.
        """
        ...

    def change(self, value: object, start: S | None) -> Plan[S] | None:
        """Return what a command does that moves nothing: where the tool is then; None if it changes no way."""
        ...

    def homes(self, value: object) -> bool:
        """Return whether an arm that has done this command knows its place."""
        ...

    def begun(self, value: object) -> object:
        """Take note that a command is on its way to the arm; return what `homed` needs, None if it does not home."""
        ...

    def homed(self, homing: object) -> None:
        """Take note that a homing is done, of which `begun` has returned this."""

    def settled(self, stance: S) -> None:
        """Take note that the arm has nothing to do, and how it was seen then."""

    def reach(self, stance: S | None) -> Region:
        """Return where the arm may come on ways that are not known."""
        ...


@dataclass(frozen=True, slots=True)
class Somewhere:
    """The stance of an arm whose ways are not known."""

    tool: XYZ

    @property
    def region(self) -> Region:
        """The place alone."""
        return Points([self.tool])

    def near(self, other: Somewhere) -> bool:
        """Return whether it is the same place."""
        return math.dist(self.tool, other.tool) < 1.0


class Unplanned:
    """The planner of arms whose ways are not known: each may lead anywhere.

    Args:
        arm: The arm.
        astray: Tells whether it is elsewhere than the arm says, for the arm has to be homed.
    """

    def __init__(self, arm: Arm, astray: Callable[[], bool]) -> None:
        self._arm = arm
        self._astray = astray

    @property
    def astray(self) -> bool:
        """Whether the arm has lost its place."""
        return self._astray()

    async def check(self) -> None:
        """Do nothing: these arms do not tell."""

    async def look(self) -> Somewhere:
        """Read where the arm stands."""
        return Somewhere(await self.tool())

    async def tool(self) -> XYZ:
        """Read where its tool is."""
        pose = await self._arm.get_pose()
        return pose.x, pose.y, pose.z

    async def plan(self, value: object, start: Somewhere | None) -> Plan[Somewhere]:  # noqa: ARG002 - no way is known
        """Return anywhere."""
        return Plan(Discs(), None, None)

    def change(self, value: object, start: Somewhere | None) -> None:
        """Return None: as no way is known, none changes."""

    def homes(self, value: object) -> bool:  # noqa: ARG002 - limits alone ask, and these arms have none
        """Return False."""
        return False

    def begun(self, value: object) -> None:
        """Do nothing."""

    def homed(self, homing: object) -> None:
        """Do nothing: the arm itself takes note of it."""

    def settled(self, stance: Somewhere) -> None:
        """Do nothing."""

    def reach(self, stance: Somewhere | None) -> Region:  # noqa: ARG002
        """Return everywhere."""
        return Discs()
