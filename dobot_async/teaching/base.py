"""What teaching asks of a family of arms.

limits     what can be played, said of an arm or of a recording alone: no arm is needed to look at a file
taught     an arm: where it is, how it goes to a step, how it is jogged and led
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import AsyncGenerator, Callable, Collection, Sequence
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from typing import Any

from dobot_async.errors import CommandRejected, UnsupportedError
from dobot_async.handling.arms import settle_time, stop_check
from dobot_async.teaching.recording import Mode, PathSample, Recording, TaughtStep

__all__ = ["RecordingLimits", "TaughtArm", "clip"]


class RecordingLimits(ABC):
    """What an arm of a family can be told.

    Attributes:
        family: The word of the family.
        axes: Of a pose, in order.
        joints: How many there are.
        modes: The ways to a step that it knows.
        tools: What it can switch.
    """

    family: str
    axes: tuple[str, ...]
    joints: int
    modes: Collection[str]
    tools: Collection[str] = ("suction", "gripper")

    def problems(self, recording: Recording) -> list[str]:
        """Return what of a recording cannot be played, each with its step; empty if all can."""
        if recording.family != self.family:
            return [f"it was recorded from an arm of the family {recording.family!r}, and this is a {self.family!r}"]

        found = self.misfits(recording)
        before: TaughtStep | None = None
        for number, step in enumerate(recording.steps, 1):
            name = f" ({step.name})" if step.name else ""
            try:
                self._check(step, before)
            except ValueError as error:
                found.append(f"step {number}{name}: {error}")

            before = step

        for number, sample in enumerate(recording.path, 1):
            try:
                self._count("joints", sample.joints, self.joints)
                self.check_joints(sample.joints)
            except ValueError as error:
                found.append(f"sample {number}: {error}")
                break  # what is beyond a limit is so for many samples

        return found

    def misfits(self, recording: Recording) -> list[str]:  # noqa: ARG002 - where nothing differs
        """Return in what the arm differs from that of the recording."""
        return []

    @abstractmethod
    def check_joints(self, joints: Sequence[float]) -> None:
        """Raise ValueError for joints that it cannot take."""

    @abstractmethod
    def check_pose(self, pose: Sequence[float]) -> None:
        """Raise ValueError for a pose that it cannot reach."""

    def check_line(self, start: Sequence[float], end: Sequence[float]) -> None:  # noqa: B027 - ranges have no gaps
        """Raise ValueError for a straight line of which it cannot reach a part; both ends were looked at."""

    def _check(self, step: TaughtStep, before: TaughtStep | None) -> None:
        if step.mode not in self.modes:
            raise ValueError(f"the mode {step.mode!r} is none of {', '.join(self.modes)}")

        for tool in ("suction", "gripper"):
            if getattr(step, tool) is not None and tool not in self.tools:
                raise ValueError(f"this arm has no {tool} of its own")

        if step.gripper is not None:
            self.check_gripper(step.gripper)

        if step.mode == "joints":
            self._count("joints", step.joints, self.joints)
            self.check_joints(step.joints)
            return

        for pose in filter(None, (step.via, step.pose)):
            self._count("pose", pose, len(self.axes))
            self.check_pose(pose)

        if step.mode == "line" and before and before.pose:
            self.check_line(before.pose, step.pose)

    def check_gripper(self, gripper: Any) -> None:
        """Raise ValueError for a state that its gripper does not have."""
        if gripper == "off":
            raise ValueError("this arm's gripper has no air to be taken off")

    def _count(self, what: str, numbers: Sequence[float], count: int) -> None:
        if len(numbers) != count:
            raise ValueError(f"{what} has {len(numbers)} numbers, and this arm {count}")


class TaughtArm(ABC):
    """An arm that is taught, and that plays.

    Attributes:
        arm: The arm itself.
        limits: What it can be told.
        mode: How a step is reached unless somebody says it.
        turn: The word of the axis that turns the tool, for jogs; "" where there is none.
        check_stop: Raises if the arm was stopped since this was made: nothing is played past a stop.
    """

    limits: RecordingLimits
    mode: Mode
    turn: str

    def __init__(self, arm: Any) -> None:
        self.arm = arm
        self.check_stop: Callable[[], None] = stop_check(arm)

    @property
    def model(self) -> str:
        """Which model of its family it is."""
        return ""

    @property
    def tool_offset(self) -> tuple[float, ...]:
        """How far its tool is from the wrist, as far as is known."""
        return ()

    async def look(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return pose and joints."""
        return self.numbers(await self.arm.get_pose())

    def numbers(self, pose: Any) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return the numbers of a pose of this arm."""
        return tuple(getattr(pose, axis) for axis in self.limits.axes), tuple(pose.joints)

    @abstractmethod
    async def move(self, step: TaughtStep, percent: float | None) -> None:
        """Go to a step, at so many percent of the arm's speed; None as it usually is."""

    @abstractmethod
    async def pace(self, start: PathSample, end: PathSample, seconds: float) -> None:
        """Go from one sample of a path to another, in so many seconds if the arm is fast enough."""

    @abstractmethod
    def jogging(self, direction: str, percent: float) -> AbstractAsyncContextManager[None]:
        """Jog until the block ends."""

    @asynccontextmanager
    async def at_speed(self, percent: float | None) -> AsyncGenerator[None]:  # noqa: ARG002 - where each motion has its own
        """Set what is set once for all motions of the block, and set it back behind it."""
        yield

    @asynccontextmanager
    async def jogs(self, percent: float) -> AsyncGenerator[None]:  # noqa: ARG002 - where each jog has its own
        """Set what is set once for all jogs of the block, and set it back behind it."""
        yield

    def released(self) -> AbstractAsyncContextManager[None]:
        """Let the joints go for the length of a block; raise UnsupportedError where the protocol cannot."""
        raise UnsupportedError("a Magician is led while the key on its forearm is held: see Recorder.from_key()")

    async def switch(self, step: TaughtStep, state: dict[str, Any]) -> None:
        """Let the tool do what a step says, as far as it has not done it; `state` is what it was told last."""
        for tool in ("suction", "gripper"):
            wanted = getattr(step, tool)
            if wanted is not None and wanted != state.get(tool):
                self.check_stop()
                await self.tell_tool(tool, wanted)
                state[tool] = wanted

    async def tell_tool(self, tool: str, wanted: Any) -> None:
        """Switch a tool, and wait until it has done that."""
        if tool == "suction":
            await self.arm.suction(wanted)
        elif wanted in {0.0, 100.0}:
            await self.arm.gripper(wanted == 0)
        else:
            await self.arm.gripper_to(wanted)

        seconds = settle_time(self.arm, tool)
        if seconds:
            await self.arm.wait(seconds)

    def check_idle(self) -> None:
        """Raise CommandRejected while motions are under way."""
        if self.arm.queue.pending:
            raise CommandRejected(
                "motions are under way: await arm.queue.join(), or arm.stop(), before the arm is let go"
            )


def clip(value: float, least: float, most: float) -> float:
    """Return a number within a range."""
    return min(max(value, least), most)
