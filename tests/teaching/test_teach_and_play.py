"""Recording and playing: what the simulated arm was shown, and what it has executed."""

from __future__ import annotations

import asyncio
import math
from contextlib import aclosing
from pathlib import Path
from typing import Any

import pytest
from virtual import virtual

from dobot_async import CommandRejected, Magician, MotionStopped, MyCobot, Pen, UltraArm, UnsupportedError
from dobot_async.arms.magician import commands as c
from dobot_async.arms.mycobot import commands as mycobot
from dobot_async.simulator import simulate
from dobot_async.simulator.scene import Piece, Scene
from dobot_async.teaching import (
    PathSample,
    Recorder,
    Recording,
    RecordingUnfit,
    TaughtStep,
    check_recording,
    from_json,
    load_recording,
    play,
    released,
    save_recording,
    to_json,
)

ON_TABLE = -138.0 + 25 + 59.5


def targets(sim: Any) -> list[tuple[Any, ...]]:
    """Mode and place of each point-to-point motion that a Magician has done."""
    found = [each.value for each in sim.arm.executed if each.command is c.SET_PTP_CMD]
    return [(each.ptp_mode.name, *(round(getattr(each, axis), 2) for axis in "xyz")) for each in found]


def magician(*steps: TaughtStep) -> Recording:
    return Recording("magician", steps=steps)


# Teaching


@virtual
async def test_the_key_of_a_magician_takes_points() -> None:
    async with simulate(homed=True) as sim, Magician.connect(sim.url) as arm:
        recorder = Recorder(arm, tool="suction")
        places = [(220.0, 30.0, 50.0), (200.0, -40.0, 20.0)]
        found = []

        async def hand() -> None:
            for place in places:
                await asyncio.sleep(1)
                sim.arm.guide_to(*place)

        guiding = asyncio.create_task(hand())
        async with aclosing(recorder.from_key()) as steps:
            async for step in steps:
                found.append(step)
                if len(found) == 2:
                    break

        await guiding
        recording = recorder.recording
        assert recording.steps == tuple(found)
        assert [step.pose[:3] for step in found] == [pytest.approx(place, abs=1e-3) for place in places]
        assert found[1].joints == pytest.approx(sim.arm.pose.joints, abs=1e-3)
        assert (recording.family, recording.tool) == ("magician", "suction")
        assert recording.tool_offset == pytest.approx((59.7, 0, 0), abs=1e-4)
        assert not sim.arm.executed
        assert from_json(to_json(recording)) == recording


@virtual
async def test_a_released_cobot_is_led_and_plays_that_in_its_time() -> None:
    """A wave of joint 1, with a rest of a second in the middle."""
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url, model="mycobot280") as arm:
        recorder = Recorder(arm)
        async with released(arm):
            assert sim.arm.released == set(range(1, 7))
            sim.arm.guide_to(0, -20, 10, 0, 0, 0)
            async for sample in recorder.samples(20, seconds=4):
                turned = (
                    20 * sample.time
                    if sample.time < 1.5
                    else 30
                    if sample.time < 2.5
                    else 30 - 20 * (sample.time - 2.5)
                )
                sim.arm.guide_to(turned, -20, 10, 0, 0, 0)

        assert not sim.arm.released
        recording = recorder.recording
        assert recording.model == "mycobot280"
        assert len(recording.path) == pytest.approx(80, abs=3)
        assert recording.duration == pytest.approx(4, abs=0.1)
        assert len(recording.thinned(1).path) < 10

        began = asyncio.get_running_loop().time()
        await play(arm, recording)
        took = asyncio.get_running_loop().time() - began
        assert sim.arm.joints == pytest.approx(recording.path[-1].joints, abs=0.5)
        assert recording.duration <= took < recording.duration + 4
        turns = [each.value.angles[0] for each in sim.arm.executed if each.command is mycobot.SEND_ANGLES]
        assert max(turns) == pytest.approx(30, abs=1)
        speeds = [each.value.speed for each in sim.arm.executed if each.command is mycobot.SEND_ANGLES][1:]
        assert max(speeds) <= 14  # 20 of 150 degrees/s

        await play(arm, recording, reverse=True, speed=200)
        assert sim.arm.joints == pytest.approx(recording.path[0].joints, abs=0.5)


