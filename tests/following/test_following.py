"""Three families follow a target: what the simulated arm did is what counts."""

from __future__ import annotations

import asyncio
import math
from itertools import pairwise
from typing import Any

import pytest
from follow_rig import BY_NAME, Family, Rig, each_family, now, rig
from virtual import virtual

from dobot_async import CommandRejected, MotionStopped, UltraArm, Unreachable
from dobot_async.arms.magician import commands as magician
from dobot_async.arms.mycobot import commands as mycobot
from dobot_async.arms.ultraarm import commands as ultraarm
from dobot_async.simulator import simulate

ways = pytest.mark.parametrize("way", ["replace", "clear"])


async def kept(follow: Any, target: Any, seconds: float) -> None:
    """Renews a target for a while."""
    ends = now() + seconds
    while now() < ends:
        follow.target = target
        await asyncio.sleep(0.05)


async def circle(r: Rig, follow: Any, seconds: float, *, radius: float = 15.0, hertz: float = 0.25) -> list[float]:
    """Lets the arm follow a circle; returns how far behind it was, in seconds, once it was under way."""
    began, turned, lags = now(), 0.0, []
    x0, y0, _ = r.family.centre
    while (elapsed := now() - began) < seconds:
        angle = math.tau * hertz * elapsed
        follow.target = r.beside(radius * math.cos(angle), radius * math.sin(angle))
        here = math.atan2(r.place[1] - y0, r.place[0] - x0)
        turned = here + round((turned - here) / math.tau) * math.tau
        if elapsed > seconds / 3:
            lags.append((angle - turned) / (math.tau * hertz))

        await asyncio.sleep(1 / 30)

    return lags


@each_family
@virtual
async def test_the_arm_follows_and_the_newest_target_wins(family: Family) -> None:
    async with rig(family) as r, r.following() as follow:
        for target in (r.beside(20), r.beside(y=20), r.beside(y=-10)):
            follow.target = target

        east = []
        for _ in range(40):
            await kept(follow, r.beside(y=-10), 0.05)
            east.append(r.place[0])

        assert max(east) < r.beside(3)[0]
        assert r.place == pytest.approx(r.beside(y=-10), abs=1.5)
        assert follow.here.numbers[:3] == pytest.approx(r.place, abs=1)
        assert follow.target.numbers[:3] == pytest.approx(r.beside(y=-10))


@pytest.mark.cases(1)
@each_family
@virtual
async def test_a_circle_is_followed_round_and_round(family: Family) -> None:
    async with rig(family) as r, r.following() as follow:
        await follow.reach(r.beside(15))
        lags = await circle(r, follow, 12)
        assert min(lags) > 0
        assert max(lags) < 1.0
        assert not follow.motion.done


@each_family
@virtual
async def test_a_target_that_is_not_renewed_is_left_alone(family: Family) -> None:
    async with rig(family) as r, r.following(max_speed=30, stale=0.3) as follow:
        follow.target = r.beside(y=40)
        await asyncio.sleep(0.3)
        sent = follow.sent
        await asyncio.sleep(0.1)
        await r.stands(within=0.8)
        assert follow.sent <= sent + 1
        assert 1 < r.place[1] - r.family.centre[1] < 20
        await kept(follow, r.beside(y=40), 3.0)  # and it goes on
        assert r.place == pytest.approx(r.beside(y=40), abs=1.5)


@each_family
@virtual
async def test_leaving_the_block_stops_the_arm(family: Family) -> None:
    async with rig(family) as r:
        async with r.following() as follow:
            await kept(follow, r.beside(y=60), 0.5)
            await r.sets_out()
            left = now()

        await follow.motion
        assert r.moving is False
        assert now() - left < 0.5
        await r.stands(within=max(0.0, left + 0.2 - now()))
        assert 0 < r.place[1] - r.family.centre[1] < 59
        with pytest.raises(MotionStopped, match="has ended"):
            follow.target = r.beside()

        if family.kind is UltraArm:  # its motors kept their power
            assert r.sim.arm.registers.powered

        await r.arm.move_joints(*(joint + 1 for joint in family.joints[: 4 if family.name != "mycobot280" else 6]))


@each_family
@virtual
async def test_an_error_in_the_block_stops_the_arm(family: Family) -> None:
    async with rig(family) as r:
        with pytest.raises(ZeroDivisionError):
            async with r.following() as follow:
                await kept(follow, r.beside(y=60), 0.5)
                raise ZeroDivisionError

        await r.stands()
        with pytest.raises(MotionStopped, match="left by an error"):
            await follow.motion


@each_family
@virtual
async def test_a_stop_by_anybody_ends_it(family: Family) -> None:
    async with rig(family) as r:
        with pytest.raises(MotionStopped, match="told to stop"):
            async with r.following() as follow:
                await kept(follow, r.beside(y=60), 0.4)
                await r.arm.stop()
                await r.stands()
                with pytest.raises(MotionStopped, match="told to stop"):
                    await follow.motion

                with pytest.raises(MotionStopped, match="told to stop"):
                    follow.target = r.beside()

        await r.stands()


