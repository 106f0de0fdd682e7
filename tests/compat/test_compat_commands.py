"""What each old name does to the arm: what it was told, and what it tells."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from typing import Any

import pytest

from dobot_async import DobotError
from dobot_async.arms.magician import commands as c
from dobot_async.compat import DobotDllType as dType
from dobot_async.compat import dobotlab, pydobot, pydobotplus
from dobot_async.simulator import SimulatedMagician, Simulation, simulate

Sim = Simulation[SimulatedMagician]
EIGHT = (11, 12, 13, 14, 15, 16, 17, 18)
PAIRS: list[tuple[str, tuple[Any, ...], str, tuple[Any, ...], list[Any]]] = [
    ("SetHOMEParams", (210, 1, 41, 2), "GetHOMEParams", (), [210, 1, 41, 2]),
    ("SetJOGJointParams", EIGHT, "GetJOGJointParams", (), list(EIGHT)),
    ("SetJOGCoordinateParams", EIGHT, "GetJOGCoordinateParams", (), list(EIGHT)),
    ("SetJOGLParams", (30, 40), "GetJOGLParams", (), [30, 40]),
    ("SetJOGCommonParams", (30, 40), "GetJOGCommonParams", (), [30, 40]),
    ("SetPTPJointParams", EIGHT, "GetPTPJointParams", (), list(EIGHT)),
    ("SetPTPCoordinateParams", (11, 12, 13, 14), "GetPTPCoordinateParams", (), [11, 13, 12, 14]),
    ("SetPTPLParams", (30, 40), "GetPTPLParams", (), [30, 40]),
    ("SetPTPJumpParams", (20, 100), "GetPTPJumpParams", (), [20, 100]),
    ("SetPTPCommonParams", (30, 40), "GetPTPCommonParams", (), [30, 40]),
    ("SetCPParams", (30, 40, 50), "GetCPParams", (), [30, 40, 50, False]),
    ("SetARCParams", (11, 12, 13, 14), "GetARCParams", (), [11, 12, 13, 14]),
    ("SetARCCommonParams", (30, 40), "GetARCCommonParams", (), [30, 40]),
    ("SetEndEffectorParams", (61, 1, 2), "GetEndEffectorParams", (), [61, 1, 2]),
    ("SetEndEffectorLaser", (1, 1), "GetEndEffectorLaser", (), [True, True]),
    ("SetEndEffectorSuctionCup", (1, 1), "GetEndEffectorSuctionCup", (), [True]),
    ("SetEndEffectorGripper", (1, 1), "GetEndEffectorGripper", (), [True]),
    ("SetIOMultiplexing", (5, 1), "GetIOMultiplexing", (5,), [1]),
    ("SetDeviceWithL", (1, 1), "GetDeviceWithL", (), [True]),
    ("SetArmSpeedRatio", (1, 35), "GetArmSpeedRatio", (1,), [35]),
    ("SetArmSpeedRatio", (0, 45), "GetArmSpeedRatio", (0,), [45]),
]
"""A function that sets, with its arguments; one that gets; and what that returns, in the vendor's order."""

SETTINGS: list[tuple[str, tuple[Any, ...], str, list[Any]]] = [
    ("SetDeviceName", ("arm one",), "GetDeviceName", ["arm one"]),
    ("SetHHTTrigMode", (1,), "GetHHTTrigMode", [1]),
    ("SetHHTTrigOutputEnabled", (1,), "GetHHTTrigOutputEnabled", [True]),
    ("SetCPRHoldEnable", (1,), "GetCPRHoldEnable", [True]),
    ("SetWIFIConfigMode", (1,), "GetWIFIConfigMode", [True]),
    ("SetWIFISSID", ("net",), "GetWIFISSID", ["net"]),
    ("SetWIFIPassword", ("secret",), "GetWIFIPassword", ["secret"]),
    ("SetWIFIIPAddress", (0, 192, 168, 1, 20), "GetWIFIIPAddress", [0, 192, 168, 1, 20]),
    ("SetWIFINetmask", (255, 255, 255, 0), "GetWIFINetmask", [255, 255, 255, 0]),
    ("SetWIFIGateway", (192, 168, 1, 1), "GetWIFIGateway", [192, 168, 1, 1]),
    ("SetWIFIDNS", (192, 168, 1, 2), "GetWIFIDNS", [192, 168, 1, 2]),
]
READS: dict[str, type | tuple[type, ...]] = {
    "GetDeviceSN": str,
    "GetDeviceVersion": int,
    "GetDeviceTime": int,
    "GetDeviceID": int,
    "GetDeviceInfo": int,
    "GetPose": float,
    "GetPoseL": float,
    "GetKinematics": float,
    "GetUserParams": float,
    "GetAutoLevelingResult": float,
    "GetHHTTrigOutput": (bool, int),
    "GetAngleSensorStaticError": float,
    "GetAngleSensorCoef": float,
    "GetBaseDecoderStaticError": float,
    "GetWIFIConnectStatus": (bool, int),
    "GetColorSensor": int,
}


