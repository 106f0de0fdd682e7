"""The command line with the words for the myCobot family: each command on an arm of its own."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

from dobot_async.arms.mycobot.models import MODELS
from dobot_async.cli.main import cli

OWN = "sim:?speed=50"


def call(arm: str, *arguments: str) -> Result:
    """Runs a command on a simulated arm of its own."""
    return CliRunner().invoke(cli, ["--arm", arm, "--url", OWN, *arguments])


def answer(arm: str, *arguments: str) -> Any:
    result = call(arm, "--json", *arguments)
    assert result.exit_code == 0, result.output
    assert result.output.count("\n") == 1
    return json.loads(result.output)


@pytest.mark.parametrize("arm", ["mycobot", *MODELS])
def test_info_and_pose(arm: str) -> None:
    model = MODELS["mycobot280" if arm == "mycobot" else arm]
    assert answer(arm, "info") == {"model": model.title, "system_version": 1.3, "basic_version": 1.4}
    assert answer(arm, "pose")["joints"] == [0.0] * model.joints
    assert f"j{model.joints}    0.00" in call(arm, "pose").output


def test_motions_end_where_they_lead() -> None:
    joints = ["30", "-20", "40", "-10", "20", "60"]
    found = answer("mycobot", "move", "--mode", "joints", *joints)
    assert found["joints"] == pytest.approx([30, -20, 40, -10, 20, 60], abs=0.02)
    coords = [str(found[axis]) for axis in ("x", "y", "z", "rx", "ry", "rz")]
    moved = answer("mycobot280", "move", *coords)
    assert [moved[axis] for axis in ("x", "y", "z")] == pytest.approx([float(each) for each in coords[:3]], abs=0.2)
    assert answer("myarm300", "move", "--mode", "joints", *joints, "-45")["joints"][6] == pytest.approx(-45, abs=0.02)
    assert answer("mypalletizer260", "home")["joints"] == [0.0] * 4
    jogged = CliRunner().invoke(cli, ["--json", "--arm", "mycobot", "--url", "sim:?speed=2", "jog", "j6-", "0.1"])
    assert json.loads(jogged.output)["joints"][5] < 0
    assert answer("mycobot", "stop") == {"stopped": True}
    assert answer("mycobot", "alarms") == {"alarms": []}
    assert call("mycobot", "alarms", "--clear").output == "no alarms\n"


@pytest.mark.parametrize(
    ("arm", "arguments", "why"),
    [
        ("mycobot", ["move", "--mode", "joints", "1", "2", "3"], "must have 6 values for this arm, not 3"),
        ("mycobot", ["move", "1", "2", "3", "4", "5", "6", "7"], "at most 6 numbers"),
        ("mycobot", ["move", "--mode", "jump", "1", "2", "3"], "one of to, linear, joints"),
        ("mycobot", ["move", "--mode", "joints", "170", "0", "0", "0", "0", "0"], "joint 1 must be in"),
        ("mycobot", ["jog", "j7+", "1"], "DIRECTION is one of"),
        ("mycobot", ["suction", "on"], "not for mycobot"),
        ("magician", ["move", "1", "2", "3", "4", "5"], "at most 4 numbers"),
    ],
)
def test_wrong_usage(arm: str, arguments: list[str], why: str) -> None:
    result = call(arm, *arguments)
    assert result.exit_code == 2
    assert why in " ".join(result.output.split())


def test_an_alarm_is_a_failure() -> None:
    result = call("mycobot", "--json", "move", "270", "270", "400", "0", "0", "0")
    assert result.exit_code == 1
    assert json.loads(result.stdout)["alarms"][0]["name"] == "NO_INVERSE_SOLUTION"


def test_monitor_and_trace(tmp_path: Path) -> None:
    file = tmp_path / "trace.jsonl"
    result = call("mycobot", "--trace", str(file), "monitor", "--count", "2", "--rate", "50")
    assert result.exit_code == 0, result.output
    assert result.output.count("at rest") == 2
    lines = [line for line in map(json.loads, file.read_text().splitlines()) if line["kind"] == "frame"]
    assert {line["command"] for line in lines} >= {"IsPowerOn", "GetAnglesCoords", "IsMoving"}
    assert lines[0]["raw"] == "fe fe 02 12 fa"
    assert {line["direction"] for line in lines} == {"in", "out"}
    assert not any("problem" in line for line in lines)
