"""An ultraArm from the user's side, on the simulator in memory and on a virtual clock."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from virtual import virtual

from dobot_async import (
    ArmAlarm,
    CommandRejected,
    ConnectFailed,
    ConnectionLost,
    MotionStopped,
    MotionUnknown,
    ReplyTimeout,
    UltraArm,
    UltraArmAngles,
    UltraArmCoords,
    UltraArmJog,
)
from dobot_async._core.protocol.transport import Transport
from dobot_async._core.protocol.wire import Command
from dobot_async.arms.ultraarm import commands as c
from dobot_async.simulator import DeviceOptions, Faults, Simulation, UltraArmQuirks, simulate
from dobot_async.simulator.ultraarm.arm import ULTRAARM
from dobot_async.transports import open_transport

FIRMWARES = [
    UltraArmQuirks(),
    UltraArmQuirks(acknowledge="ok", blanks=False),
    UltraArmQuirks(acknowledge="nothing"),
    UltraArmQuirks(jog_stop="all"),
    UltraArmQuirks(dwell_rests=True),
    UltraArmQuirks(release="queued"),
]
OUT_OF_REACH = (10.0, 0.0, 0.0)


def queue(capacity: int, *, count_executing: bool = False) -> DeviceOptions:
    """An arm with another queue."""
    return DeviceOptions(capacity, count_executing, 1, 0, power_up_alarms=frozenset())


def done(sim: Simulation, *rows: Command[Any, Any]) -> list[Any]:
    """The values of what the arm has executed of some rows, in order."""
    return [each.value for each in sim.arm.executed if each.outcome == "done" and each.command in rows]


def targets(sim: Simulation) -> list[float]:
    """The x of the G0 that the arm has executed."""
    return [value.x for value in done(sim, c.MOVE_COORDS)]


def at(coords: UltraArmCoords, x: float, y: float, z: float) -> bool:
    return math.dist((coords.x, coords.y, coords.z), (x, y, z)) < 0.011


@pytest.mark.cases(2)
@pytest.mark.parametrize("quirks", FIRMWARES, ids=str)
@virtual
async def test_an_await_returns_when_the_arm_has_arrived(quirks: UltraArmQuirks) -> None:
    async with simulate("ultraarm", homed=True, quirks=quirks) as sim, UltraArm.connect(sim.url) as arm:
        await arm.home()
        assert sim.arm.registers.homed
        await arm.move_to(200, 30, 40)
        assert at(await arm.get_coords(), 200, 30, 40)
        assert not sim.arm.device.moving
        await arm.move_joints(20, 10, 30, speed=100)
        assert await arm.get_angles() == UltraArmAngles(20, 10, 30, 0)
        await arm.move_joint(1, -20)
        assert (await arm.get_angles()).j1 == -20
        before = await arm.get_coords()
        await arm.move_by(z=-10)
        assert at(await arm.get_coords(), before.x, before.y, before.z - 10)
        assert not sim.arm.registers.relative
        started = sim.arm.device.now
        await arm.wait(2)
        assert sim.arm.device.now >= started + 2


@pytest.mark.cases(2)
@pytest.mark.parametrize("count_executing", [False, True])
@pytest.mark.parametrize("quirks", FIRMWARES, ids=str)
@virtual
async def test_no_motion_is_done_before_its_time(quirks: UltraArmQuirks, count_executing: bool) -> None:
    options = queue(100, count_executing=count_executing)
    async with (
        simulate("ultraarm", homed=True, quirks=quirks, options=options) as sim,
        UltraArm.connect(sim.url) as arm,
    ):
        motions = []
        for step in range(12):
            motions.append(await arm.queue.move_to(200 + step, 0, 40))
            motions.append(await arm.queue.suction(step % 2 == 0))

        motions.append(await arm.queue.wait(1))
        for place, motion in enumerate(motions, 1):
            await motion
            assert len([each for each in sim.arm.executed if each.name != "G90"]) >= place

        assert targets(sim) == [200 + step for step in range(12)]


@pytest.mark.full
@virtual
async def test_two_hundred_moves_arrive_in_order_and_none_is_lost() -> None:
    async with simulate("ultraarm", homed=True, speed=20) as sim, UltraArm.connect(sim.url) as arm:
        for step in range(200):
            await arm.queue.move_to(180 + step / 4, 0, 40, speed=200)

        await arm.queue.join()
        assert targets(sim) == [180 + step / 4 for step in range(200)]
        assert sim.arm.counters.overflowed == 0


@virtual
async def test_the_arm_is_given_one_motion_at_a_time() -> None:
    """Whatever stands behind one that is not done is still on this side: it can be taken back."""
    async with simulate("ultraarm", homed=True, options=queue(1)) as sim, UltraArm.connect(sim.url) as arm:
        motions = [await arm.queue.move_to(200 + 10 * step, 0, 40) for step in range(4)]
        for step, motion in enumerate(motions):
            await motion
            assert targets(sim) == [200 + 10 * each for each in range(step + 1)]
            assert sim.arm.queue_size == 0

        assert sim.arm.counters.overflowed == 0


@virtual
async def test_the_queue_returns_when_the_arm_has_accepted() -> None:
    async with simulate("ultraarm", homed=True) as sim, UltraArm.connect(sim.url) as arm:
        first = await arm.queue.move_to(200, 0, 40)
        second = await arm.queue.move_to(200, 60, 40)
        assert (first.index, second.index) == (1, 2)
        assert [first.done, second.done] == [False, False]
        await asyncio.gather(*(second.wait() for _ in range(5)))
        assert [first.done, second.done] == [True, True]
        assert len(targets(sim)) == 2


@virtual
async def test_a_batch_keeps_its_order_and_nothing_comes_between() -> None:
    async with simulate("ultraarm", homed=True, speed=20) as sim, UltraArm.connect(sim.url) as arm:

        async def other() -> None:
            for _ in range(5):
                await arm.queue.wait(0)

        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(other())
            await asyncio.sleep(0)
            async with arm.queue.batch() as batch:
                batch.move_to(220, 60, 5)
                batch.suction(True)
                lifted = batch.move_to(220, 60, 60)
                assert lifted.index is None

        await lifted
        await arm.queue.join()
        names = [each.name for each in sim.arm.executed]
        start = names.index("G0")
        assert names[start : start + 3] == ["G0", "M23", "G0"]


@virtual
async def test_settings_take_effect_before_they_return() -> None:
    async with simulate("ultraarm", homed=True, speed=20) as sim, UltraArm.connect(sim.url) as arm:
        registers: Any = sim.arm.registers
        await arm.queue.move_to(200, 0, 40)
        await arm.suction(True)
        assert registers.pump
        assert targets(sim) == [200]
        await arm.suction(False)
        await arm.laser(True)
        await arm.pwm(100)
        await arm.fan(False)
        await arm.gripper_to(60)
        await arm.set_speed_mode(c.SpeedMode.CONSTANT)
        assert (registers.pump, registers.laser, registers.pwm, registers.fan) == (False, True, 100, False)
        assert (registers.gripper, registers.speed_mode) == (60, 0)
        await arm.laser(False)
        await arm.release_gripper()
        assert (registers.laser, registers.gripper) == (False, None)
        await arm.set_position(0, 0, 0)
        assert at(await arm.get_coords(), 0, 0, 0)


@pytest.mark.parametrize(("pump", "started"), [("manual", True), ("vendor", False)])
@virtual
async def test_who_is_right_about_the_pump_is_an_option(pump: Any, started: bool) -> None:
    """The simulated pump is the manual's."""
    async with simulate("ultraarm", homed=True) as sim, UltraArm.connect(sim.url, pump=pump) as arm:
        await arm.suction(True)
        assert sim.arm.registers.pump is started
        await (await arm.queue.suction(False))
        assert sim.arm.registers.pump is not started
        async with arm.queue.batch() as batch:
            motion = batch.suction(True)

        await motion
        assert sim.arm.registers.pump is started


