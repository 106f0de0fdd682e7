"""The names, arguments and defaults are those of the libraries: what a program calls there it can call here."""

from __future__ import annotations

import inspect
from types import ModuleType
from typing import Any

import pytest

from dobot_async.compat import DobotDllType, dobotlab, pydobot, pydobotplus

PTP_JOINTS = " ".join(f"j{n}Velocity j{n}Acceleration" for n in range(1, 5))
JOG_AXES = " ".join(f"{axis}Velocity {axis}Acceleration" for axis in "xyzr")

DLL = {
    "load": "",
    "dSleep": "ms",
    "gettime": "",
    "SearchDobot": "api maxLen=1000",
    "ConnectDobot": "api portName baudrate",
    "DisconnectDobot": "api",
    "PeriodicTask": "api",
    "SetCmdTimeout": "api times",
    "DobotExec": "api",
    "GetQueuedCmdCurrentIndex": "api",
    "GetQueuedCmdLeftSpace": "api",
    "GetQueuedCmdMotionFinish": "api",
    "SetQueuedCmdStartExec": "api",
    "SetQueuedCmdStopExec": "api",
    "SetQueuedCmdForceStopExec": "api",
    "SetQueuedCmdClear": "api",
    "GetDeviceSN": "api",
    "SetDeviceName": "api str",
    "GetDeviceName": "api",
    "GetDeviceVersion": "api",
    "SetDeviceWithL": "api isWithL version=0 isQueued=0",
    "GetDeviceWithL": "api",
    "GetDeviceTime": "api",
    "GetDeviceID": "api",
    "GetDeviceInfo": "api",
    "ResetPose": "api manual rearArmAngle frontArmAngle",
    "GetPose": "api",
    "GetPoseL": "api",
    "GetKinematics": "api",
    "GetAlarmsState": "api maxLen=1000",
    "ClearAllAlarmsState": "api",
    "GetUserParams": "api",
    "SetHOMEParams": "api x y z r isQueued=0",
    "GetHOMEParams": "api",
    "SetHOMECmd": "api temp isQueued=0",
    "SetAutoLevelingCmd": "api controlFlag precision isQueued=0",
    "GetAutoLevelingResult": "api",
    "SetArmOrientation": "api armOrientation isQueued=0",
    "GetArmOrientation": "api",
    "SetHHTTrigMode": "api hhtTrigMode",
    "GetHHTTrigMode": "api",
    "SetHHTTrigOutputEnabled": "api isEnabled",
    "GetHHTTrigOutputEnabled": "api",
    "GetHHTTrigOutput": "api",
    "SetEndEffectorParams": "api xBias yBias zBias isQueued=0",
    "GetEndEffectorParams": "api",
    "SetEndEffectorLaser": "api enableCtrl on isQueued=0",
    "GetEndEffectorLaser": "api",
    "SetEndEffectorSuctionCup": "api enableCtrl on isQueued=0",
    "GetEndEffectorSuctionCup": "api",
    "SetEndEffectorGripper": "api enableCtrl on isQueued=0",
    "GetEndEffectorGripper": "api",
    "SetJOGJointParams": f"api {PTP_JOINTS} isQueued=0",
    "GetJOGJointParams": "api",
    "SetJOGCoordinateParams": f"api {JOG_AXES} isQueued=0",
    "GetJOGCoordinateParams": "api",
    "SetJOGLParams": "api velocity acceleration isQueued=0",
    "GetJOGLParams": "api",
    "SetJOGCommonParams": "api value_velocityratio value_accelerationratio isQueued=0",
    "GetJOGCommonParams": "api",
    "SetJOGCmd": "api isJoint cmd isQueued=0",
    "SetPTPJointParams": f"api {PTP_JOINTS} isQueued=0",
    "GetPTPJointParams": "api",
    "SetPTPCoordinateParams": "api xyzVelocity xyzAcceleration rVelocity rAcceleration isQueued=0",
    "GetPTPCoordinateParams": "api",
    "SetPTPLParams": "api velocity acceleration isQueued=0",
    "GetPTPLParams": "api",
    "SetPTPJumpParams": "api jumpHeight zLimit isQueued=0",
    "GetPTPJumpParams": "api",
    "SetPTPCommonParams": "api velocityRatio accelerationRatio isQueued=0",
    "GetPTPCommonParams": "api",
    "SetPTPCmd": "api ptpMode x y z rHead isQueued=0",
    "SetPTPWithLCmd": "api ptpMode x y z rHead l isQueued=0",
    "SetCPRHoldEnable": "api isEnable",
    "GetCPRHoldEnable": "api",
    "SetCPParams": "api planAcc juncitionVel acc realTimeTrack=0 isQueued=0",
    "GetCPParams": "api",
    "SetCPCmd": "api cpMode x y z velocity isQueued=0",
    "SetCPLECmd": "api cpMode x y z power isQueued=0",
    "SetARCParams": "api xyzVelocity rVelocity xyzAcceleration rAcceleration isQueued=0",
    "GetARCParams": "api",
    "SetARCCmd": "api cirPoint toPoint isQueued=0",
    "SetCircleCmd": "api cirPoint toPoint isQueued=0",
    "SetARCCommonParams": "api velocityRatio accelerationRatio isQueued=0",
    "GetARCCommonParams": "api",
    "SetWAITCmd": "api waitTime isQueued=0",
    "SetTRIGCmd": "api address mode condition threshold isQueued=0",
    "SetIOMultiplexing": "api address multiplex isQueued=0",
    "GetIOMultiplexing": "api addr",
    "SetIODO": "api address level isQueued=0",
    "GetIODO": "api addr",
    "SetIOPWM": "api address frequency dutyCycle isQueued=0",
    "GetIOPWM": "api addr",
    "GetIODI": "api addr",
    "GetIOADC": "api addr",
    "SetEMotor": "api index isEnabled speed isQueued=0",
    "SetEMotorS": "api index isEnabled speed distance isQueued=0",
    "SetColorSensor": "api isEnable colorPort version=0",
    "GetColorSensor": "api",
    "SetInfraredSensor": "api isEnable infraredPort version=0",
    "GetInfraredSensor": "api infraredPort",
    "GetAngleSensorStaticError": "api",
    "GetAngleSensorCoef": "api",
    "GetBaseDecoderStaticError": "api",
    "GetWIFIConnectStatus": "api",
    "SetWIFIConfigMode": "api enable",
    "GetWIFIConfigMode": "api",
    "SetWIFISSID": "api ssid",
    "GetWIFISSID": "api",
    "SetWIFIPassword": "api password",
    "GetWIFIPassword": "api",
    "SetWIFIIPAddress": "api dhcp addr1 addr2 addr3 addr4",
    "GetWIFIIPAddress": "api",
    "SetWIFINetmask": "api addr1 addr2 addr3 addr4",
    "GetWIFINetmask": "api",
    "SetWIFIGateway": "api addr1 addr2 addr3 addr4",
    "GetWIFIGateway": "api",
    "SetWIFIDNS": "api addr1 addr2 addr3 addr4",
    "GetWIFIDNS": "api",
    "SetLostStepParams": "api threshold isQueued=0",
    "SetLostStepCmd": "api isQueued=0",
    "SetArmSpeedRatio": "api paramsMode speedRatio isQueued=0",
    "GetArmSpeedRatio": "api paramsMode=0",
    "GetPoseEx": "api index",
    "GetColorSensorEx": "api index",
    "SetHOMECmdEx": "api temp isQueued=0",
    "SetWAITCmdEx": "api waitTime isQueued=0",
    "SetEndEffectorParamsEx": "api xBias yBias zBias isQueued=0",
    "SetPTPJointParamsEx": f"api {PTP_JOINTS} isQueued=0",
    "SetPTPCoordinateParamsEx": "api xyzVelocity xyzAcceleration rVelocity rAcceleration isQueued=0",
    "SetPTPLParamsEx": "api lVelocity lAcceleration isQueued=0",
    "SetPTPCommonParamsEx": "api velocityRatio accelerationRatio isQueued=0",
    "SetPTPJumpParamsEx": "api jumpHeight maxJumpHeight isQueued=0",
    "SetPTPCmdEx": "api ptpMode x y z rHead isQueued=0",
    "SetPTPWithLCmdEx": "api ptpMode x y z rHead l isQueued=0",
    "SetARCCmdEx": "api cirPoint toPoint isQueued=1",
    "SetTRIGCmdEx": "api address mode condition threshold isQueued=1",
    "SetLostStepCmdEx": "api isQueued=1",
    "SetIOMultiplexingEx": "api address multiplex isQueued=0",
    "SetIODOEx": "api address level isQueued=0",
    "SetIOPWMEx": "api address frequency dutyCycle isQueued=0",
    "SetEndEffectorSuctionCupEx": "api enableCtrl on isQueued=0",
    "SetEndEffectorGripperEx": "api enableCtrl on isQueued=0",
    "SetEndEffectorLaserEx": "api enableCtrl power isQueued=0",
    "SetEMotorEx": "api index isEnabled speed isQueued=0",
    "SetEMotorSEx": "api index isEnabled speed distance isQueued=0",
}
"""The functions of the vendor's file for a Magician, and their arguments in order."""

