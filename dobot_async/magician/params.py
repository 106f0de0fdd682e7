"""The parameters of the Magician's commands: what goes into a request, and what a reply gives back.

Types and fields have the manual's names (fields in snake_case); the fields lie on the wire in their order. Lengths are
mm, angles degrees, velocities mm/s or degrees/s, accelerations mm/s² or degrees/s², ratios percent; what is otherwise
says so. A docstring ends with the manual's section, or with the version of it that has the command first.
Where the manual is wrong the layout is the arm's: docs/manual-vs-arm.md has the list.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Annotated

from dobot_async.layouts import Bytes, Counted
from dobot_async.magician.frame import MAX_PARAMS
from dobot_async.wire import Record, Scalar, f32, f32x4, f32x8, flag, i32, u8, u8x4, u16, u32, u64

__all__ = [
    "IOADC",
    "IODI",
    "IODO",
    "IOPWM",
    "WIFIDNS",
    "ARCCmd",
    "ARCCommonParams",
    "ARCParams",
    "ARCPoint",
    "AccessoryVersion",
    "AngleSensorCoef",
    "AngleSensorStaticError",
    "ArmOrientation",
    "AutoLevelingCmd",
    "CPCmd",
    "CPCommonParams",
    "CPLECmd",
    "CPMode",
    "CPParams",
    "CircleCmd",
    "Color",
    "ColorPort",
    "ColorSensor",
    "DeviceInfo",
    "DeviceVersion",
    "DeviceWithL",
    "EMotor",
    "EMotorS",
    "EndEffectorGripper",
    "EndEffectorLaser",
    "EndEffectorParams",
    "EndEffectorSuctionCup",
    "HHTTrigMode",
    "HOMECmd",
    "HOMEParams",
    "IOAddress",
    "IOFunction",
    "IOMultiplexing",
    "InfraredPort",
    "InfraredSensor",
    "JOGCmd",
    "JOGCommonParams",
    "JOGCoordinateParams",
    "JOGJointParams",
    "JOGKey",
    "JOGLParams",
    "Kinematics",
    "Level",
    "PTPCmd",
    "PTPCommonParams",
    "PTPCoordinateParams",
    "PTPJointParams",
    "PTPJump2Params",
    "PTPJumpParams",
    "PTPLParams",
    "PTPMode",
    "PTPPOCmd",
    "PTPPOWithLCmd",
    "PTPWithLCmd",
    "ParallelOutputCmd",
    "Pose",
    "QueuedCmdStartDownload",
    "ResetPose",
    "TRIGCmd",
    "TriggerADCCondition",
    "TriggerIOCondition",
    "TriggerMode",
    "UART4PeripheralsType",
    "UserParams",
    "WAITCmd",
    "WIFIGateway",
    "WIFIIPAddress",
    "WIFINetmask",
]

IOAddress = Annotated[int, Scalar("B", 1, 20)]
Level = Annotated[int, Scalar("B", 0, 1)]

# --- 2.3 Device information ---


class AccessoryVersion(IntEnum):
    """Which of its two hardware versions an accessory is: rail, colour sensor or infrared sensor."""

    V1 = 0
    V2 = 1


@dataclass(frozen=True, slots=True)
class DeviceVersion:
    """The firmware's version; `rest` is what newer firmware adds, where byte 10 is the hardware version. 2.3.3."""

    major_version: u8
    minor_version: u8
    revision: u8
    rest: Annotated[bytes, Bytes()] = b""

    def __str__(self) -> str:
        return f"{self.major_version}.{self.minor_version}.{self.revision}"


@dataclass(frozen=True, slots=True)
class DeviceWithL:
    """Whether the arm stands on a sliding rail, and which one. V1.1."""

    is_with_l: flag
    version: Annotated[AccessoryVersion, Scalar("B")] = AccessoryVersion.V1


@dataclass(frozen=True, slots=True)
class DeviceInfo:
    """How long the arm has been running in all, and how often it was switched on and off. V1.1.5."""

    run_time: u64
    power_on: u32
    power_off: u32


# --- 2.4 Pose ---


@dataclass(frozen=True, slots=True)
class Pose:
    """Where the tool is, mm and degrees in the base frame, and the four joint angles. 2.4.1.

    J2 counts from the vertical; J3 counts from the horizontal, downwards, whatever J2 is; r = j1 + j4.
    """

    x: f32
    y: f32
    z: f32
    r: f32
    j1: f32
    j2: f32
    j3: f32
    j4: f32


