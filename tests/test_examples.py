"""Each program in examples/ does what it says, as a process of its own, and prints nothing to stderr."""

from __future__ import annotations

import asyncio
import os
import re
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from dobot_async import Kinematics

EXAMPLES = Path(__file__).parents[1] / "examples"
NUMBER = re.compile(r"-?\d+(?:\.\d+)?")
SLOW_MACHINE = re.compile(r"^Executing <.*> took [\d.]+ seconds\n", re.MULTILINE)


async def run(name: str, *arguments: str) -> str:
    """Runs an example to its end, and returns what it printed."""
    process = await asyncio.create_subprocess_exec(
        sys.executable,
        *("-X", "dev", "-W", "error", str(EXAMPLES / name), *arguments),
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
        env={name: value for name, value in os.environ.items() if name != "DOBOT_URL"},
    )
    output, errors = await process.communicate()
    # In its debug mode asyncio remarks on callbacks that took longer than 0.1 s, which is the machine's fault.
    assert SLOW_MACHINE.sub("", errors.decode()) == ""
    assert process.returncode == 0
    return output.decode()


def numbers(line: str) -> list[float]:
    return [float(number) for number in NUMBER.findall(line)]


def line_with(output: str, word: str) -> str:
    (line,) = [line for line in output.splitlines() if word in line]
    return line


def check_connect_and_read(output: str) -> None:
    """The pose that the arm tells is the one that its joints give."""
    joints = numbers(line_with(output, "joints"))
    tool = numbers(line_with(output, "tool"))
    assert tool == pytest.approx(Kinematics().forward(*joints), abs=0.05)
    assert tool == pytest.approx(numbers(line_with(output, "computed")), abs=0.05)
    requests, replies, _ = numbers(line_with(output, "link"))
    assert requests == replies > 0


def check_pick_and_place(output: str) -> None:
    assert [numbers(line) for line in output.splitlines()] == [[1], [2], [3]]


def check_cp_drawing(output: str) -> None:
    """Each of the points got an index of its own, nothing came between, and the curve is closed."""
    first, last = numbers(line_with(output, "accepted"))
    assert last - first + 1 == 1000
    (distance,) = numbers(line_with(output, "drawn"))
    assert distance < 0.05


def check_jog(output: str) -> None:
    before, after = numbers(line_with(output, "->"))
    assert before < after
    turns = [numbers(line.removeprefix("j1"))[0] for line in output.splitlines() if line.startswith("j1")]
    assert turns == sorted(set(turns))


def check_io_and_conveyor(output: str) -> None:
    assert re.findall(r"lamp +(on|off)", output) == ["on", "off", "off"]
    value, highest = numbers(line_with(output, "knob"))
    assert 0 <= value <= highest


def check_two_arms(output: str) -> None:
    lines = output.splitlines()
    assert "left reached (240, 20, 40)" in lines
    assert "right reached (400, 0, 40)" not in lines
    assert "0x11" in line_with(output, "right failed")
    assert [line.split(" at ")[0] for line in lines[-2:]] == ["left stopped", lines[-1]]


def check_error_handling(output: str) -> None:
    kinds = [line.split(":")[0] for line in output.splitlines()]
    assert kinds == ["wrong port", "checked before", "told by the arm", "too slow", "stopped", "and the arm goes on"]


CHECKS: dict[str, Callable[[str], None]] = {
    "connect_and_read.py": check_connect_and_read,
    "pick_and_place.py": check_pick_and_place,
    "cp_drawing.py": check_cp_drawing,
    "jog.py": check_jog,
    "io_and_conveyor.py": check_io_and_conveyor,
    "two_arms.py": check_two_arms,
    "error_handling.py": check_error_handling,
}


def test_each_example_is_checked() -> None:
    assert {path.name for path in EXAMPLES.glob("*.py")} == set(CHECKS)


@pytest.mark.parametrize("name", CHECKS)
async def test_example(name: str) -> None:
    CHECKS[name](await run(name))