@virtual
async def test_relative_coordinates() -> None:
    async with simulate("ultraarm", homed=True, speed=20) as sim, UltraArm.connect(sim.url) as arm:
        await arm.move_to(200, 0, 40)
        await arm.relative()
        await arm.move_to(5, 0, 5)
        assert at(await arm.get_coords(), 205, 0, 45)
        await arm.absolute()
        await arm.move_to(210, 0, 40)
        assert at(await arm.get_coords(), 210, 0, 40)


@virtual
async def test_what_another_program_has_left_relative_is_absolute() -> None:
    async with simulate("ultraarm", homed=True, speed=20) as sim:
        sim.arm.registers.relative = True
        async with UltraArm.connect(sim.url) as arm:
            await arm.move_to(200, 0, 40)
            assert at(await arm.get_coords(), 200, 0, 40)


@pytest.mark.parametrize("quirks", FIRMWARES, ids=str)
@virtual
async def test_a_stop_stops_the_arm_and_ends_what_is_pending(quirks: UltraArmQuirks) -> None:
    async with simulate("ultraarm", homed=True, quirks=quirks) as sim, UltraArm.connect(sim.url) as arm:
        motions = [await arm.queue.move_to(150 + 10 * step, 100, 40, speed=20) for step in range(6)]
        await asyncio.sleep(0.5)
        if quirks.release == "queued":
            with pytest.raises(CommandRejected, match="switch it off"):
                await arm.stop()
        else:
            await arm.stop()
            assert not sim.arm.device.moving
            assert not sim.arm.queue_size

        for motion in motions:
            with pytest.raises((MotionStopped, CommandRejected)):
                await motion

        assert sim.arm.registers.powered == (quirks.jog_stop == "all" or quirks.release == "queued")


