"""Programs as processes of their own: however they end, the arm stands, and nothing of them is left."""

from __future__ import annotations

import asyncio
import re
import signal
import subprocess
import sys
import textwrap
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest

from dobot_async.simulator import simulate

SLOW_MACHINE = re.compile(r"^Executing <.*> took [\d.]+ seconds\n", re.MULTILINE)
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="no SIGHUP, and no SIGTERM that can be handled")

HEAD = """
import os, signal, sys, threading, time
from dobot_async.sync import Drawing, Magician, Recorder, discover, draw, pick, play
from dobot_async.toolpath import Stroke, Toolpath, WorkPlane

url = sys.argv[1]
signal.signal(signal.SIGINT, signal.default_int_handler)

def moving(arm):
    while True:
        before = arm.get_pose().y
        time.sleep(0.02)
        if arm.get_pose().y != before:
            print("moving", flush=True)
            return
"""


@asynccontextmanager
async def program(body: str) -> AsyncIterator[tuple[Any, asyncio.subprocess.Process]]:
    """Runs a program until its arm moves; yields the simulation, and the program."""
    async with simulate(listen="tcp://127.0.0.1:0", speed=1, homed=True) as sim:
        source = HEAD + textwrap.dedent(body)
        process = await asyncio.create_subprocess_exec(
            sys.executable, "-X", "dev", "-c", source, sim.url, stdout=subprocess.PIPE, stderr=subprocess.PIPE
        )
        try:
            assert process.stdout
            line = await process.stdout.readline()
            assert line == b"moving\n", (await process.communicate())[1].decode()
            yield sim, process
        finally:
            if process.returncode is None:
                process.kill()
                await process.wait()


async def ended(process: asyncio.subprocess.Process) -> tuple[int | None, str]:
    """How a program has ended, and what it said."""
    async with asyncio.timeout(60):
        _, said = await process.communicate()

    # In its debug mode asyncio remarks on callbacks that took longer than 0.1 s, which is the machine's fault.
    return process.returncode, SLOW_MACHINE.sub("", said.decode())


def stands(sim: Any) -> None:
    """The arm was stopped in the middle of its way."""
    assert sim.arm.device.idle
    assert [each.outcome for each in sim.arm.executed if each.name == "SetPTPCmd"] == ["aborted"]


FAR = "260, 150, 40"
BLOCKED = f"""
with Magician.connect(url) as arm:
    threading.Thread(target=moving, args=(arm,), daemon=True).start()
    arm.move_to({FAR})
"""
SLEEPING = f"""
with Magician.connect(url) as arm:
    arm.queue.move_to({FAR})
    moving(arm)
    time.sleep(600)
"""


@pytest.mark.cases(1)
@pytest.mark.parametrize("body", [BLOCKED, SLEEPING], ids=["in a call", "between calls"])
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
async def test_a_signal_stops_the_arm_and_ends_the_program(name: str, body: str) -> None:
    async with program(body) as (sim, process):
        process.send_signal(getattr(signal, name))
        code, said = await ended(process)
        stands(sim)
        if name == "SIGINT":
            assert code in {-signal.SIGINT, 1, 130}
            assert "KeyboardInterrupt" in said
        else:
            assert code == 128 + getattr(signal, name)
            assert "Traceback" not in said


PICKING = "pick(arm, (260, 150, 0), tool='suction')"
PICKING_BY_HAND = "pick(arm, (260, 150, 0), tool=lambda take: arm.move_to(200, -150, 40))"
DRAWING = "draw(arm, Toolpath([Stroke([(0, 0), (40, 60)])]), WorkPlane.flat(220, 0, 0), speed=5)"
PLAYING = (
    "recorder = Recorder(arm); recorder.point(); arm.move_by(y=1); recorder.point(); "
    "play(arm, recorder.recording, loops=None)"
)


@pytest.mark.full
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
@pytest.mark.parametrize("call", [PICKING, PICKING_BY_HAND, DRAWING, PLAYING], ids=["pick", "own tool", "draw", "play"])
async def test_a_signal_in_a_function_stops_the_arm_and_ends_the_program(name: str, call: str) -> None:
    body = f"""
        with Magician.connect(url) as arm:
            threading.Thread(target=moving, args=(arm,), daemon=True).start()
            {call}
    """
    async with program(body) as (sim, process):
        process.send_signal(getattr(signal, name))
        code, said = await ended(process)
        assert sim.arm.device.idle
        assert not sim.arm.suction or "suction" in call
        assert code in {-signal.SIGINT, 1, 130} if name == "SIGINT" else code == 128 + signal.SIGTERM, said
        assert "KeyboardInterrupt" in said if name == "SIGINT" else "Traceback" not in said


