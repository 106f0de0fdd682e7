"""What is known of an arm at one time, in numbers: of a connected arm, or of one behind a bridge."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from dobot_async._core.link.link import Link
from dobot_async._core.protocol.contract import LinkState, LinkStats
from dobot_async.arms.base import Arm
from dobot_async.bridge import Bridge
from dobot_async.errors import DobotError

__all__ = ["ArmFigures", "figures_of", "figures_of_bridge", "read_figures"]

PATIENCE = 2.0
"""Seconds within which an arm has told its alarms, or is not waited for."""


@dataclass(frozen=True, slots=True)
class ArmFigures:
    """The figures of one arm; None stands for what is not known.

    Attributes:
        state: Of the link.
        stats: What went over the link so far.
        outages: How often the link was lost and reopened.
        round_trip: Seconds that an answer takes on the average.
        pending: Commands that the arm has accepted, and that are not known to have ended.
        motions: How many motions ended, by how.
        alarms: How many alarms are set.
        moving: Whether the arm is in the middle of something.
        clients: Of a bridge: how many there are.
        stops: Of a bridge: how often something stopped the arm.
        held: Of a bridge, or of MQTT: whether somebody has the lease.
    """

    state: LinkState
    stats: LinkStats
    outages: int
    round_trip: float | None = None
    pending: int | None = None
    motions: Mapping[str, int] = field(default_factory=dict[str, int])
    alarms: int | None = None
    moving: bool | None = None
    clients: int | None = None
    stops: int | None = None
    held: bool | None = None

    @property
    def up(self) -> bool:
        """Whether the link is open."""
        return self.state is LinkState.OPEN


def of_link(link: Link[Any], **more: Any) -> ArmFigures:
    """The figures of a link, and some more."""
    return ArmFigures(link.state.value, link.stats, link.outages, link.round_trip, **more)


def figures_of(arm: Arm, *, alarms: int | None = None, held: bool | None = None) -> ArmFigures:
    """Return what this program knows of an arm; asks the arm for nothing.

    Args:
        arm: A connected arm of any family.
        alarms: How many alarms are set, if that is known.
        held: Whether somebody has a lease on it.
    """
    queue = arm.queue
    pending = queue.pending
    return of_link(
        arm.link, pending=pending, moving=pending > 0, motions=dict(queue.outcomes), alarms=alarms, held=held
    )


async def read_figures(arm: Arm, *, held: bool | None = None) -> ArmFigures:
    """Return what this program knows of an arm, and how many alarms the arm tells; None if it does not answer.

    Args:
        arm: A connected arm of any family.
        held: Whether somebody has a lease on it.
    """
    alarms = None
    if arm.link.state.value is LinkState.OPEN:
        try:
            alarms = len(await arm.get_alarms(timeout=PATIENCE))
        except DobotError:
            alarms = None

    return figures_of(arm, alarms=alarms, held=held)


async def figures_of_bridge(bridge: Bridge[Any]) -> ArmFigures:
    """Return the figures of an arm behind a bridge of this program: the arm is asked as one of its clients would.

    Args:
        bridge: A bridge that runs.
    """
    alarms = moving = None
    readings = bridge.family.readings
    if bridge.link.state.value is LinkState.OPEN:
        try:
            moving = bridge.moving(await bridge.ask(readings["motion"].request))
            if "alarms" in readings:
                told = readings["alarms"].tell(await bridge.ask(readings["alarms"].request))
                alarms = len(told["alarms"])
        except DobotError:
            pass  # the figures of the link tell that it does not answer

    return of_link(
        bridge.link,
        alarms=alarms,
        moving=moving,
        clients=bridge.clients,
        stops=bridge.stops,
        held=bridge.holder is not None,
    )
