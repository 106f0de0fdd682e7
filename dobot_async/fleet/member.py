"""The description of an arm before its fleet connects it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

from dobot_async._core.util.shapes import Box
from dobot_async.fleet.families import family_of
from dobot_async.fleet.frames import BaseFrame
from dobot_async.fleet.guard import Mode

__all__ = ["Member"]

A = TypeVar("A")


@dataclass(frozen=True)
class Member(Generic[A]):
    """An arm that is to be in a fleet.

    Attributes:
        url: Where it is.
        kind: Its class: Magician, MyCobot or UltraArm.
        options: What `connect` of its class takes beside the URL, such as {"model": "myarm300"}.
        base: Where it stands in the cell.
        group: The name of its group; None for the whole fleet.
        guard: "wait" lets its motions wait for zones that others hold, "raise" refuses them, "off" looks at none.
        clearance: mm around the tool that have to stay out of such zones.
        limits: Where in the cell its tool may be at all; None leaves it to the arm.
        rail: For a Magician on a rail: the direction in which l grows, in degrees to the left of the arm's x axis, with
            `base` where the arm stands at l = 0. None: a guarded arm refuses `l`.
    """

    url: str
    kind: type[A]
    options: Mapping[str, Any] = field(default_factory=dict[str, Any])
    base: BaseFrame = field(default_factory=BaseFrame)
    group: str | None = None
    guard: Mode = "off"
    clearance: float = 0.0
    limits: Box | None = None
    rail: float | None = None

    def __post_init__(self) -> None:
        family = family_of(self.kind)
        if self.guard not in {"off", "wait", "raise"} or not self.clearance >= 0:
            raise ValueError('expected guard "off", "wait" or "raise", and clearance >= 0')

        if self.limits and (family.name != "magician" or self.guard == "off"):
            raise ValueError("limits are kept by the guard, and of a Magician alone: the ways of others are not known")

        if self.rail is not None and (family.name != "magician" or not math.isfinite(self.rail)):
            raise ValueError(f"rail is the direction of a Magician's rail in degrees, not {self.rail!r}")
