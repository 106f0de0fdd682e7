"""The simulated Dobot Magician."""

from dobot_async.simulator.magician.arm import Quirks, SimulatedMagician

__all__ = ["Quirks", "SimulatedMagician"]
