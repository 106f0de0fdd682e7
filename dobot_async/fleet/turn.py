"""The turn to command an arm: one program after the other, in the order of their requests."""

from __future__ import annotations

import asyncio
from contextlib import nullcontext

import anyio

from dobot_async.errors import ReplyTimeout
from dobot_async.fleet.zone_locks import ProgramWait, ZoneHolder
from dobot_async.fleet.zones import Zones, here

__all__ = ["Turn"]


class Turn:
    """The turns of one arm.

    Args:
        name: The arm's.
        zones: Those of the cell, where it is found out who would wait for himself.
    """

    def __init__(self, name: str, zones: Zones) -> None:
        self._name = name
        self._zones = zones
        self._order = anyio.Lock(fast_acquire=True)
        self._commanding: tuple[ZoneHolder, ...] = ()

    async def take(self, deadline: float | None) -> None:
        """Takes the lock of the order: nobody else commands the arm until `end`.

        Raises:
            ZoneDeadlock: Who has it waits, in the end, for who asks.
            ReplyTimeout: Others took too long.
        """
        program = here()
        stuck = self._zones.driven(program) | {program.holder}
        turn = ProgramWait(f"to command {self._name} behind", program.holder, stuck, lambda: self._commanding)
        try:
            async with asyncio.timeout_at(deadline):
                with self._zones.locks.pausing(turn) if self._order.locked() else nullcontext():
                    await self._order.acquire()
        except TimeoutError:
            raise ReplyTimeout(f"{self._name}: others were before it, and took too long") from None

        self._commanding = (program.holder,)

    def end(self) -> None:
        """Lets others command the arm."""
        self._commanding = ()  # from now on, although the next one goes on only when the loop lets it
        self._order.release()
