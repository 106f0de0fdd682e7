"""Segments: ways with their speed, in joints. Knows no family and no clock.

    joints ---joint_leg--> Leg --.
    Curve ----curve_leg--> Leg --+--travel--> Activity
    jump(...) -----------> Segments -'

A joint vector has any length; kinematics come as a `JointSolver`. The end of a curve has to be within reach, or
planning raises the solver's fault. The reach is checked every few mm and degrees, and a segment that
leaves it ends at that place, with the fault of the way (Dobot's codes: that of the plan and 0x10).
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import Protocol

from dobot_async.simulator.device.curve import SAME_PLACE, Curve, LineSegment, between
from dobot_async.simulator.device.profile import Profile, SpeedLimits, shared
from dobot_async.simulator.device.work import Activity, DeviceFault, Vector

__all__ = ["JointSolver", "Segment", "curve_segment", "joint_segment", "jump", "travel"]

REPEATED_POINTS, BAD_JUMP = 0x13, 0x15
UNDERWAY = 0x10
EVERY = 5.0  # mm or degrees between two looks at the reach
MOST_LOOKS = 1000  # a way of more than 5 m is looked at more seldom, for planning has to end
HALVINGS = 40


class JointSolver(Protocol):
    """The kinematics of one arm."""

    def forward(self, joints: Vector) -> Vector:
        """Returns the point of these joints."""
        ...

    def inverse(self, point: Vector) -> Vector:
        """Returns the joints of this point; raises Fault where there are none or limits forbid them."""
        ...


@dataclass(frozen=True, slots=True)
class Segment:
    """A way and its speed.

    Attributes:
        joints: The joints at a share, 0 to 1, of the way.
        profile: How fast; its length is 1.
        stop: The share of the way at which it ends.
        fault: What ends it there, if not its own end.
    """

    joints: Callable[[float], Vector]
    profile: Profile
    stop: float = 1.0
    fault: DeviceFault | None = None

    @property
    def duration(self) -> float:
        """Seconds until it ends."""
        return self.profile.time(self.stop)

    @property
    def end(self) -> Vector:
        """The joints where it ends."""
        return self.joints(self.stop)

    def at(self, elapsed: float) -> Vector:
        """Returns the joints after some seconds."""
        return self.joints(min(self.profile.position(elapsed), self.stop))


@dataclass(frozen=True, slots=True)
class Solved:
    """The joints along a curve, which begins where the arm stands.

    A gap in the reach between two of the `count` looks is stepped over: the arm is shown where it was last seen.
    An arm that stands out of reach may move back into it.
    """

    curve: Curve
    solver: JointSolver
    start: Vector
    count: int

    def __call__(self, share: float) -> Vector:
        last_look = math.ceil(share * self.count - 1) / self.count
        for seen in (share, last_look):
            found = self.solve(seen) if seen > 0 else self.start
            if not isinstance(found, DeviceFault):
                return found

        return self.start

    def leaves_reach(self, *, known_end: bool) -> tuple[float, DeviceFault] | None:
        """Where the curve leaves the reach, and why; `known_end` says that its end is known to be within."""
        outside = self.fault_at(0.0)
        for look in range(1, self.count + (not known_end)):
            fault = self.fault_at(look / self.count)
            if fault and not outside:
                return self.edge((look - 1) / self.count, look / self.count, fault)

            outside = fault

        return None if known_end or not outside else (0.0, outside)

    def edge(self, inside: float, outside: float, fault: DeviceFault) -> tuple[float, DeviceFault]:
        """The last place within reach between two looks, and what is wrong beyond it."""
        for _ in range(HALVINGS):
            middle = (inside + outside) / 2
            found = self.fault_at(middle)
            if found:
                outside, fault = middle, found
            else:
                inside = middle

        return inside, fault

    def solve(self, share: float) -> Vector | DeviceFault:
        """What the solver says of the point there."""
        try:
            return self.solver.inverse(self.curve.point(share))
        except DeviceFault as fault:
            return fault

    def fault_at(self, share: float) -> DeviceFault | None:
        """What is wrong with the point there."""
        found = self.solve(share)
        return found if isinstance(found, DeviceFault) else None


def joint_segment(
    start: Vector, end: Vector, pace: SpeedLimits, *, fault: DeviceFault | None = None, leave: float = 0.0
) -> Segment:
    """Returns the way on which all joints set out and arrive together, the slowest at its pace.

    Args:
        start: Where the joints are.
        end: Where they go; nobody asks whether they may.
        pace: What each joint may do.
        fault: What happens at the end, such as a jog's limit.
        leave: Share of the way per second at its end; `math.inf` arrives at full speed.
    """
    spans = tuple(b - a for a, b in zip(start, end, strict=True))
    return Segment(lambda share: between(start, end, share), shared(spans, pace, leave=leave), fault=fault)


def curve_segment(
    curve: Curve,
    start: Vector,
    solver: JointSolver,
    pace: SpeedLimits,
    *,
    must_arrive: bool = True,
    every: float = EVERY,
    underway: int = UNDERWAY,
    enter: float = 0.0,
    leave: float = 0.0,
) -> Segment:
    """Returns the way along a curve, cut off where it leaves the reach.

    Args:
        curve: The way; it begins where the arm is.
        start: The joints where the arm is.
        solver: The kinematics.
        pace: What the tool may do: mm along the curve, degrees of its angles.
        must_arrive: Whether an end out of reach fails now rather than on the way.
        every: mm or degrees between two looks at the reach; infinity looks at the end alone.
        underway: By how much the code of a fault on the way is higher than that of the solver.
        enter: Velocity at the beginning in mm/s, for points of one continuous path.
        leave: Velocity at the end in mm/s.

    Raises:
        Fault: The solver's, if the end has to be reached and is out of reach.
    """
    length, turn = curve.length, curve.turn
    looks = min(max(length, turn) / every, MOST_LOOKS)
    solved = Solved(curve, solver, start, max(1, math.ceil(looks)))
    if must_arrive:
        solver.inverse(curve.point(1.0))

    scale = 1 / length if length > 0 else 0.0
    profile = shared((length, turn), pace, enter=enter * scale, leave=leave * scale)
    left = solved.leaves_reach(known_end=must_arrive)
    if left is None:
        return Segment(solved, profile)

    return Segment(solved, profile, left[0], DeviceFault(left[1].code + underway))


def jump(
    start: Vector,
    target: Vector,
    solver: JointSolver,
    *,
    height: float,
    ceiling: float,
    vertical: SpeedLimits,
    across: SpeedLimits,
    straight: bool = False,
    every: float = EVERY,
    underway: int = UNDERWAY,
) -> list[Segment]:
    """Returns the segments up, across and down, or those up to the one that leaves the reach.

    The way across is `height` above the higher end, but not above `ceiling` (zLimit).

    Args:
        start: The joints where the arm is.
        target: The point to go to.
        solver: The kinematics.
        height: mm (jumpHeight).
        ceiling: z in mm (zLimit).
        vertical: Pace up and down, in mm and degrees.
        across: Pace of the joints; with `straight`, of mm and degrees.
        straight: Whether the way across is a straight line (JUMP_MOVL).
        every: As for `curve_segment`.
        underway: As for `curve_segment`.

    Raises:
        Fault: The solver's, if the target is out of reach; 0x15 if start or target is above the ceiling; 0x13 if a
            straight jump goes nowhere.
    """
    origin = solver.forward(start)
    if max(origin[2], target[2]) > ceiling + SAME_PLACE:
        raise DeviceFault(BAD_JUMP)

    if straight and math.dist(origin[:3], target[:3]) < SAME_PLACE:
        raise DeviceFault(REPEATED_POINTS)

    solver.inverse(target)
    top = min(max(origin[2], target[2]) + height, ceiling)
    above_origin = (*origin[:2], top, *origin[3:])
    above_target = (*target[:2], top, *target[3:])

    def line(a: Vector, b: Vector, joints: Vector, pace: SpeedLimits) -> Segment:
        return curve_segment(LineSegment(a, b), joints, solver, pace, must_arrive=False, every=every, underway=underway)

    def sideways(joints: Vector) -> Segment:
        if straight:
            return line(above_origin, above_target, joints, across)

        try:
            return joint_segment(joints, solver.inverse(above_target), across)
        except DeviceFault as fault:
            return joint_segment(joints, joints, across, fault=DeviceFault(fault.code + underway))

    segments = [line(origin, above_origin, start, vertical)]

    def down(joints: Vector) -> Segment:
        return line(above_target, target, joints, vertical)

    for following in (sideways, down):
        if segments[-1].fault:
            break

        segments.append(following(segments[-1].end))

    return segments


def travel(segments: Sequence[Segment], end: Callable[[], None] = lambda: None) -> Activity:
    """Returns the activity of going along some segments, one after the other.

    Args:
        segments: At least one; a fault may only be in the last.
        end: Called when all is done without a fault.
    """
    ends = list(accumulate(segment.duration for segment in segments))

    def at(elapsed: float) -> Vector:
        number = bisect_right(ends, elapsed)
        if number == len(segments):
            return segments[-1].end

        return segments[number].at(elapsed - (ends[number - 1] if number else 0.0))

    def finish() -> None:
        if segments[-1].fault:
            raise DeviceFault(segments[-1].fault.code)

        end()

    return Activity(ends[-1], at, finish)
