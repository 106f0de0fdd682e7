"""How a simulated myCobot gets from joints to joints: ways with their speed. No state, no bytes, no clock.

A target out of reach, or beyond a joint's limit, is a Fault with the arm's own code; so is a straight line that leaves
the reach. A jog is planned to where it would end by itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from dobot_async.arms.mycobot.models import CobotModel
from dobot_async.simulator.device.curve import between
from dobot_async.simulator.device.path import Segment, joint_segment
from dobot_async.simulator.device.profile import SpeedLimits, shared
from dobot_async.simulator.device.work import DeviceFault, Vector
from dobot_async.simulator.mycobot.elbow import turn_elbow
from dobot_async.simulator.mycobot.kinematics import KINEMATICS, Chain, InverseSolver, Transform

__all__ = ["NO_INVERSE", "NO_LINE", "SegmentPlanner"]

NO_INVERSE, NO_LINE = 0x20, 0x21
EVERY = 5.0  # mm or degrees between two points of a straight way
FAR = 700.0
NEIGHBOUR = 30.0  # degrees that a joint may turn between two points of a straight way
ACCELERATION = 200.0  # degrees/s²
TOOL_SPEED, TOOL_ACCELERATION = 250.0, 500.0  # mm/s, mm/s²
LIMIT_SLACK = 1e-6
SIGNS = (1, 1, -1, -1, 1, -1, 1)  # of the play of each joint


class SegmentPlanner:
    """The ways of one model.

    Attributes:
        model: What the arm is.
        limits: Least and greatest angle of each joint, as set now.
        play: By how much each joint comes to rest beside where it was told to, degrees.
    """

    def __init__(self, model: CobotModel, play: float = 0.0) -> None:
        self.model = model
        self.play: tuple[float, ...] = tuple(play * sign for sign in SIGNS[: model.joints])
        self.limits: list[tuple[float, float]] = list(model.joint_limits)
        self.solver: InverseSolver = KINEMATICS[model.name]

    def to_joints(
        self, start: Vector, target: Sequence[float], speed: float, pace: SpeedLimits | None = None
    ) -> Segment:
        """All joints set out and arrive together; the slowest at its pace, by default as the percentage says."""
        for joint, (angle, (low, high)) in enumerate(zip(target, self.limits, strict=True), 1):
            if not low - LIMIT_SLACK <= angle <= high + LIMIT_SLACK:
                raise DeviceFault(joint)

        end = tuple(angle + off for angle, off in zip(target, self.play, strict=True))
        return joint_segment(start, end, pace or self.pace(speed))

    def to_point(self, start: Vector, point: Sequence[float], speed: float, *, straight: bool) -> Segment:
        """The flange to a point, by the joints or along a straight line."""
        found = self.solver.inverse(point, start, self.limits)
        if found is None:
            raise DeviceFault(NO_INVERSE)

        if not straight:
            return self.to_joints(start, found, speed)

        segment = self.line(start, point, speed)
        if segment.stop < 1.0:
            raise DeviceFault(NO_LINE)

        return segment

    def elbow(self, start: Vector, angle: float, speed: float) -> Segment:
        """The elbow of seven joints to an angle, with the flange where it is at the end."""
        found = turn_elbow(self.solver, start, angle, self.limits) if isinstance(self.solver, Chain) else None
        if found is None:
            raise DeviceFault(NO_INVERSE)

        return self.to_joints(start, found, speed)

    def jog_joint(self, start: Vector, joint: int, *, up: bool, speed: float) -> Segment:
        """One joint (from 0) to its limit."""
        target = (*start[:joint], self.limits[joint][up], *start[joint + 1 :])
        return joint_segment(start, target, self.pace(speed), leave=math.inf)

    def jog_axis(self, start: Vector, axis: int, *, up: bool, speed: float) -> Segment:
        """The flange along or about an axis (from 0) as far as it goes."""
        point = list(self.solver.forward(start))
        if axis < 3:
            point[axis] += FAR if up else -FAR
            return self.line(start, point, speed)

        point[axis] += 120.0 if up else -120.0
        return self.line(start, point, speed)

    def line(self, start: Vector, point: Sequence[float], speed: float) -> Segment:
        """The flange along a straight line, as far as there are joints for it next to one another."""
        begin = self.solver.forward(start)
        end = list(point)
        for place in range(3, len(end)):
            end[place] = begin[place] + math.remainder(end[place] - begin[place], 360)

        length = math.dist(begin[:3], end[:3])
        turn = max((abs(b - a) for a, b in zip(begin[3:], end[3:], strict=True)), default=0.0)
        count = max(1, math.ceil(max(length, turn) / EVERY))
        ways = [start]
        for number in range(1, count + 1):
            found = self.solver.inverse(between(begin, tuple(end), number / count), ways[-1], self.limits, seeds=False)
            if found is None or max(abs(b - a) for a, b in zip(ways[-1], found, strict=True)) > NEIGHBOUR:
                break

            ways.append(found)

        def joints(share: float) -> Vector:
            place = min(share * count, len(ways) - 1.0)
            before = min(int(place), len(ways) - 2)
            if len(ways) == 1:
                return start

            exact = between(ways[before], ways[before + 1], place - before)
            return tuple(angle + share * off for angle, off in zip(exact, self.play, strict=True))

        factor = speed / 100
        pace = SpeedLimits((TOOL_SPEED * factor, self.model.joint_speed * factor), (TOOL_ACCELERATION, ACCELERATION))
        return Segment(joints, shared((length, turn), pace), (len(ways) - 1) / count)

    def pace(self, speed: float) -> SpeedLimits:
        """What the joints may do at a percentage."""
        count = self.model.joints
        return SpeedLimits((self.model.joint_speed * speed / 100,) * count, (ACCELERATION,) * count)

    def frame(self, joints: Sequence[float]) -> Transform:
        """Where the flange is."""
        return Transform.of(self.solver.forward(joints))
