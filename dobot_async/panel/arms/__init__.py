"""The families of arms as the panel shows them: the one place that knows all of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from dobot_async import Magician, MyCobot, UltraArm
from dobot_async.panel.arms.base import ArmView
from dobot_async.panel.arms.magician import MagicianView
from dobot_async.panel.arms.mycobot import CobotView
from dobot_async.panel.arms.ultraarm import UltraArmView

__all__ = ["KINDS", "ArmView", "view_of"]

VIEWS: Mapping[type, Callable[[Any], ArmView]] = {Magician: MagicianView, MyCobot: CobotView, UltraArm: UltraArmView}
KINDS: Mapping[type, str] = {Magician: "magician", MyCobot: "mycobot", UltraArm: "ultraarm"}
"""The family of each class."""


def view_of(arm: object) -> ArmView:
    """Return an arm as the panel knows it; raise TypeError for what is none."""
    for kind, make in VIEWS.items():
        if isinstance(arm, kind):
            return make(arm)

    raise TypeError(f"expected a Magician, a MyCobot or an UltraArm, not {arm!r}")
