"""All of a drawing is looked at before the arm is told anything: reach, workspace, limits of a fleet, joints."""

from __future__ import annotations

import logging
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest
from virtual import virtual

from dobot_async import Box, Cylinder, Fleet, Magician, MyCobot, UltraArm, Workspace
from dobot_async.arms.mycobot import commands as b
from dobot_async.arms.mycobot.models import MODELS
from dobot_async.fleet import Member
from dobot_async.simulator import Simulation, simulate
from dobot_async.toolpath import Drawing, Toolpath, UnreachableStroke, WorkPlane, draw, engrave
from dobot_async.toolpath.joints import JointWalk

PAPER = WorkPlane.flat(195, -45, -50, lift=6)
MANY = Toolpath.of(*([(0, y), (20, y)] for y in range(60)))  # more than are put together


@asynccontextmanager
async def cobot(model: str = "mycobot280", **options: Any) -> AsyncIterator[tuple[Simulation[Any], MyCobot]]:
    """One that stands above (150, -60), its hand down."""
    async with simulate(model) as sim, MyCobot.connect(sim.url, model=model, **options) as arm:
        await arm.power_on()
        await arm.move_joints(0, -30, -60, 0, 0, 0)
        await arm.move_to(150, -60, 120, 180, 0, 0)
        yield sim, arm


@pytest.mark.full
@pytest.mark.parametrize("tool", ["pen", "laser"])
@virtual
async def test_a_stroke_outside_of_the_workspace_is_told_before_a_byte_is_sent(tool: Any) -> None:
    space = Workspace(Box((100, 300), (-130, 130), (-60, 200)), Cylinder(215, 70, 2, z=(-60, 0)))
    path = MANY + Toolpath.of([(0, 70), (0, 115), (40, 115)])  # (195..235, 70): by the post, which is thin
    async with simulate() as sim, Magician.connect(sim.url, workspace=space) as arm:
        requests = sim.arm.counters.requests
        with pytest.raises(UnreachableStroke, match=r"stroke 60, point 2: .* through Cylinder\(215, 70, 2") as caught:
            Drawing(arm, path, PAPER, tool=tool)

        assert (caught.value.stroke, caught.value.point) == (60, 2)
        assert caught.value.place == pytest.approx((235, 70, -50))
        assert sim.arm.counters.requests == requests
        assert not sim.arm.executed
        await (draw if tool == "pen" else engrave)(arm, MANY, PAPER, speed=100, acceleration=1000)
        assert sim.arm.executed


@virtual
async def test_the_way_from_where_the_arm_stands_keeps_to_the_workspace() -> None:
    space = Workspace(Box((100, 300), (-130, 130), (-60, 200)), Box((150, 300), (60, 65), (-60, 200)))
    async with simulate() as sim, Magician.connect(sim.url, workspace=space) as arm:
        sim.arm.guide_to(200, 100, 20)  # behind a wall
        with pytest.raises(UnreachableStroke, match=r"stroke 0, point 0: .* through Box"):
            await draw(arm, Toolpath.of([(0, 0), (20, 0)]), PAPER)

        assert not sim.arm.executed


@virtual
async def test_an_ultraarm_and_a_cobot_keep_to_their_workspace_too() -> None:
    path = Toolpath.of([(0, 0), (20, 0)], [(0, 5), (60, 5)])
    async with simulate("ultraarm", homed=True) as sim, UltraArm.connect(sim.url, workspace=Box((100, 250))) as arm:
        with pytest.raises(UnreachableStroke, match=r"stroke 1, point 1: .* is outside of Box"):
            await draw(arm, path, WorkPlane.flat(200, -40, 20))

        assert not sim.arm.executed

    async with cobot(workspace=Box((100, 200))) as (sim_, arm_):
        before = len(sim_.arm.executed)
        with pytest.raises(UnreachableStroke, match=r"stroke 1, point 1: .* is outside of Box"):
            await draw(arm_, path, WorkPlane.flat(150, -60, 90))

        assert len(sim_.arm.executed) == before