@dataclass(frozen=True, slots=True)
class ResetPose:
    """Takes the pose anew: from the angle sensors (`manual` false), or from the two angles given (true). 2.4.2."""

    manual: flag
    rear_arm_angle: f32 = 0.0
    front_arm_angle: f32 = 0.0


@dataclass(frozen=True, slots=True)
class Kinematics:
    """Velocity and acceleration that the arm has now. V1.1."""

    velocity: f32
    acceleration: f32


# --- 2.6 Home ---


@dataclass(frozen=True, slots=True)
class HOMEParams:
    """Where the arm stands after homing, mm and degrees. 2.6.1."""

    x: f32
    y: f32
    z: f32
    r: f32 = 0.0


@dataclass(frozen=True, slots=True)
class HOMECmd:
    """Home; the number is reserved. 2.6.2."""

    reserved: u32 = 0


@dataclass(frozen=True, slots=True)
class AutoLevelingCmd:
    """Levels the arm with the levelling tool, to a precision. V1.1."""

    control_flag: flag
    precision: f32


# --- 2.7 Handhold teaching ---


class HHTTrigMode(IntEnum):
    """When a point is recorded while the arm is led by hand. 2.7.1."""

    TRIGGERED_ON_KEY_RELEASED = 0
    TRIGGERED_ON_PERIODIC_INTERVAL = 1


# --- 2.8 Arm orientation ---


class ArmOrientation(IntEnum):
    """The elbow's side; for SCARA arms only, a Magician may leave the request unanswered. 2.8.1."""

    LEFTY = 0
    RIGHTY = 1


# --- 2.9 End effector ---


@dataclass(frozen=True, slots=True)
class EndEffectorParams:
    """The tool's offset from the flange, mm; 59.7 forward is a suction cup or gripper, 61 a pen, 70 a laser. 2.9.1."""

    x_bias: f32
    y_bias: f32 = 0.0
    z_bias: f32 = 0.0


@dataclass(frozen=True, slots=True)
class EndEffectorLaser:
    """The laser; it burns only when both are set. 2.9.2."""

    is_ctrl_enabled: flag
    is_on: flag


@dataclass(frozen=True, slots=True)
class EndEffectorSuctionCup:
    """The air pump and its valve: control runs the pump, not sucked vents the cup. 2.9.3."""

    is_ctrl_enabled: flag
    is_sucked: flag


@dataclass(frozen=True, slots=True)
class EndEffectorGripper:
    """The air pump and the gripper: control runs the pump, gripped is closed. 2.9.4."""

    is_ctrl_enabled: flag
    is_gripped: flag


# --- 2.10 JOG ---


class JOGKey(IntEnum):
    """Which key of the teach pendant is down: an axis (or joint) and its direction; idle stops. 2.10.4.

    A is x or joint 1, B is y or joint 2, C is z or joint 3, D is r or joint 4, E is the rail (V1.1).
    """

    IDLE = 0
    AP_DOWN = 1
    AN_DOWN = 2
    BP_DOWN = 3
    BN_DOWN = 4
    CP_DOWN = 5
    CN_DOWN = 6
    DP_DOWN = 7
    DN_DOWN = 8
    EP_DOWN = 9
    EN_DOWN = 10


@dataclass(frozen=True, slots=True)
class JOGJointParams:
    """Jog velocities and accelerations of the four joints, degrees/s and degrees/s². 2.10.1."""

    velocity: f32x4
    acceleration: f32x4


@dataclass(frozen=True, slots=True)
class JOGCoordinateParams:
    """Jog velocities and accelerations along x, y, z (mm/s, mm/s²) and r (degrees/s, degrees/s²). 2.10.2."""

    velocity: f32x4
    acceleration: f32x4


@dataclass(frozen=True, slots=True)
class JOGCommonParams:
    """Percent of the jog velocities and accelerations that are used; the arm takes more than 100 as 100. 2.10.3."""

    velocity_ratio: f32
    acceleration_ratio: f32


@dataclass(frozen=True, slots=True)
class JOGCmd:
    """Starts to jog joints or coordinates, or stops (`JOGKey.IDLE`). 2.10.4."""

    is_joint: flag
    cmd: Annotated[JOGKey, Scalar("B")]


@dataclass(frozen=True, slots=True)
class JOGLParams:
    """Jog velocity and acceleration of the rail, mm/s and mm/s². V1.1."""

    velocity: f32
    acceleration: f32


# --- 2.11 PTP ---