@virtual
async def test_a_cobot_holds_again_whatever_ends_the_leading() -> None:
    async with simulate("myarm300") as sim, MyCobot.connect(sim.url, model="myarm300") as arm:
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(1), released(arm):
                assert sim.arm.released
                await asyncio.sleep(60)

        assert not sim.arm.released
        await arm.queue.move_joints(50, 0, 0, 0, 0, 0, 0, speed=5)
        with pytest.raises(CommandRejected, match="motions are under way"):
            async with released(arm):
                pass

        assert not sim.arm.released
        await arm.stop()


@virtual
async def test_an_ultraarm_that_does_not_notice_where_it_is_led_says_so() -> None:
    async with simulate("ultraarm", homed=True) as sim, UltraArm.connect(sim.url) as arm:
        recorder = Recorder(arm)
        with pytest.raises(CommandRejected, match="same place since it was released"):
            async with released(arm):
                assert not sim.arm.registers.powered
                async for _ in recorder.samples(10, seconds=2):
                    sim.arm.guide_to(20, 10, 10, 0)

        assert sim.arm.registers.powered
        await arm.home()


@virtual
async def test_an_ultraarm_is_sampled_while_it_is_jogged() -> None:
    async with simulate("ultraarm", homed=True) as sim, UltraArm.connect(sim.url) as arm:
        await arm.move_joints(0, 10, 10)
        recorder = Recorder(arm)
        async with arm.jogging("j1+", speed=20):
            async for _ in recorder.samples(10, seconds=1):
                pass

        path = recorder.recording.path
        assert path[-1].joints[0] > path[0].joints[0] + 1
        await play(arm, recorder.recording)
        assert sim.arm.angles.j1 == pytest.approx(path[-1].joints[0], abs=0.1)


@virtual
async def test_a_tool_is_taken_down_where_it_was_switched() -> None:
    scene = Scene(pieces=[Piece("red", (250, 0))])
    async with simulate(scene=scene) as sim, Magician.connect(sim.url) as arm:
        await arm.home()
        recorder = Recorder(arm)
        await arm.move_to(250, 0, 20)
        await recorder.point(name="above")
        await arm.move_to(250, 0, ON_TABLE)
        await recorder.point(mode="line", pause=0.5)
        await recorder.suction(True)
        assert recorder.recording.steps[1].suction is True
        assert scene.pieces["red"].on == "tool of"
        await arm.move_to(250, 0, 20)
        await recorder.suction(False)
        assert [step.suction for step in recorder.recording.steps] == [None, True, False]
        assert recorder.undo() is not None
        recorder.change_last(name="here", mode="point")
        assert recorder.recording.steps[-1].name == "here"
        assert (recorder.undo(), recorder.undo(), recorder.undo())[2] is None
        assert not recorder.recording.steps


@virtual
async def test_what_is_not_for_an_arm_is_said() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url, model="mycobot280") as arm:
        recorder = Recorder(arm)
        with pytest.raises(UnsupportedError, match="key"):
            await anext(recorder.from_key())

        with pytest.raises(UnsupportedError, match="suction"):
            await recorder.suction(True)

        assert not recorder.recording.steps
        with pytest.raises(ValueError, match="rate"):
            await anext(recorder.samples(0))

        await recorder.point()
        with pytest.raises(ValueError, match="steps in the recording"):
            await anext(recorder.samples(10))

        with pytest.raises(ValueError, match="of a magician, not of a mycobot280"):
            Recorder(arm, recording=Recording("magician"))

    async with simulate() as second, Magician.connect(second.url) as other:
        with pytest.raises(UnsupportedError, match="forearm"):
            async with released(other):
                pass

    with pytest.raises(TypeError, match="expected a Magician"):
        Recorder(Scene())  # type: ignore[arg-type]


