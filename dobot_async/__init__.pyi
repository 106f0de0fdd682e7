# The names of __init__.py, for type checkers.

from dobot_async._core.link.link import Link
from dobot_async._core.protocol.contract import LinkState, LinkStats, Unexpected
from dobot_async._core.protocol.wire import Command
from dobot_async._core.queue.motion import Motion
from dobot_async._core.util.shapes import Box, Cylinder
from dobot_async._core.util.workspace import OutsideWorkspace, Workspace
from dobot_async.arms.base import Arm
from dobot_async.arms.info import DeviceInfo
from dobot_async.arms.magician.alarms import Alarm
from dobot_async.arms.magician.arm import Magician
from dobot_async.arms.magician.effectors import Gripper, Laser, Pen, SuctionCup
from dobot_async.arms.magician.jogs import Jog
from dobot_async.arms.magician.kinematics import JointLimits, Kinematics, Unreachable
from dobot_async.arms.magician.params import (
    AccessoryVersion,
    Color,
    ColorPort,
    EndEffectorParams,
    HHTTrigMode,
    InfraredPort,
    IOFunction,
    Pose,
    PTPMode,
    TriggerADCCondition,
)
from dobot_async.arms.mycobot.alarms import CobotAlarm
from dobot_async.arms.mycobot.arm import MyCobot
from dobot_async.arms.mycobot.models import CobotModel
from dobot_async.arms.mycobot.params import Coords, EndType, GripperType, MoveMode, PinMode, ReferenceFrame
from dobot_async.arms.mycobot.pose import CobotPose
from dobot_async.arms.mycobot.readings import CobotInfo
from dobot_async.arms.ultraarm.arm import UltraArm, UltraArmJog
from dobot_async.arms.ultraarm.limits import UltraArmLimits
from dobot_async.arms.ultraarm.params import UltraArmAngles, UltraArmCoords, UltraArmPose
from dobot_async.discovery import DiscoveryProblem, Found, discover
from dobot_async.errors import (
    ArmAlarm,
    CommandRejected,
    ConnectFailed,
    ConnectionLost,
    DobotError,
    MotionStopped,
    MotionUnknown,
    ProtocolError,
    ReplyTimeout,
    UnsupportedError,
)
from dobot_async.fleet.fleet import Fleet
from dobot_async.transports import open_transport

__all__ = [
    "AccessoryVersion",
    "Alarm",
    "Arm",
    "ArmAlarm",
    "Box",
    "CobotAlarm",
    "CobotInfo",
    "CobotModel",
    "CobotPose",
    "Color",
    "ColorPort",
    "Command",
    "CommandRejected",
    "ConnectFailed",
    "ConnectionLost",
    "Coords",
    "Cylinder",
    "DeviceInfo",
    "DiscoveryProblem",
    "DobotError",
    "EndEffectorParams",
    "EndType",
    "Fleet",
    "Found",
    "Gripper",
    "GripperType",
    "HHTTrigMode",
    "IOFunction",
    "InfraredPort",
    "Jog",
    "JointLimits",
    "Kinematics",
    "Laser",
    "Link",
    "LinkState",
    "LinkStats",
    "Magician",
    "Motion",
    "MotionStopped",
    "MotionUnknown",
    "MoveMode",
    "MyCobot",
    "OutsideWorkspace",
    "PTPMode",
    "Pen",
    "PinMode",
    "Pose",
    "ProtocolError",
    "ReferenceFrame",
    "ReplyTimeout",
    "SuctionCup",
    "TriggerADCCondition",
    "UltraArm",
    "UltraArmAngles",
    "UltraArmCoords",
    "UltraArmJog",
    "UltraArmLimits",
    "UltraArmPose",
    "Unexpected",
    "Unreachable",
    "UnsupportedError",
    "Workspace",
    "discover",
    "open_transport",
]
