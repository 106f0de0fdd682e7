"""A Magician from the user's side, on the simulator in memory and on a virtual clock."""

from __future__ import annotations

import asyncio
import math
from typing import Any

import anyio
import pytest
from virtual import virtual

from dobot_async import (
    ArmAlarm,
    ConnectFailed,
    ConnectionLost,
    Jog,
    Laser,
    Magician,
    MotionStopped,
    MotionUnknown,
    PTPMode,
    ReplyTimeout,
    Unreachable,
)
from dobot_async.arms.magician import commands as c
from dobot_async.simulator import Faults, Simulation, simulate
from dobot_async.simulator.device.work import DeviceOptions

TOO_FAR = (500.0, 0.0, 0.0)


def done(sim: Simulation, *names: str) -> list[Any]:
    """The values of what the arm has executed of some commands, in order."""
    return [each.value for each in sim.arm.executed if each.outcome == "done" and each.name in names]


def targets(sim: Simulation) -> list[tuple[float, float, float]]:
    """Where the PTP commands led that the arm has executed."""
    return [(value.x, value.y, value.z) for value in done(sim, "SetPTPCmd")]


def at(pose: c.Pose, x: float, y: float, z: float) -> bool:
    return math.dist((pose.x, pose.y, pose.z), (x, y, z)) < 1e-2


@virtual
async def test_an_await_returns_when_the_arm_has_arrived() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        await arm.move_to(220, 30, 40, mode=PTPMode.MOVL_XYZ)
        assert at(await arm.get_pose(), 220, 30, 40)
        assert sim.arm.device.now - sim.arm.executed[-1].finished <= 0.010


@virtual
async def test_the_queue_returns_when_the_arm_has_accepted() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        first = await arm.queue.move_to(220, 0, 40)
        second = await arm.queue.move_to(200, 60, 40)
        assert first.index is not None
        assert second.index == first.index + 1
        assert [first.done, second.done] == [False, False]
        await second
        await second
        assert [first.done, second.done] == [True, True]
        assert targets(sim) == [(220, 0, 40), (200, 60, 40)]


@virtual
async def test_many_may_await_one_motion() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        motion = await arm.queue.move_to(220, 0, 40)
        await asyncio.gather(*(motion.wait() for _ in range(5)))
        assert motion.done


@virtual
async def test_a_batch_keeps_its_order_and_nothing_comes_between() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:

        async def other() -> None:
            for step in range(10):
                await arm.queue.wait(step / 1000)

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
        start = names.index("SetPTPCmd")
        assert names[start : start + 3] == ["SetPTPCmd", "SetEndEffectorSuctionCup", "SetPTPCmd"]
        assert len(done(sim, "SetWAITCmd")) == 10 + 1  # the books are opened with one


@virtual
async def test_a_batch_left_by_an_error_sends_nothing() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        with pytest.raises(RuntimeError):
            async with arm.queue.batch() as batch:
                motion = batch.move_to(220, 60, 5)
                raise RuntimeError

        with pytest.raises(MotionStopped, match="not sent"):
            await motion

        assert done(sim, "SetPTPCmd") == []


@pytest.mark.cases(1)
@pytest.mark.parametrize("capacity", [1, 2, 32])
@virtual
async def test_a_full_queue_is_back_pressure(capacity: int) -> None:
    options = DeviceOptions(capacity=capacity)
    async with simulate(options=options) as sim, Magician.connect(sim.url) as arm:
        for step in range(3 * capacity + 20):
            await arm.queue.move_to(200, step, 40)

        await arm.queue.join()
        assert targets(sim) == [(200, step, 40) for step in range(3 * capacity + 20)]
        assert sim.arm.counters.overflowed == 0


@virtual
async def test_left_space_is_asked_when_connecting_and_counted_down() -> None:
    asked = 0
    async with simulate(options=DeviceOptions(capacity=20)) as sim, Magician.connect(sim.url) as arm:

        def count(outgoing: bool, frame: Any) -> None:
            nonlocal asked
            asked += outgoing and frame.id == c.GET_QUEUED_CMD_LEFT_SPACE.id

        arm.link.on_frame.add(count)
        for _ in range(19):
            await arm.queue.wait(10)

        assert asked == 0


@virtual
async def test_room_is_awaited_no_longer_than_asked() -> None:
    async with simulate(options=DeviceOptions(capacity=1)) as sim, Magician.connect(sim.url) as arm:
        await arm.queue.wait(60)
        with pytest.raises(ReplyTimeout, match="no room"):
            await arm.queue.move_to(200, 0, 40, timeout=1)

        assert targets(sim) == []
        assert sim.arm.device.accepted == 2


