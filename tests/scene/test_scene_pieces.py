"""Pieces: what takes them, where they go, and what they fall on."""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any, assert_type

import pytest
from virtual import virtual

from dobot_async import ArmAlarm, Magician, MyCobot, PTPMode, UltraArm
from dobot_async.arms.ultraarm import commands as ultra
from dobot_async.simulator import Simulation, simulate
from dobot_async.simulator.scene import Block, CupTool, GripperTool, Mount, Piece, Scene, Workpiece

RED = Piece("red", (250, 0), color="red")
ON_TABLE = -138.0 + 25 + 59.5  # where the arm has to be for the cup to touch the top of a piece on the table


@asynccontextmanager
async def cell(scene: Scene, mount: Mount | None = None, **details: Any) -> AsyncIterator[tuple[Simulation, Magician]]:
    async with simulate(scene=scene, mount=mount, **details) as sim, Magician.connect(sim.url) as arm:
        await arm.home()
        yield sim, arm


def place(piece: Workpiece) -> Any:
    return pytest.approx(piece.position, abs=0.01)


async def take(arm: Magician) -> None:
    """Goes to where the red piece is in the beginning, and comes up with it, if it is there."""
    await go_down(arm, 250, 0, ON_TABLE)
    await arm.suction(True)
    await arm.wait(0.3)
    await arm.move_to(250, 0, 20)


async def go_down(arm: Magician, x: float, y: float, z: float, r: float = 0.0) -> None:
    await arm.move_to(x, y, 20, r)
    await arm.move_to(x, y, z, r, mode=PTPMode.MOVL_XYZ)


@virtual
async def test_a_piece_is_carried_and_falls_on_a_pallet() -> None:
    scene = Scene(pieces=[RED], blocks=[Block("pallet", (180, 120), (60, 60, 20))])
    async with cell(scene) as (sim, arm):
        await go_down(arm, 250, 0, ON_TABLE)
        await arm.suction(True)
        await arm.wait(0.3)
        await arm.move_to(250, 0, 20)
        assert scene.pieces["red"].on == "tool of"
        assert place(scene.pieces["red"]) == (250, 0, 20 - 59.5 - 25)

        await go_down(arm, 180, 120, 0)
        await arm.suction(False)
        await arm.wait(0.3)
        assert place(sim.scene.pieces["red"]) == (180, 120, -118)
        assert scene.pieces["red"].on == "pallet"

    assert [(each.kind, each.what) for each in scene.events] == [("picked", "red"), ("dropped", "red")]
    assert place(scene.pieces["red"]) == (180, 120, -118)


@virtual
async def test_a_piece_turns_with_the_tool() -> None:
    scene = Scene(pieces=[RED])
    async with cell(scene) as (_, arm):
        await go_down(arm, 250, 10, ON_TABLE, r=10)
        await arm.suction(True)
        await arm.wait(0.3)
        await arm.move_to(250, 0, 20, 10)
        await arm.move_to(250, 0, 20, 100)
        await arm.suction(False)
        await arm.wait(0.3)

    assert scene.pieces["red"].yaw == pytest.approx(90, abs=0.01)
    # It hung 10 mm beside the tip, which is now to the other side.
    assert place(scene.pieces["red"]) == (260, 0, -138)


@pytest.mark.cases(1)
@pytest.mark.parametrize(
    ("x", "z", "suck"),
    [
        (250, ON_TABLE + 4, True),  # too high
        (264, ON_TABLE, True),  # beside it
        (250, ON_TABLE, False),  # no pump
    ],
)
@virtual
async def test_a_piece_stays_where_the_cup_does_not_take_it(x: float, z: float, suck: bool) -> None:
    scene = Scene(pieces=[RED])
    async with cell(scene) as (_, arm):
        await go_down(arm, x, 0, z)
        await arm.suction(suck)
        await arm.wait(0.3)
        await arm.move_to(250, 60, 40)
        assert scene.pieces["red"].on == "table"

    assert not scene.events


