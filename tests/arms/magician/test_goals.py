"""Targets that are not whole: what is not given stays as it is, as far as that can be known."""

from __future__ import annotations

import asyncio
import math
from typing import Any

import pytest
from virtual import virtual

from dobot_async import AccessoryVersion, Magician, MotionStopped, Pose, PTPMode
from dobot_async.arms.magician import commands as c
from dobot_async.simulator import SimulatedMagician, Simulation, simulate


def last(sim: Simulation[SimulatedMagician]) -> Any:
    """The parameters of the last motion that the arm has done."""
    return [each.value for each in sim.arm.executed if each.outcome == "done" and each.command.moves][-1]


def at(sim: Simulation[SimulatedMagician], *place: float) -> bool:
    """Whether the tool is there."""
    pose = sim.arm.pose
    return math.dist((pose.x, pose.y, pose.z, pose.r), place) < 0.01


@virtual
async def test_what_is_not_given_stays_as_the_arm_stands() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        await arm.move_to(220, 30, 40, 25)
        await arm.move_to(z=20)
        assert at(sim, 220, 30, 20, 25)
        await arm.move_to(y=-30, r=5, mode=PTPMode.MOVL_XYZ)
        assert at(sim, 220, -30, 20, 5)
        assert last(sim).ptp_mode is PTPMode.MOVL_XYZ
        await arm.move_to(220, 30, 40)
        assert at(sim, 220, 30, 40, 0), "a place that is whole has the rotation 0"


@virtual
async def test_what_is_not_given_stays_as_the_queue_leaves_it() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        await arm.queue.move_to(220, 60, 40, 25)
        await arm.queue.move_by(10, -20)
        lowered = await arm.queue.move_to(z=20)
        assert not sim.arm.device.idle
        await lowered
        assert at(sim, 230, 40, 20, 25)
        async with arm.queue.batch() as batch:
            batch.move_to(200, 60, 5, 10)
            batch.suction(True)
            lifted = batch.move_to(z=60)

        await lifted
        assert at(sim, 200, 60, 60, 10)


@virtual
async def test_an_arm_that_was_moved_by_hand_since_is_asked_where_it_is() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        await arm.queue.move_to(220, 60, 40)  # nobody waits for it
        await asyncio.sleep(10)
        sim.arm.guide_to(200, -20, 30, 15)
        await (await arm.queue.move_to(z=50))
        assert at(sim, 200, -20, 50, 15)


@virtual
async def test_joints_are_a_goal_as_well() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        await arm.queue.move_joints(20, 40, 40, 0)
        there = arm.kinematics.forward(20, 40, 40, 0)
        await (await arm.queue.move_to(z=50))
        assert at(sim, there.x, there.y, 50, there.r)


@pytest.mark.parametrize(
    "before",
    [
        lambda queue: queue.home(),
        lambda queue: queue.path_to(230, 0, 40),
        lambda queue: queue.put(c.SET_END_EFFECTOR_PARAMS, c.EndEffectorParams(70)),
    ],
    ids=["home", "path", "tool"],
)
@virtual
async def test_what_cannot_be_known_is_refused_before_a_byte_is_sent(before: Any) -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        await arm.queue.move_to(220, 60, 40)
        await before(arm.queue)
        for attempt in (lambda: arm.move_to(z=20), lambda: arm.queue.move_to(z=20)):
            with pytest.raises(ValueError, match="is to stay, but what it will be then is not known"):
                await attempt()

        async with arm.queue.batch() as batch:
            with pytest.raises(ValueError, match="is to stay"):
                batch.move_to(z=20)

        await arm.queue.join()
        assert sum(each.command is c.SET_PTP_CMD for each in sim.arm.executed) == 1


@virtual
async def test_a_batch_that_begins_with_what_is_not_known_says_so() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        requests = sim.arm.counters.requests
        with pytest.raises(ValueError, match="x is to stay"):
            async with arm.queue.batch() as batch:
                batch.move_to(z=20)

        assert sim.arm.counters.requests == requests


@virtual
async def test_what_an_earlier_program_left_in_the_queue_leads_nobody_knows_where() -> None:
    async with simulate() as sim:
        async with Magician.connect(sim.url) as first:
            await first.queue.move_to(200, 150, 40)

        async with Magician.connect(sim.url, queue="keep") as arm:
            with pytest.raises(ValueError, match="keep"):
                await arm.move_to(z=20)

            await arm.wait(0)
            await arm.move_to(z=20)
            assert at(sim, 200, 150, 20, 0)


@virtual
async def test_a_stop_while_the_arm_is_asked_where_it_is_ends_the_motion() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        sim.faults.latency = 0.1
        for place in (arm, arm.queue):
            moving: asyncio.Task[Any] = asyncio.create_task(place.move_to(z=60))
            await asyncio.sleep(0.1)
            await arm.stop()
            with pytest.raises(MotionStopped):
                await moving

        await asyncio.sleep(5)
        assert not any(each.command is c.SET_PTP_CMD for each in sim.arm.executed)