@pytest.mark.parametrize("on_fault", ["halt", "continue"])
@virtual
async def test_an_alarm_raises_and_nothing_behind_it_runs(on_fault: Any) -> None:
    async with simulate(options=DeviceOptions(on_fault=on_fault)) as sim, Magician.connect(sim.url) as arm:
        good = await arm.queue.move_to(220, 0, 40)
        bad = await arm.queue.move_to(*TOO_FAR)
        behind = await arm.queue.move_to(200, 0, 40)
        await good
        for motion in (bad, behind):
            with pytest.raises(ArmAlarm) as caught:
                await motion

            assert [alarm.code for alarm in caught.value.alarms] == [0x11]

        assert [alarm.code for alarm in await arm.get_alarms()] == [0x00, 0x11]
        await arm.recover()
        await asyncio.sleep(5)
        assert targets(sim) == [(220, 0, 40)]
        await arm.move_to(210, 0, 40)
        assert at(sim.arm.pose, 210, 0, 40)


@virtual
async def test_an_alarmed_arm_refuses_motion_but_not_its_effector() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        sim.arm.raise_alarm(0x40)
        await arm.suction(True)
        await (await arm.queue.suction(False))
        with pytest.raises(ArmAlarm, match="0x40"):
            await arm.move_to(220, 0, 40)


@virtual
async def test_clearing_alarms_does_not_make_a_failed_motion_done() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        motion = await arm.queue.move_to(*TOO_FAR)
        await asyncio.sleep(1)
        await arm.clear_alarms()
        with pytest.raises(ArmAlarm):
            await motion

        assert targets(sim) == []


@virtual
async def test_a_full_queue_of_an_alarmed_arm_raises() -> None:
    async with simulate(options=DeviceOptions(capacity=2)) as sim, Magician.connect(sim.url) as arm:
        sim.arm.raise_alarm(0x40)
        with pytest.raises(ArmAlarm):
            for _ in range(5):
                await arm.queue.move_to(220, 0, 40)


@virtual
async def test_stop_is_now_and_the_arm_is_ready_again() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        motions = [await arm.queue.move_to(220, 50 * side, 40) for side in (1, -1, 1, -1)]
        await asyncio.sleep(0.2)
        await arm.stop()
        pose = sim.arm.pose
        await asyncio.sleep(5)
        assert sim.arm.pose == pose
        for motion in motions:
            with pytest.raises(MotionStopped):
                await motion

        await arm.move_to(200, 0, 40)
        assert targets(sim) == [(200, 0, 40)]


@virtual
async def test_stop_ends_a_put_that_waits_for_room() -> None:
    async with simulate(options=DeviceOptions(capacity=1)) as sim, Magician.connect(sim.url) as arm:
        await arm.queue.wait(60)
        waiting = asyncio.create_task(asyncio.wait_for(arm.queue.move_to(220, 0, 40), None))
        await asyncio.sleep(1)
        await arm.stop()
        with pytest.raises(MotionStopped):
            await waiting

        assert targets(sim) == []


@virtual
async def test_pause_and_resume() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        first = await arm.queue.move_to(220, 0, 40)
        second = await arm.queue.move_to(200, 0, 40)
        await arm.pause()
        await first
        await asyncio.sleep(5)
        assert not second.done
        assert at(sim.arm.pose, 220, 0, 40)
        await arm.resume()
        await second
        assert at(sim.arm.pose, 200, 0, 40)


@virtual
async def test_clear_drops_what_is_queued() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        motions = [await arm.queue.wait(5) for _ in range(3)]
        await arm.queue.clear()
        for motion in motions:
            with pytest.raises(MotionStopped, match="cleared"):
                await motion

        await arm.move_to(200, 0, 40)
        assert done(sim, "SetWAITCmd") == [c.WAITCmd(0)]


@virtual
async def test_join_waits_for_all_and_raises_the_first_failure() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        for side in (1, -1):
            await arm.queue.move_to(220, 50 * side, 40)

        await arm.queue.join()
        assert len(targets(sim)) == 2
        await arm.queue.move_to(*TOO_FAR)
        with pytest.raises(ArmAlarm):
            await arm.queue.join()


@virtual
async def test_leaving_by_an_error_stops_the_arm() -> None:
    async with simulate() as sim:
        with pytest.raises(RuntimeError, match="mine"):
            async with Magician.connect(sim.url) as arm:
                await arm.laser(True)
                await arm.conveyor(10000)
                motion = await arm.queue.move_to(220, 60, 40)
                await arm.queue.move_to(220, -60, 40)
                await asyncio.sleep(0.1)
                raise RuntimeError("mine")

        before = sim.arm.device.now
        pose = sim.arm.pose
        assert not sim.arm.device.moving
        await asyncio.sleep(5)
        assert sim.arm.pose == pose
        assert not sim.arm.laser
        assert sim.arm.device.idle
        [move] = [each for each in sim.arm.executed if each.name == "SetPTPCmd"]
        assert move.outcome == "aborted"
        assert before - move.finished < 0.1
        assert sim.arm.motors[0].speed == 0
        with pytest.raises(MotionStopped):
            await motion


