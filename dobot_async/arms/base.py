"""`Arm`: what every arm can do, whatever its family. For programs that are written for any of them.

    async def wave(arm: Arm) -> None:
        await arm.move_by(z=20)
        await arm.gripper(True)

The names, units and meanings are the same in all families. What an arm has not, or what its protocol does not give,
raises UnsupportedError; docs/families.md has a table. A family's class takes more than is said here: poses as targets,
speeds, modes.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Mapping
from contextlib import AbstractAsyncContextManager
from typing import Any, Protocol, TypeVar

from dobot_async._core.link.link import Link
from dobot_async._core.protocol.wire import Command
from dobot_async._core.queue.motion import Motion
from dobot_async.arms.info import DeviceInfo
from dobot_async.following import Follow

__all__ = ["Arm", "ArmBatch", "ArmPose", "ArmQueue", "ArmVerbs"]

T_co = TypeVar("T_co", covariant=True)
Q = TypeVar("Q")
R = TypeVar("R")


class ArmPose(Protocol):
    """Where the tool is, and the joints."""

    @property
    def x(self) -> float:
        """In mm."""
        ...

    @property
    def y(self) -> float:
        """In mm."""
        ...

    @property
    def z(self) -> float:
        """In mm."""
        ...

    @property
    def joints(self) -> tuple[float, ...]:
        """In degrees."""
        ...


class ArmVerbs(Protocol[T_co]):
    """What one can tell an arm to do; T_co is what each verb returns in its place: arm, queue or batch.

    Raises:
        ValueError: An argument is out of range, or the arm cannot reach the target; nothing was sent.
        TypeError: It is of the wrong type.
        UnsupportedError: The arm has no such thing.
    """

    def home(self, *, timeout: float | None = None) -> T_co:
        """Drive to the home position, where the arm finds its place if it has to.

        Args:
            timeout: Seconds; None waits as long as it takes.
        """
        ...

    def move_to(
        self,
        x: float | None = None,
        y: float | None = None,
        z: float | None = None,
        *,
        timeout: float | None = None,
    ) -> T_co:
        """Move the tool to a point, mm; coordinates that are not given stay as they are.

        Args:
            x: mm, forward.
            y: mm, to the left.
            z: mm, up.
            timeout: Seconds; None waits as long as it takes.
        """
        ...

    def move_by(self, x: float = 0.0, y: float = 0.0, z: float = 0.0, *, timeout: float | None = None) -> T_co:
        """Move the tool by mm from where it will be then.

        Args:
            x: mm, forward.
            y: mm, to the left.
            z: mm, up.
            timeout: Seconds; None waits as long as it takes.
        """
        ...

    @property
    def move_joints(self) -> Callable[..., T_co]:
        """Move the joints to angles in degrees, as many as the arm has; takes `timeout=` too."""
        ...

    def wait(self, seconds: float, *, timeout: float | None = None) -> T_co:
        """Hold the queue for a time, 0 s or more.

        Args:
            seconds: 0 or more.
            timeout: Seconds, for the waiting as well.
        """
        ...

    def gripper(self, closed: bool, *, timeout: float | None = None) -> T_co:
        """Close or open the gripper.

        Args:
            closed: Whether to close it.
            timeout: Seconds.
        """
        ...

    def gripper_to(self, percent: float, *, timeout: float | None = None) -> T_co:
        """Open the gripper to 0 (closed) to 100 (open) percent.

        Args:
            percent: 0 (closed) to 100 (open).
            timeout: Seconds.
        """
        ...

    def suction(self, on: bool, *, timeout: float | None = None) -> T_co:
        """Suck, or let go.

        Args:
            on: Whether to suck.
            timeout: Seconds.
        """
        ...


class ArmBatch(ArmVerbs[Motion], Protocol):
    """Commands that are sent together when the block of `queue.batch()` ends."""


class ArmQueue(ArmVerbs[Coroutine[Any, Any, Motion]], Protocol):
    """The queue of an arm: each verb returns a Motion once the command is accepted."""

    @property
    def pending(self) -> int:
        """How many accepted commands are not known to have ended."""
        ...

    @property
    def outcomes(self) -> Mapping[str, int]:
        """How many motions ended, by how: "done", or the name of the error that they raise."""
        ...

    async def put(self, command: Command[Q, Any], value: Q, *, timeout: float | None = None) -> Motion:
        """Queue any row of the command table that may be queued.

        Args:
            command: A row of the family's table.
            value: What the row takes; None if that is nothing.
            timeout: Seconds to wait for room in the queue.

        Raises:
            ValueError: The value is out of range, or the row may not be queued; nothing was sent.
            TypeError: The value is of the wrong type.
        """
        ...

    def batch(self, *, timeout: float | None = None) -> AbstractAsyncContextManager[ArmBatch]:
        """Collect commands, and send them with nothing between them when the block ends."""
        ...

    async def join(self, timeout: float | None = None) -> None:
        """Return when all that was put has been executed; raise the first failure since the last `join`."""

    async def clear(self, *, timeout: float = ...) -> None:
        """Throw away all that is queued."""


class Arm(ArmVerbs[Coroutine[Any, Any, None]], Protocol):
    """A connected arm: each verb returns when the arm has done it, and raises when it has not.

    Raises:
        ArmAlarm: The arm ended the motion with alarms, or missed its goal.
        CommandRejected: The arm refused it.
        MotionStopped: A stop ended it.
        MotionUnknown: Nothing can tell whether it was done; the arm is told to stop.
        ReplyTimeout: The arm is silent, or the time is over.
        ConnectionLost: The link is gone.
    """

    @property
    def link(self) -> Link[Any]:
        """The connection, with its state, events and figures."""
        ...

    @property
    def queue(self) -> ArmQueue:
        """The queue of the arm's motions, with the same verbs."""
        ...

    async def request(self, command: Command[Q, R], value: Q, *, timeout: float | None = None) -> R:
        """Send any row of the family's command table at once, and return the arm's answer.

        Args:
            command: A row of the table.
            value: What the row takes; None if that is nothing.
            timeout: Seconds to wait for the answer.

        Raises:
            ValueError: The value is out of range, or the connection only reads; nothing was sent.
            TypeError: The value is of the wrong type.
        """
        ...

    async def get_pose(self, *, timeout: float | None = None) -> ArmPose:
        """Return where the tool is."""
        ...

    async def get_joints(self, *, timeout: float | None = None) -> tuple[float, ...]:
        """Return the joints, degrees."""
        ...

    async def get_info(self, *, timeout: float | None = None) -> DeviceInfo:
        """Return serial number, name and firmware version; "" for what the arm does not tell."""
        ...

    async def get_alarms(self, *, timeout: float | None = None) -> tuple[object, ...]:
        """Return what keeps the arm from moving, in words when printed."""
        ...

    async def clear_alarms(self, *, timeout: float | None = None) -> None:
        """Clear the alarms; what the arm was doing when they came up does not go on."""

    async def recover(self) -> None:
        """Empty the queue, clear the alarms, and let the arm take new commands."""

    async def jog(self, direction: str, seconds: float) -> None:
        """Jog for a time, then stop; directions are "x+", "x-", "y+", ..., "j1+", "j2-".

        Args:
            direction: A word; what an arm knows depends on its family.
            seconds: 0 or more.

        Raises:
            ValueError: The arm knows no such direction.
        """

    def jogging(self, direction: str) -> AbstractAsyncContextManager[None]:
        """Jog until the block ends, however it ends.

        Args:
            direction: As for `jog`.

        Raises:
            ValueError: The arm knows no such direction.
        """
        ...

    @property
    def following(self) -> Callable[..., AbstractAsyncContextManager[Follow]]:
        """Let the arm follow a target for the length of a block; takes `rate=`, `max_speed=`, `max_turn=`, `stale=`."""
        ...

    async def stop(self, *, timeout: float = ...) -> None:
        """Stop the arm now, ahead of everything; pending Motions raise MotionStopped."""

    async def pause(self) -> None:
        """Let the arm wait; Motions stay pending."""

    async def resume(self) -> None:
        """Let a paused arm go on."""
