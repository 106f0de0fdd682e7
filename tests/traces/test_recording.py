"""What a trace has in it, how it is cut into parts, and that nothing of it stands in the way of an arm."""

from __future__ import annotations

import asyncio
import io
import json
import os
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
from replay_rig import ARMS
from virtual import run_virtual, virtual

from dobot_async import ArmAlarm, ConnectFailed, Fleet, Magician
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.frame import Frame
from dobot_async.fleet import Member
from dobot_async.simulator import simulate
from dobot_async.traces import Trace, TraceFile, read_trace

PROMISED = {
    "connection": {"family", "model", "url", "in_flight", "window", "reorder_window", "reply_timeout"},
    "frame": {"direction", "key", "command", "value", "raw"},
    "motion": {"motion", "name", "state"},
    "state": {"state"},
    "end": {"url", "stats"},
}
"""What docs/trace.md says that each kind of line has."""


@pytest.mark.parametrize("family", ARMS)
def test_frames_motions_and_the_end_are_recorded(family: str, tmp_path: Path) -> None:
    async def run() -> None:
        path, arm = tmp_path / "trace.jsonl", ARMS[family]
        async with simulate(arm.model, **arm.details) as sim:
            seen: list[tuple[bool, bytes]] = []
            async with arm.connect(sim.url, record=path) as connected:
                connected.link.on_frame.add(lambda outgoing, frame: seen.append((outgoing, bytes(frame))))
                await connected.get_pose()
                await connected.move_to(200, 20, 60)
                stats = connected.link.stats

            check_kinds(read_trace(path))
            trace = read_trace(path)
            frames = [(line.outgoing, bytes.fromhex(line.text("raw"))) for line in trace.lines if line.kind == "frame"]
            assert frames[-len(seen) :] == seen
            assert Counter(line.outgoing for line in trace.lines if line.kind == "frame") == {
                True: stats.sent,
                False: stats.received,
            }
            first = min(line.number("motion") for line in trace.lines if line.kind == "motion")
            states = [line.text("state") for line in trace.lines if line.fields.get("motion") == first]
            assert states == ["put", "accepted", "done"]
            [end] = [line for line in trace.lines if line.kind == "end"]
            assert end.fields["stats"]["sent"] == stats.sent  # type: ignore[index]
            assert "error" not in end.fields
            assert trace.lines[0].text("model") == arm.model

    run_virtual(run())


def check_kinds(trace: Trace) -> None:
    """Fails unless each line has what is promised of its kind, and none goes back in time."""
    assert trace.whole
    assert trace.software.startswith("dobot_async ")
    for line in trace.lines:
        assert PROMISED[line.kind] <= line.fields.keys(), line

    assert [line.t for line in trace.lines] == sorted(line.t for line in trace.lines)


@virtual
async def test_times_are_those_of_the_loop_and_of_the_wall(tmp_path: Path) -> None:
    path = tmp_path / "trace.jsonl"
    async with simulate(homed=True) as sim, Magician.connect(sim.url, record=path) as arm:
        await asyncio.sleep(100)
        await arm.get_pose()

    lines = read_trace(path).lines
    assert max(line.t for line in lines) == pytest.approx(100, abs=1)
    assert all(line.time > 1_700_000_000 for line in lines)


@virtual
async def test_what_failed_is_told_with_what_is_not_known(tmp_path: Path) -> None:
    path = tmp_path / "trace.jsonl"
    async with simulate(homed=True) as sim:
        with pytest.raises(ArmAlarm):
            async with Magician.connect(sim.url, record=path) as arm:
                await arm.move_to(900, 0, 0)

    lines = read_trace(path).lines
    [failed] = [line for line in lines if line.text("state") == "failed"]
    assert failed.text("error").startswith("ArmAlarm: the arm raised alarms: 0x11")
    assert [line.text("error") for line in lines if line.kind == "end"] == [failed.text("error")]
    stop = [line for line in lines if line.text("command") == "SetQueuedCmdForceStopExec"]
    assert [line.outgoing for line in stop] == [True, False] * 2  # and on the way out


@virtual
async def test_an_arm_that_does_not_answer_leaves_a_trace(tmp_path: Path) -> None:
    path = tmp_path / "trace.jsonl"
    async with simulate() as sim:
        sim.faults.silent = True
        with pytest.raises(ConnectFailed):
            async with Magician.connect(sim.url, record=path, timeout=2):
                pass

    lines = read_trace(path).lines
    assert lines[-1].kind == "end"
    assert lines[-1].text("error").startswith("ConnectFailed: no Magician answers")
    assert any(line.outgoing for line in lines)


@virtual
async def test_what_is_no_frame_is_shown_until_a_secret_was_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "trace.jsonl"
    async with simulate() as sim, Magician.connect(sim.url, record=path) as arm:
        [client] = sim._clients
        client._back.send(b"start ok")
        await asyncio.sleep(0.1)
        await arm.request(c.SET_WIFI_PASSWORD, "hunter2")
        client._back.send(bytes(Frame(152, 0, b"hunter2\0"))[:-3] + b"??" * 200)
        await asyncio.sleep(0.1)
        await arm.request(c.GET_WIFI_PASSWORD, None)
        await asyncio.sleep(0.1)

    junk = [dict(line.fields) for line in read_trace(path).lines if line.kind == "junk"]
    assert junk[0] == {"direction": "in", "count": 8, "raw": b"start ok".hex(" ")}
    assert len(junk) > 1
    assert not any("raw" in each for each in junk[1:])
    assert b"hunter".hex(" ") not in path.read_text()


