"""What the ultraArm's driver promises on a bad line, case by case, on a virtual clock."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from typing import Any

import pytest
from ultraarm_line import Spoil, once, rig
from virtual import run_virtual, virtual

from dobot_async import ArmAlarm, MotionUnknown, ReplyTimeout, UltraArm
from dobot_async.arms.ultraarm import commands as c
from dobot_async.simulator import DeviceOptions, Faults, Simulation, UltraArmQuirks, simulate

pytestmark = pytest.mark.cases(3)

FAST: dict[str, Any] = {"speed": 20}
OUTCOMES = ["size", "ok", "nothing"]


def targets(sim: Simulation) -> list[float]:
    """The x of the G0 that the arm has executed."""
    return [each.value.x for each in sim.arm.executed if each.command is c.MOVE_COORDS]


def lose(_: bytes) -> list[tuple[float, bytes]]:
    return []


def late(seconds: float) -> Spoil:
    return lambda data: [(seconds, data)]


def twice(data: bytes) -> list[tuple[float, bytes]]:
    return [(0, data), (0.001, data)]


def in_pieces(data: bytes) -> list[tuple[float, bytes]]:
    return [(place / 1000, data[place : place + 1]) for place in range(len(data))]


def without_command(data: bytes) -> list[tuple[float, bytes]]:
    """The command's own line is lost, and what closes its answer is not."""
    return [(0, data[data.index(b"\r") + 1 :])]


