"""Arms follow within a workspace, and within limits and zones of a fleet: the true places of the tool decide."""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from typing import Any

import pytest
from follow_rig import BY_NAME, Family, Rig, each_family, now, rig
from virtual import virtual

from dobot_async import (
    Box,
    CommandRejected,
    Cylinder,
    Fleet,
    Magician,
    OutsideWorkspace,
    UnsupportedError,
    Workspace,
)
from dobot_async.fleet import BaseFrame, Member
from dobot_async.simulator import Faults, simulate

SLACK = {"magician": 0.2, "mycobot280": 2.0, "ultraarm": 0.2}  # mm by which a way may be off; a cobot's is no line


def around(family: Family, reach: float = 30.0, post: float | None = None) -> Workspace:
    """A box around where a family begins, and perhaps a post with that radius 20 mm to the left of it."""
    x, y, z = family.centre
    box = Box((x - reach, x + reach), (y - reach, y + reach + 20), (z - reach, z + reach))
    return Workspace(box, [Cylinder(x, y + 20, post, z=(-500, 500))] if post else [])


class Watch:
    """Looks at the true place of a tool, many times a second.

    Attributes:
        places: Where it was.
    """

    def __init__(self, r: Rig) -> None:
        self.places: list[tuple[float, float, float]] = []
        self._r = r

    @asynccontextmanager
    async def watching(self) -> AsyncIterator[list[tuple[float, float, float]]]:
        async def look() -> None:
            while True:
                self.places.append(self._r.place)
                await asyncio.sleep(0.004)

        task = asyncio.create_task(look())
        try:
            yield self.places
        finally:
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)


def worst(space: Workspace, places: list[tuple[float, float, float]]) -> float:
    """How far outside the tool was."""
    return max(max(space.excess(place)) for place in places)


async def renewed(follow: Any, target: Any, seconds: float) -> int:
    """Sets a target again and again; how often it was refused."""
    ends, refused = now() + seconds, 0
    while now() < ends:
        try:
            follow.target = target
        except OutsideWorkspace:
            refused += 1

        await asyncio.sleep(1 / 30)

    return refused


@pytest.mark.cases(2)
@each_family
@virtual
async def test_a_target_outside_is_refused_by_its_name_and_the_one_before_stays(family: Family) -> None:
    space = around(family)
    async with rig(family, workspace=space) as r, Watch(r).watching() as places:
        async with r.following() as follow:
            await renewed(follow, r.beside(y=20), 2.0)
            sent, outside = follow.sent, r.beside(y=80)
            said = ", ".join(f"{round(each, 2):g}" for each in outside)
            with pytest.raises(OutsideWorkspace, match=rf"the target \({said}\) mm is outside of Box"):
                follow.target = outside

            assert follow.target.numbers[:3] == pytest.approx(r.beside(y=20))
            assert await renewed(follow, outside, 2.0) > 50
            assert follow.sent <= sent + 1
            await r.stands(within=0.0, seconds=1.0)
            await renewed(follow, r.beside(x=15), 3.0)
            assert r.place == pytest.approx(r.beside(x=15), abs=1.6)

        assert worst(space, places) < SLACK[family.name]


@pytest.mark.cases(1)
@each_family
@virtual
async def test_the_way_round_a_post_is_followed_and_none_leads_through_it(family: Family) -> None:
    """The target goes a quarter of a circle round the post, close to it, and an arm that lags would cut it."""
    space = around(family, 60, post=14)
    x, y, z = family.centre
    async with rig(family, workspace=space) as r, Watch(r).watching() as places:
        async with r.following(max_speed=60) as follow:
            with pytest.raises(OutsideWorkspace, match=r"the way to .* leads by .*, through Cylinder"):
                follow.target = (x, y + 45, z)

            assert follow.target is None
            began, seconds = now(), 8.0
            while (elapsed := now() - began) < seconds + 4:
                angle = -math.pi / 2 + math.pi * min(1.0, elapsed / seconds)
                aim = (x + 18 * math.cos(angle), y + 20 + 18 * math.sin(angle), z)
                with suppress(OutsideWorkspace):  # it is behind the post as long as the arm lags
                    follow.target = aim

                await asyncio.sleep(1 / 30)

        assert math.dist(r.place, (x, y + 38, z)) < 6 or r.place[1] > y + 20
        assert worst(space, places) < SLACK[family.name]


@pytest.mark.cases(1)
@each_family
@virtual
async def test_a_setpoint_waits_at_a_corner_for_an_arm_that_would_cut_it(family: Family) -> None:
    space = around(family, 60, post=19)
    async with rig(family, workspace=space) as r, Watch(r).watching() as places:
        async with r.following(max_speed=400) as follow:
            await renewed(follow, r.beside(x=22), 0.12)  # the setpoint is there by then, and an arm that lags is not
            assert math.dist(r.place, r.beside(x=22)) > 5 or family.name == "ultraarm"
            refused = await renewed(follow, r.beside(x=22, y=40), 6.0)

        assert refused < 30
        assert r.place == pytest.approx(r.beside(x=22, y=40), abs=2)
        assert worst(space, places) < SLACK[family.name]


