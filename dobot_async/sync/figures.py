"""Figures of arms, for programs without asyncio.

Written by tests/sync/write_sync.py: change what that reads, and run it again.
"""

from __future__ import annotations

from dobot_async.metrics import figures_of as async_figures_of
from dobot_async.metrics import read_figures as async_read_figures
from dobot_async.metrics.figures import ArmFigures
from dobot_async.sync.given import arm_of
from dobot_async.sync.portal import PORTAL
from dobot_async.sync.twins import AnyArm

__all__ = ["figures_of", "read_figures"]


def figures_of(arm: AnyArm, *, alarms: int | None = None, held: bool | None = None) -> ArmFigures:
    """Return what this program knows of an arm; asks the arm for nothing.

    Args:
        arm: A connected arm of any family.
        alarms: How many alarms are set, if that is known.
        held: Whether somebody has a lease on it.
    """
    return PORTAL.look(lambda: async_figures_of(arm_of(arm), alarms=alarms, held=held))


def read_figures(arm: AnyArm, *, held: bool | None = None) -> ArmFigures:
    """Return what this program knows of an arm, and how many alarms the arm tells; None if it does not answer.

    Args:
        arm: A connected arm of any family.
        held: Whether somebody has a lease on it.
    """
    return PORTAL.run(lambda: async_read_figures(arm_of(arm), held=held))
