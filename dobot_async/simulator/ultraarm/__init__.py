"""The simulated ultraArm P340."""

from dobot_async.simulator.ultraarm.arm import SimulatedUltraArm, UltraArmQuirks

__all__ = ["SimulatedUltraArm", "UltraArmQuirks"]
