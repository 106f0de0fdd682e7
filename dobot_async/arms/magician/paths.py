"""The way that the tool of a Magician takes, as places at most 5 mm apart, in the arm's coordinates. Pure arithmetic.

    straight (MOVL, CP)       a line from here to there
    joints (MOVJ)             all joints turn evenly from here to there
    jump                      up, across as MOVJ or as MOVL does, and down
    arc, circle               along the circle through three points

Which lift a jump has depends on which parameters were set last, which an arm does not tell: the ways of all that come
into question are taken. Of homing, and of motions on a rail, the way is not known.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.kinematics import FOREARM, REAR_ARM, Joints, Kinematics, Point

__all__ = ["STEP", "XYZ", "Lift", "Way", "reach_of", "way_of"]

STEP = 5.0
"""mm between two places that are looked at, at most."""

COLLINEAR = 1e-6
XYZ = tuple[float, float, float]


class Lift(NamedTuple):
    """How far a jump lifts at its start and at its end, and the z that it never exceeds; mm."""

    start: float
    end: float
    ceiling: float


class Way(NamedTuple):
    """Where the tool comes along, and the joints at the end of it."""

    places: tuple[XYZ, ...]
    end: Joints


def way_of(value: Any, start: Joints, kinematics: Kinematics, lifts: Sequence[Lift]) -> Way | None:
    """Returns the way of a motion, None if it is not known.

    Args:
        value: The parameters of a command that moves the arm.
        start: The joints where it begins.
        kinematics: The arm's, with its end effector.
        lifts: Of jumps: all that come into question.

    Raises:
        Unreachable: It leads where the arm cannot go.
    """
    if isinstance(value, (c.PTPCmd, c.PTPPOCmd)):
        mode = PTP[value.ptp_mode]
        return mode(kinematics, start, (value.x, value.y, value.z, value.r), lifts)

    here = kinematics.forward(*start)
    if isinstance(value, (c.CPCmd, c.CPLECmd)):
        relative = value.cp_mode is c.CPMode.RELATIVE
        x, y, z = here[:3] if relative else (0.0, 0.0, 0.0)
        return straight(kinematics, start, Point(x + value.x, y + value.y, z + value.z, here.r))

    if isinstance(value, (c.ARCCmd, c.CircleCmd)):
        via, to = (Point(each.x, each.y, each.z, each.r) for each in (value.cir_point, value.to_point))
        places = tuple(circle(here, via, to, whole=isinstance(value, c.CircleCmd)))
        end = start if isinstance(value, c.CircleCmd) else kinematics.inverse(*to)
        return Way(places, end) if places else None

    return None


def reach_of(kinematics: Kinematics) -> float:
    """Returns how far from the axis of joint 1 the tool can be at most, mm."""
    return REAR_ARM + FOREARM + abs(kinematics.x_bias) + abs(kinematics.y_bias)


def straight(kinematics: Kinematics, start: Joints, target: Point) -> Way:
    """The tool on a line."""
    return Way(tuple(line(kinematics.forward(*start), target)), kinematics.inverse(*target))


def turning(kinematics: Kinematics, start: Joints, end: Joints) -> Way:
    """All joints evenly."""
    levers = zip(start, end, (reach_of(kinematics), REAR_ARM, FOREARM), strict=False)
    length = sum(abs(math.radians(b - a)) * lever for a, b, lever in levers)
    places = (kinematics.forward(*between(start, end, share))[:3] for share in shares(length))
    return Way(tuple(places), end)


def jumping(kinematics: Kinematics, start: Joints, target: Point, lift: Lift, *, along_line: bool) -> Way:
    """Up, across and down."""
    here = kinematics.forward(*start)
    top = max(min(max(here.z + lift.start, target.z + lift.end), lift.ceiling), here.z, target.z)
    above, beyond = here._replace(z=top), target._replace(z=top)
    if along_line:
        across = tuple(line(above, beyond))
    else:
        across = turning(kinematics, kinematics.inverse(*above), kinematics.inverse(*beyond)).places

    return Way((*line(here, above), *across, *line(beyond, target)), kinematics.inverse(*target))


def line(start: Sequence[float], end: Sequence[float]) -> Iterator[XYZ]:
    """Places on a straight line, both ends among them."""
    for share in shares(math.dist(start[:3], end[:3])):
        x, y, z = between(start[:3], end[:3], share)
        yield x, y, z


def circle(start: Sequence[float], via: Sequence[float], to: Sequence[float], *, whole: bool) -> Iterator[XYZ]:
    """Places on the arc from `start` through `via` to `to`, or all around; none if three such points make no circle."""
    a, b = minus(via, start), minus(to, start)
    normal = cross(a, b)
    square = dot(normal, normal)
    if math.sqrt(square) <= COLLINEAR * math.hypot(*a) * math.hypot(*b):
        return

    mixed = minus(scaled(b, dot(a, a)), scaled(a, dot(b, b)))
    centre = scaled(cross(mixed, normal), 0.5 / square)  # seen from the start
    radius = math.hypot(*centre)
    ahead = scaled(centre, -1.0)
    aside = scaled(cross(normal, ahead), 1 / math.sqrt(square))
    out = minus(b, centre)
    sweep = 2 * math.pi if whole else math.atan2(dot(out, aside), dot(out, ahead)) % (2 * math.pi)
    for share in shares(radius * sweep):
        cos, sin = math.cos(share * sweep), math.sin(share * sweep)
        yield (
            start[0] + centre[0] + cos * ahead[0] + sin * aside[0],
            start[1] + centre[1] + cos * ahead[1] + sin * aside[1],
            start[2] + centre[2] + cos * ahead[2] + sin * aside[2],
        )


def shares(length: float) -> Iterator[float]:
    """Shares of a way, from 0 to 1, that are at most a STEP apart."""
    steps = max(1, math.ceil(length / STEP))
    return (step / steps for step in range(steps + 1))


def between(a: Sequence[float], b: Sequence[float], share: float) -> tuple[float, ...]:
    """The numbers at a share of the way from `a` to `b`."""
    return tuple(x + (y - x) * share for x, y in zip(a, b, strict=True))


def minus(a: Sequence[float], b: Sequence[float]) -> XYZ:
    """The way from `b` to `a`."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def scaled(a: XYZ, by: float) -> XYZ:
    """A way that is `by` times as long."""
    return a[0] * by, a[1] * by, a[2] * by


