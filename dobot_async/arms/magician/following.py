"""How a Magician follows a target: each setpoint is a point-to-point motion in place of the one that goes on.

replace:  SetPTPCmd, immediate                       takes the place of what goes on; see docs/manual-vs-arm.md
clear:    QueuedCmdClear, Start, SetPTPCmd, queued   for firmware that does not do that
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import AbstractAsyncContextManager
from typing import Any, Literal, SupportsFloat

from dobot_async._core.link.link import Link
from dobot_async._core.queue.executor import alarmed
from dobot_async._core.queue.motion import Motion, MotionOutbox
from dobot_async._core.util.arguments import check_choice
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.executor import MagicianExecutor
from dobot_async.arms.magician.frame import Frame
from dobot_async.arms.magician.queue import MagicianQueue
from dobot_async.arms.magician.status import SILENCE
from dobot_async.following import MAX_SPEED, MAX_TURN, RATE, STALE, Follow, FollowStatus, TargetPoint, follow_target
from dobot_async.following.points import way_along

__all__ = ["MagicianFollowing"]

Way = Literal["replace", "clear"]
MODES = {False: c.PTPMode.MOVJ_XYZ, True: c.PTPMode.MOVJ_ANGLE}
STRAIGHT = {**MODES, False: c.PTPMode.MOVL_XYZ}
STEP = 2.0  # degrees between two places of a way in joints


class MagicianFollowing:
    """Lets a Magician follow a target; to be called: `async with arm.following() as follow: ...`."""

    def __init__(self, link: Link[Frame], executor: MagicianExecutor, queue: Callable[[], MagicianQueue]) -> None:
        self._link = link
        self._executor = executor
        self._queue = queue

    def __call__(
        self,
        *,
        rate: SupportsFloat = RATE,
        max_speed: SupportsFloat = MAX_SPEED,
        max_turn: SupportsFloat = MAX_TURN,
        stale: SupportsFloat = STALE,
        way: Way = "replace",
    ) -> AbstractAsyncContextManager[Follow]:
        """Let the arm follow a target for the length of a block, and stop it at the end, as `stop` does.

        While it lasts commands that are queued are refused, and jogs; what is done at once, as the tools, is not. How
        fast the arm catches up with the target, `set_speed` says: more acceleration is less lag.

        Args:
            rate: Setpoints per second at the most, above 0 to 200; fewer where the line is slow.
            max_speed: mm/s at which the setpoint goes to the target, above 0.
            max_turn: The same of r, and of joints: degrees/s.
            stale: Seconds after which the arm comes to rest if the target was not renewed.
            way: "replace" sends immediate motions, each in place of the one before; "clear" empties the queue and
                queues the next one, for firmware that does not do that.

        Raises:
            ValueError: A number is out of range.
            CommandRejected: Commands are pending; the arm stands although it is to go.
            ArmAlarm: The arm raised alarms; the message has the target.
            MotionStopped: A stop ended it.
            MotionUnknown: The arm is silent, the link was lost, or the arm was switched off and on.
            ConnectionLost: The link is gone.
        """
        check_choice("way", way, "replace", "clear")
        queue = self._queue()
        strategy = MagicianStrategy(self._link, self._executor, queue, way)
        return follow_target(
            self._link, queue, strategy, rate=rate, max_speed=max_speed, max_turn=max_turn, stale=stale
        )


class MagicianStrategy:
    """See `Strategy`."""

    axes: tuple[Literal["x"], Literal["y"], Literal["z"], Literal["r"]] = ("x", "y", "z", "r")
    joints = 4
    turns = False
    replaces = True
    settle: float = 0.0
    tolerance: tuple[float, float] = (0.5, 0.5)
    check_every: float = 0.25

    def __init__(self, link: Link[Frame], executor: MagicianExecutor, queue: MagicianQueue, way: Way) -> None:
        self._link = link
        self._executor = executor
        self._queue = queue
        self._go = self._replace if way == "replace" else self._clear_and_go
        self._modes = MODES if queue.bounds is None else STRAIGHT  # ways that are looked at are straight

    def allow(self, point: TargetPoint) -> None:
        """Raise Unreachable, with the reason, for a place where the arm cannot go."""
        kinematics = self._queue.kinematics
        if point.joints:
            kinematics.check_joints(*point.numbers)
        else:
            kinematics.check(*point.numbers)

    def way(self, start: TargetPoint, end: TargetPoint) -> Sequence[tuple[float, ...]]:
        """Return places on the way: the joints turn evenly, coordinates go straight."""
        if not end.joints:
            return start.numbers[:3], end.numbers[:3]

        forward = self._queue.kinematics.forward
        count = max(1, math.ceil(way_along(start, end)[1] / STEP))
        return [
            forward(*(a + (b - a) * step / count for a, b in zip(start.numbers, end.numbers, strict=True)))[:3]
            for step in range(count + 1)
        ]

    async def begin(self) -> None:
        """Note the arm's clock, by which it shows that it was switched off; raise ArmAlarm if it cannot move."""
        await self._executor.status.remember()
        await self.check()

    async def look(self, *, joints: bool) -> FollowStatus:
        """Read the pose. Manual 2.4.1."""
        pose = await self._executor.status.ask(c.GET_POSE)
        numbers = pose.joints if joints else (pose.x, pose.y, pose.z, pose.r)
        return FollowStatus(TargetPoint(tuple(numbers), joints))

    def within(self, look: FollowStatus, point: TargetPoint) -> TargetPoint:  # noqa: ARG002 - such a motion can be replaced at any time
        """Return the place: a stop ends the way to it at once."""
        return point

    async def go(self, point: TargetPoint) -> bool:
        """Send the arm there. Manual 2.11.5."""
        x, y, z, r = point.numbers
        return await self._go(c.PTPCmd(self._modes[point.joints], x, y, z, r))

    async def check(self) -> None:
        """Raise ArmAlarm for alarms, and MotionUnknown if the arm was switched off and on."""
        if alarms := await self._executor.alarms():
            raise alarmed(alarms)

        await self._executor.status.check_run()

    async def end(self) -> None:
        """Do nothing: nothing was changed."""

    async def _replace(self, value: c.PTPCmd) -> bool:
        """Send it in place of what goes on; return False if it was lost."""
        async with self._link.slot(c.SET_PTP_CMD.name, SILENCE):
            request = await self._link.send(self._link.frame(c.SET_PTP_CMD, value), acknowledged, timeout=SILENCE)
            return await self._link.settle(request, SILENCE)

    async def _clear_and_go(self, value: c.PTPCmd) -> bool:
        """Throw away what goes on, and queue it."""
        await self._executor.clear()
        outbox = MotionOutbox(lambda _: None)
        outbox.add([Motion(self._queue, self._executor.prepare(c.SET_PTP_CMD, value))])
        await self._executor.submit(outbox)
        return True


def acknowledged(_: Any) -> None:
    """Take any answer for the acknowledgement: it says no more."""
