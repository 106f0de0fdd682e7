"""Picking and placing: what the scene has at the end, and what the arm has executed, decide."""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

import pytest
from virtual import virtual

from dobot_async import InfraredPort, Magician, MotionStopped, MyCobot, PTPMode, UltraArm, UnsupportedError
from dobot_async.arms.magician import commands as c
from dobot_async.arms.mycobot import commands as mycobot
from dobot_async.grid import Grid
from dobot_async.handling import PartMissing, PartStuck, gripper_holds, pick, pick_and_place, place
from dobot_async.simulator import Simulation, simulate
from dobot_async.simulator.scene import Block, GripperTool, LightBeam, Mount, Piece, Scene

ON_TABLE = -138.0 + 25 + 59.5
SOURCE, TARGET = (250.0, 0.0, ON_TABLE), (200.0, 100.0, ON_TABLE)


@asynccontextmanager
async def cell(scene: Scene, mount: Mount | None = None) -> AsyncIterator[tuple[Simulation, Magician]]:
    async with simulate(scene=scene, mount=mount) as sim, Magician.connect(sim.url) as arm:
        await arm.home()
        yield sim, arm


def red() -> Piece:
    return Piece("red", SOURCE[:2])


def moves(sim: Simulation) -> list[tuple[PTPMode, float, float, float]]:
    """The targets of all motions."""
    found = [each.value for each in sim.arm.executed if each.command is c.SET_PTP_CMD]
    return [(each.ptp_mode, each.x, each.y, each.z) for each in found]


@virtual
async def test_a_part_is_carried_with_the_cup() -> None:
    scene = Scene(pieces=[red()])
    async with cell(scene) as (sim, arm):
        await pick_and_place(arm, SOURCE, TARGET, tool="suction", approach=30)
        assert not sim.arm.suction
        above = ON_TABLE + 30
        assert moves(sim) == [
            (PTPMode.MOVJ_XYZ, 250, 0, above),
            (PTPMode.MOVL_XYZ, 250, 0, ON_TABLE),
            (PTPMode.MOVL_XYZ, 250, 0, above),
            (PTPMode.MOVJ_XYZ, 200, 100, above),
            (PTPMode.MOVL_XYZ, 200, 100, ON_TABLE),
            (PTPMode.MOVL_XYZ, 200, 100, above),
        ]

    assert scene.pieces["red"].position == pytest.approx((200, 100, -138), abs=0.01)
    assert not scene.crashes


@virtual
async def test_a_part_is_carried_with_the_gripper_which_opens_before_it_goes_down() -> None:
    scene = Scene(pieces=[red()])
    lower = -12.0
    async with cell(scene, Mount(tool=GripperTool())) as (_, arm):
        await arm.gripper(True)
        await pick_and_place(arm, (250, 0, ON_TABLE + lower), (200, 100, ON_TABLE + lower), tool="gripper", travel_z=40)
        assert (await arm.get_pose()).z == pytest.approx(40, abs=0.01)

    assert scene.pieces["red"].position == pytest.approx((200, 100, -138), abs=0.01)
    assert not scene.crashes


@virtual
async def test_the_tool_has_its_time() -> None:
    """With less than the air takes, the part stays where it is."""
    scene = Scene(pieces=[red()])
    async with cell(scene) as (_, arm):
        await arm.request(c.SET_PTP_COORDINATE_PARAMS, c.PTPCoordinateParams(400, 400, 4000, 4000))
        await pick(arm, SOURCE, tool="suction", settle=0)
        assert scene.pieces["red"].on == "table"
        await arm.suction(False)
        await arm.wait(1)
        await pick(arm, SOURCE, tool="suction")
        assert scene.pieces["red"].on == "tool of"


@virtual
async def test_a_pose_turns_the_tool() -> None:
    scene = Scene(pieces=[red()])
    async with cell(scene) as (sim, arm):
        await arm.move_to(*SOURCE, 30)
        where = await arm.get_pose()
        await arm.move_to(220, 50, 50)
        await pick(arm, where, tool="suction")
        turns = [each.value.r for each in sim.arm.executed if each.command is c.SET_PTP_CMD]
        assert turns == pytest.approx([30, 0, 30, 30, 30])

    assert scene.pieces["red"].on == "tool of"


