"""Teaching a myCobot: led by hand with its servos released, or by jogs; a step is its joints."""

from __future__ import annotations

import math
from collections.abc import AsyncGenerator, Collection, Sequence
from contextlib import AbstractAsyncContextManager, asynccontextmanager

from dobot_async.arms.mycobot.arm import MyCobot
from dobot_async.arms.mycobot.models import AXES, DEFAULT, MODELS, CobotModel
from dobot_async.arms.mycobot.params import MoveMode
from dobot_async.teaching.base import RecordingLimits, TaughtArm, clip
from dobot_async.teaching.recording import Mode, PathSample, Recording, TaughtStep

__all__ = ["CobotRecordingLimits", "TaughtCobot"]

USUAL = 50
"""Percent of its speed, as its verbs have it."""


class CobotRecordingLimits(RecordingLimits):
    """A model's joints, and its ranges of coordinates."""

    family = "mycobot"
    modes: Collection[str] = ("point", "line", "joints")
    tools: Collection[str] = ("gripper",)

    def __init__(self, model: CobotModel) -> None:
        self.model = model
        self.axes: tuple[str, ...] = AXES[: len(model.reach)]
        self.joints: int = model.joints

    @classmethod
    def of(cls, recording: Recording) -> CobotRecordingLimits:
        """Those of the model of a recording; raise ValueError if there is no such model."""
        name = recording.model or DEFAULT
        if name not in MODELS:
            raise ValueError(f"no model {name!r}; there are: {', '.join(MODELS)}")

        return cls(MODELS[name])

    def misfits(self, recording: Recording) -> list[str]:
        """Another model stands elsewhere with the same joints; those that are built alike will do."""
        here, there = MODELS.get(self.model.name), MODELS.get(recording.model or DEFAULT)
        if here and there and (here.joint_limits, here.reach) == (there.joint_limits, there.reach):
            return []

        return [f"it was recorded from a {recording.model}, and this is a {self.model.name}"]

    def check_joints(self, joints: Sequence[float]) -> None:
        """The limits of the joints."""
        for number, angle in enumerate(joints, 1):
            self.model.check_joint(number, angle)

    def check_pose(self, pose: Sequence[float]) -> None:
        """The ranges of the coordinates."""
        for number, value in enumerate(pose, 1):
            self.model.check_coord(number, value)


class TaughtCobot(TaughtArm):
    """A myCobot, or another model of its family."""

    arm: MyCobot
    mode: Mode = "joints"  # a pose alone leaves open how the elbow is

    def __init__(self, arm: MyCobot) -> None:
        super().__init__(arm)
        self.limits: RecordingLimits = CobotRecordingLimits(arm.model)
        self.turn: str = self.limits.axes[-1]

    @property
    def model(self) -> str:
        """Its name."""
        return self.arm.model.name

    async def move(self, step: TaughtStep, percent: float | None) -> None:
        """With its joints, or its coordinates."""
        speed = whole(USUAL if percent is None else percent)
        if step.mode == "joints":
            await self.arm.move_joints(*step.joints, speed=speed)
        else:
            mode = MoveMode.LINEAR if step.mode == "line" else MoveMode.ANGULAR
            x, y, z, *rotation = step.pose
            await self.arm.move_to(x, y, z, *rotation, speed=speed, mode=mode)

    async def pace(self, start: PathSample, end: PathSample, seconds: float) -> None:
        """With the speed that makes the joint with the longest way arrive in time."""
        way = max(abs(b - a) for a, b in zip(start.joints, end.joints, strict=True))
        percent = 100 * way / seconds / self.arm.model.joint_speed
        await self.arm.move_joints(*end.joints, speed=whole(percent))

    def jogging(self, direction: str, percent: float) -> AbstractAsyncContextManager[None]:
        """Jog until the block ends."""
        return self.arm.jogging(direction, speed=whole(percent))

    @asynccontextmanager
    async def released(self) -> AsyncGenerator[None]:
        """Damped where the firmware can; it holds again at the end, however that comes."""
        self.check_idle()
        async with self.arm.link.cleanup.at_end(self.arm.focus, "holding the joints again"):
            await self.arm.release()
            yield


def whole(percent: float) -> int:
    """A speed as the arm takes it: rather a little faster than late."""
    return int(clip(math.ceil(percent), 1, 100))
