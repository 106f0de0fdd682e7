"""`dobot-async trace`: what was recorded, as lines, in figures and as curves; and `replay:` as a URL."""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result
from virtual import run_virtual

from dobot_async import ArmAlarm, Magician
from dobot_async.arms.magician import commands as c
from dobot_async.cli.main import cli
from dobot_async.simulator import Faults, simulate
from dobot_async.traces import TraceFile, read_trace
from dobot_async.traces.figures import depth, figures
from dobot_async.traces.plot import in_terminal

SIM = "sim:?speed=20"


def call(*arguments: str, **options: Any) -> Result:
    return CliRunner().invoke(cli, arguments, **options)


@pytest.fixture
def trace(tmp_path: Path) -> Path:
    """A run on a lossy line: three motions in the queue, the last of which fails."""
    path = tmp_path / "trace.jsonl"

    async def run() -> None:
        async with (
            simulate(homed=True, faults=Faults(latency=0.002)) as sim,
            Magician.connect(sim.url, record=path, on_error="leave") as arm,
        ):
            motions = [await arm.queue.move_to(x, 0, 40) for x in (220, 200)]
            sim.faults.loss = 1.0
            losing = asyncio.get_running_loop().call_later(0.2, setattr, sim.faults, "loss", 0.0)
            await arm.request(c.GET_HOME_PARAMS, None)  # lost until then, and asked again
            losing.cancel()
            for motion in motions:
                await motion

            with pytest.raises(ArmAlarm):
                await arm.move_to(900, 0, 0)

    run_virtual(run())
    return path


def test_figures_are_those_of_what_happened(trace: Path) -> None:
    found = figures(read_trace(trace).of(None))
    lines = read_trace(trace).lines
    assert found.frames == (
        sum(line.kind == "frame" and line.outgoing for line in lines),
        sum(line.kind == "frame" and not line.outgoing for line in lines),
    )
    assert [(motion.name, motion.end) for motion in found.motions] == [
        ("SetPTPCmd", "done"),
        ("SetPTPCmd", "done"),
        ("SetPTPCmd", "failed"),
    ]
    assert found.motions[2].error.startswith("ArmAlarm: the arm raised alarms: 0x11")
    assert found.deepest == 2
    assert 0.2 <= found.silence < 1.5
    home = found.commands["GetHOMEParams"]
    assert home.asked == home.lost + 1
    assert home.repeated == home.lost >= 1
    assert home.latencies == [pytest.approx(0.004, abs=0.001)]
    assert found.commands["SetPTPCmd"].lost == 0
    assert (found.outages, found.junk, found.error) == (0, 0, "")
    counts = [count for _, count in depth(read_trace(trace).of(None))]
    assert counts == [0, 1, 2, 1, 0, 1, 0, 0]


def test_stats_tell_them(trace: Path) -> None:
    told = json.loads(call("--json", "trace", "stats", str(trace)).stdout)
    assert told["deepest"] == 2
    assert told["commands"]["SetPTPCmd"]["asked"] == 3
    assert told["commands"]["GetHOMEParams"]["ms"]["p50"] == pytest.approx(4, abs=1)
    text = call("trace", "stats", str(trace)).stdout
    assert "motion 3 SetPTPCmd: failed after" in text
    assert "at most 2 queued" in text


def test_show_has_a_line_for_each(trace: Path) -> None:
    lines = call("trace", "show", str(trace)).stdout.splitlines()
    assert len(lines) == len(read_trace(trace).lines)
    assert any("-> SetPTPCmd  ptp_mode MOVJ_XYZ, x 220, y 0, z 40, r 0" in line for line in lines)
    motions = call("trace", "show", str(trace), "--kind", "motion", "--last", "3").stdout.splitlines()
    assert [line.split()[1:5] for line in motions] == [
        ["motion", "3", "SetPTPCmd", "put"],
        ["motion", "3", "SetPTPCmd", "accepted"],
        ["motion", "3", "SetPTPCmd", "failed"],
    ]
    told = [json.loads(line) for line in call("--json", "trace", "show", str(trace)).stdout.splitlines()]
    assert [each["kind"] for each in told] == [line.kind for line in read_trace(trace).lines]


@pytest.mark.full
def test_plot_draws_in_the_terminal_and_into_a_picture(trace: Path, tmp_path: Path) -> None:
    text = call("trace", "plot", str(trace)).stdout
    assert text == in_terminal(read_trace(trace).of(None), 80) + "\n"
    queue, answers = text.split("ms until the answer")
    assert "     2 |" in queue
    assert "█" in queue
    assert "x" in answers
    assert max(map(len, text.splitlines())) <= 80
    png = tmp_path / "a.png"
    # In a process of its own, for matplotlib keeps its fonts open.
    command = [sys.executable, "-m", "dobot_async", "trace", "plot", str(trace), "--png", str(png)]
    subprocess.run(command, check=True, timeout=100, capture_output=True)
    assert png.read_bytes().startswith(b"\x89PNG")


def test_plot_without_matplotlib_names_the_extra(trace: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    done = call("trace", "plot", str(trace), "--png", str(tmp_path / "a.png"))
    assert done.exit_code == 2
    assert "pip install 'dobot-async[plot]'" in done.stderr


def test_an_empty_trace_has_figures_too(tmp_path: Path) -> None:
    path = tmp_path / "trace.jsonl"

    async def run() -> None:
        async with simulate() as sim:
            sim.faults.silent = True
            with TraceFile(path) as file, pytest.raises(ConnectionError):
                async with Magician.connect(sim.url, record=file, timeout=1):
                    pass

    run_virtual(run())
    assert call("trace", "plot", str(path)).exit_code == 0
    assert "it ended with ConnectFailed" in call("trace", "stats", str(path)).stdout


def test_any_command_runs_on_a_replay(tmp_path: Path) -> None:
    path = str(tmp_path / "trace.jsonl")
    for command in (("pose",), ("move", "220", "0", "40"), ("info",), ("alarms",)):
        expected = call("--url", SIM, "--trace", path, *command)
        assert expected.exit_code == 0
        again = call("--url", f"replay:{path}", *command)
        assert (again.exit_code, again.stdout) == (0, expected.stdout)

    failed = call("--url", SIM, "--trace", path, "move", "900", "0", "0")
    again = call("--url", f"replay:{path}", "move", "900", "0", "0")
    assert (again.exit_code, again.stderr) == (failed.exit_code, failed.stderr) == (1, failed.stderr)
    other = call("--url", f"replay:{path}", "--arm", "ultraarm", "pose")
    assert other.exit_code == 2
    assert "this is a trace of a magician, and no ultraarm" in other.stderr


@pytest.mark.parametrize(
    ("arguments", "hint"),
    [
        (["trace", "show", "FILE", "--url", SIM], "--url: a trace is only read"),
        (["trace", "stats", "FILE", "--connection", "2"], "has 1 connections of arm '', and no number 2"),
        (["trace", "stats", "FILE", "--of", "left"], "has 0 connections of arm 'left'"),
        (["trace", "stats", "README"], "is no trace: its first line does not say so"),
        (["trace", "stats", "nowhere"], "does not exist"),
    ],
)
def test_wrong_usage_says_what_is_wrong(arguments: list[str], hint: str, trace: Path, tmp_path: Path) -> None:
    (tmp_path / "README").write_text('{"kind": "frame", "t": 0, "time": 0}\n', encoding="utf-8")
    named = {"FILE": str(trace), "README": str(tmp_path / "README")}
    done = call(*(named.get(each, each) for each in arguments))
    assert done.exit_code == 2
    assert hint in done.stderr
