"""Who can never go on: a wait-for graph, built from what claims and pauses say, that shares no code with `ZoneLocks`.

A wait leads to another one if that has to end before. A claim waits for the holders of its zones, none of whom leaves
before all waits have ended in which it is stuck, unless it moves; a pause waits for holders, none of whom comes before
the waits of its own have ended. Who can come to no end of such a way was to be told, and so was a claim for which
everything is free.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from dobot_async.fleet.zone_locks import ProgramWait, ZoneHolder, ZoneLocks, ZoneRequest

__all__ = ["Scene", "Wait", "end", "named", "watch"]

Wait = ZoneRequest | ProgramWait
TICK = 0.01  # virtual seconds between two looks
TURNS = 5  # of the loop, in which what has just happened is told to all


@dataclass(frozen=True)
class Scene:
    """A moment.

    Attributes:
        held: Who holds which zones.
        claims: Those that wait, oldest first.
        pauses: Those that go on.
    """

    held: Sequence[tuple[ZoneHolder, frozenset[str]]]
    claims: Sequence[ZoneRequest]
    pauses: Sequence[ProgramWait]

    @classmethod
    def of(cls, claims: ZoneLocks) -> Scene:
        """What is the case in a cell."""
        held = [(claim.holder, claim.zones) for claim in claims.held]
        return cls(held, claims.waiting, list(claims._pauses))

    def forgotten(self) -> list[tuple[Wait, str]]:
        """All that should have been told, and why."""
        granted = [(claim, "nothing is in its way") for claim in self.claims if self.is_due(claim)]
        vain = [(claim, why) for claim in self.claims for why in self.in_vain(claim)]
        return [*granted, *vain, *((wait, "all that it waits for waits for it") for wait in self.endless())]

    def in_the_way(self, claim: ZoneRequest) -> list[ZoneHolder]:
        """Who holds what it is for; where it is known to be already, it may go on beside others."""
        wanted = claim.zones - claim.holder.inside
        return [holder for holder, zones in self.held if holder not in claim.own and wanted & zones]

    def in_vain(self, claim: ZoneRequest) -> Iterator[str]:
        """Whether it waits for somebody who will never leave."""
        for holder in self.in_the_way(claim):
            if holder.failure:
                yield f"{holder.name} has failed"
            elif claim.parked(holder) and not holder.moving():
                yield f"nobody moves {holder.name}"

    def before(self, wait: Wait) -> list[Wait]:
        """What has to end before a wait does, whoever comes first."""
        waits: list[Wait] = [*self.claims, *self.pauses]
        if isinstance(wait, ProgramWait):
            return [each for holder in wait.awaited() for each in waits if each.asker is holder]

        resting = [holder for holder in self.in_the_way(wait) if not holder.moving()]
        return [each for holder in resting for each in waits if holder in each.stuck]

    def earlier(self, claim: ZoneRequest) -> list[ZoneRequest]:
        """Those that came first for the same."""
        return [each for each in self.claims[: self.claims.index(claim)] if each.zones & claim.zones]

    def endless(self) -> list[Wait]:
        """The waits that are left when all are taken away that can end."""
        left: list[Wait] = [*self.claims, *self.pauses]
        while True:
            ending = [wait for wait in left if not any(each in left for each in self.before(wait))]
            if not ending:
                return left

            left = [wait for wait in left if wait not in ending]

    def is_due(self, claim: ZoneRequest) -> bool:
        """Whether its zones are free, and who came first waits for it anyway."""
        return not self.in_the_way(claim) and all(claim in self.all_before(each) for each in self.earlier(claim))

    def all_before(self, claim: ZoneRequest) -> list[Wait]:
        """What has to end, directly or not, before a claim is granted in its turn."""
        found: list[Wait] = [claim]
        for each in found:  # which grows
            turns: Sequence[Wait] = self.earlier(each) if isinstance(each, ZoneRequest) else []
            found += [other for other in (*self.before(each), *turns) if other not in found]

        return found[1:]


def named(wait: Wait) -> str:
    """A wait, for messages."""
    who = wait.asker.name if wait.asker else "?"
    return f"{who} {wait.what}" if isinstance(wait, ProgramWait) else f"{who}, for {sorted(wait.zones)},"


async def watch(claims: ZoneLocks) -> Any:
    """Looks until it is cancelled; raises AssertionError if somebody is left to wait who should have been told."""
    while True:
        before = {wait for wait, _ in Scene.of(claims).forgotten()}
        if before:
            for _ in range(TURNS):
                await asyncio.sleep(0)

            for wait, why in Scene.of(claims).forgotten():
                assert wait not in before, f"{named(wait)} is left to wait although {why}"

        await asyncio.sleep(TICK)


async def end(watching: Sequence[asyncio.Task[Any]]) -> None:
    """Ends those who look, and raises what one of them has seen."""
    for task in watching:
        task.cancel()

    await asyncio.wait(watching)
    for task in watching:
        if not task.cancelled():
            task.result()
