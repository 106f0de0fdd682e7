"""How the gripper of a myCobot does one command: told, and watched until it rests.

    tell --> look, look, look --> done             it rests where it was to go, or was to close and has, on a piece
                                  |  MotionStopped     it was to open, and rests before that
                                  |  CommandRejected   it did not move
                                  `  MotionUnknown     it does not come to rest, or the firmware tells nothing of it

The gripper is watched by its value and by its moving flag. A gripper that is told to close and does not move may hold a
piece already: that is believed if the arm has acknowledged the command, else the command may have been lost.
"""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
from functools import partial
from typing import Any

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.channel import SILENCE, Channel
from dobot_async.errors import CommandRejected, MotionStopped, MotionUnknown

__all__ = ["GRIPPER", "check_gripper", "run_gripper"]

GRIPPER = frozenset({c.SET_GRIPPER_STATE, c.SET_GRIPPER_VALUE})
ABSENT = 255
"""What is told of a gripper that does not answer."""

POLL = 0.05  # seconds between two looks
LOOKS = 3  # in a row, all of them still
NEAR = 5  # percent from where it was to go, within which it counts as there
MOVED = 2  # percent; less may be the play of its servo
START = 1.0  # seconds within which it begins to move
WHOLE_WAY = 10.0  # seconds for it at full speed, with much to spare


@dataclass(frozen=True, slots=True)
class GripperReading:
    """What the arm tells of its gripper at one time; None for what its firmware does not know."""

    moving: bool | None
    value: int | None


class GripperMotion:
    """One command.

    Args:
        channel: The arm.
        value: The command's parameters.
    """

    def __init__(self, channel: Channel, value: c.SetGripperState | c.SetGripperValue) -> None:
        self._channel = channel
        self._kind = value.kind
        self._speed = value.speed
        self._goal = value.value if isinstance(value, c.SetGripperValue) else GOAL[value.state]
        self._now = asyncio.get_running_loop().time

    async def run(self, command: Command[Any, None], value: Any) -> None:
        """Tell the gripper, again if it may not have heard it, and return when it is done; see the module."""
        before = await self._look()
        if before.moving is None and before.value is None:
            raise MotionUnknown("the arm's firmware tells nothing of its gripper, so what that does cannot be seen")

        tell, heard = partial(self._channel.tell, command, value, timeout=SILENCE), False
        for _ in range(2):
            heard = await self._channel.through_outages(tell)
            if await self._rests(before):
                return

            if heard:
                break

        if not await self._channel.poll(c.IS_POWER_ON, None):
            raise CommandRejected("the gripper does not move: the arm is not powered; await arm.power_on()")

        closes = before.value is not None and before.value > self._goal
        if not (heard and closes):
            raise CommandRejected(f"the gripper does not move{at(before.value)}; is it plugged in, and free?")

    async def _rests(self, before: GripperReading) -> bool:
        """Return whether the gripper has moved, or is where it was to go, once it rests."""
        begun = self._now()
        still, last, seen = 0, before, False
        while True:
            look = await self._look()
            still = 0 if look.moving or look.value != last.value else still + 1
            seen = seen or bool(look.moving)
            last = look
            if still >= LOOKS:
                moved = self._moved(before, look, seen=seen)
                if moved or self._is_there(look) or self._now() > begun + START:
                    return self._judge(look, moved=moved)

            if self._now() > begun + START + WHOLE_WAY * 100 / self._speed:
                raise MotionUnknown("the gripper says that it still moves, although it should have come to rest by now")

            await asyncio.sleep(POLL)

    def _judge(self, look: GripperReading, *, moved: bool) -> bool:
        """Whether a gripper that rests has done it; raises MotionStopped if it did not open as far as it was to."""
        if self._is_there(look):
            return True

        if moved and look.value is not None and look.value < self._goal:
            raise MotionStopped(f"the gripper came to rest{at(look.value)}, before it was open to {self._goal} percent")

        return moved

    def _moved(self, before: GripperReading, look: GripperReading, *, seen: bool) -> bool:
        """Whether the gripper was seen to move."""
        if before.value is None or look.value is None:
            return seen

        return abs(look.value - before.value) > MOVED

    def _is_there(self, look: GripperReading) -> bool:
        """Whether it is where it was to go."""
        return look.value is not None and abs(look.value - self._goal) <= NEAR

    async def _look(self) -> GripperReading:
        """Ask how the gripper is; raise CommandRejected if there is none."""
        moving = await self._channel.poll_if_known(c.IS_GRIPPER_MOVING, None)
        value = await self._value()
        if value == ABSENT:  # once more, for a frame has no checksum
            value = await self._value()

        return GripperReading(moving, None if value is None else check_gripper(value))

    async def _value(self) -> int | None:
        """Ask how far it is open; None if the firmware does not tell."""
        return await self._channel.poll_if_known(c.GET_GRIPPER_VALUE, self._kind)


GOAL = {c.GripperState.OPEN: 100, c.GripperState.CLOSED: 0}
"""Where the gripper goes; released it goes nowhere."""


async def run_gripper(
    channel: Channel, command: Command[Any, None], value: c.SetGripperState | c.SetGripperValue
) -> None:
    """Do one command of the gripper, and return when it is done; see the module.

    Raises:
        CommandRejected: It did not move, or there is none.
        MotionStopped: It did not open as far as it was to.
        MotionUnknown: Nothing tells whether it has.
        ReplyTimeout: The arm is silent.
        ConnectionLost: The link is gone.
    """
    if isinstance(value, c.SetGripperState) and value.state not in GOAL:
        await channel.through_outages(partial(channel.tell, command, value, timeout=SILENCE))
    else:
        await GripperMotion(channel, value).run(command, value)


def check_gripper(value: int) -> int:
    """Return how far a gripper is open; raise CommandRejected if what the arm tells says that there is none."""
    if value == ABSENT:
        raise CommandRejected(
            "the arm tells 255 of its gripper, which is no percentage: the gripper does not answer it; is it plugged "
            "in, and kind= the right one?"
        )

    return value


def at(value: int | None) -> str:
    """Where a gripper is, as far as is known."""
    return "" if value is None else f" at {value} percent"
