"""`dobot-async teleop` as a process of its own: by keys on a terminal, by lines from a pipe, along a trajectory."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import sys
import threading
from asyncio.subprocess import PIPE, Process
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from dobot_async.simulator import Simulation, simulate

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="no add_reader, no pseudo-terminals")
JOINTS = (0, 30, 40, 0, 0)


@pytest.fixture(autouse=True)
def ended() -> Iterator[None]:
    """Lets the threads end with which asyncio waits for processes; they outlive these for a moment."""
    yield
    for thread in threading.enumerate():
        if thread.name.startswith("asyncio-waitpid"):
            thread.join(1)


async def teleop(sim: Simulation, *arguments: str, stdin: int = PIPE) -> Process:
    return await asyncio.create_subprocess_exec(
        sys.executable, "-m", "dobot_async", "--url", sim.url, *arguments, stdin=stdin, stdout=PIPE, stderr=PIPE
    )


def arm() -> Any:
    return simulate("magician", listen="tcp://127.0.0.1:0", homed=True)


async def test_the_newest_line_is_the_target() -> None:
    async with arm() as sim:
        sim.arm.device.place(JOINTS)
        process = await teleop(sim, "--json", "teleop")
        assert process.stdin
        while sim.arm.pose.y < 10:
            process.stdin.write(b"230 -30 20\n230, 30, 20 # the newest wins\n\n")
            await process.stdin.drain()
            await asyncio.sleep(0.05)

        process.stdin.close()
        output, errors = await process.communicate()
        assert (process.returncode, errors) == (0, b"")
        assert json.loads(output)["sent"] > 0
        assert not sim.arm.device.moving
        assert sim.arm.pose.y > 9


@pytest.mark.cases(1)
@pytest.mark.parametrize(("line", "words"), [(b"1 2 three\n", "line 2: could not"), (b"900 0 0\n", "line 2: (900")])
async def test_a_wrong_line_is_named_and_the_arm_stops(line: bytes, words: str) -> None:
    async with arm() as sim:
        sim.arm.device.place(JOINTS)
        process = await teleop(sim, "teleop")
        _, errors = await process.communicate(b"230 30 20\n" + line)
        assert process.returncode == 1
        assert words in errors.decode()
        assert not sim.arm.device.moving


@pytest.mark.full
async def test_a_trajectory_is_played_and_a_wrong_file_is_told_before(tmp_path: Path) -> None:
    async with arm() as sim:
        sim.arm.device.place(JOINTS)
        pose, path = sim.arm.pose, tmp_path / "way.txt"
        path.write_text("\n".join(f"{0.2 * n} {pose.x} {5 * n} {pose.z}" for n in range(4)))
        process = await teleop(sim, "teleop", "--play", str(path))
        output, errors = await process.communicate()
        assert (process.returncode, errors) == (0, b"")
        assert b"setpoints" in output
        assert sim.arm.pose.y == pytest.approx(15, abs=0.6)

        requests = sim.arm.counters.requests
        for text, words in (("0 1 two", "line 1: not numbers"), ("# nothing", "no point")):
            path.write_text(text)
            process = await teleop(sim, "teleop", "--play", str(path))
            _, errors = await process.communicate()
            assert process.returncode == 2
            assert words in errors.decode()

        assert sim.arm.counters.requests == requests
        path.write_text("0 230 0 20\n1 230 900 20")
        process = await teleop(sim, "teleop", "--play", str(path))
        _, errors = await process.communicate()
        assert process.returncode == 1
        assert "point 1 (from 0)" in errors.decode()


async def test_keys_lead_the_arm_while_they_are_held() -> None:
    async with arm() as sim:
        sim.arm.device.place(JOINTS)
        master, slave = os.openpty()
        process = await teleop(sim, "teleop", stdin=slave)
        os.close(slave)
        try:
            began = sim.arm.pose.y
            while sim.arm.pose.y < began + 10:
                os.write(master, b"a")
                await asyncio.sleep(0.05)

            while sim.arm.device.moving:  # noqa: ASYNC110 - nobody holds a key any more
                await asyncio.sleep(0.02)

            await asyncio.sleep(0.6)
            stood = sim.arm.pose.y
            await asyncio.sleep(0.4)
            assert sim.arm.pose.y == stood
            os.write(master, b"x")
            _, errors = await process.communicate()
            assert (process.returncode, errors) == (0, b"")
        finally:
            os.close(master)


async def test_ctrl_c_stops_the_arm() -> None:
    async with arm() as sim:
        sim.arm.device.place(JOINTS)
        process = await teleop(sim, "teleop")
        assert process.stdin
        while sim.arm.pose.y < 5:
            process.stdin.write(b"230 60 20\n")
            await process.stdin.drain()
            await asyncio.sleep(0.05)

        process.send_signal(signal.SIGINT)
        await process.wait()
        assert process.returncode == 130
        assert not sim.arm.device.moving
        process.stdin.close()
        await process.communicate()