class PTPMode(IntEnum):
    """How the four numbers of a PTP command are meant, and which way the tool takes there. 2.11.5.

    XYZ: coordinates. ANGLE: joint angles. INC: increments, of joint angles with MOVJ_INC, else of coordinates.
    MOVJ moves the joints, MOVL moves the tool along a straight line, JUMP lifts the tool, travels as MOVJ does (as MOVL
    does with JUMP_MOVL_XYZ) and lowers it.
    """

    JUMP_XYZ = 0
    MOVJ_XYZ = 1
    MOVL_XYZ = 2
    JUMP_ANGLE = 3
    MOVJ_ANGLE = 4
    MOVL_ANGLE = 5
    MOVJ_INC = 6
    MOVL_INC = 7
    MOVJ_XYZ_INC = 8
    JUMP_MOVL_XYZ = 9


@dataclass(frozen=True, slots=True)
class PTPJointParams:
    """PTP velocities and accelerations of the four joints, degrees/s and degrees/s². 2.11.1."""

    velocity: f32x4
    acceleration: f32x4


@dataclass(frozen=True, slots=True)
class PTPCoordinateParams:
    """PTP velocities and accelerations of the tool: xyz in mm/s and mm/s², r in degrees/s and degrees/s². 2.11.2."""

    xyz_velocity: f32
    r_velocity: f32
    xyz_acceleration: f32
    r_acceleration: f32


@dataclass(frozen=True, slots=True)
class PTPJumpParams:
    """How far a jump lifts, and the z (mm) that it never exceeds; to start or end above that z is an alarm. 2.11.3."""

    jump_height: f32
    z_limit: f32


@dataclass(frozen=True, slots=True)
class PTPCommonParams:
    """Percent of the PTP velocities and accelerations that are used; the arm takes more than 100 as 100. 2.11.4."""

    velocity_ratio: f32
    acceleration_ratio: f32


@dataclass(frozen=True, slots=True)
class PTPCmd:
    """Moves to a point: mm and degrees, or four joint angles, as the mode says. 2.11.5."""

    ptp_mode: Annotated[PTPMode, Scalar("B")]
    x: f32
    y: f32
    z: f32
    r: f32 = 0.0


@dataclass(frozen=True, slots=True)
class PTPLParams:
    """PTP velocity and acceleration of the rail, mm/s and mm/s². V1.1."""

    velocity: f32
    acceleration: f32


@dataclass(frozen=True, slots=True)
class PTPWithLCmd:
    """Moves to a point (as `PTPCmd`) while the rail moves to `rail`, mm. V1.1."""

    ptp_mode: Annotated[PTPMode, Scalar("B")]
    x: f32
    y: f32
    z: f32
    r: f32
    rail: f32


@dataclass(frozen=True, slots=True)
class PTPJump2Params:
    """As `PTPJumpParams`, with a lift of its own at either end, mm. V1.1."""

    start_jump_height: f32
    end_jump_height: f32
    z_limit: f32


@dataclass(frozen=True, slots=True)
class ParallelOutputCmd:
    """An output that switches on the way: after `ratio` percent of it, address 1 to 20, level 0 or 1. V1.1."""

    ratio: u8
    address: Annotated[int, Scalar("H", 1, 20)]
    level: Level


