"""An arm that is told joints again and again: what loops at a fixed rate, such as those of LeRobot, need of one.

    arm = JointFollower(lambda: Magician.connect(url), limits_of_magician, rate=30)
    arm.connect()
    sent = arm.go((10.0, 20.0, 30.0, 0.0))       # returns at once, with what the arm goes after
    joints = arm.joints()
    arm.disconnect()                             # the arm stands

1. The newest joints win; the arm goes after them no faster than `max_turn`, and rests if none came for `stale` s.
2. What is beyond a joint's limits is clipped to them; what joints forbid together is not followed, and the ones before
   stay. `go` returns what is followed.
3. A failure is raised by the call in which it shows, and once; after it there is nothing to be done but to disconnect.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, ExitStack
from typing import Generic, Protocol, TypeVar

from dobot_async import DobotError
from dobot_async.sync.follow import Follow
from dobot_async.sync.magician import Magician
from dobot_async.sync.mycobot import MyCobot

__all__ = ["JointFollower", "limits_of_cobot", "limits_of_magician"]

logger: logging.Logger = logging.getLogger("dobot_async.sync")
Range = tuple[float, float]


class Followed(Protocol):
    """An arm of any family, as far as its joints are concerned."""

    def get_joints(self, *, timeout: float | None = None) -> tuple[float, ...]:
        """Return the joints, degrees."""
        ...

    @property
    def following(self) -> Callable[..., AbstractContextManager[Follow]]:
        """Let the arm follow a target for the length of a block."""
        ...


A = TypeVar("A", bound=Followed)


def limits_of_magician(arm: Magician) -> Sequence[Range]:
    """Return the least and the greatest angle of each joint, degrees."""
    limits = arm.kinematics.limits
    return limits.j1, limits.j2, limits.j3, limits.j4


def limits_of_cobot(arm: MyCobot) -> Sequence[Range]:
    """Return the least and the greatest angle of each joint, degrees."""
    return [(low, high) for low, high in arm.model.joint_limits]


class JointFollower(Generic[A]):
    """An arm that goes after the newest joints.

    Args:
        open_arm: Returns the block of its connection, as `Magician.connect` does.
        limits: Tells the range of each joint of a connected arm, degrees.
        rate: Setpoints per second at the most, above 0 to 200.
        max_turn: Degrees/s at which a joint goes after what it is told, above 0.
        stale: Seconds after which the arm rests if nothing new came, above 0.
    """

    def __init__(
        self,
        open_arm: Callable[[], AbstractContextManager[A]],
        limits: Callable[[A], Sequence[Range]],
        *,
        rate: float = 30.0,
        max_turn: float = 90.0,
        stale: float = 0.5,
    ) -> None:
        self._open_arm = open_arm
        self._limits_of = limits
        self._options = {"rate": rate, "max_turn": max_turn, "stale": stale}
        self._stack = ExitStack()
        self._arm: A | None = None
        self._follow: Follow | None = None
        self._limits: Sequence[Range] = ()
        self._goal: tuple[float, ...] = ()
        self._failed = False

    @property
    def connected(self) -> bool:
        """Whether it is connected."""
        return self._arm is not None

    @property
    def arm(self) -> A:
        """The arm; raises RuntimeError if it is not connected."""
        if self._arm is None:
            raise RuntimeError("the arm is not connected: connect() first")

        return self._arm

    def connect(self, prepare: Callable[[A], object] = lambda _: None) -> None:
        """Connect, and follow from now on.

        Args:
            prepare: Called with the arm before it follows: homes it, or gives it power.

        Raises:
            DobotError: As `connect` of the arm, and as `following`.
        """
        with ExitStack() as stack:
            arm = stack.enter_context(self._open_arm())
            prepare(arm)
            self._limits = self._limits_of(arm)
            self._goal = arm.get_joints()
            self._follow = stack.enter_context(arm.following(**self._options))
            self._stack = stack.pop_all()

        self._arm, self._failed = arm, False

    def joints(self) -> tuple[float, ...]:
        """Return where the joints are, degrees; raises DobotError if the arm does not tell."""
        return self.arm.get_joints()

    def go(self, joints: Sequence[float]) -> tuple[float, ...]:
        """Go after joints, and return at once.

        Args:
            joints: Degrees, one for each joint.

        Returns:
            What is followed: within the limits of each joint; those before, if the arm cannot have these together.

        Raises:
            ValueError: They are not as many as the arm has, or not finite; the ones before stay.
            DobotError: The following has failed, or was stopped.
        """
        follow = self._follow
        if follow is None:
            raise RuntimeError("the arm is not connected: connect() first")

        if len(joints) != len(self._limits) or not all(map(math.isfinite, joints)):
            raise ValueError(f"expected {len(self._limits)} finite angles in degrees, not {tuple(joints)!r}")

        goal = tuple(min(max(float(each), low), high) for each, (low, high) in zip(joints, self._limits, strict=True))
        try:
            try:
                follow.joints = goal
            except ValueError as error:
                logger.warning("not followed: %s", error)
                follow.joints = self._goal
            else:
                self._goal = goal
        except DobotError:
            self._failed = True
            raise

        return self._goal

    def disconnect(self) -> None:
        """Let the arm stand, and end the connection; nothing if there is none.

        Raises:
            DobotError: The following has failed, and `go` has not told it yet; the connection is ended all the same.
        """
        stack, self._stack = self._stack, ExitStack()
        self._arm = self._follow = None
        try:
            stack.close()
        except DobotError as error:
            if not self._failed:
                raise

            logger.info("the following had failed before: %s", error)
