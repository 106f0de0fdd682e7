"""Every command of a Magician, one row each: the manual's table, with the arm's own layouts where the manual is wrong.

    from dobot_async.arms.magician import commands as c

    await arm.request(c.SET_PTP_COMMON_PARAMS, c.PTPCommonParams(50, 50))
    await arm.queue.put(c.SET_PTP_CMD, c.PTPCmd(c.PTPMode.MOVL_XYZ, 200, 0, 40))

A row has the manual's name in UPPER_SNAKE; the parameter types of `params` stand beside the rows, so that one import
has all. `section` is the manual's section, or the version of the manual that has the command first ("V1.1").
docs/manual-vs-arm.md lists where the arm does something else than the manual says.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Annotated, Any, Final, TypeVar

from dobot_async._core.protocol.layouts import NOTHING, Bytes, Count, Lenient, Text
from dobot_async._core.protocol.rows import Rows
from dobot_async._core.protocol.wire import (
    Command,
    Layout,
    Number,
    Queueing,
    Record,
    Scalar,
    commands_in,
    f32,
    flag,
    u8,
    u32,
    u32x3,
    u64,
)
from dobot_async.arms.magician.frame import MAX_PARAMS
from dobot_async.arms.magician.params import *

Q = TypeVar("Q")

SERIAL_NUMBER = Text(MAX_PARAMS - 1, "latin-1")
DEVICE_NAME = Text(MAX_PARAMS - 1)
SSID = Text(32)  # both are the limits of Wi-Fi itself, in bytes
PASSWORD = Text(64)
FLAG = Number[bool](flag)
F32 = Number[float](f32)
U32 = Number[int](u32)
HHT_TRIG_MODE = Number[HHTTrigMode](Annotated[HHTTrigMode, Scalar("B")])
ARM_ORIENTATION = Number[ArmOrientation](Annotated[ArmOrientation, Scalar("B")])
INFRARED_PORT = Number[InfraredPort](Annotated[InfraredPort, Scalar("B")])
UART4_PERIPHERALS_TYPE = Number[UART4PeripheralsType](Annotated[UART4PeripheralsType, Scalar("B")])
IO_ADDRESS = Lenient(Number[int](IOAddress), least=1)  # the vendor's library sends the whole struct of the reply

ALLOWED, ALWAYS = Queueing.ALLOWED, Queueing.ALWAYS
FLASH = 3.0  # seconds that an arm may take to answer a command that it keeps beyond its power-off


ROWS = Rows(Record, NOTHING)
read: Final = ROWS.read
ask: Final = ROWS.ask
write: Final = ROWS.write
motion: Final = ROWS.motion


def queued(name: str, number: int, request: type[Q] | Layout[Q], section: str) -> Command[Q, None]:
    """A row whose work takes its time in the queue; to send it twice is to do it twice."""
    return write(name, number, request, section, ALWAYS, repeatable=False)


# 2.3 Device information
SET_DEVICE_SN = write("SetDeviceSN", 0, SERIAL_NUMBER, "2.3.1", timeout=FLASH)
GET_DEVICE_SN = read("GetDeviceSN", 0, SERIAL_NUMBER, "2.3.1")
SET_DEVICE_NAME = write("SetDeviceName", 1, DEVICE_NAME, "2.3.2", timeout=FLASH)
GET_DEVICE_NAME = read("GetDeviceName", 1, DEVICE_NAME, "2.3.2")
GET_DEVICE_VERSION = read("GetDeviceVersion", 2, DeviceVersion, "2.3.3")
SET_DEVICE_WITH_L = write("SetDeviceWithL", 3, Lenient(Record(DeviceWithL), least=1), "V1.1", ALLOWED)
GET_DEVICE_WITH_L = read("GetDeviceWithL", 3, FLAG, "V1.1")
GET_DEVICE_TIME = read("GetDeviceTime", 4, U32, "V1.1")  # milliseconds since power-up
GET_DEVICE_ID = read("GetDeviceID", 5, Number[tuple[int, int, int]](u32x3), "V1.1.4")  # in three parts
GET_DEVICE_INFO = read("GetDeviceInfo", 6, DeviceInfo, "V1.1.5")

# 2.4 Pose
GET_POSE = read("GetPose", 10, Pose, "2.4.1")
RESET_POSE = write("ResetPose", 11, ResetPose, "2.4.2")
GET_KINEMATICS = read("GetKinematics", 12, Kinematics, "V1.1")
GET_POSE_L = read("GetPoseL", 13, F32, "V1.1")  # mm along the rail

# 2.5 Alarm
GET_ALARMS_STATE = read("GetAlarmsState", 20, Bytes(16), "2.5.1")  # alarm n is bit n % 8 of byte n // 8
CLEAR_ALL_ALARMS_STATE = write("ClearAllAlarmsState", 20, NOTHING, "2.5.2")
CLEAR_ALL_ALARMS_STATE_21 = write("ClearAllAlarmsState21", 21, NOTHING, "2.5.2")  # as documented; arms answer to 20

# 2.6 Home
SET_HOME_PARAMS = write("SetHOMEParams", 30, HOMEParams, "2.6.1", ALLOWED)
GET_HOME_PARAMS = read("GetHOMEParams", 30, HOMEParams, "2.6.1")
SET_HOME_CMD = motion("SetHOMECmd", 31, Lenient(Record(HOMECmd), least=0), "2.6.2")
SET_AUTO_LEVELING_CMD = motion("SetAutoLevelingCmd", 32, AutoLevelingCmd, "V1.1")
GET_AUTO_LEVELING_RESULT = read("GetAutoLevelingResult", 32, F32, "V1.1")  # unit not known

# 2.7 Handhold teaching
SET_HHT_TRIG_MODE = write("SetHHTTrigMode", 40, HHT_TRIG_MODE, "2.7.1")
GET_HHT_TRIG_MODE = read("GetHHTTrigMode", 40, HHT_TRIG_MODE, "2.7.1")
SET_HHT_TRIG_OUTPUT_ENABLED = write("SetHHTTrigOutputEnabled", 41, FLAG, "2.7.2")
GET_HHT_TRIG_OUTPUT_ENABLED = read("GetHHTTrigOutputEnabled", 41, FLAG, "2.7.2")
GET_HHT_TRIG_OUTPUT = read("GetHHTTrigOutput", 42, FLAG, "2.7.3")

# 2.8 Arm orientation
SET_ARM_ORIENTATION = write("SetArmOrientation", 50, ARM_ORIENTATION, "2.8.1", ALLOWED)
GET_ARM_ORIENTATION = read("GetArmOrientation", 50, ARM_ORIENTATION, "2.8.1")

# 2.9 End effector
SET_END_EFFECTOR_PARAMS = write("SetEndEffectorParams", 60, EndEffectorParams, "2.9.1", ALLOWED)
GET_END_EFFECTOR_PARAMS = read("GetEndEffectorParams", 60, EndEffectorParams, "2.9.1")
SET_END_EFFECTOR_LASER = write("SetEndEffectorLaser", 61, EndEffectorLaser, "2.9.2", ALLOWED)
GET_END_EFFECTOR_LASER = read("GetEndEffectorLaser", 61, EndEffectorLaser, "2.9.2")
SET_END_EFFECTOR_SUCTION_CUP = write("SetEndEffectorSuctionCup", 62, EndEffectorSuctionCup, "2.9.3", ALLOWED)
GET_END_EFFECTOR_SUCTION_CUP = read("GetEndEffectorSuctionCup", 62, EndEffectorSuctionCup, "2.9.3")
SET_END_EFFECTOR_GRIPPER = write("SetEndEffectorGripper", 63, EndEffectorGripper, "2.9.4", ALLOWED)
GET_END_EFFECTOR_GRIPPER = read("GetEndEffectorGripper", 63, EndEffectorGripper, "2.9.4")

# 2.10 JOG: to say the same jog twice, or stop twice, changes nothing
SET_JOG_JOINT_PARAMS = write("SetJOGJointParams", 70, JOGJointParams, "2.10.1", ALLOWED)
GET_JOG_JOINT_PARAMS = read("GetJOGJointParams", 70, JOGJointParams, "2.10.1")
SET_JOG_COORDINATE_PARAMS = write("SetJOGCoordinateParams", 71, JOGCoordinateParams, "2.10.2", ALLOWED)
GET_JOG_COORDINATE_PARAMS = read("GetJOGCoordinateParams", 71, JOGCoordinateParams, "2.10.2")
SET_JOG_COMMON_PARAMS = write("SetJOGCommonParams", 72, JOGCommonParams, "2.10.3", ALLOWED)
GET_JOG_COMMON_PARAMS = read("GetJOGCommonParams", 72, JOGCommonParams, "2.10.3")
SET_JOG_CMD = write("SetJOGCmd", 73, JOGCmd, "2.10.4", ALLOWED, moves=True)
SET_JOGL_PARAMS = write("SetJOGLParams", 74, JOGLParams, "V1.1", ALLOWED)  # V1.1.5 has it queued
GET_JOGL_PARAMS = read("GetJOGLParams", 74, JOGLParams, "V1.1")

# 2.11 PTP
SET_PTP_JOINT_PARAMS = write("SetPTPJointParams", 80, PTPJointParams, "2.11.1", ALLOWED)
GET_PTP_JOINT_PARAMS = read("GetPTPJointParams", 80, PTPJointParams, "2.11.1")
SET_PTP_COORDINATE_PARAMS = write("SetPTPCoordinateParams", 81, PTPCoordinateParams, "2.11.2", ALLOWED)
GET_PTP_COORDINATE_PARAMS = read("GetPTPCoordinateParams", 81, PTPCoordinateParams, "2.11.2")
SET_PTP_JUMP_PARAMS = write("SetPTPJumpParams", 82, PTPJumpParams, "2.11.3", ALLOWED)
GET_PTP_JUMP_PARAMS = read("GetPTPJumpParams", 82, PTPJumpParams, "2.11.3")
SET_PTP_COMMON_PARAMS = write("SetPTPCommonParams", 83, PTPCommonParams, "2.11.4", ALLOWED)
GET_PTP_COMMON_PARAMS = read("GetPTPCommonParams", 83, PTPCommonParams, "2.11.4")
SET_PTP_CMD = motion("SetPTPCmd", 84, PTPCmd, "2.11.5")
SET_PTPL_PARAMS = write("SetPTPLParams", 85, PTPLParams, "V1.1", ALLOWED)
GET_PTPL_PARAMS = read("GetPTPLParams", 85, PTPLParams, "V1.1")
SET_PTP_WITH_L_CMD = motion("SetPTPWithLCmd", 86, PTPWithLCmd, "V1.1")
SET_PTP_JUMP2_PARAMS = write("SetPTPJump2Params", 87, PTPJump2Params, "V1.1", ALLOWED)
GET_PTP_JUMP2_PARAMS = read("GetPTPJump2Params", 87, PTPJump2Params, "V1.1")
SET_PTPPO_CMD = motion("SetPTPPOCmd", 88, PTPPOCmd, "V1.1")
SET_PTPPO_WITH_L_CMD = motion("SetPTPPOWithLCmd", 89, PTPPOWithLCmd, "V1.1")

# 2.12 CP
SET_CP_PARAMS = write("SetCPParams", 90, CPParams, "2.12.1", ALLOWED)
GET_CP_PARAMS = read("GetCPParams", 90, CPParams, "2.12.1")
SET_CP_CMD = motion("SetCPCmd", 91, CPCmd, "2.12.2")
SET_CPLE_CMD = motion("SetCPLECmd", 92, CPLECmd, "2.12.3")
SET_CPR_HOLD_ENABLE = write("SetCPRHoldEnable", 93, FLAG, "V1.1")  # whether a continuous path holds r
GET_CPR_HOLD_ENABLE = read("GetCPRHoldEnable", 93, FLAG, "V1.1")
SET_CP_COMMON_PARAMS = write("SetCPCommonParams", 94, CPCommonParams, "V1.1", ALLOWED)
GET_CP_COMMON_PARAMS = read("GetCPCommonParams", 94, CPCommonParams, "V1.1")

# 2.13 ARC
SET_ARC_PARAMS = write("SetARCParams", 100, ARCParams, "2.13.1", ALLOWED)
GET_ARC_PARAMS = read("GetARCParams", 100, ARCParams, "2.13.1")
SET_ARC_CMD = motion("SetARCCmd", 101, ARCCmd, "2.13.2")
SET_CIRCLE_CMD = motion("SetCircleCmd", 102, CircleCmd, "V1.1")
SET_ARC_COMMON_PARAMS = write("SetARCCommonParams", 103, ARCCommonParams, "V1.1", ALLOWED)
GET_ARC_COMMON_PARAMS = read("GetARCCommonParams", 103, ARCCommonParams, "V1.1")

# 2.14 WAIT, 2.15 TRIG
SET_WAIT_CMD = queued("SetWAITCmd", 110, WAITCmd, "2.14.1")
SET_TRIG_CMD = queued("SetTRIGCmd", 120, TRIGCmd, "2.15.1")

# 2.16 EIO
SET_IO_MULTIPLEXING = write("SetIOMultiplexing", 130, IOMultiplexing, "2.16.1", ALLOWED)
GET_IO_MULTIPLEXING = ask("GetIOMultiplexing", 130, IO_ADDRESS, IOMultiplexing, "2.16.1", echo="address")
SET_IODO = write("SetIODO", 131, IODO, "2.16.2", ALLOWED)
GET_IODO = ask("GetIODO", 131, IO_ADDRESS, IODO, "2.16.2", echo="address")
SET_IOPWM = write("SetIOPWM", 132, IOPWM, "2.16.3", ALLOWED)
GET_IOPWM = ask("GetIOPWM", 132, IO_ADDRESS, IOPWM, "2.16.3", echo="address")
GET_IODI = ask("GetIODI", 133, IO_ADDRESS, IODI, "2.16.4", echo="address")
GET_IOADC = ask("GetIOADC", 134, IO_ADDRESS, IOADC, "2.16.5", echo="address")
SET_E_MOTOR = write("SetEMotor", 135, EMotor, "2.16.6", ALLOWED)
SET_E_MOTOR_S = queued("SetEMotorS", 136, EMotorS, "V1.1")
SET_COLOR_SENSOR = write("SetColorSensor", 137, Lenient(Record(ColorSensor), least=2), "V1.1", ALLOWED)
GET_COLOR_SENSOR = read("GetColorSensor", 137, Color, "V1.1")
SET_INFRARED_SENSOR = write("SetInfraredSensor", 138, Lenient(Record(InfraredSensor), least=2), "V1.1", ALLOWED)
GET_INFRARED_SENSOR = ask("GetInfraredSensor", 138, INFRARED_PORT, Number[int](u8), "V1.1")

# 2.17 Calibration
SET_ANGLE_SENSOR_STATIC_ERROR = write("SetAngleSensorStaticError", 140, AngleSensorStaticError, "2.17.1", timeout=FLASH)
GET_ANGLE_SENSOR_STATIC_ERROR = read("GetAngleSensorStaticError", 140, AngleSensorStaticError, "2.17.1")
SET_ANGLE_SENSOR_COEF = write("SetAngleSensorCoef", 141, AngleSensorCoef, "V1.1", timeout=FLASH)
GET_ANGLE_SENSOR_COEF = read("GetAngleSensorCoef", 141, AngleSensorCoef, "V1.1")
SET_BASE_DECODER_STATIC_ERROR = write("SetBaseDecoderStaticError", 142, F32, "V1.1", timeout=FLASH)  # unit not known
GET_BASE_DECODER_STATIC_ERROR = read("GetBaseDecoderStaticError", 142, F32, "V1.1")  # unit not known

# 2.18 Wi-Fi
SET_WIFI_CONFIG_MODE = write("SetWIFIConfigMode", 150, FLAG, "2.18.1", timeout=FLASH)
GET_WIFI_CONFIG_MODE = read("GetWIFIConfigMode", 150, FLAG, "2.18.1")
SET_WIFI_SSID = write("SetWIFISSID", 151, SSID, "2.18.2", timeout=FLASH)
GET_WIFI_SSID = read("GetWIFISSID", 151, SSID, "2.18.2")
SET_WIFI_PASSWORD = write("SetWIFIPassword", 152, PASSWORD, "2.18.3", timeout=FLASH)
GET_WIFI_PASSWORD = read("GetWIFIPassword", 152, PASSWORD, "2.18.3")
SET_WIFI_IP_ADDRESS = write("SetWIFIIPAddress", 153, WIFIIPAddress, "2.18.4", timeout=FLASH)
GET_WIFI_IP_ADDRESS = read("GetWIFIIPAddress", 153, WIFIIPAddress, "2.18.4")
SET_WIFI_NETMASK = write("SetWIFINetmask", 154, WIFINetmask, "2.18.5", timeout=FLASH)
GET_WIFI_NETMASK = read("GetWIFINetmask", 154, WIFINetmask, "2.18.5")
SET_WIFI_GATEWAY = write("SetWIFIGateway", 155, WIFIGateway, "2.18.6", timeout=FLASH)
GET_WIFI_GATEWAY = read("GetWIFIGateway", 155, WIFIGateway, "2.18.6")
SET_WIFI_DNS = write("SetWIFIDNS", 156, WIFIDNS, "2.18.7", timeout=FLASH)
GET_WIFI_DNS = read("GetWIFIDNS", 156, WIFIDNS, "2.18.7")
GET_WIFI_CONNECT_STATUS = read("GetWIFIConnectStatus", 157, FLAG, "2.18.8")

# Lost steps: the check answers with alarms 0x50 to 0x53, hence it counts as a motion
SET_LOST_STEP_PARAMS = write("SetLostStepParams", 170, F32, "V1.1.4")  # degrees
SET_LOST_STEP_CMD = motion("SetLostStepCmd", 171, NOTHING, "V1.1.4")

# The serial socket, and what the arm tells of itself
GET_UART4_PERIPHERALS_TYPE = read("GetUART4PeripheralsType", 181, UART4_PERIPHERALS_TYPE, "V1.1")
SET_UART4_PERIPHERALS_ENABLE = write("SetUART4PeripheralsEnable", 182, FLAG, "V1.1")
GET_UART4_PERIPHERALS_ENABLE = read("GetUART4PeripheralsEnable", 182, FLAG, "V1.1")
GET_USER_PARAMS = read("GetUserParams", 220, UserParams, "V1.1")
GET_PTP_TIME = ask("GetPTPTime", 221, PTPCmd, U32, "V1.1")  # milliseconds that the motion would take

# 2.19 Queue
SET_QUEUED_CMD_START_EXEC = write("SetQueuedCmdStartExec", 240, NOTHING, "2.19.1")
SET_QUEUED_CMD_STOP_EXEC = write("SetQueuedCmdStopExec", 241, NOTHING, "2.19.2")  # once the current command is done
SET_QUEUED_CMD_FORCE_STOP_EXEC = write("SetQueuedCmdForceStopExec", 242, NOTHING, "2.19.3")  # now
SET_QUEUED_CMD_START_DOWNLOAD = write(
    "SetQueuedCmdStartDownload", 243, QueuedCmdStartDownload, "2.19.4", repeatable=False, timeout=FLASH
)
SET_QUEUED_CMD_STOP_DOWNLOAD = write("SetQueuedCmdStopDownload", 244, NOTHING, "2.19.5", timeout=FLASH)
SET_QUEUED_CMD_CLEAR = write("SetQueuedCmdClear", 245, NOTHING, "2.19.6")
GET_QUEUED_CMD_CURRENT_INDEX = read("GetQueuedCmdCurrentIndex", 246, Number[int](u64), "2.19.7")  # the last one done
GET_QUEUED_CMD_LEFT_SPACE = read("GetQueuedCmdLeftSpace", 247, Count(), "2.19.8")  # commands for which there is room
GET_QUEUED_CMD_MOTION_FINISH = read("GetQueuedCmdMotionFinish", 248, FLAG, "V1.1.5")

# The order of the module is the order of the table.
ALL = commands_in(globals())
BY_KEY: Mapping[tuple[int, bool], Command[Any, Any]] = MappingProxyType({(row.id, row.write): row for row in ALL})
