"""What other places need of the myCobot family, and where it is; imports none of it."""

from __future__ import annotations

from dobot_async.arms.registry import Family

__all__ = ["FAMILY"]

FAMILY = Family(
    models=("myarm300", "mycobot280", "mycobot280pi", "mycobot320", "mecharm270", "mypalletizer260"),
    public={
        "dobot_async.arms.mycobot.alarms": ("CobotAlarm",),
        "dobot_async.arms.mycobot.arm": ("MyCobot",),
        "dobot_async.arms.mycobot.models": ("CobotModel",),
        "dobot_async.arms.mycobot.params": (
            "Coords",
            "EndType",
            "GripperType",
            "MoveMode",
            "PinMode",
            "ReferenceFrame",
        ),
        "dobot_async.arms.mycobot.pose": ("CobotPose",),
        "dobot_async.arms.mycobot.readings": ("CobotInfo",),
    },
    simulator="dobot_async.simulator.mycobot.arm:SIMULATED",
    scene="dobot_async.simulator.scene.arms.mycobot:MyCobotInScene",
    bridge="dobot_async.arms.mycobot.bridge_adapter:BRIDGED",
    discovery="dobot_async.discovery.families:MYCOBOT",
    cli="dobot_async.cli.arms.mycobot:COBOTS",
    fleet="dobot_async.fleet.families:MYCOBOT",
    program="dobot_async.arms.mycobot.vocabulary:VOCABULARIES",
)