async def with_arm(program: Callable[[str], Any], prepare: Callable[[Sim], Any] | None = None) -> Sim:
    """Run a blocking program in a thread, with the URL of a simulated arm."""
    async with simulate(listen="tcp://127.0.0.1:0", speed=100, homed=True) as sim:
        if prepare:
            prepare(sim)

        await asyncio.to_thread(program, sim.url)
        sim.arm.device.advance()
        return sim


def told(sim: Sim, row: object) -> list[Any]:
    """What the arm was told in commands of a kind."""
    return [each.value for each in sim.arm.executed if each.command is row]


@pytest.fixture
def dll() -> Callable[[Callable[[dType.Api], Any]], Callable[[str], None]]:
    """Makes a program of a function that is given the connected library."""

    def made(body: Callable[[dType.Api], Any]) -> Callable[[str], None]:
        def program(url: str) -> None:
            api = dType.load()
            assert dType.ConnectDobot(api, url, 115200)[0] == 0
            try:
                body(api)
            finally:
                dType.DisconnectDobot(api)

        return program

    return made


async def test_what_the_dll_sets_it_gets_queued_and_at_once(dll: Any) -> None:
    def body(api: dType.Api) -> None:
        for setter, arguments, getter, asked, expected in PAIRS:
            assert getattr(dType, setter)(api, *arguments, isQueued=0) == [0]
            assert getattr(dType, getter)(api, *asked) == pytest.approx(expected), setter

        for setter, arguments, getter, asked, expected in PAIRS:
            (index,) = getattr(dType, setter)(api, *arguments, isQueued=1)
            while index > dType.GetQueuedCmdCurrentIndex(api)[0]:
                pass

            assert getattr(dType, getter)(api, *asked) == pytest.approx(expected), setter

        for setter, arguments, getter, expected in SETTINGS:
            assert getattr(dType, setter)(api, *arguments) is None
            assert getattr(dType, getter)(api) == expected, setter

    await with_arm(dll(body))


@pytest.mark.parametrize("name", READS)
async def test_what_the_dll_reads_is_a_list(name: str, dll: Any) -> None:
    def body(api: dType.Api) -> None:
        found = getattr(dType, name)(api)
        assert isinstance(found, list)
        assert found
        assert all(isinstance(each, READS[name]) for each in found)

    await with_arm(dll(body))