PYDOBOT = {
    "__init__": "port verbose=False",
    "close": "",
    "go": "x y z r=0.0",
    "move_to": "x y z r wait=False",
    "suck": "enable",
    "grip": "enable",
    "speed": "velocity=100.0 acceleration=100.0",
    "wait": "ms",
    "pose": "",
    "get_eio": "addr",
    "set_eio": "addr val",
    "_set_ptp_cmd": "x y z r mode wait",
    "_set_cp_cmd": "x y z",
    "_set_wait_cmd": "ms",
    "_set_ptp_joint_params": "v_x v_y v_z v_r a_x a_y a_z a_r",
    "_set_ptp_coordinate_params": "velocity acceleration",
    "_set_ptp_jump_params": "jump limit",
    "_set_ptp_common_params": "velocity acceleration",
    "_set_queued_cmd_clear": "",
    "_set_queued_cmd_start_exec": "",
    "_set_queued_cmd_stop_exec": "",
    "_get_queued_cmd_current_index": "",
}
PYDOBOTPLUS = {
    "__init__": "port=None",
    "close": "",
    "get_pose": "",
    "get_alarms": "",
    "clear_alarms": "",
    "wait_for_cmd": "cmd_id",
    "jog_x": "v",
    "jog_y": "v",
    "jog_z": "v",
    "jog_r": "v",
    "set_io": "address state",
    "set_hht_trig_output": "state",
    "get_hht_trig_output": "",
    "go_arc": "x y z r cir_x cir_y cir_z cir_r",
    "suck": "enable",
    "set_home": "x y z r=0.0",
    "home": "",
    "grip": "enable",
    "laze": "power=0 enable=False",
    "speed": "velocity=100.0 acceleration=100.0",
    "conveyor_belt": "speed direction=1 interface=0",
    "conveyor_belt_distance": "speed_mm_per_sec distance_mm direction=1 interface=0",
    "engrave": "image pixel_size low=0.0 high=40.0 velocity=5 acceleration=5 actual_acceleration=5",
    "set_color": "enable=True port=1 version=1",
    "get_color": "port=1 version=1",
    "set_ir": "enable=True port=2",
    "get_ir": "port=2",
    "move_rel": "x=0 y=0 z=0 r=0 wait=True",
    "move_to": "x=None y=None z=None r=0 wait=True mode=None position=None",
}
CALLS = [
    "ptp",
    "set_device_withl",
    "set_ptpl_params",
    "set_ptpwithl_cmd",
    "set_r",
    "set_multiplexing",
    "set_pwm",
    "set_do",
    "get_di",
    "get_adc",
    "set_endeffector_suctioncup",
    "set_endeffector_gripper",
    "set_infrared_sensor",
    "get_infrared_sensor",
    "set_color_sensor",
    "get_color_sensor",
    "wait",
    "set_home",
    "get_pose",
    "get_posel",
    "clear_alarm",
    "get_arm_speed_ratio",
    "set_lost_step_params",
    "set_lost_step_cmd",
    "get_lost_step_result",
    "set_converyor",
]
PROPERTIES = ["motion_params", "jump_params"]


