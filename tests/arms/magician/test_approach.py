"""When a motion cannot end yet: never later than it does, and with few questions."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import count
from typing import Any

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from virtual import virtual

from dobot_async import Magician, MotionStopped, PTPMode
from dobot_async._core.queue.executor import Entry
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.arrival import Approach
from dobot_async.simulator import simulate

SHORT = 0.03  # seconds; of a motion that is over after a few looks the speed is not known
LATE = 0.003


def motion(mode: PTPMode = PTPMode.MOVL_XYZ, x: float = 100.0) -> Entry:
    return Entry(c.SET_PTP_CMD, c.PTPCmd(mode, x, 0.0, 0.0, 0.0), None)


def told(approach: Approach, entry: Entry) -> float | None:
    """What it says; nothing here waits for anything."""
    try:
        approach.remaining(entry).send(None)
    except StopIteration as done:
        return done.value  # type: ignore[no-any-return]

    raise AssertionError("it waits")


@dataclass
class Mover:
    """Starts at 0 at second 0, goes `way` mm along x: speeds up, cruises, slows down as it has sped up."""

    way: float
    speed: float
    ramp: float
    now: float = 0.0
    looks: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.ramp = min(self.ramp, self.way / self.speed)
        self.end = self.way / self.speed + self.ramp

    def gone(self) -> float:
        now = min(max(self.now, 0.0), self.end)
        if now < self.ramp:
            return self.speed * now * now / self.ramp / 2

        if now > self.end - self.ramp:
            return self.way - self.speed * (self.end - now) ** 2 / self.ramp / 2

        return self.speed * (now - self.ramp / 2)

    async def look(self) -> c.Pose:
        self.looks.append(self.now)
        return c.Pose(self.gone(), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

    def clock(self) -> float:
        return self.now


@given(
    way=st.floats(5.0, 300.0),
    speed=st.floats(10.0, 500.0),
    ramp=st.floats(0.02, 0.5),
    before=st.floats(0.0, 0.5),
    gaps=st.lists(st.floats(0.002, 0.01), min_size=1),
)
def test_no_motion_ends_while_the_arm_is_left_alone(
    way: float, speed: float, ramp: float, before: float, gaps: list[float]
) -> None:
    """All that is said to remain is slept; also if it was asked before the arm set off, as behind a pause."""
    arm = Mover(way, speed, ramp, now=-before)
    assume(arm.end > SHORT)
    approach = Approach(arm.look, arm.clock)
    entry = motion(x=way)
    for number in count():
        least = told(approach, entry) or 0.0
        assert arm.now + least <= arm.end + LATE
        arm.now += max(least, gaps[number % len(gaps)])
        if arm.now >= arm.end:
            return


def test_a_long_motion_takes_few_looks() -> None:
    arm = Mover(way=1000.0, speed=100.0, ramp=0.5)
    approach = Approach(arm.look, arm.clock)
    entry = motion(x=1000.0)
    while arm.now < arm.end:
        least = told(approach, entry)
        arm.now += max(least or 0.0, 0.001)

    assert len(arm.looks) < 40


def test_of_a_continuous_path_nothing_tells() -> None:
    arm = Mover(way=100.0, speed=100.0, ramp=0.1)
    path = Entry(c.SET_CP_CMD, c.CPCmd(c.CPMode.ABSOLUTE, 100.0, 0.0, 0.0, 0.0), None)
    assert told(Approach(arm.look, arm.clock), path) is None
    assert not arm.looks


@pytest.mark.parametrize(
    "go",
    [
        lambda arm: arm.move_to(260, 100, 40, mode=PTPMode.MOVL_XYZ),
        lambda arm: arm.move_to(260, 100, 40),
        lambda arm: arm.move_to(260, 100, 40, mode=PTPMode.JUMP_XYZ),
        lambda arm: arm.move_to(260, 100, 40, mode=PTPMode.JUMP_MOVL_XYZ),
        lambda arm: arm.move_joints(30, 30, 30, 0),
        lambda arm: arm.move_by(20, 60, -20),
        lambda arm: arm.move_by(20, 10, -10, mode=PTPMode.MOVJ_INC),
        lambda arm: arm.wait(3),
    ],
)
@virtual
async def test_an_arm_is_asked_seldom_on_its_way_and_often_near_its_end(go: Callable[[Magician], Any]) -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        await arm.move_to(200, 0, 40)
        before = arm.link.stats.sent
        await go(arm)
        loop = asyncio.get_running_loop()
        move = sim.arm.executed[-1]
        assert move.finished <= loop.time() <= move.finished + LATE
        assert arm.link.stats.sent - before < (move.finished - move.started) / 0.012


@pytest.mark.full
@virtual
async def test_an_arm_that_was_paused_is_waited_for() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        await arm.move_to(200, 0, 40)
        await arm.queue.pause()
        move = await arm.queue.move_to(260, 100, 40)
        waiting = asyncio.create_task(move.wait())
        await asyncio.sleep(60)
        await arm.queue.resume()
        await waiting
        assert asyncio.get_running_loop().time() <= sim.arm.executed[-1].finished + LATE


@virtual
async def test_what_is_put_behind_a_stop_is_not_left_alone_for_the_sake_of_what_was_stopped() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        await arm.move_to(200, 0, 40)
        long = await arm.queue.move_to(200, 250, 40)
        waiting = asyncio.create_task(long.wait())
        await asyncio.sleep(0.5)
        await arm.queue.clear()
        with pytest.raises(MotionStopped):
            await waiting

        await arm.queue.wait(0.01)
        await arm.queue.join()
        assert asyncio.get_running_loop().time() <= sim.arm.executed[-1].finished + 2 * LATE
