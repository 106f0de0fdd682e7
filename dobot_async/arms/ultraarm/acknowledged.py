"""Commands that an ultraArm has to acknowledge, and whether an answer does."""

from __future__ import annotations

from typing import Any

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.ultraarm import commands as c
from dobot_async.arms.ultraarm.answers import Receipt
from dobot_async.arms.ultraarm.channel import Channel
from dobot_async.arms.ultraarm.status import UltraArmPoller
from dobot_async.errors import MotionUnknown

__all__ = ["TRIES", "Acknowledged"]

TRIES = 5  # how often a command is sent that the arm does not acknowledge, and does not seem to do


class Acknowledged:
    """Sends commands until they are acknowledged.

    Args:
        channel: How the arm is asked.
        status: What it shows.
    """

    def __init__(self, channel: Channel, status: UltraArmPoller) -> None:
        self._channel = channel
        self._status = status
        self._says_ok: bool | None = None

    async def taken(self, command: Command[Any, Any], value: Any) -> Receipt:
        """Send what may be sent again until the arm acknowledges it."""
        for _ in range(TRIES):
            receipt = await self._channel.send(command, value)
            if receipt and self.acknowledged(command, receipt):
                self._status.size = receipt.queue_size
                return receipt

            await self._status.poll()  # raises if the arm is silent

        raise MotionUnknown(f"the arm does not acknowledge {command.name}, sent {TRIES} times")

    def acknowledged(self, command: Command[Any, Any], receipt: Receipt | None) -> bool:
        """Return whether an answer acknowledges a command: if the arm usually says something to one, it has to."""
        if receipt is None or (not receipt.text and self._says_ok):
            self._says_ok = None  # to be learnt again
            return False

        if command is not c.HOME:  # to which all firmware says something
            self._says_ok = bool(receipt.text)

        return True
