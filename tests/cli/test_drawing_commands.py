"""`draw`, `engrave` and `write`, run as processes on arms that are simulated here: what they recorded decides."""

from __future__ import annotations

import asyncio
import json
import os
import random
import re
import signal
import sys
import threading
from asyncio.subprocess import PIPE, Process
from collections.abc import AsyncIterator, Iterator
from pathlib import Path
from typing import Any

import pytest
from burner import Burner, as_burnt, ends_of
from click.testing import CliRunner, Result
from PIL import Image

from dobot_async import MyCobot, Pen, UltraArm
from dobot_async.arms.magician import commands as m
from dobot_async.cli.main import cli
from dobot_async.simulator import Simulation, simulate
from dobot_async.toolpath import WorkPlane, read_picture, read_svg, write_text

FILES = Path(__file__).parents[1] / "toolpath" / "files"
AT = ["--at", "200", "-40", "-40"]
PLANE = WorkPlane.flat(200, -40, -40)
CROSS = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="40mm" height="40mm" viewBox="0 0 40 40" stroke="#000" fill="none">'
    '<path d="M 0 0 L 40 0"/><path d="M 0 20 L 20 20 L 20 30"/><path d="M 30 40 L 40 40"/></svg>'
)


@pytest.fixture(autouse=True)
def ended() -> Iterator[None]:
    """Lets the threads end with which asyncio waits for processes; they outlive these for a moment."""
    yield
    for thread in threading.enumerate():
        if thread.name.startswith("asyncio-waitpid"):
            thread.join(1)


@pytest.fixture
async def sim() -> AsyncIterator[Simulation]:
    async with simulate(listen="tcp://127.0.0.1:0", speed=50) as simulation:
        yield simulation


@pytest.fixture
def cross(tmp_path: Path) -> str:
    file = tmp_path / "cross.svg"
    file.write_text(CROSS, encoding="utf-8")
    return str(file)


async def start(*arguments: str, stdout: int = PIPE, code: str = "") -> Process:
    names = {name: value for name, value in os.environ.items() if name != "DOBOT_URL"}
    program = ["-c", code, *arguments] if code else ["-W", "error", "-m", "dobot_async", *arguments]
    return await asyncio.create_subprocess_exec(
        sys.executable, *program, stdin=asyncio.subprocess.DEVNULL, stdout=stdout, stderr=PIPE, env=names
    )


async def finish(process: Process) -> tuple[int, str, str]:
    output, errors = await process.communicate()
    assert process.returncode is not None
    return process.returncode, (output or b"").decode(), errors.decode()


async def run(*arguments: str) -> tuple[int, str, str]:
    return await finish(await start(*arguments))


def call(*arguments: str) -> Result:
    return CliRunner(env={"DOBOT_URL": ""}).invoke(cli, arguments, prog_name="dobot-async")


def lines_drawn(sim: Simulation) -> list[tuple[float, float]]:
    """Where the lines of a pen have ended."""
    return [
        (round(each.value.x, 2), round(each.value.y, 2))
        for each in sim.arm.executed
        if each.command is m.SET_CP_CMD and each.outcome == "done"
    ]


# --- what is drawn ---


async def test_a_file_is_drawn_where_and_as_large_as_it_is_said(sim: Simulation, cross: str) -> None:
    code, output, errors = await run("--json", "--url", sim.url, "draw", cross, *AT, "--size", "20", "30")
    assert (code, errors) == (0, "")
    answer = json.loads(output)
    assert answer == {"file": cross, "strokes": 3, "mm": 40.0, "travel": answer["travel"], "sent": True}
    strokes = [{(0, 25), (20, 25)}, {(0, 15), (10, 10)}, {(15, 5), (20, 5)}]
    ends = [{PLANE.to_arm(x, y)[:2] for x, y in stroke} for stroke in strokes]
    drawn = lines_drawn(sim)
    assert len(drawn) == 4
    assert all(len(stroke.intersection(drawn)) == 1 for stroke in ends)  # which of both, the order decides
    assert PLANE.to_arm(10, 15)[:2] in drawn
    lowest = min(each.value.z for each in sim.arm.executed if each.command is m.SET_PTP_CMD)
    assert lowest == -40
    assert sim.arm.state.get(m.SET_END_EFFECTOR_PARAMS).x_bias == Pen().x_bias
    assert sim.arm.pose.z == pytest.approx(-35, abs=0.01)


