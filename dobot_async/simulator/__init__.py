"""Simulated arms that can be reached as real ones are."""

from dobot_async.simulator.endpoints import Simulation, simulate
from dobot_async.simulator.faults import Faults
from dobot_async.simulator.magician import Quirks, SimulatedMagician
from dobot_async.simulator.mycobot import MyCobotQuirks, SimulatedMyCobot
from dobot_async.simulator.ultraarm import SimulatedUltraArm, UltraArmQuirks
from dobot_async.simulator.wifi_module import announced
from dobot_async.simulator.work import DeviceOptions

__all__ = [
    "DeviceOptions",
    "Faults",
    "MyCobotQuirks",
    "Quirks",
    "SimulatedMagician",
    "SimulatedMyCobot",
    "SimulatedUltraArm",
    "Simulation",
    "UltraArmQuirks",
    "announced",
    "simulate",
]