@pytest.mark.parametrize("later", [0.01, 0.05, 0.11, 0.17, 0.23])
@pytest.mark.parametrize("jog_stop", ["all", "jog"])
@virtual
async def test_nothing_moves_after_a_stop_that_comes_while_a_batch_is_sent(later: float, jog_stop: Any) -> None:
    quirks = UltraArmQuirks(jog_stop=jog_stop)
    faults = Faults(latency=0.02)
    async with simulate("ultraarm", homed=True, quirks=quirks, faults=faults) as sim, UltraArm.connect(sim.url) as arm:

        async def put() -> None:
            async with arm.queue.batch() as batch:
                for step in range(12):
                    batch.move_to(200 + step, 60 * (-1) ** step, 40, speed=50)

            with pytest.raises(MotionStopped):
                await batch.motions[-1]

        putting = asyncio.create_task(put())
        await asyncio.sleep(later)
        await arm.stop()
        here = sim.arm.pose
        await putting

        await asyncio.sleep(10)
        assert sim.arm.pose == here
        assert not sim.arm.device.moving
        assert not sim.arm.queue_size


@virtual
async def test_after_a_stop_that_released_the_motors_nothing_moves_until_the_arm_was_home() -> None:
    async with simulate("ultraarm", homed=True, speed=20) as sim, UltraArm.connect(sim.url) as arm:
        await arm.queue.move_to(200, 100, 40, speed=20)
        await asyncio.sleep(0.1)
        await arm.stop()
        assert not sim.arm.registers.powered
        calls: list[Callable[[], Awaitable[Any]]] = [
            lambda: arm.queue.move_to(200, 0, 40),
            lambda: arm.move_by(z=5),
            lambda: arm.move_joints(0, 10, 10),
            lambda: arm.jog("x+", 0.1),
            lambda: arm.run_gcode(["G0 X200"]),
        ]
        for call in [*calls, arm.home]:
            with pytest.raises(CommandRejected, match="no power"):
                await call()

        assert "no power" in str((await arm.get_alarms())[0])
        sim.arm.guide_to(40, 30, 30, 0)  # it sank, or somebody has moved it
        assert (await arm.get_angles()).j1 != 40, "it does not notice"
        await arm.clear_alarms()
        await arm.power_on()
        for call in calls:
            with pytest.raises(CommandRejected, match=r"lost its place.*home\(\)"):
                await call()

        assert "lost its place" in str((await arm.get_alarms())[0])
        # What puts it right may be queued in front.
        async with arm.queue.batch() as batch:
            batch.home()
            moved = batch.move_to(200, 0, 40)

        await moved
        assert await arm.get_alarms() == ()
        assert sim.arm.missed == 0
        await arm.release()
        with pytest.raises(CommandRejected, match="no power"):
            await arm.move_to(210, 0, 40)

        await arm.recover()
        await arm.home()
        await arm.move_to(210, 0, 40)


