"""An engraving that is interrupted at any moment, and gone on with: what the simulated arm recorded decides."""

from __future__ import annotations

import asyncio
import math
import random
from typing import Any

import pytest
from burner import Burner, ends_of
from virtual import run_virtual, virtual

from dobot_async import Magician, MotionStopped, UltraArm
from dobot_async.arms.magician import commands as m
from dobot_async.arms.ultraarm import commands as u
from dobot_async.simulator import Simulation, simulate
from dobot_async.toolpath import Drawing, Stroke, Toolpath, WorkPlane, estimate

PLANE = WorkPlane.flat(200, -20, -40)
WAYS_OUT = ["stop", "arm.stop", "cancel", "timeout", "twice"]


def dashes(rows: int = 5) -> Toolpath:
    """A dithered picture: rows of short dashes, to and fro, some of several powers; and a line that is long."""
    strokes = []
    for row in range(rows):
        dots = [(x * 1.1, row * 0.5) for x in range(14)]
        some = [Stroke((start, (start[0] + 0.7, start[1])), 40) for start in dots]
        strokes += some if row % 2 == 0 else [stroke.reversed() for stroke in reversed(some)]

    zigzag = tuple((3 + x * 0.8, 5 + 2 * (x % 2)) for x in range(12))
    strokes.append(Stroke(zigzag, tuple(10.0 + 5 * x for x in range(12))))
    strokes.append(Stroke(((0.0, 10.0), (40.0, 10.0)), 70))
    return Toolpath(tuple(strokes))


async def interrupt(drawing: Drawing, arm: Any, how: str, seconds: float, how_to_begin: dict[str, Any]) -> bool:
    """Ends a drawing after so many seconds, in one of the ways; whether it had not ended before."""
    expected: Any = {"cancel": asyncio.CancelledError, "twice": asyncio.CancelledError, "timeout": TimeoutError}

    async def within() -> None:
        async with asyncio.timeout(seconds if how == "timeout" else None):
            await drawing.run(**how_to_begin)

    task = asyncio.create_task(within())
    await asyncio.sleep(seconds)
    if task.done():
        await task
        return False

    if how == "stop":
        await drawing.stop()
    elif how == "arm.stop":
        await arm.stop()
    elif how != "timeout":
        task.cancel()
        if how == "twice":
            await asyncio.sleep(0.001)
            task.cancel()

    with pytest.raises(expected.get(how, MotionStopped)) as caught:
        await task

    if how != "timeout":
        done = drawing.next_stroke == drawing.progress.of
        rest = "all strokes are done" if done else f"{drawing.how_to_go_on()} draws the rest"
        assert rest in "".join(caught.value.__notes__)

    return True


@pytest.mark.cases(1)
@pytest.mark.parametrize("how", WAYS_OUT)
@pytest.mark.parametrize("seed", range(4))
def test_a_laser_burns_each_way_once_however_often_and_whenever_it_is_interrupted(how: str, seed: int) -> None:
    path, chance = dashes(), random.Random(f"{how} {seed}")
    whole = estimate(path, PLANE, tool="laser").seconds

    async def run() -> None:
        async with simulate(seed=seed) as sim, Magician.connect(sim.url) as arm:
            burner = Burner(sim)
            begin: dict[str, Any] = {}
            times = 0
            for _ in range(60):
                # Another program goes on each time, which knows nothing but what the first one has told.
                drawing = Drawing(arm, path, PLANE, tool="laser")
                going_on = await interrupt(drawing, arm, how, chance.uniform(0.05, whole / 3), begin)
                burner.look()
                if not going_on:
                    break

                times += 1
                assert sim.arm.laser == 0
                assert not sim.arm.device.moving
                stands, executed = sim.arm.pose, len(sim.arm.executed)
                await asyncio.sleep(3)
                assert (sim.arm.pose, sim.arm.laser) == (stands, 0)
                assert len(sim.arm.executed) == executed
                if drawing.next_stroke == len(path):
                    break

                begin = {"first": drawing.next_stroke, "point": drawing.next_point}

            assert times >= 3
            assert burner.ends == ends_of(path, PLANE)
            assert burner.length == pytest.approx(path.length, abs=0.02 * times)

    run_virtual(run())


@pytest.mark.full
@pytest.mark.parametrize("seed", range(6))
def test_a_pen_draws_again_what_it_was_interrupted_in_and_no_stroke_that_is_done(seed: int) -> None:
    path, chance = dashes(3), random.Random(seed)
    whole = estimate(path, PLANE).seconds
    ends = ends_of(path, PLANE)

    async def run() -> None:
        async with simulate(seed=seed) as sim, Magician.connect(sim.url) as arm:
            times, begin = 0, 0
            for _ in range(60):
                drawing = Drawing(arm, path, PLANE)
                how = chance.choice(WAYS_OUT)
                going_on = await interrupt(drawing, arm, how, chance.uniform(0.1, whole / 3), {"first": begin})
                begin = drawing.next_stroke
                if not going_on or begin == len(path):
                    break

                times += 1
                assert not sim.arm.device.moving
                assert drawing.next_point == 0

            done = [
                (round(each.value.x, 2), round(each.value.y, 2))
                for each in sim.arm.executed
                if each.command is m.SET_CP_CMD and each.outcome == "done"
            ]
            again = len(done) - len(ends)
            assert set(done) == set(ends)
            # Of the zigzag some points are drawn again; a stroke of one way only if it was stopped while it was lifted.
            single = ends[: 3 * 14]
            assert sum(done.count(end) - 1 for end in single) == 0
            assert times >= 3
            assert again <= 11 * times

    run_virtual(run())


