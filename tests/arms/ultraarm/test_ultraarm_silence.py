"""What becomes of an ultraArm's calls, and of the arm, when the line falls silent or stands still for any time."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager
from typing import Any

import pytest
from ultraarm_line import rig
from virtual import run_virtual, virtual

from dobot_async import (
    CommandRejected,
    ConnectionLost,
    DobotError,
    MotionStopped,
    MotionUnknown,
    ReplyTimeout,
    UltraArm,
    UltraArmJog,
)
from dobot_async.arms.ultraarm import commands as c
from dobot_async.simulator import Faults, Simulation, UltraArmQuirks, simulate

pytestmark = pytest.mark.cases(3)

SILENCES = [1.0, 10.0, 60.0, 300.0]
Call = Callable[[UltraArm], Coroutine[Any, Any, object]]


@asynccontextmanager
async def dead_line(**options: Any) -> AsyncIterator[tuple[Simulation, UltraArm, Faults]]:
    """An arm, and its faults: `silent` loses all, `stalled` keeps it back."""
    faults = Faults()
    async with simulate("ultraarm", homed=True, faults=faults) as sim, UltraArm.connect(sim.url, **options) as arm:
        yield sim, arm, faults


async def jogging(arm: UltraArm) -> None:
    async with arm.jogging(UltraArmJog.Z_MINUS, speed=10):
        await asyncio.sleep(1000)


async def program(arm: UltraArm) -> None:
    await arm.run_gcode([f"G0 X{200 + step} Y0 Z40 F10" for step in range(20)])


async def batch(arm: UltraArm) -> None:
    async with arm.queue.batch() as found:
        motions = [found.move_to(200 + step, 0, 40, speed=10) for step in range(20)]

    await motions[-1]


async def put_and_wait(arm: UltraArm) -> None:
    await (await arm.queue.move_to(200, 0, 40, speed=10))


CALLS: dict[str, Call] = {
    "move": lambda arm: arm.move_to(150, 100, 40, speed=10),
    "home": lambda arm: arm.home(),
    "setting": lambda arm: arm.suction(True),
    "put": put_and_wait,
    "batch": batch,
    "jog": lambda arm: arm.jog(UltraArmJog.X_MINUS, 100, speed=10),
    "jogging": jogging,
    "program": program,
    "stop": lambda arm: arm.stop(),
    "jog_stop": lambda arm: arm.jog_stop(),
    "read": lambda arm: arm.get_coords(timeout=100),
}


def calls(*quick: str) -> pytest.MarkDecorator:
    """Every call on a line that is dead, and on one that dies meanwhile; the quick ones are over by then."""
    cases = [(each, before) for each in CALLS for before in (0.0, 0.5) if before == 0.0 or each not in quick]
    return pytest.mark.parametrize(("name", "before"), cases, ids=lambda each: str(each))


@calls("setting", "stop", "jog_stop", "read")
def test_a_cancellation_comes_out_as_itself_and_soon(name: str, before: float) -> None:
    async def run() -> None:
        async with dead_line(on_error="leave") as (_, arm, faults):
            faults.silent = not before
            called = asyncio.ensure_future(CALLS[name](arm))
            await asyncio.sleep(before)
            faults.silent = True
            await asyncio.sleep(0.5)
            called.cancel()
            loop = asyncio.get_running_loop()
            cancelled_at = loop.time()
            with pytest.raises(asyncio.CancelledError):
                await called

            assert loop.time() <= cancelled_at + 2.0

    run_virtual(run())


@calls("setting", "stop", "jog_stop", "read")
def test_a_timeout_of_the_caller_comes_out_as_itself_and_soon(name: str, before: float) -> None:
    async def run() -> None:
        async with dead_line(on_error="leave") as (_, arm, faults):
            faults.silent = not before
            loop = asyncio.get_running_loop()
            loop.call_later(before, setattr, faults, "silent", True)
            deadline = loop.time() + 1.0
            with pytest.raises(TimeoutError) as caught:
                async with asyncio.timeout_at(deadline):
                    await CALLS[name](arm)

            assert not isinstance(caught.value, DobotError)
            assert loop.time() <= deadline + 2.0

    run_virtual(run())


@calls()
def test_who_leaves_the_block_leaves_it_soon(name: str, before: float) -> None:
    """With what it was left by, and whatever is going on."""

    async def run() -> None:
        loop = asyncio.get_running_loop()
        left_at = 0.0
        with pytest.raises(RuntimeError, match="mine"):
            async with dead_line() as (_, arm, faults):
                faults.silent = not before
                called = asyncio.ensure_future(CALLS[name](arm))
                await asyncio.sleep(before)
                faults.silent = True
                await asyncio.sleep(0.5)
                left_at = loop.time()
                raise RuntimeError("mine")

        assert loop.time() <= left_at + 2.0
        called.cancel()
        await asyncio.wait([called])
        if not called.cancelled():
            assert isinstance(called.exception(), DobotError | None)

    run_virtual(run())


@pytest.mark.parametrize("silence", SILENCES)
@pytest.mark.parametrize("firmware", [UltraArmQuirks(), UltraArmQuirks(jog_stop="all", acknowledge="ok")], ids=str)
@pytest.mark.parametrize("call", ["move", "jogging", "program", "stop"])
@pytest.mark.parametrize("fault", ["silent", "stalled"])
def test_once_the_line_is_back_the_arm_stands_within_a_second(
    fault: str, call: str, firmware: UltraArmQuirks, silence: float
) -> None:
    """Whoever was to stop it has long gone, or is still waiting."""

    async def run() -> None:
        faults = Faults(latency=0.01)
        async with (
            simulate("ultraarm", homed=True, faults=faults, quirks=firmware) as sim,
            UltraArm.connect(sim.url, on_error="leave") as arm,
        ):
            if call == "stop":
                for step in range(12):  # they take longer than the silence
                    await arm.queue.move_to(150, 200 * (-1) ** step, 40, speed=max(1, 200 / silence))

            called = asyncio.ensure_future(CALLS[call](arm))
            await asyncio.sleep(0.0 if call == "stop" else 0.5)
            setattr(faults, fault, True)
            await asyncio.sleep(0.1)
            if call != "stop":
                called.cancel()

            await asyncio.sleep(silence)
            setattr(faults, fault, False)
            await asyncio.sleep(1.0)
            assert not sim.arm.device.moving
            assert not sim.arm.queue_size
            await asyncio.wait([called])
            await arm.stop()
            before = asyncio.get_running_loop().time()
            await arm.get_coords()
            assert asyncio.get_running_loop().time() - before < 0.1
            assert len(arm.link._correlator) == 0

    run_virtual(run())


@pytest.mark.parametrize("silence", [0.3, 1.2])
def test_a_block_left_on_a_silent_line_stops_arm_and_laser_when_it_is_back_in_time(silence: float) -> None:
    async def run() -> None:
        faults = Faults()
        async with simulate("ultraarm", homed=True, faults=faults) as sim:
            with pytest.raises(RuntimeError):
                async with UltraArm.connect(sim.url) as arm:
                    await arm.laser(True)
                    await arm.pwm(200)
                    await arm.queue.move_to(150, 150, 40, speed=10)
                    faults.silent = True
                    asyncio.get_running_loop().call_later(silence, setattr, faults, "silent", False)
                    raise RuntimeError

            assert not sim.arm.device.moving
            assert (sim.arm.registers.laser, sim.arm.registers.pwm) == (False, 0)

    run_virtual(run())


@virtual
async def test_an_arm_that_is_told_to_stop_again_and_again_but_goes_on() -> None:
    quirks = UltraArmQuirks(release="queued")
    async with simulate("ultraarm", homed=True, quirks=quirks) as sim, UltraArm.connect(sim.url) as arm:
        for step in range(12):
            await arm.queue.move_to(150, 100 * (-1) ** step, 40, speed=10)

        await asyncio.sleep(0.5)
        loop = asyncio.get_running_loop()
        before = loop.time()
        with pytest.raises(CommandRejected, match="switch it off"):
            await arm.stop()

        assert loop.time() - before < 3
        assert sim.arm.device.moving


@virtual
async def test_silence_ends_motions_as_unknown_and_stops_the_arm_when_it_is_over() -> None:
    async with dead_line() as (sim, arm, faults):
        motions = [await arm.queue.move_to(150, 150 * (-1) ** step, 40, speed=2) for step in range(3)]
        await asyncio.sleep(0.5)
        faults.silent = True
        loop = asyncio.get_running_loop()
        before = loop.time()
        for motion in motions:
            with pytest.raises(MotionUnknown, match="no longer answers"):
                await motion

        assert loop.time() - before < 6
        assert arm.link.open
        with pytest.raises(ReplyTimeout):
            await arm.get_coords()

        await asyncio.sleep(30)
        assert sim.arm.device.moving
        faults.silent = False
        await asyncio.sleep(1)
        assert not sim.arm.device.moving
        await arm.power_on()
        await arm.home()
        await arm.move_to(200, 0, 40)


@pytest.mark.parametrize("stall", [1.0, 4.0, 30.0])
@pytest.mark.parametrize("acknowledge", ["size", "ok"])
def test_a_line_that_stands_still_moves_nothing_twice(stall: float, acknowledge: Any) -> None:
    """All that is said meanwhile arrives, late and at once."""

    async def run() -> None:
        sim_options = {"speed": 20, "quirks": UltraArmQuirks(acknowledge=acknowledge)}
        with pytest.MonkeyPatch.context() as patch:
            async with rig(patch, sim=sim_options) as (sim, arm, line):
                await arm.move_to(205, 0, 40)
                loop = asyncio.get_running_loop()
                until = loop.time() + stall
                line.reply = lambda data: [(max(0.0, until - loop.time()), data)]
                moving = asyncio.ensure_future(arm.move_to(220, 50, 40))
                await asyncio.wait([moving])
                known = moving.exception()
                await asyncio.sleep(max(0.0, until - loop.time()) + 1)
                assert not sim.arm.device.moving
                targets = [each.value.x for each in sim.arm.executed if each.command is c.MOVE_COORDS]
                assert targets.count(220) <= 1
                if known is None:
                    assert targets == [205, 220]
                else:
                    assert isinstance(known, (MotionUnknown, ReplyTimeout))

                await arm.stop()
                await arm.power_on()
                await arm.home()
                await arm.move_to(230, 0, 40)

    run_virtual(run())


@virtual
async def test_a_stop_ends_with_its_connection() -> None:
    async with dead_line() as (sim, arm, faults):
        await arm.queue.move_to(150, 150, 40, speed=10)
        faults.silent = True
        stopping = asyncio.ensure_future(arm.stop())
        await asyncio.sleep(1)
        sim.unplug()
        with pytest.raises(ConnectionLost):
            await stopping


@virtual
async def test_a_program_whose_progress_fails_stops_the_arm() -> None:
    def progress(_done: int, _of: int) -> None:
        raise RuntimeError

    async with simulate("ultraarm", homed=True) as sim, UltraArm.connect(sim.url) as arm:
        with pytest.raises(RuntimeError):
            await arm.run_gcode([f"G0 X{200 + step} Y0 Z40 F10" for step in range(5)], progress=progress)

        assert not sim.arm.device.moving
        assert not sim.arm.queue_size


@virtual
async def test_a_jog_beside_a_queued_motion_does_not_end_it() -> None:
    async with simulate("ultraarm", homed=True) as sim, UltraArm.connect(sim.url) as arm:
        motion = await arm.queue.move_to(200, 0, 40, speed=20)
        await arm.jog_stop()
        assert sim.arm.registers.powered
        await motion


@virtual
async def test_a_batch_that_is_left_sends_nothing() -> None:
    async with simulate("ultraarm", homed=True) as sim, UltraArm.connect(sim.url) as arm:
        with pytest.raises(RuntimeError):
            async with arm.queue.batch() as found:
                motion = found.move_to(200, 0, 40)
                raise RuntimeError

        with pytest.raises(MotionStopped):
            await motion

        assert sim.arm.executed == []


@virtual
async def test_a_cancellation_while_a_jog_ends_comes_out_soon() -> None:
    async with dead_line(on_error="leave") as (_, arm, faults):
        jogged = asyncio.ensure_future(arm.jog(UltraArmJog.Z_MINUS, 0.5, speed=10))
        await asyncio.sleep(0.4)
        faults.silent = True
        await asyncio.sleep(0.6)
        loop = asyncio.get_running_loop()
        cancelled_at = loop.time()
        jogged.cancel()
        with pytest.raises(asyncio.CancelledError):
            await jogged

        assert loop.time() <= cancelled_at + 2.0