async def test_the_motions_of_the_dll(dll: Any) -> None:
    def body(api: dType.Api) -> None:
        dType.SetDeviceWithL(api, 1)
        dType.SetHOMECmd(api, 0, isQueued=1)
        dType.SetPTPCmd(api, 2, 220, 0, 40, 5, isQueued=1)
        dType.SetPTPWithLCmd(api, 1, 220, 10, 40, 0, 100, isQueued=1)
        dType.SetARCCmd(api, [230, 20, 40, 0], [220, 30, 40, 0], isQueued=1)
        dType.SetCircleCmd(api, [230, 20, 40, 0], [220, 10, 40, 0], isQueued=1)
        dType.SetCPCmd(api, 1, 225, 30, 40, 100, isQueued=1)
        dType.SetCPLECmd(api, 0, 1, 1, 0, 50, isQueued=1)
        dType.SetLostStepCmd(api, isQueued=1)
        with pytest.raises(ValueError, match="cirPoint"):
            dType.SetARCCmd(api, [230, 20, 40], [220, 30, 40, 0], isQueued=1)

        with pytest.raises(ValueError, match="10"):
            dType.SetPTPCmd(api, 10, 220, 0, 40, 0)

    sim = await with_arm(dll(body))
    assert told(sim, c.SET_PTP_CMD) == [c.PTPCmd(c.PTPMode.MOVL_XYZ, 220, 0, 40, 5)]
    assert told(sim, c.SET_PTP_WITH_L_CMD) == [c.PTPWithLCmd(c.PTPMode.MOVJ_XYZ, 220, 10, 40, 0, 100)]
    assert told(sim, c.SET_ARC_CMD) == [c.ARCCmd(c.ARCPoint(230, 20, 40), c.ARCPoint(220, 30, 40))]
    assert told(sim, c.SET_CIRCLE_CMD) == [c.CircleCmd(c.ARCPoint(230, 20, 40), c.ARCPoint(220, 10, 40))]
    assert told(sim, c.SET_CP_CMD) == [c.CPCmd(c.CPMode.ABSOLUTE, 225, 30, 40, 100)]
    assert told(sim, c.SET_CPLE_CMD) == [c.CPLECmd(c.CPMode.RELATIVE, 1, 1, 0, 50)]
    assert len(told(sim, c.SET_HOME_CMD)) == len(told(sim, c.SET_LOST_STEP_CMD)) == 1


async def test_the_functions_of_the_dll_that_wait(dll: Any) -> None:
    """Each has been executed when it returns."""

    def body(api: dType.Api) -> None:
        def done() -> bool:
            return dType.GetQueuedCmdMotionFinish(api)[0]

        dType.SetDeviceWithL(api, 1)
        for call, arguments in (
            (dType.SetHOMECmdEx, (0, 1)),
            (dType.SetEndEffectorParamsEx, (59.7, 0, 0, 1)),
            (dType.SetPTPJointParamsEx, (200,) * 8),
            (dType.SetPTPCoordinateParamsEx, (200, 200, 200, 200)),
            (dType.SetPTPLParamsEx, (200, 200)),
            (dType.SetPTPCommonParamsEx, (80, 80)),
            (dType.SetPTPJumpParamsEx, (20, 100)),
            (dType.SetPTPCmdEx, (1, 220, 0, 40, 0, 1)),
            (dType.SetPTPWithLCmdEx, (1, 220, 0, 40, 0, 30, 1)),
            (dType.SetARCCmdEx, ([230, 20, 40, 0], [220, 30, 40, 0])),
            (dType.SetWAITCmdEx, (200, 1)),
            (dType.SetIOMultiplexingEx, (5, 1)),
            (dType.SetIODOEx, (5, 1)),
            (dType.SetIOMultiplexingEx, (6, 3)),
            (dType.SetTRIGCmdEx, (6, 0, 0, 0)),
            (dType.SetIOMultiplexingEx, (7, 2)),
            (dType.SetIOPWMEx, (7, 1000, 50)),
            (dType.SetEndEffectorSuctionCupEx, (1, 1)),
            (dType.SetEndEffectorGripperEx, (1, 1)),
            (dType.SetEndEffectorLaserEx, (1, 40)),
            (dType.SetEMotorEx, (0, 1, 100)),
            (dType.SetEMotorSEx, (1, 1, 1000, 100)),
            (dType.SetLostStepCmdEx, ()),
        ):
            call(api, *arguments)
            assert done(), call

        assert dType.GetPoseEx(api, 3) == 40
        assert dType.GetPoseEx(api, 0) == 30
        assert dType.GetIODO(api, 5) == [1]
        assert dType.GetIOPWM(api, 4) == [10_000, 40]
        assert dType.GetColorSensorEx(api, 0) == 0

    sim = await with_arm(dll(body))
    assert told(sim, c.SET_E_MOTOR_S) == [c.EMotorS(1, is_enabled=True, speed=1000, distance=100)]