@virtual
async def test_a_stop_of_an_arm_at_rest_releases_nothing() -> None:
    async with simulate("ultraarm", homed=True, speed=20) as sim, UltraArm.connect(sim.url) as arm:
        await arm.move_to(200, 0, 40)
        await arm.stop()
        assert sim.arm.registers.powered
        await arm.move_to(210, 0, 40)
        assert targets(sim) == [200, 210]


@virtual
async def test_a_stop_may_let_the_arm_finish() -> None:
    async with simulate("ultraarm", homed=True, speed=20) as sim, UltraArm.connect(sim.url, on_stop="finish") as arm:
        motions = [await arm.queue.move_to(200 + step, 0, 40) for step in range(10)]
        await asyncio.sleep(0.05)
        await arm.stop()
        assert not sim.arm.device.moving
        assert sim.arm.registers.powered
        with pytest.raises(MotionStopped):
            await motions[-1]

        assert 0 < len(targets(sim)) < 6
        await arm.move_to(220, 0, 40)


@virtual
async def test_a_stop_in_the_middle_of_a_relative_motion_leaves_absolute_coordinates() -> None:
    quirks = UltraArmQuirks(jog_stop="all")
    async with simulate("ultraarm", homed=True, quirks=quirks) as sim, UltraArm.connect(sim.url) as arm:
        motion = await arm.queue.move_by(z=-50, speed=10)
        await asyncio.sleep(0.5)
        await arm.stop()
        with pytest.raises(MotionStopped):
            await motion

        await arm.move_to(200, 0, 40)
        assert at(await arm.get_coords(), 200, 0, 40)


@virtual
async def test_a_cancelled_move_stops_the_arm() -> None:
    async with simulate("ultraarm", homed=True) as sim, UltraArm.connect(sim.url) as arm:
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(0.5):
                await arm.move_to(150, 150, 40, speed=10)

        assert not sim.arm.device.moving
        assert targets(sim) == []

    async with simulate("ultraarm", homed=True) as sim, UltraArm.connect(sim.url) as arm:
        with pytest.raises(ReplyTimeout, match="the arm was stopped"):
            await arm.move_to(150, 150, 40, speed=10, timeout=0.5)

        assert not sim.arm.device.moving


@virtual
async def test_a_cancelled_wait_for_a_queued_motion_stops_nothing() -> None:
    async with simulate("ultraarm", homed=True) as sim, UltraArm.connect(sim.url) as arm:
        motion = await arm.queue.move_to(200, 0, 40)
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(0.1):
                await motion

        await motion
        assert targets(sim) == [200]


