"""Arms that draw: what the simulated arm did decides, its true path, its laser, and what it did after an error."""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace
from itertools import pairwise
from typing import Any, Self

import pytest
from geometry import FILES, Line, lines_of, missed, samples
from virtual import virtual

from dobot_async import (
    ArmAlarm,
    Kinematics,
    Magician,
    MotionStopped,
    MotionUnknown,
    MyCobot,
    Pen,
    ReplyTimeout,
    UltraArm,
    Unreachable,
    UnsupportedError,
)
from dobot_async.arms.magician import commands as m
from dobot_async.arms.ultraarm import commands as u
from dobot_async.simulator import Faults, Simulation, simulate
from dobot_async.simulator.magician.arm import MAGICIAN
from dobot_async.toolpath import (
    Drawing,
    Progress,
    Stroke,
    Toolpath,
    UnreachableStroke,
    WorkPlane,
    draw,
    engrave,
    estimate,
    reachable,
    read_svg,
    write_text,
)

PAPER = WorkPlane.flat(195, -45, -50, lift=6)
TRUE = 0.2  # mm
SQUARE = [(0.0, 0.0), (20.0, 0.0), (20.0, 20.0), (0.0, 20.0), (0.0, 0.0)]
TWO = Toolpath.of(SQUARE, [(40, 0), (60, 20)], [(40, 30), (60, 40)])


@asynccontextmanager
async def magician(**options: Any) -> AsyncIterator[tuple[Simulation, Magician]]:
    async with simulate(**options) as sim, Magician.connect(sim.url) as arm:
        yield sim, arm


def burns(sim: Simulation) -> bool:
    """Whether an ultraArm's laser is on."""
    return bool(sim.arm.registers.laser)


class Tracer:
    """Looks at the true place of the tool, many times a second, and at its laser."""

    def __init__(self, sim: Simulation, plane: WorkPlane, every: float = 0.01) -> None:
        self.places: list[tuple[float, float, float, float]] = []
        self._sim, self._plane, self._every = sim, plane, every

    async def __aenter__(self) -> Self:
        self._task = asyncio.create_task(self._look())
        return self

    async def __aexit__(self, *_: object) -> None:
        self._task.cancel()
        await asyncio.gather(self._task, return_exceptions=True)

    def drawn(self, *, laser: bool = False) -> list[tuple[float, float]]:
        """Where the tool was down."""
        return [(x, y) for x, y, height, power in self.places if (power > 0 if laser else height < 0.05)]

    async def _look(self) -> None:
        while True:
            pose = self._sim.arm.pose
            self.places.append((*self._plane.to_plane(pose.x, pose.y, pose.z), self._sim.arm.laser))
            await asyncio.sleep(self._every)


def furthest(drawn: list[tuple[float, float]], lines: list[Line], gap: float) -> tuple[float, float]:
    """How far the pen was from the lines, and how far a point of the lines is from where the pen was."""
    import numpy as np

    return missed(np.array(drawn), lines), missed(samples(lines, 0.2), [[point] for point in drawn]) - gap


@pytest.mark.full
@pytest.mark.parametrize(
    "make", [lambda: read_svg(FILES / "shapes.svg"), lambda: write_text("Hello,\nWorld", 20, font="scripts")]
)
def test_the_true_path_of_the_pen_is_the_toolpath_and_all_of_it(make: Any) -> None:
    path = make().fit(90, 90).order()

    @virtual
    async def run() -> None:
        async with magician() as (sim, arm), Tracer(sim, PAPER) as tracer:
            await draw(arm, path, PAPER)

        off, left_out = furthest(tracer.drawn(), lines_of(path), gap=50 * 0.01)
        assert off <= TRUE
        assert left_out <= TRUE
        assert max(height for _, _, height, _ in tracer.places[-3:]) == pytest.approx(6, abs=0.01)
        assert not sim.arm.alarms[1:]

    run()


