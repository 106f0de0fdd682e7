"""The lease of a panel's arm: one operator at a time moves the arm, or the program that runs beside the panel.

A holder keeps the lease until it releases it, its connection ends, or another operator takes over, which all pages are
shown. The holder's motions end first: nobody gets the lease before the arm stands.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Protocol

from dobot_async.panel.problems import PanelRefusal

__all__ = ["Operator", "OperatorLease"]


class Operator(Protocol):
    """Somebody who may have it.

    Attributes:
        name: Who it is, for people.
        gone: It has left, and gets nothing any more.
        yields: Others may take over.
    """

    name: str
    gone: bool
    yields: bool


class OperatorLease:
    """See the module.

    Args:
        begin: Called before somebody gets it.
        end: Ends what the holder has under way; called before anybody else gets it.
        changed: Called with what has happened, in words.

    Attributes:
        holder: Who has it, None if nobody does.
        freed: Set while nobody has it.
    """

    def __init__(
        self, begin: Callable[[], Awaitable[None]], end: Callable[[], Awaitable[None]], changed: Callable[[str], None]
    ) -> None:
        self.holder: Operator | None = None
        self.freed: asyncio.Event = asyncio.Event()
        self.freed.set()
        self._begin = begin
        self._end = end
        self._changed = changed
        self._changing = asyncio.Lock()

    async def take(self, operator: Operator, *, takeover: bool = False) -> None:
        """Return when somebody has it; raise Refusal if somebody else keeps it."""
        async with self._changing:
            holder = self.holder
            if holder is operator:
                return

            if holder and not (takeover and holder.yields):
                can = "" if holder.yields else ", which does not yield to a page"
                raise PanelRefusal("lease", f"{holder.name} moves the arm{can}")

            if holder:
                await self._release(holder, f"{operator.name} takes over from {holder.name}")

            if operator.gone:
                raise PanelRefusal("lease", f"{operator.name} has gone")

            await self._begin()
            if operator.gone:
                raise PanelRefusal("lease", f"{operator.name} has gone")

            self.holder = operator
            self.freed.clear()
            self._changed(f"{operator.name} moves the arm from now on")

    async def end(self, operator: Operator, why: str) -> None:
        """End the lease of somebody, if he has it."""
        async with self._changing:
            if self.holder is operator:
                await self._release(operator, why)

    def check(self, operator: Operator) -> None:
        """Raise Refusal if somebody does not have it."""
        if self.holder is None:
            raise PanelRefusal("lease", "take the lease of the arm first")

        if self.holder is not operator:
            raise PanelRefusal("lease", f"{self.holder.name} moves the arm")

    async def _release(self, holder: Operator, why: str) -> None:
        """Let nothing begin any more, end what goes on, and let others have it."""
        self.holder = None
        try:
            await self._end()
        finally:
            self.freed.set()
            self._changed(f"{why}: {holder.name} does not move the arm any more")
