"""What other places need of the Magician, and where it is; imports none of it."""

from __future__ import annotations

from dobot_async.families import Family

__all__ = ["FAMILY"]

FAMILY = Family(
    public={
        "dobot_async.magician.alarms": ("Alarm",),
        "dobot_async.magician.arm": ("Magician",),
        "dobot_async.magician.effectors": ("Gripper", "Laser", "Pen", "SuctionCup"),
        "dobot_async.magician.jogs": ("Jog",),
        "dobot_async.magician.kinematics": ("JointLimits", "Kinematics", "Unreachable"),
        "dobot_async.magician.params": (
            "AccessoryVersion",
            "Color",
            "ColorPort",
            "EndEffectorParams",
            "HHTTrigMode",
            "InfraredPort",
            "IOFunction",
            "Pose",
            "PTPMode",
            "TriggerADCCondition",
        ),
    },
    simulator="dobot_async.simulator.magician:SimulatedMagician",
    scene="dobot_async.simulator.scene.magician:MagicianInScene",
    bridge="dobot_async.magician.bridged:BRIDGED",
    discovery="dobot_async.discovery.families:MAGICIAN",
    cli="dobot_async.cli.arms.magician:MAGICIAN",
    fleet="dobot_async.fleet.families:MAGICIAN",
    program="dobot_async.magician.vocabulary:VOCABULARY",
)
