"""What other places need of the Magician, and where it is; imports none of it."""

from __future__ import annotations

from dobot_async.arms.registry import Family

__all__ = ["FAMILY"]

FAMILY = Family(
    public={
        "dobot_async.arms.magician.alarms": ("Alarm",),
        "dobot_async.arms.magician.arm": ("Magician",),
        "dobot_async.arms.magician.effectors": ("Gripper", "Laser", "Pen", "SuctionCup"),
        "dobot_async.arms.magician.jogs": ("Jog",),
        "dobot_async.arms.magician.kinematics": ("JointLimits", "Kinematics", "Unreachable"),
        "dobot_async.arms.magician.params": (
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
    simulator="dobot_async.simulator.magician.arm:SimulatedMagician",
    scene="dobot_async.simulator.scene.arms.magician:MagicianInScene",
    bridge="dobot_async.arms.magician.bridge_adapter:BRIDGED",
    discovery="dobot_async.discovery.families:MAGICIAN",
    cli="dobot_async.cli.arms.magician:MAGICIAN",
    fleet="dobot_async.fleet.families:MAGICIAN",
    program="dobot_async.arms.magician.vocabulary:VOCABULARY",
    replay="dobot_async.arms.magician.trace_words:retimed",
)
