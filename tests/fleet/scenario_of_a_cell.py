"""One seed is one run of a cell: five guarded arms, zones, barriers and faults, on a virtual clock.

    make soak OF=cell [SEEDS=10000] [FIRST=0]     runs many of them

What must hold in each run: no two tools are ever in one zone, nobody hangs, nobody is left to wait who could go on or
never will (`waits.py`), no zone is held for ever, all arms stand still soon after one has failed, as soon as their
lines carry a stop to them, and a call whose time is over ends.

In some runs lines stand still or fall silent, for times that no clock of the driver bounds.
"""

from __future__ import annotations

import asyncio
import signal
from collections.abc import Awaitable, Callable, Iterator
from contextlib import AsyncExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from random import Random
from typing import Any

import async_solipsism
import waits

from dobot_async import ConnectionLost, DobotError, Fleet, Magician, PTPMode
from dobot_async._core.util.shapes import Shape
from dobot_async.fleet import BaseFrame, Box, Cylinder, Member, ZoneDeadlock
from dobot_async.simulator import Faults, Simulation, simulate

__all__ = ["Figures", "Violation", "run_seed"]

ZONES: dict[str, Shape | None] = {
    "low": Box(x=(200, 260), y=(-30, 30), z=(0, 70)),
    "side": Cylinder(180, 150, 35, z=(0, 90)),
    "high": Box(x=(200, 240), y=(-120, -60), z=(40, 120)),
    "turn": None,
}
"""The arms stand so near to each other that all zones are in the reach of each."""

PLACES = [(230, 0, 20), (230, 0, 60), (180, 150, 40), (200, 120, 60), (220, -90, 60), (220, -90, 20), (190, -60, 60)]
MODES = [PTPMode.MOVJ_XYZ, PTPMode.MOVL_XYZ, PTPMode.JUMP_XYZ, PTPMode.JUMP_MOVL_XYZ]
AWAY = (150, -190, 60)
NAMES = "abcde"
LONG = 2000.0  # virtual seconds after which somebody hangs
STANDING = 1.0  # virtual seconds of a good line after a failure until everybody stands still
PROMPT = 2.0  # virtual seconds after its `asyncio.timeout` in which a call ends
TICK = 0.01
PATIENCE = 60.0  # seconds of the processor after which a run never ends
TRIES = 20


class Violation(AssertionError):
    """What must hold does not."""


@dataclass(frozen=True, slots=True)
class Figures:
    """What happened in a run.

    Attributes:
        seconds: Simulated ones.
        told: Errors that programs were told of.
        deadlocks: How many of them were deadlocks.
        failures: Arms that failed.
    """

    seconds: float
    told: int
    deadlocks: int
    failures: int


@dataclass
class Run:
    """A run under way."""

    random: Random
    sims: dict[str, Simulation]
    fleet: Fleet[Magician]
    steps: int
    meets: bool
    say: Callable[[str], None]
    told: list[DobotError] = field(default_factory=list)

    async def play(self) -> None:
        """Runs all programs under the eyes of an observer."""
        work = (self.observe(), self.strike(), waits.watch(self.fleet._zones.locks))
        watching = [asyncio.create_task(each) for each in work]
        try:
            async with asyncio.timeout(LONG):
                with suppress(DobotError):
                    await self.fleet.run({name: self.program(name, Random(self.random.random())) for name in NAMES})
        except TimeoutError:
            raise Violation(f"somebody hangs; held: {self.held()}") from None
        finally:
            await waits.end(watching)

        if self.fleet.failures:
            loop = asyncio.get_running_loop()
            standing = max(good_from(sim, loop.time(), STANDING) for sim in self.sims.values())
            await asyncio.sleep(standing - loop.time())
            moving = [
                name
                for name, sim in self.sims.items()
                if sim.arm.device.executing and not isinstance(self.fleet.failures.get(name), ConnectionLost)
            ]
            if moving:
                raise Violation(f"{moving} go on although {list(self.fleet.failures)} failed")

        held = [holder for holder in self.held().get("turn", []) if holder]
        if held:
            raise Violation(f"turn is held by {held} though all programs have ended")

    async def program(self, name: str, random: Random) -> None:
        """Moves about, in and out of zones, and meets the others; a deadlock makes it give way."""
        for step in range(self.steps):
            try:
                await self.step(name, random)
            except DobotError as error:
                self.told.append(error)
                self.say(f"{asyncio.get_running_loop().time():8.3f} {name}: {type(error).__name__}: {error}")
                if self.fleet.failures:
                    raise

                await self.give_way(name)

            if self.meets and step % 3 == 2:
                await self.give_way(name)
                await self.fleet.barrier(f"step {step}")

        await self.give_way(name)

    async def give_way(self, name: str) -> None:
        """Drives out of all zones; raises what it was told if its only way out stays in a deadlock."""
        for left in reversed(range(TRIES)):
            try:
                await self.fleet[name].move_to(*AWAY)
            except DobotError:
                if self.fleet.failures or not left:
                    raise

                await asyncio.sleep(0.3)
            else:
                return

    async def step(self, name: str, random: Random) -> None:
        """One thing that a program does."""
        arm = self.fleet[name]
        where, mode, zone = random.choice(PLACES), random.choice(MODES), random.choice(list(ZONES))
        match random.randrange(6):
            case 0:
                async with self.fleet.zone(zone):
                    await arm.move_to(*where, mode=mode)
                    await asyncio.sleep(random.random() / 5)
            case 1:
                async with arm.queue.batch() as batch:
                    batch.move_to(*where)
                    batch.wait(random.random())
                    batch.move_to(*random.choice(PLACES), mode=mode)
            case 2:
                await self.hurried(name, arm.move_to(*where, mode=mode), random.random() / 5)
            case 3:
                motion = await arm.queue.move_to(*where, mode=mode)
                await asyncio.sleep(random.random() / 5)
                await arm.stop()
                with suppress(DobotError):
                    await motion
            case _:
                await arm.move_to(*where, mode=mode)

    async def hurried(self, name: str, moving: Awaitable[None], seconds: float) -> None:
        """A move with little time, which ends when that is over."""
        limit = asyncio.timeout(seconds)
        try:
            async with limit:
                await moving
        except TimeoutError as error:
            if not limit.expired():
                raise

            if isinstance(error, DobotError):
                raise Violation(f"{name}: ended with {error!r} although its time was over") from error

        if limit.expired() and asyncio.get_running_loop().time() > (limit.when() or 0.0) + PROMPT + TICK:
            raise Violation(f"{name}: went on for more than {PROMPT} s after its time was over")

    async def strike(self) -> None:
        """A disaster, in half of the runs."""
        kind = self.random.choice(["", "", "unplug", "alarm"])
        await asyncio.sleep(self.random.uniform(0, 6))
        name = self.random.choice(NAMES)
        if kind == "unplug":
            self.sims[name].unplug()
        elif kind == "alarm":
            with suppress(DobotError):
                await self.fleet[name].queue.move_joints(0, 120, 0, 0)

        await asyncio.sleep(LONG)

    async def observe(self) -> None:
        """Looks at where all tools are, all the time; arms that have failed are nobody's to move any more."""
        while True:
            tools = {name: self.tool(name) for name in NAMES}
            for zone, shape in ZONES.items():
                inside = [name for name, tool in tools.items() if shape and shape.contains(*tool)]
                if len(inside) > 1:
                    raise Violation(f"{inside} are in zone {zone}")

            await asyncio.sleep(TICK)

    def tool(self, name: str) -> tuple[float, float, float]:
        pose = self.sims[name].arm.pose
        x, y, z, _ = self.fleet.to_cell(name, pose.x, pose.y, pose.z)
        return x, y, z

    def held(self) -> dict[str, list[str]]:
        return {zone: self.fleet.holders(zone) for zone in ZONES}