@virtual
async def test_the_laser_burns_along_the_toolpath_and_nowhere_else() -> None:
    path = read_svg(FILES / "shapes.svg").fit(60, 60).order().with_power(40)
    async with magician() as (sim, arm), Tracer(sim, PAPER) as tracer:
        await engrave(arm, path, PAPER, speed=40)
        assert sim.arm.laser == 0
        assert sim.arm.state.get(m.SET_END_EFFECTOR_LASER) == m.EndEffectorLaser(False, False)

    off, left_out = furthest(tracer.drawn(laser=True), lines_of(path), gap=40 * 0.01)
    assert off <= TRUE
    assert left_out <= TRUE
    assert {power for _, _, _, power in tracer.places} == {0.0, 40.0}


@virtual
async def test_a_power_for_each_point_burns_on_the_way_to_it() -> None:
    path = Toolpath((Stroke(((0, 0), (20, 0), (40, 0)), (0.0, 10.0, 90.0)), Stroke(((50, 0),), 70)))
    async with magician() as (sim, arm), Tracer(sim, PAPER, 0.002) as tracer:
        await engrave(arm, path, PAPER)

    burnt = {(x, power) for x, _, _, power in tracer.places if power}
    assert {power for x, power in burnt if x < 19.99} == {10}
    assert {power for x, power in burnt if 20.01 < x < 39.99} == {90}
    assert {power for x, power in burnt if x > 40.01} == {70}
    assert max(x for x, _ in burnt) == pytest.approx(50.1, abs=0.05)


@pytest.mark.full
@virtual
async def test_nothing_is_between_the_points_of_a_stroke() -> None:
    async with magician() as (sim, arm):
        await draw(arm, read_svg(FILES / "paths.svg").fit(60, 60), PAPER)
        names = [record.name for record in sim.arm.executed]
        assert all(record.index is not None for record in sim.arm.executed)
        assert names.index("SetWAITCmd") < names.index("SetPTPCmd")
        assert names.count("SetWAITCmd") == 1  # with which the queue's ledger is opened, before all of it
        assert set(names[2:]) == {"SetPTPCmd", "SetCPCmd"}


@pytest.mark.full
@virtual
async def test_the_arm_never_halts_within_a_stroke() -> None:
    path = Toolpath.of([(40 + 40 * math.cos(i / 40), 40 + 40 * math.sin(i / 40)) for i in range(252)])
    async with magician() as (sim, arm):
        await draw(arm, path, PAPER, tolerance=0, speed=80, acceleration=400)
        records = [record for record in sim.arm.executed if record.name == "SetCPCmd"]

    slow = [b for a, b in pairwise(records) if b.started != a.finished]
    assert not slow
    whole = records[-2].finished - records[1].started
    assert whole == pytest.approx(path.length * 249 / 251 / 80, rel=0.05)


@virtual
async def test_joint_4_stays_as_it_is() -> None:
    async with magician() as (sim, arm):
        await arm.move_to(220, 0, 20, 30)
        j4 = sim.arm.pose.j4
        await draw(arm, TWO, PAPER)
        assert sim.arm.pose.j4 == pytest.approx(j4, abs=0.01)


@virtual
async def test_pressure_is_a_depth() -> None:
    plane = replace(PAPER, press=2.0)
    async with magician() as (sim, arm), Tracer(sim, plane) as tracer:
        await draw(arm, Toolpath.of(SQUARE, power=50), plane)

    assert min(height for _, _, height, _ in tracer.places) == pytest.approx(-1, abs=0.01)


@virtual
async def test_what_is_out_of_reach_is_told_before_a_byte_is_sent() -> None:
    path = TWO + Toolpath.of([(0, 50), (0, 60), (200, 60)])
    async with magician() as (sim, arm):
        requests = sim.arm.counters.requests
        with pytest.raises(
            UnreachableStroke, match=r"stroke 3, point 2: \(.*, 15.0, -50.0\) is out of reach: joint 3"
        ) as caught:
            await draw(arm, path, PAPER)

        assert sim.arm.counters.requests == requests
        assert (caught.value.stroke, caught.value.point, caught.value.alarm) == (3, 2, 0x12)
        assert caught.value.place[2] == -50
        assert isinstance(caught.value, Unreachable)
        good, bad = path.split(reachable(arm, PAPER))
        assert 0 < bad.length < 200
        await draw(arm, good, PAPER, speed=200, acceleration=2000)


