"""Asyncio driver for desktop robot arms.

async with Magician.connect("serial:///dev/ttyUSB0") as arm:
    await arm.home()
    await arm.move_to(220, 0, 40)
"""

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
)
from dobot_async.link import Link, LinkState, LinkStats, Unexpected
from dobot_async.magician.alarms import Alarm
from dobot_async.magician.arm import DeviceInfo, Jog, Magician
from dobot_async.magician.effectors import Gripper, Laser, Pen, SuctionCup
from dobot_async.magician.kinematics import JointLimits, Kinematics, Unreachable
from dobot_async.magician.params import (
    ColorPort,
    EndEffectorParams,
    HHTTrigMode,
    InfraredPort,
    IOFunction,
    Pose,
    PTPMode,
    TriggerADCCondition,
)
from dobot_async.motion import Motion
from dobot_async.transports import open_transport
from dobot_async.wire import Command

__all__ = [
    "Alarm",
    "ArmAlarm",
    "ColorPort",
    "Command",
    "CommandRejected",
    "ConnectFailed",
    "ConnectionLost",
    "DeviceInfo",
    "DobotError",
    "EndEffectorParams",
    "Gripper",
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
    "PTPMode",
    "Pen",
    "Pose",
    "ProtocolError",
    "ReplyTimeout",
    "SuctionCup",
    "TriggerADCCondition",
    "Unexpected",
    "Unreachable",
    "open_transport",
]
