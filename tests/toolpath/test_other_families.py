"""Drawings of the ultraArm and the myCobot: how long they take, how smooth they are, and what they leave behind."""

from __future__ import annotations

import asyncio
import math
from typing import Any

import pytest
from geometry import lines_of, missed, samples
from virtual import run_virtual, virtual

from dobot_async import Magician, MotionStopped, MyCobot, UltraArm
from dobot_async.arms.ultraarm import commands as u
from dobot_async.simulator import UltraArmQuirks, simulate
from dobot_async.toolpath import Drawing, Toolpath, WorkPlane, draw, engrave, estimate

TABLE = WorkPlane.flat(180, -40, 20)
RING = Toolpath.of(
    [(30 + 25 * math.cos(i / 32 * math.tau), 30 + 25 * math.sin(i / 32 * math.tau)) for i in range(33)],
    [(0, 0), (60, 0), (60, 60)],
)
SMOOTH = UltraArmQuirks(constant_speed=True)


@pytest.mark.full
@pytest.mark.parametrize("constant_speed", [False, True])
@pytest.mark.parametrize("tool", ["pen", "laser"])
def test_an_estimate_of_an_ultraarm_is_what_its_drawing_takes(tool: Any, constant_speed: bool) -> None:
    async def run() -> None:
        async with simulate("ultraarm", quirks=SMOOTH) as sim, UltraArm.connect(sim.url) as arm:
            await arm.home()
            options: dict[str, Any] = {"constant_speed": constant_speed, "speed": 40}
            found = estimate(RING, TABLE, arm=arm, tool=tool, **options)
            begun = asyncio.get_running_loop().time()
            await (draw if tool == "pen" else engrave)(arm, RING, TABLE, **options)
            assert found.seconds == pytest.approx(asyncio.get_running_loop().time() - begun, rel=0.05)

    run_virtual(run())


@virtual
async def test_an_estimate_of_a_cobot_is_what_its_drawing_takes() -> None:
    plane, path = WorkPlane.flat(150, -60, 90), Toolpath.of([(0, 0), (40, 0), (40, 60), (0, 60)], [(5, 5), (30, 50)])
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        await arm.power_on()
        await arm.move_joints(0, -30, -60, 0, 0, 0)
        await arm.move_to(150, -60, 95, 180, 0, 0)
        found = estimate(path, plane, arm=arm, percent=30)
        begun = asyncio.get_running_loop().time()
        await draw(arm, path, plane, percent=30)
        assert found.seconds == pytest.approx(asyncio.get_running_loop().time() - begun, rel=0.05)


@pytest.mark.full
@virtual
async def test_an_estimate_of_another_tool_and_speed_is_what_a_magicians_drawing_takes() -> None:
    plane = WorkPlane.flat(195, -45, -50)
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        found = estimate(RING, plane, arm=arm, tool="laser", speed=25, acceleration=300)
        begun = asyncio.get_running_loop().time()
        await engrave(arm, RING, plane, speed=25, acceleration=300)
        assert found.seconds == pytest.approx(asyncio.get_running_loop().time() - begun, rel=0.05)


@pytest.mark.full
@virtual
async def test_an_ultraarms_true_path_is_the_toolpath_and_without_ramps_it_is_sooner_done() -> None:
    taken: dict[bool, float] = {}
    for constant_speed in (False, True):
        async with simulate("ultraarm", quirks=SMOOTH) as sim, UltraArm.connect(sim.url) as arm:
            await arm.home()
            drawn: list[tuple[float, float]] = []

            async def look(sim: Any = sim, drawn: list[tuple[float, float]] = drawn) -> None:
                while True:
                    x, y, height = TABLE.to_plane(sim.arm.pose.x, sim.arm.pose.y, sim.arm.pose.z)
                    if height < 0.05:
                        drawn.append((x, y))

                    await asyncio.sleep(0.005)

            looking = asyncio.create_task(look())
            begun = asyncio.get_running_loop().time()
            await draw(arm, RING, TABLE, speed=40, constant_speed=constant_speed)
            taken[constant_speed] = asyncio.get_running_loop().time() - begun
            looking.cancel()
            await asyncio.gather(looking, return_exceptions=True)
            import numpy as np

            assert missed(np.array(drawn), lines_of(RING)) <= 0.2
            assert missed(samples(lines_of(RING), 0.5), [[point] for point in drawn]) <= 0.4
            assert sim.arm.registers.speed_mode == u.SpeedMode.RAMPED
            modes = [each.value.mode for each in sim.arm.executed if each.command is u.SET_SPEED_MODE]
            assert modes == ([u.SpeedMode.CONSTANT, u.SpeedMode.RAMPED] if constant_speed else [])

    assert taken[True] < 0.9 * taken[False]


@pytest.mark.parametrize("how", ["cancel", "stop"])
@virtual
async def test_ramps_are_back_on_every_way_out(how: str) -> None:
    async with simulate("ultraarm", quirks=SMOOTH) as sim, UltraArm.connect(sim.url, on_stop="finish") as arm:
        await arm.home()
        drawing = Drawing(arm, RING, TABLE, tool="laser", speed=20, constant_speed=True)
        task = asyncio.create_task(drawing.run())
        await asyncio.sleep(4)
        assert sim.arm.registers.speed_mode == u.SpeedMode.CONSTANT
        if how == "cancel":
            task.cancel()
        else:
            await drawing.stop()

        with pytest.raises((asyncio.CancelledError, MotionStopped)):
            await task

        await asyncio.sleep(10)
        assert sim.arm.registers.speed_mode == u.SpeedMode.RAMPED
        assert not sim.arm.registers.laser


@virtual
async def test_a_magician_has_no_such_mode() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        with pytest.raises(ValueError, match="constant_speed is for an ultraArm alone"):
            Drawing(arm, RING, WorkPlane.flat(195, -45, -50), constant_speed=True)
