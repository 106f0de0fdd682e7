"""Hold to move, in virtual time: what the simulated arm did decides, and no beat is what stops it."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from panel_rig import VirtualPage, desk_of

from dobot_async import Magician
from dobot_async.arms.magician import commands as c
from dobot_async.fleet.member import Member
from dobot_async.panel import Role
from dobot_async.panel.hold_to_run import PATIENCE
from dobot_async.simulator import Faults, Simulation, simulate

pytestmark = pytest.mark.virtual_time
BRAKES = 0.35  # seconds in which a simulated arm that jogs at 20 percent comes to rest, and the line's time


def now() -> float:
    return asyncio.get_running_loop().time()


def jogs(sim: Simulation[Any]) -> list[Any]:
    """The jogs that the arm has begun."""
    return [each for each in sim.arm.executed if each.command is c.SET_JOG_CMD and each.value.cmd != c.JOGKey.IDLE]


async def stands(sim: Simulation[Any]) -> bool:
    """Whether the arm is where it was a moment before."""
    before = sim.arm.pose
    await asyncio.sleep(0.02)
    return bool(before == sim.arm.pose)


async def operator(join: Any) -> VirtualPage:
    """A page with the lease."""
    found: VirtualPage = join()
    await found.get("take_lease", arm="arm")
    await asyncio.sleep(0.2)
    assert found.tick
    return found


async def beats(page: VirtualPage, press: int, seconds: float, every: float = 0.1) -> None:
    """Hold for some seconds."""
    end = now() + seconds
    while now() < end:
        await asyncio.sleep(every)
        page.send("beat", arm="arm", press=press, tick=page.tick)


async def test_it_moves_as_long_as_beats_come_and_not_longer() -> None:
    async with simulate() as sim, desk_of({"arm": Member(sim.url, Magician)}) as (_, join):
        page = await operator(join)
        number, press = page.press("y+")
        await beats(page, press, 2.0)
        assert not await stands(sim)
        last = now()

        await page.answer(number)

        assert now() - last <= PATIENCE + BRAKES
        answer = page.reply(number)
        assert answer
        assert answer["value"] == {"why": "no beat"}
        await asyncio.sleep(BRAKES)
        assert await stands(sim)


async def test_release_stops_it_sooner() -> None:
    async with simulate() as sim, desk_of({"arm": Member(sim.url, Magician)}) as (_, join):
        page = await operator(join)
        number, press = page.press("y+")
        await beats(page, press, 0.5)
        page.send("release", arm="arm", press=press)
        await asyncio.sleep(BRAKES / 2)
        answer = page.reply(number)
        assert answer
        assert answer["value"] == {"why": "released"}
        await asyncio.sleep(BRAKES)
        assert await stands(sim)


async def test_another_press_takes_the_place_of_the_first() -> None:
    async with simulate() as sim, desk_of({"arm": Member(sim.url, Magician)}) as (_, join):
        page = await operator(join)
        first, press = page.press("y+")
        await beats(page, press, 0.5)
        second, other = page.press("y-")
        await beats(page, other, 1.0)
        answer = page.reply(first)
        assert answer
        assert answer["value"] == {"why": "another press"}
        assert not page.reply(second)
        before = sim.arm.pose.y
        await beats(page, other, 0.3)
        assert sim.arm.pose.y < before
        await beats(page, press, 0.5 + BRAKES)  # the first one is over
        assert await stands(sim)
        assert [each.value.cmd for each in jogs(sim)] == [c.JOGKey.BP_DOWN, c.JOGKey.BN_DOWN]


async def test_of_presses_that_wait_for_the_first_to_end_the_newest_moves_it() -> None:
    """On a line that takes its time, so that two more presses come before the first one has ended."""
    async with (
        simulate(faults=Faults(latency=0.05)) as sim,
        desk_of({"arm": Member(sim.url, Magician)}) as (desk, join),
    ):
        page = await operator(join)
        first, press = page.press("x+")
        await beats(page, press, 0.3)
        second, _ = page.press("x-")
        await asyncio.sleep(0.02)
        third, newest = page.press("y+")
        before = sim.arm.pose.y
        await beats(page, newest, 1.5)
        for number in (first, second):
            answer = page.reply(number)
            assert answer
            assert answer["value"] == {"why": "another press"}

        assert not page.reply(third)
        assert sim.arm.pose.y > before + 1
        page.send("release", arm="arm", press=newest)
        await page.answer(third)
        assert not desk.stations["arm"].holds, "a press that is over is kept"


async def test_a_press_is_not_kept_if_the_arm_is_busy() -> None:
    async with simulate(speed=0.2) as sim, desk_of({"arm": Member(sim.url, Magician)}) as (desk, join):
        page = await operator(join)
        page.send("move_to", arm="arm", x=220.0, y=150.0, z=40.0)
        for _ in range(3):
            number, _ = page.press("y+")
            assert (await page.answer(number))["error"]["kind"] == "busy"

        assert not desk.stations["arm"].holds
        assert not jogs(sim)


async def test_a_press_that_is_over_is_not_revived() -> None:
    async with simulate() as sim, desk_of({"arm": Member(sim.url, Magician)}) as (_, join):
        page = await operator(join)
        number, press = page.press("y+")
        await asyncio.sleep(PATIENCE + BRAKES)
        assert page.reply(number)
        await beats(page, press, 1.0)
        assert await stands(sim)
        assert len(jogs(sim)) == 1


async def test_beats_with_old_ticks_do_not_count() -> None:
    """As from a page whose network keeps everything back for a while: the hand may be gone long since."""
    async with simulate() as sim, desk_of({"arm": Member(sim.url, Magician)}) as (_, join):
        page = await operator(join)
        number, press = page.press("y+")
        old = page.tick
        for _ in range(20):
            await asyncio.sleep(0.05)
            page.send("beat", arm="arm", press=press, tick=old)

        answer = page.reply(number)
        assert answer
        assert answer["value"] == {"why": "no beat"}
        assert await stands(sim)


async def test_a_press_that_comes_late_moves_nothing() -> None:
    async with simulate() as sim, desk_of({"arm": Member(sim.url, Magician)}) as (_, join):
        page = await operator(join)
        old = page.tick
        await asyncio.sleep(1)
        answer = await page.ask("jog", arm="arm", direction="y+", press=1, tick=old)
        assert answer["error"]["kind"] == "late"
        assert (await page.ask("jog", arm="arm", direction="y+", press=1, tick=10**9))["error"]["kind"] == "late"
        assert not jogs(sim)


async def test_a_page_that_goes_stops_what_it_holds() -> None:
    async with simulate() as sim, desk_of({"arm": Member(sim.url, Magician)}) as (desk, join):
        page = await operator(join)
        _, press = page.press("y+")
        await beats(page, press, 0.5)
        began = now()
        await page.session.aclose()
        assert now() - began <= BRAKES
        await asyncio.sleep(BRAKES)
        assert await stands(sim)
        assert desk.stations["arm"].lease.holder is None


async def test_a_page_that_goes_stops_what_it_has_commanded() -> None:
    async with simulate(speed=0.2) as sim, desk_of({"arm": Member(sim.url, Magician)}) as (_, join):
        page = await operator(join)
        page.send("move_to", arm="arm", x=220.0, y=150.0, z=40.0)
        await asyncio.sleep(1)
        assert not await stands(sim)
        await page.session.aclose()
        await asyncio.sleep(1)
        assert await stands(sim)
        ((outcome,),) = [{each.outcome} for each in sim.arm.executed if each.command is c.SET_PTP_CMD]
        assert outcome != "done"


async def test_a_viewer_stops_it_and_the_lease_ends() -> None:
    async with simulate() as sim, desk_of({"arm": Member(sim.url, Magician)}) as (_, join):
        page, viewer = await operator(join), join(Role.VIEWER)
        number, press = page.press("y+")
        await beats(page, press, 0.5)
        await viewer.get("stop", arm="arm")
        await beats(page, press, 0.5)
        assert await stands(sim)
        assert page.reply(number)
        assert page.last("lease")["mine"] is False
        number, _ = page.press("y+")
        answer = page.reply(number)
        await asyncio.sleep(0.1)
        answer = page.reply(number)
        assert answer
        assert answer["error"]["kind"] == "lease"
        assert len(jogs(sim)) == 1


async def test_who_takes_over_finds_an_arm_that_stands() -> None:
    async with simulate() as sim, desk_of({"arm": Member(sim.url, Magician)}) as (_, join):
        page, other = await operator(join), join()
        number, press = page.press("y+")
        await beats(page, press, 0.5)
        answer = await other.ask("take_lease", arm="arm")
        assert answer["error"]["kind"] == "lease"
        assert page.session.name in answer["error"]["text"]
        assert not await stands(sim)

        await other.get("take_lease", arm="arm", takeover=True)
        assert page.reply(number), "the jog had not ended when the lease was given away"
        assert page.last("jog")["state"] == "ended"
        assert page.last("lease")["mine"] is False
        assert other.last("lease")["mine"] is True
        await beats(page, press, 0.5)
        assert await stands(sim)


@pytest.mark.parametrize("held", [True, False])
async def test_a_dead_line_keeps_the_end_of_the_panel_for_two_seconds(held: bool) -> None:
    async with simulate() as sim, desk_of({"arm": Member(sim.url, Magician)}) as (desk, join):
        page = await operator(join)
        if held:
            _, press = page.press("y+")
            await beats(page, press, 0.5)
        else:
            page.send("move_to", arm="arm", x=200.0, y=150.0, z=40.0)
            await asyncio.sleep(0.3)

        sim.faults.silent = True
        began = now()
        await desk.aclose()
        assert now() - began <= 2.2


async def test_a_stop_is_repeated_on_a_dead_line_until_the_arm_hears_it() -> None:
    async with simulate() as sim, desk_of({"arm": Member(sim.url, Magician)}) as (_, join):
        page, viewer = await operator(join), join(Role.VIEWER)
        _, press = page.press("y+", speed=5)
        await beats(page, press, 0.5)
        sim.faults.silent = True
        number = viewer.send("stop")
        await asyncio.sleep(10)
        answer = viewer.reply(number)
        assert answer
        assert answer["error"]["kind"] == "timeout"
        assert not await stands(sim)
        sim.faults.silent = False
        await asyncio.sleep(5)
        assert await stands(sim)


async def test_following_ends_with_the_targets() -> None:
    async with simulate() as sim, desk_of({"arm": Member(sim.url, Magician)}) as (_, join):
        page = await operator(join)
        await page.get("follow", arm="arm", tick=page.tick)
        x = sim.arm.pose.x
        for number in range(30):
            await asyncio.sleep(0.04)
            page.send("target", arm="arm", target=[x, 2.0 * number, sim.arm.pose.z], tick=page.tick)

        assert sim.arm.pose.y > 5
        await asyncio.sleep(PATIENCE + 1)
        assert await stands(sim)
        assert page.last("follow")["why"] == "no beat"
        await page.get("home", arm="arm")  # the arm is free again


async def test_a_following_that_fails_ends_and_the_page_stays() -> None:
    async with simulate() as sim, desk_of({"arm": Member(sim.url, Magician)}) as (_, join):
        page = await operator(join)
        await page.get("follow", arm="arm", tick=page.tick)
        for number in range(40):
            if number == 10:
                sim.arm.raise_alarm(0x51)

            await asyncio.sleep(0.05)
            page.send("target", arm="arm", target=[230.0, 2.0 * number, 20.0], tick=page.tick)

        assert page.last("follow")["state"] == "ended"
        assert "alarm" in page.last("follow")["why"] or "0x51" in page.last("follow")["why"]
        assert "alarm" in {each["error"]["kind"] for each in page.of("reply") if not each["ok"]}
        assert page.last("lease")["mine"] is True
        await page.get("ping")
        await page.get("recover", arm="arm")
        await page.get("move_to", arm="arm", x=220.0, y=0.0, z=40.0)


async def test_a_stop_may_be_said_again_and_again() -> None:
    async with simulate() as sim, desk_of({"arm": Member(sim.url, Magician)}) as (_, join):
        page, viewer = await operator(join), join(Role.VIEWER)
        page.send("move_to", arm="arm", x=200.0, y=150.0, z=40.0)
        await asyncio.sleep(0.3)
        numbers = [viewer.send("stop") for _ in range(5)]
        for number in numbers:
            assert (await viewer.answer(number))["ok"]

        assert await stands(sim)
        assert sum("stops the arm" in each["text"] for each in viewer.of("log")) == 1


async def test_a_page_that_has_much_under_way_can_stop_the_arm() -> None:
    async with simulate(speed=0.2) as sim, desk_of({"arm": Member(sim.url, Magician)}) as (_, join):
        page = await operator(join)
        for number in range(70):
            page.send("move_to", arm="arm", x=200.0, y=150.0 * (-1) ** number, z=40.0)

        await asyncio.sleep(1)
        assert not await stands(sim)
        refused = [each["error"]["kind"] for each in page.of("reply") if not each["ok"]]
        assert set(refused) == {"rate"}
        assert (await page.ask("stop"))["ok"]
        await asyncio.sleep(BRAKES)
        assert await stands(sim)
        assert page.last("queue")["items"] == []
        await asyncio.sleep(5)
        assert await stands(sim)


async def test_stops_without_end_are_bounded_and_leave_others_their_stop() -> None:
    async with simulate() as sim, desk_of({"arm": Member(sim.url, Magician)}) as (_, join):
        page, viewer = await operator(join), join(Role.VIEWER)
        _, press = page.press("y+", speed=5)
        await beats(page, press, 0.5)
        sim.faults.silent = True
        before = len(asyncio.all_tasks())
        for _ in range(190):
            viewer.send("stop")

        await asyncio.sleep(1)
        assert "rate" in {each["error"]["kind"] for each in viewer.of("reply")}
        assert len(asyncio.all_tasks()) - before < 600
        other = join(Role.VIEWER)
        number = other.send("stop")
        await asyncio.sleep(0.1)
        sim.faults.silent = False
        assert (await other.answer(number))["ok"]
        await asyncio.sleep(BRAKES)
        assert await stands(sim)


@pytest.mark.full
async def test_a_bad_line_and_a_page_that_comes_and_goes_leave_no_motion_without_a_hand() -> None:
    """An hour of it, in virtual time, with 2 percent of all messages lost."""
    async with (
        simulate(faults=Faults(loss=0.02), seed=1) as sim,
        desk_of({"arm": Member(sim.url, Magician)}) as (_, join),
    ):
        before = set(asyncio.all_tasks())
        for number in range(120):
            page = await operator(join)
            _, press = page.press("y+" if number % 2 else "y-")
            await beats(page, press, 0.7)
            if number % 3:
                page.send("release", arm="arm", press=press)
                await asyncio.sleep(1)
                assert await stands(sim), number

            await page.session.aclose()
            await asyncio.sleep(1)
            assert await stands(sim), number
            await asyncio.sleep(25)

        assert len(jogs(sim)) > 100
        await asyncio.sleep(5)
        assert len(set(asyncio.all_tasks()) - before) <= 2