@dataclass(frozen=True, slots=True)
class PTPPOCmd:
    """As `PTPCmd`, with outputs that switch on the way. V1.1."""

    ptp_mode: Annotated[PTPMode, Scalar("B")]
    x: f32
    y: f32
    z: f32
    r: f32
    outputs: Annotated[tuple[ParallelOutputCmd, ...], Counted(Record(ParallelOutputCmd), (MAX_PARAMS - 18) // 4)]


@dataclass(frozen=True, slots=True)
class PTPPOWithLCmd:
    """As `PTPWithLCmd`, with outputs that switch on the way. V1.1."""

    ptp_mode: Annotated[PTPMode, Scalar("B")]
    x: f32
    y: f32
    z: f32
    r: f32
    rail: f32
    outputs: Annotated[tuple[ParallelOutputCmd, ...], Counted(Record(ParallelOutputCmd), (MAX_PARAMS - 22) // 4)]


# --- 2.12 CP ---


class CPMode(IntEnum):
    """Whether a point of a continuous path counts from the last one or from the base. 2.12.2."""

    RELATIVE = 0
    ABSOLUTE = 1


@dataclass(frozen=True, slots=True)
class CPParams:
    """Limits of a continuous path, mm/s and mm/s². 2.12.1.

    Attributes:
        plan_acc: The greatest planned acceleration.
        junction_vel: The greatest velocity at a junction.
        acc: The greatest real acceleration; in real time mode it is the period of interpolation instead.
        real_time_track: Real time mode.
    """

    plan_acc: f32
    junction_vel: f32
    acc: f32
    real_time_track: flag = False


@dataclass(frozen=True, slots=True)
class CPCmd:
    """The next point of a continuous path, mm; the velocity is reserved. 2.12.2."""

    cp_mode: Annotated[CPMode, Scalar("B")]
    x: f32
    y: f32
    z: f32
    velocity: f32 = 100.0


@dataclass(frozen=True, slots=True)
class CPLECmd:
    """The next point of a laser engraving, mm, and the laser's power on the way there, 0 to 100 percent. 2.12.3."""

    cp_mode: Annotated[CPMode, Scalar("B")]
    x: f32
    y: f32
    z: f32
    power: Annotated[float, Scalar("f", 0, 100)]


@dataclass(frozen=True, slots=True)
class CPCommonParams:
    """Percent of the CP velocity and acceleration that are used. V1.1."""

    velocity_ratio: f32
    acceleration_ratio: f32


# --- 2.13 ARC ---


@dataclass(frozen=True, slots=True)
class ARCParams:
    """Velocities and accelerations of an arc: xyz in mm/s and mm/s², r in degrees/s and degrees/s². 2.13.1."""

    xyz_velocity: f32
    r_velocity: f32
    xyz_acceleration: f32
    r_acceleration: f32


@dataclass(frozen=True, slots=True)
class ARCPoint:
    """A point of an arc, mm and degrees. 2.13.2."""

    x: f32
    y: f32
    z: f32
    r: f32 = 0.0


@dataclass(frozen=True, slots=True)
class ARCCmd:
    """An arc from where the arm is, through `cir_point`, to `to_point`. 2.13.2."""

    cir_point: ARCPoint
    to_point: ARCPoint


@dataclass(frozen=True, slots=True)
class CircleCmd:
    """`count` full circles from where the arm is, through both points. V1.1."""

    cir_point: ARCPoint
    to_point: ARCPoint
    count: u32 = 1


@dataclass(frozen=True, slots=True)
class ARCCommonParams:
    """Percent of the ARC velocities and accelerations that are used. V1.1."""

    velocity_ratio: f32
    acceleration_ratio: f32


# --- 2.14 WAIT, 2.15 TRIG ---


@dataclass(frozen=True, slots=True)
class WAITCmd:
    """Holds the queue for `timeout` milliseconds. 2.14.1."""

    timeout: u32


class TriggerMode(IntEnum):
    """What a trigger looks at: a digital or an analog input. 2.15.1."""

    IO = 0
    ADC = 1


class TriggerIOCondition(IntEnum):
    """How a digital input is compared with the threshold. 2.15.1."""

    EQUAL = 0
    NOT_EQUAL = 1


class TriggerADCCondition(IntEnum):
    """How an analog input is compared with the threshold. 2.15.1."""

    LESS = 0
    LESS_OR_EQUAL = 1
    GREATER_OR_EQUAL = 2
    GREATER = 3


@dataclass(frozen=True, slots=True)
class TRIGCmd:
    """Holds the queue until an input meets a condition, for ever if it never does. 2.15.1.

    Attributes:
        address: The input, 1 to 20.
        mode: Whether it is read as a level or as an analog value.
        condition: A `TriggerIOCondition` or a `TriggerADCCondition`, as the mode says.
        threshold: The level, 0 or 1, or the analog value, 0 to 4095.
    """

    address: IOAddress
    mode: Annotated[TriggerMode, Scalar("B")]
    condition: Annotated[int, Scalar("B", 0, 3)]
    threshold: u16


# --- 2.16 EIO ---


class IOFunction(IntEnum):
    """What a pin of the extended IO is for. 2.16.1.

    DIPU and DIPD are inputs with a resistor to high and to low (V1.1.5).
    """

    DUMMY = 0
    DO = 1
    PWM = 2
    DI = 3
    ADC = 4
    DIPU = 5
    DIPD = 6


@dataclass(frozen=True, slots=True)
class IOMultiplexing:
    """Gives a pin (1 to 20) its function. 2.16.1."""

    address: IOAddress
    multiplex: Annotated[IOFunction, Scalar("B")]


@dataclass(frozen=True, slots=True)
class IODO:
    """The level of an output: 0 low, 1 high. 2.16.2."""

    address: IOAddress
    level: Level


@dataclass(frozen=True, slots=True)
class IOPWM:
    """The PWM of an output: 10 Hz to 1 MHz, duty cycle 0 to 100 percent. 2.16.3."""

    address: IOAddress
    frequency: Annotated[float, Scalar("f", 10, 1_000_000)]
    duty_cycle: Annotated[float, Scalar("f", 0, 100)]


@dataclass(frozen=True, slots=True)
class IODI:
    """The level at an input: 0 low, 1 high. 2.16.4."""

    address: IOAddress
    level: Level


@dataclass(frozen=True, slots=True)
class IOADC:
    """The value at an analog input, 0 to 4095. 2.16.5."""

    address: IOAddress
    value: Annotated[int, Scalar("H", 0, 4095)]


@dataclass(frozen=True, slots=True)
class EMotor:
    """Runs stepper 0 or 1 at a speed in pulses/s, whose sign is the direction, until told otherwise. 2.16.6.

    10000 pulses/s move the vendor's conveyor at about 62 mm/s.
    """

    index: Annotated[int, Scalar("B", 0, 1)]
    is_enabled: flag
    speed: i32


@dataclass(frozen=True, slots=True)
class EMotorS:
    """Runs stepper 0 or 1 at a speed in pulses/s for a distance in pulses. V1.1."""

    index: Annotated[int, Scalar("B", 0, 1)]
    is_enabled: flag
    speed: i32
    distance: u32


class ColorPort(IntEnum):
    """The socket of a colour sensor. V1.1."""

    GP1 = 0
    GP2 = 1
    GP4 = 2
    GP5 = 3


class InfraredPort(IntEnum):
    """The socket of an infrared sensor. V1.1."""

    GP1 = 0
    GP2 = 1
    GP4 = 2
    GP5 = 3


@dataclass(frozen=True, slots=True)
class ColorSensor:
    """Switches the colour sensor at a port on or off. V1.1."""

    enable: flag
    port: Annotated[ColorPort, Scalar("B")]
    version: Annotated[AccessoryVersion, Scalar("B")] = AccessoryVersion.V1


@dataclass(frozen=True, slots=True)
class Color:
    """What the colour sensor sees, 0 to 255 each. V1.1."""

    r: u8
    g: u8
    b: u8


@dataclass(frozen=True, slots=True)
class InfraredSensor:
    """Switches the infrared sensor at a port on or off. V1.1."""

    enable: flag
    port: Annotated[InfraredPort, Scalar("B")]
    version: Annotated[AccessoryVersion, Scalar("B")] = AccessoryVersion.V1


# --- 2.17 Calibration ---


@dataclass(frozen=True, slots=True)
class AngleSensorStaticError:
    """What the angle sensors of the two arms show too much, degrees. 2.17.1."""

    rear_arm_angle_error: f32
    front_arm_angle_error: f32


@dataclass(frozen=True, slots=True)
class AngleSensorCoef:
    """The scale of the angle sensors of the two arms. V1.1."""

    rear_arm_angle_coef: f32
    front_arm_angle_coef: f32


# --- 2.18 Wi-Fi ---


@dataclass(frozen=True, slots=True)
class WIFIIPAddress:
    """The arm's IPv4 address, as in (192, 168, 1, 20), or DHCP. 2.18.4."""

    dhcp: flag
    addr: u8x4 = (0, 0, 0, 0)


@dataclass(frozen=True, slots=True)
class WIFINetmask:
    """The IPv4 netmask, as in (255, 255, 255, 0). 2.18.5."""

    addr: u8x4


@dataclass(frozen=True, slots=True)
class WIFIGateway:
    """The gateway's IPv4 address. 2.18.6."""

    addr: u8x4


@dataclass(frozen=True, slots=True)
class WIFIDNS:
    """The name server's IPv4 address. 2.18.7."""

    addr: u8x4


# --- 2.19 Queue, and the later chapters ---


@dataclass(frozen=True, slots=True)
class QueuedCmdStartDownload:
    """Stores what is queued next in the arm's flash, to be run from its key: loops, and lines in each. 2.19.4."""

    total_loop: u32
    line_per_loop: u32


class UART4PeripheralsType(IntEnum):
    """What is plugged into the arm's one serial socket. V1.1."""

    UART = 0
    WIFI = 1
    BLE = 2
    CH375 = 3


@dataclass(frozen=True, slots=True)
class UserParams:
    """Eight numbers that the firmware keeps for its user. V1.1."""

    params: f32x8
