"""A recorded run that failed comes out the same when its program runs again on the recording."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from bad_line import BadLine, bad_lines
from replay_rig import ARMS, Log, outcome_of, recorded
from ultraarm_line import once
from virtual import run_virtual, virtual

from dobot_async import ConnectFailed, ConnectionLost, DobotError, Magician, MyCobot, ReplyTimeout
from dobot_async.arms.magician import commands as c
from dobot_async.simulator import Faults, Simulation, simulate
from dobot_async.traces import TraceFile, read_trace

MOVES = {"magician": b"\x54\x03", "mycobot": b"\x22", "ultraarm": b"X"}
"""Bytes of the motion's request."""
ANSWERS = {"magician": b"\x54\x03", "mycobot": b"\xfe\xfe\x03\x22", "ultraarm": b"QUEUE SIZE"}
"""Bytes of what acknowledges it."""
OUT_OF_REACH = {"magician": (900, 0, 0), "mycobot": (270, 270, 400, 0, 0, 0), "ultraarm": (330, 0, 0)}


async def moves(family: str, arm: Any, log: Log) -> None:
    """Two motions one after the other, looking in between."""
    if family == "mycobot":
        await log.step("first", arm.move_joints(10, 20, 30, 0, 0, 0))
        await log.step("pose", arm.get_joints())
        await log.step("second", arm.move_joints(-10, 0, 20, 0, 0, 0))
    else:
        await log.step("first", arm.move_to(220, 0, 40))
        await log.step("pose", arm.get_joints())
        await log.step("second", arm.move_to(200, 50, 40))

    await log.step("pose", arm.get_pose())


def lose_acknowledgement(family: str, line: BadLine, sim: Simulation) -> None:
    line.reply = once(ANSWERS[family], lambda _: [])


def lose_request(family: str, line: BadLine, sim: Simulation) -> None:
    line.request = once(MOVES[family], lambda _: [])


def go_silent(family: str, line: BadLine, sim: Simulation) -> None:
    def fall_silent(data: bytes) -> list[tuple[float, bytes]]:
        line.reply = lambda _: []
        return [(0, data)]

    line.request = once(MOVES[family], fall_silent)