@virtual
async def test_a_cup_that_sucks_takes_what_it_comes_to() -> None:
    scene = Scene(pieces=[RED])
    async with cell(scene) as (_, arm):
        await arm.suction(True)
        await arm.wait(0.3)
        await go_down(arm, 250, 0, ON_TABLE)
        await arm.move_to(250, 0, 20)
        assert scene.pieces["red"].on == "tool of"


@virtual
async def test_a_piece_is_let_go_in_the_middle_of_a_queue() -> None:
    scene = Scene(pieces=[RED])
    async with cell(scene) as (_, arm):
        async with arm.queue.batch() as batch:
            batch.move_to(250, 0, ON_TABLE)
            batch.suction(True)
            batch.wait(0.3)
            batch.move_to(250, 0, 20)
            batch.move_to(200, 100, 20)
            batch.suction(False)
            batch.wait(0.3)
            last = batch.move_to(250, 0, 20)

        await last

    assert place(scene.pieces["red"]) == (200, 100, -138)


@virtual
async def test_pieces_stand_on_each_other_and_go_together() -> None:
    scene = Scene(pieces=[Piece("low", (250, 0), (40, 40, 20)), Piece("high", (260, 0), (10, 10, 10))])
    assert place(scene.pieces["high"]) == (260, 0, -118)
    async with cell(scene) as (_, arm):
        await go_down(arm, 240, 0, -118 + 59.5)
        await arm.suction(True)
        await arm.wait(0.3)
        await arm.move_to(240, 0, 20)
        await arm.move_to(200, 60, 20)
        await arm.suction(False)
        await arm.wait(0.3)

    assert scene.pieces["high"].on == "low"
    assert place(scene.pieces["low"]) == (210, 60, -138)
    assert place(scene.pieces["high"]) == (220, 60, -118)


@virtual
async def test_a_gripper_takes_what_is_between_its_fingers_when_they_close() -> None:
    scene = Scene(pieces=[RED])
    async with cell(scene, Mount(tool=GripperTool())) as (_, arm):
        await go_down(arm, 250, 1, ON_TABLE - 12)
        await arm.gripper(True)
        await arm.wait(0.6)
        await arm.move_to(250, 1, 40)
        await arm.move_to(200, 60, 40)
        await arm.gripper(False)
        await arm.wait(0.6)

    assert [each.kind for each in scene.events] == ["picked", "dropped"]
    assert place(scene.pieces["red"]) == (200, 59, -138)


@pytest.mark.cases(1)
@pytest.mark.parametrize(
    ("piece", "y", "first"),
    [
        (RED, 5, "crash"),  # the fingers come down on it
        (Piece("wide", (250, 0), (30, 30, 25)), 0, "crash"),
        (Piece("narrow", (250, 0), (10, 60, 25)), 0, "picked"),
    ],
)
@virtual
async def test_a_gripper_takes_what_fits(piece: Piece, y: float, first: str) -> None:
    scene = Scene(pieces=[piece])
    async with cell(scene, Mount(tool=GripperTool())) as (_, arm):
        if first == "crash":
            with pytest.raises(ArmAlarm, match="0x51"):
                await go_down(arm, 250, y, ON_TABLE - 12)
        else:
            await go_down(arm, 250, y, ON_TABLE - 12)
            await arm.gripper(True)
            await arm.wait(0.6)

    assert scene.events[0].kind == first


@virtual
async def test_a_closed_gripper_takes_nothing() -> None:
    scene = Scene(pieces=[RED])
    async with cell(scene, Mount(tool=GripperTool())) as (_, arm):
        await arm.gripper(True)
        await arm.wait(0.6)
        with pytest.raises(ArmAlarm, match="0x51"):
            await go_down(arm, 250, 0, ON_TABLE - 12)

    assert [each.kind for each in scene.events] == ["crash"]


@pytest.mark.full
@virtual
async def test_the_arm_is_where_its_mount_says() -> None:
    """The arm stands turned by 90 degrees, on a rail that goes along x of the scene."""
    scene = Scene(pieces=[Piece("red", (800, 350))], table=0)
    mount = Mount(1000, 100, 138, 90, rail_yaw=90)
    async with cell(scene, mount) as (_, arm):
        await arm.set_rail()
        await arm.home()
        await arm.move_to(250, 0, 20, l=200)
        await arm.move_to(250, 0, ON_TABLE, l=200)
        await arm.suction(True)
        await arm.wait(0.3)
        await arm.move_to(250, 0, 20, l=0)
        await arm.suction(False)
        await arm.wait(0.3)

    assert place(scene.pieces["red"]) == (1000, 350, 0)


