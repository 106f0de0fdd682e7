"""What other places need of the myCobot family, and where it is; imports none of it."""

from __future__ import annotations

from dobot_async.families import Family

__all__ = ["FAMILY"]

FAMILY = Family(
    models=("myarm300", "mycobot280", "mycobot280pi", "mycobot320", "mecharm270", "mypalletizer260"),
    public={
        "dobot_async.mycobot.alarms": ("CobotAlarm",),
        "dobot_async.mycobot.arm": ("MyCobot",),
        "dobot_async.mycobot.models": ("CobotModel",),
        "dobot_async.mycobot.params": ("Coords", "EndType", "GripperType", "MoveMode", "PinMode", "ReferenceFrame"),
        "dobot_async.mycobot.pose": ("CobotPose",),
        "dobot_async.mycobot.readings": ("CobotInfo",),
    },
    simulator="dobot_async.simulator.mycobot:SIMULATED",
    scene="dobot_async.simulator.scene.mycobot:MyCobotInScene",
    bridge="dobot_async.mycobot.bridged:BRIDGED",
    discovery="dobot_async.discovery.families:MYCOBOT",
    cli="dobot_async.cli.arms.mycobot:COBOTS",
    fleet="dobot_async.fleet.families:MYCOBOT",
    program="dobot_async.mycobot.vocabulary:VOCABULARIES",
)
