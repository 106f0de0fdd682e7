"""The simulated ultraArm: its answers to the byte, its motion in time, its queue, and how firmware differs."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dobot_async.arms.ultraarm import commands as c
from dobot_async.arms.ultraarm.frame import Parser, encode
from dobot_async.simulator import DeviceOptions, SimulatedUltraArm, UltraArmQuirks, simulate
from dobot_async.simulator.device.work import DeviceFault
from dobot_async.simulator.ultraarm.kinematics import REACH, forward, inverse

PLAIN = UltraArmQuirks(acknowledge="ok")


class Bench:
    """An arm, a clock, and one client."""

    def __init__(self, quirks: UltraArmQuirks = PLAIN, capacity: int = 100, *, homed: bool = True) -> None:
        self.now = 0.0
        options = DeviceOptions(capacity, False, 1, 0, power_up_alarms=frozenset())
        self.arm = SimulatedUltraArm(lambda: self.now, options, quirks, homed=homed)
        self.session = self.arm.session()

    def __call__(self, text: str) -> str:
        return self.session.receive(text.encode()).decode()


def test_the_manuals_answers() -> None:
    bench = Bench()
    assert bench("M12\r") == "DATA: ANGLES[0.00 ,0.00 ,0.00 ,0.00]\r\n"
    assert bench("M114\r") == "DATA : COORDS[235.55 ,0.00 ,130.00 ,0.00]\r\n"
    assert bench("M119\r") == "DATA : ENDSTOP[1 ,1 ,1]\r\n"
    assert bench("G28\r") == "DATA: [ok]\r\n"


def test_answers_without_blanks() -> None:
    bench = Bench(UltraArmQuirks(blanks=False))
    assert bench("M12\r") == "ANGLES[0.00,0.00,0.00,0.00]\r\n"
    assert bench("M119\r") == "ENDSTOP[1, 1, 1]\r\n"


@pytest.mark.parametrize(("acknowledge", "answer"), [("ok", "ok\r\n"), ("size", "QUEUE SIZE[0]\r\n"), ("nothing", "")])
def test_acknowledgements(acknowledge: str, answer: str) -> None:
    assert Bench(UltraArmQuirks(acknowledge=acknowledge))("M23\r") == answer  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "line", ["G0 X200 Y0 Z40 F100\r", "g0x200y0z40f100\r", "G00 F100 Z40 Y0 X200 \r\n", "G 0X2 00Y0Z40F100\r"]
)
def test_blanks_case_and_zeros_count_for_nothing(line: str) -> None:
    bench = Bench()
    assert bench(line) == "ok\r\n"
    bench.now = 10
    assert bench.arm.executed[0].value == c.CoordsMove(200, 0, 40, f=100)


@pytest.mark.parametrize(
    "line", ["G2 X5", "G4 S0.5", "M30", "M99", "hello", "G0 Q5", "M10 J5 A0", "M21 P256", "M25 A50", "Ü", "G0 X1e-07"]
)
def test_what_it_does_not_know(line: str) -> None:
    bench = Bench()
    answer = bench(f"{line}\r")
    if line == "G0 X1e-07":
        # What a library sends that writes numbers with exponents: the arm reads another axis.
        bench.now = 10
        assert bench.arm.executed[0].value == c.CoordsMove(x=1, e=-7)
    else:
        assert answer == "ERROR: COMMAND NOT RECOGNIZED\r\n"
        assert bench.arm.counters.unknown == 1
        assert bench.arm.executed == []


def test_the_oldest_firmware_tells_no_queue_size() -> None:
    bench = Bench(UltraArmQuirks(later=False))
    assert bench("M120\r") == bench("M9\r") == "ERROR: COMMAND NOT RECOGNIZED\r\n"


@given(st.data())
def test_lines_cut_anywhere_are_the_same(data: st.DataObject) -> None:
    stream = b"G0 X200 Y0 Z40 F100\rM120\r\r\nM12\rm21p7\r"
    whole, pieces = Bench(), Bench()
    answers = b""
    rest = stream
    while rest:
        size = data.draw(st.integers(1, len(rest)))
        answers += pieces.session.receive(rest[:size])
        rest = rest[size:]

    assert answers == whole.session.receive(stream)


def test_motion_takes_its_time() -> None:
    bench = Bench()
    bench("G0 Z30 F50\r")
    assert bench("M9\rM120\r") == "Moving\r\nQUEUE SIZE[0]\r\n"
    bench.now = 1.0
    halfway = bench.arm.pose
    assert 30 < halfway.z < 130
    bench.now = 2.0
    assert bench.arm.device.moving
    bench.now = 2.2
    assert bench("M9\r") == "Moving end\r\n"
    assert bench.arm.pose.z == pytest.approx(30)
    assert bench.arm.executed[0].finished == pytest.approx(2.125)  # 100 mm at 50 mm/s, with ramps of 400 mm/s²


def test_the_queue_is_counted_and_bounded() -> None:
    bench = Bench(capacity=3)
    sizes = [bench(f"G0 X{200 + step} F10\rM120\r") for step in range(5)]
    assert sizes[:4] == [f"ok\r\nQUEUE SIZE[{size}]\r\n" for size in range(4)]
    assert sizes[4] == "QUEUE SIZE[3]\r\n"
    assert bench.arm.counters.overflowed == 1
    bench.now = 1000
    assert [each.value.x for each in bench.arm.executed] == [200, 201, 202, 203]


def test_modes_speeds_and_origins_are_remembered() -> None:
    bench = Bench()
    bench("G0 X200 Y0 Z40 F100\rG91\rG0 Z5\rG90\rG0 Z50\r")
    bench.now = 60
    assert [bench.arm.registers.speed, bench.arm.pose.z] == [100, pytest.approx(50)]
    bench("G92 X0 Y0 Z0\r")
    assert bench("M114\r") == "DATA : COORDS[0.00 ,0.00 ,0.00 ,0.00]\r\n"
    bench("G0 X10\r")
    bench.now = 120
    assert bench.arm.pose.x == pytest.approx(10)
    bench("G28\r")
    bench.now = 180
    assert bench.arm.pose == c.UltraArmCoords(235.55, 0, 130, 0)
    assert bench.arm.registers.homed


def test_what_leads_nowhere_is_not_told() -> None:
    bench = Bench()
    assert bench("G0 X10 Y0 Z0\rM11 X0 Y0 Z111\r") == "ok\r\nok\r\n"
    bench("M17\rM10 J1 A50\r")
    bench.now = 10
    assert bench.arm.missed == 3
    assert bench.arm.angles == c.UltraArmAngles(0, 0, 0, 0)


@pytest.mark.parametrize(
    ("quirks", "left"), [(PLAIN, 2), (UltraArmQuirks(jog_stop="all"), 0)], ids=["jogs alone", "all"]
)
def test_what_m15_ends(quirks: UltraArmQuirks, left: int) -> None:
    bench = Bench(quirks)
    bench("G0 X200 F10\rG0 X210\rG0 X220\r")
    bench.now = 1
    bench("M15\r")
    assert bench.arm.queue_size == left
    assert bench.arm.device.moving == bool(left)


@pytest.mark.parametrize(("release", "left"), [("now", 0), ("queued", 3)])
def test_when_m17_releases(release: str, left: int) -> None:
    bench = Bench(UltraArmQuirks(release=release))  # type: ignore[arg-type]
    bench("G0 X200 F10\rG0 X210\rG0 X220\r")
    bench.now = 1
    bench("M17\r")
    assert bench.arm.queue_size == left
    assert bench.arm.registers.powered == bool(left)
    bench.now = 1000
    assert not bench.arm.registers.powered
    bench("M18\rG0 X230\r")
    bench.now = 2000
    assert bench.arm.missed == 1, "it does not know where it is"
    bench("G28\rG0 X230\r")
    bench.now = 3000
    assert bench.arm.pose.x == pytest.approx(230)


@pytest.mark.parametrize(
    ("line", "moved"),
    [
        ("M13 J1 D0 F10", lambda a: a.j1 > 9),
        ("M13 J1 D1 F10", lambda a: a.j1 < -9),
        ("M13 J2 D0 F10", lambda a: a.j2 > 9),
        ("M13 J3 D1 F10", lambda a: a.j3 == -5),
    ],
)
def test_joint_jogs(line: str, moved: Callable[[c.UltraArmAngles], bool]) -> None:
    bench = Bench()
    bench(f"{line}\r")
    bench.now = 1
    bench("M15\r")
    here = bench.arm.angles
    assert moved(here)
    bench.now = 2
    assert bench.arm.angles == here
    bench(f"{line}\r")
    bench.now = 1000
    assert -150 <= bench.arm.angles.j1 <= 170, "a jog ends at the limit"
    assert not bench.arm.device.moving


@pytest.mark.parametrize(("line", "axis", "sign"), [("M14 J3 D1", 2, -1), ("M14 J2 D0", 1, 1), ("M14 J1 D1", 0, -1)])
def test_tool_jogs_are_straight(line: str, axis: int, sign: int) -> None:
    bench = Bench()
    bench("M11 X10 Y20 Z30 F200\r")
    bench.now = 10
    start = forward(bench.arm.device.joints)
    bench(f"{line} F20\r")
    for tenth in range(1, 15):
        bench.now = 10 + tenth / 10
        here = forward(bench.arm.device.joints)
        assert math.dist(here[:3], start[:3]) == pytest.approx(sign * (here[axis] - start[axis]), abs=0.05)

    assert sign * (here[axis] - start[axis]) == pytest.approx(20 * 1.4, abs=1)
    bench.now = 1000
    assert not bench.arm.device.moving


def test_a_dwell() -> None:
    for quirks, word in [(PLAIN, "Moving"), (UltraArmQuirks(acknowledge="ok", dwell_rests=True), "Moving end")]:
        bench = Bench(quirks)
        assert bench("G4 S2\rM23\rM9\rM120\r") == f"ok\r\nok\r\n{word}\r\nQUEUE SIZE[1]\r\n"
        bench.now = 2
        assert bench.arm.registers.pump


def test_readings_of_later_firmware() -> None:
    bench = Bench()
    assert (
        bench("G6\rG7\rM32\rM31\r") == "GetSystemVersion[1.2]\r\nGetModifyVersion[3]\r\nJ1CAL[12]\r\nQUEUE SIZE[0]\r\n"
    )
    bench("M25 A60 F200 M1 T1\rM29 T1 L30\rM51 X7 Y56 Z2048 P2 \r")
    bench.now = 0.3
    assert bench("M50\r") == "GRIPPERANGLE[30]\r\n", "it takes its time, and M50 needs no T"
    bench.now = 1.0
    answers = "GRIPPERANGLE[60]\r\nGetGripperPosition[60,30]\r\nReadSYS[2048]\r\n"
    assert bench("M50 T1\rM30 T1\rM52 J7 S56 P2 \r") == answers
    bench("M17\r")
    assert bench("M31\r") == "ERROR: J1 cal failed\r\n"


def test_power_and_hands() -> None:
    bench = Bench()
    bench("G0 X200 F100\rM23\rG91\r")
    with pytest.raises(RuntimeError, match="moves"):
        bench.arm.guide_to(0, 0, 0, 0)

    bench.now = 1
    bench.arm.power_cycle()
    assert not bench.arm.registers.relative
    assert bench.arm.queue_size == 0
    bench.arm.guide_to(10, 20, 30, 0)
    assert bench.arm.angles == c.UltraArmAngles(10, 20, 30, 0)
    assert bench("M12\r") == "DATA: ANGLES[0.00 ,0.00 ,0.00 ,0.00]\r\n", "it does not know where it is"
    assert bench("M119\r") == "DATA : ENDSTOP[0 ,0 ,0]\r\n"


@pytest.mark.parametrize("forgets", ["switched on", "M17", "power cycle"])
@pytest.mark.parametrize("line", ["G0 X200", "G1 X200", "M10 J1 A5", "M11 X5 Y5 Z5", "M13 J1 D0 F10", "M14 J3 D1 F10"])
def test_nothing_moves_it_until_it_was_home(line: str, forgets: str) -> None:
    bench = Bench(homed=forgets != "switched on")
    if forgets == "M17":
        bench("M11 X10 Y10 Z10 F200\r")
        bench.now = 10
        bench("M17\r")
        assert bench("M12\r") == "DATA: ANGLES[10.00 ,10.00 ,10.00 ,0.00]\r\n"
        bench.arm.guide_to(30, 30, 30, 0)
        bench("M18\r")
        assert bench("M12\r") == "DATA: ANGLES[10.00 ,10.00 ,10.00 ,0.00]\r\n", "its motors sense nothing"
    elif forgets == "power cycle":
        bench.arm.power_cycle()

    before = bench.arm.angles
    assert bench(f"{line}\r") == "ok\r\n", "of which it says nothing"
    bench.now = 20
    bench("M15\r")
    assert bench.arm.angles == before
    assert bench.arm.missed == 1
    bench("G28\r")
    bench.now = 40
    assert bench.arm.registers.homed
    bench(f"{line}\r")
    bench.now = 41
    bench("M15\r")
    assert bench.arm.angles != before
    assert bench.arm.missed == 1


@pytest.mark.parametrize("word", ["G0", "G1"])
def test_motions_of_the_tool_are_straight(word: str) -> None:
    bench = Bench()
    bench("G0 X200 Y-150 Z40 F200\r")
    bench.now = 10
    bench(f"{word} X200 Y150 Z40\r")
    for step in range(30):
        bench.now = 10 + step / 10
        assert bench.arm.pose.x == pytest.approx(200)
        assert bench.arm.pose.z == pytest.approx(40)

    assert bench.arm.pose.y == pytest.approx(150)
    bench("G0 X-200 Y0\r")  # through the base
    bench.now = 30
    assert bench.arm.missed == 1
    assert bench.arm.pose.y == pytest.approx(150)


@given(st.floats(*REACH.j1), st.floats(*REACH.j2), st.floats(*REACH.j3))
def test_joints_and_points_belong_together(j1: float, j2: float, j3: float) -> None:
    point = forward((j1, j2, j3, 5.0))
    try:
        joints = inverse(point)
    except DeviceFault:
        return  # a posture that a point is not reached in

    assert forward(joints) == pytest.approx(point, abs=1e-6)


def test_the_geometry_is_the_librarys_ranges() -> None:
    assert forward((0, 0, 0, 0)) == pytest.approx((235.55, 0, 130, 0))
    assert forward((0, 90, 0, 0))[0] == pytest.approx(365.55)
    with pytest.raises(DeviceFault):
        inverse((10, 0, 0, 0))


@given(st.binary(max_size=200))
def test_any_bytes_are_answered_with_text(data: bytes) -> None:
    bench = Bench()
    bench.session.receive(data).decode("ascii")
    bench.now = 1
    assert bench("\rM120\r").endswith("]\r\n")


def test_each_row_is_understood_as_it_is_sent() -> None:
    values = {
        c.WAIT: c.Dwell(0),
        c.MOVE_COORDS: c.CoordsMove(200, f=100),
        c.MOVE_BY: c.CoordsMove(z=-5),
        c.MOVE_LINE: c.CoordsMove(200, f=100),
        c.SET_POSITION: c.Position(0),
        c.MOVE_JOINT: c.JointMove(1, 5),
        c.MOVE_JOINTS: c.JointsMove(1, 2, 3),
        c.JOG_JOINT: c.JogMove(1, c.JogDirection.POSITIVE),
        c.JOG_COORD: c.JogMove(1, c.JogDirection.POSITIVE),
        c.SET_SPEED_MODE: c.ModeOfSpeed(c.SpeedMode.RAMPED),
        c.SET_PWM: c.PWM(1),
        c.SET_GRIPPER_ZERO: c.GripperZero(),
        c.SET_GRIPPER: c.GripperSet(1, 1),
        c.SET_GRIPPER_CLOSE_POSITION: c.GripperClosePosition(c.GripperMode.ADAPTIVE, 5),
        c.GET_GRIPPER_POSITION: c.ModeOfGripper(c.GripperMode.ADAPTIVE),
        c.GET_GRIPPER_ANGLE: c.ModeOfGripper(c.GripperMode.ADAPTIVE),
        c.SET_SERVO_REGISTER: c.ServoValue(7, 56, 1),
        c.GET_SERVO_REGISTER: c.ServoRegister(7, 56),
    }
    for row in c.ALL:
        bench = Bench()
        frame = encode(row, row.request.encode(values.get(row)), queued=False)
        (answer,) = Parser().feed(bench.session.receive(bytes(frame)))
        row.reply.decode(answer.params)
        assert bench.arm.counters.unknown == 0, row


async def test_it_is_one_of_the_models() -> None:
    async with simulate("ultraarm") as sim:
        assert isinstance(sim.arm, SimulatedUltraArm)
