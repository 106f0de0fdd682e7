"""Targets of which a part is given, and what else is a command on this side only.

    move_to(z=120)        MOVE_PARTLY    what is not given stays as it is
    move_by(x=10)         MOVE_PARTLY    all is told from where the arm is
    wait(0.5)             WAIT
    suction(True)         SUCTION        refused: these arms have none

Such a target is made whole when its turn comes, for the queue is on this side: from the target of the motion right
before it, if that was queued before it was done and gave all coordinates; else from where the arm stands then.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, SupportsFloat

from dobot_async._core.protocol.layouts import NOTHING
from dobot_async._core.protocol.wire import Command, Queueing
from dobot_async._core.util.arguments import check_duration, to_float
from dobot_async.arms.mycobot.params import Coords, MoveMode
from dobot_async.arms.mycobot.pose import AXES, CobotPose
from dobot_async.errors import UnsupportedError

__all__ = ["MOVE_PARTLY", "SUCTION", "WAIT", "PartOfMove", "coordinates"]

Given = tuple[float | None, ...]


@dataclass(frozen=True, slots=True)
class PartOfMove:
    """A motion of the tool.

    Attributes:
        coords: Of each axis, None for one that stays as it is.
        speed: Percent.
        mode: How the tool gets there.
        relative: Whether the coordinates are told from where the arm is.
    """

    coords: Given
    speed: int
    mode: MoveMode | None
    relative: bool = False

    def filled(self, start: Sequence[float]) -> tuple[float, ...]:
        """Return all coordinates of the target, seen from a start."""
        if self.relative:
            found = [here + (step or 0.0) for here, step in zip(start, self.coords, strict=True)]
        else:
            found = [here if wanted is None else wanted for here, wanted in zip(start, self.coords, strict=True)]

        return (*found[:3], *(angle if abs(angle) <= 180 else math.remainder(angle, 360) for angle in found[3:]))


class OnThisSide:
    """The layout of what is on no wire: nothing."""

    def encode(self, value: Any) -> bytes:  # noqa: ARG002 - it was checked
        """Return nothing."""
        return b""

    def decode(self, data: bytes) -> Any:
        """Is never called."""
        raise NotImplementedError


class Seconds(OnThisSide):
    """A time."""

    def encode(self, value: SupportsFloat) -> bytes:
        """Check it, and return nothing."""
        check_duration(value)
        return b""


class Lacking(OnThisSide):
    """What an arm does not have; the value is what the arm is called."""

    def encode(self, value: str) -> bytes:
        """Raise UnsupportedError."""
        raise UnsupportedError(f"a {value} has no suction of its own; a pump at a pin is switched with set_pin()")


def on_this_side(name: str, layout: OnThisSide, *, moves: bool) -> Command[Any, None]:
    """A command that the arm does not have."""
    return Command(
        name, -1, layout, NOTHING, "on this side", write=True, queueing=Queueing.ALWAYS, repeatable=False, moves=moves
    )


WAIT: Command[float, None] = on_this_side("Wait", Seconds(), moves=False)
"""The queue on this side holds for so many seconds."""

SUCTION: Command[str, None] = on_this_side("Suction", Lacking(), moves=False)
"""Is refused wherever it is put."""

MOVE_PARTLY: Command[PartOfMove, None] = on_this_side("SendCoords", OnThisSide(), moves=True)
"""It becomes a SendCoords with all coordinates when its turn comes."""


def coordinates(count: int, title: str, **given: SupportsFloat | None) -> Given:
    """Return the coordinates of an arm that has so many, of what was given by the names of the axes.

    Raises:
        ValueError: One is not finite, or of an axis that the arm does not have.
        TypeError: One is no number.
    """
    for axis in AXES[count:]:
        if given[axis] is not None:
            raise ValueError(f"{axis}: a {title} has {', '.join(AXES[:count])} only")

    found: list[float | None] = []
    for axis in AXES[:count]:
        value = given[axis]
        number = None if value is None else to_float(value, axis)
        if number is not None and not math.isfinite(number):
            raise ValueError(f"{axis} must be finite, not {value!r}")

        found.append(number)

    return tuple(found)


def of_pose(pose: CobotPose | Coords) -> dict[str, float]:
    """The coordinates of a pose, by the names of the axes."""
    return {axis: getattr(pose, axis) for axis in AXES}
