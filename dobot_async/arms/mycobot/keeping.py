"""What keeps a myCobot in its workspace, as far as is known where its motions lead: by coordinates, not by joints.

A target is looked at before anything is sent if all of it is known by then; else, and once more with the way of a
straight motion, when its turn comes and the arm stands still.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from dobot_async._core.protocol.wire import Command
from dobot_async._core.queue.executor import Entry
from dobot_async._core.queue.keeper import Keeper
from dobot_async._core.util.workspace import Workspace
from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.channel import Channel
from dobot_async.arms.mycobot.targets import MOVE_PARTLY, PartOfMove

__all__ = ["CobotKeeper"]

Place = tuple[float | None, ...]
NOWHERE: Place = (None, None, None)


class CobotKeeper(Keeper[Place]):
    """See the module, and `Keeper`.

    Args:
        workspace: Where the tool may be.
        channel: The arm.
    """

    def __init__(self, workspace: Workspace, channel: Channel) -> None:
        super().__init__(workspace)
        self._channel = channel

    def concerns(self, entry: Entry) -> bool:
        """Return whether a command moves the arm."""
        return entry.command.moves

    async def look(self) -> Place:
        """Read where the arm stands."""
        coords = await self._channel.poll(c.GET_COORDS, None)
        return tuple(coords)[:3]

    async def follow(self, entry: Entry, start: Place) -> Place:
        """Return where a command leads; raise OutsideWorkspace if that is outside, or the way is."""
        return self.check(entry, start)

    def check(self, entry: Entry, start: Place = NOWHERE) -> Place:
        """Return where a command leads from a place, as far as that is known; raise OutsideWorkspace as `follow`."""
        lead = LEADS.get(entry.command)
        end = lead(entry.value, start) if lead else NOWHERE
        target, begin = whole(end), whole(start)
        if target and begin and getattr(entry.value, "mode", None) is c.MoveMode.LINEAR:
            self.workspace.check_way([begin, target])
        elif target:
            self.workspace.check_place(target)

        return end

    async def check_here(self, entry: Entry) -> None:
        """Raise OutsideWorkspace for a motion that leads outside from where the arm stands now."""
        if entry.command in LEADS:
            self.check(entry, await self.look())


def whole(place: Place) -> Sequence[float] | None:
    """A place, if all of it is known."""
    found = [each for each in place if each is not None]
    return found if len(found) == len(NOWHERE) else None


def point(value: c.ToMove, _: Place) -> Place:
    """All coordinates are given."""
    return tuple(value.coords[:3])


def part(value: PartOfMove, start: Place) -> Place:
    """Some are given, or all are told from the start."""
    pairs = zip(start, value.coords, strict=False)
    if value.relative:
        return tuple(None if here is None else here + (by or 0.0) for here, by in pairs)

    return tuple(here if given is None else given for here, given in pairs)


def coord(value: c.CoordMove, start: Place) -> Place:
    """One is given."""
    return tuple(value.value if value.axis == axis else here for axis, here in enumerate(start, 1))


def step(value: c.CoordStep, start: Place) -> Place:
    """One is told from the start."""
    by = [value.value if value.axis == axis else 0.0 for axis in (1, 2, 3)]
    return tuple(None if here is None else here + each for here, each in zip(start, by, strict=True))


LEADS: Mapping[Command[Any, Any], Callable[[Any, Place], Place]] = {
    c.SEND_COORDS: point,
    MOVE_PARTLY: part,
    c.SEND_COORD: coord,
    c.JOG_INCREMENT_COORD: step,
}
"""Where the motions lead that are given in coordinates."""
