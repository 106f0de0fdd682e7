"""Blocking calls do what the awaited ones do; what interrupts them stops the arm, and comes out as itself."""

from __future__ import annotations

import asyncio
import os
import signal
import sys
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager
from typing import Any, Literal

import pytest

from dobot_async import (
    ArmAlarm,
    ConnectionLost,
    LinkState,
    MotionStopped,
    PTPMode,
    ReplyTimeout,
    Unexpected,
)
from dobot_async.arms.magician import commands as c
from dobot_async.handling.pick_and_place import PartMissing, pick
from dobot_async.simulator.scene import Piece, Scene
from dobot_async.sync import Magician, MyCobot, UltraArm, run, simulate

FAR = (220, 150, 40)


def outcomes(sim: Any) -> list[str]:
    """How the motions of a simulated Magician ended."""
    return [each.outcome for each in sim.arm.executed if each.name == "SetPTPCmd"]


def until(holds: Any) -> None:
    """Waits until something holds."""
    for _ in range(20_000):
        if holds():
            return

        threading.Event().wait(0.001)

    raise AssertionError("it does not come about")


@contextmanager
def ctrl_c_once(holds: Any) -> Iterator[None]:
    """Presses Ctrl-C in the main thread as soon as something holds."""
    if sys.platform == "win32":
        pytest.skip("no signal can be sent to a thread here")

    before = signal.signal(signal.SIGINT, signal.default_int_handler)

    def press() -> None:
        until(holds)
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)

    thread = threading.Thread(target=press)
    thread.start()
    try:
        yield
    finally:
        thread.join()
        signal.signal(signal.SIGINT, before)


def test_verbs_wait_until_the_arm_has_done_it() -> None:
    with simulate(speed=50) as sim, Magician.connect(sim.url) as arm:
        arm.home()
        arm.move_to(220, 0, 40)
        assert (arm.get_pose().x, arm.get_pose().z) == (220, 40)
        assert sim.arm.device.idle
        arm.move_to(z=60, mode=PTPMode.MOVL_XYZ)
        assert [round(each) for each in arm.get_joints()] == [round(each) for each in sim.arm.pose.joints]


def test_motions_of_the_queue_are_waited_for_when_one_likes() -> None:
    with simulate(speed=50) as sim, Magician.connect(sim.url) as arm:
        motion = arm.queue.move_to(*FAR)
        assert repr(motion).endswith("pending>")
        assert motion.index is not None
        with pytest.raises(ReplyTimeout, match="goes on"):
            motion.wait(timeout=1e-6)

        motion.wait()
        assert motion.done
        assert motion.exception() is None
        assert arm.queue.pending == 0
        assert outcomes(sim) == ["done"]


def test_a_batch_is_sent_at_its_end() -> None:
    with simulate(speed=50) as sim, Magician.connect(sim.url) as arm:
        with arm.queue.batch() as batch:
            batch.move_to(220, 60, 5)
            batch.wait(0.1)
            lifted = batch.move_to(220, 60, 60)
            assert not arm.queue.pending
            assert batch.motions[-1] == lifted

        lifted.wait()
        assert [each.name for each in sim.arm.executed[-3:]] == ["SetPTPCmd", "SetWAITCmd", "SetPTPCmd"]
        with pytest.raises(ValueError, match="mine"), arm.queue.batch() as batch:
            lost = batch.move_to(200, 0, 0)
            raise ValueError("mine")

        with pytest.raises(MotionStopped):
            lost.wait()


def test_errors_are_those_of_the_asynchronous_arm() -> None:
    with simulate(speed=50) as sim, Magician.connect(sim.url) as arm:
        before = arm.link.stats.sent
        with pytest.raises(ValueError, match="x"):
            arm.move_to(float("nan"), 0, 0)

        with pytest.raises(TypeError):
            arm.queue.move_to("far", 0, 0)  # type: ignore[arg-type]

        assert arm.link.stats.sent == before
        with pytest.raises(ArmAlarm):
            arm.move_to(900, 0, 0)

        assert arm.get_alarms()
        arm.recover()
        arm.move_to(220, 0, 40)


