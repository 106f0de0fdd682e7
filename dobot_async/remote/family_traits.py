"""What remote actions have to know of each family: how a speed in percent is set, and which tools it has.

Magician   the ratio of all PTP motions, set before each action
myCobot    `speed=` of each motion, percent
ultraArm   `speed=` of each motion, 2 mm/s a percent
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from dobot_async.arms.magician.arm import Magician
from dobot_async.arms.mycobot.arm import MyCobot
from dobot_async.arms.ultraarm.arm import UltraArm

__all__ = ["FAMILY_TRAITS", "FamilyTraits", "traits_of"]

FASTEST_PEN = 100.0
"""mm/s of a pen at 100 percent."""

HOMING = 10
"""Percent, what a myCobot's `home` has."""


@dataclass(frozen=True, slots=True)
class FamilyTraits:
    """One family.

    Attributes:
        title: What it is called.
        pace: Tells the arm a speed in percent.
        moves: What `move_to` takes to go at a speed in percent.
        home: What `home` takes.
        pen: What a `Drawing` takes.
        options: What `connect` is given besides.
        turns: Whether `move_to` takes the tool's rotation `r`.
        tools: What it can grip with.
    """

    title: str
    pace: Callable[[Any, float], Awaitable[None]]
    moves: Callable[[float], Mapping[str, Any]]
    home: Callable[[float], Mapping[str, Any]]
    pen: Callable[[float], Mapping[str, Any]]
    options: Mapping[str, Any] = field(default_factory=dict[str, Any])
    turns: bool = False
    tools: tuple[str, ...] = ("suction", "gripper")


async def each_motion_says_it(_arm: object, _percent: float) -> None:
    """Tell the arm nothing."""


def nothing(_percent: float) -> Mapping[str, Any]:
    """Say nothing with a motion."""
    return {}


def whole(percent: float) -> int:
    """A speed that the arm takes."""
    return max(1, int(percent))


def millimetres(percent: float) -> Mapping[str, Any]:
    """The speed of a pen."""
    return {"speed": FASTEST_PEN * percent / 100}


FAMILY_TRAITS: Mapping[type, FamilyTraits] = {
    Magician: FamilyTraits(
        "Dobot Magician",
        lambda arm, percent: arm.set_speed(percent),
        nothing,
        nothing,
        millimetres,
        options={"check_reach": True},
        turns=True,
    ),
    MyCobot: FamilyTraits(
        "myCobot",
        each_motion_says_it,
        lambda percent: {"speed": whole(percent)},
        lambda percent: {"speed": min(HOMING, whole(percent))},
        lambda percent: {"percent": whole(percent)},
        tools=("gripper",),
    ),
    UltraArm: FamilyTraits(
        "ultraArm P340",
        each_motion_says_it,
        lambda percent: {"speed": max(1.0, 2 * percent)},
        nothing,
        millimetres,
    ),
}


def traits_of(kind: type) -> FamilyTraits:
    """Return what is known of an arm's class; raise ValueError for one of another family."""
    for family, traits in FAMILY_TRAITS.items():
        if issubclass(kind, family):
            return traits

    raise ValueError(f"nothing is known of how fast a {kind.__name__} may go")
