"""Where each motion of a myCobot leads, and how near it has to come."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from typing import Any

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.channel import Channel
from dobot_async.arms.mycobot.standstill import STILL, Goal

__all__ = ["GOALS", "Goals"]

STEPS = 4096 / 360  # of an encoder, in a degree


class Goals:
    """Make the goals of one arm's motions; what is relative is told from where the arm stands now.

    They raise ValueError for a step that leads out of the model's range.

    Attributes:
        channel: The arm.
        degrees: How near an angle has to come.
        mm: How near a coordinate has to come.
    """

    def __init__(self, channel: Channel, degrees: float, mm: float) -> None:
        self.channel = channel
        self.degrees = degrees
        self.mm = mm

    def joints(self, expected: Mapping[int, float]) -> Goal:
        """Joints, by their places."""
        return Goal(c.GET_ANGLES, expected, [self.degrees])

    async def angles(self, value: c.JointsMove) -> Goal:
        """All joints."""
        return self.joints(dict(enumerate(value.angles)))

    async def angle(self, value: c.JointMove) -> Goal:
        """One joint."""
        return self.joints({value.joint - 1: value.angle})

    async def joint_step(self, value: c.JointMove) -> Goal:
        """One joint, from where it is now."""
        here = await self.channel.poll(c.GET_ANGLES, None)
        target = here[value.joint - 1] + value.angle
        self.channel.model.check_joint(value.joint, target)
        return self.joints({value.joint - 1: target})

    def coords(self, expected: Mapping[int, float]) -> Goal:
        """Coordinates, by their places."""
        whole = len(expected) == 6
        turning = frozenset[int]() if whole else frozenset({3, 4, 5})
        tolerances = (self.mm, self.mm, self.mm, self.degrees)
        return Goal(c.GET_COORDS, expected, tolerances, rotation=whole, round=turning)

    async def point(self, value: c.ToMove) -> Goal:
        """All coordinates."""
        return self.coords(dict(enumerate(value.coords)))

    async def coord(self, value: c.CoordMove) -> Goal:
        """One coordinate."""
        return self.coords({value.axis - 1: value.value})

    async def coord_step(self, value: c.CoordStep) -> Goal:
        """One coordinate, from where it is now."""
        here = await self.channel.poll(c.GET_COORDS, None)
        target = here[value.axis - 1] + value.value
        if value.axis <= 3:  # angles go round
            self.channel.model.check_coord(value.axis, target)

        return self.coords({value.axis - 1: target})

    async def solution(self, value: c.SetSolutionAngle) -> Goal:
        """The elbow of an arm with 7 joints."""
        return Goal(c.GET_SOLUTION_ANGLES, {0: value.angle}, [self.degrees])

    async def encoders(self, value: c.SetEncoder | c.SetEncoders | c.SetEncodersDrag) -> Goal:
        """Servos."""
        tolerances, still = [self.degrees * STEPS], STILL * STEPS
        if isinstance(value, c.SetEncoder):  # it may be the gripper's, which is not among those that are read together
            return Goal(c.GET_ENCODER, {0: value.encoder}, tolerances, still, of=value.joint)

        return Goal(c.GET_ENCODERS, dict(enumerate(value.encoders)), tolerances, still)


GOALS: Mapping[Command[Any, Any], Callable[[Goals, Any], Awaitable[Goal]]] = {
    c.SEND_ANGLES: Goals.angles,
    c.SEND_ANGLE: Goals.angle,
    c.JOG_ABSOLUTE: Goals.angle,
    c.JOG_INCREMENT: Goals.joint_step,
    c.SEND_COORDS: Goals.point,
    c.SEND_COORD: Goals.coord,
    c.JOG_INCREMENT_COORD: Goals.coord_step,
    c.SET_SOLUTION_ANGLES: Goals.solution,
    c.SET_ENCODER: Goals.encoders,
    c.SET_ENCODERS: Goals.encoders,
    c.SET_ENCODERS_DRAG: Goals.encoders,
}
"""Where each motion leads."""
