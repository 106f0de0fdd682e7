"""One seed is one run of guarded arms that are switched off and on, and then told to go where others are.

    make soak OF=lost [SEEDS=10000] [FIRST=0]      runs many of them

An arm that was switched off and on is elsewhere than it tells: its base, and its rail, by as much as they had come
before. Here arms are told to go where they would really come into a zone, which another one is often in: alone, in
batches, together, behind a `home`, and when they were switched off while they waited for the zone. What must hold: no
two tools are ever in one zone, and nobody is left to wait who could go on or never will (`waits.py`).
"""

from __future__ import annotations

import asyncio
import cmath
import math
from collections.abc import Callable, Mapping
from contextlib import AsyncExitStack, suppress
from dataclasses import dataclass
from random import Random
from typing import Any

import waits
from monitor import Monitor, Stand, Violation, Zone
from scenario_of_guards import (
    AWAY,
    LONG,
    MODES,
    SPEED,
    Cell,
    Step,
    away,
    cancelled,
    change,
    hold,
    home,
    in_one,
    jog,
    move,
    power,
)
from virtual import run_virtual

from dobot_async import DobotError, Fleet, Magician, MotionUnknown
from dobot_async.fleet import BaseFrame, Box, Cylinder, Member
from dobot_async.simulator import Faults, Simulation, simulate

__all__ = ["Figures", "Violation", "run_seed"]

HEIGHT = (10.0, 70.0)
RIDE = 300.0


@dataclass(frozen=True, slots=True)
class Figures:
    """What happened in a run.

    Attributes:
        seconds: Simulated ones.
        told: Errors that programs were told of.
        done: Steps of programs that were done.
        inside: How often the monitor saw a tool in a zone.
        lost: How often an arm that was elsewhere than it told was sent into a zone in which another one was.
    """

    seconds: float
    told: int
    done: int
    inside: int
    lost: int


@dataclass
class Lost(Cell):
    """A run under way."""

    lost: int = 0

    async def ready(self, name: str, random: Random) -> None:
        """Makes an arm ready again; mostly it is not homed."""
        with suppress(DobotError, ValueError, TimeoutError):
            async with asyncio.timeout(20):
                await self.fleet[name].recover()
                if self.monitor.stands[name].rail is not None and random.random() < 0.7:
                    await self.fleet[name].set_rail()

                if random.random() < 0.2:
                    await self.fleet[name].home()

    def aim(self, name: str, random: Random) -> dict[str, float]:
        """What an arm has to be told so that its tool really comes into a zone, wherever it believes to be."""
        zone = random.choice(list(self.monitor.zones))
        middle, stand = self.monitor.zones[zone].centre, self.monitor.stands[name]
        flat = (complex(*middle[:2]) - complex(stand.x, stand.y)) * cmath.rect(1, -math.radians(stand.yaw))
        arm, rail, told = self.sims[name].arm, {}, 0.0
        if stand.rail is not None:
            told = random.uniform(0, RIDE)
            rail = {"l": told}
            flat -= cmath.rect(told + arm.true_rail - arm.rail, math.radians(stand.rail))

        turned = arm.true_pose.j1 - arm.pose.j1
        flat *= cmath.rect(1, -math.radians(turned))
        if abs(turned) > 1 or abs(arm.true_rail - arm.rail) > 1:
            others = [
                each for each in self.sims if each != name and self.monitor.zones[zone].has(self.monitor.place(each))
            ]
            self.lost += bool(others)

        return {"x": flat.real, "y": flat.imag, "z": random.uniform(*HEIGHT) - stand.z, **rail}


async def enter(cell: Cell, name: str, arm: Magician, random: Random) -> None:
    await arm.move_to(**aim(cell, name, random), mode=random.choice(MODES))


async def dwell(cell: Cell, name: str, arm: Magician, random: Random) -> None:
    await arm.move_to(**aim(cell, name, random))
    await asyncio.sleep(random.uniform(0, 8))


async def swing(_: Cell, __: str, arm: Magician, random: Random) -> None:
    """Turns the base, so that it matters if it is forgotten how far."""
    await arm.move_joints(random.choice([-1, 1]) * random.uniform(20, 90), random.uniform(10, 40), 30, 0)


async def batch(cell: Cell, name: str, arm: Magician, random: Random) -> None:
    async with arm.queue.batch() as steps:
        if random.random() < 0.3:
            steps.home()

        for _step in range(random.randint(1, 3)):
            steps.move_to(**aim(cell, name, random), mode=random.choice(MODES))

    await arm.queue.join()


async def together(cell: Cell, name: str, _: Magician, random: Random) -> None:
    other = random.choice([each for each in cell.sims if each != name])
    async with cell.fleet.together(name, other) as batches:
        batches[name].move_to(**aim(cell, name, random))
        batches[other].move_to(*AWAY)

    await batches.wait()


