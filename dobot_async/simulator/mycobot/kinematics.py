"""Kinematics of simulated myCobots: a chain of joints, solved numerically; and a palletizer, whose flange stays level.

A point is x, y, z (mm) and rx, ry, rz (degrees); the palletizer's is x, y, z and one angle. Lengths are from drawings
of the vendor where there are any, and else chosen so that the reach is right; real arms differ by some mm.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from dobot_async.arms.mycobot.standstill import matrix

__all__ = ["KINEMATICS", "Chain", "InverseSolver", "Palletizer", "Transform"]

Vector = tuple[float, ...]
Ranges = Sequence[tuple[float, float]]
Matrix = Sequence[Sequence[float]]
ROUNDS = 60
NEAR = 0.01  # mm, and hundredths of a radian
LEVER = 100.0  # mm that a radian counts as
LONGEST_STEP = 15.0  # degrees
SEEDS = (20.0, -20.0, 50.0, -50.0, 80.0, -80.0)
ASIDE = (0.0, 60.0, -60.0)
SMALL = 1e-9


class Transform(NamedTuple):
    """A place and a rotation."""

    place: Sequence[float]
    rotation: Matrix

    @classmethod
    def of(cls, point: Sequence[float]) -> Transform:
        """That of a point; what is missing of its angles is 0."""
        angles = [*point[3:], 0.0, 0.0, 0.0][:3]
        return cls(tuple(point[:3]), matrix(angles))

    @property
    def point(self) -> Vector:
        """As x, y, z, rx, ry, rz."""
        r = self.rotation
        ry = math.asin(max(-1.0, min(1.0, -r[2][0])))
        if abs(r[2][0]) > 1 - SMALL:
            rx, rz = math.atan2(-r[1][2], r[1][1]), 0.0
        else:
            rx, rz = math.atan2(r[2][1], r[2][2]), math.atan2(r[1][0], r[0][0])

        return (*self.place, *map(math.degrees, (rx, ry, rz)))

    def then(self, other: Transform) -> Transform:
        """The other one, seen from where this one is seen from."""
        place = [p + sum(r * q for r, q in zip(row, other.place, strict=True)) for p, row in self.rows]
        columns = list(zip(*other.rotation, strict=True))
        rotation = [
            [sum(a * b for a, b in zip(row, column, strict=True)) for column in columns] for row in self.rotation
        ]
        return Transform(place, rotation)

    @property
    def inverse(self) -> Transform:
        """Where this one is seen from, seen from it."""
        rotation = [list(column) for column in zip(*self.rotation, strict=True)]
        place = [-sum(r * p for r, p in zip(row, self.place, strict=True)) for row in rotation]
        return Transform(place, rotation)

    @property
    def rows(self) -> zip[tuple[float, Sequence[float]]]:
        """The place and the rotation, row by row."""
        return zip(self.place, self.rotation, strict=True)


class InverseSolver(Protocol):
    """The kinematics of one model."""

    def forward(self, joints: Sequence[float]) -> Vector:
        """Returns the flange's point."""
        ...

    def inverse(
        self,
        point: Sequence[float],
        near: Sequence[float],
        limits: Ranges,
        *,
        seeds: bool = True,
    ) -> Vector | None:
        """Returns joints within their limits, near some others, that reach a point; None if none were found."""
        ...


@dataclass(frozen=True, slots=True)
class LinkParameters:
    """One joint and what it carries, after Denavit and Hartenberg: mm and degrees."""

    d: float
    a: float
    alpha: float
    offset: float = 0.0

    def frame(self, angle: float) -> Transform:
        """The next joint, seen from this one."""
        (s, c), (sa, ca) = ((math.sin(x), math.cos(x)) for x in map(math.radians, (angle + self.offset, self.alpha)))
        return Transform((self.a * c, self.a * s, self.d), [[c, -s * ca, s * sa], [s, c * ca, -c * sa], [0.0, sa, ca]])


