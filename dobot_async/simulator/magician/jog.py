"""How a simulated Magician jogs: from a key and where the arm is, to an Activity that ends at a limit with its alarm.

A jog is planned to the place where it would end by itself; letting go of the key ends it before. Joint vectors have
five numbers, the last one is the place on the rail.
"""

from __future__ import annotations

import math
from dataclasses import replace

from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.kinematics import JointLimits
from dobot_async.simulator.device.curve import LineSegment
from dobot_async.simulator.device.path import Segment, curve_segment, joint_segment
from dobot_async.simulator.device.profile import SpeedLimits, trapezoid
from dobot_async.simulator.device.work import Activity, DeviceFault, Vector
from dobot_async.simulator.magician.motion import RAIL, along, clipped, standing
from dobot_async.simulator.magician.reach import Reach
from dobot_async.simulator.magician.state import State

__all__ = ["jog", "margins"]

LIMIT = 0x40  # the upper limit of joint 1; then the lower one, then those of joints 2, 3 and 4
STRETCHED, FOLDED = 0x48, 0x49
LIMIT_UNDERWAY = 0x22
FAR = 1000.0  # mm or degrees; every jog of the tool meets a limit before it
RAIL_AXIS = 4
PARALLELOGRAM = {(1, 1): STRETCHED, (1, -1): FOLDED, (2, 1): FOLDED, (2, -1): STRETCHED}
"""What else than its own limit can stop joints 2 and 3, by joint (from 0) and direction."""


def jog(state: State, reach: Reach, value: c.JOGCmd, joints: Vector) -> Activity:
    """Returns the jog that a key starts, as far as the limits let it go."""
    axis, backwards = divmod(value.cmd - 1, 2)
    direction = -1 if backwards else 1
    ratios = state.get(c.SET_JOG_COMMON_PARAMS)
    factors = clipped(ratios.velocity_ratio), clipped(ratios.acceleration_ratio)
    if axis == RAIL_AXIS:  # only as a joint: three texts of the vendor ask for isJoint = 1
        return rail_jog(state, direction, factors, joints) if value.is_joint else Activity()

    if value.is_joint:
        segment = joint_jog(state, axis, direction, factors, joints[:4])
    else:
        segment = tool_jog(state, reach, axis, direction, factors, joints[:4])

    return along([segment], standing(joints[4]))


def margins(limits: JointLimits, joints: Vector) -> dict[int, float]:
    """How many degrees are left until each limit alarm, 0x40 to 0x49; negative beyond it."""
    left: dict[int, float] = {}
    for number, (low, high) in enumerate((limits.j1, limits.j2, limits.j3, limits.j4)):
        left[LIMIT + 2 * number] = high - joints[number]
        left[LIMIT + 2 * number + 1] = joints[number] - low

    left[STRETCHED] = limits.fold[1] - (joints[1] - joints[2])
    left[FOLDED] = (joints[1] - joints[2]) - limits.fold[0]
    return left


def joint_jog(state: State, axis: int, direction: int, factors: tuple[float, float], joints: Vector) -> Segment:
    """One joint to its limit."""
    left = margins(state.limits, joints)
    codes = {
        LIMIT + 2 * axis + (direction < 0),
        PARALLELOGRAM.get((axis, direction), LIMIT + 2 * axis + (direction < 0)),
    }
    code = min(codes, key=left.__getitem__)
    target = (*joints[:axis], joints[axis] + direction * max(0.0, left[code]), *joints[axis + 1 :])
    limits = state.get(c.SET_JOG_JOINT_PARAMS)
    pace = SpeedLimits(limits.velocity, limits.acceleration).scaled(*factors)
    return joint_segment(joints, target, pace, fault=DeviceFault(code), leave=math.inf)


def tool_jog(
    state: State, reach: Reach, axis: int, direction: int, factors: tuple[float, float], joints: Vector
) -> Segment:
    """The tool along x, y or z, or turning, until a joint is at its limit."""
    start = reach.forward(joints)
    end = (*start[:axis], start[axis] + direction * FAR, *start[axis + 1 :])
    limits = state.get(c.SET_JOG_COORDINATE_PARAMS)
    pace = SpeedLimits(
        (limits.velocity[axis], limits.velocity[3]), (limits.acceleration[axis], limits.acceleration[3])
    ).scaled(*factors)
    segment = curve_segment(LineSegment(start, end), joints, reach, pace, must_arrive=False)
    if segment.fault and segment.fault.code == LIMIT_UNDERWAY:
        left = margins(state.limits, segment.end)
        return replace(segment, fault=DeviceFault(min(left, key=left.__getitem__)))

    return segment


def rail_jog(state: State, direction: int, factors: tuple[float, float], joints: Vector) -> Activity:
    """The rail to its end, where nothing but the way ends; an arm without a rail stays."""
    if not state.has_rail:
        return Activity()

    limits = state.get(c.SET_JOGL_PARAMS)
    pace = SpeedLimits((limits.velocity,), (limits.acceleration,)).scaled(*factors)
    rail = joint_segment((joints[4],), (RAIL[direction > 0],), pace, leave=math.inf)
    return along([Segment(lambda _: joints[:4], trapezoid(0.0, 0.0, 0.0))], rail)
