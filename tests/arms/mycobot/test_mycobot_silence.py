"""An arm that does not answer on an open line: what stops, what is said, and what a cancellation still is."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from itertools import count, product
from typing import Any

import pytest
from bad_line import BadLine, bad_lines
from virtual import virtual

from dobot_async._core.queue.motion import Motion
from dobot_async.arms.mycobot import commands as c
from dobot_async.arms.mycobot.arm import MyCobot
from dobot_async.errors import ConnectFailed, DobotError, MotionStopped, MotionUnknown, ReplyTimeout
from dobot_async.simulator import MyCobotQuirks, Simulation, simulate

NEW, OLD = MyCobotQuirks(), MyCobotQuirks(acknowledges=False, later=False)
Act = Callable[[MyCobot], Awaitable[Any]]
firmwares = pytest.mark.parametrize("quirks", [NEW, OLD], ids=["new firmware", "old firmware"])
silences = pytest.mark.parametrize(("how", "seconds"), [*product(("silent", "stalled"), (7.0, 30.0, 300.0))])


@asynccontextmanager
async def slow_arm(quirks: MyCobotQuirks) -> AsyncIterator[tuple[Simulation, MyCobot]]:
    """An arm whose motions take half an hour."""
    async with simulate("mycobot280", quirks=quirks, speed=0.1) as sim, MyCobot.connect(sim.url, timeout=60) as arm:
        sim.arm.place(-160, 0, 0, 0, 0, 0)
        yield sim, arm


def dead(sim: Simulation, how: str = "silent") -> None:
    """Nothing arrives from now on."""
    setattr(sim.faults, how, True)


def back(sim: Simulation) -> None:
    """The line is as it was; one that stood still delivers everything now."""
    sim.faults.silent = sim.faults.stalled = False


async def stands_after(sim: Simulation) -> None:
    """The line is back: the arm stands within a second, and goes on standing."""
    assert sim.arm.moving
    back(sim)
    await asyncio.sleep(1)
    joints = sim.arm.joints
    await asyncio.sleep(20)
    assert sim.arm.joints == joints
    assert not sim.arm.moving


async def moved(arm: MyCobot) -> Motion:
    """A motion that goes on."""
    motion = await arm.queue.move_joint(1, 160, speed=1)
    await asyncio.sleep(0.5)
    return motion


@firmwares
@silences
@virtual
async def test_a_motion_that_nobody_awaits_is_stopped_when_the_line_is_back(
    how: str, seconds: float, quirks: MyCobotQuirks
) -> None:
    async with slow_arm(quirks) as (sim, arm):
        motion = await moved(arm)
        dead(sim, how)
        await asyncio.sleep(seconds)
        await stands_after(sim)
        with pytest.raises(MotionUnknown, match="no longer answers"):
            await motion

        await arm.move_joint(1, sim.arm.joints[0] + 1)


@firmwares
@virtual
async def test_a_line_that_stands_still_for_less_ends_no_motion(quirks: MyCobotQuirks) -> None:
    async with slow_arm(quirks) as (sim, arm):
        motion = await moved(arm)
        dead(sim)
        with pytest.raises(ReplyTimeout):
            await motion.wait(3)

        back(sim)
        with pytest.raises(ReplyTimeout):
            await motion.wait(20)

        assert sim.arm.moving


async def stop(arm: MyCobot) -> None:
    await arm.stop(timeout=0.5)


async def cancel(arm: MyCobot) -> None:
    async with asyncio.timeout(0.5):
        await arm.move_joint(2, 20)


async def clear(arm: MyCobot) -> None:
    await arm.queue.clear(timeout=0.5)


@firmwares
@silences
@pytest.mark.parametrize("act", [stop, cancel, clear])
@virtual
async def test_a_stop_that_was_not_heard_is_repeated_until_it_is(
    act: Act, how: str, seconds: float, quirks: MyCobotQuirks
) -> None:
    async with slow_arm(quirks) as (sim, arm):
        motion = await moved(arm)
        dead(sim, how)
        with pytest.raises(TimeoutError):
            await act(arm)

        with pytest.raises(MotionStopped):
            await motion

        await asyncio.sleep(seconds)
        await stands_after(sim)
        await arm.move_joint(1, sim.arm.joints[0] + 1)


@firmwares
@silences
@virtual
async def test_a_jog_whose_end_was_not_heard_ends_when_the_line_is_back(
    how: str, seconds: float, quirks: MyCobotQuirks
) -> None:
    async with slow_arm(quirks) as (sim, arm):
        with pytest.raises(ReplyTimeout):
            async with arm.jogging("j1+", speed=1):
                await asyncio.sleep(1)
                dead(sim, how)

        await asyncio.sleep(seconds)
        await stands_after(sim)


@virtual
async def test_a_paused_arm_is_let_go_of_when_the_line_is_back() -> None:
    async with slow_arm(NEW) as (sim, arm):
        sim.arm._end_all = lambda: (sim.arm.device.force_stop(), sim.arm.device.clear(), sim.arm.device.start())
        await moved(arm)
        await arm.pause()
        dead(sim)
        with pytest.raises(ReplyTimeout):
            await arm.stop()

        await asyncio.sleep(60)
        back(sim)
        await arm.move_joint(1, sim.arm.joints[0] + 1)
        assert not await arm.is_paused()


async def queued_gripper(arm: MyCobot) -> None:
    await (await arm.queue.gripper(True))


async def queued_color(arm: MyCobot) -> None:
    await (await arm.queue.color(1, 2, 3))


@firmwares
@pytest.mark.parametrize("act", [queued_gripper, queued_color, lambda arm: arm.gripper(True)])
@virtual
async def test_nothing_is_done_on_a_dead_line(act: Act, quirks: MyCobotQuirks) -> None:
    async with simulate("mycobot280", quirks=quirks) as sim, MyCobot.connect(sim.url) as arm:
        dead(sim)
        with pytest.raises((MotionUnknown, ReplyTimeout)):
            await act(arm)

        back(sim)


@firmwares
@virtual
async def test_a_gripper_of_which_nothing_more_is_heard_is_not_done(quirks: MyCobotQuirks) -> None:
    async with simulate("mycobot280", quirks=quirks) as sim, MyCobot.connect(sim.url) as arm:
        await arm.gripper(False)
        await asyncio.sleep(5)
        motion = await arm.queue.gripper(True, speed=10)
        await asyncio.sleep(2)
        dead(sim)
        with pytest.raises(MotionUnknown):
            await motion

        back(sim)


@virtual
async def test_a_gripper_that_never_rests_is_not_done() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        sim.arm.gripper = type("Stuck", (), {"moving": True, "value": 50, "told": 50, "go": lambda *_: None})()
        with pytest.raises(MotionUnknown, match="gripper"):
            await (await arm.queue.gripper(True, speed=100))


CALLS: dict[str, Act] = {
    "move_joint": lambda arm: arm.move_joint(1, 20),
    "move_to": lambda arm: arm.move_to(150, 0, 200, 0, 0, 0),
    "step_joint": lambda arm: arm.step_joint(1, 5),
    "wait": lambda arm: arm.wait(100),
    "gripper": lambda arm: arm.gripper(True),
    "jog": lambda arm: arm.jog("j1+", 100),
    "stop": lambda arm: arm.stop(timeout=100),
    "clear": lambda arm: arm.queue.clear(timeout=100),
    "pause": lambda arm: arm.pause(),
    "resume": lambda arm: arm.resume(),
    "recover": lambda arm: arm.recover(),
    "clear_alarms": lambda arm: arm.clear_alarms(timeout=100),
    "power_on": lambda arm: arm.power_on(timeout=100),
    "color": lambda arm: arm.color(1, 2, 3, timeout=100),
    "set_tool": lambda arm: arm.set_tool(0, 0, 0, 0, 0, 0, timeout=100),
    "get_pose": lambda arm: arm.get_pose(timeout=100),
    "get_info": lambda arm: arm.get_info(timeout=100),
    "get_alarms": lambda arm: arm.get_alarms(timeout=100),
    "get_gripper": lambda arm: arm.get_gripper(kind=c.GripperType.ADAPTIVE, timeout=100),
    "join": lambda arm: arm.queue.join(),
    "put": lambda arm: queued_gripper(arm),
}
DELAYS = (0.0, 0.01, 0.03, 0.2, 0.7)


@firmwares
@pytest.mark.parametrize("name", CALLS)
@virtual
async def test_a_cancelled_call_ends_as_that_soon_on_a_dead_line(name: str, quirks: MyCobotQuirks) -> None:
    loop = asyncio.get_running_loop()
    for delay in DELAYS:
        async with simulate("mycobot280", quirks=quirks) as sim:
            with pytest.raises(RuntimeError, match="mine"):
                async with MyCobot.connect(sim.url) as arm:
                    if name != "jog":  # it is refused while motions are under way
                        await arm.queue.move_joint(1, 160, speed=1)

                    await asyncio.sleep(0.3)
                    dead(sim)
                    call = asyncio.create_task(anything(CALLS[name](arm)))
                    await asyncio.sleep(delay)
                    call.cancel()
                    at = loop.time()
                    with pytest.raises(asyncio.CancelledError):
                        await call

                    assert loop.time() - at < 2
                    at = loop.time()
                    raise RuntimeError("mine")

            assert loop.time() - at < 2.1


async def anything(call: Awaitable[Any]) -> Any:
    return await call


@firmwares
@pytest.mark.parametrize("name", sorted(CALLS.keys() - {"clear", "join"}))  # they have nothing to do
@virtual
async def test_a_call_that_is_cancelled_late_ends_as_that(name: str, quirks: MyCobotQuirks) -> None:
    """After seconds, some calls have given up already; the others are cancelled, and nothing else."""
    async with simulate("mycobot280", quirks=quirks) as sim, MyCobot.connect(sim.url) as arm:
        dead(sim)
        begun = asyncio.get_running_loop().time()
        limit = asyncio.timeout(2.5)
        with pytest.raises((TimeoutError, DobotError)) as caught:
            async with limit:
                await CALLS[name](arm)

        assert asyncio.get_running_loop().time() - begun < 4.5
        assert not limit.expired() or type(caught.value) is TimeoutError
        back(sim)
        await asyncio.sleep(1)


@pytest.mark.parametrize("error", [KeyboardInterrupt, asyncio.CancelledError, RuntimeError])
@virtual
async def test_what_leaves_the_block_comes_out_of_it_on_a_dead_line(error: type[BaseException]) -> None:
    loop = asyncio.get_running_loop()
    async with simulate("mycobot280") as sim:
        with pytest.raises(error):
            async with MyCobot.connect(sim.url) as arm:
                await moved(arm)
                dead(sim)
                at = loop.time()
                raise error

        assert loop.time() - at < 2.1


@virtual
async def test_an_arm_that_falls_silent_while_it_is_greeted_is_no_hang() -> None:
    loop = asyncio.get_running_loop()
    async with simulate("mycobot280") as sim:
        for silent_at in (0.0, 0.03, 0.05, 0.09, 0.13, 0.2):
            back(sim)
            at = loop.time()
            connecting = asyncio.create_task(connect(sim))
            await asyncio.sleep(silent_at)
            dead(sim)
            with pytest.raises(ConnectFailed):
                await connecting

            assert loop.time() - at < 5


async def connect(sim: Simulation) -> None:
    async with MyCobot.connect(sim.url, timeout=2):
        await asyncio.sleep(0.5)
        raise ConnectFailed("it was there before it fell silent")


@pytest.fixture
def lines(monkeypatch: pytest.MonkeyPatch) -> list[BadLine]:
    return bad_lines(monkeypatch)


@firmwares
@virtual
async def test_one_look_at_an_arm_that_stands_is_not_believed(lines: list[BadLine], quirks: MyCobotQuirks) -> None:
    async with simulate("mycobot280", quirks=quirks) as sim, MyCobot.connect(sim.url) as arm:
        await moved(arm)
        told: list[bytes] = []

        def spoilt(data: bytes) -> list[tuple[float, bytes]]:
            """The first stops are lost, and every third reply says that the arm stands."""
            if data[3] == c.STOP.id:
                told.append(data)
                return [] if len(told) < 8 else [(0, data)]

            return [(0, data)]

        def flags(data: bytes) -> list[tuple[float, bytes]]:
            return [(0, data[:4] + b"\0" + data[5:] if data[3] == c.IS_MOVING.id and len(told) % 3 == 0 else data)]

        lines[0].request, lines[0].reply = spoilt, flags
        await arm.stop()
        assert not sim.arm.moving
        assert len(told) > 8


def moves_say(lines: list[BadLine], spoil: Callable[[int], bool], *, stops_lost: int) -> None:
    """The arm does not hear the first stops, and says that it stands in the looks that are chosen."""
    looks, stops = count(), count()

    def request(data: bytes) -> list[tuple[float, bytes]]:
        return [] if data[3] == c.STOP.id and next(stops) < stops_lost else [(0, data)]

    def reply(data: bytes) -> list[tuple[float, bytes]]:
        still = data[3] == c.IS_MOVING.id and spoil(next(looks))
        return [(0, data[:4] + b"\0" + data[5:] if still else data)]

    lines[0].request, lines[0].reply = request, reply


@pytest.mark.parametrize("spoilt", [1, 2, 3, 4, 5])
@firmwares
@virtual
async def test_a_stop_that_was_lost_is_not_over_though_the_arm_seems_to_stand(
    lines: list[BadLine], quirks: MyCobotQuirks, spoilt: int
) -> None:
    """The first stops are lost, so none is acknowledged, and so many looks are spoilt."""
    async with simulate("mycobot280", quirks=quirks) as sim, MyCobot.connect(sim.url) as arm:
        await moved(arm)
        moves_say(lines, lambda look: look < spoilt, stops_lost=spoilt)
        await arm.stop()
        assert not sim.arm.moving
        joints = sim.arm.joints
        await asyncio.sleep(5)
        assert sim.arm.joints == joints


@pytest.mark.parametrize("late", [1, 2, 3, 4, 5])
@firmwares
@virtual
async def test_a_motion_that_begins_behind_looks_at_an_arm_that_stands_is_stopped(
    lines: list[BadLine], quirks: MyCobotQuirks, late: int
) -> None:
    """The motion is held back on the way, and so are the stops, till the arm has said that it stands several times."""
    async with simulate("mycobot280", quirks=quirks) as sim, MyCobot.connect(sim.url) as arm:
        held: list[bytes] = []
        looks = count()

        def request(data: bytes) -> list[tuple[float, bytes]]:
            if data[3] == c.SEND_ANGLE.id:
                held.append(data)
                return []

            if data[3] == c.STOP.id and held:
                return []

            if data[3] == c.IS_MOVING.id and next(looks) == late and held:
                return [(0, data), (0, held.pop())]

            return [(0, data)]

        lines[0].request = request
        await arm.queue.move_joint(1, 160, speed=1)
        looks = count()
        await arm.stop()
        assert not held
        joints = sim.arm.joints
        await asyncio.sleep(5)
        assert sim.arm.joints == joints
        assert not sim.arm.moving


@virtual
async def test_no_stop_waits_for_the_answers_of_others(lines: list[BadLine]) -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url) as arm:
        await moved(arm)
        lines[0].reply = lambda data: []
        reads = [asyncio.create_task(anything(arm.get_encoders())) for _ in range(5)]
        await asyncio.sleep(0.3)
        with pytest.raises(ReplyTimeout):
            await arm.stop(timeout=0.1)

        assert not sim.arm.moving
        lines[0].reply = lambda data: [(0, data)]
        await asyncio.gather(*reads, return_exceptions=True)