class Chain:
    """Joints, each on the one before."""

    def __init__(self, *links: LinkParameters) -> None:
        self.links = links
        self.length = sum(math.hypot(link.a, link.d) for link in links)

    def forward(self, joints: Sequence[float]) -> Vector:
        """Returns the flange's point."""
        return self.frames(joints)[-1].point

    def inverse(
        self,
        point: Sequence[float],
        near: Sequence[float],
        limits: Ranges,
        *,
        seeds: bool = True,
    ) -> Vector | None:
        """Returns joints that reach a point: the nearest by damped least squares, from here or from other places."""
        goal = Transform.of(point)
        if math.hypot(*goal.place) > self.length:
            return None

        starts = [list(near)]
        if seeds:
            towards = math.degrees(math.atan2(goal.place[1], goal.place[0]))
            starts += [
                [math.remainder(towards + aside, 360), *(seed if n % 2 else -seed for n in range(1, len(near)))]
                for seed in SEEDS
                for aside in ASIDE
            ]

        for start in starts:
            found = self.solve(goal, start, limits)
            if found:
                return found

        return None

    def solve(self, goal: Transform, start: Sequence[float], limits: Ranges) -> Vector | None:
        """Steps towards the goal from one start."""
        joints = [min(max(joint, low), high) for joint, (low, high) in zip(start, limits, strict=True)]
        for _ in range(ROUNDS):
            frames = self.frames(joints)
            error = gap(frames[-1], goal)
            size = sum(each * each for each in error)
            if size < NEAR * NEAR:
                return tuple(joints)

            columns = [column(frame, frames[-1]) for frame in frames[:-1]]
            damping = 1e-2 * size + 1e-3
            rows = [
                [sum(a[i] * a[j] for a in columns) + (damping if i == j else 0.0) for j in range(6)] for i in range(6)
            ]
            weights = solved(rows, error)
            steps = [math.degrees(sum(w * a for w, a in zip(weights, each, strict=True))) for each in columns]
            scale = min(1.0, LONGEST_STEP / max(SMALL, *map(abs, steps)))
            joints = [
                min(max(joint + scale * step, low), high)
                for joint, step, (low, high) in zip(joints, steps, limits, strict=True)
            ]

        return None

    def frames(self, joints: Sequence[float]) -> list[Transform]:
        """The axis of each joint, and the flange at the end."""
        frames = [Transform((0.0, 0.0, 0.0), matrix((0.0, 0.0, 0.0)))]
        for link, joint in zip(self.links, joints, strict=True):
            frames.append(frames[-1].then(link.frame(joint)))

        return frames


@dataclass(frozen=True, slots=True)
class Palletizer:
    """Four joints: base, upper arm from the vertical, forearm from the horizontal, flange."""

    height: float
    upper: float
    fore: float
    reach: float

    def forward(self, joints: Sequence[float]) -> Vector:
        """Returns the flange's point."""
        j1, j2, j3 = map(math.radians, joints[:3])
        out = self.upper * math.sin(j2) + self.fore * math.cos(j3) + self.reach
        up = self.height + self.upper * math.cos(j2) - self.fore * math.sin(j3)
        return out * math.cos(j1), out * math.sin(j1), up, math.remainder(joints[0] + joints[3], 360)

    def inverse(
        self,
        point: Sequence[float],
        near: Sequence[float],  # noqa: ARG002 - there is one way, with the elbow up
        limits: Ranges,
        *,
        seeds: bool = True,  # noqa: ARG002 - nor is there anything to search for
    ) -> Vector | None:
        """Returns the joints that reach a point; None if it is out of reach."""
        x, y, z, turn = point
        out, up = math.hypot(x, y) - self.reach, z - self.height
        far = math.hypot(out, up)
        cosine = (far * far + self.upper**2 - self.fore**2) / (2 * self.upper * max(far, SMALL))
        if abs(cosine) > 1:
            return None

        j2 = math.atan2(out, up) - math.acos(cosine)
        j3 = math.atan2(self.upper * math.cos(j2) - up, out - self.upper * math.sin(j2))
        j1 = math.degrees(math.atan2(y, x))
        joints = (j1, math.degrees(j2), math.degrees(j3), math.remainder(turn - j1, 360))
        within = all(low - 1e-6 <= joint <= high + 1e-6 for joint, (low, high) in zip(joints, limits, strict=True))
        return joints if within else None


