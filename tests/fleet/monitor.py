"""Watches where the tools of simulated arms really are. It knows the arms' true joints, and nothing of the driver.

Its kinematics is written from the drawing of the arm in the vendor's manual, for itself: the rear arm of 135 mm stands
upright at joint 2 = 0, the forearm of 147 mm lies level at joint 3 = 0 and sinks with it, and the tool is carried level
in front of the wrist.

A tool is on an arm from the moment at which the arm was told of it, and stays on it when the arm is switched off,
although the arm forgets it.
"""

from __future__ import annotations

import asyncio
import cmath
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from dobot_async.arms.magician import commands as c
from dobot_async.simulator import Simulation

__all__ = ["Monitor", "Stand", "Violation", "Zone", "true_joints"]

LOOK = 0.004  # virtual seconds between two looks


def true_joints(sim: Simulation) -> tuple[float, ...]:
    """Where the joints of an arm, and its rail, really are; the arm may believe something else."""
    pose = sim.arm.true_pose
    return pose.j1, pose.j2, pose.j3, pose.j4, sim.arm.true_rail


class Violation(AssertionError):
    """What must hold does not."""


@dataclass(frozen=True)
class Zone:
    """A box, or an upright cylinder if it has a radius: centre, and half of its sizes; mm."""

    centre: tuple[float, float, float]
    half: tuple[float, float, float]
    radius: float = 0.0

    def has(self, place: tuple[float, float, float], margin: float = 0.0) -> bool:
        """Whether a place is inside, or so near."""
        away = [abs(a - b) - margin for a, b in zip(place, self.centre, strict=True)]
        beside = math.dist(place[:2], self.centre[:2]) - margin
        flat = beside < self.radius if self.radius else away[0] < self.half[0] and away[1] < self.half[1]
        return flat and away[2] < self.half[2]


@dataclass(frozen=True)
class Stand:
    """Where an arm stands in the cell, and where its rail leads, if it is on one; mm and degrees."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    yaw: float = 0.0
    rail: float | None = None

    def tool(self, joints: tuple[float, ...], tool: tuple[float, float, float]) -> tuple[float, float, float]:
        """Where in the cell a tool is that is so far ahead of the wrist, beside and below it."""
        base, rear, fore, _, rail = joints
        ahead = 135 * math.cos(math.radians(90 - rear)) + 147 * math.cos(math.radians(fore)) + tool[0]
        height = 135 * math.sin(math.radians(90 - rear)) - 147 * math.sin(math.radians(fore)) - tool[2]
        flat = complex(ahead, tool[1]) * cmath.rect(1, math.radians(base))
        if self.rail is not None:
            flat += cmath.rect(rail, math.radians(self.rail))

        flat = flat * cmath.rect(1, math.radians(self.yaw)) + complex(self.x, self.y)
        return flat.real, flat.imag, self.z + height


@dataclass
class Monitor:
    """Looks at all arms again and again.

    Attributes:
        seen: How often tools were seen in zones.
    """

    sims: Mapping[str, Simulation]
    stands: Mapping[str, Stand]
    zones: Mapping[str, Zone]
    seen: int = 0
    _kept: dict[str, tuple[float, float, float]] = field(default_factory=dict)

    def tool(self, name: str) -> tuple[float, float, float]:
        """The tool that is on an arm: ahead, beside, below."""
        bias = self.told(name)
        kept = self._kept.get(name)
        if kept and bias != self._forgotten(name):
            del self._kept[name]  # it was told of another one since
            kept = None

        return kept or bias

    def told(self, name: str) -> tuple[float, float, float]:
        """The tool that an arm was told of."""
        bias = self.sims[name].arm.state.get(c.SET_END_EFFECTOR_PARAMS)
        return bias.x_bias, bias.y_bias, bias.z_bias

    def switch_off_and_on(self, name: str) -> None:
        """Switches an arm off and on; its tool stays where it is."""
        self._kept[name] = self.tool(name)
        self.sims[name].arm.power_cycle()

    def place(self, name: str) -> tuple[float, float, float]:
        """Where a tool is."""
        return self.stands[name].tool(true_joints(self.sims[name]), self.tool(name))

    def look(self) -> None:
        """Looks once; raises Violation if two tools are in one zone."""
        places = {name: self.place(name) for name in self.sims}
        for zone, shape in self.zones.items():
            inside = [name for name, place in places.items() if shape.has(place)]
            self.seen += len(inside)
            if len(inside) > 1:
                raise Violation(f"{inside} are in zone {zone}, at {[places[name] for name in inside]}")

    async def watch(self) -> Any:
        """Looks until it is cancelled."""
        while True:
            self.look()
            await asyncio.sleep(LOOK)

    def _forgotten(self, name: str) -> tuple[float, float, float]:
        """The tool that an arm takes for granted after it was switched on."""
        return 59.7, 0.0, 0.0