@pytest.mark.full
async def test_a_text_is_written_turned_and_fast(sim: Simulation) -> None:
    arguments = ["write", "Ab", *AT, "--height", "20", "--rotate", "-90", "--speed", "120", "--tool", "80", "0", "-5"]
    code, output, errors = await run("--url", sim.url, *arguments)
    assert (code, errors) == (0, "")
    *progress, last = output.splitlines()
    assert re.fullmatch(r"Ab: \d strokes, \d+ mm done", last)
    assert all(re.fullmatch(r"\d of \d strokes, \d+ of \d+ mm, \d+:\d\d min left", line) for line in progress)
    assert progress
    path = write_text("Ab", 20)
    path = path.translate(-path.bounds.left, -path.bounds.bottom)
    plane = WorkPlane.flat(200, -40, -40, rotation=-90)
    ends = {(round(x, 2), round(y, 2)) for x, y in ends_of(path, plane)}
    drawn = lines_drawn(sim)
    assert drawn
    assert set(drawn) <= ends
    speeds = {each.value.junction_vel for each in sim.arm.executed if each.command is m.SET_CP_PARAMS}
    assert speeds == {120}
    assert sim.arm.state.get(m.SET_END_EFFECTOR_PARAMS) == m.EndEffectorParams(80, 0, -5)


@pytest.mark.full
async def test_a_picture_is_engraved_with_a_share_of_the_power(sim: Simulation) -> None:
    picture = str(FILES / "shapes.png")
    options = ["--size", "30", "30", "--line", "2", "--mode", "grey", "--power", "40"]
    code, _, errors = await run("--url", sim.url, "engrave", picture, *AT, *options)
    assert (code, errors) == (0, "")
    powers = {each.value.power for each in sim.arm.executed if each.command is m.SET_CPLE_CMD}
    assert max(powers) == pytest.approx(40)
    assert len(powers) > 2
    assert sim.arm.laser == 0


@pytest.mark.full
async def test_pressure_is_a_depth(sim: Simulation, cross: str) -> None:
    assert (await run("--url", sim.url, "draw", cross, *AT, "--press", "2", "--power", "50"))[0] == 0
    assert {each.value.z for each in sim.arm.executed if each.command is m.SET_CP_CMD} == {-41}


@pytest.mark.full
async def test_an_ultraarm_draws_and_engraves(cross: str) -> None:
    async with simulate("ultraarm", listen="tcp://127.0.0.1:0", speed=50) as sim:
        async with UltraArm.connect(sim.url) as arm:
            await arm.home()

        for command in ("draw", "engrave"):
            options = ["--at", "180", "-20", "20", "--speed", "100"]
            code, output, errors = await run("--json", "--arm", "ultraarm", "--url", sim.url, command, cross, *options)
            assert (code, errors) == (0, "")
            assert json.loads(output)["strokes"] == 3

        lines = [each.value for each in sim.arm.executed if each.name == "G1" and each.outcome == "done"]
        assert {(200, 0), (180, 20), (220, 20), (210, -20)} <= {(line.x, line.y) for line in lines}
        assert "M3" in [each.name for each in sim.arm.executed]
        assert not sim.arm.registers.laser


@pytest.mark.full
async def test_a_mycobot_draws(cross: str) -> None:
    async with simulate("mycobot280", listen="tcp://127.0.0.1:0", speed=50) as sim:
        async with MyCobot.connect(sim.url) as arm:
            await arm.power_on()
            await arm.move_joints(0, -30, -60, 0, 0, 0)
            await arm.move_to(150, -60, 120, 180, 0, 0)

        options = ["--at", "150", "-60", "90", "--size", "20", "20", "--percent", "60"]
        code, output, errors = await run("--json", "--arm", "mycobot", "--url", sim.url, "draw", cross, *options)
        assert (code, errors) == (0, "")
        assert json.loads(output)["sent"]
        assert (170, -60, 90) in [each.value.coords[:3] for each in sim.arm.executed if hasattr(each.value, "coords")]


@pytest.mark.full
async def test_a_terminal_shows_a_bar(sim: Simulation, cross: str) -> None:
    master, slave = os.openpty()
    os.set_blocking(master, False)
    shown = bytearray()
    loop = asyncio.get_running_loop()
    loop.add_reader(master, lambda: shown.extend(os.read(master, 65536)))
    code, _, errors = await finish(await start("--url", sim.url, "draw", cross, *AT, stdout=slave))
    loop.remove_reader(master)
    os.close(master)
    os.close(slave)
    assert (code, errors) == (0, "")
    assert b"/3" in shown
    assert b"strokes, 80 mm done" in shown
    assert b"min left" not in shown