@each_family
@virtual
async def test_what_is_queued_meanwhile_is_refused(family: Family) -> None:
    async with rig(family) as r:
        async with r.following() as follow:
            follow.target = r.beside(y=5)
            before = len(r.sim.arm.executed)
            joints = r.family.joints[: len(await r.arm.get_joints())]
            for call in (r.arm.move_joints, r.arm.queue.move_joints):
                with pytest.raises(CommandRejected, match="following has the arm"):
                    await call(*joints)

            with pytest.raises(CommandRejected, match="following has the arm"):
                async with r.arm.queue.batch() as batch:
                    queued = batch.move_joints(*joints)

            assert isinstance(queued.exception(), CommandRejected)
            with pytest.raises(CommandRejected, match="following has the arm"):
                async with r.following():
                    raise AssertionError

            with pytest.raises(CommandRejected):
                await r.arm.jog("j1+", 0.1)

            await kept(follow, r.beside(y=5), 1.0)
            assert all("Joints" not in each.name and "Angles" not in each.name for each in r.sim.arm.executed[before:])

        await r.arm.move_joints(*joints)


@each_family
@virtual
async def test_it_waits_for_no_motion_that_is_pending(family: Family) -> None:
    async with rig(family) as r:
        motion = await r.arm.queue.move_joints(*(20 + joint for joint in await r.arm.get_joints()))
        with pytest.raises(CommandRejected, match="has the arm; following can begin"):
            async with r.following():
                raise AssertionError

        await motion  # it was not disturbed


@each_family
@virtual
async def test_targets_that_are_not_allowed_are_told_at_once(family: Family) -> None:
    async with rig(family) as r, r.following() as follow:
        await kept(follow, r.beside(y=5), 0.5)
        with pytest.raises(ValueError, match=r"reach|must be in"):
            follow.target = (900, 0, 100)

        with pytest.raises(ValueError, match=r"reach|must be in"):
            follow.joints = (179.9,) * len(await r.arm.get_joints())

        with pytest.raises(TypeError, match="target must be a pose"):
            follow.target = 5

        assert follow.target.numbers[:3] == pytest.approx(r.beside(y=5))
        await kept(follow, r.beside(y=5), 0.5)
        assert r.place == pytest.approx(r.beside(y=5), abs=1.5)


@each_family
@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"rate": 0}, "rate must be above 0"),
        ({"rate": 1000}, "rate must be 0 or more and at most 200"),
        ({"max_speed": -1}, "max_speed must be 0 or more"),
        ({"max_turn": math.nan}, "max_turn"),
        ({"stale": 0}, "stale must be above 0"),
    ],
)
@virtual
async def test_arguments_are_checked_before_a_byte(family: Family, options: dict[str, float], words: str) -> None:
    async with rig(family) as r:
        sent = r.arm.link.stats.sent
        with pytest.raises(ValueError, match=words):
            async with r.following(**options):
                raise AssertionError

        assert r.arm.link.stats.sent == sent
        assert not r.arm.queue.pending


@each_family
@virtual
async def test_the_setpoint_is_no_faster_than_it_may_be(family: Family) -> None:
    async with rig(family) as r, r.following(max_speed=20, rate=30) as follow:
        began, way = now(), []
        while now() < began + 3:
            follow.target = r.beside(y=55)
            way.append((now(), r.place[1]))
            await asyncio.sleep(0.25)

        assert 30 < way[-1][1] - way[0][1] < 61
        for (then, before), (later, after) in pairwise(way[2:]):
            assert after - before < 20 * (later - then) * 2.5 + 1  # the arm comes up with it in short moves


@each_family
@virtual
async def test_joints_are_followed_too(family: Family) -> None:
    async with rig(family) as r, r.following() as follow:
        pose, joints = await r.arm.get_pose(), await r.arm.get_joints()
        wanted = tuple(joint + 8 for joint in joints)
        await follow.reach(wanted, joints=True)
        assert follow.joints == pytest.approx(wanted)
        assert r.sim.arm.device.joints[: len(wanted)] == pytest.approx(wanted, abs=4.1)
        with pytest.raises(ValueError, match="give all of x, y, z"):
            follow.target = r.beside()

        await follow.reach(pose)  # and coordinates again
        assert follow.joints is None