@pytest.mark.full
@virtual
async def test_a_pallet_is_filled() -> None:
    places = [(250, -90), (250, -45), (250, 0), (250, 45)]
    scene = Scene(
        pieces=[Piece(str(n), place) for n, place in enumerate(places)],
        blocks=[Block("pallet", (180, 130), (90, 90, 20))],
    )
    z = ON_TABLE + 20
    pallet = Grid([(160, 110, z), (200, 110, z), (160, 150, z)], rows=2, columns=1, layers=2, layer_height=25)
    async with cell(scene) as (_, arm):
        for (x, y), to in zip(places, pallet, strict=True):
            await pick_and_place(arm, (x, y, ON_TABLE), to, tool="suction", travel_z=30)

    assert [scene.pieces[str(n)].on for n in range(4)] == ["pallet", "pallet", "0", "1"]
    assert not scene.crashes


# What is wrong


@virtual
async def test_a_sensor_tells_that_there_is_no_part() -> None:
    """The light beam looks below the cup where it is above the place."""
    beam = LightBeam((250, 60, ON_TABLE + 40 - 59.5 - 10), (250, -60, ON_TABLE + 40 - 59.5 - 10), port=InfraredPort.GP4)
    scene = Scene(pieces=[red()], sensors=[beam])
    async with cell(scene) as (sim, arm):
        await arm.set_infrared_sensor(InfraredPort.GP4)

        async def seen() -> bool:
            await asyncio.sleep(0.2)
            return await arm.get_infrared(InfraredPort.GP4)

        await pick(arm, SOURCE, tool="suction", check=seen)
        await arm.move_to(*TARGET)
        await arm.suction(False, pump=False)
        await arm.wait(1)
        await arm.move_to(250, 0, 60)
        with pytest.raises(PartMissing, match=r"no part to pick at \(250, 0, -53\.5\)") as caught:
            await pick(arm, SOURCE, tool="suction", check=seen)

        assert caught.value.place == SOURCE
        assert (await arm.get_pose()).z == pytest.approx(ON_TABLE + 40, abs=0.01)
        assert not sim.arm.suction


@virtual
async def test_a_part_that_is_lost_on_the_way_is_told_above_the_place() -> None:
    scene = Scene(pieces=[red()])
    async with cell(scene) as (sim, arm):
        looks = 0

        def lost() -> bool:
            nonlocal looks
            looks += 1
            if looks == 2:
                scene.put("red", 220, -50)

            return scene.pieces["red"].on == "tool of"

        with pytest.raises(PartMissing, match=r"lost on the way to \(200, 100, -53\.5\)") as caught:
            await pick_and_place(arm, SOURCE, TARGET, tool="suction", check=lost)

        assert caught.value.place == TARGET
        assert looks == 2
        assert moves(sim)[-1] == (PTPMode.MOVJ_XYZ, 200, 100, ON_TABLE + 40)
        assert not sim.arm.suction


@virtual
async def test_a_part_that_sticks_is_told() -> None:
    scene = Scene(pieces=[red()])
    async with cell(scene) as (sim, arm):
        await pick(arm, SOURCE, tool="suction")
        with pytest.raises(PartStuck, match="still holds"):
            await place(arm, TARGET, tool="suction", check=lambda: True)

        assert moves(sim)[-1] == (PTPMode.MOVL_XYZ, 200, 100, ON_TABLE + 40)


@virtual
async def test_a_cobots_gripper_tells_whether_it_holds_something() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url, model="mycobot280") as arm:
        await arm.move_joints(0, -30, -60, 0, 0, 0)
        pose = await arm.get_pose()
        where = (pose.x, pose.y, pose.z - 30)
        sim.arm.gripper.piece = 40.0
        await pick(arm, where, tool="gripper", approach=30, check=gripper_holds(arm))
        assert await arm.get_gripper() == 40

        sim.arm.gripper.piece = None
        with pytest.raises(PartMissing):
            await place(arm, where, tool="gripper", approach=30, check=gripper_holds(arm, least=45))

        with pytest.raises(PartMissing, match="no part"):
            await pick(arm, where, tool="gripper", approach=30, check=gripper_holds(arm))

        assert await arm.get_gripper() == 100
        assert sim.arm.coords[2] == pytest.approx(pose.z, abs=0.5)
        down = [each.value for each in sim.arm.executed if each.command is mycobot.SEND_COORDS]
        assert {each.mode for each in down[1:3]} == {mycobot.MoveMode.LINEAR}