@pytest.mark.full
@virtual
async def test_an_arm_on_no_rail_stays_where_it_stands() -> None:
    """Whatever its program says of a rail."""
    scene = Scene(pieces=[RED])
    async with cell(scene) as (sim, arm):
        await arm.set_rail()
        await arm.home()
        await arm.move_to(250, 0, 20, l=200)
        assert sim.arm.true_rail == pytest.approx(200)
        await take(arm)

    assert scene.pieces["red"].on == "tool of"


@pytest.mark.cases(1)
@pytest.mark.parametrize(("mount", "at"), [(Mount(), (250, 0)), (Mount(rail_yaw=90), (250, 120))])
@virtual
async def test_an_arm_that_nobody_homed_goes_beside(mount: Mount, at: tuple[float, float]) -> None:
    """Its base is turned by 8 degrees when it is switched on, and if it stands on a rail, it does so at 120 mm."""
    scene = Scene(pieces=[RED])
    async with simulate(scene=scene, mount=mount) as sim, Magician.connect(sim.url) as arm:
        await take(arm)
        assert scene.pieces["red"].on == "table"
        await arm.suction(False)
        await arm.wait(0.3)

        radians = math.radians(8)
        scene.put("red", at[0] * math.cos(radians), at[1] + 250 * math.sin(radians))
        await take(arm)
        assert scene.pieces["red"].on == "tool of"
        await arm.suction(False)
        await arm.wait(0.3)

        scene.put("red", 250, 0)
        await arm.set_rail()
        await arm.home()
        await take(arm)
        assert scene.pieces["red"].on == "tool of"

    assert not scene.crashes


@virtual
async def test_the_air_takes_its_time_and_nobody_has_to_look() -> None:
    """The piece is taken and let go 0.2 s after the command, though nothing moves and nobody asks meanwhile."""
    scene = Scene(pieces=[RED])
    async with cell(scene) as (sim, arm):
        await go_down(arm, 250, 0, ON_TABLE)
        await arm.suction(True)
        await asyncio.sleep(10)
        assert scene.pieces["red"].on == "tool of"
        await arm.move_to(250, 0, 20)
        await arm.suction(False)
        await asyncio.sleep(10)
        assert scene.pieces["red"].on == "table"
        switched = [each.finished for each in sim.arm.executed if each.name == "SetEndEffectorSuctionCup"]

    assert [each.time for each in scene.events] == [pytest.approx(each + 0.2) for each in switched]


@virtual
async def test_a_cup_that_does_not_wait_for_the_air_leaves_the_piece() -> None:
    scene = Scene(pieces=[RED])
    async with cell(scene) as (_, arm):
        await go_down(arm, 250, 0, ON_TABLE)
        await arm.suction(True)
        await arm.move_to(250, 0, 60)

    assert scene.pieces["red"].on == "table"


@virtual
async def test_the_tip_is_where_the_arm_really_is() -> None:
    """After lost steps it believes to be elsewhere, and takes nothing."""
    scene = Scene(pieces=[RED])
    async with cell(scene) as (sim, arm):
        sim.arm.lose_steps(1, 10)
        await go_down(arm, 250, 0, ON_TABLE)
        await arm.suction(True)
        await arm.wait(0.3)
        await arm.move_to(250, 0, 20)

    assert scene.pieces["red"].on == "table"


@virtual
async def test_a_wrong_end_effector_misses() -> None:
    """The scene has the cup that is on the arm, whatever the program says of it."""
    scene = Scene(pieces=[RED])
    async with cell(scene, Mount(tool=CupTool(offset=90))) as (_, arm):
        await go_down(arm, 250, 0, ON_TABLE)
        await arm.suction(True)
        await arm.wait(0.3)
        await arm.move_to(250, 0, 20)

    assert scene.pieces["red"].on == "table"


