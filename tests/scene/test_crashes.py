"""What an arm runs into ends its motion, with the alarm of its family."""

from __future__ import annotations

from contextlib import suppress
from itertools import pairwise

import pytest
from virtual import virtual

from dobot_async import ArmAlarm, DobotError, Jog, Magician, MyCobot, Pen, PTPMode, UltraArm
from dobot_async.simulator import simulate
from dobot_async.simulator.scene import Block, Mount, PenTool, Piece, Scene

WALL = Block("wall", (230, 60), (60, 1, 200))


@virtual
async def test_a_magician_runs_into_the_table() -> None:
    scene = Scene()
    async with simulate(scene=scene) as sim, Magician.connect(sim.url) as arm:
        await arm.home()
        await arm.move_to(220, 0, 0)
        with pytest.raises(ArmAlarm) as caught:
            await arm.move_to(220, 0, -90, mode=PTPMode.MOVL_XYZ)

        assert [alarm.code for alarm in caught.value.alarms] == [0x51]
        # The cup gives 3 mm; the rest is how far it goes in 10 ms.
        assert -78.5 - 3 - 2 <= (await arm.get_pose()).z <= -78.5 - 3
        (crash,) = scene.crashes
        assert (crash.what, crash.arm) == ("table", "")
        assert crash.place[:2] == pytest.approx((220, 0), abs=0.01)
        assert [each.outcome for each in sim.arm.executed if each.name == "SetPTPCmd"] == ["done", "alarm"]

        await arm.recover()
        await arm.move_to(220, 0, 0)
        assert len(scene.crashes) == 1


@virtual
async def test_no_wall_is_too_thin_for_a_fast_arm() -> None:
    scene = Scene(blocks=[WALL])
    async with simulate(scene=scene) as sim, Magician.connect(sim.url) as arm:
        await arm.home()
        await arm.set_speed(100)
        await arm.move_to(230, 0, 50)
        with pytest.raises(ArmAlarm):
            await arm.move_to(230, 120, 50, mode=PTPMode.MOVL_XYZ)

        assert 59 <= (await arm.get_pose()).y <= 63

    assert [each.what for each in scene.crashes] == ["wall"]


@virtual
async def test_above_the_wall_is_free() -> None:
    scene = Scene(blocks=[Block("wall", (230, 60), (60, 1, 80))])
    async with simulate(scene=scene) as sim, Magician.connect(sim.url) as arm:
        await arm.home()
        await arm.move_to(230, 0, 50)
        await arm.move_to(230, 120, 50, mode=PTPMode.MOVL_XYZ)

    assert not scene.crashes


@virtual
async def test_what_the_arm_holds_runs_into_things_too() -> None:
    """The wall ends below the tip, but not below the piece that hangs at it."""
    scene = Scene(pieces=[Piece("red", (230, 0))], blocks=[Block("wall", (230, 60), (60, 1, 80))])
    async with simulate(scene=scene) as sim, Magician.connect(sim.url) as arm:
        await arm.home()
        await arm.move_to(230, 0, 20)
        await arm.move_to(230, 0, -53.5)
        await arm.suction(True)
        await arm.wait(0.3)
        await arm.move_to(230, 0, 20)
        with pytest.raises(ArmAlarm):
            await arm.move_to(230, 120, 20, mode=PTPMode.MOVL_XYZ)

    assert [each.what for each in scene.crashes] == ["wall"]
    assert scene.pieces["red"].position[1] == pytest.approx(60 - 12.5, abs=4)


@virtual
async def test_a_piece_on_the_way_is_run_into() -> None:
    scene = Scene(pieces=[Piece("tower", (230, 60), (20, 20, 150))])
    async with simulate(scene=scene) as sim, Magician.connect(sim.url) as arm:
        await arm.home()
        await arm.move_to(230, 0, 20)
        with pytest.raises(ArmAlarm):
            await arm.move_to(230, 120, 20, mode=PTPMode.MOVL_XYZ)

    assert [each.what for each in scene.crashes] == ["tower"]