@virtual
async def test_a_block_left_by_an_error_stops_arm_and_laser() -> None:
    async with simulate("ultraarm", homed=True) as sim:
        with pytest.raises(RuntimeError):
            async with UltraArm.connect(sim.url) as arm:
                await arm.laser(True)
                await arm.pwm(200)
                await arm.queue.move_to(150, 150, 40, speed=10)
                raise RuntimeError

        assert not sim.arm.device.moving
        assert (sim.arm.registers.laser, sim.arm.registers.pwm) == (False, 0)

        with pytest.raises(RuntimeError):
            async with UltraArm.connect(sim.url, on_error="leave") as arm:
                await arm.power_on()
                await arm.queue.move_to(150, 150, 40, speed=10)
                raise RuntimeError

        assert sim.arm.device.moving


@virtual
async def test_a_block_left_normally_stops_nothing() -> None:
    async with simulate("ultraarm", homed=True) as sim:
        async with UltraArm.connect(sim.url) as arm:
            motion = await arm.queue.move_to(200, 0, 40)
            behind = await arm.queue.move_to(205, 0, 40)
            await asyncio.sleep(0.1)

        for each in (motion, behind):
            with pytest.raises(MotionStopped, match="block ended"):
                await each

        assert sim.arm.device.moving
        async with UltraArm.connect(sim.url) as arm:
            await arm.move_to(210, 0, 40)  # behind what the earlier program left
            assert targets(sim) == [200, 210]


@virtual
async def test_what_led_nowhere_is_told() -> None:
    """The arm itself says nothing of a target that it cannot reach."""
    async with simulate("ultraarm", homed=True) as sim, UltraArm.connect(sim.url) as arm:
        await arm.move_to(200, 0, 40)
        with pytest.raises(ArmAlarm, match="instead of x 10"):
            await arm.move_to(*OUT_OF_REACH)

        await arm.move_to(210, 0, 40)
        assert sim.arm.missed == 1


@virtual
async def test_limits_are_data() -> None:
    async with simulate("ultraarm", homed=True) as sim, UltraArm.connect(sim.url) as arm:
        before = sim.arm.counters.requests
        for wrong in [(301, 0, 0), (0, -301, 0), (0, 0, 136)]:
            with pytest.raises(ValueError, match="must be in"):
                await arm.move_to(*wrong)

        with pytest.raises(ValueError, match="j3 must be in -5 to 60"):
            await arm.queue.move_joints(0, 0, 90)

        with pytest.raises(ValueError, match="j3 must be in -5 to 60"):
            async with arm.queue.batch() as batch:
                batch.move_joint(3, 90)

        with pytest.raises(ValueError, match="x must be in"):
            await arm.request(c.SET_POSITION, c.Position(x=400))

        for speed in (0, 201, math.nan):
            with pytest.raises(ValueError, match="speed must be in"):
                await arm.move_to(200, 0, 40, speed=speed)

        with pytest.raises(ValueError, match="axis"):
            await arm.move_to()

        assert sim.arm.counters.requests == before

    async with simulate("ultraarm", homed=True) as sim, UltraArm.connect(sim.url, limits=c.LIBRARY_LIMITS) as arm:
        await arm.move_joint(3, 90)


@virtual
async def test_every_row_can_be_asked() -> None:
    async with simulate("ultraarm", homed=True, speed=20) as sim, UltraArm.connect(sim.url) as arm:
        assert await arm.request(c.GET_SYSTEM_VERSION, None) == 1.2
        assert await arm.get_version() == "1.2"
        assert await arm.request(c.GET_ENDSTOPS, None) == await arm.get_endstops() == c.Endstops(1, 1, 1)
        assert (await arm.request(c.PUMP_ON, None)).queue_size == 0
        assert sim.arm.registers.pump
        assert await arm.get_queue_size() == 0
        await arm.request(c.SET_SERVO_REGISTER, c.ServoValue(7, 56, 2048, c.RegisterMode.WORD))
        assert await arm.request(c.GET_SERVO_REGISTER, c.ServoRegister(7, 56, c.RegisterMode.WORD)) == 2048
        assert (await arm.request(c.CALIBRATE_J1, None)).queue_size == 0
        await arm.release()
        with pytest.raises(CommandRejected, match="M31: J1 cal failed"):
            await arm.request(c.CALIBRATE_J1, None)

        with pytest.raises(ValueError, match="queue"):
            await arm.request(c.MOVE_COORDS, c.CoordsMove(x=200))

        with pytest.raises(ValueError, match="cannot be queued"):
            await arm.queue.put(c.GET_ANGLES, None)


