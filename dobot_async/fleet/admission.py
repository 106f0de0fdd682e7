"""Lets several arms begin something at once: all that they need is claimed as one, or nothing is.

Each arm's turn is taken, all ways are looked at, and then one claim is made for all zones. Two ways through one zone
can never be granted, for the arms start at one instant: that is told at once.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Mapping, Sequence
from contextlib import AsyncExitStack, asynccontextmanager
from itertools import combinations
from typing import Any

from dobot_async._core.queue.motion import Motion
from dobot_async.fleet.concurrent import run_concurrently
from dobot_async.fleet.errors import ZoneDeadlock
from dobot_async.fleet.fleet_arm import FleetArm
from dobot_async.fleet.guard import Guard
from dobot_async.fleet.zone_locks import ZoneHolder, ZoneRequest
from dobot_async.fleet.zones import Zones, here

__all__ = ["admit_together", "turns"]


@asynccontextmanager
async def turns(seats: Mapping[str, FleetArm]) -> AsyncGenerator[None]:
    """While this is entered, nobody else commands these arms. They are taken in one order, by whomever."""
    async with AsyncExitStack() as stack:
        for name in sorted(seats):
            seats[name].check()
            await seats[name].take_turn(None)
            stack.callback(seats[name].end_turn)

        yield


async def admit_together(
    seats: Mapping[str, FleetArm], motions: Mapping[str, Sequence[Motion]], zones: Zones, timeout: float | None
) -> None:
    """Returns when arms whose turn it is may do all of this at once, and takes note of it.

    Raises:
        ValueError: A way leads out of the limits of its arm, or where the arm cannot go.
        ZoneDeadlock: Two of the ways lead through one zone; or waiting for a zone would never end.
        ZoneOccupied: A zone is held, and one of the arms does not wait.
        ReplyTimeout: Waiting took too long.
    """
    loop = asyncio.get_running_loop()
    deadline = None if timeout is None else loop.time() + timeout
    courses = await run_concurrently({name: seat.plan(motions[name]) for name, seat in seats.items()})
    guards = {name: seat.guard for name, seat in seats.items() if seat.guard}
    for (one, guard), (other, its) in combinations(guards.items(), 2):
        shared = (courses[one].zones & (courses[other].zones | its.holds)) | (guard.holds & courses[other].zones)
        if shared:
            raise ZoneDeadlock(
                f"{one} and {other} start together, and each needs zone {', '.join(sorted(shared))} from the start on"
            )

    needed = {name: courses[name].zones for name in guards}
    joint = await claim_for_all(seats, guards, needed, zones, deadline)
    for name, seat in seats.items():
        claim = None
        if needed.get(name):
            claim = ZoneRequest(seat.party, frozenset([seat.party]), needed[name])
            zones.claims.take(claim)

        seat.enter(courses[name], claim)

    if joint:
        zones.claims.release(joint)


async def claim_for_all(
    seats: Mapping[str, FleetArm],
    guards: Mapping[str, Guard[Any]],
    needed: Mapping[str, frozenset[str]],
    zones: Zones,
    deadline: float | None,
) -> ZoneRequest | None:
    """Waits for all zones at once; returns the claim, None if there are none."""
    program = here()
    for name in seats:
        zones.drive(name, program)

    everything = frozenset[str]().union(*needed.values())
    if not everything:
        return None

    arms = frozenset(seats[name].party for name in guards)
    claim = ZoneRequest(
        ZoneHolder(f"the start of {' and '.join(seats)} together"),
        frozenset(each.party for each in program.line()) | arms,
        everything,
        patient=all(guard.patient for guard in guards.values()),
        stuck=zones.driven(program),
        asker=program.party,
        movers=arms,
        parked=zones.parked(program),
    )

    async def check() -> None:
        await run_concurrently({name: guard.check() for name, guard in guards.items()})

    left = None if deadline is None else max(0.0, deadline - asyncio.get_running_loop().time())
    return await zones.claim(claim, left, check)