@virtual
async def test_leaving_by_an_error_can_let_the_arm_finish() -> None:
    async with simulate() as sim:
        with pytest.raises(RuntimeError):
            async with Magician.connect(sim.url, on_error="leave") as arm:
                await arm.queue.move_to(220, 60, 40)
                raise RuntimeError

        await asyncio.sleep(5)
        assert targets(sim) == [(220, 60, 40)]


@virtual
async def test_leaving_normally_stops_nothing() -> None:
    async with simulate() as sim:
        async with Magician.connect(sim.url) as arm:
            motion = await arm.queue.move_to(220, 60, 40)

        await asyncio.sleep(5)
        assert targets(sim) == [(220, 60, 40)]
        with pytest.raises(MotionStopped, match="block ended"):
            await motion


@virtual
async def test_a_cancelled_move_stops_the_arm() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(0.3):
                await arm.move_to(220, 90, 40)

        assert not sim.arm.device.moving
        with anyio.move_on_after(0.3):
            await arm.move_to(220, -90, 40)

        assert not sim.arm.device.moving
        with pytest.raises(ReplyTimeout, match="the arm was stopped"):
            await arm.move_to(220, 90, 40, timeout=0.3)

        assert not sim.arm.device.moving
        await arm.move_to(220, 0, 40)
        assert targets(sim) == [(220, 0, 40)]


@virtual
async def test_a_cancelled_wait_stops_nothing() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        motion = await arm.queue.move_to(220, 90, 40)
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(0.1):
                await motion

        with pytest.raises(ReplyTimeout, match="goes on"):
            await motion.wait(timeout=0.1)

        await motion
        assert targets(sim) == [(220, 90, 40)]


@virtual
async def test_an_observer_sends_reads_alone() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as controller:
        motion = await controller.queue.move_to(220, 90, 40)
        async with Magician.connect(sim.url, control=False) as observer:
            written = []
            observer.link.on_frame.add(
                lambda outgoing, frame: written.append(frame) if outgoing and frame.write else None
            )
            assert (await observer.get_pose()).x > 0
            for attempt in (
                lambda: observer.queue.move_to(200, 0, 0),
                lambda: observer.move_to(200, 0, 0),
                lambda: observer.suction(True),
                lambda: observer.clear_alarms(),
            ):
                with pytest.raises(ValueError, match="control=False"):
                    await attempt()

            assert written == []

        await motion


@virtual
async def test_connect_leaves_or_empties_the_queue() -> None:
    async with simulate() as sim:
        async with Magician.connect(sim.url) as arm:
            await arm.pause()
            await arm.queue.move_to(220, 60, 40)

        async with Magician.connect(sim.url, queue="keep"):
            await asyncio.sleep(2)
            assert targets(sim) == []

        async with Magician.connect(sim.url) as arm:
            await arm.move_to(200, 0, 40)

        assert targets(sim) == [(200, 0, 40)]


@virtual
async def test_reach_is_explained_before_a_byte_is_sent() -> None:
    async with simulate() as sim, Magician.connect(sim.url, check_reach=True) as arm:
        requests = sim.arm.counters.requests
        for attempt in (
            lambda: arm.move_to(*TOO_FAR),
            lambda: arm.queue.move_to(*TOO_FAR, mode=PTPMode.JUMP_XYZ),
            lambda: arm.move_joints(0, 120, 0, 0),
            lambda: arm.queue.path_to(*TOO_FAR),
            lambda: arm.queue.arc((220, 0, 40, 0), (*TOO_FAR, 0)),
        ):
            with pytest.raises(Unreachable):
                await attempt()

        async with arm.queue.batch() as batch:
            with pytest.raises(Unreachable):
                batch.move_to(*TOO_FAR)

        assert sim.arm.counters.requests == requests
        await arm.set_end_effector(Laser())
        assert arm.kinematics.x_bias == 70


