"""`teach` and `play` as processes: keys come through a pseudo-terminal, and the simulated arm tells what they did."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import sys
import threading
from asyncio.subprocess import PIPE, Process
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import Any

import pytest

from dobot_async.arms.magician import commands as c
from dobot_async.simulator import Simulation, simulate
from dobot_async.teaching import PathSample, Recording, TaughtStep, load_recording, save_recording

MODULE = (sys.executable, "-W", "error", "-m", "dobot_async")
REPEAT = 0.03  # seconds between two repetitions of a key that is held
UP, DOWN, LEFT, PAGE_UP = "\x1b[A", "\x1b[B", "\x1bOD", "\x1b[5~"
FAST = 20


@pytest.fixture(autouse=True)
def ended() -> Iterator[None]:
    """Lets the threads end with which asyncio waits for processes."""
    yield
    for thread in threading.enumerate():
        if thread.name.startswith("asyncio-waitpid"):
            thread.join(1)


SHELL = """
import fcntl, os, signal, sys, termios
fcntl.ioctl(0, termios.TIOCSCTTY, 0)
child = os.fork()
if not child:
    os.setpgid(0, 0)
    signal.signal(signal.SIGTTOU, signal.SIG_IGN)
    os.tcsetpgrp(0, os.getpid())
    signal.signal(signal.SIGTTOU, signal.SIG_DFL)
    os.execv(sys.argv[1], sys.argv[1:])
