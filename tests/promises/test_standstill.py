"""No orphan motion: whatever ends a call on a line that is gone, once the line is back the arm stands within 1 s.

    verb x what ends it x what is wrong with the line, for how long x when

Random cases, each from its own seed. In one half the connection's block stays open, and what is promised holds however
long the line was gone. In the other half the block is left by the exception; there the line is back while the driver
may still be leaving, for behind that nobody is there to speak to the arm. The simulated arm decides whether it stands.
The quick form takes some of the seeds, PROMISES=all a thousand.
"""

from __future__ import annotations

import asyncio
import os
from collections.abc import Awaitable, Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from random import Random
from typing import Any

import pytest
from promise_arms import BY_NAME, FAMILIES, Bench, Family, bench, each_family, place, simulated, stands
from promise_clock import end_of, now, on_virtual_clock, run_on_virtual_clock
from promise_line import Lines, Manner

from dobot_async import DobotError
from dobot_async.simulator import Simulation

pytestmark = pytest.mark.timeout(100)
EVERYTHING = os.environ.get("PROMISES") == "all"
SEEDS, QUICK, BLOCK = 1000, 240, 10
STANDS_WITHIN = 1.0
LEAVING = 2.0  # seconds that leaving a block may take
MARGIN = 0.5  # of these, in which a stop that is on its way at the end need not arrive any more
STOPPING = 1.0  # seconds after which a user has had enough of waiting for a stop


class UsersError(Exception):
    """What goes wrong in a user's program."""


async def jogging(arm: Any, family: Family) -> None:
    """Jogs until it is ended."""
    async with arm.jogging(family.jog):
        await asyncio.sleep(600)


async def download(arm: Any, _: Family) -> None:
    """Stores many motions in a Magician."""
    async with arm.queue.download() as program:
        for step in range(300):
            program.move_to(200 + step / 10, 0, 40)


async def queued(arm: Any, family: Family) -> None:
    """Queues motions in a batch, and waits for all."""
    async with arm.queue.batch() as batch:
        for share in (1, 0.5, 0.9, 0.4):
            batch.move_joints(*(share * joint for joint in family.far))

    await arm.queue.join()


async def put(arm: Any, family: Family) -> None:
    """Queues motions one by one, and waits for the first."""
    first = await arm.queue.move_joints(*family.far)
    for share in (0.5, 0.9, 0.4):
        await arm.queue.move_joints(*(share * joint for joint in family.far))

    await first


async def behind(arm: Any, family: Family) -> None:
    """Moves behind another motion."""
    await arm.queue.move_joints(*family.far)
    await arm.move_joints(*family.near)


VERBS: Mapping[str, Callable[[Any, Family], Awaitable[None]]] = {
    "move": lambda arm, family: arm.move_joints(*family.far),
    "move with a timeout": lambda arm, family: arm.move_joints(*family.far, timeout=0.7),
    "move behind another": behind,
    "jog": lambda arm, family: arm.jog(family.jog, 600),
    "short jog": lambda arm, family: arm.jog(family.jog, 0.6),
    "jogging": jogging,
    "download": download,
    "queue": queued,
    "put": put,
}
OWNED = ("move", "move with a timeout", "move behind another", "jog", "short jog", "jogging")
"""The call owns its motion: when it is ended, the arm stops, though the block stays open."""


@dataclass(frozen=True)
class Case:
    """One case.

    Attributes:
        family: Whose arm.
        verb: Of `VERBS`.
        end: "cancel", "timeout"; with an open block also "stop", without it also "error", beside the call.
        fault: "dead" or "still".
        fault_at: Seconds after the verb began.
        end_at: Seconds after the verb began.
        gone: Seconds for which the line is gone.
        leaves: Whether the block is left.
    """

    family: str
    verb: str
    end: str
    fault: str
    fault_at: float
    end_at: float
    gone: float
    leaves: bool