# Playing


@virtual
async def test_steps_are_played_as_they_were_taught() -> None:
    scene = Scene(pieces=[Piece("red", (250, 0))])
    recording = magician(
        TaughtStep((250, 0, 20, 0)),
        TaughtStep((250, 0, ON_TABLE, 0), mode="line", suction=True, pause=2),
        TaughtStep((250, 0, 20, 0), mode="line"),
        TaughtStep((200, 100, ON_TABLE, 0), mode="jump", suction=False),
        TaughtStep((), (10, 30, 30, 0), mode="joints"),
    )
    async with simulate(scene=scene) as sim, Magician.connect(sim.url) as arm:
        await arm.home()
        told: list[tuple[int, int]] = []
        await play(arm, recording, progress=lambda done, total: told.append((done, total)))
        assert targets(sim) == [
            ("MOVJ_XYZ", 250, 0, 20),
            ("MOVL_XYZ", 250, 0, ON_TABLE),
            ("MOVL_XYZ", 250, 0, 20),
            ("JUMP_XYZ", 200, 100, ON_TABLE),
            ("MOVJ_ANGLE", 10, 30, 30),
        ]
        assert told == [(number, 5) for number in range(1, 6)]
        assert sum(each.value.timeout for each in sim.arm.executed if each.name == "SetWAITCmd") >= 2400
        assert scene.pieces["red"].position == pytest.approx((200, 100, -138), abs=0.01)

        await play(arm, magician(*recording.steps[:4]), reverse=True)
        assert scene.pieces["red"].position == pytest.approx((250, 0, -138), abs=0.01)
        assert targets(sim)[5:] == [
            ("MOVJ_XYZ", 200, 100, ON_TABLE),
            ("JUMP_XYZ", 250, 0, 20),
            ("MOVL_XYZ", 250, 0, ON_TABLE),
            ("MOVL_XYZ", 250, 0, 20),
        ]


@virtual
async def test_an_arc_is_played_both_ways() -> None:
    ends = TaughtStep((200, -60, 50, 0)), TaughtStep((200, 60, 50, 0), mode="arc", via=(240, 0, 50, 0))
    async with simulate(homed=True) as sim, Magician.connect(sim.url) as arm:
        await play(arm, magician(*ends))
        assert (sim.arm.pose.x, sim.arm.pose.y) == pytest.approx((200, 60), abs=0.01)
        await play(arm, magician(*ends), reverse=True)
        arcs = [each.value for each in sim.arm.executed if each.name == "SetARCCmd"]
        assert [(each.cir_point.x, each.to_point.y) for each in arcs] == [(240, 60), (240, -60)]


@virtual
async def test_loops_and_speed() -> None:
    recording = magician(TaughtStep((220, 0, 40, 0)), TaughtStep((220, 50, 40, 0)))
    async with simulate(homed=True) as sim, Magician.connect(sim.url) as arm:
        await arm.set_speed(70, 60)
        clock = asyncio.get_running_loop().time
        await play(arm, recording)
        began = clock()
        await play(arm, recording, loops=2, speed=100)
        fast = clock() - began
        await play(arm, recording, loops=2, speed=10)
        assert clock() - began - fast > 3 * fast
        assert len(targets(sim)) == 2 + 4 + 4
        assert await arm.request(c.GET_PTP_COMMON_PARAMS, None) == c.PTPCommonParams(70, 60)


@virtual
async def test_it_goes_on_until_it_is_cancelled_and_then_stands() -> None:
    recording = magician(TaughtStep((220, 0, 40, 0)), TaughtStep((220, 50, 40, 0)))
    async with simulate(homed=True) as sim, Magician.connect(sim.url) as arm:
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(20.25):
                await play(arm, recording, loops=None)

        assert len(targets(sim)) > 10
        assert sim.arm.device.idle
        assert "aborted" in {each.outcome for each in sim.arm.executed}