@pytest.mark.parametrize("spoil", [lose, without_command], ids=lambda each: each.__name__)
@pytest.mark.parametrize("busy", [0, 5])
@pytest.mark.parametrize("acknowledge", ["size", "ok"])
def test_a_lost_command_is_sent_again(
    spoil: Spoil, busy: int, acknowledge: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def run() -> None:
        sim_options = {**FAST, "quirks": UltraArmQuirks(acknowledge=acknowledge)}
        async with rig(monkeypatch, sim=sim_options) as (sim, arm, line):
            await arm.move_to(205, 0, 40)
            for step in range(busy):
                await arm.queue.move_to(206 + step, 50 * (-1) ** step, 40)

            line.request = once(b"X220", spoil)
            await arm.move_to(220, 0, 40)
            assert targets(sim) == [205, *(206 + step for step in range(busy)), 220]

    run_virtual(run())


SPOILT: dict[str, Spoil] = {
    "lost": lose,
    "a little late": late(0.3),
    "late": late(1.8),
    "very late": late(2.9),
    "twice": twice,
    "in pieces": in_pieces,
}


@pytest.mark.parametrize("spoil", SPOILT.values(), ids=SPOILT)
@pytest.mark.parametrize("busy", [0, 5])
@pytest.mark.parametrize("acknowledge", OUTCOMES)
def test_a_spoilt_answer_moves_nothing_twice(
    spoil: Spoil, busy: int, acknowledge: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def run() -> None:
        sim_options = {**FAST, "quirks": UltraArmQuirks(acknowledge=acknowledge)}
        async with rig(monkeypatch, sim=sim_options) as (sim, arm, line):
            await arm.move_to(205, 0, 40)
            for step in range(busy):
                await arm.queue.move_to(206 + step, 50 * (-1) ** step, 40)

            def armed(data: bytes) -> list[tuple[float, bytes]]:
                if b"X220" in data:
                    line.reply = once(b"COORDS", spoil)

                return [(0, data)]

            line.request = armed
            await arm.move_to(220, 0, 40)
            assert targets(sim) == [205, *(206 + step for step in range(busy)), 220]
            await arm.move_to(230, 0, 40)
            assert targets(sim)[-1] == 230
            assert len(targets(sim)) == busy + 3

    run_virtual(run())


@pytest.mark.parametrize("spoil", [lose, without_command], ids=lambda each: each.__name__)
@pytest.mark.parametrize("acknowledge", ["size", "ok"])
def test_an_increment_that_is_lost_is_sent_again_and_done_once(
    spoil: Spoil, acknowledge: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It goes over the line as a place, which does no harm twice."""

    async def run() -> None:
        sim_options = {**FAST, "quirks": UltraArmQuirks(acknowledge=acknowledge)}
        async with rig(monkeypatch, sim=sim_options) as (sim, arm, line):
            await arm.move_to(205, 0, 40)
            line.request = once(b"Z45", spoil)
            await arm.move_by(z=5)
            assert abs(sim.arm.pose.z - 45) < 0.01
            assert [each.value.z for each in sim.arm.executed if each.name == "G0"] == [40, 45]

    run_virtual(run())


@pytest.mark.parametrize("spoil", [lose, late(0.3), late(1.8)], ids=["lost", "a little late", "late"])
def test_an_increment_whose_answer_is_spoilt_is_done_once(spoil: Spoil, monkeypatch: pytest.MonkeyPatch) -> None:
    async def run() -> None:
        async with rig(monkeypatch, sim=FAST) as (sim, arm, line):
            await arm.move_to(205, 0, 40)

            def armed(data: bytes) -> list[tuple[float, bytes]]:
                if b"Z45" in data:
                    line.reply = once(b"COORDS", spoil)

                return [(0, data)]

            line.request = armed
            for _ in range(2):
                await arm.move_by(z=5)

            assert abs(sim.arm.pose.z - 50) < 0.01
            assert [each.value.z for each in sim.arm.executed if each.name == "G0"] == [40, 45, 50]

    run_virtual(run())


@pytest.mark.parametrize("seconds", [0.05, 0.3, 1.4, 2.5])
def test_a_late_answer_never_answers_a_later_call(seconds: float, monkeypatch: pytest.MonkeyPatch) -> None:
    async def run() -> None:
        async with rig(monkeypatch, sim=FAST) as (sim, arm, line):
            line.reply = once(b"ANGLES", late(seconds))
            loop = asyncio.get_running_loop()
            started = loop.time()
            asking = asyncio.create_task(arm.get_angles())
            await asyncio.sleep(0.01)
            asking.cancel()
            await asyncio.wait([asking])
            sim.arm.guide_to(30, 10, 20, 0)
            right = 0
            while loop.time() < started + seconds + 1.5:
                with suppress(ReplyTimeout):
                    assert (await arm.get_angles()).j1 == 30
                    right += 1

                await asyncio.sleep(0.01)

            assert right

    run_virtual(run())


@pytest.mark.parametrize("seconds", [1.6, 2.0, 2.9])
def test_the_late_answer_to_a_command_acknowledges_no_other(seconds: float, monkeypatch: pytest.MonkeyPatch) -> None:
    async def run() -> None:
        async with rig(monkeypatch, sim=FAST) as (sim, arm, line):
            await arm.move_to(205, 0, 40)
            line.reply = once(b"COORDS", late(seconds))
            await arm.queue.suction(True)
            line.request = once(b"X220", lose)
            await arm.move_to(220, 0, 40)
            assert targets(sim) == [205, 220]

    run_virtual(run())


@virtual
async def test_what_the_last_motion_missed_is_told_by_silent_firmware_too() -> None:
    """Nothing acknowledges, and the motion is lost with its line alone: only where the arm stands tells."""
    quirks = UltraArmQuirks(acknowledge="nothing")
    with pytest.MonkeyPatch.context() as patch:
        async with rig(patch, sim={**FAST, "quirks": quirks}) as (sim, arm, line):
            await arm.move_to(205, 0, 40)
            line.request = once(b"X220", without_command)
            with pytest.raises(ArmAlarm, match="came to rest"):
                await arm.move_to(220, 0, 40)

            assert targets(sim) == [205]


@virtual
async def test_an_error_that_comes_late_fails_what_is_pending() -> None:
    with pytest.MonkeyPatch.context() as patch:
        async with rig(patch) as (_, arm, line):
            motion = await arm.queue.move_to(205, 0, 40, speed=10)
            line.reply = once(b"Moving", lambda data: [(0, b"ERROR: J2 lost\r\n" + data)])
            with pytest.raises(ArmAlarm, match="J2 lost"):
                await motion


@virtual
async def test_a_command_that_is_cancelled_while_it_is_sent_is_settled_by_the_next() -> None:
    with pytest.MonkeyPatch.context() as patch:
        async with rig(patch, sim=FAST) as (sim, arm, line):
            await arm.move_to(205, 0, 40)
            line.reply = once(b"COORDS", late(1.0))
            sent = asyncio.Event()

            def notice(data: bytes) -> list[tuple[float, bytes]]:
                if b"X220" in data:
                    sent.set()

                return [(0, data)]

            line.request = notice
            putting = asyncio.ensure_future(arm.queue.put(c.MOVE_COORDS, c.CoordsMove(220, 0, 40)))
            await sent.wait()
            putting.cancel()
            await asyncio.wait([putting])
            await arm.move_to(230, 0, 40)
            assert targets(sim) == [205, 220, 230]


@pytest.mark.cases(1)
@pytest.mark.parametrize("acknowledge", ["size", "ok"])
@pytest.mark.parametrize("seed", range(8))
def test_many_moves_on_a_terrible_line(seed: int, acknowledge: Any) -> None:
    """Whole messages are lost, split, merged and held back; none of them is changed, for a line has no checksum."""

    async def run() -> None:
        faults = Faults(loss=0.05, split=0.1, merge=0.1, stall=0.01, stall_time=0.3, latency=0.003)
        options = DeviceOptions(20, False, 1, 0, power_up_alarms=frozenset())
        quirks = UltraArmQuirks(acknowledge=acknowledge)
        async with (
            simulate("ultraarm", homed=True, faults=faults, seed=seed, speed=20, options=options, quirks=quirks) as sim,
            UltraArm.connect(sim.url, timeout=30) as arm,
        ):
            wanted = [180 + step / 4 for step in range(150)]
            for step, x in enumerate(wanted):
                await arm.queue.move_to(x, 30 * (-1) ** step, 40, speed=200)

            await arm.queue.join()
            assert targets(sim) == wanted

    run_virtual(run())


@virtual
async def test_a_link_that_is_reopened_goes_on() -> None:
    async with simulate("ultraarm", homed=True, speed=5) as sim, UltraArm.connect(sim.url, reconnect=True) as arm:
        motions = [await arm.queue.move_to(200 + 10 * step, 0, 40) for step in range(4)]
        sim.unplug()
        for motion in motions:
            await motion

        await arm.move_to(250, 0, 40)
        assert targets(sim) == [200, 210, 220, 230, 250]


@virtual
async def test_an_arm_that_was_switched_off_meanwhile_is_noticed() -> None:
    async with simulate("ultraarm", homed=True) as sim, UltraArm.connect(sim.url, reconnect=True) as arm:
        motions = [await arm.queue.move_to(200 + 10 * step, 0, 40, speed=10) for step in range(4)]
        await asyncio.sleep(0.5)
        sim.arm.power_cycle()
        sim.unplug()
        for motion in motions:
            with pytest.raises(ArmAlarm, match="came to rest"):
                await motion


@pytest.mark.parametrize("verb", ["home", "wait"])
def test_what_no_place_tells_of_is_unknown_after_an_outage(verb: str) -> None:
    async def run() -> None:
        async with (
            simulate("ultraarm", homed=True) as sim,
            UltraArm.connect(sim.url, reconnect=True, home_switches=None) as arm,
        ):
            motion = await (arm.queue.home() if verb == "home" else arm.queue.wait(3))
            await asyncio.sleep(0.5)
            sim.arm.power_cycle()
            sim.unplug()
            with pytest.raises(MotionUnknown, match="switched off"):
                await motion

    run_virtual(run())


@virtual
async def test_a_vanished_arm_ends_everything_in_time() -> None:
    with pytest.MonkeyPatch.context() as patch:
        async with rig(patch, on_error="leave") as (_, arm, line):
            motion = await arm.queue.move_to(205, 0, 40)
            line.request = lose
            loop = asyncio.get_running_loop()
            before = loop.time()
            with pytest.raises(MotionUnknown, match="no longer answers"):
                await motion

            assert loop.time() - before < 8