async def off_at_rest(cell: Cell, name: str, arm: Magician, random: Random) -> None:
    """The arm is switched off and on with nothing to do; nobody knows until it is to move."""
    await arm.queue.join()
    await asyncio.sleep(random.uniform(0.1, 1))
    cell.monitor.switch_off_and_on(name)
    with suppress(MotionUnknown):
        await arm.move_to(**aim(cell, name, random))


async def off_while_it_waits(cell: Cell, name: str, arm: Magician, random: Random) -> None:
    """The arm is switched off and on while its motion waits for a zone."""
    moving = asyncio.create_task(arm.move_to(**aim(cell, name, random)))
    try:
        await asyncio.sleep(random.uniform(0.5, 2))
        if any(claim.holder.name == name for claim in cell.fleet._zones.locks.waiting):
            cell.monitor.switch_off_and_on(name)

        await moving
    finally:
        moving.cancel()
        await asyncio.wait([moving])


def aim(cell: Cell, name: str, random: Random) -> dict[str, Any]:
    """Where a program of this scenario sends its arm."""
    assert isinstance(cell, Lost)
    return cell.aim(name, random)


STEPS: Mapping[Step, int] = {
    enter: 8,
    dwell: 8,
    swing: 6,
    away: 6,
    batch: 3,
    together: 2,
    off_at_rest: 4,
    off_while_it_waits: 3,
    power: 4,
    move: 2,
    jog: 2,
    hold: 2,
    home: 1,
    change: 1,
    cancelled: 2,
}


def some_zone(random: Random) -> tuple[Zone, Box | Cylinder]:
    """A narrow zone that all arms reach, as the monitor and as the fleet know it."""
    angle, out = random.uniform(-0.7, 0.7), random.uniform(210, 250)
    x, y, z, radius = out * math.cos(angle), out * math.sin(angle), random.uniform(30, 50), random.uniform(25, 45)
    if random.random() < 0.5:
        return Zone((x, y, z), (0, 0, 60), radius), Cylinder(x, y, radius, (z - 60, z + 60))

    half = (radius, radius, 60.0)
    spans = [(middle - size, middle + size) for middle, size in zip((x, y, z), half, strict=True)]
    return Zone((x, y, z), half), Box(*spans)


async def run(seed: int, say: Callable[[str], None]) -> Figures:
    """Runs a seed to the end of all programs."""
    random, loop = Random(seed), asyncio.get_running_loop()
    names = "abc"[: random.randint(2, 3)]
    stands = {
        name: Stand(
            random.uniform(-20, 20),
            random.uniform(-20, 20),
            random.uniform(-20, 20),
            random.uniform(-20, 20),
            random.choice([None, None, 90.0, -60.0]),
        )
        for name in names
    }
    zones: dict[str, tuple[Zone, Box | Cylinder]] = {}
    while not zones or in_one(zones, stands):
        zones = {f"zone {number}": some_zone(random) for number in range(random.randint(1, 2))}

    async with AsyncExitStack() as stack:
        sims: dict[str, Simulation] = {}
        members: dict[str, Member[Magician]] = {}
        for name, stand in stands.items():
            faults = Faults(latency=random.choice([0.0, 0.003, 0.02]), loss=random.choice([0.0, 0.0, 0.02]))
            sims[name] = sim = await stack.enter_async_context(
                simulate(speed=SPEED, seed=random.randrange(1 << 30), faults=faults, homed=True)
            )
            sim.arm.guide_to(*AWAY)
            if stand.rail is not None:
                async with Magician.connect(sim.url) as arm:
                    await arm.set_rail()

            base = BaseFrame(stand.x, stand.y, stand.z, stand.yaw)
            members[name] = Member(sim.url, Magician, {"timeout": 20.0}, base, "alone", "wait", rail=stand.rail)

        monitor = Monitor(sims, stands, {name: seen for name, (seen, _) in zones.items()})
        watching = [asyncio.create_task(monitor.watch())]
        shapes = {name: shape for name, (_, shape) in zones.items()}
        try:
            fleet = await stack.enter_async_context(Fleet.connect(members, zones=shapes, groups={"alone": "alone"}))
            watching.append(asyncio.create_task(waits.watch(fleet._zones.locks)))
            cell = Lost(random, sims, fleet, monitor, say, STEPS)
            steps = random.randint(6, 14)
            async with asyncio.timeout(LONG):
                await fleet.run({name: cell.program(name, Random(random.random()), steps) for name in names})
        except TimeoutError:
            raise Violation(f"somebody hangs; held: {[(zone, fleet.holders(zone)) for zone in zones]}") from None
        finally:
            await waits.end(watching)

        return Figures(loop.time(), cell.told, cell.done, monitor.seen, cell.lost)


def run_seed(seed: int, say: Callable[[str], None] = lambda _: None) -> Figures:
    """Runs a seed; raises Violation if something does not hold."""
    found: list[Figures] = []

    async def scene() -> None:
        found.append(await run(seed, say))

    run_virtual(scene())
    return found[0]