@pytest.mark.cases(1)
@each_family
@virtual
async def test_a_trajectory_that_leads_outside_is_refused_whole(family: Family) -> None:
    space = around(family, 60, post=14)
    async with rig(family, workspace=space) as r:
        async with r.following(max_speed=30) as follow:
            why = r"point 4 \(from 0\) of the trajectory: the way to .* through Cylinder"
            points = [(0, r.beside()), (3, r.beside(x=25)), (8, r.beside(x=25, y=40)), (12, r.beside(y=45))]
            with pytest.raises(ValueError, match=why):
                await follow.play([*points, (20, r.beside())])

            assert follow.sent == 0
            await follow.play(points)

        assert r.place == pytest.approx(r.beside(y=45), abs=1.6)


@each_family
@virtual
async def test_an_arm_that_stands_outside_follows_nothing(family: Family) -> None:
    x, y, z = family.centre
    async with rig(family, workspace=Box((x - 60, x - 30), (y - 50, y + 50), (z - 50, z + 50))) as r:
        with pytest.raises(CommandRejected, match=r"the arm stands outside: .*bring it back with move_to"):
            async with r.following():
                raise AssertionError

        await r.stands(within=0.0, seconds=1.0)


@each_family
@virtual
async def test_joints_are_followed_inside_where_the_driver_knows_where_they_lead(family: Family) -> None:
    space = around(family)
    async with rig(family, workspace=space) as r, Watch(r).watching() as places:
        async with r.following() as follow:
            joints = list(await r.arm.get_joints())
            if family.name != "magician":
                with pytest.raises(UnsupportedError, match="follow coordinates"):
                    follow.joints = joints

                return

            await follow.reach([4, *joints[1:]], joints=True)
            with pytest.raises(OutsideWorkspace, match="the target"):
                follow.joints = [40, *joints[1:]]

        assert r.place[1] > 10
        assert worst(space, places) < SLACK[family.name]


@virtual
async def test_an_arm_that_is_pushed_outside_ends_its_following() -> None:
    family = BY_NAME["magician"]
    async with rig(family, workspace=around(family)) as r:
        with pytest.raises(CommandRejected, match=r"the arm has come outside, \d+\.\d mm, .*; in following \("):
            async with r.following() as follow:
                await renewed(follow, r.beside(y=5), 1.0)
                r.sim.arm.guide_to(200, 90, 30)
                await renewed(follow, r.beside(y=5), 2.0)

        await r.stands(within=0.0, seconds=1.0)


@asynccontextmanager
async def cell(limits: Box | None = None) -> AsyncIterator[tuple[Any, Fleet[Any], Any]]:
    """Two Magicians that face each other, 500 mm apart, with a zone between them."""
    family = BY_NAME["magician"]
    async with (
        simulate("magician", homed=True, faults=Faults(latency=0.003)) as one,
        simulate("magician", homed=True, faults=Faults(latency=0.003)) as two,
    ):
        one.arm.device.place(family.joints)
        two.arm.device.place((80, *family.joints[1:]))  # beside the zone

        members = {
            "left": Member(one.url, Magician, guard="wait", limits=limits),
            "right": Member(two.url, Magician, guard="wait", base=BaseFrame(500, 0, 0, 180)),
        }
        async with Fleet.connect(members, zones={"middle": Box((245, 330), (-100, 100), (-100, 100))}) as fleet:
            yield one, fleet, two


@virtual
async def test_limits_in_a_fleet_are_kept_by_who_follows() -> None:
    limits = Box((150, 290), (-40, 40), (-20, 100))
    async with cell(limits) as (one, fleet, _):
        arm = fleet["left"]
        r = Rig(BY_NAME["magician"], one, arm)
        async with Watch(r).watching() as places, arm.following() as follow:
            with pytest.raises(ValueError, match=r"left: the way leaves the arm's limits, at \(239.8, 60.0, 22.4\)"):
                follow.target = r.beside(y=60)

            for y in (38, -38, 38):
                await follow.reach(r.beside(y=y))

        assert max(abs(y) for _, y, _ in places) < 40.1
        assert max(y for _, y, _ in places) > 37


@virtual
async def test_who_follows_holds_the_zones_in_its_reach_until_the_end_of_the_block() -> None:
    async with cell() as (one, fleet, two):
        left, right = fleet["left"], fleet["right"]
        r = Rig(BY_NAME["magician"], one, left)
        right_began = asyncio.Event()

        async def enter() -> float:
            right_began.set()
            await right.move_to(215, 30, 30)  # (285, -30) of the cell: in the zone
            return now()

        async with left.following() as follow:
            task = asyncio.create_task(enter())
            await right_began.wait()
            before = two.arm.pose
            await renewed(follow, r.beside(-40), 3.0)
            assert two.arm.pose == before
            assert not task.done()
            left_at = now()

        assert await task > left_at
        assert two.arm.pose.x == pytest.approx(215, abs=0.1)
