"""The vendor's own library drives the simulated ultraArm, over a pseudo-terminal, as it drives a real one.

It blocks, hence each call runs in a thread while the arm answers in the loop; after each, both sides are looked at:
what the library made of the answers, and what happened at the arm.
"""

from __future__ import annotations

import asyncio
import sys
import time
import warnings
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.ultraarm import commands as c
from dobot_async.simulator import Simulation, UltraArmQuirks, simulate

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # what it imports beside this is not up to date
    from pymycobot.ultraArmP340 import ultraArmP340

library_module = sys.modules[ultraArmP340.__module__]

SPEED = 50.0
NONE = UltraArmQuirks()
IN_TIME = 30.0
SHORT = 0.05


@pytest.fixture(autouse=True)
def no_long_naps(monkeypatch: pytest.MonkeyPatch) -> None:
    """The library sleeps a second after it has opened the port, and two while the queue is full: the arm needs neither.

    Its 20 ms between a command and its answer stay.
    """
    hurried = SimpleNamespace(**{**vars(time), "sleep": lambda seconds: time.sleep(min(seconds, SHORT))})
    monkeypatch.setattr(library_module, "time", hurried)


class Vendor:
    """The library, and the arm that it talks to."""

    def __init__(self, sim: Simulation, library: Any) -> None:
        self.sim = sim
        self.library = library

    async def __call__(self, name: str, *args: Any) -> Any:
        """Calls a method of the library."""
        async with asyncio.timeout(IN_TIME):
            return await asyncio.to_thread(getattr(self.library, name), *args)

    def done(self, row: Command[Any, Any]) -> list[Any]:
        """The parameters of what the arm has executed of a row, in order."""
        return [each.value for each in self.sim.arm.executed if each.command is row and each.outcome == "done"]


@asynccontextmanager
async def vendor(quirks: UltraArmQuirks = NONE) -> AsyncIterator[Vendor]:
    """The library, connected."""
    async with simulate("ultraarm", homed=True, listen="pty", speed=SPEED, quirks=quirks) as sim:
        library: Any = await asyncio.to_thread(ultraArmP340, sim.url.removeprefix("serial://"))
        try:
            yield Vendor(sim, library)
        finally:
            await asyncio.to_thread(library.close)


async def test_readings() -> None:
    async with vendor() as arm:
        assert await arm("get_angles_info") == [0, 0, 0, 0]
        assert await arm("get_coords_info") == pytest.approx([235.55, 0, 130, 0])
        assert (await arm("get_switch_state")).strip() == "ENDSTOP[1 ,1 ,1]"
        assert await arm("get_system_version") == 1.2
        assert await arm("get_modify_version") == 3
        assert await arm("get_calibrate_step") == 12
        assert await arm("calibrate_joint") == 1
        assert await arm("is_moving_end") == 1
        assert arm.sim.arm.counters.unknown == 0


async def test_motions() -> None:
    async with vendor() as arm:
        await arm("go_zero")
        await arm("sync")
        assert arm.sim.arm.registers.homed
        await arm("set_coords", [200, 0, 40], 100)
        await arm("sync")
        assert await arm("get_coords_info") == pytest.approx([200, 0, 40, 0])
        await arm("set_coord", "Y", 50.5, 100)
        await arm("sync")
        assert await arm("get_coords_info") == pytest.approx([200, 50.5, 40, 0])
        await arm("set_angles", [30, 10.5, 20], 100)
        await arm("sync")
        assert await arm("get_angles_info") == pytest.approx([30, 10.5, 20, 0])
        await arm("set_angle", 1, -45, 150)
        await arm("sync")
        assert await arm("get_angles_info") == pytest.approx([-45, 10.5, 20, 0])
        await arm("set_mode", 1)
        await arm("set_coords", [0, 0, 10], 50)
        await arm("set_mode", 0)
        await arm("sync")
        assert arm.done(c.MOVE_COORDS)[-1] == c.CoordsMove(0, 0, 10, f=50)
        assert not arm.sim.arm.registers.relative
        await arm("sleep", 1)
        await arm("set_init_pose", [0, 0, 0])
        await arm("sync")
        assert await arm("get_coords_info") == pytest.approx([0, 0, 0, 0])
        assert arm.done(c.WAIT) == [c.Dwell(1)]
        assert arm.sim.arm.counters.unknown == arm.sim.arm.counters.overflowed == 0


async def test_jogs() -> None:
    async with vendor() as arm:
        await arm("set_jog_angle", 1, 0, 100)
        await arm("set_jog_stop")
        turned = await arm("get_angles_info")
        assert turned[0] > 0
        assert await arm("is_moving_end") == 1
        await arm("set_jog_coord", 3, 1, 100)
        await arm("set_jog_stop")
        assert (await arm("get_coords_info"))[2] < 130


async def test_what_is_mounted() -> None:
    async with vendor() as arm:
        registers: Any = arm.sim.arm.registers
        await arm("set_pwm", 200)
        assert registers.pwm == 200
        await arm("set_gpio_state", 1)
        assert registers.pump, "M23, which starts the pump as the manual has it, and stops it as this library does"
        await arm("set_gpio_state", 0)
        assert not registers.pump
        await arm("set_fan_state", 0)
        assert not registers.fan
        await arm("set_gripper_state", 60, 200)
        assert await arm("get_gripper_angle", 1) == "60"
        await arm("set_gripper_close_position", 1, 30)
        assert await arm("get_gripper_position", 1) == [60, 30]
        await arm("set_gripper_release")
        assert [registers.gripper] == [None]
        await arm("set_gripper_zero")
        assert registers.gripper == 0
        await arm("set_system_value", 7, 56, 2048, 2)
        assert await arm("get_system_value", 7, 56, 2) == 2048
        await arm("set_speed_mode", 0)
        assert registers.speed_mode == 0
        await arm("release_all_servos")
        assert not registers.powered
        await arm("power_on")
        assert registers.powered
        assert arm.sim.arm.counters.unknown == 0


async def test_a_file_of_many_lines(tmp_path: Path) -> None:
    lines = [f"G0 X{200 + step / 4} Y0 Z40 F200" for step in range(40)]
    file = tmp_path / "many.gcode"
    file.write_text("\n".join(lines))
    async with vendor() as arm:
        await arm("play_gcode_file", str(file))
        await arm("sync")
        assert [each.x for each in arm.done(c.MOVE_COORDS)] == [200 + step / 4 for step in range(40)]
        assert arm.sim.arm.counters.overflowed == 0


@pytest.mark.parametrize("acknowledge", ["ok", "nothing"])
async def test_other_firmware(acknowledge: Any) -> None:
    async with vendor(UltraArmQuirks(acknowledge=acknowledge, blanks=False)) as arm:
        await arm("set_coords", [200, 0, 40], 100)
        await arm("sync")
        assert await arm("get_coords_info") == pytest.approx([200, 0, 40, 0])