# --- what is refused, before a byte is sent ---


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        (["draw", "CROSS"], "Missing option '--at'"),
        (["draw", "CROSS", "--at", "200", "nan", "0"], "no finite number"),
        (["draw", "nowhere.svg", *AT], "does not exist"),
        (["draw", str(FILES / "geometry.py"), *AT], "does not exist"),
        (["draw", __file__, *AT], "ends in none of .svg, .dxf"),
        (["draw", str(FILES / "broken_path.svg"), *AT], "line 3: <path>"),
        (["draw", str(FILES / "broken.png"), *AT], "broken.png: "),
        (["draw", "CROSS", *AT, "--mode", "grey"], "--mode is for pictures alone"),
        (["draw", "CROSS", *AT, "--line", "1"], "--line is for pictures alone"),
        (["engrave", str(FILES / "shapes.png"), *AT, "--mode", "outline", "--line", "1"], "not for outlines"),
        (["draw", "CROSS", *AT, "--power", "10"], "without --press"),
        (["write", "A", *AT, "--power", "10"], "without --press"),
        (["engrave", "CROSS", *AT, "--power", "0"], "not in the range"),
        (["engrave", "CROSS", *AT, "--power", "101"], "not in the range"),
        (["draw", "CROSS", *AT, "--speed", "0"], "not in the range"),
        (["draw", "CROSS", *AT, "--percent", "10"], "knows mm/s: give --speed"),
        (["draw", "CROSS", *AT, "--speed", "10", "--arm", "mycobot"], "knows percent alone: give --percent"),
        (["draw", "CROSS", *AT, "--tool", "1", "2", "3", "--arm", "ultraarm"], "--tool is for --arm magician"),
        (["engrave", "CROSS", *AT, "--arm", "mycobot"], "for --arm magician or ultraarm alone"),
        (["draw", "CROSS", *AT, "--from-stroke", "3"], "--from-stroke must be in 0 to 2, for there are 3 strokes"),
        (["draw", "CROSS", *AT, "--from-stroke", "-1"], "--from-stroke must be in 0 to 2"),
        (["draw", "CROSS", *AT, "--from-stroke", "1:0.5"], "--from-stroke 1:0.5: point is for lasers alone"),
        (["engrave", "CROSS", *AT, "--from-stroke", "1:9"], "--from-stroke 1:9.0: point must be 0 or above and below"),
        (["engrave", "CROSS", *AT, "--from-stroke", "1:nan"], "--from-stroke 1:nan: point must be"),
        (["engrave", "CROSS", *AT, "--from-stroke", "one"], "'one' is no stroke such as 12"),
        (["draw", "CROSS", *AT, "--preview", "out.gif"], "ends neither in .svg nor in .png"),
        (["draw", "CROSS", *AT, "--preview", "/nowhere/at/all.svg"], "--preview /nowhere/at/all.svg: No such file"),
        (["write", "A", *AT, "--font", "comic"], "no font 'comic'; there are: "),
        (["write", "\u20ac", *AT], "has no '\u20ac'"),
        (["write", " ", *AT], "there is nothing to draw"),
        (["write", "A", *AT, "--height", "5", "--size", "9", "9"], "not both"),
        (["write", "A", *AT, "--height", "0"], "height must be above 0 mm"),
        (["draw", "CROSS", "--at", "300", "0", "-40"], "stroke 0, point 1: (325.0, 40.0, -40.0) is out of reach: "),
        (
            ["draw", "CROSS", "--at", "150", "-20", "0", "--arm", "ultraarm", "--size", "400", "400"],
            "y must be in -300 to 300",
        ),
        (
            ["draw", "CROSS", "--at", "150", "-20", "90", "--arm", "mycobot", "--size", "400", "400"],
            "y must be in -281.45",
        ),
    ],
    ids=lambda value: " ".join(value)[-60:] if isinstance(value, list) else "",
)
async def test_what_is_wrong_is_exit_code_2_and_nothing_is_sent(
    sim: Simulation, cross: str, arguments: list[str], why: str
) -> None:
    # A magician's port for all arms: a byte sent is a byte counted.
    given = [cross if each == "CROSS" else each for each in arguments]
    result = await asyncio.to_thread(call, "--json", "--url", sim.url, *given)
    assert (result.exit_code, result.stdout) == (2, "")
    assert why in " ".join(result.stderr.split())
    assert (sim.arm.counters.requests, sim.arm.counters.junk_bytes) == (0, 0)