@virtual
async def test_a_travel_over_the_base_is_told() -> None:
    path = Toolpath.of([(0, -200), (20, -200)], [(0, 200), (20, 200)])
    async with magician() as (sim, arm):
        with pytest.raises(UnreachableStroke, match="on the way to the stroke") as caught:
            await draw(arm, path, WorkPlane.flat(0, 0, 0))

        assert caught.value.stroke == 1
        assert not sim.arm.executed


@virtual
async def test_the_way_from_where_the_arm_is_is_looked_at() -> None:
    async with magician() as (sim, arm):
        sim.arm.guide_to(0, 210, 0)
        with pytest.raises(UnreachableStroke, match="stroke 0, point 0"):
            await draw(arm, Toolpath.of([(0, 0), (5, 0)]), WorkPlane.flat(0, -215, 0))

        assert not sim.arm.executed


@virtual
async def test_progress_ends_with_everything_and_never_goes_back() -> None:
    told: list[Progress] = []
    ends: list[float] = []
    path = TWO.scale(1.5, 1)
    async with magician() as (_, arm):
        clock = asyncio.get_running_loop().time

        def note(each: Progress) -> None:
            told.append(each)
            ends.append(clock())

        begun = clock()
        await draw(arm, path, PAPER, speed=20, progress=note)
        done = clock()

    assert [each.strokes for each in told] == sorted({each.strokes for each in told})
    assert (told[-1].strokes, told[-1].of, told[-1].seconds_left) == (3, 3, 0.0)
    assert told[-1].mm == pytest.approx(path.length)
    assert all(a.mm < b.mm for a, b in pairwise(told))
    for each, when in zip(told[:-1], ends, strict=False):
        assert each.seconds_left == pytest.approx(done - when, rel=0.4)
        assert when > begun


@virtual
async def test_a_progress_that_fails_does_not_stop_the_drawing() -> None:
    def fail(_: Progress) -> None:
        raise RuntimeError("mine")

    async with magician() as (sim, arm):
        await draw(arm, TWO, PAPER, progress=fail)
        assert len(sim.arm.executed) > 10


@pytest.mark.cases(1)
@pytest.mark.parametrize("tool", ["pen", "laser"])
@pytest.mark.parametrize("how", ["stop", "arm.stop", "cancel", "alarm", "timeout"])
def test_on_every_way_out_the_arm_stands_its_laser_is_off_and_it_goes_on_from_there(tool: Any, how: str) -> None:
    @virtual
    async def run() -> None:
        async with magician() as (sim, arm), Tracer(sim, PAPER, 0.04) as tracer:
            drawing = Drawing(arm, TWO, PAPER, tool=tool, speed=5)
            ends = estimate(TWO, PAPER, tool=tool, speed=5).stroke_ends
            middle = (ends[0] + ends[1]) / 2

            async def within() -> None:
                async with asyncio.timeout(middle if how == "timeout" else None):
                    await drawing.run()

            task = asyncio.create_task(within())
            await asyncio.sleep(middle)
            if how == "stop":
                await drawing.stop()
            elif how == "arm.stop":
                await arm.stop()
            elif how == "cancel":
                task.cancel()
            elif how == "alarm":
                sim.arm.raise_alarm(0x48)

            expected = {"cancel": asyncio.CancelledError, "alarm": ArmAlarm, "timeout": TimeoutError}
            with pytest.raises(expected.get(how, MotionStopped)) as caught:
                await task

            if how != "timeout":
                assert f"first={drawing.next_stroke} draws the rest" in "".join(caught.value.__notes__)

            assert drawing.next_stroke == 1
            assert not sim.arm.device.moving
            assert sim.arm.laser == 0
            here = sim.arm.pose
            await asyncio.sleep(1.0)
            assert sim.arm.pose == here
            await arm.recover()
            before = len(tracer.places)
            await drawing.run()
            assert drawing.progress.strokes == 3
            again = [
                place for place in tracer.places[before:] if (place[3] > 0 if tool == "laser" else place[2] < 0.05)
            ]
            # Where it was stopped the pen stood on the paper; but for that, nothing of the first stroke is drawn again.
            assert all(
                x > 39 or (x, y) == again[0][:2] or math.dist((x, y), again[0][:2]) < 0.2 for x, y, _, _ in again
            )

        _, left_out = furthest(tracer.drawn(laser=tool == "laser"), lines_of(TWO), gap=0.2)
        assert left_out <= TRUE

    run()


