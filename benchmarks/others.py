"""Blocking libraries do what the benchmarks ask, each in a process of its own.

    python benchmarks/others.py LIBRARY TASK PORT COUNT

prints one line of JSON: `seconds`, `cpu` (seconds), and for each of the COUNT how long it took (`times`) and when it
returned by `time.monotonic` (`ended`). Nothing of this package is
imported here, so the interpreter can be one of another environment: pydobotplus wants an older pyserial than the driver
does, and is measured if `DOBOT_BENCH_PYDOBOTPLUS` names the Python of an environment that has it.
"""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

__all__ = ["LIBRARIES", "available", "measured"]

PLUS = "DOBOT_BENCH_PYDOBOTPLUS"
CAPACITY = 32
STEP = 10.0
Call = Callable[[int], Any]


def available() -> dict[str, str]:
    """The libraries for the Magician that can be measured here, each with its interpreter."""
    found = {"pydobotlab": sys.executable} if importlib.util.find_spec("pydobotlab") else {}
    plus = os.environ.get(PLUS) or (sys.executable if importlib.util.find_spec("pydobotplus") else "")
    return found | ({"pydobotplus": plus} if plus else {})


def measured(library: str, task: str, url: str, count: int) -> dict[str, Any]:
    """Has a library do a task so many times; returns what this prints as a program."""
    python = available().get(library, sys.executable)
    command = [python, __file__, library, task, url.removeprefix("serial://"), str(count)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{library} could not do {task}: {done.stderr.strip().splitlines()[-1]}")

    answer: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return answer


def place(number: int) -> tuple[float, float, float, float]:
    """Where the arm is to go next: back and forth."""
    return 220.0, STEP * (number % 2), 40.0, 0.0


def lab(port: str) -> dict[str, Call]:
    """The library pydobotlab, with its settings as packaged.

    On an arm that has executed nothing yet it takes every motion for done, hence the wait.
    """
    import pydobotlab
    from pydobotlab.config import default_config, set_config
    from pydobotlab.protocol import pack_floats, pack_u8

    set_config(default_config())
    arm = pydobotlab.Magician(port, via_broker=False, require_panel=False, verbose=False)
    arm.connect()
    arm.clear_alarm()
    arm.wait(0)
    left = 0

    def cp(number: int) -> None:
        nonlocal left
        while not left:
            left = arm.queued_cmd_left_space()

        left -= 1
        arm.cp(220.0 + 0.5 * (number % 2), 0.0, 40.0)

    return {
        "pose": lambda _: arm.get_pose(),
        "queue": lambda number: arm.queue_command(84, pack_u8(2) + pack_floats(*place(number))),
        "wait": lambda number: arm.ptp(2, *place(number)),
        "cp": cp,
    }


def plus(port: str) -> dict[str, Call]:
    """The library pydobotplus, with its settings as packaged."""
    from pydobotplus import Dobot
    from pydobotplus.dobotplus import MODE_PTP

    arm = Dobot(port)
    return {
        "pose": lambda _: arm.get_pose(),
        "queue": lambda number: arm.move_to(*place(number), wait=False, mode=MODE_PTP.MOVL_XYZ),
        "wait": lambda number: arm.move_to(*place(number), wait=True, mode=MODE_PTP.MOVL_XYZ),
    }


def myarm(port: str) -> dict[str, Call]:
    """The vendor's library with a myArm."""
    from pymycobot import MyArm

    arm = MyArm(port, "115200")
    arm.power_on()
    return {
        "read": lambda _: arm.get_angles(),
        "wait": lambda number: arm.sync_send_angles(joints(number, 7), 80),
    }


def ultraarm(port: str) -> dict[str, Call]:
    """The vendor's library with an ultraArm."""
    from pymycobot.ultraArmP340 import ultraArmP340

    arm = ultraArmP340(port)

    def wait(number: int) -> None:
        arm.set_angles(joints(number, 3), 50)
        arm.sync()

    return {"read": lambda _: arm.get_angles_info(), "wait": wait}


def joints(number: int, count: int) -> list[float]:
    """Which angles the joints are to take next: back and forth with the first one."""
    return [STEP * (1 + number % 2)] + [0.0] * (count - 1)


LIBRARIES: dict[str, Callable[[str], dict[str, Call]]] = {
    "pydobotlab": lab,
    "pydobotplus": plus,
    "pymycobot (myArm)": myarm,
    "pymycobot (ultraArm)": ultraarm,
}


def main() -> None:
    """Does a task."""
    library, task, port, count = sys.argv[1:]
    call = LIBRARIES[library](port)[task]
    ended = []
    lasted = []
    cpu = time.process_time()
    started = time.perf_counter()
    for number in range(int(count)):
        begun = time.perf_counter()
        call(number)
        lasted.append(time.perf_counter() - begun)
        ended.append(time.monotonic())

    seconds = time.perf_counter() - started
    print(json.dumps({"seconds": seconds, "cpu": time.process_time() - cpu, "times": lasted, "ended": ended}))


if __name__ == "__main__":
    main()