async def test_pins_and_sensors_of_the_dll(dll: Any) -> None:
    def prepare(sim: Sim) -> None:
        sim.arm.set_input(4, 1)
        sim.arm.set_adc(5, 1234)

    def body(api: dType.Api) -> None:
        with pytest.raises(ValueError, match="pin 4 is not configured"):
            dType.GetIODI(api, 4)

        dType.SetIOMultiplexing(api, 4, dType.GPIOType.GPIOTypeDI)
        dType.SetIOMultiplexing(api, 5, dType.GPIOType.GPIOTypeADC)
        assert dType.GetIODI(api, 4) == [1]
        assert dType.GetIOADC(api, 5) == [1234]
        with pytest.raises(ValueError, match="pin 4 is not configured"):
            dType.SetIODO(api, 4, 1)

        dType.SetColorSensor(api, 1, dType.ColorPort.PORT_GP4, 1)
        dType.SetInfraredSensor(api, 1, dType.InfraredPort.PORT_GP5, 1)
        assert dType.GetInfraredSensor(api, dType.InfraredPort.PORT_GP5) == [0]
        dType.SetJOGCmd(api, 1, dType.JC.JogAPPressed)
        dType.SetJOGCmd(api, 0, dType.JC.JogIdle)

    sim = await with_arm(dll(body), prepare)
    assert told(sim, c.SET_COLOR_SENSOR) == [c.ColorSensor(True, c.ColorPort.GP4, c.AccessoryVersion.V2)]
    assert told(sim, c.SET_INFRARED_SENSOR) == [c.InfraredSensor(True, c.InfraredPort.GP5, c.AccessoryVersion.V2)]
    assert told(sim, c.SET_JOG_CMD) == [c.JOGCmd(True, c.JOGKey.AP_DOWN)]


async def test_pydobot_moves_in_straight_lines_and_sets_what_it_does_at_connect() -> None:
    def program(url: str) -> None:
        device = pydobot.Dobot(port=url, verbose=True)
        device.move_to(220, 0, 40, 0)
        device.move_to(220, 10, 40, 0, wait=True)
        device._set_ptp_cmd(0, 30, 40, 0, mode=pydobot.PTPMode.MOVJ_ANGLE, wait=True)
        device._set_ptp_cmd(mode=1, x=220, y=0, z=40)
        device._set_cp_cmd(225, 0, 40)
        with pytest.warns(DeprecationWarning, match="move_to"):
            device.go(220, 20, 40)

        device.speed(40, 60)
        device.suck(True)
        device.grip(True)
        device.wait(20)
        device.set_eio(3, 1)
        assert device.get_eio(3) == 1
        pose = device.pose()
        assert pose[:4] == pytest.approx((220, 20, 40, 0), abs=0.01)
        assert device.get_pose().joints.in_radians()[0] == pytest.approx(0.0907, abs=0.001)
        device.close()

    sim = await with_arm(program)
    modes = [value.ptp_mode.name for value in told(sim, c.SET_PTP_CMD)]
    assert modes == ["MOVL_XYZ", "MOVL_XYZ", "MOVJ_ANGLE", "MOVJ_XYZ", "MOVL_XYZ"]
    assert told(sim, c.SET_PTP_JOINT_PARAMS) == [c.PTPJointParams((200,) * 4, (200,) * 4)]
    assert told(sim, c.SET_PTP_JUMP_PARAMS) == [c.PTPJumpParams(10, 200)]
    assert told(sim, c.SET_PTP_COMMON_PARAMS) == [c.PTPCommonParams(100, 100), c.PTPCommonParams(40, 60)]
    assert told(sim, c.SET_PTP_COORDINATE_PARAMS)[1] == c.PTPCoordinateParams(40, 40, 60, 60)


async def test_pydobotplus_goes_where_it_is_told_and_keeps_what_is_not_given() -> None:
    def program(url: str) -> None:
        device = pydobotplus.Dobot(url)
        assert device.move_to(220, 0, 40) < device.move_to(z=60)
        assert device.get_pose().position == pytest.approx((220, 0, 60, 0), abs=0.01)
        device.move_to(position=pydobotplus.CustomPosition(z=50, y=10))
        device.move_rel(x=5, r=10)
        assert device.get_pose().position == pytest.approx((225, 10, 50, 10), abs=0.01)
        with pytest.raises(pydobotplus.DobotException, match="give x, y or z"):
            device.move_to()

        device.wait_for_cmd(device.go_arc(220, 30, 50, 0, 230, 20, 50, 0))
        device.set_home(210, 0, 50)
        device.wait_for_cmd(device.home())
        assert device.get_pose().position == pytest.approx((210, 0, 50, 0), abs=0.1)
        device.speed(50, 50)
        device.set_hht_trig_output(True)
        assert device.get_hht_trig_output()
        device.laze(100, enable=True)
        device.laze(0)
        device.close()

    sim = await with_arm(program)
    lasers = told(sim, c.SET_END_EFFECTOR_LASER)
    assert [laser.is_on for laser in lasers] == [True, False]