@pytest.mark.parametrize("kind", [MyCobot, UltraArm])
def test_the_other_families(kind: type[Any]) -> None:
    model = "mycobot280" if kind is MyCobot else "ultraarm"
    with simulate(model, speed=20) as sim, kind.connect(sim.url) as arm:
        if kind is MyCobot:
            arm.power_on()
        else:
            arm.home()

        arm.queue.move_joints(*(10.0,) * len(arm.get_joints())).wait()
        assert [round(each) for each in arm.get_pose().joints[:3]] == [10, 10, 10]
        with pytest.raises(ZeroDivisionError), kind.connect(sim.url) as other:
            other.queue.move_joints(*(45.0,) * len(other.get_joints()))
            raise ZeroDivisionError

        assert not sim.arm.device.moving
        assert round(sim.arm.device.joints[0]) != 45


def test_the_pump_of_an_ultraarm_is_the_one_that_was_chosen() -> None:
    pumps: tuple[Literal["manual", "vendor"], ...] = ("manual", "vendor")
    for pump in pumps:
        with simulate("ultraarm", speed=50, homed=True) as sim, UltraArm.connect(sim.url, pump=pump) as arm:
            arm.suction(True)
            arm.queue.suction(True).wait()
            with arm.queue.batch() as batch:
                last = batch.suction(True)

            last.wait()
            assert {each.name for each in sim.arm.executed} == {"M23"} if pump == "manual" else {"M22"}


def test_a_gcode_program_runs_while_one_waits_or_iterates() -> None:
    lines = ["G90", "G0 X200 Y0 Z60 F100", "G0 X200 Y20 Z60"]
    with simulate("ultraarm", speed=50, homed=True) as sim, UltraArm.connect(sim.url) as arm:
        arm.run_gcode(lines).wait()
        assert round(sim.arm.pose.y) == 20
        assert [line.number for line in arm.run_gcode(lines)] == [1, 2, 3]


def test_a_stream_draws_from_a_generator_that_asks_the_arm_itself() -> None:
    with simulate(speed=50) as sim, Magician.connect(sim.url) as arm:

        class Step:
            command = c.SET_PTP_CMD

            def __init__(self, y: float) -> None:
                self.value = c.PTPCmd(PTPMode.MOVJ_XYZ, 220, y, arm.get_pose().z * 0 + 40, 0)

        arm.queue.stream([Step(0), Step(10)]).wait()
        done = list(arm.queue.stream(Step(10 * number) for number in range(3)))
        assert [step.value.y for step in done] == [0, 10, 20]
        assert [each.value.y for each in sim.arm.executed if each.name == "SetPTPCmd"] == [0, 10, 0, 10, 20]


def test_events_and_states_are_iterated_over_until_the_connection_ends() -> None:
    with simulate(speed=50) as sim:
        with Magician.connect(sim.url) as arm:
            events, states = iter(arm.link.events), iter(arm.link.state)
            sim.faults.dup = 1.0
            arm.get_pose()
            assert isinstance(next(events), Unexpected)
            sim.faults.dup = 0.0

        assert list(states) == [LinkState.CLOSED]
        for _ in events:
            pass


def test_taught_points_are_iterated_over_and_leaving_the_loop_ends_the_teaching() -> None:
    with simulate(speed=50) as sim, Magician.connect(sim.url) as arm:
        with closing(arm.taught_points()) as points, ThreadPoolExecutor(1) as threads:
            found = threads.submit(next, points)
            until(lambda: arm.request(c.GET_HHT_TRIG_OUTPUT_ENABLED, None))
            sim.arm.guide_to(220, 30, 50)
            pose = found.result()
            assert (pose.x, pose.y, pose.z) == pytest.approx((220, 30, 50), abs=0.1)
            assert arm.request(c.GET_HHT_TRIG_OUTPUT_ENABLED, None)

        assert not arm.request(c.GET_HHT_TRIG_OUTPUT_ENABLED, None)


