"""The elbow of a simulated arm with seven joints: it turns about the line from shoulder to wrist, which both stay.

    shoulder S --upper arm-- elbow E --forearm-- wrist W --- flange        joints 1 to 3, 4, 5 to 7

Its angle counts from where it is in the vertical plane through S and W. The upper arm and the forearm turn together, so
joint 4 stays, and joints 1 to 3 and 5 to 7 are found exactly: each three of them are a rotation about z, y and z.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product

from dobot_async.simulator.mycobot.kinematics import Chain

__all__ = ["elbow_angle", "turn_elbow"]

Vector = tuple[float, ...]
Rows = Sequence[Sequence[float]]
Ranges = Sequence[tuple[float, float]]
SMALL = 1e-6
STRETCHED = 0.5  # mm from the line, within which the elbow is on it
SLACK = 1e-6  # degrees
UP = (0.0, 0.0, 1.0)


def elbow_angle(chain: Chain, joints: Sequence[float]) -> float | None:
    """Return the angle of the elbow, degrees, -90 to 90; None for an arm that is stretched out: it has none then."""
    shoulder, elbow, wrist = (chain.frames(joints)[number].place for number in (2, 3, 5))
    to_wrist = minus(wrist, shoulder)
    axis = scaled(to_wrist, 1 / math.hypot(*to_wrist))
    side = across(minus(elbow, shoulder), axis)
    plane = across(UP, axis)
    if math.hypot(*side) < STRETCHED or math.hypot(*plane) < SMALL:
        return None

    angle = math.degrees(math.atan2(dot(axis, cross(plane, side)), dot(plane, side)))
    return math.remainder(angle, 180)  # above the line and below it are the same plane


def turn_elbow(chain: Chain, joints: Sequence[float], angle: float, limits: Ranges) -> Vector | None:
    """Return the joints with the elbow at an angle and the flange where it is; None if there are none within limits."""
    now = elbow_angle(chain, joints)
    if now is None:
        return None

    frames = chain.frames(joints)
    to_wrist = minus(frames[5].place, frames[2].place)
    turn = about(scaled(to_wrist, 1 / math.hypot(*to_wrist)), math.radians(angle - now))
    upper = times(turn, rotation_zyz(joints[:3]))
    fore = times(upper, rotation_y(joints[3]))
    hand = times(transposed(fore), frames[7].rotation)
    shoulder = nearest(upper, joints[:3], limits[:3])
    wrist = nearest(hand, joints[4:], limits[4:])
    return (*shoulder, joints[3], *wrist) if shoulder and wrist else None


def nearest(rotation: Rows, near: Sequence[float], limits: Ranges) -> Vector | None:
    """The three joints that make a rotation, within their limits, that are nearest to some others."""
    found = [
        each
        for solution in zyz(rotation, near)
        for each in product(*(whole_turns(angle, ends) for angle, ends in zip(solution, limits, strict=True)))
    ]
    return min(found, key=lambda each: max(abs(a - b) for a, b in zip(each, near, strict=True)), default=None)


def whole_turns(angle: float, ends: tuple[float, float]) -> list[float]:
    """An angle, and what is the same after a whole turn, within limits."""
    return [each for each in (angle - 360, angle, angle + 360) if ends[0] - SLACK <= each <= ends[1] + SLACK]


def zyz(rotation: Rows, near: Sequence[float]) -> list[Vector]:
    """The angles about z, y and z that make a rotation: two solutions, or any about the first where it is open."""
    m = rotation
    middle = math.degrees(math.acos(max(-1.0, min(1.0, m[2][2]))))
    if math.hypot(m[0][2], m[1][2]) < SMALL:
        both = math.degrees(math.atan2(m[1][0], m[0][0] if m[2][2] > 0 else -m[0][0]))
        return [(near[0], middle, both - near[0] if m[2][2] > 0 else near[0] - both)]

    first = math.degrees(math.atan2(m[1][2], m[0][2]))
    last = math.degrees(math.atan2(m[2][1], -m[2][0]))
    other = math.remainder(first + 180, 360), -middle, math.remainder(last + 180, 360)
    return [(first, middle, last), other]


def rotation_zyz(angles: Sequence[float]) -> Rows:
    """The rotation about z, y and z."""
    first, middle, last = angles
    return times(times(rotation_z(first), rotation_y(middle)), rotation_z(last))


def rotation_z(angle: float) -> Rows:
    """That about z."""
    return about(UP, math.radians(angle))


def rotation_y(angle: float) -> Rows:
    """That about y."""
    return about((0.0, 1.0, 0.0), math.radians(angle))


def about(axis: Sequence[float], angle: float) -> Rows:
    """The rotation about an axis of length 1 (Rodrigues)."""
    x, y, z = axis
    s, c = math.sin(angle), math.cos(angle)
    k = 1 - c
    return [
        [c + x * x * k, x * y * k - z * s, x * z * k + y * s],
        [y * x * k + z * s, c + y * y * k, y * z * k - x * s],
        [z * x * k - y * s, z * y * k + x * s, c + z * z * k],
    ]


def times(a: Rows, b: Rows) -> Rows:
    """One rotation after another."""
    columns = list(zip(*b, strict=True))
    return [[dot(row, column) for column in columns] for row in a]


def transposed(rows: Rows) -> Rows:
    """The rotation back."""
    return list(zip(*rows, strict=True))


def dot(a: Sequence[float], b: Sequence[float]) -> float:
    """The scalar product."""
    return sum(p * q for p, q in zip(a, b, strict=True))


def cross(a: Sequence[float], b: Sequence[float]) -> Vector:
    """The vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def minus(a: Sequence[float], b: Sequence[float]) -> Vector:
    """The way from one point to another."""
    return tuple(p - q for p, q in zip(a, b, strict=True))


def scaled(a: Sequence[float], factor: float) -> Vector:
    """A vector, longer or shorter."""
    return tuple(factor * p for p in a)


def across(a: Sequence[float], axis: Sequence[float]) -> Vector:
    """The part of a vector that is perpendicular to an axis."""
    return minus(a, scaled(axis, dot(a, axis)))
