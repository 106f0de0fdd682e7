"""What keeps an ultraArm in its workspace, as far as is known where its motions lead: by coordinates, not by joints.

G0 and G1 are taken to be straight: no document says so, and none says otherwise. A way is looked at before anything is
sent if all of it is known by then, and in any case when its turn comes and the arm stands still.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, TypeGuard

from dobot_async._core.protocol.wire import Command
from dobot_async._core.queue.executor import Entry
from dobot_async._core.queue.keeper import Keeper
from dobot_async._core.util.workspace import Workspace
from dobot_async.arms.ultraarm import commands as c
from dobot_async.arms.ultraarm.goals import INCREMENTS

__all__ = ["Stand", "UltraArmKeeper"]

Place = tuple[float | None, float | None, float | None]
NOWHERE: Place = (None, None, None)
MODES = {c.ABSOLUTE: False, c.RELATIVE: True}
BY_COORDS = INCREMENTS | {c.MOVE_BY}


@dataclass(frozen=True, slots=True)
class Stand:
    """Where a way begins.

    Attributes:
        place: mm, None for what is not known.
        relative: Whether coordinates are increments (G91).
    """

    place: Place = NOWHERE
    relative: bool = False


class UltraArmKeeper(Keeper[Stand]):
    """See the module, and `Keeper`.

    Args:
        workspace: Where the tool may be.
        stand: Reads where the arm stands.
    """

    def __init__(self, workspace: Workspace, stand: Callable[[], Awaitable[Stand]]) -> None:
        super().__init__(workspace)
        self._stand = stand

    def concerns(self, entry: Entry) -> bool:
        """Return whether a command moves the arm, or changes what coordinates mean."""
        return entry.command.moves or entry.command in {*MODES, c.RELEASE}

    async def look(self) -> Stand:
        """Read where the arm stands."""
        return await self._stand()

    async def follow(self, entry: Entry, start: Stand) -> Stand:
        """Return where a command leads; raise OutsideWorkspace if that is outside, or the way is."""
        return self.lead(entry.command, entry.value, start)

    def lead(self, command: Command[Any, Any], value: Any, start: Stand) -> Stand:
        """Return where a command leads from a place, as far as that is known; raise ValueError as `follow`."""
        if command is c.SET_POSITION:
            raise ValueError(
                "with a workspace the arm's coordinates stay its own: set_position (G92) would give its place another "
                "name, and the workspace another place"
            )

        if command in MODES:
            return replace(start, relative=MODES[command])

        if command not in BY_COORDS:
            return replace(start, place=NOWHERE) if command.moves or command is c.RELEASE else start

        x, y, z = start.place
        to = partial(ahead, relative=start.relative or command is c.MOVE_BY)
        end = to(x, value.x), to(y, value.y), to(z, value.z)
        if known(end) and known(start.place):
            self.workspace.check_way([start.place, end])
        elif known(end):
            self.workspace.check_place(end)

        return replace(start, place=end)


def ahead(here: float | None, given: float | None, *, relative: bool) -> float | None:
    """Where an axis leads, as far as that is known."""
    if given is None:
        return here

    if relative:
        return None if here is None else here + given

    return given


def known(place: Place) -> TypeGuard[tuple[float, float, float]]:
    """Whether all of a place is."""
    return None not in place
