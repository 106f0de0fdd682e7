"""What other places need of the ultraArm, and where it is; imports none of it."""

from __future__ import annotations

from dobot_async.arms.registry import Family

__all__ = ["FAMILY"]

FAMILY = Family(
    public={
        "dobot_async.arms.ultraarm.arm": ("UltraArm", "UltraArmJog"),
        "dobot_async.arms.ultraarm.limits": ("UltraArmLimits",),
        "dobot_async.arms.ultraarm.params": ("UltraArmAngles", "UltraArmCoords", "UltraArmPose"),
    },
    simulator="dobot_async.simulator.ultraarm.arm:SimulatedUltraArm",
    scene="dobot_async.simulator.scene.arms.ultraarm:UltraArmInScene",
    bridge="dobot_async.arms.ultraarm.bridge_adapter:BRIDGED",
    discovery="dobot_async.discovery.families:ULTRAARM",
    cli="dobot_async.cli.arms.ultraarm:ULTRAARM",
    fleet="dobot_async.fleet.families:ULTRAARM",
    program="dobot_async.arms.ultraarm.vocabulary:VOCABULARY",
)