@virtual
async def test_the_limits_of_a_fleet_are_looked_at_too() -> None:
    limits = Box((100, 300), (-130, 50), (-60, 200))
    async with simulate(homed=True) as sim:
        members = {"left": Member(sim.url, Magician, guard="wait", limits=limits)}
        async with Fleet.connect(members, zones={"bin": Box((0, 50), (200, 250), (-60, 0))}) as fleet:
            with pytest.raises(UnreachableStroke, match=r"stroke 60, point 1: .* leaves the arm's limits"):
                await draw(fleet["left"], MANY + Toolpath.of([(0, 60), (0, 100)]), PAPER)

        assert not sim.arm.executed


@virtual
async def test_a_limit_of_a_cobots_joints_in_the_way_of_a_late_stroke_is_told_before_it_moves() -> None:
    """All of x, y and z are in the ranges; near to its base the elbow would have to bend too far."""
    plane = WorkPlane.flat(150, -60, 90)
    good = Toolpath.of(*([(0, y), (30, y)] for y in range(0, 40, 10)))
    async with cobot() as (sim, arm):
        before = len(sim.arm.executed)
        with pytest.raises(
            UnreachableStroke,
            match=r"stroke 4, point 1: .* is out of reach: joint 3 would be at -15\d\.\d\d degrees, beyond -150 to 150",
        ) as caught:
            await draw(arm, good + Toolpath.of([(0, 20), (-60, 20)]), plane)

        assert (caught.value.stroke, caught.value.point) == (4, 1)
        assert 110 < caught.value.place[0] < 150
        assert len(sim.arm.executed) == before
        await draw(arm, good, plane, percent=80)
        assert {record.outcome for record in sim.arm.executed} == {"done"}


@virtual
async def test_limits_of_ones_own_count_for_joints() -> None:
    plane, path = WorkPlane.flat(150, -60, 90), Toolpath.of([(0, 0), (0, 120)])
    async with cobot(limits={"j1": (-30, 20)}) as (sim, arm):
        before = len(sim.arm.executed)
        with pytest.raises(UnreachableStroke, match=r"stroke 0, point 1: .*joint 1 would be at 2[01]"):
            await draw(arm, path, plane)

        assert len(sim.arm.executed) == before

    async with cobot() as (sim, arm):
        await draw(arm, path, plane, percent=80)
        assert sim.arm.coords[1] == pytest.approx(60, abs=0.2)


@virtual
async def test_the_hand_may_be_turned_otherwise_than_a_place_allows() -> None:
    plane = WorkPlane.flat(150, -60, 120)
    async with cobot() as (sim, arm):
        await arm.move_joints(0, -30, -60, 0, 0, 0)  # the hand looks ahead
        here = await arm.get_pose()
        before = len(sim.arm.executed)
        with pytest.raises(UnreachableStroke, match="stroke 0, point"):
            await draw(arm, Toolpath.of([(130, 100), (130, 200)]), plane)

        assert len(sim.arm.executed) == before
        assert await arm.get_pose() == here


@virtual
async def test_a_frame_of_its_own_leaves_the_joints_to_the_arm(caplog: pytest.LogCaptureFixture) -> None:
    path = Toolpath.of([(0, 0), (10, 0)])
    async with cobot() as (sim, arm):
        await arm.request(b.SET_WORLD_REFERENCE, (0.0, 0.0, 100.0, 0.0, 0.0, 0.0))
        await arm.request(b.SET_REFERENCE_FRAME, b.ReferenceFrame.WORLD)
        x, y, z = sim.arm.coords[:3]
        assert z == pytest.approx(220, abs=1)
        with caplog.at_level(logging.WARNING, "dobot_async.toolpath"):
            await draw(arm, path, WorkPlane.flat(x, y, z - 20), percent=80)

        assert "was its tool or its base given a frame" in caplog.text
        assert sim.arm.executed[-1].outcome == "done"


def test_what_is_beyond_the_arms_length_is_told_with_its_rotation() -> None:
    walk = JointWalk(MODELS["mycobot280"], (1.3, -7.2, -134.3, 51.5, 0, -88.7), (150, -60, 120, 180, 0, 0))
    assert walk.knows_the_arm
    walk.go((150, -60, 110))
    with pytest.raises(ValueError, match=r"no joints bring the hand there with its rotation \(180, 0, 0 degrees\)"):
        walk.go((600, -60, 110))
