"""Lets several arms begin something at once: all that they need is claimed as one, or nothing is.

Each arm's turn is taken, all ways are looked at, and then one request is made for all zones. Two ways through one zone
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
async def turns(fleet_arms: Mapping[str, FleetArm]) -> AsyncGenerator[None]:
    """While this is entered, nobody else commands these arms. They are taken in one order, by whomever."""
    async with AsyncExitStack() as stack:
        for name in sorted(fleet_arms):
            fleet_arms[name].check()
            await fleet_arms[name].take_turn(None)
            stack.callback(fleet_arms[name].end_turn)

        yield


async def admit_together(
    fleet_arms: Mapping[str, FleetArm], motions: Mapping[str, Sequence[Motion]], zones: Zones, timeout: float | None
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
    courses = await run_concurrently({name: fleet_arm.plan(motions[name]) for name, fleet_arm in fleet_arms.items()})
    guards = {name: fleet_arm.guard for name, fleet_arm in fleet_arms.items() if fleet_arm.guard}
    for (one, guard), (other, its) in combinations(guards.items(), 2):
        shared = (courses[one].zones & (courses[other].zones | its.holds)) | (guard.holds & courses[other].zones)
        if shared:
            raise ZoneDeadlock(
                f"{one} and {other} start together, and each needs zone {', '.join(sorted(shared))} from the start on"
            )

    needed = {name: courses[name].zones for name in guards}
    joint = await claim_for_all(fleet_arms, guards, needed, zones, deadline)
    for name, fleet_arm in fleet_arms.items():
        request = None
        if needed.get(name):
            request = ZoneRequest(fleet_arm.holder, frozenset([fleet_arm.holder]), needed[name])
            zones.locks.take(request)

        fleet_arm.enter(courses[name], request)

    if joint:
        zones.locks.release(joint)


async def claim_for_all(
    fleet_arms: Mapping[str, FleetArm],
    guards: Mapping[str, Guard[Any]],
    needed: Mapping[str, frozenset[str]],
    zones: Zones,
    deadline: float | None,
) -> ZoneRequest | None:
    """Waits for all zones at once; returns the request, None if there are none."""
    program = here()
    for name in fleet_arms:
        zones.drive(name, program)

    everything = frozenset[str]().union(*needed.values())
    if not everything:
        return None

    arms = frozenset(fleet_arms[name].holder for name in guards)
    request = ZoneRequest(
        ZoneHolder(f"the start of {' and '.join(fleet_arms)} together"),
        frozenset(each.holder for each in program.line()) | arms,
        everything,
        patient=all(guard.patient for guard in guards.values()),
        stuck=zones.driven(program),
        asker=program.holder,
        movers=arms,
        parked=zones.parked(program),
    )

    async def check() -> None:
        await run_concurrently({name: guard.check() for name, guard in guards.items()})

    left = None if deadline is None else max(0.0, deadline - asyncio.get_running_loop().time())
    return await zones.request(request, left, check)
