"""The families of arms that can be taught: the one place that knows all of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from dobot_async.arms.magician.arm import Magician
from dobot_async.arms.mycobot.arm import MyCobot
from dobot_async.arms.ultraarm.arm import UltraArm
from dobot_async.teaching.arms.magician import MagicianRecordingLimits, TaughtMagician
from dobot_async.teaching.arms.mycobot import CobotRecordingLimits, TaughtCobot
from dobot_async.teaching.arms.ultraarm import TaughtUltraArm, UltraArmRecordingLimits
from dobot_async.teaching.base import RecordingLimits, TaughtArm
from dobot_async.teaching.problems import RecordingUnfit
from dobot_async.teaching.recording import Recording

__all__ = ["check_recording", "taught"]

ARMS: Mapping[type, Callable[[Any], TaughtArm]] = {
    Magician: TaughtMagician,
    MyCobot: TaughtCobot,
    UltraArm: TaughtUltraArm,
}
LIMITS: Mapping[str, Callable[[Recording], RecordingLimits]] = {
    "magician": MagicianRecordingLimits.of,
    "mycobot": CobotRecordingLimits.of,
    "ultraarm": UltraArmRecordingLimits.of,
}


def taught(arm: object) -> TaughtArm:
    """Return an arm as teaching knows it; raise TypeError for what is none."""
    for kind, make in ARMS.items():
        if isinstance(arm, kind):
            return make(arm)

    raise TypeError(f"expected a Magician, a MyCobot or an UltraArm, not {arm!r}")


def check_recording(recording: Recording, arm: object | None = None) -> None:
    """Check that an arm can play a recording: family, model, tool, the limits of joints and axes, and the reach.

    Of a straight line of a Magician all that lies between is looked at, of other ways their ends.

    Args:
        recording: What was taught.
        arm: A connected arm; None checks it as far as is known without one, with the usual limits of its family.

    Raises:
        RecordingUnfit: It cannot; the message has each step that is wrong.
        TypeError: It is no such arm.
    """
    if arm is not None:
        limits = taught(arm).limits
    elif recording.family in LIMITS:
        try:
            limits = LIMITS[recording.family](recording)
        except ValueError as error:
            raise RecordingUnfit([str(error)]) from None
    else:
        raise RecordingUnfit([f"no family {recording.family!r}; there are: {', '.join(LIMITS)}"])

    problems = limits.problems(recording)
    if problems:
        raise RecordingUnfit(problems)
