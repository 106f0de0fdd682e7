"""Functions that take an arm, without asyncio: what the arm recorded, and what is in the scene, decides."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import AsyncGenerator, Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import pytest

from dobot_async import Magician as AsyncMagician
from dobot_async import Pen
from dobot_async.discovery import DiscoveryProblem, Found
from dobot_async.handling import PartMissing
from dobot_async.simulator.scene import GripperTool, Mount, Piece, Scene
from dobot_async.sync import (
    Drawing,
    Magician,
    MyCobot,
    Recorder,
    check_recording,
    check_toolpath,
    discover,
    draw,
    engrave,
    estimate,
    figures_of,
    gripper_holds,
    pick,
    pick_and_place,
    place,
    play,
    reach_of,
    reachable,
    read_figures,
    released,
    run,
    simulate,
)
from dobot_async.teaching import load_recording, save_recording
from dobot_async.toolpath import Stroke, Toolpath, WorkPlane

ON_TABLE = -138.0 + 25 + 59.5
SOURCE, TARGET = (250.0, 0.0, ON_TABLE), (200.0, 100.0, ON_TABLE)
SQUARE = Toolpath((Stroke(((0, 0), (20, 0), (20, 20), (0, 20), (0, 0))),))
PAPER = WorkPlane.flat(220, -10, 0)


def until(holds: Callable[[], object]) -> None:
    """Wait until something holds."""
    for _ in range(30_000):
        if holds():
            return

        threading.Event().wait(0.001)

    raise AssertionError("it does not come about")


@contextmanager
def ctrl_c_once(holds: Callable[[], object]) -> Iterator[None]:
    """Press Ctrl-C in the main thread as soon as something holds."""
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


def aborted(sim: Any) -> list[str]:
    """What the arm did not bring to its end."""
    return [each.name for each in sim.arm.executed if each.outcome == "aborted"]


@contextmanager
def cell(speed: float = 50, **details: Any) -> Iterator[tuple[Any, Magician]]:
    """An arm, and a red piece in front of it."""
    scene = Scene(pieces=[Piece("red", SOURCE[:2])])
    with simulate(speed=speed, homed=True, scene=scene, **details) as sim, Magician.connect(sim.url) as arm:
        yield sim, arm


def test_a_part_is_carried() -> None:
    with cell() as (sim, arm):
        pick_and_place(arm, SOURCE, TARGET, tool="suction")
        assert sim.scene.pieces["red"].position == pytest.approx((200, 100, -138), abs=0.01)
        pick(arm, TARGET, tool="suction")
        place(arm, SOURCE, tool="suction")
        assert sim.scene.pieces["red"].position == pytest.approx((250, 0, -138), abs=0.01)


def test_a_tool_and_a_check_of_ones_own_may_command_the_arm() -> None:
    asked: list[float] = []

    with cell() as (sim, arm):

        def cup(take: bool) -> None:
            arm.suction(take)

        def check() -> bool:
            asked.append(arm.get_pose().z)
            return bool(sim.arm.suction)

        pick(arm, SOURCE, tool=cup, check=check, settle=0.3)
        assert asked == [pytest.approx(ON_TABLE + 40, abs=0.1)]
        assert sim.scene.pieces["red"].position[2] > -138
        with pytest.raises(PartMissing, match="no part to pick"):
            pick(arm, (200, 50, ON_TABLE), tool=cup, check=lambda: False)


def test_a_tool_that_fails_is_told_and_nothing_moves_on() -> None:
    with cell() as (sim, arm):
        with pytest.raises(ZeroDivisionError):
            pick(arm, SOURCE, tool=lambda take: 1 / 0)

        done = [each.value.z for each in sim.arm.executed if each.name == "SetPTPCmd"]
        assert done == pytest.approx([ON_TABLE + 40, ON_TABLE])


@pytest.mark.parametrize("where", ["on the way", "in the tool"])
def test_ctrl_c_stops_a_picking(where: str) -> None:
    inside = threading.Event()

    def cup(take: bool) -> None:
        inside.set()
        arm.wait(300)

    with cell(speed=2) as (sim, arm):
        device = sim.arm.device
        holds = {"on the way": lambda: device.moving, "in the tool": lambda: inside.is_set() and bool(device.executing)}
        with ctrl_c_once(holds[where]), pytest.raises(KeyboardInterrupt):
            pick(arm, SOURCE, tool=cup)

        assert sim.arm.device.idle
        assert aborted(sim) == (["SetPTPCmd"] if where == "on the way" else ["SetWAITCmd"])
        until(lambda: not [each for each in threading.enumerate() if "function" in each.name])
        arm.move_to(220, 0, 40)


@pytest.mark.parametrize("wrong", ["the URL of an arm", None, 5])
def test_what_is_no_arm_is_told_before_anything_is_sent(wrong: Any) -> None:
    with pytest.raises(TypeError, match=r"expected an arm of dobot_async\.sync"):
        pick(wrong, SOURCE, tool="suction")

    with pytest.raises(TypeError, match=r"expected an arm of dobot_async\.sync"):
        draw(wrong, SQUARE, PAPER)

    with pytest.raises(TypeError, match="expected"):
        Recorder(wrong)


def test_an_arm_of_programs_that_await_is_told_apart() -> None:
    with Magician.connect("sim:?speed=50") as arm:
        awaiting: Any = arm.asynchronous
        assert type(arm.asynchronous) is AsyncMagician
        with pytest.raises(TypeError, match=r"an arm of dobot_async\.sync"):
            pick(awaiting, SOURCE, tool="suction")

        with pytest.raises(TypeError, match=r"an arm of dobot_async\.sync"):
            reach_of(awaiting)

        assert not figures_of(arm).motions


def test_a_picture_is_drawn_and_estimated() -> None:
    told: list[int] = []
    with simulate(speed=50, homed=True) as sim, Magician.connect(sim.url) as arm:
        arm.set_end_effector(Pen())
        check_toolpath(arm, SQUARE, PAPER)
        reach_of(arm)((220, 0, 0))
        assert reachable(arm, PAPER)(0, 0)
        assert estimate(SQUARE, PAPER, arm=arm).seconds > 0
        assert estimate(SQUARE, PAPER, arm="ultraarm").seconds > 0
        draw(arm, SQUARE, PAPER, progress=lambda progress: told.append(progress.strokes))
        corners = {(each.value.x, each.value.y) for each in sim.arm.executed if each.name == "SetCPCmd"}
        assert {(220, -10), (240, -10), (240, 10), (220, 10)} <= corners
        assert told[-1] == 1
        engrave(arm, SQUARE, PAPER)
        assert sim.arm.executed[-1].outcome == "done"
        assert not sim.arm.laser


@pytest.mark.full
def test_ctrl_c_stops_a_drawing_which_goes_on_where_it_was() -> None:
    two = Toolpath((*SQUARE.strokes, Stroke(((0, 0), (20, 20)))))
    with simulate(speed=1, homed=True) as sim, Magician.connect(sim.url) as arm:
        arm.set_end_effector(Pen())
        arm.move_to(220, 0, 10)
        drawing = Drawing(arm, two, PAPER, speed=10)
        begun = len(sim.arm.executed)
        with ctrl_c_once(lambda: len(sim.arm.executed) > begun + 3), pytest.raises(KeyboardInterrupt) as caught:
            drawing.run()

        assert sim.arm.device.idle
        assert any("draws the rest" in note for note in caught.value.__notes__)
        assert drawing.next_stroke == 0
        assert drawing.how_to_go_on() == "first=0"
        with pytest.raises(ValueError, match="stroke"):
            drawing.run(first=7)


def test_an_arm_is_taught_and_plays() -> None:
    done: list[tuple[int, int]] = []
    with cell() as (sim, arm):
        recorder = Recorder(arm, tool="cup")
        assert recorder.arm == arm
        arm.move_to(250, 0, 20)
        recorder.point(name="above")
        arm.move_to(*SOURCE)
        recorder.point(mode="line")
        recorder.suction(True)
        arm.move_to(250, 0, 20)
        recorder.point(mode="line")
        assert recorder.undo()
        recording = recorder.recording
        assert [each.name for each in recording.steps] == ["above", ""]
        check_recording(recording, arm)
        check_recording(recording)
        arm.suction(False)
        play(arm, recording, progress=lambda number, total: done.append((number, total)))
        assert done == [(1, 2), (2, 2)]
        assert sim.arm.suction
        assert sim.arm.pose.z == pytest.approx(ON_TABLE, abs=0.1)


def test_ctrl_c_stops_a_recording_that_is_played(tmp_path: Path) -> None:
    with cell(speed=2) as (sim, arm):
        recorder = Recorder(arm)
        for y in (100, -100):
            arm.move_to(220, y, 40)
            recorder.point()

        save_recording(recorder.recording, tmp_path / "part.json")
        with ctrl_c_once(lambda: sim.arm.device.moving), pytest.raises(KeyboardInterrupt):
            play(arm, load_recording(tmp_path / "part.json"), loops=None)

        assert sim.arm.device.idle
        assert aborted(sim) == ["SetPTPCmd"]


def test_a_path_is_shown_by_hand() -> None:
    with simulate("mycobot280", speed=50) as sim, MyCobot.connect(sim.url) as arm:
        arm.power_on()
        recorder = Recorder(arm)
        with released(arm):
            assert len(list(recorder.samples(20, seconds=0.2))) > 1

        assert len(recorder.recording.path) > 1
        assert gripper_holds(arm, least=1)() is (arm.get_gripper() > 1)


def test_a_key_takes_steps_until_the_loop_is_left() -> None:
    with simulate(speed=50, homed=True) as sim, Magician.connect(sim.url) as arm:
        recorder = Recorder(arm)
        with closing(recorder.from_key()) as steps:
            threading.Timer(0.2, lambda: until(lambda: taught(sim))).start()
            step = next(steps)

        assert step.pose[:3] == pytest.approx((220, 30, 50), abs=0.1)


def taught(sim: Any) -> bool:
    """Lead the arm to a place by its key."""
    sim.arm.guide_to(220, 30, 50)
    return True


def test_figures_are_read() -> None:
    with simulate(speed=50, homed=True) as sim, Magician.connect(sim.url) as arm:
        arm.clear_alarms()
        arm.move_to(220, 0, 40)
        assert read_figures(arm).alarms == 0
        assert figures_of(arm).motions == {"done": 1}


class OneArm:
    """A source of arms that finds one, and goes on to look."""

    name = "one"
    probes_at_once = 1

    def __init__(self) -> None:
        self.ended = threading.Event()

    async def search(self, timeout: float) -> AsyncGenerator[Found, None]:
        try:
            yield Found("sim:?speed=50", "one", "here", families=("magician",))
        finally:
            self.ended.set()


class Broken(OneArm):
    """One that cannot."""

    name = "broken"

    async def search(self, timeout: float) -> AsyncGenerator[Found, None]:
        if self.ended:
            raise OSError("there is no radio")

        yield Found("sim:", "broken", "nowhere")


def test_arms_are_looked_for() -> None:
    problems: list[DiscoveryProblem] = []
    source = OneArm()
    (found,) = discover(sources=[source, Broken()], timeout=0, probe=True, on_problem=problems.append)
    assert found.info
    assert found.info.name
    assert [each.message for each in problems] == ["there is no radio"]
    assert source.ended.is_set()
    with pytest.raises(ValueError, match="no source of arms is called 'smell'"):
        discover(sources=["smell"])


def test_a_search_that_is_forgotten_ends_and_leaves_no_thread() -> None:
    threads = set(threading.enumerate())
    for found in discover(sources=[OneArm(), OneArm()], timeout=0):
        assert found.url == "sim:?speed=50"
        break

    assert set(threading.enumerate()) == threads


def test_the_awaited_ones_are_still_there_for_run() -> None:
    with cell() as (_, arm):
        assert run(lambda: arm.asynchronous.get_pose()) == arm.get_pose()


def test_a_gripper_is_told_by_its_opening() -> None:
    with cell(mount=Mount(tool=GripperTool())) as (sim, arm):
        pick(arm, (250, 0, ON_TABLE - 12), tool="gripper")
        assert sim.scene.pieces["red"].position[2] > -138