@virtual
async def test_errors_of_the_arm_are_rejections() -> None:
    quirks = UltraArmQuirks()
    async with simulate("ultraarm", homed=True, quirks=quirks) as sim, UltraArm.connect(sim.url) as arm:
        await arm.move_to(200, 0, 40)
        sim.arm.quirks = UltraArmQuirks(later=False)
        with pytest.raises(CommandRejected, match="G6: COMMAND NOT RECOGNIZED"):
            await arm.get_version()

    async with simulate("ultraarm", homed=True, quirks=UltraArmQuirks(later=False)) as sim:
        with pytest.raises(ConnectFailed, match="QUEUE SIZE"):
            async with UltraArm.connect(sim.url, timeout=1):
                pass


@virtual
async def test_a_queued_command_that_is_refused() -> None:
    row = c.SET_SPEED_MODE
    async with simulate("ultraarm", homed=True) as sim, UltraArm.connect(sim.url) as arm:
        refused = Command("M99", 99, row.request, row.reply, "", write=True, queueing=row.queueing)
        motion = await arm.queue.put(refused, c.ModeOfSpeed(c.SpeedMode.CONSTANT))
        with pytest.raises(CommandRejected, match="M99: COMMAND NOT RECOGNIZED"):
            await motion

        await arm.move_to(200, 0, 40)
        assert targets(sim) == [200]


@virtual
async def test_what_the_way_to_the_arm_takes_is_not_taken_from_its_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    async def slowly(url: str, arm: str) -> Transport:
        await asyncio.sleep(4.999)
        return await open_transport(url, arm=arm)

    monkeypatch.setattr("dobot_async.arms.session.open_transport", slowly)
    async with UltraArm.connect("sim:?latency=0.05", timeout=5) as arm:
        assert await arm.get_queue_size() == 0


@virtual
async def test_a_jog_that_is_wrong_sends_nothing() -> None:
    async with simulate("ultraarm", homed=True) as sim, UltraArm.connect(sim.url) as arm:
        requests = sim.arm.counters.requests
        with pytest.raises(ValueError, match="must be in"):
            await arm.jog(UltraArmJog.Z_MINUS, 0.5, speed=1000)

        assert sim.arm.counters.requests == requests


@virtual
async def test_jogs_end_with_their_block() -> None:
    async with simulate("ultraarm", homed=True) as sim, UltraArm.connect(sim.url) as arm:
        await arm.move_to(200, 0, 40)
        before = await arm.get_coords()
        await arm.jog(UltraArmJog.Z_MINUS, 0.5, speed=20)
        after = await arm.get_coords()
        assert 5 < before.z - after.z < 15
        assert abs(after.x - before.x) < 0.1
        await arm.jog(UltraArmJog.J1_PLUS, 0.5, speed=20)
        assert (await arm.get_angles()).j1 > 5
        with pytest.raises(RuntimeError):
            async with arm.jogging(UltraArmJog.Y_PLUS):
                assert await arm.is_moving()
                raise RuntimeError

        assert not await arm.is_moving()
        await arm.suction(True)  # the arm stands elsewhere than the last motion led, and that is right
        for seconds in (-1, math.nan, math.inf):
            with pytest.raises(ValueError, match="seconds"):
                await arm.jog(UltraArmJog.X_PLUS, seconds)


@virtual
async def test_observers_only_read() -> None:
    async with simulate("ultraarm", homed=True) as sim, UltraArm.connect(sim.url, control=False) as arm:
        assert at(await arm.get_coords(), 235.55, 0, 130)
        for call in (arm.home(), arm.suction(True), arm.release(), arm.request(c.PUMP_ON, None)):
            with pytest.raises(ValueError, match="only reads"):
                await call

        assert sim.arm.executed == []