_, status = os.waitpid(child, os.WUNTRACED)
if os.WIFSTOPPED(status):
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    os._exit(99)
os._exit(os.waitstatus_to_exitcode(status))
"""
"""What a shell does for a program in the foreground of its terminal, so that Ctrl-C and Ctrl-Z are signals."""


class Terminal:
    """A program at a pseudo-terminal."""

    def __init__(self, process: Process, master: int) -> None:
        self.process = process
        self.shown = ""
        self._master = master
        os.set_blocking(master, False)
        self._news = asyncio.Event()
        asyncio.get_running_loop().add_reader(master, self._readable)

    def _readable(self) -> None:
        try:
            data = os.read(self._master, 65536)
        except OSError:
            data = b""
            asyncio.get_running_loop().remove_reader(self._master)

        self.shown += data.decode()
        self._news.set()

    def press(self, text: str) -> None:
        os.write(self._master, text.encode())

    async def hold(self, text: str, until: Callable[[], bool]) -> None:
        """Repeats a key, as a keyboard does, until something is so."""
        while not until():
            self.press(text)
            await asyncio.sleep(REPEAT)

    async def sees(self, words: str) -> None:
        """Returns when something was shown, behind what was seen before."""
        while words not in self.shown:
            assert self.process.returncode is None, self.shown
            self._news.clear()
            await self._news.wait()

        self.shown = self.shown.partition(words)[2]

    async def end(self) -> int:
        return await self.process.wait()


@asynccontextmanager
async def terminal(*arguments: str, shell: bool = False) -> AsyncIterator[Terminal]:
    master, slave = os.openpty()
    command = (*((sys.executable, "-c", SHELL) if shell else ()), *MODULE, *arguments)
    process = await asyncio.create_subprocess_exec(
        *command, stdin=slave, stdout=slave, stderr=slave, start_new_session=shell
    )
    os.close(slave)
    try:
        yield Terminal(process, master)
    finally:
        asyncio.get_running_loop().remove_reader(master)
        if process.returncode is None:
            process.kill()
            await process.wait()

        with suppress(OSError):
            os.close(master)


@asynccontextmanager
async def taught(sim: Simulation, file: Path, *options: str, shell: bool = False) -> AsyncIterator[Terminal]:
    """`teach` with an arm at a terminal, once it takes keys."""
    async with terminal("--url", sim.url, "teach", str(file), *options, shell=shell) as at:
        await at.sees("save, and end")
        yield at


def names_in(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


async def run(*arguments: str, text: str = "") -> tuple[int, str, str]:
    process = await asyncio.create_subprocess_exec(*MODULE, *arguments, stdin=PIPE, stdout=PIPE, stderr=PIPE)
    output, errors = await process.communicate(text.encode())
    assert process.returncode is not None
    return process.returncode, output.decode(), errors.decode()


async def until(condition: Callable[[], bool]) -> None:
    """Returns when something is so."""
    while not condition():  # noqa: ASYNC110 - the simulated arm tells nobody of it
        await asyncio.sleep(0.005)


async def stands(sim: Simulation, where: Callable[[], Any] | None = None) -> Any:
    """Returns where the arm stands, when it does."""
    await until(lambda: not sim.arm.device.moving)
    return where() if where else sim.arm.pose


@pytest.fixture
async def sim() -> AsyncIterator[Simulation]:
    async with simulate(listen="tcp://127.0.0.1:0", homed=True) as simulation:
        yield simulation


# Jogging


async def test_the_arm_moves_while_a_key_is_held_and_no_longer(sim: Simulation, tmp_path: Path) -> None:
    """Nothing but the end of the repetitions stops it: the program goes on."""
    async with taught(sim, tmp_path / "part.json") as at:
        start = sim.arm.pose
        await at.hold(PAGE_UP, lambda: sim.arm.pose.z > start.z + 5)
        assert sim.arm.device.moving
        high = await stands(sim)
        await at.hold(LEFT, lambda: sim.arm.pose.y > high.y + 5)
        left = await stands(sim)
        assert (left.x, left.z) == pytest.approx((high.x, high.z), abs=0.01)
        at.press(" q")
        assert await at.end() == 0

    (step,) = load_recording(tmp_path / "part.json").steps
    assert step.pose == pytest.approx((left.x, left.y, left.z, left.r), abs=0.01)
    jogs = [each.value for each in sim.arm.executed if each.command is c.SET_JOG_CMD]
    assert {each.cmd for each in jogs} <= {c.JOGKey.CP_DOWN, c.JOGKey.BP_DOWN, c.JOGKey.IDLE}


@pytest.mark.full
async def test_a_tap_moves_it_a_little_and_another_key_ends_a_jog(sim: Simulation, tmp_path: Path) -> None:
    async with taught(sim, tmp_path / "part.json") as at:
        start = sim.arm.pose
        at.press(PAGE_UP)
        await until(lambda: sim.arm.pose.z > start.z)
        tapped = await stands(sim)
        await at.hold(PAGE_UP, lambda: sim.arm.pose.z > tapped.z)
        at.press("?")
        await at.sees("save, and end")
        assert not sim.arm.device.moving
        at.press("\t")
        await at.sees("the keys jog joints")
        await at.hold(UP, lambda: sim.arm.pose.j2 > tapped.j2 + 5)
        await stands(sim)
        at.press("q")
        assert await at.end() == 0
        await at.sees("nothing new, and not written")

    assert not (tmp_path / "part.json").exists()


@pytest.mark.full
async def test_what_was_typed_ahead_moves_nothing(sim: Simulation, tmp_path: Path) -> None:
    """While the line stands still keys come in; when it goes on they are old."""
    async with taught(sim, tmp_path / "part.json") as at:
        start = sim.arm.pose
        sim.faults.stalled = True
        at.press(" ")
        for _ in range(20):
            at.press(PAGE_UP)
            await asyncio.sleep(REPEAT)

        await asyncio.sleep(0.3)  # real time: older than any hold
        sim.faults.stalled = False
        await at.sees("point 1")
        at.press(" ")
        await at.sees("point 2")
        assert sim.arm.pose == start
        at.press("q")
        assert await at.end() == 0


@pytest.mark.cases(1)
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGHUP, 129), (signal.SIGTERM, 143)])
async def test_a_signal_stops_the_arm_and_keeps_what_was_taken(
    sim: Simulation, tmp_path: Path, number: int, code: int
) -> None:
    async with taught(sim, tmp_path / "part.json") as at:
        at.press(" ")
        await at.sees("point 1")
        start = sim.arm.pose
        await at.hold(PAGE_UP, lambda: sim.arm.pose.z > start.z)
        at.process.send_signal(number)
        assert await at.end() == code
        await stands(sim)

    assert len(load_recording(tmp_path / "part.json").steps) == 1


@pytest.mark.full
async def test_it_cannot_be_suspended_by_a_key_while_the_arm_moves(sim: Simulation, tmp_path: Path) -> None:
    """Ctrl-Z and Ctrl-S, which would leave nobody to stop the arm, are keys as any other; Ctrl-C is what it is."""
    async with taught(sim, tmp_path / "part.json", shell=True) as at:
        for number, key in enumerate(("\x1a", "\x13"), 1):
            start = sim.arm.pose
            await at.hold(PAGE_UP, lambda start=start: sim.arm.pose.z > start.z)  # type: ignore[misc]
            at.press(key)
            await stands(sim)
            at.press(" ")
            await at.sees(f"point {number}")

        await at.hold(PAGE_UP, lambda: sim.arm.device.moving)
        at.press("\x03")
        assert await at.end() == 130
        await stands(sim)


@pytest.mark.full
async def test_a_terminal_that_is_closed_ends_it(sim: Simulation, tmp_path: Path) -> None:
    master, slave = os.openpty()
    command = [*MODULE, "--url", sim.url, "teach", str(tmp_path / "part.json")]
    process = await asyncio.create_subprocess_exec(*command, stdin=slave, stdout=PIPE, stderr=PIPE)
    os.close(slave)
    assert process.stdout
    try:
        while b"save, and end" not in await process.stdout.readline():
            pass

        os.write(master, PAGE_UP.encode())
        start = sim.arm.pose
        while sim.arm.pose == start:
            os.write(master, PAGE_UP.encode())
            await asyncio.sleep(REPEAT)
    finally:
        os.close(master)

    await process.communicate()
    assert process.returncode == 0
    await stands(sim)


async def test_a_session_with_all_keys(tmp_path: Path) -> None:
    file = tmp_path / "part.playback"
    async with (
        simulate(listen="tcp://127.0.0.1:0", homed=True, speed=FAST) as sim,
        taught(sim, file, "--tool", "cup", "--speed", "30") as at,
    ):
        for key, words in (
            (" ", "point 1: x "),
            ("l", "by lines"),
            ("s", "point 1: "),
            ("w", "stay 0.5 s"),
            ("u", "took back point 1"),
            ("u", "nothing to take back"),
            (" ", "point 1: "),
            ("s", "suction off"),
        ):
            at.press(key)
            await at.sees(words)

        start = sim.arm.pose
        await at.hold(LEFT, lambda: sim.arm.pose.y > start.y + 2)
        await stands(sim)
        at.press(" ")
        await at.sees("line")
        at.press("p")
        await at.sees("played")
        assert [each.value.ptp_mode for each in sim.arm.executed if each.command is c.SET_PTP_CMD] == [
            c.PTPMode.MOVL_XYZ
        ] * 2
        at.press("q")
        assert await at.end() == 0
        await at.sees("part.playback: 2 points")
        assert sim.arm.state.get(c.SET_JOG_COMMON_PARAMS).velocity_ratio != 30

    first, second = load_recording(file).steps
    assert (first.mode, first.suction, second.mode) == ("line", False, "line")


@pytest.mark.full
async def test_any_key_stops_what_is_played(sim: Simulation, tmp_path: Path) -> None:
    file = tmp_path / "part.json"
    save_recording(Recording("magician", steps=(TaughtStep((220, 100, 40, 0)), TaughtStep((220, -100, 40, 0)))), file)
    async with taught(sim, file, "--speed", "10") as at:
        start = sim.arm.pose
        at.press("p")
        await until(lambda: sim.arm.pose.y > start.y)
        at.press(" ")
        await at.sees("stopped")
        assert not sim.arm.device.moving
        assert sim.arm.pose.y < 100
        at.press("q")
        assert await at.end() == 0


@pytest.mark.full
async def test_what_a_playback_file_cannot_hold_is_kept_as_json(tmp_path: Path) -> None:
    file = tmp_path / "part.playback"
    (tmp_path / "part.json").write_text("something else")
    async with simulate(listen="tcp://127.0.0.1:0", homed=True, speed=FAST) as sim, taught(sim, file) as at:
        for key in " sg":
            at.press(key)
            await at.sees("point ")

        at.press("h")
        await at.sees("home")
        at.press("q")
        assert await at.end() == 0
        await at.sees("part.playback cannot hold it: a row has suction or a gripper")
        await at.sees("part-new.json: 1 points")

    assert names_in(tmp_path) == ["part-new.json", "part.json"]
    (step,) = load_recording(tmp_path / "part-new.json").steps
    assert (step.suction, step.gripper) == (True, 0)


@pytest.mark.full
async def test_an_end_of_the_way_is_told_and_can_be_left(tmp_path: Path) -> None:
    async with (
        simulate("mycobot280", listen="tcp://127.0.0.1:0", speed=FAST) as sim,
        terminal("--url", sim.url, "--arm", "mycobot", "teach", str(tmp_path / "part.json")) as at,
    ):
        await at.sees("save, and end")
        at.press("\t")
        await at.sees("joints")
        await at.hold(LEFT, lambda: sim.arm.joints[0] > 167.9)
        await at.hold(LEFT, lambda: not sim.arm.moving)
        await at.sees("MotionStopped: j1+: ")
        await at.hold("\x1b[C", lambda: sim.arm.joints[0] < 150)
        at.press("6")
        await at.sees("jog joint 6")
        await at.hold("]", lambda: sim.arm.joints[5] > 5)
        await stands(sim, lambda: sim.arm.joints)
        at.press(" q")
        assert await at.end() == 0

    (step,) = load_recording(tmp_path / "part.json").steps
    assert step.mode == "joints"
    assert step.joints == pytest.approx(sim.arm.joints, abs=0.1)


# Leading


@pytest.mark.full
async def test_the_key_on_the_forearm(sim: Simulation, tmp_path: Path) -> None:
    file = tmp_path / "part.json"
    command = [*MODULE, "--url", sim.url, "teach", str(file), "--hand", "--count", "2"]
    process = await asyncio.create_subprocess_exec(*command, stdin=asyncio.subprocess.DEVNULL, stdout=PIPE, stderr=PIPE)
    assert process.stdout
    assert b"hold the key" in await process.stdout.readline()
    await until(lambda: bool(sim.arm.state.get(c.SET_HHT_TRIG_OUTPUT_ENABLED)))
    for number, place in enumerate(((220, 30, 50), (200, -40, 20)), 1):
        sim.arm.guide_to(*place)
        assert f"point {number}: ".encode() in await process.stdout.readline()

    output, errors = await process.communicate()
    assert (process.returncode, output.decode(), errors) == (0, f"{file}: 2 points\n", b"")
    assert [step.pose[:2] for step in load_recording(file).steps] == [
        pytest.approx((220, 30), abs=0.01),
        pytest.approx((200, -40), abs=0.01),
    ]


@pytest.mark.full
async def test_a_released_cobot_is_led_until_a_key_is_pressed(tmp_path: Path) -> None:
    file = tmp_path / "part.json"
    async with (
        simulate("mycobot280", listen="tcp://127.0.0.1:0") as sim,
        terminal("--url", sim.url, "--arm", "mycobot", "teach", str(file), "--hand") as at,
    ):
        await at.sees("Go on?")
        assert not sim.arm.released
        at.press("y\n")
        await at.sees("lead it")
        assert sim.arm.released
        sim.arm.guide_to(10, 0, 0, 0, 0, 0)
        await asyncio.sleep(0.3)
        sim.arm.guide_to(20, 0, 0, 0, 0, 0)
        await asyncio.sleep(0.3)
        at.press(" ")
        assert await at.end() == 0
        await at.sees("samples in")
        assert not sim.arm.released

    path = load_recording(file).path
    assert path[-1].joints[0] == pytest.approx(20, abs=0.1)


@pytest.mark.full
async def test_the_answer_in_json(tmp_path: Path) -> None:
    file = tmp_path / "part.json"
    async with simulate("mycobot280", listen="tcp://127.0.0.1:0") as sim:
        options = ("--json", "--arm", "mycobot", "teach", str(file), "--hand", "--yes", "--seconds", "1")
        running = asyncio.create_task(run("--url", sim.url, *options))
        await until(lambda: bool(sim.arm.released))
        for turned in range(100):
            if sim.arm.released:
                sim.arm.guide_to(turned, 0, 0, 0, 0, 0)
                await asyncio.sleep(0.05)

        code, output, errors = await running

    path = load_recording(file).path
    assert (code, errors) == (0, "")
    assert json.loads(output) == {
        "file": str(file),
        "steps": 0,
        "samples": len(path),
        "seconds": path[-1].time - path[0].time,
    }


@pytest.mark.full
async def test_an_ultraarm_that_notices_nothing_leaves_no_file(tmp_path: Path) -> None:
    file = tmp_path / "part.json"
    async with simulate("ultraarm", listen="tcp://127.0.0.1:0", homed=True) as sim:
        options = ("--arm", "ultraarm", "teach", str(file), "--hand", "--yes", "--seconds", "0.3")
        code, _, errors = await run("--url", sim.url, *options)

    assert code == 1
    assert "same place since it was released" in errors
    assert not file.exists()


# Playing

TWO = (TaughtStep((220, 0, 40, 0)), TaughtStep((220, 60, 40, 0)))


@pytest.mark.full
async def test_a_file_is_played(tmp_path: Path) -> None:
    file = tmp_path / "part.json"
    save_recording(Recording("magician", steps=TWO), file)
    async with simulate(listen="tcp://127.0.0.1:0", homed=True, speed=FAST) as sim:
        options = ("play", str(file), "--loop", "2", "--reverse", "--speed", "50")
        assert await run("--url", sim.url, *options) == (0, "part.json: played\n", "")
        places = [each.value.y for each in sim.arm.executed if each.command is c.SET_PTP_CMD]
        assert places == [60, 0, 60, 0]


@pytest.mark.full
async def test_the_arm_of_a_file_is_taken(tmp_path: Path) -> None:
    file = tmp_path / "part.json"
    save_recording(Recording("mycobot", "myarm300", path=(PathSample(0, (0,) * 7), PathSample(1, (5,) * 7))), file)
    async with simulate("myarm300", listen="tcp://127.0.0.1:0", speed=FAST) as sim:
        code, output, errors = await run("--url", sim.url, "--json", "play", str(file))
        assert (code, errors) == (0, "")
        assert json.loads(output) == {"file": str(file), "steps": 0, "samples": 2}
        assert sim.arm.joints == pytest.approx([5] * 7, abs=0.5)

        code, _, errors = await run("--url", sim.url, "--arm", "ultraarm", "play", str(file))
        assert (code, errors.count("\n")) == (2, 1)
        assert "recorded from a myarm300, and --arm is ultraarm; nothing was sent" in errors


@pytest.mark.cases(1)
@pytest.mark.parametrize(
    ("recording", "words"),
    [
        (Recording("magician", steps=(*TWO, TaughtStep((400, 0, 0, 0), name="far"))), "step 3 (far)"),
        (Recording("scara", steps=TWO), "no arm 'scara'"),
        (Recording("magician"), "there is nothing in it"),
    ],
)
async def test_what_is_wrong_in_a_file_is_usage_and_nothing_is_sent(
    sim: Simulation, tmp_path: Path, recording: Recording, words: str
) -> None:
    file = tmp_path / "part.json"
    save_recording(recording, file)
    code, output, errors = await run("--url", sim.url, "play", str(file))
    assert (code, output, errors.count("\n")) == (2, "", 1)
    assert words in errors
    assert errors.endswith("nothing was sent\n")
    assert sim.arm.counters.requests == 0


@pytest.mark.full
async def test_another_tool_on_the_arm_is_found_when_it_is_connected(sim: Simulation, tmp_path: Path) -> None:
    file = tmp_path / "part.json"
    save_recording(Recording("magician", tool="pen", tool_offset=(61, 0, 0), steps=TWO), file)
    code, _, errors = await run("--url", sim.url, "play", str(file))
    assert code == 1
    assert "tool (pen)" in errors
    assert not [each for each in sim.arm.executed if each.command.moves]


@pytest.mark.full
async def test_a_playback_file_is_played_and_what_is_not_known_in_it_is_told(sim: Simulation, tmp_path: Path) -> None:
    file = tmp_path / "part.playback"
    save_recording(Recording("magician", steps=TWO), file)
    file.write_text(file.read_text().replace("</row1>", "<item_13>9</item_13></row1>"))
    code, output, errors = await run("play", str(file), "--dry-run")
    assert (code, output) == (0, "part.playback: would play\n")
    assert "warning: part.playback: line " in errors
    assert "item_13" in errors


@pytest.mark.full
@pytest.mark.parametrize(
    "arguments",
    [
        ["teach", "FILE"],
        ["teach", "FILE", "--speed", "101"],
        ["teach", "FILE", "--hand", "--seconds", "3"],
        ["teach", "FILE", "--count", "3"],
        ["teach", "FILE", "--hand", "--rate", "2000"],
        ["teach", "FILE", "--hand", "--arm", "mycobot"],
        ["teach", "FILE", "--hand", "--yes", "--count", "2", "--arm", "mycobot"],
        ["teach", "part.playback", "--hand", "--yes", "--arm", "ultraarm"],
        ["teach", "/nowhere/part.json", "--hand"],
        ["play", "FILE"],
        ["play", "FILE", "--loop", "-1"],
    ],
)
async def test_wrong_usage(sim: Simulation, tmp_path: Path, arguments: list[str]) -> None:
    places = [str(tmp_path / "part.json") if each == "FILE" else each for each in arguments]
    code, output, errors = await run("--url", sim.url, *places)
    assert (code, output) == (2, "")
    assert errors
    assert sim.arm.counters.requests == 0