@virtual
async def test_a_path_does_not_go_on_past_a_stop() -> None:
    """The arm is held still for a while, and nothing is under way when it is stopped."""
    still, away = (0.0, 30.0, 30.0, 0.0), (20.0, 30.0, 30.0, 0.0)
    path = PathSample(0, still), PathSample(5, still), PathSample(6, away)
    async with simulate(homed=True) as sim, Magician.connect(sim.url) as arm:
        await arm.move_joints(*still)
        playing = asyncio.create_task(play(arm, Recording("magician", path=path)))
        await asyncio.sleep(2)
        assert sim.arm.device.idle
        await arm.stop()
        with pytest.raises(MotionStopped):
            await playing

        assert sim.arm.pose.joints == pytest.approx(still, abs=0.1)


@virtual
async def test_a_stop_while_the_tool_is_told_is_the_end_of_a_playing() -> None:
    recording = magician(TaughtStep((220, 0, 40, 0), suction=True), TaughtStep((220, 60, 40, 0)))
    async with simulate(homed=True) as sim, Magician.connect(sim.url) as arm:
        stops: list[asyncio.Task[None]] = []
        tell = arm.suction

        async def suction(on: bool, **options: Any) -> None:
            stops.append(asyncio.create_task(arm.stop()))
            await tell(on, **options)
            await stops[0]

        arm.suction = suction  # type: ignore[method-assign]
        with pytest.raises(MotionStopped):
            await play(arm, recording)

        assert targets(sim) == [("MOVJ_XYZ", 220, 0, 40)]


@virtual
async def test_a_cobot_and_an_ultraarm_play_lines_and_joints() -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url, model="mycobot280") as arm:
        recorder = Recorder(arm)
        await arm.move_joints(0, -30, -60, 0, 0, 0)
        await recorder.point()
        await arm.move_by(z=-20)
        await recorder.point(mode="line")
        await recorder.gripper(False)
        await recorder.gripper_to(40)
        recording = recorder.recording
        assert [(step.mode, step.gripper) for step in recording.steps] == [
            ("joints", None),
            ("line", 100),
            ("joints", 40),
        ]
        await arm.home()
        before = len(sim.arm.executed)
        await play(arm, recording, speed=30)
        done = [
            each for each in sim.arm.executed[before:] if each.command in {mycobot.SEND_ANGLES, mycobot.SEND_COORDS}
        ]
        assert [each.value.speed for each in done] == [30] * len(done)
        assert done[1].value.mode is mycobot.MoveMode.LINEAR
        assert sim.arm.coords[:3] == pytest.approx(recording.steps[-1].pose[:3], abs=1)
        assert await arm.get_gripper() == 40

    async with simulate("ultraarm", homed=True) as second, UltraArm.connect(second.url) as other:
        steps = (
            TaughtStep((220, 0, 40, 0)),
            TaughtStep((220, 40, 40, 0), mode="line"),
            TaughtStep((), (0, 20, 20, 0), "joints"),
        )
        await play(other, Recording("ultraarm", steps=steps), speed=25)
        feeds = [(each.name, each.value.f) for each in second.arm.executed if each.value]
        assert feeds == [("G0", 50), ("G1", 50), ("M11", 50)]


# What is wrong is found before anything moves

HERE = TaughtStep((220, 0, 40, 0))


