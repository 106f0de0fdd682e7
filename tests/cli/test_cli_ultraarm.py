"""The command line with `--arm ultraarm`: each command on an arm of its own, and some on one that is looked at."""

from __future__ import annotations

import asyncio
import json
import sys
import threading
from asyncio.subprocess import PIPE
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

from dobot_async.arms.ultraarm import commands as c
from dobot_async.cli.main import cli
from dobot_async.simulator import simulate

OWN = "sim:?speed=50"


@pytest.fixture(autouse=True)
def ended() -> Iterator[None]:
    """Lets the threads end with which asyncio waits for processes; they outlive these for a moment."""
    yield
    for thread in threading.enumerate():
        if thread.name.startswith("asyncio-waitpid"):
            thread.join(1)


def call(*arguments: str) -> Result:
    """Runs a command on a simulated arm of its own."""
    return CliRunner().invoke(cli, ["--arm", "ultraarm", "--url", OWN, *arguments])


def answer(*arguments: str) -> Any:
    result = call("--json", *arguments)
    assert result.exit_code == 0, result.output
    assert result.output.count("\n") == 1
    return json.loads(result.output)


def test_info_and_pose() -> None:
    assert answer("info") == {"version": "1.2", "endstops": {"j1": 1, "j2": 1, "j3": 1}}
    pose = answer("pose")
    assert pose["coords"] == {"x": 235.55, "y": 0.0, "z": 130.0, "e": 0.0}
    assert pose["angles"] == {"j1": 0.0, "j2": 0.0, "j3": 0.0, "j4": 0.0}
    assert "x  235.55" in call("pose").output
    assert "firmware       1.2" in call("info").output


@pytest.mark.parametrize(
    ("arguments", "coords"),
    [
        (["move", "200", "0", "40"], [200, 0, 40, 0]),
        (["move", "200", "0", "40", "15"], [200, 0, 40, 15]),
        (["move", "--mode", "by", "-20", "0", "-60"], [215.55, 0, 70, 0]),
        (["home"], [235.55, 0, 130, 0]),
    ],
)
def test_motions_end_where_they_lead(arguments: list[str], coords: list[float]) -> None:
    assert list(answer(*arguments)["coords"].values()) == pytest.approx(coords, abs=0.02)


def test_joints_and_jogs() -> None:
    assert answer("move", "--mode", "joints", "10", "20", "30")["angles"]["j2"] == pytest.approx(20, abs=0.01)
    assert answer("jog", "j1+", "0.02")["angles"]["j1"] > 0
    assert answer("jog", "Z-", "0.02")["coords"]["z"] < 130


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        (["move", "900", "0", "0"], "x must be in -260 to 300"),
        (["move", "--mode", "jump", "200", "0", "0"], "one of to, by, joints"),
        (["jog", "rail+", "1"], "one of x+"),
        (["alarms"], "not for ultraarm"),
        (["demo"], "not for ultraarm"),
    ],
)
def test_wrong_usage(arguments: list[str], why: str) -> None:
    result = call(*arguments)
    assert result.exit_code == 2
    assert why in " ".join(result.output.split())


def test_an_arm_that_does_not_get_there_is_one_line() -> None:
    result = call("move", "10", "0", "0")
    assert result.exit_code == 1
    assert "came to rest" in result.output
    assert result.output.count("\n") == 1


def test_monitor_and_trace(tmp_path: Path) -> None:
    trace = tmp_path / "trace.jsonl"
    result = call("--json", "--trace", str(trace), "monitor", "--count", "2", "--rate", "100")
    readings = [json.loads(line) for line in result.output.splitlines()]
    assert [each["queue_size"] for each in readings] == [0, 0]
    assert readings[0]["coords"]["x"] == 235.55
    assert not readings[0]["moving"]
    lines = [line for line in map(json.loads, trace.read_text().splitlines()) if line["kind"] == "frame"]
    assert lines[0]["command"] == "M120"
    assert {each["direction"] for each in lines} == {"out", "in"}
    assert "QUEUE SIZE[0]" in lines[1]["value"]
    assert "at rest" in call("monitor", "--count", "1").output


def test_a_gcode_file(tmp_path: Path) -> None:
    file = tmp_path / "part.gcode"
    file.write_text("G28\nG0 X200 Y0 Z40 F100\nM3\nM5\n")
    assert answer("gcode", str(file)) == {"file": str(file), "commands": 4, "sent": True}
    dry = CliRunner().invoke(cli, ["--arm", "ultraarm", "gcode", "--dry-run", str(file)])
    assert (dry.exit_code, dry.output) == (0, f"{file}: 4 commands would run\n")
    file.write_text("G28\nG0 X900\nG7\n")
    for wrong in (call("gcode", str(file)), call("gcode", "--dry-run", str(file))):
        assert wrong.exit_code == 2
        assert "line 2: x must be in" in wrong.output
        assert "(wrong as well: line 3); nothing was sent" in wrong.output
        assert wrong.output.count("\n") == 1

    file.write_text("; nothing\n")
    assert "no commands" in call("gcode", str(file)).output
    file.write_bytes(b"\xff")
    assert "not UTF-8" in call("gcode", str(file)).output
    file.write_text("G28\n")
    other = CliRunner().invoke(cli, ["--url", OWN, "gcode", str(file)])
    assert "for --arm ultraarm alone" in " ".join(other.output.split())


@pytest.mark.full
async def test_suction_and_stop_leave_the_rest_alone() -> None:
    async with simulate("ultraarm", homed=True, listen="tcp://127.0.0.1:0", speed=50) as sim:

        async def run(*arguments: str) -> str:
            command = (sys.executable, "-W", "error", "-m", "dobot_async", "--arm", "ultraarm", "--url", sim.url)
            process = await asyncio.create_subprocess_exec(*command, *arguments, stdout=PIPE, stderr=PIPE)
            output, errors = await process.communicate()
            assert process.returncode == 0, errors
            return output.decode()

        assert await run("suction", "on") == "suction on\n"
        assert sim.arm.registers.pump
        assert await run("stop") == "stopped\n"
        assert sim.arm.registers.pump
        assert sim.arm.registers.powered
        assert {each.command for each in sim.arm.executed} == {c.PUMP_ON}
