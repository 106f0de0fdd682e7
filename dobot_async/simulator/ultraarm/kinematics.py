"""The geometry of a simulated ultraArm P340.

It is inferred from the ranges that the vendor's library names (x up to 365.55 mm, z up to 130 mm): two links
of 130 and 160 mm, and 75.55 mm of shoulder and wrist, of which 235.55 mm stand ahead with all joints at 0. It is
good enough to have points, joints and limits that belong together, and not to be relied on for a real arm.
"""

from __future__ import annotations

import math

from dobot_async.arms.ultraarm import commands as c
from dobot_async.simulator.device.work import DeviceFault, Vector

__all__ = ["LIMIT", "OUT_OF_REACH", "REACH", "checked", "forward", "inverse"]

UPPER, FORE, OFFSET = 130.0, 160.0, 75.55
REACH = c.LIBRARY_LIMITS
OUT_OF_REACH, LIMIT = 1, 2  # codes of faults


def forward(joints: Vector) -> Vector:
    """Returns x, y, z (mm) and the fourth joint."""
    j1, j2, j3, j4 = (*map(math.radians, joints[:3]), joints[3])
    radius = OFFSET + UPPER * math.sin(j2) + FORE * math.cos(j3)
    return radius * math.cos(j1), radius * math.sin(j1), UPPER * math.cos(j2) - FORE * math.sin(j3), j4


def inverse(point: Vector) -> Vector:
    """Returns the joints of a point; raises Fault where there are none, or a limit forbids them."""
    x, y, z, e = point
    ahead = math.hypot(x, y) - OFFSET
    distance = math.hypot(ahead, z)
    if not abs(UPPER - FORE) < distance <= UPPER + FORE:
        raise DeviceFault(OUT_OF_REACH)

    opening = (UPPER**2 + distance**2 - FORE**2) / (2 * UPPER * distance)
    upper = math.atan2(z, ahead) + math.acos(max(-1.0, min(1.0, opening)))
    fore = math.atan2(z - UPPER * math.sin(upper), ahead - UPPER * math.cos(upper))
    return checked((math.degrees(math.atan2(y, x)), 90 - math.degrees(upper), -math.degrees(fore), e))


def checked(joints: Vector) -> Vector:
    """Returns the joints; raises Fault beyond a limit."""
    for value, (low, high) in zip(joints, (REACH.j1, REACH.j2, REACH.j3, REACH.j4), strict=True):
        if not low - 1e-6 <= value <= high + 1e-6:
            raise DeviceFault(LIMIT)

    return joints