@pytest.mark.parametrize(
    ("recording", "words"),
    [
        (Recording("mycobot", "mycobot280", steps=(HERE,)), "family 'mycobot', and this is a 'magician'"),
        (
            Recording("magician", tool="pen", tool_offset=(61, 0, 0), steps=(HERE,)),
            r"tool \(pen\) at \(61.0, 0.0, 0.0\)",
        ),
        (magician(), "nothing in it"),
        (magician(HERE, TaughtStep((400, 0, 0, 0), name="far")), r"step 2 \(far\): .*too far"),
        (magician(TaughtStep((), (0, 95, 0, 0), mode="joints")), "joint 2 would be 95"),
        (magician(HERE, TaughtStep((240, 0, 40, 0), mode="arc", via=(0, 0, 40, 0))), "axis of joint 1"),
        (
            magician(TaughtStep((80, 200, 40, 0)), TaughtStep((80, -200, 40, 0), mode="line")),
            "step 2: on the straight line to it",
        ),
        (magician(TaughtStep((220, 0, 40))), "pose has 3 numbers, and this arm 4"),
        (magician(TaughtStep((220, 0, 40, 0), gripper=40)), "open .*closed .*or off, not 40 percent"),
        (
            Recording("magician", path=(PathSample(0, (0, 45, 45, 0)), PathSample(1, (0, 45, 99, 0)))),
            "sample 2: .*joint 3",
        ),
    ],
)
@virtual
async def test_a_magician_refuses_what_it_cannot_play(recording: Recording, words: str) -> None:
    async with simulate(homed=True) as sim, Magician.connect(sim.url) as arm:
        with pytest.raises(RecordingUnfit, match=words):
            await play(arm, recording)

        assert not sim.arm.executed
        if recording.steps and "tool" not in words and "family" not in words:
            with pytest.raises(RecordingUnfit, match=words):
                check_recording(recording)


@pytest.mark.parametrize(
    ("recording", "words"),
    [
        (
            Recording("mycobot", "myarm300", steps=(TaughtStep((), (0,) * 7, "joints"),)),
            "from a myarm300, and this is a mycobot280",
        ),
        (Recording("mycobot", "mycobot280", steps=(TaughtStep((), (0,) * 5, "joints"),)), "5 numbers, and this arm 6"),
        (Recording("mycobot", "mycobot280", steps=(TaughtStep((), (170, 0, 0, 0, 0, 0), "joints"),)), "joint 1"),
        (Recording("mycobot", "mycobot280", steps=(TaughtStep((300, 0, 200, 0, 0, 0)),)), "x must be in"),
        (Recording("mycobot", "mycobot280", steps=(TaughtStep((200, 0, 200, 0, 0, 0), mode="jump"),)), "mode 'jump'"),
        (Recording("mycobot", "mycobot280", steps=(TaughtStep((200, 0, 200, 0, 0, 0), suction=True),)), "no suction"),
        (Recording("mycobot", "mycobot280", steps=(TaughtStep((200, 0, 200, 0, 0, 0), gripper="off"),)), "no air"),
    ],
)
@virtual
async def test_a_cobot_refuses_what_it_cannot_play(recording: Recording, words: str) -> None:
    async with simulate("mycobot280") as sim, MyCobot.connect(sim.url, model="mycobot280") as arm:
        with pytest.raises(RecordingUnfit, match=words):
            await play(arm, recording)

        assert not sim.arm.executed


@virtual
async def test_the_limits_of_the_connection_count() -> None:
    steps = (TaughtStep((), (0, 50, 0, 0, 0, 0), "joints"),)
    for model in ("mycobot280", "mycobot280pi"):  # built alike
        async with simulate(model) as sim, MyCobot.connect(sim.url, model=model, limits={"j2": (-20, 20)}) as arm:
            recording = Recording("mycobot", "mycobot280", steps=steps)
            check_recording(recording)
            with pytest.raises(RecordingUnfit, match="joint 2 must be in -20 to 20 degrees"):
                check_recording(recording, arm)


def test_without_an_arm_the_usual_limits_count() -> None:
    with pytest.raises(RecordingUnfit, match="z must be in -130 to 135"):
        check_recording(Recording("ultraarm", steps=(TaughtStep((220, 0, 140, 0)),)))

    with pytest.raises(RecordingUnfit, match="no family 'scara'"):
        check_recording(Recording("scara"))

    with pytest.raises(RecordingUnfit, match="no model 'mycobot9000'"):
        check_recording(Recording("mycobot", "mycobot9000", steps=(HERE,)))