def takes(function: Any, expected: str, *, method: bool = False) -> None:
    """Check that a function takes arguments of these names, in this order, with these defaults; more may follow."""
    found = list(inspect.signature(function).parameters.values())[method:]
    wanted = [word.partition("=") for word in expected.split()]
    assert [each.name for each in found][: len(wanted)] == [name for name, _, _ in wanted]
    for each, (_, given, default) in zip(found, wanted, strict=False):
        if given:
            value = each.default
            assert str(int(value) if isinstance(value, int) and not isinstance(value, bool) else value) == default

    assert all(each.default is not each.empty for each in found[len(wanted) :])


@pytest.mark.parametrize("name", DLL)
def test_a_function_of_the_dll_has_its_arguments(name: str) -> None:
    takes(getattr(DobotDllType, name), DLL[name])


def test_all_functions_of_the_dll_are_in_the_table() -> None:
    functions = {name for name in DobotDllType.__all__ if inspect.isfunction(getattr(DobotDllType, name))}
    assert functions - {"output"} == set(DLL)


@pytest.mark.parametrize(
    ("module", "name", "expected"),
    [(pydobot, *each) for each in PYDOBOT.items()] + [(pydobotplus, *each) for each in PYDOBOTPLUS.items()],
)
def test_a_method_has_its_arguments(module: ModuleType, name: str, expected: str) -> None:
    takes(getattr(module.Dobot, name), expected, method=True)


