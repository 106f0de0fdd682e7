"""The simulated arms of the myCobot family."""

from dobot_async.simulator.mycobot.arm import MyCobotQuirks, SimulatedMyCobot

__all__ = ["MyCobotQuirks", "SimulatedMyCobot"]
