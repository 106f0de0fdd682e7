"""Every command of the myCobot family, one row each: the manual's table, and the useful ones of later firmware.

    from dobot_async.arms.mycobot import commands as c

    await arm.request(c.GET_JOINT_MIN_ANGLE, 2)
    await arm.queue.put(c.SEND_ANGLES, c.JointsMove((0, 0, 0, 0, 0, 0), speed=30))

A row is the same for all models; `models` says which rows a model lacks, and which have another ID or layout there.
Names are those of the vendor's library. `section` is the manual's title, or "later" for what the manual does not have.
A command is acknowledged by newer firmware only, and an acknowledgement says nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Annotated, Any, Final

from dobot_async._core.protocol.layouts import NOTHING
from dobot_async._core.protocol.rows import Rows
from dobot_async._core.protocol.wire import Command, Queueing, commands_in
from dobot_async.arms.mycobot.dialects import PositionLayout, ServoRegister
from dobot_async.arms.mycobot.layouts import ACK, Axis, Fixed, Octets, Packed, Value, Whole
from dobot_async.arms.mycobot.params import *

FLAG = Value[bool](flag)
BYTE = Value[int](byte)
U16 = Value[int](u16)
ANGLE = Value[float](angle)
ANGLES = Value[tuple[float, ...]](angles)
COORDS = Value[tuple[float, ...]](coords)
OCTETS = Value[tuple[int, ...]](octets)
U16S = Value[tuple[int, ...]](u16s)
I16S = Value[tuple[int, ...]](i16s)
VERSION = Value[float](tenths)
VOLTS = Value[tuple[float, ...]](volts)
SERVO = Value[int](servo)
SERVO_OR_ALL = Value[int](servo_or_all)
UNDAMPED = Value[int | None](Annotated[int | None, Fixed("B", low=0, high=1, optional=True)])
GRIPPER_TYPE = Value[GripperType | None](Annotated[GripperType | None, Fixed("B", optional=True)])
REFERENCE_FRAME = Value[ReferenceFrame](Annotated[ReferenceFrame, Fixed("B")])
MOVE_MODE = Value[MoveMode](Annotated[MoveMode, Fixed("B")])
END_TYPE = Value[EndType](Annotated[EndType, Fixed("B")])
TRANSPONDER_MODE = Value[TransponderMode](Annotated[TransponderMode, Fixed("B")])
PERCENT = Value[int](percent)
PROTECT_CURRENT = Value[int](Annotated[int, Fixed("H", low=1, high=500)])

ALLOWED, ALWAYS = Queueing.ALLOWED, Queueing.ALWAYS
SLOW = 3.0  # seconds that an arm may take for what its servos have to be asked, or told, one by one


ROWS = Rows(Packed, ACK)
read: Final = ROWS.read
ask: Final = ROWS.ask
write: Final = ROWS.write
motion: Final = ROWS.motion


# The controller
GET_SYSTEM_VERSION = read("GetSystemVersion", 0x02, VERSION, "later")  # major and minor version, such as 1.3
CLEAR_QUEUE = write("ClearQueue", 0x05, NOTHING, "later")
GET_ERROR_INFORMATION = read("GetErrorInformation", 0x07, BYTE, "later")  # a code of `CobotAlarm`
CLEAR_ERROR_INFORMATION = write("ClearErrorInformation", 0x08, NOTHING, "later")
GET_ATOM_VERSION = read("GetAtomVersion", 0x09, VERSION, "later")  # major and minor version
POWER_ON = write("PowerOn", 0x10, NOTHING, "Powering up", timeout=SLOW)
POWER_OFF = write("PowerOff", 0x11, NOTHING, "Power Decreasing and Connection Breaking up", timeout=SLOW)
IS_POWER_ON = read("IsPowerOn", 0x12, FLAG, "Checking the Status of Atom")
RELEASE_ALL_SERVOS = write("ReleaseAllServos", 0x13, UNDAMPED, "Power Decreasing", timeout=SLOW)  # 1: undamped
IS_CONTROLLER_CONNECTED = read("IsControllerConnected", 0x14, FLAG, "Robot System Checking: Normal")
READ_NEXT_ERROR = read("ReadNextError", 0x15, Octets(4, 8), "Abnormal Error Detection")  # codes of `CobotAlarm`
SET_FRESH_MODE = write("SetFreshMode", 0x16, FLAG, "Command Updating Mode")
GET_FRESH_MODE = read("GetFreshMode", 0x17, FLAG, "later")
SET_FREE_MODE = write("SetFreeMode", 0x1A, FLAG, "Free Mode")
IS_FREE_MODE = read("IsFreeMode", 0x1B, FLAG, "Checking whether free mode is set")
SET_VISION_MODE = write("SetVisionMode", 0x1D, FLAG, "later")
GET_REBOOT_COUNT = read("GetRebootCount", 0xD8, U16, "later")  # how often the arm has started

# Motion
GET_ANGLES = read("GetAngles", 0x20, ANGLES, "Reading Angles")  # degrees
SEND_ANGLE = motion("SendAngle", 0x21, JointMove, "Sending Sole Angle")
SEND_ANGLES = motion("SendAngles", 0x22, JointsMove, "Sending Entire Angles")
GET_COORDS = read("GetCoords", 0x23, COORDS, "Reading the Entire Coordinates")  # mm and degrees
SEND_COORD = motion("SendCoord", 0x24, Axis(CoordMove), "Sending Parameters of Sole Coordinate")
SEND_COORDS = motion("SendCoords", 0x25, ToMove, "Sending Parameters of Entire Coordinate")
PAUSE = write("Pause", 0x26, NOTHING, "Program Stops")
IS_PAUSED = read("IsPaused", 0x27, FLAG, "Judging Whether Program Stops")
RESUME = write("Resume", 0x28, NOTHING, "Program Restoration")
STOP = write("Stop", 0x29, NOTHING, "Program Stops")
IS_IN_POSITION = ask(
    "IsInPosition", 0x2A, PositionLayout(ANGLES, COORDS), FLAG, "Whether Reaching Specified Coordinate"
)
IS_MOVING = read("IsMoving", 0x2B, FLAG, "Movement Check")
GET_SOLUTION_ANGLES = read("GetSolutionAngles", 0x2E, ANGLE, "Get zero space deflection angle value")  # degrees
SET_SOLUTION_ANGLES = motion("SetSolutionAngles", 0x2F, SetSolutionAngle, "Set zero space deflection angle value")
GET_ANGLES_COORDS = read("GetAnglesCoords", 0xD5, JointsAndCoords, "later")

# Jogs: to say the same jog twice, or stop twice, changes nothing
JOG_ANGLE = write("JogAngle", 0x30, JogJoint, "jog-Joint-Oriented Movement", moves=True)
JOG_ABSOLUTE = motion("JogAbsolute", 0x31, JointMove, "jod-Absolute Control")
JOG_ROTATION = write("JogRotation", 0x31, JogRotation, "later", moves=True)
JOG_COORD = write("JogCoord", 0x32, JogAxis, "jog-Coordinate-Oriented Movement", moves=True)
JOG_INCREMENT = motion("JogIncrement", 0x33, JointMove, "jog-Stepper Model")
JOG_STOP = write("JogStop", 0x34, NOTHING, "jog-Stop")
JOG_INCREMENT_COORD = motion("JogIncrementCoord", 0x34, Axis(CoordStep), "later")

# Encoders
SET_ENCODER = motion("SetEncoder", 0x3A, SetEncoder, "Sending Potential")
GET_ENCODER = ask("GetEncoder", 0x3B, SERVO, U16, "Get the Potential")  # a servo's position, 0 to 4096
SET_ENCODERS = motion("SetEncoders", 0x3C, SetEncoders, "Sending Potential of Seven Steering Gears")
GET_ENCODERS = read("GetEncoders", 0x3D, U16S, "Reading Potential of Seven Steering Gears")  # positions, 0 to 4096
SET_ENCODERS_DRAG = motion("SetEncodersDrag", 0x3E, SetEncodersDrag, "Set joint potential and velocity values")

# Speed, acceleration, limits
GET_SPEED = read("GetSpeed", 0x40, BYTE, "Reading Speed")  # percent
SET_SPEED = write("SetSpeed", 0x41, PERCENT, "Setting Speed")  # percent
GET_ACCELERATION = read("GetAcceleration", 0x44, BYTE, "Reading acceleration")  # percent
SET_ACCELERATION = write("SetAcceleration", 0x45, PERCENT, "Setting acceleration")  # percent
GET_JOINT_MIN_ANGLE = ask("GetJointMinAngle", 0x4A, SERVO, JointAngle, "Reading the Smallest Angle", echo="joint")
GET_JOINT_MAX_ANGLE = ask("GetJointMaxAngle", 0x4B, SERVO, JointAngle, "Reading the largest Angle", echo="joint")
SET_JOINT_MIN = write("SetJointMin", 0x4C, JointLimit, "Setting the Smallest Angle")
SET_JOINT_MAX = write("SetJointMax", 0x4D, JointLimit, "Setting the Largest Angle")

# Servos
IS_SERVO_ENABLE = ask("IsServoEnable", 0x50, SERVO, ServoConnected, "Checking Connection", echo="joint")
IS_ALL_SERVO_ENABLE = read("IsAllServoEnable", 0x51, FLAG, "Checking Whether All Steering Gears Are Powered On")
SET_SERVO_DATA = write("SetServoData", 0x52, ServoRegister(), "Setting Servo Parameters", timeout=SLOW)
GET_SERVO_DATA = ask("GetServoData", 0x53, ServoDataAddress, Whole(), "Reading Servo Parameters")
SET_SERVO_CALIBRATION = write("SetServoCalibration", 0x54, SERVO, "Setting Zero Position of Steering Gear")  # a servo
JOINT_BRAKE = write("JointBrake", 0x55, SERVO, "Braking Single Motor")  # the servo
RELEASE_SERVO = write("ReleaseServo", 0x56, Release, "Power Failure of Single Motor")
FOCUS_SERVO = write("FocusServo", 0x57, SERVO_OR_ALL, "Powering On a Single Motor")  # 0 is all
GET_SERVO_SPEEDS = read("GetServoSpeeds", 0xE1, I16S, "Getting Joint running speed")  # steps/s
GET_SERVO_VOLTAGES = read("GetServoVoltages", 0xE3, VOLTS, "Getting Joint Voltage")  # volts
GET_SERVO_STATUS = read("GetServoStatus", 0xE4, OCTETS, "Getting Joint State")  # bits, 0 if all is well
GET_SERVO_TEMPS = read("GetServoTemps", 0xE5, OCTETS, "Getting Joint temperature")  # degrees Celsius

# Pins, gripper, light
SET_PIN_MODE = write("SetPinMode", 0x60, PinModeSetting, "Setting Mode of Atom", ALLOWED)
SET_DIGITAL_OUTPUT = write("SetDigitalOutput", 0x61, PinLevel, "Setting Atom IO", ALLOWED)
GET_DIGITAL_INPUT = ask("GetDigitalInput", 0x62, BYTE, PinLevel, "Reading Atom IO", echo="pin")
SET_PWM_OUTPUT = write("SetPWMOutput", 0x64, PWMOutput, "Setting PWM signal configuration", ALLOWED)
GET_GRIPPER_VALUE = ask("GetGripperValue", 0x65, GRIPPER_TYPE, BYTE, "Reading the Angle of Gripper")
SET_GRIPPER_STATE = write("SetGripperState", 0x66, SetGripperState, "Setting the Mode of Gripper", ALLOWED)
SET_GRIPPER_VALUE = write("SetGripperValue", 0x67, SetGripperValue, "Setting Angles of Gripper", ALLOWED)
SET_GRIPPER_CALIBRATION = write("SetGripperCalibration", 0x68, NOTHING, "Setting the Gripper to Zero Position")
IS_GRIPPER_MOVING = read("IsGripperMoving", 0x69, FLAG, "Checking Whether the Gripper is Moving")
SET_COLOR = write("SetColor", 0x70, RGB, "Setting RGB of Atom", ALLOWED)
SET_BASIC_OUTPUT = write("SetBasicOutput", 0xA0, PinLevel, "Setting IO Output", ALLOWED)
GET_BASIC_INPUT = ask("GetBasicInput", 0xA1, BYTE, PinLevel, "Reading IO Output", echo="pin")
SET_HTS_GRIPPER_TORQUE = write("SetHTSGripperTorque", 0x35, U16, "later")  # unit not known
GET_HTS_GRIPPER_TORQUE = read("GetHTSGripperTorque", 0x36, U16, "later")  # unit not known
GET_GRIPPER_PROTECT_CURRENT = read("GetGripperProtectCurrent", 0x37, U16, "later")  # unit not known
INIT_GRIPPER = write("InitGripper", 0x38, NOTHING, "later", timeout=SLOW)
SET_GRIPPER_PROTECT_CURRENT = write("SetGripperProtectCurrent", 0x39, PROTECT_CURRENT, "later")  # unit not known
GET_TOF_DISTANCE = read("GetTOFDistance", 0xC0, U16, "later")  # mm
SET_FOUR_PIECES_ZERO = write("SetFourPiecesZero", 0xD7, NOTHING, "later", timeout=SLOW)

# Frames of coordinates
SET_TOOL_REFERENCE = write("SetToolReference", 0x81, COORDS, "Setting Tool Coordinate")  # mm and degrees
GET_TOOL_REFERENCE = read("GetToolReference", 0x82, COORDS, "Acquiring Tool Coordinate")  # mm and degrees
SET_WORLD_REFERENCE = write("SetWorldReference", 0x83, COORDS, "Setting World Coordinate")  # mm and degrees
GET_WORLD_REFERENCE = read("GetWorldReference", 0x84, COORDS, "Reading World Coordinate")  # mm and degrees
SET_REFERENCE_FRAME = write("SetReferenceFrame", 0x85, REFERENCE_FRAME, "Setting Base Coordinate")
GET_REFERENCE_FRAME = read("GetReferenceFrame", 0x86, REFERENCE_FRAME, "Acquiring Base Coordinate")
SET_MOVEMENT_TYPE = write("SetMovementType", 0x87, MOVE_MODE, "Setting Move Type")
GET_MOVEMENT_TYPE = read("GetMovementType", 0x88, MOVE_MODE, "Reading Move Type")
SET_END_TYPE = write("SetEndType", 0x89, END_TYPE, "Setting End Coordinate")
GET_END_TYPE = read("GetEndType", 0x8A, END_TYPE, "Acquiring End Coordinate")

# The M5
GET_TRANSPONDER_MODE = read("GetTransponderMode", 0xB0, TRANSPONDER_MODE, "Getting configuration information")
SET_TRANSPONDER_MODE = write("SetTransponderMode", 0xB1, TRANSPONDER_MODE, "Setting Transparent Mode")
GET_BASIC_VERSION = read("GetBasicVersion", 0xC1, VERSION, "later")  # major and minor version

# The order of the module is the order of the table.
ALL = commands_in(globals())

CONFIRMED_BY: Mapping[Command[Any, Any], Command[Any, Any]] = MappingProxyType(
    {
        SET_FRESH_MODE: GET_FRESH_MODE,
        SET_TOOL_REFERENCE: GET_TOOL_REFERENCE,
        SET_WORLD_REFERENCE: GET_WORLD_REFERENCE,
        SET_REFERENCE_FRAME: GET_REFERENCE_FRAME,
        SET_MOVEMENT_TYPE: GET_MOVEMENT_TYPE,
        SET_END_TYPE: GET_END_TYPE,
        SET_SPEED: GET_SPEED,
        SET_ACCELERATION: GET_ACCELERATION,
        SET_FREE_MODE: IS_FREE_MODE,
        SET_TRANSPONDER_MODE: GET_TRANSPONDER_MODE,
        SET_GRIPPER_PROTECT_CURRENT: GET_GRIPPER_PROTECT_CURRENT,
        SET_HTS_GRIPPER_TORQUE: GET_HTS_GRIPPER_TORQUE,
    }
)
"""What a command sets, and the read that gives it back."""
