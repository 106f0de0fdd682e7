"""What takes down where an arm is: step by step, or a path in time."""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncGenerator, Sequence
from contextlib import AbstractAsyncContextManager, aclosing
from dataclasses import replace
from typing import Any, SupportsFloat, cast

from dobot_async._core.util.arguments import check_duration, to_float
from dobot_async.arms.base import Arm
from dobot_async.arms.magician.arm import Magician
from dobot_async.arms.magician.params import Pose
from dobot_async.errors import UnsupportedError
from dobot_async.teaching.recording import Mode, PathSample, Recording, TaughtStep
from dobot_async.teaching.registry import taught

__all__ = ["Recorder", "released"]

SAME_PLACE = 0.5  # mm and degrees within which the arm stands where a step was taken
FASTEST_RATE = 1000.0


def released(arm: Arm) -> AbstractAsyncContextManager[None]:
    """Let the joints of an arm go for the length of a block, so that a hand can lead it: it falls unless it is held.

        async with released(arm):
            async for sample in recorder.samples(20, seconds=10): ...

    A myCobot holds again at the end, however the block ends. An ultraArm gets its power back, and has to be homed.

    Args:
        arm: A connected MyCobot or UltraArm.

    Raises:
        CommandRejected: Motions are under way; or, of an ultraArm at the end: it has not noticed where it was led.
        UnsupportedError: It is a Magician, which has a key for that; see `Recorder.from_key`.
        DobotError: The arm did not hear it.
    """
    return taught(arm).released()


