"""Teaching an ultraArm: by jogs; released, if its firmware notices where it is led. A point is x, y, z and e."""

from __future__ import annotations

import math
from collections.abc import AsyncGenerator, Collection, Sequence
from contextlib import AbstractAsyncContextManager, asynccontextmanager

from dobot_async.arms.ultraarm import commands as c
from dobot_async.arms.ultraarm.arm import UltraArm
from dobot_async.arms.ultraarm.verbs import SPEED
from dobot_async.errors import CommandRejected
from dobot_async.teaching.base import RecordingLimits, TaughtArm, clip
from dobot_async.teaching.recording import Mode, PathSample, Recording, TaughtStep

__all__ = ["TaughtUltraArm", "UltraArmRecordingLimits"]

SLOWEST, FASTEST = 1.0, 200.0  # F of the manual


class UltraArmRecordingLimits(RecordingLimits):
    """The ranges of joints and coordinates."""

    family = "ultraarm"
    axes: tuple[str, ...] = ("x", "y", "z", "e")
    joints = 4
    modes: Collection[str] = ("point", "line", "joints")

    def __init__(self, limits: c.UltraArmLimits) -> None:
        self.limits = limits

    @classmethod
    def of(cls, _: Recording) -> UltraArmRecordingLimits:
        """The manual's."""
        return cls(c.MANUAL_LIMITS)

    def check_joints(self, joints: Sequence[float]) -> None:
        """The limits of the joints."""
        j1, j2, j3, j4 = joints
        self.limits.check(c.JointsMove(j1, j2, j3, j4, None))

    def check_pose(self, pose: Sequence[float]) -> None:
        """The ranges of the coordinates."""
        x, y, z, e = pose
        self.limits.check(c.CoordsMove(x, y, z, e, f=None))


class TaughtUltraArm(TaughtArm):
    """An ultraArm P340."""

    arm: UltraArm
    mode: Mode = "point"
    turn = ""  # the protocol jogs x, y, z and three joints

    def __init__(self, arm: UltraArm) -> None:
        super().__init__(arm)
        self.limits: RecordingLimits = UltraArmRecordingLimits(arm.limits)

    async def move(self, step: TaughtStep, percent: float | None) -> None:
        """G0, G1 or M11."""
        speed = SPEED if percent is None else feed(percent)
        if step.mode == "joints":
            j1, j2, j3, j4 = step.joints
            await self.arm.move_joints(j1, j2, j3, j4, speed=speed)
        elif step.mode == "line":
            x, y, z, e = step.pose
            await self.arm.perform(c.MOVE_LINE, c.CoordsMove(x, y, z, e, f=speed), None)
        else:
            x, y, z, e = step.pose
            await self.arm.move_to(x, y, z, e, speed=speed)

    async def pace(self, start: PathSample, end: PathSample, seconds: float) -> None:
        """F as if it were mm/s, or degrees/s, of what goes the longest way; the manual calls it so."""
        ways = [abs(b - a) for a, b in zip(start.joints, end.joints, strict=True)]
        if start.pose and end.pose:
            ways.append(math.dist(start.pose[:3], end.pose[:3]))

        j1, j2, j3, j4 = end.joints
        await self.arm.move_joints(j1, j2, j3, j4, speed=clip(max(ways) / seconds, SLOWEST, FASTEST))

    def jogging(self, direction: str, percent: float) -> AbstractAsyncContextManager[None]:
        """Jog until the block ends."""
        return self.arm.jogging(direction, speed=feed(percent))

    @asynccontextmanager
    async def released(self) -> AsyncGenerator[None]:
        """M17, and M18 at the end, after which it has to be homed.

        Raises:
            CommandRejected: It has told the same place all the time: its motors count steps, and sense nothing.
        """
        self.check_idle()
        before = await self.arm.get_joints()
        async with self.arm.link.cleanup.at_end(self.arm.power_on, "the power of the motors"):
            await self.arm.release()
            yield
            after = await self.arm.get_joints()

        if before == after:
            raise CommandRejected(
                "the arm has told the same place since it was released: with this firmware it does not notice where it "
                "is led; teach it by jogs. home() is needed now"
            )


def feed(percent: float) -> float:
    """A share of the fastest speed."""
    return clip(FASTEST * percent / 100, SLOWEST, FASTEST)
