"""The simulated Magician, over bytes alone: what it answers, where it goes, and what it makes of nonsense."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from quick_suite import examples

from dobot_async._core.protocol.layouts import NOTHING, Counted, Lenient, Text
from dobot_async._core.protocol.wire import Command, Field, Layout, Number, Record
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.alarms import IGNORED
from dobot_async.arms.magician.frame import MAX_PARAMS, QUEUED, WRITE, Frame, Parser, encode, request
from dobot_async.arms.magician.kinematics import JointLimits, Kinematics, Unreachable
from dobot_async.simulator.device.work import DeviceOptions
from dobot_async.simulator.magician.arm import MAGICIAN, MagicianSession, Quirks, SimulatedMagician
from dobot_async.simulator.magician.jog import margins

Row = Command[Any, Any]
HOME = (259.104, 0, -8.485, 0)
NO_INDEX = 2**64 - 1
LITE = replace(MAGICIAN, on_fault="continue")


@dataclass
class Bench:
    """An arm, its clock and one client."""

    options: DeviceOptions | None = None
    quirks: Quirks = field(default_factory=Quirks)
    now: float = 0.0

    def __post_init__(self) -> None:
        self.arm = SimulatedMagician(lambda: self.now, self.options, self.quirks)
        self.session = self.arm.session()

    def send(self, frame: Frame, session: MagicianSession | None = None) -> Frame | None:
        """Sends one frame, returns the reply."""
        replies = Parser().feed((session or self.session).receive(bytes(frame)))
        assert len(replies) <= 1
        return replies[0] if replies else None

    def ask(self, row: Command[Any, Any], value: Any = None) -> Any:
        """Sends a row immediately, returns what it answers."""
        reply = self.send(request(row, row.request.encode(value), queued=False))
        assert reply is not None, f"no reply to {row.name}"
        assert (reply.id, reply.ctrl) == (row.id, row.write * WRITE)
        return row.reply.decode(reply.params)

    def put(self, row: Command[Any, Any], value: Any = None) -> int:
        """Queues a row, returns its index."""
        reply = self.send(Frame(row.id, WRITE | QUEUED, row.request.encode(value)))
        assert reply is not None, f"no reply to {row.name}"
        assert (reply.id, reply.ctrl, len(reply.params)) == (row.id, WRITE | QUEUED, 8)
        return int.from_bytes(reply.params, "little")

    def move(self, mode: c.PTPMode, *numbers: float) -> int:
        return self.put(c.SET_PTP_CMD, c.PTPCmd(mode, *numbers))

    def configure(self, function: c.IOFunction, *addresses: int) -> None:
        for address in addresses:
            self.arm.state.set(c.SET_IO_MULTIPLEXING, c.IOMultiplexing(address, function))

    def jog(self, key: c.JOGKey, *, joint: bool = False) -> None:
        self.ask(c.SET_JOG_CMD, c.JOGCmd(joint, key))

    def after(self, seconds: float) -> SimulatedMagician:
        self.now += seconds
        return self.arm

    @property
    def point(self) -> tuple[float, float, float, float]:
        pose = self.arm.pose
        return pose.x, pose.y, pose.z, pose.r

    @property
    def joints(self) -> tuple[float, ...]:
        pose = self.arm.pose
        return pose.j1, pose.j2, pose.j3, pose.j4

    @property
    def faults(self) -> set[int]:
        return {alarm.code for alarm in self.arm.alarms} - IGNORED

    @property
    def outcomes(self) -> list[tuple[Any, str]]:
        return [(executed.command, executed.outcome) for executed in self.arm.executed]

    @property
    def times(self) -> list[tuple[float, float]]:
        return [(executed.started, executed.finished) for executed in self.arm.executed]


def at(bench: Bench, *point: float) -> bool:
    """Whether the tool is there."""
    return bench.point == pytest.approx(point, abs=1e-3)


# Frames.


@pytest.mark.parametrize(
    ("sent", "answered"),
    [
        ("AA AA 04 03 01 01 00 FB", "AA AA 02 03 01 FC"),
        ("AA AA 04 03 02 01 00 FA", f"AA AA 0A 03 02 02 {'00' * 7} F9"),
        (f"AA AA 13 54 03 01 00 00 7A 43 {'00' * 12} EB", f"AA AA 0A 54 03 02 {'00' * 7} A7"),
        (f"AA AA 13 54 03 01 00 00 7A 43 {'00' * 12} EA", ""),
        ("AA AA 02 F7 00 09", "AA AA 06 F7 00 20 00 00 00 E9"),
        ("AA AA 02 14 00 EC", f"AA AA 12 14 00 01 {'00' * 15} EB"),
        ("AA AA 08 01 01 48 65 6C 6C 6F 00 0A", "AA AA 02 01 01 FE"),
    ],
)
def test_frames_of_real_arms(sent: str, answered: str) -> None:
    assert Bench().session.receive(bytes.fromhex(sent)) == bytes.fromhex(answered)


def test_a_queued_read_has_no_effect_and_an_index() -> None:
    bench = Bench()
    reply = bench.send(Frame(84, QUEUED, c.SET_PTP_CMD.request.encode(c.PTPCmd(c.PTPMode.MOVJ_XYZ, 200, 0, 0))))
    assert reply == Frame(84, QUEUED, bytes((2, 0, 0, 0, 0, 0, 0, 0)))
    bench.after(9)
    assert at(bench, *HOME)
    assert bench.ask(c.GET_QUEUED_CMD_CURRENT_INDEX) == 2


def test_other_bits_of_ctrl_say_nothing() -> None:
    bench = Bench()
    reply = bench.send(Frame(10, 0b1111_0100, b""))
    assert reply
    assert c.GET_POSE.reply.decode(reply.params) == bench.ask(c.GET_POSE)


@pytest.mark.parametrize(("number", "ctrl"), [(99, 0), (99, WRITE), (99, QUEUED), (10, WRITE), (84, 0), (21, WRITE)])
def test_what_the_arm_does_not_know(number: int, ctrl: int) -> None:
    bench = Bench()
    assert bench.send(Frame(number, ctrl, b"")) is None
    assert [alarm.code for alarm in bench.arm.alarms] == [0x00, 0x01]
    assert (bench.arm.counters.unknown, bench.arm.counters.requests, bench.arm.counters.replies) == (1, 1, 0)


@pytest.mark.parametrize(
    ("row", "params"),
    [
        (c.GET_POSE, b"\0"),
        (c.SET_PTP_CMD, bytes(16)),
        (c.SET_PTP_CMD, b"\x0a" + bytes(16)),
        (c.SET_PTP_CMD, b"\1" + b"\0\0\xc0\x7f" * 4),
        (c.SET_IODO, b"\x15\1"),
        (c.GET_IODI, b"\0"),
        (c.GET_IODI, b""),
        (c.SET_E_MOTOR, b"\2\1\0\0\0\0"),
    ],
)
def test_parameters_that_do_not_fit(row: Row, params: bytes) -> None:
    bench = Bench()
    assert bench.send(Frame(row.id, row.write * WRITE, params)) is None
    assert (bench.arm.counters.unfit, bench.arm.counters.unknown, bench.faults) == (1, 0, set())


def test_half_frames_of_one_client_do_not_touch_the_other() -> None:
    bench = Bench()
    other = bench.arm.session()
    pose, name = (bytes(request(row, b"", queued=False)) for row in (c.GET_POSE, c.GET_DEVICE_NAME))
    assert bench.session.receive(b"\xaa\xaa\xaa" + pose[2:4]) == b""
    assert bench.send(request(c.GET_DEVICE_NAME, b"", queued=False), other) == Frame(1, 0, b"Dobot Magician\0")
    assert len(bench.session.receive(pose[4:] + name)) == 38 + 21
    assert other.receive(b"noise") == b""
    damaged = bytearray(pose)
    damaged[-1] ^= 1
    assert other.receive(bytes(damaged) + pose)
    counters = bench.arm.counters
    assert (counters.requests, counters.replies, counters.bad_frames, counters.junk_bytes) == (4, 4, 1, 1 + 5 + 6)


# Registers.


def values(layout: Layout[Any] | Field) -> st.SearchStrategy[Any]:
    """Values of a layout."""
    match layout:
        case Field():
            return numbers(layout)
        case Lenient():
            return values(layout.layout)
        case Number():
            return numbers(layout.field)
        case Record():
            parts = {name: values(field) for name, field in layout.fields.items()}
            if layout.tail:
                parts[layout.tail_name] = values(layout.tail)

            return st.builds(layout.kind, **parts)
        case Counted():
            return st.lists(values(layout.record), max_size=5).map(tuple)
        case Text():
            letters = st.characters(min_codepoint=1, max_codepoint=255, codec=layout.encoding)
            return st.text(letters, max_size=layout.limit // 2)

    assert layout is NOTHING
    return st.none()


def numbers(field: Field) -> st.SearchStrategy[Any]:
    """Values of one field."""
    scalar = field.scalar
    single: st.SearchStrategy[Any]
    if scalar.code == "f":
        single = st.floats(scalar.low, scalar.high, width=32)
    elif field.kind:
        single = st.sampled_from([*field.kind] if issubclass(field.kind, IntEnum) else [False, True])
    else:
        single = st.integers(int(scalar.low), int(scalar.high))

    return single if scalar.count == 1 else st.tuples(*[single] * scalar.count)


MORE_THAN_REGISTERS = {3, 20, 32, 137, 138}
REGISTERS = [row for row in c.ALL if row.write and (row.id, False) in c.BY_KEY and row.id not in MORE_THAN_REGISTERS]
every_register = pytest.mark.parametrize("row", REGISTERS, ids=lambda row: row.name)


def get(bench: Bench, row: Row, value: Any) -> Any:
    """What the Get row of a Set row says, about the same pin if it is about one."""
    getter = c.BY_KEY[row.id, False]
    return bench.ask(getter, value.address if getter.echo else None)


@every_register
@given(data=st.data())
@settings(max_examples=examples(10), deadline=None)
def test_what_was_set_is_what_is_got(row: Row, data: st.DataObject) -> None:
    bench = Bench()
    first, second = data.draw(values(row.request)), data.draw(values(row.request))
    bench.ask(row, first)
    assert get(bench, row, first) == first
    bench.put(c.SET_WAIT_CMD, c.WAITCmd(1000))
    bench.put(row, second)
    if getattr(first, "address", 0) == getattr(second, "address", 0):
        assert get(bench, row, second) == first

    bench.after(1.0)
    assert get(bench, row, second) == second


@every_register
@given(data=st.data())
@settings(max_examples=examples(5), deadline=None)
def test_power_brings_the_defaults_back_except_in_flash(row: Row, data: st.DataObject) -> None:
    bench = Bench()
    getter = c.BY_KEY[row.id, False]
    value = data.draw(values(row.request))
    address = value.address if getter.echo else None
    before = bench.ask(getter, address)
    bench.ask(row, value)
    bench.arm.power_cycle()
    flash = row.id in {0, 1, *range(140, 160)}
    assert bench.ask(getter, address) == (value if flash else before)


@pytest.mark.parametrize("row", [row for row in c.ALL if not row.write], ids=lambda row: row.name)
@given(data=st.data())
@settings(max_examples=examples(3), deadline=None)
def test_everything_can_be_read(row: Row, data: st.DataObject) -> None:
    Bench().ask(row, data.draw(values(row.request)))


def test_pins_are_apart() -> None:
    bench = Bench()
    bench.configure(c.IOFunction.DO, *range(1, 21))
    for address in range(1, 21):
        bench.ask(c.SET_IODO, c.IODO(address, address % 2))

    assert [bench.ask(c.GET_IODO, address).level for address in range(1, 21)] == [1, 0] * 10
    assert [bench.arm.output(address) for address in range(1, 21)] == [1, 0] * 10
    bench.configure(c.IOFunction.PWM, 4)
    bench.ask(c.SET_IOPWM, c.IOPWM(4, 1000, 25))
    assert bench.arm.output(4) == 0
    assert (bench.arm.pwm(4), bench.arm.pwm(5).duty_cycle) == (c.IOPWM(4, 1000, 25), 0)
    with pytest.raises(ValueError, match="1 to 20"):
        bench.arm.output(21)


@pytest.mark.parametrize("function", c.IOFunction)
def test_a_pin_does_only_what_it_is_configured_for(function: c.IOFunction) -> None:
    bench = Bench()
    bench.ask(c.SET_IO_MULTIPLEXING, c.IOMultiplexing(2, function))
    bench.ask(c.SET_IODO, c.IODO(2, 1))
    bench.ask(c.SET_IOPWM, c.IOPWM(2, 50, 7.5))
    bench.arm.set_input(2, 1)
    bench.arm.set_adc(2, 1234)
    put_out = bench.arm.output(2), bench.arm.pwm(2).duty_cycle
    read = bench.ask(c.GET_IODI, 2).level, bench.ask(c.GET_IOADC, 2).value
    assert put_out == (function is c.IOFunction.DO, 7.5 * (function is c.IOFunction.PWM))
    assert read == (function.name.startswith("DI"), 1234 * (function is c.IOFunction.ADC))
    assert bench.ask(c.GET_IODO, 2).level == 1, "the register keeps what was written"


@pytest.mark.parametrize(("function", "level"), [(c.IOFunction.DIPU, 1), (c.IOFunction.DIPD, 0), (c.IOFunction.DI, 0)])
def test_an_input_with_nothing_at_it_reads_its_resistor(function: c.IOFunction, level: int) -> None:
    bench = Bench()
    bench.configure(function, 3)
    assert bench.ask(c.GET_IODI, 3).level == level
    bench.arm.set_input(3, not level)
    assert bench.ask(c.GET_IODI, 3).level == (not level)


def test_inputs() -> None:
    bench = Bench()
    bench.configure(c.IOFunction.DI, 7)
    bench.configure(c.IOFunction.ADC, 8)
    bench.arm.set_input(7, 1)
    bench.arm.set_adc(8, 4095)
    assert bench.ask(c.GET_IODI, 7) == c.IODI(7, 1)
    assert bench.ask(c.GET_IODI, 8) == c.IODI(8, 0)
    assert bench.ask(c.GET_IOADC, 8) == c.IOADC(8, 4095)
    assert bench.ask(c.GET_IOADC, 7) == c.IOADC(7, 0)
    with pytest.raises(ValueError, match="0 to 4095"):
        bench.arm.set_adc(8, 4096)
    with pytest.raises(ValueError, match="1 to 20"):
        bench.arm.set_input(0, 1)


def test_effectors() -> None:
    bench = Bench()
    bench.ask(c.SET_END_EFFECTOR_SUCTION_CUP, c.EndEffectorSuctionCup(is_ctrl_enabled=True, is_sucked=True))
    assert not bench.arm.suction, "the air takes a moment"
    bench.after(0.2)
    assert (bench.arm.suction, bench.arm.gripper, bench.arm.laser) == (True, False, 0)
    bench.ask(c.SET_END_EFFECTOR_SUCTION_CUP, c.EndEffectorSuctionCup(is_ctrl_enabled=False, is_sucked=True))
    bench.ask(c.SET_END_EFFECTOR_GRIPPER, c.EndEffectorGripper(is_ctrl_enabled=True, is_gripped=True))
    bench.ask(c.SET_END_EFFECTOR_LASER, c.EndEffectorLaser(is_ctrl_enabled=True, is_on=True))
    assert (bench.arm.suction, bench.arm.gripper, bench.arm.laser) == (True, False, 100)
    bench.after(0.5)
    assert (bench.arm.suction, bench.arm.gripper, bench.arm.laser) == (False, True, 100)
    assert [(executed.index, executed.command) for executed in bench.arm.executed][-1:] == [
        (None, c.SET_END_EFFECTOR_LASER)
    ]
    bench.ask(c.SET_END_EFFECTOR_GRIPPER, c.EndEffectorGripper(is_ctrl_enabled=False, is_gripped=True))
    bench.ask(c.SET_END_EFFECTOR_LASER, c.EndEffectorLaser(is_ctrl_enabled=False, is_on=True))
    bench.after(0.5)
    assert (bench.arm.gripper, bench.arm.laser) == (False, 0)


def test_queued_tools_and_outputs_are_seen_in_their_turn() -> None:
    def looked_at(look: Callable[[SimulatedMagician], Any]) -> tuple[Any, Any]:
        bench = Bench()
        bench.configure(c.IOFunction.DO, 1)
        bench.configure(c.IOFunction.PWM, 4)
        bench.put(c.SET_WAIT_CMD, c.WAITCmd(1000))
        bench.put(c.SET_END_EFFECTOR_SUCTION_CUP, c.EndEffectorSuctionCup(is_ctrl_enabled=True, is_sucked=True))
        bench.put(c.SET_END_EFFECTOR_GRIPPER, c.EndEffectorGripper(is_ctrl_enabled=True, is_gripped=True))
        bench.put(c.SET_IODO, c.IODO(1, 1))
        bench.put(c.SET_IOPWM, c.IOPWM(4, 1000, 25))
        bench.put(c.SET_E_MOTOR, c.EMotor(0, is_enabled=True, speed=100))
        return look(bench.after(0.9)), look(bench.after(0.6))

    assert looked_at(lambda arm: arm.suction) == (False, True)
    assert looked_at(lambda arm: arm.gripper) == (False, True)
    assert looked_at(lambda arm: arm.output(1)) == (0, 1)
    assert looked_at(lambda arm: arm.pwm(4).duty_cycle) == (0, 25)
    assert looked_at(lambda arm: arm.motors[0].speed) == (0, 100)


def test_end_effector_moves_the_tool_and_not_the_joints() -> None:
    bench = Bench()
    joints = bench.joints
    bench.ask(c.SET_END_EFFECTOR_PARAMS, c.EndEffectorParams(70))
    assert bench.joints == joints
    assert at(bench, HOME[0] + 70 - 59.7, *HOME[1:])


def test_sensors() -> None:
    bench = Bench()
    bench.arm.color = c.Color(1, 2, 3)
    bench.arm.infrared[c.InfraredPort.GP4] = True
    assert bench.ask(c.GET_COLOR_SENSOR) == c.Color(0, 0, 0)
    assert bench.ask(c.GET_INFRARED_SENSOR, c.InfraredPort.GP4) == 0
    bench.ask(c.SET_COLOR_SENSOR, c.ColorSensor(enable=True, port=c.ColorPort.GP2))
    for port in c.InfraredPort:
        bench.ask(c.SET_INFRARED_SENSOR, c.InfraredSensor(enable=True, port=port))

    assert bench.ask(c.GET_COLOR_SENSOR) == c.Color(0, 0, 0), "a sensor takes a moment"
    assert bench.ask(c.GET_INFRARED_SENSOR, c.InfraredPort.GP4) == 0
    bench.after(0.2)
    assert bench.ask(c.GET_COLOR_SENSOR) == c.Color(1, 2, 3)
    assert [bench.ask(c.GET_INFRARED_SENSOR, port) for port in c.InfraredPort] == [0, 0, 1, 0]


def test_a_sensor_of_another_version_sees_nothing() -> None:
    bench = Bench()
    bench.arm.color, bench.arm.color_version = c.Color(1, 0, 0), c.AccessoryVersion.V2
    bench.arm.infrared[c.InfraredPort.GP2], bench.arm.infrared_version = True, c.AccessoryVersion.V2
    for version in c.AccessoryVersion:
        seen = version is c.AccessoryVersion.V2
        bench.ask(c.SET_COLOR_SENSOR, c.ColorSensor(enable=True, port=c.ColorPort.GP1, version=version))
        bench.ask(c.SET_INFRARED_SENSOR, c.InfraredSensor(enable=True, port=c.InfraredPort.GP2, version=version))
        bench.after(1)
        assert bench.ask(c.GET_COLOR_SENSOR).r == seen
        assert bench.ask(c.GET_INFRARED_SENSOR, c.InfraredPort.GP2) == seen


def test_wifi() -> None:
    bench = Bench()
    assert not bench.ask(c.GET_WIFI_CONNECT_STATUS)
    bench.ask(c.SET_WIFI_CONFIG_MODE, value=True)
    bench.ask(c.SET_WIFI_SSID, "cell")
    assert not bench.ask(c.GET_WIFI_CONNECT_STATUS)
    bench.ask(c.SET_WIFI_CONFIG_MODE, value=False)
    assert not bench.ask(c.GET_WIFI_CONNECT_STATUS)
    bench.now += 2.0
    assert bench.ask(c.GET_WIFI_CONNECT_STATUS)


def test_wifi_needs_a_network_that_is_there_and_its_password() -> None:
    bench = Bench()
    bench.arm.state.networks = {"cell": "right"}
    for ssid, password, connected in (("cell", "wrong", 0), ("other", "right", 0), ("cell", "right", 1)):
        bench.ask(c.SET_WIFI_SSID, ssid)
        bench.ask(c.SET_WIFI_PASSWORD, password)
        bench.now += 2.0
        assert bench.ask(c.GET_WIFI_CONNECT_STATUS) == connected

    bench.arm.power_cycle()
    assert not bench.ask(c.GET_WIFI_CONNECT_STATUS)
    bench.now += 2.0
    assert bench.ask(c.GET_WIFI_CONNECT_STATUS)


def test_steppers() -> None:
    bench = Bench()
    bench.ask(c.SET_E_MOTOR, c.EMotor(0, is_enabled=True, speed=-10_000))
    bench.after(2)
    bench.put(c.SET_E_MOTOR_S, c.EMotorS(1, is_enabled=True, speed=500, distance=1000))
    bench.put(c.SET_E_MOTOR_S, c.EMotorS(1, is_enabled=True, speed=-500, distance=250))
    bench.put(c.SET_E_MOTOR_S, c.EMotorS(1, is_enabled=True, speed=0, distance=250))
    bench.after(1)
    first, second = bench.arm.motors
    assert repr(second) == "<Motor at 500 pulses/s, 500 pulses so far>"
    assert [(first.speed, first.pulses), (second.speed, second.pulses)] == [(-10_000, -30_000), (500, 500)]
    bench.ask(c.SET_E_MOTOR, c.EMotor(0, is_enabled=False, speed=-10_000))
    bench.after(7)
    assert [(first.speed, first.pulses), (second.speed, second.pulses)] == [(0, -30_000), (0, 750)]
    assert bench.times[2:] == [(2, 4), (4, 4.5), (4.5, 4.5)]
    bench.put(c.SET_E_MOTOR_S, c.EMotorS(1, is_enabled=True, speed=100, distance=1000))
    bench.after(1)
    bench.ask(c.SET_QUEUED_CMD_FORCE_STOP_EXEC)
    bench.after(1)
    assert second.pulses == 850
    bench.ask(c.SET_E_MOTOR, c.EMotor(0, is_enabled=True, speed=100))
    bench.arm.power_cycle()
    assert first.speed == 0


# Motions.


@pytest.mark.parametrize(
    ("mode", "numbers", "expected"),
    [
        (c.PTPMode.JUMP_XYZ, (200, 80, 20, 10), (200, 80, 20, 10)),
        (c.PTPMode.MOVJ_XYZ, (200, 80, 20, 10), (200, 80, 20, 10)),
        (c.PTPMode.MOVL_XYZ, (200, 80, 20, 10), (200, 80, 20, 10)),
        (c.PTPMode.JUMP_ANGLE, (10, 20, 30, 40), Kinematics().forward(10, 20, 30, 40)),
        (c.PTPMode.MOVJ_ANGLE, (10, 20, 30, 40), Kinematics().forward(10, 20, 30, 40)),
        (c.PTPMode.MOVL_ANGLE, (10, 20, 30, 40), Kinematics().forward(10, 20, 30, 40)),
        (c.PTPMode.MOVJ_INC, (10, -5, 5, 20), Kinematics().forward(10, 40, 50, 20)),
        (c.PTPMode.MOVL_INC, (-30, 10, 20, 5), (HOME[0] - 30, 10, HOME[2] + 20, 5)),
        (c.PTPMode.MOVJ_XYZ_INC, (-30, 10, 20, 5), (HOME[0] - 30, 10, HOME[2] + 20, 5)),
        (c.PTPMode.JUMP_MOVL_XYZ, (200, 80, 20, 10), (200, 80, 20, 10)),
    ],
)
@pytest.mark.parametrize("queued", [True, False])
def test_all_modes_end_where_they_should(
    mode: c.PTPMode, numbers: tuple[float, ...], expected: tuple[float, ...], queued: bool
) -> None:
    bench = Bench()
    value = c.PTPCmd(mode, *numbers)
    milliseconds = bench.ask(c.GET_PTP_TIME, value)
    assert 300 < milliseconds < 5000
    (bench.put if queued else bench.ask)(c.SET_PTP_CMD, value)
    bench.after(milliseconds / 1000 - 0.01)
    assert not bench.ask(c.GET_QUEUED_CMD_MOTION_FINISH)
    assert bench.ask(c.GET_KINEMATICS).velocity == 200
    bench.after(0.02)
    assert bench.ask(c.GET_QUEUED_CMD_MOTION_FINISH)
    assert bench.ask(c.GET_KINEMATICS).velocity == 0
    assert at(bench, *expected)
    assert bench.ask(c.GET_POSE).x == pytest.approx(expected[0], abs=1e-3)
    [executed] = bench.arm.executed
    assert (executed.index, executed.command, executed.outcome) == (2 if queued else None, c.SET_PTP_CMD, "done")
    assert executed.value.ptp_mode is mode
    assert executed.finished == pytest.approx(milliseconds / 1000, abs=1e-3)


def path_of(bench: Bench) -> list[tuple[float, float, float, float]]:
    """Where the tool is on the way of the motion that has just begun."""
    points = []
    while bench.arm.device.moving:
        bench.after(0.01)
        points.append(bench.point)

    assert len(points) > 50
    return points


def highest(bench: Bench) -> float:
    """How high the tool goes."""
    return max(point[2] for point in path_of(bench))


def test_the_ways_of_the_modes() -> None:
    line, joints, lift, straight = (Bench() for _ in range(4))
    line.move(c.PTPMode.MOVL_XYZ, 200, 150, 20)
    joints.move(c.PTPMode.MOVJ_XYZ, 200, 150, 20)
    lift.move(c.PTPMode.JUMP_XYZ, 200, 150, 20)
    straight.move(c.PTPMode.JUMP_MOVL_XYZ, 200, 150, 20)

    def from_the_line(point: tuple[float, ...]) -> float:
        return abs((point[0] - HOME[0]) * 150 - (point[1]) * (200 - HOME[0])) / math.hypot(150, 200 - HOME[0])

    assert max(map(from_the_line, path_of(line))) < 0.01
    assert max(map(from_the_line, path_of(joints))) > 5
    assert highest(straight) == pytest.approx(40, abs=0.01)
    assert highest(lift) == pytest.approx(40, abs=1)

    lift.move(c.PTPMode.JUMP_XYZ, *HOME)
    straight.move(c.PTPMode.JUMP_MOVL_XYZ, *HOME)
    assert max(map(from_the_line, path_of(lift))) > 5
    assert max(map(from_the_line, path_of(straight))) < 0.01


def test_increments_count_from_where_the_arm_is_then() -> None:
    bench = Bench()
    for _ in range(3):
        bench.move(c.PTPMode.MOVL_INC, -10, 0, 10, 0)

    bench.after(10)
    assert at(bench, HOME[0] - 30, 0, HOME[2] + 30, 0)


def test_jump_parameters() -> None:
    bench = Bench()
    bench.ask(c.SET_PTP_JUMP_PARAMS, c.PTPJumpParams(50, 30))
    bench.move(c.PTPMode.JUMP_MOVL_XYZ, 200, 80, 0)
    assert highest(bench) == pytest.approx(30, abs=0.01)
    bench.ask(c.SET_PTP_JUMP2_PARAMS, c.PTPJump2Params(10, 60, 100))
    bench.move(c.PTPMode.JUMP_MOVL_XYZ, 200, -80, 0)
    assert highest(bench) == pytest.approx(60, abs=0.01)
    bench.ask(c.SET_PTP_JUMP_PARAMS, c.PTPJumpParams(20, 100))
    bench.move(c.PTPMode.JUMP_MOVL_XYZ, 200, 80, 0)
    assert highest(bench) == pytest.approx(20, abs=0.01)


def test_velocities_are_registers_that_change_in_their_turn() -> None:
    bench = Bench()
    bench.move(c.PTPMode.MOVJ_ANGLE, 50, 45, 45, 0)
    bench.put(c.SET_PTP_COMMON_PARAMS, c.PTPCommonParams(100, 100))
    bench.move(c.PTPMode.MOVJ_ANGLE, 0, 45, 45, 0)
    bench.put(c.SET_PTP_COMMON_PARAMS, c.PTPCommonParams(400, 400))
    bench.move(c.PTPMode.MOVJ_ANGLE, 50, 45, 45, 0)
    bench.put(c.SET_PTP_JOINT_PARAMS, c.PTPJointParams((25,) * 4, (1e6,) * 4))
    bench.move(c.PTPMode.MOVJ_ANGLE, 0, 45, 45, 0)
    assert bench.ask(c.GET_PTP_COMMON_PARAMS) == c.PTPCommonParams(50, 50)
    bench.after(100)
    durations = [finished - started for started, finished in bench.times]
    assert durations == pytest.approx([math.sqrt(2), 0, 1, 0, 1, 0, 2], abs=1e-4)


def test_a_velocity_of_zero_moves_nothing_until_a_stop() -> None:
    bench = Bench()
    bench.ask(c.SET_PTP_COMMON_PARAMS, c.PTPCommonParams(0, 50))
    assert bench.ask(c.GET_PTP_TIME, c.PTPCmd(c.PTPMode.MOVL_XYZ, 200, 0, 0)) == 2**32 - 1
    bench.move(c.PTPMode.MOVL_XYZ, 200, 0, 0)
    bench.after(1e6)
    assert at(bench, *HOME)
    bench.ask(c.SET_QUEUED_CMD_FORCE_STOP_EXEC)
    assert bench.outcomes[-1] == (c.SET_PTP_CMD, "aborted")


@pytest.mark.parametrize(
    ("row", "value", "code"),
    [
        (c.SET_PTP_CMD, c.PTPCmd(c.PTPMode.MOVJ_XYZ, 400, 0, 0), 0x11),
        (c.SET_PTP_CMD, c.PTPCmd(c.PTPMode.MOVL_XYZ, 0, 0, 0), 0x10),
        (c.SET_PTP_CMD, c.PTPCmd(c.PTPMode.MOVL_XYZ, 150, 0, 150), 0x12),
        (c.SET_PTP_CMD, c.PTPCmd(c.PTPMode.MOVJ_ANGLE, 126, 45, 45), 0x12),
        (c.SET_PTP_CMD, c.PTPCmd(c.PTPMode.MOVJ_INC, 126, 0, 0), 0x12),
        (c.SET_PTP_CMD, c.PTPCmd(c.PTPMode.MOVL_INC, 200, 0, 0), 0x11),
        (c.SET_PTP_CMD, c.PTPCmd(c.PTPMode.JUMP_XYZ, 200, 0, 101), 0x15),
        (c.SET_PTP_CMD, c.PTPCmd(c.PTPMode.JUMP_MOVL_XYZ, 260, 0, 0), 0x13),
        (c.SET_CP_CMD, c.CPCmd(c.CPMode.ABSOLUTE, 400, 0, 0), 0x11),
        (c.SET_ARC_CMD, c.ARCCmd(c.ARCPoint(200, 0, 0), c.ARCPoint(200, 0, 0)), 0x13),
        (c.SET_ARC_CMD, c.ARCCmd(c.ARCPoint(240, 0, 0), c.ARCPoint(220, 0, 0)), 0x14),
        (c.SET_TRIG_CMD, c.TRIGCmd(1, c.TriggerMode.IO, 2, 0), 0x6C),
    ],
)
@pytest.mark.parametrize("options", [MAGICIAN, LITE], ids=["halt", "continue"])
def test_an_alarm_ends_the_command_and_the_rest_is_up_to_the_options(
    row: Row, value: Any, code: int, options: DeviceOptions
) -> None:
    bench = Bench(options)
    bench.arm.guide_to(260, 0, 0)
    bench.configure(c.IOFunction.DO, 1)
    bench.put(row, value)
    bench.put(c.SET_IODO, c.IODO(1, 1))
    index = bench.move(c.PTPMode.MOVJ_XYZ, 200, 0, 0)
    bench.after(20)
    assert (bench.faults, bench.arm.output(1)) == ({code}, 1)
    assert bench.outcomes[:2] == [(row, "alarm"), (c.SET_IODO, "done")]
    assert bench.ask(c.GET_ALARMS_STATE)[code // 8] >> code % 8 & 1
    if options is MAGICIAN:
        assert bench.ask(c.GET_QUEUED_CMD_CURRENT_INDEX) == index - 1
        assert at(bench, 260, 0, 0, 0)
        bench.ask(c.CLEAR_ALL_ALARMS_STATE)
        bench.after(20)

    assert bench.ask(c.GET_QUEUED_CMD_CURRENT_INDEX) == index
    assert at(bench, 200, 0, 0, 0)


def test_limits_are_the_arms_own() -> None:
    now = [0.0]
    arm = SimulatedMagician(lambda: now[0], limits=JointLimits(j1=(-10, 10)))
    value = c.PTPCmd(c.PTPMode.MOVJ_ANGLE, 11, 45, 45)
    arm.session().receive(bytes(request(c.SET_PTP_CMD, c.SET_PTP_CMD.request.encode(value), queued=True)))
    assert [alarm.code for alarm in arm.alarms] == [0x00, 0x12]


def test_leaving_the_reach_on_the_way() -> None:
    bench = Bench()
    bench.move(c.PTPMode.MOVJ_XYZ, 20, -200, 0, -90)
    bench.move(c.PTPMode.MOVL_XYZ, 20, 200, 0, 90)
    bench.after(20)
    assert bench.faults == {0x22}
    assert bench.outcomes[-1] == (c.SET_PTP_CMD, "alarm")
    assert -200 < bench.point[1] < -100


def test_an_immediate_motion_waits_for_no_one() -> None:
    bench = Bench()
    bench.put(c.SET_WAIT_CMD, c.WAITCmd(1000))
    bench.ask(c.SET_PTP_CMD, c.PTPCmd(c.PTPMode.MOVJ_XYZ, 200, 0, 0))
    bench.after(5)
    assert at(bench, *HOME), "nothing runs beside a queue that executes"
    bench.arm.raise_alarm(0x22)
    bench.ask(c.SET_PTP_CMD, c.PTPCmd(c.PTPMode.MOVJ_XYZ, 200, 0, 0))
    bench.after(5)
    assert at(bench, *HOME), "alarms hold it back"
    bench.ask(c.CLEAR_ALL_ALARMS_STATE)
    bench.ask(c.SET_PTP_CMD, c.PTPCmd(c.PTPMode.MOVJ_XYZ, 200, 0, 0))
    bench.after(5)
    assert at(bench, 200, 0, 0, 0)
    assert bench.ask(c.GET_QUEUED_CMD_CURRENT_INDEX) == 2


@pytest.mark.parametrize("queued", [True, False])
def test_an_immediate_motion_takes_the_place_of_the_one_that_goes_on(queued: bool) -> None:
    bench = Bench()
    far = c.PTPCmd(c.PTPMode.MOVJ_XYZ, 200, 150, 0)
    if queued:
        bench.put(c.SET_PTP_CMD, far)
        bench.move(c.PTPMode.MOVJ_XYZ, 240, 0, 0)
    else:
        bench.ask(c.SET_PTP_CMD, far)

    bench.after(0.3)
    bench.ask(c.SET_PTP_CMD, c.PTPCmd(c.PTPMode.MOVJ_XYZ, 200, -50, 0))
    assert 0 < bench.point[1] < 150, "it sets out from where the arm is"
    outcomes = [(each.value.y, each.outcome) for each in bench.after(20).executed]
    assert outcomes == [(150, "aborted"), (-50, "done"), *([(0, "done")] if queued else [])]
    assert at(bench, 240, 0, 0, 0) if queued else at(bench, 200, -50, 0, 0)


def test_rail() -> None:
    bench = Bench()
    there = c.PTPWithLCmd(c.PTPMode.MOVL_XYZ, 200, 0, 0, 0, 400)
    bench.put(c.SET_PTP_WITH_L_CMD, there)
    bench.after(10)
    assert math.isnan(bench.ask(c.GET_POSE_L)), "what arms without a rail answer"
    assert (bench.arm.rail, bench.ask(c.GET_DEVICE_WITH_L)) == (0, False)
    bench.ask(c.SET_DEVICE_WITH_L, c.DeviceWithL(is_with_l=True))
    assert bench.ask(c.GET_DEVICE_WITH_L)
    bench.put(c.SET_PTP_WITH_L_CMD, there)
    bench.after(2)
    assert 50 < bench.ask(c.GET_POSE_L) < 350
    bench.after(10)
    assert bench.ask(c.GET_POSE_L) == 400
    assert bench.times[-1][1] - bench.times[-1][0] == pytest.approx(5, abs=1e-3)
    bench.move(c.PTPMode.MOVL_INC, 10, 0, 0, 0)
    bench.put(c.SET_PTPPO_WITH_L_CMD, c.PTPPOWithLCmd(c.PTPMode.MOVL_XYZ, 200, 0, 0, 0, 500, ()))
    bench.after(10)
    assert bench.arm.rail == 500
    bench.put(c.SET_PTP_WITH_L_CMD, replace(there, rail=1001))
    bench.after(10)
    assert (bench.arm.rail, bench.faults) == (500, {0x12})


@pytest.mark.parametrize("mode", [c.PTPMode.MOVL_XYZ, c.PTPMode.JUMP_MOVL_XYZ])
def test_outputs_switch_on_the_way(mode: c.PTPMode) -> None:
    bench = Bench()
    bench.ask(c.SET_PTP_JUMP_PARAMS, c.PTPJumpParams(0, 100))
    bench.ask(c.SET_PTP_COORDINATE_PARAMS, c.PTPCoordinateParams(100, 100, 1e9, 1e9))
    bench.ask(c.SET_PTP_COMMON_PARAMS, c.PTPCommonParams(100, 100))
    bench.move(c.PTPMode.MOVL_XYZ, 200, -50, 0)
    bench.after(10)
    bench.configure(c.IOFunction.DO, 3, 4)
    outputs = (c.ParallelOutputCmd(75, 3, 0), c.ParallelOutputCmd(25, 3, 1), c.ParallelOutputCmd(100, 4, 1))
    bench.put(c.SET_PTPPO_CMD, c.PTPPOCmd(mode, 200, 50, 0, 0, outputs))
    bench.after(0.001)
    seen = []
    for _ in range(6):
        seen.append((round(bench.now - 10, 2), bench.arm.output(3), bench.arm.output(4)))
        bench.after(0.2)

    assert seen == [(0, 0, 0), (0.2, 0, 0), (0.4, 1, 0), (0.6, 1, 0), (0.8, 0, 0), (1.0, 0, 1)]


def test_outputs_of_a_motion_that_is_stopped_do_not_switch() -> None:
    bench = Bench()
    bench.configure(c.IOFunction.DO, 3, 4)
    outputs = (c.ParallelOutputCmd(0, 3, 1), c.ParallelOutputCmd(90, 4, 1))
    bench.put(c.SET_PTPPO_CMD, c.PTPPOCmd(c.PTPMode.MOVJ_XYZ, 200, 100, 0, 0, outputs))
    bench.after(0.3)
    bench.ask(c.SET_QUEUED_CMD_FORCE_STOP_EXEC)
    bench.after(10)
    assert (bench.arm.output(3), bench.arm.output(4)) == (1, 0)


def test_outputs_of_a_motion_on_the_spot() -> None:
    bench = Bench()
    bench.configure(c.IOFunction.DO, 3, 4)
    outputs = (c.ParallelOutputCmd(0, 3, 1), c.ParallelOutputCmd(100, 4, 1))
    bench.put(c.SET_PTPPO_CMD, c.PTPPOCmd(c.PTPMode.MOVJ_INC, 0, 0, 0, 90, outputs))
    bench.after(0.1)
    assert (bench.arm.output(3), bench.arm.output(4)) == (1, 0)
    bench.after(10)
    assert bench.arm.output(4) == 1


def ring(count: int) -> list[c.CPCmd]:
    """Points on a circle of 40 mm."""
    angles = [number * math.tau / count for number in range(count + 1)]
    return [c.CPCmd(c.CPMode.ABSOLUTE, 220 + 40 * math.cos(angle), 40 * math.sin(angle), 0) for angle in angles]


def test_a_continuous_path_does_not_halt() -> None:
    bench = Bench(replace(MAGICIAN, capacity=2000))
    bench.move(c.PTPMode.MOVJ_XYZ, 260, 0, 0)
    for value in ring(1000):
        bench.put(c.SET_CP_CMD, value)

    bench.after(100)
    began, ended = bench.times[1][0], bench.times[-1][1]
    assert len(bench.times) == 1002
    assert ended - began == pytest.approx(80 * math.pi / 100 + 0.5, rel=0.01), "100 mm/s, and a second to get there"
    assert at(bench, 260, 0, 0, 0)


def test_a_path_that_runs_dry_halts_and_goes_on() -> None:
    bench = Bench()
    for x in (250, 240, 230):
        bench.put(c.SET_CP_CMD, c.CPCmd(c.CPMode.ABSOLUTE, x, 0, HOME[2]))
        bench.after(20)

    assert [end - begin for begin, end in bench.times[1:]] == pytest.approx([2 * math.sqrt(0.1)] * 2, rel=1e-3)
    bench.ask(c.SET_CP_COMMON_PARAMS, c.CPCommonParams(10, 25))
    bench.put(c.SET_CP_CMD, c.CPCmd(c.CPMode.RELATIVE, -10, 10, 5))
    bench.after(20)
    assert bench.point[:3] == pytest.approx((220, 10, HOME[2] + 5), abs=1e-3)
    assert bench.times[-1][1] - bench.times[-1][0] == pytest.approx(1.5 + 0.4, rel=1e-3)


def test_a_path_leaves_joint_4_alone_unless_it_is_to_hold_r() -> None:
    bench = Bench()
    bench.put(c.SET_CP_CMD, c.CPCmd(c.CPMode.ABSOLUTE, 200, 100, 0))
    bench.after(20)
    assert (bench.joints[3], bench.point[3]) == pytest.approx((0, bench.joints[0]))
    bench.ask(c.SET_CPR_HOLD_ENABLE, value=True)
    held = bench.point[3]
    bench.put(c.SET_CP_CMD, c.CPCmd(c.CPMode.ABSOLUTE, 200, 0, 0))
    bench.after(20)
    assert at(bench, 200, 0, 0, held)


def test_engraving() -> None:
    bench = Bench()
    bench.put(c.SET_CPLE_CMD, c.CPLECmd(c.CPMode.ABSOLUTE, 240, 0, 0, 40))
    bench.put(c.SET_CPLE_CMD, c.CPLECmd(c.CPMode.RELATIVE, -20, 0, 0, 75))
    assert bench.arm.laser == 40
    bench.after(1.0)
    assert bench.arm.laser == 75
    bench.after(10)
    assert bench.arm.laser == 0
    assert at(bench, 220, 0, 0, 0)


def test_arcs_and_circles() -> None:
    bench = Bench()
    bench.move(c.PTPMode.MOVJ_XYZ, 260, 0, 0)
    bench.put(c.SET_ARC_CMD, c.ARCCmd(c.ARCPoint(220, 40, 0), c.ARCPoint(180, 0, 0, 30)))
    bench.after(20)
    assert at(bench, 180, 0, 0, 30)
    bench.put(c.SET_CIRCLE_CMD, c.CircleCmd(c.ARCPoint(220, 40, 0), c.ARCPoint(260, 0, 0), 3))
    points = path_of(bench)
    assert at(bench, 180, 0, 0, 30)
    assert all(math.hypot(x - 220, y) == pytest.approx(40, abs=0.01) for x, y, _, _ in points)
    started, finished = bench.times[-1]
    assert finished - started == pytest.approx(3 * 80 * math.pi / 100 + 1, rel=1e-3), "100 mm/s"


def test_a_circle_of_a_billion_turns_is_planned_at_once() -> None:
    bench = Bench()
    bench.move(c.PTPMode.MOVJ_XYZ, 260, 0, 0)
    bench.put(c.SET_CIRCLE_CMD, c.CircleCmd(c.ARCPoint(220, 40, 0), c.ARCPoint(180, 0, 0), 2**32 - 1))
    bench.after(1e6)
    assert bench.ask(c.GET_QUEUED_CMD_CURRENT_INDEX) == 2
    assert math.hypot(bench.point[0] - 220, bench.point[1]) == pytest.approx(40, abs=0.01)
    bench.put(c.SET_CIRCLE_CMD, c.CircleCmd(c.ARCPoint(220, 40, 0), c.ARCPoint(180, 0, 0), 0))


def test_a_circle_that_leaves_the_reach() -> None:
    bench = Bench()
    bench.put(c.SET_CIRCLE_CMD, c.CircleCmd(c.ARCPoint(330, 70, 0), c.ARCPoint(330, 0, 60), 2))
    bench.after(20)
    assert bench.outcomes == [(c.SET_CIRCLE_CMD, "alarm")]


def test_home() -> None:
    bench = Bench()
    bench.move(c.PTPMode.MOVJ_XYZ, 200, 100, 50, 40)
    bench.ask(c.SET_END_EFFECTOR_PARAMS, c.EndEffectorParams(70))
    bench.put(c.SET_HOME_CMD, c.HOMECmd())
    bench.after(20)
    assert bench.joints == pytest.approx((0, 45, 45, 0))
    started, finished = bench.times[-1]
    assert finished - started == pytest.approx(5)
    bench.ask(c.SET_HOME_PARAMS, c.HOMEParams(200, 10, 20, 30))
    bench.put(c.SET_HOME_CMD, c.HOMECmd())
    bench.after(20)
    assert at(bench, 200, 10, 20, 30)
    bench.ask(c.SET_HOME_PARAMS, c.HOMEParams(500, 0, 0, 0))
    bench.put(c.SET_HOME_CMD, c.HOMECmd())
    assert bench.faults == {0x11}


@pytest.mark.parametrize("options", [MAGICIAN, LITE], ids=["halt", "continue"])
def test_lost_steps_are_found_when_asked_for_and_home_makes_them_good(options: DeviceOptions) -> None:
    bench = Bench(options)
    bench.arm.lose_steps(2, -6)
    bench.arm.lose_steps(4, 9)
    bench.arm.lose_steps(1, 4)
    assert bench.faults == set()
    bench.put(c.SET_LOST_STEP_CMD)
    assert bench.faults == {0x51, 0x53}
    if options is MAGICIAN:
        bench.ask(c.CLEAR_ALL_ALARMS_STATE)

    bench.put(c.SET_HOME_CMD, c.HOMECmd())
    bench.after(5)
    assert bench.faults == set()
    bench.put(c.SET_LOST_STEP_CMD)
    assert bench.faults == set()
    bench.arm.lose_steps(1, 4)
    bench.ask(c.SET_LOST_STEP_PARAMS, 3.0)
    bench.put(c.SET_LOST_STEP_CMD)
    assert bench.faults == {0x50}


@pytest.mark.parametrize("joint", [0, 5, -1])
def test_only_joints_that_are_there_lose_steps(joint: int) -> None:
    with pytest.raises(ValueError, match="1 to 4"):
        Bench().arm.lose_steps(joint, 7)


def true_point(bench: Bench) -> tuple[float, ...]:
    pose = bench.arm.true_pose
    return pose.x, pose.y, pose.z, pose.r


def test_lost_steps_are_seen_in_the_true_pose_alone() -> None:
    bench = Bench()
    bench.put(c.SET_HOME_CMD, c.HOMECmd())
    bench.after(5)
    bench.arm.lose_steps(1, 10)
    bench.move(c.PTPMode.MOVJ_ANGLE, 20, 40, 40, 0)
    bench.after(10)
    assert bench.joints == pytest.approx((20, 40, 40, 0))
    assert (bench.arm.true_pose.j1, bench.arm.true_pose.j2) == pytest.approx((30, 40))
    assert true_point(bench) == pytest.approx(Kinematics().forward(30, 40, 40, 0))


def test_an_arm_does_not_know_where_it_is_before_it_is_homed() -> None:
    bench = Bench()
    bench.ask(c.SET_DEVICE_WITH_L, c.DeviceWithL(is_with_l=True))
    assert [bench.arm.homed] == [False]
    assert abs(bench.arm.true_pose.j1 - bench.joints[0]) > 1
    assert (bench.arm.true_pose.j2, bench.arm.true_pose.j3) == bench.joints[1:3], "the two arms have angle sensors"
    assert bench.arm.true_rail > 1
    bench.put(c.SET_PTP_WITH_L_CMD, c.PTPWithLCmd(c.PTPMode.MOVJ_XYZ, 200, 50, 20, 0, 300))
    bench.after(10)
    assert at(bench, 200, 50, 20, 0)
    assert math.dist(true_point(bench), bench.point) > 10
    bench.put(c.SET_LOST_STEP_CMD)
    assert bench.faults == set()

    bench.put(c.SET_HOME_CMD, c.HOMECmd())
    last = true_point(bench)
    for _ in range(100):
        bench.after(0.05)
        assert math.dist(true_point(bench), last) < 30, "it is not carried away, it drives"
        last = true_point(bench)

    assert bench.arm.homed
    assert at(bench, *HOME)
    assert (bench.arm.true_pose, bench.arm.true_rail, bench.arm.rail) == (bench.arm.pose, 0, 0)


def test_power_takes_away_what_the_arm_knew_of_its_place() -> None:
    bench = Bench()
    bench.put(c.SET_HOME_CMD, c.HOMECmd())
    bench.move(c.PTPMode.MOVJ_ANGLE, 30, 40, 50, -60)
    bench.after(20).power_cycle()
    assert not bench.arm.homed
    assert bench.joints == pytest.approx((0, 40, 50, 0))
    true = bench.arm.true_pose
    assert (true.j1, true.j2, true.j3, true.j4) == pytest.approx((30, 40, 50, -60))


def test_levelling() -> None:
    bench = Bench()
    bench.put(c.SET_AUTO_LEVELING_CMD, c.AutoLevelingCmd(control_flag=True, precision=0.5))
    assert bench.ask(c.GET_AUTO_LEVELING_RESULT) == 0
    assert not bench.ask(c.GET_QUEUED_CMD_MOTION_FINISH)
    bench.after(5)
    assert bench.ask(c.GET_AUTO_LEVELING_RESULT) == 0.5
    assert bench.ask(c.GET_QUEUED_CMD_MOTION_FINISH)


def test_pose_can_be_reset() -> None:
    bench = Bench()
    bench.ask(c.RESET_POSE, c.ResetPose(manual=False, rear_arm_angle=1, front_arm_angle=2))
    assert bench.joints == pytest.approx((0, 45, 45, 0))
    bench.ask(c.RESET_POSE, c.ResetPose(manual=True, rear_arm_angle=40, front_arm_angle=50))
    assert bench.joints == pytest.approx((0, 40, 50, 0))


# Waiting.


def test_wait_and_device_time() -> None:
    bench = Bench(now=100.0)
    bench.put(c.SET_WAIT_CMD, c.WAITCmd(1250))
    bench.after(1.2)
    assert bench.ask(c.GET_QUEUED_CMD_CURRENT_INDEX) == NO_INDEX
    bench.after(0.05)
    assert bench.ask(c.GET_QUEUED_CMD_CURRENT_INDEX) == 2
    assert bench.ask(c.GET_DEVICE_TIME) == 1250


@pytest.mark.parametrize(
    ("mode", "condition", "threshold", "holds"),
    [
        (c.TriggerMode.IO, c.TriggerIOCondition.EQUAL, 1, [1]),
        (c.TriggerMode.IO, c.TriggerIOCondition.EQUAL, 0, [0]),
        (c.TriggerMode.IO, c.TriggerIOCondition.NOT_EQUAL, 0, [1]),
        (c.TriggerMode.ADC, c.TriggerADCCondition.LESS, 100, [0, 1, 99]),
        (c.TriggerMode.ADC, c.TriggerADCCondition.LESS_OR_EQUAL, 100, [0, 1, 99, 100]),
        (c.TriggerMode.ADC, c.TriggerADCCondition.GREATER_OR_EQUAL, 100, [100, 101]),
        (c.TriggerMode.ADC, c.TriggerADCCondition.GREATER, 100, [101]),
    ],
)
def test_triggers(mode: c.TriggerMode, condition: int, threshold: int, holds: list[int]) -> None:
    found = []
    for value in [0, 1] if mode is c.TriggerMode.IO else [0, 1, 99, 100, 101]:
        bench = Bench()
        bench.configure(c.IOFunction.DI if mode is c.TriggerMode.IO else c.IOFunction.ADC, 6)
        (bench.arm.set_input if mode is c.TriggerMode.IO else bench.arm.set_adc)(6, value)
        bench.put(c.SET_TRIG_CMD, c.TRIGCmd(6, mode, condition, threshold))
        if bench.after(10).executed:
            found.append(value)

    assert found == holds


def test_a_trigger_holds_the_queue_until_its_pin_changes() -> None:
    bench = Bench()
    bench.configure(c.IOFunction.DI, 6)
    bench.configure(c.IOFunction.DO, 1)
    bench.put(c.SET_TRIG_CMD, c.TRIGCmd(6, c.TriggerMode.IO, c.TriggerIOCondition.EQUAL, 1))
    bench.put(c.SET_IODO, c.IODO(1, 1))
    bench.after(10).set_adc(6, 1)
    bench.arm.set_input(5, 1)
    assert bench.arm.executed == []
    bench.after(5).set_input(6, 1)
    bench.after(5)
    assert bench.times == [(0, 15), (15, 15)]
    assert bench.arm.output(1) == 1


# Jogging.


@pytest.mark.parametrize(
    ("key", "codes", "joint", "angle"),
    [
        (c.JOGKey.AP_DOWN, {0x40}, 0, 125),
        (c.JOGKey.AN_DOWN, {0x41}, 0, -125),
        (c.JOGKey.BP_DOWN, {0x42}, 1, 90),
        (c.JOGKey.BN_DOWN, {0x43}, 1, -5),
        (c.JOGKey.CP_DOWN, {0x44}, 2, 90),
        (c.JOGKey.CN_DOWN, {0x48}, 2, -10),
        (c.JOGKey.DP_DOWN, {0x46}, 3, 150),
        (c.JOGKey.DN_DOWN, {0x47}, 3, -150),
    ],
)
def test_a_joint_jogs_to_its_limit_and_back(key: c.JOGKey, codes: set[int], joint: int, angle: float) -> None:
    bench = Bench()
    bench.jog(key, joint=True)
    bench.after(1)
    assert abs(bench.joints[joint] - (0, 45, 45, 0)[joint]) == pytest.approx(15, abs=1.2)
    bench.after(60)
    assert bench.faults == codes
    assert bench.joints[joint] == pytest.approx(angle)
    [executed] = bench.arm.executed
    assert (executed.index, executed.command, executed.outcome) == (None, c.SET_JOG_CMD, "alarm")
    bench.jog(key, joint=True)
    assert bench.joints[joint] == pytest.approx(angle)
    bench.jog(c.JOGKey(key + 1 if key % 2 else key - 1), joint=True)
    bench.after(1)
    bench.jog(c.JOGKey.IDLE)
    assert bench.faults == set(), "the alarm clears itself"
    bench.after(9)
    assert abs(bench.joints[joint] - angle) == pytest.approx(15, abs=1.2)


def test_the_parallelogram_folds_and_stretches() -> None:
    bench = Bench()
    bench.arm.guide_to(*Kinematics().forward(0, 0, 60, 0))
    bench.jog(c.JOGKey.CP_DOWN, joint=True)
    bench.after(60)
    assert bench.faults == {0x49}
    assert bench.joints[2] == pytest.approx(70)
    bench.jog(c.JOGKey.BN_DOWN, joint=True)
    bench.after(1)
    assert bench.joints[1] == pytest.approx(0), "folded by joint 3, and not to be folded further by joint 2"
    bench.arm.guide_to(*Kinematics().forward(0, 50, 0, 0))
    bench.ask(c.CLEAR_ALL_ALARMS_STATE)
    bench.jog(c.JOGKey.BP_DOWN, joint=True)
    bench.after(60)
    assert bench.faults == {0x48}
    assert bench.joints[1] == pytest.approx(55)


@pytest.mark.parametrize("key", list(c.JOGKey)[1:9])
def test_the_tool_jogs_along_its_axis_to_a_limit_and_back(key: c.JOGKey) -> None:
    bench = Bench()
    bench.arm.guide_to(230, 0, 30, 0)
    axis, sign = (key - 1) // 2, 1 if key % 2 else -1
    bench.jog(key)
    bench.after(0.3)
    moved = [there - here for there, here in zip(bench.point, (230, 0, 30, 0), strict=True)]
    assert moved[axis] * sign == pytest.approx(9, abs=0.1)
    assert [number for at_axis, number in enumerate(moved) if at_axis != axis] == pytest.approx([0, 0, 0], abs=1e-6)
    bench.after(60)
    assert bench.faults <= set(range(0x40, 0x4A))
    assert len(bench.faults) == 1
    assert min(margins(JointLimits(), bench.joints).values()) == pytest.approx(0, abs=0.06)
    bench.jog(c.JOGKey(key + 1 if key % 2 else key - 1))
    bench.after(0.5)
    bench.jog(c.JOGKey.IDLE)
    assert bench.faults == set()


def test_the_same_key_again_changes_nothing() -> None:
    once, often = Bench(), Bench()
    for bench in (once, often):
        bench.jog(c.JOGKey.AP_DOWN, joint=True)

    for _ in range(9):
        often.after(0.1)
        often.jog(c.JOGKey.AP_DOWN, joint=True)

    once.after(0.9)
    assert once.joints == pytest.approx(often.joints)
    assert often.arm.executed == []
    often.jog(c.JOGKey.BP_DOWN, joint=True)
    often.after(1)
    often.jog(c.JOGKey.IDLE)
    assert [executed.value.cmd for executed in often.arm.executed] == [c.JOGKey.AP_DOWN, c.JOGKey.BP_DOWN]
    often.jog(c.JOGKey.AP_DOWN, joint=True)
    assert often.arm.device.moving


def test_no_jog_while_the_queue_executes() -> None:
    bench = Bench()
    bench.put(c.SET_WAIT_CMD, c.WAITCmd(1000))
    bench.jog(c.JOGKey.AP_DOWN, joint=True)
    bench.after(5)
    assert bench.joints[0] == 0
    bench.jog(c.JOGKey.AP_DOWN, joint=True)
    bench.after(5)
    assert bench.joints[0] > 50


def test_a_queued_jog_goes_on_until_a_queued_idle() -> None:
    bench = Bench()
    bench.put(c.SET_JOG_CMD, c.JOGCmd(is_joint=True, cmd=c.JOGKey.AP_DOWN))
    bench.put(c.SET_WAIT_CMD, c.WAITCmd(2000))
    bench.put(c.SET_JOG_CMD, c.JOGCmd(is_joint=True, cmd=c.JOGKey.IDLE))
    bench.move(c.PTPMode.MOVJ_INC, 0, 0, 0, 10)
    bench.after(60)
    assert bench.joints == pytest.approx((15 * 2 - 15 * 0.15 / 2, 45, 45, 10))
    assert [executed.index for executed in bench.arm.executed] == [2, 3, None, 4, 5]


def test_the_rail_jogs_to_its_end() -> None:
    bench = Bench()
    bench.jog(c.JOGKey.EP_DOWN, joint=True)
    assert bench.after(5).rail == 0
    bench.ask(c.SET_DEVICE_WITH_L, c.DeviceWithL(is_with_l=True))
    bench.jog(c.JOGKey.EP_DOWN)
    assert bench.after(5).rail == 0, "the rail's keys are those of a joint"
    bench.jog(c.JOGKey.EP_DOWN, joint=True)
    assert bench.after(5).rail == pytest.approx(291)
    assert bench.after(20).rail == 1000
    bench.jog(c.JOGKey.EN_DOWN, joint=True)
    assert bench.after(20).rail == 0
    assert bench.faults == set()
    assert at(bench, *HOME)


# The queue.


def test_stop_force_stop_clear_start() -> None:
    bench = Bench()
    for y in (50, -50, 50):
        bench.move(c.PTPMode.MOVL_XYZ, 200, y, 0)

    bench.after(0.5)
    bench.ask(c.SET_QUEUED_CMD_STOP_EXEC)
    bench.after(20)
    assert at(bench, 200, 50, 0, 0)
    assert (bench.ask(c.GET_QUEUED_CMD_CURRENT_INDEX), bench.ask(c.GET_QUEUED_CMD_LEFT_SPACE)) == (2, 30)
    bench.ask(c.SET_QUEUED_CMD_START_EXEC)
    bench.after(0.5)
    bench.ask(c.SET_QUEUED_CMD_FORCE_STOP_EXEC)
    stopped = bench.point
    bench.after(20)
    assert bench.point == stopped
    assert (bench.ask(c.GET_QUEUED_CMD_CURRENT_INDEX), bench.ask(c.GET_QUEUED_CMD_LEFT_SPACE)) == (3, 31)
    bench.ask(c.SET_QUEUED_CMD_CLEAR)
    assert bench.ask(c.GET_QUEUED_CMD_LEFT_SPACE) == 32
    bench.ask(c.SET_QUEUED_CMD_START_EXEC)
    assert bench.move(c.PTPMode.MOVL_XYZ, 220, 0, 0) == 5
    bench.after(20)
    assert at(bench, 220, 0, 0, 0)


def test_control_of_the_queue_is_never_queued() -> None:
    bench = Bench()
    bench.ask(c.SET_QUEUED_CMD_STOP_EXEC)
    assert bench.send(Frame(240, WRITE | QUEUED, b"")) == Frame(240, WRITE | QUEUED, b"")
    assert bench.arm.device.started


def test_a_full_queue_is_silent() -> None:
    bench = Bench(replace(MAGICIAN, capacity=1))
    bench.configure(c.IOFunction.DO, 1)
    bench.put(c.SET_WAIT_CMD, c.WAITCmd(1000))
    assert bench.send(Frame(131, WRITE | QUEUED, b"\1\1")) is None
    bench.after(5)
    assert (bench.arm.output(1), bench.arm.counters.overflowed) == (0, 1)
    assert bench.put(c.SET_WAIT_CMD, c.WAITCmd(1000)) == 3


def test_a_full_queue_that_lies() -> None:
    bench = Bench(replace(MAGICIAN, capacity=1), Quirks(overflow="index"))
    bench.configure(c.IOFunction.DO, 1)
    assert bench.put(c.SET_WAIT_CMD, c.WAITCmd(1000)) == 2
    assert bench.put(c.SET_IODO, c.IODO(1, 1)) == 3
    bench.after(5)
    assert (bench.arm.output(1), bench.arm.counters.overflowed) == (0, 1)
    assert bench.put(c.SET_WAIT_CMD, c.WAITCmd(1000)) == 4


def test_options_of_the_device_are_the_firmwares() -> None:
    bench = Bench(DeviceOptions(garbage_index_while_moving=True, first_index=7))
    assert bench.move(c.PTPMode.MOVJ_XYZ, 200, 0, 0) == 7
    assert bench.ask(c.GET_QUEUED_CMD_CURRENT_INDEX) >= NO_INDEX - 1
    bench.after(10)
    assert bench.ask(c.GET_QUEUED_CMD_CURRENT_INDEX) == 7


# Alarms, power, quirks.


def test_alarms_are_set_and_cleared() -> None:
    bench = Bench()
    bench.move(c.PTPMode.MOVJ_XYZ, 200, 0, 0)
    bench.after(0.2).raise_alarm(0x45)
    bench.arm.raise_alarm(0x22)
    assert bench.ask(c.GET_ALARMS_STATE).hex() == "01000000040000002000000000000000"
    assert [alarm.name for alarm in bench.arm.alarms] == ["COMMON_RESET", "MOVE_INV_LIMIT", "LIMIT_AXIS3_NEG"]
    assert bench.outcomes == [(c.SET_PTP_CMD, "alarm")]
    bench.ask(c.CLEAR_ALL_ALARMS_STATE)
    assert bench.arm.alarms == ()
    with pytest.raises(ValueError, match="0x7F"):
        bench.arm.raise_alarm(0x80)


def test_an_unknown_command_does_not_stop_the_arm() -> None:
    bench = Bench()
    bench.move(c.PTPMode.MOVJ_XYZ, 200, 0, 0)
    bench.send(Frame(99, 0, b""))
    bench.after(10)
    assert at(bench, 200, 0, 0, 0)


def test_power_cycle() -> None:
    bench = Bench()
    bench.ask(c.CLEAR_ALL_ALARMS_STATE)
    bench.move(c.PTPMode.MOVJ_XYZ, 200, 0, 0)
    bench.move(c.PTPMode.MOVJ_XYZ, 200, 50, 0)
    bench.ask(c.SET_QUEUED_CMD_START_DOWNLOAD, c.QueuedCmdStartDownload(1, 1))
    bench.after(0.3).power_cycle()
    stood = bench.point
    bench.after(10)
    assert bench.point == stood
    assert [alarm.code for alarm in bench.arm.alarms] == [0x00]
    assert (bench.ask(c.GET_DEVICE_TIME), bench.ask(c.GET_QUEUED_CMD_CURRENT_INDEX)) == (10_000, NO_INDEX)
    assert bench.move(c.PTPMode.MOVJ_XYZ, 200, 0, 0) == 2
    bench.after(10)
    assert at(bench, 200, 0, 0, 0)


def test_quirks() -> None:
    plain, odd = Bench(), Bench(quirks=Quirks("silent", True, True, True, True))
    for bench, sizes, ctrl in ((plain, (4, 3), 0), (odd, (8, 14), WRITE)):
        replies = [bench.send(Frame(number, 0, b"")) for number in (247, 2, 40)]
        assert [len(reply.params) for reply in replies if reply] == [*sizes, 1]
        assert [reply.ctrl for reply in replies if reply] == [0, 0, ctrl]

    assert odd.send(Frame(21, WRITE, b"")) == Frame(21, WRITE, b"")
    assert odd.arm.alarms == ()
    assert (odd.ask(c.GET_QUEUED_CMD_LEFT_SPACE), str(odd.ask(c.GET_DEVICE_VERSION))) == (32, "3.7.0")


# Teaching and programs.


def test_hand_guiding() -> None:
    bench = Bench()
    bench.arm.guide_to(200, 50, 20, 10)
    assert at(bench, 200, 50, 20, 10)
    assert not bench.ask(c.GET_HHT_TRIG_OUTPUT), "not enabled"
    bench.ask(c.SET_HHT_TRIG_OUTPUT_ENABLED, value=True)
    assert not bench.ask(c.GET_HHT_TRIG_OUTPUT)
    bench.arm.guide_to(200, 60, 20, 10)
    assert [bench.ask(c.GET_HHT_TRIG_OUTPUT) for _ in range(2)] == [True, False]
    bench.arm.press_teach_key()
    assert bench.ask(c.GET_HHT_TRIG_OUTPUT)
    with pytest.raises(Unreachable):
        bench.arm.guide_to(400, 0, 0, 0)

    bench.move(c.PTPMode.MOVJ_XYZ, 200, 0, 0)
    with pytest.raises(RuntimeError, match="moves"):
        bench.arm.guide_to(200, 0, 0, 0)


def download(bench: Bench, loops: int, *commands: tuple[Row, Any]) -> list[int]:
    """Stores a program."""
    bench.ask(c.SET_QUEUED_CMD_START_DOWNLOAD, c.QueuedCmdStartDownload(loops, len(commands)))
    indices = [bench.put(row, value) for row, value in commands]
    bench.ask(c.SET_QUEUED_CMD_STOP_DOWNLOAD)
    return indices


def test_a_program_is_stored_and_runs_from_the_key() -> None:
    bench = Bench()
    commands: list[tuple[Row, Any]] = [
        (c.SET_PTP_CMD, c.PTPCmd(c.PTPMode.MOVL_INC, -10, 0, 0, 0)),
        (c.SET_IODO, c.IODO(1, 1)),
        (c.SET_WAIT_CMD, c.WAITCmd(500)),
    ]
    bench.arm.run_program()
    assert download(bench, 3, *commands) == [2, 3, 4]
    bench.after(20)
    assert bench.arm.executed == []
    assert bench.arm.program
    assert (bench.arm.program.loops, bench.arm.program.commands) == (3, commands)
    assert bench.put(c.SET_WAIT_CMD, c.WAITCmd(0)) == 5
    bench.arm.power_cycle()
    bench.ask(c.SET_QUEUED_CMD_STOP_EXEC)
    bench.arm.run_program()
    bench.after(60)
    assert at(bench, HOME[0] - 30, *HOME[1:])
    assert [(executed.command, executed.value) for executed in bench.arm.executed][1:] == commands * 3
    download(bench, 5)
    bench.arm.run_program()
    assert bench.ask(c.GET_QUEUED_CMD_MOTION_FINISH)


def test_a_program_longer_than_the_queue_and_its_end_by_clear() -> None:
    bench = Bench(replace(MAGICIAN, capacity=2))
    bench.configure(c.IOFunction.DO, 2)
    download(bench, 2**32 - 1, (c.SET_WAIT_CMD, c.WAITCmd(100)), (c.SET_IODO, c.IODO(1, 1)))
    bench.arm.run_program()
    bench.after(10.05)
    assert len(bench.arm.executed) == 200
    bench.ask(c.SET_QUEUED_CMD_CLEAR)
    bench.after(10)
    assert bench.outcomes[200:] == [(c.SET_WAIT_CMD, "aborted")]
    assert bench.put(c.SET_IODO, c.IODO(2, 1))
    assert bench.arm.output(2) == 1


# Whatever comes.

frames = st.builds(
    Frame, st.sampled_from([row.id for row in c.ALL]), st.integers(0, 255), st.binary(max_size=MAX_PARAMS)
)
requests = st.sampled_from(c.ALL).flatmap(
    lambda row: st.builds(
        lambda value, ctrl: encode(Frame(row.id, ctrl, row.request.encode(value))),
        values(row.request),
        st.just(row.write * WRITE) | st.integers(0, 3),
    )
)
targets = st.builds(
    c.PTPCmd,
    st.sampled_from(c.PTPMode),
    st.floats(-300, 300, width=32),
    st.floats(-300, 300, width=32),
    st.floats(-100, 150, width=32),
    st.floats(-150, 150, width=32),
)
moves = targets.map(lambda value: encode(request(c.SET_PTP_CMD, c.SET_PTP_CMD.request.encode(value), queued=True)))
chunks = st.lists(
    st.tuples(st.binary(max_size=40) | frames.map(encode) | requests | moves, st.floats(0, 20)), max_size=30
)


@given(chunks, st.sampled_from(["halt", "continue"]), st.integers(1, 40))
@settings(max_examples=examples(300), deadline=None)
def test_anything_is_survived_and_nothing_grows(
    script: list[tuple[bytes, float]], on_fault: Any, capacity: int
) -> None:
    bench = Bench(replace(MAGICIAN, on_fault=on_fault, capacity=capacity, keep=50))
    for data, pause in script:
        for frame in Parser().feed(bench.session.receive(data)):
            assert len(frame.params) <= MAX_PARAMS

        bench.after(pause)

    bench.session.receive(bytes(300))
    for row in (c.GET_POSE, c.GET_ALARMS_STATE, c.GET_QUEUED_CMD_CURRENT_INDEX, c.GET_QUEUED_CMD_LEFT_SPACE):
        bench.ask(row)

    assert len(bench.session._parser._buffer) < 256
    assert len(bench.arm.state._registers) < 60 + 3 * 20 + 4
    assert len(bench.arm.executed) <= 50
    assert bench.arm.device.left_space <= capacity


def test_planning_ends_however_far_the_way_goes_outside_of_the_reach(monkeypatch: pytest.MonkeyPatch) -> None:
    checked = []
    check = Kinematics.check

    def counted(kinematics: Kinematics, x: float, y: float, z: float, r: float) -> Any:
        checked.append((x, y, z, r))
        return check(kinematics, x, y, z, r)

    monkeypatch.setattr(Kinematics, "check", counted)
    bench = Bench()
    bench.ask(c.RESET_POSE, c.ResetPose(manual=True, rear_arm_angle=100, front_arm_angle=45))
    bench.ask(c.SET_PTP_JUMP_PARAMS, c.PTPJumpParams(-1e6, 1e6))
    bench.move(c.PTPMode.JUMP_XYZ, 200, 0, 0)
    assert bench.outcomes[-1] == (c.SET_PTP_CMD, "alarm")
    assert 100 < len(checked) < 5000


def test_programs_do_not_grow_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dobot_async.simulator.magician.body.PROGRAM_LINES", 3)
    bench = Bench()
    bench.ask(c.SET_QUEUED_CMD_START_DOWNLOAD, c.QueuedCmdStartDownload(1, 9))
    for _ in range(3):
        bench.put(c.SET_WAIT_CMD, c.WAITCmd(0))

    assert bench.send(Frame(110, WRITE | QUEUED, bytes(4))) is None
    assert bench.arm.counters.overflowed == 1


@given(chunks.map(lambda script: b"".join(data for data, _ in script)), st.data())
@settings(max_examples=examples(50), deadline=None)
def test_bytes_may_be_cut_anywhere(stream: bytes, data: st.DataObject) -> None:
    whole, cut = Bench(), Bench()
    answered = b""
    rest = stream
    while rest:
        size = data.draw(st.integers(1, len(rest)))
        answered += cut.session.receive(rest[:size])
        rest = rest[size:]

    assert answered == whole.session.receive(stream)
    assert cut.arm.counters == whole.arm.counters


LOOKS: list[Callable[[Bench], Any]] = [
    lambda bench: bench.ask(c.GET_POSE),
    lambda bench: bench.ask(c.GET_QUEUED_CMD_CURRENT_INDEX),
    lambda bench: bench.arm.laser,
    lambda bench: bench.arm.executed,
]


@given(st.lists(st.tuples(st.floats(0, 12), st.sampled_from(LOOKS)), max_size=12))
@settings(max_examples=examples(50), deadline=None)
def test_watching_changes_nothing(looks: list[tuple[float, Callable[[Bench], Any]]]) -> None:
    watched, alone = Bench(), Bench()
    for bench in (watched, alone):
        for value in ring(20)[:10]:
            bench.put(c.SET_CPLE_CMD, c.CPLECmd(value.cp_mode, value.x, value.y, value.z, 50))

        outputs = (c.ParallelOutputCmd(50, 3, 1),)
        bench.put(c.SET_PTPPO_CMD, c.PTPPOCmd(c.PTPMode.JUMP_XYZ, 200, 0, 0, 0, outputs))
        bench.put(c.SET_HOME_CMD, c.HOMECmd())

    for when, look in sorted(looks, key=lambda item: item[0]):
        watched.now = when
        look(watched)

    watched.now = alone.now = 30.0
    assert watched.arm.executed == alone.arm.executed
    assert watched.arm.pose == alone.arm.pose


@pytest.mark.full
def test_ten_thousand_points() -> None:
    bench = Bench()
    bench.move(c.PTPMode.MOVJ_XYZ, 260, 0, 0)
    for value in ring(10_000):
        frame = request(c.SET_CP_CMD, c.SET_CP_CMD.request.encode(value), queued=True)
        while bench.send(frame) is None:
            bench.after(0.01)

    bench.after(100)
    assert len(bench.arm.executed) == 10_002
    assert bench.ask(c.GET_QUEUED_CMD_CURRENT_INDEX) == 10_003
    assert bench.faults == set()