@virtual
async def test_an_ultraarm_carries_a_piece() -> None:
    scene = Scene(pieces=[Piece("red", (240, 0))], table=-60)
    async with simulate("ultraarm", scene=scene) as sim, UltraArm.connect(sim.url) as arm:
        await arm.home()
        await arm.move_to(240, 0, 40)
        await arm.move_to(240, 0, -60 + 25 + 59.5)
        await arm.suction(True)
        await arm.wait(1)
        await arm.move_to(240, 0, 60)
        await arm.move_to(200, 100, 60)
        await arm.suction(False)
        await arm.wait(1)
        await arm.move_to(200, 100, 80)

    assert place(scene.pieces["red"]) == (200, 100, -60)


@virtual
async def test_the_fingers_of_an_ultraarm_take_their_time() -> None:
    """They are 30 mm apart, and come together at 50 percent of that a second: on 25 mm after a third of one."""
    scene = Scene(pieces=[Piece("red", (240, 0))], table=-60)
    mount = Mount(tool=GripperTool(opening=30))
    async with simulate("ultraarm", scene=scene, mount=mount, homed=True) as sim, UltraArm.connect(sim.url) as arm:
        await arm.gripper(False)
        await arm.move_to(240, 0, 60)
        await arm.move_to(240, 0, -60 + 12 + 59.5)
        await arm.gripper(True, speed=100)
        await arm.move_to(240, 0, 60)
        assert scene.pieces["red"].on == "tool of"
        (closed,) = (
            each.finished for each in sim.arm.executed if each.command is ultra.SET_GRIPPER and not each.value.opening
        )

    (picked,) = scene.events
    assert picked.time == pytest.approx(closed + 1 / 3, abs=0.01)


@virtual
async def test_a_mycobot_grips_a_piece_in_front_of_its_flange() -> None:
    scene = Scene(table=0)
    mount = Mount(tool=GripperTool(length=60, opening=40))
    async with (
        simulate("mycobot280", scene=scene, mount=mount) as sim,
        MyCobot.connect(sim.url, model="mycobot280") as arm,
    ):
        await arm.move_joints(0, -40, -60, 10, 0, 0)
        frame = sim.arm.ways.frame(sim.arm.joints)
        tip = tuple(p + row[2] * 60 for p, row in frame.rows)
        stand = tip[2] - 12
        scene.add(Piece("stand", (tip[0], tip[1]), (20, 20, stand)))
        scene.add(Piece("red", (tip[0], tip[1])))
        assert (tip[0], tip[1], stand) == place(scene.pieces["red"])
        sim.arm.gripper.go(100, 100)
        await arm.wait(2)
        sim.arm.gripper.go(0, 100)
        await arm.wait(2)
        assert scene.pieces["red"].on == "tool of"
        await arm.move_joints(40, -40, -60, 10, 0, 0)
        assert scene.pieces["red"].position[1] > 50
        sim.arm.gripper.go(100, 100)
        await arm.wait(2)

    assert scene.pieces["red"].on == "table"


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Piece("red", (0, 0), (0, 10, 10)), "size of red"),
        (lambda: Piece("red", (0, float("nan"))), "at is x, y and z"),
        (lambda: Mount(x=float("inf")), "x of .* is not finite"),
        (lambda: Scene(table=float("nan")), "table is a finite height"),
        (lambda: Scene(pieces=[RED, RED]), "something called 'red'"),
        (lambda: Scene(blocks=[Block("table", (0, 0), (1, 1, 1))]), "a name of its own"),
        (lambda: GripperTool(opening=0), "opening is above 0"),
    ],
)
def test_what_cannot_be_is_refused(make: Any, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        make()


async def test_an_application_has_the_scene_with_its_type() -> None:
    async with simulate(scene=Scene(pieces=[RED])) as sim:
        assert_type(sim.scene, Scene)
        assert_type(sim.scene.pieces["red"].position, tuple[float, float, float])
        assert isinstance(sim.scene, Scene)


async def test_without_a_scene_there_is_none() -> None:
    async with simulate() as sim:
        with pytest.raises(RuntimeError, match="stands in no scene"):
            _ = sim.scene

    with pytest.raises(ValueError, match="give scene="):
        async with simulate(mount=Mount()):
            pass
