"""Teaching a Magician: by the key on its forearm, by jogs; a point is x, y, z and r."""

from __future__ import annotations

import math
from collections.abc import AsyncGenerator, Collection, Sequence
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from typing import Any

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.arm import Magician
from dobot_async.arms.magician.kinematics import Kinematics
from dobot_async.handling.arms import settle_time
from dobot_async.teaching.base import RecordingLimits, TaughtArm, clip
from dobot_async.teaching.recording import Mode, PathSample, Recording, TaughtStep

__all__ = ["MagicianRecordingLimits", "TaughtMagician"]

STEP = 5.0  # mm between two looks at a line
SAME = 0.01  # mm by which two tools may differ
MODES = {"point": c.PTPMode.MOVJ_XYZ, "line": c.PTPMode.MOVL_XYZ, "jump": c.PTPMode.JUMP_XYZ}


class MagicianRecordingLimits(RecordingLimits):
    """The joints and their limits, with the tool that is on the arm."""

    family = "magician"
    axes: tuple[str, ...] = ("x", "y", "z", "r")
    joints = 4
    modes: Collection[str] = ("point", "line", "joints", "jump", "arc")

    def __init__(self, kinematics: Kinematics) -> None:
        self.kinematics = kinematics

    @classmethod
    def of(cls, recording: Recording) -> MagicianRecordingLimits:
        """Those of the arm of a recording; without a tool's offset, of one with a suction cup."""
        if not recording.tool_offset:
            return cls(Kinematics())

        x, y, z = (*recording.tool_offset, 0.0, 0.0)[:3]
        return cls(Kinematics(x, y, z))

    def misfits(self, recording: Recording) -> list[str]:
        """A longer tool would be somewhere else with the same joints, and the arm with the same pose."""
        here, there = self.offset, recording.tool_offset
        if not there or (len(there) == len(here) and math.dist(there, here) <= SAME):
            return []

        name = f" ({recording.tool})" if recording.tool else ""
        difference = f"it was recorded with a tool{name} at {there} mm from the wrist, and the arm was told {here}"
        return [f"{difference}: set_end_effector(...) says which is on it"]

    @property
    def offset(self) -> tuple[float, ...]:
        """Of the tool from the wrist, mm."""
        return (self.kinematics.x_bias, self.kinematics.y_bias, self.kinematics.z_bias)

    def check_joints(self, joints: Sequence[float]) -> None:
        """The limits of the joints."""
        j1, j2, j3, j4 = joints
        self.kinematics.check_joints(j1, j2, j3, j4)

    def check_pose(self, pose: Sequence[float]) -> None:
        """There are joints for it, within their limits."""
        x, y, z, r = pose
        self.kinematics.check(x, y, z, r)

    def check_line(self, start: Sequence[float], end: Sequence[float]) -> None:
        """What is between two places in reach may be too near, or beside the arm."""
        if len(start) != len(end):
            return

        pieces = math.ceil(math.dist(start[:3], end[:3]) / STEP)
        for piece in range(1, pieces):
            share = piece / pieces
            try:
                self.check_pose([a + share * (b - a) for a, b in zip(start, end, strict=True)])
            except ValueError as error:
                raise ValueError(f"on the straight line to it: {error}") from None

    def check_gripper(self, gripper: Any) -> None:
        """It is moved by air."""
        if gripper not in {"off", 0.0, 100.0}:
            raise ValueError(f"a Magician's gripper is open (100), closed (0) or off, not {gripper:g} percent")


class TaughtMagician(TaughtArm):
    """A Magician."""

    arm: Magician
    mode: Mode = "point"
    turn = "r"

    def __init__(self, arm: Magician) -> None:
        super().__init__(arm)
        self._fastest: tuple[float, ...] = ()

    @property
    def limits(self) -> MagicianRecordingLimits:  # type: ignore[override] # the tool may be changed meanwhile
        """With the tool that it was told."""
        return MagicianRecordingLimits(self.arm.kinematics)

    @property
    def tool_offset(self) -> tuple[float, ...]:
        """What it was told of its tool."""
        return self.limits.offset

    async def move(self, step: TaughtStep, percent: float | None) -> None:  # noqa: ARG002 - set before
        """PTP, or an arc."""
        if step.mode == "arc":
            await self.arm.arc(step.via, step.pose)
        elif step.mode == "joints":
            j1, j2, j3, j4 = step.joints
            await self.arm.move_joints(j1, j2, j3, j4)
        else:
            x, y, z, r = step.pose
            await self.arm.move_to(x, y, z, r, mode=MODES[step.mode])

    async def pace(self, start: PathSample, end: PathSample, seconds: float) -> None:
        """With the ratio that makes the slowest joint arrive in time."""
        if not self._fastest:
            self._fastest = (await self.arm.request(c.GET_PTP_JOINT_PARAMS, None)).velocity

        ways = zip(start.joints, end.joints, self._fastest, strict=True)
        needed = max(abs(b - a) / fastest for a, b, fastest in ways)
        await self.arm.set_speed(clip(100 * needed / seconds, 1, 100), 100)
        self.check_stop()
        j1, j2, j3, j4 = end.joints
        await self.arm.move_joints(j1, j2, j3, j4)

    @asynccontextmanager
    async def at_speed(self, percent: float | None) -> AsyncGenerator[None]:
        """The ratios of PTP and of arcs."""
        ptp = await self.arm.request(c.GET_PTP_COMMON_PARAMS, None)
        arc = await self.arm.request(c.GET_ARC_COMMON_PARAMS, None)
        if percent is not None:
            await self.arm.request(c.SET_PTP_COMMON_PARAMS, c.PTPCommonParams(percent, percent))
            await self.arm.request(c.SET_ARC_COMMON_PARAMS, c.ARCCommonParams(percent, percent))

        async with self._set_back((c.SET_PTP_COMMON_PARAMS, ptp), (c.SET_ARC_COMMON_PARAMS, arc)):
            yield

    @asynccontextmanager
    async def jogs(self, percent: float) -> AsyncGenerator[None]:
        """The ratios of jogs."""
        before = await self.arm.request(c.GET_JOG_COMMON_PARAMS, None)
        await self.arm.request(c.SET_JOG_COMMON_PARAMS, c.JOGCommonParams(percent, percent))
        async with self._set_back((c.SET_JOG_COMMON_PARAMS, before)):
            yield

    @asynccontextmanager
    async def _set_back(self, *settings: tuple[Command[Any, None], Any]) -> AsyncGenerator[None]:
        """Set what it was before when the block ends; if that is by an error, without keeping the error waiting."""

        async def tell() -> None:
            for command, value in settings:
                await self.arm.request(command, value)

        try:
            yield
        except BaseException:
            self.arm.link.cleanup.start(tell(), "setting the speed back")
            raise

        await tell()

    def jogging(self, direction: str, percent: float) -> AbstractAsyncContextManager[None]:  # noqa: ARG002 - set before
        """Jog until the block ends."""
        return self.arm.jogging(direction)

    async def tell_tool(self, tool: str, wanted: Any) -> None:
        """The pump stops with the tool."""
        if wanted == "off":
            await self.arm.gripper(False, pump=False)
        elif tool == "suction" and not wanted:
            await self.arm.suction(False, pump=False)
            await self.arm.wait(settle_time(self.arm, tool))
        else:
            await super().tell_tool(tool, wanted)