@pytest.mark.full
@virtual
async def test_an_ultraarm_carries_a_part() -> None:
    scene = Scene(pieces=[Piece("red", (240, 0))], table=-60)
    z = -60 + 25 + 59.5
    async with simulate("ultraarm", scene=scene) as sim, UltraArm.connect(sim.url) as arm:
        await arm.home()
        await pick_and_place(arm, (240, 0, z), (200, 80, z), tool="suction")
        assert [each.name for each in sim.arm.executed].count("G1") == 4

    assert scene.pieces["red"].position == pytest.approx((200, 80, -60), abs=0.1)


@virtual
async def test_a_tool_of_ones_own_is_switched_by_a_function() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url, model="mycobot280") as arm:
        await arm.move_joints(0, -30, -60, 0, 0, 0)
        pose = await arm.get_pose()
        heights: list[tuple[bool, float]] = []

        async def pump(take: bool) -> None:
            heights.append((take, (await arm.get_pose()).z))

        where = (pose.x, pose.y, pose.z - 30)
        await pick_and_place(arm, where, where, tool=pump, approach=30)

    assert [take for take, _ in heights] == [True, False]
    assert [height for _, height in heights] == pytest.approx([pose.z - 30] * 2, abs=0.5)


ANYTHING: Any = "high"
MAGNET: Any = "magnet"
WRONG: dict[str, tuple[Callable[[Any], Any], type[Exception], str]] = {
    "out of reach": (lambda arm: pick(arm, (400, 0, 0), tool="suction"), ValueError, "too far"),
    "the way down begins out of reach": (
        lambda arm: pick(arm, (250, 0, 0), tool="suction", approach=300),
        ValueError,
        "too far",
    ),
    "the second place is out of reach": (
        lambda arm: pick_and_place(arm, SOURCE, (0, 400, 0), tool="suction"),
        ValueError,
        "too far",
    ),
    "no approach": (lambda arm: pick(arm, SOURCE, tool="suction", approach=0), ValueError, "approach"),
    "no number": (lambda arm: pick(arm, SOURCE, tool="suction", approach=ANYTHING), TypeError, "approach"),
    "no finite height": (lambda arm: pick(arm, SOURCE, tool="suction", travel_z=math.nan), ValueError, "travel_z"),
    "negative time": (lambda arm: place(arm, SOURCE, tool="suction", settle=-1), ValueError, "settle"),
    "no tool": (lambda arm: place(arm, SOURCE, tool=MAGNET), ValueError, "'suction' or 'gripper'"),
    "no place": (lambda arm: place(arm, (1, 2), tool="suction"), ValueError, "x, y and z"),
}


@pytest.mark.parametrize("name", WRONG)
@virtual
async def test_what_is_wrong_is_told_before_a_byte_is_sent(name: str) -> None:
    call, kind, words = WRONG[name]
    async with simulate(homed=True) as sim, Magician.connect(sim.url) as arm:
        before = sim.arm.counters.requests
        with pytest.raises(kind, match=words):
            await call(arm)

        assert sim.arm.counters.requests == before


@virtual
async def test_a_cobot_has_no_cup() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url, model="mycobot280") as arm:
        before = sim.arm.counters.requests
        with pytest.raises(UnsupportedError, match="no suction"):
            await pick(arm, (200, 0, 200), tool="suction")

        with pytest.raises(ValueError, match="x must be"):
            await pick(arm, (500, 0, 200), tool="gripper")

        assert sim.arm.counters.requests == before


@virtual
async def test_a_cancelled_pick_stops_the_arm_and_keeps_the_part() -> None:
    scene = Scene(pieces=[red()])
    async with cell(scene) as (sim, arm):
        await pick(arm, SOURCE, tool="suction")
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(0.3):
                await place(arm, TARGET, tool="suction")

        assert sim.arm.device.idle
        assert scene.pieces["red"].on == "tool of"


@pytest.mark.parametrize("at", [1, 2, 3, 4])
@virtual
async def test_nothing_goes_on_past_a_stop(at: int) -> None:
    """Whatever it is between two motions, a stop ends all of it."""
    async with simulate(homed=True) as sim, Magician.connect(sim.url) as arm:
        calls = 0

        async def stopping(_: bool = True) -> bool:
            nonlocal calls
            calls += 1
            if calls == at:
                await arm.stop()

            return True

        with pytest.raises(MotionStopped):
            await pick_and_place(arm, SOURCE, TARGET, tool=stopping, check=stopping, settle=0)

        assert calls == at
        assert len(moves(sim)) == {1: 2, 2: 3, 3: 4, 4: 5}[at]
        assert sim.arm.device.idle
