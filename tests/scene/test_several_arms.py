"""Several arms in one scene: one time, one hand-over, in the order in which things happen."""

from __future__ import annotations

import asyncio

import pytest
from virtual import virtual

from dobot_async import Magician, PTPMode, UltraArm
from dobot_async.arms.magician import commands as c
from dobot_async.simulator import simulate
from dobot_async.simulator.scene import Event, Mount, Piece, Scene

LOW = -53.5


async def carry(arm: Magician, start: tuple[float, float], end: tuple[float, float]) -> None:
    for (x, y), on in ((start, True), (end, False)):
        await arm.move_to(x, y, 20)
        await arm.move_to(x, y, LOW)
        await arm.suction(on)
        await arm.wait(0.3)
        await arm.move_to(x, y, 20)


@pytest.mark.full
@virtual
async def test_a_piece_goes_from_hand_to_hand() -> None:
    """Two arms stand face to face, 500 mm apart; the second sees everything turned."""
    scene = Scene(pieces=[Piece("red", (200, 100))])
    async with (
        simulate(scene=scene, mount=Mount(name="left")) as one,
        simulate(scene=scene, mount=Mount(x=500, yaw=180, name="right")) as other,
        Magician.connect(one.url) as left,
        Magician.connect(other.url) as right,
    ):
        await left.home()
        await right.home()
        await carry(left, (200, 100), (250, 0))
        await carry(right, (250, 0), (200, -100))

    assert [(each.kind, each.arm) for each in scene.events] == [
        ("picked", "left"),
        ("dropped", "left"),
        ("picked", "right"),
        ("dropped", "right"),
    ]
    assert scene.pieces["red"].position == pytest.approx((300, 100, -138), abs=0.05)


@pytest.mark.cases(1)
@pytest.mark.parametrize("first", ["left", "right"])
@virtual
async def test_who_is_read_first_decides_nothing(first: str) -> None:
    """Both go for the same piece with nobody looking; the nearer one has it, whichever is looked at first."""
    scene = Scene(pieces=[Piece("red", (220, 0))])
    async with (
        simulate(scene=scene, mount=Mount(name="left")) as one,
        simulate(scene=scene, mount=Mount(x=440, yaw=180, name="right")) as other,
        Magician.connect(one.url) as left,
        Magician.connect(other.url) as right,
    ):
        await left.home()
        await right.home()
        await left.move_to(220, 0, 20)
        await right.move_to(220, 0, 40)
        await left.suction(True)
        await left.wait(0.3)
        await right.suction(True)
        motions = [await right.queue.move_to(220, 0, LOW), await left.queue.move_to(220, 0, LOW)]
        motions += [await right.queue.move_to(180, 100, 20), await left.queue.move_to(180, 100, 20)]
        await asyncio.sleep(10)
        looked_at = {"left": one, "right": other}[first]
        assert looked_at.arm.device.idle
        for motion in motions:
            await motion

    assert [each.arm for each in scene.events if each.kind == "picked"] == ["left"]
    assert scene.pieces["red"].on == "tool of left"


@pytest.mark.full
@virtual
async def test_arms_of_two_families_share_a_scene() -> None:
    """The ultraArm stands on something, so that the table is 62 mm below its origin."""
    scene = Scene(pieces=[Piece("red", (200, 100))])
    async with (
        simulate("ultraarm", scene=scene, mount=Mount(x=490, z=-76, yaw=180, name="ultra")) as other,
        simulate(scene=scene, mount=Mount(name="left")) as one,
        Magician.connect(one.url) as left,
        UltraArm.connect(other.url) as ultra,
    ):
        await left.home()
        await ultra.home()
        await ultra.move_to(200, 100, 60)
        await carry(left, (200, 100), (250, 0))
        await left.move_to(200, 100, 20)
        await ultra.move_to(240, 0, 60)
        await ultra.move_to(240, 0, -62 + 25 + 59.5)
        await ultra.suction(True)
        await ultra.wait(1)
        await ultra.move_to(240, 0, 60)
        await ultra.move_to(200, 100, 60)
        await ultra.suction(False)
        await ultra.wait(1)
        await ultra.wait(1)

    assert scene.pieces["red"].position == pytest.approx((290, -100, -138), abs=0.1)


@pytest.mark.full
@virtual
async def test_a_scene_outlives_its_arms() -> None:
    """Another arm finds everything where it was left."""
    scene = Scene(pieces=[Piece("red", (200, 100))])
    for start, end in (((200, 100), (250, 0)), ((250, 0), (200, -100))):
        async with simulate(scene=scene) as sim, Magician.connect(sim.url) as arm:
            await arm.home()
            await asyncio.sleep(3)
            await carry(arm, start, end)

    assert scene.pieces["red"].position == pytest.approx((200, -100, -138), abs=0.05)