async def test_a_token_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "trace.jsonl"
    with pytest.raises(ConnectFailed):
        async with Magician.connect("tcp://127.0.0.1:1?token=sesame", record=path):
            pass

    [end] = read_trace(path).lines
    assert "sesame" not in path.read_text()
    assert (end.kind, end.text("url")) == ("end", "tcp://127.0.0.1:1?token=...")
    assert end.text("error").startswith("ConnectFailed: cannot reach")


@virtual
async def test_what_comes_unasked_is_told_without_its_secret(tmp_path: Path) -> None:
    path = tmp_path / "trace.jsonl"
    async with simulate() as sim, Magician.connect(sim.url, record=path):
        [client] = sim._clients
        client._back.send(bytes(Frame(152, 0, b"hunter2\0")))
        await asyncio.sleep(0.1)

    assert [line.fields for line in read_trace(path).lines if line.kind == "event"] == [
        {"event": "Unexpected", "key": "152"}
    ]
    assert b"hunter".hex(" ") not in path.read_text()
    assert "hunter" not in path.read_text()


@virtual
async def test_it_is_cut_into_parts_of_which_the_oldest_are_removed(tmp_path: Path) -> None:
    path = tmp_path / "trace.jsonl"
    with TraceFile(path, max_bytes=10_000, keep=2) as file:
        async with simulate() as sim, Magician.connect(sim.url, record=file) as arm:
            for _ in range(300):
                await arm.get_pose()

    parts = sorted(tmp_path.iterdir())  # noqa: ASYNC240 - nobody else waits
    assert [part.name for part in parts] == ["trace.jsonl", "trace.jsonl.1", "trace.jsonl.2"]
    for part in parts:
        assert part.stat().st_size < 11_000
        kinds = [json.loads(line)["kind"] for line in part.read_text().splitlines()]
        assert kinds[:2] == ["trace", "connection"]

    trace = read_trace(path)
    assert not trace.whole
    assert [line.kind for line in trace.lines].count("connection") == 1
    assert trace.lines[-1].kind == "end"
    times = [line.t for line in trace.lines if line.kind == "frame"]
    assert times == sorted(times)
    with pytest.raises(ValueError, match="was rotated away"):
        async with Magician.connect(f"replay:{path}"):
            pass


@virtual
async def test_parts_that_are_all_there_are_one_trace(tmp_path: Path) -> None:
    path = tmp_path / "trace.jsonl"
    (tmp_path / "trace.jsonl.9").write_text("of somebody else")
    for _ in range(2):  # the parts of the first trace are none of the second one
        with TraceFile(path, max_bytes=10_000, keep=8) as file:
            async with simulate() as sim, Magician.connect(sim.url, record=file) as arm:
                for _ in range(60):
                    await arm.get_pose()

    trace = read_trace(path)
    assert trace.whole
    assert sum(line.text("command") == "GetPose" and line.outgoing for line in trace.lines) == 60
    async with Magician.connect(f"replay:{path}") as arm:
        await arm.get_pose()


@virtual
async def test_half_a_line_at_the_end_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "trace.jsonl"
    async with simulate() as sim, Magician.connect(sim.url, record=path):
        pass

    whole = read_trace(path)
    path.write_bytes(path.read_bytes()[:-10])
    assert read_trace(path).lines == whole.lines[:-1]


@virtual
async def test_a_disk_that_is_full_ends_the_trace_and_nothing_else(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    class Full(io.StringIO):
        def write(self, text: str) -> int:
            raise OSError(28, "No space left on device")

    file = TraceFile(Full())
    async with simulate(homed=True) as sim, Magician.connect(sim.url, record=file) as arm:
        await arm.move_to(220, 0, 40)
        assert sim.arm.executed[-1].name == "SetPTPCmd"

    assert isinstance(file.error, OSError)
    assert [record.message for record in caplog.records if record.name == "dobot_async.trace"] == [
        "the trace ends here: [Errno 28] No space left on device"
    ]


async def test_a_target_that_is_none_is_refused_before_anything_is_opened(tmp_path: Path) -> None:
    for record, error in ((7, TypeError), (tmp_path, OSError), (tmp_path / "no" / "trace", OSError)):
        with pytest.raises(error):
            async with Magician.connect("sim:", record=record):  # type: ignore[arg-type]
                pass

    for wrong in ({"max_bytes": 10}, {"keep": -1}):
        with pytest.raises(ValueError, match="must be"):
            TraceFile(tmp_path / "trace", **wrong)

    assert list(tmp_path.iterdir()) == []  # noqa: ASYNC240 - nobody else waits


async def test_the_arms_of_a_fleet_share_a_trace(tmp_path: Path) -> None:
    path = tmp_path / "trace.jsonl"
    async with simulate(homed=True, speed=20) as left, simulate("ultraarm", homed=True, speed=20) as right:
        members: dict[str, Any] = {
            "left": Member(left.url, Magician),
            "right": Member(right.url, ARMS["ultraarm"].kind),
        }
        async with Fleet.connect(members, record=path) as fleet:
            await fleet["left"].move_to(220, 0, 40)
            await fleet["right"].move_to(220, 0, 40)

    trace = read_trace(path)
    assert set(trace.arms) == {"left", "right"}
    for name in ("left", "right"):
        states = {line.text("state") for line in trace.of(name).lines if line.kind == "motion"}
        assert states == {"put", "accepted", "done"}


async def test_a_pipe_whose_reader_is_gone_ends_the_trace(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    with TraceFile(pipe) as file:
        os.close(reader)
        async with Magician.connect("sim:", record=file) as arm:
            await arm.get_pose()

        assert isinstance(file.error, BrokenPipeError)