def case_of(seed: int) -> Case:
    """The case of a seed."""
    random = Random(seed)
    leaves = seed % 2 == 1
    family = random.choice(FAMILIES).name
    end = random.choice(("cancel", "timeout", "error" if leaves else "stop"))
    verb = random.choice(
        [
            name
            for name in VERBS
            if (family == "magician" or name != "download")
            and (leaves or end == "stop" or name in OWNED)  # a queue's motions go on when a wait for them is ended
        ]
    )
    end_at = random.random() * 1.5
    fault_at = max(0.0, end_at + random.choice((0.03, -0.002, -0.02, -random.random())))
    gone = random.choice((random.random(), 5 * random.random(), 60 * random.random()))
    if leaves:
        gone = max(0.0, end_at - fault_at + random.random() * (LEAVING - MARGIN))

    return Case(family, verb, end, random.choice(("dead", "still")), fault_at, end_at, gone, leaves)


async def outage(lines: Lines, case: Case) -> None:
    """Takes the line away for a while."""
    await asyncio.sleep(case.fault_at)
    if case.fault == "dead":
        lines[0].die()
    else:
        lines[0].stand_still()

    await asyncio.sleep(case.gone)
    lines[0].recover()


async def ended(arm: Any, case: Case) -> None:
    """Begins the verb, and ends it as the case says; raises what comes out."""
    call = VERBS[case.verb](arm, BY_NAME[case.family])
    if case.end == "timeout":
        async with asyncio.timeout(case.end_at):
            await call

        return

    task = asyncio.ensure_future(call)
    try:
        await asyncio.wait([task], timeout=case.end_at)
        if case.end == "error":
            raise UsersError

        if case.end == "cancel":
            task.cancel()
        else:
            async with asyncio.timeout(STOPPING):
                await arm.stop()
    finally:
        if case.end != "error":
            await asyncio.wait([task], timeout=0.5 if case.end == "stop" else 20)

        if case.end != "stop":
            task.cancel()  # where the error came from elsewhere, as out of a task group

        later.append(task)

    if case.end == "cancel":
        await task


later: list[asyncio.Future[Any]] = []
"""The calls of this case; a jog that was stopped is still in its block."""


async def fault_of(case: Case, seed: int) -> str:
    """Goes through a case; returns what the arm does that it should not do, "" if it stands."""
    family = BY_NAME[case.family]
    fault = ""
    later.clear()
    async with simulated(family, speed=family.slow, manner=Manner(latency=0.005), seed=seed) as (sim, lines):
        taking_away: asyncio.Task[None] | None = None
        begun = 0.0

        async def looked_at() -> str:
            assert taking_away
            await taking_away
            await asyncio.sleep(max(now(), begun + case.end_at) + STANDS_WITHIN - now())
            return await stands(sim)

        async def block() -> str:
            nonlocal taking_away, begun
            async with family.connect(sim.url) as arm:
                await asyncio.sleep(0.1)
                begun = now()
                taking_away = asyncio.create_task(outage(lines, case))
                if case.leaves:
                    await ended(arm, case)
                    return ""

                with suppress(DobotError, TimeoutError, asyncio.CancelledError):
                    await ended(arm, case)

                found = await looked_at()
                for task in later:
                    task.cancel()
                    await asyncio.wait([task], timeout=20)

                return found or await taken_up(Bench(family, sim, arm, lines, {}))

        with suppress(UsersError, DobotError, TimeoutError, asyncio.CancelledError):
            fault = await block()

        if taking_away and case.leaves:
            fault = await looked_at()

        await asyncio.gather(*later, return_exceptions=True)

    return fault


async def taken_up(b: Bench) -> str:
    """Whether the arm works: an ultraArm, which may have been released, answers; the others move when told to."""
    try:
        await b.works_again()
        if b.family.name == "ultraarm":
            return ""

        async with asyncio.timeout(10):
            # Where it has not got to, whatever it has done meanwhile.
            there = abs(place(b.sim)[0] - b.family.far[0]) < 10
            await b.arm.queue.move_joints(*(b.family.near if there else b.family.far))
    except (DobotError, TimeoutError, AssertionError) as error:
        return f"afterwards: {error!r}"

    for _ in range(30):
        await asyncio.sleep(0.1)
        if b.sim.arm.device.moving:
            await b.arm.stop()
            return ""

    return "the next motion that was queued is not executed"


