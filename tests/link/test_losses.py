"""What reads cost on a line that loses messages, in all families: how many fail, how long they take, what is sent."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any

import pytest
from virtual import run_virtual

from dobot_async import DobotError, Magician, MyCobot, UltraArm
from dobot_async.simulator import Faults, simulate

Read = Callable[[Any], Awaitable[Any]]
READS = 100
LOSS = 0.05
SEEDS = range(4)
ROUND_TRIP = 0.02
FAMILIES: dict[str, tuple[str, Any, Read]] = {
    "magician": ("magician", Magician, lambda arm: arm.get_pose()),
    "280 angles": ("mycobot280", MyCobot, lambda arm: arm.get_angles()),
    "280 pose": ("mycobot280", MyCobot, lambda arm: arm.get_pose()),
    "280 pin, whose answer looks like its echo": ("mycobot280", MyCobot, lambda arm: arm.get_pin(5)),
    "ultraarm": ("ultraarm", UltraArm, lambda arm: arm.get_coords()),
}


@dataclass
class Figures:
    """What a hundred reads came to."""

    seconds: float = 0.0
    failed: int = 0
    sent: int = 0
    repeated: int = 0
    unanswered: int = 0
    reply_timeout: float = 0.0


def measured(name: str, loss: float, latency: float, seed: int) -> Figures:
    """Read on a line that loses messages, at default settings, in virtual time."""
    model, kind, read = FAMILIES[name]
    figures = Figures()

    async def work() -> None:
        loop = asyncio.get_running_loop()
        async with simulate(model, seed=seed, faults=Faults(latency=latency)) as sim, kind.connect(sim.url) as arm:
            for _ in range(3):
                await read(arm)  # the round trip is known

            stats, begun = arm.link.stats, loop.time()
            before = (stats.sent, stats.repeated, stats.received)
            sim.faults.loss = loss
            for _ in range(READS):
                try:
                    await read(arm)
                except DobotError:
                    figures.failed += 1

                figures.reply_timeout = max(figures.reply_timeout, arm.link.reply_timeout)

            stats = arm.link.stats
            figures.seconds = loop.time() - begun
            figures.sent, figures.repeated = stats.sent - before[0], stats.repeated - before[1]
            figures.unanswered = figures.sent - (stats.received - before[2])
            sim.faults.loss = 0.0

    run_virtual(work())
    return figures


@pytest.mark.cases(2)
@pytest.mark.parametrize("latency", [0.0, 0.01], ids=["fast", "20 ms"])
@pytest.mark.parametrize("name", FAMILIES)
def test_reads_on_a_line_that_loses_one_message_in_twenty(name: str, latency: float) -> None:
    clean = measured(name, 0.0, latency, 0)
    assert clean.repeated == clean.failed == clean.unanswered == 0
    for seed in SEEDS:
        lossy = measured(name, LOSS, latency, seed)
        assert lossy.unanswered > 0
        assert lossy.failed == 0
        assert lossy.seconds <= 2 * clean.seconds + lossy.unanswered * lossy.reply_timeout
        assert lossy.repeated <= lossy.unanswered, "nothing is sent again that was not lost"
        assert lossy.sent <= 2 * READS


@pytest.mark.parametrize("name", FAMILIES)
def test_nothing_is_asked_again_while_its_answer_is_on_the_way(name: str) -> None:
    """The line stands still for a while, several times: each answer comes, late, and none is asked for twice."""
    model, kind, read = FAMILIES[name]

    async def work() -> None:
        async with simulate(model, faults=Faults(latency=ROUND_TRIP / 2)) as sim, kind.connect(sim.url) as arm:
            await read(arm)
            loop = asyncio.get_running_loop()
            for seconds in (0.1, 0.3, 0.6, 1.0):
                sent, repeated, at = arm.link.stats.sent, arm.link.stats.repeated, loop.time()
                sim.faults.stalled = True
                loop.call_later(seconds, setattr, sim.faults, "stalled", False)
                await read(arm)
                assert loop.time() - at >= seconds
                assert arm.link.stats.repeated == repeated
                assert arm.link.stats.sent - sent <= 1 + seconds / ROUND_TRIP, "at most one barrier a round trip"

    run_virtual(work())
