"""Somebody else's client drives the simulated arm: pydobotlab, over a pseudo-terminal, as it drives a real one.

It was written from the vendor's documents by other people, so what passes here is not only right by this package's own
reading of the protocol. It blocks, hence each call runs in a thread while the arm answers in the loop; after each, both
sides are looked at: what the client was told, and what happened at the arm.
"""

from __future__ import annotations

import asyncio
import math
import struct
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager
from typing import Any

import pydobotlab
import pytest
from pydobotlab import CommandID, IOFunction, JOGCmd, JogMode, PTPMode
from pydobotlab.config import default_config, set_config
from pydobotlab.discovery import identify_magician, is_dobot
from pydobotlab.protocol import pack_floats, pack_u8, pack_u32, unpack_floats
from pydobotlab.transport import SerialTransport

from dobot_async._core.protocol.wire import Command
from dobot_async.arms.magician import commands as c
from dobot_async.simulator import Simulation, simulate
from dobot_async.simulator.device.work import DeviceOptions, Executed

SPEED = 50.0
IN_TIME = 20.0
HOME = (259.104, 0.0, -8.485, 0.0)
START = (220.0, 0.0, 40.0, 0.0)
TOO_FAR = (500.0, 0.0, 0.0, 0.0)


@pytest.fixture(autouse=True)
def packaged_settings(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The client's settings as packaged; it would read, and write, a file of the user's. It need not settle here."""
    set_config(default_config())
    monkeypatch.setattr("pydobotlab.device.CLEAR_ALARM_SETTLE_SECONDS", 0.0)
    yield
    set_config(None)


class Lab:
    """The client, and the arm that it talks to."""

    def __init__(self, sim: Simulation, port: str) -> None:
        self.sim = sim
        self.arm = sim.arm
        self.client: Any = pydobotlab.Magician(port, via_broker=False, require_panel=False, verbose=False)

    async def __call__(self, name: str, *args: Any, **details: Any) -> Any:
        """Calls a method of the client."""
        async with asyncio.timeout(IN_TIME):
            return await asyncio.to_thread(getattr(self.client, name), *args, **details)

    async def get(self, name: str) -> Any:
        """Reads a property of the client, which asks the arm."""
        return await asyncio.to_thread(getattr, self.client, name)

    async def set(self, name: str, value: Any) -> None:
        """Sets a property of the client, which tells the arm."""
        await asyncio.to_thread(setattr, self.client, name, value)

    def last(self) -> Executed:
        """What the arm has executed last."""
        executed: Executed = self.arm.executed[-1]
        return executed

    def done(self, row: Command[Any, Any]) -> list[Any]:
        """The parameters of what the arm has executed of a row, in order."""
        return [each.value for each in self.arm.executed if each.command is row and each.outcome == "done"]

    def at(self, *place: float) -> bool:
        """Whether the arm stands there, x, y, z, r."""
        pose = self.arm.pose
        return (pose.x, pose.y, pose.z, pose.r) == pytest.approx(place, abs=0.01)


@asynccontextmanager
async def switched_on(**details: Any) -> AsyncIterator[Lab]:
    """An arm that was just switched on, and the client connected to it."""
    async with simulate(listen="pty", **{"speed": SPEED, **details}) as sim:
        lab = Lab(sim, sim.url.removeprefix("serial://"))
        await lab("connect")
        try:
            yield lab
        finally:
            await lab("disconnect")
            assert not lab.client.is_open


@asynccontextmanager
async def ready(**details: Any) -> AsyncIterator[Lab]:
    """An arm that this client can wait for; see `test_what_the_client_takes_for_done_on_a_fresh_arm`."""
    async with switched_on(**details) as lab:
        await lab("clear_alarm")
        await lab("wait", 0)
        yield lab


async def until(condition: Callable[[], bool]) -> None:
    """Lets the arm move until something has come about."""
    async with asyncio.timeout(IN_TIME):
        while True:
            if condition():
                return

            await asyncio.sleep(0.002)


async def eventually(lab: Lab, value: Any, name: str, *args: Any) -> bool:
    """Asks until a value comes back."""
    async with asyncio.timeout(IN_TIME):
        while True:
            if await lab(name, *args) == value:
                return True

            await asyncio.sleep(0.002)


async def refused(lab: Lab, kind: type[Exception], name: str, *args: Any) -> Any:
    """Calls a method that must raise; returns the error."""
    with pytest.raises(kind) as caught:
        await lab(name, *args)

    return caught.value


# Who is there.


async def test_the_arm_is_recognised() -> None:
    async with simulate(listen="pty") as sim:
        port = sim.url.removeprefix("serial://")
        assert await asyncio.to_thread(is_dobot, port)
        transport = SerialTransport(port)
        transport.open()
        try:
            assert await asyncio.to_thread(identify_magician, transport) == sim.arm.state.get(c.SET_DEVICE_SN)
        finally:
            transport.close()

        assert sim.arm.executed == []


async def test_connecting_clears_and_starts_the_queue() -> None:
    async with switched_on() as lab:
        assert lab.client.is_open
        assert lab.arm.device.started
        assert lab.arm.counters.requests == lab.arm.counters.replies == 2
        assert lab.arm.executed == []


async def test_identity() -> None:
    async with switched_on() as lab:
        assert await lab("get_device_serial_number") == lab.arm.state.get(c.SET_DEVICE_SN)
        assert await lab("get_device_name") == "Dobot Magician"
        await lab("set_device_name", "left arm")
        assert lab.arm.state.get(c.SET_DEVICE_NAME) == "left arm"
        assert await lab("get_device_name") == "left arm"
        assert await lab("get_device_version") == (3, 7, 0)
        milliseconds = struct.unpack("<I", (await lab("read_command", CommandID.GET_DEVICE_TIME)).params)[0]
        assert 0 <= milliseconds <= lab.arm.device.uptime * 1000
        assert len((await lab("read_command", CommandID.GET_DEVICE_ID)).params) == 12


async def test_pose() -> None:
    async with switched_on() as lab:
        pose = await lab("get_pose")
        assert pose.as_xyzr() == pytest.approx(HOME, abs=1e-3)
        assert pose.as_joints() == pytest.approx((0, 45, 45, 0), abs=1e-4)
        assert math.isnan(await lab("get_posel")), "there is no rail"
        await lab("write_command", CommandID.GET_SET_DEVICE_WITH_L, b"\1\0")
        assert await lab("get_posel") == 0
        still = unpack_floats((await lab("read_command", CommandID.GET_KINEMATICS)).params)
        assert still == (0, 0)


# Motion.


@pytest.mark.parametrize(
    ("mode", "numbers", "place"),
    [
        (PTPMode.JUMP_XYZ, (200, 60, 20, 10), (200, 60, 20, 10)),
        (PTPMode.MOVJ_XYZ, (200, 60, 20, 10), (200, 60, 20, 10)),
        (PTPMode.MOVL_XYZ, (200, -60, 20, -10), (200, -60, 20, -10)),
        (PTPMode.JUMP_ANGLE, (0, 45, 45, 0), HOME),
        (PTPMode.MOVJ_ANGLE, (0, 45, 45, 0), HOME),
        (PTPMode.MOVL_ANGLE, (0, 45, 45, 30), (*HOME[:3], 30)),
        (PTPMode.MOVJ_INC, (90, 0, 0, -90), (0, 220, 40, 0)),
        (PTPMode.MOVL_INC, (10, 20, -5, 15), (230, 20, 35, 15)),
        (PTPMode.MOVJ_XYZ_INC, (10, 20, -5, 15), (230, 20, 35, 15)),
        (PTPMode.JUMP_MOVL_XYZ, (200, 60, 20, 10), (200, 60, 20, 10)),
    ],
)
async def test_each_way_to_a_point(mode: PTPMode, numbers: tuple[float, ...], place: tuple[float, ...]) -> None:
    async with ready() as lab:
        assert await lab("move_to", *START) > 0
        assert lab.at(*START)
        assert await lab("ptp", mode, *numbers) is True
        assert lab.at(*place)
        assert (await lab("get_pose")).as_xyzr() == pytest.approx(place, abs=0.01)
        assert (lab.last().outcome, lab.last().value.ptp_mode) == ("done", mode)


async def test_turning_the_tool_alone() -> None:
    async with ready() as lab:
        await lab("move_to", *START)
        await lab("set_r", 45)
        assert lab.at(*START[:3], 45)


async def test_homing() -> None:
    async with ready() as lab:
        await lab("move_to", *START)
        assert await lab("set_home") is True
        assert lab.at(*HOME)
        assert lab.last().command is c.SET_HOME_CMD
        await lab("queue_command", CommandID.GET_SET_HOME_PARAMS, pack_floats(200, 10, 50, 5))
        assert await lab("home") is True
        assert lab.at(200, 10, 50, 5)
        read = await lab("read_command", CommandID.GET_SET_HOME_PARAMS)
        assert unpack_floats(read.params) == (200, 10, 50, 5)


async def test_motion_parameters() -> None:
    async with ready() as lab:
        await lab.set("motion_params", (80, 60))
        assert lab.arm.state.get(c.SET_PTP_COMMON_PARAMS) == c.PTPCommonParams(80, 60)
        assert await lab.get("motion_params") == (80, 60)
        assert await lab("get_arm_speed_ratio", 1) == 80
        await lab.set("jump_params", (120, 35))
        assert lab.arm.state.get(c.SET_PTP_JUMP_PARAMS) == c.PTPJumpParams(jump_height=35, z_limit=120)
        assert await lab.get("jump_params") == (120, 35)
        await lab("set_jog_common_params", 40, 30)
        assert await lab("get_jog_common_params") == (40, 30)
        assert await lab("get_arm_speed_ratio", 0) == 40
        assert lab.arm.state.get(c.SET_JOG_COMMON_PARAMS) == c.JOGCommonParams(40, 30)


async def test_a_lower_ratio_makes_slower_motions() -> None:
    async with ready() as lab:
        for ratio in (100, 25):
            await lab.set("motion_params", (ratio, ratio))
            await lab("move_to", 200, 100, 40)
            await lab("move_to", 200, -100, 40)

        _, fast, _, slow = [each.finished - each.started for each in lab.arm.executed if each.command is c.SET_PTP_CMD]
        assert slow > 1.5 * fast


async def test_the_rail() -> None:
    async with ready() as lab:
        await lab("set_device_withl", enable=True, version=1)
        assert lab.arm.state.get(c.SET_DEVICE_WITH_L) == c.DeviceWithL(True, c.AccessoryVersion.V2)
        assert (await lab("read_command", CommandID.GET_SET_DEVICE_WITH_L)).params == b"\x01"
        # The client's help calls these percentages; they are mm/s and mm/s².
        await lab("set_ptpl_params", 150, 250)
        assert lab.arm.state.get(c.SET_PTPL_PARAMS) == c.PTPLParams(150, 250)
        await lab("set_ptpwithl_cmd", PTPMode.MOVJ_XYZ, *START, 300)
        assert lab.at(*START)
        assert await lab("get_posel") == lab.arm.rail == 300


async def test_a_continuous_path() -> None:
    async with ready() as lab:
        await lab("move_to", *START)
        await lab("set_cp_params", 200, 80, 90)
        for step in range(1, 6):
            await lab("cp", 220, 10 * step, 40)

        await lab("cp", 5, 0, -10, mode=0)
        await lab("wait_idle", timeout=10)
        assert lab.arm.state.get(c.SET_CP_PARAMS) == c.CPParams(200, 80, 90)
        assert [value.cp_mode for value in lab.done(c.SET_CP_CMD)] == [c.CPMode.ABSOLUTE] * 5 + [c.CPMode.RELATIVE]
        assert lab.arm.pose.y == pytest.approx(50, abs=0.01)
        assert (lab.arm.pose.x, lab.arm.pose.z) == pytest.approx((225, 30), abs=0.01)


async def test_the_velocity_of_a_continuous_path_is_reserved() -> None:
    """The client promises that it holds; on the wire it is a field that the arm does not use."""
    async with ready() as lab:
        await lab("move_to", *START)
        for velocity, y in ((1, 40), (100, 0)):
            await lab("cp", 220, y, 40, velocity=velocity)
            await lab("wait_idle", timeout=10)

        one, other = [each.finished - each.started for each in lab.arm.executed if each.command is c.SET_CP_CMD]
        assert one == pytest.approx(other, rel=1e-3)


async def test_arcs_and_circles() -> None:
    """The client has no method for them, but the frames are its own."""
    async with ready() as lab:
        await lab("move_to", *START)
        await lab("queue_command", CommandID.GET_SET_ARC_PARAMS, pack_floats(150, 100, 200, 120))
        arc = pack_floats(240, 20, 40, 0, 220, 40, 40, 0)
        await lab("queue_command", CommandID.SET_ARC_CMD, arc)
        await lab("wait_idle", timeout=10)
        assert lab.at(220, 40, 40, 0)
        assert lab.arm.state.get(c.SET_ARC_PARAMS) == c.ARCParams(150, 100, 200, 120)
        circle = pack_floats(240, 20, 40, 0, 220, 0, 40, 0) + pack_u32(2)
        await lab("queue_command", CommandID.SET_CIRCLE_CMD, circle)
        await lab("wait_idle", timeout=10)
        assert lab.at(220, 40, 40, 0)
        assert [value.count for value in lab.done(c.SET_CIRCLE_CMD)] == [2]


async def test_a_laser_engraving() -> None:
    async with ready() as lab:
        await lab("move_to", *START)
        await lab("queue_command", CommandID.SET_CP_LE_CMD, pack_u8(1) + pack_floats(230, 0, 40, 75))
        await lab("wait_idle", timeout=10)
        assert lab.done(c.SET_CPLE_CMD) == [c.CPLECmd(c.CPMode.ABSOLUTE, 230, 0, 40, 75)]
        assert lab.at(230, 0, 40, 0)


async def test_jogging() -> None:
    async with ready(speed=1.0) as lab:
        before = lab.arm.pose
        await lab("jog", JOGCmd.AP_DOWN, JogMode.JOINT)
        await until(lambda: lab.arm.pose.j1 > before.j1 + 1)
        await lab("jog_stop")
        stopped = lab.arm.pose
        assert not lab.arm.device.moving
        assert (stopped.j2, stopped.j3) == (before.j2, before.j3)
        assert (await lab("get_pose")).as_joints()[0] == pytest.approx(stopped.j1, abs=1e-3)
        await lab("jog", JOGCmd.CP_DOWN)
        await until(lambda: lab.arm.pose.z > stopped.z + 1)
        await lab("jog", JOGCmd.IDLE)
        assert not lab.arm.device.moving
        assert (await lab("get_pose")).z > stopped.z


async def test_the_parameters_of_all_kinds_of_motion_are_kept() -> None:
    rows: list[tuple[CommandID, Command[Any, None], bytes]] = [
        (CommandID.GET_SET_JOG_JOINT_PARAMS, c.SET_JOG_JOINT_PARAMS, pack_floats(*range(1, 9))),
        (CommandID.GET_SET_JOG_COORDINATE_PARAMS, c.SET_JOG_COORDINATE_PARAMS, pack_floats(*range(2, 10))),
        (CommandID.GET_SET_JOG_L_PARAMS, c.SET_JOGL_PARAMS, pack_floats(30, 40)),
        (CommandID.GET_SET_PTP_JOINT_PARAMS, c.SET_PTP_JOINT_PARAMS, pack_floats(*range(3, 11))),
        (CommandID.GET_SET_PTP_COORDINATE_PARAMS, c.SET_PTP_COORDINATE_PARAMS, pack_floats(*range(4, 8))),
        (CommandID.GET_SET_PTP_JUMP_2_PARAMS, c.SET_PTP_JUMP2_PARAMS, pack_floats(10, 20, 90)),
        (CommandID.GET_SET_ARC_COMMON_PARAMS, c.SET_ARC_COMMON_PARAMS, pack_floats(45, 55)),
        (CommandID.GET_SET_END_EFFECTOR_PARAMS, c.SET_END_EFFECTOR_PARAMS, pack_floats(70, 1, 2)),
    ]
    async with ready() as lab:
        for number, row, params in rows:
            await lab("write_command", number, params)
            assert (await lab("read_command", number)).params == params
            assert row.request.encode(lab.arm.state.get(row)) == params


# Tools, inputs, outputs.


async def test_suction_gripper_and_laser() -> None:
    async with ready() as lab:
        for name, seen in (
            ("set_endeffector_suctioncup", lambda: lab.arm.suction),
            ("set_endeffector_gripper", lambda: lab.arm.gripper),
            ("set_endeffector_laser", lambda: lab.arm.laser == 100),
        ):
            await on_and_off(lab, name, seen)


async def on_and_off(lab: Lab, name: str, seen: Callable[[], bool]) -> None:
    for enable, on in ((True, True), (True, False), (True, True), (False, False)):
        assert await lab(name, enable, on) is True
        await until(lambda on=on: seen() is on)  # type: ignore[misc]


async def test_inputs_and_outputs() -> None:
    async with ready() as lab:
        for function in (IOFunction.DO, IOFunction.PWM, IOFunction.DI, IOFunction.ADC, IOFunction.DIPU):
            await lab("set_multiplexing", "DO_04", function)
            assert lab.arm.state.get(c.SET_IO_MULTIPLEXING, 4) == c.IOMultiplexing(4, c.IOFunction(function))

        for address, function in ((5, IOFunction.DO), (6, IOFunction.PWM), (7, IOFunction.DI), (8, IOFunction.ADC)):
            await lab("set_multiplexing", address, function)

        for level in (1, 0):
            await lab("set_do", "DO_05", level)
            assert lab.arm.output(5) == level
            assert (await lab("read_command", CommandID.GET_SET_IO_DO, pack_u8(5))).params == bytes((5, level))

        await lab("set_pwm", 6, 1000, 25)
        assert lab.arm.pwm(6) == c.IOPWM(6, 1000, 25)
        for level in (1, 0):
            lab.arm.set_input(7, level)
            assert await lab("get_di", "DI_07") == level

        for value in (0, 1, 2048, 4095):
            lab.arm.set_adc(8, value)
            assert await lab("get_adc", 8) == value


async def test_waiting_for_an_input() -> None:
    async with ready() as lab:
        await lab("set_multiplexing", 9, IOFunction.DI)
        trigger = struct.pack("<BBBH", 9, 0, 0, 1)  # input 9, digital, equal, high
        index = await lab("queue_command", CommandID.SET_TRIG_CMD, trigger)
        await lab("queue_command", CommandID.SET_PTP_CMD, pack_u8(PTPMode.MOVJ_XYZ) + pack_floats(*START))
        assert await lab("queued_cmd_current_index") == index - 1
        lab.arm.set_input(9, 1)
        await lab("wait_idle", timeout=10)
        assert lab.at(*START)


async def test_sensors() -> None:
    async with ready() as lab:
        lab.arm.color, lab.arm.color_version = c.Color(10, 20, 30), c.AccessoryVersion.V2
        assert await lab("get_color_sensor") == (0, 0, 0)
        await lab("set_color_sensor", 2, True, 1)
        assert lab.arm.state.get(c.SET_COLOR_SENSOR) == c.ColorSensor(True, c.ColorPort.GP4, c.AccessoryVersion.V2)
        assert await eventually(lab, (10, 20, 30), "get_color_sensor")
        lab.arm.infrared[c.InfraredPort.GP2], lab.arm.infrared_version = True, c.AccessoryVersion.V2
        assert await lab("get_infrared_sensor", 1) == 0
        await lab("set_infrared_sensor", 1, True)
        assert await eventually(lab, 1, "get_infrared_sensor", 1)
        assert await lab("get_infrared_sensor", 0) == 0


async def test_the_conveyor() -> None:
    async with ready() as lab:
        await lab("set_converyor", lab.client.Stepper1, True, 10000)
        await lab("set_conveyor", lab.client.Stepper2, True, -2500)
        assert [motor.speed for motor in lab.arm.motors] == [10000, -2500]
        await lab("set_converyor", lab.client.Stepper1, False, 10000)
        assert [motor.speed for motor in lab.arm.motors] == [0, -2500]
        await lab("queue_command", CommandID.SET_E_MOTOR_S, struct.pack("<BBiI", 1, 1, 4000, 800))
        before = lab.arm.motors[1].pulses
        await lab("wait_idle", timeout=10)
        assert lab.arm.motors[1].speed == 0
        assert lab.last().finished - lab.last().started == pytest.approx(0.2)
        assert before <= lab.arm.motors[1].pulses


async def test_hand_guided_teaching() -> None:
    async with ready() as lab:
        await lab("write_command", CommandID.GET_SET_HHT_TRIG_MODE, pack_u8(0))
        await lab("write_command", CommandID.GET_SET_HHT_TRIG_OUTPUT_ENABLED, pack_u8(1))
        assert (await lab("read_command", CommandID.GET_HHT_TRIG_OUTPUT)).params == b"\0"
        lab.arm.guide_to(210, 20, 30)
        assert (await lab("read_command", CommandID.GET_HHT_TRIG_OUTPUT)).params == b"\x01"
        assert (await lab("get_pose")).as_xyzr() == pytest.approx((210, 20, 30, 0), abs=0.01)


async def test_the_wireless_settings() -> None:
    async with ready() as lab:
        for number, params in (
            (CommandID.GET_SET_WIFI_SSID, b"workshop\0"),
            (CommandID.GET_SET_WIFI_PASSWORD, b"secret\0"),
            (CommandID.GET_SET_WIFI_IP_ADDRESS, bytes((0, 192, 168, 1, 20))),
            (CommandID.GET_SET_WIFI_NETMASK, bytes((255, 255, 0, 0))),
        ):
            await lab("write_command", number, params)
            assert (await lab("read_command", number)).params == params

        await until(lambda: lab.arm.state.in_wifi)
        assert (await lab("read_command", CommandID.GET_WIFI_CONNECT_STATUS)).params == b"\x01"
        assert lab.arm.state.get(c.SET_WIFI_SSID) == "workshop"


# Alarms.


async def test_what_the_client_takes_for_done_on_a_fresh_arm() -> None:
    """Before anything was executed the index is 2**64 - 1, which says nothing; the client takes it for "all done".

    It also takes the alarm 0x00, which every arm shows after power-up, for a failure.
    """
    async with switched_on(speed=1.0) as lab:
        error = await refused(lab, pydobotlab.DobotSystemAlarmError, "wait", 0)
        assert error.alarms == ["PUBLIC_RESET"]

    async with switched_on(speed=1.0) as lab:
        await lab("clear_alarm")
        assert await lab("queued_cmd_current_index") == 2**64 - 1
        assert await lab("wait", 3600) is True
        assert lab.arm.device.executing is not None
        assert lab.arm.executed == []


async def test_an_unreachable_target() -> None:
    async with ready() as lab:
        await lab("move_to", *START)
        error = await refused(lab, pydobotlab.DobotKinematicError, "ptp", PTPMode.MOVJ_XYZ, *TOO_FAR)
        assert error.alarms == ["PLAN_INVERSE_CALCULATION"]
        assert lab.last().outcome == "alarm"
        assert [alarm.code for alarm in lab.arm.alarms] == [pydobotlab.Alarm.PLAN_INVERSE_CALCULATION]
        assert lab.at(*START)
        assert await refused(lab, pydobotlab.DobotKinematicError, "ensure_no_alarms")
        assert await lab("clear_alarm") is True
        assert lab.arm.alarms == ()
        await lab("ensure_no_alarms")
        await lab("move_to", 200, 0, 40)
        assert lab.at(200, 0, 40, 0)


@pytest.mark.parametrize(
    ("alarm", "mode", "numbers"),
    [
        ("PLAN_INVERSE_LIMIT", PTPMode.MOVJ_ANGLE, (0, 120, 45, 0)),
        ("PLAN_INVERSE_SINGULARITY", PTPMode.MOVJ_XYZ, (0, 0, 40, 0)),
        ("PLAN_JUMP_PARAMETER", PTPMode.JUMP_XYZ, (200, 0, 120, 0)),
        ("PLAN_DATA_REPEAT", PTPMode.JUMP_MOVL_XYZ, START),
    ],
)
async def test_the_client_names_the_alarm_that_the_arm_raised(
    alarm: str, mode: PTPMode, numbers: tuple[float, ...]
) -> None:
    async with ready() as lab:
        await lab("move_to", *START)
        error = await refused(lab, pydobotlab.DobotKinematicError, "ptp", mode, *numbers)
        assert error.alarms == [alarm]
        assert [found.code for found in lab.arm.alarms] == [pydobotlab.Alarm[alarm]]


async def test_every_alarm_lies_where_the_client_looks_for_it() -> None:
    async with ready() as lab:
        for alarm in pydobotlab.Alarm:
            lab.arm.raise_alarm(alarm)
            assert list(await lab("get_alarms")) == [alarm]
            lab.arm.device.clear_alarms()

        for alarm in pydobotlab.Alarm:
            lab.arm.raise_alarm(alarm)

        assert list(await lab("get_alarms")) == list(pydobotlab.Alarm)


async def test_a_jog_into_a_limit() -> None:
    async with ready() as lab:
        await lab("jog", JOGCmd.AP_DOWN, JogMode.JOINT)
        await until(lambda: not lab.arm.device.moving)
        assert list(await lab("get_alarms")) == [pydobotlab.Alarm.LIMIT_POS_J1]
        await lab("jog", JOGCmd.AN_DOWN, JogMode.JOINT)
        await until(lambda: lab.arm.pose.j1 < 100)
        await lab("jog_stop")
        assert not await lab("get_alarms")


async def test_lost_steps() -> None:
    async with ready() as lab:
        await lab("set_lost_step_params", 6)
        assert lab.arm.state.get(c.SET_LOST_STEP_PARAMS) == 6
        assert await lab("set_lost_step_cmd") is True
        assert await lab("get_lost_step_result") == []
        lab.arm.lose_steps(2, 8)
        error = await refused(lab, pydobotlab.DobotLostStepError, "set_lost_step_cmd")
        assert error.alarms == ["LOST_STEP_J2"]
        assert await lab("get_lost_step_result") == ["LOST_STEP_J2"]
        await lab("clear_alarm")
        await lab("set_home")
        assert await lab("set_lost_step_cmd") is True


async def test_an_alarmed_arm_holds_motions_back_and_nothing_else() -> None:
    """The client's help says that homing works during an alarm; no motion does before the alarm is cleared."""
    async with ready() as lab:
        await lab("move_to", *START)
        await lab("set_multiplexing", 3, IOFunction.DO)
        lab.arm.raise_alarm(pydobotlab.Alarm.MOVE_INVERSE_LIMIT)
        index = await lab("queue_command", CommandID.GET_SET_IO_DO, pack_u8(3, 1))
        await lab("wait_for", index, timeout=5, raise_on_alarm=False)
        assert lab.arm.output(3) == 1
        index = await lab("queue_command", CommandID.SET_HOME_CMD, pack_u32(0))
        with pytest.raises(pydobotlab.DobotTimeoutError):
            await lab("wait_for", index, timeout=0.2, raise_on_alarm=False)

        assert lab.at(*START)
        await lab("clear_alarm")
        await lab("wait_for", index, timeout=5)
        assert lab.at(*HOME)


# The queue.


async def test_indices_and_left_space() -> None:
    async with ready(options=DeviceOptions(capacity=4)) as lab:
        assert await lab("queued_cmd_left_space") == 4
        last = await lab("queued_cmd_current_index")
        await lab("stop_queue")
        wait = pack_u32(100)
        assert [await lab("queue_command", CommandID.SET_WAIT_CMD, wait) for _ in range(4)] == [
            last + 1 + step for step in range(4)
        ]
        assert await lab("queued_cmd_left_space") == 0
        assert await lab("queued_cmd_current_index") == last
        await lab("start_queue")
        await lab("wait_idle", timeout=5)
        assert await lab("queued_cmd_current_index") == last + 4
        assert await lab("queued_cmd_left_space") == 4
        assert [each.index for each in lab.arm.executed][-4:] == [last + 1 + step for step in range(4)]


async def test_a_full_queue_is_silent() -> None:
    async with ready(options=DeviceOptions(capacity=1)) as lab:
        lab.client._transport._serial.timeout = 0.2
        await lab("stop_queue")
        await lab("queue_command", CommandID.SET_WAIT_CMD, pack_u32(0))
        with pytest.raises(pydobotlab.DobotTimeoutError):
            await lab("queue_command", CommandID.SET_WAIT_CMD, pack_u32(0))

        assert lab.arm.counters.overflowed == 1
        assert await lab("queued_cmd_left_space") == 0


async def test_stop_lets_the_command_end_and_force_stop_does_not() -> None:
    async with ready(speed=1.0) as lab:
        for pulled, outcome in (("stop_queue", "done"), ("force_stop_queue", "aborted")):
            first = await lab("queue_command", CommandID.SET_WAIT_CMD, pack_u32(300))
            await lab("queue_command", CommandID.SET_WAIT_CMD, pack_u32(300))
            await lab(pulled)
            await lab("wait_for", first, timeout=5)
            assert (lab.last().index, lab.last().outcome) == (first, outcome)
            assert await lab("queued_cmd_left_space") == 31
            await lab("clear_queue")
            assert await lab("queued_cmd_left_space") == 32
            await lab("start_queue")


async def test_wait_holds_the_queue() -> None:
    async with ready() as lab:
        assert await lab("wait", 1.5) is True
        assert lab.last().value == c.WAITCmd(1500)
        assert lab.last().finished - lab.last().started == pytest.approx(1.5)


async def test_a_batch_runs_when_it_is_whole() -> None:
    async with ready() as lab:
        await lab("move_to", *START)
        client, done = lab.client, []

        def draw() -> None:
            with client.batch():
                for y in (20, 40, 60):
                    client.ptp(PTPMode.MOVL_XYZ, 220, y, 40, 0)
                    done.append(client.queued_cmd_current_index())

                client.set_do(2, 1)

        await asyncio.to_thread(draw)
        assert len(set(done)) == 1
        assert [value.y for value in lab.done(c.SET_PTP_CMD)] == [0, 20, 40, 60]
        assert lab.last().value == c.IODO(2, 1)


async def test_a_batch_that_fails_runs_nothing() -> None:
    async with ready() as lab:
        client = lab.client

        def draw() -> None:
            with client.batch():
                client.ptp(PTPMode.MOVL_XYZ, *START)
                raise RuntimeError

        with pytest.raises(RuntimeError):
            await asyncio.to_thread(draw)

        await lab("wait", 0)
        assert lab.done(c.SET_PTP_CMD) == []
        assert lab.at(*HOME)


async def test_a_stream_of_poses_during_a_motion() -> None:
    async with ready() as lab:
        await lab("move_to", 200, -100, 40)
        poses = await lab("start_pose_stream", hz=200)
        try:
            await lab.set("motion_params", (5, 5))
            await lab("move_to", 200, 100, 40)
        finally:
            await lab("stop_pose_stream")

        heard = [poses.get_nowait().y for _ in range(poses.qsize())]
        assert len(heard) > 10
        assert heard == sorted(heard)


async def test_outputs_switch_on_the_way() -> None:
    async with ready() as lab:
        await lab("move_to", 200, -100, 40)
        await lab("set_multiplexing", 1, IOFunction.DO)
        outputs = b"".join(struct.pack("<BHB", ratio, 1, level) for ratio, level in ((20, 1), (80, 0)))
        target = pack_u8(PTPMode.MOVL_XYZ) + pack_floats(200, 100, 40, 0)
        await lab("queue_command", CommandID.SET_PTP_PO_CMD, target + pack_u8(2) + outputs)
        await lab("wait_idle", timeout=10)
        [value] = lab.done(c.SET_PTPPO_CMD)
        assert [(each.ratio, each.address, each.level) for each in value.outputs] == [(20, 1, 1), (80, 1, 0)]
        assert lab.arm.output(1) == 0
        assert lab.at(200, 100, 40, 0)


# What an arm does not answer.


@pytest.mark.parametrize(
    ("number", "write", "params"),
    [
        (99, False, b""),
        (99, True, b""),
        (CommandID.SET_PTP_CMD, True, b"\x01"),
        (CommandID.GET_SET_IO_DO, True, bytes((21, 1))),
        (CommandID.GET_SET_PTP_COMMON_PARAMS, True, pack_floats(float("nan"), 50)),
    ],
    ids=["unknown read", "unknown write", "too short", "no such pin", "not a number"],
)
async def test_what_no_arm_knows_is_not_answered(number: int, write: bool, params: bytes) -> None:
    async with ready() as lab:
        lab.client._transport._serial.timeout = 0.2
        with pytest.raises(pydobotlab.DobotTimeoutError):
            await lab("send_command", number, params, write=write)

        counters = lab.arm.counters
        assert counters.unknown + counters.unfit == 1
        assert (await lab("get_pose")).as_xyzr() == pytest.approx(HOME, abs=1e-3)


async def test_everything_was_understood() -> None:
    """No frame of the client's own methods is junk, bad, unknown or misfit."""
    async with ready() as lab:
        await lab("set_home")
        await lab("set_endeffector_suctioncup", True, True)
        await lab("move_to", *START)
        await lab("get_pose")
        counters = lab.arm.counters
        assert counters.requests == counters.replies
        assert counters.bad_frames == counters.junk_bytes == counters.unknown == counters.unfit == 0
