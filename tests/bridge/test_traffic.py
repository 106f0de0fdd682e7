"""Many programs at one arm whose line is bad for a while: a bridge serves them as well as the bare line would."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import AbstractAsyncContextManager, AsyncExitStack
from functools import partial

import pytest
from bridge_rig import until
from traffic import Figures, Programs, bare, through_a_bridge
from virtual import run_virtual
from virtual_ports import virtual_ports
from zenoh_rig import endpoint, warm_up

from dobot_async.simulator import Simulation, simulate

__all__ = ["virtual_ports"]

BAD = 1.5  # seconds
SETTLES = 1.0
LOOKED_AT = 3.0
WORST = 0.95
Way = Callable[[Simulation, str, int], AbstractAsyncContextManager[Programs]]


@pytest.fixture(scope="module", autouse=True)
def runtime() -> None:
    warm_up()


async def trouble(sim: Simulation, what: str, bad: float = BAD) -> None:
    """Makes the arm's line bad for a while, in seconds, and clean again."""
    if what == "blip":
        sim.faults.stalled = True
        await asyncio.sleep(0.02)
        sim.faults.stalled = False
    elif what == "break":
        sim.unplug()
        await asyncio.sleep(bad)
    elif what in {"stalled", "silent"}:
        setattr(sim.faults, what, True)
        await asyncio.sleep(bad)
        setattr(sim.faults, what, False)
    else:
        sim.faults.loss = sim.faults.corrupt = 0.05
        await asyncio.sleep(bad)
        sim.faults.loss = sim.faults.corrupt = 0.0


class Seen:
    """What came of it.

    Attributes:
        figures: What the programs were told.
        during: The share of reads that were answered while the line was bad.
        after: Answers a second when it had been clean for a while, and the share of reads.
        done: Motions after that.
    """

    def __init__(self, figures: Figures, bad: float, clean: float, moves: int) -> None:
        self.figures = figures
        _, self.during = figures.between(bad, clean + SETTLES)
        self.after = figures.between(clean + SETTLES, clean + SETTLES + LOOKED_AT)
        self.done = figures.moves - moves


def seen(way: Way, family: str, what: str, programs: int = 5, *, moves: bool = True) -> Seen:
    """Runs it on the virtual clock."""
    found: list[Seen] = []

    async def run() -> None:
        now = asyncio.get_running_loop().time
        async with simulate(family, seed=3, speed=20) as sim:
            sim.faults.latency = 0.005
            async with way(sim, family, programs) as running:
                await asyncio.sleep(0.5)
                began = now()
                await trouble(sim, what)
                clean = now()
                await asyncio.sleep(SETTLES + 1.0)  # a motion that was lost on its way is noticed a second later
                done = running.figures.moves
                await asyncio.sleep(LOOKED_AT - 1.0)
                found.append(Seen(running.figures, began, clean, done))

    run_virtual(run())
    return found[0]


def assert_as_good(served: Seen, own: Seen) -> None:
    assert own.after[0] > 0
    assert served.after[0] >= WORST * own.after[0], "answers a second, afterwards"
    assert served.after[1] >= WORST * own.after[1], "share of reads, afterwards"
    assert served.during >= WORST * own.during, "share of reads, while the line was bad"
    assert not served.figures.failures["ConnectionLost"]


@pytest.mark.cases(1)
@pytest.mark.usefixtures("virtual_ports")
@pytest.mark.parametrize("what", ["blip", "loss", "stalled", "silent", "break"])
def test_a_magician_is_served_as_well_as_by_the_bare_line(what: str) -> None:
    own = seen(bare, "magician", what)
    served = seen(through_a_bridge, "magician", what)
    assert_as_good(served, own)
    # For some seconds after a loss each command is asked for once more: decision 0006.
    assert served.done >= 0.8 * own.done > 0


@pytest.mark.full
@pytest.mark.usefixtures("virtual_ports")
@pytest.mark.parametrize(("listen", "programs"), [("ws://127.0.0.1:0", 5), ("tcp://127.0.0.1:0", 15)])
def test_by_whichever_way_and_however_many_they_are(listen: str, programs: int) -> None:
    own = seen(bare, "magician", "loss", programs)
    assert_as_good(seen(partial(through_a_bridge, listen=listen), "magician", "loss", programs), own)


@pytest.mark.cases(1)
@pytest.mark.usefixtures("virtual_ports")
@pytest.mark.parametrize("family", ["mycobot280", "ultraarm"])
@pytest.mark.parametrize("what", ["blip", "loss", "break"])
def test_other_arms_are_served_as_well(family: str, what: str) -> None:
    own = seen(partial(bare, moves=False), family, what)
    assert_as_good(seen(partial(through_a_bridge, moves=False), family, what), own)


@pytest.mark.full
async def test_ways_that_know_no_virtual_clock_serve_as_well() -> None:
    places = ["pty", "udp://127.0.0.1:0", f"zenoh://left?listen={endpoint()}"]
    async with AsyncExitStack() as stack:
        sims = [await stack.enter_async_context(simulate(listen="tcp://127.0.0.1:0", seed=3, speed=20)) for _ in places]
        running = [
            await stack.enter_async_context(through_a_bridge(sim, "magician", 5, listen))
            for sim, listen in zip(sims, places, strict=True)
        ]
        await asyncio.gather(*(trouble(sim, "loss", 0.7) for sim in sims))
        marks = [len(each.figures.reads) for each in running]
        await until(
            lambda: all(len(each.figures.reads) >= mark + 60 for each, mark in zip(running, marks, strict=True))
        )
        for each, mark in zip(running, marks, strict=True):
            assert sum(answered for _, answered in each.figures.reads[:mark]) >= WORST * mark
            assert all(answered for _, answered in each.figures.reads[mark + 25 :])
            assert not each.figures.failures["ConnectionLost"]
