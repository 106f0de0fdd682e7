"""The global options on both sides of a command, what is refused with a hint, and what start-up costs."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import click
import pytest
from click.testing import CliRunner, Result

from dobot_async.arms.magician import commands as c
from dobot_async.arms.registry import Parts
from dobot_async.cli.addresses import connectable
from dobot_async.cli.main import COMMANDS, cli

SIM = "sim:?speed=50"


def call(*arguments: str, text: str | bytes | None = None) -> Result:
    return CliRunner(env={"DOBOT_URL": ""}).invoke(cli, arguments, input=text, prog_name="dobot-async")


def errors(*arguments: str, text: str | bytes | None = None) -> str:
    """What is told of wrong usage."""
    result = call(*arguments, text=text)
    assert (result.exit_code, result.stdout) == (2, "")
    return " ".join(result.stderr.split())


# Before and behind


@pytest.mark.parametrize(
    "arguments",
    [
        ["--url", SIM, "--arm", "mycobot", "--json", "pose"],
        ["pose", "--url", SIM, "--arm", "mycobot", "--json"],
        ["--json", "--url", "nonsense", "pose", "--arm", "MyCobot", "--url", SIM],
    ],
    ids=" ".join,
)
def test_global_options_stand_before_a_command_or_behind_it(arguments: list[str]) -> None:
    result = call(*arguments)
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["joints"] == [0] * 6


def test_they_stand_among_the_arguments_of_a_command(tmp_path: Path) -> None:
    assert json.loads(call("move", "210", "--url", SIM, "-20", "50", "--json").stdout)["y"] == pytest.approx(-20)
    file = tmp_path / "trace"
    assert call("pose", "--trace", str(file), "--url", SIM).exit_code == 0
    assert "GetPose" in file.read_text(encoding="utf-8")


def frames_in(trace: Path) -> list[dict[str, Any]]:
    """The frames of a trace."""
    lines = map(json.loads, trace.read_text(encoding="utf-8").splitlines())
    return [line for line in lines if line["kind"] == "frame"]


def test_they_stand_behind_the_commands_of_a_cell(tmp_path: Path) -> None:
    cell, trace = tmp_path / "cell.toml", tmp_path / "trace"
    cell.write_text(f'[arms.a]\nurl="{SIM}"\n[arms.b]\nurl="{SIM}"\nfamily="mycobot"\n', encoding="utf-8")
    result = call("cell", str(cell), "status", "--json", "--trace", str(trace))
    assert list(json.loads(result.stdout)["arms"]) == ["a", "b"]
    lines = frames_in(trace)
    assert {(line["arm"], line["command"]) for line in lines} >= {("a", "GetPose"), ("b", "IsPowerOn")}
    program = tmp_path / "program"
    program.write_text("a: move 220 0 40\nb: joints 10 0 0 0 0 0\n", encoding="utf-8")
    assert call("cell", str(cell), "run", str(program), "--trace", str(trace)).exit_code == 0
    lines = frames_in(trace)
    assert {(line["arm"], line["command"]) for line in lines} >= {("a", "SetPTPCmd"), ("b", "SendAngles")}


@pytest.mark.parametrize(
    ("arguments", "hint"),
    [
        (["--url", SIM, "bridge", "sim:", "tcp://127.0.0.1:0"], "--url: SOURCE_URL says where the arm is"),
        (["serve", "sim:", "--name", "x", "--url", SIM], "--url: SOURCE_URL says where the arm is"),
        (["simulate", "--url", SIM], "--url: a simulated arm has a URL of its own"),
        (["simulate", "--trace", "x"], "--trace: trace the program that connects"),
        (["discover", "--arm", "mycobot"], "--arm: a search finds arms of all kinds"),
        (["decode", "AA", "--url", SIM], "--url: nothing is asked of an arm"),
        (["pose", "--arm", "puma"], "'puma' is none of magician, mycobot, "),
        (["wifi", "home"], "which arm? Give --url"),
        (["jog", "up", "1", "--url", SIM], "DIRECTION is one of x+, x-, y+, y-, z+, z-, r+, r-, j1+"),
        (["jog", "r+", "1", "--url", SIM, "--arm", "ultraarm"], "DIRECTION is one of x+, x-, y+, y-, z+, z-, j1+"),
        (["jog", "x+", "nan", "--url", SIM], "is no finite number"),
        (
            ["move", "999", "0", "0", "0", "0", "0", "--mode", "joints", "--arm", "mycobot", "--url", SIM],
            "joint 1 must",
        ),
        (["run", "-", "--loops", "2"], "--loops is for --download"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_wrong_usage_has_a_hint(arguments: list[str], hint: str) -> None:
    assert hint in errors(*arguments)


def test_an_error_of_a_jog_has_the_directions_of_this_arm_alone() -> None:
    assert "rx+" not in errors("jog", "up", "1", "--url", SIM)
    assert "rail+" not in errors("jog", "up", "1", "--url", SIM, "--arm", "mycobot")


def test_wifi_does_not_ask_for_a_password_before_it_knows_the_arm() -> None:
    assert "assword" not in errors("wifi", "home", text="secret\n")


def test_an_address_to_listen_at_is_none_to_connect_to() -> None:
    assert connectable("tcp://127.0.0.1:9000") == "tcp://127.0.0.1:9000"
    for url in ("tcp://0.0.0.0:9000", "ws://[::]:9000/"):
        found = connectable(url)
        assert "0.0.0.0" not in found
        assert "[::]" not in found
        assert found.endswith(url[-5:])


# Programs


def test_a_program_is_checked_without_an_arm() -> None:
    done = call("run", "-", "--dry-run", "--json", text="home\nmove 200 0 50\n")
    assert json.loads(done.stdout) == {"file": "standard input", "commands": 2, "sent": False}


@pytest.mark.parametrize(("arm", "line"), [("mycobot", "joints 10 0 0 0 0 0"), ("ultraarm", "move 200 0 40")])
def test_programs_run_on_all_families(arm: str, line: str) -> None:
    done = call("run", "-", "--url", SIM, "--arm", arm, "--json", text=f"home\n{line}\nwait 1\n")
    assert json.loads(done.stdout)["commands"] == 3
    wrong = call("run", "-", "--url", SIM, "--arm", arm, "--json", text=f"home\n{line}\nmove 999 0 0 0 0 0\n")
    assert (wrong.exit_code, wrong.stdout, wrong.stderr.count("\n")) == (2, "", 1)
    assert "line 3: " in wrong.stderr


def test_a_program_is_stored_in_an_arm() -> None:
    done = call("run", "-", "--url", SIM, "--download", "--loops", "3", text="move 200 0 50\nmove 210 0 50\n")
    assert (done.exit_code, done.stdout) == (0, "standard input: 2 commands stored\n")
    assert "magician alone" in errors("run", "-", "--url", SIM, "--download", "--arm", "mycobot", text="home\n")


def test_what_was_stored_is_what_the_program_says(tmp_path: Path) -> None:
    trace = tmp_path / "trace"
    text = "move 200 0 50\nsuction on\n"
    assert call("run", "-", "--url", SIM, "--download", "--trace", str(trace), text=text).exit_code == 0
    lines = frames_in(trace)
    sent = [line["command"] for line in lines if line["direction"] == "out"]
    start, stop = sent.index("SetQueuedCmdStartDownload"), sent.index("SetQueuedCmdStopDownload")
    stored = [name for name in sent[start + 1 : stop] if name.startswith(("SetPTP", "SetEnd"))]
    assert stored == ["SetPTPCmd", "SetEndEffectorSuctionCup"]


@pytest.mark.parametrize("text", [b"", b"# nothing\n", b"home # \xe9\n", b"home\rhome\n", b"\xef\xbb\xbffly\n"])
def test_a_wrong_program_is_one_line(text: bytes) -> None:
    done = call("run", "-", "--url", SIM, text=text)
    assert (done.exit_code, done.stdout, done.stderr.count("\n")) == (2, "", 1)
    assert done.stderr.endswith("nothing was sent\n")


# decode


def test_decode_reads_lines_of_text_standard_input_and_files(tmp_path: Path) -> None:
    (piece,) = json.loads(call("--json", "decode", "G0 X200 F50", "--arm", "ultraarm").stdout)["pieces"]
    assert (piece["command"], piece["request"]["x"]) == ("G0", 200)
    file = tmp_path / "bytes"
    file.write_bytes(bytes.fromhex("aaaa020a00f6"))
    (binary,) = json.loads(call("--json", "decode", "--file", str(file)).stdout)["pieces"]
    (digits,) = json.loads(call("--json", "decode", "-", text="AA AA 02 0A 00 F6\n").stdout)["pieces"]
    assert binary == digits
    assert digits["command"] == "GetPose"


def test_decode_reads_a_trace(tmp_path: Path) -> None:
    trace = tmp_path / "trace"
    assert call("--url", SIM, "--trace", str(trace), "pose").exit_code == 0
    lines = frames_in(trace)
    pieces = json.loads(call("--json", "decode", "--file", str(trace)).stdout)["pieces"]
    assert [piece["command"] for piece in pieces] == [line["command"] for line in lines]
    assert [piece["direction"] for piece in pieces] == [line["direction"] for line in lines]
    assert "line 1 is no line of a trace" in errors("decode", "-", text="{\n")
    secret = '{"kind": "frame", "raw": "aa aa *** 9c 01 ***"}'
    (masked,) = json.loads(call("--json", "decode", "-", text=secret).stdout)["pieces"]
    assert "left out" in masked["junk"]


@pytest.mark.parametrize("arguments", [["decode"], ["decode", "AA", "--file", "x"]])
def test_decode_wants_something(arguments: list[str]) -> None:
    assert "give bytes" in errors(*arguments)


# Processes


def run(command: str, **options: Any) -> subprocess.CompletedProcess[bytes]:
    words = f"{sys.executable} -W error -m dobot_async {command}"
    return subprocess.run(["bash", "-c", words], capture_output=True, timeout=60, check=False, **options)


@pytest.mark.cases(1)
@pytest.mark.parametrize("command", ["pose", "--json pose"])
def test_an_output_that_is_full_is_a_failure_without_a_traceback(command: str) -> None:
    done = run(f"--url {SIM} {command} > /dev/full")
    assert (done.returncode, done.stderr.count(b"\n")) == (1, 1)


def test_a_closed_input_is_wrong_usage() -> None:
    done = run(f"--url {SIM} run - <&-")
    assert done.returncode == 2
    assert b"Traceback" not in done.stderr


def test_a_trace_into_a_pipe_that_nobody_reads_is_wrong_usage(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    assert "nobody reads from this pipe" in errors("--url", SIM, "--trace", str(pipe), "pose")


@pytest.mark.full
def test_a_trace_into_a_pipe_whose_reader_stalls_does_not_hold_up_the_arm(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        done = run(f"--url '{SIM}' --trace {pipe} monitor --count 300 --rate 1000")
    finally:
        os.close(reader)

    assert done.returncode == 0
    assert b"warning: the trace ended early" in done.stderr


@pytest.mark.full
def test_a_quit_from_the_terminal_stops_the_arm_as_well() -> None:
    command = (sys.executable, "-W", "error", "-m", "dobot_async", "--url", "sim:", "run", "-")
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdin
        assert process.stderr
        process.stdin.write(b"wait 600\n")
        process.stdin.close()
        trace = Path(f"/proc/{process.pid}/status")
        mask = 1 << signal.SIGQUIT - 1
        while not any(
            int(line.split()[1], 16) & mask for line in trace.read_text().splitlines() if line.startswith("SigCgt")
        ):
            assert process.poll() is None

        process.send_signal(signal.SIGQUIT)
        assert process.wait(30) == 128 + signal.SIGQUIT


# Start-up


def imported(source: str) -> set[str]:
    """What a program has imported in the end."""
    program = f"import sys\n{source}\nprint(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=True)
    return set(done.stdout.splitlines()[-1].split())


@pytest.mark.parametrize("option", ["--version", "--help"])
def test_what_needs_no_arm_imports_none(option: str) -> None:
    found = imported(f"from dobot_async.cli.main import cli\ncli(['{option}'], standalone_mode=False)")
    assert not found & {
        "asyncio",
        "anyio",
        "rich",
        "serial",
        "dobot_async._core.protocol.wire",
        "dobot_async.cli.session",
    }


def test_a_command_imports_its_own_family_alone() -> None:
    nowhere = "['--url', 'tcp://127.0.0.1:1', 'alarms']"
    found = imported(f"from dobot_async.cli.main import cli\ncli({nowhere}, standalone_mode=False)")
    assert "dobot_async.arms.magician.arm" in found
    assert not found & {
        "dobot_async.arms.mycobot.arm",
        "dobot_async.arms.ultraarm.arm",
        "dobot_async.fleet.fleet",
        "rich",
    }


@pytest.mark.parametrize("name", COMMANDS)
def test_the_help_of_the_group_says_what_each_command_says_of_itself(name: str) -> None:
    assert isinstance(cli, click.Group)
    command = cli.get_command(click.Context(cli), name)
    assert command
    assert command.name == name
    assert command.get_short_help_str(200) == COMMANDS[name][1]
    shown = call(name, "--help")
    assert shown.exit_code == 0
    assert "--url" not in shown.output or name == "demo"


def test_the_help_has_its_layout_whatever_arms_there_are() -> None:
    lines = call("--help").output.splitlines()
    assert max(map(len, lines)) <= 100
    assert all(word in " ".join(lines) for word in Parts("cli"))
    assert c.SET_PTP_CMD.name not in " ".join(lines)
