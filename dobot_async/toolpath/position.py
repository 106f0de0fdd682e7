"""How far an arm is in a drawing: what was sent, what is done, and where it was stopped.

    pending   draw 11   draw 12   draw 13 ...     sent, and not known to be done
                 done  |--x                       a stop: the arm's index says 12, and it stands on the way 12

A stop ends all Motions, done or not, and how far the arm is was last asked half a second before: short strokes that
were done meanwhile would be drawn twice. A Magician tells it when it stands, by two things that have to agree: the
command that was ended, by its index, and the place. If they do not, what was known before is all that is known.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Awaitable, Callable, Iterable, Mapping
from typing import Any, NamedTuple

from dobot_async._core.queue.motion import Motion
from dobot_async.arms.magician import commands as m
from dobot_async.arms.magician.arm import Magician
from dobot_async.toolpath.moves import SAME, MoveKind, ToolpathMove
from dobot_async.toolpath.plane import Place

__all__ = ["DrawingStand", "Sent", "StrokePosition", "along", "stand_of"]

NEAR = 0.3  # mm by which an arm may stand beside the way on which it was stopped
LOOKS = 20
FINE = 10_000  # parts of a way that are told apart
PAUSE = 0.02  # seconds between two looks at an arm that comes to rest


class StrokePosition(NamedTuple):
    """Where to go on.

    Attributes:
        stroke: The first stroke that is not known to be done.
        point: How far in it, in points: 7.25 is a quarter of the way from point 7 to point 8.
    """

    stroke: int
    point: float = 0.0


class Sent(NamedTuple):
    """A command on its way.

    Attributes:
        motion: The command.
        move: The move that it is of, None for settings.
        start: Where the arm is before it.
        ends: Whether its stroke ends with it.
    """

    motion: Motion
    move: ToolpathMove | None
    start: Place
    ends: bool

    def passed(self, position: StrokePosition) -> StrokePosition:
        """Return the position when it is done."""
        if not self.move:
            return position

        if self.ends:
            return max(position, StrokePosition(self.move.stroke + 1))

        return (
            max(position, StrokePosition(self.move.stroke, self.move.point))
            if self.move.kind is MoveKind.DRAW
            else position
        )


class DrawingStand(NamedTuple):
    """Where an arm stands after a stop.

    Attributes:
        command: The index of what it was doing, or of the command before that: firmware may count either.
        place: mm.
    """

    command: int
    place: Place


async def of_magician(arm: Magician) -> DrawingStand | None:
    """Where a Magician stands; None if it does not come to rest."""
    before: Place | None = None
    for _ in range(LOOKS):
        pose = await arm.get_pose()
        place = pose.x, pose.y, pose.z
        if before and math.dist(before, place) < SAME:
            return DrawingStand(await arm.request(m.GET_QUEUED_CMD_CURRENT_INDEX, None), place)

        before = place
        await asyncio.sleep(PAUSE)

    return None


STANDS: Mapping[type, Callable[[Any], Awaitable[DrawingStand | None]]] = {Magician: of_magician}
"""The others do one motion at a time, and each is seen to be done before the next one is sent."""


async def stand_of(arm: object) -> DrawingStand | None:
    """Return where an arm stands, None for one that does not tell; it must have been stopped."""
    ask = next((ask for kind, ask in STANDS.items() if isinstance(arm, kind)), None)
    return await ask(arm) if ask else None


def along(pending: Iterable[Sent], stand: DrawingStand, position: StrokePosition) -> StrokePosition:
    """Return the position of an arm that was stopped: the one before if index and place do not agree.

    Args:
        pending: What was sent and is not known to be done, in order.
        stand: Where the arm stands.
        position: What was known before.
    """
    done = position
    for each in pending:
        index = each.motion.index
        if index is None or index > stand.command + 1:
            break

        if index >= stand.command and (share := share_of(each, stand.place)) is not None:
            return stopped_on(each, share, done)

        done = each.passed(done)

    return position


def stopped_on(sent: Sent, share: float, position: StrokePosition) -> StrokePosition:
    """The position of an arm that was stopped on a way, of which a share lies behind it."""
    move = sent.move
    if not move:
        return position

    if move.kind is MoveKind.LIFT or share >= 1:  # which begins when all of the stroke is drawn
        return sent.passed(position)

    if move.kind is not MoveKind.DRAW:
        return position

    # A way on which it had been stopped before begins there.
    start = max(position, StrokePosition(move.stroke, move.point - 1)).point
    return StrokePosition(move.stroke, math.floor((start + share * (move.point - start)) * FINE) / FINE)


def share_of(sent: Sent, place: Place) -> float | None:
    """How much of a way lies behind a place on it, 0 to 1; None for a place that is not on it."""
    end = sent.move.place if sent.move else sent.start
    if math.dist(place, end) < SAME:
        return 1.0

    way = tuple(b - a for a, b in zip(sent.start, end, strict=True))
    length = math.hypot(*way)
    if length < SAME:
        return 0.0 if math.dist(place, end) < NEAR else None

    share = sum(d * (p - a) for d, p, a in zip(way, place, sent.start, strict=True)) / length**2
    share = max(0.0, min(1.0, share))
    nearest = [a + share * d for a, d in zip(sent.start, way, strict=True)]
    return share if math.dist(nearest, place) < NEAR else None
