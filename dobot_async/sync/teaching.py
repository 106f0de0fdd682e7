"""Teaching and playing back, for programs without asyncio.

Written by tests/sync/write_sync.py: change what that reads, and run it again.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from typing import Any, SupportsFloat

from dobot_async.sync.given import arm_of, like_an_arm
from dobot_async.sync.portal import PORTAL
from dobot_async.sync.twin import BlockingContext, Items, Twin, same
from dobot_async.sync.twins import AnyArm, twin_of
from dobot_async.teaching import check_recording as async_check_recording
from dobot_async.teaching import play as async_play
from dobot_async.teaching import released as async_released
from dobot_async.teaching.player import Progress
from dobot_async.teaching.recorder import Recorder as AsyncRecorder
from dobot_async.teaching.recording import Mode, PathSample, Recording, TaughtStep

__all__ = ["Recorder", "check_recording", "play", "released"]


class Recorder(Twin[AsyncRecorder]):
    """Takes down where an arm is, as steps or as a path."""

    def __init__(self, arm: AnyArm, *, tool: str = "", recording: Recording | None = None) -> None:
        """Begin a recording, or go on with one.

        Args:
            arm: A connected Magician, MyCobot or UltraArm.
            tool: What is on the arm, in your words.
            recording: What to go on with; of the same family and model.

        Raises:
            ValueError: The recording is another arm's, or was made with another tool.
        """
        super().__init__(AsyncRecorder(arm_of(arm), tool=tool, recording=recording))

    @property
    def arm(self) -> AnyArm:
        """The arm."""
        found: AnyArm = twin_of(self.asynchronous.arm)
        return found

    @property
    def recording(self) -> Recording:
        """What was taken so far."""
        return self.asynchronous.recording

    def point(
        self, *, mode: Mode | None = None, via: Sequence[float] = (), pause: float = 0.0, name: str = ""
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
        return PORTAL.run(lambda: self.asynchronous.point(mode=mode, via=via, pause=pause, name=name))

    def suction(self, on: bool) -> None:
        """Switch the cup, and take that down: in the last step if the arm stands there, else as a step of its own.

        Args:
            on: Whether to suck.

        Raises:
            ValueError: There is a path in the recording.
            DobotError: The arm did not tell where it is, or did not switch it.
        """
        PORTAL.run(lambda: self.asynchronous.suction(on))

    def gripper(self, closed: bool) -> None:
        """Close or open the gripper, and take that down, as `suction` does.

        Args:
            closed: Whether to close it.

        Raises:
            ValueError: There is a path in the recording.
            DobotError: The arm did not tell where it is, or did not move it.
        """
        PORTAL.run(lambda: self.asynchronous.gripper(closed))

    def gripper_to(self, percent: SupportsFloat) -> None:
        """Open the gripper to 0 (closed) to 100 percent, and take that down, as `suction` does.

        Args:
            percent: 0 to 100; of a Magician 0 or 100.

        Raises:
            ValueError: It is out of range, or there is a path in the recording.
            DobotError: The arm did not tell where it is, or did not move it.
        """
        PORTAL.run(lambda: self.asynchronous.gripper_to(percent))

    def change_last(self, **changes: Any) -> TaughtStep:
        """Change the last step: its mode, pause or name.

        Raises:
            IndexError: There is none.
            ValueError: A change is wrong.
        """
        return PORTAL.look(lambda: self.asynchronous.change_last(**changes))

    def undo(self) -> TaughtStep | None:
        """Take the last step back, and return it; None if there is none. Arm and tool stay as they are."""
        return PORTAL.look(self.asynchronous.undo)

    def from_key(self) -> Items[TaughtStep]:
        """Take a step each time that the key on a Magician's forearm is released, until the loop is left.

        Raises:
            UnsupportedError: The arm has no such key.
        """
        return Items(self.asynchronous.from_key, same)

    def samples(self, rate: float, *, seconds: float | None = None) -> Items[PathSample]:
        """Take down where the arm is, so many times a second, until the loop is left or the time is over.

        Args:
            rate: Samples per second, above 0 and at most 1000. A slow line leaves out what it cannot carry.
            seconds: For how long; None until the loop is left.

        Raises:
            ValueError: An argument is out of range, or there are steps in the recording.
            DobotError: The arm did not tell where it is.
        """
        return Items(lambda: self.asynchronous.samples(rate, seconds=seconds), same)


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
    async_check_recording(recording, like_an_arm(arm))


def play(
    arm: AnyArm,
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
        loops: How often, 1 or more; None until it is interrupted.
        reverse: From the end to the beginning, along the same ways; what was taken is put down.
        progress: Called with (steps done, steps in all) after each step of a loop.

    Raises:
        MotionStopped: The arm was stopped meanwhile, whatever it did then: nothing goes on past a stop.
        RecordingUnfit: The arm cannot do it: another family, model or tool, or beyond limits or reach. Nothing moved.
        ValueError: An argument is out of range.
        DobotError: As the verbs of the arm.
    """
    PORTAL.run(lambda: async_play(arm_of(arm), recording, speed=speed, loops=loops, reverse=reverse, progress=progress))


def released(arm: AnyArm) -> AbstractContextManager[None]:
    """Let the joints of an arm go for the length of a block, so that a hand can lead it: it falls unless it is held.

        with released(arm):
            for sample in recorder.samples(20, seconds=10): ...

    A myCobot holds again at the end, however the block ends. An ultraArm gets its power back, and has to be homed.

    Args:
        arm: A connected MyCobot or UltraArm.

    Raises:
        CommandRejected: Motions are under way; or, of an ultraArm at the end: it has not noticed where it was led.
        UnsupportedError: It is a Magician, which has a key for that; see `Recorder.from_key`.
        DobotError: The arm did not hear it.
    """
    return BlockingContext(lambda: async_released(arm_of(arm)), same, "released")
