"""What an ultraArm has mounted: its gripper until it rests, its laser until it is off."""

from __future__ import annotations

import asyncio
import math
from contextlib import suppress
from typing import Any

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.ultraarm import commands as c
from dobot_async.arms.ultraarm.channel import Channel
from dobot_async.errors import CommandRejected, ProtocolError

__all__ = ["darken", "wait_for_gripper"]

TOOLS: tuple[tuple[Command[Any, Any], Any], ...] = ((c.LASER_OFF, None), (c.SET_PWM, c.PWM(0)))
"""What switches the laser off."""

PACE = 0.05  # seconds between two looks at the gripper
SAME = 4  # looks in a row at which it stands still: it rests, at its opening or on what it holds


async def darken(channel: Channel) -> None:
    """Switch the laser off, until the arm has heard it."""
    for command, value in TOOLS:
        with suppress(CommandRejected):  # an arm that does not know it has none
            await channel.ask(command, value, timeout=math.inf, urgent=True)


async def wait_for_gripper(channel: Channel, value: c.GripperSet) -> None:
    """Return when the gripper rests; at once with firmware that does not tell where it is (M50).

    Raises:
        ReplyTimeout: The arm is silent.
    """
    mode = c.ModeOfGripper(value.mode)
    seen: list[int] = []
    while len(seen) < SAME or len(set(seen[-SAME:])) > 1:
        try:
            seen.append(await channel.ask(c.GET_GRIPPER_ANGLE, mode))
        except (CommandRejected, ProtocolError):
            return

        if abs(seen[-1] - value.opening) <= 1:
            return

        await asyncio.sleep(PACE)
