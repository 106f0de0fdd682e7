"""How an arm of the myCobot family follows a target: in fresh mode 1, where the newest motion wins.

SetFreshMode 1 --> SendCoords, or SendAngles; GetCoords ... --> the stop --> SetFreshMode as it was
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractAsyncContextManager
from functools import partial
from typing import SupportsFloat

from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.channel import SILENCE, Channel
from dobot_async.arms.mycobot.executor import CobotRunner, Tolerance
from dobot_async.arms.mycobot.pose import AXES
from dobot_async.arms.mycobot.queue import CobotQueue
from dobot_async.errors import CommandRejected
from dobot_async.following import MAX_SPEED, MAX_TURN, RATE, STALE, Follow, FollowStatus, TargetPoint, follow_target
from dobot_async.following.points import straight_way

__all__ = ["CobotFollowing"]

FASTEST = 100


class CobotFollowing:
    """Lets an arm of the myCobot family follow a target; to be called: `async with arm.following() as follow: ...`."""

    def __init__(
        self, channel: Channel, runner: CobotRunner, tolerance: Tolerance, queue: Callable[[], CobotQueue]
    ) -> None:
        self._channel = channel
        self._runner = runner
        self._tolerance = tolerance
        self._queue = queue

    def __call__(
        self,
        *,
        rate: SupportsFloat = RATE,
        max_speed: SupportsFloat = MAX_SPEED,
        max_turn: SupportsFloat = MAX_TURN,
        stale: SupportsFloat = STALE,
        speed: int = FASTEST,
    ) -> AbstractAsyncContextManager[Follow]:
        """Let the arm follow a target for the length of a block, and stop it at the end, as `stop` does.

        While it lasts the arm is in fresh mode 1. Commands that are queued are refused, and jogs; what is done at once,
        as the gripper, is not.

        Args:
            rate: Setpoints per second at the most, above 0 to 200; fewer where the line is slow.
            max_speed: mm/s at which the setpoint goes to the target, above 0.
            max_turn: The same of rx, ry, rz, and of joints: degrees/s.
            stale: Seconds after which the arm comes to rest if the target was not renewed.
            speed: Percent, 1 to 100, with which the arm goes to each setpoint.

        Raises:
            ValueError: A number is out of range.
            CommandRejected: Commands are pending; the arm is not powered; it stands although it is to go.
            ArmAlarm: A joint keeps the arm from moving; the message has the target.
            MotionStopped: A stop ended it.
            MotionUnknown: The arm is silent, or the link was lost.
            ConnectionLost: The link is gone.
        """
        strategy = CobotStrategy(self._channel, self._runner, self._tolerance, speed)
        return follow_target(
            self._channel.link,
            self._queue(),
            strategy,
            rate=rate,
            max_speed=max_speed,
            max_turn=max_turn,
            stale=stale,
        )


class CobotStrategy:
    """See `Strategy`."""

    turns = True
    replaces = True
    settle: float = 0.0
    check_every: float = 1.0

    def __init__(self, channel: Channel, runner: CobotRunner, tolerance: Tolerance, speed: int) -> None:
        self.axes: tuple[str, ...] = AXES[: len(channel.model.reach)]
        self.joints: int = channel.model.joints
        self.tolerance: tuple[float, float] = (tolerance[1], tolerance[0])
        self._channel = channel
        self._runner = runner
        self._speed = speed
        self._before: bool | None = None
        self._told = False
        runner.prepare(c.SEND_ANGLES, c.JointsMove((0.0,) * self.joints, speed))  # refuses a wrong speed

    def allow(self, point: TargetPoint) -> None:
        """Raise ValueError for a place that is beyond the model's limits."""
        model = self._channel.model
        check = model.check_joint if point.joints else model.check_coord
        for number, value in enumerate(point.numbers, 1):
            check(number, value)

    def way(self, start: TargetPoint, end: TargetPoint) -> Sequence[tuple[float, ...]]:
        """Return the ends of the way."""
        return straight_way(start, end)

    async def begin(self) -> None:
        """Let the newest motion win."""
        await self.check()
        if not await self._runner.is_powered():
            raise CommandRejected("the arm is not powered; await arm.power_on(), then wait half a second")

        self._before = await self._channel.poll_if_known(c.GET_FRESH_MODE, None)
        self._told = True
        await self._fresh(on=True)

    async def look(self, *, joints: bool) -> FollowStatus:
        """Read the coordinates, or the joints."""
        found = await self._channel.poll(c.GET_ANGLES if joints else c.GET_COORDS, None)
        return FollowStatus(TargetPoint(tuple(found), joints))

    def within(self, look: FollowStatus, point: TargetPoint) -> TargetPoint:  # noqa: ARG002 - such a motion can be replaced at any time
        """Return the place: a stop ends the way to it at once."""
        return point

    async def go(self, point: TargetPoint) -> bool:
        """Send the arm there. That it was not acknowledged says nothing: older firmware acknowledges none."""
        if point.joints:
            entry = self._runner.prepare(c.SEND_ANGLES, c.JointsMove(point.numbers, self._speed))
        else:
            value = c.ToMove(point.numbers, self._speed, c.MoveMode.ANGULAR)
            entry = self._runner.prepare(c.SEND_COORDS, value)

        await self._channel.send(entry.frame, entry.command)
        return True

    async def check(self) -> None:
        """Raise ArmAlarm if a joint keeps the arm from moving."""
        await self._runner.raise_joint_alarms()

    async def end(self) -> None:
        """Put the mode back; where the arm does not tell it, to the queue's order, in which it wakes up."""
        if self._told and self._before is not True:
            await self._fresh(on=False)

    async def _fresh(self, *, on: bool) -> None:
        """Set fresh mode."""
        tell = partial(self._channel.tell, c.SET_FRESH_MODE, on, timeout=SILENCE)
        await self._channel.through_outages(tell)