class Recorder:
    """Takes down where an arm is, as steps or as a path.

    Attributes:
        arm: The arm.
    """

    def __init__(self, arm: Arm, *, tool: str = "", recording: Recording | None = None) -> None:
        """Begin a recording, or go on with one.

        Args:
            arm: A connected Magician, MyCobot or UltraArm.
            tool: What is on the arm, in your words.
            recording: What to go on with; of the same family and model.

        Raises:
            ValueError: The recording is another arm's, or was made with another tool.
        """
        self.arm: Any = arm
        self._taught = taught(arm)
        family, model = self._taught.limits.family, self._taught.model
        if recording and (recording.family, recording.model) != (family, model):
            raise ValueError(f"the recording is of a {recording.model or recording.family}, not of a {model or family}")

        misfits = self._taught.limits.misfits(recording) if recording else []
        if misfits:
            raise ValueError(misfits[0])

        offset = self._taught.tool_offset
        self._recording = replace(recording, path=()) if recording else Recording(family, model, tool, offset)
        self._path = list(recording.path) if recording else []

    @property
    def recording(self) -> Recording:
        """What was taken so far."""
        return replace(self._recording, path=tuple(self._path))

    async def point(
        self,
        *,
        mode: Mode | None = None,
        via: Sequence[float] = (),
        pause: float = 0.0,
        name: str = "",
    ) -> TaughtStep:
        """Take the place where the arm is as the next step.

        Args:
            mode: How it is to be reached; "point" by default, of a myCobot "joints". See `TaughtStep`.
            via: For "arc": the pose that it goes through.
            pause: Seconds to stay there.
            name: What the place is called.

        Raises:
            ValueError: An argument is wrong, or there is a path in the recording.
            DobotError: The arm did not tell where it is.
        """
        pose, joints = await self._taught.look()
        return self._take(TaughtStep(pose, joints, mode or self._taught.mode, tuple(via), pause=pause, name=name))

    async def suction(self, on: bool) -> None:
        """Switch the cup, and take that down: in the last step if the arm stands there, else as a step of its own.

        Args:
            on: Whether to suck.

        Raises:
            ValueError: There is a path in the recording.
            DobotError: The arm did not tell where it is, or did not switch it.
        """
        await self._switch("suction", bool(on))

    async def gripper(self, closed: bool) -> None:
        """Close or open the gripper, and take that down, as `suction` does.

        Args:
            closed: Whether to close it.

        Raises:
            ValueError: There is a path in the recording.
            DobotError: The arm did not tell where it is, or did not move it.
        """
        await self._switch("gripper", 0.0 if closed else 100.0)

    async def gripper_to(self, percent: SupportsFloat) -> None:
        """Open the gripper to 0 (closed) to 100 percent, and take that down, as `suction` does.

        Args:
            percent: 0 to 100; of a Magician 0 or 100.

        Raises:
            ValueError: It is out of range, or there is a path in the recording.
            DobotError: The arm did not tell where it is, or did not move it.
        """
        await self._switch("gripper", to_float(percent, "percent"))

    def change_last(self, **changes: Any) -> TaughtStep:
        """Change the last step: its mode, pause or name.

        Raises:
            IndexError: There is none.
            ValueError: A change is wrong.
        """
        step = replace(self._recording.steps[-1], **changes)
        self._recording = replace(self._recording, steps=(*self._recording.steps[:-1], step))
        return step

    def undo(self) -> TaughtStep | None:
        """Take the last step back, and return it; None if there is none. Arm and tool stay as they are."""
        if not self._recording.steps:
            return None

        *steps, last = self._recording.steps
        self._recording = replace(self._recording, steps=tuple(steps))
        return last

    async def from_key(self) -> AsyncGenerator[TaughtStep, None]:
        """Take a step each time that the key on a Magician's forearm is released, until the loop is left.

        Raises:
            UnsupportedError: The arm has no such key.
        """
        if not isinstance(self.arm, Magician):
            raise UnsupportedError("only a Magician has a key for that: see released()")

        async with aclosing(cast("AsyncGenerator[Pose, None]", self.arm.taught_points())) as poses:
            async for found in poses:
                pose, joints = self._taught.numbers(found)
                yield self._take(TaughtStep(pose, joints, self._taught.mode))

    async def samples(self, rate: float, *, seconds: float | None = None) -> AsyncGenerator[PathSample, None]:
        """Take down where the arm is, so many times a second, until the loop is left or the time is over.

        Args:
            rate: Samples per second, above 0 and at most 1000. A slow line leaves out what it cannot carry.
            seconds: For how long; None until the loop is left.

        Raises:
            ValueError: An argument is out of range, or there are steps in the recording.
            DobotError: The arm did not tell where it is.
        """
        found = to_float(rate, "rate")
        if not 0 < found <= FASTEST_RATE:
            raise ValueError(f"rate must be above 0 and at most {FASTEST_RATE:g} samples/s, not {rate!r}")

        if self._recording.steps:
            raise ValueError("there are steps in the recording: a path needs one of its own")

        end = math.inf if seconds is None else check_duration(seconds)
        clock = asyncio.get_running_loop().time
        began = due = clock()
        offset = self._path[-1].time + 1 / found if self._path else 0.0
        while True:
            pose, joints = await self._taught.look()
            sample = PathSample(offset + clock() - began, joints, pose)
            self._path.append(sample)
            yield sample
            due = max(due + 1 / found, clock())
            if due - began > end:
                return

            await asyncio.sleep(due - clock())

    def _take(self, step: TaughtStep) -> TaughtStep:
        if self._path:
            raise ValueError("there is a path in the recording: steps need one of their own")

        self._recording = replace(self._recording, steps=(*self._recording.steps, step))
        return step

    async def _switch(self, tool: str, wanted: Any) -> None:
        """Switch a tool where the arm stands."""
        pose, joints = await self._taught.look()
        state: dict[str, Any] = {tool: wanted}
        switched = TaughtStep(pose, joints, self._taught.mode, **state)
        if self._path:
            raise ValueError("there is a path in the recording: a tool is switched in steps")

        await self._taught.tell_tool(tool, wanted)
        last = self._recording.steps[-1] if self._recording.steps else None
        if last and getattr(last, tool) is None and stands_at(last, switched):
            self.change_last(**state)
        else:
            self._take(switched)


def stands_at(step: TaughtStep, here: TaughtStep) -> bool:
    """Whether the arm is where a step was taken."""
    pairs = ((step.pose, here.pose), (step.joints, here.joints))
    return all(
        len(one) == len(other) and all(abs(a - b) <= SAME_PLACE for a, b in zip(one, other, strict=False))
        for one, other in pairs
    )
