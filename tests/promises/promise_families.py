"""The three families as the promises see them; imports no more than a user's program does."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from contextlib import AbstractAsyncContextManager
from dataclasses import dataclass, field
from typing import Any

from dobot_async import Jog, Magician, MyCobot, UltraArm, UltraArmJog
from dobot_async.arms.magician import commands as magician
from dobot_async.arms.mycobot import commands as mycobot
from dobot_async.arms.ultraarm import commands as ultraarm

__all__ = ["BY_NAME", "FAMILIES", "Family"]


@dataclass(frozen=True)
class Family:
    """One family.

    Attributes:
        name: Its name.
        model: What `simulate` calls it.
        kind: Its class.
        near: Joints near the place where it wakes up.
        far: Joints far from it.
        row: A row of its table that reads.
        jog: A direction with a long way to go.
        read: Asks it something.
        slow: The simulator's speed at which the way from near to far takes minutes.
        details: What `simulate` needs, so that the arm can move.
    """

    name: str
    model: str
    kind: Any
    near: tuple[float, ...]
    far: tuple[float, ...]
    row: Any
    jog: Any
    read: Callable[[Any], Awaitable[Any]]
    slow: float
    details: Mapping[str, Any] = field(default_factory=dict, compare=False)

    def connect(self, url: str, **options: Any) -> AbstractAsyncContextManager[Any]:
        """Its `connect`."""
        connection: AbstractAsyncContextManager[Any] = self.kind.connect(url, **options)
        return connection


FAMILIES = (
    Family(
        name="magician",
        model="magician",
        kind=Magician,
        near=(0, 40, 40, 0),
        far=(85, 40, 40, 0),
        row=magician.GET_POSE,
        jog=Jog.J1_PLUS,
        read=lambda arm: arm.get_pose(),
        slow=0.01,
    ),
    Family(
        name="mycobot",
        model="mycobot280",
        kind=MyCobot,
        near=(10, 0, 0, 0, 0, 0),
        far=(150, 0, 0, 0, 0, 0),
        row=mycobot.GET_ANGLES,
        jog="j1+",
        read=lambda arm: arm.get_angles(),
        slow=0.05,  # more slowly, and it would not be seen to set out
    ),
    Family(
        name="ultraarm",
        model="ultraarm",
        kind=UltraArm,
        near=(10, 10, 10),
        far=(160, 10, 10),
        row=ultraarm.GET_ANGLES,
        jog=UltraArmJog.J1_PLUS,
        read=lambda arm: arm.get_angles(),
        slow=0.02,
        details={"homed": True},
    ),
)
BY_NAME = {family.name: family for family in FAMILIES}
