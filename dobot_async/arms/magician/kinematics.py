"""Where the Magician's tool is for given joints, and which joints bring it to a given place. Pure arithmetic.

              j3  forearm 147            x forward, y left, z up; mm and degrees
              o----------.               origin: where the axes of joints 1 and 2 meet (not the table)
    rear arm /            `--o---[]      j1: base; j2: rear arm, from the vertical, forward positive
      135   /           wrist  x_bias    j3: forearm, from the horizontal, down positive, whatever j2 is
         j2 o                            j4: tool; r = j1 + j4
        ____|____ j1

Two parallelograms hold the tool upright, so j3 does not add to j2, but they bind the two to each other
(`JointLimits.fold`). `x_bias` is the whole horizontal distance from wrist to tool: 59.7 suction cup and gripper,
61 pen, 70 laser.

Limits differ from arm to arm and from source to source. They are advice: the arm itself is the judge.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

__all__ = ["FOREARM", "REAR_ARM", "JointLimits", "Joints", "Kinematics", "Point", "Unreachable"]

REAR_ARM, FOREARM = 135.0, 147.0
LIMIT_TOLERANCE = 0.05  # degrees; a smaller excess would not show in the message, and no arm keeps it
SINGULAR, NO_SOLUTION, BEYOND_LIMIT = 0x10, 0x11, 0x12


class Joints(NamedTuple):
    """The four joint angles in degrees."""

    j1: float
    j2: float
    j3: float
    j4: float


class Point(NamedTuple):
    """The tool: x, y, z in mm and its rotation r in degrees."""

    x: float
    y: float
    z: float
    r: float


class Unreachable(ValueError):
    """The arm cannot go there; the message says why, in numbers.

    Attributes:
        alarm: The code of the alarm that the arm would raise: 0x10 singular, 0x11 no solution, 0x12 joint limits.
    """

    def __init__(self, message: str, alarm: int) -> None:
        super().__init__(message)
        self.alarm = alarm


@dataclass(frozen=True, slots=True)
class JointLimits:
    """Lowest and highest angle of each joint, in degrees.

    The defaults are the widest that any source states for a Magician, so that nothing is refused that some arm can do:
    joints 1, 2 and 4 and the lower end of joint 3 as measured for magician_ros2, the upper end of joint 3 from the
    vendor's ALARM Description V1.0.1, table 3.4 (the measured 60 would forbid z < 0 near the base, where arms do work,
    and one that was taught by hand stood at 85.3). With the default x_bias all places 200
    to 300 mm from the axis of joint 1 pass at z -50 to 100. Of the usual work area, x 150 to 300, y -150 to 150,
    z -50 to 150, what fails is high and near (the rear arm would lean back), far out in the corners (stretched), and
    the last few mm low and near.

    Attributes:
        j1: Base.
        j2: Rear arm.
        j3: Forearm.
        j4: Tool.
        fold: j2 - j3. The upper end is the parallelogram stretched: from j2 = 40 on it lifts the lower end of joint 3
            by as much as j2 grows. The lower end is the parallelogram folded, near the base.
    """

    j1: tuple[float, float] = (-125.0, 125.0)
    j2: tuple[float, float] = (-5.0, 90.0)
    j3: tuple[float, float] = (-15.0, 90.0)
    j4: tuple[float, float] = (-150.0, 150.0)
    fold: tuple[float, float] = (-70.0, 55.0)

    def span(self, number: int, joints: tuple[float, ...]) -> tuple[float, float]:
        """Returns how low and how high joint `number` (1 to 4) may stand while the others stand as they do.

        Args:
            number: 1 to 4.
            joints: The angles of all four, degrees.
        """
        low, high = (self.j1, self.j2, self.j3, self.j4)[number - 1]
        if number == 2:
            return max(low, joints[2] + self.fold[0]), min(high, joints[2] + self.fold[1])

        if number == 3:
            return max(low, joints[1] - self.fold[1]), min(high, joints[1] - self.fold[0])

        return low, high

    def problems(self, joints: tuple[float, ...]) -> list[str]:
        """Returns what is wrong with these joints, a phrase for each; empty if nothing is.

        Args:
            joints: The angles of all four, degrees.
        """
        found: list[str] = []
        for number, angle in enumerate(joints, start=1):
            low, high = (self.j1, self.j2, self.j3, self.j4)[number - 1]
            where = ""
            if number == 3 and low <= angle <= high:
                low, high = self.span(3, joints)
                where = f" with joint 2 at {joints[1]:.1f}"
            limit = low if angle < low else high
            if max(low - angle, angle - high) > LIMIT_TOLERANCE:
                found.append(f"joint {number} would be {angle:.1f} degrees, limit {round(limit, 1):g}{where}")

        return found


@dataclass(frozen=True, slots=True)
class Kinematics:
    """The arm's geometry with one end effector.

    Attributes:
        x_bias: mm from the wrist forward to the tool, as in EndEffectorParams (manual 2.9.1).
        y_bias: mm from the wrist to the left.
        z_bias: mm by which the tool reports itself lower than the flange. Scripts for the Magician leave it 0; its sign
            is the Magician Lite's.
        limits: What `check` and `check_joints` allow.
    """

    x_bias: float = 59.7
    y_bias: float = 0.0
    z_bias: float = 0.0
    limits: JointLimits = JointLimits()

    def forward(self, j1: float, j2: float, j3: float, j4: float) -> Point:
        """Returns where the tool is; any angles will do.

        Args:
            j1: Degrees, the base.
            j2: Degrees, the rear arm.
            j3: Degrees, the forearm.
            j4: Degrees, the tool.
        """
        a1, a2, a3 = math.radians(j1), math.radians(j2), math.radians(j3)
        out = REAR_ARM * math.sin(a2) + FOREARM * math.cos(a3) + self.x_bias
        up = REAR_ARM * math.cos(a2) - FOREARM * math.sin(a3) - self.z_bias
        cos, sin = math.cos(a1), math.sin(a1)
        return Point(out * cos - self.y_bias * sin, out * sin + self.y_bias * cos, up, j1 + j4)

    def inverse(self, x: float, y: float, z: float, r: float) -> Joints:
        """Returns the joints that bring the tool there, whatever their limits.

        Args:
            x: mm, forward.
            y: mm, to the left.
            z: mm, up.
            r: Degrees, the tool's rotation.

        Raises:
            ValueError: A number is not finite.
            Unreachable: No joints do; `alarm` is 0x10 (on the axis of joint 1) or 0x11 (too far, too near).
        """
        if not all(map(math.isfinite, (x, y, z, r))):
            raise ValueError(f"x, y, z and r must be finite, not {x!r}, {y!r}, {z!r}, {r!r}")

        out = self._distance_out(x, y)
        ahead, up = out - self.x_bias, z + self.z_bias
        wrist = math.hypot(ahead, up)
        self._check_wrist(wrist, f"({x:.1f}, {y:.1f}, {z:.1f})")

        cosine = (REAR_ARM**2 + wrist**2 - FOREARM**2) / (2 * REAR_ARM * wrist)
        raised = math.acos(max(-1.0, min(1.0, cosine))) + math.atan2(up, ahead)
        j1 = math.remainder(math.degrees(math.atan2(y, x) - math.atan2(self.y_bias, out)), 360.0)
        sunk = math.atan2(REAR_ARM * math.sin(raised) - up, ahead - REAR_ARM * math.cos(raised))
        return Joints(j1, 90.0 - math.degrees(raised), math.degrees(sunk), r - j1)

    def check(self, x: float, y: float, z: float, r: float) -> Joints:
        """Returns the joints that bring the tool there, within their limits.

        Args:
            x: mm, forward.
            y: mm, to the left.
            z: mm, up.
            r: Degrees, the tool's rotation.

        Raises:
            ValueError: A number is not finite.
            Unreachable: As `inverse`, and with `alarm` 0x12 where joints would pass their limits.
        """
        joints = self.inverse(x, y, z, r)
        problems = self.limits.problems(joints)
        if problems:
            raise Unreachable(
                f"({x:.1f}, {y:.1f}, {z:.1f}, {r:.1f}) is out of reach: {'; '.join(problems)}", BEYOND_LIMIT
            )

        return joints

    def check_joints(self, j1: float, j2: float, j3: float, j4: float) -> None:
        """Raises Unreachable (`alarm` 0x12) if joints pass their limits.

        Args:
            j1: Degrees, the base.
            j2: Degrees, the rear arm.
            j3: Degrees, the forearm.
            j4: Degrees, the tool.

        Raises:
            ValueError: An angle is not finite.
        """
        joints = (j1, j2, j3, j4)
        if not all(map(math.isfinite, joints)):
            raise ValueError(f"joint angles must be finite, not {joints!r}")

        problems = self.limits.problems(joints)
        if problems:
            raise Unreachable(f"these joints are out of reach: {'; '.join(problems)}", BEYOND_LIMIT)

    def _distance_out(self, x: float, y: float) -> float:
        """How far in front of the axis of joint 1 the tool is, seen along the arm."""
        square = x * x + y * y - self.y_bias**2
        if x == y == 0:
            raise Unreachable(f"({x:.1f}, {y:.1f}) is on the axis of joint 1: there is no way to turn there", SINGULAR)

        if square < 0:
            raise Unreachable(
                f"({x:.1f}, {y:.1f}) is too near: {math.hypot(x, y):.1f} mm from the axis of joint 1, "
                f"and the tool is {abs(self.y_bias):.1f} mm beside the arm (y_bias)",
                NO_SOLUTION,
            )

        return math.sqrt(square)

    def _check_wrist(self, wrist: float, place: str) -> None:
        """Refuses a wrist that the two links cannot reach."""
        reach, nearest = REAR_ARM + FOREARM, FOREARM - REAR_ARM
        if wrist > reach * (1 + 1e-9):
            raise Unreachable(
                f"{place} is too far: the wrist would be {wrist:.1f} mm from the shoulder, "
                f"the arm reaches {reach:.1f} mm",
                NO_SOLUTION,
            )

        if wrist < nearest * (1 - 1e-9):
            raise Unreachable(
                f"{place} is too near: the wrist would be {wrist:.1f} mm from the shoulder, "
                f"the arm folds to {nearest:.1f} mm",
                NO_SOLUTION,
            )