@virtual
async def test_a_pose_is_a_target() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        await arm.move_to(220, 60, 40, 25)
        there = await arm.get_pose()
        assert await arm.get_joints() == there.joints == (there.j1, there.j2, there.j3, there.j4)
        await arm.move_to(200, 0, 20)
        await arm.move_to(there)
        assert at(sim, 220, 60, 40, 25)
        await arm.move_to(200, 0, 20)
        await arm.move_to(there, mode=PTPMode.MOVJ_ANGLE)
        assert at(sim, 220, 60, 40, 25)
        assert last(sim).x == pytest.approx(there.j1)
        wrong: list[dict[str, Any]] = [{"y": 1}, {"z": 1}, {"r": 1}, {"j4": 1}, {"mode": PTPMode.MOVL_INC}]
        for more in wrong:
            with pytest.raises(ValueError, match="whole target"):
                await arm.move_to(there, **more)


@virtual
async def test_joint_4_can_be_kept() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        await arm.set_end_effector(c.EndEffectorParams(59.7, 12.0))
        for x, y in ((200, 100), (200, -100), (250, 0)):
            await arm.move_to(x, y, 20, j4=15)
            assert sim.arm.pose.j4 == pytest.approx(15, abs=1e-3)
            assert sim.arm.pose.r == pytest.approx(sim.arm.pose.j1 + 15, abs=1e-3)

        await arm.move_to(y=80, j4=15)
        assert (sim.arm.pose.j4, sim.arm.pose.y) == pytest.approx((15, 80), abs=1e-3)
        with pytest.raises(ValueError, match="give one of them"):
            await arm.move_to(200, 0, 20, 5, j4=15)


@pytest.mark.parametrize("mode", [PTPMode.MOVJ_ANGLE, PTPMode.MOVL_INC])
@virtual
async def test_joints_and_increments_have_nothing_to_stay(mode: PTPMode) -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        wrong: list[dict[str, Any]] = [{"z": 1}, {"x": 1, "y": 2}, {"x": 1, "y": 2, "z": 3, "j4": 4}]
        for target in wrong:
            with pytest.raises(ValueError, match="needs x, y and z"):
                await arm.move_to(**target, mode=mode)

        with pytest.raises(ValueError, match="mode of move_by"):
            await arm.move_by(10, mode=PTPMode.MOVL_XYZ)
        with pytest.raises(ValueError, match="mode of move_joints"):
            await arm.move_joints(0, 45, 45, 0, mode=PTPMode.MOVL_INC)


# The rail.


@virtual
async def test_a_rail_that_was_not_declared_is_named_and_nothing_is_sent() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        for attempt in (
            lambda: arm.move_to(220, 0, 40, l=300),
            lambda: arm.queue.move_joints(0, 45, 45, 0, l=300),
            lambda: arm.queue.put(c.SET_PTP_WITH_L_CMD, c.PTPWithLCmd(PTPMode.MOVJ_XYZ, 220, 0, 40, 0, 300)),
            lambda: arm.jog("l+", 0.5),
        ):
            with pytest.raises(ValueError, match=r"set_rail\(\)"):
                await attempt()

        with pytest.raises(ValueError, match=r"set_rail\(\)"):
            async with arm.queue.batch() as batch:
                batch.suction(True)
                moved = batch.move_to(220, 0, 40, l=300)

        with pytest.raises(MotionStopped):
            await moved

        assert sim.arm.executed == []


@pytest.mark.full
@virtual
async def test_all_motions_go_along_the_rail() -> None:
    async with simulate(homed=True) as sim, Magician.connect(sim.url) as arm:
        await arm.set_rail(version=AccessoryVersion.V2)
        await arm.move_to(220, 0, 40, l=300)
        assert (sim.arm.rail, await arm.get_rail()) == (300, 300)
        await arm.move_joints(10, 40, 40, 0, l=200)
        assert sim.arm.rail == 200
        await arm.move_by(l=50)
        assert sim.arm.rail == pytest.approx(250)
        assert sim.arm.pose.joints == pytest.approx((10, 40, 40, 0), abs=1e-3)
        await arm.move_by(10, 0, -5, mode=PTPMode.MOVJ_INC, l=-50)
        assert sim.arm.rail == pytest.approx(200)
        assert sim.arm.pose.joints == pytest.approx((20, 40, 35, 0), abs=1e-3)
        await arm.move_to(l=100)
        assert sim.arm.rail == 100
        assert sim.arm.pose.joints == pytest.approx((20, 40, 35, 0), abs=1e-3)
        async with arm.queue.batch() as batch:
            batch.move_to(220, 0, 40, l=400)
            ended = batch.move_by(z=10, l=30)

        await ended
        assert (sim.arm.rail, round(sim.arm.pose.z)) == (430, 50)
        with pytest.raises(ValueError, match=r"move_by\(l="):
            await arm.move_to(0, 0, 0, l=50, mode=PTPMode.MOVL_INC)


@virtual
async def test_a_rail_may_be_declared_in_the_queue() -> None:
    async with simulate(homed=True) as sim, Magician.connect(sim.url) as arm:
        async with arm.queue.batch() as batch:
            batch.put(c.SET_DEVICE_WITH_L, c.DeviceWithL(is_with_l=True))
            moved = batch.move_to(220, 0, 40, l=300)

        await moved
        assert sim.arm.rail == 300


@virtual
async def test_the_rail_was_declared_by_another_program() -> None:
    async with simulate(homed=True) as sim:
        async with Magician.connect(sim.url) as arm:
            await arm.set_rail()

        async with Magician.connect(sim.url) as arm:
            await arm.move_to(220, 0, 40, l=300)
            assert sim.arm.rail == 300


def test_a_pose_has_its_joints() -> None:
    assert Pose(1, 2, 3, 4, 5, 6, 7, 8).joints == (5, 6, 7, 8)