def dot(a: XYZ, b: XYZ) -> float:
    """The scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: XYZ, b: XYZ) -> XYZ:
    """The vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


Numbers = tuple[float, float, float, float]
Target = Callable[[Kinematics, Joints, Numbers], Joints]
Planned = Callable[[Kinematics, Joints, Numbers, Sequence[Lift]], Way]


def to_point(kinematics: Kinematics, _: Joints, numbers: Numbers) -> Joints:
    """The numbers are a place."""
    return kinematics.inverse(*numbers)


def to_joints(_: Kinematics, __: Joints, numbers: Numbers) -> Joints:
    """The numbers are joints."""
    return Joints(*numbers)


def by_point(kinematics: Kinematics, start: Joints, numbers: Numbers) -> Joints:
    """The numbers are added to the place."""
    x, y, z, r = (a + b for a, b in zip(kinematics.forward(*start), numbers, strict=True))
    return kinematics.inverse(x, y, z, r)


def by_joints(_: Kinematics, start: Joints, numbers: Numbers) -> Joints:
    """The numbers are added to the joints."""
    return Joints(*(a + b for a, b in zip(start, numbers, strict=True)))


def movj(target: Target) -> Planned:
    """The joints go there."""
    return lambda kinematics, start, numbers, _: turning(kinematics, start, target(kinematics, start, numbers))


def movl(target: Target) -> Planned:
    """The tool goes there on a line."""

    def plan(kinematics: Kinematics, start: Joints, numbers: Numbers, _: Sequence[Lift]) -> Way:
        end = target(kinematics, start, numbers)
        return straight(kinematics, start, kinematics.forward(*end))

    return plan


def jump(target: Target, *, along_line: bool = False) -> Planned:
    """The tool jumps there, with one of the lifts."""

    def plan(kinematics: Kinematics, start: Joints, numbers: Numbers, lifts: Sequence[Lift]) -> Way:
        end = target(kinematics, start, numbers)
        point = kinematics.forward(*end)
        ways = [jumping(kinematics, start, point, lift, along_line=along_line) for lift in lifts]
        return Way(tuple(place for way in ways for place in way.places), end)

    return plan


PTP: Mapping[c.PTPMode, Planned] = {
    c.PTPMode.JUMP_XYZ: jump(to_point),
    c.PTPMode.MOVJ_XYZ: movj(to_point),
    c.PTPMode.MOVL_XYZ: movl(to_point),
    c.PTPMode.JUMP_ANGLE: jump(to_joints),
    c.PTPMode.MOVJ_ANGLE: movj(to_joints),
    c.PTPMode.MOVL_ANGLE: movl(to_joints),
    c.PTPMode.MOVJ_INC: movj(by_joints),
    c.PTPMode.MOVL_INC: movl(by_point),
    c.PTPMode.MOVJ_XYZ_INC: movj(by_point),
    c.PTPMode.JUMP_MOVL_XYZ: jump(to_point, along_line=True),
}