def test_out_of_reach_names_stroke_point_place_and_reason_in_one_line(cross: str) -> None:
    result = call("draw", cross, "--at", "300", "0", "-40", "--url", "sim:")
    assert result.exit_code == 2
    assert re.fullmatch(
        r"error: cross\.svg: stroke \d, point \d: \(325\.0, 40\.0, -40\.0\) is out of reach: joint 3 would be .*; "
        r"nothing was sent\n",
        result.stderr,
    )


@pytest.mark.full
async def test_the_way_from_where_the_arm_stands_names_the_stroke_and_nothing_moves(sim: Simulation) -> None:
    sim.arm.guide_to(0, 210, 0)
    code, output, errors = await run("--url", sim.url, "write", "-", "--at", "0", "-215", "0")
    assert (code, output) == (1, "")
    assert errors.startswith("error: stroke 0, point 0: ")
    assert not [each for each in sim.arm.executed if each.command in {m.SET_PTP_CMD, m.SET_CP_CMD}]


@pytest.mark.full
@pytest.mark.parametrize(
    ("library", "arguments"),
    [
        ("svgelements", ["draw", str(FILES / "shapes.svg")]),
        ("ezdxf", ["draw", str(FILES / "entities.dxf")]),
        ("PIL", ["engrave", str(FILES / "shapes.png")]),
        ("numpy", ["engrave", str(FILES / "shapes.png"), "--mode", "outline"]),
        ("HersheyFonts", ["write", "A"]),
    ],
)
async def test_without_the_extra_its_name_is_told(sim: Simulation, library: str, arguments: list[str]) -> None:
    code = f"import sys; sys.modules[{library!r}] = None; from dobot_async.__main__ import main; main()"
    done = await finish(await start("--url", sim.url, *arguments, *AT, code=code))
    assert done[:2] == (2, "")
    assert done[2].count("\n") == 1
    assert "pip install 'dobot-async[draw]'" in done[2]
    assert sim.arm.counters.requests == 0


# --- dry runs and previews ---


@pytest.mark.parametrize("arm", ["magician", "ultraarm"])
def test_a_dry_run_needs_no_arm_and_estimates(cross: str, arm: str) -> None:
    at = ["--at", "180", "-20", "20"]
    answer = json.loads(call("--json", "--arm", arm, "draw", cross, *at, "--dry-run").stdout)
    assert (answer["strokes"], answer["sent"]) == (3, False)
    assert 3 < answer["seconds"] < 60
    rest = json.loads(call("--json", "--arm", arm, "draw", cross, *at, "--dry-run", "--from-stroke", "2").stdout)
    assert rest["seconds"] < answer["seconds"]
    assert re.search(
        r"would be drawn in about 0:\d\d min\n", call("--arm", arm, "draw", cross, *at, "--dry-run").stdout
    )


@pytest.mark.full
@pytest.mark.parametrize("kind", ["svg", "png"])
def test_a_preview_is_saved_even_of_what_is_out_of_reach(cross: str, tmp_path: Path, kind: str) -> None:
    for at, code in ((AT, 0), (["--at", "300", "0", "-40"], 2)):
        out = tmp_path / f"out-{code}.{kind}"
        result = call("draw", cross, *at, "--dry-run", "--preview", str(out))
        assert result.exit_code == code, result.output
        assert out.read_bytes()[:4] == {"svg": b"<svg", "png": b"\x89PNG"}[kind]

    if kind == "svg":
        assert 'class="unreachable"' in out.read_text(encoding="utf-8")


def test_order_is_made_or_kept() -> None:
    shapes = str(FILES / "shapes.svg")
    made, kept = (
        json.loads(call("--json", "draw", shapes, *AT, "--size", "60", "60", "--dry-run", *option).stdout)
        for option in ([], ["--keep-order"])
    )
    assert made["travel"] < kept["travel"]
    assert kept["strokes"] == len(read_svg(shapes))


# --- Ctrl-C and failures ---