@virtual
async def test_a_stop_between_two_batches_ends_it() -> None:
    async with magician() as (sim, arm):
        drawing = Drawing(arm, TWO, PAPER, speed=20, progress=lambda _: None)
        task = asyncio.create_task(drawing.run())
        await asyncio.sleep(0.05)
        await drawing.stop()
        with pytest.raises(MotionStopped):
            await task

        executed = len(sim.arm.executed)
        await asyncio.sleep(5)
        assert len(sim.arm.executed) == executed


@virtual
async def test_a_line_that_dies_is_told_and_the_laser_goes_off_when_it_lives_again() -> None:
    async with magician() as (sim, arm):
        task = asyncio.create_task(engrave(arm, TWO, PAPER, speed=5))
        await asyncio.sleep(5)
        assert sim.arm.laser == 100
        sim.faults.silent = True
        with pytest.raises((MotionUnknown, ReplyTimeout)) as caught:
            await task

        assert "its laser is off" in "".join(caught.value.__notes__)
        sim.faults.silent = False
        await asyncio.sleep(5)
        assert sim.arm.laser == 0
        assert not sim.arm.device.moving


@virtual
async def test_it_begins_with_the_stroke_that_it_is_told() -> None:
    async with magician() as (sim, arm), Tracer(sim, PAPER) as tracer:
        await draw(arm, TWO, PAPER, first=2)

    assert min(y for _, y in tracer.drawn()) > 29.9
    with pytest.raises(ValueError, match="0 to 2"):
        await draw(arm, TWO, PAPER, first=3)


@virtual
async def test_a_lossy_line_draws_each_point_once() -> None:
    async with magician(faults=Faults(loss=0.03), seed=3) as (sim, arm):
        await draw(arm, TWO, PAPER, tolerance=0)
        points = [record.value for record in sim.arm.executed if record.name == "SetCPCmd"]
        assert len(points) == len({(value.x, value.y) for value in points}) == 6


@pytest.mark.full
@pytest.mark.parametrize("tool", ["pen", "laser"])
def test_an_estimate_is_what_the_drawing_takes(tool: Any) -> None:
    @virtual
    async def run() -> None:
        path = write_text("abc", 20).order()
        async with magician() as (_, arm):
            await arm.set_end_effector(Pen())
            found = estimate(path, PAPER, arm=arm, tool=tool)
            begun = asyncio.get_running_loop().time()
            await (draw if tool == "pen" else engrave)(arm, path, PAPER)
            assert found.seconds == pytest.approx(asyncio.get_running_loop().time() - begun, rel=0.02)
            assert found.drawn == pytest.approx(path.length, rel=0.01)
            assert len(found.stroke_ends) == len(path)
            assert sorted(found.stroke_ends) == list(found.stroke_ends)

    run()


@pytest.mark.parametrize("arm", ["ultraarm", "mycobot280", Kinematics(61)])
def test_other_arms_are_estimated_too(arm: Any) -> None:
    plane = WorkPlane.flat(170, -30, 0 if isinstance(arm, Kinematics) else 60)
    key = "percent" if arm == "mycobot280" else "speed"
    slow, fast = (estimate(TWO, plane, arm=arm, **{key: each}) for each in (20, 80))  # type: ignore[arg-type]
    assert slow.seconds > fast.seconds > 0.5


def test_what_nobody_can_estimate_is_refused() -> None:
    with pytest.raises(ValueError, match="there are: magician"):
        estimate(TWO, PAPER, arm="delta")

    with pytest.raises(ValueError, match="stroke"):
        estimate(TWO.translate(500), PAPER)

    assert estimate(Toolpath(), PAPER).seconds == 0


