"""Actions that move the tool: home, move, pick, place; and those of the hand: grip, recover."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, cast

from dobot_async.handling import pick, place
from dobot_async.handling.arms import move_straight, settle_time
from dobot_async.remote.actions import Note, Strict, Way, action
from dobot_async.remote.reports import pose_told
from dobot_async.remote.site import RemoteArm

__all__ = ["Grip", "Home", "Move", "Pick", "Place", "Recover"]

Spot = tuple[float, float, float]
Tool = Literal["suction", "gripper"]
HIGHEST = 300.0
"""mm above a place where the way down to it may begin."""


class Unseen(Strict):
    """An action of which a picture shows nothing: nobody knows the way, or there is none."""

    def ways(self, on: RemoteArm, start: Spot) -> list[Way]:
        """Return none."""
        del on, start
        return []


@action
@dataclass(frozen=True, kw_only=True)
class Home(Unseen):
    """Drive home, where the arm finds its place."""

    do: Literal["home"] = "home"

    def check(self, on: RemoteArm) -> None:
        """Any arm can do it."""

    async def run(self, on: RemoteArm, note: Note) -> dict[str, Any]:
        """Do it."""
        note("driving home")
        await on.arm.home(**on.traits.home(on.fastest))
        return await reached(on, self.do)


@action
@dataclass(frozen=True, kw_only=True)
class Move(Strict):
    """Move the tool to a point; what is not given stays."""

    x: float | None = None
    y: float | None = None
    z: float | None = None
    r: float | None = None
    straight: bool = False
    speed: float | None = None
    do: Literal["move"] = "move"

    def check(self, on: RemoteArm) -> None:
        """Check what is given; the rest is looked at when the arm has told where it stands."""
        on.check_speed(self.speed)
        given = [each for each in (self.x, self.y, self.z) if each is not None]
        if not given and self.r is None:
            raise ValueError("move needs x, y, z or r")

        if self.r is not None and not on.traits.turns:
            raise ValueError(f"r: the hand of a {on.traits.title} is not turned so")

        if self.x is not None and self.y is not None and self.z is not None:
            on.check_spot((self.x, self.y, self.z))

    def ways(self, on: RemoteArm, start: Spot) -> list[Way]:
        """To the target."""
        end = self.target(start)
        on.check_spot(end)
        if self.straight:
            on.check_straight(start, end)

        return [(start, end)]

    async def run(self, on: RemoteArm, note: Note) -> dict[str, Any]:
        """Do it."""
        note("moving")
        percent = on.check_speed(self.speed)
        pose = await on.arm.get_pose()
        start = pose.x, pose.y, pose.z
        end = self.target(start)
        on.check_spot(end)
        await on.traits.pace(on.arm, percent)
        options, arm = dict(on.traits.moves(percent)), cast(Any, on.arm)
        if self.straight:
            await move_straight(arm, self.whole(on, end, pose), **options)
        else:
            await arm.move_to(*end, **options, **({} if self.r is None else {"r": self.r}))

        return await reached(on, self.do)

    def target(self, start: Spot) -> Spot:
        """Where it ends."""
        x, y, z = (
            here if given is None else given for given, here in zip((self.x, self.y, self.z), start, strict=True)
        )
        return x, y, z

    def whole(self, on: RemoteArm, end: Spot, pose: Any) -> Any:
        """The target of a straight way: of an arm that turns its tool, with its rotation."""
        if not on.traits.turns:
            return end

        return type(pose)(*end, pose.r if self.r is None else self.r, *pose.joints)


@dataclass(frozen=True, kw_only=True)
class PickOrPlace(Strict):
    """What picking and placing have in common."""

    x: float
    y: float
    z: float
    tool: Tool = "suction"
    approach: float = 40.0
    speed: float | None = None

    def check(self, on: RemoteArm) -> None:
        """The place, what is above it, and the tool."""
        on.check_speed(self.speed)
        if self.tool not in on.traits.tools:
            raise ValueError(f"tool: a {on.traits.title} has {' and '.join(on.traits.tools)}, not {self.tool}")

        if not 0 < self.approach <= HIGHEST:
            raise ValueError(f"approach must be above 0 and at most {HIGHEST:g} mm, not {self.approach!r}")

        on.check_spot(self.spot, "the place")
        on.check_spot(self.above, "the point above the place")
        on.check_straight(self.above, self.spot)

    def ways(self, on: RemoteArm, start: Spot) -> list[Way]:
        """Above the place, down, and up again."""
        self.check(on)
        return [(start, self.above), (self.above, self.spot), (self.spot, self.above)]

    @property
    def spot(self) -> Spot:
        """The place."""
        return self.x, self.y, self.z

    @property
    def above(self) -> Spot:
        """Where it begins and ends."""
        return self.x, self.y, self.z + self.approach


@action
@dataclass(frozen=True, kw_only=True)
class Pick(PickOrPlace):
    """Pick a part up."""

    do: Literal["pick"] = "pick"

    async def run(self, on: RemoteArm, note: Note) -> dict[str, Any]:
        """Do it."""
        note("picking")
        percent = on.check_speed(self.speed)
        await on.traits.pace(on.arm, percent)
        await pick(on.arm, self.spot, tool=self.tool, approach=self.approach, **on.traits.moves(percent))
        return await reached(on, self.do)


@action
@dataclass(frozen=True, kw_only=True)
class Place(PickOrPlace):
    """Put down what the tool holds."""

    do: Literal["place"] = "place"

    async def run(self, on: RemoteArm, note: Note) -> dict[str, Any]:
        """Do it."""
        note("placing")
        percent = on.check_speed(self.speed)
        await on.traits.pace(on.arm, percent)
        await place(on.arm, self.spot, tool=self.tool, approach=self.approach, **on.traits.moves(percent))
        return await reached(on, self.do)


@action
@dataclass(frozen=True, kw_only=True)
class Grip(Unseen):
    """Let the tool hold, or let go."""

    hold: bool
    tool: Tool = "suction"
    do: Literal["grip"] = "grip"

    def check(self, on: RemoteArm) -> None:
        """Whether the arm has the tool."""
        if self.tool not in on.traits.tools:
            raise ValueError(f"tool: a {on.traits.title} has {' and '.join(on.traits.tools)}, not {self.tool}")

    async def run(self, on: RemoteArm, note: Note) -> dict[str, Any]:
        """Do it."""
        note("gripping" if self.hold else "letting go")
        await (on.arm.suction(self.hold) if self.tool == "suction" else on.arm.gripper(self.hold))
        if seconds := settle_time(on.arm, self.tool):
            await on.arm.wait(seconds)

        return {"done": self.do, "tool": self.tool, "hold": self.hold}


@action
@dataclass(frozen=True, kw_only=True)
class Recover(Unseen):
    """Clear the alarms, and let the arm take new commands; it does not move."""

    do: Literal["recover"] = "recover"

    def check(self, on: RemoteArm) -> None:
        """Any arm can do it."""

    async def run(self, on: RemoteArm, note: Note) -> dict[str, Any]:
        """Do it."""
        note("clearing the alarms")
        await on.recover()
        return {"done": self.do}


async def reached(on: RemoteArm, what: str) -> dict[str, Any]:
    """What is said of a motion: that it is done, and where the arm is."""
    return {"done": what, "pose": pose_told(await on.arm.get_pose())}
