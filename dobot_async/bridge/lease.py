"""Whose motion it is: one client at a time may write, from its first write to the end of its connection.

If the arm is then in the middle of a motion it is stopped, and until it has heard that nobody else may write.
"""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Generic, Literal, TypeVar

from dobot_async._core.protocol.contract import Frame
from dobot_async.arms.bridge_adapter import Bridged
from dobot_async.bridge.client import Client
from dobot_async.bridge.desk import Refused
from dobot_async.bridge.line import Line
from dobot_async.errors import ConnectionLost, DobotError

__all__ = ["Lease"]

F = TypeVar("F", bound=Frame)
LOOKS, LOOK = 3, 0.05  # how often, and how many seconds apart, an arm is seen to stand that need not say so
GENTLY = 3  # times that an arm is told to stop before that is insisted on


class Lease(Generic[F]):
    """See the module.

    Args:
        line: The way to the arm.
        family: How it is bridged.
        takeover: Whoever writes takes the lease from who has it; else the first one keeps it.
        on_vanish: "stop" stops the arm if its mover goes in the middle of a motion; "leave" lets it finish.
        cut: Ends a client's connection.
        tell: Takes note of what happens to whom.

    Attributes:
        holder: Who has it, None if nobody does.
    """

    def __init__(
        self,
        line: Line[F],
        family: Bridged[F],
        *,
        takeover: bool,
        on_vanish: Literal["stop", "leave"],
        cut: Callable[[Client[F], str], None],
        tell: Callable[[str, Client[F], str], None],
    ) -> None:
        self.holder: Client[F] | None = None
        self._line = line
        self._family = family
        self._takeover = takeover
        self._on_vanish = on_vanish
        self._cut = cut
        self._tell = tell
        self._changing = asyncio.Lock()

    async def take(self, client: Client[F]) -> None:
        """Returns when a client may write; raises Refused if it may not."""
        async with self._changing:
            holder = self.holder
            if holder is client:
                return

            if client.gone:
                raise Refused("the client has gone")

            if holder and not holder.gone:
                if not self._takeover:
                    raise Refused(f"{holder.name} moves the arm")

                self._cut(holder, f"{client.name} takes over")

            if holder:
                await self._release(holder)

            self.holder = client
            self._tell("lease", client, "moves the arm from now on")

    async def end(self, client: Client[F]) -> None:
        """Ends the lease of a client that has gone, if it has it."""
        async with self._changing:
            if self.holder is client:
                await self._release(client)

    async def _release(self, holder: Client[F]) -> None:
        """Ends the lease; stops the arm first if it is in the middle of something."""
        with suppress(ConnectionLost):
            if self._on_vanish == "stop" and not await self._stands(holder, 1 if self._family.proves_stop else LOOKS):
                await self._halt(holder)

        self.holder = None
        self._tell("released", holder, "anybody may move the arm")

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
            frames = [*(family.stopping if attempt < GENTLY else family.insisting), *off]
            answered = await self._line.stop(frames)
            told = attempt > GENTLY or all(
                heard or family.may_be_silent(frame) for heard, frame in zip(answered, frames, strict=True)
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