def good_from(sim: Simulation, start: float, seconds: float) -> float:
    """When an arm's line has carried everything for so many seconds without a break, from `start` on."""
    at = start
    for begun, ended in sorted(sim.outages):
        if ended > at and begun < at + seconds:
            at = ended

    return at + seconds


def worsen(faults: Faults, random: Random) -> None:
    """Makes an open line one that stands still or falls silent now and then."""
    faults.stall = random.choice([0.0, 0.0, 0.001, 0.003])
    faults.silence = random.choice([0.0, 0.0, 0.0, 0.001])
    faults.stall_time = random.choice([0.3, 1.0, 4.0])
    faults.silence_time = random.choice([0.3, 1.0, 4.0])


async def run(seed: int, say: Callable[[str], None]) -> Figures:
    """Runs a seed; returns what happened, and says which errors programs are told of."""
    random, loop = Random(seed), asyncio.get_running_loop()
    async with AsyncExitStack() as stack:
        sims = {}
        for number, name in enumerate(NAMES):
            latency, loss = random.choice([0.0, 0.003, 0.02]), random.choice([0.0, 0.0, 0.02])
            faults = Faults(latency=latency, loss=loss)
            sims[name] = await stack.enter_async_context(
                simulate(speed=5, seed=random.randrange(1 << 30), faults=faults)
            )
            sims[name].arm.guide_to(150 + 5 * number, -190, 60)

        guard: Any = random.choice(["wait", "wait", "raise"])
        bases = {name: BaseFrame(*(random.uniform(-10, 10) for _ in range(2))) for name in NAMES}
        members = {name: Member(sim.url, Magician, base=bases[name], guard=guard) for name, sim in sims.items()}
        fleet = await stack.enter_async_context(Fleet.connect(members, zones=ZONES))
        for arm in NAMES:
            await fleet[arm].set_speed(random.choice([20, 50, 100]))

        if random.random() < 0.5:
            for sim in sims.values():
                worsen(sim.faults, random)

        under_way = Run(random, sims, fleet, random.randint(3, 9), random.random() < 0.5, say)
        await under_way.play()
        told = under_way.told
        deadlocks = sum(isinstance(error, ZoneDeadlock) for error in told)
        return Figures(loop.time(), len(told), deadlocks, len(fleet.failures))


@contextmanager
def not_for_ever() -> Iterator[None]:
    """Fails a run that never ends although its clock is virtual. That others have the processor does not count."""

    def end(*_: object) -> None:
        raise Violation("it never ends")

    before = signal.signal(signal.SIGVTALRM, end)
    signal.setitimer(signal.ITIMER_VIRTUAL, PATIENCE)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, before)


def run_seed(seed: int, say: Callable[[str], None] = lambda _: None) -> Figures:
    """Runs a seed; raises Violation if something does not hold."""

    async def checked() -> Figures:
        figures = await run(seed, say)
        left = asyncio.all_tasks() - {asyncio.current_task()}
        if left:
            raise Violation(f"left behind: {left}")

        return figures

    with not_for_ever(), asyncio.Runner(loop_factory=async_solipsism.EventLoop) as runner:
        return runner.run(checked())