@pytest.mark.parametrize(
    "wrong",
    [
        {"queue": "new"},
        {"on_error": "x"},
        {"on_stop": "x"},
        {"pump": "x"},
        {"tolerance": -1},
        {"tolerance": math.nan},
        {"tolerance": math.inf},
        {"tolerance": "1"},
        {"tolerance": None},
        {"tolerance": 0},
        {"home_switches": (1, 1)},
        {"home_switches": (2, 1, 1)},
        {"timeout": 0},
        {"timeout": math.nan},
        {"reply_timeout": 0},
    ],
    ids=str,
)
async def test_wrong_options(wrong: dict[str, Any]) -> None:
    (name,) = wrong
    with pytest.raises((ValueError, TypeError), match=f"^{name} must be"):
        async with UltraArm.connect("sim:", **wrong):
            pass


@pytest.mark.parametrize("url", ["sim:?dup=0.1", "sim:?jitter=0.1"])
async def test_links_that_double_or_reorder_are_refused(url: str) -> None:
    with pytest.raises(ValueError, match="neither doubles nor reorders"):
        async with UltraArm.connect(url):
            pass


@virtual
async def test_a_silent_arm_never_hangs_a_call() -> None:
    faults = Faults()
    async with simulate("ultraarm", homed=True, faults=faults) as sim:
        async with UltraArm.connect(sim.url, on_error="leave") as arm:
            loop = asyncio.get_running_loop()
            motion = await arm.queue.move_to(200, 0, 40)
            faults.silent = True
            for call in (arm.get_angles(), arm.get_version(), arm.request(c.PUMP_ON, None)):
                before = loop.time()
                with pytest.raises(ReplyTimeout):
                    await call

                assert loop.time() - before <= 1.51

            before = loop.time()
            with pytest.raises(MotionUnknown, match="no longer answers"):
                await motion

            assert loop.time() - before <= 5.1
            before = loop.time()
            with pytest.raises(ReplyTimeout, match="nothing was sent"):
                await arm.move_to(210, 0, 40)

            assert loop.time() - before <= 5.1
            before = loop.time()
            with pytest.raises(ReplyTimeout):
                await arm.stop()

            assert loop.time() - before <= 5.1
            faults.silent = False
            await arm.stop()
            assert await arm.get_coords()

        faults.silent = True

        with pytest.raises(ConnectFailed, match="no ultraArm answers"):
            async with UltraArm.connect(sim.url, timeout=1):
                pass


@virtual
async def test_the_end_of_the_link_ends_everything() -> None:
    async with simulate("ultraarm", homed=True) as sim, UltraArm.connect(sim.url) as arm:
        motion = await arm.queue.move_to(200, 0, 40)
        sim.unplug()
        with pytest.raises(ConnectionLost):
            await motion

        with pytest.raises(ConnectionLost):
            await arm.get_angles()


async def test_over_a_serial_port() -> None:
    async with simulate("ultraarm", homed=True, listen="pty", speed=50) as sim, UltraArm.connect(sim.url) as arm:
        await arm.home()
        await arm.move_to(200, 0, 40)
        assert at(await arm.get_coords(), 200, 0, 40)


async def test_over_tcp_and_by_its_own_simulation() -> None:
    async with (
        simulate("ultraarm", homed=True, listen="tcp://127.0.0.1:0", speed=50) as sim,
        UltraArm.connect(sim.url) as arm,
    ):
        await arm.move_to(200, 0, 40)

    async with UltraArm.connect("sim:?speed=50") as arm:
        await arm.move_to(200, 0, 40)
        assert at(await arm.get_coords(), 200, 0, 40)


def test_the_simulated_queue_is_deep() -> None:
    assert ULTRAARM.capacity == 100
