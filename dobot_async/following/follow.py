"""What a user holds while an arm follows a target, and the loop that leads the arm.

    target --allow--> setpoint, at most max_speed further each time --> due? --> strategy.go
                          ^                                               ^
                          `--------- strategy.look: where is it ----------'

1. The newest target wins, and none is sent twice; one that is older than `stale` seconds is not followed any more.
2. A setpoint that takes the place of another is sent when the arm is past the middle of its way, where it begins to
   brake, or when the target lies behind it. Arms that begin each motion from rest would never get going otherwise.
3. One setpoint is out at a time, so that a slow line is never full of old ones; for one that was lost the one goes out
   that is due by then.
4. An arm that stands although it is to go is told once more, and is an error after a while.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

from dobot_async._core.queue.motion import Motion
from dobot_async.errors import CommandRejected, MotionStopped, MotionUnknown, another
from dobot_async.following.boundary import Boundary
from dobot_async.following.points import (
    GRAIN,
    TargetPoint,
    apart,
    nearer_than,
    part_of_way,
    read_point,
    turns_back,
)
from dobot_async.following.strategy import FollowLimits, FollowStatus, Strategy
from dobot_async.following.trajectory import Trajectory

__all__ = ["Follow"]

AGAIN = 0.15  # seconds after which an arm that stands is told once more where to go
PATIENCE = 1.5  # seconds of standing elsewhere after which an arm does not follow
STEPS = 3.0  # intervals of `rate` by which a setpoint moves on at the most, however late it is


class Follow:
    """The arm follows `target` for the length of the block of `arm.following()`.

    Attributes:
        motion: All of it as one Motion: done when the block has ended well, and failed as soon as the following has.
        sent: How many setpoints were sent.
    """

    def __init__(
        self, strategy: Strategy, motion: Motion, pace: FollowLimits, boundary: Boundary, outages: Callable[[], int]
    ) -> None:
        self.motion = motion
        self.sent: int = 0
        self._strategy = strategy
        self._boundary = boundary
        self._pace = pace
        self._outages = outages  # returns how often the link was lost
        self._now = asyncio.get_running_loop().time
        self._target: TargetPoint | None = None
        self._renewed_at = -math.inf
        self._stirred = asyncio.Event()
        self._began = asyncio.Event()
        self._closing = False
        self._here: dict[bool, TargetPoint] = {}
        self._moved_at = self._checked_at = -math.inf
        self._setpoint: TargetPoint | None = None
        self._moved_on_at = 0.0
        self._sent_from: TargetPoint | None = None
        self._sent_to: TargetPoint | None = None

    @property
    def target(self) -> TargetPoint | None:
        """The newest target. Set it, again and again, to a pose, or to numbers: x, y, z (mm) and angles (degrees).

        Angles that are not given stay as they are. What is set counts for `stale` seconds, also if it is the same.

        Raises:
            ValueError: It is beyond the limits, out of reach, or outside of the workspace, or the straight way to it
                is; the one before stays.
            TypeError: It is neither a pose nor numbers.
            DobotError: The following has failed, or was stopped.
        """
        return self._target

    @target.setter
    def target(self, target: Any) -> None:
        self._renew(self._checked(target))

    @property
    def joints(self) -> tuple[float, ...] | None:
        """The newest target, if it is in joints. Set it to one angle for each joint, degrees; see `target`."""
        return self._target.numbers if self._target and self._target.joints else None

    @joints.setter
    def joints(self, angles: Any) -> None:
        self._renew(self._checked(angles, joints=True))

    @property
    def here(self) -> TargetPoint | None:
        """Where the arm was when it was last looked at, in coordinates."""
        return self._here.get(False)

    async def play(self, points: Iterable[tuple[float, Any]], *, joints: bool = False) -> None:
        """Follow a trajectory; return when the arm is at its end.

        The arm goes to the first point before the time begins to run. Between two points the target goes straight.

        Args:
            points: Pairs of seconds, growing, and a target as for `target`: all points are checked first.
            joints: The targets are joints, degrees.

        Raises:
            ValueError: A point is not allowed, or a way needs more than `max_speed`; the message has its number.
            DobotError: The following has failed, or was stopped.
        """
        read = partial(self._read, joints=joints)
        pace = self._pace
        trajectory = Trajectory(
            points, read, self._boundary.check, mm=pace.mm, degrees=pace.degrees, turns=self._strategy.turns
        )
        self._boundary.check(self._start(joints=joints), trajectory.first)
        await self._reach(trajectory.first)
        began = self._now()
        while (elapsed := self._now() - began) < trajectory.seconds:
            self._renew(trajectory.at(elapsed))
            await asyncio.sleep(1 / pace.rate)

        await self._reach(trajectory.last)

    async def reach(self, target: Any, *, joints: bool = False) -> None:
        """Set a target, and return when the arm is there.

        Args:
            target: As for `target`.
            joints: It is in joints, degrees.

        Raises:
            ValueError: It is beyond the limits, or out of reach.
            DobotError: The following has failed, or was stopped.
        """
        await self._reach(self._checked(target, joints=joints))

    async def run(self) -> None:
        """Lead the arm until `close`; for the block.

        Raises:
            DobotError: The arm does not follow, or cannot be seen any more.
        """
        await self._strategy.begin()
        self._checked_at = self._now()
        self._outages_before = self._outages()
        self._seen(look := await self._strategy.look(joints=False))
        self._boundary.begin(look.here)
        self._began.set()
        while not self._closing:
            began = self._now()
            if self._target is None or began > self._renewed_at + self._pace.stale:
                self._setpoint = None
                self._stirred.clear()
                await self._stirred.wait()
                continue

            await self._lead(self._target)
            await asyncio.sleep(max(began + 1 / self._pace.rate - self._now(), 0.0))

        if not self._strategy.replaces:
            await self._settle()

    async def begun(self, leading: asyncio.Task[None]) -> None:
        """Return when the arm is ready to be led; raise what the leading task has failed with before."""
        began = asyncio.ensure_future(self._began.wait())
        try:
            await asyncio.wait({began, leading}, return_when=asyncio.FIRST_COMPLETED)
        finally:
            began.cancel()

        self.check()

    def close(self) -> None:
        """Lead the arm no further."""
        self._closing = True
        self._stirred.set()

    def check(self) -> None:
        """Raise what has ended the following."""
        if self.motion.ended:
            failure = self.motion.exception()
            raise another(failure) if failure else MotionStopped("the block of the following has ended")

    def _read(self, target: Any, *, joints: bool = False) -> TargetPoint:
        """The checked place of a target."""
        self.check()
        before = self._target or self.here
        point = read_point(target, self._strategy.axes, self._strategy.joints, before, as_joints=joints)
        self._strategy.allow(point)
        return point

    def _checked(self, target: Any, *, joints: bool = False) -> TargetPoint:
        """The place of a target to which the straight way is allowed, too."""
        point = self._read(target, joints=joints)
        self._boundary.check(self._start(joints=joints), point)
        return point

    def _start(self, *, joints: bool) -> TargetPoint | None:
        """Where the way to the next target begins."""
        setpoint = self._setpoint
        return setpoint if setpoint and setpoint.joints == joints else self._here.get(joints)

    def _renew(self, point: TargetPoint) -> None:
        """Follow a checked target from now on."""
        self.check()
        self._target, self._renewed_at = point, self._now()
        self._stirred.set()

    async def _reach(self, point: TargetPoint) -> None:
        """Follow a target until the arm is there."""
        while True:
            self._renew(point)
            here, sent = self._here.get(point.joints), self._sent_to
            same = sent and sent.joints == point.joints and apart(sent, point, turns=self._strategy.turns) <= GRAIN
            if (same or sent is None) and here and self._is_at(here, point):
                return

            await asyncio.sleep(1 / self._pace.rate)

    async def _lead(self, target: TargetPoint) -> None:
        """Look where the arm is, and send it on if that is due."""
        strategy, pace = self._strategy, self._pace
        look = await strategy.look(joints=target.joints)
        if self._outages() != self._outages_before:
            raise MotionUnknown("the link was lost, and nothing tells whether the arm was switched off meanwhile")

        now = self._now()
        if self._setpoint is None or self._setpoint.joints != target.joints:
            self._setpoint, self._moved_on_at, self._moved_at = look.here, now - 1 / pace.rate, now
            self._sent_to = None

        self._seen(look)
        self._boundary.watch(look.here)
        elapsed = min(now - self._moved_on_at, STEPS / pace.rate)
        reached = part_of_way(self._setpoint, target, pace.mm * elapsed, pace.degrees * elapsed, turns=strategy.turns)
        setpoint = strategy.within(look, reached)
        # A setpoint that is led round a corner waits there for the arm, which would cut it.
        obstacle = self._boundary.obstacle(look.here, setpoint)
        self._setpoint, self._moved_on_at = self._setpoint if obstacle else setpoint, now
        if self._is_due(look, self._setpoint):
            await self._send(look.here, self._setpoint)

        self._check_standing(look.here, target if obstacle or not strategy.replaces else self._setpoint, obstacle)
        if now >= self._checked_at + strategy.check_every:
            self._checked_at = now
            await strategy.check()

    async def _send(self, here: TargetPoint, setpoint: TargetPoint) -> None:
        """Send the arm to a setpoint."""
        try:
            self._strategy.allow(setpoint)
        except ValueError as error:
            raise CommandRejected(f"the way there is not allowed at {setpoint}, and was not gone: {error}") from None

        self._sent_from, self._sent_to = here, setpoint
        self.sent += 1
        if not await self._strategy.go(setpoint):
            self._sent_to = None

    def _is_due(self, look: FollowStatus, setpoint: TargetPoint) -> bool:
        """Whether the arm is to be sent to a setpoint now."""
        distance = partial(apart, turns=self._strategy.turns)
        here, start, sent = look.here, self._sent_from, self._sent_to
        if not self._strategy.replaces:
            return bool(look.rests) and distance(here, setpoint) > GRAIN

        if start is None or sent is None:
            return distance(here, setpoint) > GRAIN

        if self._now() > self._moved_at + AGAIN and not self._is_at(here, setpoint):
            return True

        if distance(sent, setpoint) <= GRAIN:
            return False

        past_middle = distance(here, sent) <= distance(start, sent) / 2
        return past_middle or turns_back(here, sent, setpoint, turns=self._strategy.turns)

    def _seen(self, look: FollowStatus) -> None:
        """Note where the arm is."""
        before = self._here.get(look.here.joints)
        if before is None or apart(before, look.here, turns=self._strategy.turns) > GRAIN:
            self._moved_at = self._now()

        self._here[look.here.joints] = look.here

    def _is_at(self, here: TargetPoint, place: TargetPoint) -> bool:
        """Whether the arm is at a place."""
        return nearer_than(here, place, self._strategy.tolerance, turns=self._strategy.turns)

    def _check_standing(self, here: TargetPoint, wanted: TargetPoint, obstacle: str) -> None:
        """Raise CommandRejected if the arm has stood for long, elsewhere than it is wanted."""
        if self._now() > self._moved_at + PATIENCE and not self._is_at(here, wanted):
            if obstacle:
                raise CommandRejected(f"the arm stands at {here}, for its way on leads outside: {obstacle}")

            raise CommandRejected(
                f"the arm answers, and stands at {here}, although it was sent to {wanted}: is that within reach, is it "
                "homed, has it power, does its firmware replace motions?"
            )

    async def _settle(self) -> None:
        """Let what nothing ends come to its end."""
        while not (await self._strategy.look(joints=False)).rests:
            pass
