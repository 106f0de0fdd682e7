"""A recording, played: everything is checked, then the arm does one step after the other.

Each motion belongs to the call: cancelled, it stops the arm.
"""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Callable
from dataclasses import replace
from typing import Any, SupportsFloat, SupportsIndex

from dobot_async._core.util.arguments import to_float
from dobot_async.arms.base import Arm
from dobot_async.teaching.base import TaughtArm
from dobot_async.teaching.problems import RecordingUnfit
from dobot_async.teaching.recording import Recording
from dobot_async.teaching.registry import check_recording, taught

__all__ = ["play"]

Progress = Callable[[int, int], None]
FULL = 100.0
MOST = 1000.0


async def play(
    arm: Arm,
    recording: Recording,
    *,
    speed: float | None = None,
    loops: int | None = 1,
    reverse: bool = False,
    progress: Progress | None = None,
) -> None:
    """Play a recording; all of it is checked before the arm moves.

    A step is done when the arm is there, the tool has had its time, and the pause is over. A path in time is gone
    through as fast as it was shown, or more slowly where the arm needs longer: it rests at each bend.

    Args:
        arm: A connected arm of the family, and the model, that was taught.
        recording: What it was taught.
        speed: Percent. Of steps: of the arm's own speed, above 0 and at most 100; None leaves it as it is. Of a
            path: of the speed at which it was shown, up to 1000; 100 by default. A Magician's ratios are set back.
        loops: How often, 1 or more; None until it is cancelled.
        reverse: From the end to the beginning, along the same ways; what was taken is put down.
        progress: Called with (steps done, steps in all) after each step of a loop.

    Raises:
        MotionStopped: The arm was stopped meanwhile, whatever it did then: nothing goes on past a stop.
        RecordingUnfit: The arm cannot do it: another family, model or tool, or beyond limits or reach. Nothing moved.
        ValueError: An argument is out of range.
        DobotError: As the verbs of the arm.
    """
    percent = to_percent(speed, MOST if recording.path else FULL)
    times = itertools.count() if loops is None else range(to_count(loops))
    if not recording.steps and not recording.path:
        raise RecordingUnfit(["there is nothing in it"])

    if reverse:
        recording = recording.reversed()

    check_recording(recording, arm)
    report: Progress = progress or (lambda done, total: None)  # noqa: ARG005 - nobody wants to know
    player = taught(arm)
    async with player.at_speed(None if recording.path else percent):
        state: dict[str, Any] = {}
        for _ in times:
            if recording.path:
                await play_path(player, recording, (percent or FULL) / FULL, report)
            else:
                await play_steps(player, recording, percent, state, report)


async def play_steps(
    player: TaughtArm, recording: Recording, percent: float | None, state: dict[str, Any], report: Progress
) -> None:
    """Do one step after the other; `state` is what the tools were told last."""
    for number, step in enumerate(recording.steps, 1):
        player.check_stop()
        await player.move(step, percent)
        await player.switch(step, state)
        if step.pause:
            player.check_stop()
            await player.arm.wait(step.pause)

        report(number, len(recording.steps))


async def play_path(player: TaughtArm, recording: Recording, factor: float, report: Progress) -> None:
    """Go from sample to sample, none of them faster than it was shown: who is late rests less."""
    path, clock = recording.thinned().path, asyncio.get_running_loop().time
    here = replace(path[0], joints=(await player.look())[1], pose=())
    player.check_stop()
    await player.pace(here, path[0], travel_time(here.joints, path[0].joints))
    report(1, len(path))
    began = clock()
    for number, (start, end) in enumerate(itertools.pairwise(path), 2):
        due = began + (end.time - path[0].time) / factor
        if any(abs(a - b) > STILL for a, b in zip(start.joints, end.joints, strict=True)):
            player.check_stop()
            await player.pace(start, end, (end.time - start.time) / factor)

        await asyncio.sleep(max(0.0, due - clock()))
        player.check_stop()
        report(number, len(path))


STILL = 0.05  # degrees; what is no motion for an arm would be one that it does not begin
LEAST = 0.01  # seconds; no way is 0
DEGREES_PER_SECOND = 30.0


def travel_time(start: tuple[float, ...], end: tuple[float, ...]) -> float:
    """Return a careful time for a way that nobody has shown."""
    return max(LEAST, *(abs(a - b) / DEGREES_PER_SECOND for a, b in zip(start, end, strict=True)))


def to_percent(speed: SupportsFloat | None, most: float) -> float | None:
    """Return a speed; raise ValueError or TypeError for what is none."""
    if speed is None:
        return None

    found = to_float(speed, "speed")
    if not 0 < found <= most:
        raise ValueError(f"speed must be above 0 and at most {most:g} percent, not {speed!r}")

    return found


def to_count(loops: SupportsIndex) -> int:
    """Return how often; raise ValueError or TypeError for what is no number of times."""
    if not hasattr(loops, "__index__"):
        raise TypeError(f"loops must be a whole number or None, not {loops!r}")

    found = loops.__index__()
    if found < 1:
        raise ValueError(f"loops must be 1 or more, not {loops!r}")

    return found
