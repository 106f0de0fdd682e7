"""What other places need of the ultraArm, and where it is; imports none of it."""

from __future__ import annotations

from dobot_async.families import Family

__all__ = ["FAMILY"]

FAMILY = Family(
    public={
        "dobot_async.ultraarm.arm": ("UltraArm", "UltraArmJog"),
        "dobot_async.ultraarm.params": ("UltraArmAngles", "UltraArmCoords", "UltraArmLimits", "UltraArmPose"),
    },
    simulator="dobot_async.simulator.ultraarm:SimulatedUltraArm",
    scene="dobot_async.simulator.scene.ultraarm:UltraArmInScene",
    bridge="dobot_async.ultraarm.bridged:BRIDGED",
    discovery="dobot_async.discovery.families:ULTRAARM",
    cli="dobot_async.cli.arms.ultraarm:ULTRAARM",
    fleet="dobot_async.fleet.families:ULTRAARM",
    program="dobot_async.ultraarm.vocabulary:VOCABULARY",
)