@pytest.mark.cases(2)
@pytest.mark.parametrize("first", range(0, SEEDS if EVERYTHING else QUICK, BLOCK))
def test_the_arm_stands_once_the_line_is_back(first: int) -> None:
    faults = {}
    for seed in range(first, first + BLOCK):
        case = case_of(seed)
        try:
            fault = run_on_virtual_clock(fault_of(case, seed))
        except AssertionError as error:
            fault = str(error)

        if fault:
            faults[seed] = f"{fault}: {case}"

    assert not faults, "\n".join(f"seed {seed}: {fault}" for seed, fault in faults.items())


@each_family
@pytest.mark.parametrize("gone", [0.4, 1.6, 4.0, 20.0])
@on_virtual_clock
async def test_a_jog_ends_though_its_stop_is_lost(family: Family, gone: float) -> None:
    """The line goes in the middle of a jog, and the jog's time is over before it is back."""
    async with bench(family, speed=family.slow) as b:
        jog = asyncio.ensure_future(b.arm.jog(family.jog, 0.5))
        await asyncio.sleep(0.4)
        b.line.die()
        await asyncio.sleep(gone)
        b.line.recover()
        await asyncio.sleep(STANDS_WITHIN)
        assert not await stands(b.sim)
        with suppress(DobotError):
            await jog


def moved_to(sim: Simulation) -> float:
    """Where the last motion of a simulated Magician has led: its x."""
    motions = [each for each in sim.arm.executed if each.name == "SetPTPCmd" and each.outcome == "done"]
    return float(motions[-1].value.x) if motions else 0.0


async def magician_after_a_download(b: Bench, sim: Simulation) -> None:
    """The next motion that is queued is executed, and not stored."""
    await b.works_again()
    program = len(sim.arm.program.commands) if sim.arm.program else 0
    async with asyncio.timeout(20):
        await b.arm.move_to(230, 0, 40)

    assert moved_to(sim) == 230
    assert (len(sim.arm.program.commands) if sim.arm.program else 0) == program


@pytest.mark.parametrize("line", ["good", "dead", "still"])
@pytest.mark.parametrize("end", ["cancel", "anyio", "timeout", "stop"])
@on_virtual_clock
async def test_a_download_that_is_ended_leaves_no_arm_in_download_mode(end: str, line: str) -> None:
    import anyio

    async with bench(BY_NAME["magician"], speed=20) as b:

        async def scoped() -> None:
            with anyio.move_on_after(0.3):
                await download(b.arm, b.family)

        async def timed() -> None:
            with suppress(TimeoutError):
                async with asyncio.timeout(0.3):
                    await download(b.arm, b.family)

        ways = {"anyio": scoped, "timeout": timed}
        task = asyncio.ensure_future(ways[end]() if end in ways else download(b.arm, b.family))
        await asyncio.sleep(0.29)
        if line == "dead":
            b.line.die()
        elif line == "still":
            b.line.stand_still()

        await asyncio.sleep(0.01)
        if end == "cancel":
            task.cancel()
        elif end == "stop":
            with suppress(DobotError, TimeoutError):
                async with asyncio.timeout(STOPPING):
                    await b.arm.stop()

        assert (await end_of(task, 2.5)).seconds < 2.5
        await asyncio.sleep(3)
        b.line.recover()
        await asyncio.sleep(STANDS_WITHIN)
        await magician_after_a_download(b, b.sim)


@on_virtual_clock
async def test_a_stop_ends_a_download_at_once() -> None:
    async with bench(BY_NAME["magician"]) as b:
        task = asyncio.ensure_future(download(b.arm, b.family))
        await asyncio.sleep(0.3)
        before = now()
        await b.arm.stop()
        assert now() - before < 1
        ended_ = await end_of(task, 1)
        assert isinstance(ended_.error, DobotError), ended_
        assert len(b.sim.arm.program.commands) < 300
        await b.arm.move_to(230, 0, 40)
        assert moved_to(b.sim) == 230