def gap(here: Transform, there: Transform) -> list[float]:
    """What is missing from one frame to another: mm, and radians as mm at the end of a lever."""
    a, b = here.rotation, there.rotation
    turn = [[sum(b[i][k] * a[j][k] for k in range(3)) for j in range(3)] for i in range(3)]
    cosine = max(-1.0, min(1.0, (turn[0][0] + turn[1][1] + turn[2][2] - 1) / 2))
    angle = math.acos(cosine)
    axis = [turn[2][1] - turn[1][2], turn[0][2] - turn[2][0], turn[1][0] - turn[0][1]]
    size = math.sqrt(sum(each * each for each in axis))
    if size < SMALL and angle > 1:
        axis, size = [1.0, 0.0, 0.0], 1.0  # half a turn: any way round will do

    factor = LEVER * angle / max(size, SMALL)
    return [*(b - a for a, b in zip(here.place, there.place, strict=True)), *(factor * each for each in axis)]


def column(joint: Transform, end: Transform) -> list[float]:
    """How the end moves with a joint: mm per radian, and its rotation at the end of a lever."""
    axis = [row[2] for row in joint.rotation]
    arm = [b - a for a, b in zip(joint.place, end.place, strict=True)]
    across = [
        axis[1] * arm[2] - axis[2] * arm[1],
        axis[2] * arm[0] - axis[0] * arm[2],
        axis[0] * arm[1] - axis[1] * arm[0],
    ]
    return [*across, *(LEVER * each for each in axis)]


def solved(rows: Sequence[Sequence[float]], right: Sequence[float]) -> list[float]:
    """Solves a positive definite system."""
    table = [[*row, value] for row, value in zip(rows, right, strict=True)]
    count = len(table)
    for i in range(count):
        for k in range(i + 1, count):
            factor = table[k][i] / table[i][i]
            table[k] = [a - factor * b for a, b in zip(table[k], table[i], strict=True)]

    found = [0.0] * count
    for i in reversed(range(count)):
        found[i] = (table[i][-1] - sum(table[i][k] * found[k] for k in range(i + 1, count))) / table[i][i]

    return found


def like_280(base: float, upper: float, fore: float, wrist: tuple[float, float, float]) -> Chain:
    """Six joints as those of a myCobot 280, in other lengths."""
    return Chain(
        LinkParameters(base, 0, 90),
        LinkParameters(0, -upper, 0, -90),
        LinkParameters(0, -fore, 0),
        LinkParameters(wrist[0], 0, 90, -90),
        LinkParameters(wrist[1], 0, -90, 90),
        LinkParameters(wrist[2], 0, 0),
    )


MYCOBOT_280 = like_280(131.22, 110.4, 96, (63.4, 75.05, 45.6))
KINEMATICS: Mapping[str, InverseSolver] = {
    "mycobot280": MYCOBOT_280,
    "mycobot280pi": MYCOBOT_280,
    "mycobot320": like_280(173.9, 135, 120, (88.78, 95, 65.5)),
    "mecharm270": Chain(
        LinkParameters(114, 0, -90),
        LinkParameters(0, 100, 0, -90),
        LinkParameters(0, 10, -90),
        LinkParameters(96, 0, 90),
        LinkParameters(0, 0, -90),
        LinkParameters(56.5, 0, 0),
    ),
    "myarm300": Chain(
        LinkParameters(170, 0, -90),
        LinkParameters(0, 0, 90),
        LinkParameters(125, 0, -90),
        LinkParameters(0, 0, 90),
        LinkParameters(125, 0, -90),
        LinkParameters(0, 0, 90),
        LinkParameters(60, 0, 0),
    ),
    "mypalletizer260": Palletizer(123, 130, 130, 0),
}
"""The kinematics of each model."""
