"""Asyncio driver for desktop robot arms.

async with Magician.connect("serial:///dev/ttyUSB0") as arm:
    await arm.home()
    await arm.move_to(220, 0, 40)
"""

from importlib import import_module
from typing import Any

HOMES = {
    "contract": ("LinkState", "LinkStats", "Unexpected"),
    "discovery": ("DiscoveryProblem", "Found", "discover"),
    "errors": (
        "ArmAlarm",
        "CommandRejected",
        "ConnectFailed",
        "ConnectionLost",
        "DobotError",
        "MotionStopped",
        "MotionUnknown",
        "ProtocolError",
        "ReplyTimeout",
    ),
    "fleet.fleet": ("Fleet",),
    "link": ("Link",),
    "magician.alarms": ("Alarm",),
    "magician.arm": ("DeviceInfo", "Jog", "Magician"),
    "magician.effectors": ("Gripper", "Laser", "Pen", "SuctionCup"),
    "magician.kinematics": ("JointLimits", "Kinematics", "Unreachable"),
    "magician.params": (
        "ColorPort",
        "EndEffectorParams",
        "HHTTrigMode",
        "InfraredPort",
        "IOFunction",
        "Pose",
        "PTPMode",
        "TriggerADCCondition",
    ),
    "motion": ("Motion",),
    "mycobot.alarms": ("CobotAlarm",),
    "mycobot.arm": ("MyCobot",),
    "mycobot.models": ("CobotModel",),
    "mycobot.params": ("Coords", "EndType", "GripperType", "MoveMode", "PinMode", "ReferenceFrame"),
    "mycobot.readings": ("CobotInfo", "CobotPose"),
    "transports": ("open_transport",),
    "ultraarm.arm": ("UltraArm", "UltraArmJog"),
    "ultraarm.params": ("UltraArmAngles", "UltraArmCoords", "UltraArmLimits"),
    "wire": ("Command",),
}
"""Where each public name is at home; it is imported when it is first asked for, so that nobody pays for the rest."""

HOME = {name: module for module, names in HOMES.items() for name in names}
__all__ = sorted(HOME)  # noqa: PLE0605 - `__init__.pyi` has it for tools


def __getattr__(name: str) -> Any:
    if name not in HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

    value = globals()[name] = getattr(import_module(f"{__name__}.{HOME[name]}"), name)
    return value


def __dir__() -> list[str]:
    return [*globals(), *__all__]