def test_an_arm_follows_a_target() -> None:
    with simulate(speed=1, homed=True) as sim, Magician.connect(sim.url) as arm:
        with arm.following(rate=30, max_speed=200) as follow:
            here = follow.here
            assert here
            x, y, z, *_ = here.numbers
            follow.target = (x, y + 10, z)
            follow.reach((x, y + 15, z))
            assert follow.sent > 0
            assert repr(follow.motion).endswith("pending>")
            with pytest.raises(ValueError, match="reach"):
                follow.target = (900, 0, 0)

        assert follow.motion.done
        assert sim.arm.pose.y == pytest.approx(y + 15, abs=1)


def test_functions_of_the_library_run_in_the_arms_thread() -> None:
    scene = Scene(pieces=[Piece("part", (250, 0))])
    with simulate(speed=50, homed=True, scene=scene) as sim, Magician.connect(sim.url) as arm:
        run(lambda: pick(arm.asynchronous, (250, 0, -53.5), tool="suction"))
        assert sim.scene.pieces["part"].position[2] > -130
        with pytest.raises(PartMissing):
            run(lambda: pick(arm.asynchronous, (200, 0, -53.5), tool="suction", check=lambda: False))


def test_hooks_are_called_and_must_not_wait() -> None:
    said: list[str] = []
    with simulate(speed=50) as sim, Magician.connect(sim.url) as arm:

        def hook(outgoing: bool, frame: object) -> None:
            try:
                arm.get_pose()
            except RuntimeError as error:
                said.append(str(error))

        arm.link.on_frame.add(hook)
        arm.get_pose()
        arm.link.on_frame.remove(hook)

    assert "must not wait" in said[0]


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt, SystemExit, GeneratorExit, asyncio.CancelledError])
def test_an_error_that_leaves_the_block_stops_the_arm(error: type[BaseException]) -> None:
    with simulate(speed=5) as sim:
        with pytest.raises(error) as caught, Magician.connect(sim.url) as arm:
            motion = arm.queue.move_to(*FAR)
            until(lambda: sim.arm.device.moving)
            raise error("mine")

        assert str(caught.value) == "mine"
        assert sim.arm.device.idle
        assert outcomes(sim) == ["aborted"]
        with pytest.raises(MotionStopped):
            motion.wait()

        with pytest.raises(ConnectionLost):
            arm.move_to(220, 0, 40)


def test_a_block_that_is_left_normally_stops_nothing() -> None:
    with simulate(speed=5) as sim:
        with Magician.connect(sim.url) as arm:
            arm.queue.move_to(*FAR)

        until(lambda: outcomes(sim) == ["done"])


def test_ctrl_c_in_a_call_stops_the_arm_before_it_comes_out() -> None:
    with simulate(speed=2) as sim, Magician.connect(sim.url) as arm, ctrl_c_once(lambda: sim.arm.device.moving):
        with pytest.raises(KeyboardInterrupt):
            arm.move_to(*FAR)

        assert sim.arm.device.idle  # within the block: the call itself has stopped it
        assert outcomes(sim) == ["aborted"]
        arm.move_to(220, 0, 40)


def test_ctrl_c_while_a_motion_of_the_queue_is_waited_for_ends_the_waiting() -> None:
    with simulate(speed=5) as sim, Magician.connect(sim.url) as arm, ctrl_c_once(lambda: sim.arm.device.moving):
        motion = arm.queue.move_to(*FAR)
        with pytest.raises(KeyboardInterrupt):
            motion.wait()

        assert not motion.done
        motion.wait()
        assert outcomes(sim) == ["done"]