def cut_in_two(family: str, line: BadLine, sim: Simulation) -> None:
    line.reply = once(ANSWERS[family], lambda data: [(0, data[: len(data) // 2])])


def raise_alarm(family: str, line: BadLine, sim: Simulation) -> None:
    if family == "magician":
        asyncio.get_running_loop().call_later(0.3, sim.arm.raise_alarm, 0x12)
    elif family == "mycobot":
        asyncio.get_running_loop().call_later(0.3, sim.arm.raise_error, 3, 97)
    else:
        line.reply = once(b"Moving", lambda data: [(0, b"ERROR: J2 lost\r\n" + data)])


SPOILS = [lose_acknowledgement, lose_request, go_silent, cut_in_two, raise_alarm]


@pytest.mark.cases(3)
@pytest.mark.parametrize("spoil", SPOILS, ids=lambda spoil: spoil.__name__)
@pytest.mark.parametrize("family", ARMS)
def test_what_failed_fails_alike(
    family: str, spoil: Callable[[str, BadLine, Simulation], None], tmp_path: Path
) -> None:
    async def run() -> None:
        arm, path = ARMS[family], tmp_path / "trace.jsonl"
        program = partial(moves, family)
        expected, executed = await recorded(arm, program, path, partial(spoil, family))
        assert executed  # the arm moved, or began to
        assert await outcome_of(arm, f"replay:{path}", program) == expected
        if spoil in {go_silent, raise_alarm}:
            assert any("MotionUnknown" in text or "ArmAlarm" in text for _, text in expected)

    run_virtual(run())


@pytest.mark.parametrize("family", ["magician", "mycobot"])
@virtual
async def test_a_target_out_of_reach_is_refused_alike(family: str, tmp_path: Path) -> None:
    async def program(arm: Any, log: Log) -> None:
        await log.step("move", arm.move_to(*OUT_OF_REACH[family]))
        await log.step("alarms", arm.get_alarms())
        await arm.clear_alarms()
        await log.step("again", arm.get_alarms())

    arm, path = ARMS[family], tmp_path / "trace.jsonl"
    expected, _ = await recorded(arm, program, path)
    assert "ArmAlarm" in expected[0][1]
    assert await outcome_of(arm, f"replay:{path}", program) == expected


@virtual
async def test_a_break_comes_when_it_came_and_lasts_as_long(tmp_path: Path) -> None:
    path = tmp_path / "trace.jsonl"

    async def program(url: str, breaking: Callable[[], None], **options: Any) -> tuple[float, int]:
        async with Magician.connect(url, reconnect=True, **options) as arm:
            asyncio.get_running_loop().call_later(1.0, breaking)
            began = asyncio.get_running_loop().time()
            await arm.move_to(220, 0, 40)
            motion = await arm.queue.move_to(200, 50, 40)
            await arm.queue.wait(3)
            await arm.queue.join()
            await motion
            return asyncio.get_running_loop().time() - began, arm.link.outages

    async with simulate(homed=True) as sim:
        took, outages = await program(sim.url, sim.unplug, record=path)

    assert outages == 1
    states = [line.text("state") for line in read_trace(path).lines if line.kind == "state"]
    assert states == ["reopening", "open", "closed"]
    again, outages = await program(f"replay:{path}", lambda: None)
    assert outages == 1
    assert again == pytest.approx(took, rel=0.2)


@virtual
async def test_a_lost_link_is_lost_again(tmp_path: Path) -> None:
    async def program(arm: Any, log: Log) -> None:
        await log.step("move", arm.move_to(220, 0, 40))
        await log.step("pose", arm.get_pose())

    path = tmp_path / "trace.jsonl"
    async with simulate(homed=True) as sim:
        asyncio.get_running_loop().call_later(0.2, sim.unplug)
        expected = await outcome_of(ARMS["magician"], sim.url, program, record=path)

    assert [text.split(":")[0] for _, text in expected] == ["ConnectionLost", "ConnectionLost"]
    again = await outcome_of(ARMS["magician"], f"replay:{path}", program)
    assert [text.split(":")[0] for _, text in again] == ["ConnectionLost", "ConnectionLost"]


@virtual
async def test_what_is_no_answer_is_told_in_the_same_words(tmp_path: Path) -> None:
    path = tmp_path / "trace.jsonl"
    with pytest.MonkeyPatch.context() as patch:
        bad_lines(patch)
        real = BadLine.__init__

        def noisy(line: BadLine, *arguments: Any, **options: Any) -> None:
            real(line, *arguments, **options)
            line.reply = lambda data: [(0, bytes(len(data)))]

        patch.setattr(BadLine, "__init__", noisy)
        async with simulate() as sim:
            with pytest.raises(ConnectFailed, match="bytes that are no answer of a Magician") as first:
                async with Magician.connect(sim.url, record=path):
                    pass

    with pytest.raises(ConnectFailed, match="bytes that are no answer of a Magician") as second:
        async with Magician.connect(f"replay:{path}"):
            pass

    assert str(second.value) == str(first.value).replace(sim.url, f"replay:{path}")


@virtual
async def test_another_program_is_told_that_it_is_another_one(tmp_path: Path) -> None:
    path = tmp_path / "trace.jsonl"
    async with simulate(homed=True) as sim, Magician.connect(sim.url, record=path) as arm:
        await arm.move_to(220, 0, 40)

    async with Magician.connect(f"replay:{path}") as arm:
        began = asyncio.get_running_loop().time()
        with pytest.raises(ConnectionLost, match="is this the program that was recorded"):
            await arm.move_to(210, 0, 40)

        assert asyncio.get_running_loop().time() - began < 5

    async with Magician.connect(f"replay:{path}") as arm:
        await arm.move_to(220, 0, 40)
        with pytest.raises(ConnectionLost, match="is this the program that was recorded"):
            await arm.move_to(220, 0, 40)  # it was done once


@virtual
async def test_what_is_asked_more_often_is_answered_as_the_last_time(tmp_path: Path) -> None:
    path = tmp_path / "trace.jsonl"
    async with simulate(homed=True) as sim, Magician.connect(sim.url, record=path) as arm:
        await arm.move_to(220, 0, 40)
        expected = await arm.get_pose()

    async with Magician.connect(f"replay:{path}") as arm:
        await arm.move_to(220, 0, 40)
        for _ in range(5):
            assert await arm.get_pose() == expected
            await asyncio.sleep(1)


@virtual
async def test_an_arm_that_had_fallen_silent_stays_silent(tmp_path: Path) -> None:
    path = tmp_path / "trace.jsonl"
    async with simulate(homed=True) as sim, Magician.connect(sim.url, record=path, on_error="leave") as arm:
        await arm.get_pose()
        sim.faults.silent = True
        with pytest.raises(ReplyTimeout):
            await arm.get_pose(timeout=3)

    async with Magician.connect(f"replay:{path}", on_error="leave") as arm:
        await arm.get_pose()
        for _ in range(3):
            with pytest.raises(ReplyTimeout):
                await arm.get_pose(timeout=3)


@virtual
async def test_one_arm_of_several_is_chosen(tmp_path: Path) -> None:
    path = tmp_path / "trace.jsonl"
    with TraceFile(path) as file:
        async with (
            simulate("magician") as left,
            simulate("mycobot280") as right,
            Magician.connect(left.url, record=file.named("left")) as magician,
            MyCobot.connect(right.url, record=file.named("right")) as mycobot,
        ):
            pose, joints = await magician.get_pose(), await mycobot.get_joints()

    with pytest.raises(ValueError, match="several arms, left, right: say which"):
        async with Magician.connect(f"replay:{path}"):
            pass

    with pytest.raises(ValueError, match="trace of a mycobot280, and no magician"):
        async with Magician.connect(f"replay:{path}?arm=right"):
            pass

    async with (
        Magician.connect(f"replay:{path}?arm=left") as magician,
        MyCobot.connect(f"replay:{path}?arm=right") as mycobot,
    ):
        assert (await magician.get_pose(), await mycobot.get_joints()) == (pose, joints)


@virtual
async def test_a_secret_is_answered_by_what_stands_for_it(tmp_path: Path) -> None:
    path = tmp_path / "trace.jsonl"
    async with simulate() as sim, Magician.connect(sim.url, record=path) as arm:
        await arm.request(c.SET_WIFI_PASSWORD, "hunter2")
        assert await arm.request(c.GET_WIFI_PASSWORD, None) == "hunter2"

    assert "hunter2" not in path.read_text()
    assert b"hunter2".hex(" ") not in path.read_text()
    async with Magician.connect(f"replay:{path}") as arm:
        await arm.request(c.SET_WIFI_PASSWORD, "of another network")
        assert await arm.request(c.GET_WIFI_PASSWORD, None) == "***"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is no trace: its first line does not say so"),
        ("{}\n", "line 1 is no line of a trace"),
        ("[]\n", "line 1 is no line of a trace"),
        ('{"kind": "trace", "t": 0, "time": 0, "version": 2, "part": 1}\n', "version 2; this reads version 1"),
        ('{"kind": "trace", "t": 0, "time": 0, "version": 1, "part": 3}\n', "was rotated away"),
        ('{"kind": "trace", "t": 0, "time": 0, "version": 1, "part": 1}\n', "has 0 connections"),
        ('{"kind": "frame", "t": 0, "time": 0}\n', "is no trace"),
    ],
)
@virtual
async def test_a_file_that_is_no_trace_is_refused(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "trace.jsonl"
    path.write_text(text)
    with pytest.raises(ValueError, match=message):
        async with Magician.connect(f"replay:{path}"):
            pass


@virtual
async def test_a_file_that_is_not_there_cannot_be_reached(tmp_path: Path) -> None:
    with pytest.raises(ConnectFailed, match=r"cannot read the trace .*: No such file"):
        async with MyCobot.connect(f"replay:{tmp_path}/none"):
            pass

    with pytest.raises(ValueError, match="expected replay:FILE"):
        async with MyCobot.connect("replay:"):
            pass

    with pytest.raises(ValueError, match="unknown option 'speed'; known: arm, connection"):
        async with Magician.connect(f"replay:{tmp_path}/none?speed=2"):
            pass


@virtual
async def test_a_datagram_link_is_replayed_as_one(tmp_path: Path) -> None:
    path = tmp_path / "trace.jsonl"
    async with (
        simulate(homed=True, faults=Faults(loss=0.1, dup=0.2, jitter=0.004), seed=5) as sim,
        Magician.connect(sim.url, record=path) as arm,
    ):
        for x in (220, 210, 200):
            await arm.move_to(x, 0, 40)

        assert arm.link.reorder_window > 0
        window = arm.link.reorder_window

    async with Magician.connect(f"replay:{path}") as arm:
        assert arm.link.reorder_window == window
        for x in (220, 210, 200):
            await arm.move_to(x, 0, 40)


async def test_it_goes_by_the_real_clock_too(tmp_path: Path) -> None:
    path = tmp_path / "trace.jsonl"

    async def program(url: str, **options: Any) -> str:
        async with Magician.connect(url, **options) as arm:
            await arm.home()
            await arm.move_to(220, 0, 40)
            with pytest.raises(DobotError) as failed:
                await arm.move_to(900, 0, 0)

            return f"{type(failed.value).__name__}: {failed.value}"

    expected = await program("sim:?speed=20", record=path)
    assert await program(f"replay:{path}") == expected
    assert json.loads(path.read_text().splitlines()[0])["version"] == 1