@each_family
@virtual
async def test_a_trajectory_is_played_in_its_time(family: Family) -> None:
    async with rig(family) as r, r.following() as follow:
        points = [(0.5 * number, r.beside(y=6.0 * number)) for number in range(7)]
        await follow.reach(points[0][1])
        began = now()
        await follow.play(points)
        assert 3.0 <= now() - began < 4.5
        assert r.place == pytest.approx(points[-1][1], abs=8.1)
        with pytest.raises(ValueError, match=r"point 1 \(from 0\)"):
            await follow.play([(0, r.beside()), (1, (5000, 0, 0))])

        pose = await r.arm.get_pose()
        await follow.play([(0, pose), (0.2, pose)])
        await follow.play([(0, pose), (0.2, pose)], joints=True)


@each_family
@virtual
async def test_nobody_moves_an_arm_that_has_no_target(family: Family) -> None:
    async with rig(family) as r:
        async with r.following() as follow:
            await r.stands(within=0.0)
            assert follow.target is None
            assert follow.sent == 0

        await r.stands(within=0.0)


@ways
@virtual
async def test_both_ways_of_a_magician(way: str) -> None:
    async with rig(BY_NAME["magician"]) as r:
        async with r.following(way=way) as follow:
            await follow.reach(r.beside(15))
            lags = await circle(r, follow, 9)
            assert max(lags) < 1.0

        motions = [each for each in r.sim.arm.executed if each.command is magician.SET_PTP_CMD]
        assert len(motions) > 10
        assert {each.index is None for each in motions} == {way == "replace"}
        await r.arm.move_to(*r.beside())
        assert r.place == pytest.approx(r.beside(), abs=0.1)


@virtual
async def test_a_magician_knows_its_ways() -> None:
    async with rig(BY_NAME["magician"]) as r:
        with pytest.raises(ValueError, match="way must be 'replace' or 'clear'"):
            r.arm.following(way="jump")


@pytest.mark.parametrize("before", [False, True])
@virtual
async def test_a_cobot_gets_its_mode_back(before: bool) -> None:
    async with rig(BY_NAME["mycobot280"]) as r:
        await r.arm.request(mycobot.SET_FRESH_MODE, before)
        async with r.following() as follow:
            assert r.sim.arm.settings[mycobot.SET_FRESH_MODE] is True
            await kept(follow, r.beside(y=20), 0.3)

        assert r.sim.arm.settings[mycobot.SET_FRESH_MODE] is before
        with pytest.raises(ValueError, match="speed"):
            r.arm.following(speed=101)


@virtual
async def test_an_ultraarm_with_ramps_is_slow_and_keeps_its_power() -> None:
    """Short motions alone: none is longer than a moment, so that the end of the block is one, too."""
    family = BY_NAME["ultraarm"]
    async with simulate("ultraarm", homed=True) as sim, UltraArm.connect(sim.url) as arm:
        sim.arm.device.place(family.joints)
        r = Rig(family, sim, arm)
        async with arm.following() as follow:
            await kept(follow, r.beside(y=60), 3)
            left = now()

        await r.stands(within=max(0.0, left + 0.2 - now()))
        assert 10 < r.place[1] < 60
        motions = [each for each in sim.arm.executed if each.command is ultraarm.MOVE_COORDS]
        assert max(each.finished - each.started for each in motions) < 0.16
        assert sim.arm.registers.powered
        assert not sim.arm.missed


@virtual
async def test_an_ultraarm_runs_without_ramps_for_so_long_alone() -> None:
    async with rig(BY_NAME["ultraarm"]) as r:
        async with r.following():
            assert r.sim.arm.registers.speed_mode == ultraarm.SpeedMode.CONSTANT

        assert r.sim.arm.registers.speed_mode == ultraarm.SpeedMode.RAMPED
        await r.arm.release()
        with pytest.raises(CommandRejected, match="no power"):
            async with r.following():
                raise AssertionError


@virtual
async def test_reach_tells_why() -> None:
    async with rig(BY_NAME["magician"]) as r, r.following() as follow:
        with pytest.raises(Unreachable, match="too far"):
            await follow.reach((500, 0, 0))


@virtual
async def test_longer_motions_of_an_ultraarm_with_ramps_get_on_faster_and_rest_in_their_time() -> None:
    family = BY_NAME["ultraarm"]
    speeds: dict[float, float] = {}
    for motion_time in (0.1, 0.4):
        async with simulate("ultraarm", homed=True) as sim, UltraArm.connect(sim.url) as arm:
            sim.arm.device.place(family.joints)
            r = Rig(family, sim, arm)
            async with arm.following(motion_time=motion_time) as follow:
                await kept(follow, r.beside(y=100), 2)
                speeds[motion_time] = r.place[1] / 2
                left = now()

            await r.stands(within=max(0.0, left + 2 * motion_time - now()))
            motions = [each for each in sim.arm.executed if each.command is ultraarm.MOVE_COORDS]
            assert max(each.finished - each.started for each in motions) < 1.6 * motion_time
            assert sim.arm.registers.powered
            with pytest.raises(ValueError, match="motion_time must be"):
                arm.following(motion_time=3)

    assert speeds[0.4] > 2.5 * speeds[0.1]
