"""The vendor's own library drives the simulated arms: pymycobot, over a pseudo-terminal, as it drives real ones.

It blocks, hence each call runs in a thread while the arm answers in the loop; after each, both sides are looked at:
what the library returned, and what happened at the arm.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from functools import partial
from types import SimpleNamespace
from typing import Any

import pytest

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.mycobot import commands as c
from dobot_async.simulator import MyCobotQuirks, SimulatedMyCobot, simulate

pymycobot = pytest.importorskip("pymycobot")

SPEED = 20.0
NEW = MyCobotQuirks()
OF_MYARM: frozenset[Command[Any, Any]] = frozenset(
    {c.SEND_ANGLE, c.SEND_ANGLES, c.SEND_COORD, c.SEND_COORDS, c.SET_GRIPPER_VALUE}
)
"""What a newer myArm acknowledges, as the library has it; any other acknowledgement, or an echo, confuses it."""
IN_TIME = 20.0
HERE = [20.0, -20.5, 30.25, -40.75, 50.0, -60.0]
SEVEN = [*HERE, 90.0]
Check = Callable[[SimulatedMyCobot], Any]
Step = tuple[str, tuple[Any, ...], Any, Check]


@pytest.fixture(autouse=True)
def no_naps(monkeypatch: pytest.MonkeyPatch) -> None:
    """The library sleeps after opening a port, for boards that restart then; the simulated one does not.

    Its texts come in the language that it finds by a function that newer Pythons warn of.
    """
    monkeypatch.setattr("locale.getdefaultlocale", lambda *_: ("en_US", "UTF-8"))
    clock = SimpleNamespace(time=time.time, sleep=lambda seconds: time.sleep(min(seconds, 0.02)))
    for module in ("mycobot280", "mycobot320", "mecharm270", "mypalletizer260", "myarm"):
        monkeypatch.setattr(f"pymycobot.{module}.time", clock, raising=False)


class Lab:
    """The library, and the arm that it talks to."""

    def __init__(self, arm: SimulatedMyCobot, client: Any) -> None:
        self.arm = arm
        self.client = client

    async def __call__(self, name: str, *args: Any, **details: Any) -> Any:
        """Calls a method of the library."""
        async with asyncio.timeout(IN_TIME):
            return await asyncio.to_thread(getattr(self.client, name), *args, **details)

    def rests(self, check: Check) -> bool:
        """Whether the arm stands, and is as it should be."""
        return not self.arm.moving and bool(check(self.arm))

    async def stands(self) -> None:
        """Returns when the arm stands."""
        await self.until(lambda: not self.arm.moving, "it stands")

    async def until(self, condition: Callable[[], Any], what: str) -> None:
        """Returns when something has come about; some calls return before the arm has heard of them."""
        try:
            async with asyncio.timeout(IN_TIME):
                while True:
                    if condition():
                        return

                    await asyncio.sleep(0.005)
        except TimeoutError:
            pytest.fail(f"{what}: the arm is at {self.arm.joints}")

    async def take(self, steps: list[Step]) -> None:
        """Makes calls, and looks at what came back and what came of it once the arm stands."""
        for name, args, returned, check in steps:
            found = await self(name, *args)
            assert found == (pytest.approx(returned, abs=0.05) if isinstance(returned, list) else returned), name
            await self.until(partial(self.rests, check), name)


@asynccontextmanager
async def connected(model: str, client: str, quirks: MyCobotQuirks = NEW) -> AsyncIterator[Lab]:
    """A simulated arm, and the library connected to it."""
    async with simulate(model, listen="pty", speed=SPEED, quirks=quirks) as sim:
        made = await asyncio.to_thread(getattr(pymycobot, client), sim.url.removeprefix("serial://"), "115200")
        try:
            yield Lab(sim.arm, made)
        finally:
            made._serial_port.close()


def anything(_: SimulatedMyCobot) -> bool:
    """There is nothing to see at the arm."""
    return True


def at(*joints: float) -> Check:
    """The arm stands there."""
    return lambda arm: list(arm.joints) == pytest.approx(joints, abs=0.02)


def setting(row: Any, value: Any) -> Check:
    """The arm remembers what was set."""
    return lambda arm: arm.settings[row] == value


async def test_mycobot_280() -> None:
    steps: list[Step] = [
        ("get_system_version", (), 1.3, anything),
        ("get_basic_version", (), 1.4, anything),
        ("is_power_on", (), 1, anything),
        ("power_off", (), 1, lambda arm: not arm.powered),
        ("is_power_on", (), 0, anything),
        ("power_on", (), 1, lambda arm: arm.powered),
        ("is_controller_connected", (), 1, anything),
        ("set_fresh_mode", (1,), 1, setting(c.SET_FRESH_MODE, True)),
        ("get_fresh_mode", (), 1, anything),
        ("set_fresh_mode", (0,), 1, setting(c.SET_FRESH_MODE, False)),
        ("get_angles", (), [0.0] * 6, anything),
        ("send_angles", (HERE, 80), 1, at(*HERE)),
        ("get_angles", (), HERE, anything),
        ("is_in_position", (HERE, 0), 1, anything),
        ("is_in_position", ([0] * 6, 0), 0, anything),
        ("is_moving", (), 0, anything),
        ("send_angle", (1, 45, 80), 1, at(45, *HERE[1:])),
        ("send_angle", (1, 20, 80), 1, at(*HERE)),
        ("sync_send_angles", ([0, 0, 0, 0, 0, 0], 90), 1, at(0, 0, 0, 0, 0, 0)),
        ("send_angles", (HERE, 90), 1, at(*HERE)),
        ("get_encoder", (1,), round(2048 + 20 * 4096 / 360), anything),
        ("set_encoder", (1, 2048, 80), 1, at(0, *HERE[1:])),
        ("get_joint_min_angle", (2,), -140.0, anything),
        ("get_joint_max_angle", (2,), 140.0, anything),
        ("set_joint_min", (2, -90), 1, lambda arm: arm.ways.limits[1] == (-90, 140)),
        ("get_joint_min_angle", (2,), -90.0, anything),
        ("is_servo_enable", (1,), 1, anything),
        ("is_all_servo_enable", (), 1, anything),
        ("set_servo_data", (1, 21, 7), 1, lambda arm: arm.servo_data == {(1, 21): 7}),
        ("get_servo_data", (1, 21), 7, anything),
        ("get_servo_speeds", (), [0] * 6, anything),
        ("get_servo_voltages", (), [7.2] * 6, anything),
        ("get_servo_status", (), [0] * 6, anything),
        ("get_servo_temps", (), [30] * 6, anything),
        ("set_color", (0, 0, 255), 1, lambda arm: arm.color == c.RGB(0, 0, 255)),
        ("set_digital_output", (22, 1), 1, lambda arm: arm.outputs.get((c.SET_DIGITAL_OUTPUT, 22)) == 1),
        ("get_digital_input", (22,), 0, anything),
        ("set_gripper_value", (40, 100), 1, anything),
        ("set_tool_reference", ([0, 0, 50, 0, 0, 0],), 1, anything),
        ("get_tool_reference", (), [0.0, 0.0, 50.0, 0.0, 0.0, 0.0], anything),
        ("set_reference_frame", (1,), 1, setting(c.SET_REFERENCE_FRAME, c.ReferenceFrame.WORLD)),
        ("get_reference_frame", (), 1, anything),
        ("set_movement_type", (1,), 1, setting(c.SET_MOVEMENT_TYPE, c.MoveMode.LINEAR)),
        ("get_movement_type", (), 1, anything),
        ("get_end_type", (), 0, anything),
        ("get_error_information", (), 0, anything),
        ("get_tof_distance", (), 123, anything),
        ("go_home", (), 1, at(0, 0, 0, 0, 0, 0)),
    ]
    assert len(steps) >= 40
    async with connected("mycobot280", "MyCobot280") as lab:
        await lab.take(steps)
        assert lab.arm.counters.unknown == lab.arm.counters.unfit == 0


async def test_mycobot_280_moves_in_coordinates_jogs_pauses_and_stops() -> None:
    async with connected("mycobot280", "MyCobot280") as lab:
        await lab("send_angles", HERE, 90)
        await lab.stands()
        coords = await lab("get_coords")
        assert coords == pytest.approx(lab.arm.coords, abs=0.06)
        target = [coords[0], coords[1], coords[2] - 20, *coords[3:]]
        assert await lab("send_coords", target, 80, 1) == 1
        await lab.stands()
        assert await lab("get_coords") == pytest.approx(target, abs=0.2)
        assert await lab("send_coord", 3, coords[2], 80) == 1
        await lab.stands()
        assert (await lab("get_coords"))[2] == pytest.approx(coords[2], abs=0.2)
        assert await lab("get_angles_coords") == pytest.approx([*lab.arm.joints, *lab.arm.coords], abs=0.06)
        assert await lab("is_in_position", coords, 1) == 1
        before = lab.arm.joints[0]
        assert await lab("jog_angle", 1, 1, 1) == 1
        assert await lab("is_moving") == 1
        assert await lab("stop") == 1
        assert await lab("is_moving") == 0
        assert lab.arm.joints[0] > before
        assert await lab("send_angle", 1, -160, 1) == 1
        assert await lab("pause") == 1
        assert await lab("is_paused") == 1
        held = lab.arm.joints
        assert await lab("resume") == 1
        await lab.until(lambda: lab.arm.joints[0] < held[0], "it goes on")
        assert await lab("stop") == 1
        lab.arm.raise_error(2, 16)
        assert (await lab("read_next_error"))[1] != 0


async def test_myarm_300() -> None:
    steps: list[Step] = [
        ("is_power_on", (), 1, anything),
        ("is_controller_connected", (), 1, anything),
        ("get_angles", (), [0.0] * 7, anything),
        ("send_angles", (SEVEN, 80), [1], at(*SEVEN)),
        ("get_angles", (), SEVEN, anything),
        ("get_radians", (), [0.349, -0.358, 0.528, -0.711, 0.873, -1.047, 1.571], anything),
        ("send_angle", (7, -90, 80), [1], at(*HERE, -90)),
        ("jog_increment", (7, 30, 80), None, at(*HERE, -60)),
        ("is_in_position", ([*HERE, -60.0], 0), 1, anything),
        ("is_moving", (), 0, anything),
        ("is_paused", (), 0, anything),
        ("set_encoder", (7, 2048, 80), None, at(*HERE, 0)),
        ("get_encoder", (7,), 2048, anything),
        ("set_encoders", ([2048] * 7, 80), None, at(*[0.0] * 7)),
        ("get_encoders", (), [2048] * 7, anything),
        ("get_joint_min_angle", (2,), -70.0, anything),
        ("get_joint_max_angle", (2,), 115.0, anything),
        ("set_joint_max", (2, 90), None, lambda arm: arm.ways.limits[1] == (-70, 90)),
        ("is_servo_enable", (7,), 1, anything),
        ("set_fresh_mode", (1,), None, setting(c.SET_FRESH_MODE, True)),
        ("get_fresh_mode", (), 1, anything),
        ("set_color", (9, 8, 7), None, lambda arm: arm.color == c.RGB(9, 8, 7)),
        ("set_digital_output", (23, 1), None, lambda arm: arm.outputs.get((c.SET_DIGITAL_OUTPUT, 23)) == 1),
        ("set_basic_output", (2, 1), None, lambda arm: arm.outputs.get((c.SET_BASIC_OUTPUT, 2)) == 1),
        ("get_basic_input", (2,), 0, anything),
        ("set_gripper_value", (30, 100), [1], anything),
        ("set_gripper_state", (0, 100), None, anything),
        ("set_tool_reference", ([0, 0, 50, 0, 0, 0],), None, anything),
        ("get_tool_reference", (), [0.0, 0.0, 50.0, 0.0, 0.0, 0.0], anything),
        ("set_movement_type", (1,), None, setting(c.SET_MOVEMENT_TYPE, c.MoveMode.LINEAR)),
        ("get_movement_type", (), 1, anything),
        ("get_transponder_mode", (), 0, anything),
        ("get_solution_angles", (), 0.0, anything),
        ("release_servo", (3,), None, lambda arm: arm.released == {3}),
        ("focus_servo", (3,), None, lambda arm: not arm.released),
        ("get_system_version", (), 1.3, anything),
    ]
    async with connected("myarm300", "MyArm", MyCobotQuirks(acknowledges=OF_MYARM, echo=False)) as lab:
        await lab.take(steps)
        coords = await lab("get_coords")
        assert coords == pytest.approx(lab.arm.coords, abs=0.06)
        assert lab.arm.counters.unknown == lab.arm.counters.unfit == 0


async def test_what_the_library_says_of_an_arm_that_acknowledges_nothing() -> None:
    async with connected("myarm300", "MyArm") as lab:
        assert await lab("send_angle", 1, 20, 80) == -1  # it has moved all the same, once
        await lab.stands()
        assert lab.arm.joints[0] == 20
        assert [each.name for each in lab.arm.executed] == ["SendAngle"]

    async with connected("mycobot280", "MyCobot280", MyCobotQuirks(acknowledges=False)) as lab:
        assert await lab("send_angle", 1, 20, 80) == -1
        await lab.stands()
        assert [each.name for each in lab.arm.executed] == ["SendAngle"] * 3  # it has sent it three times


@pytest.mark.parametrize(
    ("model", "client", "joints"),
    [
        ("mycobot320", "MyCobot320", HERE),
        ("mecharm270", "MechArm270", HERE),
        ("mypalletizer260", "MyPalletizer260", [20.0, 30.0, -20.0, 40.0]),
    ],
)
async def test_the_other_models(model: str, client: str, joints: list[float]) -> None:
    async with connected(model, client) as lab:
        await lab("send_angles", joints, 80)
        await lab.until(partial(lab.rests, at(*joints)), "send_angles")
        assert await lab("get_angles") == pytest.approx(joints, abs=0.02)
        assert await lab("get_coords") == pytest.approx(lab.arm.coords, abs=0.06)
        assert await lab("is_in_position", joints, 0) == 1
        await lab("set_color", 1, 2, 3)
        await lab.until(lambda: lab.arm.color == c.RGB(1, 2, 3), "set_color")
