"""The line to the arm as a bridge uses it: requests with replies, and stops that are repeated until acknowledged."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from functools import partial
from typing import Generic, TypeVar

from dobot_async._core.link.link import Link
from dobot_async._core.protocol.contract import Frame
from dobot_async.arms.bridge_adapter import BridgeAdapter
from dobot_async.errors import ConnectionLost, ReplyTimeout

__all__ = ["ArmLink"]

F = TypeVar("F", bound=Frame)
STOPPED_WITHIN = 1.0  # seconds until what stops the arm is said again


class ArmLink(Generic[F]):
    """Frames of a family, by way of a link."""

    def __init__(self, link: Link[F], family: BridgeAdapter[F]) -> None:
        self._link = link
        self._family = family

    async def ask(self, frame: F, *, ready: Callable[[], None] = lambda: None, urgent: bool = False) -> F:
        """Sends a frame as often, and waits for its reply as long, as the family says; raises DobotError without one.

        `ready` is called whenever it is about to be sent; what that raises is raised, and nothing sent.
        """
        family = self._family
        repeatable = family.repeatable(frame)
        if urgent and not repeatable:
            return await self._once(frame)

        return await self._link.exchange(
            frame,
            partial(family.accept, frame),
            name=family.name(frame),
            timeout=family.patience(frame),
            repeatable=repeatable,
            urgent=urgent,
            ready=ready,
        )

    async def stop(self, frames: Sequence[F]) -> list[bool]:
        """Says what stops the arm ahead of everything, for a second; returns which of the frames were answered.

        It waits until the arm can be reached. Raises ConnectionLost if that is over.
        """
        await self._link.opened()
        replies = await asyncio.gather(*map(self._urge, frames), return_exceptions=True)
        for reply in replies:
            if isinstance(reply, ConnectionLost):
                raise reply

        return [not isinstance(reply, BaseException) for reply in replies]

    async def _once(self, frame: F) -> F:
        """Sends what stops the arm at once and a single time: another one might end what its program has gone on to."""
        patience = self._family.patience(frame)
        problem = f"no answer to {self._family.name(frame)} from {self._link.url} within {patience:.3g} s"
        try:
            request = await self._link.send(frame, partial(self._family.accept, frame), timeout=patience)
        except TimeoutError:
            raise ReplyTimeout(problem) from None

        if not await self._link.settle(request, patience):
            raise ReplyTimeout(problem)

        reply: F = request.value
        return reply

    async def _urge(self, frame: F) -> F:
        return await self._link.exchange(
            frame,
            partial(self._family.accept, frame),
            name=self._family.name(frame),
            timeout=STOPPED_WITHIN,
            repeatable=True,
            urgent=True,
        )
