"""The end of a lease holder: an arm in the middle of a motion is stopped, until it is seen at rest."""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Generic, TypeVar

from dobot_async._core.protocol.contract import Frame
from dobot_async.arms.bridge_adapter import BridgeAdapter
from dobot_async.bridge.client import Client
from dobot_async.bridge.line import ArmLink
from dobot_async.errors import ConnectionLost, DobotError

__all__ = ["Standstill"]

F = TypeVar("F", bound=Frame)
LOOKS, LOOK = 3, 0.05  # how often, and how many seconds apart, an arm is seen to stand that need not say so
GENTLY = 3  # times that an arm is told to stop before that is insisted on


class Standstill(Generic[F]):
    """See the module.

    Args:
        line: The way to the arm.
        family: How it is bridged.
        tell: Takes note of what happens to whom.
    """

    def __init__(self, line: ArmLink[F], family: BridgeAdapter[F], tell: Callable[[str, Client[F], str], None]) -> None:
        self._line = line
        self._family = family
        self._tell = tell

    async def reach(self, holder: Client[F]) -> None:
        """Return when the arm stands, or does nothing that a client has told it, or the link is gone for good."""
        with suppress(ConnectionLost):
            if not await self._stands(holder, 1 if self._family.proves_stop else LOOKS):
                await self._halt(holder)

    async def _halt(self, holder: Client[F]) -> None:
        """Stops the arm, and switches off what burns or turns; says it until it is done, or the link is gone for good.

        Where switches are no part of the queue all is said once more when the stop was heard: what was still in the
        queue may have switched something on after it was switched off. What an arm that obeys does not acknowledge is
        given up after a while, for it may not know it.
        """
        family = self._family
        off = holder.watch.off()
        final = not family.proves_stop
        for attempt in itertools.count():
            frames = [*(family.stopping if attempt < GENTLY else family.escalated_stop), *off]
            answered = await self._line.stop(frames)
            told = attempt > GENTLY or all(
                heard or family.ack_optional(frame) for heard, frame in zip(answered, frames, strict=True)
            )
            obeys = answered[0] if family.proves_stop else await self._is_seen_to_stand(holder, frames, answered)
            if final and obeys and told:
                self._tell("stopped", holder, "it has gone, and the arm was in motion")
                return

            final = final or obeys

    async def _is_seen_to_stand(self, holder: Client[F], frames: Sequence[F], answered: Sequence[bool]) -> bool:
        """Whether an arm stands that was told to stop, and whose answer to that proves nothing."""
        for frame in frames:
            holder.watch.sent(frame)

        for frame, was_answered in zip(frames, answered, strict=True):
            if was_answered:
                holder.watch.answered(frame, frame)

        return await self._stands(holder, LOOKS)

    async def _stands(self, holder: Client[F], looks: int) -> bool:
        """Whether the arm is not in the middle of what a client has told it, however often one looks."""
        for look in range(looks):
            if look:
                await asyncio.sleep(LOOK)

            if await self._moves_for(holder):
                return False

        return True

    async def _moves_for(self, holder: Client[F]) -> bool:
        """Whether the arm is, or may be, in the middle of what a client has told it."""
        if not holder.watch.moving(None):
            return False

        try:
            return holder.watch.moving(await self._line.ask(holder.watch.question))
        except ConnectionLost:
            raise
        except DobotError:
            return True
