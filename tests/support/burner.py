"""What a simulated Magician has burnt with its laser, by its own record.

Each way that was burnt is there with its end and its outcome; one that was broken off has ended where the arm stood.
What is burnt once, and wholly, is as long as the toolpath, and has each of its ends once.
"""

from __future__ import annotations

import math

from dobot_async.arms.magician import commands as m
from dobot_async.simulator import Simulation
from dobot_async.toolpath import Stroke, Toolpath, WorkPlane

__all__ = ["Burner", "as_burnt", "ends_of"]


class Burner:
    """What a simulated Magician has burnt: the ends of whole ways in order, and the length of all of it."""

    def __init__(self, sim: Simulation) -> None:
        self._sim = sim
        self._seen = 0
        self._place = (0.0, 0.0, 0.0)
        self.ends: list[tuple[float, float]] = []
        self.length = 0.0

    def look(self) -> None:
        """Take what was recorded since; the arm must stand where that has ended."""
        new, pose = self._sim.arm.executed[self._seen :], self._sim.arm.pose
        self._seen += len(new)
        records = [record for record in new if record.command in {m.SET_CPLE_CMD, m.SET_PTP_CMD}]
        for number, record in enumerate(records):
            value = record.value
            target = (value.x, value.y, value.z)
            broken = record.outcome != "done"
            assert not broken or number == len(records) - 1, "something went on after it"
            end = (pose.x, pose.y, pose.z) if broken else target
            if record.command is m.SET_CPLE_CMD and value.power:
                self.length += math.dist(self._place, end)
                if not broken or math.dist(end, target) < 0.01:
                    self.ends.append((round(value.x, 2), round(value.y, 2)))

            self._place = end


def as_burnt(path: Toolpath) -> Toolpath:
    """It with dots as the lines of 0.1 mm that the documentation promises."""
    return Toolpath(
        tuple(
            stroke if len(stroke.points) > 1 else Stroke((stroke.start, (stroke.start[0] + 0.1, stroke.start[1])))
            for stroke in path
        )
    )


def ends_of(path: Toolpath, plane: WorkPlane) -> list[tuple[float, float]]:
    places = [plane.to_arm(*point) for stroke in path for point in stroke.points[1:]]
    return [(round(x, 2), round(y, 2)) for x, y, _ in places]