@pytest.mark.full
async def test_a_tool_that_fails_ends_the_program_and_stops_the_arm() -> None:
    body = """
        def tool(take):
            arm.queue.move_to(200, -150, 40)
            moving(arm)
            raise ZeroDivisionError("mine")

        with Magician.connect(url) as arm:
            pick(arm, (220, 0, 0), tool=tool)
    """
    async with program(body) as (sim, process):
        code, said = await ended(process)
        assert code == 1
        assert said.rstrip().endswith("ZeroDivisionError: mine")
        assert sim.arm.device.idle
        assert [each.outcome for each in sim.arm.executed if each.name == "SetPTPCmd"] == ["done", "done", "aborted"]


@pytest.mark.full
async def test_a_search_that_was_begun_and_forgotten_holds_up_no_end() -> None:
    body = """
        with Magician.connect(url) as arm:
            arm.queue.move_to(260, 150, 40)
            moving(arm)

        searching = discover(sources=["serial"], timeout=0)
        print(list(searching), next(discover(sources=["serial"], timeout=0), None))
        begun = discover(sources=["serial", "wifi"], timeout=60)
        threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
        next(begun)
    """
    async with program(body) as (_, process):
        code, said = await ended(process)
        assert code in {-signal.SIGINT, 1, 130}
        assert said.rstrip().endswith("KeyboardInterrupt")
        assert "never awaited" not in said
        assert "ignored" not in said


async def test_an_exception_stops_the_arm() -> None:
    async with program(f"with Magician.connect(url) as arm:\n arm.queue.move_to({FAR})\n moving(arm)\n 1 / 0") as found:
        sim, process = found
        code, said = await ended(process)
        assert code == 1
        assert said.rstrip().endswith("ZeroDivisionError: division by zero")
        stands(sim)


@pytest.mark.cases(1)
@pytest.mark.parametrize("end", ["", "sys.exit(3)", "1 / 0"])
async def test_a_block_that_was_never_left_is_left_at_the_end_of_the_program(end: str) -> None:
    body = f"arm = Magician.connect(url).__enter__()\narm.queue.move_to({FAR})\nmoving(arm)\n{end}"
    async with program(body) as (sim, process):
        code, said = await ended(process)
        assert code == {"": 0, "sys.exit(3)": 3, "1 / 0": 1}[end]
        assert "was still open at the end of the program" in said
        stands(sim)


@pytest.mark.full
async def test_the_end_of_the_program_stops_the_arm_of_a_daemon_thread() -> None:
    body = f"""
        begun = threading.Event()

        def work():
            with Magician.connect(url) as arm:
                arm.queue.move_to({FAR})
                moving(arm)
                begun.set()
                time.sleep(600)

        threading.Thread(target=work, daemon=True).start()
        begun.wait()
    """
    async with program(body) as (sim, process):
        code, _ = await ended(process)
        assert code == 0
        stands(sim)


@pytest.mark.full
async def test_sigterm_stops_the_arm_that_another_thread_drives_and_that_thread_ends() -> None:
    body = f"""
        def work():
            with Magician.connect(url) as arm:
                threading.Thread(target=moving, args=(arm,), daemon=True).start()
                arm.move_to({FAR})

        with Magician.connect("sim:"):
            thread = threading.Thread(target=work)
            thread.start()
            thread.join()
    """
    async with program(body) as (sim, process):
        process.send_signal(signal.SIGTERM)
        code, said = await ended(process)
        assert code == 128 + signal.SIGTERM, said
        stands(sim)


@pytest.mark.full
async def test_a_program_that_handles_sigterm_itself_is_left_alone() -> None:
    body = f"""
        def mine(number, frame):
            print("mine", flush=True)
            os._exit(7)

        signal.signal(signal.SIGTERM, mine)
        with Magician.connect(url) as arm:
            arm.queue.move_to({FAR})
            moving(arm)
            time.sleep(600)
    """
    async with program(body) as (_, process):
        process.send_signal(signal.SIGTERM)
        code, _ = await ended(process)
        assert code == 7


@pytest.mark.full
async def test_after_the_last_block_signals_and_threads_are_as_before() -> None:
    body = """
        before = [signal.getsignal(each) for each in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT)]
        with Magician.connect(url) as arm:
            arm.queue.move_to(260, 150, 40)
            moving(arm)
            assert signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL

        assert [signal.getsignal(each) for each in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT)] == before
        assert threading.enumerate() == [threading.main_thread()]
    """
    async with program(body) as (_, process):
        assert await ended(process) == (0, "")