@pytest.mark.parametrize("bad", [math.nan, math.inf, 1e300])
@virtual
async def test_numbers_that_are_none_are_refused(bad: float) -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        requests = sim.arm.counters.requests
        for attempt in (
            lambda: arm.move_to(bad, 0, 0),
            lambda: arm.queue.move_to(0, bad, 0),
            lambda: arm.queue.arc((bad, 0, 0, 0), (0, 0, 0, 0)),
            lambda: arm.queue.path_to(0, 0, bad),
            lambda: arm.jog(Jog.X_PLUS, bad) if bad != 1e300 else arm.set_speed(bad),
        ):
            with pytest.raises(ValueError, match="must be"):
                await attempt()

        for address in (0, 21, -1):
            with pytest.raises(ValueError, match="1 to 20"):
                await arm.get_input(address)
            with pytest.raises(ValueError, match="1 to 20"):
                await arm.set_output(address, level=True)

        with pytest.raises(TypeError):
            await arm.get_input("1")  # type: ignore[arg-type]
        with pytest.raises(ValueError, match="166"):
            await arm.request(c.SET_DEVICE_NAME, "x" * 167)
        with pytest.raises(ValueError, match="queue"):
            await arm.request(c.SET_PTP_CMD, c.PTPCmd(PTPMode.MOVJ_XYZ, 0, 0, 0))
        with pytest.raises(ValueError, match="cannot be queued"):
            await arm.queue.put(c.GET_POSE, None)

        assert sim.arm.counters.requests == requests


@virtual
async def test_jog_runs_for_its_time_and_no_longer() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        start = sim.arm.pose
        await arm.jog(Jog.J1_PLUS, 0.5)
        end = sim.arm.pose
        assert end.j1 > start.j1
        await asyncio.sleep(1)
        assert sim.arm.pose == end
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(0.2):
                await arm.jog(Jog.X_MINUS, 10)

        assert not sim.arm.device.moving


@virtual
async def test_taught_points_come_when_the_key_is_released() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        places = [(200.0, 0.0, 20.0), (220.0, 40.0, 30.0)]
        found = []

        async def guide() -> None:
            for place in places:
                await asyncio.sleep(1)
                sim.arm.guide_to(*place, 0.0)

        guiding = asyncio.create_task(guide())
        async for pose in arm.taught_points():
            found.append(pose)
            if len(found) == 2:
                break

        await guiding
        await asyncio.sleep(0.1)
        assert all(at(pose, *place) for pose, place in zip(found, places, strict=True))
        assert await arm.request(c.GET_HHT_TRIG_OUTPUT_ENABLED, None) is False


@virtual
async def test_a_program_is_stored_and_run_by_the_key() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        async with arm.queue.download(loops=2) as program:
            program.move_to(220, 0, 40)
            program.move_to(200, 0, 40)

        await asyncio.sleep(3)
        assert targets(sim) == []
        sim.arm.run_program()
        await asyncio.sleep(20)
        assert targets(sim) == [(220, 0, 40), (200, 0, 40)] * 2


@virtual
async def test_inputs_outputs_and_sensors() -> None:
    async with simulate() as sim, Magician.connect(sim.url) as arm:
        await arm.configure_io(4, c.IOFunction.DO)
        await arm.set_output(4, level=True)
        assert await arm.get_output(4)
        assert sim.arm.output(4)
        await arm.configure_io(5, c.IOFunction.DI)
        await arm.configure_io(6, c.IOFunction.ADC)
        sim.arm.set_input(5, True)
        assert await arm.get_input(5)
        sim.arm.set_adc(6, 1234)
        assert await arm.get_adc(6) == 1234
        assert (await arm.get_info()).version.count(".") == 2
        await arm.set_rail(on=True)
        await arm.move_to(200, 0, 40, l=100)
        assert await arm.get_rail() == pytest.approx(100)


@virtual
async def test_a_silent_arm_fails_the_connection_with_advice() -> None:
    async with simulate(faults=Faults(silent=True)) as sim:
        with pytest.raises(ConnectFailed, match=r"switched on.*3D-printing"):
            async with Magician.connect(sim.url, timeout=2):
                pass


@virtual
async def test_a_link_that_breaks_ends_everything() -> None:
    async with simulate() as sim:
        with pytest.raises(ConnectionLost):
            async with Magician.connect(sim.url) as arm:
                motion = await arm.queue.move_to(220, 0, 40)
                sim.unplug()
                with pytest.raises(ConnectionLost):
                    await arm.get_pose()

                await motion


@virtual
async def test_an_arm_that_falls_silent_ends_what_is_awaited() -> None:
    async with simulate() as sim:
        with pytest.raises(MotionUnknown, match="no longer answers"):
            async with Magician.connect(sim.url) as arm:
                motion = await arm.queue.move_to(220, 0, 40)
                sim.faults.silent = True
                await motion


@virtual
async def test_using_an_arm_after_its_block_says_so() -> None:
    async with simulate() as sim:
        async with Magician.connect(sim.url) as arm:
            pass

        with pytest.raises(ConnectionLost, match="closed"):
            await arm.get_pose()


@virtual
async def test_several_clients_in_turn() -> None:
    async with simulate() as sim:
        for step in range(3):
            async with Magician.connect(sim.url) as arm:
                await arm.move_to(200, 10 * step, 40)

        assert targets(sim) == [(200, 10 * step, 40) for step in range(3)]
