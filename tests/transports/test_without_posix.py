"""What only Linux has, or POSIX, is behind a check: without it the rest works, and what needs it says so."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

GONE = """
import sys

GONE = {"termios", "tty", "pty", "fcntl", "resource", "grp", "pwd", "dbus_fast", "readline", "curses"}


class Gone:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in GONE:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)


sys.meta_path.insert(0, Gone())
for name in [name for name in sys.modules if name.partition(".")[0] in GONE]:
    del sys.modules[name]

import os, signal

for name in ("openpty", "ttyname", "mkfifo", "O_NONBLOCK"):
    delattr(os, name)

for name in ("SIGHUP", "SIGQUIT", "SIGUSR1"):
    delattr(signal, name)

import asyncio
import dobot_async
from dobot_async import Magician, MyCobot, UltraArm
from dobot_async.simulator import simulate
"""
RUN = """
KINDS = {"magician": Magician, "mycobot280": MyCobot, "ultraarm": UltraArm}


async def main():
    for model, kind in KINDS.items():
        for listen in ("memory", "tcp://127.0.0.1:0", *(["udp://127.0.0.1:0"] if model == "magician" else [])):
            homed = {} if model == "mycobot280" else {"homed": True}
            async with simulate(model, listen=listen, speed=20, **homed) as sim:
                async with kind.connect(sim.url, record="trace.jsonl") as arm:
                    await arm.get_pose()
                    await (arm.move_joints(10, 0, 0, 0, 0, 0) if model == "mycobot280" else arm.move_to(220, 0, 40))
                    print(model, listen.partition(":")[0], len(sim.arm.executed) > 0)


asyncio.run(main())
print(sorted(name for name in sys.modules if name.partition(".")[0] in GONE))
"""
REFUSED = {
    "pty": ("simulate(listen='pty')", "ValueError", "this system has no pseudo-terminals, which need POSIX"),
    "ble": ("simulate(listen='ble')", "ImportError", "dobot-async[ble-sim]"),
    "serial": ("Magician.connect('serial:///dev/ttyUSB0')", "ConnectFailed", "pyserial cannot be used here"),
}


def run(program: str, cwd: Path | None = None) -> str:
    """What a program prints where those modules are gone."""
    command = [sys.executable, "-c", GONE + program]
    done = subprocess.run(command, capture_output=True, text=True, timeout=100, cwd=cwd, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.full
def test_memory_tcp_and_udp_need_none_of_it(tmp_path: Path) -> None:
    *lines, left = run(RUN, tmp_path).splitlines()
    assert left == "[]"
    assert lines == [
        "magician memory True",
        "magician tcp True",
        "magician udp True",
        "mycobot280 memory True",
        "mycobot280 tcp True",
        "ultraarm memory True",
        "ultraarm tcp True",
    ]


@pytest.mark.full
@pytest.mark.parametrize("what", REFUSED)
def test_what_needs_it_says_so(what: str) -> None:
    call, error, message = REFUSED[what]
    program = f"""
async def main():
    try:
        async with {call}:
            pass
    except (ImportError, ValueError, dobot_async.ConnectFailed) as error:
        print(type(error).__name__, error)

asyncio.run(main())
"""
    printed = run(program)
    assert printed.startswith(error), printed
    assert message in printed


@pytest.mark.full
def test_the_command_line_needs_none_of_it() -> None:
    program = """
from dobot_async.cli.main import cli
cli(["--url", "sim:?speed=20", "move", "220", "0", "40"], standalone_mode=False)
"""
    assert "220" in run(program)
    keys = """
from dobot_async.cli.keys import keys_of
try:
    with keys_of(sys.stdin):
        pass
except OSError as error:
    print(error)
"""
    assert run(keys).startswith("keys need a POSIX terminal")