@pytest.mark.full
@pytest.mark.parametrize("how", ["alarm", "dead"])
@pytest.mark.parametrize("seed", range(4))
def test_what_is_not_known_to_be_done_is_burnt_again_and_nothing_is_left_out(how: str, seed: int) -> None:
    path, chance = dashes(), random.Random(seed)
    whole = estimate(path, PLANE, tool="laser").seconds

    async def run() -> None:
        async with simulate(seed=seed) as sim, Magician.connect(sim.url) as arm:
            burner = Burner(sim)
            drawing = Drawing(arm, path, PLANE, tool="laser")
            task = asyncio.create_task(drawing.run())
            await asyncio.sleep(chance.uniform(0.3, 0.8) * whole)
            if how == "alarm":
                sim.arm.raise_alarm(0x48)
            else:
                sim.faults.silent = True

            with pytest.raises(Exception, match=r"(?i)alarm|answer|known"):
                await task

            sim.faults.silent = False
            await asyncio.sleep(5)
            assert sim.arm.laser == 0
            assert not sim.arm.device.moving
            await arm.recover()
            burner.look()
            already = set(burner.ends)
            before = drawing.next_stroke
            await drawing.run()
            burner.look()
            assert set(burner.ends) == set(ends_of(path, PLANE))
            if how == "alarm":
                # As many as lie between two looks of half a second.
                twice = len(burner.ends) - len(set(burner.ends))
                assert twice <= 0.8 / (whole / len(path)) + 12
                assert before > 0
                assert already

    run_virtual(run())


async def until_it_stands(sim: Simulation) -> None:
    while sim.arm.device.moving:  # noqa: ASYNC110 - no event tells it
        await asyncio.sleep(0.0005)


@pytest.mark.full
@virtual
async def test_an_index_that_does_not_agree_with_the_place_is_not_believed() -> None:
    path = dashes()
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        drawing = Drawing(arm, path, PLANE, tool="laser")
        task = asyncio.create_task(drawing.run())
        await asyncio.sleep(8)
        known = drawing.next_stroke
        task.cancel()
        await until_it_stands(sim)
        sim.arm.guide_to(250, 50, 0)  # somebody has pushed it meanwhile
        with pytest.raises(asyncio.CancelledError):
            await task

        assert known <= drawing.next_stroke <= known + 1


@virtual
async def test_where_to_begin_is_checked() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        requests = sim.arm.counters.requests
        laser, pen = Drawing(arm, dashes(), PLANE, tool="laser"), Drawing(arm, dashes(), PLANE)
        last = len(dashes()) - 1
        bad: list[tuple[Drawing, dict[str, Any], str]] = [
            (laser, {"first": last, "point": 1}, "point must be 0 or above and below 1"),
            (laser, {"first": last, "point": -0.1}, "point must be"),
            (laser, {"first": last, "point": math.nan}, "point must be"),
            (laser, {"first": last + 1}, f"first must be in 0 to {last}"),
            (pen, {"first": 0, "point": 0.5}, "point is for lasers alone"),
        ]
        for drawing, options, why in bad:
            with pytest.raises(ValueError, match=why):
                await drawing.run(**options)

        assert sim.arm.counters.requests == requests
        await laser.run(first=last, point=0.75)
        burner = Burner(sim)
        burner.look()
        assert burner.length == pytest.approx(10, abs=0.01)


@pytest.mark.full
@pytest.mark.parametrize("seed", range(3))
def test_an_ultraarm_leaves_nothing_out_and_its_laser_is_off(seed: int) -> None:
    plane, chance = WorkPlane.flat(180, -40, 20), random.Random(seed)
    path = Toolpath.of([(0, 0), (20, 0), (20, 10)], [(0, 20), (30, 20)], [(0, 30), (30, 30)], power=50)

    async def run() -> None:
        async with simulate("ultraarm") as sim, UltraArm.connect(sim.url) as arm:
            await arm.home()
            begin: dict[str, Any] = {}
            times = 0
            for _ in range(30):
                drawing = Drawing(arm, path, plane, tool="laser", speed=60)
                if not await interrupt(drawing, arm, chance.choice(WAYS_OUT[:3]), chance.uniform(2.2, 4.2), begin):
                    break

                times += 1
                assert not sim.arm.registers.laser
                await asyncio.sleep(20)
                assert not sim.arm.registers.laser
                assert sim.arm.registers.pwm == 0
                begin = {"first": drawing.next_stroke, "point": drawing.next_point}
                await arm.recover()
                await arm.home()

            burnt, duty = [], 0
            for each in sim.arm.executed:
                if each.command is u.SET_PWM:
                    duty = each.value.duty
                elif each.name == "G1" and duty and each.outcome == "done":
                    burnt.append((each.value.x, each.value.y))

            assert set(burnt) >= {plane.to_arm(*point)[:2] for stroke in path for point in stroke.points[1:]}
            assert len(burnt) <= 4 + times
            assert times >= 2

    run_virtual(run())