async def test_pydobotplus_has_its_belt_its_jogs_and_its_pins() -> None:
    def program(url: str) -> None:
        device = pydobotplus.Dobot(url)
        device.conveyor_belt(0.5, direction=-1, interface=1)
        device.wait_for_cmd(device.conveyor_belt_distance(50, 10))
        for wrong in (
            lambda: device.conveyor_belt(2),
            lambda: device.conveyor_belt_distance(200, 10),
            lambda: device.set_io(23, True),
            lambda: device._set_ptp_cmd(220, 0, 40, 0, mode=17),
        ):
            with pytest.raises(pydobotplus.DobotException) as caught:
                wrong()

            assert isinstance(caught.value, ValueError)

        device.jog_z(5)
        device.jog_z(0)
        device.jog_r(-5)
        device.jog_r(0)
        device.set_io(3, True)
        device.session.put(c.SET_IO_MULTIPLEXING, c.IOMultiplexing(4, c.IOFunction.DI))
        with pytest.raises(pydobotplus.DobotException, match="configured as DI"):
            device.set_io(4, True)

        device.set_ir(True, pydobotplus.Dobot.PORT_GP4)
        device.set_color(True, pydobotplus.Dobot.PORT_GP2)
        assert device.get_color() == [False, False, False]
        assert device.get_ir() is False
        device.close()

    sim = await with_arm(program)
    assert told(sim, c.SET_E_MOTOR)[0] == c.EMotor(1, True, -int(25 * 32000 / (36 * 3.1415926535898)))
    assert told(sim, c.SET_E_MOTOR_S)[0].distance == int(10 * 16000 / (34 * 3.1415926535898))
    assert [each.cmd for each in told(sim, c.SET_JOG_CMD)] == [c.JOGKey.CP_DOWN, c.JOGKey.DN_DOWN]
    assert told(sim, c.SET_IODO) == [c.IODO(3, 1)]


async def test_pydobotplus_clears_alarms_at_connect_and_names_those_that_it_meets(
    caplog: pytest.LogCaptureFixture,
) -> None:
    def program(url: str) -> None:
        device = pydobotplus.Dobot(url)
        assert device.get_alarms() == set()
        with pytest.raises(DobotError):
            device.move_to(900, 0, 0)

        (alarm,) = device.get_alarms()
        assert alarm == 0x11
        assert (alarm.name, alarm.value) == ("PLAN_INV_CALC", 0x11)
        assert "out of the workspace" in str(alarm)
        device.clear_alarms()
        assert not device.get_alarms()
        device.close()

    await with_arm(program, lambda sim: sim.arm.raise_alarm(0x40))
    assert "cleared" in caplog.text
    assert "LIMIT_AXIS1_POS" in caplog.text


async def test_pydobotplus_engraves_there_and_back() -> None:
    def program(url: str) -> None:
        device = pydobotplus.Dobot(url)
        device.move_to(220, 0, 40)
        device.engrave([[0, 255], [255, 127.5]], 2, low=0, high=40)
        device.close()

    sim = await with_arm(program)
    points = [(round(p.x), round(p.y), round(p.power)) for p in told(sim, c.SET_CPLE_CMD)]
    assert points == [(220, 0, 40), (220, 2, 0), (222, 2, 20), (222, 0, 0)]