def test_pydobot_has_the_methods_of_pydobotplus_as_well() -> None:
    assert not {name for name in PYDOBOTPLUS if not hasattr(pydobot.Dobot, name)}


def test_dobotlab_has_28_calls() -> None:
    assert len(CALLS) + len(PROPERTIES) == 28


@pytest.mark.parametrize("name", CALLS)
def test_a_call_of_dobotlab_is_as_in_pydobotlab(name: str) -> None:
    theirs = pytest.importorskip("pydobotlab", reason="pydobotlab is not installed").Magician
    own, other = (
        [(each.name, each.default) for each in inspect.signature(getattr(kind, name)).parameters.values()]
        for kind in (dobotlab.Magician, theirs)
    )
    assert own == other


@pytest.mark.parametrize("name", PROPERTIES)
def test_a_property_of_dobotlab_can_be_set(name: str) -> None:
    assert isinstance(inspect.getattr_static(dobotlab.Magician, name), property)
    assert getattr(dobotlab.Magician, name).fset


def test_the_names_of_the_numbers_are_the_vendors() -> None:
    assert DobotDllType.PTPMode.PTPJUMPMOVLXYZMode == 9
    assert DobotDllType.DobotConnect.DobotConnect_Occupied == 2
    assert DobotDllType.JC.JogENPressed == 10
    assert DobotDllType.GPIOType.GPIOTypeDIPD == 6
    assert list(pydobotplus.MODE_PTP) == list(pydobot.PTPMode)
    assert pydobot.enums.PTPMode.MOVL_XYZ == 2
    assert (pydobotplus.Dobot.PORT_GP1, pydobotplus.Dobot.PORT_GP5) == (0, 3)