@pytest.mark.full
@virtual
async def test_an_ultraarm_draws() -> None:
    plane = WorkPlane.flat(180, -40, 20)
    async with simulate("ultraarm") as sim, UltraArm.connect(sim.url) as arm:
        await arm.home()
        told: list[Progress] = []
        await draw(arm, TWO, plane, progress=told.append)
        targets = [(each.value.x, each.value.y, each.value.z) for each in sim.arm.executed if each.value][:]
        for x, y in (point for stroke in TWO for point in stroke.points):
            assert plane.to_arm(x, y) in targets

        assert targets[-1] == pytest.approx(plane.to_arm(60, 40, plane.lift))
        assert told[-1].strokes == 3
        assert sim.arm.missed == 0
        with pytest.raises(UnreachableStroke, match="x must be in"):
            await draw(arm, TWO.translate(200), plane)


@pytest.mark.full
@virtual
async def test_an_ultraarm_engraves_and_its_laser_is_off_on_every_way_out() -> None:
    plane = WorkPlane.flat(180, -40, 20)
    async with simulate("ultraarm") as sim, UltraArm.connect(sim.url, on_stop="finish") as arm:
        await arm.home()
        await engrave(arm, TWO.with_power(50), plane, speed=50)
        duties = [each.value.duty for each in sim.arm.executed if each.command is u.SET_PWM]
        assert duties == [0, 127, 0, 127, 0, 127, 0]
        names = [each.name for each in sim.arm.executed]
        assert names.index("M3") < names.index("G1") < len(names) - 1 - names[::-1].index("M5")
        assert not burns(sim)

        task = asyncio.create_task(engrave(arm, TWO, plane))
        await asyncio.sleep(5)
        assert burns(sim)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task

        await asyncio.sleep(60)  # it finishes what is in its queue
        assert not burns(sim)
        assert sim.arm.registers.pwm == 0


@virtual
async def test_a_mycobot_draws_along_straight_lines_and_has_no_laser() -> None:
    plane = WorkPlane.flat(150, -60, 90)
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        await arm.power_on()
        await arm.move_joints(0, -30, -60, 0, 0, 0)
        await arm.move_to(150, -60, 120, 180, 0, 0)
        heights: list[float] = []
        done = len(sim.arm.executed)
        await draw(
            arm,
            Toolpath.of([(0, 0), (30, 0), (30, 20)]),
            plane,
            percent=40,
            progress=lambda _: heights.append(sim.arm.coords[2]),
        )
        moves = sim.arm.executed[done:]
        assert [each.value.coords[:3] for each in moves] == [
            (150, -60, 95),
            (150, -60, 90),
            (180, -60, 90),
            (180, -40, 90),
            (180, -40, 95),
        ]
        assert {(each.value.coords[3:], each.value.speed) for each in moves} == {((180, 0, 0), 40)} or all(
            abs(abs(each.value.coords[3]) - 180) < 1 for each in moves
        )
        with pytest.raises(UnsupportedError, match="myCobot 280 has no laser"):
            await engrave(arm, TWO, plane)

        with pytest.raises(ValueError, match="percent"):
            await draw(arm, TWO, plane, speed=20)

        with pytest.raises(UnreachableStroke, match="x must be in"):
            await draw(arm, TWO.translate(200), plane)


@virtual
async def test_bad_arguments_are_told_before_a_byte_is_sent() -> None:
    async with magician() as (sim, arm):
        requests = sim.arm.counters.requests
        for options in ({"speed": 0}, {"acceleration": math.nan}, {"tolerance": -1}, {"rate": 0}, {"percent": 0}):
            with pytest.raises(ValueError, match=next(iter(options))):
                await draw(arm, TWO, PAPER, **options)

        with pytest.raises(ValueError, match="nothing to draw"):
            await draw(arm, Toolpath(), PAPER)

        with pytest.raises(TypeError, match="connected"):
            await draw("sim:", TWO, PAPER)  # type: ignore[arg-type]

        assert sim.arm.counters.requests == requests


@pytest.mark.full
def test_many_short_ways_are_drawn_so_slowly_that_the_line_keeps_up() -> None:
    dense = Toolpath.of([(i * 0.1, (i % 2) * 0.1) for i in range(600)])
    slow, fast = estimate(dense, PAPER, tolerance=0), estimate(dense, PAPER, tolerance=0, rate=None)
    assert slow.seconds > 600 / 120
    assert fast.seconds < slow.seconds
    assert MAGICIAN.capacity == 32