async def until_it_burns(sim: Simulation, seconds: float, process: Process) -> None:
    """Returns when the laser has been on, and so many seconds of the arm's have gone since."""
    while not sim.arm.laser and process.returncode is None:  # noqa: ASYNC110 - no event tells it
        await asyncio.sleep(0.005)

    await asyncio.sleep(seconds)


@pytest.mark.full
@pytest.mark.parametrize("seed", range(3))
async def test_ctrl_c_switches_the_laser_off_and_the_rest_is_burnt_once(seed: int) -> None:
    chance, picture, options = random.Random(seed), FILES / "shapes.png", ["--size", "24", "24", "--line", "2"]
    with Image.open(picture) as opened:
        width, height = opened.size

    path = read_picture(picture, width=min(24, 24 * width / height), line=2)
    path = as_burnt(path.translate(-path.bounds.left, -path.bounds.bottom))
    async with simulate(listen="tcp://127.0.0.1:0", speed=4) as sim:
        burner, begin, times = Burner(sim), "0", 0
        for _ in range(20):
            arguments = ["engrave", str(picture), *AT, *options, "--from-stroke", begin]
            process = await start("--json", "--url", sim.url, *arguments)
            await until_it_burns(sim, chance.uniform(0.05, 0.8), process)
            for _ in range(chance.choice([1, 1, 3])):
                if process.returncode is None:
                    os.kill(process.pid, signal.SIGINT)
                    await asyncio.sleep(0.001)

            code, output, errors = await finish(process)
            burner.look()
            assert sim.arm.laser == 0
            assert sim.arm.device.idle
            if output:  # it was done before the signal came
                assert json.loads(output)["sent"]
                break

            times += 1
            assert (code, output) == (130, "")
            assert errors.count("\n") == 1
            found = re.fullmatch(
                r"interrupted; the arm was told to stop; stroke \d+ \(of \d+, from 0\) is not known to be done; "
                r"--from-stroke (\S+) draws the rest\n",
                errors,
            )
            if not found:
                assert "all strokes are done" in errors
                break

            begin = found[1]

        assert times >= 2
        assert burner.ends == ends_of(path, PLANE)
        assert burner.length == pytest.approx(path.length, abs=0.02 * times)


@pytest.mark.full
async def test_ctrl_c_of_a_pen_draws_the_stroke_again_from_its_start(cross: str) -> None:
    async with simulate(listen="tcp://127.0.0.1:0", speed=2) as sim:
        process = await start("--url", sim.url, "draw", cross, *AT, "--speed", "20")
        while not lines_drawn(sim):  # noqa: ASYNC110 - no event tells it
            await asyncio.sleep(0.01)

        os.kill(process.pid, signal.SIGTERM)
        code, _, errors = await finish(process)
        assert code == 143
        begin = errors.split("--from-stroke ")[1].split()[0]
        assert begin in {"0", "1"}
        assert sim.arm.device.idle
        before = len(lines_drawn(sim))
        code, _, errors = await run("--url", sim.url, "draw", cross, *AT, "--speed", "20", "--from-stroke", begin)
        assert (code, errors) == (0, "")
        assert len(lines_drawn(sim)) - before in {3, 4}


@pytest.mark.full
async def test_an_alarm_is_exit_code_1_and_tells_the_rest(cross: str) -> None:
    async with simulate(listen="tcp://127.0.0.1:0", speed=2) as sim:
        process = await start("--json", "--url", sim.url, "engrave", cross, *AT)
        await until_it_burns(sim, 0.3, process)
        sim.arm.raise_alarm(0x48)
        code, output, errors = await finish(process)
        assert code == 1
        assert errors.count("\n") == 1
        answer: dict[str, Any] = json.loads(output)
        assert answer["error"] == "ArmAlarm"
        assert re.search(r"--from-stroke \d+(:[\d.]+)? draws the rest", answer["message"])
        assert answer["message"] in errors
        assert sim.arm.laser == 0


@pytest.mark.full
async def test_a_dead_line_is_told_in_time_with_the_rest(cross: str) -> None:
    async with simulate(listen="tcp://127.0.0.1:0", speed=2) as sim:
        process = await start("--url", sim.url, "engrave", cross, *AT)
        await until_it_burns(sim, 0.3, process)
        sim.faults.silent = True
        os.kill(process.pid, signal.SIGINT)
        code, output, errors = await finish(process)
        assert code == 130
        assert "--from-stroke " in errors
        assert "it is not known whether the arm stands, and its laser is off" in errors
        assert "done" not in output.splitlines()[-1:]