@pytest.mark.parametrize("silent", ["connect", "move"])
def test_ctrl_c_comes_out_of_a_dead_line(silent: str) -> None:
    with simulate(speed=5) as sim:
        if silent == "connect":
            sim.faults.silent = True  # it hears, and says nothing
            connecting = Magician.connect(sim.url, timeout=60)
            with ctrl_c_once(lambda: sim.asynchronous._clients), pytest.raises(KeyboardInterrupt), connecting:
                pytest.fail("an arm that says nothing was connected")

            return

        cutting = ctrl_c_once(lambda: sim.arm.device.moving and cut(sim))
        with pytest.raises(KeyboardInterrupt) as caught, Magician.connect(sim.url) as arm, cutting:
            arm.move_to(*FAR)

        assert any("acknowledged" in note for note in caught.value.__notes__)


def cut(sim: Any) -> bool:
    """Nothing comes through any more."""
    sim.faults.silent = True
    return True


def test_several_threads_drive_one_arm() -> None:
    with simulate(speed=50) as sim, Magician.connect(sim.url) as arm, ThreadPoolExecutor(4) as threads:
        list(threads.map(lambda y: arm.move_to(220, y, 40), range(-40, 40, 10)))
        moves = [each.value.y for each in sim.arm.executed if each.name == "SetPTPCmd"]
        assert sorted(moves) == list(range(-40, 40, 10))


def test_a_stop_of_another_thread_ends_a_call() -> None:
    with simulate(speed=2) as sim, Magician.connect(sim.url) as arm, ThreadPoolExecutor(1) as threads:
        moving = threads.submit(arm.move_to, *FAR)
        until(lambda: sim.arm.device.moving)
        arm.stop()
        with pytest.raises(MotionStopped):
            moving.result()

        assert sim.arm.device.idle


def test_a_thread_that_waits_when_the_block_ends_is_told() -> None:
    with simulate(speed=2) as sim, ThreadPoolExecutor(1) as threads:
        with Magician.connect(sim.url) as arm:
            moving = threads.submit(arm.move_to, *FAR)
            until(lambda: sim.arm.device.moving)

        with pytest.raises((MotionStopped, ConnectionLost)):
            moving.result()


def test_connecting_from_several_threads_at_the_same_time() -> None:
    def visit(number: int) -> float:
        with Magician.connect("sim:?speed=50") as arm:
            arm.move_to(220, number, 40)
            return arm.get_pose().y

    with ThreadPoolExecutor(4) as threads:
        assert list(threads.map(visit, range(8))) == list(range(8))


async def test_it_works_where_a_loop_is_running_as_in_a_notebook() -> None:
    with Magician.connect("sim:?speed=50") as arm:
        arm.move_to(220, 0, 40)
        assert arm.get_pose().x == 220
        await asyncio.sleep(0)
        assert (await asyncio.to_thread(arm.get_pose)).x == 220


def test_one_cell_connects_and_others_drive() -> None:
    block = Magician.connect("sim:?speed=50")
    arm = block.__enter__()
    arm.move_to(220, 0, 40)
    block.__exit__(None, None, None)
    with pytest.raises(RuntimeError, match="once"):
        block.__enter__()


def test_objects_of_one_arm_are_equal() -> None:
    with Magician.connect("sim:?speed=50") as arm:
        assert arm.queue == arm.queue
        assert len({arm.link, arm.link}) == 1
        motion = arm.queue.move_to(220, 0, 40)
        motion.wait()
        assert motion == motion.asynchronous
        assert repr(motion).startswith("<Motion SetPTPCmd")


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
@pytest.mark.filterwarnings("ignore:This process:DeprecationWarning")
def test_a_forked_process_leaves_the_arms_of_its_parent_alone() -> None:
    with simulate(speed=50) as sim, Magician.connect(sim.url) as arm:
        sent = arm.link.stats.sent
        child = os.fork()
        if child == 0:
            code = 1
            try:
                arm.get_pose()
            except RuntimeError as error:
                code = 0 if "forked" in str(error) else 2
            finally:
                os._exit(code)

        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
        assert arm.link.stats.sent == sent
        arm.move_to(220, 0, 40)