@virtual
async def test_what_is_behind_a_crash_is_not_executed() -> None:
    scene = Scene(blocks=[WALL])
    async with simulate(scene=scene) as sim, Magician.connect(sim.url) as arm:
        await arm.home()
        await arm.move_to(230, 0, 50)
        async with arm.queue.batch() as batch:
            crash = batch.move_to(230, 120, 50, mode=PTPMode.MOVL_XYZ)
            behind = batch.move_to(200, 150, 50)

        for motion in (crash, behind):
            with pytest.raises(DobotError):
                await motion

        assert (await arm.get_pose()).y < 63


@virtual
async def test_a_jog_runs_into_the_table() -> None:
    scene = Scene()
    async with simulate(scene=scene) as sim, Magician.connect(sim.url) as arm:
        await arm.home()
        await arm.move_to(220, 0, -60)
        with suppress(ArmAlarm):
            await arm.jog(Jog.Z_MINUS, 2)

        assert (await arm.get_pose()).z > -90

    assert [each.what for each in scene.crashes] == ["table"]


@virtual
async def test_a_stopped_arm_may_not_be_driven_on_into_what_it_has_met() -> None:
    scene = Scene()
    async with simulate(scene=scene) as sim, Magician.connect(sim.url) as arm:
        await arm.home()
        await arm.move_to(220, 0, -70)
        for _ in range(2):
            with pytest.raises(ArmAlarm):
                await arm.move_to(220, 0, -100, mode=PTPMode.MOVL_XYZ)

            await arm.recover()

        assert (await arm.get_pose()).z > -90

    assert len(scene.crashes) == 2


@virtual
async def test_a_hand_that_guides_the_arm_through_a_wall_is_no_crash() -> None:
    scene = Scene(blocks=[WALL])
    async with simulate(scene=scene) as sim, Magician.connect(sim.url) as arm:
        await arm.home()
        await arm.move_to(230, 0, 50)
        sim.arm.guide_to(230, 120, 50)
        await arm.move_to(230, 130, 50)

    assert not scene.crashes


@virtual
async def test_a_mycobot_notices_a_collision() -> None:
    scene = Scene(table=0)
    async with simulate("mycobot280", scene=scene) as sim, MyCobot.connect(sim.url, model="mycobot280") as arm:
        with pytest.raises(DobotError):
            await arm.move_joints(0, -90, -90, 0, 0, 0)

        assert sim.arm.error == 16
        assert not sim.arm.moving
        assert sim.arm.executed[-1].outcome == "aborted"

    assert [each.what for each in scene.crashes] == ["table"]


@virtual
async def test_an_ultraarm_stays_where_it_has_hit_something() -> None:
    """It tells nobody; but it is seen not to be at its goal."""
    scene = Scene(table=-60)
    async with simulate("ultraarm", scene=scene) as sim, UltraArm.connect(sim.url) as arm:
        await arm.home()
        await arm.move_to(240, 0, 40)
        with pytest.raises(DobotError):
            await arm.move_to(240, 0, -40)

        assert sim.arm.pose.z > -10

    assert [each.what for each in scene.crashes] == ["table"]


@virtual
async def test_a_pen_draws_where_it_touches() -> None:
    scene = Scene()
    async with simulate(scene=scene, mount=Mount(tool=PenTool())) as sim, Magician.connect(sim.url) as arm:
        await arm.home()
        await arm.set_end_effector(Pen())
        down = -138 + 59.5
        for x, y in ((220, 0), (220, 60)):
            await arm.move_to(x, y, -50)
            await arm.move_to(x, y, down, mode=PTPMode.MOVL_XYZ)
            await arm.move_to(x + 40, y, down, mode=PTPMode.MOVL_XYZ)
            await arm.move_to(x + 40, y, -50, mode=PTPMode.MOVL_XYZ)

    assert len(scene.drawing) == 2
    for stroke, y in zip(scene.drawing, (0, 60), strict=True):
        on_paper = [point for point in stroke if point[2] < -137.99]
        assert on_paper[0] == pytest.approx((220, y, -138), abs=0.1)
        assert on_paper[-1] == pytest.approx((260, y, -138), abs=0.1)
        assert all(abs(point[1] - y) < 0.01 for point in stroke)
        assert max(b[0] - a[0] for a, b in pairwise(stroke)) < 2

    assert not scene.crashes
