r"""How an ultraArm follows a target: one short G0 after the other, each sent when the arm rests, with nothing waiting.

    M9 ... \r --> at rest? --> G0 X.. Y.. Z.. F.. \r --> M9 ... \r

Nothing in its protocol replaces a motion, or ends one. So each is made so short, as its pace so far tells, that it is
over within a moment: then the arm rests soon after the end, and no stop has to take the power off its motors.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractAsyncContextManager
from typing import Any, SupportsFloat

from dobot_async._core.protocol.wire import Command
from dobot_async._core.util.arguments import to_float
from dobot_async.arms.ultraarm import commands as c
from dobot_async.arms.ultraarm.goals import AXES
from dobot_async.arms.ultraarm.queue import UltraArmQueue
from dobot_async.arms.ultraarm.runner import UltraArmRunner
from dobot_async.arms.ultraarm.status import STATUS_AND_ANGLES
from dobot_async.errors import CommandRejected, MotionUnknown
from dobot_async.following import (
    MAX_SPEED,
    MAX_TURN,
    RATE,
    STALE,
    Follow,
    FollowStatus,
    TargetPoint,
    follow_target,
    positive,
)
from dobot_async.following.points import apart, part_of_way, straight_way

__all__ = ["UltraArmFollowing"]

FIRST = 1.0  # mm or degrees of the first motion, of which nobody knows yet how long it takes
LEAST = 0.3  # of any
SHORT = 0.1  # seconds that each is to take, unless told otherwise
LONGEST = 2.0
SETTLE = 2.0  # times as long as a motion is to take: by then the last one has ended
SLOWEST, FASTEST = 1.0, 200.0  # F
GRAIN = 0.02


class UltraArmFollowing:
    """Lets an ultraArm follow a target; to be called: `async with arm.following() as follow: ...`."""

    def __init__(self, runner: UltraArmRunner, tolerance: float, queue: Callable[[], UltraArmQueue]) -> None:
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
        motion_time: SupportsFloat = SHORT,
        constant_speed: bool = False,
    ) -> AbstractAsyncContextManager[Follow]:
        """Let the arm follow a target for the length of a block; at its end the arm comes to rest.

        It goes in short motions of about `motion_time`, for nothing ends one: with ramps that is slow, a few mm/s to
        some tens.
        While it lasts commands are refused, those of the tools too, and jogs.

        Args:
            rate: Setpoints per second at the most, above 0 to 200; fewer where the line, or the arm, is slow.
            max_speed: mm/s, above 0; the arm's F is 1 to 200.
            max_turn: The same of e, and of joints: degrees/s.
            stale: Seconds after which the arm comes to rest if the target was not renewed.
            motion_time: Seconds that each motion is to take, above 0 to 2. With ramps the arm gets on faster the longer
                they are, and cuts corners more; after the block it goes on for so long, up to twice.
            constant_speed: Run without ramps (M16 S0), as the vendor's library does in programs, and put that back
                after it (M16 S2). What it does to single motions nobody has measured.

        Raises:
            ValueError: A number is out of range.
            CommandRejected: Commands are pending; the arm is not homed; it stands although it is to go.
            ArmAlarm: The arm tells of an error; the message has the target.
            MotionStopped: A stop ended it.
            MotionUnknown: The arm is silent, or the link was lost.
            ConnectionLost: The link is gone.
        """
        strategy = UltraArmStrategy(
            self._runner,
            self._tolerance,
            to_float(max_speed, "max_speed"),
            to_float(max_turn, "max_turn"),
            positive(motion_time, "motion_time", LONGEST),
            constant=bool(constant_speed),
        )
        return follow_target(
            self._runner.channel.link,
            self._queue(),
            strategy,
            rate=rate,
            max_speed=max_speed,
            max_turn=max_turn,
            stale=stale,
        )


class UltraArmStrategy:
    """See `Strategy`."""

    axes = AXES
    joints = 4
    turns = False
    replaces = False
    check_every: float = float("inf")  # each look tells errors

    def __init__(
        self, runner: UltraArmRunner, tolerance: float, mm: float, degrees: float, seconds: float, *, constant: bool
    ) -> None:
        self.tolerance: tuple[float, float] = (tolerance, tolerance)
        self.settle: float = SETTLE * seconds
        self._seconds = seconds
        self._runner = runner
        self._constant = constant
        self._told = False
        self._speeds = {False: min(max(mm, SLOWEST), FASTEST), True: min(max(degrees, SLOWEST), FASTEST)}
        self._length = FIRST
        self._here: TargetPoint | None = None
        self._sent: tuple[float, TargetPoint] | None = None

    def allow(self, point: TargetPoint) -> None:
        """Raise ValueError for a place that is beyond the limits."""
        self._runner.limits.check(command(point, None)[1])

    def way(self, start: TargetPoint, end: TargetPoint) -> Sequence[tuple[float, ...]]:
        """Return the ends of the way."""
        return straight_way(start, end)

    async def begin(self) -> None:
        """Let coordinates be places; raise CommandRejected if the arm cannot move."""
        runner = self._runner
        if runner.jogging:
            raise CommandRejected("a jog goes on: a following can begin when it has ended")

        runner.state.check(c.MOVE_COORDS)
        await runner.ask(c.ABSOLUTE, None)
        self._told = self._constant
        if self._constant:
            await runner.ask(c.SET_SPEED_MODE, c.ModeOfSpeed(c.SpeedMode.CONSTANT))

    async def look(self, *, joints: bool) -> FollowStatus:
        """Read whether the arm rests, and where; note how long the last motion has taken."""
        status = self._runner.status
        found = await status.poll_paced() if not joints else await status.poll(STATUS_AND_ANGLES)
        numbers = found.angles if joints else found.coords
        if len(numbers) < 3:
            raise MotionUnknown(f"the arm does not tell where it is: {numbers}")

        look = FollowStatus(TargetPoint((*numbers[:4], 0.0)[:4], joints), rests=found.at_rest and not found.queue_size)
        self._here = look.here
        if look.rests and self._sent:
            (sent_at, start), self._sent = self._sent, None
            length = apart(start, look.here) if start.joints == joints else 0.0
            if length > GRAIN:
                self._length = max(LEAST, self._seconds * length / (status.now() - sent_at))

        return look

    def within(self, look: FollowStatus, point: TargetPoint) -> TargetPoint:
        """Return how far the arm comes within a moment."""
        return part_of_way(look.here, point, self._length, self._length)

    async def go(self, point: TargetPoint) -> bool:
        """Send the arm there; return False if that was lost."""
        assert self._here
        row, value = command(point, self._speeds[point.joints], self._here)
        self._sent = self._runner.status.now(), self._here
        return await self._runner.channel.send(row, value) is not None

    async def check(self) -> None:
        """Do nothing: the arm has no alarms beside what each look tells."""

    async def end(self) -> None:
        """Let the arm use ramps again."""
        if self._told:
            await self._runner.ask(c.SET_SPEED_MODE, c.ModeOfSpeed(c.SpeedMode.RAMPED))


def command(point: TargetPoint, speed: float | None, here: TargetPoint | None = None) -> tuple[Command[Any, Any], Any]:
    """The command that leads to a place; the fourth axis is left out where it stays, for it may not be there."""
    a, b, d, last = point.numbers
    fourth = None if here is None or abs(here.numbers[3] - last) <= GRAIN else last
    if point.joints:
        return c.MOVE_JOINTS, c.JointsMove(a, b, d, fourth, speed)

    return c.MOVE_COORDS, c.CoordsMove(a, b, d, fourth, speed)
