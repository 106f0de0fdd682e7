"""Whatever happens while an arm follows: it stands once the block is left, and what is said is true."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import suppress

import pytest
from follow_rig import BY_NAME, Family, LateLine, Rig, SteppedTask, each_family, now, rig
from virtual import run_virtual, virtual

from dobot_async import ArmAlarm, CommandRejected, ConnectionLost, DobotError, Magician, MotionUnknown
from dobot_async._core.protocol.transport import Transport
from dobot_async.arms.magician import commands as magician
from dobot_async.arms.magician.frame import HEADER
from dobot_async.simulator import Faults, simulate

MOST_WAITS = 400


async def led(r: Rig, seconds: float = 1e9) -> None:
    """Follows a place far away, for a while."""
    async with r.following() as follow:
        ends = now() + seconds
        while now() < ends:
            follow.target = r.beside(y=60)
            await asyncio.sleep(0.05)


async def cancelled_at(family: Family, waits: int, hold: float) -> bool:
    """Cancels a program when it waits for the n-th time; returns whether it had ended before."""
    async with rig(family) as r:
        stepped = SteppedTask(led(r, hold), waits)
        await asyncio.wait([stepped.task])
        ended = stepped.waits < waits
        assert ended or stepped.task.cancelled()
        await r.stands(seconds=1.0)
        assert not r.arm.queue.pending
        if family.name != "ultraarm":  # whose motors may have lost their power
            await r.arm.move_joints(*(joint + 1 for joint in await r.arm.get_joints()))

        return ended


@each_family
def test_cancelled_at_each_wait_the_arm_stands(family: Family) -> None:
    for waits in range(1, MOST_WAITS):
        over: list[bool] = []

        async def once(waits: int = waits, over: list[bool] = over) -> None:
            over.append(await cancelled_at(family, waits, 0.3))

        run_virtual(once())
        if over[0]:
            assert waits > 8
            return

    raise AssertionError("it never ends")


@each_family
@pytest.mark.parametrize("seed", range(3))
@virtual
async def test_an_arm_on_a_bad_line_follows_and_stands(family: Family, seed: int) -> None:
    faults = Faults(latency=0.003)
    async with rig(family, faults=faults) as r:
        faults.loss = faults.dup = 0.05 * (seed + 1) if family.name != "ultraarm" else 0.03
        if family.name == "ultraarm":
            faults.dup = 0.0
        with suppress(DobotError):  # what cannot be known any more is said, and the arm stands all the same
            await led(r, 4.0)
            assert r.place[1] - r.family.centre[1] > 20

        faults.loss = faults.dup = 0.0
        await r.stands(within=1.0)


@each_family
@pytest.mark.parametrize("way", ["silent", "stalled"])
@pytest.mark.parametrize("gone", [0.5, 3.0, 30.0])
@virtual
async def test_an_arm_on_a_line_that_is_gone_stands_when_it_is_back(family: Family, way: str, gone: float) -> None:
    async with rig(family) as r:
        leading = asyncio.ensure_future(led(r))
        await asyncio.sleep(0.5)
        setattr(r.sim.faults, way, True)
        await asyncio.sleep(gone)
        leading.cancel()
        await asyncio.wait([leading], timeout=2.1)
        assert leading.done()
        assert leading.cancelled() or isinstance(leading.exception(), MotionUnknown)
        assert leading.cancelled() == (gone < 5)
        r.sim.faults.silent = r.sim.faults.stalled = False
        await r.stands(within=1.0)


@each_family
@virtual
async def test_a_silent_arm_is_unknown_and_the_error_names_the_target(family: Family) -> None:
    async with rig(family) as r:
        began = now()
        with pytest.raises(MotionUnknown, match=r"no longer answers.*in following \("):
            async with r.following() as follow:
                follow.target = r.beside(y=60)
                await asyncio.sleep(0.2)
                r.sim.faults.silent = True
                while True:
                    follow.target = r.beside(y=60)
                    await asyncio.sleep(0.05)

        assert now() - began < 9
        assert isinstance(follow.motion.exception(), MotionUnknown)
        r.sim.faults.silent = False
        await r.stands(within=1.0)


@each_family
@virtual
async def test_a_link_that_is_lost_ends_it(family: Family) -> None:
    async with rig(family) as r:
        with pytest.raises((ConnectionLost, MotionUnknown)):
            async with r.following() as follow:
                follow.target = r.beside(y=60)
                await asyncio.sleep(0.2)
                await r.arm.link.aclose()
                await asyncio.sleep(0.2)
                with pytest.raises((ConnectionLost, MotionUnknown)):
                    follow.target = r.beside(y=60)

        assert isinstance(follow.motion.exception(), (ConnectionLost, MotionUnknown))


async def alarm(r: Rig) -> None:
    r.sim.arm.raise_alarm(0x22)


async def joint_error(r: Rig) -> None:
    r.sim.arm.raise_error(2, 1)


Harm = Callable[[Rig], Awaitable[None]]


@pytest.mark.parametrize(("name", "harm"), [("magician", alarm), ("mycobot280", joint_error)])
@virtual
async def test_an_alarm_ends_it_and_names_the_target(name: str, harm: Harm) -> None:
    async with rig(BY_NAME[name]) as r:
        with pytest.raises(ArmAlarm, match=r"alarms: .*; in following \(") as raised:
            async with r.following() as follow:
                follow.target = r.beside(y=60)
                await asyncio.sleep(0.4)
                await harm(r)
                while True:
                    follow.target = r.beside(y=60)
                    await asyncio.sleep(0.05)

        assert raised.value.alarms
        await r.stands(within=0.0)


async def power_off(r: Rig) -> None:
    r.sim.arm.power(on=False)


async def release(r: Rig) -> None:
    r.sim.arm.registers.release(r.sim.arm.device.joints)
    r.sim.arm.device.force_stop()
    r.sim.arm.device.clear()
    r.sim.arm.device.start()


async def hold(r: Rig) -> None:
    r.sim.arm.device.begin_aside = r.sim.arm.device.replace = lambda _: False


@pytest.mark.parametrize(("name", "harm"), [("magician", hold), ("mycobot280", power_off), ("ultraarm", release)])
@virtual
async def test_an_arm_that_does_not_follow_is_told(name: str, harm: Harm) -> None:
    """It answers, and goes nowhere: firmware that replaces nothing, or no power."""
    async with rig(BY_NAME[name]) as r:
        with pytest.raises(CommandRejected, match=r"stands at .*; in following \("):
            async with r.following() as follow:
                follow.target = r.beside(y=60)
                await asyncio.sleep(0.2)
                await harm(r)
                while True:
                    follow.target = r.beside(y=60)
                    await asyncio.sleep(0.05)

        await r.stands(within=0.0)


@virtual
async def test_an_alarm_in_a_block_that_looks_at_nothing_is_raised_at_its_end() -> None:
    async with rig(BY_NAME["magician"]) as r:
        with pytest.raises(ArmAlarm):
            async with r.following(stale=10) as follow:
                follow.target = r.beside(y=60)
                await asyncio.sleep(0.2)
                r.sim.arm.raise_alarm(0x22)
                await asyncio.sleep(1.0)
                assert follow.motion.done
                assert not r.moving


@virtual
async def test_an_arm_that_was_switched_off_follows_no_further() -> None:
    async with rig(BY_NAME["magician"]) as r:
        with pytest.raises(MotionUnknown, match="switched off"):
            async with r.following() as follow:
                follow.target = r.beside(y=60)
                await asyncio.sleep(2.0)
                r.sim.arm.power_cycle()
                while True:
                    follow.target = r.beside(y=60)
                    await asyncio.sleep(0.05)


@virtual
async def test_a_setpoint_that_the_stop_has_overtaken_is_stopped_too() -> None:
    """On a line of datagrams the last setpoint may arrive when the arm has been stopped already."""
    from dobot_async.arms import session
    from dobot_async.transports import open_transport

    lines: list[LateLine] = []

    async def opened(url: str, *, arm: str) -> Transport:
        lines.append(LateLine(await open_transport(url, arm=arm), 0.1))
        return lines[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(session, "open_transport", opened)
        family = BY_NAME["magician"]
        async with simulate("magician", homed=True) as sim, Magician.connect(sim.url) as arm:
            sim.arm.device.place(family.joints)
            r = Rig(family, sim, arm)
            await arm.set_speed(5)
            goes = bytes((*HEADER, 19, magician.SET_PTP_CMD.id))
            late = asyncio.Event()

            def held_back(data: bytes) -> float:
                if not data.startswith(goes):
                    return 0.0

                late.set()
                return 0.08

            with suppress(ZeroDivisionError):
                async with r.following(max_speed=5000) as follow:
                    follow.target = r.beside(y=60)
                    await asyncio.sleep(0.2)
                    lines[0].late = held_back
                    follow.target = r.beside(y=-60)
                    await late.wait()
                    raise ZeroDivisionError

            await r.stands()