@virtual
async def test_what_is_held_at_the_end_stays_where_it_is() -> None:
    scene = Scene(pieces=[Piece("red", (250, 0))])
    async with simulate(scene=scene) as sim, Magician.connect(sim.url) as arm:
        await arm.home()
        await arm.move_to(250, 0, 20)
        await arm.move_to(250, 0, LOW)
        await arm.suction(True)
        await arm.wait(0.3)
        await arm.queue.move_to(250, 0, 20)

    height = scene.pieces["red"].position[2]
    await asyncio.sleep(10)
    assert scene.pieces["red"].position[2] == height


async def test_no_time_passes_while_a_piece_is_read() -> None:
    """The arm lets go at the very moment at which the piece's place is read: it is in the hand, or on the table."""
    clock = Leaping()
    scene = Scene(pieces=[Piece("red", (250, 0))])
    async with simulate(scene=scene, clock=clock) as sim, Magician.connect(sim.url) as arm:
        await arm.home()
        await arm.move_to(250, 0, LOW)
        await arm.suction(True)
        await arm.wait(0.3)
        await arm.move_to(250, 0, 40)
        clock.running = False
        async with arm.queue.batch() as batch:
            batch.wait(1)
            batch.suction(False)
            batch.wait(0.3)

        red = scene.pieces["red"]
        clock.leap_after(1)  # the first look is that which brings the scene up to now
        assert red.position[2] == pytest.approx(40 - 59.5 - 25)
        assert red.position[2] == -138.0
        clock.running = True


class Leaping:
    """A clock that runs by 10 ms with each look, or stands still and then leaps on by a minute."""

    def __init__(self) -> None:
        self.running = True
        self._now = 0.0
        self._looks: int | None = None

    def leap_after(self, looks: int) -> None:
        """Leaps on after so many further looks."""
        self._looks = looks

    def __call__(self) -> float:
        if self._looks is not None:
            self._looks -= 1
            if self._looks < 0:
                self._now, self._looks = self._now + 60, None
        elif self.running:
            self._now += 0.01

        return self._now


async def test_arms_of_one_scene_have_one_time() -> None:
    scene = Scene()
    async with simulate(scene=scene, speed=20):
        with pytest.raises(ValueError, match=r"speed=20.*not 10"):
            async with simulate(scene=scene, mount=Mount(name="other"), speed=10):
                pass

        with pytest.raises(ValueError, match="give each mount a name="):
            async with simulate(scene=scene, speed=20):
                pass


PROGRAM = (
    (c.SET_PTP_CMD, c.PTPCmd(PTPMode.MOVJ_XYZ, 250, 0, 20, 0)),
    (c.SET_PTP_CMD, c.PTPCmd(PTPMode.MOVJ_XYZ, 250, 0, LOW, 0)),
    (c.SET_END_EFFECTOR_SUCTION_CUP, c.EndEffectorSuctionCup(is_ctrl_enabled=True, is_sucked=True)),
    (c.SET_WAIT_CMD, c.WAITCmd(300)),
    (c.SET_PTP_CMD, c.PTPCmd(PTPMode.MOVJ_XYZ, 250, 0, 40, 0)),
    (c.SET_END_EFFECTOR_SUCTION_CUP, c.EndEffectorSuctionCup(is_ctrl_enabled=True, is_sucked=False)),
    (c.SET_WAIT_CMD, c.WAITCmd(300)),
    (c.SET_PTP_CMD, c.PTPCmd(PTPMode.MOVJ_XYZ, 200, 100, 40, 0)),
    (c.SET_PTP_CMD, c.PTPCmd(PTPMode.MOVJ_XYZ, 200, 100, -90, 0)),
)


async def watched(step: float) -> tuple[Event, ...]:
    """What happens in 20 s of a program, with somebody who looks at the arm each so many seconds."""
    now = 0.0
    scene = Scene(pieces=[Piece("red", (250, 0)), Piece("blue", (250, 60))])
    async with simulate(scene=scene, clock=lambda: now, homed=True) as sim:
        for row, value in PROGRAM:
            sim.arm.put(row, value)

        for look in range(1, round(20 / step) + 1):
            now = look * step
            assert sim.arm.pose

        return scene.events


@pytest.mark.full
async def test_how_often_somebody_looks_changes_nothing() -> None:
    """A reader that asks a thousand times a second, and one that comes when all is over."""
    events = await watched(20)
    assert [each.kind for each in events] == ["picked", "dropped", "crash"]
    assert await watched(0.001) == events
