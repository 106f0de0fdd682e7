"""One seed is one run of guarded arms in a random cell, watched by a monitor that knows only where the tools are.

    make soak OF=guards [SEEDS=10000] [FIRST=0]      runs many of them

Arms come with something left in their queues, change their tools at once and in the queue, ride on rails, jog, home,
jump, raise alarms, are stopped, and are switched off and on. What must hold: no two tools are ever in one zone, and
nobody is left to wait who could go on or never will (`waits.py`).
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Coroutine, Mapping
from contextlib import AsyncExitStack, suppress
from dataclasses import dataclass
from random import Random
from typing import Any, Literal

import waits
from monitor import Monitor, Stand, Violation, Zone, true_joints
from virtual import run_virtual

from dobot_async import ConnectionLost, DobotError, Fleet, Jog, Magician, PTPMode
from dobot_async.arms.magician import commands as c
from dobot_async.fleet import BaseFrame, Box, Cylinder, Member
from dobot_async.simulator import Faults, Simulation, simulate

__all__ = ["Figures", "Violation", "run_seed"]

AWAY = (150.0, -190.0, 60.0)
START = (-51.71, 22.01, 26.31, 0.0, 0.0)  # about the joints of that place
NEAR = 10.0  # mm; nearer to a zone than this, nobody stands at the beginning
LONG = 400.0  # virtual seconds after which somebody hangs
SPEED = 5.0
GRACE = 0.1  # virtual seconds after a stop has returned in which an arm comes to rest
WATCHED = 2.0  # virtual seconds for which it is watched then
LOOK = 0.02
TOOLS = [(59.7, 0.0, 0.0), (70.0, 0.0, 0.0), (110.0, 0.0, 0.0), (40.0, 25.0, -20.0), (90.0, -30.0, 30.0)]
MODES = [mode for mode in PTPMode if "INC" not in mode.name and "ANGLE" not in mode.name]


@dataclass(frozen=True, slots=True)
class Figures:
    """What happened in a run.

    Attributes:
        seconds: Simulated ones.
        told: Errors that programs were told of.
        done: Steps of programs that were done.
        inside: How often the monitor saw a tool in a zone.
        failures: Arms that failed.
    """

    seconds: float
    told: int
    done: int
    inside: int
    failures: int


@dataclass
class Cell:
    """A run under way."""

    random: Random
    sims: Mapping[str, Simulation]
    fleet: Fleet[Magician]
    monitor: Monitor
    say: Callable[[str], None]
    steps: Mapping[Step, int]
    told: int = 0
    done: int = 0
    failures: int = 0

    async def program(self, name: str, random: Random, steps: int) -> None:
        """Does this and that with its arm, and makes it ready again when it has failed."""
        for _ in range(steps):
            what = random.choices(list(self.steps), list(self.steps.values()))[0]
            try:
                async with asyncio.timeout(random.uniform(3, 30)):
                    await what(self, name, self.fleet[name], random)
            except (DobotError, ValueError, TimeoutError) as error:
                self.told += 1
                self.say(f"{asyncio.get_running_loop().time():8.3f} {name} {what.__name__}: {error!r}")
                if isinstance(error, ConnectionLost):
                    return

                if name in self.fleet.failures:
                    self.failures += 1
                    await self.ready(name, random)
            else:
                self.done += 1
                self.say(f"{asyncio.get_running_loop().time():8.3f} {name} {what.__name__}: done")

    async def ready(self, name: str, random: Random) -> None:
        """Makes an arm ready again that has failed; now and then tool and rail are said anew, and it is homed."""
        with suppress(DobotError, ValueError, TimeoutError):
            async with asyncio.timeout(20):
                await self.fleet[name].recover()
                if random.random() < 0.5:
                    await self.fleet[name].set_end_effector(c.EndEffectorParams(*self.monitor.tool(name)))

                if self.monitor.stands[name].rail is not None and random.random() < 0.5:
                    await self.fleet[name].set_rail()

                if random.random() < 0.5:
                    await self.fleet[name].home()

    async def stop(self) -> None:
        """Stops all at some moment; nobody may move any more soon after that has returned, whatever programs do."""
        await asyncio.sleep(self.random.uniform(0, 5))
        await self.fleet.stop()
        await asyncio.sleep(GRACE)
        stood = {name: true_joints(sim) for name, sim in self.sims.items()}
        for _ in range(round(WATCHED / LOOK)):
            await asyncio.sleep(LOOK)
            moved = [name for name, sim in self.sims.items() if true_joints(sim) != stood[name]]
            if moved:
                raise Violation(f"{moved} moved after the stop of the fleet")


Step = Callable[[Cell, str, Magician, Random], Coroutine[Any, Any, None]]


def place(random: Random) -> tuple[float, float, float]:
    """Somewhere in front of the arm, and within its reach with most tools."""
    angle, out = random.uniform(-0.8, 0.8), random.uniform(190, 290)
    return out * math.cos(angle), out * math.sin(angle), random.uniform(0, 100)


async def move(_: Cell, __: str, arm: Magician, random: Random) -> None:
    await arm.move_to(*place(random), mode=random.choice(MODES))


async def joints(_: Cell, __: str, arm: Magician, random: Random) -> None:
    mode = random.choice([PTPMode.MOVJ_ANGLE, PTPMode.MOVL_ANGLE, PTPMode.JUMP_ANGLE])
    await arm.move_joints(random.uniform(-60, 60), random.uniform(10, 60), random.uniform(10, 60), 0, mode=mode)


async def increment(_: Cell, __: str, arm: Magician, random: Random) -> None:
    mode = random.choice([PTPMode.MOVJ_INC, PTPMode.MOVL_INC, PTPMode.MOVJ_XYZ_INC])
    await arm.move_by(*(random.uniform(-40, 40) for _step in range(3)), mode=mode)


async def rest(_: Cell, __: str, arm: Magician, random: Random) -> None:
    await arm.move_to(*place(random), mode=random.choice(MODES))
    await asyncio.sleep(random.random())


async def away(_: Cell, __: str, arm: Magician, ___: Random) -> None:
    await arm.move_to(*AWAY)


async def batch(_: Cell, __: str, arm: Magician, random: Random) -> None:
    async with arm.queue.batch() as steps:
        for _step in range(random.randint(2, 5)):
            match random.randrange(5):
                case 0:
                    steps.put(c.SET_END_EFFECTOR_PARAMS, c.EndEffectorParams(*random.choice(TOOLS)))
                case 1:
                    steps.put(c.SET_PTP_JUMP_PARAMS, c.PTPJumpParams(random.uniform(1, 60), 150))
                case 2:
                    steps.wait(random.random())
                case _:
                    steps.move_to(*place(random), mode=random.choice(MODES))

    if random.random() < 0.7:
        await arm.queue.join()


async def path(_: Cell, __: str, arm: Magician, random: Random) -> None:
    async with arm.queue.batch() as steps:
        for _step in range(random.randint(2, 5)):
            steps.path_to(*place(random))

        steps.arc((*place(random), 0.0), (*place(random), 0.0))

    await arm.queue.join()


async def change(_: Cell, __: str, arm: Magician, random: Random) -> None:
    tool = c.EndEffectorParams(*random.choice(TOOLS))
    match random.randrange(3):
        case 0:
            await arm.set_end_effector(tool)
        case 1:
            await arm.request(c.SET_END_EFFECTOR_PARAMS, tool)
        case _:
            await arm.queue.put(c.SET_END_EFFECTOR_PARAMS, tool)


async def change_on_the_way(_: Cell, __: str, arm: Magician, random: Random) -> None:
    for _step in range(2):
        await arm.queue.move_to(*place(random), mode=random.choice(MODES))

    await asyncio.sleep(random.random() / 5)
    await arm.request(c.SET_END_EFFECTOR_PARAMS, c.EndEffectorParams(*random.choice(TOOLS)))
    await arm.queue.join()


async def lift(_: Cell, __: str, arm: Magician, random: Random) -> None:
    await arm.request(c.SET_PTP_JUMP_PARAMS, c.PTPJumpParams(random.uniform(1, 60), random.uniform(100, 180)))


async def ride(cell: Cell, name: str, arm: Magician, random: Random) -> None:
    on_rail = cell.monitor.stands[name].rail is not None
    if on_rail and random.random() < 0.3:
        await arm.set_rail(on=random.random() < 0.8)

    await arm.move_to(*place(random), l=random.uniform(0, 400))


async def jog(_: Cell, __: str, arm: Magician, random: Random) -> None:
    await arm.jog(random.choice([each for each in Jog if "RAIL" not in each.name]), random.random() / 3)


async def home(_: Cell, __: str, arm: Magician, random: Random) -> None:
    await (arm.home() if random.random() < 0.5 else arm.queue.home())


async def stop(_: Cell, __: str, arm: Magician, random: Random) -> None:
    motion = await arm.queue.move_to(*place(random), mode=random.choice(MODES))
    await asyncio.sleep(random.random() / 3)
    await arm.stop()
    with suppress(DobotError):
        await motion


async def alarm(cell: Cell, name: str, arm: Magician, random: Random) -> None:
    for _step in range(2):
        await arm.queue.move_to(*place(random), mode=random.choice(MODES))

    await asyncio.sleep(random.random() / 3)
    cell.sims[name].arm.raise_alarm(0x40)
    await arm.queue.join()


async def power(cell: Cell, name: str, arm: Magician, random: Random) -> None:
    if random.random() < 0.7:
        await arm.queue.move_to(*place(random), mode=random.choice(MODES))
        await asyncio.sleep(random.random() / 3)

    cell.monitor.switch_off_and_on(name)
    await asyncio.sleep(random.random())
    await arm.queue.join()


async def together(cell: Cell, name: str, _: Magician, random: Random) -> None:
    other = random.choice([each for each in cell.sims if each != name])
    async with cell.fleet.together(name, other) as batches:
        for each in batches:
            for _step in range(random.randint(1, 3)):
                batches[each].move_to(*place(random), mode=random.choice(MODES))

    await batches.wait()


async def hold(cell: Cell, _: str, arm: Magician, random: Random) -> None:
    async with cell.fleet.zone(random.choice(list(cell.monitor.zones)), timeout=5):
        await arm.move_to(*place(random))


async def cancelled(_: Cell, __: str, arm: Magician, random: Random) -> None:
    with suppress(TimeoutError):
        async with asyncio.timeout(random.random() / 3):
            await arm.move_to(*place(random), mode=random.choice(MODES))


STEPS: Mapping[Step, int] = {
    move: 12,
    joints: 5,
    increment: 4,
    away: 8,
    batch: 6,
    path: 3,
    change: 3,
    change_on_the_way: 3,
    lift: 2,
    ride: 4,
    jog: 2,
    home: 1,
    stop: 3,
    alarm: 2,
    power: 2,
    hold: 3,
    cancelled: 3,
    rest: 8,
    together: 3,
}
"""How often each is done."""


def some_zone(random: Random) -> tuple[Zone, Box | Cylinder]:
    """A zone, as the monitor and as the fleet know it."""
    x, y, z = random.uniform(190, 270), random.uniform(-100, 120), random.uniform(20, 70)
    if random.random() < 0.3:
        radius, high = random.uniform(20, 60), random.uniform(30, 80)
        return Zone((x, y, z), (0, 0, high), radius), Cylinder(x, y, radius, (z - high, z + high))

    half = (random.uniform(20, 60), random.uniform(20, 60), random.uniform(30, 80))
    spans = [(middle - size, middle + size) for middle, size in zip((x, y, z), half, strict=True)]
    return Zone((x, y, z), half), Box(*spans)


def in_one(zones: Mapping[str, tuple[Zone, Any]], stands: Mapping[str, Stand]) -> bool:
    """Whether somebody would stand in a zone from the beginning."""
    return any(zone.has(stand.tool(START, TOOLS[0]), NEAR) for zone, _ in zones.values() for stand in stands.values())


async def leave_something(sim: Simulation, random: Random) -> None:
    """What an earlier program leaves in the queue of an arm."""
    async with Magician.connect(sim.url) as arm:
        await arm.queue.wait(random.uniform(0, 10))
        for _step in range(random.randint(1, 3)):
            await arm.queue.move_to(*place(random))
            await arm.queue.wait(random.uniform(0, 5))


async def run(seed: int, guard: Literal["on", "off"], say: Callable[[str], None], *, stopped: bool) -> Figures:
    """Runs a seed, to the end of all programs, or until the fleet is stopped."""
    random, loop = Random(seed), asyncio.get_running_loop()
    names = "abcd"[: random.randint(2, 4)]
    stands = {
        name: Stand(
            random.uniform(-30, 30),
            random.uniform(-30, 30),
            random.uniform(-20, 20),
            random.uniform(-20, 20),
            random.choice([None, None, 90.0, 0.0, -60.0]),
        )
        for name in names
    }
    zones: dict[str, tuple[Zone, Box | Cylinder]] = {}
    while not zones or in_one(zones, stands):
        zones = {f"zone {number}": some_zone(random) for number in range(random.randint(1, 3))}

    async with AsyncExitStack() as stack:
        sims: dict[str, Simulation] = {}
        members: dict[str, Member[Magician]] = {}
        for name, stand in stands.items():
            faults = Faults(latency=random.choice([0.0, 0.003, 0.02]), loss=random.choice([0.0, 0.0, 0.02]))
            sims[name] = sim = await stack.enter_async_context(
                simulate(speed=SPEED, seed=random.randrange(1 << 30), faults=faults, homed=True)
            )
            sim.arm.guide_to(*AWAY)
            if stand.rail is not None and random.random() < 0.8:
                async with Magician.connect(sim.url) as arm:
                    await arm.set_rail()

            keep = random.random() < 0.3 and not any(each.options["queue"] == "keep" for each in members.values())
            if keep:
                await leave_something(sim, random)

            mode: Any = random.choice(["wait", "wait", "raise"]) if guard == "on" else "off"
            options = {"queue": "keep" if keep else "fresh", "timeout": 20.0}
            base = BaseFrame(stand.x, stand.y, stand.z, stand.yaw)
            members[name] = Member(sim.url, Magician, options, base, "alone", mode, rail=stand.rail)

        monitor = Monitor(sims, stands, {name: seen for name, (seen, _) in zones.items()})
        watching = [asyncio.create_task(monitor.watch())]
        shapes = {name: shape for name, (_, shape) in zones.items()}
        connecting = Fleet.connect(members, zones=shapes, groups={"alone": "alone"})
        try:
            fleet = await stack.enter_async_context(connecting)
            watching.append(asyncio.create_task(waits.watch(fleet._zones.locks)))
            cell = Cell(random, sims, fleet, monitor, say, STEPS)
            steps = random.randint(4, 12)
            work = fleet.run({name: cell.program(name, Random(random.random()), steps) for name in names})
            if stopped:
                await stop_in(work, cell)
            else:
                async with asyncio.timeout(LONG):
                    await work
        except TimeoutError:
            raise Violation(f"somebody hangs; held: {[(zone, fleet.holders(zone)) for zone in zones]}") from None
        finally:
            await waits.end(watching)

        return Figures(loop.time(), cell.told, cell.done, monitor.seen, cell.failures)


async def stop_in(work: Coroutine[Any, Any, Any], cell: Cell) -> None:
    """Stops the fleet in the middle of work."""
    working = asyncio.create_task(work)
    try:
        await cell.stop()
    finally:
        working.cancel()
        await asyncio.wait([working])


def run_seed(
    seed: int,
    say: Callable[[str], None] = lambda _: None,
    *,
    guard: Literal["on", "off"] = "on",
    stopped: bool = False,
) -> Figures:
    """Runs a seed; raises Violation if something does not hold."""
    found: list[Figures] = []

    async def scene() -> None:
        found.append(await run(seed, guard, say, stopped=stopped))

    run_virtual(scene())
    return found[0]
