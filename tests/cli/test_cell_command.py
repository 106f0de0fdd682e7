"""`cell`: all arms of a cell file, as processes; the arms are simulated here, so that their side can be looked at."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import sys
import threading
from asyncio.subprocess import PIPE, Process
from collections.abc import AsyncIterator, Iterator
from contextlib import AsyncExitStack
from pathlib import Path

import pytest
from click.testing import CliRunner

from dobot_async import Magician
from dobot_async.arms.magician import commands as c
from dobot_async.cli.cell_program import parse_cell_program
from dobot_async.cli.cell_watch import observe
from dobot_async.cli.main import cli
from dobot_async.fleet.cell import parse_cell, read_cell
from dobot_async.simulator import Simulation, simulate

CELL = """
[arms.left]
url = "{left}"
guard = "wait"

[arms.right]
url = "{right}"
base = {{ x = 500, yaw = 180 }}
guard = "wait"

[arms.third]
url = "sim:?speed=50"
family = "ultraarm"

[zones.bin]
box = {{ x = [220, 280], y = [-40, 40], z = [0, 80] }}
"""

PROGRAM = """
left, right: move 200 -120 20
left: zone bin
left: move 250 0 20
left: move 200 -120 20
left: leave bin
*: barrier done     # right waits, too
right: zone bin
right: move 250 0 20
third: suction on
"""


@pytest.fixture(autouse=True)
def ended() -> Iterator[None]:
    """Lets the threads end with which asyncio waits for processes; they outlive these for a moment."""
    yield
    for thread in threading.enumerate():
        if thread.name.startswith("asyncio-waitpid"):
            thread.join(1)


@pytest.fixture
async def arms() -> AsyncIterator[dict[str, Simulation]]:
    async with AsyncExitStack() as stack:
        yield {
            name: await stack.enter_async_context(simulate(listen="tcp://127.0.0.1:0", speed=50))
            for name in ("left", "right")
        }


@pytest.fixture
def file(arms: dict[str, Simulation], tmp_path: Path) -> Path:
    path = tmp_path / "cell.toml"
    path.write_text(CELL.format(**{name: sim.url for name, sim in arms.items()}), encoding="utf-8")
    return path


async def start(*arguments: str | Path) -> Process:
    names = {name: value for name, value in os.environ.items() if name != "DOBOT_URL"}
    module = (sys.executable, "-W", "error", "-m", "dobot_async")
    return await asyncio.create_subprocess_exec(*module, *map(str, arguments), stdout=PIPE, stderr=PIPE, env=names)


async def run(*arguments: str | Path) -> tuple[int, str, str]:
    process = await start(*arguments)
    output, errors = await process.communicate()
    assert process.returncode is not None
    return process.returncode, output.decode(), errors.decode()


def rewrite(file: Path, old: str, new: str) -> None:
    file.write_text(file.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")


def places(sim: Simulation) -> list[tuple[float, float]]:
    return [(each.value.x, each.value.y) for each in sim.arm.executed if each.command is c.SET_PTP_CMD]


@pytest.mark.full
async def test_status_tells_all_in_the_frame_of_the_cell(file: Path) -> None:
    code, output, errors = await run("--json", "cell", file, "status")
    assert (code, errors) == (0, "")
    told = json.loads(output)["arms"]
    assert told["left"]["x"] == pytest.approx(259.1, abs=0.1)
    assert told["right"]["x"] == pytest.approx(500 - 259.1, abs=0.1)
    assert told["third"]["family"] == "ultraarm"


@pytest.mark.full
async def test_status_and_stop_do_not_need_all(file: Path, arms: dict[str, Simulation]) -> None:
    arms["left"].end()
    code, output, errors = await run("--json", "cell", file, "status")
    assert code == 1
    assert json.loads(output)["arms"]["right"]["error"] is None
    assert errors.startswith("error: left: ")
    code, output, errors = await run("--json", "cell", file, "stop")
    assert code == 1
    assert json.loads(output)["stopped"] == {"left": False, "right": True, "third": True}


@pytest.mark.full
async def test_home(file: Path, arms: dict[str, Simulation]) -> None:
    code, output, errors = await run("cell", file, "home")
    assert (code, output, errors) == (0, "all arms are home\n", "")
    assert all(sim.arm.executed[-1].command is c.SET_HOME_CMD for sim in arms.values())


@pytest.mark.full
async def test_run(file: Path, arms: dict[str, Simulation], tmp_path: Path) -> None:
    program = tmp_path / "program.txt"
    program.write_text(PROGRAM, encoding="utf-8")
    code, output, errors = await run("--json", "cell", file, "run", program)
    assert (code, errors) == (0, "")
    assert json.loads(output)["commands"] == {"left": 6, "right": 4, "third": 2}
    assert places(arms["left"]) == [(200, -120), (250, 0), (200, -120)]
    assert places(arms["right"]) == [(200, -120), (250, 0)]


@pytest.mark.full
async def test_run_tells_the_line_of_a_failure_and_stops_all(
    file: Path, arms: dict[str, Simulation], tmp_path: Path
) -> None:
    program = tmp_path / "program.txt"
    program.write_text("right: wait 600\nthird: wait 600\nleft: wait 0.1\nleft: by 0 0 600\n", encoding="utf-8")
    rewrite(file, 'guard = "wait"', "")
    code, _, errors = await run("cell", file, "run", program)
    assert code == 1
    assert errors.count("\n") == 1
    assert errors.startswith("error: left, line 4 (by 0 0 600): left: the arm raised alarms: ")
    assert [name for name, sim in arms.items() if sim.arm.device.executing] == []


@pytest.mark.full
async def test_what_the_guard_refuses_under_way_is_a_failure_and_not_wrong_usage(
    file: Path, arms: dict[str, Simulation], tmp_path: Path
) -> None:
    program = tmp_path / "program.txt"
    program.write_text("left: move 200 -180 20\nleft: wait 0.01\nleft: move 200 180 20\n", encoding="utf-8")
    limits = 'guard = "wait"\nlimits = { x = [190, 265] }'
    rewrite(file, 'guard = "wait"', limits)
    code, _, errors = await run("cell", file, "run", program)
    assert (code, errors.count("\n")) == (1, 1)
    assert errors.startswith("error: left, line 3 (move 200 180 20): ")


@pytest.mark.cases(1)
@pytest.mark.parametrize(
    ("lines", "number"),
    [
        (["left: move 200 0 50", "left: fly", "right: home"], 2),
        (["left: home", "third: suction on", "third: move 900 0 0"], 3),
        (["*: home", "*: joints 1 2"], 2),
        (["left: move 200 0 50", "right: move 200 0 600"], 2),
        (["left: move 200 0 50", "left: by 0 0 400"], 2),
        (["left: move 200 0 50 l=100"], 1),
        (["left: wait 1", "left: leave bin"], 2),
        (["left: wait 1", "left: tool pen"], 2),
        (["left, right: barrier x", "left: barrier x"], 2),
        (["left:"], 1),
    ],
    ids=str,
)
async def test_a_wrong_line_is_one_line_of_errors_and_nothing_is_sent_to_any_arm(
    file: Path, arms: dict[str, Simulation], tmp_path: Path, lines: list[str], number: int
) -> None:
    program = tmp_path / "program.txt"
    program.write_text("\n".join(lines), encoding="utf-8")
    code, output, errors = await run("--json", "cell", file, "run", program)
    assert (code, output) == (2, "")
    assert errors.count("\n") == 1
    assert errors.startswith(f"error: {program}: line {number}: ")
    assert [sim.arm.counters.requests for sim in arms.values()] == [0, 0]


async def test_dry_run_sends_nothing(file: Path, arms: dict[str, Simulation], tmp_path: Path) -> None:
    program = tmp_path / "program.txt"
    program.write_text(PROGRAM, encoding="utf-8")
    code, output, errors = await run("--json", "cell", file, "run", program, "--dry-run")
    assert (code, errors) == (0, "")
    assert json.loads(output)["sent"] is False
    assert [sim.arm.counters.requests for sim in arms.values()] == [0, 0]


async def test_ctrl_c_stops_all(file: Path, arms: dict[str, Simulation], tmp_path: Path) -> None:
    program = tmp_path / "program.txt"
    program.write_text("*: wait 6000\n", encoding="utf-8")
    process = await start("cell", file, "run", program)
    async with AsyncExitStack() as stack:
        for sim in arms.values():
            observer = await stack.enter_async_context(Magician.connect(sim.url, control=False))
            while sim.arm.device.idle:
                await observer.get_pose()

    process.send_signal(signal.SIGINT)
    _, errors = await process.communicate()
    assert process.returncode == 130
    assert b"told to stop" in errors
    assert all(sim.arm.device.idle for sim in arms.values())


@pytest.mark.full
async def test_watch_shows_all_and_tries_again(file: Path, arms: dict[str, Simulation]) -> None:
    arms["left"].end()
    code, output, _ = await run("--json", "cell", file, "watch", "--count", "2", "--rate", "50")
    assert code == 0
    first, _second = map(json.loads, output.splitlines())
    assert first["arms"]["left"]["error"]
    assert first["arms"]["right"]["error"] is None


async def test_watch_draws_every_arm(file: Path) -> None:
    shown: list[list[str]] = []
    cell = read_cell(file)
    await observe(cell, 50, 2, lambda told: shown.append([each.cells(name)[0] for name, each in told.items()]))
    assert shown == [["left", "right", "third"]] * 2


async def test_watch_says_what_is_wrong_with_an_arm_and_does_not_wait_for_it() -> None:
    cell = parse_cell('[arms.left]\nurl = "sim:?fast=1"\n')
    with pytest.raises(ValueError, match="fast"):
        await asyncio.wait_for(observe(cell, 50, 1, lambda _: None), 30)


CELL_TEXT = CELL.format(left="sim:", right="sim:")


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("home", "expected ARM: VERB"),
        ("middle: home", "no arm 'middle'; there are: left, right, third"),
        ("left: fly", "no verb 'fly'"),
        ("left: zone nowhere", "no zone 'nowhere'; there are: bin"),
        ("left: barrier", "expected: barrier NAME"),
        ("left: move 1 2", "expected: move X Y Z"),
        ("third: path 1 2 3", "no verb 'path' for the ultraArm"),
        ("third: move a 0 0", "x is a number, not 'a'"),
    ],
)
def test_wrong_programs(line: str, why: str) -> None:
    with pytest.raises(ValueError, match=why):
        parse_cell_program([line], parse_cell(CELL_TEXT))


def test_wrong_files_are_wrong_usage(tmp_path: Path) -> None:
    path = tmp_path / "cell.toml"
    path.write_text("[arms.left]\n", encoding="utf-8")
    result = CliRunner().invoke(cli, ["cell", str(path), "home"])
    assert result.exit_code == 2
    assert "arms.left: url: it is missing" in " ".join(result.output.split())