async def test_dobotlab_does_each_thing_before_it_returns() -> None:
    def program(url: str) -> None:
        with dobotlab.Magician(url) as arm:
            assert arm.is_open
            assert arm.set_device_withl(enable=True, version=0)
            assert arm.set_home()
            assert arm.ptp(mode=1, x=220, y=0, z=40, r=0)
            assert arm.set_r(20)
            x, y, z, r, joints = pose = arm.get_pose()
            assert (x, y, z, r) == pytest.approx((220, 0, 40, 20), abs=0.01)
            assert (pose.x, pose["x"], pose[0], pose.get("x"), pose.get("w", 7)) == (x, x, x, x, 7)
            assert pose.joints == joints == pose["jointAngle"]
            with pytest.raises(KeyError, match="jointAngle"):
                pose["w"]

            assert arm.set_ptpl_params(50, 50)
            assert arm.set_ptpwithl_cmd(1, 220, 0, 40, 0, 60)
            assert arm.get_posel() == pytest.approx(60)
            assert arm.motion_params(50, 60)
            assert arm.get_arm_speed_ratio(mode=1) == 50
            assert arm.get_arm_speed_ratio(mode=0) > 0
            arm.motion_params = 30, 40
            arm.jump_params = 100, 20
            assert (arm.motion_params, arm.jump_params) == ((30, 40), (100, 20))
            for name, multiplex in (("DO_01", 1), ("DO_02", 2), ("DI_03", 3), (4, 4)):
                assert arm.set_multiplexing(io=name, multiplex=multiplex)

            assert arm.set_do("DO_01", 1)
            assert arm.set_pwm(io="DO_02", freq=1000, cycle=30)
            assert arm.get_di("DI_03") == 0
            assert arm.get_adc("DO_04") == 0
            for wrong in ("DO_21", "XX_01", 0):
                with pytest.raises(ValueError, match="DO_01"):
                    arm.set_do(wrong, 1)

            assert arm.set_endeffector_suctioncup(enable=True, on=True)
            assert arm.set_endeffector_gripper(enable=True, on=False)
            assert arm.set_endeffector_laser(enable=False, on=False)
            assert arm.set_infrared_sensor(port=4, enable=True, version=1)
            assert arm.get_infrared_sensor(port=4)["status"] == 0 == arm.get_infrared_sensor(4)
            assert arm.set_color_sensor(port=2, enable=True, version=1)
            assert arm.get_color_sensor() == (0, 0, 0)
            assert arm.get_color_sensor().get("red") == arm.get_color_sensor()["blue"] == 0
            with pytest.raises(ValueError, match="GP1"):
                arm.set_infrared_sensor(port=3, enable=True)

            assert arm.wait(second=0.5)
            assert arm.set_lost_step_params(5)
            assert arm.set_lost_step_cmd()
            assert arm.set_converyor(index=arm.Stepper2, enable=True, speed=-100.0)
            with pytest.raises(DobotError):
                arm.ptp(1, 900, 0, 0, 0)

            assert "PLAN_INV_CALC" in arm.get_lost_step_result()
            assert arm.set_home()  # from an alarm as well
            assert arm.clear_alarm()

        assert not arm.is_open

    sim = await with_arm(program)
    assert told(sim, c.SET_IODO) == [c.IODO(1, 1)]
    assert c.EMotor(1, True, -100) in told(sim, c.SET_E_MOTOR)
    assert c.WAITCmd(500) in told(sim, c.SET_WAIT_CMD)
    assert told(sim, c.SET_INFRARED_SENSOR) == [c.InfraredSensor(True, c.InfraredPort.GP4, c.AccessoryVersion.V2)]


async def test_magician_connects_when_it_is_first_used(monkeypatch: pytest.MonkeyPatch) -> None:
    def program(url: str) -> None:
        monkeypatch.setenv("DOBOT_URL", url)
        before = dobotlab.magician.is_open
        dobotlab.magician.ptp(1, 220, 0, 40, 0)
        assert (before, dobotlab.magician.is_open) == (False, True)
        dobotlab.magician.disconnect()
        dobotlab.magician.connect()
        assert dobotlab.magician.get_pose().x == pytest.approx(220, abs=0.01)
        dobotlab.magician.disconnect()

    await with_arm(program)


async def test_the_small_functions_of_the_dll_do_nothing_to_the_arm(dll: Any) -> None:
    def body(api: dType.Api) -> None:
        dType.PeriodicTask(api)
        dType.SetCmdTimeout(api, 3000)
        assert dType.DobotExec(api) == [0]
        dType.output("text")
        assert abs(dType.gettime()[0] - time.time()) < 60
        assert dType.GetAlarmsState(api)[1] == 16

    sim = await with_arm(dll(body))
    assert {each.value for each in sim.arm.executed} <= {c.WAITCmd(0)}