@virtual
async def test_a_tool_that_was_told_afterwards_counts() -> None:
    recording = Recording("magician", tool_offset=(61, 0, 0), steps=(HERE,))
    async with simulate(homed=True) as sim, Magician.connect(sim.url) as arm:
        with pytest.raises(ValueError, match="set_end_effector"):
            Recorder(arm, recording=recording)

        await arm.set_end_effector(Pen())
        await play(arm, recording)
        assert len(targets(sim)) == 1


@pytest.mark.parametrize(
    ("options", "kind", "words"),
    [
        ({"speed": 0}, ValueError, "speed must be above 0 and at most 100 percent"),
        ({"speed": 101}, ValueError, "speed"),
        ({"speed": math.nan}, ValueError, "speed"),
        ({"speed": "fast"}, TypeError, "speed"),
        ({"loops": 0}, ValueError, "loops must be 1 or more"),
        ({"loops": 1.5}, TypeError, "loops"),
    ],
)
@virtual
async def test_wrong_arguments_of_play(options: dict[str, Any], kind: type[Exception], words: str) -> None:
    async with simulate(homed=True) as sim, Magician.connect(sim.url) as arm:
        before = sim.arm.counters.requests
        with pytest.raises(kind, match=words):
            await play(arm, magician(HERE), **options)

        assert sim.arm.counters.requests == before


@virtual
async def test_an_arm_that_is_stopped_at_another_speed_gets_its_own_back() -> None:
    recording = magician(TaughtStep((220, 0, 40, 0)), TaughtStep((220, 50, 40, 0)))
    async with simulate(homed=True) as sim, Magician.connect(sim.url) as arm:
        await arm.set_speed(70, 60)
        playing = asyncio.create_task(play(arm, recording, speed=10))
        await asyncio.sleep(0.5)
        assert await arm.request(c.GET_PTP_COMMON_PARAMS, None) == c.PTPCommonParams(10, 10)
        await arm.stop()
        with pytest.raises(MotionStopped):
            await playing

        await asyncio.sleep(1)
        assert await arm.request(c.GET_PTP_COMMON_PARAMS, None) == c.PTPCommonParams(70, 60)


@pytest.mark.full
@pytest.mark.parametrize("suffix", ["json", "playback"])
@virtual
async def test_what_is_taught_and_saved_does_the_same_in_another_scene(tmp_path: Path, suffix: str) -> None:
    file = tmp_path / f"carry.{suffix}"
    taught_in, played_in = (Scene(pieces=[Piece("red", (250, 0)), Piece("blue", (250, -60))]) for _ in range(2))
    async with simulate(scene=taught_in) as sim, Magician.connect(sim.url) as arm:
        await arm.home()
        recorder = Recorder(arm)
        for start, end in (((250, 0), (200, 100)), ((250, -60), (160, 120))):
            for (x, y), suck in ((start, True), (end, False)):
                await arm.move_to(x, y, 20)
                await recorder.point()
                await arm.move_to(x, y, ON_TABLE)
                await recorder.point(mode="line", pause=0.3)
                await recorder.suction(suck)
                await arm.move_to(x, y, 20)
                await recorder.point(mode="line")

        save_recording(recorder.recording, file)

    recording = load_recording(file)
    assert [step.suction for step in recording.steps] == [step.suction for step in recorder.recording.steps]
    async with simulate(scene=played_in) as sim, Magician.connect(sim.url) as arm:
        await arm.home()
        await play(arm, recording)
        assert not played_in.crashes
        for name, place in (("red", (200, 100, -138)), ("blue", (160, 120, -138))):
            assert taught_in.pieces[name].position == pytest.approx(place, abs=0.1)
            assert played_in.pieces[name].position == pytest.approx(taught_in.pieces[name].position, abs=0.1)
